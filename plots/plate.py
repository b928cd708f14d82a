"""A plate: one picture with its claims, its numbers and its references."""

from collections.abc import Mapping
from dataclasses import dataclass

from matplotlib.figure import Figure

from plots.claim import Claim
from springs.operations import Array


@dataclass(frozen=True)
class Plate:
    """What a module of this package makes.

    Attributes:
        name: of its files, as `hip_flexion` in `hip_flexion.svg`.
        title: what it shows, with the thesis's figure where it redraws one.
        caption: what the reader sees, and what the curves ignore.
        sign: the sign convention in words.
        figure: the picture.
        claims: what the picture bears out or refutes.
        tables: the numbers drawn, each written as `NAME.csv` or, where there are several,
            `NAME.TABLE.csv`: columns by header with unit ("angle [deg]"), of equal length.
        references: printed in full, in the order of appearance.
    """

    name: str
    title: str
    caption: str
    sign: str
    figure: Figure
    claims: tuple[Claim, ...]
    tables: Mapping[str, Mapping[str, Array]]
    references: tuple[str, ...]
