"""Coordinates of the model that a figure is from."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator import read_figure
from generator.input_files.coordinates import (
    COORDINATE_NAMES,
    MAX_SCALE,
    MAX_SHIFT,
    MIN_SCALE,
    NO_COORDINATES,
    CoordinateMapping,
    coordinates_of_figure,
    displacement_columns,
    write_coordinates,
)

FIGURE = read_figure("prototype")
PLACES = [(joint, k) for joint, one in FIGURE.joints.items() for k in range(len(one.chain))]
CHAINS = {name: joint.chain for name, joint in FIGURE.joints.items()}
TABLE = '[[coordinate]]\nname = "{name}"\njoint = "{joint}"\nplace = {place}\n'


@st.composite
def coordinates(draw: st.DrawFn) -> dict[str, CoordinateMapping]:
    places = draw(st.lists(st.sampled_from(PLACES), unique=True))
    words = st.text(
        st.characters(exclude_categories=["C", "Z"], exclude_characters='"\\'),
        min_size=1,
        max_size=20,
    )
    names = draw(st.lists(words, unique=True, min_size=len(places), max_size=len(places)))
    numbers = st.floats(-0.99 * MAX_SHIFT, 0.99 * MAX_SHIFT), st.floats(MIN_SCALE, MAX_SCALE)
    return {
        name: CoordinateMapping(*place, *map(draw, numbers))
        for name, place in zip(names, places, strict=True)
    }


@given(coordinates())
def test_what_was_written_is_read(content: dict[str, CoordinateMapping]):
    text = write_coordinates(content, FIGURE)
    assert COORDINATE_NAMES.parse_text(text, FIGURE).require_value() == content


@given(coordinates())
def test_each_displacement_has_one_column(content: dict[str, CoordinateMapping]):
    columns = displacement_columns(CHAINS, content)
    assert [(at.joint, at.index) for at in columns.values()] == PLACES
    assert content.items() <= columns.items()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (TABLE.format(name="a", joint="knee", place=1), "the figure has no joint `knee`"),
        (TABLE.format(name="a", joint="waist", place=4), "`waist` has 3 displacements"),
        (TABLE.format(name="a b", joint="waist", place=1), "blanks, or no letters, in `a b`"),
        (TABLE.format(name="a", joint="waist", place=1) + "shift_m = 1", "the key `shift_deg`"),
        (TABLE.format(name="a", joint="waist", place=1) + "scale = 0", "must be from 1e-09"),
        (
            TABLE.format(name="a", joint="waist", place=1)
            + TABLE.format(name="a", joint="waist", place=2),
            "a second coordinate `a`",
        ),
        (
            TABLE.format(name="a", joint="waist", place=1)
            + TABLE.format(name="b", joint="waist", place=1),
            "this displacement is `a` already",
        ),
        ("[[coordinates]]\n", "unknown key `coordinates`"),
    ],
)
def test_errors_have_a_place(text: str, message: str):
    parsed = COORDINATE_NAMES.parse_text(text, FIGURE)
    assert parsed.value is None
    assert any(message in one.message and one.span for one in parsed.diagnostics)


def test_a_figure_without_the_file_has_its_own_names(tmp_path: Path):
    assert coordinates_of_figure(FIGURE) == NO_COORDINATES
    assert list(displacement_columns(CHAINS, NO_COORDINATES))[:2] == ["waist_1", "waist_2"]
