"""Rotations: matrices, rotation vectors, and the angles of three axes up to and through poles."""

from itertools import product

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from generator.rotations import (
    Array,
    RotationSequence,
    cross_matrix,
    cross_product,
    inverse_pose,
    matrix_from_axis_angle,
    matrix_from_chain_angles,
    matrix_from_quaternion,
    matrix_from_rotation_vector,
    matrix_from_xyz,
    pose_matrix,
    quaternion_from_matrix,
    rotation_vector_from_matrix,
    rotation_with_z_axis,
    unit_vector,
    wrap_angle,
)

AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
ORDERS = [a + b + c for a, b, c in product("xyz", repeat=3) if a != b and b != c]
assert len(ORDERS) == 12
SIGNS = list(product((1.0, -1.0), repeat=3))
POLES = (1.0, -1.0)

angle = st.floats(-3.14, 3.14)
turn = st.floats(-12.0, 12.0)
vector = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1)).map(np.array)
direction = vector.filter(lambda v: np.linalg.norm(v) > 0.1).map(unit_vector)


def signed(order: str, signs: tuple[float, ...]) -> RotationSequence:
    return RotationSequence(
        tuple(tuple(s * c for c in AXES[k]) for k, s in zip(order, signs, strict=True))
    )


def polar(sequence: RotationSequence, middle: float) -> float:
    """The angle between the last axis and the turned first one, zero or pi at a pole."""
    first, axis, last = (np.array(a) for a in sequence.axes)
    return float(np.arccos(np.clip(last @ matrix_from_axis_angle(axis, middle) @ first, -1, 1)))


def middle_at(sequence: RotationSequence, pole: float) -> float:
    """The middle angle at which the turned first axis is the last one, or its opposite."""
    first, axis, last = (np.array(a) for a in sequence.axes)
    return float(np.arctan2(axis @ np.cross(first, pole * last), first @ (pole * last)))


sequences = st.builds(signed, st.sampled_from(ORDERS), st.sampled_from(SIGNS))


@st.composite
def davenport(draw: st.DrawFn) -> RotationSequence:
    """Axes each perpendicular to the next, turned anyhow, with any angle between first and last."""
    frame = matrix_from_rotation_vector(3.0 * draw(vector))
    offset = draw(angle)
    first = frame @ np.array([0.0, np.cos(offset), np.sin(offset)])
    return RotationSequence(tuple(tuple(map(float, a)) for a in (first, frame[:, 0], frame[:, 2])))


@given(sequences | davenport(), angle, angle, angle)
def test_round_trip(sequence, first, middle, last) -> None:
    matrix = sequence.matrix([first, middle, last])
    found = sequence.matrix(sequence.angles(matrix))
    near_pole = min(polar(sequence, middle), np.pi - polar(sequence, middle)) < 1e-6
    assert np.max(np.abs(found - matrix)) < (1e-7 if near_pole else 1e-12)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("pole", POLES)
def test_round_trip_at_the_poles(order, pole) -> None:
    """At every distance from a pole, for every combination of signs."""
    for signs in SIGNS:
        sequence = signed(order, signs)
        for off in (0.0, 1e-15, 1e-12, 1e-9, 9e-9, 2e-8, 1e-7, 1e-5):
            matrix = sequence.matrix([0.7, middle_at(sequence, pole) + off, -1.1])
            found = sequence.angles(matrix)
            assert np.max(np.abs(sequence.matrix(found) - matrix)) < 1e-7
            assert sequence.is_singular(matrix) == (off < 1e-8)


@given(davenport(), angle, angle, st.sampled_from(POLES), st.floats(-1e-8, 1e-8))
def test_round_trip_of_turned_copies_at_the_poles(sequence, first, last, pole, off) -> None:
    matrix = sequence.matrix([first, middle_at(sequence, pole) + off, last])
    found = sequence.matrix(sequence.angles(matrix))
    assert np.max(np.abs(found - matrix)) < 1e-7


@given(sequences, turn, turn, turn)
def test_the_given_triple_is_found_near_itself(sequence, first, middle, last) -> None:
    """Whole turns and the second of the two triples included."""
    given_angles = np.array([first, middle, last])
    matrix = sequence.matrix(given_angles)
    if min(polar(sequence, middle), np.pi - polar(sequence, middle)) > 1e-5:
        assert np.max(np.abs(sequence.angles(matrix, given_angles) - given_angles)) < 1e-9


@given(sequences, turn, turn, st.sampled_from(POLES), st.integers(-2, 2))
def test_at_a_pole_the_given_triple_is_found_near_itself(sequence, first, last, pole, turns):
    given_angles = np.array([first, middle_at(sequence, pole) + 2.0 * np.pi * turns, last])
    matrix = sequence.matrix(given_angles)
    assert np.max(np.abs(sequence.angles(matrix, given_angles) - given_angles)) < 1e-7


