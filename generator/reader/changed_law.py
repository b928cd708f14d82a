"""What `scale`, `offset_deg` and `hysteresis_Nm` make of a law."""

import numpy as np

from springs.directional import Directional
from springs.elastic import Elastic
from springs.scaled import Scaled

LARGEST = 1e100
"""Torque [N m] and energy [J] beyond which squares and products would leave the numbers."""

_FARTHEST = np.radians(np.linspace(-200.0, 200.0, 401))
"""Angles that a joint may reach, and more [rad]."""


def changed_law(
    law: Elastic, scale: float, offset: float, hysteresis: float, slip: float
) -> Elastic:
    """The law with its torque scaled, moved, and then split by the direction.

    Args:
        law: as it is written.
        scale: factor of its torque.
        offset: how far it is moved towards greater angles [rad].
        hysteresis: distance of the curves of a growing and a falling angle [N m].
        slip: rate at which the direction is told [rad/s].
    """
    if isinstance(law, Directional):
        up, down = (_moved(one, scale, offset) for one in (law.increasing, law.decreasing))
        return Directional(up, down, slip)
    moved = _moved(law, scale, offset)
    return Directional.around(moved, hysteresis, slip) if hysteresis else moved


def _moved(law: Elastic, scale: float, offset: float) -> Elastic:
    return law if (scale, offset) == (1.0, 0.0) else Scaled(law, scale, offset)


def is_finite(law: Elastic) -> bool:
    """Whether torque and energy of a law can be calculated with wherever a joint may turn."""
    curves = (law.increasing, law.decreasing) if isinstance(law, Directional) else (law,)
    places = np.unique([*_FARTHEST, *law.corners])
    try:
        with np.errstate(all="ignore"):
            values = [np.asarray(f(places)) for one in curves for f in (one.torque, one.energy)]
    except ValueError:  # slopes between points that are not finite
        return False
    return all(bool(np.all(np.abs(value) < LARGEST)) for value in values)
