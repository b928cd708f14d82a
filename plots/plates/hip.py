"""Passive torques of the hip about its three axes (the thesis's figures 4.8 to 4.10)."""

from collections.abc import Iterator
from math import degrees, radians

import numpy as np

from plots.joint_curve import (
    RANGE_END_MOMENT,
    JointCurve,
    first_zero_crossing,
    low_resistance_claim,
    low_torque_claim,
    printed_cubic_claim,
    rms_difference_claim,
    same_direction_claim,
    same_magnitude_claim,
    stop_not_late_claim,
)
from plots.joint_plate import JointPlate, Window
from plots.literature import (
    Literature,
    literature_from_points,
    published_curve,
    single_angle_curve,
)
from plots.plate import Claim
from springs.published import tables as published

_CADAVERS = "van Arkel 2015, cadaver hips"
_LIGAMENTS = "Anderson 1999, ligaments"
_OTHER_ANGLES = {"knee flexion": 15.0, "ankle dorsiflexion": 0.0}


def _zero_crossing_claim(curve: JointCurve, literature: Literature, remark: str = "") -> Claim:
    """Claim that the torque vanishes where the published one does."""
    low, high = radians(-15.0), radians(80.0)
    own = degrees(curve.zero_crossing(low, high))
    angles, torques = literature.points or (curve.angles, literature.torque(curve.angles))
    inside = (angles > low) & (angles < high)
    published = degrees(first_zero_crossing(angles[inside], torques[inside]))
    return Claim(
        f"The torque vanishes at {own:.1f} deg, within 1 deg of the angle at which that of "
        f"{literature.label} does, {published:.1f} deg",
        abs(own - published),
        "deg",
        at_most=1.0,
        remark=remark,
    )


def _flexion_claims(
    curve: JointCurve,
    silder: Literature,
    equation: Literature,
    riener: Literature,
    *_: Literature,
) -> Iterator[Claim]:
    extended = radians(-15.0)
    yield _zero_crossing_claim(curve, silder)
    remark = "an exponential of mean parameters is not the mean curve"
    yield _zero_crossing_claim(curve, equation, remark)
    yield rms_difference_claim(curve, silder, radians(20.0), radians(70.0))
    yield same_direction_claim(curve, silder, extended, radians(80.0))
    yield same_magnitude_claim(
        curve,
        silder,
        -15.0,
        f"{curve.torque_at(extended):.1f} against {silder.torque_at(extended):.1f} N m: the thesis "
        "has one subject, moving towards extension",
    )
    remark = "Silder's hips also resist with 17 N m at 70 deg, the knee at 15 deg"
    yield low_resistance_claim(curve, remark)
    yield Claim(
        "Riener & Edrich's equation gives -34 N m at 90 deg with the knee at 15 deg",
        riener.torque_at(radians(90.0)),
        "N m",
        at_least=-34.5,
        at_most=-33.5,
    )


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
        published_curve("anderson_1999/hip_flexion", _LIGAMENTS),
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
    return literature_from_points(points, _CADAVERS, abduction.reference)


def _abduction_claims(
    curve: JointCurve, anderson: Literature, cadavers: Literature
) -> Iterator[Claim]:
    yield printed_cubic_claim(curve)
    yield low_torque_claim(curve, anderson, *curve.normal_range)
    yield stop_not_late_claim(curve, "adduction stops 16 deg beyond the normal limit")
    remark = "the dead zone ends at 46 deg, where a real hip resists already"
    yield same_magnitude_claim(curve, cadavers, 30.0, remark)
    yield same_magnitude_claim(curve, anderson, 60.0)
    yield same_magnitude_claim(curve, anderson, -60.0)
    yield same_direction_claim(curve, anderson, radians(-60.0), radians(60.0))


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
        "with the ligament term of a gait model and the two angles at which the ligaments of "
        "cadaver hips resist with 5 N m."
    ),
    is_estimate=True,
)


def _dead_zone_claim(curve: JointCurve, cadavers: Literature) -> Claim:
    """Claim that the dead zone ends where cadaver hips begin to resist."""
    rows = published.publication("van_arkel_2015").ranges
    scatter = next(row.deviation for row in rows if row.deviation is not None)
    zone = curve.dead_zone
    angles = np.radians(np.arange(-60.0, 60.0, 0.01))
    loose = angles[np.abs(cadavers.torque(angles)) <= RANGE_END_MOMENT]
    ends = float(loose[0]), float(loose[-1])
    return Claim(
        f"The dead zone ends at {degrees(zone[0]):.1f} and {degrees(zone[1]):.1f} deg, where "
        f"cadaver hips resist with {RANGE_END_MOMENT:g} N m: at {degrees(ends[0]):.1f} and "
        f"{degrees(ends[1]):.1f} deg, within the standard deviation of that study in extension, "
        f"{degrees(scatter):g} deg",
        degrees(max(abs(edge - end) for edge, end in zip(zone, ends, strict=True))),
        "deg",
        at_most=degrees(scatter),
    )


def _rotation_claims(curve: JointCurve, cadavers: Literature, _: Literature) -> Iterator[Claim]:
    low, high = curve.normal_range
    yield printed_cubic_claim(curve)
    yield low_resistance_claim(curve)
    yield stop_not_late_claim(curve)
    yield _dead_zone_claim(curve, cadavers)
    yield low_torque_claim(curve, cadavers, radians(-35.0), radians(35.0))
    yield rms_difference_claim(
        curve,
        cadavers,
        low,
        high,
        f"at {degrees(low):.1f} deg cadaver hips resist with {abs(cadavers.torque_at(low)):.0f} "
        f"N m, this one with {abs(curve.torque_at(low)):.0f} N m",
    )
    yield same_direction_claim(curve, cadavers, low, high)


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
        "with the fit of a public code base to the ligaments of cadaver hips, and with the "
        "ligament term of a gait model."
    ),
    is_estimate=True,
)
