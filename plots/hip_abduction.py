"""The hip's passive torque in abduction and adduction (the thesis's figure 4.9)."""

from dataclasses import replace
from math import radians

from plots.curve_claims import (
    both_small,
    of_size,
    printed_holds,
    read_out,
    same_way,
    stops,
)
from plots.curve_plate import curve_plate
from plots.joint_curve import read_curve
from plots.literature import Literature, compared, points_of, published_curve
from plots.moment_axes import Window
from plots.plate import Plate
from springs import published

_WORDS = (
    "The curve is an estimate of the thesis's author, based on no study. Beside it stand the "
    "ligament term of a gait model and the two angles at which the ligaments of cadaver hips hold "
    "5 N m."
)
_WINDOW = Window(angles=(-70.0, 70.0), torques=(-100.0, 100.0), residuals=(-40.0, 40.0))


def plate() -> Plate:
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
    return curve_plate("hip_abduction", title, curve, literature, _WINDOW, claims, _WORDS)


def _cadavers() -> Literature:
    """The ends of the range that van Arkel read at a moment."""
    rows = {row.motion: row for row in published.publication("van_arkel_2015").ranges}
    adduction, abduction = rows["hip adduction"], rows["hip abduction"]
    assert adduction.moment is not None
    assert abduction.moment is not None
    points = ((-adduction.limit, adduction.moment), (abduction.limit, -abduction.moment))
    found = points_of(points, "van Arkel 2015, cadaver hips", abduction.reference)
    return replace(found, is_substitute=False)
