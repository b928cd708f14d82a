"""The findings of all laws over several joints, each law once however many sides share it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import radians

import numpy as np

from springs.coupled import CoupledExponential
from springs.coupled_lint import UNKNOWN, lint_coupled, lint_replaced
from springs.elastic import total_torque
from springs.finding import Finding, Kind
from springs.joint import AxisSpring, CoupledSpring, SpringSet
from springs.lint import FIRM
from springs.stop import Stop
from springs.symmetry import other_side

_PARALLEL = radians(0.01)


@dataclass(frozen=True)
class Replaced:
    """A conservative law, and the law nearest to which it is and for which it stands."""

    law: CoupledExponential
    original: CoupledExponential


@dataclass(frozen=True)
class CoupledReport:
    """What the lint finds of one law over several joints.

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


def report_coupled(
    springs: SpringSet, replaced: Sequence[Replaced] = ()
) -> tuple[CoupledReport, ...]:
    """Lint every law over several joints.

    Args:
        springs: of a figure.
        replaced: laws that stand for others.
    """
    groups: list[list[CoupledSpring]] = []
    for spring in springs.coupled:
        group = next((one for one in groups if one[0].law == spring.law), None)
        if group is None:
            groups.append([spring])
        else:
            group.append(spring)
    return tuple(_report(group, springs, replaced) for group in groups)


def _report(
    group: Sequence[CoupledSpring], springs: SpringSet, replaced: Sequence[Replaced]
) -> CoupledReport:
    originals = {pair.original: None for pair in replaced if pair.law == group[0].law}
    found = [
        *lint_coupled(group[0].law),
        *(finding for original in originals for finding in lint_replaced(original)),
        *_sides(group, springs.coupled),
        *_twice(group, springs),
    ]
    ordered = sorted(found, key=lambda finding: not finding.is_doubt)
    return CoupledReport(tuple(group), tuple(ordered))


def _sides(group: Sequence[CoupledSpring], everyone: Sequence[CoupledSpring]) -> Iterator[Finding]:
    """Whether the joints on the other side have the same law."""
    joints = {tuple(axis.joint for axis in spring.axes) for spring in group}
    elsewhere = {tuple(axis.joint for axis in spring.axes) for spring in everyone}
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
        yield Finding(Kind.SYMMETRY, True, f"{listed} {has} {law}")
    if not lone and len(joints) > 1:
        yield Finding(Kind.SYMMETRY, False, "left and right have the same law")


def _twice(group: Sequence[CoupledSpring], springs: SpringSet) -> Iterator[Finding]:
    """Angles that have a curve of their own beside the law: the two add."""
    law = group[0].law
    for i, name in enumerate(law.coordinates):
        own = {
            axis.joint: _strength(curve, law.measured[i] or UNKNOWN)
            for spring in group
            for axis in (spring.axes[i],)
            for curve in _curves(springs, axis.joint, axis.direction)
        }
        if not own:
            continue
        joints = " and ".join(f"`{joint}`" for joint in own)
        one, both = max(own.values()), _coupled_strength(group[0], i)
        said = (
            f"beside this law, with up to {both:.4g} N m about {name}, {joints} "
            f"{'has' if len(own) == 1 else 'have'} a curve with up to {one:.4g} N m: the two add"
        )
        yield Finding(Kind.TWICE, min(one, both) > FIRM, said, (), (one, both))


def _curves(
    springs: SpringSet, joint: str, direction: tuple[float, float, float]
) -> Iterator[AxisSpring]:
    """The springs about an axis of a joint that are more than stops and damping."""
    for spring in springs.joints[joint].axes if joint in springs.joints else ():
        across = float(np.linalg.norm(np.cross(spring.direction, direction)))
        if across < _PARALLEL and any(not isinstance(law, Stop) for law in spring.elastic):
            yield spring


def _strength(spring: AxisSpring, known: tuple[float, float]) -> float:
    """Greatest torque of a spring, its stops apart, over the range of the law [N m]."""
    laws = [law for law in spring.elastic if not isinstance(law, Stop)]
    angles = np.linspace(*known, 361)
    return float(np.abs(np.asarray(total_torque(laws, angles))).max())


def _coupled_strength(spring: CoupledSpring, i: int) -> float:
    """Greatest torque about one coordinate over the range of the law [N m]."""
    box = [np.linspace(*(known or UNKNOWN), 11) for known in spring.law.measured]
    torques = spring.law.torques(np.meshgrid(*box, indexing="ij"))
    return float(np.abs(np.asarray(torques[i])).max())
