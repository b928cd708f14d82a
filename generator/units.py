"""Units: the only place where centimetres, degrees and grams exist.

A bare number is cgs (cm, g, s, dyn) and a bare angle is radians. Every conversion is one exact
rational factor, so a value in SI is the float nearest to what was written: `2.61cm` is 0.0261.
"""

import re
from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Context, Decimal
from enum import Enum
from fractions import Fraction
from functools import lru_cache
from math import degrees, frexp, isfinite, radians

from generator.diagnostics import shorten, spelling_hint

PI = Fraction(Decimal("3.14159265358979323846264338327950288419716939937510582097494459"))
"""Enough digits that no float of an angle is rounded the wrong way."""

Powers = tuple[int, int, int, int]
"""Exponents of length, mass, time and angle."""


class Dimension(Enum):
    """Physical dimension of a field; the value is its name in a sentence."""

    NUMBER = "a plain number"
    LENGTH = "a length"
    ANGLE = "an angle"
    MASS = "a mass"
    INERTIA = "a moment of inertia"
    FORCE = "a force"
    MOMENT = "a moment"
    ANGULAR_STIFFNESS = "a rotational stiffness"
    LINEAR_STIFFNESS = "a linear stiffness"
    ANGULAR_DAMPING = "a rotational damping"
    LINEAR_DAMPING = "a linear damping"
    DENSITY = "a density"


DIMENSION_POWERS: Mapping[Dimension, Powers] = {
    Dimension.NUMBER: (0, 0, 0, 0),
    Dimension.LENGTH: (1, 0, 0, 0),
    Dimension.ANGLE: (0, 0, 0, 1),
    Dimension.MASS: (0, 1, 0, 0),
    Dimension.INERTIA: (2, 1, 0, 0),
    Dimension.FORCE: (1, 1, -2, 0),
    Dimension.MOMENT: (2, 1, -2, 0),
    Dimension.ANGULAR_STIFFNESS: (2, 1, -2, -1),
    Dimension.LINEAR_STIFFNESS: (0, 1, -2, 0),
    Dimension.ANGULAR_DAMPING: (2, 1, -1, -1),
    Dimension.LINEAR_DAMPING: (0, 1, -1, 0),
    Dimension.DENSITY: (-3, 1, 0, 0),
}

UNIT_EXAMPLES: Mapping[Dimension, str] = {
    Dimension.NUMBER: "none",
    Dimension.LENGTH: "cm, m, mm, in, ft",
    Dimension.ANGLE: "deg, rad",
    Dimension.MASS: "g, kg, lb",
    Dimension.INERTIA: "g cm2, kg m2",
    Dimension.FORCE: "dyn, N",
    Dimension.MOMENT: "dyn cm, N m",
    Dimension.ANGULAR_STIFFNESS: "dyn cm/rad, N m/rad",
    Dimension.LINEAR_STIFFNESS: "dyn/cm, N/m",
    Dimension.ANGULAR_DAMPING: "dyn cm s/rad, N m s/rad",
    Dimension.LINEAR_DAMPING: "dyn s/cm, N s/m",
    Dimension.DENSITY: "g/cm3, kg/m3",
}


@dataclass(frozen=True)
class InputBound:
    """Largest magnitude of an input; a larger one is a mistake.

    Within the bound, squares and products stay far from the largest float.

    Attributes:
        dimension: dimension of the input.
        max_abs: largest magnitude [SI].
        text: the same in words.
    """

    dimension: Dimension
    max_abs: float
    text: str

    def contains(self, value: float) -> bool:
        """Return whether a value [SI] is finite and within the bound."""
        return abs(value) <= self.max_abs

    def __str__(self) -> str:
        """The bound as a sentence."""
        return f"{self.dimension.value} is at most {self.text}"


INPUT_BOUNDS: Mapping[Dimension, InputBound] = {
    bound.dimension: bound
    for bound in (
        InputBound(Dimension.LENGTH, 1e9, "1e9 m"),
        InputBound(Dimension.ANGLE, float(10**6 * PI / 180), "1e6 deg"),
        InputBound(Dimension.MASS, 1e9, "1e9 kg"),
        InputBound(Dimension.DENSITY, 1e6, "1e6 kg/m3"),
    )
}


