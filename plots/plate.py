"""A plate: one picture with its claims, its numbers and its references.

Nothing here imports numpy or matplotlib, so that drawn plates can be passed between processes.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from math import inf, isinf, isnan, nan
from typing import TYPE_CHECKING

from generator.text_io import format_csv_comment, format_csv_rows
from plots.medium import typographic

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from springs.backends import Array

PICTURE_FORMATS = ("svg", "png")


class ClaimKind(StrEnum):
    """Kind of statement that a claim makes."""

    VERIFICATION = "verification"
    """The program computes what it says."""
    COMPARISON = "comparison"
    """A body agrees with the literature."""
    SPEED = "speed"
    """Cost of a run."""


class Outcome(StrEnum):
    """Outcome of a claim; the last three are those of a comparison."""

    HOLDS = "holds"
    FAILS = "DOES NOT HOLD"
    AGREES = "agrees"
    DIFFERS = "differs"
    INCOMPARABLE = "cannot be compared"


@dataclass(frozen=True)
class Claim:
    """A sentence about a curve or a motion that a measured value confirms or refutes.

    Attributes:
        sentence: the claim, understandable by itself.
        measured: the measured value.
        unit: unit of `measured` and of the bounds; "" for a plain number.
        at_least: lower bound; -inf for none.
        at_most: upper bound; inf for none.
        remark: the meaning of a failing or partly true claim, or "".
        kind: kind of statement.
        obstacle: reason why a comparison cannot be made, or "".
        is_repetition: whether `measured` is the difference of a run from itself on another machine.
            It depends on the processor, so that pages are compared by its bound alone.
    """

    sentence: str
    measured: float
    unit: str = ""
    at_least: float = -inf
    at_most: float = inf
    remark: str = ""
    kind: ClaimKind = ClaimKind.VERIFICATION
    obstacle: str = ""
    is_repetition: bool = False

    def __post_init__(self) -> None:
        """Raise ValueError for a claim that cannot fail, or cannot hold."""
        if not self.sentence.strip():
            raise ValueError("a claim needs a sentence")
        if self.obstacle:
            if self.kind is not ClaimKind.COMPARISON:
                raise ValueError("only a comparison has an obstacle")
            return
        if isinf(self.at_least) and isinf(self.at_most):
            raise ValueError("a claim without a bound cannot fail")
        if isnan(self.at_least) or isnan(self.at_most) or self.at_least > self.at_most:
            raise ValueError(f"no value is {self.at_least} to {self.at_most}")

    @property
    def holds(self) -> bool:
        """True if the measured value is within the bounds; nan never is."""
        return not self.obstacle and self._is_within_bounds(self.measured)

    @property
    def outcome(self) -> Outcome:
        """Outcome of a comparison, or whether another claim holds."""
        if self.kind is not ClaimKind.COMPARISON:
            return Outcome.HOLDS if self.holds else Outcome.FAILS
        if self.obstacle:
            return Outcome.INCOMPARABLE
        return Outcome.AGREES if self.holds else Outcome.DIFFERS

    @property
    def measured_text(self) -> str:
        """The measured value with its unit, in enough digits to be on its side of the bounds."""
        if self.obstacle:
            return ""
        number = ""
        for digits in range(4, 18):
            number = f"{self.measured:.{digits}g}"
            if self._is_within_bounds(float(number)) == self.holds:
                break
        return f"{number} {self.unit}".rstrip()

    def to_json(self) -> dict[str, object]:
        """Return the claim for `--json`."""
        keys = ("sentence", "measured", "unit", "at_least", "at_most", "holds", "remark", "kind")
        return {key: getattr(self, key) for key in (*keys, "outcome", "obstacle")}

    @property
    def bound_text(self) -> str:
        """The bound in words: `at most 4 N m`, `-36 to -32 N m`."""
        if self.obstacle:
            return ""
        low, high = f"{self.at_least:.4g}", f"{self.at_most:.4g}"
        words = f"{low} to {high}" if self.at_least < self.at_most else f"exactly {low}"
        if isinf(self.at_most):
            words = f"at least {low}"
        elif isinf(self.at_least):
            words = f"at most {high}"
        return f"{words} {self.unit}".rstrip()

    @property
    def verdict(self) -> str:
        """The outcome in words."""
        return self.outcome.value

    @property
    def explanation(self) -> str:
        """Obstacle and remark in one text, or ""."""
        return "; ".join(filter(None, (self.obstacle, self.remark)))

    def _is_within_bounds(self, value: float) -> bool:
        return bool(self.at_least <= value <= self.at_most)


def comparison(
    sentence: str, measured: float, unit: str, low: float, high: float, remark: str = ""
) -> Claim:
    """Compare with the literature, between bounds; the remark explains a number beyond them."""
    claim = Claim(sentence, measured, unit, low, high, kind=ClaimKind.COMPARISON)
    return claim if claim.holds else replace(claim, remark=remark)


def incomparable_claim(sentence: str, obstacle: str) -> Claim:
    """A comparison that cannot be made, with the reason."""
    return Claim(sentence, nan, kind=ClaimKind.COMPARISON, obstacle=obstacle)


@dataclass(frozen=True)
class DrawnPlate:
    """A plate with its picture rendered; fields as those of `Plate` unless listed.

    Attributes:
        svg: picture as SVG.
        png: picture as PNG.
        tables: text of each table, by file name.
        pdf: picture as PDF for a paper; None in a report.
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
    pdf: bytes | None = None

    @property
    def files(self) -> dict[str, bytes | str]:
        """The content of each file, by name."""
        pictures = {f"{self.name}.svg": self.svg}
        if self.pdf is None:
            return {**pictures, f"{self.name}.png": self.png, **self.tables}
        return {f"{self.name}.pdf": self.pdf, **pictures, **paper_texts(self), **self.tables}


