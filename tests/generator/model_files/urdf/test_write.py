"""Models in URDF: Pinocchio has our mass matrix. `test_export_model.py` has the motions."""

import numpy as np
import pytest

from generator.kinematics.placement import initial_displacements
from generator.kinematics.tree import build_tree
from springs import SpringSet
from tests.generator.model_files.engines import Pinocchio
from tests.generator.model_files.mass_matrix import mass_matrix
from tests.generator.model_files.model_cases import TREES

pytestmark = pytest.mark.verify


@pytest.mark.parametrize("name", TREES)
def test_the_mass_matrix_is_that_of_the_segments(name: str) -> None:
    of = TREES[name]
    loaded = Pinocchio(of, SpringSet())
    order, expected = mass_matrix(of, initial_displacements(build_tree(of)))
    mass = loaded.api.crba(loaded.model, loaded.data, loaded.q)
    mass = np.triu(mass) + np.triu(mass, 1).T
    places = [loaded.joint(joint, k).idx_v for joint, k in order]
    assert mass[np.ix_(places, places)] == pytest.approx(expected, rel=1e-9, abs=1e-12)
