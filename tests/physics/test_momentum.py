"""A figure that nothing holds and nothing pulls keeps its momentum, whatever its joints do."""

from functools import cache
from typing import Any

import numpy as np

from generator import read_figure
from generator.figure import Figure
from generator.recording import Recording
from generator.rotations import Array
from generator.run_options import Integrator
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import AxisSpring, Damping, JointSprings, Linear, SpringSet
from tests.runs import momenta

PROTOTYPE = read_figure("prototype")

TUMBLE = {
    "lower_torso": (1.0, 2.0, -0.7, 0.3, 1.0, 0.5),
    "left_knee": (2.0,),
    "right_shoulder": (0.9, -1.4, 1.0),
}
BENT = {"left_hip_joint": (0.1, 0.2, 0.5), "left_knee": (0.6,), "right_elbow": (0.4,)}


def smooth_springs(figure: Figure) -> SpringSet:
    """Without corners, which would spoil the order of a step that crosses one."""
    return SpringSet(
        {
            name: JointSprings(
                name,
                tuple(
                    AxisSpring(factor.axis, (Linear(20.0),), Damping(0.08))
                    for factor in joint.chain
                ),
            )
            for name, joint in figure.joints.items()
        }
    )


@cache
def flight(
    step: float | None,
    *,
    stop: float = 0.4,
    smooth: bool = False,
    tolerance: float = 1e-6,
    **fields: Any,
) -> Recording:
    """A tumbling prototype; the tolerance holds where no step is set."""
    plan = Plan(
        stop=stop,
        gravity=(0.0, 0.0, 0.0),
        free_root=True,
        displacements=BENT,
        velocities=TUMBLE,
        springs=smooth_springs(PROTOTYPE) if smooth else None,
        step=step,
        tolerance=tolerance,
        **fields,
    )
    run = simulate(PROTOTYPE, plan)
    assert run.outcome.succeeded
    return run


def change(momentum: Array) -> float:
    """Largest change since the start, as a share of the size at the start."""
    return float(
        np.max(np.linalg.norm(momentum - momentum[0], axis=1)) / np.linalg.norm(momentum[0])
    )


def test_linear_momentum_is_kept_to_rounding() -> None:
    """In Exudyn every force of a joint acts on two bodies at one place, however coarse the step.

    The momentum is that of the start: the centre of mass is where it has carried it.
    """
    run = flight(2e-3, integrator=Integrator.EXUDYN)
    linear, _ = momenta(PROTOTYPE, run)
    expected = run.centre_of_mass[0] + run.times[:, None] * linear[0] / PROTOTYPE.total_mass
    assert np.max(np.abs(run.centre_of_mass - expected)) < 1e-12


def test_angular_momentum_converges_with_the_order_of_the_integrator() -> None:
    coarse, fine = (change(momenta(PROTOTYPE, flight(h, smooth=True))[1]) for h in (2e-3, 1e-3))
    assert coarse < 1e-3
    assert 3.5 < coarse / fine < 4.5


def test_angular_momentum_is_kept_with_corners_by_a_tolerance() -> None:
    _, angular = momenta(PROTOTYPE, flight(None))
    assert change(angular) < 1e-6
