"""The shoulder's passive torque in rotation about the upper arm (the thesis's figure 4.6)."""

from math import radians

import numpy as np

from plots.claim import Claim
from plots.curve_claims import both_small, late_stop, read_out, same_way
from plots.curve_plate import curve_plate
from plots.joint_curve import read_curve
from plots.literature import published_curve
from plots.moment_axes import Window
from plots.plate import Plate
from plots.shoulder_abduction import WORDS
from springs.smooth_limit import SmoothLimit

LOOSE = 5.0
"""The moment to which cadaver joints are turned to find the ends of their range [N m]."""

_MODEL = "axial rotation of the arm; no torque between -60 and -10 deg"
_ZERO = (
    " A published figure of Engin's earlier study has its zero with the forearm turned inwards by "
    "45 deg; whether the data of 1980 have it too is not known."
)
_WINDOW = Window(angles=(-120.0, 90.0), torques=(-60.0, 40.0), residuals=(-40.0, 40.0))


def plate() -> Plate:
    """Draw the plate."""
    curve = read_curve("left_shoulder", "medial rotation")
    saul = published_curve("saul_2015/shoulder_rot", "Saul 2015, limit of rotation", _MODEL)
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
    return curve_plate("shoulder_rotation", title, curve, [saul], _WINDOW, claims, WORDS + _ZERO)
