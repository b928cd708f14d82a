"""Findings on all curves and coupled laws of a figure, each once for all joints that share it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from springs.axis import AxisSpring
from springs.elastic import total_torque
from springs.joint import CoupledSpring, SpringSet
from springs.lint.coupled import DEFAULT_RANGE, lint_coupled, lint_original_law
from springs.lint.curve import (
    FIRM_TORQUE,
    MirrorRotations,
    is_same_axis,
    lint_curve,
    lint_range,
    lint_symmetry,
    other_side,
)
from springs.lint.finding import Finding, FindingKind, doubts_first
from springs.published.range_of_motion import PREFERRED_PUBLICATIONS, RangeEnd, normal_range


@dataclass(frozen=True)
class CoupledReport:
    """Findings on one law over several joints.

    Attributes:
        springs: those that have it.
        findings: doubts first.
    """

    springs: tuple[CoupledSpring, ...]
    findings: tuple[Finding, ...]

    @property
    def doubts(self) -> tuple[Finding, ...]:
        """The findings that are unlikely of passive joints."""
        return tuple(finding for finding in self.findings if finding.is_doubt)


def report_coupled(springs: SpringSet) -> tuple[CoupledReport, ...]:
    """Lint every law of a figure over several joints."""
    groups: list[list[CoupledSpring]] = []
    for spring in springs.coupled:
        group = next((one for one in groups if one[0].law == spring.law), None)
        if group is None:
            groups.append([spring])
        else:
            group.append(spring)
    return tuple(_build_report(group, springs) for group in groups)


def _build_report(group: Sequence[CoupledSpring], springs: SpringSet) -> CoupledReport:
    originals = dict.fromkeys(spring.original for spring in group if spring.original is not None)
    found = [
        *lint_coupled(group[0].law),
        *(finding for original in originals for finding in lint_original_law(original)),
        *_lint_sides(group, springs.coupled),
        *_lint_duplicate_laws(group, springs),
    ]
    return CoupledReport(tuple(group), doubts_first(found))


def _lint_sides(
    group: Sequence[CoupledSpring], all_springs: Sequence[CoupledSpring]
) -> Iterator[Finding]:
    """Check that the joints on the other side have the same law."""
    joints = {tuple(axis.joint for axis in spring.axes) for spring in group}
    elsewhere = {tuple(axis.joint for axis in spring.axes) for spring in all_springs}
    lone: list[tuple[str, ...]] = []
    for names in sorted(joints):
        other = tuple(other_side(name) or name for name in names)
        if other != names and other not in joints:
            lone.append(other)
    for names in lone:
        each = tuple(dict.fromkeys(names))
        listed = " and ".join(f"`{name}`" for name in each)
        law = "another law" if names in elsewhere else "no such law"
        has = "has" if len(each) == 1 else "have"
        yield Finding(FindingKind.SYMMETRY, True, f"{listed} {has} {law}")
    if not lone and len(joints) > 1:
        yield Finding(FindingKind.SYMMETRY, False, "left and right have the same law")


def _lint_duplicate_laws(group: Sequence[CoupledSpring], springs: SpringSet) -> Iterator[Finding]:
    """Angles that have a curve of their own beside the law: the two add."""
    law = group[0].law
    for i, name in enumerate(law.coordinates):
        own = {
            axis.joint: _max_torque(curve, law.valid_ranges[i] or DEFAULT_RANGE)
            for spring in group
            for axis in (spring.axes[i],)
            for curve in _own_curves(springs, axis.joint, axis.direction)
        }
        if not own:
            continue
        joints = " and ".join(f"`{joint}`" for joint in own)
        one, both = max(own.values()), _max_coupled_torque(group[0], i)
        message = (
            f"beside this law, with up to {both:.4g} N m about {name}, {joints} "
            f"{'has' if len(own) == 1 else 'have'} a curve with up to {one:.4g} N m: the two add"
        )
        yield Finding(
            FindingKind.DUPLICATE_LAW, min(one, both) > FIRM_TORQUE, message, (), (one, both)
        )


def _own_curves(
    springs: SpringSet, joint: str, direction: tuple[float, float, float]
) -> Iterator[AxisSpring]:
    """The springs about an axis of a joint that are more than stops and damping."""
    for spring in springs.joints[joint].axes if joint in springs.joints else ():
        if is_same_axis(spring, direction) and spring.laws_besides_stops:
            yield spring


def _max_torque(spring: AxisSpring, law_range: tuple[float, float]) -> float:
    """Greatest torque of a spring, its stops apart, over the range of the law [N m]."""
    angles = np.linspace(*law_range, 361)
    return float(np.abs(np.asarray(total_torque(spring.laws_besides_stops, angles))).max())


def _max_coupled_torque(spring: CoupledSpring, i: int) -> float:
    """Greatest torque about one coordinate over the range of the law [N m]."""
    box = [np.linspace(*(known or DEFAULT_RANGE), 11) for known in spring.law.valid_ranges]
    torques = spring.law.torques(np.meshgrid(*box, indexing="ij"))
    return float(np.abs(np.asarray(torques[i])).max())


@dataclass(frozen=True)
class CurveReport:
    """Findings on one curve.

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
    def lint_range(self) -> tuple[float, float]:
        """Range over which the curve was checked [rad]."""
        return lint_range(self.low, self.high)


def report_curves(
    springs: SpringSet,
    mirrors: MirrorRotations | None = None,
    publications: Sequence[str] = PREFERRED_PUBLICATIONS,
) -> tuple[CurveReport, ...]:
    """Lint every axis that has an elastic law.

    Args:
        springs: springs of a figure.
        mirrors: mirrors as of `lint_symmetry`.
        publications: those of `normal_range`.
    """
    reports: list[CurveReport] = []
    for name, joint in springs.joints.items():
        for spring in joint.axes:
            if spring.elastic:
                ends = normal_range(name, spring.motion, publications)
                sides = lint_symmetry(name, spring, springs.joints, mirrors)
                _add_to_reports(reports, name, spring, ends, sides)
    return tuple(reports)


def _add_to_reports(
    reports: list[CurveReport],
    name: str,
    spring: AxisSpring,
    ends: tuple[RangeEnd | None, RangeEnd | None],
    symmetry_findings: tuple[Finding, ...],
) -> None:
    """Add a joint to the report of an equal curve, or a report of its own."""
    low, high = ends
    line = tuple(map(abs, spring.direction))
    for place, one in enumerate(reports):
        shared = (one.spring.elastic, one.spring.damping, one.spring.motion, one.low, one.high)
        same_line = tuple(map(abs, one.spring.direction)) == line
        if (
            same_line
            and shared == (spring.elastic, spring.damping, spring.motion, low, high)
            and set(symmetry_findings) <= set(one.findings)
        ):
            joints = (*one.joints, name)
            reports[place] = CurveReport(joints, one.spring, low, high, one.findings)
            return
    found = (*lint_curve(spring, low, high), *symmetry_findings)
    reports.append(CurveReport((name,), spring, low, high, doubts_first(found)))
