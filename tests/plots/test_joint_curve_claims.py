"""Claims of joints' curves: they hold of curves made to hold, and fail of curves made to fail."""

from dataclasses import replace
from math import degrees, radians

import numpy as np
import pytest

from plots import joint_curve as claims
from plots.joint_curve import JointCurve
from plots.literature import Literature
from plots.plate import Outcome
from springs import AxisSpring, Cubic, Linear
from springs.published.range_of_motion import RangeEnd
from springs.published.reference import Reference, Sample, SampleKind, Sureness

SOURCE = Reference("invented for this test", Sureness.PAGE)
PEOPLE = Sample(SampleKind.LIVING, 9)
ANGLES = np.radians(np.arange(-90.0, 91.0, 1.0))
CUBIC = Cubic((0.0, 20.0, 0.0, 0.0))
ENDS = tuple(RangeEnd("flexion", radians(end), "nobody", SOURCE) for end in (-20.0, 40.0))


def curve(torques: np.ndarray | None = None, other: np.ndarray | None = None, cubic=CUBIC):
    spring = AxisSpring((0.0, 1.0, 0.0), (cubic,), motion="flexion")
    law = np.asarray(cubic.torque(ANGLES))
    simulated = law if torques is None else torques
    return JointCurve("made", spring, ANGLES, simulated, other, *ENDS)


def published(
    stiffness: float, sample: Sample = PEOPLE, source: Reference = SOURCE, measured: bool = True
) -> Literature:
    everywhere, known = (-np.inf, np.inf), (radians(-60.0), radians(60.0))
    return Literature(
        "a paper", ((Linear(stiffness), everywhere),), known, source, sample, measured
    )


def test_a_reading_that_is_not_the_law_fails() -> None:
    good, off = curve(), curve(-20.0 * ANGLES + 2e-6)
    assert claims.law_claims(good)[0].holds
    assert not claims.law_claims(off)[0].holds


def test_sides_that_differ_fail() -> None:
    (_, same) = claims.law_claims(curve(other=-20.0 * ANGLES))
    (_, differs) = claims.law_claims(curve(other=-20.1 * ANGLES))
    assert same.holds
    assert not differs.holds
    assert differs.measured == pytest.approx(0.1 * np.pi / 2.0)


def test_an_end_of_the_range_is_where_resistance_is_firm() -> None:
    """20 N m/rad are 10 N m at 28.6 deg: 8.6 after -20 and 11.4 before 40 deg."""
    low, high = (claims.range_end_claim(curve(), end, "soft") for end in ENDS)
    assert (low.measured, high.measured) == pytest.approx(
        (degrees(0.5) - 20.0, 40.0 - degrees(0.5))
    )
    assert (low.outcome, high.outcome) == (Outcome.AGREES, Outcome.DIFFERS)
    assert (low.remark, high.remark) == ("", "soft")
    limp = claims.range_end_claim(curve(-1.0 * ANGLES), ENDS[1])
    assert limp.outcome is Outcome.DIFFERS
    assert "(where an examiner would stop) at no angle; " in limp.sentence
    unsure = claims.range_end_claim(curve(), ENDS[0], obstacle="who knows")
    assert unsure.outcome is Outcome.INCOMPARABLE


def test_a_width_does_not_depend_on_the_zero() -> None:
    """From -28.6 to 28.6 deg, of 60 deg; with the zero moved as well."""
    for zero in (0.0, radians(20.0)):
        found = claims.range_width_claim(curve(-20.0 * (ANGLES - zero)))
        assert found.measured == pytest.approx(60.0 - 2.0 * degrees(0.5))
        assert found.outcome is Outcome.AGREES
    narrow = claims.range_width_claim(curve(-60.0 * ANGLES))
    assert narrow.measured == pytest.approx(60.0 - 2.0 * degrees(1.0 / 6.0))
    assert narrow.outcome is Outcome.DIFFERS


def test_torques_that_oppose_each_other_fail() -> None:
    low, high = radians(-30.0), radians(30.0)
    against = claims.same_direction_claim(curve(), published(-20.0), low, high)
    half = claims.same_direction_claim(curve(-20.0 * np.abs(ANGLES)), published(20.0), low, high)
    with_it = claims.same_direction_claim(curve(), published(3.0), low, high)
    assert with_it.holds
    assert not against.holds
    assert against.measured == 0.0
    assert not half.holds
    assert half.measured == pytest.approx(50.0)
    # All but the 2.9 deg either side of zero where one of 20 N m/rad does not push with 1 N m.
    over = float(against.sentence.rsplit("over ", 1)[1].split()[0])
    assert over == pytest.approx(60.0 - 2.0 * 2.9, abs=1.5)


