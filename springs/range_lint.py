"""The lint of what a law knows of itself: where it was measured, and what its hysteresis takes."""

from collections.abc import Iterator
from math import degrees

import numpy as np

from springs.directional import Directional
from springs.elastic import Elastic
from springs.finding import Finding, Kind
from springs.measured import Measured, extrapolation, measured_range
from springs.sampled_curve import SampledCurve
from springs.scaled import Scaled

_EQUAL = 1e-6
"""What rounding may do to the order of two curves [N m]."""


def lint_known_range(curve: SampledCurve) -> Iterator[Finding]:
    """Which part of the curve is an extrapolation, for laws that know their range."""
    ends = curve.low, curve.high
    for law in curve.laws:
        said = extrapolation(measured_range(law), *ends) if _knows_range(law) else ""
        if said:
            torques = curve.at(curve.low), curve.at(curve.high)
            places = " and ".join(
                f"{torque + 0.0:.4g} N m at {_deg(end)} deg"
                for end, torque in zip(ends, torques, strict=True)
            )
            yield Finding(Kind.KNOWN, False, f"{said}; {places}", ends, torques)


def lint_hysteresis(curve: SampledCurve) -> Iterator[Finding]:
    """What the direction of motion takes in a slow cycle, and where it would give instead."""
    for law in curve.laws:
        if not isinstance(law, Directional):
            continue
        lost, ends = law.loss(curve.low, curve.high), (curve.low, curve.high)
        over = f"{_deg(curve.low)} .. {_deg(curve.high)} deg"
        said = f"a slow cycle over {over} loses {lost:.4g} J to the hysteresis"
        yield Finding(Kind.HYSTERESIS, False, said, ends, (lost,))
        up, down = (
            np.asarray(one.torque(curve.angles)) for one in (law.increasing, law.decreasing)
        )
        excess = up - down
        worst = int(excess.argmax())
        if excess[worst] > _EQUAL * max(1.0, curve.size):
            angle, much = float(curve.angles[worst]), float(excess[worst])
            said = (
                f"at {_deg(angle)} deg the curve of the growing angle lies {much:.3g} N m "
                "above that of the falling one: a cycle there feeds energy"
            )
            yield Finding(Kind.HYSTERESIS, True, said, (angle,), (much,))


def _deg(angle: float) -> str:
    return f"{round(degrees(angle), 1) + 0.0:.1f}"


def _knows_range(law: Elastic) -> bool:
    """Whether a law, whatever is done to it, is of a kind that knows where it was measured."""
    while isinstance(law, Scaled | Directional):
        law = law.law if isinstance(law, Scaled) else law.increasing
    return isinstance(law, Measured)