def paper_texts(plate: "DrawnPlate") -> Mapping[str, str]:
    """Return what stands beside a picture in a paper: `NAME.txt` and `NAME.bib`."""
    numbered = [f"[{k}] {text}" for k, text in enumerate(plate.references, start=1)]
    parts = [plate.title, typographic(plate.caption), typographic(plate.sign), "\n".join(numbered)]
    return {
        f"{plate.name}.txt": "\n\n".join(filter(None, parts)) + "\n",
        f"{plate.name}.bib": "\n".join(_bib_entries(plate.references)),
    }


_DOI = re.compile(r";? ?doi:(\S+?)(?= \[|$)")
_SURENESS = re.compile(r" \[[^\]]*\]$")


def _bib_entries(references: tuple[str, ...]) -> Iterator[str]:
    """Yield an entry for each reference: its text as a note, with its year and its DOI."""
    keys: set[str] = set()
    for reference in references:
        doi, year = _DOI.search(reference), re.search(r"\b(1[89]\d\d|20\d\d)\b", reference)
        text = _SURENESS.sub("", _DOI.sub("", reference))
        names = re.findall(r"[A-Z][a-zà-ž]{2,}", text)
        key = base = f"{names[0].lower() if names else 'source'}{year[0] if year else ''}"
        count = 1
        while key in keys:
            count += 1
            key = f"{base}_{count}"
        keys.add(key)
        fields = {"note": text, "year": year and year[0], "doi": doi and doi[1]}
        escaped = {
            name: re.sub(r"([&%$#_{}])", r"\\\1", text or "") for name, text in fields.items()
        }
        lines = [f"  {name} = {{{value}}}," for name, value in escaped.items() if value]
        yield "\n".join([f"@misc{{{key},", *lines, "}", ""])


@dataclass(frozen=True)
class FailedPlate:
    """A plate that could not be made, with the reason."""

    name: str
    reason: str

    def __str__(self) -> str:
        """A sentence with the name and the reason."""
        return f"the plate `{self.name}` could not be made: {self.reason}"


_FILE_NAME = re.compile(r"[a-z0-9][a-z0-9_-]*")


@dataclass(frozen=True)
class Plate:
    """A picture with its claims, numbers and references.

    Attributes:
        name: stem of the file names, as `hip_flexion` in `hip_flexion.svg`.
        title: title with the number of the thesis's figure if it redraws one.
        caption: description of the picture, and what the curves neglect.
        sign: sign convention in words.
        figure: the picture.
        claims: confirmed or refuted by the picture.
        tables: numbers drawn, each written as `NAME.csv` or, if there are several,
            `NAME.TABLE.csv`: columns by header with unit ("angle [deg]"), of equal length.
        references: references in full, in the order of appearance.
    """

    name: str
    title: str
    caption: str
    sign: str
    figure: "Figure"
    tables: "Mapping[str, Mapping[str, Array]]"
    claims: tuple[Claim, ...] = ()
    references: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Raise ValueError for what cannot be written as files, and for missing parts."""
        for name in (self.name, *(self.tables if len(self.tables) > 1 else ())):
            if not _FILE_NAME.fullmatch(name):
                raise ValueError(f"`{name}` names files: use a to z, 0 to 9, _ and -")
        for part in ("title", "caption", "sign", "tables"):
            if not getattr(self, part):
                raise ValueError(f"the plate `{self.name}` has no {part}")
        for table, columns in self.tables.items():
            shapes = {column.shape for column in columns.values()}
            if len(shapes) != 1 or len(shapes.pop()) != 1:
                raise ValueError(f"the columns of the table `{table}` differ in length")


def plate_name(stem: str) -> str:
    """Return a name of files made of a stem."""
    return re.sub(r"[^a-z0-9_-]+", "_", stem.lower()).strip("_-") or "motion"


def table_name(*words: str) -> str:
    """Return the name of a table made of words."""
    return re.sub(r"[^a-z0-9]+", "-", " ".join(words).lower())


def table_files(plate: Plate) -> dict[str, str]:
    """Format each table of a plate, by file name.

    Three comment lines (title, sign convention, references), the headers, then the rows with nine
    digits.
    """
    single = len(plate.tables) == 1
    return {
        f"{plate.name}.csv" if single else f"{plate.name}.{table}.csv": _table_text(
            plate, plate.title if single else f"{plate.title}: {table}", columns
        )
        for table, columns in plate.tables.items()
    }


def _table_text(plate: Plate, title: str, columns: "Mapping[str, Array]") -> str:
    comments = (title, plate.sign, f"References: {'; '.join(plate.references) or 'none'}")
    rows = zip(*columns.values(), strict=True)
    numbers = [[f"{float(value):.9g}" for value in row] for row in rows]
    lines = [format_csv_comment(" ".join(comment.split())) for comment in comments]
    return "".join([*lines, format_csv_rows([columns, *numbers])])
