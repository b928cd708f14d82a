"""A claim: a sentence about a curve or a motion, the value that was measured, and its bound."""

from dataclasses import dataclass
from math import inf, isinf, isnan


@dataclass(frozen=True)
class Claim:
    """A sentence that a measured value bears out or not.

    Attributes:
        sentence: what is claimed, in words a reader of the report understands by itself.
        measured: the value found.
        unit: of `measured` and of the bounds; "" for a plain number.
        at_least: lower bound; -inf for none.
        at_most: upper bound; inf for none.
        remark: what a failing or a partly true claim means, or "".
    """

    sentence: str
    measured: float
    unit: str = ""
    at_least: float = -inf
    at_most: float = inf
    remark: str = ""

    def __post_init__(self) -> None:
        """Refuse a claim that cannot fail, and one that cannot hold."""
        if not self.sentence.strip():
            raise ValueError("a claim needs a sentence")
        if isinf(self.at_least) and isinf(self.at_most):
            raise ValueError("a claim needs a bound: without one it cannot fail")
        if isnan(self.at_least) or isnan(self.at_most) or self.at_least > self.at_most:
            raise ValueError(f"no value is {self.at_least} to {self.at_most}")

    @property
    def holds(self) -> bool:
        """Whether the measured value is within the bounds; nan is not."""
        return self._within(self.measured)

    @property
    def measured_words(self) -> str:
        """The measured value with its unit, in as many digits as tell on which side it is."""
        said = ""
        for digits in range(4, 18):
            said = f"{self.measured:.{digits}g}"
            if self._within(float(said)) == self.holds:
                break
        return f"{said} {self.unit}".rstrip()

    @property
    def bound_words(self) -> str:
        """The bound in words: `at most 4 N m`, `-36 to -32 N m`."""
        low, high = f"{self.at_least:.4g}", f"{self.at_most:.4g}"
        if isinf(self.at_most):
            words = f"at least {low}"
        elif isinf(self.at_least):
            words = f"at most {high}"
        elif self.at_least == self.at_most:
            words = f"exactly {low}"
        else:
            words = f"{low} to {high}"
        return f"{words} {self.unit}".rstrip()

    @property
    def verdict(self) -> str:
        """`holds` or `DOES NOT HOLD`."""
        return "holds" if self.holds else "DOES NOT HOLD"

    def _within(self, value: float) -> bool:
        return bool(self.at_least <= value <= self.at_most)
