"""A plate: one picture with its claims, its numbers and its references.

A claim: a sentence about a curve or a motion, the value that was measured, and its bound.

A plate drawn: its words and claims, and its files as bytes; light enough to be sent about.

Draws a plate: its picture as SVG and PNG, its numbers as comma-separated values.
"""

import csv
import re
from collections.abc import Mapping
from dataclasses import dataclass
from io import StringIO
from math import inf, isinf, isnan
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from springs.backends import Array

PICTURE_FORMATS = ("svg", "png")


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
        """Refuse a claim that cannot fail, and one that cannot hold."""
        if not self.sentence.strip():
            raise ValueError("a claim needs a sentence")
        if isinf(self.at_least) and isinf(self.at_most):
            raise ValueError("a claim needs a bound: without one it cannot fail")
        if isnan(self.at_least) or isnan(self.at_most) or self.at_least > self.at_most:
            raise ValueError(f"no value is {self.at_least} to {self.at_most}")

    @property
    def holds(self) -> bool:
        """Whether the measured value is within the bounds; nan is not."""
        return self._is_within_bounds(self.measured)

    @property
    def measured_text(self) -> str:
        """The measured value with its unit, in as many digits as tell on which side it is."""
        said = ""
        for digits in range(4, 18):
            said = f"{self.measured:.{digits}g}"
            if self._is_within_bounds(float(said)) == self.holds:
                break
        return f"{said} {self.unit}".rstrip()

    @property
    def bound_text(self) -> str:
        """The bound in words: `at most 4 N m`, `-36 to -32 N m`."""
        low, high = f"{self.at_least:.4g}", f"{self.at_most:.4g}"
        if isinf(self.at_most):
            words = f"at least {low}"
        elif isinf(self.at_least):
            words = f"at most {high}"
        elif self.at_least == self.at_most:
            words = f"exactly {low}"
        else:
            words = f"{low} to {high}"
        return f"{words} {self.unit}".rstrip()

    @property
    def verdict(self) -> str:
        """`holds` or `DOES NOT HOLD`."""
        return "holds" if self.holds else "DOES NOT HOLD"

    def _is_within_bounds(self, value: float) -> bool:
        return bool(self.at_least <= value <= self.at_most)


@dataclass(frozen=True)
class DrawnPlate:
    """What is left of a plate when its picture is drawn.

    Attributes:
        name: of the plate.
        title: what it shows.
        caption: what the reader sees.
        sign: the sign convention in words.
        claims: what the picture bears out or refutes.
        references: in full.
        svg: the picture as SVG.
        png: the picture as PNG.
        tables: the text of each table, by the name of its file.
    """

    name: str
    title: str
    caption: str
    sign: str
    claims: tuple[Claim, ...]
    references: tuple[str, ...]
    svg: bytes
    png: bytes
    tables: Mapping[str, str]

    @property
    def files(self) -> dict[str, bytes | str]:
        """What each of its files holds, by its name."""
        return {f"{self.name}.svg": self.svg, f"{self.name}.png": self.png, **self.tables}


@dataclass(frozen=True)
class FailedPlate:
    """A plate that could not be made, and the reason as the end of a sentence."""

    name: str
    reason: str

    def __str__(self) -> str:
        """The sentence."""
        return f"the plate `{self.name}` could not be made: {self.reason}"


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
    figure: "Figure"
    claims: tuple[Claim, ...]
    tables: "Mapping[str, Mapping[str, Array]]"
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
            shapes = {column.shape for column in columns.values()}
            if len(shapes) != 1 or len(shapes.pop()) != 1:
                raise ValueError(f"the columns of the table `{table}` are not of one length")


def table_files(plate: Plate) -> dict[str, str]:
    """The text of each table of a plate, by the name of its file.

    Three lines of comment (title, sign convention, references), then the headers, then the rows, in
    nine digits.
    """
    single = len(plate.tables) == 1
    return {
        f"{plate.name}.csv" if single else f"{plate.name}.{table}.csv": _table_text(
            plate, plate.title if single else f"{plate.title}: {table}", columns
        )
        for table, columns in plate.tables.items()
    }


def _table_text(plate: Plate, title: str, columns: "Mapping[str, Array]") -> str:
    stream = StringIO()
    for comment in (title, plate.sign, f"References: {'; '.join(plate.references) or 'none'}"):
        stream.write(f"# {' '.join(comment.split())}\n")
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(columns)
    for values in zip(*columns.values(), strict=True):
        writer.writerow([f"{float(value):.9g}" for value in values])
    return stream.getvalue()
