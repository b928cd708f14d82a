"""What commands read: a figure, its springs, and whether the two can move.

The pose or the motion that a command line asks for: `--pose`, `--set` and `--along`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np

from generator.cli.answer import UsageError
from generator.cli.options import chains_of, displacements_given
from generator.diagnostics import Fault, InputError, MoverError, error, errors_among, warning
from generator.figure import Figure
from generator.figure_file import examine_figure, faults_for_simulation
from generator.figure_file.resolve import place_of
from generator.input_files.pose import examine_pose
from generator.joint_chain import ChainError, chain_of
from generator.kinematics.loops import OpenLoopError, assemble
from generator.kinematics.placement import Placement, drawn_displacements
from generator.kinematics.trajectory import placements_along, tree_of_motion
from generator.kinematics.tree import Tree, hang
from generator.motion_files import ActionFile, read_action
from generator.motion_files.motion import Header
from generator.rotations import Array
from generator.springs_file.read import PassiveReading, springs_for
from springs import Joining, SpringSet


def figure_of(name: str) -> tuple[Figure, tuple[Fault, ...]]:
    """The figure that a path or name means, with warnings. Raises InputError."""
    reading = examine_figure(name)
    if reading.figure is None:
        raise InputError(reading.faults)
    return reading.figure, reading.faults


def look_for_springs(
    figure: Figure, choice: str | None, joining: Joining | None = None
) -> PassiveReading:
    """The springs that `--springs` chooses for a figure, with all faults."""
    path = figure.path
    folder, stem = (None, None) if path is None else (path.parent, path.stem)
    return springs_for(figure, folder, stem, choice, joining)


def springs_of(
    figure: Figure, choice: str | None, joining: Joining | None = None
) -> tuple[SpringSet, tuple[Fault, ...]]:
    """The springs that `--springs` chooses for a figure, with warnings. Raises InputError."""
    reading = look_for_springs(figure, choice, joining)
    if reading.springs is None:
        raise InputError(reading.faults)
    return reading.springs, reading.faults


def faults_of_motion(figure: Figure) -> tuple[Fault, ...]:
    """What keeps a figure that could be read from being simulated."""
    return (*faults_for_simulation(figure), *faults_of_chains(figure), *_fault_of_rest(figure))


def faults_of_pose(figure: Figure) -> tuple[Fault, ...]:
    """Loops that the figure's pose opens and that cannot be closed, in a figure of sound joints."""
    tree = hang(figure)
    try:
        assemble(tree, drawn_displacements(tree))
    except OpenLoopError as failure:
        return (error(str(failure), hint="other start values by --set may close it"),)
    return ()


def insist_on_motion(figure: Figure, warnings: tuple[Fault, ...]) -> None:
    """Raise InputError, with the warnings so far, when the figure cannot be simulated."""
    faults = faults_of_motion(figure)
    if errors_among(faults):
        said = {fault.message for fault in faults}
        raise InputError((*(one for one in warnings if one.message not in said), *faults))


def _fault_of_rest(figure: Figure) -> Iterator[Fault]:
    if not figure.bodies:
        yield error(
            "the figure cannot be simulated: none of its segments moves",
            hint=f"the root's segment `{figure.root.segment}` is fixed",
        )


def faults_of_chains(figure: Figure) -> Iterator[Fault]:
    """Joints whose chains are none that one joint can hold."""
    for joint in figure.joints.values():
        try:
            chain_of(joint.chain)
        except ChainError as failure:
            yield error(
                f"joint `{joint.name}` cannot be simulated: {failure}",
                place_of(joint.origins, "type"),
            )


FARTHEST = 1e9
"""Nothing may be farther from the world's origin than this [m], along any axis."""

Given = dict[str, tuple[float, ...]]


@dataclass(frozen=True)
class Motion:
    """A motion from a file, and the tree that it moves."""

    action: ActionFile
    tree: Tree

    def placements(self) -> Iterator[Placement]:
        """The placements of all frames, many in each. Raises MoverError for one out of reach."""
        for placement in placements_along(self.tree, self.action.displacements):
            insist_on_reach(placement)
            yield placement


def placement_asked(
    figure: Figure, pose: Path | None, sets: Sequence[str]
) -> tuple[Placement, tuple[Fault, ...]]:
    """The figure in its own pose, changed by a pose file and then by `JOINT=a,b,c`, with warnings.

    Loops are closed. The joints that are set stay as asked, and without any those of the file.

    Raises:
        UsageError: `--set` cannot be read or does not fit the figure.
        InputError: the pose file is wrong, or a joint's chain is none.
        OpenLoopError: the loops cannot be closed.
    """
    insist_on_chains(figure)
    tree = hang(figure)
    from_file, faults = _from_file(figure, pose)
    given = displacements_given("--set", sets, chains_of(figure))
    asked = {
        **drawn_displacements(tree),
        **from_file,
        **{name: np.array(values, dtype=float) for name, values in given.items()},
    }
    placement = assemble(tree, asked, held=set(given or from_file))
    insist_on_reach(placement)
    return placement, faults


def start_of(
    figure: Figure, pose: Path | None, sets: Sequence[str]
) -> tuple[Given, tuple[Fault, ...]]:
    """The displacements that a run of a figure is told to start from [rad or m], with warnings.

    With a pose file these are all, its loops closed; without one those that are set, and the run
    closes the loops. Raises as `placement_asked` does.
    """
    if pose is None:
        return displacements_given("--set", sets, chains_of(figure)), ()
    placement, faults = placement_asked(figure, pose, sets)
    values = placement.displacements.items()
    return {name: tuple(float(value) for value in row) for name, row in values}, faults


def motion_asked(
    figure: Figure, path: Path, pose: Path | None, sets: Sequence[str]
) -> tuple[Motion, tuple[Fault, ...]]:
    """The motion in an action file and the tree that it moves, with warnings.

    Raises:
        UsageError: a pose is asked for as well.
        InputError: the file cannot be read, or a joint's chain is none.
        OtherMotionError: the motion is one of another figure.
    """
    if pose is not None or sets:
        raise UsageError("--along takes the poses from the motion, so --pose and --set do not fit")
    insist_on_chains(figure)
    action = read_action(path)
    return Motion(action, tree_of_motion(figure, action.chains)), doubts_of(
        figure, action.header, path
    )


def insist_on_chains(figure: Figure) -> None:
    """Raise InputError when a joint's chain is none that one joint can hold."""
    faults = tuple(faults_of_chains(figure))
    if errors_among(faults):
        raise InputError(faults)


def insist_on_reach(placement: Placement) -> None:
    """Raise MoverError when a segment is so far away that nothing can be said of it."""
    for name, pose in placement.poses.items():
        insist_near(f"segment `{name}`", pose[..., :3, 3])


def insist_near(what: str, positions: Array) -> None:
    """Raise MoverError when positions, shape (..., 3) [m], are not all near enough."""
    if not np.all(np.abs(positions) < FARTHEST):
        raise MoverError(f"{what} would be more than {FARTHEST:.0e} m away from the origin")


def _from_file(figure: Figure, path: Path | None) -> tuple[dict[str, Array], tuple[Fault, ...]]:
    if path is None:
        return {}, ()
    reading = examine_pose(path, figure)
    if reading.displacements is None:
        raise InputError(reading.faults)
    return dict(reading.displacements), reading.faults


def doubts_of(figure: Figure, header: Header, path: Path) -> tuple[Fault, ...]:
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
