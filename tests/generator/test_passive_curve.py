"""Passive moment curves of the joints of a figure."""

from dataclasses import replace
from math import pi, radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator import read_figure
from generator.joint_chain import build_chain
from generator.passive_curve import (
    PassiveCurve,
    angle_about,
    initial_angles,
    joint_label,
    passive_curves,
    passive_torque,
)
from generator.rotations import matrix_from_rotation_vector, rotation_vector_from_matrix
from generator.springs_file.read import read_springs
from springs import SphericalLaw, conservative_energy

FIGURE = read_figure("prototype")
SPRINGS = read_springs(None, FIGURE)
COUPLED = read_springs("coupled", FIGURE)
CURVES = passive_curves(FIGURE, SPRINGS)
REST = initial_angles(FIGURE)


def curve_of(joint: str, motion: str, curves=None) -> PassiveCurve:
    return next(one for one in (curves or CURVES)[joint] if one.motion == motion)


def test_every_axis_with_a_law_has_a_curve():
    assert {name: len(curves) for name, curves in CURVES.items()} == {
        name: len(joint.axes) for name, joint in SPRINGS.joints.items()
    }
    for curves in CURVES.values():
        for one in curves:
            assert np.all(np.diff(one.angles) > 0.0)
            assert np.array_equal(one.moment_at(one.angles), one.torques)
            assert float(one.moment_at(0.3)) == pytest.approx(float(one.moment_at(np.array(0.3))))


def test_the_moment_and_what_holds_at_an_angle_in_sentences():
    knee = curve_of("left_knee", "flexion")
    inside = knee.describe(0.5)
    assert inside == ("0.0 N m at 28.6 deg", "In the dead zone, 0.0 to 89.0 deg")
    moment = float(knee.moment_at(2.6))
    first, beyond = knee.describe(2.6)
    assert first == f"{moment:.1f} N m at 149.0 deg (drives back)"
    assert beyond.startswith("Beyond the normal range: knee flexion ends at ")
    coupled = curve_of("left_knee", "flexion", passive_curves(FIGURE, COUPLED))
    _, extrapolated, *others = coupled.describe(radians(-5.0))
    assert extrapolated == "Extrapolated: the curve is known for 0.0 to 135.0 deg only"
    assert others[-1] == "A law over several joints, drawn with hip flexion at 0.0 deg"
    pendulum = read_figure("pendulum")
    (curve, *_), *_ = passive_curves(pendulum, read_springs(None, pendulum)).values()
    assert not curve.describe(0.3)[0].startswith("-0.0 ")


def test_a_hinge_counts_whole_turns_about_its_own_axis():
    knee = curve_of("left_knee", "flexion")
    angle = np.array([2.5 * pi])
    sign = float(np.dot(FIGURE.joints["left_knee"].chain[0].axis, knee.spring.direction))
    assert knee.component({"left_knee": angle}) == pytest.approx(sign * 2.5 * pi)
    frames = np.linspace(-1.0, 1.0, 5)[:, None]
    assert knee.component({"left_knee": frames}).shape == (5,)


VECTORS = st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(lambda v: np.array(v) * 0.9)


@given(VECTORS)
def test_the_angle_about_an_axis_is_the_component_of_the_rotation_vector(vector):
    chain = build_chain(FIGURE.joints["left_shoulder"].chain)
    pose = np.eye(4)
    pose[:3, :3] = matrix_from_rotation_vector(vector)
    displacements = chain.displacements(pose)
    for one in CURVES["left_shoulder"]:
        angle = angle_about(chain, SphericalLaw.CONSERVATIVE, one.spring.direction, displacements)
        assert angle == pytest.approx(float(vector @ one.spring.direction), abs=1e-9)


@given(VECTORS, VECTORS)
def test_the_torque_of_a_joint_in_a_pose_is_minus_the_slope_of_its_energy(vector, rate):
    chain = build_chain(FIGURE.joints["left_shoulder"].chain)
    axes = SPRINGS.joints["left_shoulder"].axes

    def turned(time: float) -> np.ndarray:
        """Rotation vector after a turn at the rate, in the half-way frame of the first pose."""
        half = matrix_from_rotation_vector(0.5 * vector)
        matrix = half @ matrix_from_rotation_vector(time * rate) @ half
        pose = np.eye(4)
        pose[:3, :3] = matrix
        return chain.displacements(pose)

    torque = passive_torque(FIGURE, SPRINGS, "left_shoulder", REST | {"left_shoulder": turned(0.0)})
    step = 1e-5

    def energy(time: float) -> float:
        matrix = chain.pose(turned(time))[:3, :3]
        return float(conservative_energy(axes, rotation_vector_from_matrix(matrix)))

    slope = (energy(step) - energy(-step)) / (2.0 * step)
    assert float(torque @ rate) == pytest.approx(-slope, abs=1e-3 * (1.0 + abs(slope)))


def test_a_turn_about_one_axis_has_the_torque_of_its_curve():
    for joint, curves in CURVES.items():
        chain = build_chain(FIGURE.joints[joint].chain)
        for one in curves:
            pose = np.eye(4)
            pose[:3, :3] = matrix_from_rotation_vector(0.7 * np.array(one.spring.direction))
            at = REST | {joint: chain.displacements(pose)}
            assert one.component(at) == pytest.approx(0.7)
            about = float(passive_torque(FIGURE, SPRINGS, joint, at) @ one.spring.direction)
            assert about == pytest.approx(float(one.moment_at(0.7)), abs=1e-6)


