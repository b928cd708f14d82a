"""The hip's passive torque in flexion (the thesis's figure 4.8).

The hip's passive torque in abduction and adduction (the thesis's figure 4.9).

The hip's passive torque in rotation about the thigh (the thesis's figure 4.10).
"""

from dataclasses import replace
from math import degrees, radians

import numpy as np

from plots.joint_curve import (
    JointCurve,
    first_zero_crossing,
    law_claims,
    low_resistance_claim,
    low_torque_claim,
    printed_cubic_claim,
    read_curve,
    rms_difference_claim,
    same_direction_claim,
    same_magnitude_claim,
    stop_not_late_claim,
)
from plots.joint_plate import Window, build_curve_plate
from plots.literature import (
    Literature,
    literature_from_points,
    mark_as_comparison,
    published_curve,
    single_angle_curve,
)
from plots.plate import Claim, Plate
from springs.published import tables as published

_ABDUCTION_COMMENT = (
    "The curve is an estimate of the thesis's author, based on no study. Beside it stand the "
    "ligament term of a gait model and the two angles at which the ligaments of cadaver hips hold "
    "5 N m."
)
_ABDUCTION_WINDOW = Window(angles=(-70.0, 70.0), torques=(-100.0, 100.0), residuals=(-40.0, 40.0))


def hip_abduction() -> Plate:
    """Draw the plate."""
    curve = read_curve("left_hip_joint", "abduction")
    anderson = mark_as_comparison(
        published_curve("anderson_1999/hip_adduction", "Anderson 1999, ligaments")
    )
    cadavers = _cadaver_points()
    claims = [
        *law_claims(curve),
        printed_cubic_claim(curve),
        low_torque_claim(curve, anderson, *curve.normal_range),
        stop_not_late_claim(curve, "adduction meets its wall 16 deg late"),
        same_magnitude_claim(
            curve, cadavers, 30.0, "the dead zone ends at 46 deg, where a hip is long held"
        ),
        same_magnitude_claim(curve, anderson, 60.0),
        same_magnitude_claim(curve, anderson, -60.0),
        same_direction_claim(curve, anderson, radians(-60.0), radians(60.0)),
    ]
    title = "Hip abduction (the thesis's figure 4.9)"
    literature = [anderson, cadavers]
    return build_curve_plate(
        "hip_abduction", title, curve, literature, _ABDUCTION_WINDOW, claims, _ABDUCTION_COMMENT
    )


def _cadaver_points() -> Literature:
    """The ends of the range that van Arkel read at a moment."""
    rows = {row.motion: row for row in published.publication("van_arkel_2015").ranges}
    adduction, abduction = rows["hip adduction"], rows["hip abduction"]
    assert adduction.moment is not None
    assert abduction.moment is not None
    points = ((-adduction.limit, adduction.moment), (abduction.limit, -abduction.moment))
    found = literature_from_points(points, "van Arkel 2015, cadaver hips", abduction.reference)
    return replace(found, is_substitute=False)


_HELD_ANGLES = {"knee flexion": 15.0, "ankle dorsiflexion": 0.0}
_RIENER_NOTE = "its range is taken to be Silder's"
_FLEXION_COMMENT = (
    "The thesis fits a cubic to one subject of Yoon & Mansour 1982 with the knee at 15 deg, moving "
    "towards extension; how hip and knee hang together, and the 5 to 10 N m between the two "
    "directions, it leaves out. Those data are not public. Of the substitutes the digitised curve "
    "of Silder and others was measured with the knee at the same angle. Silder's equation has the "
    "mean parameters of the subjects, which is not the mean curve."
)
_FLEXION_WINDOW = Window(angles=(-30.0, 135.0), torques=(-75.0, 100.0), residuals=(-30.0, 70.0))


