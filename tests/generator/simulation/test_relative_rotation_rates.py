"""Rates of a joint's angles, read off its orientation, against the chain's own axes."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from generator.joint_chain import build_chain
from generator.simulation.relative_rotation import JointRates, quaternion
from tests.chains import chain

CHAINS = ["Rx", "R-y", "Rs", "Rx Ry", "Rs Ra", "R-y Rz", "Rx Ry Rz", "Rz R-x Rz", "Rs Ra Rs"]

three = st.tuples(*[st.floats(-3.0, 3.0)] * 3)
scales = st.sampled_from([1.0, -1.0, 0.7])


@given(st.sampled_from(CHAINS), three, three, scales)
def test_the_rates_of_an_angular_velocity(word, angles, rates, scale) -> None:
    """Whatever the length and the sign of the quaternion; away from where axes fall together."""
    made = build_chain(chain(word))
    count = len(made.joint_axes)
    q, given_rates = np.array(angles[:count]), np.array(rates[:count])
    axes = made.twists(q)[:, :3]
    assume(np.linalg.svd(axes, compute_uv=False)[-1] > 0.05)
    turn = tuple(scale * part for part in quaternion(made.pose(q)[:3, :3]))
    found = JointRates.from_chain(made, q)
    spin = given_rates @ axes
    assert [np.dot(axis, spin) for axis in found.rate_axes(turn)] == pytest.approx(
        list(given_rates), abs=1e-9
    )
    assert found.angular_velocity(q.tolist(), given_rates.tolist()) == pytest.approx(
        list(spin), abs=1e-12
    )


@given(three)
def test_slides_are_passed_over(angles) -> None:
    made = build_chain(chain("Rx Ry Rz Tx"))
    q = np.array([*angles, 0.3])
    axes = made.twists(q)[:3, :3]
    assume(np.linalg.svd(axes, compute_uv=False)[-1] > 0.05)
    found = JointRates.from_chain(made, q).rate_axes(quaternion(made.pose(q)[:3, :3]))
    assert np.allclose(np.array(found) @ axes.T, np.eye(3), atol=1e-9)


def test_at_a_pole_the_rates_are_finite() -> None:
    """Where the outer axes are one, a solver gets large numbers, and no division by zero."""
    made = build_chain(chain("Rx Ry Rz"))
    q = np.array([0.3, 0.5 * np.pi, 0.1])
    found = np.array(JointRates.from_chain(made, q).rate_axes(quaternion(made.pose(q)[:3, :3])))
    assert np.all(np.isfinite(found))