def test_a_coupled_law_is_taken_at_the_present_angles_of_the_others():
    bent = REST | {"left_hip_joint": hip_flexed(radians(60.0))}
    straight = curve_of("left_knee", "flexion", passive_curves(FIGURE, COUPLED))
    flexed = curve_of("left_knee", "flexion", passive_curves(FIGURE, COUPLED, bent))
    assert straight.held_angles == {"hip flexion": 0.0}
    assert flexed.held_angles["hip flexion"] == pytest.approx(radians(60.0))
    assert straight.valid_range == pytest.approx((0.0, radians(135.0)))
    coupled = next(one for one in COUPLED.coupled if one.axes[1].joint == "left_knee")
    for curve, hip in ((straight, 0.0), (flexed, radians(60.0))):
        expected = float(coupled.law.torques([hip, 0.4])[1])
        assert float(curve.moment_at(0.4)) == pytest.approx(expected)
    at = bent | {"left_knee": np.array([0.4 * sign_of("left_knee")])}
    torque = passive_torque(FIGURE, COUPLED, "left_knee", at) @ flexed.spring.direction
    assert float(torque) == pytest.approx(float(flexed.moment_at(0.4)))


@given(VECTORS, VECTORS)
def test_the_torque_of_a_coupled_joint_is_minus_the_slope_of_its_energy(vector, rate):
    chain = build_chain(FIGURE.joints["left_hip_joint"].chain)
    axes = COUPLED.joints["left_hip_joint"].axes
    (coupled,) = (one for one in COUPLED.coupled if one.axes[0].joint == "left_hip_joint")
    knee = 0.6

    def turned(time: float) -> np.ndarray:
        half = matrix_from_rotation_vector(0.5 * vector)
        return half @ matrix_from_rotation_vector(time * rate) @ half

    def energy(time: float) -> float:
        at = rotation_vector_from_matrix(turned(time))
        shared = coupled.law.energy([float(at @ coupled.axes[0].direction), knee])
        return float(conservative_energy(axes, at)) + float(shared)

    pose = np.eye(4)
    pose[:3, :3] = turned(0.0)
    knee_at = np.array([knee * sign_of("left_knee")])
    at = REST | {"left_hip_joint": chain.displacements(pose), "left_knee": knee_at}
    torque = passive_torque(FIGURE, COUPLED, "left_hip_joint", at)
    step = 1e-5
    slope = (energy(step) - energy(-step)) / (2.0 * step)
    assert float(torque @ rate) == pytest.approx(-slope, abs=1e-3 * (1.0 + abs(slope)))


def test_a_coupled_law_about_the_opposite_axis_is_the_same_curve():
    (knee,) = COUPLED.joints["left_knee"].axes
    turned = replace(COUPLED.joints["left_knee"], axes=(knee.with_opposite_axis(),))
    opposite = replace(COUPLED, joints={**COUPLED.joints, "left_knee": turned})
    (one,) = passive_curves(FIGURE, COUPLED)["left_knee"]
    (other,) = passive_curves(FIGURE, opposite)["left_knee"]
    assert np.allclose(other.moment_at(-one.angles), -one.torques)


def sign_of(joint: str) -> float:
    axis = curve_of(joint, "flexion").spring.direction
    return float(np.dot(FIGURE.joints[joint].chain[0].axis, axis))


def hip_flexed(angle: float) -> np.ndarray:
    chain = build_chain(FIGURE.joints["left_hip_joint"].chain)
    direction = curve_of("left_hip_joint", "flexion").spring.direction
    pose = np.eye(4)
    pose[:3, :3] = matrix_from_rotation_vector(angle * np.array(direction))
    return chain.displacements(pose)


def test_an_axis_with_a_coupled_law_alone_has_a_curve():
    bare = replace(COUPLED, joints={})
    curves = passive_curves(FIGURE, bare)
    assert set(curves) == {"left_hip_joint", "left_knee", "right_hip_joint", "right_knee"}
    (knee,) = curves["left_knee"]
    assert knee.motion == "flexion"
    whole = curve_of("left_knee", "flexion", passive_curves(FIGURE, COUPLED))
    assert np.allclose(knee.moment_at(whole.angles), whole.torques)


def test_labels_of_joints_and_of_axes_without_a_motion():
    assert joint_label("left_hip_joint") == "Left hip"
    assert joint_label("joint") == "Joint"
    assert joint_label("_") == "_"
    bare = {
        name: replace(joint, axes=tuple(replace(axis, motion="") for axis in joint.axes))
        for name, joint in SPRINGS.joints.items()
    }
    curves = passive_curves(FIGURE, replace(SPRINGS, joints=bare))["left_shoulder"]
    assert {one.motion.removeprefix("about ").lstrip("-") for one in curves} == {"x", "y", "z"}


def test_a_curve_shows_itself_beside_published_ones():
    curve = curve_of("left_knee", "flexion")
    page = curve._repr_html_()
    assert page.count("<title>") == 1 + len(curve.published) > 3
    assert all(f"</span> {one.label}<br>" in page for one in curve.published)
    assert len(repr(curve)) <= 200


def test_the_summary_of_a_curve_has_its_known_range_and_the_torques_at_its_ends():
    leg = read_figure("leg")
    (curve,) = passive_curves(leg, read_springs(None, leg))["knee"]
    low, high = (float(curve.moment_at(radians(angle))) for angle in (0, 120))
    assert curve.summary() == ("knee", "flexion", "0 to 120", f"{low:.1f} and {high:.1f}", "0.331")
    assert low > 0.0 > high
