from math import exp, inf

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from springs import FLOATS
from springs.coupled import CoupledExponential, CoupledTerm, NotConservativeError
from springs.transformed import Transformed
from tests.slopes import gradient

NAMES = ("hip flexion", "knee flexion", "ankle dorsiflexion")
RANGES = ((-0.3, 1.7), (0.0, 2.3), None)

small = st.floats(-4.0, 4.0)
triples = st.tuples(small, small, small)
angle_sets = st.tuples(*[st.floats(-1.0, 1.0)] * 3)


def gradient_term(energy, rates, exponent, end):
    return CoupledTerm(tuple(-energy * rate for rate in rates), rates, exponent, end)


rates = triples.filter(lambda r: max(map(abs, r)) > 0.1)
ends = st.none() | st.floats(-1.0, 3.0)
any_terms = st.builds(CoupledTerm, triples, rates, st.floats(-1.0, 1.0), ends)
gradient_terms = st.builds(gradient_term, st.floats(-5.0, 5.0), rates, st.floats(-1.0, 1.0), ends)


def laws(terms):
    made = st.lists(terms, max_size=3).map(tuple)
    return st.builds(CoupledExponential, st.just(NAMES), made, triples, st.just(RANGES))


def near(values):
    return pytest.approx(values, rel=1e-9, abs=1e-9)


MOTOR = CoupledExponential(
    ("hip flexion", "knee flexion"),
    (CoupledTerm((1.0, 0.0), (0.5, 2.0)),),
    (0.0, 0.0),
    (None, None),
)


def test_a_known_value():
    law = CoupledExponential(
        ("hip flexion", "knee flexion"),
        (CoupledTerm((3.0, -1.0), (0.5, 2.0), 0.1), CoupledTerm((0.0, 2.0), (0.0, -1.0))),
        (4.0, 5.0),
        (None, None),
    )
    shared = exp(0.1 + 0.5 * 0.2 + 2.0 * 0.3)
    assert law.torques((0.2, 0.3)) == near((4.0 + 3.0 * shared, 5.0 - shared + 2.0 * exp(-0.3)))


@given(laws(any_terms), angle_sets)
def test_slopes_are_those_of_the_torques(law, angles):
    for row, place in zip(law.torque_jacobian(angles), range(3), strict=True):
        expected = gradient(lambda x, k=place: law.torques(x)[k], angles)
        assert row == pytest.approx(expected, rel=1e-6, abs=1e-6)


@given(laws(gradient_terms), angle_sets)
def test_torques_are_minus_the_gradient_of_energy(law, angles):
    assert law.is_conservative
    assert law.torques(angles) == near([-part for part in gradient(law.energy, angles)])


def test_beyond_its_end_an_exponential_is_its_tangent():
    term = CoupledTerm((3.0, -1.0), (0.5, 2.0), 0.1, 0.4)
    law = CoupledExponential(("hip flexion", "knee flexion"), (term,), (0.0, 0.0), (None, None))
    for angles in ((0.0, 0.1), (0.2, 0.1)):  # before the end, and on it
        exponential = exp(0.1 + 0.5 * angles[0] + 2.0 * angles[1])
        assert law.torques(angles) == near((3.0 * exponential, -exponential))
    assert law.torques((2.0, 1.0))[0] == near(3.0 * exp(0.4) * (1.0 + 3.1 - 0.4))
    bent = np.linspace(0.5, 9.0, 5)
    assert np.diff(law.torques((bent, bent))[1], 2) == pytest.approx(0.0, abs=1e-12)


def test_torques_that_are_no_gradient_have_no_energy():
    assert not MOTOR.is_conservative
    with pytest.raises(NotConservativeError, match="hip flexion, knee flexion are not a grad"):
        MOTOR.energy((0.0, 0.0))


def test_terms_of_equal_rates_may_be_a_gradient_together():
    rates = (0.5, 2.0)
    hip, knee = CoupledTerm((-0.5, 0.0), rates), CoupledTerm((0.0, -2.0), rates)
    law = CoupledExponential(("hip flexion", "knee flexion"), (hip, knee), (0.0, 0.0), (None, None))
    assert not hip.is_gradient
    assert law.is_conservative
    assert law.energy((0.2, 0.3)) == pytest.approx(exp(0.1 + 0.6))


@given(laws(any_terms), st.lists(angle_sets, min_size=1, max_size=3))
def test_arrays_and_floats_agree(law, rows):
    columns = np.array(rows).T
    single = np.array([law.torques(row, FLOATS) for row in rows]).T
    assert np.allclose(law.torques(columns), single, rtol=1e-12, atol=1e-12)


@given(laws(any_terms), angle_sets)
def test_the_mirrored_law_turns_angle_and_torque_of_its_coordinates(law, angles):
    h, k, a = angles
    mirrored = law.mirrored(NAMES[0], NAMES[2])
    hip, knee, ankle = law.torques(angles)
    assert mirrored.torques((-h, k, -a)) == near((-hip, knee, -ankle))
    assert mirrored.valid_ranges == ((-1.7, 0.3), (0.0, 2.3), None)
    assert mirrored.mirrored(NAMES[0], NAMES[2]) == law


@given(laws(any_terms), angle_sets, st.floats(-2.0, 2.0), st.floats(-0.5, 0.5))
def test_the_law_is_scaled_and_moved(law, angles, scale, offset):
    moved = law.scaled(scale, {"knee flexion": offset})
    h, k, a = angles
    assert moved.torques((h, k + offset, a)) == near([scale * t for t in law.torques(angles)])
    assert moved.valid_ranges[1] == pytest.approx((offset, 2.3 + offset))


@given(laws(any_terms), angle_sets)
def test_holding_a_joint_leaves_the_others_as_they_are(law, angles):
    h, k, a = angles
    pair = law.hold_coordinate("knee flexion", k)
    assert pair.coordinates == (NAMES[0], NAMES[2])
    assert pair.valid_ranges == (RANGES[0], RANGES[2])
    hip, _, ankle = law.torques(angles)
    assert pair.torques((h, a)) == near((hip, ankle))


@given(laws(any_terms), angle_sets)
def test_the_law_about_one_joint_is_an_exponential_of_its_angle(law, angles):
    held = dict(zip(NAMES, angles, strict=True))
    for place, name in enumerate(NAMES):
        alone = law.single_angle_law(name, held)
        assert alone.torque(angles[place]) == near(law.torques(angles)[place])
        assert alone.valid_range == RANGES[place]
        assert Transformed(alone, 2.0).valid_range == RANGES[place]


def test_far_outside_the_torque_is_infinite_for_every_kind_of_number():
    assert MOTOR.torques((0.0, 1e4))[0] == MOTOR.torques((0.0, 1e4), FLOATS)[0] == inf


def test_senseless_laws_are_refused():
    with pytest.raises(ValueError, match="not all zero"):
        CoupledTerm((1.0, 0.0), (0.0, 0.0))
    with pytest.raises(ValueError, match="2 entries, one a coordinate"):
        CoupledExponential(("a", "b"), (CoupledTerm((1.0,), (1.0,)),), (0.0, 0.0), (None, None))
    with pytest.raises(ValueError, match="no coordinate `toe`; it has hip flexion, knee flexion"):
        MOTOR.hold_coordinate("toe", 0.0)
