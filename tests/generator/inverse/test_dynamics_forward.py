"""Forward again: under the moments of inverse dynamics the simulators make the motion.

Moments are equal and opposite local loads on the segments of each joint, and what is left over at
the root is a load on its segment.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

from generator import Model, Plan, build_tree, read_figure, simulate
from generator.conversion import read_motion_with_warnings
from generator.figure import Figure, SiteRef
from generator.inverse.dynamics import Motion, follow_curves, generalized_forces
from generator.inverse.external_loads import read_external_loads, wrenches_of_forces
from generator.inverse.smoothing import smooth_motion
from generator.kinematics.free_root import detach_root, free_joints
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import Tree
from generator.loads import LoadKind, TimedLoad
from generator.model_files.formats import read_model
from generator.rotations import Array
from generator.simulation.exudyn_model.agreement import ExudynEquations
from generator.simulation.exudyn_model.model import build_model
from springs import SpringSet
from tests.compiled_models import SettableModel
from tests.generator.inverse.walking import LOADS, MODEL, MOTION
from tests.poses import Pose, motion_matrix

GRAVITY = (0.3, -9.81, 0.2)


@dataclass(frozen=True)
class Case:
    """A motion of a figure, with the wrenches that are known beside its moments."""

    tree: Tree
    motion: Callable[[Array], Motion]
    wrenches: Callable[[Motion], dict[str, Array]]

    @property
    def figure(self) -> Figure:
        return self.tree.figure

    def loads(self, times: Array) -> list[TimedLoad]:
        """The loads that the motion needs, with a row at each time."""
        motion = self.motion(times)
        poses = self.tree.kinematics.poses(motion.values)
        wrenches = self.wrenches(motion)
        needed = generalized_forces(self.tree, motion, wrenches, GRAVITY)
        found = list(self._joint_loads(motion, poses, needed))
        for name, wrench in wrenches.items():
            site = SiteRef(name, next(iter(self.figure.segments[name].sites)))
            found += self._at_site(site, motion.times, poses[name], wrench)
        return found

    def _joint_loads(
        self, motion: Motion, poses: dict[str, Array], needed: Array
    ) -> Iterator[TimedLoad]:
        twists = self.tree.kinematics.twists(motion.values)
        for branch in self.tree.joints:
            columns = self.tree.kinematics.columns[branch.joint.name]
            # The least wrench with the generalized forces of this joint, whose segments may have
            # other forces along what the joint holds: its constraints add them.
            inverse = np.linalg.pinv(twists[:, columns])
            wrench = (inverse @ needed[:, columns, None])[..., 0]
            ends = branch.joint.child, branch.joint.parent
            outer, inner = ends if branch.parent_is_inboard else ends[::-1]
            for ref, sign in ((outer, 1.0), (inner, -1.0)):
                if ref.segment not in self.figure.ground:
                    pose = poses[ref.segment]
                    yield from self._at_site(ref, motion.times, pose, sign * wrench)

    def _at_site(
        self, ref: SiteRef, times: Array, pose: Array, wrench: Array
    ) -> Iterator[TimedLoad]:
        """Yield the local force and moment at a site of a wrench about the world's origin."""
        point = (pose @ self.figure.site(ref).pose_in_segment)[:, :3, 3]
        moment = wrench[:, :3] - np.cross(point, wrench[:, 3:])
        parts = ((LoadKind.LOCAL_FORCE, wrench[:, 3:]), (LoadKind.LOCAL_MOMENT, moment))
        for kind, values in parts:
            local = np.einsum("nji,nj->ni", pose[:, :3, :3], values)
            yield TimedLoad(ref, kind, times.tolist(), local.tolist())

    def plan(self, times: Array) -> Plan:
        """A run from the motion at the first time, with loads that have a row at each time."""
        motion, columns = self.motion(times[:1]), self.tree.kinematics.columns
        displacements, velocities = (
            {name: part[0, columns[name]].tolist() for name in columns}
            for part in (motion.values, motion.rates)
        )
        placed = forward_kinematics(self.tree, {n: np.array(x) for n, x in displacements.items()})
        bodies = dict(zip(self.figure.bodies, motion_matrix(placed) @ motion.rates[0], strict=True))
        for name, joint in free_joints(self.figure).items():
            velocities[name] = bodies[joint.child.segment].tolist()
        return Plan(
            start=float(times[0]),
            stop=float(times[-1]),
            frame=0.01,
            tolerance=1e-5,
            gravity=GRAVITY,
            displacements=displacements,
            velocities=velocities,
            loads=self.loads(times),
        )


