"""Drives: what stands in the rows, smooth between them, and nothing that is no motion."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.drive import Drive

coefficients = st.lists(st.floats(-3.0, 3.0), min_size=4, max_size=4)
steps = st.lists(st.floats(0.05, 1.0), min_size=4, max_size=12)


@given(coefficients, steps)
def test_a_cubic_motion_is_given_back_whole(made, gaps) -> None:
    """Its displacements and rates, at the ends as well as between."""
    times = np.cumsum(gaps)
    cubic = np.polynomial.Polynomial(made)
    drive = Drive(times, cubic(times)[:, None])
    between = np.linspace(times[0], times[-1], 31)
    size = 1.0 + np.max(np.abs(cubic(between)))
    assert np.max(np.abs(drive.displacements(between)[:, 0] - cubic(between))) < 1e-8 * size
    rates = cubic.deriv()(between)
    assert np.max(np.abs(drive.rates(between)[:, 0] - rates)) < 1e-6 * (1.0 + np.max(np.abs(rates)))


@given(st.lists(st.floats(-3.0, 3.0), min_size=5, max_size=9))
def test_rows_are_met_and_accelerations_do_not_jump(values) -> None:
    times = np.arange(float(len(values)))
    drive = Drive(times, np.array(values)[:, None])
    assert drive.displacements(times)[:, 0] == pytest.approx(values, abs=1e-12)
    inner, h = times[1:-1], 1e-6
    before = (drive.rates(inner) - drive.rates(inner - h)) / h
    after = (drive.rates(inner + h) - drive.rates(inner)) / h
    assert np.max(np.abs(after - before)) < 1e-3
    assert drive.accelerations(inner) == pytest.approx(0.5 * (after + before), abs=1e-3)


def test_two_rows_are_a_line_and_three_a_parabola() -> None:
    line = Drive((0.0, 2.0), ((1.0, 0.0), (5.0, -4.0)))
    assert line.displacements(0.5) == pytest.approx([2.0, -1.0])
    assert line.rates(1.7) == pytest.approx([2.0, -2.0])
    parabola = Drive((0.0, 1.0, 2.0), ((0.0,), (1.0,), (4.0,)))
    assert parabola.displacements(1.5) == pytest.approx([2.25])
    assert (line.start, line.stop) == (0.0, 2.0)


@pytest.mark.parametrize(
    ("times", "values", "freedoms", "said"),
    [
        ((0.0,), ((1.0,),), None, "two rows or more"),
        ((0.0, 1.0), ((1.0,),), None, "as many rows"),
        ((0.0, 1.0), (1.0, 2.0), None, "as many rows"),
        ((0.0, 1.0), ((), ()), None, "as many rows"),
        ((0.0, float("nan")), ((1.0,), (2.0,)), None, "finite"),
        ((0.0, 1.0), ((1.0,), (float("inf"),)), None, "finite"),
        ((0.0, 0.0), ((1.0,), (2.0,)), None, "increase"),
        ((0.0, 1.0), ((1.0,), (2.0,)), (0, 1), "one degree of freedom"),
        ((0.0, 1.0), ((1.0, 1.0), (2.0, 1.0)), (1, 1), "one degree of freedom"),
        ((0.0, 1.0), ((1.0,), (2.0,)), (-1,), "one degree of freedom"),
    ],
)
def test_what_is_no_motion_is_refused(times, values, freedoms, said) -> None:
    with pytest.raises(ValueError, match=said):
        Drive(times, values, freedoms)
