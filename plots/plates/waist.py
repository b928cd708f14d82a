"""The waist's passive torque in bending to the side (the thesis's figure 4.11).

The waist's passive torque in bending forward and back (the thesis's figure 4.12).

The waist's passive torque in twisting (the thesis's figure 4.13).
"""

from math import degrees

from plots.joint_curve import (
    law_claims,
    low_resistance_claim,
    low_torque_claim,
    printed_cubic_claim,
    read_curve,
    rms_difference_claim,
    same_direction_claim,
    stop_not_early_claim,
    stop_not_late_claim,
)
from plots.joint_plate import Window, build_curve_plate
from plots.literature import join_curves, mark_as_comparison, mirror_to_both_sides, published_curve
from plots.plate import Plate

WAIST_COMMENT = (
    "The waist is an artifice of the thesis, one joint for a whole spine, and its curve is "
    "invented. Beside it stand measured lumbar spines, six segments in series that share the "
    "angle, and the limit of a gait model. The normal range is that of the thoracolumbar spine, of "
    "which the lumbar one is a part."
)
"""What is to be said of all three curves of the waist."""

_BEND_WINDOW = Window(angles=(-50.0, 50.0), torques=(-40.0, 40.0), residuals=(-40.0, 40.0))


def waist_bend() -> Plate:
    """Draw the plate."""
    motion = "lateral bend to the right"
    curve = read_curve("waist", motion)
    schmidt = mark_as_comparison(
        published_curve("schmidt_1998/lateral_bend", "Schmidt 1998, lumbar spine")
    )
    han = mirror_to_both_sides(
        mark_as_comparison(published_curve("han_2010/lateral_bend", "Han 2010, lumbar spine"))
    )
    anderson = mark_as_comparison(
        published_curve("anderson_1999/lumbar_bending", "Anderson 1999, limits")
    )
    zone = curve.cubic.dead_zone
    assert zone is not None
    claims = [
        *law_claims(curve),
        printed_cubic_claim(curve),
        low_resistance_claim(curve),
        stop_not_late_claim(curve),
        rms_difference_claim(
            curve,
            schmidt,
            *curve.normal_range,
            f"the dead zone ends at {degrees(zone[1]):.1f} deg, where those spines hold "
            f"{abs(schmidt.torque_at(zone[1])):.0f} N m",
        ),
        low_torque_claim(curve, han, *curve.normal_range),
        same_direction_claim(curve, schmidt, *curve.normal_range),
    ]
    title = "Waist, bent to the side (the thesis's figure 4.11)"
    literature = [schmidt, han, anderson]
    return build_curve_plate(
        "waist_bend", title, curve, literature, _BEND_WINDOW, claims, WAIST_COMMENT
    )


_FLEXION_WINDOW = Window(angles=(-60.0, 100.0), torques=(-90.0, 90.0), residuals=(-90.0, 40.0))


def waist_flexion() -> Plate:
    """Draw the plate."""
    curve = read_curve("waist", "flexion")
    schmidt = mark_as_comparison(
        join_curves(
            published_curve("schmidt_1998/flexion", "Schmidt 1998, lumbar spine"),
            published_curve("schmidt_1998/extension", "Schmidt 1998, lumbar spine"),
        )
    )
    han = mark_as_comparison(
        published_curve("han_2010/flexion", "Han 2010, lumbar spine, flexion only")
    )
    anderson = mark_as_comparison(
        published_curve("anderson_1999/lumbar_extension", "Anderson 1999, limits")
    )
    low, high = curve.normal_range
    zone = curve.cubic.dead_zone
    assert zone is not None
    early = "a spine that bends forward by 80 deg is stopped here at 56"
    claims = [
        *law_claims(curve),
        printed_cubic_claim(curve),
        stop_not_early_claim(curve, early),
        stop_not_late_claim(curve, "extension is held 19 deg beyond the normal end only"),
        rms_difference_claim(
            curve,
            schmidt,
            low,
            zone[1],
            f"all of it is in the dead zone; those spines hold {abs(schmidt.torque_at(zone[1])):.0f} N m "
            "where it ends",
        ),
        rms_difference_claim(curve, schmidt, low, high, early),
        rms_difference_claim(curve, han, 0.0, high, early),
        same_direction_claim(curve, schmidt, low, high),
    ]
    title = "Waist, bent forward (the thesis's figure 4.12)"
    literature = [schmidt, han, anderson]
    return build_curve_plate(
        "waist_flexion", title, curve, literature, _FLEXION_WINDOW, claims, WAIST_COMMENT
    )


_TWIST_WINDOW = Window(angles=(-85.0, 85.0), torques=(-90.0, 90.0), residuals=(-60.0, 60.0))


def waist_twist() -> Plate:
    """Draw the plate."""
    curve = read_curve("waist", "twist to the left")
    schmidt = mark_as_comparison(
        published_curve("schmidt_1998/axial_rotation", "Schmidt 1998, lumbar spine")
    )
    han = mark_as_comparison(published_curve("han_2010/axial_rotation", "Han 2010, lumbar spine"))
    anderson = mark_as_comparison(
        published_curve("anderson_1999/lumbar_rotation", "Anderson 1999, limits")
    )
    free = "its dead zone of 139 deg is wider than any spine turns"
    claims = [
        *law_claims(curve),
        printed_cubic_claim(curve),
        stop_not_late_claim(curve, free),
        rms_difference_claim(curve, schmidt, *curve.normal_range, free),
        rms_difference_claim(curve, han, *curve.normal_range, free),
    ]
    title = "Waist, twisted (the thesis's figure 4.13)"
    literature = [schmidt, han, anderson]
    return build_curve_plate(
        "waist_twist", title, curve, literature, _TWIST_WINDOW, claims, WAIST_COMMENT
    )
