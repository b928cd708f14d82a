"""The hip's passive torque in rotation about the thigh (the thesis's figure 4.10)."""

from math import degrees, radians

import numpy as np

from plots.claim import Claim
from plots.curve_claims import (
    both_small,
    near,
    printed_holds,
    read_out,
    same_way,
    soft,
    stops,
)
from plots.curve_plate import curve_plate
from plots.joint_curve import JointCurve, read_curve
from plots.literature import Literature, compared, published_curve
from plots.moment_axes import Window
from plots.plate import Plate
from springs import published

HELD = 5.0
"""The moment to which van Arkel turned hips to find the ends of their range [N m]."""

_WORDS = (
    "The curve is an estimate of the thesis's author, based on no study. Beside it stand the fit "
    "of a public code base to the ligaments of cadaver hips, and the ligament term of a gait model."
)
_WINDOW = Window(angles=(-60.0, 60.0), torques=(-60.0, 60.0), residuals=(-60.0, 60.0))


def plate() -> Plate:
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
    return curve_plate("hip_rotation", title, curve, literature, _WINDOW, claims, _WORDS)


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
