from math import inf, radians

import numpy as np
import pytest

from springs import Cubic, Linear, Stop, total_energy, total_torque
from springs.elastic import common_valid_range, describe_extrapolation, mirror_range, valid_range
from springs.exponential import Exponential
from springs.interpolated import Interpolated

LAWS = (Linear(10.0, 0.1), Cubic((1.0, 2.0, 3.0, 4.0)), Stop(-0.2, 0.2))


@pytest.mark.parametrize("angle", [-0.5, 0.0, 0.15, 0.6])
def test_laws_of_one_axis_add(angle):
    assert total_torque(LAWS, angle) == sum(law.torque(angle) for law in LAWS)
    assert total_energy(LAWS, angle) == sum(law.energy(angle) for law in LAWS)


def test_without_laws_there_is_no_torque_for_any_angle():
    angles = np.array([-1.0, 0.0, 2.0])
    assert total_torque((), angles).tolist() == [0.0, 0.0, 0.0]
    assert total_energy((), angles).tolist() == [0.0, 0.0, 0.0]
    assert total_torque((), 0.3) == total_energy((), 0.3) == 0.0


KNOWN = (radians(-15.0), radians(80.0))


def test_a_law_tells_its_range_if_it_has_one():
    assert valid_range(Exponential((), valid_range=KNOWN)) == KNOWN
    assert valid_range(Interpolated(((0.0, 1.0), (2.0, 0.0)))) == (0.0, 2.0)
    assert valid_range(Cubic((0.0, 1.0, 0.0, 0.0))) is None


def test_a_mirrored_range_ends_where_it_began():
    assert mirror_range((-0.5, 2.0)) == (-2.0, 0.5)
    assert mirror_range(None) is None


@pytest.mark.parametrize(
    ("low", "high", "said"),
    [
        (-15.0, 80.0, ""),
        (0.0, 10.0, ""),
        (-20.0, 80.0, "extrapolated at -20 .. -15 deg: the curve is known for -15 .. 80 deg only"),
        (0.0, 90.0, "extrapolated at 80 .. 90 deg: the curve is known for -15 .. 80 deg only"),
        (85.0, 90.0, "extrapolated at 85 .. 90 deg: the curve is known for -15 .. 80 deg only"),
        (
            -20.0,
            90.0,
            "extrapolated at -20 .. -15 deg and 80 .. 90 deg: "
            "the curve is known for -15 .. 80 deg only",
        ),
    ],
)
def test_going_beyond_is_said(low, high, said):
    assert describe_extrapolation(KNOWN, radians(low), radians(high)) == said


def test_an_open_end_is_never_passed():
    assert describe_extrapolation((0.0, inf), 0.0, 100.0) == ""
    assert "-10 .. 0 deg" in describe_extrapolation((0.0, inf), radians(-10.0), 1.0)


def test_an_unknown_range_is_said_to_be_unknown():
    assert "not known" in describe_extrapolation(None, 0.0, 1.0)


def test_laws_hold_together_where_all_of_them_are_known():
    one, other = (Exponential((), 1.0, known) for known in ((-1.0, 0.5), (-0.5, 2.0)))
    assert common_valid_range((one, *LAWS, other)) == (-0.5, 0.5)
    assert common_valid_range(LAWS) is None
