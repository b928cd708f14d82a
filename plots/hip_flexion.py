"""The hip's passive torque in flexion (the thesis's figure 4.8)."""

from math import degrees, radians

from plots.claim import Claim
from plots.curve_claims import near, of_size, read_out, same_way, soft
from plots.curve_plate import curve_plate
from plots.joint_curve import JointCurve, read_curve, zero_of
from plots.literature import Literature, held_law, published_curve
from plots.moment_axes import Window
from plots.plate import Plate

_HELD = {"knee flexion": 15.0, "ankle dorsiflexion": 0.0}
_RIENER = "its range is taken to be Silder's"
_WORDS = (
    "The thesis fits a cubic to one subject of Yoon & Mansour 1982 with the knee at 15 deg, moving "
    "towards extension; how hip and knee hang together, and the 5 to 10 N m between the two "
    "directions, it leaves out. Those data are not public. Of the substitutes the digitised curve "
    "of Silder and others was measured with the knee at the same angle. Silder's equation has the "
    "mean parameters of the subjects, which is not the mean curve."
)
_WINDOW = Window(angles=(-30.0, 135.0), torques=(-75.0, 100.0), residuals=(-30.0, 70.0))


def plate() -> Plate:
    """Draw the plate."""
    curve = read_curve("left_hip_joint", "flexion", {"left_knee": 15.0, "right_knee": 15.0})
    silder = published_curve("silder_2007/hip_knee_15", "Silder 2007, digitised")
    equation = held_law("silder_2007/leg", "hip flexion", _HELD, "Silder 2007, equation")
    riener = held_law(
        "riener_edrich_1999/leg", "hip flexion", _HELD, "Riener & Edrich 1999", _RIENER
    )
    literature = [
        silder,
        equation,
        riener,
        published_curve("davy_audu_1987/hip", "Davy & Audu 1987"),
        published_curve("anderson_1999/hip_flexion", "Anderson 1999, ligaments"),
        published_curve(
            "anderson_madigan_nussbaum_2007/hip_male_18_25", "Anderson 2007, young men"
        ),
    ]
    extended = radians(-15.0)
    claims = [
        *read_out(curve),
        _same_zero(curve, silder),
        _same_zero(curve, equation, "an exponential of mean parameters is not the mean curve"),
        near(curve, silder, radians(20.0), radians(70.0)),
        same_way(curve, silder, radians(-15.0), radians(80.0)),
        of_size(
            curve,
            silder,
            -15.0,
            f"{curve.at(extended):.1f} N m stand against {silder.at(extended):.1f}: one subject, "
            "moving towards extension",
        ),
        soft(curve, "Silder's hips too take 17 N m at 70 deg, with the knee at 15 deg"),
        Claim(
            "Riener & Edrich's equation gives -34 N m at 90 deg with the knee at 15 deg",
            riener.at(radians(90.0)),
            "N m",
            at_least=-34.5,
            at_most=-33.5,
        ),
    ]
    title = "Hip flexion with the knee at 15 deg (the thesis's figure 4.8)"
    return curve_plate("hip_flexion", title, curve, literature, _WINDOW, claims, _WORDS)


def _same_zero(curve: JointCurve, one: Literature, remark: str = "") -> Claim:
    """That the torque vanishes where the published one does."""
    own = degrees(curve.zero_between(radians(-15.0), radians(80.0)))
    angles, torques = one.points or (curve.angles, one.torque(curve.angles))
    inside = (angles > radians(-15.0)) & (angles < radians(80.0))
    published = degrees(zero_of(angles[inside], torques[inside]))
    return Claim(
        f"The torque is zero, at {own:.1f} deg, within 1 deg of where that of {one.label} is, "
        f"at {published:.1f} deg",
        abs(own - published),
        "deg",
        at_most=1.0,
        remark=remark,
    )
