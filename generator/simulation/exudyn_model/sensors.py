"""Sensors of springs, loads and drives at every step, and the integrals of their power.

Exudyn's sensors are C++ and cost almost nothing.
"""

from typing import Any, assert_never

import numpy as np

from generator.contact.states import ContactSteps, ContactTrace, evaluate_contacts
from generator.coupled_motion import CoupledMotion
from generator.loads import LoadKind, TimedLoad
from generator.rotations import (
    Array,
    matrix_from_rotation_vector,
    rotation_vector_from_matrix,
)
from generator.simulation.exudyn_model.constraints import CoordinateConstraint
from generator.simulation.exudyn_model.exudyn_api import Index, exu, items
from generator.simulation.exudyn_model.model import ExudynModel
from generator.simulation.exudyn_model.springs import Connector, JointKind, SlideFrame
from generator.simulation.trace import mean_position
from springs import AxisSpring, Singularity
from springs.coordinates import LARGEST_SINE
from springs.tone.law import rotation_tone, vector_tone

_MIN_REVERSAL_SINE = 0.5
"""Sine of the middle one of three angles below which a reversal is that of a quick outer one."""

_MIN_HALF_TURN_ANGLE = 2.0
"""Angle above which a reversal of the rotation vector is a passage through 180 deg [rad]."""


