"""The hip's passive torque in flexion (the thesis's figure 4.8).

The hip's passive torque in abduction and adduction (the thesis's figure 4.9).

The hip's passive torque in rotation about the thigh (the thesis's figure 4.10).
"""

from dataclasses import replace
from math import degrees, radians

import numpy as np

from plots.joint_curve import (
    JointCurve,
    both_small,
    near,
    of_size,
    printed_holds,
    read_curve,
    read_out,
    same_way,
    soft,
    stops,
    zero_of,
)
from plots.joint_plate import Window, curve_plate
from plots.literature import Literature, compared, held_law, points_of, published_curve
from plots.plate import Claim, Plate
from springs.published import tables as published

_ABDUCTION_WORDS = (
    "The curve is an estimate of the thesis's author, based on no study. Beside it stand the "
    "ligament term of a gait model and the two angles at which the ligaments of cadaver hips hold "
    "5 N m."
)
_ABDUCTION_WINDOW = Window(angles=(-70.0, 70.0), torques=(-100.0, 100.0), residuals=(-40.0, 40.0))


def hip_abduction() -> Plate:
    """Draw the plate."""
    curve = read_curve("left_hip_joint", "abduction")
    anderson = compared(published_curve("anderson_1999/hip_adduction", "Anderson 1999, ligaments"))
    cadavers = _cadavers()
    claims = [
        *read_out(curve),
        printed_holds(curve),
        both_small(curve, anderson, *curve.normal),
        stops(curve, "adduction meets its wall 16 deg late"),
        of_size(curve, cadavers, 30.0, "the dead zone ends at 46 deg, where a hip is long held"),
        of_size(curve, anderson, 60.0),
        of_size(curve, anderson, -60.0),
        same_way(curve, anderson, radians(-60.0), radians(60.0)),
    ]
    title = "Hip abduction (the thesis's figure 4.9)"
    literature = [anderson, cadavers]
    return curve_plate(
        "hip_abduction", title, curve, literature, _ABDUCTION_WINDOW, claims, _ABDUCTION_WORDS
    )


def _cadavers() -> Literature:
    """The ends of the range that van Arkel read at a moment."""
    rows = {row.motion: row for row in published.publication("van_arkel_2015").ranges}
    adduction, abduction = rows["hip adduction"], rows["hip abduction"]
    assert adduction.moment is not None
    assert abduction.moment is not None
    points = ((-adduction.limit, adduction.moment), (abduction.limit, -abduction.moment))
    found = points_of(points, "van Arkel 2015, cadaver hips", abduction.reference)
    return replace(found, is_substitute=False)


_HELD = {"knee flexion": 15.0, "ankle dorsiflexion": 0.0}
_RIENER = "its range is taken to be Silder's"
_FLEXION_WORDS = (
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
    equation = held_law("silder_2007/leg", "hip flexion", _HELD, "Silder 2007, equation")
    riener = held_law(
        "riener_edrich_1999/leg", "hip flexion", _HELD, "Riener & Edrich 1999", _RIENER
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
        *read_out(curve),
        _same_zero(curve, silder),
        _same_zero(curve, equation, "an exponential of mean parameters is not the mean curve"),
        near(curve, silder, radians(20.0), radians(70.0)),
        same_way(curve, silder, radians(-15.0), radians(80.0)),
        of_size(
            curve,
            silder,
            -15.0,
            f"{curve.at(extended):.1f} N m stand against {silder.at(extended):.1f}: one subject, "
            "moving towards extension",
        ),
        soft(curve, "Silder's hips too take 17 N m at 70 deg, with the knee at 15 deg"),
        Claim(
            "Riener & Edrich's equation gives -34 N m at 90 deg with the knee at 15 deg",
            riener.at(radians(90.0)),
            "N m",
            at_least=-34.5,
            at_most=-33.5,
        ),
    ]
    title = "Hip flexion with the knee at 15 deg (the thesis's figure 4.8)"
    return curve_plate(
        "hip_flexion", title, curve, literature, _FLEXION_WINDOW, claims, _FLEXION_WORDS
    )


def _same_zero(curve: JointCurve, one: Literature, remark: str = "") -> Claim:
    """That the torque vanishes where the published one does."""
    own = degrees(curve.zero_between(radians(-15.0), radians(80.0)))
    angles, torques = one.points or (curve.angles, one.torque(curve.angles))
    inside = (angles > radians(-15.0)) & (angles < radians(80.0))
    published = degrees(zero_of(angles[inside], torques[inside]))
    return Claim(
        f"The torque is zero, at {own:.1f} deg, within 1 deg of where that of {one.label} is, "
        f"at {published:.1f} deg",
        abs(own - published),
        "deg",
        at_most=1.0,
        remark=remark,
    )


HELD = 5.0
"""The moment to which van Arkel turned hips to find the ends of their range [N m]."""

_ROTATION_WORDS = (
    "The curve is an estimate of the thesis's author, based on no study. Beside it stand the fit "
    "of a public code base to the ligaments of cadaver hips, and the ligament term of a gait model."
)
_ROTATION_WINDOW = Window(angles=(-60.0, 60.0), torques=(-60.0, 60.0), residuals=(-60.0, 60.0))


def hip_rotation() -> Plate:
    """Draw the plate."""
    curve = read_curve("left_hip_joint", "medial rotation")
    cadavers = compared(
        published_curve("van_arkel_2015/hip_rotation", "van Arkel 2015, cadaver hips")
    )
    anderson = compared(published_curve("anderson_1999/hip_rotation", "Anderson 1999, ligaments"))
    low, _ = curve.normal
    claims = [
        *read_out(curve),
        printed_holds(curve),
        soft(curve),
        stops(curve),
        _same_edges(curve, cadavers),
        both_small(curve, cadavers, radians(-35.0), radians(35.0)),
        near(
            curve,
            cadavers,
            *curve.normal,
            f"at {degrees(low):.1f} deg cadaver hips hold {abs(cadavers.at(low)):.0f} N m, "
            f"this one {abs(curve.at(low)):.0f}",
        ),
        same_way(curve, cadavers, *curve.normal),
    ]
    title = "Hip rotation (the thesis's figure 4.10)"
    literature = [cadavers, anderson]
    return curve_plate(
        "hip_rotation", title, curve, literature, _ROTATION_WINDOW, claims, _ROTATION_WORDS
    )


def _same_edges(curve: JointCurve, cadavers: Literature) -> Claim:
    """That the dead zone ends where cadaver hips begin to hold."""
    rows = published.publication("van_arkel_2015").ranges
    scatter = next(row.deviation for row in rows if row.deviation is not None)
    zone = curve.cubic.dead_zone
    assert zone is not None
    angles = np.radians(np.arange(-60.0, 60.0, 0.01))
    held = angles[np.abs(cadavers.torque(angles)) <= HELD]
    ends = float(held[0]), float(held[-1])
    return Claim(
        f"The dead zone ends, at {degrees(zone[0]):.1f} and {degrees(zone[1]):.1f} deg, where "
        f"cadaver hips hold {HELD:g} N m, at {degrees(ends[0]):.1f} and {degrees(ends[1]):.1f} "
        f"deg, within the {degrees(scatter):g} deg by which that study's hips scattered in "
        "extension",
        degrees(max(abs(edge - end) for edge, end in zip(zone, ends, strict=True))),
        "deg",
        at_most=degrees(scatter),
    )
