"""States of bodies at frames: rotations and spins from Euler parameters, and Richardson's limit."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from generator.rotations import matrix_from_rotation_vector, rotation_vector_from_matrix
from generator.simulation.exudyn_run import (
    angular_velocities_from_parameters,
    extrapolate,
    richardson_extrapolation,
    rotations_from_parameters,
)
from generator.simulation.trace import Trace, mean_position
from tests.chains import body, figure, ground, joint, row

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


def test_the_limit_of_two_passes() -> None:
    """Errors of 0.09 h^2 vanish from every quantity."""
    coarse, fine = trace(1.36), trace(1.09)
    limit, exact = richardson_extrapolation(coarse, fine), trace(1.0)
    assert np.allclose(limit.positions, exact.positions)
    assert np.allclose(limit.velocities, exact.velocities)
    assert np.allclose(limit.angular_velocities, exact.angular_velocities)
    assert np.allclose(limit.multipliers["joint"], exact.multipliers["joint"])
    assert np.allclose(limit.dissipated, 5.0)
    assert np.allclose(limit.spring_work, 6.0)
    assert np.allclose(limit.load_work, 7.0)
    off = np.swapaxes(exact.rotations, -1, -2) @ limit.rotations
    assert np.max(np.abs(rotation_vector_from_matrix(off))) < 1e-12


@pytest.mark.parametrize(("coarse", "fine"), [(5, 3), (3, 5), (3, 3)])
def test_frames_that_only_the_finer_pass_has_follow_without_an_estimate(coarse, fine) -> None:
    made = row(2)
    found, errors = extrapolate(made, trace(1.18, coarse), trace(1.045, fine))
    common = min(coarse, fine)
    assert len(found) == len(errors) == fine
    assert found.dissipated == pytest.approx([5.0] * common + [5.225] * (fine - common))
    assert errors[:common] == pytest.approx(0.135 * np.sqrt(0.14))
    assert np.all(np.isinf(errors[common:]))


def test_passes_that_diverge_are_not_extrapolated() -> None:
    """Their difference is above 0.1 rad in all frames."""
    found, errors = extrapolate(row(2), trace(1.8), trace(1.2))
    assert np.array_equal(found.dissipated, trace(1.2).dissipated)
    assert np.array_equal(found.rotations, trace(1.2).rotations)
    assert errors == pytest.approx(0.6 * np.sqrt(0.14))


def test_the_first_frames() -> None:
    cut = trace(1.0, 5).first_frames(2)
    assert len(cut) == 2
    assert cut.rotations.shape == (2, 2, 3, 3)
    assert cut.multipliers["joint"].shape == (2, 1, 6)


def test_the_mean_position_is_weighted_by_the_masses() -> None:
    made = figure(
        [ground(), body("a", 1.0), body("b", 3.0)],
        [joint("one", "ground.base", "a.near", ()), joint("two", "a.near", "b.near", ())],
    )
    positions = np.array([[[0.0, 0.0, 4.0], [1.0, 2.0, 0.0]]] * 2)
    assert mean_position(made, positions) == pytest.approx(np.array([[0.75, 1.5, 1.0]] * 2))
