"""Loads in time: linear between their rows and zero outside."""

import numpy as np
import pytest

from generator.figure import SiteRef
from generator.loads import LoadKind, TimedLoad, constant_load

HAND = SiteRef("arm", "hand")


def ramp() -> TimedLoad:
    values = ((0.0, 0.0, 0.0), (4.0, -2.0, 1.0))
    return TimedLoad(HAND, LoadKind.GLOBAL_FORCE, (1.0, 3.0), values)


@pytest.mark.parametrize(
    ("time", "expected"),
    [
        (0.999, [0.0, 0.0, 0.0]),
        (1.0, [0.0, 0.0, 0.0]),
        (1.5, [1.0, -0.5, 0.25]),
        (3.0, [4.0, -2.0, 1.0]),
        (3.001, [0.0, 0.0, 0.0]),
    ],
)
def test_a_load_is_linear_between_its_rows_and_zero_outside(time: float, expected: list[float]):
    assert ramp().components(time).tolist() == expected


def test_many_times_are_taken_at_once():
    assert ramp().components(np.array([[0.0, 2.0], [2.5, 4.0]])).shape == (2, 2, 3)


def test_a_constant_load_acts_from_start_to_stop():
    load = constant_load(HAND, LoadKind.LOCAL_MOMENT, (1.0, 2.0, 3.0), 0.0, 2.0)
    assert load.components(1.234).tolist() == [1.0, 2.0, 3.0]
    assert load.components(2.1).tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("times", "values", "message"),
    [
        ((), (), "three components"),
        ((0.0, 1.0), ((0.0, 0.0, 0.0),), "three components"),
        ((0.0,), ((0.0, 0.0),), "three components"),
        ((0.0, 0.0), ((0.0,) * 3,) * 2, "must increase"),
        ((1.0, 0.0), ((0.0,) * 3,) * 2, "must increase"),
        ((0.0, np.nan), ((0.0,) * 3,) * 2, "finite"),
        ((0.0, 1.0), ((0.0,) * 3, (0.0, np.inf, 0.0)), "finite"),
    ],
)
def test_rows_that_are_no_load_are_refused(times: tuple, values: tuple, message: str):
    with pytest.raises(ValueError, match=message):
        TimedLoad(HAND, LoadKind.LOCAL_FORCE, times, values)


def test_the_kind_says_what_acts_and_in_whose_axes():
    assert [(k.value, k.is_force, k.is_local) for k in LoadKind] == [
        ("globalforce", True, False),
        ("localforce", True, True),
        ("globalmoment", False, False),
        ("localmoment", False, True),
    ]
