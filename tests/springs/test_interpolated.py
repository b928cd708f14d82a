import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import PchipInterpolator

from springs.interpolated import Interpolated

SAMPLE = Interpolated(((-0.5, 4.0), (0.0, 1.0), (0.2, 0.0), (0.3, 0.0), (1.0, -6.0)))

gaps = st.lists(st.floats(0.05, 1.0), min_size=2, max_size=8)
torques = st.integers(-100_000, 100_000).map(lambda milli: milli / 1000.0)
tables = gaps.flatmap(
    lambda steps: st.lists(torques, min_size=len(steps), max_size=len(steps)).map(
        lambda values: Interpolated(tuple(zip(np.cumsum(steps).tolist(), values, strict=True)))
    )
)
angles = st.floats(-1.0, 9.0)


@given(tables, angles)
def test_inside_it_is_the_interpolation_of_scipy(table, angle):
    first, last = table.valid_range
    x = min(max(angle, first), last)
    expected = PchipInterpolator(*np.array(table.points).T)(x)
    assert table.torque(x) == pytest.approx(float(expected), rel=1e-9, abs=1e-9)


def test_beyond_its_ends_it_goes_on_along_the_tangent():
    first = (SAMPLE.torque(-0.5 + 1e-7) - 4.0) / 1e-7
    assert SAMPLE.torque(-1.5) == pytest.approx(4.0 - first, rel=1e-4)
    last = (SAMPLE.torque(1.0) - SAMPLE.torque(1.0 - 1e-7)) / 1e-7
    assert SAMPLE.torque(2.0) == pytest.approx(-6.0 + last, rel=1e-4)
    assert SAMPLE.valid_range == (-0.5, 1.0)


def test_energy_is_counted_from_the_first_point():
    assert SAMPLE.energy(-0.5) == 0.0
    assert Interpolated(((0.0, 2.0), (1.0, 2.0))).energy(1.0) == pytest.approx(-2.0)
