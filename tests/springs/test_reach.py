"""The law of a limb's reach: points met, gradient, mirror, half turns, and what is refused."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from generator.rotations import matrix_from_rotation_vector, rotation_vector_from_matrix
from springs import (
    FLOATS,
    AxisSpring,
    Damping,
    JointSprings,
    Linear,
    Reach,
    ReachLaw,
    ReachPoint,
    Singularity,
    SphericalLaw,
    Stop,
    TurnRange,
    rotation_law,
)
from springs.axis import UNKNOWN_AXIS
from springs.smooth_limit import SmoothLimit

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
BOUNDARY = [(0, 170), (60, 175), (100, 150), (150, 65), (-150, 45), (-90, 62), (-50, 110)]
TURNS = [
    *[(0, 0, -80, 70), (0, 90, -100, 55), (90, 90, -100, 45), (-70, 50, -90, 65)],
    *[(50, 140, -70, 25), (120, 80, -90, 60)],
]
WALL = AxisSpring(UNKNOWN_AXIS, (SmoothLimit(-3.0, -0.6, 0.0, 400.0, 2.0), Stop(None, 0.3, 90.0)))


def point(plane: float, elevation: float) -> ReachPoint:
    return ReachPoint(radians(plane), radians(elevation))


def arm(side: float = 1.0) -> Reach:
    """Reach of a left arm, or of its mirror image."""
    turns = (TurnRange(point(a, b), radians(low), radians(high)) for a, b, low, high in TURNS)
    return Reach(
        Z,
        ((side, 0.0, 0.0), Y),
        point(55, 70),
        tuple(point(*each) for each in BOUNDARY),
        tuple(turns),
        harmonics=3,
        sense=side,
        beyond=WALL,
        turn=WALL,
    )


ARM, MIRRORED = arm(), arm(-1.0)
PART = st.floats(-1.8, 1.8)
VECTOR = st.tuples(PART, PART, PART).map(np.array)


def raised(plane: float, elevation: float, turn: float = 0.0) -> np.ndarray:
    """Rotation vector of the left arm, turned about itself and raised in a plane [deg]."""
    about = np.array([np.cos(radians(plane)), np.sin(radians(plane)), 0.0])
    lifted = matrix_from_rotation_vector(radians(elevation) * about)
    return rotation_vector_from_matrix(
        lifted @ matrix_from_rotation_vector(radians(turn) * np.array(Z))
    )


def test_the_boundary_passes_its_points():
    assert max(ARM.residuals) < radians(8.0)
    flat = AxisSpring(UNKNOWN_AXIS, (Linear(1.0),))
    read = replace(ARM, beyond=flat, turns=())
    for plane, elevation in BOUNDARY:
        beyond = np.sqrt(2.0 * read.energy(raised(plane, elevation), FLOATS))
        assert beyond < radians(8.0)


@given(plane=st.floats(-180.0, 180.0), elevation=st.floats(1.0, 150.0))
def test_the_energy_does_not_jump_while_a_limb_turns_about_itself(plane, elevation):
    """Nor where the turn is half of one from the middle of its range, wherever the limb points."""
    start = matrix_from_rotation_vector(raised(plane, elevation))
    jumps = []
    for step in (1.0, 0.1):
        turns = np.radians(np.arange(0.0, 361.0, step))[:, None] * np.array(Z)
        made = rotation_vector_from_matrix(start @ matrix_from_rotation_vector(turns))
        jumps.append(float(np.max(np.abs(np.diff(ARM.energy(made))))))
    assert jumps[1] < 0.2 * jumps[0]


def test_a_turn_is_told_as_the_limb_is_turned_before_it_is_raised():
    """Beyond the highest turn of each direction by 20 deg, a stop there has that depth."""
    stop = AxisSpring(UNKNOWN_AXIS, (Linear(1.0),))
    read = replace(ARM, beyond=replace(WALL, elastic=(Linear(0.0),)), turn=stop)
    for plane, elevation, low, high in TURNS:
        at = read.at(raised(plane, elevation, high + 20.0), FLOATS)
        upper, lower = at.upper[0], at.lower[0]
        assert np.degrees(at.turn - upper) == pytest.approx(20.0, abs=8.0)
        assert np.degrees(upper - lower) == pytest.approx(high - low, abs=12.0)


def half_way_gradient(law: ReachLaw, r: np.ndarray, step: float) -> np.ndarray:
    """Minus the slope of the energy along turns in the half-way frame, by central differences."""
    rotation, half = matrix_from_rotation_vector(r), matrix_from_rotation_vector(0.5 * r)
    slopes = []
    for axis in np.eye(3):
        both = [
            law.energy(
                rotation_vector_from_matrix(
                    matrix_from_rotation_vector(sign * step * (half @ axis)) @ rotation
                ),
                FLOATS,
            )
            for sign in (1.0, -1.0)
        ]
        slopes.append((both[1] - both[0]) / (2.0 * step))
    return np.array(slopes)


@given(VECTOR)
def test_the_torque_is_the_slope_of_the_energy(r):
    law = ReachLaw((), ARM)
    assume(ARM.at(r, FLOATS).theta < 2.9)
    found = np.array(law.torque(r, FLOATS))
    coarse, fine = (half_way_gradient(law, r, step) for step in (2e-4, 1e-4))
    exact = fine + (fine - coarse) / 3.0
    assert np.abs(found - exact).max() < 1e-7 * (1.0 + np.abs(exact).max())


@given(VECTOR)
def test_the_right_arm_is_the_mirror_image_of_the_left(r):
    flip = np.array([-1.0, 1.0, -1.0])
    left, right = ARM.torque(r, FLOATS), MIRRORED.torque(flip * r, FLOATS)
    assert np.array_equal(right, flip * left)


def test_mirror_images_are_exact_with_a_point_opposite_to_the_zero_of_the_azimuth():
    """Its azimuth is half a turn on both sides, not that and its opposite."""
    one, other = (
        replace(each, boundary=(*each.boundary, point(55, 178)), turns=each.turns[:3])
        for each in (ARM, MIRRORED)
    )
    r = np.random.default_rng(5).uniform(-1.7, 1.7, (500, 3))
    flip = np.array([-1.0, 1.0, -1.0])
    assert np.array_equal(other.torque(flip * r), flip * one.torque(r))


def test_at_the_centre_and_near_it_the_torque_is_smooth():
    """The turn's ends have slopes there; the azimuth has no gradient at the centre itself."""
    at_centre = raised(55, 70, 60.0)
    near = [ARM.torque(raised(55, 70 + d, 60.0), FLOATS) for d in (-0.2, -0.05, 0.05, 0.2)]
    middle = ARM.torque(at_centre, FLOATS)
    assert np.abs(middle).max() > 0.1
    assert all(np.allclose(each, middle, atol=0.05 * np.abs(middle).max()) for each in near)


