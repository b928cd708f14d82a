"""Reading links, and writing them back."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.input_files.links import (
    MAX_LINK_FACTOR,
    LinkEntry,
    LinksFile,
    parse_links,
    write_links,
)

NAMES = st.text(st.characters(exclude_categories=["Cs"]), max_size=25)
NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
PLACES = st.none() | st.integers(0, 10**6)

BOUNDED = st.floats(-0.999 * MAX_LINK_FACTOR, 0.999 * MAX_LINK_FACTOR)
"""Factors, and offsets that a conversion to degrees does not take over the edge."""


@st.composite
def entries(draw):
    mirror = draw(st.booleans())
    offset, is_length = (0.0, False) if mirror else draw(st.tuples(BOUNDED, st.booleans()))
    return LinkEntry(
        joints=tuple(draw(st.lists(NAMES, min_size=1, max_size=4))),
        control=draw(NAMES),
        dof=None if mirror else draw(PLACES),
        control_dof=None if mirror else draw(PLACES),
        factor=draw(BOUNDED.filter(bool)),
        mirror=mirror,
        offset=offset + 0.0,
        offset_is_length=is_length,
        why=draw(NAMES),
    )


FILES = st.builds(
    LinksFile, st.lists(entries(), min_size=1, max_size=5).map(tuple), st.none() | NAMES
)


@given(FILES)
def test_what_is_written_reads_back_equal(content):
    try:
        text = write_links(content, comment="two\nlines")
    except ValueError:
        return  # a number of degrees that no float holds, or a long line
    reading = parse_links(text)
    assert reading.diagnostics == ()
    assert reading.value == content


def test_nearly_all_files_can_be_written():
    content = LinksFile((LinkEntry(("b",), "a", 0, 2, -1e-300, False, 1.5, False, "it is so"),))
    assert parse_links(write_links(content)).value == content
    with pytest.raises(ValueError, match="finite"):
        write_links(LinksFile((LinkEntry(("b",), "a", factor=np.inf),)))
    with pytest.raises(ValueError, match="at most 1000 characters"):
        write_links(LinksFile((LinkEntry(("b" * 1000,), "a"),)))


def test_values_and_what_is_left_out():
    text = """
figure = "prototype"
[[link]]
joints = ["right_elbow", "right_knee"]
control = "left_elbow"
[[link]]
joints = ["left_hip_joint"]
control = "waist"
dof = 3
control_dof = 2
factor = -0.5
offset_deg = 90
why = "they belong together"
[[link]]
joints = ["slider"]
control = "screw"
offset_m = 0.2
"""
    content = parse_links(text).value
    assert content == LinksFile(
        (
            LinkEntry(("right_elbow", "right_knee"), "left_elbow"),
            LinkEntry(
                ("left_hip_joint",), "waist", 2, 1, -0.5, False, np.pi / 2, False,
                "they belong together",
            ),
            LinkEntry(("slider",), "screw", offset=0.2, offset_is_length=True),
        ),
        "prototype",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("text", "place", "said"),
    [
        ("x = " + "[" * 900, (1, 1), "nested too deeply"),
        ("# " + "x" * 1000, (1, 1001), "too long for a links file"),
        ("#\n" * 60_000, (50_001, 1), "too long for a links file"),
    ],
)
def test_what_is_wrong_is_told_with_its_place(text, place, said):
    reading = parse_links(text, "my.links.toml")
    assert reading.value is None
    fault = next(fault for fault in reading.diagnostics if said in fault.message)
    assert fault.span is not None
    assert (fault.span.line, fault.span.column) == place


@given(st.text() | st.text("[]=\"'{}#\n link dof factor control joints 1-.e", max_size=300))
def test_no_text_breaks_the_reader(text):
    reading = parse_links(text)
    assert (reading.value is None) == any(f.severity.value == "error" for f in reading.diagnostics)
