"""The lint of laws over several joints: senses, energy, known ranges, sides, curves beside them."""

from math import degrees, exp, radians

import numpy as np
import pytest

from springs import (
    AxisSpring,
    CoupledAxis,
    CoupledSpring,
    Damping,
    JointSprings,
    Linear,
    SpringSet,
    Stop,
)
from springs.coupled import CoupledExponential, CoupledTerm, nearest_conservative_law
from springs.lint.coupled import lint_coupled, lint_original_law
from springs.lint.finding import Finding, FindingKind
from springs.lint.report import CoupledReport, report_coupled
from springs.published.tables import coupled_law

Y = (0.0, 1.0, 0.0)
LEG = coupled_law("riener_edrich_1999/leg").law
PAIR = LEG.hold_coordinate("ankle dorsiflexion", 0.0)
MUSCLES = coupled_law("silder_2007/leg").law.hold_coordinate("ankle dorsiflexion", 0.0)
RANGE = (-1.0, 1.0)


def law(*terms: CoupledTerm, measured: object = (RANGE, RANGE)) -> CoupledExponential:
    return CoupledExponential(("a", "b"), terms, (0.0, 0.0), measured)  # type: ignore[arg-type]


def of(findings: tuple[Finding, ...], kind: FindingKind) -> list[Finding]:
    return [finding for finding in findings if finding.kind is kind]


def side(name: str, one: CoupledExponential = PAIR) -> CoupledSpring:
    joints = (f"{name}_hip_joint", f"{name}_knee")
    return CoupledSpring(one, tuple(CoupledAxis(joint, Y) for joint in joints))


def test_of_three_angles_only_pairs_that_do_work_are_told():
    loops = [one for one in of(lint_coupled(LEG), FindingKind.ENERGY) if one.is_doubt]
    assert ["ankle" in one.sentence for one in loops] == [False, True]


def test_an_energy_is_told_by_how_much_it_varies():
    (one,) = of(lint_coupled(MUSCLES), FindingKind.ENERGY)
    assert not one.is_doubt
    box = [np.linspace(*known, 41) for known in MUSCLES.valid_ranges]
    energies = MUSCLES.energy(np.meshgrid(*box, indexing="ij"))
    assert one.values == pytest.approx([np.ptp(energies)])


def test_what_was_replaced_is_no_doubt_any_more():
    assert [one.is_doubt for one in lint_original_law(PAIR)] == [False, False]
    assert all(
        one.sentence.startswith("the law that was replaced") for one in lint_original_law(PAIR)
    )


def test_a_torque_that_drives_on_whatever_the_other_angle_is_a_doubt():
    outwards = law(CoupledTerm((1.0, 0.0), (2.0, 0.5)))
    upper = next(
        one for one in of(lint_coupled(outwards), FindingKind.SENSE) if one.angles == (1.0,)
    )
    assert upper.is_doubt
    assert upper.values == pytest.approx([exp(2.5)])
    (slope,) = [one for one in of(lint_coupled(outwards), FindingKind.SLOPE) if one.is_doubt]
    assert "about a" in slope.sentence


def test_where_a_torque_drives_on_at_some_of_the_other_angles_is_told():
    """At hip 100 deg the published hip drives on with a bent knee: 8.072 - exp(1.3391) N m."""
    (upper,) = [
        one
        for one in of(lint_coupled(PAIR), FindingKind.SENSE)
        if "upper end of hip" in one.sentence
    ]
    assert not upper.is_doubt
    assert upper.values == pytest.approx([4.26], abs=0.005)
    assert upper.sentence.endswith("by 4.26 N m at knee flexion 135 deg")
    mended = nearest_conservative_law(PAIR, [known or RANGE for known in PAIR.valid_ranges]).law
    (upper,) = [
        one
        for one in of(lint_coupled(mended), FindingKind.SENSE)
        if "upper end of hip" in one.sentence
    ]
    assert upper.values == pytest.approx([3.15], abs=0.005)


def test_the_published_laws_drive_back_and_have_no_negative_stiffness():
    for one in (PAIR, MUSCLES):
        kinds = (FindingKind.SENSE, FindingKind.SLOPE)
        assert not [f for f in lint_coupled(one) if f.is_doubt and f.kind in kinds]


