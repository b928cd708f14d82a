"""Passive torques of the hip about its three axes (the thesis's figures 4.8 to 4.10)."""

from collections.abc import Iterator
from math import degrees, inf, radians

import numpy as np

from plots.joint_curve import (
    AGREEMENT_TORQUE,
    JointCurve,
    difference_claim,
    first_zero_crossing,
    range_end_claim,
    range_end_claims,
    same_direction_claim,
)
from plots.joint_plate import JointPlate, Window
from plots.literature import Literature, literature_from_points, published_curve, single_angle_curve
from plots.plate import Claim, comparison
from springs.published import tables as published

_CADAVERS = "van Arkel 2015, cadaver hips"
_LIGAMENTS = "Anderson 1999, ligaments"
_OTHER_ANGLES = {"knee flexion": 15.0, "ankle dorsiflexion": 0.0}


def _zero_crossing_claim(curve: JointCurve, silder: Literature) -> Claim:
    """Compare the angles at which the torques vanish."""
    low, high = radians(-15.0), radians(80.0)
    assert silder.points is not None
    own, measured = (
        degrees(angle)
        for angle in (curve.zero_crossing(low, high), first_zero_crossing(*silder.points))
    )
    sentence = (
        f"The torque vanishes at {own:.2f} deg, within 1 deg of the angle at which that of "
        f"{silder.label} does, {measured:.2f} deg"
    )
    return comparison(sentence, abs(own - measured), "deg", -inf, 1.0)


def _flexion_claims(curve: JointCurve, silder: Literature, *_: Literature) -> Iterator[Claim]:
    extended, neutral, flexed = (radians(angle) for angle in (-15.0, 20.0, 80.0))
    yield _zero_crossing_claim(curve, silder)
    remark = "most of it is beyond 70 deg, where Silder's hips stiffen faster"
    yield difference_claim(curve, silder, neutral, flexed, remark)
    yield difference_claim(
        curve,
        silder,
        extended,
        neutral,
        f"at -15 deg {curve.torque_at(extended):.1f} against {silder.torque_at(extended):.1f} N m: "
        "the thesis has one subject, moving towards extension",
    )
    yield same_direction_claim(curve, silder, extended, flexed)
    assert curve.low is not None
    assert curve.high is not None
    early = "the thesis's subject resists extension already when standing"
    yield range_end_claim(curve, curve.low, early)
    obstacle = "it is read with the knee bent, the curve holds with the knee at 15 deg"
    yield range_end_claim(curve, curve.high, obstacle=obstacle)


hip_flexion = JointPlate(
    name="hip_flexion",
    title="Hip flexion with the knee at 15 deg (the thesis's figure 4.8)",
    joint="left_hip_joint",
    motion="flexion",
    held_deg={"left_knee": 15.0, "right_knee": 15.0},
    literature=(
        published_curve("silder_2007/hip_knee_15", "Silder 2007, digitised"),
        single_angle_curve(
            "silder_2007/leg", "hip flexion", _OTHER_ANGLES, "Silder 2007, equation"
        ),
        single_angle_curve(
            "riener_edrich_1999/leg",
            "hip flexion",
            _OTHER_ANGLES,
            "Riener & Edrich 1999",
            "its range is assumed to be Silder's",
        ),
        published_curve("davy_audu_1987/hip", "Davy & Audu 1987"),
        published_curve(
            "anderson_madigan_nussbaum_2007/hip_male_18_25", "Anderson 2007, young men"
        ),
    ),
    window=Window(angles=(-30.0, 135.0), torques=(-75.0, 100.0), residuals=(-30.0, 70.0)),
    claims=_flexion_claims,
    comment=(
        "The thesis fits a cubic to one subject of Yoon & Mansour 1982 with the knee at 15 deg, "
        "moving towards extension; it neglects the coupling of hip and knee, and the difference of "
        "5 to 10 N m between the two directions. Those data are not public. Of the substitutes, "
        "the digitised curve of Silder et al. was measured at the same knee angle. Silder's "
        "equation has the mean parameters of the subjects, which does not give the mean curve."
    ),
)


