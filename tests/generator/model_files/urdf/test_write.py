"""Models in URDF: Pinocchio reads them, and has our kinematics, mass matrix and motion."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

from generator.figure import Figure
from generator.kinematics.placement import (
    forward_kinematics,
    initial_displacements,
    segment_jacobians,
)
from generator.kinematics.tree import Tree, build_tree
from generator.model_files.urdf.write import format_urdf
from generator.rotations import Array
from springs import SpringSet
from tests.chains import SKEW
from tests.generator.model_files.model_cases import (
    AGREEMENT,
    FRAME,
    STOP,
    TREES,
    apart,
    hinge,
    on_a_rail,
    ours,
    slide,
    spring_set,
)

pinocchio = pytest.importorskip("pinocchio")

pytestmark = pytest.mark.verify

STEP = 1e-3

UPRIGHT = np.array([[0.0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0], [0, 0, 0, 1]])
"""From z up, x ahead to y up, z ahead."""


class Loaded:
    """A model as Pinocchio has read it."""

    def __init__(self, of: Figure, springs: SpringSet) -> None:
        text, self.losses = format_urdf(of, springs)
        self.figure = of
        self.model = pinocchio.buildModelFromXML(text)
        self.model.gravity.linear = np.array([0.0, 0.0, -9.81])
        self.data = self.model.createData()

    def joint(self, name: str, number: int) -> object:
        """The joint of one displacement, counted from 0."""
        single = len(self.figure.joints[name].chain) == 1
        own = name if single else f"{name}_{number + 1}"
        if own in self.figure.joints and not single:
            own += "_2"
        return self.model.joints[self.model.getJointId(own)]

    def positions(self, values: Mapping[str, Sequence[float]]) -> Array:
        q = pinocchio.neutral(self.model)
        for name, numbers in values.items():
            for number, value in enumerate(numbers):
                joint = self.joint(name, number)
                around = [np.cos(value), np.sin(value)] if joint.nq == 2 else [value]
                q[joint.idx_q : joint.idx_q + joint.nq] = around
        return q

    def poses(self, q: Array) -> dict[str, Array]:
        pinocchio.framesForwardKinematics(self.model, self.data, q)
        frames = {name: self.data.oMf[self.model.getFrameId(name)] for name in self.figure.bodies}
        return {name: UPRIGHT @ x.homogeneous for name, x in frames.items()}

    def order(self, tree: Tree) -> list[int]:
        """Place of each displacement of the tree's branches among the velocities."""
        return [
            self.joint(branch.joint.name, number).idx_v
            for branch in tree.joints
            for number in range(len(branch.joint.chain))
        ]

    def moved(self) -> dict[str, Array]:
        """The motion from the pose in which the figure is drawn, by RK4."""
        start = {name: one.displacement for name, one in self.figure.joints.items()}
        q, v = self.positions(start), np.zeros(self.model.nv)
        rows = [self.poses(q)]
        for _ in range(round(STOP / FRAME)):
            for _ in range(round(FRAME / STEP)):
                q, v = self._step(q, v)
            rows.append(self.poses(q))
        return {name: np.array([row[name] for row in rows]) for name in rows[0]}

    def _step(self, q: Array, v: Array) -> tuple[Array, Array]:
        h = STEP
        a1 = self._acceleration(q, v)
        v2 = v + 0.5 * h * a1
        a2 = self._acceleration(self._shifted(q, 0.5 * h * v), v2)
        v3 = v + 0.5 * h * a2
        a3 = self._acceleration(self._shifted(q, 0.5 * h * v2), v3)
        v4 = v + h * a3
        a4 = self._acceleration(self._shifted(q, h * v3), v4)
        rate = (v + 2.0 * v2 + 2.0 * v3 + v4) / 6.0
        return self._shifted(q, h * rate), v + h * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0

    def _shifted(self, q: Array, shift: Array) -> Array:
        return pinocchio.integrate(self.model, q, shift)

    def _acceleration(self, q: Array, v: Array) -> Array:
        return pinocchio.aba(self.model, self.data, q, v, -self.model.damping * v).copy()


def unloaded(of: Figure) -> Figure:
    """The figure without forces and moments at its sites."""
    none = dict.fromkeys(("global_force", "local_force", "global_moment", "local_moment"))
    bare = {
        name: replace(one, sites={n: replace(site, **none) for n, site in one.sites.items()})
        for name, one in of.segments.items()
    }
    return replace(of, segments=bare)


@pytest.mark.parametrize("name", TREES)
def test_joint_values_are_the_displacements(name: str) -> None:
    of = TREES[name]
    loaded, tree = Loaded(of, SpringSet()), build_tree(of)
    random = np.random.default_rng(3)
    assert loaded.model.nv == of.degrees_of_freedom
    for _ in range(5):
        values = {
            joint: random.uniform(-1.2, 1.2, len(one.chain)) for joint, one in of.joints.items()
        }
        expected = forward_kinematics(tree, values).poses
        for segment, pose in loaded.poses(loaded.positions(values)).items():
            assert pose == pytest.approx(expected[segment], abs=1e-12)


@pytest.mark.parametrize("name", TREES)
def test_the_mass_matrix_is_that_of_the_segments(name: str) -> None:
    of = TREES[name]
    loaded, tree = Loaded(of, SpringSet()), build_tree(of)
    placement = forward_kinematics(tree, initial_displacements(tree))
    expected = np.zeros((loaded.model.nv, loaded.model.nv))
    maps = segment_jacobians(placement)
    for segment in of.bodies.values():
        pose, motion = placement.poses[segment.name], maps[segment.name]
        turn = pose[:3, :3]
        centre = turn @ segment.centre_of_mass + pose[:3, 3]
        velocity = motion[3:] + np.cross(motion[:3], centre, axisa=0, axisc=0)
        inertia = turn @ np.diag(segment.inertia) @ turn.T
        expected += segment.mass * velocity.T @ velocity + motion[:3].T @ inertia @ motion[:3]
    q = loaded.positions(placement.displacements)
    mass = pinocchio.crba(loaded.model, loaded.data, q)
    mass = np.triu(mass) + np.triu(mass, 1).T
    order = loaded.order(tree)
    assert mass[np.ix_(order, order)] == pytest.approx(expected, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("name", TREES)
def test_figures_without_springs_fall_alike(name: str) -> None:
    of = unloaded(TREES[name])
    assert apart(Loaded(of, SpringSet()).moved(), ours(of, SpringSet()).poses) < AGREEMENT


def test_damped_hinges_and_slides_move_alike() -> None:
    of = on_a_rail()
    springs = spring_set(
        hinge("hinge", axis=(1.0, 0.0, 0.0), viscous=0.2), slide("rail", SKEW, viscous=3.0)
    )
    assert apart(Loaded(of, springs).moved(), ours(of, springs).poses) < AGREEMENT
