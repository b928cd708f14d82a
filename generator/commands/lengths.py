"""Positions and displacements as commands show them: centimetres and degrees."""

from collections.abc import Iterable, Sequence

from generator.animation.displayed import unit_of
from generator.figure import Factor
from generator.frames import Array
from generator.reader.units import unit_named

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
