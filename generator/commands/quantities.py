"""Option values with a unit: `1.05g/cm3`, `1cm`, `mm`."""

import re
from fractions import Fraction

from generator.commands.answer import UsageError
from generator.reader.units import (
    BOUNDS,
    EXAMPLES,
    POWERS,
    Dimension,
    UnitError,
    converted,
    unit_named,
)

_QUANTITY = re.compile(r"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?)\s*(.*?)\s*")

LEAST_DENSITY = 1e-6
"""Below it a density that a person gives is a slip [kg/m3]."""


def density_given(option: str, text: str) -> float:
    """The density [kg/m3] that `1.05g/cm3` says; its unit must stand there. Raises UsageError."""
    density = _given(option, text, Dimension.DENSITY, "1.05g/cm3")
    if not density >= LEAST_DENSITY:
        raise UsageError(f"{option} {text}: a density is at least {LEAST_DENSITY:g} kg/m3")
    return density


def length_given(option: str, text: str) -> float:
    """The length [m] that `1cm` says; zero alone needs no unit. Raises UsageError."""
    return _given(option, text, Dimension.LENGTH, "1cm")


def length_unit_given(option: str, text: str) -> Fraction:
    """The length [m] that a unit such as `mm` names. Raises UsageError."""
    return _factor(option, text, text, Dimension.LENGTH)


def _given(option: str, text: str, dimension: Dimension, example: str) -> float:
    match = _QUANTITY.fullmatch(text)
    if match is None:
        raise UsageError(f"{option} {text}: expected {dimension.value} such as {example}")
    number, unit = match[1], match[2]
    if not unit:
        if float(number) == 0.0:
            return 0.0
        raise UsageError(f"{option} {text}: the unit is missing; give one of {EXAMPLES[dimension]}")
    bound = BOUNDS[dimension]
    try:
        value = converted(number, _factor(option, text, unit, dimension))
    except OverflowError:
        value = float("inf")
    if not bound.holds(value):
        raise UsageError(f"{option} {text}: {bound}")
    return value


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
