from dataclasses import replace
from math import inf, pi, radians, sqrt

import numpy as np
import pytest

from generator import read_figure, read_springs
from generator.joint_chain import build_chain
from generator.losses import Losses
from generator.model_files.fit_error import (
    FitError,
    FitErrors,
    are_in_range,
    format_range,
    format_size,
    joint_ranges,
    normal_ends,
    orientation_error,
    orientations,
)
from generator.passive_curve import rotation_vector
from generator.units import TRANSLATION_UNITS
from springs import AxisSpring, JointSprings
from springs.smooth_limit import SmoothLimit
from tests.chains import chain, one_body


def test_error_of_differences() -> None:
    error = FitError.from_differences([3.0, -4.0, 0.0])
    assert error.largest == 4.0
    assert error.rms == pytest.approx(sqrt(25.0 / 3.0))
    assert str(error) == "4 N m at most, 2.9 N m rms"
    assert str(FitError(1234.4, 99.6)) == "1234 N m at most, 100 N m rms"
    assert str(FitError.from_differences([2.0], "N")) == "2 N at most, 2 N rms"
    assert format_size(3.2e13) == "3.2e+13"


def test_the_largest_errors_are_first_and_equal_ones_are_named_together() -> None:
    errors, losses = FitErrors(), Losses("model")
    errors.add("springs err", "left_knee", FitError(2.0, 1.0))
    errors.add("springs err", "neck", FitError(30.0, 4.0), " over -5 to 5 deg")
    errors.add("springs err", "right_knee", FitError(2.0, 1.0))
    errors.report(losses)
    (loss,) = losses.entries
    assert loss.where == (
        "neck (30 N m at most, 4 N m rms over -5 to 5 deg)",
        "left_knee and right_knee (2 N m at most, 1 N m rms)",
    )


def test_orientations_have_their_rotation_vectors_in_the_range() -> None:
    """The largest size is at a corner of the range, which no sample at random reaches."""
    ranges = ((-0.3, 0.8), (-1.1, 1.2), (-0.6, 2.0))
    joint = build_chain(chain("Rx Ry Rz"))
    vectors = rotation_vector(joint, orientations(joint, ranges))
    low, high = np.array(ranges).T
    assert len(vectors) > 1000
    assert (vectors >= low - 1e-8).all()
    assert (vectors <= high + 1e-8).all()

    def steep(displacements: np.ndarray) -> np.ndarray:
        return np.exp(5.0 * rotation_vector(joint, displacements).sum(axis=1))

    error = orientation_error(steep, joint, ranges, "N")
    assert np.exp(5.0 * vectors.sum(axis=1)).max() < 0.95 * error.largest
    trials = np.random.default_rng(1).uniform(low, high, (200_000, 3))
    inside = are_in_range(joint, ranges, trials)
    assert error.largest >= steep(trials[inside]).max()
    assert error.unit == "N"


def test_a_joint_that_is_locked_beside_zero_has_orientations() -> None:
    ranges = ((0.4, 0.4), (0.5, 0.5), (-0.3, -0.3))
    joint = build_chain(chain("Rx Ry Rz"))
    assert orientations(joint, ranges)[0] == pytest.approx([0.4, 0.5, -0.3])


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
    assert format_range((-0.05, 0.1), TRANSLATION_UNITS) == "-5 to 10 cm"
