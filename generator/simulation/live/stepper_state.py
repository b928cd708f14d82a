"""State of a stepper: its integration, and the motion, energies and tables that follow from it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from generator.contact.states import ContactModel, ContactStates, evaluate_contacts
from generator.coupled_motion import CoupledMotion
from generator.figure import Figure, Vector
from generator.kinematics.placement import Placement
from generator.kinematics.tree import Tree
from generator.recording import CONTACT_ENERGY_KINDS
from generator.rotations import Array, inverse_pose, pose_matrix, rotation_vector_from_matrix
from generator.simulation.compiled.frames import record_frames
from generator.simulation.compiled.layout import (
    BALL,
    COORDINATE,
    DISSIPATION,
    EXTERNAL,
    FRICTION,
    IMPACT,
    INERTIA,
    KIND,
    MASS,
    NONCONSERVATIVE,
    POINT,
    POWERS,
    RATE,
    RECORDED_COLUMNS,
    ROTATION,
    SPIN,
    IndexArray,
    Mechanism,
    Scratch,
)
from generator.simulation.compiled.mechanism import CompiledModel
from generator.simulation.compiled.refinement import start_progress
from generator.simulation.compiled.runge_kutta import TIME, Progress
from generator.simulation.compiled_run import body_rotations, centre_arms, centre_velocities
from springs import JointSprings, SphericalLaw, SpringSet, rotation_law, total_energy

FIRST_STEP = 1e-3
"""First step after a start, a change of the tables or a failure [s]."""

_PROJECTION_SWEEPS = 2
"""Number of least-squares solutions, each for the residual of those before it."""

_POLE_TOLERANCE = 1e-10
"""Singular value of the axes of rotations, relative to the largest, below which it is zero."""

Point = tuple[str, Vector]
"""A segment and a point in its frame [m]."""


@dataclass(frozen=True)
class Setting:
    """Everything that may change between two steps.

    Attributes:
        tree: tree of the figure; with a free root, of the detached one.
        springs: springs of its joints.
        locked: displacements of the locked joints [rad or m].
        gravity: gravity in world axes [m/s2].
        scales: scales of the springs and of damping.
        forces: external forces in world axes [N], by point.
        contacts: props, and contact spheres of the segments; None without props.
    """

    tree: Tree
    springs: SpringSet
    locked: Mapping[str, Array]
    gravity: Vector
    scales: tuple[float, float]
    forces: Mapping[Point, Vector]
    contacts: ContactModel | None


@dataclass(eq=False, repr=False)
class StepperState:
    """A state to which `Stepper.rewind` returns, with all that may change.

    Attributes:
        setting: figure, springs, locks, gravity and forces.
        model: their compiled equations.
        mechanism: tables of the model with gravity, scales and forces.
        progress: the integration.
        nearest: displacements of all joints when they were last computed [rad or m].
        ground_poses: poses of the segments that do not move, shape (4, 4).
    """

    setting: Setting
    model: CompiledModel
    mechanism: Mechanism
    progress: Progress
    nearest: Mapping[str, Array]
    ground_poses: Mapping[str, Array]
    _links: Array | None = field(default=None, init=False)

    @classmethod
    def start(
        cls,
        setting: Setting,
        model: CompiledModel,
        values: Array,
        time: float,
        placement: Placement,
    ) -> "StepperState":
        """Return a state from which the integration starts.

        Args:
            setting: setting of the model.
            model: the compiled equations.
            values: coordinates, rates and integrals of powers, shape (n,).
            time: [s].
            placement: placement of the figure in this state.
        """
        mechanism = build_tables(setting, model)
        return cls(
            setting,
            model,
            mechanism,
            start_progress(
                values, time, FIRST_STEP, len(mechanism.branches), model.integrals, max_events=0
            ),
            placement.displacements,
            {name: placement.poses[name] for name in setting.tree.figure.ground},
        )

    def __repr__(self) -> str:
        """The time, in a line."""
        return f"<StepperState at {self.time:.6g} s>"

    def copy(self) -> "StepperState":
        """Return a state that can be advanced beside this one, also by another thread."""
        scratch = Scratch._make(np.zeros_like(array) for array in self.model.scratch)
        return replace(
            self,
            model=replace(self.model, scratch=scratch),
            mechanism=self.mechanism._replace(branches=self.mechanism.branches.copy()),
            progress=Progress._make(array.copy() for array in self.progress),
        )

    def forget_motion(self) -> None:
        """Discard the recorded columns, which belong to a state that will be overwritten."""
        self._links = None

    @property
    def figure(self) -> Figure:
        """The figure; with a free root, the detached one."""
        return self.setting.tree.figure

    @property
    def time(self) -> float:
        """Time [s]."""
        return float(self.progress.clock[TIME])

    @property
    def bodies(self) -> IndexArray:
        """Links of the moving segments, in the order of the figure."""
        links = [self.model.segment_links[name] for name in self.figure.bodies]
        return np.array(links, dtype=np.int64)

    @property
    def links(self) -> Array:
        """Recorded columns of all links, shape (links, RECORDED_COLUMNS)."""
        links = self._links
        if links is None:
            states = self.progress.state[None]
            links = evaluate(self.model, self.mechanism, self.time, states)[0][0]
            self._links = links
        return links

    @property
    def poses(self) -> dict[str, Array]:
        """Pose of each segment in the world, shape (4, 4)."""
        links, moving = self.links, self.model.segment_links
        poses: dict[str, Array] = {}
        for name in self.figure.segments:
            if name in moving:
                row = links[moving[name]]
                rotation = row[ROTATION : ROTATION + 9].reshape(3, 3)
                origin = row[POINT : POINT + 3] - rotation @ self.model.points[moving[name]]
                poses[name] = pose_matrix(rotation, origin)
            else:
                poses[name] = self.ground_poses[name].copy()
        return poses

    @property
    def displacements(self) -> dict[str, Array]:
        """Displacements of each joint, shape (n,) [rad or m], nearest to those computed before."""
        poses = self.poses
        values: dict[str, Array] = {}
        for name, joint in self.figure.joints.items():
            value = np.array(self.nearest[name], dtype=float)
            places = self._places(name)
            if name not in self.setting.locked and len(places) < len(value):
                parent, child = (
                    poses[ref.segment] @ self.figure.site(ref).pose_in_segment for ref in joint.ends
                )
                chain = self.setting.tree.chains[name]
                value = chain.displacements(inverse_pose(parent) @ child, value)
            for factor, (place, _) in places.items():
                value[factor] = self.progress.state[place]
            values[name] = value
        self.nearest = values
        return {name: value.copy() for name, value in values.items()}

    @property
    def rates(self) -> dict[str, Array]:
        """Rates of the displacements, shape (n,) [rad/s or m/s]; at a pole, the smallest ones."""
        poses, displacements = self.poses, self.displacements
        spins = dict.fromkeys(self.figure.ground, np.zeros(3))
        for name, link in self.model.segment_links.items():
            spins[name] = self.links[link, SPIN : SPIN + 3]
        rates: dict[str, Array] = {}
        for name, joint in self.figure.joints.items():
            rate, places = np.zeros(len(joint.chain)), self._places(name)
            if name not in self.setting.locked and len(places) < len(rate):
                chain = self.setting.tree.chains[name]
                site = self.figure.site(joint.parent).pose_in_segment
                to_parent = (poses[joint.parent.segment] @ site)[:3, :3].T
                spin = spins[joint.child.segment] - spins[joint.parent.segment]
                turns = list(chain.rotations)
                axes = chain.twists(displacements[name])[turns, :3]
                rate[turns] = np.linalg.pinv(axes.T, rcond=_POLE_TOLERANCE) @ (to_parent @ spin)
            for factor, (_, place) in places.items():
                rate[factor] = self.progress.state[place]
            rates[name] = rate
        return rates

    def integrals_for(self, model: CompiledModel) -> Array:
        """Return the integrals of powers, and those of contact forces if a model has the same."""
        if model.touching == self.model.touching:
            return self.progress.state[-model.integrals :]
        integrals = np.zeros(model.integrals)
        integrals[-POWERS:] = self.progress.state[-POWERS:]
        return integrals

    def _places(self, name: str) -> dict[int, tuple[int, int]]:
        """Places in the state of those displacements of a joint that it holds, and of their rates.

        It holds the displacements of hinges and slides that are not driven.
        """
        places: dict[int, tuple[int, int]] = {}
        for factor in range(len(self.figure.joints[name].chain)):
            link = self.model.factor_links.get((name, factor))
            if link is None:
                continue
            row = self.model.mechanism.links[link]
            if row[KIND] != BALL and row[COORDINATE] >= 0:
                places[factor] = int(row[COORDINATE]), int(row[RATE])
        return places

    @property
    def centre_of_mass(self) -> Array:
        """Centre of mass of all moving segments, shape (3,) [m]."""
        return self._masses @ self._centres / np.sum(self._masses)

    @property
    def _masses(self) -> Array:
        return self.model.mechanism.constants[self.bodies, MASS]

    @property
    def _centres(self) -> Array:
        """Centres of mass of the moving segments, shape (B, 3) [m]."""
        points = self.links[self.bodies, POINT : POINT + 3]
        return points + centre_arms(self.model, self.bodies, self.links)

    @property
    def energy(self) -> dict[str, float]:
        """Energy by kind [J]: `ENERGY_KINDS`; with props, or after, `CONTACT_ENERGY_KINDS`."""
        powers, contact = self.progress.state[-POWERS:], self.contact
        losses = powers[[IMPACT, FRICTION]].tolist()
        energy = {
            "kinetic": self.kinetic_energy,
            "gravity": self.gravity_energy,
            "spring": self.spring_energy,
            "dissipated": float(powers[DISSIPATION]),
            "work": float(powers[EXTERNAL]),
        }
        if contact is not None or any(losses):
            stored = 0.0 if contact is None else float(contact.energy[0])
            energy.update(zip(CONTACT_ENERGY_KINDS, (stored, *losses), strict=True))
        return energy

    @property
    def contact(self) -> ContactStates | None:
        """Contact with the props in this state, as its only row; None without props."""
        if self.setting.contacts is None:
            return None
        links, bodies = self.links, self.bodies
        return evaluate_contacts(
            self.setting.contacts,
            self.figure,
            self._centres[None],
            body_rotations(bodies, links)[None],
            centre_velocities(self.model, bodies, links)[None],
            links[None, bodies, SPIN : SPIN + 3],
        )

    @property
    def kinetic_energy(self) -> float:
        """Kinetic energy [J]."""
        speeds = weighted_velocities(self.model, self.bodies, self.links)
        return 0.5 * float(speeds @ speeds)

    @property
    def gravity_energy(self) -> float:
        """Energy of gravity, zero at the world's origin [J]."""
        return -float(self._masses @ (self._centres @ np.array(self.setting.gravity)))

    @property
    def spring_energy(self) -> float:
        """Energy stored in springs, and work against springs without an energy [J]."""
        work = float(self.progress.state[NONCONSERVATIVE - POWERS])
        return self.setting.scales[0] * self.unscaled_spring_energy() + work

    def unscaled_spring_energy(self) -> float:
        """Energy of the springs that have one, at a scale of one [J]."""
        figure, springs, chains = self.figure, self.setting.springs, self.setting.tree.chains
        displacements, poses, total = self.displacements, self.poses, 0.0
        rotations: dict[str, Array] = {}
        coupled_joints = {axis.joint for spring in springs.coupled for axis in spring.axes}
        for name, joint in figure.joints.items():
            own, chain = springs.joints.get(name, JointSprings(name)), chains[name]
            if {ref.segment for ref in joint.ends} <= figure.ground:
                continue
            if own.axes or name in coupled_joints:
                turns = [
                    (poses[ref.segment] @ figure.site(ref).pose_in_segment)[:3, :3]
                    for ref in joint.ends
                ]
                rotations[name] = (
                    displacements[name][None, chain.rotations[0]]
                    if len(chain.rotations) == 1
                    else rotation_vector_from_matrix(turns[0].T @ turns[1])[None]
                )
            if own.axes and len(chain.rotations) == 1:
                spring = own.axes[0].oriented_along(chain.rotation_axes[0])
                total += float(total_energy(spring.elastic, rotations[name][0]))
            elif own.reach or (own.axes and springs.law is not SphericalLaw.WEIGHTED):
                law = rotation_law(own, springs.law, chain.rotation_axes)
                total += float(law.energy(rotations[name])[0])
            for spring in own.translations:
                index = chain.translation_along(spring.direction)
                spring = spring.oriented_along(chain.joint_axes[index].axis)
                total += float(total_energy(spring.elastic, displacements[name][index]))
        for coupled in springs.coupled:
            moves = all(axis.joint in rotations for axis in coupled.axes)
            if moves and coupled.law.is_conservative:
                total += float(CoupledMotion(chains, springs, rotations).energy(coupled)[0])
        return total


