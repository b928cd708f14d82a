"""What commands read: a figure, its springs, and whether the two can move.

The pose or the motion that a command line asks for: `--pose`, `--set` and `--along`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np

from generator.cli.answer import UsageError
from generator.cli.options import displacements_from_options, settable_chains
from generator.diagnostics import (
    Diagnostic,
    InputError,
    MoverError,
    Parsed,
    error,
    select_errors,
    warning,
)
from generator.figure import Figure
from generator.figure_file import parse_figure_file, simulation_diagnostics
from generator.figure_file.resolve import origin_span
from generator.input_files.pose import parse_pose_file
from generator.joint_chain import ChainError, build_chain
from generator.kinematics.loops import OpenLoopError, close_loops
from generator.kinematics.placement import Placement, initial_displacements
from generator.kinematics.trajectory import batched_placements, tree_for_motion
from generator.kinematics.tree import Tree, build_tree
from generator.motion_files import ActionFile, read_action
from generator.motion_files.motion import Header
from generator.rotations import Array
from generator.springs_file.read import LoadedSprings, load_springs
from springs import Joining, SpringSet


def load_figure(name: str) -> tuple[Figure, tuple[Diagnostic, ...]]:
    """The figure that a path or name means, with warnings. Raises InputError."""
    parsed = parse_figure_file(name)
    return parsed.require_value(), parsed.diagnostics


def parse_springs_option(
    figure: Figure, choice: str | None, joining: Joining | None = None
) -> Parsed[LoadedSprings]:
    """The springs that `--springs` chooses for a figure, with all faults."""
    path = figure.path
    folder, stem = (None, None) if path is None else (path.parent, path.stem)
    return load_springs(figure, folder, stem, choice, joining)


def springs_from_option(
    figure: Figure, choice: str | None, joining: Joining | None = None
) -> tuple[SpringSet, tuple[Diagnostic, ...]]:
    """The springs that `--springs` chooses for a figure, with warnings. Raises InputError."""
    parsed = parse_springs_option(figure, choice, joining)
    return parsed.require_value().springs, parsed.diagnostics


def simulation_obstacles(figure: Figure) -> tuple[Diagnostic, ...]:
    """What keeps a figure that could be read from being simulated."""
    return (
        *simulation_diagnostics(figure),
        *chain_errors(figure),
        *_no_moving_segment_errors(figure),
    )


def loop_closure_errors(figure: Figure) -> tuple[Diagnostic, ...]:
    """Loops that the figure's pose opens and that cannot be closed, in a figure of sound joints."""
    tree = build_tree(figure)
    try:
        close_loops(tree, initial_displacements(tree))
    except OpenLoopError as failure:
        return (error(str(failure), hint="other start values by --set may close it"),)
    return ()


def require_simulatable(figure: Figure, warnings: tuple[Diagnostic, ...]) -> None:
    """Raise InputError, with the warnings so far, when the figure cannot be simulated."""
    faults = simulation_obstacles(figure)
    if select_errors(faults):
        said = {fault.message for fault in faults}
        raise InputError((*(one for one in warnings if one.message not in said), *faults))


def _no_moving_segment_errors(figure: Figure) -> Iterator[Diagnostic]:
    if not figure.bodies:
        yield error(
            "the figure cannot be simulated: none of its segments moves",
            hint=f"the root's segment `{figure.root.segment}` is fixed",
        )


def chain_errors(figure: Figure) -> Iterator[Diagnostic]:
    """Joints whose chains are none that one joint can hold."""
    for joint in figure.joints.values():
        try:
            build_chain(joint.chain)
        except ChainError as failure:
            yield error(
                f"joint `{joint.name}` cannot be simulated: {failure}",
                origin_span(joint.origins, "type"),
            )


MAX_DISTANCE = 1e9
"""Nothing may be farther from the world's origin than this [m], along any axis."""

DisplacementValues = dict[str, tuple[float, ...]]


