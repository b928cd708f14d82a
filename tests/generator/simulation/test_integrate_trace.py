"""States of bodies at frames: rotations and spins from Euler parameters, and Richardson's limit."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from generator.rotations import matrix_from_rotation_vector, rotation_vector_from_matrix
from generator.simulation.error_control import richardson_extrapolation
from generator.simulation.integrate import (
    Trace,
    angular_velocities_from_parameters,
    rotations_from_parameters,
)

vectors = st.tuples(*[st.floats(-2.0, 2.0)] * 3).map(np.array)


def trace(value: float, count: int = 3) -> Trace:
    """All quantities made of one number, so that they have its error."""
    ones = np.ones((count, 2, 3))
    spin = np.array([0.3, -0.2, 0.1]) * value
    return Trace(
        np.arange(count) * 0.1,
        ones * value,
        np.broadcast_to(matrix_from_rotation_vector(spin), (count, 2, 3, 3)),
        2.0 * ones * value,
        3.0 * ones * value,
        {"joint": np.full((count, 1, 6), 4.0 * value)},
        *(np.full(count, k * value) for k in (5.0, 6.0, 7.0)),
    )


@given(vectors)
def test_rotations_from_parameters(r) -> None:
    x, y, z, w = Rotation.from_rotvec(r).as_quat()
    expected = matrix_from_rotation_vector(r)
    for scale in (1.0, -1.0, 1.0001):
        found = rotations_from_parameters(scale * np.array([w, x, y, z]))
        assert np.allclose(found, expected, atol=1e-12)


@given(vectors, vectors)
def test_spins_from_parameters(r, omega) -> None:
    """World axes: the rate of the parameters is half the spin times them, as quaternions."""
    x, y, z, w = Rotation.from_rotvec(r).as_quat()
    vector = np.array([x, y, z])
    rates = 0.5 * np.array([-omega @ vector, *(w * omega + np.cross(omega, vector))])
    assert np.allclose(
        angular_velocities_from_parameters(np.array([w, x, y, z]), rates), omega, atol=1e-12
    )


@pytest.mark.parametrize("ratio", [2.0, 3.0, 7.0 / 3.0])
def test_the_limit_of_two_passes(ratio) -> None:
    """Errors of 0.09 h^2 vanish from every quantity."""
    coarse, fine = trace(1.0 + 0.09 * ratio**2), trace(1.09)
    limit, exact = richardson_extrapolation(coarse, fine, ratio), trace(1.0)
    assert np.allclose(limit.positions, exact.positions)
    assert np.allclose(limit.velocities, exact.velocities)
    assert np.allclose(limit.angular_velocities, exact.angular_velocities)
    assert np.allclose(limit.multipliers["joint"], exact.multipliers["joint"])
    assert np.allclose(limit.dissipated, 5.0)
    assert np.allclose(limit.spring_work, 6.0)
    assert np.allclose(limit.load_work, 7.0)
    off = np.swapaxes(exact.rotations, -1, -2) @ limit.rotations
    assert np.max(np.abs(rotation_vector_from_matrix(off))) < 1e-12


def test_frames_that_only_one_pass_has_are_left_out() -> None:
    assert len(richardson_extrapolation(trace(1.0, 5), trace(1.0, 3), 2.0)) == 3
    assert len(richardson_extrapolation(trace(1.0, 2), trace(1.0, 3), 2.0)) == 2


def test_the_first_frames() -> None:
    cut = trace(1.0, 5).first_frames(2)
    assert len(cut) == 2
    assert cut.rotations.shape == (2, 2, 3, 3)
    assert cut.multipliers["joint"].shape == (2, 1, 6)
