"""The lint of curves: what it finds in the prototype's springs, and in curves made to be wrong."""

from dataclasses import dataclass
from math import degrees, pi, radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.figure_file import read_figure
from generator.springs_file.read import load_springs
from springs import (
    NUMPY,
    AxisSpring,
    Cubic,
    Damping,
    Elastic,
    JointSprings,
    Linear,
    Operations,
    Real,
    SpringSet,
    Stop,
    passive_cubic,
)
from springs.exponential import Exponential, ExponentialTerm
from springs.hysteresis import Hysteresis
from springs.interpolated import Interpolated
from springs.lint.curve import (
    DEFAULT_RANGE_END,
    SampledCurve,
    lint_curve,
)
from springs.lint.finding import Finding, FindingKind
from springs.lint.report import CurveReport, report_curves
from springs.published.range_of_motion import RangeEnd
from springs.published.reference import Reference, Sureness
from springs.smooth_limit import SmoothLimit
from springs.transformed import Transformed
from tests.paths import FIGURES

Z = (0.0, 0.0, 1.0)
SOURCE = Reference("invented for this test", Sureness.PAGE)


@pytest.fixture(scope="module")
def prototype() -> tuple[CurveReport, ...]:
    path = FIGURES / "prototype.springs.toml"
    springs = load_springs(read_figure("prototype"), path.parent, "prototype").value
    assert springs is not None
    return report_curves(springs)


def lint(
    *laws: Elastic, low: float | None = None, high: float | None = None
) -> tuple[Finding, ...]:
    """The findings of laws between ends of a normal range [deg]."""
    ends = [
        None if end is None else RangeEnd(motion, radians(end), "nobody", SOURCE)
        for end, motion in ((low, "knee hyperextension"), (high, "knee flexion"))
    ]
    return lint_curve(AxisSpring(Z, laws), *ends)


def doubts(findings: tuple[Finding, ...], kind: FindingKind) -> list[Finding]:
    return [finding for finding in findings if finding.is_doubt and finding.kind is kind]


def notes(findings: tuple[Finding, ...], kind: FindingKind) -> list[Finding]:
    return [finding for finding in findings if not finding.is_doubt and finding.kind is kind]


# the prototype


# sense and equilibria


def test_a_cubic_of_the_wrong_sense_is_flagged():
    good = passive_cubic((0.0, 10.0, 0.0, 100.0))
    assert not doubts(lint(good), FindingKind.SENSE)
    findings = lint(Cubic(good.coefficients, -good.sense))
    away, lower, upper = doubts(findings, FindingKind.SENSE)
    assert away.angles == pytest.approx((0.0, 0.0), abs=1e-9)
    assert "drives away from 0.0 deg" in away.sentence
    push = 10.0 * DEFAULT_RANGE_END + 100.0 * DEFAULT_RANGE_END**3
    assert [f.values[0] for f in (away, lower, upper)] == pytest.approx([push] * 3)
    assert (lower.angles[0], upper.angles[0]) == (-DEFAULT_RANGE_END, DEFAULT_RANGE_END)
    (equilibrium,) = (f for f in findings if f.kind is FindingKind.EQUILIBRIUM)
    assert equilibrium.is_doubt
    assert "unstable" in equilibrium.sentence


def test_a_printed_cubic_pushes_outwards_in_the_middle():
    """The hip's abduction as printed, without its dead zone: 40 and 43 N m the wrong way."""
    findings = lint(Cubic((-0.131, 136.0, 8.42, -218.0), 1))
    (away,) = doubts(findings, FindingKind.SENSE)
    assert away.values[0] == pytest.approx(43.0, abs=0.1)
    equilibria = [f for f in findings if f.kind is FindingKind.EQUILIBRIUM]
    stable = [degrees(f.angles[0]) for f in equilibria if not f.is_doubt]
    unstable = [degrees(f.angles[0]) for f in equilibria if f.is_doubt]
    assert stable == pytest.approx([-44.19, 46.35], abs=0.01)
    assert unstable == pytest.approx([0.06], abs=0.01)


