"""Quaternions and axes of orientations without jumps, and the axes of bones along their limbs."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from generator.motion_files.skeleton import (
    build_skeleton,
    continuous_quaternions,
)
from tests.chains import BALL, at, body, figure, ground, joint
from tests.motions import shipped, standing

angle = st.floats(-20.0, 20.0, allow_nan=False)
walks = st.integers(1, 12).flatmap(lambda n: arrays(float, (n, 3), elements=angle))


@settings(max_examples=50)
@given(walks)
def test_a_quaternion_is_its_matrix(vectors: np.ndarray):
    matrices = Rotation.from_rotvec(vectors).as_matrix()
    quaternions = continuous_quaternions(matrices)
    assert np.allclose(np.linalg.norm(quaternions, axis=1), 1.0)
    assert np.allclose(Rotation.from_quat(quaternions).as_matrix(), matrices, atol=1e-9)


@settings(max_examples=50)
@given(walks)
def test_neighbours_are_on_the_same_side(vectors: np.ndarray):
    quaternions = continuous_quaternions(Rotation.from_rotvec(vectors).as_matrix())
    assert quaternions[0, 3] >= 0.0
    assert np.all(np.sum(quaternions[1:] * quaternions[:-1], axis=1) >= 0.0)


def test_three_turns_in_small_steps_never_jump():
    angles = np.linspace(0.0, 6.0 * np.pi, 200)
    axis = np.array([0.6, 0.0, 0.8])
    quaternions = continuous_quaternions(Rotation.from_rotvec(angles[:, None] * axis).as_matrix())
    steps = np.linalg.norm(np.diff(quaternions, axis=0), axis=1)
    assert np.allclose(steps, 2.0 * np.sin(angles[1] / 4.0), atol=1e-9)
    # After one turn the sign is the other one: that is what continuity costs.
    assert np.allclose(quaternions[-1], [0.0, 0.0, 0.0, -1.0], atol=1e-9)


def test_the_bones_of_a_human_figure_point_along_its_limbs():
    made = shipped("clavicles")
    skeleton = build_skeleton(standing(made))
    axes = skeleton.limb_axes(made)
    mirror = np.diag([-1.0, 1.0, 1.0])
    for name, columns in axes.items():
        assert np.allclose(columns.T @ columns, np.eye(3), atol=1e-12)
        assert np.linalg.det(columns) > 0.0
        if name.startswith("left"):
            other = axes[name.replace("left", "right")]
            assert np.allclose(mirror @ columns[:, 1:], other[:, 1:], atol=1e-9)
    down, front = [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]
    for name in ("left_upper_arm", "left_lower_arm", "right_upper_leg", "right_lower_leg"):
        assert np.allclose(axes[name][:, 1], down, atol=1e-6)
        assert np.allclose(axes[name][:, 2], front, atol=1e-6)
    centres = {bone.segment: bone.centre for bone in skeleton.bones}
    along = centres["left_upper_arm"] - centres["left_clavicle"]
    assert np.allclose(axes["left_clavicle"][:, 1], along / np.linalg.norm(along))


def test_a_bone_to_the_front_has_z_up_and_one_without_a_length_is_upright():
    made = figure(
        [
            ground(),
            body("foot", sites={"toe": at(shift=(0.01, 0.0, 0.3))}),
            body("dot", centre=(0.0, 0.0, 0.0)),
        ],
        [
            joint("ankle", "ground.base", "foot.near", BALL),
            joint("pin", "ground.base", "dot.near", BALL),
        ],
    )
    axes = build_skeleton(standing(made)).limb_axes(made)
    assert axes["foot"][2, 1] > 0.99
    assert axes["foot"][1, 2] > 0.99
    assert np.allclose(axes["dot"], np.eye(3))
