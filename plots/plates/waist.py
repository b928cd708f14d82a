"""Passive torques of the waist about its three axes (the thesis's figures 4.11 to 4.13)."""

from collections.abc import Iterator

from plots.joint_curve import JointCurve, range_end_claims
from plots.joint_plate import JointPlate, Window
from plots.literature import Literature, join_curves, mirror_to_both_sides, published_curve
from plots.plate import Claim

_COMMENT = (
    "The waist of the thesis is one joint for the whole spine, and its curve is invented. It is "
    "drawn beside lumbar spines, six segments in series that share the angle, over the range of a "
    "young lumbar spine, and beside the limit of a gait model. The normal range is that of the "
    "thoracolumbar spine, which includes the lumbar spine."
)
_UNSURE = "the sense of the printed moment is not certain, and in the other one there is no stop"
_SCHMIDT, _HAN = "Schmidt 1998, lumbar spine", "Han 2010, lumbar spine"
_ANDERSON = "Anderson 1999, limits"


def _range_claims(curve: JointCurve, *_: Literature) -> Iterator[Claim]:
    return range_end_claims(curve)


def _unsure_claims(curve: JointCurve, *_: Literature) -> Iterator[Claim]:
    return range_end_claims(curve, obstacle=_UNSURE)


waist_bend = JointPlate(
    name="waist_bend",
    title="Waist, bent to the side (the thesis's figure 4.11)",
    joint="waist",
    motion="lateral bend to the right",
    literature=(
        published_curve("schmidt_1998/lateral_bend", _SCHMIDT),
        mirror_to_both_sides(published_curve("han_2010/lateral_bend", _HAN, side=1)),
        published_curve("anderson_1999/lumbar_bending", _ANDERSON),
    ),
    window=Window(angles=(-50.0, 50.0), torques=(-40.0, 40.0), residuals=(-40.0, 40.0)),
    claims=_range_claims,
    comment=_COMMENT,
    is_estimate=True,
)


waist_flexion = JointPlate(
    name="waist_flexion",
    title="Waist, bent forward (the thesis's figure 4.12)",
    joint="waist",
    motion="flexion",
    literature=(
        join_curves(
            published_curve("schmidt_1998/flexion", _SCHMIDT, side=1),
            published_curve("schmidt_1998/extension", _SCHMIDT, side=-1),
        ),
        published_curve("han_2010/flexion", f"{_HAN}, flexion only", side=1),
        published_curve("anderson_1999/lumbar_extension", _ANDERSON),
    ),
    window=Window(angles=(-60.0, 100.0), torques=(-90.0, 90.0), residuals=(-90.0, 40.0)),
    claims=_unsure_claims,
    comment=f"{_COMMENT} In the chosen sense the cubic restores beyond both outer roots. In the "
    "other one it is a spring about 17 deg with 50 N m standing upright, restoring from -42 to 54 "
    "deg, and drives outwards beyond. The plate of the waist's senses shows what follows for the "
    "motion.",
    is_estimate=True,
    sense_odds="60/40",
)


waist_twist = JointPlate(
    name="waist_twist",
    title="Waist, twisted (the thesis's figure 4.13)",
    joint="waist",
    motion="twist to the left",
    literature=(
        published_curve("schmidt_1998/axial_rotation", _SCHMIDT),
        published_curve("han_2010/axial_rotation", _HAN),
        published_curve("anderson_1999/lumbar_rotation", _ANDERSON),
    ),
    window=Window(angles=(-85.0, 85.0), torques=(-90.0, 90.0), residuals=(-60.0, 60.0)),
    claims=_unsure_claims,
    comment=f"{_COMMENT} In the chosen sense the cubic restores beyond 69 deg on either side, "
    "further than a spine turns. In the other one it is a spring of 136 N m/rad at zero, where six "
    "lumbar segments have 80, and drives outwards beyond 69 deg. The plate of the waist's senses "
    "shows what follows for the motion.",
    is_estimate=True,
    sense_odds="50/50",
)