@dataclass(frozen=True)
class AxisUnits:
    """Units in which text has the quantities of a joint axis; inside they are in SI.

    Attributes:
        displacement: unit of a displacement.
        scale: number of these units in a radian or a metre.
        si: unit of a displacement inside.
        effort: unit of a torque or a force.
        stiffness: unit of a stiffness.
        damping: unit of a viscous damping.
        preposition: "about" or "along" the axis.
    """

    displacement: str
    scale: float
    si: str
    effort: str
    stiffness: str
    damping: str
    preposition: str

    @property
    def is_angle(self) -> bool:
        """True where a displacement is an angle."""
        return self.si == "rad"

    @property
    def rate(self) -> str:
        """Unit of a rate of a displacement."""
        return f"{self.displacement}/s"

    def format(self, value: float) -> str:
        """Format a displacement [rad or m], such as `12.5 deg`."""
        return f"{self.scale * value + 0.0:.4g} {self.displacement}"

    def si_value(self, number: float) -> float:
        """Return the displacement [rad or m] of a number in the unit of text."""
        return radians(number) if self.is_angle else number / self.scale


ROTATION_UNITS = AxisUnits(
    "deg", degrees(1.0), "rad", "N m", "N m/rad", "N m s/rad", preposition="about"
)
TRANSLATION_UNITS = AxisUnits("cm", 100.0, "m", "N", "N/m", "N s/m", preposition="along")


MAX_MODEL_NUMBER = 1e50
"""Largest number of a model [SI]: products of six such numbers stay below the largest float."""


@dataclass(frozen=True)
class Unit:
    """A product of powers of the base units: `factor` is its value in SI."""

    factor: Fraction
    powers: Powers


_LENGTH: Powers = (1, 0, 0, 0)
_MASS: Powers = (0, 1, 0, 0)
_FORCE: Powers = (1, 1, -2, 0)

_BASE_UNITS: Mapping[str, Unit] = {
    "cm": Unit(Fraction(1, 100), _LENGTH),
    "m": Unit(Fraction(1), _LENGTH),
    "mm": Unit(Fraction(1, 1000), _LENGTH),
    "in": Unit(Fraction(254, 10_000), _LENGTH),
    "ft": Unit(Fraction(3048, 10_000), _LENGTH),
    "deg": Unit(PI / 180, (0, 0, 0, 1)),
    "rad": Unit(Fraction(1), (0, 0, 0, 1)),
    "g": Unit(Fraction(1, 1000), _MASS),
    "kg": Unit(Fraction(1), _MASS),
    "lb": Unit(Fraction(45_359_237, 100_000_000), _MASS),
    "s": Unit(Fraction(1), (0, 0, 1, 0)),
    "N": Unit(Fraction(1), _FORCE),
    "dyn": Unit(Fraction(1, 100_000), _FORCE),
}

_CGS_FACTORS = (Fraction(1, 100), Fraction(1, 1000), Fraction(1), Fraction(1))

_UNIT_WORD = re.compile(r"([A-Za-z]+)([2-4]?)")


class UnitError(ValueError):
    """Unknown unit; the hint suggests what was meant."""

    def __init__(self, message: str, hint: str) -> None:
        """Keep the hint beside the message: they are shown on two lines."""
        super().__init__(message)
        self.hint = hint


def is_unit_word(word: str) -> bool:
    """Return whether `word` is a base unit with or without a power (`cm`, `m2`)."""
    match = _UNIT_WORD.fullmatch(word)
    return match is not None and match[1] in _BASE_UNITS


_UNIT_SYNONYMS: Mapping[str, str] = {
    **{name.lower(): name for name in _BASE_UNITS},
    **{
        f"{prefix}met{end}": unit + "m"
        for prefix, unit in (("", ""), ("centi", "c"), ("milli", "m"))
        for end in ("er", "re")
    },
    "inch": "in",
    "inche": "in",
    "foot": "ft",
    "feet": "ft",
    "degree": "deg",
    "\u00b0": "deg",
    "radian": "rad",
    "gram": "g",
    "kilogram": "kg",
    "pound": "lb",
    "sec": "s",
    "second": "s",
    "newton": "N",
    "dyne": "dyn",
}
"""Other names of the base units, in lower case and without the `s` of a plural."""