@cache
def walk() -> Case:
    model = read_model(MODEL)
    figure = model.figure
    motion, _ = read_motion_with_warnings(MOTION, figure, model.coordinates)
    tree = motion.tree
    forces, _ = read_external_loads(LOADS, figure)

    def wrenches(of: Motion) -> dict[str, Array]:
        return wrenches_of_forces(forces, of.times, tree.kinematics.poses(of.values), figure)

    def smooth(times: Array) -> Motion:
        return follow_curves(tree, smooth_motion(tree, motion, 6.0, times))

    return Case(tree, smooth, wrenches)


@cache
def person() -> Case:
    """A random smooth motion of a free person."""
    shipped = read_figure("male50")
    freed, start = detach_root(shipped, initial_displacements(build_tree(shipped)))
    tree = build_tree(freed)
    kinematics, rng = tree.kinematics, np.random.default_rng(5)
    middle = kinematics.displacement_vector(start)
    sizes = 0.3 * rng.uniform(-1.0, 1.0, (3, kinematics.size))
    speeds, phases = rng.uniform(2.0, 9.0, sizes.shape), rng.uniform(0.0, 6.0, sizes.shape)

    def motion(times: Array) -> Motion:
        angles = times[:, None, None] * speeds + phases
        waves = np.sin(angles), speeds * np.cos(angles), -(speeds**2) * np.sin(angles)
        values, rates, accelerations = ((sizes * wave).sum(axis=1) for wave in waves)
        return Motion(times, middle + values, rates, accelerations)

    return Case(tree, motion, lambda _: {})


CASES = pytest.mark.parametrize("make", [walk, person])


def body_accelerations(pose: Pose, accelerations: Array) -> Array:
    """Accelerations of the bodies by kinematics, shape (B, 6): J a + dJ/dt v.

    The rate of J is its central difference along the rates, of fourth order.
    """
    step = 4e-4

    def moved(times: float) -> Array:
        return motion_matrix(pose.shifted(times * step)) @ pose.rates

    bend = (8.0 * (moved(1.0) - moved(-1.0)) - moved(2.0) + moved(-2.0)) / (12.0 * step)
    return motion_matrix(pose.placement) @ accelerations + bend


@CASES
def test_accelerations_are_those_of_the_motion(make: Callable[[], Case]):
    case = make()
    for time in (0.71, 1.03, 1.318):
        times = np.array([time, time + 1e-3])
        model = build_model(Model(case.figure, SpringSet()), case.plan(times))
        motion = case.motion(times)
        columns = case.tree.kinematics.columns
        placement = forward_kinematics(
            model.placement.tree, {name: motion.values[0, columns[name]] for name in columns}
        )
        pose = Pose(model, placement, motion.rates[0], time)
        expected = body_accelerations(pose, motion.accelerations[0])
        assert np.abs(expected).max() > 20.0
        for found in (
            SettableModel.of(model).accelerations(pose),
            ExudynEquations(model).accelerations(pose.state),
        ):
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9)


@pytest.mark.slow
@CASES
def test_a_run_under_the_moments_follows_the_motion(make: Callable[[], Case]):
    """The body follows, though nothing but the loads moves it."""
    case, start = make(), 0.8
    times = start + np.linspace(0.0, 0.1, 201)
    run = simulate(Model(case.figure, SpringSet()), case.plan(times))
    expected = case.motion(run.times).values
    found = case.tree.kinematics.displacement_vector(run.displacements)
    assert np.ptp(expected, axis=0).max() > 0.2
    assert np.abs(found - expected).max() < 1e-4
