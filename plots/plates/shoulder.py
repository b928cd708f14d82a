"""Passive torques of the shoulder about its three axes (the thesis's figures 4.4 to 4.6)."""

from collections.abc import Iterator

from plots.joint_curve import JointCurve, range_end_claim, range_end_claims, range_width_claim
from plots.joint_plate import JointPlate, Window
from plots.literature import Literature, published_curve
from plots.plate import Claim

_ZERO = "the zero angle of Engin's data is not known"
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


def _abduction_claims(curve: JointCurve, _: Literature) -> Iterator[Claim]:
    assert curve.high is not None
    yield range_end_claim(curve, curve.high, obstacle=_ZERO)


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


def _width_claims(curve: JointCurve, _: Literature) -> Iterator[Claim]:
    yield range_width_claim(curve, "whatever the zero is, the cubic is firm within too few degrees")
    yield from range_end_claims(curve, obstacle=_ZERO)


shoulder_flexion = JointPlate(
    name="shoulder_flexion",
    title="Shoulder flexion, about y (the thesis's figure 4.5)",
    joint="left_shoulder",
    motion="flexion",
    literature=(_elevation_limit("sagittal"),),
    window=Window(angles=(-75.0, 180.0), torques=(-80.0, 80.0), residuals=(-80.0, 40.0)),
    claims=_width_claims,
    comment=_COMMENT,
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
    claims=_width_claims,
    comment=f"{_COMMENT} In a figure of Engin's earlier study the forearm is rotated inwards by 45 "
    "deg at zero; whether this holds for the data of 1980 is unknown.",
)
