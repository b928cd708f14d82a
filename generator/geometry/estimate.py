"""Mass, inertia and centre of mass of a segment as the figure language writes them.

A segment's inertia there is three principal moments along the segment's own axes. Of a tensor that
has products of inertia as well the diagonal is written, and `products` tells what is left out.
"""

from dataclasses import dataclass
from math import floor, log10

import numpy as np

from generator.figure import CENTRE_OF_MASS
from generator.inertia import MassProperties
from generator.reader.units import Dimension, bare_factor

DIGITS = 7
"""Significant digits that are written: more than any drawing of a segment has."""

SMALL = 0.01
"""Products of inertia below this, relative to the moments of their axes, are not worth a word."""

FIELDS = ("mass", "inertia", CENTRE_OF_MASS)
"""What a segment that moves must have."""


@dataclass(frozen=True)
class Products:
    """Products of inertia that the figure language cannot hold.

    Attributes:
        ratio: the largest of |I_ij| / sqrt(I_ii I_jj).
        angle: between the principal axes and those of the segment nearest to them, at most [rad].
    """

    ratio: float
    angle: float

    @property
    def are_small(self) -> bool:
        """Whether leaving them out changes nothing that counts."""
        return self.ratio <= SMALL


def products_of(body: MassProperties) -> Products:
    """What of a body's inertia is not along the axes of its frame."""
    moments = np.sqrt(np.diag(body.inertia))
    ratios = np.abs(body.inertia) / np.outer(moments, moments)
    nearest = np.abs(body.principal.axes).max(axis=0).min()
    return Products(
        ratio=float(ratios[~np.eye(3, dtype=bool)].max()),
        angle=float(np.arccos(min(1.0, float(nearest)))),
    )


def statements_of(body: MassProperties) -> dict[str, str]:
    """The statements of a segment block for a body told in the segment's frame, by field."""
    size = float(np.sqrt(np.trace(body.inertia) / body.mass)) / _cgs(Dimension.LENGTH)
    places = DIGITS - 1 - floor(log10(size))
    centre = (_decimal(round(float(c) / _cgs(Dimension.LENGTH), places)) for c in body.centre)
    moments = (_number(float(m) / _cgs(Dimension.INERTIA)) for m in np.diag(body.inertia))
    return {
        "mass": f"mass = {_number(body.mass / _cgs(Dimension.MASS))}g;",
        "inertia": f"inertia = ({','.join(moments)});",
        CENTRE_OF_MASS: f"site {CENTRE_OF_MASS}->location = "
        f"trans({','.join(f'{part}cm' for part in centre)});",
    }


def _cgs(dimension: Dimension) -> float:
    return float(bare_factor(dimension))


def _number(value: float) -> str:
    return _decimal(float(f"{value:.{DIGITS}g}"))


def _decimal(value: float) -> str:
    """Digits without an exponent where that is not too long, and without a minus before zero."""
    return f"{value + 0.0:.15g}"