@dataclass(frozen=True)
class LoadedMotion:
    """A motion from a file, and the tree that it moves."""

    action: ActionFile
    tree: Tree

    def placements(self) -> Iterator[Placement]:
        """The placements of all frames, many in each. Raises MoverError for one out of reach."""
        for placement in batched_placements(self.tree, self.action.displacements):
            check_segment_distances(placement)
            yield placement


def placement_from_options(
    figure: Figure, pose: Path | None, sets: Sequence[str]
) -> tuple[Placement, tuple[Diagnostic, ...]]:
    """The figure in its own pose, changed by a pose file and then by `JOINT=a,b,c`, with warnings.

    Loops are closed. The joints that are set stay as asked, and without any those of the file.

    Raises:
        UsageError: `--set` cannot be read or does not fit the figure.
        InputError: the pose file is wrong, or a joint's chain is none.
        OpenLoopError: the loops cannot be closed.
    """
    check_chains(figure)
    tree = build_tree(figure)
    from_file, faults = _read_pose(figure, pose)
    given = displacements_from_options("--set", sets, settable_chains(figure))
    asked = {
        **initial_displacements(tree),
        **from_file,
        **{name: np.array(values, dtype=float) for name, values in given.items()},
    }
    placement = close_loops(tree, asked, held=set(given or from_file))
    check_segment_distances(placement)
    return placement, faults


def start_displacements_from_options(
    figure: Figure, pose: Path | None, sets: Sequence[str]
) -> tuple[DisplacementValues, tuple[Diagnostic, ...]]:
    """The displacements that a run of a figure is told to start from [rad or m], with warnings.

    With a pose file these are all, its loops closed; without one those that are set, and the run
    closes the loops. Raises as `placement_asked` does.
    """
    if pose is None:
        return displacements_from_options("--set", sets, settable_chains(figure)), ()
    placement, faults = placement_from_options(figure, pose, sets)
    values = placement.displacements.items()
    return {name: tuple(float(value) for value in row) for name, row in values}, faults


def motion_from_options(
    figure: Figure, path: Path, pose: Path | None, sets: Sequence[str]
) -> tuple[LoadedMotion, tuple[Diagnostic, ...]]:
    """The motion in an action file and the tree that it moves, with warnings.

    Raises:
        UsageError: a pose is asked for as well.
        InputError: the file cannot be read, or a joint's chain is none.
        OtherMotionError: the motion is one of another figure.
    """
    if pose is not None or sets:
        raise UsageError("--along takes the poses from the motion, so --pose and --set do not fit")
    check_chains(figure)
    action = read_action(path)
    return LoadedMotion(action, tree_for_motion(figure, action.chains)), changed_figure_warnings(
        figure, action.header, path
    )


def check_chains(figure: Figure) -> None:
    """Raise InputError when a joint's chain is none that one joint can hold."""
    faults = tuple(chain_errors(figure))
    if select_errors(faults):
        raise InputError(faults)


def check_segment_distances(placement: Placement) -> None:
    """Raise MoverError when a segment is so far away that nothing can be said of it."""
    for name, pose in placement.poses.items():
        check_distances(f"segment `{name}`", pose[..., :3, 3])


def check_distances(what: str, positions: Array) -> None:
    """Raise MoverError when positions, shape (..., 3) [m], are not all near enough."""
    if not np.all(np.abs(positions) < MAX_DISTANCE):
        raise MoverError(f"{what} would be more than {MAX_DISTANCE:.0e} m away from the origin")


def _read_pose(
    figure: Figure, path: Path | None
) -> tuple[dict[str, Array], tuple[Diagnostic, ...]]:
    if path is None:
        return {}, ()
    parsed = parse_pose_file(path, figure)
    return dict(parsed.require_value()), parsed.diagnostics


def changed_figure_warnings(figure: Figure, header: Header, path: Path) -> tuple[Diagnostic, ...]:
    """A warning where the figure's file is not the one that the motion was made of."""
    if figure.path is None or header.sha256 is None:
        return ()
    if sha256(figure.path.read_bytes()).hexdigest() == header.sha256:
        return ()
    return (
        warning(
            f"`{path}` is a motion of {header.figure} as it was; `{figure.path}` differs",
            hint="its joints are the same, its segments may not be",
        ),
    )
