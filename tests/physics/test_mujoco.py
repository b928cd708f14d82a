"""Motions of this program against those of MuJoCo, built and solved independently."""

from dataclasses import replace

import numpy as np
import pytest

from generator.recording import Ending
from generator.rotations import matrix_from_rotation_vector, rotation_vector_from_matrix
from generator.simulation.run import simulate
from springs import damping_torque, elastic_torque, total_torque
from tests.mujoco_cases import CASES, LINEAR, OWN_LAW, STEP, TOLERANCE, TURNING_OVER, Case, compare
from tests.mujoco_twin import Twin, angles_between, joint_errors, mujoco

pytestmark = pytest.mark.verify

AGREEMENT = 1e-4
"""Largest joint-angle difference allowed [rad], of runs with a tolerance of TOLERANCE."""


REPEATED = {
    "linear springs: bent",
    "linear springs: standing, tilted",
    "linear springs: standing, tilted, damped, pelvis loose",
    "own law: stride",
}
"""Cases that test nothing beyond the others; the table of results has them as well."""


@pytest.mark.parametrize("name", sorted(CASES.keys() - REPEATED))
def test_falls_agree_with_mujoco(name: str) -> None:
    comparison = compare(CASES[name], TOLERANCE)
    assert comparison.recording.outcome.succeeded
    assert comparison.reference_error < 0.5 * AGREEMENT
    assert comparison.joints[-1] < AGREEMENT
    assert comparison.origins < AGREEMENT
    for kind, difference in comparison.energy.items():
        assert difference < 1e-5 * comparison.exchanged, kind


@pytest.mark.parametrize("name", ["standing, tilted", "free root, tumbling"])
def test_the_default_tolerance_is_held(name: str) -> None:
    comparison = compare(OWN_LAW[name], tolerance=1e-3)
    assert comparison.reference_error < 0.5e-3
    assert comparison.joints[-1] < 1e-3


def test_the_comparison_sees_a_thousandth_of_gravity() -> None:
    case = LINEAR["standing, tilted"]
    heavier = replace(case.plan(), gravity=(0.0, -9.81 * 1.001, 0.0))
    errors = joint_errors(case.twin().fall(case.stop, STEP), simulate(case.figure, heavier))
    assert errors[-1] > AGREEMENT


def test_both_engines_take_the_same_shoulder_through_a_half_turn() -> None:
    case = TURNING_OVER
    outcome = simulate(case.figure, case.plan(tolerance=1e-3)).outcome
    assert outcome.ending is Ending.TURNED_OVER
    assert outcome.joint == "left_shoulder"
    fall = case.twin().fall(case.stop, STEP)
    times, turns = fall.times, fall.joints["left_shoulder"]
    angle = angles_between(np.broadcast_to(np.eye(3), turns.shape), turns)
    near = np.abs(times - outcome.last_time) < 0.03
    assert np.max(angle[near]) > np.pi - 0.1
    assert np.max(angle[times < outcome.last_time - 0.1]) < np.pi - 0.1


@pytest.mark.parametrize("name", LINEAR)
def test_the_callback_does_what_mujocos_own_springs_do(name: str) -> None:
    case = LINEAR[name]
    own, called = (replace(case, native=native).twin().fall(0.2, STEP) for native in (True, False))
    for joint, turns in own.joints.items():
        assert np.max(angles_between(turns, called.joints[joint])) < 1e-12
    assert np.max(np.abs(own.potential - called.potential)) < 1e-10


@pytest.mark.parametrize("name", ["stride", "two bodies, child nearer to the root"])
def test_the_law_by_the_right_jacobian_is_that_in_the_half_way_frame(name: str) -> None:
    """Two derivations of the conservative torque, and two ways into MuJoCo's coordinates."""
    case = OWN_LAW[name]
    twin = case.twin()
    random = np.random.default_rng(5)
    for _ in range(20):
        data = mujoco.MjData(twin.model)
        data.qpos = random.uniform(-1.0, 1.0, twin.model.nq)
        data.qvel = random.uniform(-3.0, 3.0, twin.model.nv)
        mujoco.mj_normalizeQuat(twin.model, data.qpos)
        mujoco.mj_kinematics(twin.model, data)
        twin.law(twin.model, data)
        for joint in case.springs.joints:
            at = twin.model.joint(joint)
            v = int(at.dofadr[0])
            expected = _torque_by_the_half_way_frame(case, twin, data, joint)
            assert data.qfrc_passive[v : v + expected.size] == pytest.approx(expected, abs=1e-9)


def _torque_by_the_half_way_frame(case: Case, twin: Twin, data: object, name: str) -> np.ndarray:
    joint, axes = case.figure.joints[name], case.springs.joints[name].axes
    at = twin.model.joint(name)
    q, v = int(at.qposadr[0]), int(at.dofadr[0])
    if len(axes) == 1:
        sign = np.dot(axes[0].direction, joint.chain[0].axis)
        torque = total_torque(axes[0].elastic, sign * data.qpos[q])
        return np.atleast_1d(sign * (torque + axes[0].damping.torque(sign * data.qvel[v])))
    turns = twin.rotations(data)
    parent, child = (
        turns[ref.segment] @ case.figure.site(ref).pose_in_segment[:3, :3] for ref in joint.ends
    )
    r = rotation_vector_from_matrix(parent.T @ child)
    half = parent @ matrix_from_rotation_vector(0.5 * r)
    # MuJoCo hangs one of the two on the other, and has rate and torque in the axes of that one.
    hung = twin.model.body(at.bodyid[0]).name
    sign = 1.0 if hung == joint.child.segment else -1.0
    rate = sign * half.T @ turns[hung] @ data.qvel[v : v + 3]
    torque = elastic_torque(case.springs.joining, axes, r) + damping_torque(axes, r, rate)
    return sign * turns[hung].T @ half @ torque
