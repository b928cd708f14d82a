"""Models in URDF: Pinocchio has our mass matrix. `test_export_model.py` has the motions."""

import numpy as np
import pytest

from generator.kinematics.placement import (
    forward_kinematics,
    initial_displacements,
    segment_jacobians,
)
from generator.kinematics.tree import build_tree
from springs import SpringSet
from tests.generator.model_files.engines import Pinocchio
from tests.generator.model_files.model_cases import TREES

pytestmark = pytest.mark.verify


@pytest.mark.parametrize("name", TREES)
def test_the_mass_matrix_is_that_of_the_segments(name: str) -> None:
    of = TREES[name]
    loaded, tree = Pinocchio(of, SpringSet()), build_tree(of)
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
    mass = loaded.api.crba(loaded.model, loaded.data, loaded.q)
    mass = np.triu(mass) + np.triu(mass, 1).T
    order = [
        loaded.joint(branch.joint.name, number).idx_v
        for branch in tree.joints
        for number in range(len(branch.joint.chain))
    ]
    assert mass[np.ix_(order, order)] == pytest.approx(expected, rel=1e-9, abs=1e-12)
