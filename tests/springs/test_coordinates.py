"""Laws of a joint's own displacements: closed forms, gradient, power, mirror, and the pole."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from generator.figure import AxisKind, JointAxis
from generator.joint_chain import Chain
from generator.rotations import matrix_from_rotation_vector, rotation_vector_from_matrix
from springs import (
    FLOATS,
    AxisSpring,
    Cubic,
    Damping,
    JointSprings,
    Linear,
    Singularity,
    SphericalLaw,
    rotation_law,
)
from springs.coordinates import ChainCoordinates

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
NEGATIVE = {axis: tuple(-part for part in axis) for axis in (X, Y, Z)}

CHAINS = [
    tuple(NEGATIVE[axis] if flipped else axis for axis, flipped in zip(order, flips, strict=True))
    for order in permutations((X, Y, Z))
    for flips in ((False, False, False), (True, False, False), (False, True, True))
]
ANGLES = st.floats(-3.0, 3.0)
MIDDLE = st.floats(-1.4, 1.4)


def figure_chain(axes):
    return Chain(tuple(JointAxis(AxisKind.ROTATION, axis) for axis in axes))


def vector_of(axes, angles):
    """Rotation vector of a chain's displacements."""
    return rotation_vector_from_matrix(figure_chain(axes).pose(np.array(angles))[:3, :3])


def law_of(axes, *, damping=0.0):
    """A law with another curve about each axis, the second about the opposite axis."""
    curves = (Cubic((1.0, 30.0, -8.0, 40.0)), Linear(25.0, 0.3), Cubic((0.0, 12.0, 3.0, 9.0)))
    springs = tuple(
        AxisSpring(axis if k != 1 else tuple(-a for a in axis), (curve,), Damping(damping))
        for k, (axis, curve) in enumerate(zip(axes, curves, strict=False))
    )
    return rotation_law(JointSprings("joint", springs), SphericalLaw.COORDINATES, axes)


@pytest.mark.parametrize("axes", CHAINS)
@given(first=ANGLES, second=MIDDLE, third=ANGLES)
def test_the_displacements_are_those_of_the_chain(axes, first, second, third):
    coordinates = ChainCoordinates(axes, (0.0, 0.0, 0.0))
    for ops_axes, angles in ((axes, (first, second, third)), (axes[:2], (first, third))):
        r = vector_of(ops_axes, angles)
        chain = coordinates if len(ops_axes) == 3 else ChainCoordinates(ops_axes, (0.0, 0.0))
        assert chain.at(r, FLOATS).angles == pytest.approx(angles, abs=1e-12)


def test_an_angle_is_within_half_a_turn_of_the_middle_of_its_range():
    coordinates = ChainCoordinates((Z, X, Y), (0.0, 0.0, 1.0))
    assert coordinates.at(vector_of((Z, X, Y), (0.1, 0.2, 4.0)), FLOATS).angles == pytest.approx(
        (0.1, 0.2, 4.0)
    )


@pytest.mark.parametrize("axes", [*CHAINS, (Z, Y), (NEGATIVE[X], Z)])
@settings(max_examples=10)
@given(first=st.floats(-2.0, 2.0), second=st.floats(-1.2, 1.2), third=st.floats(-2.0, 2.0))
def test_the_torque_is_the_slope_of_the_energy(axes, first, second, third):
    """By turns about the parent's axes."""
    law = law_of(axes)
    r = vector_of(axes, (first, second, third)[: len(axes)])
    assume(np.linalg.norm(r) < 3.0)
    step = 1e-4
    slope = np.zeros(3)
    for k, axis in enumerate(np.eye(3)):
        ends = [
            law.energy(
                rotation_vector_from_matrix(
                    matrix_from_rotation_vector(size * axis) @ matrix_from_rotation_vector(r)
                )
            )
            for size in (-2 * step, -step, step, 2 * step)
        ]
        slope[k] = (ends[0] - 8.0 * ends[1] + 8.0 * ends[2] - ends[3]) / (12.0 * step)
    torque = matrix_from_rotation_vector(0.5 * r) @ law.torque(r)
    if len(axes) == 2:
        # The constraint bears what turns the joint out of its two rotations.
        chain = figure_chain(axes)
        free = chain.twists(chain.displacements(np.block(
            [[matrix_from_rotation_vector(r), np.zeros((3, 1))], [np.zeros((1, 3)), 1.0]]
        )))[:, :3]  # fmt: skip
        torque, slope = free @ torque, free @ slope
    assert torque == pytest.approx(-slope, rel=1e-7, abs=1e-6)


@pytest.mark.parametrize("axes", CHAINS[:6])
@given(first=ANGLES, second=MIDDLE, third=ANGLES, rates=st.tuples(ANGLES, ANGLES, ANGLES))
def test_the_power_is_the_sum_over_the_displacements(axes, first, second, third, rates):
    """Of the torque, of damping, and of generalized forces that a law over joints gives."""
    law = law_of(axes, damping=0.7)
    displacements = np.array([first, second, third])
    r = vector_of(axes, displacements)
    assume(np.linalg.norm(r) < 3.1)
    angular = np.array(rates) @ figure_chain(axes).twists(displacements)[:, :3]
    rate = matrix_from_rotation_vector(0.5 * r).T @ angular
    given_torques = [2.0, -3.0, 5.0]
    torque = law.torque_about(axes, given_torques, r)
    assert torque @ rate == pytest.approx(np.dot(given_torques, rates), rel=1e-9, abs=1e-9)
    damping = law.damping(r, rate)
    assert damping @ rate == pytest.approx(-0.7 * np.dot(rates, rates), rel=1e-9, abs=1e-9)


def test_arrays_and_floats_agree():
    law = law_of(CHAINS[1], damping=0.3)
    r = np.array([vector_of(CHAINS[1], row) for row in ((0.1, 0.2, 0.3), (-1.0, 1.1, 0.4))])
    rate = np.array([[0.1, 0.2, -0.3], [1.0, -2.0, 0.5]])
    for k in range(2):
        assert law.torque(r)[k] == pytest.approx(law.torque(r[k], FLOATS), abs=1e-12)
        assert law.energy(r)[k] == pytest.approx(law.energy(r[k], FLOATS), abs=1e-12)
        assert law.damping(r, rate)[k] == pytest.approx(law.damping(r[k], rate[k], FLOATS))


def test_near_the_pole_torques_are_bounded_and_damping_dissipates():
    law = law_of((Z, X, Y), damping=0.5)
    for distance in (1e-2, 1e-5, 0.0):
        r = vector_of((Z, X, Y), (0.3, 0.5 * np.pi - distance, 0.2))
        assert np.all(np.isfinite(law.torque(r)))
        assert law.damping(r, np.array([1.0, 2.0, 3.0])) @ [1.0, 2.0, 3.0] <= 0.0


def test_what_has_a_pole():
    assert law_of((Z, X, Y)).singularity is Singularity.POLE
    assert law_of((Z, X)).singularity is Singularity.NONE


def test_springs_and_chains_that_have_no_coordinates_are_refused():
    skew = (AxisSpring((0.6, 0.8, 0.0), (Linear(1.0),)),)
    with pytest.raises(ValueError, match="springs about axes of the joint's chain"):
        rotation_law(JointSprings("joint", skew), SphericalLaw.COORDINATES, (X, Y, Z))
    with pytest.raises(ValueError, match="three perpendicular axes"):
        rotation_law(JointSprings("joint"), SphericalLaw.COORDINATES, (X, Y, X))
