"""A claim: a sentence about a curve or a motion, the value that was measured, and its bound."""

from dataclasses import dataclass
from math import inf, isinf


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
        """Refuse a claim that cannot fail."""
        if isinf(self.at_least) and isinf(self.at_most):
            raise ValueError("a claim needs a bound: without one it cannot fail")

    @property
    def holds(self) -> bool:
        """Whether the measured value is within the bounds; nan is not."""
        return self.at_least <= self.measured <= self.at_most

    @property
    def measured_words(self) -> str:
        """The measured value with its unit."""
        return f"{self.measured:.4g} {self.unit}".rstrip()

    @property
    def bound_words(self) -> str:
        """The bound in words: `at most 4 N m`, `-36 to -32 N m`."""
        low, high = f"{self.at_least:.4g}", f"{self.at_most:.4g}"
        if isinf(self.at_most):
            words = f"at least {low}"
        elif isinf(self.at_least):
            words = f"at most {high}"
        else:
            words = f"{low} to {high}"
        return f"{words} {self.unit}".rstrip()
