"""Obstacles to a simulation: the one definition of what can be simulated.

`mover check`, `mover describe`, `mover simulate` and `build_model` all ask here; Exudyn is not
needed for the answer, but for a run: `import_exudyn` says what it lacks.
"""

import sys
from collections.abc import Iterator, Mapping, Sequence, Set
from contextlib import redirect_stdout
from io import StringIO

import numpy as np

from generator.diagnostics import (
    Diagnostic,
    ModelError,
    NotInstalledError,
    error,
    spelling_hint,
)
from generator.figure import Figure, Joint, is_rotation
from generator.figure_file import simulation_diagnostics
from generator.figure_file.resolve import origin_span
from generator.joint_chain import Chain, build_chain
from generator.kinematics.loops import OpenLoopError, close_loops
from generator.kinematics.placement import (
    Displacements,
    Placement,
    forward_kinematics,
    initial_displacements,
)
from generator.kinematics.tree import Tree, build_tree
from generator.model import Model
from generator.rotations import (
    PERPENDICULAR_TOLERANCE,
    Array,
    cross_product,
    rotation_vector_from_matrix,
    unit_vector,
)
from springs import AxisSpring, CoupledSpring, JointSprings, SphericalLaw, SpringSet, rotation_law
from springs.axis import Direction
from springs.coordinates import LARGEST_SINE

_HALF_TURN_TOLERANCE = 1e-6
"""A rotation nearer than this to 180 deg has the sign of its vector from its rounding [rad]."""


def simulation_obstacles(
    model: Model, start: Mapping[str, Sequence[float]] | None = None
) -> tuple[Diagnostic, ...]:
    """Return the reasons why a model cannot be simulated; none if it can.

    Args:
        model: Figure without errors of its file, with springs.
        start: initial displacements by joint, in place of the figure's own [rad or m].
    """
    obstacles = model_obstacles(model)
    if obstacles:
        return obstacles
    tree, values = build_tree(model.figure), start or {}
    displacements = {
        **initial_displacements(tree),
        **{name: np.asarray(value, dtype=float) for name, value in values.items()},
    }
    try:
        placement = place(tree, displacements, set(values))
    except OpenLoopError as failure:
        return (error(str(failure), hint="set other start values with --set"),)
    return tuple(placement_obstacles(placement, model.springs, values))


def place(tree: Tree, displacements: Displacements, fixed: Set[str]) -> Placement:
    """Return the placement at displacements [rad or m]; the loops of a tree that has some close.

    Raises OpenLoopError; see `close_loops`.
    """
    if tree.closures:
        return close_loops(tree, displacements, fixed)
    return forward_kinematics(tree, displacements)


def model_obstacles(model: Model) -> tuple[Diagnostic, ...]:
    """Return the obstacles that hold in all poses: masses, chains, and springs without an axis."""
    figure = model.figure
    obstacles = (*simulation_diagnostics(figure), *chain_obstacles(figure))
    if not figure.bodies:
        fixed = error(
            "the figure cannot be simulated: none of its segments moves",
            hint=f"the root's segment `{figure.root.segment}` is fixed",
        )
        obstacles = (*obstacles, fixed)
    return obstacles or tuple(_spring_axis_obstacles(model))


def chain_obstacles(figure: Figure) -> Iterator[Diagnostic]:
    """Yield the errors of joints whose chains no single joint can realise."""
    for joint in figure.joints.values():
        try:
            build_chain(joint.chain)
        except ModelError as failure:
            yield error(
                f"joint `{joint.name}` cannot be simulated: {failure}",
                origin_span(joint.origins, "type"),
            )


def _spring_axis_obstacles(model: Model) -> Iterator[Diagnostic]:
    """Yield the springs whose axis or translation their joint does not have."""
    for name, own in model.springs.joints.items():
        turns, slides = _chain_axes(model.figure.joints[name])
        if own.axes and not turns:
            yield error(f"joint {name} has springs about axes but no rotation")
        elif own.axes and len(turns) == 1:
            for spring in own.axes:
                if not _is_parallel(spring, turns):
                    yield error(f"joint {name} does not rotate about {spring.direction}")
        if own.translations and not slides:
            yield error(f"joint {name} has springs along axes but no translation")
        elif own.translations:
            for spring in own.translations:
                if not _is_parallel(spring, slides):
                    yield error(f"joint {name} has no translation along {spring.direction}")
    for spring in model.springs.coupled:
        yield from _coupled_obstacles(model.figure, spring)


def _chain_axes(joint: Joint) -> tuple[list[Array], list[Array]]:
    """Unit axes of the rotations and of the translations of a joint, which connectors act on."""
    turns: list[Array] = []
    slides: list[Array] = []
    for factor in joint.chain:
        (turns if is_rotation(factor.kind) else slides).append(unit_vector(factor.axis))
    return turns, slides


def _is_parallel(spring: AxisSpring, axes: Sequence[Array]) -> bool:
    """Return whether a spring is along one of the unit axes."""
    direction = np.array(spring.direction)
    distances = (np.linalg.norm(cross_product(axis, direction)) for axis in axes)
    return any(spring.direction) and min(map(float, distances)) < PERPENDICULAR_TOLERANCE


