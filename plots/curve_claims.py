"""What is claimed of every joint's curve, and of the curves that are compared with it."""

from math import degrees, radians

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
    """That simulated and published torque do not oppose each other.

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
    opposed = (simulated * published < 0.0) & (
        np.minimum(np.abs(simulated), np.abs(published)) > PUSHES
    )
    angles = curve.angles[inside]
    widths = np.diff([angles[0], *(0.5 * (angles[1:] + angles[:-1])), angles[-1]])
    return Claim(
        f"From {range_words(low, high)} there is no angle at which simulated curve and {one.label} "
        f"push opposite ways, both with more than {PUSHES:g} N m",
        degrees(float(np.sum(widths[opposed]))),
        "deg",
        at_most=0.0,
        remark=remark,
    )


def near(
    curve: JointCurve,
    one: Literature,
    low: float,
    high: float,
    bound: float = FIRM,
    remark: str = "",
) -> Claim:
    """That simulated and published torque differ by little.

    Args:
        curve: as read.
        one: the published curve.
        low: lower end of the range compared [rad].
        high: upper end.
        bound: of the root mean square [N m]; by default what an examiner's hand can tell.
        remark: of the claim.
    """
    less = curve.less(one, low, high)
    return Claim(
        f"From {range_words(low, high)} the simulated torque is that of {one.label} within "
        f"{bound:g} N m (root mean square of {less.size} differences)",
        float(np.sqrt(np.mean(less**2))),
        "N m",
        at_most=bound,
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
