"""Passive torques of elbow and knee (the thesis's figures 4.2 and 4.3)."""

from collections.abc import Iterator
from math import degrees, radians

from plots.joint_curve import JointCurve, difference_claim, range_end_claims, same_direction_claim
from plots.joint_plate import JointPlate, Window
from plots.literature import Literature, published_curve, single_angle_curve
from plots.plate import Claim


def _elbow_claims(curve: JointCurve, _: Literature) -> Iterator[Claim]:
    edge = degrees(curve.dead_zone[1])
    yield from range_end_claims(
        curve,
        "the thesis's data are of hyperextension, where its ten men resisted later",
        f"the dead zone ends at {edge:.1f} deg, an estimate of the thesis's author: this elbow "
        "bends less than a real one",
    )


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


def _knee_claims(
    curve: JointCurve, pointed: Literature, drawn_up: Literature, *others: Literature
) -> Iterator[Claim]:
    edge = degrees(curve.dead_zone[1])
    stop = f"the dead zone ends at {edge:.1f} deg as printed: this knee bends less than a real one"
    yield from range_end_claims(curve, high=stop)
    straight = "the thesis's knee resists only beyond 0 deg; stretched calf muscles resist before"
    dummy = "the dummy's knee has a stiff stop where a real one bends further"
    for measured in (pointed, drawn_up, *others[:2]):
        yield difference_claim(curve, measured, 0.0, radians(60.0), straight)
        yield difference_claim(curve, measured, radians(60.0), radians(120.0), dummy)
        yield same_direction_claim(curve, measured, 0.0, radians(120.0))


knee = JointPlate(
    name="knee",
    title="Knee flexion (the thesis's figure 4.3)",
    joint="left_knee",
    motion="flexion",
    literature=(
        published_curve("silder_2007/knee_hip_0_ankle_-15", "Silder 2007, ankle -15 deg"),
        published_curve("silder_2007/knee_hip_0_ankle_20", "Silder 2007, ankle 20 deg"),
        published_curve("silder_2007/knee_hip_45_ankle_0", "Silder 2007, hip 45 deg"),
        published_curve("silder_2007/knee_hip_-15_ankle_20", "Silder 2007, hip -15 deg"),
        single_angle_curve(
            "riener_edrich_1999/leg",
            "knee flexion",
            {"hip flexion": 0.0, "ankle dorsiflexion": 0.0},
            "Riener & Edrich 1999",
            "its range is assumed to be Silder's",
        ),
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
