"""The spherical laws on the rotation group: passivity, work on closed loops, mirror images."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from scipy.optimize import brentq

from generator.rotations import matrix_from_rotation_vector, rotation_vector_from_matrix
from springs import (
    FLOATS,
    AxisSpring,
    Cubic,
    Damping,
    Linear,
    Stop,
    conservative_energy,
    conservative_torque,
    damping_torque,
    elastic_torque,
    group_torque,
    passive_cubic,
    total_torque,
    weighted_torque,
)
from springs.hysteresis import Hysteresis
from tests.laws import VECTOR_LAWS

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
HIP_X = passive_cubic((-0.131, 136.0, 8.42, -218.0))
HIP_Y = passive_cubic((33.180672, -144.6, 188.2, -82.76))
HIP_Z = passive_cubic((2.91, 38.3, -13.4, -106.0))
LEFT_HIP = (AxisSpring(Z, (HIP_Z,)), AxisSpring(X, (HIP_X,)), AxisSpring(Y, (HIP_Y,)))
RIGHT_HIP = (
    AxisSpring((0.0, 0.0, -1.0), (HIP_Z,)),
    AxisSpring((-1.0, 0.0, 0.0), (HIP_X,)),
    AxisSpring(Y, (HIP_Y,)),
)
OBLIQUE = (
    AxisSpring((0.6, 0.8, 0.0), (Cubic((1.0, 30.0, -8.0, 40.0)),)),
    AxisSpring((0.0, -0.6, 0.8), (Linear(25.0, 0.3), Stop(-0.4, 0.9))),
)
JOINTS = {"left": LEFT_HIP, "oblique": OBLIQUE}

components = st.floats(-1.6, 1.6)
rotation_vectors = st.tuples(components, components, components).map(np.array)


def corners(axis: AxisSpring) -> list[float]:
    """Angles at which a law of the axis has a jump in one of its derivatives."""
    return [corner for law in axis.elastic for corner in law.breakpoints]


def along(path, s: float) -> np.ndarray:
    """Rotation vector at s in 0..1 of the geodesic from one orientation to another."""
    start, turn = path
    return rotation_vector_from_matrix(start @ matrix_from_rotation_vector(s * turn))


def work(law, axes, path, nodes: int) -> float:
    """Work of the torque along a geodesic, exact between the corners of the laws.

    The relative angular velocity is constant in the child; the torque is in the half-way frame.
    """
    breaks = {0.0, 1.0}
    grid = np.linspace(0.0, 1.0, 41)
    for axis in axes:
        for corner in corners(axis):

            def beyond(s, axis=axis, corner=corner):
                return float(np.dot(axis.direction, along(path, s))) - corner

            values = [beyond(s) for s in grid]
            for (a, fa), (b, fb) in pairwise(zip(grid, values, strict=True)):
                if fa * fb < 0.0:
                    breaks.add(float(brentq(beyond, a, b, xtol=1e-15, rtol=1e-14)))
    points, weights = np.polynomial.legendre.leggauss(nodes)
    total = 0.0
    for a, b in pairwise(sorted(breaks)):
        for point, weight in zip(points, weights, strict=True):
            r = along(path, 0.5 * (b - a) * point + 0.5 * (b + a))
            velocity = matrix_from_rotation_vector(0.5 * r) @ path[1]
            total += 0.5 * (b - a) * weight * float(law(axes, r) @ velocity)
    return total


def loop(corner_vectors) -> list[tuple[np.ndarray, np.ndarray]]:
    """The closed polygon of geodesics through the orientations of the given rotation vectors."""
    turns = [matrix_from_rotation_vector(r) for r in (*corner_vectors, corner_vectors[0])]
    return [(a, rotation_vector_from_matrix(a.T @ b)) for a, b in pairwise(turns)]


TRIANGLE = loop(
    [np.array([0.9, 0.2, -0.3]), np.array([-0.2, 1.1, 0.4]), np.array([0.3, -0.4, 1.0])]
)


@pytest.mark.parametrize("joint", JOINTS)
@given(rotation_vectors)
def test_conservative_torque_is_minus_the_slope_of_energy_on_the_rotation_group(joint, r):
    axes = JOINTS[joint]
    for axis in axes:  # at a corner the torque's slope jumps, and differences say less
        component = float(np.dot(axis.direction, r))
        assume(all(abs(component - corner) > 1e-4 for corner in corners(axis)))
    half, whole = matrix_from_rotation_vector(0.5 * r), matrix_from_rotation_vector(r)
    h = 1e-6

    def energy(turn_in_half_way_frame):
        step = matrix_from_rotation_vector(half @ turn_in_half_way_frame)
        return conservative_energy(axes, rotation_vector_from_matrix(step @ whole))

    slope = [(energy(h * e) - energy(-h * e)) / (2.0 * h) for e in np.eye(3)]
    torque = conservative_torque(axes, r)
    size = 1.0 + np.linalg.norm(torque) + abs(conservative_energy(axes, r))
    assert np.allclose(torque, -np.array(slope), rtol=0.0, atol=2e-8 * size)


@pytest.mark.parametrize("joint", JOINTS)
@given(rotation_vectors)
def test_the_small_angle_series_meets_the_formula(joint, r):
    assume(np.linalg.norm(r) > 0.1)
    direction = r / np.linalg.norm(r)
    below, above = (conservative_torque(JOINTS[joint], a * direction) for a in (0.00999999, 0.01))
    assert np.allclose(below, above, rtol=0.0, atol=2e-5)


@pytest.mark.parametrize("law", VECTOR_LAWS)
@pytest.mark.parametrize("joint", JOINTS)
@pytest.mark.parametrize("angle", [-2.5, -0.8, -1e-3, 0.0, 1e-3, 0.8, 2.5])
def test_both_laws_reduce_to_the_law_of_the_axis_in_both_directions(law, joint, angle):
    axes = JOINTS[joint]
    if joint == "oblique":
        axes = axes[:1]
    for axis in axes:
        direction = np.array(axis.direction)
        torque = elastic_torque(law, axes, angle * direction)
        assert torque @ direction == pytest.approx(total_torque(axis.elastic, angle), abs=1e-12)


@pytest.mark.parametrize("joint", JOINTS)
def test_round_a_closed_loop_the_conservative_law_does_no_work(joint):
    done = [work(conservative_torque, JOINTS[joint], path, 24) for path in TRIANGLE]
    assert max(map(abs, done)) > 1.0  # there was something to cancel
    assert abs(sum(done)) < 1e-10


def test_round_a_closed_loop_the_weighted_law_does_work():
    coarse, fine = (
        sum(work(weighted_torque, LEFT_HIP, path, nodes) for path in TRIANGLE) for nodes in (24, 48)
    )
    assert abs(fine) > 1.0
    assert coarse == pytest.approx(fine, rel=1e-2)


@pytest.mark.parametrize("law", VECTOR_LAWS)
@given(rotation_vectors)
def test_the_right_joint_is_the_mirror_image_of_the_left(law, r):
    # Reflected in the xz plane, turns about x and z change sign and turns about y do not.
    mirror = np.array([-1.0, 1.0, -1.0])
    left = elastic_torque(law, LEFT_HIP, r)
    right = elastic_torque(law, RIGHT_HIP, mirror * r)
    assert np.allclose(right, mirror * left, rtol=1e-12, atol=1e-11)
    energies = [conservative_energy(LEFT_HIP, r), conservative_energy(RIGHT_HIP, mirror * r)]
    assert energies[0] == pytest.approx(energies[1], rel=1e-12, abs=1e-11)


@pytest.mark.parametrize("law", VECTOR_LAWS)
@pytest.mark.parametrize("joint", JOINTS)
@given(rotation_vectors)
def test_a_joint_told_about_the_opposite_axes_is_the_same_joint(law, joint, r):
    axes = JOINTS[joint]
    turned = tuple(axis.with_opposite_axis() for axis in axes)
    torque = elastic_torque(law, axes, r)
    assert np.allclose(elastic_torque(law, turned, r), torque, rtol=1e-12, atol=1e-11)


@pytest.mark.parametrize("law", VECTOR_LAWS)
@pytest.mark.parametrize("joint", JOINTS)
@given(st.lists(rotation_vectors, min_size=1, max_size=4))
def test_arrays_and_floats_agree(law, joint, rows):
    axes = JOINTS[joint]
    together = elastic_torque(law, axes, np.array(rows))
    single = [elastic_torque(law, axes, r, FLOATS) for r in rows]
    assert np.allclose(together, single, rtol=1e-12, atol=1e-11)
    energies = conservative_energy(axes, np.array(rows))
    assert np.allclose(energies, [conservative_energy(axes, r, FLOATS) for r in rows], atol=1e-11)


@given(rotation_vectors)
def test_the_weighted_law_is_continuous_where_a_component_changes_sign(r):
    assume(np.linalg.norm(r[1:]) > 0.1)
    below, above = (weighted_torque(LEFT_HIP, np.array([x, r[1], r[2]])) for x in (-1e-9, 1e-9))
    assert np.allclose(below, above, rtol=0.0, atol=1e-4)


def test_a_known_oblique_value_of_the_weighted_law():
    axes = (AxisSpring(X, (Linear(10.0),)), AxisSpring(Y, (Cubic((0.0, 0.0, 0.0, 5.0)),)))
    r = np.array([0.3, -0.4, 0.0])
    assert weighted_torque(axes, r) == pytest.approx([-0.6 * 10.0 * 0.5, 0.8 * 5.0 * 0.125, 0.0])


@example(np.array([0.0, 0.0, 1.15e-13]))
@given(rotation_vectors)
def test_an_isotropic_linear_spring_is_one_spring_in_both_laws(r):
    axes = tuple(AxisSpring(axis, (Linear(20.0),)) for axis in (X, Y, Z))
    for law in VECTOR_LAWS:
        assert np.allclose(elastic_torque(law, axes, r), -20.0 * r, rtol=1e-12, atol=1e-12)


@given(rotation_vectors, rotation_vectors, rotation_vectors)
def test_the_group_torque_has_the_power_of_its_forces(f, r, rate):
    """f . dr/dt for a turn that goes on at some angular velocity of the half-way frame."""
    assume(np.linalg.norm(r) < 3.0)
    h = 1e-5
    half = matrix_from_rotation_vector(0.5 * r)
    turn = matrix_from_rotation_vector(r)
    ahead, behind = (
        rotation_vector_from_matrix(matrix_from_rotation_vector(step * half @ rate) @ turn)
        for step in (h, -h)
    )
    expected = f @ (ahead - behind) / (2.0 * h)
    assert group_torque(f, r) @ rate == pytest.approx(expected, rel=1e-5, abs=1e-5)


@given(rotation_vectors, rotation_vectors)
def test_damping_and_hysteresis_about_any_axes_take_energy(rate, coefficients):
    a, b, c = np.abs(coefficients)
    axes = (
        AxisSpring((-1.0, 0.0, 0.0), damping=Damping(a)),
        AxisSpring(
            (0.0, 0.6, 0.8), (Hysteresis.from_mean_and_width(Linear(5.0), c),), Damping(b, 0.3)
        ),
        AxisSpring(Y, damping=Damping(0.0, c)),
    )
    r = 0.3 * coefficients
    assert damping_torque(axes, r, rate) @ rate <= 1e-15


def test_a_joint_with_slides_only_has_no_torque_and_no_energy():
    r = np.array([0.1, 0.2, 0.3])
    assert conservative_energy((), r) == 0.0
    assert conservative_energy((), np.stack([r, r])).tolist() == [0.0, 0.0]
    for law in VECTOR_LAWS:
        assert elastic_torque(law, (), r).tolist() == [0.0, 0.0, 0.0]
