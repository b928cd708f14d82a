"""A plate drawn: its words and claims, and its files as bytes; light enough to be sent about."""

from collections.abc import Mapping
from dataclasses import dataclass

from plots.claim import Claim


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
class Failed:
    """A plate that could not be made, and the reason as the end of a sentence."""

    name: str
    reason: str

    def __str__(self) -> str:
        """The sentence."""
        return f"the plate `{self.name}` could not be made: {self.reason}"
