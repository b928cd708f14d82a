"""Joints beyond their ranges: ends of limits, boundaries of reaches, and their times."""

from dataclasses import replace

import numpy as np
import pytest

from generator import read_figure
from generator.kinematics.range_of_motion import RangeExcess, range_excesses
from generator.model import Model
from generator.model_files.formats import read_model
from generator.rotations import Array
from generator.units import ROTATION_UNITS
from springs import JointSprings, SpringSet
from tests.generator.model_files.imported_models import MODELS

MALE = Model.of(read_figure("male50"))
TIMES = np.linspace(0.0, 1.0, 101)
STILL = {
    name: np.tile(np.array(joint.displacement), (len(TIMES), 1))
    for name, joint in MALE.figure.joints.items()
}
VECTORS = {name: np.zeros((len(TIMES), 3)) for name in MALE.figure.joints}


def beyond(turned: Array, joint: str, column: int, model: Model = MALE) -> tuple[RangeExcess, ...]:
    """Excesses where a displacement of one joint is some angles [deg]."""
    values = STILL[joint].copy()
    values[:, column] = np.radians(turned)
    return range_excesses(model, TIMES, {**STILL, joint: values}, VECTORS)


def parabola(top: float, at: float) -> Array:
    """Angles with a largest one between two frames."""
    return top - 300.0 * (TIMES - at) ** 2


def test_a_person_who_stands_is_within_all_ranges() -> None:
    assert range_excesses(MALE, TIMES, STILL, VECTORS) == ()


def test_the_farthest_angle_is_that_between_two_frames() -> None:
    (found,) = beyond(parabola(158.7, 0.404), "left_knee", 0)
    assert (found.joint, found.motion, found.is_only) == ("left_knee", "flexion", True)
    assert np.degrees(found.beyond) == pytest.approx(21.0, abs=1e-9)
    assert found.time == pytest.approx(0.404, abs=1e-9)
    assert str(found) == "left_knee 21 deg beyond 137.7 deg (at 0.404 s)"


@pytest.mark.parametrize(
    ("angle", "text"),
    [
        (81.6, "waist 12 deg beyond 69.6 deg of lumbar flexion (at 0.5 s)"),
        (70.5, ""),
    ],
)
def test_joints_of_several_angles_name_the_motion(angle: float, text: str) -> None:
    assert "".join(map(str, beyond(parabola(angle, 0.5), "waist", 2))) == text


def test_the_lower_end_is_passed_downwards() -> None:
    (found,) = beyond(-parabola(30.0, 0.5), "left_hip_joint", 2)
    assert str(found) == "left_hip_joint 13 deg beyond -17.4 deg of flexion (at 0.5 s)"


def test_motion_that_turns_against_the_axis_has_the_limit_in_its_own_sense() -> None:
    own = MALE.springs.joints["left_knee"]
    axis = replace(own.axes[0], direction=tuple(-x for x in own.axes[0].direction))
    joints = {**MALE.springs.joints, "left_knee": JointSprings("left_knee", (axis,))}
    model = replace(MALE, springs=replace(MALE.springs, joints=joints, coupled=()))
    (found,) = beyond(parabola(158.7, 0.5), "left_knee", 0, model)
    assert found.limit == pytest.approx(-np.radians(137.7))


def test_shoulders_leave_their_reach_and_not_their_angles() -> None:
    vectors = VECTORS["left_shoulder"].copy()
    reach = MALE.springs.joints["left_shoulder"].reach
    assert reach is not None
    vectors[:, 0] = np.linspace(0.0, -2.5, len(TIMES))
    wrong = {**STILL, "left_shoulder": np.full_like(STILL["left_shoulder"], 3.0)}
    found = range_excesses(MALE, TIMES, wrong, {**VECTORS, "left_shoulder": vectors})
    depths = np.asarray(reach.depth(vectors))
    assert depths.max() > np.radians(5.0)
    (only,) = found
    assert only.beyond == pytest.approx(depths.max(), rel=1e-4)
    assert only.limit is None
    assert "deg beyond its reach (at" in str(only)


def test_excesses_come_in_their_order_in_metres_too() -> None:
    values = {name: rows.copy() for name, rows in STILL.items()}
    values["left_knee"][:, 0] = np.radians(parabola(140.0, 0.5))
    values["right_knee"][:, 0] = np.radians(parabola(150.0, 0.5))
    names = [one.joint for one in range_excesses(MALE, TIMES, values, VECTORS)]
    assert names == ["right_knee", "left_knee"]
    text = str(RangeExcess("rail", "", 0.1, 0.021, 0.5, ROTATION_UNITS))
    assert text.startswith("rail 1.2 deg beyond 5.73 deg")


def test_the_limit_of_a_follower_names_its_displacement() -> None:
    figure = read_model(MODELS / "knee.osim").figure
    knee = replace(figure.joints["knee"], upper_limit=(np.inf, np.inf, -0.6, np.inf))
    model = Model(figure.with_parts(knee), SpringSet({}))
    rows = {"knee": np.tile(knee.displacement, (3, 1))}
    (found,) = range_excesses(model, np.arange(3.0), rows, {})
    assert str(found).startswith("knee 16 cm beyond -60 cm of displacement 3 (at ")
