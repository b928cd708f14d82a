"""Which springs a plan chooses for a figure."""

from generator.engine.plan import Plan
from generator.errors import InputError
from generator.figure import Figure
from generator.reader.passive import springs_for
from springs import SpringSet


def springs_of(figure: Figure, plan: Plan) -> SpringSet:
    """The plan's own springs, else those that its choice finds beside the figure's file.

    Raises:
        InputError: the springs' file has errors, or is not there; it holds all of them.
    """
    if plan.springs is not None:
        return plan.springs
    folder, stem = (None, None) if figure.path is None else (figure.path.parent, figure.path.stem)
    reading = springs_for(figure, folder, stem, plan.spring_choice, plan.joining)
    if reading.springs is None:
        raise InputError(reading.faults)
    return reading.springs