def test_a_torque_beyond_the_scatter_differs() -> None:
    """Of two straight lines the difference is one as well, here to 60 deg."""
    low, high = radians(-60.0), radians(60.0)
    inside = ANGLES[np.abs(ANGLES) < radians(60.5)]
    size = float(np.sqrt(np.mean(inside**2)))
    for stiffness, outcome in ((20.0, Outcome.AGREES), (35.0, Outcome.DIFFERS)):
        found = claims.difference_claim(curve(), published(stiffness), low, high)
        assert found.measured == pytest.approx(abs(stiffness - 20.0) * size)
        assert found.outcome is outcome
        assert found.at_most == 5.0


def test_soft_joints_are_not_told_apart() -> None:
    """Within 10 deg neither 20 nor 10 N m/rad are 5 N m; 60 N m/rad are 6 (rms)."""
    low, high = radians(-10.0), radians(10.0)
    soft = claims.difference_claim(curve(), published(10.0), low, high)
    assert soft.outcome is Outcome.INCOMPARABLE
    assert "any soft joint" in soft.obstacle
    firm = claims.difference_claim(curve(-80.0 * ANGLES), published(10.0), low, high)
    assert firm.outcome is Outcome.DIFFERS


def test_nothing_is_compared_beyond_what_was_measured() -> None:
    found = claims.difference_claim(curve(), published(50.0), radians(-90.0), radians(90.0))
    assert "From -60 to 60 deg" in found.sentence
    assert "of 121 differences" in found.sentence


def test_an_assumed_dead_zone_is_not_compared() -> None:
    zone = Cubic((0.0, -10.0, 0.0, 30.0), -1, (radians(-33.08), radians(33.08)))
    made = replace(curve(cubic=zone), has_assumed_dead_zone=True)
    found = claims.difference_claim(made, published(50.0), radians(-30.0), radians(30.0))
    assert found.outcome is Outcome.INCOMPARABLE
    assert "dead zone that the thesis does not print" in found.obstacle
    beyond = claims.difference_claim(made, published(50.0), radians(-60.0), radians(60.0))
    assert "of 54 differences" in beyond.sentence


@pytest.mark.parametrize(
    ("other", "obstacle"),
    [
        (published(20.0, Sample(SampleKind.MODEL)), "the curve is a model, not measured"),
        (
            published(20.0, source=Reference("two codes", Sureness.DISPUTED)),
            "code bases disagree about its numbers",
        ),
        (published(20.0, measured=False), "the range in which it was measured is not known"),
    ],
)
def test_what_cannot_be_compared_has_its_reason(other: Literature, obstacle: str) -> None:
    for compare in (claims.difference_claim, claims.same_direction_claim):
        found = compare(curve(), other, radians(-60.0), radians(60.0))
        assert (found.outcome, found.obstacle) == (Outcome.INCOMPARABLE, obstacle)


def test_a_limp_joint_agrees_with_nothing() -> None:
    limp = curve(np.zeros_like(ANGLES))
    low, high = radians(-30.0), radians(30.0)
    for stiffness in (-20.0, 0.1, 3.0, 300.0):
        other = published(stiffness)
        for compare in (claims.difference_claim, claims.same_direction_claim):
            assert compare(limp, other, low, high).outcome is not Outcome.AGREES
    assert all(not claims.range_end_claim(limp, end).holds for end in ENDS)
    assert not claims.law_claims(limp)[0].holds


def test_how_far_a_printed_cubic_pushes_outwards() -> None:
    """x^3 - x between its roots -1 and 1 is 2/(3 sqrt 3) at most."""
    made = curve(cubic=Cubic((0.0, -1.0, 0.0, 1.0), -1, (-1.0, 1.0)))
    assert made.outward_torque == pytest.approx(2.0 / (3.0 * np.sqrt(3.0)), abs=1e-5)
    assert made.other_sense_torques(np.array([0.5])) == pytest.approx([0.5**3 - 0.5])
