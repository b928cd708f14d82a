"""Links: values of the keys, limits of the format, and no text breaks the reader."""

import numpy as np

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
