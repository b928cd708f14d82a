"""The shoulder's passive torque in flexion (the thesis's figure 4.5)."""

from math import radians

from plots.claim import Claim
from plots.curve_claims import late_stop, near, read_out, same_way
from plots.curve_plate import curve_plate
from plots.joint_curve import read_curve
from plots.literature import published_curve
from plots.moment_axes import Window
from plots.plate import Plate
from plots.shoulder_abduction import WORDS
from springs.lint import FIRM

_MODEL = "elevation of the arm, in the sagittal plane here; no torque between 30 and 150 deg"
_WINDOW = Window(angles=(-75.0, 180.0), torques=(-80.0, 80.0), residuals=(-80.0, 40.0))


def plate() -> Plate:
    """Draw the plate."""
    curve = read_curve("left_shoulder", "flexion")
    saul = published_curve("saul_2015/shoulder_elv", "Saul 2015, limit of elevation", _MODEL)
    early = (
        "a relaxed arm is lifted to level with next to nothing but its weight; where Engin counted "
        "the angle from is not told, and a zero other than the hanging arm's would explain it"
    )
    claims = [
        *read_out(curve),
        Claim(
            f"The arm lifted forward to level, 90 deg, resists with less than {FIRM:g} N m, where "
            f"{saul.label} has {abs(saul.at(radians(90.0))):g} N m",
            abs(curve.at(radians(90.0))),
            "N m",
            at_most=FIRM,
            remark=early,
        ),
        late_stop(curve, "the cubic has no dead zone and 5 N m at 46 deg already"),
        near(curve, saul, 0.0, radians(150.0), "the model is free from 30 deg on"),
        same_way(
            curve,
            saul,
            0.0,
            radians(175.0),
            "about 8 deg the cubic draws the arm back already, the model still forward",
        ),
    ]
    title = "Shoulder flexion, about y (the thesis's figure 4.5)"
    return curve_plate("shoulder_flexion", title, curve, [saul], _WINDOW, claims, WORDS)
