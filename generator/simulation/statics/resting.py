"""The pose in which a figure comes to rest on the props of a scene.

The figure falls from its start, and stops wherever its kinetic energy has a maximum. This dynamic
relaxation with kinetic damping (Barnes 1999, Form finding and analysis of tension structures by
dynamic relaxation, Int. J. Space Structures 14(2):89-104) needs no coefficient. It takes out the
energy of a fall in a few seconds, so that the motion is a slow collapse without rebounds.

Friction is smooth at rest, so that points in contact creep, by which friction carries what it must.
A pose is therefore tested with a thousandth of the friction speed and of the velocities: friction
is what it was, and nothing else depends on a velocity any more. The figure rests where the
accelerations are negligible then, and stably where no small motion grows then.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from generator.contact.scene import Scene
from generator.diagnostics import ModelError
from generator.figure import Figure
from generator.joint_chain import build_chain
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.model import Model
from generator.recording import Ending
from generator.rotations import Array, inverse_pose
from generator.simulation.compiled.layout import (
    BALL,
    COORDINATE,
    INERTIA,
    KIND,
    MASS,
    RATE,
    SPIN_RATE,
)
from generator.simulation.compiled_run import (
    body_rotations,
    centre_accelerations,
    centre_velocities,
)
from generator.simulation.live.stepper import Stepper
from generator.simulation.live.stepper_state import evaluate
from generator.simulation.plan import Plan, resolve_model
from generator.simulation.statics.equilibrium import NEUTRAL_RATE_SQUARED, NoEquilibriumError
from springs import SphericalLaw
from springs.contact import Surface

MAX_REST_ACCELERATION = 0.05
"""Acceleration of a segment up to which it counts as being at rest [m/s^2], g / 200."""

MAX_GROWTH = NEUTRAL_RATE_SQUARED**0.5
"""Rate up to which a growth counts as zero [1/s]."""

_STEP_TOLERANCE = 1e-6
"""Tolerance of the steps. A larger one leaves errors of the speeds in contact, whose friction
accelerates light segments by more than `MAX_REST_ACCELERATION`."""

_SEARCH_DAMPING = 10.0
"""Least damping of the surfaces during a search [s/m], which takes out vibrations of what lies on
them in tenths of a second. At rest it has no effect."""

_INTERVAL = 5e-3
"""Time between two comparisons of the kinetic energy [s]."""

_TIME_TOLERANCE = 1e-9
"""Time by which an advance may be shorter [s]."""

_COLLAPSE_TIME = 0.5
"""Time with kinetic damping between two tests [s]."""

_FREE_TIME = 0.25
"""Time without it, from rest, after which the pose is tested [s]."""

MAX_TESTS = 80
"""Number of tests after which a figure does not come to rest, in a minute."""

_UNSTABLE_TESTS = 4
"""Number of successive tests that find the figure in an unstable pose before the search ends."""

_STICKING_RATIO = 1e-3
"""Factor of the friction speed and of the velocities in a test."""

_ANGLE_STEP, _RATE_STEP = 1e-6, 1e-8
"""Steps of finite differences [rad or m], [rad/s or m/s]."""

_MAX_LOST_ANGLE = 1e-6
"""Sine of the rotation of a segment beyond which a pose of the joints does not hold it."""

_MAX_LOST_DISTANCE = 1e-6
"""The same for its place [m]."""


@dataclass(frozen=True, eq=False)
class RestingPose:
    """A pose at rest on props; vectors along the world's axes.

    Attributes:
        figure: the figure, with a free root the detached one.
        displacements: displacements of its joints, shape (n,) [rad or m].
        poses: poses of its segments, shape (4, 4).
        forces: forces of the props on each segment with contact spheres, shape (3,) [N].
        depths: deepest penetration of each such segment, zero where it touches nothing [m].
        weight: weight of the figure [N].
        shares: shares of the weight, carried by each segment; empty without gravity.
        centre_of_mass: shape (3,) [m].
        height: height of the centre of mass, from the world's origin [m].
        energy: energy of gravity, springs and contact [J]; None if a law has none, such as the
            weighted one.
        start_energy: the same at the start.
        acceleration: largest one that is left, of the segment `fastest` [m/s^2]: the root mean
            square of the accelerations of its mass points.
        fastest: segment with this acceleration.
        creep: largest speed of a centre of mass of a segment, after a start from rest [m/s].
        creeping: segment with this speed.
        growth: rate at which small motions grow while nothing creeps [1/s].
        time: simulated [s].
    """

    figure: Figure
    displacements: Mapping[str, Array]
    poses: Mapping[str, Array]
    forces: Mapping[str, Array]
    depths: Mapping[str, float]
    weight: float
    shares: Mapping[str, float]
    centre_of_mass: Array
    height: float
    energy: float | None
    start_energy: float | None
    acceleration: float
    fastest: str
    creep: float
    creeping: str
    growth: float
    time: float

    @property
    def is_stable(self) -> bool:
        """True if no small motion grows."""
        return self.growth <= MAX_GROWTH

    @property
    def weight_carried(self) -> float | None:
        """Force of the props against gravity over the weight; None without gravity."""
        return sum(self.shares.values()) if self.weight > 0.0 else None


def find_resting_pose(
    model: Model | Figure, plan: Plan, watch: Callable[[float, float], None] | None = None
) -> RestingPose:
    """Find the pose in which a model comes to rest on the props of a plan.

    Other starts lead to other poses.

    Args:
        model: Figure without closed loops, with springs, as for `simulate`.
        plan: its start, springs, gravity, root, pose, scene, locks and loads; velocities and
            other times are ignored.
        watch: called with the simulated time [s] and the largest acceleration [m/s^2].

    Raises:
        NoEquilibriumError: the figure does not come to rest, or not within the wall limit.
        MoverError: the figure or the plan cannot be simulated step by step.
    """
    if not plan.scene.props:
        raise ModelError("a figure comes to rest on props: the plan has none")
    if plan.drives:
        raise NoEquilibriumError("a driven joint does not come to rest")
    model, plan = resolve_model(model, plan)
    scene = _replace_surfaces(plan.scene, _damped)
    stepper = Stepper(model, replace(plan, velocities={}, scene=scene), _STEP_TOLERANCE)
    search = _Search(stepper, plan.wall_limit)
    start_energy, start_height = _potential_energy(stepper), _height(stepper, plan)
    unstable_tests = 0
    for _ in range(MAX_TESTS):
        search.collapse(_COLLAPSE_TIME)
        stepper.stop()
        search.advance(_FREE_TIME)
        still = hold_still(stepper)
        motion = _Motion.of(still, stepper)
        if watch is not None:
            watch(stepper.time - plan.start, motion.acceleration)
        if motion.acceleration > MAX_REST_ACCELERATION:
            unstable_tests = 0
            continue
        growth = growth_of_small_motions(still)
        unstable_tests += 1
        if growth > MAX_GROWTH and unstable_tests < _UNSTABLE_TESTS:
            continue
        stores = model.springs.law is not SphericalLaw.WEIGHTED and all(
            spring.law.is_conservative for spring in model.springs.coupled
        )
        return _resting_pose(still, plan, motion, growth, start_energy if stores else None)
    raise NoEquilibriumError(_restless_message(stepper, plan, start_height))


def _resting_pose(
    stepper: Stepper,
    plan: Plan,
    motion: "_Motion",
    growth: float,
    start_energy: float | None,
) -> RestingPose:
    """Return the present pose of a stepper; its energy is None with that of the start."""
    state = stepper.snapshot()
    contact, contacts = state.contact, state.setting.contacts
    assert contact is not None
    assert contacts is not None
    names, forces = list(contacts.spheres), stepper.contact_forces
    mass = sum(body.mass or 0.0 for body in stepper.figure.bodies.values())
    weight = mass * float(np.linalg.norm(plan.gravity))
    up = np.array(plan.up)
    return RestingPose(
        stepper.figure,
        stepper.displacements,
        stepper.poses,
        forces,
        {
            name: max(float(contact.depths[0, contacts.owners == g].max()), 0.0)
            for g, name in enumerate(names)
        },
        weight,
        {name: float(force @ up) / weight for name, force in forces.items()} if weight else {},
        stepper.centre_of_mass,
        _height(stepper, plan),
        None if start_energy is None else _potential_energy(stepper),
        start_energy,
        motion.acceleration,
        motion.fastest,
        motion.speed,
        motion.creeping,
        growth,
        stepper.time - plan.start,
    )


def _restless_message(stepper: Stepper, plan: Plan, start_height: float) -> str:
    """Message for a figure that has not come to rest."""
    motion, fall = _Motion.of(stepper, stepper), start_height - _height(stepper, plan)
    message = (
        f"the figure does not come to rest within {stepper.time - plan.start:.3g} s: "
        f"{motion.creeping} still moves at {motion.speed:.3g} m/s"
    )
    if not any(force.any() for force in stepper.contact_forces.values()):
        return f"{message} and nothing touches a prop; the centre of mass has fallen {fall:.3g} m"
    return f"{message}, and its largest acceleration is {motion.acceleration:.3g} m/s^2"


class _Search:
    """The fall of a stepper until a wall-time limit."""

    def __init__(self, stepper: Stepper, wall_limit: float) -> None:
        self.stepper = stepper
        self._wall_limit = wall_limit
        self._deadline = time.monotonic() + wall_limit

    def collapse(self, duration: float) -> None:
        """Advance with kinetic damping."""
        before = self.stepper.kinetic_energy
        for _ in range(round(duration / _INTERVAL)):
            self.advance(_INTERVAL)
            kinetic = self.stepper.kinetic_energy
            if kinetic < before:
                self.stepper.stop()
                kinetic = 0.0
            before = kinetic

    def advance(self, duration: float) -> None:
        """Advance, by any number of steps.

        Raises NoEquilibriumError if the motion cannot be continued, or after the wall limit.
        """
        stop = self.stepper.time + duration
        while stop - self.stepper.time > _TIME_TOLERANCE:
            if time.monotonic() > self._deadline:
                raise NoEquilibriumError(
                    f"the wall-time limit of {self._wall_limit:g} s was reached at "
                    f"{self.stepper.time:.3g} s"
                )
            outcome = self.stepper.advance(stop - self.stepper.time)
            if not outcome.succeeded and outcome.ending is not Ending.TOO_LONG:
                raise NoEquilibriumError(
                    f"the fall cannot be followed to its end: {outcome.message}"
                )


def _potential_energy(stepper: Stepper) -> float:
    """Energy of gravity, springs and contact [J]."""
    energy = stepper.energy
    return sum(energy[kind] for kind in ("gravity", "spring", "contact"))


def _height(stepper: Stepper, plan: Plan) -> float:
    """Height of the centre of mass [m]."""
    return float(stepper.centre_of_mass @ np.array(plan.up))


@dataclass(frozen=True)
class _Motion:
    """Largest acceleration [m/s^2] and speed [m/s] of a segment, with its name."""

    acceleration: float
    fastest: str
    speed: float
    creeping: str

    @classmethod
    def of(cls, still: Stepper, moving: Stepper) -> "_Motion":
        """Return the accelerations of one stepper and the speeds of another."""
        state = still.snapshot()
        model, bodies, names = state.model, state.bodies, list(state.figure.bodies)
        links, constants = state.links, state.model.mechanism.constants[state.bodies]
        spin_rates = links[bodies, SPIN_RATE : SPIN_RATE + 3]
        linear = centre_accelerations(model, bodies, links, still.gravity)
        turns = np.swapaxes(body_rotations(bodies, links), -1, -2)
        own = (turns @ spin_rates[..., None])[..., 0]
        angular = np.sum(own**2 * constants[:, INERTIA : INERTIA + 3], axis=1)
        sizes = np.sqrt(np.sum(linear**2, axis=1) + angular / constants[:, MASS])
        after = moving.snapshot()
        speeds = np.linalg.norm(centre_velocities(after.model, after.bodies, after.links), axis=1)
        fastest, creeping = int(np.argmax(sizes)), int(np.argmax(speeds))
        return cls(float(sizes[fastest]), names[fastest], float(speeds[creeping]), names[creeping])


def hold_still(stepper: Stepper) -> Stepper:
    """Return a copy with a thousandth of the velocities and of the friction speed of all props."""
    still = stepper.copy()
    contacts = still.snapshot().setting.contacts
    assert contacts is not None
    still.set_scene(_replace_surfaces(contacts.scene, _sticking))
    state = still.snapshot()
    state.progress.state[state.model.rate_places] *= _STICKING_RATIO
    state.forget_motion()
    still.rewind(state)
    return still


def _replace_surfaces(scene: Scene, change: Callable[[Surface], Surface]) -> Scene:
    """Return a scene with changed surfaces."""
    changed = tuple(replace(prop, surface=change(prop.surface)) for prop in scene.props)
    return replace(scene, props=changed)


def _damped(surface: Surface) -> Surface:
    """Return a surface on which nothing vibrates for long."""
    return replace(surface, damping=max(surface.damping, _SEARCH_DAMPING))


def _sticking(surface: Surface) -> Surface:
    """Return a surface on which almost nothing creeps."""
    return replace(surface, friction_speed=_STICKING_RATIO * surface.friction_speed)


def growth_of_small_motions(stepper: Stepper) -> float:
    """Largest rate at which small motions about the present pose grow [1/s].

    It is the largest real part of an eigenvalue of the linearized equations of motion.
    """
    state = stepper.snapshot()
    values, places = state.progress.state, state.model.rate_places
    count = len(places)
    if count == 0:
        return 0.0
    changes = np.zeros((2 * count, len(values)))
    rows = [row for row in state.model.mechanism.links if row[RATE] >= 0]
    tangents = [tangent for row in rows for tangent in _tangents(row, values)]
    changes[:count] = _ANGLE_STEP * np.array(tangents)
    changes[np.arange(count, 2 * count), places] = _RATE_STEP
    states = np.concatenate([values + changes, values - changes])
    _, rates = evaluate(state.model, state.mechanism, state.time, states)
    accelerations = rates[:, places]
    slopes = (accelerations[: 2 * count] - accelerations[2 * count :]).T
    steps = np.repeat([_ANGLE_STEP, _RATE_STEP], count)
    matrix = np.zeros((2 * count, 2 * count))
    matrix[:count, count:] = np.eye(count)
    matrix[count:] = slopes / (2.0 * steps)
    return float(np.max(np.linalg.eigvals(matrix).real))


def _tangents(row: Array, values: Array) -> list[Array]:
    """Derivatives of a state by the angles or the displacement of a link, shape (n,) each."""
    place = int(row[COORDINATE])
    if row[KIND] != BALL:
        tangent = np.zeros(len(values))
        tangent[place] = 1.0
        return [tangent]
    scalar, vector = values[place], values[place + 1 : place + 4]
    tangents: list[Array] = []
    for axis in np.eye(3):
        tangent = np.zeros(len(values))
        tangent[place] = -0.5 * axis @ vector
        tangent[place + 1 : place + 4] = 0.5 * (scalar * axis + np.cross(axis, vector))
        tangents.append(tangent)
    return tangents


@dataclass(frozen=True)
class AttachedPose:
    """Displacements of the joints of a figure that holds its root, in a pose of the free figure.

    Attributes:
        displacements: displacements of all joints, shape (n,) [rad or m].
        turned: segments whose orientation in the world these do not hold.
        moved: segments whose place they do not hold.
    """

    displacements: dict[str, Array]
    turned: tuple[str, ...]
    moved: tuple[str, ...]


def attach_pose(figure: Figure, rest: RestingPose) -> AttachedPose:
    """Return the displacements of a figure in a pose of the figure with a free root.

    Those of the joints to the ground are the nearest ones that they can have.

    Args:
        figure: figure before its root was freed.
        rest: its resting pose.
    """
    tree = build_tree(figure)
    displacements = initial_displacements(tree)
    for name, joint in figure.joints.items():
        if name in rest.displacements and joint == rest.figure.joints[name]:
            displacements[name] = rest.displacements[name]
        elif joint.chain:
            parent, child = (
                rest.poses[ref.segment] @ figure.site(ref).pose_in_segment for ref in joint.ends
            )
            near = displacements[name]
            displacements[name] = build_chain(joint.chain).displacements(
                inverse_pose(parent) @ child, near
            )
    poses = forward_kinematics(tree, displacements).poses
    between = {name: inverse_pose(poses[name]) @ rest.poses[name] for name in figure.bodies}
    turned = [n for n, pose in between.items() if _largest_turn(pose) > _MAX_LOST_ANGLE]
    moved = [
        name
        for name in figure.bodies
        if np.linalg.norm(poses[name][:3, 3] - rest.poses[name][:3, 3]) > _MAX_LOST_DISTANCE
    ]
    return AttachedPose(displacements, tuple(turned), tuple(moved))


def _largest_turn(pose: Array) -> float:
    """Largest difference of the axes of a pose from those of the identity."""
    return float(np.max(np.abs(pose[:3, :3] - np.eye(3))))
