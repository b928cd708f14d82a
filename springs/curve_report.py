"""The findings of all curves of a figure, each curve once however many joints share it."""

from dataclasses import dataclass

from springs.finding import Finding
from springs.joint import AxisSpring, SpringSet
from springs.lint import lint_curve, studied_range
from springs.normal_range import RangeEnd, normal_range
from springs.symmetry import lint_symmetry


@dataclass(frozen=True)
class CurveReport:
    """What the lint finds of one curve.

    Attributes:
        joints: those that have it.
        spring: the curve, about its axis in the first of them.
        low: lower end of the normal range, or None where none is known.
        high: upper end likewise.
        findings: doubts first.
    """

    joints: tuple[str, ...]
    spring: AxisSpring
    low: RangeEnd | None
    high: RangeEnd | None
    findings: tuple[Finding, ...]

    @property
    def doubts(self) -> tuple[Finding, ...]:
        """The findings that are unlikely of a passive joint."""
        return tuple(finding for finding in self.findings if finding.is_doubt)

    @property
    def studied(self) -> tuple[float, float]:
        """The angles at which the curve was looked at [rad]."""
        return studied_range(self.low, self.high)


def report_curves(springs: SpringSet) -> tuple[CurveReport, ...]:
    """Lint every axis that has an elastic law."""
    reports: list[CurveReport] = []
    for name, joint in springs.joints.items():
        for spring in joint.axes:
            if spring.elastic:
                sides = lint_symmetry(name, spring, springs.joints)
                _add(reports, name, spring, sides)
    return tuple(reports)


def _add(
    reports: list[CurveReport], name: str, spring: AxisSpring, sides: tuple[Finding, ...]
) -> None:
    """Add a joint to the report of an equal curve, or a report of its own."""
    low, high = normal_range(name, spring.motion)
    line = tuple(map(abs, spring.direction))
    for place, one in enumerate(reports):
        shared = (one.spring.elastic, one.spring.damping, one.spring.motion, one.low, one.high)
        same_line = tuple(map(abs, one.spring.direction)) == line
        if (
            same_line
            and shared == (spring.elastic, spring.damping, spring.motion, low, high)
            and set(sides) <= set(one.findings)
        ):
            joints = (*one.joints, name)
            reports[place] = CurveReport(joints, one.spring, low, high, one.findings)
            return
    found = (*lint_curve(spring, low, high), *sides)
    ordered = tuple(sorted(found, key=lambda finding: not finding.is_doubt))
    reports.append(CurveReport((name,), spring, low, high, ordered))