def test_half_a_turn_is_no_end():
    """The torque of a rotation by 180 deg is that of either of its vectors, as a whole vector."""
    r = raised(55, 179.9999, 30.0)
    assert np.linalg.norm(r) > np.pi - 0.2
    axis = r / np.linalg.norm(r)
    one, other = (np.pi - 1e-7) * axis, -(np.pi - 1e-7) * axis
    torques = [
        matrix_from_rotation_vector(0.5 * each) @ ARM.torque(each, FLOATS) for each in (one, other)
    ]
    assert np.allclose(*torques, atol=1e-3 * (1.0 + np.abs(torques[0]).max()))
    assert ReachLaw((), ARM).singularity is Singularity.NONE


def test_arrays_and_floats_agree():
    vectors = np.random.default_rng(3).uniform(-1.5, 1.5, (40, 3))
    assert np.allclose(
        ARM.torque(vectors), [ARM.torque(r, FLOATS) for r in vectors], rtol=1e-12, atol=1e-12
    )
    assert np.allclose(ARM.energy(vectors), [ARM.energy(r, FLOATS) for r in vectors], rtol=1e-12)


def test_a_reach_takes_the_place_of_elastic_laws_under_any_law():
    own = JointSprings("shoulder", (AxisSpring(X, (), Damping(0.2)),), reach=ARM)
    r, rate = np.array([0.4, 0.9, -0.3]), np.array([1.0, -2.0, 0.5])
    for law in SphericalLaw:
        made = rotation_law(own, law, (Z, X, Y))
        assert np.array_equal(made.torque(r), ARM.torque(r))
        assert made.damping(r, rate) == pytest.approx([-0.2, 0.0, 0.0])
    assert own.is_elastic
    with pytest.raises(ValueError, match="damping only"):
        JointSprings("shoulder", (AxisSpring(X, (Linear(1.0),)),), reach=ARM)
    with pytest.raises(ValueError, match="several joints"):
        ReachLaw((), ARM).angles([X], r)


def test_a_factor_scales_the_torque():
    r = raised(180, 60, 80.0)
    scaled = ARM.with_laws(lambda law: law.scaled(2.5, 1.0))
    assert np.allclose(scaled.torque(r), 2.5 * ARM.torque(r))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"boundary": ARM.boundary[:6]}, "needs 7 points, not 6"),
        ({"turns": ARM.turns[:1]}, "three directions at least"),
        ({"centre": point(0, 0)}, "direction at zero"),
        ({"centre": point(-120, 30)}, "from its centre, not between 0 and 165"),
    ],
)
def test_a_reach_that_cannot_be_is_refused(change, message):
    with pytest.raises(ValueError, match=message):
        replace(ARM, **change)