def test_a_wrong_sense_behind_a_dead_zone():
    (away, *ends) = doubts(lint(Cubic((0.0, 10.0, 0.0, 0.0), 1, (-0.5, 0.5))), FindingKind.SENSE)
    assert away.angles == pytest.approx((-0.5, 0.5))
    assert len(ends) == 2


def test_a_torque_of_one_sign_drives_on():
    (end,) = doubts(lint(Linear(5.0, rest=3.0)), FindingKind.SENSE)
    assert end.angles == (DEFAULT_RANGE_END,)
    assert "upper end" in end.sentence


def test_a_free_joint_is_said_to_be_free():
    findings = lint(Stop(-3.0, 3.0))
    assert "there is no torque over" in notes(findings, FindingKind.SENSE)[0].sentence
    assert notes(findings, FindingKind.EQUILIBRIUM)[0].angles == (
        -DEFAULT_RANGE_END,
        DEFAULT_RANGE_END,
    )
    assert not any(finding.is_doubt for finding in findings)


@given(st.floats(-1.5, 1.5), st.floats(0.1, 1e4))
def test_a_linear_spring_has_one_stable_rest(rest: float, stiffness: float):
    findings = lint(Linear(stiffness, rest))
    (equilibrium,) = notes(findings, FindingKind.EQUILIBRIUM)
    assert equilibrium.angles[0] == pytest.approx(rest, abs=1e-9)
    (slope,) = notes(findings, FindingKind.SLOPE)
    assert slope.values[0] == pytest.approx(stiffness, rel=1e-6)
    assert not any(finding.is_doubt for finding in findings)


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_the_runs_join_and_cover_the_range(one: float, other: float):
    zone = (min(one, other), max(one, other))
    curve = SampledCurve((Cubic((0.0, 10.0, 0.0, 20.0), -1, zone),), -2.0, 2.0)
    assert curve.sign_intervals[0].start == -2.0
    assert curve.sign_intervals[-1].end == 2.0
    assert [run.sign for run in curve.sign_intervals if run.end > run.start + 1e-6] in (
        [1, 0, -1],
        [1, -1],
    )
    for before, after in zip(curve.sign_intervals, curve.sign_intervals[1:], strict=False):
        assert before.end == after.start


# slopes, jumps, energy


def test_the_greatest_stiffness_is_found_where_it_is():
    (slope,) = notes(lint(Cubic((0.0, 1.0, 0.0, 10.0)), high=50.0), FindingKind.SLOPE)
    assert slope.angles[0] == pytest.approx(-DEFAULT_RANGE_END, abs=0.002)
    assert slope.values[0] == pytest.approx(1.0 + 30.0 * DEFAULT_RANGE_END**2, rel=0.005)


@dataclass(frozen=True)
class Broken:
    """A law that jumps at an angle by `jump` [N m], and whose energy is off by `leak` of it."""

    corner: float
    jump: float
    leak: float = 0.0

    def torque(self, angle: Real, ops: Operations = NUMPY) -> Real:
        return -10.0 * angle + ops.where(angle > self.corner, -self.jump, 0.0)

    def energy(self, angle: Real, ops: Operations = NUMPY) -> Real:
        beyond = ops.where(angle > self.corner, self.jump * (angle - self.corner), 0.0)
        return (1.0 + self.leak) * (5.0 * angle * angle + beyond)

    @property
    def breakpoints(self) -> tuple[float, ...]:
        return (self.corner,)

    def mirrored(self) -> "Broken":
        return Broken(-self.corner, self.jump, self.leak)


def test_a_jump_is_found():
    (jump,) = doubts(lint(Broken(0.3, 7.0)), FindingKind.JUMP)
    assert jump.angles == (0.3,)
    assert jump.values[0] == pytest.approx(-7.0, rel=1e-6)


def test_a_steep_curve_without_a_jump_has_none():
    law = Cubic((0.0, 1e4, 0.0, 1e5), -1, (-0.1, 0.1))
    findings = lint(law)
    assert not doubts(findings, FindingKind.JUMP)
    lower, upper = notes(findings, FindingKind.JUMP)
    edge = 1e4 + 3.0 * 1e5 * 0.01
    assert (lower.values[0], upper.values[0]) == pytest.approx((-edge, edge), rel=1e-3)


