"""Links: values of the keys, limits of the format, and no text breaks the reader."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import Source
from generator.input_files.links import LINK_ENTRIES, LinkEntry, LinksFile


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
    content = LINK_ENTRIES.parse_text(text).value
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
    reading = LINK_ENTRIES.parse(Source("my.links.toml", text))
    assert reading.value is None
    fault = next(fault for fault in reading.diagnostics if said in fault.message)
    assert fault.span is not None
    assert (fault.span.line, fault.span.column) == place


@given(st.text() | st.text("[]=\"'{}#\n link dof factor control joints 1-.e", max_size=300))
def test_no_text_breaks_the_reader(text):
    reading = LINK_ENTRIES.parse_text(text)
    assert (reading.value is None) == any(f.severity.value == "error" for f in reading.diagnostics)
