"""Segments that touch each other: the forces for arrays, their Jacobian, and the model's."""

from dataclasses import replace

import numpy as np
import pytest

from generator.contact.self_contact import LIMB_SURFACE
from generator.run_options import Integrator
from generator.simulation.exudyn_model.contacts import _rotations, _SelfContact, _UserFunctions
from generator.simulation.exudyn_model.model import build_model
from generator.simulation.live.stepper import Stepper
from generator.simulation.run import simulate
from tests.compiled_models import SettableModel
from tests.runs import energy_error
from tests.self_contact_poses import PLAN, PROTOTYPE, contact_in, poses, settable, table


def test_random_poses_have_pairs_that_touch_and_pairs_that_do_not():
    depths = np.concatenate([contact_in(pose).depths[0] for pose in poses()])
    assert 0.02 < np.mean(depths > 0.0) < 0.9


def test_segments_that_touch_accelerate_otherwise():
    without = SettableModel.of(build_model(PROTOTYPE, replace(PLAN, self_contact=False)))
    for pose in poses(3):
        assert np.any(contact_in(pose).depths > 0.0)
        touching = settable()[0].accelerations(pose)
        free = without.accelerations(replace(pose, model=without.model))
        assert np.max(np.abs(touching - free)) > 1.0


def test_the_forces_of_a_figure_on_itself_add_up_to_nothing():
    for pose in poses():
        wrenches, places = contact_in(pose).wrenches[0], pose.state.positions
        scale = np.max(np.abs(wrenches)) + 1.0
        assert wrenches[:, :3].sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-11 * scale)
        moments = wrenches[:, 3:] + np.cross(places, wrenches[:, :3])
        assert moments.sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-9 * scale)


def test_the_power_of_the_wrenches_is_taken_from_the_energies():
    """Elastic energy, by its change in a short time, damping and friction."""
    step = 1e-7
    for pose in poses():
        state, contact = pose.state, contact_in(pose)
        motions = np.concatenate([state.velocities, state.angular_velocities], axis=1)
        power = float(np.sum(contact.wrenches[0] * motions))
        before, after = (
            float(contact_in(replace(pose, placement=pose.shifted(s))).energy[0])
            for s in (-step, step)
        )
        losses = float(contact.impact_power[0] + contact.friction_power[0])
        expected = -(after - before) / (2.0 * step) - losses
        assert power == pytest.approx(expected, rel=1e-4, abs=1e-3)


def test_pairs_that_are_not_near_do_not_touch():
    for pose in poses():
        state, everything = pose.state, contact_in(pose)
        near = table().near(state.positions, _rotations(state.parameters))
        assert len(near.reach) < len(table().reach)
        assert np.array_equal(contact_in(pose, near).wrenches, everything.wrenches)


def test_the_jacobian_is_the_derivative_of_the_forces():
    """By differences of another length, in random directions."""
    model = settable()[0].model
    nodes = [model.mbs.GetObject(model.bodies[name])["nodeNumber"] for name in model.figure.bodies]
    reference = np.concatenate([model.mbs.GetNode(n)["referenceCoordinates"] for n in nodes])
    functions = _UserFunctions(_SelfContact(table()), reference)
    rng = np.random.default_rng(0)
    for pose in poses(4):
        state = pose.state
        q = np.concatenate([state.positions, state.parameters], axis=1).ravel() - reference
        q_t = rng.normal(size=q.size)
        for factors in ((1.0, 0.0), (0.0, 1.0), (0.7, 0.3)):
            matrix = functions.jacobian(None, 0.0, 0, q, q_t, *factors)
            rows = np.asarray(matrix.Convert2DenseMatrix())
            direction, step = rng.normal(size=q.size), 1e-5
            ends = [
                functions.forces(
                    None,
                    0.0,
                    0,
                    q + sign * step * factors[0] * direction,
                    q_t + sign * step * factors[1] * direction,
                )
                for sign in (1.0, -1.0)
            ]
            expected = -(ends[0] - ends[1]) / (2.0 * step)
            scale = np.max(np.abs(expected)) + 1.0
            assert rows @ direction == pytest.approx(expected, abs=1e-3 * scale)


@pytest.mark.slow
def test_both_integrators_bring_the_legs_together():
    """Compiled, and Exudyn's own with the object's Jacobian."""
    plan = replace(
        PLAN,
        stop=0.06,
        gravity=(0.0, 0.0, 0.0),
        velocities=dict.fromkeys(("left_hip_joint", "right_hip_joint"), (0.0, -4.0, 0.0)),
        tolerance=1e-4,
    )
    runs = [simulate(PROTOTYPE, replace(plan, integrator=one)) for one in BOTH]
    compiled, exudyn = runs
    assert compiled.agreement_with_exudyn is not None
    assert compiled.agreement_with_exudyn < 1e-8
    assert compiled.energy["contact damping"][-1] > 1.0
    for run in runs:
        assert run.outcome.succeeded
        assert energy_error(run) < 1e-3
    for name, values in compiled.displacements.items():
        assert exudyn.displacements[name] == pytest.approx(values, abs=2e-4)


def test_a_stepper_brings_the_legs_together():
    """An overlap at the start does not count later, when the model is built anew."""
    plan = replace(
        PLAN,
        stop=0.1,
        gravity=(0.0, 0.0, 0.0),
        velocities=dict.fromkeys(("left_hip_joint", "right_hip_joint"), (0.0, -4.0, 0.0)),
        tolerance=1e-6,
    )
    run, stepper = simulate(PROTOTYPE, plan), Stepper(PROTOTYPE, plan)
    for duration in (0.02, 0.08):
        assert stepper.advance(duration).succeeded
        assert stepper.agreement_with_exudyn() < 1e-10
    assert stepper.energy["contact damping"] > 1.0
    for name, rows in run.displacements.items():
        assert stepper.displacements[name] == pytest.approx(rows[-1], abs=1e-4)


BOTH = (Integrator.COMPILED, Integrator.EXUDYN)


def test_the_joints_bear_what_the_legs_exchange():
    """The reactions of the hips balance the forces on the thighs and shanks."""
    plan = replace(
        PLAN,
        stop=0.04,
        gravity=(0.0, 0.0, 0.0),
        velocities=dict.fromkeys(("left_hip_joint", "right_hip_joint"), (0.0, -4.0, 0.0)),
    )
    runs = [simulate(PROTOTYPE, replace(plan, integrator=one)) for one in BOTH]
    for name, reaction in runs[0].reactions.items():
        scale = max(1.0, float(np.max(np.abs(reaction))))
        assert runs[1].reactions[name] == pytest.approx(reaction, abs=2e-2 * scale)


def test_the_surface_is_that_of_limbs():
    pose = poses(1)[0]
    contact = contact_in(pose)
    assert contact.energy[0] == pytest.approx(np.sum(LIMB_SURFACE.energy(contact.depths[0])))
