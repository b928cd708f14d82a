"""Passive torques of the waist about its three axes (the thesis's figures 4.11 to 4.13)."""

from collections.abc import Iterator
from math import degrees

from plots.joint_curve import (
    JointCurve,
    low_resistance_claim,
    low_torque_claim,
    printed_cubic_claim,
    rms_difference_claim,
    same_direction_claim,
    stop_not_early_claim,
    stop_not_late_claim,
)
from plots.joint_plate import JointPlate, Window
from plots.literature import Literature, join_curves, mirror_to_both_sides, published_curve
from plots.plate import Claim

_COMMENT = (
    "The waist of the thesis is one joint for the whole spine, and its curve is invented. It is "
    "compared with measured lumbar spines, six segments in series that share the angle, and with "
    "the limit of a gait model. The normal range is that of the thoracolumbar spine, which "
    "includes the lumbar spine."
)
_SCHMIDT, _HAN = "Schmidt 1998, lumbar spine", "Han 2010, lumbar spine"
_ANDERSON = "Anderson 1999, limits"


def _bend_claims(
    curve: JointCurve, schmidt: Literature, han: Literature, _: Literature
) -> Iterator[Claim]:
    end = curve.dead_zone[1]
    yield printed_cubic_claim(curve)
    yield low_resistance_claim(curve)
    yield stop_not_late_claim(curve)
    yield rms_difference_claim(
        curve,
        schmidt,
        *curve.normal_range,
        f"the dead zone ends at {degrees(end):.1f} deg, where those spines resist "
        f"with {abs(schmidt.torque_at(end)):.0f} N m",
    )
    yield low_torque_claim(curve, han, *curve.normal_range)
    yield same_direction_claim(curve, schmidt, *curve.normal_range)


waist_bend = JointPlate(
    name="waist_bend",
    title="Waist, bent to the side (the thesis's figure 4.11)",
    joint="waist",
    motion="lateral bend to the right",
    literature=(
        published_curve("schmidt_1998/lateral_bend", _SCHMIDT),
        mirror_to_both_sides(published_curve("han_2010/lateral_bend", _HAN)),
        published_curve("anderson_1999/lumbar_bending", _ANDERSON),
    ),
    window=Window(angles=(-50.0, 50.0), torques=(-40.0, 40.0), residuals=(-40.0, 40.0)),
    claims=_bend_claims,
    comment=_COMMENT,
    is_estimate=True,
)


def _flexion_claims(
    curve: JointCurve, schmidt: Literature, han: Literature, _: Literature
) -> Iterator[Claim]:
    low, high = curve.normal_range
    end = curve.dead_zone[1]
    early = "a real spine bends forward by 80 deg, this one stops at 56"
    yield printed_cubic_claim(curve)
    yield stop_not_early_claim(curve, early)
    yield stop_not_late_claim(curve, "extension is stopped 19 deg beyond the normal limit")
    yield rms_difference_claim(
        curve,
        schmidt,
        low,
        end,
        "all of the range is in the dead zone; at its end those spines resist with "
        f"{abs(schmidt.torque_at(end)):.0f} N m",
    )
    yield rms_difference_claim(curve, schmidt, low, high, early)
    yield rms_difference_claim(curve, han, 0.0, high, early)
    yield same_direction_claim(curve, schmidt, low, high)


waist_flexion = JointPlate(
    name="waist_flexion",
    title="Waist, bent forward (the thesis's figure 4.12)",
    joint="waist",
    motion="flexion",
    literature=(
        join_curves(
            published_curve("schmidt_1998/flexion", _SCHMIDT),
            published_curve("schmidt_1998/extension", _SCHMIDT),
        ),
        published_curve("han_2010/flexion", f"{_HAN}, flexion only"),
        published_curve("anderson_1999/lumbar_extension", _ANDERSON),
    ),
    window=Window(angles=(-60.0, 100.0), torques=(-90.0, 90.0), residuals=(-90.0, 40.0)),
    claims=_flexion_claims,
    comment=_COMMENT,
    is_estimate=True,
)


def _twist_claims(
    curve: JointCurve, schmidt: Literature, han: Literature, _: Literature
) -> Iterator[Claim]:
    free = "the dead zone of 139 deg exceeds the range of any spine"
    yield printed_cubic_claim(curve)
    yield stop_not_late_claim(curve, free)
    yield rms_difference_claim(curve, schmidt, *curve.normal_range, free)
    yield rms_difference_claim(curve, han, *curve.normal_range, free)


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
    claims=_twist_claims,
    comment=_COMMENT,
    is_estimate=True,
)
