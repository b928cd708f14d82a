"""Laws as cubics, piece by piece."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator.model_files.piecewise import (
    FITTED_SHARE,
    FITTED_TORQUE,
    fit_piecewise_cubic,
    piecewise_cubic,
)
from springs import Cubic, Elastic, Linear, Stop, total_torque
from springs.exponential import Exponential, ExponentialTerm
from springs.interpolated import Interpolated
from springs.smooth_limit import SmoothLimit
from springs.transformed import Transformed
from tests.generator.model_files.model_cases import CURVES, OTHER_CURVES

NUMBER = st.floats(-50.0, 50.0).map(lambda x: round(x, 3))
ANGLE = st.floats(-2.0, 2.0).map(lambda x: round(x, 3))
STIFF = st.floats(0.5, 500.0)

CUBICS = st.builds(
    lambda c, c3, ends, rest: Cubic((*c, c3), -1, ends and (min(ends), max(ends)), rest),
    st.tuples(NUMBER, NUMBER, NUMBER),
    STIFF,
    st.none() | st.tuples(ANGLE, ANGLE),
    ANGLE,
)
STOPS = st.builds(
    lambda ends, stiff, onset: Stop(min(ends), max(ends), stiff, onset),
    st.tuples(ANGLE, ANGLE),
    STIFF,
    st.floats(0.01, 0.5),
)
LINEARS = st.builds(Linear, STIFF, ANGLE)


def agree(laws: tuple[Elastic, ...], values: np.ndarray) -> None:
    held = piecewise_cubic(laws)
    assert held is not None
    expected, given = total_torque(laws, values), held.torque(values)
    assert np.abs(given - expected).max() <= 1e-8 * (1.0 + np.abs(expected).max())


@settings(max_examples=50)
@given(st.lists(CUBICS | STOPS | LINEARS, min_size=1, max_size=3))
def test_the_pieces_add_up_to_the_laws(laws: list[Elastic]) -> None:
    agree(tuple(laws), np.linspace(-3.0, 3.0, 61))


@pytest.mark.parametrize("name", CURVES)
def test_the_curves_of_the_cases_are_held(name: str) -> None:
    agree(CURVES[name], np.linspace(-3.0, 3.0, 601))


def test_a_cubic_without_a_dead_zone_is_one_spring_about_its_zero() -> None:
    held = piecewise_cubic((Cubic((0.7, 9.0, -1.5, 6.0), rest=0.1),))
    assert held is not None
    assert held.breakpoint_terms == ()
    assert float(Cubic((0.7, 9.0, -1.5, 6.0), rest=0.1).torque(held.root)) == pytest.approx(0.0)
    assert held.coefficients[2] == pytest.approx(-6.0)


def test_a_dead_zone_needs_a_spring_at_each_end_and_none_between() -> None:
    held = piecewise_cubic((Cubic((-15.5, 84.5, -124.0, 49.2), -1, (0.0, 1.553)),))
    assert held is not None
    assert held.coefficients == (0.0, 0.0, 0.0)
    assert [(step.start, step.above) for step in held.breakpoint_terms] == [
        (0.0, False),
        (1.553, True),
    ]
    assert held.breakpoint_terms[0].coefficients == pytest.approx((-84.5, 124.0, -49.2))


@pytest.mark.parametrize(
    "laws",
    [
        OTHER_CURVES["exponential"],
        (SmoothLimit(-0.5, 0.5, 20.0, 20.0, 0.3),),
        (Exponential((ExponentialTerm(1.0, 1e-2),)),),
        (Linear(3.0), Exponential((ExponentialTerm(1.0, 2.0),))),
        (Transformed(Linear(0.0), constant=2.0),),
        (Cubic((5.0, 0.0, 1.0, 0.0)),),
    ],
    ids=str,
)
def test_other_laws_have_no_such_form(laws: tuple[Elastic, ...]) -> None:
    assert piecewise_cubic(laws) is None


@settings(max_examples=50)
@given(st.lists(st.tuples(ANGLE, NUMBER), min_size=2, max_size=8, unique_by=lambda p: p[0]))
def test_tables_that_cross_zero_are_held(points: list[tuple[float, float]]) -> None:
    points = sorted(points)
    if min(np.diff([angle for angle, _ in points])) < 0.05:
        return
    law = Interpolated(tuple(points))
    torques = [value for _, value in points]
    if min(torques) <= 0.0 <= max(torques):
        agree((law,), np.linspace(-2.5, 2.5, 101))


FITTED = np.linspace(-1.5, 1.5, 301)

EXPONENTIALS = st.builds(
    lambda amplitudes, rates, constant: Exponential(
        tuple(ExponentialTerm(a, r) for a, r in zip(amplitudes, rates, strict=True)), constant
    ),
    st.tuples(NUMBER, NUMBER),
    st.tuples(st.floats(0.5, 8.0), st.floats(-8.0, -0.5)),
    NUMBER,
)


@settings(max_examples=50, deadline=None)
@given(EXPONENTIALS, st.none() | STOPS)
def test_other_laws_are_fitted_within_the_tolerance(law: Elastic, stop: Elastic | None) -> None:
    laws = (law,) if stop is None else (law, stop)
    fitted = fit_piecewise_cubic(laws, (-1.5, 1.5))
    assert fitted is not None
    expected = total_torque(laws, FITTED)
    allowed = max(FITTED_SHARE * np.abs(expected).max(), FITTED_TORQUE)
    assert np.abs(fitted.torque(FITTED) - expected).max() <= 1.5 * allowed


def test_steep_forces_of_short_slides_are_fitted_within_the_tolerance() -> None:
    """Pieces are as short as the range asks for: 2 cm are not half a degree."""
    law = Exponential((ExponentialTerm(1.0, 800.0), ExponentialTerm(-1.0, -800.0)))
    fitted = fit_piecewise_cubic((law,), (-0.01, 0.01))
    assert fitted is not None
    positions = np.linspace(-0.01, 0.01, 1001)
    expected = law.torque(positions)
    allowed = FITTED_SHARE * np.abs(expected).max()
    assert np.abs(fitted.torque(positions) - expected).max() <= 1.5 * allowed


@pytest.mark.parametrize("name", CURVES)
def test_a_fit_of_piecewise_cubics_is_exact(name: str) -> None:
    assert fit_piecewise_cubic(CURVES[name], (-0.1, 0.1)) == piecewise_cubic(CURVES[name])


def test_laws_without_a_zero_are_fitted() -> None:
    for law in (Transformed(Linear(0.0), constant=2.0), Cubic((5.0, 0.0, 1.0, 0.0))):
        fitted = fit_piecewise_cubic((law,), (-1.5, 1.5))
        assert fitted is not None
        assert (fitted.constant == 2.0) == isinstance(law, Transformed)
        assert fitted.torque(FITTED) == pytest.approx(law.torque(FITTED) + 0.0 * FITTED, abs=1e-9)


def test_beyond_the_range_a_fit_continues_with_its_slope() -> None:
    fitted = fit_piecewise_cubic(OTHER_CURVES["exponential"], (-1.0, 1.0))
    assert fitted is not None
    for beyond in (np.linspace(1.0, 3.0, 9), np.linspace(-3.0, -1.0, 9)):
        torques = fitted.torque(beyond)
        assert np.diff(torques, 2) == pytest.approx(0.0, abs=1e-6 * np.abs(torques).max())
        assert (np.diff(torques) < 0.0).all()


def test_infinite_torques_cannot_be_fitted() -> None:
    law = Exponential((ExponentialTerm(3.0, 900.0),))
    assert piecewise_cubic((law,)) is None
    assert fit_piecewise_cubic((law,), (-1.0, 1.0)) is None


@pytest.mark.parametrize("limit", [1e7, 1e12, 1e16, 1e40])
def test_stops_that_nothing_reaches_have_no_torque(limit: float) -> None:
    for laws in ((Stop(-limit, limit),), (Linear(3.0), Stop(-limit, limit))):
        exact, fitted = piecewise_cubic(laws), fit_piecewise_cubic(laws, (-limit, limit))
        assert exact is not None
        assert fitted is not None
        for found in (exact, fitted):
            expected = total_torque(laws, FITTED)
            np.testing.assert_allclose(found.torque(FITTED), expected, atol=1e-9)
