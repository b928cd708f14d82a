"""Models for MuJoCo: the torques of curves and of balls. `test_export_model.py` has the motions."""

import numpy as np
import pytest

from springs import AxisSpring, Damping, JointSprings, Linear
from tests.chains import ACROSS, SKEW, chain, two_bodies
from tests.generator.model_files.engines import MuJoCo, moved
from tests.generator.model_files.model_cases import (
    AGREEMENT,
    CURVES,
    START,
    apart,
    equal,
    hinge,
    on_a_rail,
    ours,
    slide,
    spring_set,
)

pytestmark = pytest.mark.verify


@pytest.mark.parametrize("name", CURVES)
def test_hinges_and_slides_have_the_torques_of_their_curves(name: str) -> None:
    of, laws = on_a_rail(), CURVES[name]
    springs = spring_set(hinge("hinge", *laws, axis=(-1.0, 0.0, 0.0)), slide("rail", SKEW, *laws))
    loaded = MuJoCo(of, springs)
    assert not loaded.losses.entries
    for value in np.linspace(-2.0, 2.0, 83):
        loaded.data.qpos[:] = value
        loaded.api.mj_forward(loaded.model, loaded.data)
        expected = sum(float(law.torque(value)) for law in laws)
        torques = loaded.data.qfrc_passive
        assert torques == pytest.approx([expected, expected], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("reverse", [False, True])
def test_equal_springs_of_a_ball_are_held(reverse: bool) -> None:
    of = two_bodies(chain("R-s Ra Rs"), START, reverse=reverse)
    third = tuple(float(part) for part in np.cross(SKEW, ACROSS))
    law, damping = (Linear(8.0),), Damping(0.05)
    axes = tuple(AxisSpring(axis, law, damping) for axis in (SKEW, ACROSS, third))
    springs = spring_set(JointSprings("tested", axes), equal(of, "ball", 5.0, 0.0))
    loaded = MuJoCo(of, springs)
    assert not loaded.losses.entries
    assert apart(moved(loaded), ours(of, springs).poses) < AGREEMENT
