"""The medium of the pictures: the report, or a column of a paper.

In a paper the caption stands in the text: pictures have no title and no references; degree and
minus signs are typographic, and fonts are embedded.
"""

import re
import warnings
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from generator.diagnostics import MoverError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MM_PER_INCH = 25.4

_NARROW_LEGEND_SIZE = 6.5
"""Largest text of a legend in a narrow picture [points]."""

_LEAST_PANEL_WIDTH = 0.5
"""Width of the smallest panel in a narrow picture, relative to the picture."""

REPORT_WIDTH = 7.2
"""Width of a picture in the report [inch]."""


@dataclass(frozen=True)
class Medium:
    """Page on which a picture is shown.

    Attributes:
        width: width of the picture [inch].
        is_paper: whether title and references stand elsewhere.
    """

    width: float = REPORT_WIDTH
    is_paper: bool = False

    @classmethod
    def paper(cls, width_mm: int) -> "Medium":
        """Return a column of a paper."""
        return cls(width_mm / _MM_PER_INCH, is_paper=True)

    @property
    def is_narrow(self) -> bool:
        """Return whether two columns of a legend do not fit."""
        return self.width < 0.6 * REPORT_WIDTH

    @property
    def font_size(self) -> float:
        """Size of the text [points]."""
        if not self.is_paper:
            return 9.0
        return 7.0 if self.is_narrow else 8.0


REPORT = Medium()

_current = REPORT


def current_medium() -> Medium:
    """Return the medium for which pictures are drawn now."""
    return _current


@contextmanager
def drawing_for(medium: Medium) -> Generator[None]:
    """Draw pictures for a medium."""
    global _current
    before, _current = _current, medium
    try:
        yield
    finally:
        _current = before


def typographic(text: str) -> str:
    """Return a text with degree and minus signs."""
    text = text.replace("[deg]", "[°]").replace("/deg", "/°")
    text = re.sub(r"(?<=\d) deg\b", "°", text)
    text = re.sub(r"(?<![\w.)\]])-(?=\.?\d)", "−", text)
    return re.sub(r" -(?=\s)", " −", text)


def prepare_for_paper(figure: "Figure") -> None:
    """Set degree and minus signs in all texts; refuse what a narrow picture cannot hold."""
    from matplotlib.legend import Legend
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        # Why a published curve stands for the thesis's source is said in the caption.
        text.set_text(re.sub(r"^substitute(?=:| \[)", "published", typographic(text.get_text())))
    if not current_medium().is_narrow:
        return
    for legend in figure.findobj(Legend):
        for text in legend.get_texts():
            text.set_fontsize(min(text.get_fontsize(), _NARROW_LEGEND_SIZE))
        if legend not in figure.legends:
            legend.set_in_layout(False)  # it would take the panel's width
    with warnings.catch_warnings():
        # Matplotlib warns of a layout that is refused below.
        warnings.simplefilter("ignore", UserWarning)
        figure.draw_without_rendering()
    if min(axes.get_position().width for axes in figure.axes) < _LEAST_PANEL_WIDTH:
        raise MoverError("its panels do not fit a column of 85 mm: use --width 174")
