"""The lint of curves in words and in data."""

from collections.abc import Iterator, Sequence
from math import degrees

from generator.commands.answer import aligned, counted
from generator.commands.spring_words import axis_name, places_of
from springs.coupled_report import CoupledReport
from springs.curve_report import CurveReport
from springs.finding import Finding
from springs.joint import UNKNOWN_AXIS


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