def _coupled_obstacles(figure: Figure, spring: CoupledSpring) -> Iterator[Diagnostic]:
    """Yield the joints and axes of a coupled law that the figure does not have."""
    for name, axis in zip(spring.law.coordinates, spring.axes, strict=True):
        joint = figure.joints.get(axis.joint)
        if joint is None:
            yield error(
                f"the figure has no joint {axis.joint}, whose angle is the {name} of a coupled "
                f"law; {spelling_hint(axis.joint, figure.joints)}"
            )
            continue
        turns, _ = _chain_axes(joint)
        if not turns:
            yield error(f"joint {joint.name} has the {name} of a coupled law but no rotation")
        elif _distance_from_span(np.array(turns), np.asarray(axis.direction)) > (
            PERPENDICULAR_TOLERANCE
        ):
            yield error(
                f"joint {joint.name} does not rotate about {axis.direction}, the axis of the "
                f"{name} of a coupled law"
            )


def _distance_from_span(axes: Array, direction: Array) -> float:
    """Distance of a unit vector from the span of axes, shape (n, 3)."""
    return float(np.linalg.norm(direction - axes.T @ np.linalg.lstsq(axes.T, direction)[0]))


def placement_obstacles(
    placement: Placement, springs: SpringSet, start: Mapping[str, Sequence[float]] | None = None
) -> Iterator[Diagnostic]:
    """Yield the springs that a simulation from this placement does not support, one a joint.

    Args:
        placement: initial placement of a figure without `model_obstacles`.
        springs: the springs of its joints.
        start: joints whose displacements are not those of the figure's file.
    """
    coupled = {axis.joint for spring in springs.coupled for axis in spring.axes}
    for name, joint in placement.tree.figure.joints.items():
        own = springs.joints.get(name, JointSprings(name))
        elastic = name in coupled or own.is_elastic
        chain = placement.tree.chains[name]
        several = len(chain.rotations) > 1
        axes = [a.direction for s in springs.coupled for a in s.axes if a.joint == name]
        coordinates = _coordinate_obstacle(joint, chain, own, axes, springs.law)
        if coordinates is not None:
            yield coordinates
        elif own.reach is not None:
            continue
        elif several and (elastic or (own.axes and springs.law is SphericalLaw.COORDINATES)):
            where = singular_orientation(placement, joint, springs.law)
            if where is not None:
                yield error(
                    f"joint {name} starts {where}, where the torque of its springs is not defined",
                    None if name in (start or {}) else origin_span(joint.origins, "displacement"),
                )


def _coordinate_obstacle(
    joint: Joint,
    chain: Chain,
    springs: JointSprings,
    coupled_axes: Sequence[Direction],
    law: SphericalLaw,
) -> Diagnostic | None:
    """Check that a law of coordinates has the axes that it needs."""
    if len(chain.rotations) < 2 or (law is not SphericalLaw.COORDINATES and not springs.reach):
        return None
    try:
        made = rotation_law(springs, law, chain.rotation_axes)
        if coupled_axes:
            made.angles(coupled_axes, np.zeros(3))
    except ValueError as failure:
        return error(f"joint {joint.name}: {failure}", origin_span(joint.origins, "type"))
    return None


def singular_orientation(placement: Placement, joint: Joint, law: SphericalLaw) -> str | None:
    """Return where a joint is if the torque of its springs is not defined there, else None."""
    chain = placement.tree.chains[joint.name]
    if law is not SphericalLaw.COORDINATES:
        return "at 180 deg" if _is_at_half_turn(placement, joint) else None
    if len(chain.rotations) < 3:
        return None
    middle = float(placement.displacements[joint.name][chain.rotations[1]])
    inner, _, outer = (np.asarray(axis) for axis in chain.rotation_axes)
    along = float(outer @ placement.pose_in_parent(joint)[:3, :3] @ inner)
    if abs(along) > LARGEST_SINE or np.cos(middle) < 0.0:
        return "at its pole or beyond, 90 deg of its middle rotation"
    return None


def _is_at_half_turn(placement: Placement, joint: Joint) -> bool:
    """Return whether a joint is rotated by 180 deg, where its rotation vector changes sign."""
    rotation = placement.pose_in_parent(joint)[:3, :3]
    if np.trace(rotation) > 0.0:  # less than 120 deg
        return False
    size = float(np.linalg.norm(rotation_vector_from_matrix(rotation)))
    return size > np.pi - _HALF_TURN_TOLERANCE


def import_exudyn() -> None:
    """Import Exudyn, in its build without range checks if available.

    That build is a sixth faster and gives the same numbers; if Exudyn is loaded already, nothing
    changes. Exudyn's announcement on the standard output is suppressed.

    Raises:
        NotInstalledError: Exudyn cannot be loaded; the message names the missing library.
    """
    if "exudyn" not in sys.modules:
        sys.exudynFast = True  # pyright: ignore[reportAttributeAccessIssue]
    try:
        with redirect_stdout(StringIO()):
            import exudyn as _  # noqa: F401
    except ImportError as failure:
        raise NotInstalledError(_import_error_message(str(failure))) from None


def _import_error_message(failure: str) -> str:
    """Message that names what is missing and how to install it."""
    library = failure.split(":")[0]
    if not library.startswith("lib"):
        return f"Exudyn cannot be loaded: {failure}"
    return (
        f"Exudyn cannot be loaded because this system lacks the library {library}; "
        "on Debian and Ubuntu, install it with `apt-get install libgl1`"
    )
