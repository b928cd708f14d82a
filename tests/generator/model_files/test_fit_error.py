from dataclasses import replace
from math import inf, pi, radians, sqrt

import pytest

from generator import read_figure, read_springs
from generator.model_files.fit_error import FitError, format_range, joint_ranges, normal_ends
from springs import AxisSpring, JointSprings
from springs.smooth_limit import SmoothLimit
from tests.chains import chain, one_body


def test_error_of_differences() -> None:
    error = FitError.from_differences([3.0, -4.0, 0.0])
    assert error.largest == 4.0
    assert error.rms == pytest.approx(sqrt(25.0 / 3.0))
    assert str(error) == "4 N m at most, 2.9 N m rms"
    assert str(FitError(1234.4, 99.6)) == "1234 N m at most, 100 N m rms"


def test_ranges_are_limits_else_those_of_the_springs() -> None:
    figure = read_figure("prototype")
    springs = read_springs(None, figure)
    elbow, hip = figure.joints["left_elbow"], figure.joints["left_hip_joint"]
    bare = replace(elbow, lower_limit=None, upper_limit=None)
    limited = replace(elbow, lower_limit=(-0.1,), upper_limit=(0.2,))
    none = JointSprings("left_elbow")
    assert joint_ranges(limited, none) == ((-0.1, 0.2),)
    assert joint_ranges(bare, none) == ((-pi / 2, pi / 2),)
    ((low, high),) = joint_ranges(bare, springs.joints["left_elbow"])
    assert low < 0.0 < radians(140.0) < max(-low, high)
    ranges = joint_ranges(hip, springs.joints["left_hip_joint"])
    assert len(ranges) == 3
    assert all(-inf < low < high < inf for low, high in ranges)
    assert max(max(-low, high) for low, high in ranges) > radians(100.0)


def test_ranges_hold_the_displacement_of_the_figure() -> None:
    elbow = read_figure("prototype").joints["left_elbow"]
    bent = replace(elbow, displacement=(3.0,), lower_limit=(-0.1,), upper_limit=(0.2,))
    assert joint_ranges(bent, JointSprings("left_elbow")) == ((-0.1, 3.0),)


def test_an_infinite_limit_is_no_end_of_a_range() -> None:
    hinge = one_body(chain("Rx"), lower_limit=(-inf,), upper_limit=(0.4,)).joints["pin"]
    assert joint_ranges(hinge, JointSprings("pin")) == ((-pi / 2, 0.4),)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_ranges_are_as_wide_as_the_law_is_known(sense: float) -> None:
    law = SmoothLimit(-0.2, 0.4, 20.0, 30.0, 0.3, (radians(-20.0), radians(100.0)))
    spring = AxisSpring((sense, 0.0, 0.0), (law,), motion="bending")
    hinge = one_body(chain("Rx")).joints["pin"]
    ((low, high),) = joint_ranges(hinge, JointSprings("pin", (spring,)))
    expected = (-20.0, 100.0) if sense > 0.0 else (-100.0, 20.0)
    assert (low, high) == pytest.approx(tuple(map(radians, expected)))


def test_a_spring_without_a_motion_leaves_the_normal_range_to_another() -> None:
    elbow = read_figure("prototype").joints["left_elbow"]
    axis = elbow.chain[0].axis
    named, other = AxisSpring(axis, motion="flexion"), AxisSpring(axis)
    for springs in ((named, other), (other, named)):
        assert None not in normal_ends(elbow, JointSprings("left_elbow", springs), 0)


def test_range_as_text() -> None:
    assert format_range((-pi / 4, pi)) == "-45 to 180 deg"
    assert format_range((-0.05, 0.1), turns=False) == "-5 to 10 cm"
