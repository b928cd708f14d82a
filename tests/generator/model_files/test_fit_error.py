from dataclasses import replace
from math import inf, pi, radians, sqrt

import pytest

from generator import read_figure, read_springs
from generator.model_files.fit_error import FitError, format_range, joint_ranges
from springs import JointSprings


def test_error_of_differences() -> None:
    error = FitError.from_differences([3.0, -4.0, 0.0])
    assert error.largest == 4.0
    assert error.rms == pytest.approx(sqrt(25.0 / 3.0))
    assert str(error) == "4 N m at most, 2.9 N m rms"


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


def test_range_as_text() -> None:
    assert format_range((-pi / 4, pi)) == "-45 to 180 deg"
    assert format_range((-0.05, 0.1), turns=False) == "-5 to 10 cm"