_MAX_UNIT_LENGTH = 30
"""Length of the longest word for which a unit is suggested."""


def suggest_unit(word: str) -> str | None:
    """Return how an unknown unit is probably written: `N m` for `Nm`, `kg m2` for `kg*m^2`."""
    plain = word.replace("^", "").replace("\u00b2", "2").replace("\u00b3", "3")
    if not 0 < len(plain) <= _MAX_UNIT_LENGTH:
        return None
    found = [_split_unit(part) for part in re.split(r"[*.\u00b7\u22c5-]+", plain)]
    return " ".join(part for part in found if part) if all(found) else None


def _split_unit(text: str) -> str | None:
    """Return a unit by another name, or units without blanks between them, as the language has."""
    match = re.fullmatch(r"([^0-9]+)([2-4]?)", text)
    if match is not None:
        base = _UNIT_SYNONYMS.get(match[1].lower()) or _UNIT_SYNONYMS.get(
            match[1].lower().removesuffix("s")
        )
        if base is not None:
            return base + match[2]
    # A product of a force or a mass: "min" is not a metre times an inch.
    for first in sorted(_BASE_UNITS, key=len, reverse=True):
        powers = _BASE_UNITS[first].powers
        if text.startswith(first) and powers[1]:
            rest = _split_factors(text[len(first) :])
            if rest is not None:
                return " ".join([first, *rest])
    return None


def _split_factors(text: str) -> list[str] | None:
    """Split units without blanks between them; None where the text is something else."""
    if not text:
        return []
    for first in sorted(_BASE_UNITS, key=len, reverse=True):
        match = re.match(rf"{first}[2-4]?", text)
        rest = _split_factors(text[match.end() :]) if match is not None else None
        if match is not None and rest is not None:
            return [match[0], *rest]
    return None


def _parse_unit_word(word: str) -> Unit:
    match = _UNIT_WORD.fullmatch(word)
    if match is None or match[1] not in _BASE_UNITS:
        meant = suggest_unit(word)
        hint = f"did you mean `{meant}`?" if meant else spelling_hint(word, _BASE_UNITS)
        raise UnitError(f"unknown unit `{shorten(word)}`", hint)
    power = int(match[2] or 1)
    base = _BASE_UNITS[match[1]]
    a, b, c, d = base.powers
    return Unit(base.factor**power, (a * power, b * power, c * power, d * power))


@lru_cache(maxsize=1024)
def parse_unit(text: str) -> Unit:
    """The unit that `text` names, such as `cm`, `N m s/rad` or `g/cm3`.

    Words are multiplied; those after a `/` divide. Raises UnitError for an unknown word.
    """
    factor, powers = Fraction(1), (0, 0, 0, 0)
    for place, side in enumerate(text.split("/")):
        sign = -1 if place else 1
        for word in side.split():
            unit = _parse_unit_word(word)
            factor *= unit.factor**sign
            a, b, c, d = (p + sign * q for p, q in zip(powers, unit.powers, strict=True))
            powers = (a, b, c, d)
    return Unit(factor, powers)


@lru_cache(maxsize=64)
def default_unit_factor(dimension: Dimension) -> Fraction:
    """The SI value of the bare number 1: cgs and radians."""
    factor = Fraction(1)
    for base, power in zip(_CGS_FACTORS, DIMENSION_POWERS[dimension], strict=True):
        factor *= base**power
    return factor


def convert_to_si(number: str, factor: Fraction) -> float:
    """The float nearest to the decimal `number` times `factor`.

    Raises OverflowError when it is beyond the largest float.
    """
    mantissa, _, exponent = number.lower().partition("e")
    whole, _, decimals = mantissa.partition(".")
    digits, power = int(whole + decimals), int(exponent or 0) - len(decimals)
    top, bottom = factor.as_integer_ratio()
    if -300 < power <= 0 and len(mantissa) < 300:
        return digits * top / (bottom * 10**-power)
    if digits == 0:
        return 0.0
    places = len(str(abs(digits))) + power
    if places > 400:
        raise OverflowError
    if places < -400:
        return 0.0
    if power >= 0:
        return digits * top * 10**power / bottom
    return digits * top / (bottom * 10**-power)


