"""A plate: one picture with its claims, its numbers and its references."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from plots.claim import Claim
from springs.operations import Array

_FILE_NAME = re.compile(r"[a-z0-9][a-z0-9_-]*")


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

    def __post_init__(self) -> None:
        """Refuse what cannot be written as files, and a picture without claims or numbers."""
        for name in (self.name, *(self.tables if len(self.tables) > 1 else ())):
            if not _FILE_NAME.fullmatch(name):
                raise ValueError(f"`{name}` names files: use a to z, 0 to 9, _ and -")
        for what in ("title", "caption", "sign", "claims", "tables"):
            if not getattr(self, what):
                raise ValueError(f"the plate `{self.name}` has no {what}")
        for table, columns in self.tables.items():
            shapes = {np.shape(column) for column in columns.values()}
            if len(shapes) != 1 or len(shapes.pop()) != 1:
                raise ValueError(f"the columns of the table `{table}` are not of one length")
