"""A plate becomes files: pictures of the same bytes each time, and numbers that can be read."""

from collections.abc import Mapping
from dataclasses import replace
from io import StringIO
from xml.etree import ElementTree

import numpy as np
import pytest

from plots.canvas import draw_plate, render_figure
from plots.plate import DrawnPlate, Plate
from tests.tiny_plates import ANGLES, damper, spring


@pytest.fixture(scope="module")
def drawn() -> DrawnPlate:
    return draw_plate(spring())


@pytest.fixture(scope="module")
def tables() -> Mapping[str, str]:
    return draw_plate(damper()).tables


def test_the_files_of_a_plate(drawn: DrawnPlate, tables: Mapping[str, str]):
    assert list(drawn.files) == ["spring.svg", "spring.png", "spring.csv"]
    assert list(tables) == ["damper.slow.csv", "damper.fast.csv"]


def test_the_pictures_are_pictures(drawn: DrawnPlate):
    assert ElementTree.fromstring(drawn.svg).tag == "{http://www.w3.org/2000/svg}svg"
    assert drawn.png.startswith(b"\x89PNG\r\n\x1a\n")


def test_every_picture_has_its_title_and_the_same_bytes_each_time(drawn: DrawnPlate):
    plate = spring()
    assert draw_plate(plate) == drawn
    assert plate.figure.get_suptitle() == plate.title
    (above,) = (text for text in plate.figure.texts if text.get_text() == plate.title)
    assert above.get_position()[1] > plate.figure.axes[0].get_position().y1
    assert draw_plate(plate) == drawn


def test_a_legend_of_the_whole_figure_takes_the_title_in():
    plate = spring()
    plate.figure.legend(loc="outside upper center")
    assert draw_plate(plate) == draw_plate(plate)
    (legend,) = plate.figure.legends
    assert legend.get_title().get_text() == plate.title
    assert plate.figure.get_suptitle() == ""


def test_the_last_digits_of_a_layout_do_not_count():
    figure = spring().figure
    render_figure(figure, "svg")
    (axes,) = figure.axes
    bounds = axes.get_position().bounds
    assert bounds == pytest.approx([round(value, 6) for value in bounds], abs=1e-12)
    assert bounds[1] > 0.2  # there is room for the label below: the axes were laid out


def test_a_drawn_plate_has_plain_numbers(drawn: DrawnPlate):
    assert {type(claim.measured) for claim in drawn.claims} == {float}


def test_the_head_of_a_table(drawn: DrawnPlate, tables: Mapping[str, str]):
    lines = drawn.tables["spring.csv"].splitlines()
    assert lines[:4] == [
        "# A spring <b>& its moment</b>",
        "# M is positive in flexion.",
        "# References: A. Author & B. Author, <Springs>, 1989; Another, 1990",
        'angle [deg],"moment, of the spring [N m]"',
    ]
    assert len(lines) == 4 + len(ANGLES)
    lines = tables["damper.slow.csv"].splitlines()
    assert lines[0] == "# A damper: slow"
    assert lines[2] == "# References: none"


def test_a_table_is_read_back(drawn: DrawnPlate, tables: Mapping[str, str]):
    rows = np.loadtxt(StringIO(drawn.tables["spring.csv"]), delimiter=",", skiprows=4)
    assert rows[:, 0] == pytest.approx(ANGLES)
    assert rows[:, 1] == pytest.approx(-2.0 * np.radians(ANGLES), rel=1e-8)
    text = StringIO(tables["damper.slow.csv"])
    named = np.genfromtxt(text, delimiter=",", names=True, skip_header=3)
    assert named["moment_N_m"] == pytest.approx(0.1 * ANGLES)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": "a/b"}, "`a/b` names files"),
        ({"name": "Knee"}, "`Knee` names files"),
        ({"tables": {}}, "has no tables"),
        ({"sign": ""}, "has no sign"),
        ({"tables": {"": {"a [deg]": ANGLES, "b [deg]": ANGLES[1:]}}}, "differ in length"),
        ({"tables": {"": {}}}, "differ in length"),
        ({"tables": {"": {"a [deg]": np.zeros((2, 2))}}}, "differ in length"),
        ({"tables": {"": {"a [deg]": ANGLES}, "b": {"a [deg]": ANGLES}}}, "`` names files"),
    ],
)
def test_a_plate_that_cannot_be_written_is_refused(changes: dict[str, object], message: str):
    plate: Plate = spring()
    with pytest.raises(ValueError, match=message):
        replace(plate, **changes)
