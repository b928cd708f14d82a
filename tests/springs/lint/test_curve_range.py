"""What the lint says of known ranges and of hysteresis."""

from math import radians

import pytest

from springs import AxisSpring, Cubic, Linear
from springs.exponential import Exponential, ExponentialTerm
from springs.hysteresis import Hysteresis
from springs.interpolated import Interpolated
from springs.joint import JointSprings
from springs.lint.curve import lint_curve, lint_symmetry
from springs.lint.finding import Finding, FindingKind
from springs.transformed import Transformed

Z = (0.0, 0.0, 1.0)
KNEE = Exponential(
    (ExponentialTerm(3.0, -4.0), ExponentialTerm(-0.5, 2.0)), valid_range=(0.0, radians(80.0))
)


def found(law: object, kind: FindingKind) -> list[Finding]:
    findings = lint_curve(AxisSpring(Z, (law,)))  # type: ignore[arg-type]
    return [finding for finding in findings if finding.kind is kind]


def test_what_lies_beyond_the_measured_range_is_told_with_its_torques():
    (one,) = found(KNEE, FindingKind.VALID_RANGE)
    assert not one.is_doubt
    assert "extrapolated at -90 .. 0 deg and 80 .. 90 deg" in one.sentence
    assert one.angles == pytest.approx((radians(-90.0), radians(90.0)))
    assert one.values == pytest.approx([KNEE.torque(angle) for angle in one.angles])


def test_a_moved_curve_is_known_elsewhere():
    (one,) = found(Transformed(KNEE, offset=radians(10.0)), FindingKind.VALID_RANGE)
    assert "known for 10 .. 90 deg only" in one.sentence


def test_a_range_that_is_not_known_is_said():
    (one,) = found(Exponential((ExponentialTerm(-0.5, 2.0),)), FindingKind.VALID_RANGE)
    assert "the range in which this curve was measured is not known" in one.sentence


@pytest.mark.parametrize(
    "law", [Linear(3.0), Cubic((0.0, 1.0, 0.0, 1.0)), Transformed(Linear(3.0))]
)
def test_laws_that_no_one_measured_are_passed_over(law: object):
    assert found(law, FindingKind.VALID_RANGE) == []


def test_the_hysteresis_of_a_cycle_is_its_width_times_the_way():
    (one,) = found(Hysteresis.from_mean_and_width(Linear(3.0), 6.0), FindingKind.HYSTERESIS)
    assert not one.is_doubt
    # The way there and back is one range each, and the curves are 6 N m apart.
    assert one.values == pytest.approx([6.0 * radians(180.0)])


def test_curves_that_cross_beyond_their_points_feed_energy_there():
    up = Interpolated(((0.0, 1.0), (1.0, -1.0)))
    down = Interpolated(((0.0, 2.0), (1.0, -0.9)))
    doubts = [one for one in found(Hysteresis(up, down), FindingKind.HYSTERESIS) if one.is_doubt]
    (one,) = doubts
    assert one.angles == pytest.approx([radians(90.0)])
    # Tangents of slopes -2 and -2.9, 0.1 apart at 1 rad.
    assert one.values == pytest.approx([0.9 * (radians(90.0) - 1.0) - 0.1])


def test_another_hysteresis_on_the_other_side_is_a_doubt():
    left, right = (
        AxisSpring(Z, (Hysteresis.from_mean_and_width(Linear(3.0), w),)) for w in (4.0, 5.0)
    )
    joints = {name: JointSprings(name, (s,)) for name, s in (("left_a", left), ("right_a", right))}
    (one,) = lint_symmetry("left_a", left, joints)
    assert one.is_doubt
    assert one.sentence == "`right_a` has another hysteresis"
