"""Forms of a curve through moments: each is found in data of its kind, and restores if bound."""

from collections.abc import Sequence
from math import isclose

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from springs.cubic import polynomial
from springs.fit_forms import Form, FormFit, choose_form, fit_forms, form_doubts
from springs.interpolated import Interpolated

ANGLES = np.radians(np.linspace(-10.0, 130.0, 25))


def data_of(form: Form) -> tuple[np.ndarray, float]:
    """Torques on the child of each form over `ANGLES`, and the size of the largest."""
    if form is Form.CUBIC:
        torques = -polynomial((-2.0, 8.0, -20.0, 18.0), ANGLES)
    elif form is Form.EXPONENTIALS:
        torques = 1.8 * np.exp(-6.0 * ANGLES) - 9.4e-5 * np.exp(5.0 * ANGLES) + 0.3
    else:
        knots, values = ANGLES[[0, 3, 6, 9, 15, 18, 21, 24]], (9, 8, 1, 0.5, 0.3, -5, -6, -6.5)
        law = Interpolated(tuple(zip(knots.tolist(), values, strict=True)))
        torques = np.asarray(law.torque(ANGLES))
    return torques, float(np.abs(torques).max())


def chosen(fits: Sequence[FormFit]) -> FormFit:
    found = choose_form(fits)
    assert found is not None
    return found


@pytest.mark.parametrize("sense", [-1, 1])
@pytest.mark.parametrize("form", Form)
def test_data_of_a_form_choose_it(form: Form, sense: int) -> None:
    torques, largest = data_of(form)
    noise = 0.01 * largest * np.random.default_rng(2).normal(size=25)
    found = chosen(fit_forms(ANGLES, sense * (torques + noise)))
    assert (found.form, found.sense) == (form, sense)
    misses = found.moments(ANGLES) - sense * torques
    assert np.sqrt(np.mean(misses**2)) < (0.05 if form is Form.POINTS else 0.01) * largest


@pytest.mark.parametrize("form", Form)
def test_a_bound_form_restores_at_both_ends(form: Form) -> None:
    """Data that drive on at the first angle, and rise on the way."""
    torques = np.interp(ANGLES, ANGLES[[0, 8, 16, 24]], [-3.0, 2.0, 4.0, -8.0])
    free, bound = (
        next(one for one in fit_forms(ANGLES, torques, passive=passive) if one.form is form)
        for passive in (False, True)
    )
    assert bound.law is not None
    values = np.asarray(bound.law.torque(ANGLES))
    assert values[0] >= -1e-9
    assert values[-1] <= 1e-9
    if form is Form.POINTS:
        doubts = form_doubts(free, ANGLES)
        assert "at -10 deg the torque drives the joint on" in doubts[0]
        assert "a negative stiffness" in doubts[1]
        assert form_doubts(bound, ANGLES) == []
    if form is not Form.CUBIC:
        assert np.diff(values).max() <= 1e-9


def test_without_enough_angles_the_cubic_stays() -> None:
    torques, _ = data_of(Form.EXPONENTIALS)
    fits = fit_forms(ANGLES[::6], -torques[::6])
    assert [one.error for one in fits] == [None] * 3
    assert chosen(fits).form is Form.CUBIC


def test_many_moments_are_averaged_in_groups() -> None:
    angles = np.radians(np.linspace(-10.0, 130.0, 20_000))
    torques = 1.8 * np.exp(-6.0 * angles) - 9.4e-5 * np.exp(5.0 * angles)
    noise = 0.5 * np.random.default_rng(3).normal(size=20_000)
    found = chosen(fit_forms(angles, noise - torques))
    assert found.form is Form.EXPONENTIALS
    assert found.moments(angles) == pytest.approx(-torques, abs=0.05)


def test_equal_moments_have_no_form() -> None:
    fits = fit_forms(ANGLES, np.full(25, 3.0))
    assert choose_form(fits) is None
    assert all("restores in neither sense" in one.obstacle for one in fits)


def test_a_simpler_form_within_one_standard_error_comes_first() -> None:
    law = Interpolated(((0.0, 1.0), (1.0, 0.0)))
    fits = [
        FormFit(Form.POINTS, 10, law, error=1.0, spread=0.3),
        FormFit(Form.CUBIC, 4, law, error=1.1, spread=0.1),
        FormFit(Form.EXPONENTIALS, 5, law, error=1.2, spread=0.1),
    ]
    assert chosen(fits).form is Form.CUBIC
    assert chosen([fits[0], fits[2]]).form is Form.POINTS


@given(
    st.lists(st.floats(-1e3, 1e3), min_size=4, max_size=9),
    st.floats(-2.0, 2.0),
    st.sampled_from([0.02, 0.5, 3.0]),
)
@settings(max_examples=8, deadline=None)
def test_any_data_are_fitted_with_finite_laws(
    moments: list[float], start: float, width: float
) -> None:
    angles = start + width * np.linspace(0.0, 1.0, len(moments))
    for one in fit_forms(angles, np.array(moments), passive=True):
        assert one.obstacle or np.isfinite(one.moments(angles)).all()
        assert one.error is None or isclose(one.error, abs(one.error))
