"""`mover cite`: where the numbers of a figure are from."""

from collections.abc import Iterator

from generator.commands.answer import Answer, UsageError
from generator.commands.cite_tables import cite_table, is_table, table_names
from generator.commands.inputs import figure_of, springs_of
from generator.commands.spring_words import axis_name, places_of
from generator.errors import Fault, InputError, error, nearest
from generator.figure import Figure
from generator.reader.figure_file import find_figure, shipped_figures
from generator.reader.vocabulary import shown
from springs import SpringSet

THESIS = (
    "E. M. Otani, Software Tools for Dynamic and Kinematic Modeling of Human Motion, "
    "MS-CIS-89-43, University of Pennsylvania, 1989"
)
LANGUAGE, LAWS = "the figure language", "the laws of joints"

OF_THE_THESIS = {
    "prototype": "the prototype figure",
    "clavicles": "the prototype figure",
    "pendulum": "the pendulum of its figure 3.4",
}
"""What the thesis has of shipped figures."""


def cite(name: str, springs: str | None = None) -> Answer:
    """The thesis, and the references of the springs of the figure that `name` means.

    With the name of a published table, or of a row of one, what is known of it; with "tables" a
    list of all. A figure of the same name goes first.
    """
    if not _is_figure(name):
        if is_table(name):
            if springs is not None:
                raise UsageError("--springs goes with a figure, not with a published table")
            return cite_table(name)
        raise InputError([_nothing(name)])
    figure, warnings = figure_of(name)
    spring_set, more = springs_of(figure, springs)
    uses = {reference: list[str]() for reference in spring_set.references}
    for joint in spring_set.joints.values():
        for spring in (*joint.axes, *joint.slides):
            if spring.reference:
                uses[spring.reference].append(f"{joint.joint} {axis_name(spring)}")
    for spring in spring_set.coupled:
        if spring.reference:
            uses[spring.reference].append(" with ".join(places_of(spring)))
    entries = [(THESIS, list(_thesis_uses(figure, spring_set))), *uses.items()]
    return Answer(
        text="\n\n".join(f"{reference}\n  for {', '.join(used)}" for reference, used in entries),
        data={
            "figure": name,
            "springs": spring_set.origin,
            "references": [{"reference": text, "used_for": used} for text, used in entries],
        },
        faults=(*warnings, *more),
    )


def _thesis_uses(figure: Figure, springs: SpringSet) -> Iterator[str]:
    """What of a figure is the thesis's."""
    yield LANGUAGE
    if springs.joints or springs.coupled:
        yield LAWS
    for name, path in shipped_figures().items():
        if name in OF_THE_THESIS and path == figure.path:
            yield OF_THE_THESIS[name]


def _is_figure(name: str) -> bool:
    """Whether a name is that of a file or of a shipped figure."""
    try:
        return find_figure(name).exists()
    except OSError:  # longer than any file's name
        return False


def _nothing(name: str) -> Fault:
    """The fault of a name that is neither a figure nor a table."""
    return error(
        f"there is no file `{shown(name)}`, no shipped figure and no published table of that name",
        hint=nearest(name, (*shipped_figures(), *table_names(name))),
    )
