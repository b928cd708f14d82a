"""The range in which a curve was measured, and the sentence for going beyond it."""

from math import degrees
from typing import Protocol, TypeAlias, runtime_checkable

Range: TypeAlias = tuple[float, float]
"""Lower and upper end [rad]; an end may be infinite."""

_ROUNDING = 1e-9
"""What converting degrees may add to an end of a range [rad]."""


@runtime_checkable
class Measured(Protocol):
    """A law that knows where it was measured."""

    @property
    def measured(self) -> Range | None:
        """Range in which the law is known to hold [rad], or None where that is not known."""
        ...


def measured_range(law: object) -> Range | None:
    """The range in which a law is known to hold [rad], or None where that is not known."""
    return law.measured if isinstance(law, Measured) else None


def mirrored_range(measured: Range | None) -> Range | None:
    """The range of the same joint when its angle is counted the other way [rad]."""
    return None if measured is None else (-measured[1], -measured[0])


def extrapolation(measured: Range | None, low: float, high: float) -> str:
    """What to say of a curve shown or used from `low` to `high` [rad]; empty within its range."""
    if measured is None:
        return "the range in which this curve was measured is not known"
    first, last = measured
    if low >= first - _ROUNDING and high <= last + _ROUNDING:
        return ""
    known = f"{degrees(first) + 0.0:.4g} .. {degrees(last) + 0.0:.4g} deg"
    parts = [
        f"{degrees(start) + 0.0:.4g} .. {degrees(end) + 0.0:.4g} deg"
        for start, end in ((low, min(high, first)), (max(low, last), high))
        if end - start > _ROUNDING
    ]
    return f"extrapolated at {' and '.join(parts)}: the curve is known for {known} only"