@given(sequences, angle, st.floats(0.01, 1.5), angle, st.booleans())
def test_convention_of_the_two_triples(sequence, first, middle, last, below) -> None:
    """cos theta >= 0 (eq. 3.8) for three different axes, sin theta >= 0 where the first returns."""
    returns = abs(np.dot(sequence.axes[0], sequence.axes[2])) > 0.5
    meant = np.array([first, -middle if below and not returns else middle, last])
    assert np.max(np.abs(sequence.angles(sequence.matrix(meant)) - meant)) < 1e-9


@given(angle, st.floats(-1.5, 1.5), angle)
def test_against_scipy(first, middle, last) -> None:
    """The first factor is innermost: angles of a chain are those of scipy's, read backwards."""
    matrix = signed("xyz", (1.0, 1.0, 1.0)).matrix([first, middle, last])
    assert np.allclose(Rotation.from_euler("ZYX", [last, middle, first]).as_matrix(), matrix)


@pytest.mark.parametrize("total", [-2.9, -1.0, 0.0, 0.4, 3.0])
def test_the_first_frame_at_the_upper_pole(total) -> None:
    """Eq. 3.14: at theta = +90 deg both outer angles are half of atan2(R12, R22)'s turn."""
    sequence = signed("xyz", (1.0, 1.0, 1.0))
    first, middle, last = sequence.angles(sequence.matrix([-total, np.pi / 2, 0.0]))
    assert middle == pytest.approx(np.pi / 2, abs=1e-9)
    assert (first, last) == pytest.approx((-total / 2, total / 2), abs=1e-9)


@pytest.mark.parametrize("total", [-2.9, -1.0, 0.0, 0.4, 3.0])
def test_the_first_frame_at_the_lower_pole(total) -> None:
    """The corrected eq. 3.15: phi = psi = atan2(-R23, -R13) / 2 at theta = -90 deg."""
    sequence = signed("xyz", (1.0, 1.0, 1.0))
    matrix = sequence.matrix([total, -np.pi / 2, 0.0])
    first, middle, last = sequence.angles(matrix)
    half = 0.5 * np.arctan2(-matrix[1, 2], -matrix[0, 2])
    assert middle == pytest.approx(-np.pi / 2, abs=1e-9)
    assert (first, last) == pytest.approx((half, half), abs=1e-9)
    assert first == pytest.approx(total / 2, abs=1e-9)
    printed = 0.5 * np.arctan2(matrix[1, 2], matrix[0, 2])
    assert not np.allclose(sequence.matrix([printed, middle, printed]), matrix)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("pole", POLES)
@pytest.mark.parametrize("aside", [0.0, 1e-10, 3e-3])
def test_angles_run_continuously_through_a_pole(order, pole, aside) -> None:
    """Through the pole itself the triple goes on; past it by `aside` no jump of a turn appears."""
    sequence = signed(order, (1.0, -1.0, 1.0))
    pole_at = middle_at(sequence, pole)
    axis = np.array(sequence.axes[0])
    start = sequence.matrix([0.4, pole_at, -0.3])
    across = np.cross(sequence.matrix([0.4, pole_at, -0.3]) @ axis, sequence.axes[1])
    side = matrix_from_rotation_vector(aside * unit_vector(across))
    about = np.array(sequence.matrix([0.0, 0.0, -0.3]) @ sequence.axes[1])
    found = [sequence.angles(matrix_from_axis_angle(about, -0.2) @ start, [0.4, pole_at, -0.3])]
    steps = np.linspace(-0.2, 0.2, 101)[1:]
    matrices = [matrix_from_axis_angle(about, step) @ side @ start for step in steps]
    for matrix in matrices:
        found.append(sequence.angles(matrix, found[-1]))
    assert np.max(np.abs(sequence.matrix(np.array(found[1:])) - matrices)) < 1e-7
    jump = np.max(np.abs(np.diff(found, axis=0)))
    assert jump < np.pi / 2 + 0.01
    if aside < 1e-8:
        assert jump < 0.01
        assert found[-1] == pytest.approx([0.4, pole_at + 0.2, -0.3], abs=1e-6)


@pytest.mark.parametrize(
    "axes",
    [
        ("x", (0.1, 1.0, 0.0), "z"),
        ("x", "y", (0.0, 0.1, 1.0)),
        ("x", "x", "y"),
        ("x", "y", "y"),
    ],
)
def test_oblique_axes_are_refused_with_the_reason(axes) -> None:
    with pytest.raises(ValueError, match="perpendicular to the next"):
        RotationSequence(tuple(AXES[a] if isinstance(a, str) else a for a in axes))


@given(vector, st.sampled_from([0.0, 1e-200, 1e-9, 1e-3, 1.0, 6.0]))
def test_rotation_vectors_and_matrices_equal_those_of_scipy(v, size) -> None:
    rotation = Rotation.from_rotvec(size * v)
    matrix = rotation.as_matrix()
    assert np.max(np.abs(matrix_from_rotation_vector(size * v) - matrix)) < 1e-14
    assert quaternion_error(matrix) < 1e-14
    if rotation.magnitude() < np.pi - 1e-9:
        vectors = rotation_vector_from_matrix(np.stack([matrix, np.eye(3)]))
        assert np.max(np.abs(vectors - [rotation.as_rotvec(), np.zeros(3)])) < 1e-14