class SensorLog:
    """Sensors on the springs and loads of a model, and the integrals of their power.

    `work` contains the integrals since the start [J], shape (4,): dissipation by damping, work
    against springs without an energy (the weighted law and coupled laws that are not a gradient),
    work of loads and drives, and of tone; by the trapezoidal rule over the steps. With contact they
    are followed by the losses by impact damping and friction [J], and the impulses on all segments
    with contact spheres [N s].
    """

    def __init__(self, model: ExudynModel) -> None:
        """Add the sensors to the system and assemble it again."""
        self._model = model
        self._last_powers: tuple[float, Array] | None = None
        self._last_rotations: dict[str, Array] = {}
        self._last_pole_sines: dict[str, float] = {}
        self._last_inner_axes: dict[str, Array] = {}
        contacts = model.contacts
        impulses = 0 if contacts is None else 3 * len(contacts.spheres)
        self.work: Array = np.zeros(4 if contacts is None else 6 + impulses)
        self._body_sensors = [] if contacts is None else self._add_body_sensors()
        self._contact_steps: list[ContactSteps] = []
        self._springs = [
            (joint, connector, *self._add_connector_sensors(connector))
            for joint, connectors in model.springs.items()
            for connector in connectors
        ]
        self._frame_sensors = {
            (joint, connector.axis_index): self._add_frame_sensors(connector, connector.frame)
            for joint, connector, *_ in self._springs
            if connector.frame is not None
        }
        self._nonconservative = [one for one in model.coupled if not one.law.is_conservative]
        coupled = {axis.joint for one in model.coupled for axis in one.axes}
        self._half_turn_joints = {
            joint
            for joint, connector, *_ in self._springs
            if connector.law is not None
            and connector.law.singularity is Singularity.HALF_TURN
            and (joint in coupled or any(axis.elastic for axis in connector.springs))
        }
        chains = model.placement.tree.chains
        self._pole_axes = {
            joint: chains[joint].rotation_axes
            for joint, connector, *_ in self._springs
            if connector.law is not None
            and connector.law.singularity is Singularity.POLE
            and (joint in coupled or connector.springs)
        }
        self._loads = [(load, self._add_load_sensor(load)) for load in model.loads]
        self._constraints = [
            (constraint, self._add_constraint_sensor(constraint))
            for constraint in model.coordinate_constraints
            if constraint.driven_joint
        ]
        kinds = exu.OutputVariableType
        self._righting = {
            name: (
                self._add_object_sensor(made.item, kinds.Rotation),
                self._add_object_sensor(made.item, kinds.AngularVelocityLocal),
                *(
                    model.mbs.AddSensor(
                        items.SensorBody(
                            bodyNumber=made.body, storeInternal=True, outputVariableType=kind
                        )
                    )
                    for kind in (kinds.RotationMatrix, kinds.AngularVelocity)
                ),
            )
            for name, made in model.righting.items()
        }
        model.mbs.Assemble()
        if contacts is not None:
            self._read_start()

    def _add_connector_sensors(self, connector: Connector) -> tuple[Index, Index]:
        kinds = exu.OutputVariableType
        position, rate = (
            (kinds.DisplacementLocal, kinds.VelocityLocal)
            if connector.kind is JointKind.PRISMATIC
            else (kinds.Rotation, kinds.AngularVelocityLocal)
        )
        return (
            self._add_object_sensor(connector.item, position),
            self._add_object_sensor(connector.item, rate),
        )

    def _add_frame_sensors(
        self, connector: Connector, frame: SlideFrame
    ) -> tuple[Index, Index | None]:
        """Add sensors of a joint's rotation, and of the spin of the segment with its axes."""
        kinds = exu.OutputVariableType
        rotation = self._add_object_sensor(connector.item, kinds.Rotation)
        if frame.body is None:
            return rotation, None
        spin = self._model.mbs.AddSensor(
            items.SensorBody(
                bodyNumber=frame.body,
                storeInternal=True,
                outputVariableType=kinds.AngularVelocityLocal,
            )
        )
        return rotation, spin

    def _add_object_sensor(self, item: Index, kind: Any) -> Index:
        return self._model.mbs.AddSensor(
            items.SensorObject(objectNumber=item, storeInternal=True, outputVariableType=kind)
        )

    def _tone_power(
        self, connector: Connector, times: Array, position: Array, rate: Array
    ) -> Array:
        """Power of the tones that hold a joint, shape (n,) [W]."""
        tone = self._model.tone
        assert tone is not None
        active = tone.activation.at(times)
        if connector.law is None:
            (axis,) = connector.tone
            weights = np.asarray(connector.output_weights)
            angle, speed = position @ weights, rate @ weights
            return np.asarray(axis.torque(angle, speed, active)) * speed
        torque = rotation_tone(connector.law, connector.tone, position, rate, active)
        return _power(torque, rate)

    def _righting_power(
        self, name: str, times: Array, rotation: Array, rate: Array, turns: Array, spins: Array
    ) -> Array:
        """Power of righting on both segments of a joint, shape (n,) [W]."""
        tone, figure = self._model.tone, self._model.figure
        assert tone is not None
        righting = tone.righting[name]
        site = figure.site(figure.joints[name].child).pose_in_segment[:3, :3]
        turn = turns.reshape(-1, 3, 3) @ site
        error = rotation_vector_from_matrix(righting.upright.T @ turn)
        spin = (np.swapaxes(turn, -1, -2) @ spins[..., None])[..., 0]
        torque = vector_tone(righting.axes, error, spin, tone.activation.at(times))
        half = matrix_from_rotation_vector(0.5 * rotation)
        return _power((half @ torque[..., None])[..., 0], rate)

    def _add_body_sensors(self) -> list[tuple[Index, ...]]:
        """Add sensors of the state of each body."""
        kinds = exu.OutputVariableType
        outputs = (
            kinds.Position,
            kinds.RotationMatrix,
            kinds.Velocity,
            kinds.AngularVelocity,
            kinds.Acceleration,
        )
        return [
            tuple(
                self._model.mbs.AddSensor(
                    items.SensorBody(
                        bodyNumber=self._model.bodies[name],
                        storeInternal=True,
                        outputVariableType=kind,
                    )
                )
                for kind in outputs
            )
            for name in self._model.figure.bodies
        ]

    def _read_start(self) -> None:
        """Evaluate the contact at the start."""
        values = self._model.mbs.GetSensorValues
        rows = [
            [np.atleast_2d(np.asarray(values(sensor))) for sensor in body]
            for body in self._body_sensors
        ]
        start = np.array([self._model.plan.start])
        self._contact_steps.append(self._evaluate_contact(start, rows)[0])

    def _evaluate_contact(
        self, times: Array, rows: list[list[Array]]
    ) -> tuple[ContactSteps, list[Array]]:
        """Return the contact by the bodies' sensors, and powers of impact damping and friction."""
        model = self._model
        assert model.contacts is not None
        positions, rotations, velocities, spins, accelerations = (
            np.stack([body[k] for body in rows], axis=1) for k in range(5)
        )
        rotations = rotations.reshape(*rotations.shape[:2], 3, 3)
        states = evaluate_contacts(
            model.contacts, model.figure, positions, rotations, velocities, spins
        )
        steps = ContactSteps(
            times,
            states.forces,
            states.depths,
            states.rates,
            mean_position(model.figure, positions),
            accelerations,
            states.part_forces,
        )
        return steps, [states.impact_power, states.friction_power]

    def contact_trace(self, work: Array) -> ContactTrace | None:
        """Return the contact of the steps read so far; None without props.

        Args:
            work: `work` at n frames, shape (n, k).
        """
        if self._model.contacts is None:
            return None
        return ContactTrace(
            work[:, 4:6],
            work[:, 6:].reshape(len(work), -1, 3),
            ContactSteps.join(self._contact_steps),
        )

    def _add_load_sensor(self, load: TimedLoad) -> Index:
        figure = self._model.figure
        kinds = exu.OutputVariableType
        segment = figure.segments[load.site.segment]
        centre = segment.centre_of_mass
        assert centre is not None
        point = figure.site(load.site).pose_in_segment[:3, 3] - centre
        kind = {
            LoadKind.GLOBAL_FORCE: kinds.Velocity,
            LoadKind.LOCAL_FORCE: kinds.VelocityLocal,
            LoadKind.GLOBAL_MOMENT: kinds.AngularVelocity,
            LoadKind.LOCAL_MOMENT: kinds.AngularVelocityLocal,
        }[load.kind]
        return self._model.mbs.AddSensor(
            items.SensorBody(
                bodyNumber=self._model.bodies[load.site.segment],
                localPosition=list(point),
                storeInternal=True,
                outputVariableType=kind,
            )
        )

    def _add_constraint_sensor(self, constraint: CoordinateConstraint) -> Index:
        return self._model.mbs.AddSensor(
            items.SensorObject(
                objectNumber=constraint.item,
                storeInternal=True,
                outputVariableType=exu.OutputVariableType.Force,
            )
        )

    def read(self) -> tuple[str, float] | None:
        """Read the steps of the last call of the integrator.

        Returns:
            The first joint whose springs depend on its rotation vector and that crossed 180 deg in
            that time, and when [s]; None if none did.
        """
        times: Array | None = None
        powers: list[list[Array]] = [[], [], [], []]
        half_turns: list[tuple[str, float]] = []
        rotations: dict[str, Array] = {}
        rates: dict[str, Array] = {}
        for joint, connector, position_sensor, rate_sensor in self._springs:
            position, rate = self._stored_rows(position_sensor), self._stored_rows(rate_sensor)
            times, position, rate = rate[:, 0], position[:, 1:], rate[:, 1:]
            if connector.frame is not None:
                rotation_sensor, spin_sensor = self._frame_sensors[joint, connector.axis_index]
                turn = self._stored_rows(rotation_sensor)[:, 1:]
                spin = np.zeros_like(turn)
                if spin_sensor is not None:
                    spin = self._stored_rows(spin_sensor)[:, 1:]
                position, rate = connector.frame.motion(position, turn, rate, spin)
            if connector.springs:
                damped, sprung = _spring_powers(connector, position, rate)
                powers[0].append(damped)
                powers[1].append(sprung)
            if connector.tone:
                powers[3].append(self._tone_power(connector, times, position, rate))
            match connector.kind:
                case JointKind.REVOLUTE:
                    rotations[joint], rates[joint] = position[:, 0], rate[:, 0]
                case JointKind.SPHERICAL:
                    rotations[joint], rates[joint] = position, rate
                    if joint in self._half_turn_joints:
                        half_turns.extend(self._half_turn_crossings(joint, times, position))
                    if joint in self._pole_axes:
                        half_turns.extend(self._pole_crossings(joint, times, position))
                case JointKind.PRISMATIC:
                    pass
                case _:
                    assert_never(connector.kind)
        moved = CoupledMotion(self._model.placement.tree.chains, self._model.spring_set, rotations)
        for spring in self._nonconservative:
            torques = moved.torques(spring)
            powers[1].extend(-_power(torque, rates[joint]) for joint, torque in torques.items())
        for load, sensor in self._loads:
            rate = self._stored_rows(sensor)
            times = rate[:, 0]
            powers[2].append(np.sum(load.components(times) * rate[:, 1:], axis=1))
        for constraint, sensor in self._constraints:
            pulls = self._stored_rows(sensor)
            times = pulls[:, 0]
            powers[2].append(-_power(pulls[:, 1:], constraint.rates(times)))
        for name, sensors in self._righting.items():
            rows = [self._stored_rows(sensor) for sensor in sensors]
            times = rows[0][:, 0]
            powers[3].append(self._righting_power(name, times, *(row[:, 1:] for row in rows)))
        contact: list[Array] = []
        if self._body_sensors:
            rows = [[self._stored_rows(sensor) for sensor in body] for body in self._body_sensors]
            times = rows[0][0][:, 0]
            steps, losses = self._evaluate_contact(
                times, [[r[:, 1:] for r in body] for body in rows]
            )
            self._contact_steps.append(steps)
            contact = [*losses, *steps.forces.reshape(times.size, -1).T]
        if times is not None:
            summed = np.array([*(_sum_powers(power, times.size) for power in powers), *contact])
            self._integrate_power(times, summed)
        return min(half_turns, key=lambda crossing: crossing[1], default=None)

    def _stored_rows(self, sensor: Index) -> Array:
        """Rows of (time, values) since the last reading."""
        return np.atleast_2d(np.asarray(self._model.mbs.GetSensorStoredData(sensor)))

    def _integrate_power(self, times: Array, powers: Array) -> None:
        if self._last_powers is not None:
            times = np.concatenate([[self._last_powers[0]], times])
            powers = np.column_stack([self._last_powers[1], powers])
        strips = 0.5 * (powers[:, 1:] + powers[:, :-1]) * np.diff(times)
        self.work = self.work + np.sum(strips, axis=1)
        self._last_powers = (float(times[-1]), powers[:, -1])

    def _half_turn_crossings(
        self, joint: str, times: Array, rotations: Array
    ) -> list[tuple[str, float]]:
        """Find the first reversal of a rotation vector."""
        last = self._last_rotations.get(joint)
        track = rotations if last is None else np.vstack([last, rotations])
        self._last_rotations[joint] = rotations[-1]
        is_reversed = np.sum(track[1:] * track[:-1], axis=1) < 0.0
        # Near 180 deg Exudyn's vectors are short by rounding, so one of two neighbours counts.
        sizes = np.linalg.norm(track, axis=1)
        is_large = np.maximum(sizes[1:], sizes[:-1]) > _MIN_HALF_TURN_ANGLE
        hits = np.nonzero(is_reversed & is_large)[0]
        return [(joint, float(times[k + 1 + times.size - len(track)])) for k in hits[:1]]

    def _pole_crossings(
        self, joint: str, times: Array, rotations: Array
    ) -> list[tuple[str, float]]:
        """Find the first step within a degree of a joint's pole, or past it.

        Past it, the inner axis is on the other side of the outer one.
        """
        inner, *_, outer = (np.asarray(axis) for axis in self._pole_axes[joint])
        moved = matrix_from_rotation_vector(rotations) @ inner
        last = self._last_inner_axes.get(joint)
        self._last_inner_axes[joint] = moved[-1]
        along = np.abs(moved @ outer)
        across = np.cross(outer, np.vstack([moved[0] if last is None else last, moved]))
        is_past = (np.sum(across[1:] * across[:-1], axis=1) < 0.0) & (along > _MIN_REVERSAL_SINE)
        self._last_pole_sines[joint] = float(along[-1])
        hits = np.nonzero((along > LARGEST_SINE) | is_past)[0]
        return [(joint, float(times[k])) for k in hits[:1]]

    def nearest_pole(self) -> tuple[str, float] | None:
        """Return the joint nearest to its pole, and the sine of its middle angle, in size."""
        return max(self._last_pole_sines.items(), key=lambda item: item[1], default=None)

    def is_at_pole(self, joint: str) -> bool:
        """Return whether a joint's law ends at a pole, not at a half turn."""
        return joint in self._pole_axes

    def nearest_half_turn(self) -> tuple[str, float] | None:
        """Return the spherical joint with springs nearest to 180 deg, and its angle [rad]."""
        angles = {name: float(np.linalg.norm(r)) for name, r in self._last_rotations.items()}
        return max(angles.items(), key=lambda item: item[1]) if angles else None