def build_tables(setting: Setting, model: CompiledModel) -> Mechanism:
    """Return the tables of a model with the gravity, scales and forces of a setting."""
    mechanism, count = model.mechanism, len(setting.forces)
    segments = [model.segment_links[segment] for segment, _ in setting.forces]
    points = np.array([point for _, point in setting.forces]).reshape(-1, 3)
    pieces = np.zeros((len(mechanism.knots), count, 6))
    pieces[:, :, :3] = np.array(list(setting.forces.values())).reshape(-1, 3)
    loads = np.array([(link, 1, 0) for link in segments], dtype=np.int64).reshape(-1, 3)
    parameters = mechanism.parameters.copy()
    parameters[: len(setting.scales)] = setting.scales
    return mechanism._replace(
        gravity=np.array(setting.gravity, dtype=float),
        parameters=parameters,
        loads=np.concatenate([mechanism.loads, loads]),
        load_points=np.concatenate([mechanism.load_points, points - model.points[segments]]),
        load_pieces=np.concatenate([mechanism.load_pieces, pieces], axis=1),
    )


def evaluate(
    model: CompiledModel, mechanism: Mechanism, time: float, states: Array
) -> tuple[Array, Array]:
    """Return the recorded columns of all links, and the rates, in states of shape (f, n).

    They have the shapes (f, links, RECORDED_COLUMNS) and (f, n).
    """
    links = np.empty((len(states), len(mechanism.links), RECORDED_COLUMNS))
    mechanism = mechanism._replace(branches=mechanism.branches.copy())
    times = np.full(len(states), time)
    rates, wrenches = np.empty_like(states), np.empty((len(states), len(mechanism.rows), 6))
    record_frames(model.equations, mechanism, model.scratch, times, states, links, rates, wrenches)
    return links, rates