@pytest.mark.parametrize("axis", [(-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (-1.0, 2.0, -3.0)])
def test_rotation_vectors_of_half_turns_equal_those_of_scipy(axis) -> None:
    u = unit_vector(axis)
    matrix = 2.0 * np.outer(u, u) - np.eye(3)
    expected = Rotation.from_matrix(matrix).as_rotvec()
    assert np.allclose(rotation_vector_from_matrix(matrix), expected, rtol=0.0, atol=1e-14)


@given(vector, vector)
def test_a_skewed_matrix_becomes_the_nearest_rotation(v, w) -> None:
    matrix = matrix_from_rotation_vector(2.0 * v) + 1e-3 * np.outer(v, w)
    assert quaternion_error(matrix) < 1e-13


@given(vector)
@example(np.array([np.pi / 2.0, 0.0, 0.0]))
def test_one_matrix_has_the_quaternion_that_it_has_among_several(v) -> None:
    for matrix in (m := matrix_from_rotation_vector(2.0 * v), np.round(m)):
        if np.linalg.det(matrix) > 0.0:
            one, several = quaternion_from_matrix(matrix), quaternion_from_matrix(matrix[None])[0]
            assert one.tobytes() == several.tobytes()


def test_a_reflection_has_no_quaternion() -> None:
    with pytest.raises(ValueError, match="determinant"):
        quaternion_from_matrix(np.diag([1.0, 1.0, -1.0]))


@given(vector, st.floats(0.1, 10.0))
def test_the_matrix_of_a_quaternion_of_any_length_is_that_of_scipy(v, length) -> None:
    rotation = Rotation.from_rotvec(2.0 * v)
    found = matrix_from_quaternion(-length * rotation.as_quat(scalar_first=True))
    assert np.max(np.abs(found - rotation.as_matrix())) < 1e-14


def quaternion_error(matrix: Array) -> float:
    """Largest difference from scipy's quaternion, or from its negative."""
    found, expected = quaternion_from_matrix(matrix), Rotation.from_matrix(matrix)
    q = expected.as_quat(scalar_first=True)
    return float(np.max(np.abs(found - np.sign(found @ q) * q)))


@given(vector, vector)
def test_cross_matrix(v, w) -> None:
    assert np.allclose(cross_matrix(v) @ w, np.cross(v, w))
    assert np.array_equal(cross_product(np.array(v), np.array(w)), np.cross(v, w))


near_minus_z = st.sampled_from([0.0, 1e-13, 1e-9, 1e-7, 1e-5]).map(
    lambda off: unit_vector([off, -off, -1.0])
)


@given(direction | near_minus_z)
def test_a_frame_with_its_z_axis_along_a_direction(axis) -> None:
    frame = rotation_with_z_axis(axis)
    assert np.allclose(frame[:, 2], axis, atol=1e-9)
    assert np.max(np.abs(frame.T @ frame - np.eye(3))) < 1e-9
    assert np.linalg.det(frame) == pytest.approx(1.0)


def test_xyz_is_intrinsic() -> None:
    """`xyz(-45deg, -90deg, -45deg)` is the triad of figure 3.2."""
    triad = matrix_from_xyz(*np.radians([-45.0, -90.0, -45.0]))
    assert np.allclose(triad, [[0, 0, -1], [0, 1, 0], [1, 0, 0]], atol=1e-12)


@given(vector, vector)
def test_inverse_pose(r, t) -> None:
    pose = pose_matrix(matrix_from_rotation_vector(r), t)
    assert np.allclose(inverse_pose(pose) @ pose, np.eye(4))


def test_many_at_once() -> None:
    vectors = np.random.default_rng(1).uniform(-1, 1, (4, 5, 3))
    matrices = matrix_from_rotation_vector(vectors)
    assert matrices.shape == (4, 5, 3, 3)
    assert np.allclose(rotation_vector_from_matrix(matrices), vectors)
    angles = matrix_from_chain_angles(list(AXES.values()), vectors)
    assert np.allclose(angles[2, 3], matrix_from_chain_angles(list(AXES.values()), vectors[2, 3]))


def test_the_zero_vector_has_no_direction() -> None:
    with pytest.raises(ValueError, match="no direction"):
        unit_vector([0.0, 0.0, 0.0])


def test_wrapped_angles_are_within_half_a_turn() -> None:
    angles = np.linspace(-20.0, 20.0, 401)
    assert np.all(np.abs(wrap_angle(angles)) <= np.pi)
    assert np.allclose(np.exp(1j * wrap_angle(angles)), np.exp(1j * angles))
