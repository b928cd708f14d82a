"""The torque that Exudyn applies, read out at rest, and its work round a closed loop."""

import numpy as np
import pytest

from generator.model import Model
from generator.rotations import cross_matrix, matrix_from_rotation_vector
from generator.simulation.exudyn_model.exudyn_api import exu, rigid
from generator.simulation.exudyn_model.model import build_model
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


class Rig:
    """One ball joint in Exudyn, put into any orientation; the torque of its connector."""

    def __init__(self, law: SphericalLaw) -> None:
        figure = one_body(BALL, segment=body("link", centre=(0.0, 0.0, 0.0)))
        self.assembly = build_model(Model(figure, springs(law)), Plan())
        (connector,) = self.assembly.springs["pin"]
        self._item = connector.item

    def torque(self, r: np.ndarray) -> np.ndarray:
        """On the child, in the half-way frame [N m]."""
        mbs = self.assembly.mbs
        parameters = np.asarray(
            rigid.RotationMatrix2EulerParameters(matrix_from_rotation_vector(r))
        )
        moved = np.concatenate([np.zeros(3), parameters - [1.0, 0.0, 0.0, 0.0]])
        mbs.systemData.SetODE2Coordinates(moved)
        return -np.asarray(mbs.GetObjectOutput(self._item, exu.OutputVariableType.TorqueLocal))


def half_way_rate(r: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Angular velocity in the half-way frame for a rate of the rotation vector."""
    a = float(np.linalg.norm(r))
    k = cross_matrix(r / a)
    left = np.eye(3) + (1 - np.cos(a)) / a * k + (1 - np.sin(a) / a) * k @ k
    return matrix_from_rotation_vector(-0.5 * r) @ left @ rate


def loop_work(law: SphericalLaw, count: int = 200) -> float:
    """Work of the torque once round a closed, smooth loop of orientations [J].

    The rectangle rule converges faster than any power on a smooth loop.
    """
    rig = Rig(law)
    centre, one, other = (
        np.array([0.5, 0.3, 0.6]),
        np.array([0.3, 0.2, 0.0]),
        np.array([0, -0.2, 0.4]),
    )
    work = 0.0
    for s in 2.0 * np.pi * np.arange(count) / count:
        r = centre + one * np.cos(s) + other * np.sin(s)
        rate = -one * np.sin(s) + other * np.cos(s)
        work += rig.torque(r) @ half_way_rate(r, rate) * 2.0 * np.pi / count
    return float(work)


def test_the_conservative_law_does_no_work_on_a_closed_loop() -> None:
    assert abs(loop_work(SphericalLaw.CONSERVATIVE)) < 1e-10


def test_the_weighted_law_does() -> None:
    coarse, fine = (loop_work(SphericalLaw.WEIGHTED, count) for count in (400, 800))
    assert abs(fine) > 0.01
    assert coarse == pytest.approx(fine, rel=1e-2)


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
