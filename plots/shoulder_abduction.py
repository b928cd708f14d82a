"""The shoulder's passive torque in abduction (the thesis's figure 4.4)."""

from math import radians

from plots.curve_claims import (
    both_small,
    late_stop,
    near,
    printed_holds,
    read_out,
    same_way,
)
from plots.curve_plate import curve_plate
from plots.joint_curve import read_curve
from plots.literature import published_curve
from plots.moment_axes import Window
from plots.plate import Plate

WORDS = (
    "The thesis fits a cubic to one subject of Engin 1980: the component of the resisting moment "
    "that opposes the motion about one axis; the smaller ones about the others are ignored. Those "
    "data are not public. The limit torque of a musculoskeletal model stands in; its angle is one "
    "of three of another kind (elevation, plane of elevation, axial rotation), so that the two "
    "stand side by side and neither is a fit of the other."
)
"""What is to be said of all three curves of the shoulder."""

_MODEL = "elevation of the arm, in the frontal plane here; no torque between 30 and 150 deg"
_WINDOW = Window(angles=(-60.0, 190.0), torques=(-60.0, 40.0), residuals=(-60.0, 40.0))


def plate() -> Plate:
    """Draw the plate."""
    curve = read_curve("left_shoulder", "abduction")
    saul = published_curve("saul_2015/shoulder_elv", "Saul 2015, limit of elevation", _MODEL)
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
    return curve_plate("shoulder_abduction", title, curve, [saul], _WINDOW, claims, WORDS)
