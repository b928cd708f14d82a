"""Sources of published numbers, their verification, and what was measured for them."""

from dataclasses import dataclass
from enum import Enum, StrEnum
from typing import assert_never


class Sureness(StrEnum):
    """Verification of a published number."""

    SEVERAL_CODES = "C2"
    ONE_CODE = "C1"
    PAGE = "P"
    CODE_AND_PAGE = "C1+P"
    DISPUTED = "D"
    MEMORY = "M"

    @property
    def description(self) -> str:
        """Description in words."""
        return {
            Sureness.SEVERAL_CODES: "the same in two or more independent code bases",
            Sureness.ONE_CODE: "from one code base",
            Sureness.PAGE: "read on a page",
            Sureness.CODE_AND_PAGE: "a code base and a page agree",
            Sureness.DISPUTED: "code bases disagree",
            Sureness.MEMORY: "from memory",
        }[self]


@dataclass(frozen=True)
class Reference:
    """Source of a number.

    Attributes:
        text: authors, title, journal, year.
        sureness: how the number was checked.
        doi: doi without "https://doi.org/", or "".
        place: page, table or equation, or "".
    """

    text: str
    sureness: Sureness
    doi: str = ""
    place: str = ""

    def __str__(self) -> str:
        """The reference in one line, with how sure it is."""
        doi = f"doi:{self.doi}" if self.doi else ""
        citation = "; ".join(part for part in (self.text, self.place, doi) if part)
        return f"{citation} [{self.sureness.value}: {self.sureness.description}]"


class SampleKind(Enum):
    """Kind of bodies from which a number comes."""

    LIVING = "living"
    CADAVERS = "cadavers"
    DUMMY = "dummy"
    MODEL = "model"
    NORM = "norm"
    ESTIMATE = "estimate"
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class Sample:
    """Bodies that were measured.

    Attributes:
        kind: kind of bodies; `NORM` is a clinical table, `MODEL` a limit or curve of a model.
        subjects: their number, or None if unknown.
    """

    kind: SampleKind = SampleKind.UNKNOWN
    subjects: int | None = None

    @property
    def is_measured(self) -> bool:
        """True for measurements of people, living or dead."""
        return self.kind in (SampleKind.LIVING, SampleKind.CADAVERS)

    def __str__(self) -> str:
        """The sample in words: `20 living subjects`, `9 cadavers`, `a model`."""
        match self.kind:
            case SampleKind.LIVING:
                noun = "living subject" if self.subjects == 1 else "living subjects"
            case SampleKind.CADAVERS:
                noun = "cadaver" if self.subjects == 1 else "cadavers"
            case SampleKind.DUMMY:
                return "a crash dummy"
            case SampleKind.MODEL:
                return "a model, not measured"
            case SampleKind.NORM:
                return "a clinical table, not a sample"
            case SampleKind.ESTIMATE:
                return "an estimate, not measured"
            case SampleKind.UNKNOWN:
                return ""
            case _ as never:
                assert_never(never)
        return noun if self.subjects is None else f"{self.subjects} {noun}"