def test_the_growth_beyond_the_range_is_told():
    hip, knee = of(lint_coupled(PAIR), FindingKind.VALID_RANGE)
    assert not hip.is_doubt
    assert "-15 .. 100 deg it is an extrapolation" in hip.sentence
    straight = PAIR.torques((radians(180.0), 0.0))
    assert hip.values[3] == pytest.approx(max(map(abs, straight)))
    assert hip.values[3] > 900.0
    assert [degrees(angle) for angle in knee.angles] == pytest.approx([-30.0, 165.0, -180.0, 180.0])


def test_a_range_that_is_not_known_is_said():
    term = CoupledTerm((-1.0, -1.0), (1.0, 1.0))
    (one,) = of(lint_coupled(law(term, measured=(None, RANGE))), FindingKind.VALID_RANGE)[:1]
    assert "the range of a is not known; checked over -90 .. 90 deg" in one.sentence


def test_six_coordinates_can_be_checked():
    term = CoupledTerm((-1.0,) * 6, (1.0,) * 6)
    assert lint_coupled(CoupledExponential(tuple("abcdef"), (term,), (0.0,) * 6, (None,) * 6))


def report(*springs: CoupledSpring, joints: dict[str, JointSprings] | None = None) -> CoupledReport:
    (one,) = report_coupled(SpringSet(joints or {}, coupled=springs))
    return one


def test_both_sides_with_one_law_are_one_report():
    one = report(side("left"), side("right"))
    assert len(one.springs) == 2
    (symmetry,) = of(one.findings, FindingKind.SYMMETRY)
    assert symmetry.sentence == "left and right have the same law"
    assert not symmetry.is_doubt


def test_a_side_without_the_law_is_a_doubt():
    (symmetry,) = of(report(side("left")).findings, FindingKind.SYMMETRY)
    assert symmetry.is_doubt
    assert symmetry.sentence == "`right_hip_joint` and `right_knee` have no such law"


def test_a_joint_of_two_coordinates_is_named_once():
    hip = CoupledSpring(PAIR, tuple(CoupledAxis("left_hip_joint", one) for one in (Y, (1, 0, 0))))
    (symmetry,) = of(report(hip).findings, FindingKind.SYMMETRY)
    assert symmetry.sentence == "`right_hip_joint` has no such law"


def test_a_side_with_another_law_is_a_doubt_of_both():
    reports = report_coupled(SpringSet({}, coupled=(side("left"), side("right", MUSCLES))))
    said = [of(one.findings, FindingKind.SYMMETRY)[0].sentence for one in reports]
    assert said == [
        "`right_hip_joint` and `right_knee` have another law",
        "`left_hip_joint` and `left_knee` have another law",
    ]


def knee_springs(*laws: object) -> dict[str, JointSprings]:
    turned = (0.0, -1.0, 0.0)
    spring = AxisSpring(turned, laws, Damping(0.1))  # type: ignore[arg-type]
    return {"left_knee": JointSprings("left_knee", (spring,))}


def test_a_strong_curve_of_its_own_beside_a_strong_law_is_a_doubt():
    (one,) = of(
        report(side("left"), joints=knee_springs(Linear(40.0))).findings, FindingKind.DUPLICATE_LAW
    )
    assert one.is_doubt
    assert "`left_knee` has a curve" in one.sentence
    assert one.values[0] == pytest.approx(40.0 * radians(135.0))
    assert "knee flexion" in one.sentence


def test_a_weak_curve_beside_it_is_only_told():
    (one,) = of(
        report(side("left"), joints=knee_springs(Linear(1.0))).findings, FindingKind.DUPLICATE_LAW
    )
    assert not one.is_doubt


@pytest.mark.parametrize("laws", [(), (Stop(-0.1, 2.4),)])
def test_damping_and_stops_beside_it_are_right(laws: tuple[object, ...]):
    joints = knee_springs(*laws)
    assert of(report(side("left"), joints=joints).findings, FindingKind.DUPLICATE_LAW) == []
