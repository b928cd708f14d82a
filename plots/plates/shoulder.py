"""The shoulder's passive torque in rotation about the upper arm (the thesis's figure 4.6).

The shoulder's passive torque in abduction (the thesis's figure 4.4).

The shoulder's passive torque in flexion (the thesis's figure 4.5).
"""

from math import radians

import numpy as np

from plots.joint_curve import (
    both_small,
    late_stop,
    near,
    printed_holds,
    read_curve,
    read_out,
    same_way,
)
from plots.joint_plate import Window, curve_plate
from plots.literature import published_curve
from plots.plate import Claim, Plate
from springs.lint.curve import FIRM
from springs.smooth_limit import SmoothLimit

WORDS = (
    "The thesis fits a cubic to one subject of Engin 1980: the component of the resisting moment "
    "that opposes the motion about one axis; the smaller ones about the others are ignored. Those "
    "data are not public. The limit torque of a musculoskeletal model stands in; its angle is one "
    "of three of another kind (elevation, plane of elevation, axial rotation), so that the two "
    "stand side by side and neither is a fit of the other."
)
"""What is to be said of all three curves of the shoulder."""

_ABDUCTION_MODEL = (
    "elevation of the arm, in the frontal plane here; no torque between 30 and 150 deg"
)
_ABDUCTION_WINDOW = Window(angles=(-60.0, 190.0), torques=(-60.0, 40.0), residuals=(-60.0, 40.0))


def shoulder_abduction() -> Plate:
    """Draw the plate."""
    curve = read_curve("left_shoulder", "abduction")
    saul = published_curve(
        "saul_2015/shoulder_elv", "Saul 2015, limit of elevation", _ABDUCTION_MODEL
    )
    zone = curve.cubic.dead_zone
    assert zone is not None
    claims = [
        *read_out(curve),
        printed_holds(curve),
        late_stop(curve, "the cubic grows from 91 deg on"),
        both_small(curve, saul, 0.0, zone[1]),
        near(
            curve,
            saul,
            0.0,
            radians(175.0),
            "the cubic resists from 91 deg on, the model from 150",
        ),
        same_way(curve, saul, 0.0, radians(175.0)),
    ]
    title = "Shoulder abduction, about x (the thesis's figure 4.4)"
    return curve_plate("shoulder_abduction", title, curve, [saul], _ABDUCTION_WINDOW, claims, WORDS)


_FLEXION_MODEL = (
    "elevation of the arm, in the sagittal plane here; no torque between 30 and 150 deg"
)
_FLEXION_WINDOW = Window(angles=(-75.0, 180.0), torques=(-80.0, 80.0), residuals=(-80.0, 40.0))


def shoulder_flexion() -> Plate:
    """Draw the plate."""
    curve = read_curve("left_shoulder", "flexion")
    saul = published_curve(
        "saul_2015/shoulder_elv", "Saul 2015, limit of elevation", _FLEXION_MODEL
    )
    early = (
        "a relaxed arm is lifted to level with next to nothing but its weight; where Engin counted "
        "the angle from is not told, and a zero other than the hanging arm's would explain it"
    )
    claims = [
        *read_out(curve),
        Claim(
            f"The arm lifted forward to level, 90 deg, resists with less than {FIRM:g} N m, where "
            f"{saul.label} has {abs(saul.at(radians(90.0))):g} N m",
            abs(curve.at(radians(90.0))),
            "N m",
            at_most=FIRM,
            remark=early,
        ),
        late_stop(curve, "the cubic has no dead zone and 5 N m at 46 deg already"),
        near(curve, saul, 0.0, radians(150.0), "the model is free from 30 deg on"),
        same_way(
            curve,
            saul,
            0.0,
            radians(175.0),
            "about 8 deg the cubic draws the arm back already, the model still forward",
        ),
    ]
    title = "Shoulder flexion, about y (the thesis's figure 4.5)"
    return curve_plate("shoulder_flexion", title, curve, [saul], _FLEXION_WINDOW, claims, WORDS)


LOOSE = 5.0
"""The moment to which cadaver joints are turned to find the ends of their range [N m]."""

_ROTATION_MODEL = "axial rotation of the arm; no torque between -60 and -10 deg"
_ZERO = (
    " A published figure of Engin's earlier study has its zero with the forearm turned inwards by "
    "45 deg; whether the data of 1980 have it too is not known."
)
_ROTATION_WINDOW = Window(angles=(-120.0, 90.0), torques=(-60.0, 40.0), residuals=(-40.0, 40.0))


def shoulder_rotation() -> Plate:
    """Draw the plate."""
    curve = read_curve("left_shoulder", "medial rotation")
    saul = published_curve(
        "saul_2015/shoulder_rot", "Saul 2015, limit of rotation", _ROTATION_MODEL
    )
    (limit, _) = saul.pieces[0]
    assert isinstance(limit, SmoothLimit)
    free = curve.within(limit.lower, limit.upper)
    claims = [
        *read_out(curve),
        Claim(
            f"Where the model's arm turns without torque, -60 to -10 deg, this one resists with "
            f"{LOOSE:g} N m at most",
            float(np.abs(curve.simulated[free]).max()),
            "N m",
            at_most=LOOSE,
        ),
        both_small(curve, saul, radians(-90.0), radians(20.0)),
        same_way(curve, saul, radians(-90.0), radians(20.0)),
        late_stop(
            curve,
            "with the zero of Engin's earlier study the stop would be at 76 deg, but that of "
            "lateral rotation at 55 instead of 104",
        ),
    ]
    title = "Shoulder rotation, about z (the thesis's figure 4.6)"
    return curve_plate(
        "shoulder_rotation", title, curve, [saul], _ROTATION_WINDOW, claims, WORDS + _ZERO
    )
