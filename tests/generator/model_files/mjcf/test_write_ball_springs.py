"""Springs of several rotations that are equal in all directions."""

from dataclasses import replace

import pytest

from generator.model_files.mjcf.write import isotropic_stiffness
from springs import JointSprings, Stop
from springs.spherical import VectorLaw
from tests.chains import BALL, two_bodies
from tests.generator.model_files.model_cases import START, equal


def test_equal_springs_with_stops_are_not_isotropic() -> None:
    """Stops are at the ends of the range, beyond which a ball's own spring has none."""
    stop = Stop(-0.5, 0.5, 200.0)
    of = two_bodies(BALL, START)
    limited = replace(of.joints["tested"], lower_limit=(-0.5,) * 3, upper_limit=(0.5,) * 3)
    alike = equal(of, "tested", 20.0, 0.0)
    stopped = [replace(axis, elastic=(*axis.elastic, stop)) for axis in alike.axes]
    found = isotropic_stiffness(limited, alike, VectorLaw(alike.axes))
    assert found == pytest.approx((20.0, 0.0, 0.0))
    with_stops = JointSprings("tested", tuple(stopped))
    assert isotropic_stiffness(limited, with_stops, VectorLaw(with_stops.axes)) is None
    locked = replace(limited, lower_limit=(0.0,) * 3, upper_limit=(0.0,) * 3)
    assert isotropic_stiffness(locked, alike, VectorLaw(alike.axes)) == pytest.approx((20.0, 0, 0))
