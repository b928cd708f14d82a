"""Ramps in place of laws of the rotation vector, and their errors."""

from dataclasses import replace
from itertools import pairwise
from math import radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator import read_springs
from generator.joint_chain import build_chain
from generator.model_files.fit_error import are_in_range, joint_ranges
from generator.model_files.mjcf.spring_fit import (
    RELATIVE_TOLERANCE,
    SMALLEST_TOLERANCE,
    Ramp,
    axis_ramps,
    component_range,
    damping_error,
    fit_ramps,
    isotropic_stiffness,
    largest_torque,
    ramps_torque,
    spring_error,
)
from generator.passive_curve import rotation_vector
from generator.rotations import matrix_from_rotation_vector
from springs import (
    AxisSpring,
    Cubic,
    Damping,
    JointSprings,
    Linear,
    SphericalLaw,
    Stop,
    elastic_torque,
)
from tests.chains import BALL, chain, two_bodies
from tests.generator.model_files.model_cases import PROTOTYPE, START, equal

X, Y, Z = np.eye(3).tolist()
ENDS = (-2.0, 2.0)
ANGLES = np.linspace(*ENDS, 401)
FIGURE = two_bodies(BALL, START)
TESTED = FIGURE.joints["tested"]

CORNERS = st.lists(st.integers(-19, 19), min_size=1, max_size=5, unique=True).map(sorted)
TORQUES = st.lists(st.floats(-100.0, 100.0), min_size=7, max_size=7)


def total(ramps: tuple[Ramp, ...], angles: np.ndarray) -> np.ndarray:
    return sum((ramp.torque(angles) for ramp in ramps), np.zeros(len(angles)))


def springs(*stiffness: float, viscous: tuple[float, ...] = (0.0, 0.0, 0.0)) -> JointSprings:
    axes = [
        AxisSpring(axis, (Linear(k),), Damping(b))
        for axis, k, b in zip((X, Y, Z), stiffness, viscous, strict=True)
    ]
    return JointSprings("tested", tuple(axes))


@given(CORNERS, TORQUES)
def test_piecewise_linear_torques_come_back(corners: list[int], torques: list[float]) -> None:
    inner = [0.1 * k for k in corners]
    places = [ENDS[0], *inner, ENDS[1]]
    values = torques[: len(places)]

    def curve(angle: np.ndarray) -> np.ndarray:
        return np.interp(angle, places, values)

    ramps = fit_ramps(curve, inner, ENDS)
    assert total(ramps, ANGLES) == pytest.approx(curve(ANGLES), abs=1e-6)
    assert len(ramps) <= len(places)


@given(st.tuples(*[st.floats(-300.0, 300.0)] * 4))
def test_cubics_are_followed_within_the_tolerance(terms: tuple[float, ...]) -> None:
    def curve(angle: np.ndarray) -> np.ndarray:
        return np.polyval(terms, angle)

    expected = curve(ANGLES)
    allowed = np.maximum(SMALLEST_TOLERANCE, RELATIVE_TOLERANCE * np.abs(expected))
    error = np.abs(total(fit_ramps(curve, (), ENDS), ANGLES) - expected)
    assert (error <= 2.0 * allowed).all()


def test_a_dead_zone_stays_without_torque() -> None:
    law = Cubic((0.0, 50.0, 3.0, 200.0), dead_zone=(-0.4, 0.7))
    ramps = axis_ramps(TESTED, one := JointSprings("tested", (AxisSpring(X, (law,)),)), one.axes[0])
    inside = np.linspace(-0.4, 0.7, 30)
    assert np.abs(total(ramps, inside)).max() < 1e-9
    assert all(ramp.start is not None for ramp in ramps)
    starts = sorted(ramp.start for ramp in ramps if ramp.start is not None)
    assert {-0.4, 0.7} <= set(starts)
    assert all(one < other for one, other in pairwise(starts))


def test_beyond_the_range_a_torque_continues_with_its_slope() -> None:
    ramps = fit_ramps(lambda x: -(x**3), (), (-1.0, 1.0))
    beyond = total(ramps, np.array([1.5, 2.0, 2.5]))
    assert np.diff(beyond, 2) == pytest.approx(0.0, abs=1e-12)
    assert (np.diff(beyond) < 0.0).all()


