"""Generalized forces of a motion."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator import Model, Plan, build_tree, read_figure, simulate
from generator.conversion import read_motion_with_warnings
from generator.diagnostics import ModelError
from generator.inverse.dynamics import (
    Motion,
    add_followers_forces,
    curve_columns,
    follow_curves,
    generalized_forces,
)
from generator.inverse.moments import joint_moments
from generator.inverse.smoothing import smooth_motion
from generator.kinematics.tree import Tree
from generator.model_files.formats import read_model
from generator.motion_files import motion_from_recording
from generator.rotations import Array
from generator.simulation.exudyn_model.model import build_model
from generator.simulation.statics.static_forces import StaticState
from tests.generator.inverse.walking import MODEL, MOTION

PROTOTYPE = read_figure("prototype")
TREE = build_tree(PROTOTYPE)
GRAVITY = np.array([0.3, -9.81, 1.0])
SIZE = TREE.kinematics.size
NUMBERS = st.lists(st.floats(-1.0, 1.0), min_size=SIZE, max_size=SIZE).map(np.array)


def forces_at(tree: Tree, q: Array, rates: Array, accelerations: Array, gravity: Array) -> Array:
    rows = (row[None] for row in (q, rates, accelerations))
    return generalized_forces(tree, Motion(np.zeros(1), *rows), {}, gravity)[0]


def energy(q: Array, rates: Array) -> float:
    """Kinetic energy, and that of gravity."""
    kinematics, total = TREE.kinematics, 0.0
    twists, poses = kinematics.twists(q), kinematics.poses(q)
    for name, body in PROTOTYPE.bodies.items():
        assert body.mass is not None
        assert body.inertia is not None
        spin, slide = np.split((kinematics.motion_masks[name] * rates) @ twists, 2)
        turn, centre = poses[name][:3, :3], poses[name] @ np.append(body.centre_of_mass, 1.0)
        speed = slide + np.cross(spin, centre[:3])
        about = turn.T @ spin
        total += 0.5 * body.mass * speed @ speed + 0.5 * about @ (np.array(body.inertia) * about)
        total -= body.mass * GRAVITY @ centre[:3]
    return total


@settings(max_examples=25, deadline=None)
@given(NUMBERS, NUMBERS, NUMBERS)
def test_their_power_is_the_rate_of_energy(q: Array, rates: Array, accelerations: Array):
    h = 1e-5

    def at(time: float) -> float:
        return energy(
            q + time * rates + 0.5 * time**2 * accelerations, rates + time * accelerations
        )

    power = forces_at(TREE, q, rates, accelerations, GRAVITY) @ rates
    rate = (8.0 * (at(h) - at(-h)) - at(2.0 * h) + at(-2.0 * h)) / (12.0 * h)
    assert rate == pytest.approx(power, abs=1e-4 * (1.0 + np.abs(power)))


@settings(max_examples=10, deadline=None)
@given(NUMBERS, NUMBERS, NUMBERS)
def test_inertia_is_that_of_the_model(q: Array, rates: Array, accelerations: Array):
    model = build_model(Model(PROTOTYPE), Plan(gravity=(0.0, 0.0, 0.0)))
    inertia = StaticState.from_displacements(model, q[None]).inertia()
    moved = forces_at(TREE, q, rates, accelerations, np.zeros(3))
    steady = forces_at(TREE, q, rates, np.zeros(SIZE), np.zeros(3))
    np.testing.assert_allclose(moved - steady, inertia @ accelerations, rtol=1e-9, atol=1e-11)


def test_forces_on_segments_are_subtracted():
    q = np.zeros((1, SIZE))
    motion = Motion(np.zeros(1), q, q, q)
    wrench = np.array([[1.0, 2.0, 3.0, 40.0, 50.0, 60.0]])
    name = "left_lower_leg"
    plain = generalized_forces(TREE, motion, {}, GRAVITY)
    pushed = generalized_forces(TREE, motion, {name: wrench}, GRAVITY)
    expected = (TREE.kinematics.twists(q)[0] @ wrench[0]) * TREE.kinematics.motion_masks[name]
    np.testing.assert_allclose(plain[0] - pushed[0], expected, atol=1e-12)


def test_moments_of_a_run_are_those_of_its_springs():
    """A run under springs alone needs no other moments: forward and inverse dynamics agree."""
    run = simulate(Model.of(PROTOTYPE), Plan(stop=0.3, frame=0.001))
    moments, inner = joint_moments(motion_from_recording(run), {}), slice(10, -10)
    for name in ("waist", "left_knee", "right_elbow", "left_shoulder"):
        values, springs = run.displacements[name], run.passive_torques[name]
        twists = TREE.chains[name].twists(values)[..., :3]
        for k in range(values.shape[1]):
            needed = moments.coordinates[f"{name}_{k + 1}"].forces
            given_by_springs = (twists[:, k] * springs).sum(axis=1)
            worst = np.abs(needed - given_by_springs)[inner].max()
            assert worst < 0.01 * (1.0 + np.abs(needed).max()), f"{name} {k + 1}"


def test_followers_move_by_their_curves_and_work_through_their_controls():
    """The moments of controls alone have the power of all forces."""
    imported = read_model(MODEL)
    motion, _ = read_motion_with_warnings(MOTION, imported.figure, imported.coordinates)
    tree = motion.tree
    times = np.arange(0.3, 2.2, 0.002)
    smooth = follow_curves(tree, smooth_motion(tree, motion, 6.0, times))
    columns = list(curve_columns(tree))
    assert len(columns) == 4
    inner, step = slice(10, -10), 0.002
    for own, control, curve in columns:
        np.testing.assert_allclose(smooth.values[:, own], curve.at(smooth.values[:, control]))
        for part, rate in ((smooth.values, smooth.rates), (smooth.rates, smooth.accelerations)):
            by_difference = np.gradient(part[:, own], step)
            close = 0.03 * np.abs(rate[:, own]).max()
            # At the ends of a curve, beyond which it is straight, its bend jumps.
            assert np.quantile(np.abs(by_difference - rate[:, own])[inner], 0.99) < close
    forces = generalized_forces(tree, smooth, {}, GRAVITY)
    total = add_followers_forces(tree, smooth, forces)
    followers = [own for own, *_ in columns]
    kept = [k for k in range(forces.shape[1]) if k not in followers]
    power = (forces * smooth.rates).sum(axis=1)
    np.testing.assert_allclose((total * smooth.rates)[:, kept].sum(axis=1), power, atol=1e-9)


def test_loops_and_missing_masses_are_refused():
    fourbar = build_tree(read_figure("fourbar"))
    zeros = np.zeros((1, fourbar.kinematics.size))
    motion = Motion(np.zeros(1), zeros, zeros, zeros)
    with pytest.raises(ModelError, match="close loops"):
        generalized_forces(fourbar, motion, {}, GRAVITY)
