from math import tanh

import pytest
from hypothesis import given
from hypothesis import strategies as st

from springs import (
    AxisSpring,
    CoupledAxis,
    CoupledSpring,
    Cubic,
    Damping,
    JointSprings,
    Linear,
    SphericalLaw,
    SpringSet,
    Stop,
    total_energy,
    total_torque,
)
from springs.coupled import CoupledExponential, CoupledTerm
from springs.hysteresis import Hysteresis

RANGES = (None, None)
SPRING = AxisSpring(
    (-1.0, 0.0, 0.0),
    (Cubic((0.9, 8.6, -14.2, 5.3), -1, (-0.1, 1.6)), Linear(3.0, 0.2), Stop(-0.5, 2.0)),
    Damping(0.08),
    "abduction",
    "a study",
    "a reason",
)


@given(st.floats(-3.0, 3.0))
def test_a_spring_told_about_the_opposite_axis_is_the_same_spring(angle):
    turned = SPRING.with_opposite_axis()
    assert turned.direction == (1.0, 0.0, 0.0)
    torque = total_torque(SPRING.elastic, angle)
    assert total_torque(turned.elastic, -angle) == pytest.approx(-torque, rel=1e-12, abs=1e-12)
    energy = total_energy(SPRING.elastic, angle)
    assert total_energy(turned.elastic, -angle) == pytest.approx(energy, rel=1e-12, abs=1e-12)
    assert turned.with_opposite_axis() == SPRING
    assert (turned.damping, turned.motion, turned.reference) == (
        SPRING.damping,
        SPRING.motion,
        SPRING.reference,
    )


RUBBING = AxisSpring(
    (0.0, 0.0, 1.0),
    (Linear(3.0, 0.2), Hysteresis.from_mean_and_width(Linear(8.0), 2.0, 0.1)),
    Damping(0.5),
)


@given(st.floats(-2.0, 2.0), st.floats(-3.0, 3.0))
def test_the_resistance_is_damping_and_the_friction_of_directional_laws(angle, rate):
    assert SPRING.resistance(angle, rate) == SPRING.damping.torque(rate)
    expected = -0.5 * rate - tanh(rate / 0.1)
    assert RUBBING.resistance(angle, rate) == pytest.approx(expected, rel=1e-12, abs=1e-12)
    turned = RUBBING.with_opposite_axis()
    assert turned.resistance(-angle, -rate) == pytest.approx(-expected, rel=1e-12, abs=1e-12)


def test_references_are_told_once_in_order_and_slides_count():
    def about(reference: str) -> AxisSpring:
        return AxisSpring((1.0, 0.0, 0.0), reference=reference)

    springs = SpringSet(
        {
            "a": JointSprings("a", (about("one"), about(""), about("two")), (about("three"),)),
            "b": JointSprings("b", (about("two"), about("four"))),
        }
    )
    assert springs.references == ("one", "two", "three", "four")


def test_an_empty_set_is_conservative_and_has_no_origin():
    springs = SpringSet()
    assert (dict(springs.joints), springs.law, springs.origin) == (
        {},
        SphericalLaw.CONSERVATIVE,
        "none",
    )
    assert springs.references == ()


@given(st.floats(-1.0, 1.0), st.floats(-2.0, 2.0), st.floats(0.0, 3.0), st.floats(0.0, 3.0))
def test_a_scaled_spring_scales_elastic_torque_and_resistance(angle, rate, elastic, damping):
    directional = Hysteresis(Linear(2.0, 0.3), Linear(3.0, 0.1), 0.1)
    spring = AxisSpring((0.0, 0.0, 1.0), (directional, *SPRING.elastic), Damping(0.3, 0.2))
    scaled = spring.scaled(elastic, damping)
    torque, energy = total_torque(spring.elastic, angle), total_energy(spring.elastic, angle)
    assert total_torque(scaled.elastic, angle) == pytest.approx(elastic * torque, abs=1e-11)
    assert total_energy(scaled.elastic, angle) == pytest.approx(elastic * energy, abs=1e-11)
    resistance = spring.resistance(angle, rate)
    assert scaled.resistance(angle, rate) == pytest.approx(damping * resistance, abs=1e-11)


def test_all_springs_of_a_set_are_scaled():
    law = CoupledExponential(("a", "b"), (CoupledTerm((1.0, 2.0), (1.0, 2.0)),), (0.5, 0.0), RANGES)
    axes = (CoupledAxis("knee", (0.0, 0.0, 1.0)), CoupledAxis("hip", (0.0, 0.0, 1.0)))
    joint = JointSprings("knee", (SPRING,), (SPRING,))
    whole = SpringSet({"knee": joint}, SphericalLaw.WEIGHTED, "a file", (CoupledSpring(law, axes),))
    assert whole.scaled(1.0, 1.0) is whole
    scaled = whole.scaled(2.0, 0.5)
    assert scaled.joints["knee"].axes == scaled.joints["knee"].translations
    assert scaled.joints["knee"].axes == (SPRING.scaled(2.0, 0.5),)
    assert scaled.coupled[0].law == law.scaled(2.0)
    assert (scaled.law, scaled.origin) == (whole.law, whole.origin)
    assert whole.of_joints({"knee", "hip"}) == whole
    assert whole.of_joints({"knee"}).coupled == ()
    assert whole.of_joints({"hip"}).joints == {}
