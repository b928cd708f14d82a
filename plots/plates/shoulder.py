"""The shoulder's passive torque in rotation about the upper arm (the thesis's figure 4.6).

The shoulder's passive torque in abduction (the thesis's figure 4.4).

The shoulder's passive torque in flexion (the thesis's figure 4.5).
"""

from math import radians

import numpy as np

from plots.joint_curve import (
    law_claims,
    low_torque_claim,
    printed_cubic_claim,
    read_curve,
    rms_difference_claim,
    same_direction_claim,
    stop_not_early_claim,
)
from plots.joint_plate import Window, build_curve_plate
from plots.literature import published_curve
from plots.plate import Claim, Plate
from springs.lint.curve import FIRM_TORQUE
from springs.smooth_limit import SmoothLimit

SHOULDER_COMMENT = (
    "The thesis fits a cubic to one subject of Engin 1980: the component of the resisting moment "
    "that opposes the motion about one axis; the smaller ones about the others are ignored. Those "
    "data are not public. The limit torque of a musculoskeletal model stands in; its angle is one "
    "of three of another kind (elevation, plane of elevation, axial rotation), so that the two "
    "stand side by side and neither is a fit of the other."
)
"""What is to be said of all three curves of the shoulder."""

_FRONTAL_MODEL_NOTE = (
    "elevation of the arm, in the frontal plane here; no torque between 30 and 150 deg"
)
_ABDUCTION_WINDOW = Window(angles=(-60.0, 190.0), torques=(-60.0, 40.0), residuals=(-60.0, 40.0))


def shoulder_abduction() -> Plate:
    """Draw the plate."""
    curve = read_curve("left_shoulder", "abduction")
    saul = published_curve(
        "saul_2015/shoulder_elv", "Saul 2015, limit of elevation", _FRONTAL_MODEL_NOTE
    )
    zone = curve.cubic.dead_zone
    assert zone is not None
    claims = [
        *law_claims(curve),
        printed_cubic_claim(curve),
        stop_not_early_claim(curve, "the cubic grows from 91 deg on"),
        low_torque_claim(curve, saul, 0.0, zone[1]),
        rms_difference_claim(
            curve,
            saul,
            0.0,
            radians(175.0),
            "the cubic resists from 91 deg on, the model from 150",
        ),
        same_direction_claim(curve, saul, 0.0, radians(175.0)),
    ]
    title = "Shoulder abduction, about x (the thesis's figure 4.4)"
    return build_curve_plate(
        "shoulder_abduction", title, curve, [saul], _ABDUCTION_WINDOW, claims, SHOULDER_COMMENT
    )


_SAGITTAL_MODEL_NOTE = (
    "elevation of the arm, in the sagittal plane here; no torque between 30 and 150 deg"
)
_FLEXION_WINDOW = Window(angles=(-75.0, 180.0), torques=(-80.0, 80.0), residuals=(-80.0, 40.0))


def shoulder_flexion() -> Plate:
    """Draw the plate."""
    curve = read_curve("left_shoulder", "flexion")
    saul = published_curve(
        "saul_2015/shoulder_elv", "Saul 2015, limit of elevation", _SAGITTAL_MODEL_NOTE
    )
    early = (
        "a relaxed arm is lifted to level with next to nothing but its weight; where Engin counted "
        "the angle from is not told, and a zero other than the hanging arm's would explain it"
    )
    claims = [
        *law_claims(curve),
        Claim(
            f"The arm lifted forward to level, 90 deg, resists with less than {FIRM_TORQUE:g} N m, where "
            f"{saul.label} has {abs(saul.torque_at(radians(90.0))):g} N m",
            abs(curve.torque_at(radians(90.0))),
            "N m",
            at_most=FIRM_TORQUE,
            remark=early,
        ),
        stop_not_early_claim(curve, "the cubic has no dead zone and 5 N m at 46 deg already"),
        rms_difference_claim(curve, saul, 0.0, radians(150.0), "the model is free from 30 deg on"),
        same_direction_claim(
            curve,
            saul,
            0.0,
            radians(175.0),
            "about 8 deg the cubic draws the arm back already, the model still forward",
        ),
    ]
    title = "Shoulder flexion, about y (the thesis's figure 4.5)"
    return build_curve_plate(
        "shoulder_flexion", title, curve, [saul], _FLEXION_WINDOW, claims, SHOULDER_COMMENT
    )


RANGE_END_MOMENT = 5.0
"""The moment to which cadaver joints are turned to find the ends of their range [N m]."""

_ROTATION_MODEL_NOTE = "axial rotation of the arm; no torque between -60 and -10 deg"
_ZERO_ANGLE_NOTE = (
    " A published figure of Engin's earlier study has its zero with the forearm turned inwards by "
    "45 deg; whether the data of 1980 have it too is not known."
)
_ROTATION_WINDOW = Window(angles=(-120.0, 90.0), torques=(-60.0, 40.0), residuals=(-40.0, 40.0))


def shoulder_rotation() -> Plate:
    """Draw the plate."""
    curve = read_curve("left_shoulder", "medial rotation")
    saul = published_curve(
        "saul_2015/shoulder_rot", "Saul 2015, limit of rotation", _ROTATION_MODEL_NOTE
    )
    (limit, _) = saul.pieces[0]
    assert isinstance(limit, SmoothLimit)
    free = curve.range_mask(limit.lower, limit.upper)
    claims = [
        *law_claims(curve),
        Claim(
            f"Where the model's arm turns without torque, -60 to -10 deg, this one resists with "
            f"{RANGE_END_MOMENT:g} N m at most",
            float(np.abs(curve.simulated[free]).max()),
            "N m",
            at_most=RANGE_END_MOMENT,
        ),
        low_torque_claim(curve, saul, radians(-90.0), radians(20.0)),
        same_direction_claim(curve, saul, radians(-90.0), radians(20.0)),
        stop_not_early_claim(
            curve,
            "with the zero of Engin's earlier study the stop would be at 76 deg, but that of "
            "lateral rotation at 55 instead of 104",
        ),
    ]
    title = "Shoulder rotation, about z (the thesis's figure 4.6)"
    return build_curve_plate(
        "shoulder_rotation",
        title,
        curve,
        [saul],
        _ROTATION_WINDOW,
        claims,
        SHOULDER_COMMENT + _ZERO_ANGLE_NOTE,
    )
