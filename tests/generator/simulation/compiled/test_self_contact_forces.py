"""Segments that touch each other in the compiled evaluation, against arrays and Exudyn."""

import numpy as np
import pytest

from generator.simulation.compiled.layout import FRICTION, IMPACT
from tests.self_contact_poses import contact_in, poses, settable


def test_accelerations_are_exudyn_s():
    """Exudyn's object on the coordinates of the bodies, against the forces on the links."""
    made, equations = settable()
    for pose in poses():
        exact, found = equations.accelerations(pose.state), made.accelerations(pose)
        assert np.max(np.abs(found - exact)) < 1e-10 * np.max(np.abs(exact))


def test_powers_are_those_for_arrays():
    made, _ = settable()
    for pose in poses():
        made.settle(pose)
        expected = contact_in(pose)
        powers = expected.impact_power[0], expected.friction_power[0]
        scale = max(1.0, *np.abs(powers))
        found = made.compiled.scratch.powers[[IMPACT, FRICTION]]
        assert found == pytest.approx(powers, abs=1e-10 * scale)


def test_the_props_bear_nothing_of_it():
    """The impulses of a run are those of its props."""
    made, _ = settable()
    for pose in poses(3):
        made.settle(pose)
        assert np.all(made.compiled.scratch.contact_forces == 0.0)
