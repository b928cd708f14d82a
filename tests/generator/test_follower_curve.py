"""Curves by which displacements follow others: values, derivatives and changes of units."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import ModelError
from generator.follower_curve import MAX_COEFFICIENTS, ORIGIN, CurveKind, FollowerCurve
from generator.rotations import Array

POLYNOMIAL, SPLINE = CurveKind.POLYNOMIAL, CurveKind.SIMM_SPLINE
CUBIC = FollowerCurve(POLYNOMIAL, (0.3, -1.0, 2.0, 0.5))
BENT = FollowerCurve(SPLINE, (-2.0, 1.0, -1.2, 0.4, -0.4, 0.7, 0.1, -0.3, 0.5, 0.2, 1.4, 0.0))
PLACES = np.array([-3.0, -2.0, -1.7, -0.4, 0.05, 0.3, 1.39, 1.5, 4.0])

numbers = st.floats(-3.0, 3.0)


@st.composite
def curves(draw: st.DrawFn) -> FollowerCurve:
    """A polynomial or a spline."""
    if draw(st.booleans()):
        return FollowerCurve(POLYNOMIAL, tuple(draw(st.lists(numbers, min_size=1, max_size=6))))
    steps = draw(st.lists(st.floats(0.1, 1.0), min_size=2, max_size=8))
    x = np.cumsum(steps) - 1.0
    y = draw(st.lists(numbers, min_size=len(x), max_size=len(x)))
    return FollowerCurve(SPLINE, tuple(np.stack([x, y], axis=1).ravel()))


@pytest.mark.parametrize("curve", [CUBIC, BENT])
def test_derivatives_are_those_of_the_values(curve: FollowerCurve):
    step = 1e-5
    for order in (0, 1):
        difference = curve.at(PLACES + step, order) - curve.at(PLACES - step, order)
        inside = np.abs(PLACES[:, None] - curve.pieces[:, ORIGIN]).min(axis=1) > step
        found = curve.at(PLACES, order + 1)
        assert difference[inside] / (2.0 * step) == pytest.approx(found[inside], abs=1e-6)


def test_a_spline_passes_its_points_smoothly_and_goes_straight_on():
    x, y = np.array(BENT.numbers[::2]), np.array(BENT.numbers[1::2])
    assert BENT.at(x) == pytest.approx(y, abs=1e-14)
    for order in (0, 1, 2):
        before = BENT.at(x[1:-1], order, BENT.places(x[1:-1]) - 1)
        assert before == pytest.approx(BENT.at(x[1:-1], order), abs=1e-12)
    assert BENT.at(np.array([-9.0, 9.0]), 2) == pytest.approx([0.0, 0.0])
    assert BENT.at(x[-1] + 2.0) == pytest.approx(y[-1] + 2.0 * float(BENT.at(x[-1], 1)))


def test_a_cubic_through_its_points_is_the_spline():
    """Its third derivative is everywhere the same."""
    x = np.array([-1.0, -0.2, 0.3, 0.9, 2.0])
    points: Array = np.stack([x, CUBIC.at(x)], axis=1)
    spline = FollowerCurve(SPLINE, tuple(points.ravel()))
    inside = np.linspace(-1.0, 2.0, 40)
    assert spline.at(inside) == pytest.approx(CUBIC.at(inside), abs=1e-12)


@given(curves(), st.floats(0.2, 3.0), st.booleans(), st.floats(-2.0, 2.0))
def test_changes_of_units_change_the_values_alone(
    curve: FollowerCurve, size: float, is_reversed: bool, shift: float
):
    slope = -size if is_reversed else size
    same, scaled = curve.of_line(slope, shift), curve.scaled(slope, shift)
    expected, scale = curve.at(slope * PLACES + shift), 1.0 + np.abs(curve.at(PLACES)).max()
    largest = 1.0 + np.abs(expected).max()
    np.testing.assert_allclose(same.at(PLACES), expected, atol=1e-9 * largest)
    np.testing.assert_allclose(
        scaled.at(PLACES), slope * curve.at(PLACES) + shift, atol=1e-9 * scale
    )


@pytest.mark.parametrize(
    ("kind", "given_numbers", "said"),
    [
        (POLYNOMIAL, (), "1 to 20 coefficients"),
        (POLYNOMIAL, (0.0,) * (MAX_COEFFICIENTS + 1), "1 to 20 coefficients"),
        (POLYNOMIAL, (0.0, float("nan")), "not finite"),
        (SPLINE, (0.0, 1.0), "2 to 1000 points"),
        (SPLINE, (0.0, 1.0, 2.0, 1.0, 3.0), "2 to 1000 points"),
        (SPLINE, (0.0, 1.0, 0.0, 2.0), "increasing x"),
        (SPLINE, (0.0, 1e300, 1e-300, -1e300), "too steep"),
    ],
)
def test_what_is_no_curve_is_refused(kind: CurveKind, given_numbers: tuple[float, ...], said: str):
    with pytest.raises(ModelError, match=said):
        FollowerCurve(kind, given_numbers)
