"""The motion of a figure does not depend on the order of its file."""

from dataclasses import replace
from random import Random

import numpy as np
import pytest

from generator import read_figure
from generator.rotations import rotation_vector_from_matrix
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from tests.chains import BALL, chain, row

BENT = {"left_hip_joint": (0.1, 0.2, 0.5), "left_knee": (0.6,), "right_elbow": (0.4,)}


def shuffled(figure, seed):
    """The same figure with segments and joints in another order."""
    random = Random(seed)

    def mixed(items):
        names = list(items)
        random.shuffle(names)
        return {name: items[name] for name in names}

    return replace(figure, segments=mixed(figure.segments), joints=mixed(figure.joints))


@pytest.mark.parametrize(
    ("figure", "start"),
    [
        pytest.param(read_figure("prototype"), BENT, marks=pytest.mark.slow),
        (row(4, (BALL, chain("Ry")), stiff=5.0, damp=0.05), {}),
    ],
    ids=["prototype", "row"],
)
def test_the_order_of_segments_and_joints_does_not_matter(figure, start) -> None:
    """Beyond what Newton's method leaves undone, of which another order leaves another part."""
    other = shuffled(figure, 1)
    assert list(other.joints) != list(figure.joints)
    plan = Plan(stop=0.2, tolerance=1e-5, displacements=start)
    one, two = simulate(figure, plan), simulate(other, plan)
    assert one.outcome.succeeded
    assert one.accuracy.steps == two.accuracy.steps
    for name, poses in one.poses.items():
        turn = np.swapaxes(poses[:, :3, :3], -1, -2) @ two.poses[name][:, :3, :3]
        assert np.max(np.linalg.norm(rotation_vector_from_matrix(turn), axis=-1)) < 1e-8
        assert np.max(np.abs(poses[:, :3, 3] - two.poses[name][:, :3, 3])) < 1e-8
    for kind, energy in one.energy.items():
        assert two.energy[kind] == pytest.approx(energy, abs=1e-6)
