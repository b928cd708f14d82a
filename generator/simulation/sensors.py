"""What is read at every step: rates of springs and loads, pulls of drives, for the work they do.

Sensors are C++ and cost next to nothing; they are emptied now and then, so that a long run does not
keep every step in memory.
"""

from dataclasses import dataclass
from typing import assert_never

import numpy as np

from generator.loads import LoadKind, TimedLoad
from generator.rotations import Array
from generator.simulation.constraints import CoordinateConstraint
from generator.simulation.coupled_springs import coupled_torques
from generator.simulation.exudyn_api import Index, exu, items
from generator.simulation.model import ExudynModel
from generator.simulation.springs import Connector, JointKind
from generator.simulation.step_schedule import BreakpointCrossing, StepHints
from springs import AxisSpring, Joining, damping_torque, elastic_torque

_MIN_HALF_TURN_ANGLE = 2.0
"""Angle above which a rotation vector that changes sides has been through 180 deg [rad]."""


@dataclass(frozen=True)
class HalfTurnCrossing:
    """A joint of several turns with springs went through 180 deg."""

    joint: str
    time: float


class SensorLog:
    """Sensors on the springs and loads of an assembly, and the integrals of their powers.

    `work` holds the integrals since the start [J] at the frames that were read, each of shape (3,):
    dissipated by damping, put into springs that have no energy (the weighted law's and coupled laws
    that are no gradient), done by loads and drives; by the trapezoidal rule over the steps.
    `crossings` holds when springs passed corners of their laws, `tracked_displacements` where the springs that have
    corners were at the frames [rad or m].
    """

    def __init__(self, assembly: ExudynModel) -> None:
        """Hang the sensors on the system and assemble it anew."""
        self._assembly = assembly
        self._last: tuple[float, Array] | None = None
        self._last_rotations: dict[str, Array] = {}
        self.work: list[Array] = [np.zeros(3)]
        self.crossings: list[BreakpointCrossing] = []
        self._springs = [
            (joint, connector, *self._add_connector_sensors(connector))
            for joint, connectors in assembly.springs.items()
            for connector in connectors
        ]
        self._working = [one.spring for one in assembly.coupled if not one.is_conservative]
        coupled = {axis.joint for one in assembly.coupled for axis in one.spring.axes}
        self._flipping = {
            joint
            for joint, connector, *_ in self._springs
            if connector.kind is JointKind.SPHERICAL
            and (joint in coupled or any(axis.elastic for axis in connector.springs))
        }
        self._loads = [(load, self._add_load_sensor(load)) for load, *_ in assembly.loads]
        self._servos = [
            (servo, self._add_constraint_sensor(servo))
            for servo in assembly.coordinate_constraints
            if servo.driven_joint
        ]
        self._tracked = {
            f"{joint} {connector.kind.value} {number}": (connector, spring, position_sensor)
            for joint, connector, position_sensor, _ in self._springs
            for number, spring in enumerate(connector.springs)
            if any(law.breakpoints for law in spring.elastic)
        }
        assembly.mbs.Assemble()
        self.tracked_displacements = {
            name: [self.current_displacement(name)] for name in self._tracked
        }

    @property
    def step_hints(self) -> StepHints:
        """What the pass tells the next one."""
        return StepHints(
            sorted(self.crossings, key=lambda passage: passage.time), self.tracked_displacements
        )

    def current_displacement(self, label: str) -> float:
        """The present displacement of a spring [rad or m]."""
        connector, spring, sensor = self._tracked[label]
        value = np.atleast_1d(np.asarray(self._assembly.mbs.GetSensorValues(sensor)))
        return float(value @ _sensor_axis(connector, spring))

    def _add_connector_sensors(self, connector: Connector) -> tuple[Index, Index]:
        kinds = exu.OutputVariableType
        position, rate = (
            (kinds.DisplacementLocal, kinds.VelocityLocal)
            if connector.kind is JointKind.PRISMATIC
            else (kinds.Rotation, kinds.AngularVelocityLocal)
        )
        first, second = (
            self._assembly.mbs.AddSensor(
                items.SensorObject(
                    objectNumber=connector.item, storeInternal=True, outputVariableType=kind
                )
            )
            for kind in (position, rate)
        )
        return first, second

    def _add_load_sensor(self, load: TimedLoad) -> Index:
        figure = self._assembly.figure
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
        return self._assembly.mbs.AddSensor(
            items.SensorBody(
                bodyNumber=self._assembly.bodies[load.site.segment],
                localPosition=list(point),
                storeInternal=True,
                outputVariableType=kind,
            )
        )

    def _add_constraint_sensor(self, servo: CoordinateConstraint) -> Index:
        return self._assembly.mbs.AddSensor(
            items.SensorObject(
                objectNumber=servo.item,
                storeInternal=True,
                outputVariableType=exu.OutputVariableType.Force,
            )
        )

    def read(self, frames: Array) -> HalfTurnCrossing | None:
        """Take in the steps since the last reading.

        Args:
            frames: times of the frames since the last reading [s], shape (n,).

        Returns:
            The first joint that went through 180 deg in that time, if one did.
        """
        times: Array | None = None
        powers: list[list[Array]] = [[], [], []]
        flips: list[HalfTurnCrossing] = []
        turns: dict[str, Array] = {}
        rates: dict[str, Array] = {}
        for joint, connector, position_sensor, rate_sensor in self._springs:
            position, rate = self._stored_rows(position_sensor), self._stored_rows(rate_sensor)
            times, position, rate = rate[:, 0], position[:, 1:], rate[:, 1:]
            if connector.springs:
                damped, sprung = _spring_powers(self._assembly, connector, position, rate)
                powers[0].append(damped)
                powers[1].append(sprung)
            match connector.kind:
                case JointKind.REVOLUTE:
                    turns[joint], rates[joint] = position[:, 0], rate[:, 0]
                case JointKind.SPHERICAL:
                    turns[joint], rates[joint] = position, rate
                    if joint in self._flipping:
                        flips.extend(self._half_turn_crossings(joint, times, position))
                case JointKind.PRISMATIC:
                    pass
                case _:
                    assert_never(connector.kind)
        for spring in self._working:
            torques = coupled_torques(spring, self._assembly.placement.tree.chains, turns)
            powers[1].extend(-_power(torque, rates[joint]) for joint, torque in torques.items())
        for track, (connector, spring, sensor) in self._tracked.items():
            rows = self._stored_rows(sensor)
            values = rows[:, 1:] @ _sensor_axis(connector, spring)
            self.crossings.extend(_breakpoint_crossings(track, spring, rows[:, 0], values))
            self.tracked_displacements[track].extend(np.interp(frames, rows[:, 0], values).tolist())
        for load, sensor in self._loads:
            rate = self._stored_rows(sensor)
            times = rate[:, 0]
            powers[2].append(np.sum(load.components(times) * rate[:, 1:], axis=1))
        for servo, sensor in self._servos:
            pulls = self._stored_rows(sensor)
            times = pulls[:, 0]
            powers[2].append(-_power(pulls[:, 1:], servo.rates(times)))
        if times is None:
            self.work.extend(np.zeros(3) for _ in frames)
        else:
            summed = np.array([_sum_powers(power, times.size) for power in powers])
            self._integrate_power(times, summed, frames)
        return min(flips, key=lambda flip: flip.time, default=None)

    def _stored_rows(self, sensor: Index) -> Array:
        """Rows (time, values) since the last reading."""
        return np.atleast_2d(np.asarray(self._assembly.mbs.GetSensorStoredData(sensor)))

    def _integrate_power(self, times: Array, powers: Array, frames: Array) -> None:
        if self._last is not None:
            times = np.concatenate([[self._last[0]], times])
            powers = np.column_stack([self._last[1], powers])
        strips = 0.5 * (powers[:, 1:] + powers[:, :-1]) * np.diff(times)
        sums = np.column_stack([np.zeros(3), np.cumsum(strips, axis=1)])
        slack = 1e-3 * (float(times[-1]) - float(times[0])) / times.size
        places: list[int] = np.searchsorted(times, frames - slack).tolist()
        start = self.work[-1]
        self.work.extend(start + sums[:, place] for place in places)
        self._last = (float(times[-1]), powers[:, -1])

    def _half_turn_crossings(
        self, joint: str, times: Array, rotations: Array
    ) -> list[HalfTurnCrossing]:
        """Where a rotation vector jumps to the other side."""
        last = self._last_rotations.get(joint)
        track = rotations if last is None else np.vstack([last, rotations])
        self._last_rotations[joint] = rotations[-1]
        turned = np.sum(track[1:] * track[:-1], axis=1) < 0.0
        far = np.linalg.norm(track[1:], axis=1) > _MIN_HALF_TURN_ANGLE
        hits = np.nonzero(turned & far)[0]
        return (
            [HalfTurnCrossing(joint, float(times[hits[0] + times.size - len(track)]))]
            if hits.size
            else []
        )

    def nearest_half_turn(self) -> tuple[str, float] | None:
        """The sprung spherical joint that was last nearest to 180 deg, and its angle [rad]."""
        angles = {name: float(np.linalg.norm(r)) for name, r in self._last_rotations.items()}
        return max(angles.items(), key=lambda item: item[1]) if angles else None