def _cadaver_range() -> Literature:
    """Van Arkel's ends of the range, each with its moment."""
    rows = {row.motion: row for row in published.publication("van_arkel_2015").ranges}
    adduction, abduction = rows["hip adduction"], rows["hip abduction"]
    assert adduction.moment is not None
    assert abduction.moment is not None
    points = ((-adduction.limit, adduction.moment), (abduction.limit, -abduction.moment))
    return literature_from_points(points, _CADAVERS, abduction.reference, abduction.sample)


def _moment_angle_claim(
    curve: JointCurve, cadavers: Literature, ends: tuple[float, float], remark: str = ""
) -> Claim:
    """Compare the angles of the moment at which cadaver hips end their range [rad]."""
    rows = published.publication("van_arkel_2015").ranges
    scatter = next(row.deviation for row in rows if row.deviation is not None)
    own = [curve.resistance_angle(side, AGREEMENT_TORQUE) for side in (-1, 1)]
    return comparison(
        f"{AGREEMENT_TORQUE:g} N m are reached at {degrees(own[0]):.1f} and {degrees(own[1]):.1f} "
        f"deg, in {cadavers.label} at {degrees(ends[0]):.1f} and {degrees(ends[1]):.1f} deg, "
        f"within the standard deviation of that study in extension, {degrees(scatter):g} deg",
        degrees(max(abs(angle - end) for angle, end in zip(own, ends, strict=True))),
        "deg",
        -inf,
        degrees(scatter),
        remark,
    )


def _abduction_claims(curve: JointCurve, _: Literature, cadavers: Literature) -> Iterator[Claim]:
    assert cadavers.points is not None
    first, last = cadavers.points[0].tolist()
    late = "ligaments without muscles resist abduction 17 deg earlier"
    yield _moment_angle_claim(curve, cadavers, (first, last), late)
    beyond = "adduction stops beyond the clinical limit"
    yield from range_end_claims(curve, beyond, beyond)


hip_abduction = JointPlate(
    name="hip_abduction",
    title="Hip abduction (the thesis's figure 4.9)",
    joint="left_hip_joint",
    motion="abduction",
    literature=(published_curve("anderson_1999/hip_adduction", _LIGAMENTS), _cadaver_range()),
    window=Window(angles=(-70.0, 70.0), torques=(-100.0, 100.0), residuals=(-40.0, 40.0)),
    claims=_abduction_claims,
    comment=(
        "The curve is an estimate of the thesis's author, not based on a study. It is compared "
        "with the two angles at which the ligaments of cadaver hips resist with 5 N m, and drawn "
        "beside the ligament term of a gait model."
    ),
    is_estimate=True,
)


def _rotation_claims(curve: JointCurve, cadavers: Literature, _: Literature) -> Iterator[Claim]:
    angles = np.radians(np.arange(-36.0, 36.0, 0.01))
    loose = angles[np.abs(cadavers.torque(angles)) <= AGREEMENT_TORQUE]
    yield _moment_angle_claim(curve, cadavers, (float(loose[0]), float(loose[-1])))
    yield from range_end_claims(curve)


hip_rotation = JointPlate(
    name="hip_rotation",
    title="Hip rotation (the thesis's figure 4.10)",
    joint="left_hip_joint",
    motion="medial rotation",
    literature=(
        published_curve("van_arkel_2015/hip_rotation", _CADAVERS),
        published_curve("anderson_1999/hip_rotation", _LIGAMENTS),
    ),
    window=Window(angles=(-60.0, 60.0), torques=(-60.0, 60.0), residuals=(-60.0, 60.0)),
    claims=_rotation_claims,
    comment=(
        "The curve is an estimate of the thesis's author, not based on a study. It is compared "
        "with the fit of a public code base to the ligaments of cadaver hips, and drawn beside the "
        "ligament term of a gait model."
    ),
    is_estimate=True,
)