def test_an_energy_that_is_not_the_torques_is_found():
    assert not doubts(lint(Broken(0.3, 0.0)), FindingKind.ENERGY)
    (leak,) = doubts(lint(Broken(0.3, 0.0, leak=0.5), low=-45.0), FindingKind.ENERGY)
    low, high = radians(-55.0), DEFAULT_RANGE_END
    assert leak.values[0] == pytest.approx(0.5 * 5.0 * (high**2 - low**2), rel=1e-6)


def test_what_a_cycle_stores_and_loses():
    """Worked by hand: 2 pi^2 b A^2 + 4 c A, and k A^2 / 2."""
    spring = AxisSpring(Z, (Linear(10.0),), Damping(0.08, 0.5))
    (energy,) = notes(lint_curve(spring), FindingKind.ENERGY)
    amplitude = pi / 2.0
    stored, lost = energy.values
    assert stored == pytest.approx(5.0 * amplitude**2, rel=1e-9)
    assert lost == pytest.approx(2.0 * pi**2 * 0.08 * amplitude**2 + 2.0 * amplitude, rel=1e-9)


# normal ranges


def test_a_soft_joint_is_not_early():
    findings = lint(Linear(2.0), low=-5.0, high=140.0)
    assert not any(finding.is_doubt for finding in findings)
    assert [f.values[0] for f in notes(findings, FindingKind.RANGE_END)] == pytest.approx(
        [2.0 * radians(5.0), -2.0 * radians(140.0)]
    )


def test_a_joint_that_is_firm_everywhere():
    """Firm from the other end of what was looked at."""
    (early,) = doubts(lint(Linear(100.0, -3.0), low=-5.0, high=40.0), FindingKind.EARLY_RESISTANCE)
    assert degrees(early.angles[0]) == pytest.approx(-15.0)
    assert np.degrees(early.angles[1:]) == pytest.approx([0.0, 30.0, 40.0], abs=1e-9)
    assert early.sentence.startswith(
        "it resists with more than 10 N m at all angles from -15.0 deg on: 300 N m at 0.0 deg"
    )


def test_a_joint_that_becomes_firm_is_told_from_where():
    (early,) = doubts(lint(Linear(40.0), low=-5.0, high=40.0), FindingKind.EARLY_RESISTANCE)
    assert early.sentence.startswith("it resists with 10 N m from 14.3 deg on: 20.94 N m at 30.0")


@pytest.mark.parametrize(
    ("lower", "upper", "where"),
    [
        (60.0, 60.0, "at 60.0 deg"),
        (30.0, 30.04, "at 30.0 deg"),
        (0, 30, "between 0.0 and 30.0 deg"),
    ],
)
def test_a_stretch_without_torque_is_told_by_its_ends(lower: float, upper: float, where: str):
    limits = SmoothLimit(radians(lower), radians(upper), 30.0, 30.0, radians(3.0))
    said = [one.sentence for one in notes(lint(limits), FindingKind.EQUILIBRIUM)]
    assert said == [f"there is no torque {where}"]


def test_what_drives_on_at_an_end_is_not_called_resistance():
    findings = lint(Linear(100.0, 3.0), high=40.0)
    assert not doubts(findings, FindingKind.EARLY_RESISTANCE)
    assert doubts(findings, FindingKind.SENSE)


def test_the_lower_end_mirrors_the_upper():
    law = Cubic((1.0, 20.0, -6.0, 90.0), -1, (0.1, 0.6))
    up = lint(law, low=-30.0, high=70.0)
    down = lint(law.mirrored(), low=-70.0, high=30.0)
    for kind in (FindingKind.EARLY_RESISTANCE, FindingKind.FREE_MOTION):
        mine = sorted(tuple(-a for a in f.angles) for f in doubts(up, kind))
        assert mine
        its = sorted(f.angles for f in doubts(down, kind))
        for one, other in zip(mine, its, strict=True):
            assert one == pytest.approx(other, abs=2e-3)


# left and right


