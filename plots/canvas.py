"""Drawing of plates: style, panels, curves, title and footer.

Pictures are readable in grey, by the colour-blind, and in a column of print. Colours are those of
Okabe & Ito; no two lines differ by colour alone.
"""

from collections.abc import Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from io import BytesIO
from math import inf
from textwrap import fill
from typing import Any, cast

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from generator.contact.scene import Scene
from plots.figure_image import Body, Poses, Strip, draw_moments
from plots.medium import current_medium, prepare_for_paper
from plots.plate import DrawnPlate, Plate, table_files
from springs.backends import Array
from springs.elastic import Range

Look = dict[str, Any]
"""Arguments of matplotlib for what is drawn."""

BLACK = "#000000"
BLUE = "#0072B2"
VERMILION = "#D55E00"
GREEN = "#009E73"
GREY = "#6E6E6E"
PALE = "#D9D9D9"

_RC: Mapping[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.titlelocation": "left",
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
    "pdf.fonttype": 42,
}
_RESOLUTION = 200

_METADATA: Mapping[str, Any] = {
    "svg": {"Date": None},
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
"""Without what changes from run to run."""

_PAPER_HEIGHT = 0.8
"""Height of a picture in a paper, without title and references, relative to the report's."""


@contextmanager
def plot_style() -> Generator[None]:
    """Draw figures in the style of the plates, independent of the user's own settings."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(cast("Any", _RC))
        mpl.rcParams["font.size"] = current_medium().font_size
        yield


def render_figure(figure: Figure, kind: str, dpi: float = _RESOLUTION) -> bytes:
    """Render a figure as png, svg or pdf; the same figure gives the same bytes."""
    FigureCanvasAgg(figure)
    stream = BytesIO()
    metadata = _METADATA[kind]
    with plot_style():
        _fix_layout(figure)
        figure.savefig(stream, format=kind, dpi=dpi, metadata=metadata)
    return stream.getvalue()


def _fix_layout(figure: Figure) -> None:
    """Fix the positions of the axes, rounded.

    The last digits of matplotlib's layout solver depend on the addresses of its variables, and the
    ids in an SVG contain all digits.
    """
    if figure.get_layout_engine() is None:
        return
    # The width of text depends on the resolution.
    figure.set_dpi(_RESOLUTION)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for axes in figure.axes:
        x, y, width, height = axes.get_position(original=True).bounds
        axes.set_position((round(x, 6), round(y, 6), round(width, 6), round(height, 6)))


_TITLE_SIZE = 10.0
_FOOTER_FONT_SIZE = 6.5
_FOOTER_LINE_LENGTH = 142
"""Characters on a line of the footer."""

_BAND_OPACITY = 0.2

_MARKED_POINTS = 12
"""Number of markers on a line through many points."""

_EXTRAPOLATED_LINE_WIDTH = 0.8
"""Line width where a curve is extrapolated [points]."""


@dataclass(frozen=True)
class LineStyle:
    """Colour, dash and marker of a line; no two styles differ by colour alone.

    Attributes:
        colour: colour of line and marker.
        dash: matplotlib's name of a line style.
        marker: matplotlib's name of a marker, or "".
    """

    colour: str
    dash: str = "-"
    marker: str = ""


THESIS_STYLE = LineStyle(BLACK)
"""Style of the thesis's own curve on every plate."""

LINE_STYLES = (
    LineStyle(BLUE, "-", "o"),
    LineStyle(VERMILION, "--", "s"),
    LineStyle(GREEN, "-.", "^"),
    LineStyle(GREY, "-", "D"),
    LineStyle("#CC79A7", "--", "v"),
    LineStyle("#56B4E9", "-.", "P"),
)
"""Styles of several curves of one kind."""


def create_canvas(height: float) -> Figure:
    """Create an empty figure of a height [inch] in the report; call it within `plot_style`."""
    medium = current_medium()
    size = (medium.width, _PAPER_HEIGHT * height if medium.is_paper else height)
    return Figure(figsize=size, layout="constrained")


def create_panels(
    height: float,
    rows: int,
    columns: int = 1,
    heights: Sequence[float] = (),
    *,
    share_rows: bool = True,
) -> tuple[Figure, list[list[Axes]]]:
    """Create a figure and its panels, row by row.

    Args:
        height: [inch].
        rows: rows of panels; the panels of a column share the x axis.
        columns: columns of panels.
        heights: relative heights of the rows [default: equal].
        share_rows: whether the panels of a row share the y axis.
    """
    figure = create_canvas(height)
    shared: Look = {"sharex": "col", "sharey": "row" if share_rows else "none"}
    panels = figure.subplots(rows, columns, squeeze=False, height_ratios=heights or None, **shared)
    return figure, [list(row) for row in panels]


def draw_curve(
    axes: Axes,
    x: Array,
    y: Array,
    valid_range: Range | None,
    style: LineStyle,
    label: str,
    width: float = 1.6,
) -> None:
    """Draw a curve in its style where it is known, thin and dotted beyond.

    Args:
        axes: axes to draw on.
        x: angles [deg].
        y: values, shape of `x`.
        valid_range: range in which the curve is known [rad]; None if unknown: all is dotted.
        style: style of the known part.
        label: label in the legend.
        width: width of the known part [points].
    """
    low, high = (inf, -inf) if valid_range is None else np.degrees(valid_range)
    slack = 1e-9 * (1.0 + np.abs(x).max())
    inside = (x >= low - slack) & (x <= high + slack)
    if inside.any():
        known = np.where(inside, y, np.nan)
        axes.plot(x, known, style.dash, color=style.colour, lw=width, label=label)
        label = "_"
    # The dotted part begins at the last known point, so that no gap is left.
    edge = np.convolve(~inside, [True, True, True], mode="same")
    if not inside.all():
        beyond = np.where(edge, y, np.nan)
        axes.plot(x, beyond, ":", color=style.colour, lw=_EXTRAPOLATED_LINE_WIDTH, label=label)


def draw_band(axes: Axes, x: Array, below: Array, above: Array, style: LineStyle) -> None:
    """Draw the scatter about a curve as a pale band of its colour."""
    axes.fill_between(x, below, above, color=style.colour, alpha=_BAND_OPACITY, lw=0.0, zorder=1.2)


def draw_line(
    axes: Axes, x: ArrayLike, y: ArrayLike, style: LineStyle, label: str = "_", **look: Any
) -> None:
    """Draw a line with open markers in its style; `look` are arguments of matplotlib's `plot`."""
    shown: Look = {**line_look(style), "lw": 1.2, "label": label, **look}
    axes.plot(x, y, **shown)


def draw_marks(
    axes: Axes, x: ArrayLike, y: ArrayLike, style: LineStyle, label: str = "_", size: float = 5.0
) -> None:
    """Draw open markers without a line."""
    draw_line(axes, x, y, style, label, ls="none", ms=size)


def line_look(style: LineStyle) -> Look:
    """Arguments of matplotlib for lines of a style."""
    look: Look = {"ls": style.dash, "color": style.colour, "marker": style.marker}
    return {**look, "ms": 4.0, "mfc": "white"}


def draw_points(
    axes: Axes, x: Array, y: Array, style: LineStyle, label: str, line: bool = True
) -> None:
    """Draw measured points, by default joined by a thin line; of many, few have a marker."""
    every = max(1, len(x) // _MARKED_POINTS)
    dash = style.dash if line else "none"
    draw_line(axes, x, y, style, label, ls=dash, markevery=every, lw=1.0)


def draw_zero_line(axes: Axes) -> None:
    """Draw the line y = 0."""
    axes.axhline(0.0, color=BLACK, linewidth=0.8)


def draw_range(axes: Axes, low: float, high: float, *, across: bool = False) -> None:
    """Draw a range of y, or of x, as a pale band behind everything."""
    look: Look = {"color": PALE, "lw": 0.0, "zorder": 0.5}
    _ = axes.axvspan(low, high, **look) if across else axes.axhspan(low, high, **look)


def draw_strip(axes: Axes, strip: Strip, body: Body, moments: Sequence[Poses]) -> None:
    """Draw moments of a body side by side, in metres and without axes."""
    axes.set_axis_off()
    image = draw_moments(body, moments, strip, Scene())
    axes.imshow(image, extent=strip.extent(len(moments)), interpolation="none")


def draw_outline(
    axes: Axes, strip: Strip, body: Body, moments: Sequence[Poses], colour: str, width: float
) -> None:
    """Draw the outlines of moments of a body side by side."""
    alpha = draw_moments(body, moments, strip, Scene())[::-1, :, 3].astype(float)
    extent = strip.extent(len(moments))
    axes.contour(alpha, [127.0], extent=extent, colors=[colour], linewidths=width)


def draw_strip_labels(axes: Axes, strip: Strip, labels: Iterable[str], **look: Any) -> None:
    """Write a text below each moment of a strip."""
    for place, text in enumerate(labels):
        axes.text(place * strip.spacing, strip.bottom, text, ha="center", **look)


def add_legend_above(figure: Figure, axes: Axes, handles: Sequence[Artist]) -> None:
    """Write a legend above the panels: over an axes, or from edge to edge of a narrow picture."""
    if current_medium().is_narrow:
        figure.legend(handles=handles, loc="outside upper left", fontsize=6.5, borderaxespad=0.2)
        return
    place: Look = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderaxespad": 0.0}
    axes.legend(handles=handles, ncols=2, fontsize=7.5, **place)


def add_title(figure: Figure, title: str) -> None:
    """Write the title above the panels.

    A legend of the whole figure would get the same place: it takes the title as its own. A picture
    in a paper has none.
    """
    if current_medium().is_paper:
        return
    for legend in figure.legends[:1]:
        legend.set_title(title)
        legend.get_title().set_fontsize(_TITLE_SIZE)
        legend.get_title().set_parse_math(False)
        legend.set_alignment("left")
        return
    if figure.get_suptitle() != title:
        figure.suptitle(title, x=0.01, ha="left", fontsize=_TITLE_SIZE, parse_math=False)


def add_footer(figure: Figure, sign: str, references: Sequence[str]) -> None:
    """Write the sign convention and the references in full below the panels of a report."""
    if current_medium().is_paper:
        return
    parts = [sign, *(f"[{number}] {text}" for number, text in enumerate(references, start=1))]
    lines = [fill(part, _FOOTER_LINE_LENGTH, subsequent_indent="     ") for part in parts]
    figure.supxlabel(
        "\n".join(lines), fontsize=_FOOTER_FONT_SIZE, x=0.01, ha="left", parse_math=False
    )


def draw_plate(plate: Plate) -> DrawnPlate:
    """Draw a plate with its title; the same plate gives the same bytes."""
    is_paper = current_medium().is_paper
    with plot_style():
        add_title(plate.figure, plate.title)
        if is_paper:
            prepare_for_paper(plate.figure)
    return DrawnPlate(
        name=plate.name,
        title=plate.title,
        caption=plate.caption,
        sign=plate.sign,
        # A numpy scalar would pull numpy into every process that the claim is sent to.
        claims=tuple(replace(claim, measured=float(claim.measured)) for claim in plate.claims),
        references=plate.references,
        svg=render_figure(plate.figure, "svg"),
        png=render_figure(plate.figure, "png"),
        tables=table_files(plate),
        pdf=render_figure(plate.figure, "pdf") if is_paper else None,
    )
