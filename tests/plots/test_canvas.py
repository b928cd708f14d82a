"""The sheet of a plate: what is drawn solid, what dotted, and that nothing leaves the sheet."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg

from plots.canvas import (
    LINE_STYLES,
    THESIS_STYLE,
    add_footer,
    create_panels,
    draw_curve,
    plot_style,
)

ANGLES = np.linspace(-40.0, 60.0, 101)


with plot_style():
    _, ((AXES,),) = create_panels(3.0, 1)


def drawn(known: tuple[float, float] | None) -> dict[str, np.ndarray]:
    """The angles [deg] of which a curve is drawn, by line style."""
    while AXES.lines:
        AXES.lines[0].remove()
    draw_curve(AXES, ANGLES, ANGLES**2, known, THESIS_STYLE, "curve")
    return {
        line.get_linestyle(): np.asarray(line.get_xdata())[~np.isnan(np.asarray(line.get_ydata()))]
        for line in AXES.lines
    }


def test_a_curve_is_dotted_beyond_its_range_and_has_no_gap() -> None:
    styles = drawn((np.radians(-20.0), np.radians(35.0)))
    assert styles["-"][[0, -1]] == pytest.approx([-20.0, 35.0])
    assert np.all((styles[":"] <= -20.0) | (styles[":"] >= 35.0))
    assert {-20.0, 35.0} <= set(np.round(styles[":"], 9))


def test_a_curve_of_unknown_range_is_dotted_throughout() -> None:
    styles = drawn(None)
    assert list(styles) == [":"]
    assert len(styles[":"]) == len(ANGLES)


def test_a_curve_within_its_range_is_not_dotted() -> None:
    assert list(drawn((-9.0, 9.0))) == ["-"]


@given(low=st.floats(-1.5, 1.5), width=st.floats(0.0, 2.0))
def test_every_point_of_a_curve_is_drawn(low, width) -> None:
    styles = drawn((low, low + width))
    assert set(np.concatenate(list(styles.values()))) == set(ANGLES)


def test_pens_differ_without_their_colours() -> None:
    assert len({(pen.dash, pen.marker) for pen in LINE_STYLES}) == len(LINE_STYLES)


def test_a_foot_of_long_lines_stays_on_the_sheet() -> None:
    with plot_style():
        figure, ((axes,),) = create_panels(4.0, 1)
        axes.plot([0.0, 1.0])
        add_footer(figure, "Positive is up. " * 30, ["A. Author, A Title, A Journal " * 12])
        FigureCanvasAgg(figure).draw()
        foot = figure.get_supxlabel()
        assert foot.count("\n") > 4
        (text,) = [t for t in figure.texts if t.get_text() == foot]
        box = text.get_window_extent()
    assert box.x0 >= 0.0
    assert box.x1 <= figure.bbox.x1
    assert box.y0 >= 0.0
