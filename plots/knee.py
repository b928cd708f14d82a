"""The knee's passive torque (the thesis's figure 4.3)."""

from math import degrees, radians

from plots.curve_claims import both_small, late_stop, of_size, read_out, same_way
from plots.curve_plate import curve_plate
from plots.joint_curve import read_curve
from plots.literature import held_law, published_curve
from plots.moment_axes import Window
from plots.plate import Plate

_WORDS = (
    "The thesis fits a cubic to the knee of a Sierra 292-1050 crash dummy (CAL3D report), of which "
    "it says itself that it is unclear how well a dummy resembles a man. The report's data are not "
    "public, so measurements of living knees stand in. The thesis's knee knows nothing of hip and "
    "ankle, which move the others' curves."
)
_WINDOW = Window(angles=(-20.0, 150.0), torques=(-60.0, 40.0), residuals=(-60.0, 30.0))


def plate() -> Plate:
    """Draw the plate."""
    curve = read_curve("left_knee", "flexion")
    silder = published_curve("silder_2007/knee_hip_0_ankle_-15", "Silder 2007, ankle at -15 deg")
    literature = [
        silder,
        published_curve("silder_2007/knee_hip_0_ankle_20", "Silder 2007, ankle at 20 deg"),
        held_law(
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
        *read_out(curve),
        late_stop(curve, f"{edge}, as it is printed: this knee does not bend as far as a man's"),
        both_small(curve, silder, 0.0, radians(90.0)),
        of_size(curve, silder, 95.0),
        of_size(curve, silder, 115.0, "the dummy's knee ends in a wall where a man's goes on"),
        same_way(curve, silder, 0.0, radians(120.0)),
    ]
    title = "Knee flexion (the thesis's figure 4.3)"
    return curve_plate("knee", title, curve, literature, _WINDOW, claims, _WORDS)