_OUTPUT_UNITS: Mapping[Dimension, tuple[str, str]] = {
    Dimension.NUMBER: ("", ""),
    Dimension.LENGTH: ("cm", "m"),
    Dimension.ANGLE: ("deg", "rad"),
    Dimension.MASS: ("g", "kg"),
    Dimension.INERTIA: ("", "kg m2"),
    Dimension.FORCE: ("", "N"),
    Dimension.MOMENT: ("", "N m"),
    Dimension.ANGULAR_STIFFNESS: ("", "N m/rad"),
    Dimension.LINEAR_STIFFNESS: ("", "N/m"),
    Dimension.ANGULAR_DAMPING: ("", "N m s/rad"),
    Dimension.LINEAR_DAMPING: ("", "N s/m"),
    Dimension.DENSITY: ("g/cm3", "kg/m3"),
}
"""The two units in which a value may be written, the usual one first, then that of SI."""

_WIDE_CONTEXT = Context(prec=60)
_CONTEXTS = tuple(Context(prec=digits) for digits in range(1, 18))
"""Contexts that round to 1, 2 and more digits, up to those with which all floats differ."""


def format_quantity(value: float, dimension: Dimension) -> str:
    """The shortest text that reads back to exactly `value` [SI].

    Raises ValueError for a value that is not finite.
    """
    return format_quantities((value,), dimension)[0]


def format_quantities(values: Sequence[float], dimension: Dimension) -> list[str]:
    """The texts that read back to exactly `values` [SI], in one unit: the one with fewer digits.

    Raises ValueError for a value that is not finite.
    """
    for value in values:
        if not isfinite(value):
            raise ValueError(f"the figure language cannot write {value}")
    usual, si = _OUTPUT_UNITS[dimension]
    candidates: list[tuple[int, list[str]]] = []
    for unit in (usual, si):
        factor = parse_unit(unit).factor if unit else default_unit_factor(dimension)
        numbers = [shortest_decimal(value, factor) for value in values]
        length = sum(_significant_length(number, has_no_unit=usual == "") for number in numbers)
        ending = (" " if " " in unit or "/" in unit else "") + unit
        texts = [n if n == "0" and not usual else n + ending for n in numbers]
        candidates.append((length, texts))
    return min(candidates, key=lambda candidate: candidate[0])[1]


def shortest_decimal(value: float, factor: Fraction) -> str:
    """The shortest decimal whose product with `factor` rounds to `value`.

    Decimals of 17 digits lie closer together than floats, so one of them always does.
    """
    if value == 0.0:
        return "0"
    exact = Fraction(value) / factor
    quotient = _WIDE_CONTEXT.divide(Decimal(exact.numerator), Decimal(exact.denominator))

    def rounded(digits: int) -> str:
        return _format_decimal(_CONTEXTS[digits - 1].plus(quotient))

    def is_exact(digits: int) -> bool:
        return _round_trips(rounded(digits), factor, value)

    counts = range(1, len(_CONTEXTS) + 1)
    if abs(frexp(value)[0]) == 0.5:  # below a power of two floats are closer than above
        return rounded(next(filter(is_exact, counts)))
    return rounded(counts[bisect_left(counts, True, key=is_exact)])


def _format_decimal(number: Decimal) -> str:
    """A decimal without needless zeros, with an exponent only where it saves many."""
    short = number.normalize(_WIDE_CONTEXT)
    return f"{short:f}" if -6 <= short.adjusted() < 12 else str(short).replace("E+", "e").lower()


def _round_trips(text: str, factor: Fraction, value: float) -> bool:
    try:
        return convert_to_si(text, factor) == value
    except OverflowError:  # rounded up beyond the largest float
        return False


def _significant_length(number: str, has_no_unit: bool) -> int:
    """Number of characters without a unit, of significant digits with one."""
    mantissa = number.partition("e")[0]
    return len(number) if has_no_unit else len(mantissa.lstrip("-0.").replace(".", "").rstrip("0"))
