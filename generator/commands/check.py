"""`mover check`: all that is wrong or odd in a figure and its springs, and a verdict."""

from generator.commands.answer import Answer, ExitCode, counted
from generator.commands.inputs import faults_of_motion, look_for_springs
from generator.errors import Fault, errors_among
from generator.reader import examine_figure


def check(name: str, springs: str | None = None) -> Answer:
    """The faults of the figure that `name` means, and of its springs."""
    reading = examine_figure(name)
    faults, hindrances = reading.faults, ()
    if reading.figure is not None:
        faults = (*faults, *look_for_springs(reading.figure, springs).faults)
        hindrances = faults_of_motion(reading.figure)
        told = {fault.message for fault in faults}
        faults = (*faults, *(one for one in hindrances if one.message not in told))
    verdict = f"{name}: {_tally(faults)}; {_use(faults, hindrances)}"
    return Answer(
        text="\n\n".join([*map(str, faults), verdict]),
        data=[fault.as_dict() for fault in faults],
        code=ExitCode.WRONG_INPUT if errors_among(faults) else ExitCode.GOOD,
    )


def _tally(faults: tuple[Fault, ...]) -> str:
    errors = len(errors_among(faults))
    warnings = len(faults) - errors
    return f"{counted(errors, 'error')}, {counted(warnings, 'warning')}"


def _use(faults: tuple[Fault, ...], hindrances: tuple[Fault, ...]) -> str:
    if errors_among(faults):
        return "the figure cannot be used"
    if hindrances:
        return "the figure can be read, but not simulated"
    return "the figure can be simulated"
