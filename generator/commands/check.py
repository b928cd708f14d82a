"""`mover check`: all that is wrong or odd in a figure and its springs, and a verdict.

The curves of the springs are looked at too. What is doubtful of them does not change the exit code:
the figure can be simulated all the same.
"""

from pathlib import Path

from generator.commands.answer import Answer, ExitCode, UsageError, counted
from generator.commands.curve_words import curves_data, curves_text, tally
from generator.commands.inputs import faults_of_motion, faults_of_pose, look_for_springs
from generator.errors import Fault, errors_among
from generator.reader import examine_figure
from generator.reader.bare_springs import examine_springs
from springs import SpringSet
from springs.curve_report import report_curves

SPRINGS_SUFFIX = ".toml"


def check(name: str, springs: str | None = None) -> Answer:
    """The faults of the figure that `name` means and of its springs, and doubts about the curves.

    With the name of a springs file: its faults, and all that there is to say of its curves.
    """
    if Path(name).suffix == SPRINGS_SUFFIX:
        if springs is not None:
            raise UsageError("--springs goes with a figure, not with a springs file")
        return _check_springs(name)
    reading = examine_figure(name)
    faults, hindrances, spring_set = reading.faults, (), SpringSet()
    if reading.figure is not None:
        found = look_for_springs(reading.figure, springs)
        faults, spring_set = (*faults, *found.faults), found.springs or spring_set
        hindrances = faults_of_motion(reading.figure) or faults_of_pose(reading.figure)
        told = {fault.message for fault in faults}
        faults = (*faults, *(one for one in hindrances if one.message not in told))
    verdict = f"{name}: {_tally(faults)}; {_use(faults, hindrances)}"
    return _answer(faults, spring_set, verdict, notes=False)


def _check_springs(name: str) -> Answer:
    reading = examine_springs(Path(name))
    faults, spring_set = reading.faults, reading.springs or SpringSet()
    use = "the springs cannot be used" if reading.springs is None else "the springs can be used"
    figure = f" for `{reading.figure}`" if reading.figure is not None else ""
    return _answer(faults, spring_set, f"{name}: {_tally(faults)}; {use}{figure}", notes=True)


def _answer(faults: tuple[Fault, ...], springs: SpringSet, verdict: str, *, notes: bool) -> Answer:
    reports = report_curves(springs)
    curves = [*curves_text(reports, notes=notes), tally(reports)] if reports else []
    return Answer(
        text="\n\n".join([*map(str, faults), *curves, verdict]),
        data=[*(fault.as_dict() for fault in faults), *curves_data(reports)],
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
