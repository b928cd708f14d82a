"""Findings of the checks of a curve."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum


class FindingKind(Enum):
    """Subject of a finding, and the meaning of its `angles` [rad] and `values`."""

    SENSE = "sense"
    """Angles at which the torque drives away; values: its greatest size there [N m]."""

    EQUILIBRIUM = "equilibrium"
    """Angle of an equilibrium, or both ends of a zone without torque."""

    SLOPE = "slope"
    """Angle of the greatest stiffness, values: it [N m/rad]; or the ends of a stretch in which the
    torque grows with the angle, values: by how much [N m]."""

    JUMP = "jump"
    """Angle of a breakpoint; values: jump of the torque [N m] or of the stiffness [N m/rad]."""

    ENERGY = "energy"
    """Ends of the cycle; values: energies [J]."""

    RANGE_END = "end of range"
    """Normal end of the motion; values: torque on the child there [N m]."""

    FREE_MOTION = "free motion"
    """End of free motion, and end of the normal range."""

    EARLY_RESISTANCE = "early resistance"
    """Start of firm resistance, then angles further on; values: the torques there [N m]."""

    SYMMETRY = "symmetry"
    """Angle at which left and right differ most; values: by how much [N m]."""

    VALID_RANGE = "known range"
    """Angles within or beyond the range in which the law is known; values: torques there [N m]."""

    HYSTERESIS = "hysteresis"
    """Ends of a cycle; values: energy lost in it [J]. Or an angle at which the curve of the growing
    angle lies above that of the falling one; values: by how much [N m]."""

    MAX_TORQUE = "strength"
    """Angles of all coordinates; values: the greatest torque, which is there [N m]."""

    DUPLICATE_LAW = "two laws"
    """Values: greatest torques of the joint's own curve and of the law over several [N m]."""


@dataclass(frozen=True)
class Finding:
    """One thing that a curve is or does.

    Attributes:
        kind: what it is about.
        is_doubt: whether it is unlikely of a passive joint, and not only worth knowing.
        sentence: sentence for people.
        angles: where [rad]; see `Kind`.
        values: how much; see `Kind`.
    """

    kind: FindingKind
    is_doubt: bool
    sentence: str
    angles: tuple[float, ...] = ()
    values: tuple[float, ...] = ()


def doubts_first(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Return findings with the doubts first, otherwise in their order."""
    return tuple(sorted(findings, key=lambda finding: not finding.is_doubt))
