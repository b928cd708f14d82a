import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from springs import FLOATS, NUMPY, Damping

angles = st.lists(st.floats(-3.0, 3.0), min_size=1, max_size=5)
vectors = st.lists(st.tuples(*[st.floats(-3.0, 3.0)] * 3), min_size=1, max_size=5)


@given(values=angles)
def test_arrays_and_floats_agree_on_damping(values):
    law = Damping(0.08, 0.5)
    single = [law.torque(value, FLOATS) for value in values]
    assert np.allclose(law.torque(np.array(values)), single, rtol=1e-14, atol=1e-15)


@given(rows=vectors)
def test_vectors_of_arrays_and_floats_agree(rows):
    array = np.array(rows)
    other = array[:, ::-1]
    for k, row in enumerate(rows):
        u, v = np.array(row), np.array(row[::-1])
        assert NUMPY.dot(array, other)[k] == pytest.approx(FLOATS.dot(u, v), abs=1e-13)
        assert NUMPY.norm(array)[k] == pytest.approx(FLOATS.norm(u), abs=1e-13)
        assert np.allclose(NUMPY.scaled(NUMPY.part(array, 0), other)[k], FLOATS.scaled(row[0], v))
        assert [NUMPY.part(array, i)[k] for i in range(3)] == list(row)


def test_vectors_are_stacked_along_the_last_axis_and_constants_are_spread():
    x = np.array([1.0, 2.0])
    assert NUMPY.vector([x, 0.0, -x]).tolist() == [[1.0, 0.0, -1.0], [2.0, 0.0, -2.0]]
    assert FLOATS.vector([1.0, 0.0, -1.0]).tolist() == [1.0, 0.0, -1.0]


def test_functions_are_those_of_the_angle():
    for ops in (NUMPY, FLOATS):
        assert ops.sin(np.pi / 6.0) == pytest.approx(0.5, abs=1e-15)
        assert ops.tanh(1e3) == 1.0
        assert ops.exp(1.0) == pytest.approx(np.e, abs=1e-15)
        assert ops.exp(709.7) < ops.exp(709.9) == np.inf
        assert ops.where(1.0 < 2.0, "yes", "no") == "yes"
        assert ops.where(2.0 < 1.0, "yes", "no") == "no"
