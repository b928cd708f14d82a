"""The torque that Exudyn applies, read out at rest, and its work round a closed loop."""

import numpy as np

from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import (
    AxisSpring,
    Cubic,
    Damping,
    JointSprings,
    Linear,
    SphericalLaw,
    SpringSet,
)
from tests.chains import BALL, X, Y, Z, body, one_body
from tests.runs import energy_error, springs_of

AXES = (
    AxisSpring(Z, (Cubic((1.0, 38.0, -13.0, 106.0)),)),
    AxisSpring((-1.0, 0.0, 0.0), (Cubic((-0.1, 20.0, 8.0, 60.0)),)),
    AxisSpring(Y, (Linear(30.0, 0.4),)),
)


def springs(law: SphericalLaw) -> SpringSet:
    return SpringSet({"pin": JointSprings("pin", AXES)}, law)


def test_a_swing_keeps_its_energy_under_the_conservative_law_only() -> None:
    """In motion: the stored energy of the one law, the work against the other."""
    figure = one_body(BALL, (0.3, -0.2, 0.5), body("link", centre=(0.0, -0.2, 0.1)))
    plan = {"stop": 1.0, "step": 2.5e-4, "velocities": {"pin": (2.0, 3.0, -1.0)}}
    for law in (SphericalLaw.CONSERVATIVE, SphericalLaw.WEIGHTED):
        run = simulate(figure, Plan(springs=springs(law), **plan))
        exchanged = np.ptp(run.energy["kinetic"])
        assert energy_error(run) < 1e-4 * exchanged
        assert run.law == law.value


def test_damping_acts_on_the_components_of_the_relative_spin() -> None:
    """Isotropic viscous damping of a ball is minus b times the relative angular velocity."""
    axes = tuple(AxisSpring(axis, (), Damping(0.3)) for axis in (X, Y, Z))
    figure = one_body(BALL, (0.3, -0.9, 0.5))
    run = simulate(
        figure,
        Plan(
            stop=0.2,
            step=1e-4,
            frame=2e-3,
            springs=springs_of("pin", *axes),
            velocities={"pin": (2.0, 3.0, -1.0)},
        ),
    )
    rotations = run.poses["link"][:, :3, :3]
    # Central differences: the passive torque is in the parent's axes, here the world's.
    spin = (rotations[2:] - rotations[:-2]) / 4e-3 @ np.swapaxes(rotations[1:-1], 1, 2)
    omega = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
    assert np.allclose(run.passive_torques["pin"][1:-1], -0.3 * omega, atol=2e-4)
    assert run.energy["dissipated"][-1] > 0.0
