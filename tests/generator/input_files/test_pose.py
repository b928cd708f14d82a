"""Pose files: units of displacements, all that is wrong, and no text breaks the reader."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from generator import build_tree, initial_displacements, read_figure
from generator.cli.options import displacements_from_options, velocities_from_options
from generator.diagnostics import ModelError, UsageError, select_errors
from generator.figure_file.write import write_pose
from generator.input_files.pose import POSE_FILE, read_pose
from generator.kinematics.free_root import detach_root, settable_joints
from generator.kinematics.placement import checked_joint_values
from tests.chains import chain, row
from tests.paths import FAULTS

SLIDING = row(3, (chain("Rx Ry Rz Tx Ty Tz"), chain("Ts"), ()))


@cache
def prototype():
    return read_figure("prototype")


def read(text, figure=None):
    reading = POSE_FILE.parse_text(text, figure or prototype())
    assert not reading.diagnostics, "\n".join(map(str, reading.diagnostics))
    return {name: tuple(values) for name, values in reading.value.items()}


def test_a_pose_by_example():
    text = """
    joint left_knee { displacement = (30deg); }   # bent
    joint waist { displacement = (0.1rad,0,-90deg); }
    joint right_knee { displacement = 1e1deg; }
    """
    found = read(text)
    assert list(found) == ["left_knee", "waist", "right_knee"]
    assert found["left_knee"] == pytest.approx((np.pi / 6,), rel=1e-15)
    assert found["waist"] == (0.1, 0.0, -np.pi / 2)
    assert found["right_knee"] == pytest.approx((np.pi / 18,), rel=1e-15)
    assert all(
        values.dtype == float for values in POSE_FILE.parse_text(text, prototype()).value.values()
    )


def test_lengths_and_angles_of_a_sliding_joint():
    found = read("joint joint0 { displacement = (90deg,0,0,1cm,2,3m); }", SLIDING)
    assert found == {"joint0": (np.pi / 2, 0.0, 0.0, 0.01, 0.02, 3.0)}


def test_three_values_of_an_elastic_neck_are_its_rotations():
    """In pose files, options and Python; not where its translations are not zero."""
    person = read_figure("male50")
    turns = np.radians((10.0, 20.0, -30.0))
    text, option = "joint neck { displacement = (10deg,20deg,-30deg); }", ["neck=10,20,-30"]
    stated = displacements_from_options("--set", option, settable_joints(person))
    checked = checked_joint_values(person, {"neck": turns})
    for values in (read(text, person)["neck"], stated["neck"], checked["neck"]):
        assert values == pytest.approx((*turns, 0.0, 0.0, 0.0))
    neck = replace(person.joints["neck"], displacement=(0.0, 0.0, 0.0, 0.0, 0.1, 0.0))
    moved = person.with_parts(neck)
    (fault,) = POSE_FILE.parse_text(text, moved).diagnostics
    assert fault.message == "3 values instead of 6"
    with pytest.raises(UsageError, match=r"takes 6 values \(deg,deg,deg,cm,cm,cm\), not 3"):
        displacements_from_options("--set", option, settable_joints(moved))
    with pytest.raises(ModelError, match="has 6 displacements, not 3"):
        checked_joint_values(moved, {"neck": turns})


def test_the_velocity_of_a_free_segment_has_six_values():
    free, _ = detach_root(prototype(), initial_displacements(build_tree(prototype())))
    (name,) = free.joints.keys() - prototype().joints.keys()
    with pytest.raises(UsageError, match="takes 6 values"):
        velocities_from_options([f"{name}=1,2,3"], prototype(), free_root=True)
    with pytest.raises(ModelError, match="has 6 displacements, not 3"):
        checked_joint_values(free, {name: (1.0, 2.0, 3.0)})


def test_only_what_is_given_is_written():
    text = write_pose(prototype(), {"left_knee": (0.5,)})
    assert text == "joint left_knee {\n  displacement = (0.5rad);\n}\n"


def test_a_figure_without_freedoms_has_an_empty_pose():
    rigid = row(2, ((),))
    assert read(write_pose(rigid, {name: () for name in rigid.joints}), rigid) == {}


def test_what_the_language_cannot_say_is_not_written():
    with pytest.raises(ValueError, match="cannot write"):
        write_pose(prototype(), {"left_knee": (np.inf,)})


def test_warnings_pass():
    pose = read_pose(FAULTS / "pose/bare_angle.pose", prototype())
    assert pose["left_knee"] == pytest.approx([0.5])


WORDS = ["joint", "left_knee", "waist", "displacement", "figure", "type", "connect", "to", "site"]
MARKS = [*"{}();,=*./-#", "->", "/*", "*/", "\n", " ", '"', "30deg", "1", "nan", "T", "\0", "é"]


@given(st.lists(st.sampled_from([*WORDS, *MARKS]), max_size=40).map("".join) | st.text(max_size=60))
@example("joint waist {" * 9)
def test_no_text_breaks_the_reader(text):
    reading = POSE_FILE.parse_text(text, prototype())
    assert (reading.value is None) is bool(select_errors(reading.diagnostics))
    for fault in reading.diagnostics:
        assert fault.span is not None
        assert str(fault)


def test_very_long_files_and_deep_braces_end():
    many = POSE_FILE.parse_text("joint left_kne { displacement = (1deg); }\n" * 500, prototype())
    assert len(many.diagnostics) == 100
    deep = POSE_FILE.parse_text("joint left_knee " + "{" * 5000, prototype())
    assert deep.value is None