def _sensor_axis(connector: Connector, spring: AxisSpring) -> Array:
    """Weights of a sensor's output in the displacement along a spring."""
    return np.asarray(
        spring.direction if connector.kind is JointKind.SPHERICAL else connector.output_weights
    )


def _sum_powers(powers: list[Array], count: int) -> Array:
    return np.sum(powers, axis=0) if powers else np.zeros(count)


def _spring_powers(connector: Connector, position: Array, rate: Array) -> tuple[Array, Array]:
    """Power dissipated by damping and power into a weighted law, shape (n,) each [W].

    The energy of other springs is a function of their displacement and needs no integral.
    """
    none = np.zeros(len(rate))
    law = connector.law
    if law is not None:
        damping = law.damping(position, rate)
        if law.is_conservative:
            return -_power(damping, rate), none
        return -_power(damping, rate), -_power(law.torque(position), rate)
    spring = connector.springs[0]
    axis = _sensor_axis(connector, spring)
    speed = rate @ axis
    return -_power(np.asarray(spring.resistance(position @ axis, speed)), speed), none


def _power(torque: Array, rate: Array) -> Array:
    """Power of torques at rates, about one axis (n,) or three (n, 3); shape (n,) [W]."""
    return torque * rate if torque.ndim == 1 else np.sum(torque * rate, axis=1)
