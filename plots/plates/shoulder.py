"""Passive torques of the shoulder about its three axes (the thesis's figures 4.4 to 4.6)."""

from collections.abc import Iterator
from math import radians

import numpy as np

from plots.joint_curve import (
    RANGE_END_MOMENT,
    JointCurve,
    low_torque_claim,
    printed_cubic_claim,
    rms_difference_claim,
    same_direction_claim,
    stop_not_early_claim,
)
from plots.joint_plate import JointPlate, Window
from plots.literature import Literature, published_curve
from plots.plate import Claim
from springs.lint.curve import FIRM_TORQUE
from springs.smooth_limit import SmoothLimit

_COMMENT = (
    "The thesis fits a cubic to one subject of Engin 1980: the component of the resisting moment "
    "that opposes the motion about one axis; the smaller components are neglected. Those data are "
    "not public. The limit torque of a musculoskeletal model is the substitute; its angles are "
    "defined differently (elevation, plane of elevation, axial rotation), so that neither curve is "
    "a fit of the other."
)


def _elevation_limit(plane: str) -> Literature:
    note = f"elevation of the arm, here in the {plane} plane; no torque between 30 and 150 deg"
    return published_curve("saul_2015/shoulder_elv", "Saul 2015, limit of elevation", note)


def _abduction_claims(curve: JointCurve, saul: Literature) -> Iterator[Claim]:
    yield printed_cubic_claim(curve)
    yield stop_not_early_claim(curve, "the cubic grows from 91 deg on")
    yield low_torque_claim(curve, saul, 0.0, curve.dead_zone[1])
    remark = "the cubic resists from 91 deg on, the model from 150"
    yield rms_difference_claim(curve, saul, 0.0, radians(175.0), remark)
    yield same_direction_claim(curve, saul, 0.0, radians(175.0))


shoulder_abduction = JointPlate(
    name="shoulder_abduction",
    title="Shoulder abduction, about x (the thesis's figure 4.4)",
    joint="left_shoulder",
    motion="abduction",
    literature=(_elevation_limit("frontal"),),
    window=Window(angles=(-60.0, 190.0), torques=(-60.0, 40.0), residuals=(-60.0, 40.0)),
    claims=_abduction_claims,
    comment=_COMMENT,
)


def _flexion_claims(curve: JointCurve, saul: Literature) -> Iterator[Claim]:
    level = radians(90.0)
    yield Claim(
        f"The arm raised forward to 90 deg resists with less than {FIRM_TORQUE:g} N m, "
        f"where {saul.label} has {abs(saul.torque_at(level)):g} N m",
        abs(curve.torque_at(level)),
        "N m",
        at_most=FIRM_TORQUE,
        remark="a relaxed arm raised to 90 deg hardly resists beyond its weight; Engin's zero "
        "angle is unknown, and one other than that of the hanging arm would explain the torque",
    )
    yield stop_not_early_claim(curve, "the cubic has no dead zone, and reaches 5 N m at 46 deg")
    remark = "the model is free from 30 deg on"
    yield rms_difference_claim(curve, saul, 0.0, radians(150.0), remark)
    remark = "near 8 deg the cubic already drives the arm back, the model still forward"
    yield same_direction_claim(curve, saul, 0.0, radians(175.0), remark)


shoulder_flexion = JointPlate(
    name="shoulder_flexion",
    title="Shoulder flexion, about y (the thesis's figure 4.5)",
    joint="left_shoulder",
    motion="flexion",
    literature=(_elevation_limit("sagittal"),),
    window=Window(angles=(-75.0, 180.0), torques=(-80.0, 80.0), residuals=(-80.0, 40.0)),
    claims=_flexion_claims,
    comment=_COMMENT,
)


def _rotation_claims(curve: JointCurve, saul: Literature) -> Iterator[Claim]:
    (limit, _) = saul.pieces[0]
    assert isinstance(limit, SmoothLimit)
    free = curve.range_mask(limit.lower, limit.upper)
    yield Claim(
        f"Where the model's arm rotates without torque, -60 to -10 deg, this one resists with at "
        f"most {RANGE_END_MOMENT:g} N m",
        float(np.abs(curve.simulated[free]).max()),
        "N m",
        at_most=RANGE_END_MOMENT,
    )
    yield low_torque_claim(curve, saul, radians(-90.0), radians(20.0))
    yield same_direction_claim(curve, saul, radians(-90.0), radians(20.0))
    yield stop_not_early_claim(
        curve,
        "with the zero angle of Engin's earlier study the stop would be at 76 deg, but that of "
        "lateral rotation at 55 instead of 104 deg",
    )


shoulder_rotation = JointPlate(
    name="shoulder_rotation",
    title="Shoulder rotation, about z (the thesis's figure 4.6)",
    joint="left_shoulder",
    motion="medial rotation",
    literature=(
        published_curve(
            "saul_2015/shoulder_rot",
            "Saul 2015, limit of rotation",
            "axial rotation of the arm; no torque between -60 and -10 deg",
        ),
    ),
    window=Window(angles=(-120.0, 90.0), torques=(-60.0, 40.0), residuals=(-40.0, 40.0)),
    claims=_rotation_claims,
    comment=f"{_COMMENT} In a figure of Engin's earlier study the forearm is rotated inwards by 45 "
    "deg at zero; whether this holds for the data of 1980 is unknown.",
)
