"""`mover check`: all that is wrong or odd in a figure and its springs, and a verdict.

The curves of the springs are looked at too. What is doubtful of them does not change the exit code:
the figure can be simulated all the same.

The lint of curves in words and in data.
"""

from collections.abc import Iterator, Sequence
from math import degrees
from pathlib import Path

from generator.cli.answer import Answer, ExitCode, UsageError, aligned, counted
from generator.cli.inputs import faults_of_motion, faults_of_pose, look_for_springs
from generator.cli.springs_text import axis_name, places_of
from generator.diagnostics import Fault, error, errors_among
from generator.figure import Figure
from generator.figure_file import examine_figure
from generator.figure_file.resolve import place_of
from generator.kinematics.loops import assemble
from generator.kinematics.placement import drawn_displacements
from generator.kinematics.tree import hang
from generator.simulation.preconditions import refused_springs
from generator.springs_file.read import examine_springs
from springs import SpringSet
from springs.joint import UNKNOWN_AXIS
from springs.lint.finding import Finding
from springs.lint.report import CoupledReport, CurveReport, Replaced, report_coupled, report_curves


def curves_text(reports: Sequence[CurveReport], *, notes: bool) -> Iterator[str]:
    """A paragraph for each curve: its joints, then its findings in a table.

    Args:
        reports: of the curves.
        notes: whether to tell what is no doubt, and curves without any.
    """
    told = [report for report in reports if notes or report.doubts]
    for report in told:
        low, high = (degrees(angle) for angle in report.studied)
        motion = f", {report.spring.motion}" if report.spring.motion else ""
        title = f"{', '.join(report.joints)} about {axis_name(report.spring)}{motion}"
        findings = report.findings if notes else report.doubts
        rows = [(f"  {weight_of(f)}", f.kind.value, f.sentence) for f in findings]
        yield f"{title}, from {low:.1f} to {high:.1f} deg\n{aligned(rows, left=3)}"
    ends = [end for report in told for end in (report.low, report.high) if end is not None]
    sources = dict.fromkeys(f"  {end.source}: {end.reference}" for end in ends)
    if sources:
        yield "\n".join(["normal ranges of motion:", *sources])


def coupled_text(reports: Sequence[CoupledReport], *, notes: bool) -> Iterator[str]:
    """A paragraph for each law over several joints; `notes` as for `curves_text`."""
    for report in reports:
        findings = report.findings if notes else report.doubts
        if findings:
            rows = [(f"  {weight_of(f)}", f.kind.value, f.sentence) for f in findings]
            sides = "; ".join(", ".join(places_of(spring)) for spring in report.springs)
            names = ", ".join(report.springs[0].law.coordinates)
            yield f"{sides}: {names}\n{aligned(rows, left=3)}"


def tally(reports: Sequence[CurveReport], coupled: Sequence[CoupledReport] = ()) -> str:
    """`8 curves, 1 law over several joints, 12 doubts`."""
    doubts = sum(len(report.doubts) for report in (*reports, *coupled))
    count = len(coupled)
    laws = [f"{count} law{'' if count == 1 else 's'} over several joints"] if coupled else []
    return ", ".join([counted(len(reports), "curve"), *laws, counted(doubts, "doubt")])


def curves_data(reports: Sequence[CurveReport]) -> list[dict[str, object]]:
    """All findings for `--json`, in the order of the text; angles in deg, values in SI."""
    return [
        {
            "severity": weight_of(finding),
            "message": finding.sentence,
            "kind": finding.kind.value,
            "joints": list(report.joints),
            "axis": axis_name(report.spring)
            if report.spring.direction != UNKNOWN_AXIS
            else "joint",
            "motion": report.spring.motion,
            "angles_deg": [degrees(angle) for angle in finding.angles],
            "values": list(finding.values),
        }
        for report in reports
        for finding in report.findings
    ]


def coupled_findings_data(reports: Sequence[CoupledReport]) -> list[dict[str, object]]:
    """All findings about laws over several joints for `--json`, as `curves_data`."""
    return [
        {
            "severity": weight_of(finding),
            "message": finding.sentence,
            "kind": finding.kind.value,
            "coordinates": list(report.springs[0].law.coordinates),
            "joints": [[axis.joint for axis in spring.axes] for spring in report.springs],
            "angles_deg": [degrees(angle) for angle in finding.angles],
            "values": list(finding.values),
        }
        for report in reports
        for finding in report.findings
    ]


def weight_of(finding: Finding) -> str:
    """`doubt` or `note`."""
    return "doubt" if finding.is_doubt else "note"


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
