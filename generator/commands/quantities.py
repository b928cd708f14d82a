"""Option values with a unit: `1.05g/cm3`, `mm`."""

import re
from fractions import Fraction

from generator.commands.answer import UsageError
from generator.reader.units import EXAMPLES, POWERS, Dimension, UnitError, converted, unit_named

_QUANTITY = re.compile(r"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?)\s*(.*?)\s*")


def density_given(option: str, text: str) -> float:
    """The density [kg/m3] that `1.05g/cm3` says; its unit must stand there. Raises UsageError."""
    match = _QUANTITY.fullmatch(text)
    if match is None:
        raise UsageError(f"{option} {text}: expected a density such as 1.05g/cm3")
    number, unit = match[1], match[2]
    if not unit:
        raise UsageError(
            f"{option} {text}: the unit is missing; give one of {EXAMPLES[Dimension.DENSITY]}"
        )
    try:
        density = converted(number, _factor(option, text, unit, Dimension.DENSITY))
    except OverflowError:
        density = float("inf")
    if not 0.0 < density < float("inf"):
        raise UsageError(f"{option} {text}: a density is above zero and finite")
    return density


def length_unit_given(option: str, text: str) -> Fraction:
    """The length [m] that a unit such as `mm` names. Raises UsageError."""
    return _factor(option, text, text, Dimension.LENGTH)


def _factor(option: str, text: str, unit: str, dimension: Dimension) -> Fraction:
    try:
        named = unit_named(unit)
    except UnitError as failure:
        raise UsageError(f"{option} {text}: {failure}; {failure.hint}") from None
    if named.powers != POWERS[dimension]:
        raise UsageError(
            f"{option} {text}: `{unit}` is no unit of {dimension.value}; "
            f"give one of {EXAMPLES[dimension]}"
        )
    return named.factor
