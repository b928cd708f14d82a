"""Angles of joints from Euler parameters, their rates, and the forces that torques are on them."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from generator.joint_chain import build_chain
from generator.rotations import matrix_from_axis_angle, matrix_from_rotation_vector
from generator.simulation.exudyn_model.relative_rotation import (
    JointEnd,
    JointRates,
    RelativeRotation,
    RevoluteAngles,
    SphericalAngles,
    conjugate,
    product,
    quaternion,
)
from tests.chains import ACROSS, SKEW, chain

components = st.floats(-1.2, 1.2)
vectors = st.tuples(components, components, components)
angles = st.floats(-9.0, 9.0)
scales = st.floats(0.5, 2.0)


def turned(vector):
    return quaternion(matrix_from_rotation_vector(np.array(vector)))


@given(vectors, vectors)
def test_products_are_those_of_the_matrices(one, other):
    both = matrix_from_rotation_vector(np.array(one)) @ matrix_from_rotation_vector(np.array(other))
    made = np.array(product(turned(one), turned(other)))
    assert abs(made @ np.array(quaternion(both))) == pytest.approx(1.0, abs=1e-12)
    assert product(turned(one), conjugate(turned(one))) == pytest.approx((1, 0, 0, 0), abs=1e-12)


@given(angles, scales, st.sampled_from([1.0, -1.0]))
def test_a_hinge_counts_whole_turns_from_the_angle_nearby(angle, scale, side):
    """Whatever the length and the sign of the quaternion."""
    made = quaternion(matrix_from_axis_angle(np.array(SKEW), angle))
    turn = tuple(scale * side * part for part in made)
    hinge = RevoluteAngles(SKEW, (1.0, -1.0))
    assert hinge.values(turn, angle + 1.0) == pytest.approx([angle, -angle], abs=1e-9)


@given(vectors, scales, st.sampled_from([1.0, -1.0]))
def test_a_ball_has_the_components_of_its_rotation_vector(vector, scale, side):
    turn = tuple(scale * side * part for part in turned(vector))
    expected = [np.dot(vector, SKEW), np.dot(vector, ACROSS)]
    assert SphericalAngles((SKEW, ACROSS)).values(turn, 0.0) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("size", [0.0, 1e-300, 1e-170, 1e-16, 1e-8, 1e-3])
def test_small_turns_have_angles_and_gradients(size):
    ball = SphericalAngles((SKEW,))
    x, y, z = SKEW
    turn = (1.0, 0.5 * size * x, 0.5 * size * y, 0.5 * size * z)
    assert ball.values(turn, 0.0)[0] == pytest.approx(2.0 * np.arctan(0.5 * size), rel=1e-12)
    gradient = ball.gradient(turn, [3.0])
    assert gradient[1:] == pytest.approx([6.0 * c for c in SKEW], rel=1e-5)


ENDS = st.sampled_from(["both move", "parent held", "child held"])


@given(vectors, vectors, scales, scales, st.booleans(), ENDS)
def test_forces_are_torques_times_the_slopes_of_the_angles(one, other, a, b, is_hinge, moving):
    """Against central differences in all coordinates, also off the unit sphere."""
    angles = RevoluteAngles(SKEW, (1.0, -1.0)) if is_hinge else SphericalAngles((SKEW, ACROSS))
    rests = [tuple(a * c for c in turned(one)), tuple(b * c for c in turned(other))]
    places = {"both move": (7, 0), "parent held": (None, 0), "child held": (7, None)}[moving]
    sites = [turned((0.4, -0.7, 0.3)), turned((-0.3, 0.9, 0.5))]
    turn = RelativeRotation(
        JointEnd(places[0], rests[0], sites[0]), JointEnd(places[1], rests[1], sites[1])
    )
    torques = (2.0, -0.7)

    relative = turn.orientations([0.0] * 14)[2]
    from_jump = np.hypot(relative[0], np.dot(relative[1:], SKEW)) if is_hinge else relative[0]
    assume(abs(from_jump) > 0.1 * a * b)
    near = angles.values(relative, 0.0)[0]

    def work(coordinates):
        return float(np.dot(torques, angles.values(turn.orientations(coordinates)[2], near)))

    forces = [0.0] * 14
    turn.add_forces(forces, turn.orientations([0.0] * 14), angles.gradient(relative, torques))
    h = 1e-5
    slopes = [(work(list(step)) - work(list(-step))) / (2.0 * h) for step in h * np.eye(14)]
    assert forces == pytest.approx(slopes, abs=1e-6)
    assert np.max(np.abs(slopes)) > 0.1


CHAINS = ["Rx", "R-y", "Rs", "Rx Ry", "Rs Ra", "R-y Rz", "Rx Ry Rz", "Rz R-x Rz", "Rs Ra Rs"]

three = st.tuples(*[st.floats(-3.0, 3.0)] * 3)


@given(st.sampled_from(CHAINS), three, three, st.sampled_from([1.0, -1.0, 0.7]))
def test_the_rates_of_an_angular_velocity(word, angles, rates, scale) -> None:
    """Whatever the length and the sign of the quaternion; away from where axes fall together."""
    made = build_chain(chain(word))
    count = len(made.joint_axes)
    q, given_rates = np.array(angles[:count]), np.array(rates[:count])
    axes = made.twists(q)[:, :3]
    assume(np.linalg.svd(axes, compute_uv=False)[-1] > 0.05)
    turn = tuple(scale * part for part in quaternion(made.pose(q)[:3, :3]))
    found = JointRates.from_chain(made, q)
    spin = given_rates @ axes
    assert [np.dot(axis, spin) for axis in found.rate_axes(turn)] == pytest.approx(
        list(given_rates), abs=1e-9
    )
    assert found.angular_velocity(q.tolist(), given_rates.tolist()) == pytest.approx(
        list(spin), abs=1e-12
    )


@given(st.sampled_from(CHAINS), three, three, three)
def test_the_angular_acceleration_is_the_slope_of_the_angular_velocity(
    word, angles, rates, accelerations
) -> None:
    made = build_chain(chain(word))
    count = len(made.joint_axes)
    q, v, a = (np.array(values[:count]) for values in (angles, rates, accelerations))
    found = JointRates.from_chain(made, q)
    h = 1e-4

    def spin(t):
        moved = q + t * v + 0.5 * t * t * a
        return np.array(found.angular_velocity(moved.tolist(), (v + t * a).tolist()))

    expected = (spin(h) - spin(-h)) / (2.0 * h)
    solved = found.angular_acceleration(q.tolist(), v.tolist(), a.tolist())
    assert solved == pytest.approx(list(expected), abs=1e-5)


@given(three)
def test_slides_are_passed_over(angles) -> None:
    made = build_chain(chain("Rx Ry Rz Tx"))
    q = np.array([*angles, 0.3])
    axes = made.twists(q)[:3, :3]
    assume(np.linalg.svd(axes, compute_uv=False)[-1] > 0.05)
    found = JointRates.from_chain(made, q).rate_axes(quaternion(made.pose(q)[:3, :3]))
    assert np.allclose(np.array(found) @ axes.T, np.eye(3), atol=1e-9)


def test_at_a_pole_the_rates_are_finite() -> None:
    """At a pole a solver gets large numbers and no division by zero."""
    made = build_chain(chain("Rx Ry Rz"))
    q = np.array([0.3, 0.5 * np.pi, 0.1])
    found = np.array(JointRates.from_chain(made, q).rate_axes(quaternion(made.pose(q)[:3, :3])))
    assert np.all(np.isfinite(found))
