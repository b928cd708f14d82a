"""The waist's passive torque in bending to the side (the thesis's figure 4.11)."""

from math import degrees

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
from plots.joint_curve import read_curve
from plots.literature import both_sides, compared, published_curve
from plots.moment_axes import Window
from plots.plate import Plate

WORDS = (
    "The waist is an artifice of the thesis, one joint for a whole spine, and its curve is "
    "invented. Beside it stand measured lumbar spines, six segments in series that share the "
    "angle, and the limit of a gait model. The normal range is that of the thoracolumbar spine, of "
    "which the lumbar one is a part."
)
"""What is to be said of all three curves of the waist."""

_WINDOW = Window(angles=(-50.0, 50.0), torques=(-40.0, 40.0), residuals=(-40.0, 40.0))


def plate() -> Plate:
    """Draw the plate."""
    motion = "lateral bend to the right"
    curve = read_curve("waist", motion)
    schmidt = compared(published_curve("schmidt_1998/lateral_bend", "Schmidt 1998, lumbar spine"))
    han = both_sides(compared(published_curve("han_2010/lateral_bend", "Han 2010, lumbar spine")))
    anderson = compared(published_curve("anderson_1999/lumbar_bending", "Anderson 1999, limits"))
    zone = curve.cubic.dead_zone
    assert zone is not None
    claims = [
        *read_out(curve),
        printed_holds(curve),
        soft(curve),
        stops(curve),
        near(
            curve,
            schmidt,
            *curve.normal,
            f"the dead zone ends at {degrees(zone[1]):.1f} deg, where those spines hold "
            f"{abs(schmidt.at(zone[1])):.0f} N m",
        ),
        both_small(curve, han, *curve.normal),
        same_way(curve, schmidt, *curve.normal),
    ]
    title = "Waist, bent to the side (the thesis's figure 4.11)"
    literature = [schmidt, han, anderson]
    return curve_plate("waist_bend", title, curve, literature, _WINDOW, claims, WORDS)
