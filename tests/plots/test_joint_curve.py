"""Readings of a joint: zeros, stops, and differences from published curves."""

from dataclasses import replace
from math import degrees, isnan, radians

import numpy as np
import pytest

from plots import joint_curve
from plots.joint_curve import JointCurve, first_zero_crossing, format_range, read_curve
from plots.literature import literature_from_points, published_curve
from springs import AxisSpring, Cubic
from springs.published.reference import Reference, Sample, Sureness
from tests.plots import drawn

SOURCE = Reference("invented for this test", Sureness.PAGE)
ANGLES = np.radians(np.arange(-90.0, 91.0, 1.0))
SPRING = AxisSpring((0.0, 1.0, 0.0), (Cubic((0.0, 20.0, 0.0, 0.0)),), motion="flexion")


def curve(torques: np.ndarray) -> JointCurve:
    return JointCurve("made", SPRING, ANGLES, torques, None, None, None)


def test_where_a_torque_changes_its_sign() -> None:
    assert curve(-3.0 * (ANGLES - 0.1234)).zero_crossing(-1.0, 1.0) == pytest.approx(0.1234)
    assert isnan(curve(np.ones_like(ANGLES)).zero_crossing(-1.0, 1.0))
    assert first_zero_crossing(np.array([0.0, 1.0, 2.0]), np.array([1.0, 0.0, -1.0])) == 1.0


def test_where_a_joint_stops() -> None:
    made = curve(-20.0 * ANGLES)
    assert made.resistance_angle(1, 10.0) == pytest.approx(0.5)
    assert made.resistance_angle(-1, 10.0) == pytest.approx(-0.5)
    assert isnan(curve(0.0 * ANGLES).resistance_angle(1, 10.0))
    assert curve(-20.0 + 0.0 * ANGLES).resistance_angle(1, 10.0) == 0.0


def test_a_torque_that_drives_on_is_no_stop() -> None:
    assert isnan(curve(20.0 * ANGLES).resistance_angle(1, 10.0))


def test_differences_from_points_are_taken_at_the_points() -> None:
    made = curve(-20.0 * ANGLES)
    points = tuple((radians(a), 1.0) for a in (-10.0, 0.5, 20.0, 80.0))
    made_of = literature_from_points(points, "made", SOURCE, Sample())
    published, less = made.compare_with(made_of, radians(-5.0), radians(30.0))
    assert published == pytest.approx([1.0, 1.0])
    assert less == pytest.approx([-20.0 * radians(0.5) - 1.0, -20.0 * radians(20.0) - 1.0])


def test_differences_are_left_out_where_nothing_is_published() -> None:
    made = curve(-20.0 * ANGLES)
    half = published_curve("han_2010/flexion", "Han", side=1)
    published, less = made.compare_with(half, radians(-30.0), radians(30.0))
    assert published.size == less.size == 31


@pytest.fixture
def few_angles(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(joint_curve, "SWEEP", np.arange(-60.0, 61.0, 20.0))


def test_a_curve_is_read_at_the_edges_of_its_dead_zone_and_of_the_normal_range() -> None:
    made = drawn.data("knee")
    for angle in (0.0, 1.553, radians(137.7), radians(-1.0)):
        assert np.min(np.abs(made.angles - angle)) < 1e-7
    assert made.simulated.shape == made.angles.shape == made.law_torques.shape


@pytest.mark.usefixtures("few_angles")
def test_the_right_side_may_be_read_as_well() -> None:
    left, right = (read_curve(f"{side}_hip_joint", "medial rotation") for side in ("left", "right"))
    assert np.max(np.abs(left.simulated - right.simulated)) < 1e-9
    assert np.ptp(right.simulated) > 10.0
    assert right.other_side_torques is None


@pytest.mark.usefixtures("few_angles")
def test_other_joints_may_be_held() -> None:
    made = read_curve("left_hip_joint", "flexion", {"left_knee": 100.0})
    assert made.held_text == "left_knee at 100 deg"
    # The knee's torque acts between thigh and shank: the hip's does not see it.
    assert np.max(np.abs(made.simulated - made.law_torques)) < 1e-9


def test_the_printed_cubic_has_no_dead_zone() -> None:
    made = drawn.data("elbow")
    assert made.printed_torques(np.array([0.0, 1.0])) == pytest.approx([-1.014, -238.52215])


def test_an_unknown_end_of_the_normal_range_is_zero() -> None:
    made = replace(drawn.data("shoulder_abduction"), low=None)
    assert [round(degrees(end), 6) for end in made.normal_range] == [0.0, 184.0]


def test_a_range_in_words() -> None:
    assert format_range(radians(-0.8), radians(144.64)) == "-0.8 to 144.6 deg"


@pytest.mark.parametrize("angles", [ANGLES[::-1], ANGLES[:-1], ANGLES * 0.0])
def test_readings_that_do_not_belong_together_are_refused(angles) -> None:
    with pytest.raises(ValueError, match="angle"):
        JointCurve("made", SPRING, angles, np.zeros_like(ANGLES), None, None, None)
