"""`mover cite`: where the numbers of a figure are from."""

from generator.commands.answer import Answer, UsageError
from generator.commands.cite_tables import cite_table, is_table, table_names
from generator.commands.inputs import figure_of, springs_of
from generator.commands.spring_words import axis_name, places_of
from generator.errors import Fault, InputError, error, nearest
from generator.reader.figure_file import find_figure, shipped_figures
from generator.reader.vocabulary import shown

THESIS = (
    "E. M. Otani, Software Tools for Dynamic and Kinematic Modeling of Human Motion, "
    "MS-CIS-89-43, University of Pennsylvania, 1989"
)
THESIS_USE = "the figure language, the laws of joints, the prototype figure"


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
    entries = [(THESIS, [THESIS_USE]), *uses.items()]
    return Answer(
        text="\n\n".join(f"{reference}\n  for {', '.join(used)}" for reference, used in entries),
        data={
            "figure": name,
            "springs": spring_set.origin,
            "references": [{"reference": text, "used_for": used} for text, used in entries],
        },
        faults=(*warnings, *more),
    )


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
