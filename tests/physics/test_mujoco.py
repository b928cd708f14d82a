"""Falls that `test_engines.py` does not have, in MuJoCo: a free root, oblique axes, velocities."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks import cases
from benchmarks.engines.exudyn_engine import fall as our_fall
from benchmarks.engines.exudyn_engine import radial_springs
from benchmarks.outside import Fall
from benchmarks.passive_law import CurveLaw, RadialLaw, rotation_vectors
from benchmarks.tree import TreeModel, between, tree_model
from generator.figure import Figure
from generator.figure_file import read_figure
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.recording import Ending
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import AxisSpring, Cubic, Damping, JointSprings, SpringSet
from tests.chains import ACROSS, SKEW, chain, row, two_bodies

pytestmark = pytest.mark.verify
mujoco_engine = pytest.importorskip("benchmarks.engines.mujoco_engine")

AGREEMENT = 1e-4
"""Largest difference allowed of joint angles [rad] and of the centre of mass [m], of runs with a
tolerance of 2e-5 rad."""

PROTOTYPE = read_figure("prototype")
BENT = {name: tuple(np.radians(angles)) for name, angles in cases.BENT.items()}


@dataclass(frozen=True)
class Case:
    """A fall: the plan of the run, and the tree with its law in MuJoCo.

    Attributes:
        figure: what falls.
        plan: the run.
        tree: the same for MuJoCo.
        law: of its joints, by MuJoCo's callback or, a radial one, by its own springs.
    """

    figure: Figure
    plan: Plan
    tree: TreeModel
    law: CurveLaw | RadialLaw

    def fall(self, step: float) -> Fall:
        native = self.law if isinstance(self.law, RadialLaw) else None
        law = None if native else self.law
        return mujoco_engine.MuJoCo(self.tree, native).fall(self.plan.stop, step, law=law)


class DampedAxes(CurveLaw):
    """Viscous and Coulomb friction about each axis of the balls, turned half way to the tip."""

    friction = ((0.03, 0.0), (0.01, 0.05), (0.08, 0.0))
    slip = 0.5

    def torques(self, quaternions, angles, spins, rates):
        balls, hinges = super().torques(quaternions, angles, spins, rates)
        half = Rotation.from_rotvec(0.5 * rotation_vectors(quaternions)[0])
        rate = np.einsum("bij,bj->bi", self._axes, half.apply(spins))
        viscous, coulomb = np.transpose(self.friction)
        friction = -viscous * rate - coulomb * np.tanh(rate / self.slip)
        return balls + half.inv().apply(np.einsum("bi,bij->bj", friction, self._axes)), hinges


def tumbling() -> Case:
    """The prototype, bent and let go: its pelvis spins about the joint that it had."""
    spin = np.array([1.0, 2.0, -0.7])
    rates = {"left_knee": (1.7,), "right_shoulder": (0.9, -1.4, 1.0)}
    placed = forward_kinematics(
        build_tree(PROTOTYPE), initial_displacements(build_tree(PROTOTYPE)) | BENT
    )
    pose = placed.poses["lower_torso"]
    site = PROTOTYPE.site(PROTOTYPE.joints["root_torso"].child).pose_in_segment[:3, 3]
    arm = PROTOTYPE.segments["lower_torso"].centre_of_mass - site
    moving = np.cross(spin, pose[:3, :3] @ arm)
    plan = Plan(
        stop=0.3,
        tolerance=2e-5,
        displacements=BENT,
        velocities={**rates, "lower_torso": (*spin, *moving)},
        free_root=True,
    )
    tree = tree_model(PROTOTYPE, BENT, {**rates, "root_torso": spin}, free_root=True)
    law = CurveLaw.from_file(tree, PROTOTYPE, "prototype.springs.toml")
    return Case(PROTOTYPE, plan, tree, law)


def oblique(*, reverse: bool, velocities=()) -> Case:
    """Two bodies whose springs are about axes that are along none of the coordinates."""
    figure = two_bodies(chain("Rs Ra Rs"), (0.5, -0.3, 0.4), reverse=reverse)
    third = tuple(float(part) for part in np.cross(SKEW, ACROSS))
    curves = (
        (SKEW, Cubic((0.5, 9.0, -1.0, 6.0), -1, (-0.2, 0.3))),
        (ACROSS, Cubic((0.2, 4.0, 3.0, 8.0))),
        (third, Cubic((-2.4, 12.0, 0.0, 0.0), -1)),
    )
    axes = tuple(
        AxisSpring(axis, (curve,), Damping(*friction, DampedAxes.slip))
        for (axis, curve), friction in zip(curves, DampedAxes.friction, strict=True)
    )
    springs = SpringSet({name: JointSprings(name, axes) for name in ("ball", "tested")})
    numbers = [
        {
            "joints": ["ball", "tested"],
            "axis": axis,
            "coefficients_Nm_rad": curve.coefficients,
            "sense": curve.sense,
            "viscous_Nms_rad": 0.0,
            "coulomb_Nm": 0.0,
        }
        | ({"dead_zone_deg": np.degrees(curve.dead_zone)} if curve.dead_zone else {})
        for axis, curve in curves
    ]
    tree = tree_model(figure, None, dict(velocities))
    plan = Plan(stop=0.5, tolerance=2e-5, springs=springs, velocities=dict(velocities))
    return Case(figure, plan, tree, DampedAxes(tree, figure, numbers))


def spun_row() -> Case:
    """Five bars on balls with linear springs, MuJoCo's own, the middle one spun."""
    figure, law, spun = row(5), RadialLaw(3.0, 0.0, 0.02), {"joint2": (1.4, 0.9, -1.6)}
    plan = Plan(tolerance=2e-5, springs=radial_springs(figure, law), velocities=spun)
    return Case(figure, plan, tree_model(figure, None, spun), law)


