"""Option values that a figure gives a meaning: `JOINT=a,b,c` and `X,Y,Z`.

Positions and displacements as commands show them: centimetres and degrees.

Option values with a unit: `1.05g/cm3`, `1cm`, `mm`.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from math import isfinite

from generator.cli.answer import UsageError
from generator.diagnostics import nearest
from generator.figure import Factor, Figure, Vector
from generator.figure_file.values import bound_of
from generator.kinematics.free_root import let_go
from generator.kinematics.placement import drawn_displacements
from generator.kinematics.tree import hang
from generator.motion_files.action import meant_number, unit_of
from generator.rotations import Array
from generator.units import BOUNDS, EXAMPLES, POWERS, Dimension, UnitError, converted, unit_named

CM = 0.01
"""A centimetre [m]."""


def in_units(values: Iterable[float], chain: Sequence[Factor]) -> list[float]:
    """Displacements [rad or m] in degrees and cm."""
    factors = (float(unit_named(unit_of(factor)).factor) for factor in chain)
    return [float(value) / factor for value, factor in zip(values, factors, strict=True)]


def in_cm(position: Array) -> list[float]:
    """A position [m] in cm, without minus zeros."""
    return [float(part) / CM + 0.0 for part in position]


def rounded(number: float, digits: int = 2) -> str:
    """A number with a fixed count of decimals, without a minus before zero."""
    return f"{round(number, digits) + 0.0:.{digits}f}"


def xyz_cm(position: Array) -> str:
    """A position [m] as a sentence tells it in cm: `(1.00, 2.00, 3.00) cm`."""
    return f"({', '.join(map(rounded, in_cm(position)))}) cm"


LARGEST = 1e9
"""Beyond it a component that a person gives is a slip; see `generator.units.Bound`."""

Chains = Mapping[str, Sequence[Factor]]


def chains_of(figure: Figure, *, free_root: bool = False) -> Chains:
    """The chains that values can be given for, by joint.

    With a free root those of the figure let go, in which joints named after the segments that fly
    stand for those to the ground.
    """
    if free_root:
        figure, _ = let_go(figure, drawn_displacements(hang(figure)))
    return {name: joint.chain for name, joint in figure.joints.items()}


def displacements_given(
    option: str, texts: Iterable[str], chains: Chains
) -> dict[str, tuple[float, ...]]:
    """What `JOINT=a,b,c` says, by joint [rad or m, or their rates]; degrees and cm are written.

    Raises UsageError for what cannot be read or does not fit a chain.
    """
    given: dict[str, tuple[float, ...]] = {}
    for text in texts:
        name, equals, values = text.partition("=")
        name = name.strip()
        if not equals:
            raise UsageError(f"{option} {text}: expected JOINT=a,b,c")
        if name not in chains:
            hint = nearest(name, chains)
            raise UsageError(f"{option} {text}: the figure has no joint `{name}`; {hint}")
        if name in given:
            raise UsageError(f"{option} {text}: `{name}` was given before")
        parts, chain = values.split(","), chains[name]
        if len(parts) != len(chain):
            units = ",".join(map(unit_of, chain))
            raise UsageError(
                f"{option} {text}: `{name}` takes {len(chain)} values ({units}), not {len(parts)}"
            )
        given[name] = tuple(
            _meant(option, text, part.strip(), factor)
            for part, factor in zip(parts, chain, strict=True)
        )
    return given


def vector_given(option: str, text: str, largest: float = LARGEST) -> Vector:
    """What `X,Y,Z` says. Raises UsageError unless it is three numbers, none beyond `largest`."""
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise UsageError(f"{option} {text}: expected three numbers, X,Y,Z") from None
    if not all(map(isfinite, (x, y, z))):
        raise UsageError(f"{option} {text}: the numbers must be finite")
    if any(abs(part) > largest for part in (x, y, z)):
        raise UsageError(f"{option} {text}: the numbers must be at most {largest:g}")
    return x, y, z


def _meant(option: str, text: str, part: str, factor: Factor) -> float:
    try:
        value = meant_number(part, unit_of(factor))
    except (ValueError, OverflowError):
        raise UsageError(f"{option} {text}: `{part}` is no finite number") from None
    bound = bound_of(factor)
    if not bound.holds(value):
        raise UsageError(f"{option} {text}: `{part}` is beyond {bound.said}")
    return value


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