def weighted_velocities(model: CompiledModel, bodies: IndexArray, links: Array) -> Array:
    """Velocities of bodies times the roots of masses and moments of inertia, shape (..., 6 B).

    The kinetic energy is half the square of this vector.

    Args:
        model: model with the masses.
        bodies: links of the B bodies.
        links: recorded columns, shape (..., links, RECORDED_COLUMNS).
    """
    spins = links[..., bodies, SPIN : SPIN + 3]
    constants = model.mechanism.constants[bodies]
    linear = centre_velocities(model, bodies, links)
    own_spins = (np.swapaxes(body_rotations(bodies, links), -1, -2) @ spins[..., None])[..., 0]
    weighted = np.concatenate(
        [
            np.sqrt(constants[:, INERTIA : INERTIA + 3]) * own_spins,
            np.sqrt(constants[:, MASS, None]) * linear,
        ],
        axis=-1,
    )
    return weighted.reshape(*links.shape[:-2], -1)


def project_velocities(
    model: CompiledModel, bodies: IndexArray, time: float, values: Array, wanted: Array
) -> None:
    """Set the rates in a state to those whose velocities are nearest to other ones.

    Args:
        model: model whose joints permit the velocities.
        bodies: links of the B bodies.
        time: [s].
        values: coordinates, rates and integrals of powers, shape (n,); its rates are set.
        wanted: the result of `weighted_velocities` for the other velocities, shape (6 B,).
    """
    places = model.rate_places
    values[places] = 0.0
    states = np.tile(values, (len(places) + 1, 1))
    states[np.arange(1, len(states)), places] = 1.0
    links, _ = evaluate(model, model.mechanism, time, states)
    speeds = weighted_velocities(model, bodies, links)
    matrix = (speeds[1:] - speeds[0]).T
    rest = np.asarray(wanted - speeds[0], dtype=float)
    for _ in range(_PROJECTION_SWEEPS if places else 0):
        change = np.asarray(np.linalg.lstsq(matrix, rest, rcond=None)[0], dtype=float)
        values[places] += change
        rest = np.asarray(rest - matrix @ change, dtype=float)
    if len(model.mechanism.rows) > 0:
        from generator.simulation.compiled.projection import project_state  # compiled if needed

        arguments = model.equations.laws, model.mechanism, model.scratch, 0, time
        project_state(*arguments, values, np.zeros_like(values))