CASES = {
    "free root, tumbling": tumbling,
    "oblique axes": lambda: oblique(reverse=False),
    "child nearer to the root": lambda: oblique(
        reverse=True, velocities={"tested": (1.7, -1.0, 1.4)}
    ),
    "spun row": spun_row,
}


@pytest.mark.parametrize("name", CASES)
def test_falls_agree_with_mujoco(name: str) -> None:
    case = CASES[name]()
    made, recording = our_fall(case.figure, case.plan)
    coarse, fine = case.fall(1e-3), case.fall(5e-4)
    assert between(coarse.rotations, fine.rotations).max() < 0.5 * AGREEMENT
    # A free root is recorded by its segment, in the world.
    turns = {n: turns for n, turns in made.rotations.items() if n in case.figure.joints}
    assert between(fine.rotations, turns).max() < AGREEMENT
    for link in case.tree.links:
        if link.is_free:
            found = recording.poses[link.name][:, :3, :3] @ link.in_tip[:3, :3]
            assert between({"": fine.rotations[link.joint]}, {"": found}).max() < AGREEMENT
    assert np.max(np.linalg.norm(made.centre - fine.centre, axis=1)) < AGREEMENT
    exchanged = max(np.max(recording.energy["kinetic"]), -np.min(made.energy - made.energy[0]))
    change = (made.energy - made.energy[0]) - (fine.energy - fine.energy[0])
    assert np.max(np.abs(change)) < 1e-5 * exchanged


def test_both_engines_take_the_same_joint_through_a_half_turn() -> None:
    figure, law, spun = row(2), RadialLaw(0.1, 0.0, 0.0), {"joint1": (0.0, 25.0, 0.0)}
    plan = Plan(springs=radial_springs(figure, law), velocities=spun)
    outcome = simulate(figure, plan).outcome
    assert outcome.ending is Ending.TURNED_OVER
    engine = mujoco_engine.MuJoCo(tree_model(figure, None, spun), law)
    turns = engine.fall(1.0, 5e-4).rotations[outcome.joint]
    times, angle = np.linspace(0.0, 1.0, len(turns)), Rotation.from_matrix(turns).magnitude()
    assert np.max(angle[np.abs(times - outcome.last_time) < 0.03]) > np.pi - 0.1
    assert np.max(angle[times < outcome.last_time - 0.1]) < np.pi - 0.1
