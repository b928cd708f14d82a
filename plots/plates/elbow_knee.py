"""The knee's passive torque (the thesis's figure 4.3).

The elbow's passive torque (the thesis's figure 4.2).
"""

from math import degrees, radians

from plots.joint_curve import (
    law_claims,
    low_torque_claim,
    read_curve,
    rms_difference_claim,
    same_direction_claim,
    same_magnitude_claim,
    stop_not_early_claim,
)
from plots.joint_plate import Window, build_curve_plate
from plots.literature import published_curve, single_angle_curve
from plots.plate import Plate

_ELBOW_COMMENT = (
    "The thesis takes the mean cubic of ten men from Engin & Chen 1987, measured in extension and "
    "hyperextension. Their data are not public, so the limit torque of a musculoskeletal model "
    "stands in. The dead zone's edges are estimates of the thesis's author; at its upper edge the "
    "cubic made for extension becomes a wall of 1870 N m/rad."
)
_ELBOW_WINDOW = Window(angles=(-25.0, 155.0), torques=(-60.0, 40.0), residuals=(-40.0, 20.0))


def elbow() -> Plate:
    """Draw the plate."""
    curve = read_curve("left_elbow", "flexion")
    saul = published_curve("saul_2015/elbow_flexion", "Saul 2015, limit torque")
    zone = curve.cubic.dead_zone
    assert zone is not None
    edge = f"the dead zone ends at {degrees(zone[1]):.1f} deg, an estimate of the thesis's author"
    claims = [
        *law_claims(curve),
        stop_not_early_claim(curve, f"{edge}: this elbow cannot be bent as a man's can"),
        low_torque_claim(
            curve,
            saul,
            0.0,
            zone[1],
            f"the model holds a straight elbow with {abs(saul.torque_at(0.0)):.0f} N m, the thesis's "
            "is free from 0 deg on",
        ),
        rms_difference_claim(
            curve, saul, 0.0, radians(130.0), f"{edge}; the model's elbow is free there"
        ),
        same_direction_claim(curve, saul, 0.0, radians(130.0)),
    ]
    title = "Elbow flexion (the thesis's figure 4.2)"
    return build_curve_plate("elbow", title, curve, [saul], _ELBOW_WINDOW, claims, _ELBOW_COMMENT)


_KNEE_COMMENT = (
    "The thesis fits a cubic to the knee of a Sierra 292-1050 crash dummy (CAL3D report), of which "
    "it says itself that it is unclear how well a dummy resembles a man. The report's data are not "
    "public, so measurements of living knees stand in. The thesis's knee knows nothing of hip and "
    "ankle, which move the others' curves."
)
_KNEE_WINDOW = Window(angles=(-20.0, 150.0), torques=(-60.0, 40.0), residuals=(-60.0, 30.0))


def knee() -> Plate:
    """Draw the plate."""
    curve = read_curve("left_knee", "flexion")
    silder = published_curve("silder_2007/knee_hip_0_ankle_-15", "Silder 2007, ankle at -15 deg")
    literature = [
        silder,
        published_curve("silder_2007/knee_hip_0_ankle_20", "Silder 2007, ankle at 20 deg"),
        single_angle_curve(
            "riener_edrich_1999/leg",
            "knee flexion",
            {"hip flexion": 0.0, "ankle dorsiflexion": 0.0},
            "Riener & Edrich 1999",
            "its range is taken to be Silder's",
        ),
        published_curve("davy_audu_1987/knee", "Davy & Audu 1987"),
        published_curve("anderson_1999/knee", "Anderson 1999, ligaments"),
        published_curve(
            "anderson_madigan_nussbaum_2007/knee_male_18_25", "Anderson 2007, young men"
        ),
    ]
    zone = curve.cubic.dead_zone
    assert zone is not None
    edge = f"the dead zone ends at {degrees(zone[1]):.1f} deg"
    claims = [
        *law_claims(curve),
        stop_not_early_claim(
            curve, f"{edge}, as it is printed: this knee does not bend as far as a man's"
        ),
        low_torque_claim(curve, silder, 0.0, radians(90.0)),
        same_magnitude_claim(curve, silder, 95.0),
        same_magnitude_claim(
            curve, silder, 115.0, "the dummy's knee ends in a wall where a man's goes on"
        ),
        same_direction_claim(curve, silder, 0.0, radians(120.0)),
    ]
    title = "Knee flexion (the thesis's figure 4.3)"
    return build_curve_plate("knee", title, curve, literature, _KNEE_WINDOW, claims, _KNEE_COMMENT)