def test_the_range_of_a_component_is_that_of_its_displacement() -> None:
    of = two_bodies(chain("Rx R-y Rz"), (0.0, 0.0, 0.0))
    joint = of.joints["tested"]
    limited = type(joint)(
        **{**vars(joint), "lower_limit": (-0.1, -0.2, -0.3), "upper_limit": (0.4, 0.5, 0.6)}
    )
    bare = JointSprings("tested")
    assert component_range(limited, bare, AxisSpring(tuple(X))) == (-0.1, 0.4)
    assert component_range(limited, bare, AxisSpring(tuple(Y))) == (-0.5, 0.2)
    skew = AxisSpring((0.6, 0.0, 0.8))
    assert component_range(limited, bare, skew) == (radians(-90.0), radians(90.0))


def test_errors_are_those_across_the_rotation() -> None:
    alike, differing = springs(20.0, 20.0, 20.0), springs(20.0, 20.0, 50.0)
    for each, exact in ((alike, True), (differing, False)):
        ramps = [(axis, axis_ramps(TESTED, each, axis)) for axis in each.axes]
        error = spring_error(TESTED, each, SphericalLaw.CONSERVATIVE, ramps)
        assert (error.largest < 1e-9) == exact
        assert 0.0 <= error.rms <= error.largest
        assert error.largest < largest_torque(TESTED, each, SphericalLaw.CONSERVATIVE)
    weighted = spring_error(
        TESTED,
        differing,
        SphericalLaw.WEIGHTED,
        [(a, axis_ramps(TESTED, differing, a)) for a in differing.axes],
    )
    assert weighted.largest > 0.0


def test_the_stated_error_is_the_largest_over_the_range() -> None:
    own = read_springs(None, PROTOTYPE).joints["waist"]
    waist = PROTOTYPE.joints["waist"]
    ramps = [(axis, axis_ramps(waist, own, axis)) for axis in own.axes]
    error = spring_error(waist, own, SphericalLaw.CONSERVATIVE, ramps)
    of, ranges = build_chain(waist.chain), joint_ranges(waist, own)
    q = np.random.default_rng(3).uniform(*np.array(ranges).T, (40_000, 3))
    r = rotation_vector(of, q[are_in_range(of, ranges, q)])
    half_way = elastic_torque(SphericalLaw.CONSERVATIVE, own.axes, r)
    exact = np.einsum("nij,nj->ni", matrix_from_rotation_vector(0.5 * r), half_way)
    found = np.linalg.norm(ramps_torque(ramps, r) - exact, axis=1)
    assert found.max() <= 1.01 * error.largest <= 1.1 * found.max()
    assert np.sqrt(np.mean(found**2)) == pytest.approx(error.rms, rel=0.05)


def test_equal_springs_with_stops_are_not_isotropic() -> None:
    """Stops are at the ends of the range, beyond which a ball's own spring has none."""
    stop = Stop(-0.5, 0.5, 200.0)
    limited = replace(TESTED, lower_limit=(-0.5,) * 3, upper_limit=(0.5,) * 3)
    alike = springs(20.0, 20.0, 20.0)
    stopped = [replace(axis, elastic=(*axis.elastic, stop)) for axis in alike.axes]
    found = isotropic_stiffness(limited, alike, SphericalLaw.CONSERVATIVE)
    assert found == pytest.approx((20.0, 0.0, 0.0))
    with_stops = JointSprings("tested", tuple(stopped))
    assert isotropic_stiffness(limited, with_stops, SphericalLaw.CONSERVATIVE) is None
    locked = replace(TESTED, lower_limit=(0.0,) * 3, upper_limit=(0.0,) * 3)
    assert isotropic_stiffness(locked, alike, SphericalLaw.CONSERVATIVE) == pytest.approx(
        (20.0, 0, 0)
    )


def test_errors_of_damping_are_per_rate() -> None:
    assert damping_error(TESTED, equal(FIGURE, "tested", 0.0, 0.3)).largest < 1e-12
    error = damping_error(TESTED, springs(1.0, 1.0, 1.0, viscous=(0.3, 0.1, 0.2)))
    assert 0.0 < error.largest < 0.3