def _breakpoint_crossings(
    label: str, spring: AxisSpring, times: Array, values: Array
) -> list[BreakpointCrossing]:
    """When a spring passed corners of its laws, linear between steps."""
    found: list[BreakpointCrossing] = []
    for corner in {corner for law in spring.elastic for corner in law.breakpoints}:
        off = values - corner
        for k in np.nonzero(off[1:] * off[:-1] < 0.0)[0]:
            speed = float((off[k + 1] - off[k]) / (times[k + 1] - times[k]))
            found.append(BreakpointCrossing(label, float(times[k] - off[k] / speed), speed))
    return found


def _sensor_axis(connector: Connector, spring: AxisSpring) -> Array:
    """What turns a sensor's reading into the displacement along a spring."""
    return np.asarray(
        spring.direction if connector.kind is JointKind.SPHERICAL else connector.output_weights
    )


def _sum_powers(powers: list[Array], count: int) -> Array:
    return np.sum(powers, axis=0) if powers else np.zeros(count)


def _spring_powers(
    assembly: ExudynModel, connector: Connector, position: Array, rate: Array
) -> tuple[Array, Array]:
    """Power taken by damping and power put into a spherical joint's weighted law, (n,) each [W].

    The energy of other springs is a function of their displacement and needs no integral.
    """
    still = np.zeros(len(rate))
    if connector.kind is JointKind.SPHERICAL:
        joining = assembly.spring_set.joining
        damping = damping_torque(connector.springs, position, rate)
        if joining is Joining.CONSERVATIVE:
            return -_power(damping, rate), still
        elastic = elastic_torque(joining, connector.springs, position)
        return -_power(damping, rate), -_power(elastic, rate)
    spring = connector.springs[0]
    axis = _sensor_axis(connector, spring)
    speed = rate @ axis
    return -_power(np.asarray(spring.resistance(position @ axis, speed)), speed), still


def _power(torque: Array, rate: Array) -> Array:
    """Power of torques at rates, of one axis (n,) or of three (n, 3); shape (n,) [W]."""
    return torque * rate if torque.ndim == 1 else np.sum(torque * rate, axis=1)
