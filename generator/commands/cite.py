"""`mover cite`: where the numbers of a figure are from."""

from generator.commands.answer import Answer
from generator.commands.inputs import figure_of, springs_of
from generator.commands.spring_words import axis_name

THESIS = (
    "E. M. Otani, Software Tools for Dynamic and Kinematic Modeling of Human Motion, "
    "MS-CIS-89-43, University of Pennsylvania, 1989"
)
THESIS_USE = "the figure language, the laws of joints, the prototype figure"


def cite(name: str, springs: str | None = None) -> Answer:
    """The thesis, and the references of the springs of the figure that `name` means."""
    figure, warnings = figure_of(name)
    spring_set, more = springs_of(figure, springs)
    uses = {reference: list[str]() for reference in spring_set.references}
    for joint in spring_set.joints.values():
        for spring in (*joint.axes, *joint.slides):
            if spring.reference:
                uses[spring.reference].append(f"{joint.joint} {axis_name(spring)}")
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
