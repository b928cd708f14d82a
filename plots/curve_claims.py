"""What is claimed of every joint's curve, and of the curves that are compared with it.

Claims that compare fail of a joint without springs. Those that a joint is free somewhere do not;
they are made only where it has some torque, or where what is published has.
"""

from math import degrees, nan, radians

import numpy as np

from plots.claim import Claim
from plots.joint_curve import JointCurve, range_words
from plots.literature import Literature
from springs.lint import BEYOND, FIRM
from springs.sense import outer_roots

AGREED = 1e-6
"""Torques that differ by less are the same [N m]."""

ORDER = 2.0
"""Torques of one size differ by less than this factor, either way."""

PUSHES = 1.0
"""A torque that sets a limb moving [N m]."""

HALF = 0.5
"""A joint is near a published one within this share of its torque; a limp joint is off by all."""


def read_out(curve: JointCurve) -> list[Claim]:
    """That the model has the law, on both sides of the body."""
    swept = range_words(float(curve.angles[0]), float(curve.angles[-1]))
    claims = [
        Claim(
            f"The torque read out of Exudyn is that of the law, from {swept}",
            float(np.abs(curve.simulated - curve.law).max()),
            "N m",
            at_most=AGREED,
        )
    ]
    if curve.other_side is not None:
        claims.append(
            Claim(
                "The joint of the other side reads the same about its own axis",
                float(np.abs(curve.simulated - curve.other_side).max()),
                "N m",
                at_most=AGREED,
            )
        )
    return claims


def soft(curve: JointCurve, remark: str = "") -> Claim:
    """That a joint lets itself be moved through its normal range."""
    low, high = curve.normal
    high = min(high, float(curve.angles[-1]))
    inside = curve.within(low, high)
    return Claim(
        f"Within the normal range, {range_words(low, high)}, the joint resists with less than "
        f"{FIRM:g} N m, which is where an examiner's hand is stopped",
        float(np.abs(curve.simulated[inside]).max()),
        "N m",
        at_most=FIRM,
        remark=remark,
    )


def late_stop(curve: JointCurve, remark: str = "") -> Claim:
    """That a joint's stop is not before the upper end of its normal range."""
    assert curve.high is not None
    end = degrees(curve.high.angle)
    return Claim(
        f"The stop of {curve.motion} ({FIRM:g} N m) is not before the normal end, {end:.4g} deg",
        degrees(curve.firm_angle(1)),
        "deg",
        at_least=end,
        remark=remark,
    )


def printed_holds(curve: JointCurve) -> Claim:
    """That the cubic as printed does not push outwards between its outer roots."""
    zone = outer_roots(curve.cubic.coefficients)
    assert zone is not None
    between = np.linspace(*zone, 1001)
    return Claim(
        f"As printed, the cubic does not push the joint outwards between its outer two roots, "
        f"{range_words(*zone)}",
        float(np.abs(curve.printed(between)).max()),
        "N m",
        at_most=0.0,
        remark="so the law has a dead zone there, as eq. 4.5 gives elbow and knee",
    )


def same_way(
    curve: JointCurve, one: Literature, low: float, high: float, remark: str = ""
) -> Claim:
    """That simulated and published torque drive the same way wherever both drive.

    A joint that never drives there does not: the share is nan.

    Args:
        curve: as read.
        one: the published curve.
        low: lower end of the range compared [rad].
        high: upper end.
        remark: of the claim.
    """
    inside = curve.within(low, high)
    published = one.torque(curve.angles[inside])
    simulated = curve.simulated[inside]
    both = np.minimum(np.abs(simulated), np.abs(published)) > PUSHES
    angles = curve.angles[inside]
    widths = np.diff([angles[0], *(0.5 * (angles[1:] + angles[:-1])), angles[-1]])
    over = float(np.sum(widths[both]))
    opposed = float(np.sum(widths[both & (simulated * published < 0.0)]))
    return Claim(
        f"From {range_words(low, high)} simulated curve and {one.label} push the same way wherever "
        f"both push with more than {PUSHES:g} N m, which is over {degrees(over):.3g} deg",
        100.0 * (1.0 - opposed / over) if over else nan,
        "%",
        at_least=100.0,
        remark=remark,
    )


def both_small(
    curve: JointCurve, one: Literature, low: float, high: float, remark: str = ""
) -> Claim:
    """That neither simulated nor published torque is firm: the joint is free where others are.

    Args:
        curve: as read.
        one: the published curve.
        low: lower end of the range compared [rad].
        high: upper end.
        remark: of the claim.
    """
    published, _ = curve.beside(one, low, high)
    inside = curve.within(low, high)
    return Claim(
        f"From {range_words(low, high)} both are small: neither the simulated torque nor that of "
        f"{one.label} exceeds {FIRM:g} N m, which stops an examiner's hand",
        max(float(np.abs(curve.simulated[inside]).max()), float(np.abs(published).max())),
        "N m",
        at_most=FIRM,
        remark=remark,
    )


def near(curve: JointCurve, one: Literature, low: float, high: float, remark: str = "") -> Claim:
    """That simulated and published torque differ by little against the published one.

    Without springs the share is 1.

    Args:
        curve: as read.
        one: the published curve.
        low: lower end of the range compared [rad].
        high: upper end.
        remark: of the claim.
    """
    published, less = curve.beside(one, low, high)
    own = float(np.sqrt(np.mean(published**2)))
    return Claim(
        f"From {range_words(low, high)} the simulated torque is that of {one.label} within half of "
        f"it: root mean square of {less.size} differences, as a share of its own, {own:.3g} N m",
        float(np.sqrt(np.mean(less**2))) / own,
        at_most=HALF,
        remark=remark,
    )


def of_size(curve: JointCurve, one: Literature, angle_deg: float, remark: str = "") -> Claim:
    """That simulated and published torque at an angle [deg] are of one size and sign."""
    angle = radians(angle_deg)
    published = one.at(angle)
    return Claim(
        f"At {angle_deg:g} deg the simulated torque is of the size of {one.label}, "
        f"{published:.3g} N m, by a factor of {ORDER:g} either way",
        curve.at(angle) / published,
        at_least=1.0 / ORDER,
        at_most=ORDER,
        remark=remark,
    )


def stops(curve: JointCurve, remark: str = "") -> Claim:
    """That a joint is held not far beyond the ends of its normal range."""
    assert curve.low is not None
    assert curve.high is not None
    over = max(
        curve.firm_angle(1) - curve.high.angle,
        curve.low.angle - curve.firm_angle(-1),
    )
    return Claim(
        f"At both ends the joint resists with {FIRM:g} N m at most {degrees(BEYOND):g} deg beyond "
        f"its normal range, {range_words(*curve.normal)}",
        degrees(over),
        "deg",
        at_most=degrees(BEYOND),
        remark=remark,
    )
