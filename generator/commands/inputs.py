"""What commands read: a figure, its springs, and whether the two can move."""

from collections.abc import Iterator

from generator.chain import ChainError, chain_of
from generator.errors import Fault, InputError, error, errors_among
from generator.figure import Figure
from generator.posture.assemble import OpenLoopError, assemble
from generator.posture.placement import drawn_displacements
from generator.posture.tree import hang
from generator.reader import examine_figure, faults_for_simulation
from generator.reader.draft import place_of
from generator.reader.passive import PassiveReading, springs_for
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
