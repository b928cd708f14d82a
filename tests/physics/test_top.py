"""A free symmetric body: its spin precesses about the momentum as the closed form says."""

import numpy as np
import pytest

from generator.joint_chain import build_chain
from generator.rotations import matrix_from_rotation_vector, rotation_vector_from_matrix
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import SpringSet
from tests.chains import FREE, body, one_body

ACROSS, ALONG = 0.05, 0.02
"""Moments of inertia across and along the symmetry axis [kg m2]."""


@pytest.mark.parametrize("gravity", [(0.0, 0.0, 0.0), (0.0, -9.81, 0.0)])
def test_a_free_symmetric_top(gravity) -> None:
    """Within 1e-6 rad over 1 s at the tolerance 1e-6, falling or not."""
    link = body("link", inertia=(ACROSS, ACROSS, ALONG), centre=(0.0, 0.0, 0.0))
    start = np.array([0.3, -0.5, 0.7, 0.0, 0.0, 0.0])
    spin = np.array([1.0, -2.0, 12.0])
    link_chain = build_chain(FREE)
    rotation = link_chain.pose(start)[:3, :3]
    twists = link_chain.twists(start)[:3, :3].T
    rates = np.concatenate([np.linalg.solve(twists, rotation @ spin), np.zeros(3)])
    plan = Plan(
        stop=1.0,
        tolerance=1e-6,
        gravity=gravity,
        springs=SpringSet(),
        velocities={"pin": rates},
    )
    run = simulate(one_body(FREE, start, link), plan)

    # Torque-free: R(t) = exp(t L/I1) R(0) exp(t (1 - I3/I1) w3 e3).
    momentum = rotation @ (np.array([ACROSS, ACROSS, ALONG]) * spin)
    t = run.times[:, None]
    precession = matrix_from_rotation_vector(t * momentum / ACROSS)
    own = np.array([0.0, 0.0, (1.0 - ALONG / ACROSS) * spin[2]])
    expected = precession @ rotation @ matrix_from_rotation_vector(t * own)
    off = np.swapaxes(expected, 1, 2) @ run.poses["link"][:, :3, :3]
    assert np.max(np.linalg.norm(rotation_vector_from_matrix(off), axis=1)) < 1e-6
    fall = 0.5 * t**2 * np.array(gravity)
    assert np.max(np.abs(run.centre_of_mass - fall)) < 1e-6
    assert np.ptp(run.energy["kinetic"] + run.energy["gravity"]) < 1e-5