def hip_flexion() -> Plate:
    """Draw the plate."""
    curve = read_curve("left_hip_joint", "flexion", {"left_knee": 15.0, "right_knee": 15.0})
    silder = published_curve("silder_2007/hip_knee_15", "Silder 2007, digitised")
    equation = single_angle_curve(
        "silder_2007/leg", "hip flexion", _HELD_ANGLES, "Silder 2007, equation"
    )
    riener = single_angle_curve(
        "riener_edrich_1999/leg", "hip flexion", _HELD_ANGLES, "Riener & Edrich 1999", _RIENER_NOTE
    )
    literature = [
        silder,
        equation,
        riener,
        published_curve("davy_audu_1987/hip", "Davy & Audu 1987"),
        published_curve("anderson_1999/hip_flexion", "Anderson 1999, ligaments"),
        published_curve(
            "anderson_madigan_nussbaum_2007/hip_male_18_25", "Anderson 2007, young men"
        ),
    ]
    extended = radians(-15.0)
    claims = [
        *law_claims(curve),
        _zero_crossing_claim(curve, silder),
        _zero_crossing_claim(
            curve, equation, "an exponential of mean parameters is not the mean curve"
        ),
        rms_difference_claim(curve, silder, radians(20.0), radians(70.0)),
        same_direction_claim(curve, silder, radians(-15.0), radians(80.0)),
        same_magnitude_claim(
            curve,
            silder,
            -15.0,
            f"{curve.torque_at(extended):.1f} N m stand against {silder.torque_at(extended):.1f}: one subject, "
            "moving towards extension",
        ),
        low_resistance_claim(
            curve, "Silder's hips too take 17 N m at 70 deg, with the knee at 15 deg"
        ),
        Claim(
            "Riener & Edrich's equation gives -34 N m at 90 deg with the knee at 15 deg",
            riener.torque_at(radians(90.0)),
            "N m",
            at_least=-34.5,
            at_most=-33.5,
        ),
    ]
    title = "Hip flexion with the knee at 15 deg (the thesis's figure 4.8)"
    return build_curve_plate(
        "hip_flexion", title, curve, literature, _FLEXION_WINDOW, claims, _FLEXION_COMMENT
    )


def _zero_crossing_claim(curve: JointCurve, literature: Literature, remark: str = "") -> Claim:
    """That the torque vanishes where the published one does."""
    own = degrees(curve.zero_crossing(radians(-15.0), radians(80.0)))
    angles, torques = literature.points or (curve.angles, literature.torque(curve.angles))
    inside = (angles > radians(-15.0)) & (angles < radians(80.0))
    published = degrees(first_zero_crossing(angles[inside], torques[inside]))
    return Claim(
        f"The torque is zero, at {own:.1f} deg, within 1 deg of where that of {literature.label} is, "
        f"at {published:.1f} deg",
        abs(own - published),
        "deg",
        at_most=1.0,
        remark=remark,
    )


RANGE_END_MOMENT = 5.0
"""The moment to which van Arkel turned hips to find the ends of their range [N m]."""

_ROTATION_COMMENT = (
    "The curve is an estimate of the thesis's author, based on no study. Beside it stand the fit "
    "of a public code base to the ligaments of cadaver hips, and the ligament term of a gait model."
)
_ROTATION_WINDOW = Window(angles=(-60.0, 60.0), torques=(-60.0, 60.0), residuals=(-60.0, 60.0))


def hip_rotation() -> Plate:
    """Draw the plate."""
    curve = read_curve("left_hip_joint", "medial rotation")
    cadavers = mark_as_comparison(
        published_curve("van_arkel_2015/hip_rotation", "van Arkel 2015, cadaver hips")
    )
    anderson = mark_as_comparison(
        published_curve("anderson_1999/hip_rotation", "Anderson 1999, ligaments")
    )
    low, _ = curve.normal_range
    claims = [
        *law_claims(curve),
        printed_cubic_claim(curve),
        low_resistance_claim(curve),
        stop_not_late_claim(curve),
        _dead_zone_ends_claim(curve, cadavers),
        low_torque_claim(curve, cadavers, radians(-35.0), radians(35.0)),
        rms_difference_claim(
            curve,
            cadavers,
            *curve.normal_range,
            f"at {degrees(low):.1f} deg cadaver hips hold {abs(cadavers.torque_at(low)):.0f} N m, "
            f"this one {abs(curve.torque_at(low)):.0f}",
        ),
        same_direction_claim(curve, cadavers, *curve.normal_range),
    ]
    title = "Hip rotation (the thesis's figure 4.10)"
    literature = [cadavers, anderson]
    return build_curve_plate(
        "hip_rotation", title, curve, literature, _ROTATION_WINDOW, claims, _ROTATION_COMMENT
    )


def _dead_zone_ends_claim(curve: JointCurve, cadavers: Literature) -> Claim:
    """That the dead zone ends where cadaver hips begin to hold."""
    rows = published.publication("van_arkel_2015").ranges
    scatter = next(row.deviation for row in rows if row.deviation is not None)
    zone = curve.cubic.dead_zone
    assert zone is not None
    angles = np.radians(np.arange(-60.0, 60.0, 0.01))
    held = angles[np.abs(cadavers.torque(angles)) <= RANGE_END_MOMENT]
    ends = float(held[0]), float(held[-1])
    return Claim(
        f"The dead zone ends, at {degrees(zone[0]):.1f} and {degrees(zone[1]):.1f} deg, where "
        f"cadaver hips hold {RANGE_END_MOMENT:g} N m, at {degrees(ends[0]):.1f} and {degrees(ends[1]):.1f} "
        f"deg, within the {degrees(scatter):g} deg by which that study's hips scattered in "
        "extension",
        degrees(max(abs(edge - end) for edge, end in zip(zone, ends, strict=True))),
        "deg",
        at_most=degrees(scatter),
    )
