"""Balance of a figure in a pose: support from its lowest vertices, margin and tipping edge."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator import read_figure
from generator.diagnostics import InputError
from generator.geometry.appearance import segment_appearances
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.stability import LowFaces, stability
from generator.kinematics.tree import build_tree
from generator.rotations import Array, matrix_from_rotation_vector, pose_matrix
from generator.viewer.balance import BalanceModel, balance_text
from tests.chains import BALL, at, body, figure, ground, joint

PROTOTYPE = read_figure("prototype")


def standing_poses() -> Mapping[str, Array]:
    tree = build_tree(PROTOTYPE)
    return forward_kinematics(tree, initial_displacements(tree)).poses


POSES = standing_poses()


def prototype_model() -> BalanceModel:
    return BalanceModel(PROTOTYPE, segment_appearances(PROTOTYPE)[0])


MODEL = prototype_model()


def moved(turn: tuple[float, float, float], shift: tuple[float, float, float]) -> dict[str, Array]:
    """The standing prototype, turned about the origin of the world and moved."""
    pose = pose_matrix(matrix_from_rotation_vector(np.array(turn)), np.array(shift))
    return {name: pose @ each for name, each in POSES.items()}


def test_the_prototype_stands_on_its_soles_as_on_their_low_faces():
    state = MODEL.state(POSES)
    soles = LowFaces(PROTOTYPE, state.height + MODEL.support_height).points_in_pose(POSES)
    expected = stability(MODEL.masses.centre(POSES), soles.positions)
    assert state.is_balanced
    assert state.stability.margin == pytest.approx(expected.margin, rel=1e-12)
    assert state.stability.area == pytest.approx(expected.area, rel=1e-12)
    assert "inside" in balance_text(state)


@given(
    turn=st.floats(-3.0, 3.0),
    shift=st.tuples(*[st.floats(-2.0, 2.0)] * 3),
)
def test_a_turn_about_the_vertical_and_a_shift_change_height_and_place_only(
    turn: float, shift: tuple[float, float, float]
):
    here, there = MODEL.state(POSES), MODEL.state(moved((0.0, turn, 0.0), shift))
    assert there.stability.margin == pytest.approx(here.stability.margin, abs=1e-9)
    assert there.height == pytest.approx(here.height + shift[1], abs=1e-9)
    assert np.allclose(there.corners[:, 1], there.height)
    assert there.foot[[0, 2]] == pytest.approx(there.centre[[0, 2]])


def test_a_prototype_that_leans_tips_over_the_edge_of_its_toes():
    state = MODEL.state(moved((0.3, 0.0, 0.0), (0.0, 0.0, 0.0)))
    assert not state.is_balanced
    assert "outside" in balance_text(state)
    foremost = state.corners[:, 2].max()
    assert np.allclose(state.pivot[:, 2], foremost, atol=0.01)
    gap = state.centre[2] - foremost
    assert -state.stability.margin == pytest.approx(gap, abs=0.01)


def test_a_greater_height_of_the_support_adds_corners_only():
    model = prototype_model()
    leaning = moved((0.1, 0.0, 0.0), (0.0, 0.0, 0.0))
    areas: list[float] = []
    for height in (0.0, 0.005, 0.02, 0.1):
        model.support_height = height
        areas.append(model.state(leaning).stability.area)
    assert areas == sorted(areas)
    assert areas[-1] > areas[0]


def test_a_segment_without_a_psurf_stands_on_its_capsule():
    post = body("post", centre=(0.0, 0.5, 0.0), sites={"top": at(shift=(0.0, 1.0, 0.0))})
    made = figure([ground(), post], [joint("pin", "ground.base", "post.near", BALL)])
    model = BalanceModel(made, segment_appearances(made)[0])
    state = model.state({"ground": np.eye(4), "post": np.eye(4)})
    lowest = segment_appearances(made)[0]["post"].surface.vertices[:, 1].min()
    assert state.height == pytest.approx(lowest)
    assert state.is_balanced


def test_a_figure_without_masses_has_no_balance():
    made = figure(
        [ground(), replace(body("link"), mass=None, inertia=None)],
        [joint("pin", "ground.base", "link.near", BALL)],
    )
    with pytest.raises(InputError, match="has no mass"):
        BalanceModel(made, segment_appearances(made)[0])
