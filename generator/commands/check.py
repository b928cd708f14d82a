"""`mover check`: all that is wrong or odd in a figure and its springs, and a verdict.

The curves of the springs are looked at too. What is doubtful of them does not change the exit code:
the figure can be simulated all the same.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

from generator.commands.answer import Answer, ExitCode, UsageError, counted
from generator.commands.curve_words import (
    coupled_findings_data,
    coupled_text,
    curves_data,
    curves_text,
    tally,
)
from generator.commands.inputs import faults_of_motion, faults_of_pose, look_for_springs
from generator.errors import Fault, error, errors_among
from generator.figure import Figure
from generator.posture.assemble import assemble
from generator.posture.placement import drawn_displacements
from generator.posture.refused_springs import refused_springs
from generator.posture.tree import hang
from generator.reader import examine_figure
from generator.reader.bare_springs import examine_springs
from generator.reader.draft import place_of
from springs import SpringSet
from springs.coupled_report import Replaced, report_coupled
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
    faults, hindrances, spring_set, replaced = reading.faults, (), SpringSet(), ()
    if reading.figure is not None:
        found = look_for_springs(reading.figure, springs)
        faults, spring_set = (*faults, *found.faults), found.springs or spring_set
        replaced = found.replaced
        hindrances = faults_of_motion(reading.figure) or faults_of_pose(reading.figure)
        if not hindrances:
            hindrances = tuple(_faults_of_springs(reading.figure, spring_set))
        told = {fault.message for fault in faults}
        faults = (*faults, *(one for one in hindrances if one.message not in told))
    verdict = f"{name}: {_tally(faults)}; {_use(faults, hindrances)}"
    return _answer(faults, spring_set, replaced, verdict, notes=False)


def _faults_of_springs(figure: Figure, springs: SpringSet) -> Iterator[Fault]:
    """Springs that a simulation of a figure, sound by itself, would refuse."""
    tree = hang(figure)
    for refusal in refused_springs(assemble(tree, drawn_displacements(tree)), springs):
        yield error(refusal.sentence, place_of(refusal.joint.origins, *refusal.fields))


def _check_springs(name: str) -> Answer:
    reading = examine_springs(Path(name))
    faults, spring_set = reading.faults, reading.springs or SpringSet()
    use = "the springs cannot be used" if reading.springs is None else "the springs can be used"
    figure = f" for `{reading.figure}`" if reading.figure is not None else ""
    verdict = f"{name}: {_tally(faults)}; {use}{figure}"
    return _answer(faults, spring_set, reading.replaced, verdict, notes=True)


def _answer(
    faults: tuple[Fault, ...],
    springs: SpringSet,
    replaced: Sequence[Replaced],
    verdict: str,
    *,
    notes: bool,
) -> Answer:
    reports, coupled = report_curves(springs), report_coupled(springs, replaced)
    told = [*curves_text(reports, notes=notes), *coupled_text(coupled, notes=notes)]
    if reports or coupled:
        told.append(tally(reports, coupled))
    return Answer(
        text="\n\n".join([*map(str, faults), *told, verdict]),
        data={
            **({"error": "the input is wrong"} if errors_among(faults) else {}),
            "verdict": verdict,
            "faults": [fault.as_dict() for fault in faults],
            "findings": [*curves_data(reports), *coupled_findings_data(coupled)],
        },
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
