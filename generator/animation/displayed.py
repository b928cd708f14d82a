"""Displacements as output files show them: degrees and centimetres, exact to the last bit.

A float of degrees does not hold every float of radians, so the text is the shortest decimal whose
value, taken exactly and turned into SI, is the float that was meant.
"""

from collections.abc import Sequence
from decimal import Context, Decimal
from fractions import Fraction
from math import isfinite

from generator.figure import Factor
from generator.reader.units import Dimension, converted, unit_named, written

ANGLE_UNIT = "deg"
LENGTH_UNIT = "cm"

_WIDE = Context(prec=60)
_DIGITS = Context(prec=18)  # with 17 the floats just above a power of two may be missed


def unit_of(factor: Factor) -> str:
    """The unit in which a displacement about or along `factor` is shown."""
    return ANGLE_UNIT if factor.kind == "R" else LENGTH_UNIT


def shown_number(value: float, unit: str) -> str:
    """The text in `unit` of a displacement [rad or m]. Raises ValueError unless it is finite."""
    if not isfinite(value):
        raise ValueError(f"an output file cannot hold {value}")
    if value == 0.0:
        return repr(float(value))
    scale = unit_named(unit).factor
    near = float(value) / float(scale)
    text = repr(near)
    if isfinite(near) and converted(text, scale) == value:
        return text
    exact = Fraction(value) / scale
    quotient = _WIDE.divide(Decimal(exact.numerator), Decimal(exact.denominator))
    return str(_DIGITS.plus(quotient)).replace("E", "e")


def meant_number(text: str, unit: str) -> float:
    """The displacement [rad or m] that `text` shows in `unit`.

    Raises ValueError for what is no number, OverflowError for what is beyond the largest float.
    """
    near = float(text)
    return near if near == 0.0 else converted(text, unit_named(unit).factor)


def shown_chain(chain: Sequence[Factor]) -> str:
    """A chain as the figure language writes it; `fixed` for one without freedoms."""
    return "*".join(f"{f.kind}({_shown_axis(f)})" for f in chain) or "fixed"


def _shown_axis(factor: Factor) -> str:
    return ",".join(written(part, Dimension.NUMBER) for part in factor.axis)
