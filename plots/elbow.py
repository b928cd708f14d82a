"""The elbow's passive torque (the thesis's figure 4.2)."""

from math import degrees, radians

from plots.curve_claims import both_small, late_stop, near, read_out, same_way
from plots.curve_plate import curve_plate
from plots.joint_curve import read_curve
from plots.literature import published_curve
from plots.moment_axes import Window
from plots.plate import Plate

_WORDS = (
    "The thesis takes the mean cubic of ten men from Engin & Chen 1987, measured in extension and "
    "hyperextension. Their data are not public, so the limit torque of a musculoskeletal model "
    "stands in. The dead zone's edges are estimates of the thesis's author; at its upper edge the "
    "cubic made for extension becomes a wall of 1870 N m/rad."
)
_WINDOW = Window(angles=(-25.0, 155.0), torques=(-60.0, 40.0), residuals=(-40.0, 20.0))


def plate() -> Plate:
    """Draw the plate."""
    curve = read_curve("left_elbow", "flexion")
    saul = published_curve("saul_2015/elbow_flexion", "Saul 2015, limit torque")
    zone = curve.cubic.dead_zone
    assert zone is not None
    edge = f"the dead zone ends at {degrees(zone[1]):.1f} deg, an estimate of the thesis's author"
    claims = [
        *read_out(curve),
        late_stop(curve, f"{edge}: this elbow cannot be bent as a man's can"),
        both_small(
            curve,
            saul,
            0.0,
            zone[1],
            f"the model holds a straight elbow with {abs(saul.at(0.0)):.0f} N m, the thesis's "
            "is free from 0 deg on",
        ),
        near(curve, saul, 0.0, radians(130.0), f"{edge}; the model's elbow is free there"),
        same_way(curve, saul, 0.0, radians(130.0)),
    ]
    title = "Elbow flexion (the thesis's figure 4.2)"
    return curve_plate("elbow", title, curve, [saul], _WINDOW, claims, _WORDS)
