"""Sources of published numbers and their verification."""

from dataclasses import dataclass
from enum import Enum


class Sureness(Enum):
    """Verification of a published number."""

    SEVERAL_CODES = "C2"
    ONE_CODE = "C1"
    PAGE = "P"
    CODE_AND_PAGE = "C1+P"

    @property
    def description(self) -> str:
        """Description in words."""
        return {
            Sureness.SEVERAL_CODES: "the same in two or more independent code bases",
            Sureness.ONE_CODE: "from one code base",
            Sureness.PAGE: "read on a page",
            Sureness.CODE_AND_PAGE: "a code base and a page agree",
        }[self]


@dataclass(frozen=True)
class Reference:
    """Source of a number.

    Attributes:
        text: authors, title, journal, year.
        sureness: how the number was checked.
        doi: without "https://doi.org/", or "".
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
