"""How every picture looks: readable in grey, by the colour-blind, and in a column of print.

Colours are those of Okabe & Ito; no two lines differ by colour alone.
"""

# Matplotlib leaves the types of its keyword arguments open.
# pyright: reportUnknownMemberType=false

from collections.abc import Generator, Mapping
from contextlib import contextmanager
from io import BytesIO
from typing import Any, cast

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

BLACK = "#000000"
BLUE = "#0072B2"
VERMILION = "#D55E00"
GREEN = "#009E73"
GREY = "#6E6E6E"
PALE = "#D9D9D9"

FORMATS = ("svg", "png")

_RC: Mapping[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": PALE,
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.6,
    "hatch.linewidth": 0.5,
    "legend.facecolor": "white",
    "legend.edgecolor": "none",
    "legend.framealpha": 0.9,
    "legend.fontsize": 8.0,
    "svg.hashsalt": "exudyn-mover",
}
_RESOLUTION = 200


@contextmanager
def styled() -> Generator[None]:
    """Within it, figures are drawn in this style, whatever the user's own settings are."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(cast("Any", _RC))
        yield


def picture(figure: Figure, kind: str) -> bytes:
    """The figure as a file of a kind in `FORMATS`; the same figure gives the same bytes."""
    FigureCanvasAgg(figure)
    stream = BytesIO()
    metadata = {"Date": None} if kind == "svg" else {"Software": None}
    with styled():
        _fix_layout(figure)
        figure.savefig(stream, format=kind, dpi=_RESOLUTION, metadata=metadata)
    return stream.getvalue()


def _fix_layout(figure: Figure) -> None:
    """Place the axes for good.

    The solver behind a layout leaves the last digits of its answers to the addresses of its
    variables, and the names within an SVG are made of all digits.
    """
    if figure.get_layout_engine() is None:
        return
    # Letters are not equally wide at all resolutions.
    figure.set_dpi(_RESOLUTION)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for axes in figure.axes:
        x, y, width, height = axes.get_position(original=True).bounds
        axes.set_position((round(x, 6), round(y, 6), round(width, 6), round(height, 6)))