def two_sided(left: AxisSpring, right: AxisSpring | None) -> tuple[CurveReport, ...]:
    joints = {"left_knee": JointSprings("left_knee", (left,))}
    if right is not None:
        joints["right_knee"] = JointSprings("right_knee", (right,))
    return report_curves(SpringSet(joints))


def test_equal_sides_are_one_curve():
    law = Cubic((1.0, 2.0, 3.0, 4.0))
    (report,) = two_sided(AxisSpring((1.0, 0.0, 0.0), (law,)), AxisSpring((-1.0, 0.0, 0.0), (law,)))
    assert report.joints == ("left_knee", "right_knee")
    assert notes(report.findings, FindingKind.SYMMETRY)


def test_unequal_sides_are_found():
    """Coefficients negated on the right, as the thesis prints them."""
    left, right = Cubic((1.0, 2.0, 3.0, 4.0)), Cubic((-1.0, -2.0, -3.0, -4.0))
    reports = two_sided(AxisSpring(Z, (left,)), AxisSpring(Z, (right,)))
    assert len(reports) == 2
    for report in reports:
        (finding,) = doubts(report.findings, FindingKind.SYMMETRY)
        assert finding.values[0] == pytest.approx(2.0 * (1.0 + 2.0 * pi + 3 * pi**2 + 4 * pi**3))


SOFT = AxisSpring(Z, (Linear(1.0),))


def rubbing(width: float) -> AxisSpring:
    return AxisSpring(Z, (Hysteresis.from_mean_and_width(Linear(1.0), width),))


@pytest.mark.parametrize(
    ("left", "right", "sentence"),
    [
        (SOFT, AxisSpring(Z, (Linear(1.0),), Damping(0.1)), "`right_knee` has another damping"),
        (rubbing(4.0), rubbing(5.0), "`right_knee` has another hysteresis"),
        (SOFT, None, "`right_knee` has no spring"),
        (SOFT, AxisSpring((1.0, 0.0, 0.0), SOFT.elastic), "`right_knee` has no spring about this"),
    ],
)
def test_another_spring_on_the_other_side(
    left: AxisSpring, right: AxisSpring | None, sentence: str
):
    reports = two_sided(left, right)
    assert len(reports) == (1 if right is None else 2)
    found = [doubts(report.findings, FindingKind.SYMMETRY) for report in reports]
    assert all(len(findings) == 1 for findings in found)
    assert found[0][0].sentence.startswith(sentence)


def test_a_joint_without_sides_has_no_symmetry():
    (report,) = report_curves(
        SpringSet({"waist": JointSprings("waist", (AxisSpring(Z, (Linear(1.0),)),))})
    )
    assert not [f for f in report.findings if f.kind is FindingKind.SYMMETRY]


def test_an_axis_with_damping_alone_has_no_curve():
    spring = AxisSpring(Z, (), Damping(0.1))
    assert report_curves(SpringSet({"waist": JointSprings("waist", (spring,))})) == ()


# known ranges and hysteresis

KNEE = Exponential(
    (ExponentialTerm(3.0, -4.0), ExponentialTerm(-0.5, 2.0)), valid_range=(0.0, radians(80.0))
)


def found(law: Elastic, kind: FindingKind) -> list[Finding]:
    return [finding for finding in lint(law) if finding.kind is kind]


def test_what_lies_beyond_the_measured_range_is_told_with_its_torques():
    (one,) = found(KNEE, FindingKind.VALID_RANGE)
    assert not one.is_doubt
    assert "extrapolated at -90 .. 0 deg and 80 .. 90 deg" in one.sentence
    assert one.angles == pytest.approx((radians(-90.0), radians(90.0)))
    assert one.values == pytest.approx([KNEE.torque(angle) for angle in one.angles])


def test_a_range_that_is_not_known_is_said():
    (one,) = found(Exponential((ExponentialTerm(-0.5, 2.0),)), FindingKind.VALID_RANGE)
    assert "the range in which this curve was measured is not known" in one.sentence


@pytest.mark.parametrize(
    "law", [Linear(3.0), Cubic((0.0, 1.0, 0.0, 1.0)), Transformed(Linear(3.0))]
)
def test_laws_that_no_one_measured_are_passed_over(law: Elastic):
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
