"""Plates as data: texts, and the functions that collect, draw and compare what a plate shows."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

from matplotlib.figure import Figure

from plots.canvas import add_footer, plot_style
from plots.plate import Claim, Plate
from springs.backends import Array

Data = TypeVar("Data")


@dataclass(frozen=True)
class PlateDefinition(Generic[Data]):
    """Texts of a plate and functions of its data; a call makes the plate.

    Attributes:
        name: Stem of the file names.
        title: Title, with the number of the thesis's figure if the plate redraws one.
        sign: Sign convention in words, or function of the data.
        references: Sources in full, in the order of appearance.
        collect: Function that simulates or reads the data.
        caption: Text below the picture, or function of the data.
        draw: Function that draws the data.
        claims: Function that compares the data.
        tables: Function that returns the numbers drawn.
    """

    name: str
    title: str
    sign: str | Callable[[Data], str]
    collect: Callable[[], Data]
    caption: str | Callable[[Data], str]
    draw: Callable[[Data], Figure]
    claims: Callable[[Data], Iterable[Claim]]
    tables: Callable[[Data], Mapping[str, Mapping[str, Array]]]
    references: tuple[str, ...] = ()

    def __call__(self) -> Plate:
        """Collect the data and draw their plate."""
        return self.build(self.collect())

    def build(self, data: Data) -> Plate:
        """Draw the plate of data, in the style of plates and with a footer."""
        sign = self.sign if isinstance(self.sign, str) else self.sign(data)
        with plot_style():
            figure = self.draw(data)
            add_footer(figure, sign, self.references)
        return Plate(
            name=self.name,
            title=self.title,
            caption=self.caption if isinstance(self.caption, str) else self.caption(data),
            sign=sign,
            figure=figure,
            claims=tuple(self.claims(data)),
            tables=self.tables(data),
            references=self.references,
        )
