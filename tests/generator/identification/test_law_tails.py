"""Tails of the elastic laws of a motion."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.identification.fit import fit_springs
from generator.identification.law_tails import TORQUE_CHANGE, LawTail, change_tail, find_tails
from generator.study.parameter_paths import Case
from springs import Stop, total_torque
from tests.swings import ALONE, TRUTH, leg_case, paths, standard_fit, swing

COLUMNS = (("left_knee", 0),)


def tails_of(series: np.ndarray, case: Case | None = None) -> list[LawTail]:
    return list(find_tails(case or leg_case(), COLUMNS, np.radians(series)[:, None]))


def ends(tails: list[LawTail]) -> list[tuple[float, float]]:
    return [(round(np.degrees(one.inner), 6), round(np.degrees(one.end), 6)) for one in tails]


@given(
    start=st.floats(20.0, 55.0),
    decay=st.floats(0.5, 0.95),
    held=st.integers(0, 5),
)
def test_a_tail_is_where_the_swing_passed_once(start: float, decay: float, held: int):
    """Turning points are at start, -start d, start d^2, ...: the second of a side ends a tail."""
    peaks = start * decay ** np.arange(8) * (-1.0) ** np.arange(8)
    quarter = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, 20, endpoint=False)))
    halves = [a + (b - a) * quarter for a, b in pairwise(peaks)]
    series = np.concatenate([np.full(held, start), *halves, peaks[-1:]])
    expected = [(-start * decay**3, -start * decay), (start * decay**2, start)]
    np.testing.assert_allclose(ends(tails_of(series)), expected, atol=1e-4)


def test_a_motion_that_does_not_come_back_is_one_tail_from_each_end():
    assert ends(tails_of(np.linspace(50.0, 10.0, 30))) == [(50.0, 10.0), (10.0, 50.0)]


def test_a_tail_begins_where_the_law_was_measured():
    swung = np.array([70.0, -66.0, 68.0, -64.0, 66.0])
    low, high = tails_of(swung)
    assert ends([low, high]) == [(-60.0, -66.0), (68.0, 70.0)]
    assert low.is_extrapolated
    assert not high.is_extrapolated


def test_a_joint_without_an_elastic_law_has_no_tails():
    case = leg_case()
    bare = case.with_springs(replace(case.springs, joints={}))
    assert tails_of(np.array([50.0, -20.0, 40.0]), bare) == []


@pytest.mark.parametrize("is_opposite", [False, True])
@pytest.mark.parametrize(("inner", "end"), [(20.0, 50.0), (-10.0, -40.0)])
def test_the_torque_of_a_tail_changes_at_its_end_and_not_before(
    inner: float, end: float, is_opposite: bool
):
    case = leg_case()
    own = case.springs.joints["left_knee"]
    (axis,) = own.axes
    axis = replace(axis, elastic=(*axis.elastic, Stop(-1.2, 1.2, 100.0)))
    if is_opposite:
        axis = axis.with_opposite_axis()
    springs = replace(case.springs, joints={"left_knee": replace(own, axes=(axis,))})
    case = case.with_springs(springs)
    (changed,) = (
        change_tail(case, LawTail("left_knee", *np.radians([inner, end])))
        .springs.joints["left_knee"]
        .axes
    )
    sign = -1.0 if is_opposite else 1.0
    angles = sign * np.radians([-inner, inner, 0.5 * (inner + end), end])
    before = np.asarray(total_torque(axis.elastic, angles))
    after = np.asarray(total_torque(changed.elastic, angles))
    np.testing.assert_allclose(
        after, before * (1.0 + TORQUE_CHANGE * np.array([0.0, 0.0, 0.5, 1.0])), atol=1e-12
    )


def test_estimates_change_as_those_of_a_fit_with_the_changed_law():
    """The change is linear: a fit with the changed tail moves the estimates back by it."""
    fit = standard_fit()
    upper = fit.tails[1]
    other = fit_springs(change_tail(leg_case(), upper), swing(), paths(*TRUTH), ALONE)
    # The changed law is that at nominal values, whose torque is smaller than the fitted one.
    for one, moved, change in zip(
        fit.estimates[:2], other.estimates[:2], upper.changes[:2], strict=True
    ):
        assert moved.value - one.value == pytest.approx(change, rel=0.5, abs=one.sd)
