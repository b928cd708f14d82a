"""Passive torques of elbow and knee (the thesis's figures 4.2 and 4.3)."""

from collections.abc import Iterator
from math import degrees, radians

from plots.joint_curve import (
    JointCurve,
    low_torque_claim,
    rms_difference_claim,
    same_direction_claim,
    same_magnitude_claim,
    stop_not_early_claim,
)
from plots.joint_plate import JointPlate, Window
from plots.literature import Literature, published_curve, single_angle_curve
from plots.plate import Claim


def _elbow_claims(curve: JointCurve, saul: Literature) -> Iterator[Claim]:
    end = curve.dead_zone[1]
    edge = f"the dead zone ends at {degrees(end):.1f} deg, an estimate of the thesis's author"
    yield stop_not_early_claim(curve, f"{edge}: this elbow bends less than a real one")
    yield low_torque_claim(
        curve,
        saul,
        0.0,
        end,
        f"the model resists with {abs(saul.torque_at(0.0)):.0f} N m at 0 deg, where the thesis's "
        "dead zone begins",
    )
    remark = f"{edge}, where the model's elbow is free"
    yield rms_difference_claim(curve, saul, 0.0, radians(130.0), remark)
    yield same_direction_claim(curve, saul, 0.0, radians(130.0))


elbow = JointPlate(
    name="elbow",
    title="Elbow flexion (the thesis's figure 4.2)",
    joint="left_elbow",
    motion="flexion",
    literature=(published_curve("saul_2015/elbow_flexion", "Saul 2015, limit torque"),),
    window=Window(angles=(-25.0, 155.0), torques=(-60.0, 40.0), residuals=(-40.0, 20.0)),
    claims=_elbow_claims,
    comment=(
        "The thesis takes the mean cubic of ten men from Engin & Chen 1987, measured in extension "
        "and hyperextension. Their data are not public; the limit torque of a musculoskeletal "
        "model is the substitute. The edges of the dead zone are estimates of the thesis's author; "
        "at the upper edge the cubic fitted to extension rises with 1870 N m/rad."
    ),
)


def _knee_claims(curve: JointCurve, silder: Literature, *_: Literature) -> Iterator[Claim]:
    yield stop_not_early_claim(
        curve,
        f"the dead zone ends at {degrees(curve.dead_zone[1]):.1f} deg as printed: this knee bends "
        "less than a real one",
    )
    yield low_torque_claim(curve, silder, 0.0, radians(90.0))
    yield same_magnitude_claim(curve, silder, 95.0)
    remark = "the dummy's knee has a stiff stop where a real one bends further"
    yield same_magnitude_claim(curve, silder, 115.0, remark)
    yield same_direction_claim(curve, silder, 0.0, radians(120.0))


knee = JointPlate(
    name="knee",
    title="Knee flexion (the thesis's figure 4.3)",
    joint="left_knee",
    motion="flexion",
    literature=(
        published_curve("silder_2007/knee_hip_0_ankle_-15", "Silder 2007, ankle at -15 deg"),
        published_curve("silder_2007/knee_hip_0_ankle_20", "Silder 2007, ankle at 20 deg"),
        single_angle_curve(
            "riener_edrich_1999/leg",
            "knee flexion",
            {"hip flexion": 0.0, "ankle dorsiflexion": 0.0},
            "Riener & Edrich 1999",
            "its range is assumed to be Silder's",
        ),
        published_curve("davy_audu_1987/knee", "Davy & Audu 1987"),
        published_curve("anderson_1999/knee", "Anderson 1999, ligaments"),
        published_curve(
            "anderson_madigan_nussbaum_2007/knee_male_18_25", "Anderson 2007, young men"
        ),
    ),
    window=Window(angles=(-20.0, 150.0), torques=(-60.0, 40.0), residuals=(-60.0, 30.0)),
    claims=_knee_claims,
    comment=(
        "The thesis fits a cubic to the knee of a Sierra 292-1050 crash dummy (CAL3D report), and "
        "leaves open how well a dummy resembles a human. The report's data are not public; "
        "measurements of living knees are the substitutes. The thesis's knee is independent of "
        "hip and ankle, whose angles change the published curves."
    ),
)
