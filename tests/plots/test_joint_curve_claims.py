"""Claims of joints' curves: they hold of curves made to hold, and fail of curves made to fail."""

from math import degrees, radians

import numpy as np
import pytest

from plots import joint_curve as claims
from plots.joint_curve import JointCurve
from plots.literature import Literature
from springs import AxisSpring, Cubic, Linear
from springs.published.range_of_motion import RangeEnd
from springs.published.reference import Reference, Sureness

SOURCE = Reference("invented for this test", Sureness.PAGE)
ANGLES = np.radians(np.arange(-90.0, 91.0, 1.0))
CUBIC = Cubic((0.0, 20.0, 0.0, 0.0))
ENDS = tuple(RangeEnd("flexion", radians(end), "nobody", SOURCE) for end in (-20.0, 40.0))


def curve(torques: np.ndarray | None = None, other: np.ndarray | None = None, cubic=CUBIC):
    spring = AxisSpring((0.0, 1.0, 0.0), (cubic,), motion="flexion")
    law = np.asarray(cubic.torque(ANGLES))
    simulated = law if torques is None else torques
    return JointCurve("made", spring, ANGLES, simulated, other, *ENDS)


def published(stiffness: float) -> Literature:
    everywhere = (-np.inf, np.inf)
    return Literature("a paper", ((Linear(stiffness), everywhere),), None, SOURCE)


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


def test_a_stiff_joint_is_not_soft() -> None:
    """20 N m/rad at 40 deg is 14 N m, 10 N m/rad is 7."""
    stiff, limp = (
        claims.low_resistance_claim(curve()),
        claims.low_resistance_claim(curve(-10.0 * ANGLES)),
    )
    assert stiff.measured == pytest.approx(20.0 * radians(40.0))
    assert not stiff.holds
    assert limp.holds


def test_a_stop_before_the_normal_end_fails() -> None:
    """10 N m are at 0.5 rad, 28.6 deg, of 40."""
    early, late = (
        claims.stop_not_early_claim(curve()),
        claims.stop_not_early_claim(curve(-10.0 * ANGLES)),
    )
    assert early.measured == pytest.approx(degrees(0.5))
    assert not early.holds
    assert late.holds


def test_a_joint_that_is_never_held_fails() -> None:
    """At 20 N m/rad the lower end is overrun by 8.6 deg, at 15 by 18.2, and at 1 for ever."""
    assert claims.stop_not_late_claim(curve()).measured == pytest.approx(degrees(0.5) - 20.0)
    assert claims.stop_not_late_claim(curve()).holds
    assert not claims.stop_not_late_claim(curve(-15.0 * ANGLES)).holds
    assert not claims.stop_not_late_claim(curve(-1.0 * ANGLES)).holds


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


def test_a_curve_far_from_the_published_one_fails() -> None:
    """Of two straight lines the root mean squares are as their slopes."""
    low, high = radians(-60.0), radians(60.0)
    assert claims.rms_difference_claim(
        curve(), published(20.0), low, high
    ).measured == pytest.approx(0.0)
    for stiffness, share in ((60.0, 2.0 / 3.0), (12.0, 2.0 / 3.0), (30.0, 1.0 / 3.0)):
        found = claims.rms_difference_claim(curve(), published(stiffness), low, high)
        assert found.measured == pytest.approx(share)
        assert found.holds is (share < 0.5)
    inside = ANGLES[np.abs(ANGLES) < radians(60.5)]
    own = 60.0 * np.sqrt(np.mean(inside**2))
    assert (
        f"{own:.3g} N m"
        in claims.rms_difference_claim(curve(), published(60.0), low, high).sentence
    )


def test_both_are_small_where_neither_is_firm() -> None:
    """20 N m/rad at 20 deg are 7 N m; 10 N m are at 28.6 deg, and at 19.1 for 30 N m/rad."""
    low, high = radians(-20.0), radians(20.0)
    assert claims.low_torque_claim(curve(), published(3.0), low, high).holds
    assert claims.low_torque_claim(curve(), published(3.0), low, high).measured == pytest.approx(
        20.0 * radians(20.0)
    )
    assert not claims.low_torque_claim(curve(), published(30.0), low, high).holds
    assert not claims.low_torque_claim(curve(), published(3.0), low, radians(29.0)).holds


def test_a_limp_joint_fails_whatever_it_is_compared_with() -> None:
    limp = curve(np.zeros_like(ANGLES))
    low, high = radians(-30.0), radians(30.0)
    for stiffness in (-20.0, 0.1, 3.0, 300.0):
        other = published(stiffness)
        assert claims.rms_difference_claim(limp, other, low, high).measured == pytest.approx(1.0)
        assert not claims.rms_difference_claim(limp, other, low, high).holds
        assert np.isnan(claims.same_direction_claim(limp, other, low, high).measured)
        assert not claims.same_direction_claim(limp, other, low, high).holds
        assert not claims.same_magnitude_claim(limp, other, 20.0).holds
    assert not claims.stop_not_late_claim(limp).holds
    assert not claims.stop_not_early_claim(limp).holds
    assert not claims.law_claims(limp)[0].holds


def test_sizes_are_compared_with_their_sign() -> None:
    assert claims.same_magnitude_claim(curve(), published(30.0), 30.0).measured == pytest.approx(
        2.0 / 3.0
    )
    assert claims.same_magnitude_claim(curve(), published(30.0), 30.0).holds
    assert not claims.same_magnitude_claim(curve(), published(50.0), 30.0).holds
    assert not claims.same_magnitude_claim(curve(), published(-20.0), 30.0).holds


def test_how_far_a_printed_cubic_pushes_outwards() -> None:
    """x^3 - x between its roots -1 and 1 is 2/(3 sqrt 3) at most."""
    found = claims.printed_cubic_claim(curve(cubic=Cubic((0.0, -1.0, 0.0, 1.0), -1, (-1.0, 1.0))))
    assert found.measured == pytest.approx(2.0 / (3.0 * np.sqrt(3.0)), abs=1e-5)
    assert not found.holds
