"""The law that the other engines are given, against that of `springs`: two texts, one torque."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks import cases
from benchmarks.engines.exudyn_engine import radial_springs
from generator.springs_file.read import read_springs
from springs import damping_torque, elastic_torque, total_energy, total_torque
from springs.spherical import conservative_energy

CASE = cases.prototype("striding")
OWN = read_springs(None, CASE.figure)


def random_state(case, seed):
    """Balls and hinges anywhere below 160 deg, moving."""
    random = np.random.default_rng(seed)
    balls, hinges = len(case.tree.balls), len(case.tree.hinges)
    vectors = random.normal(size=(balls, 3))
    vectors *= random.uniform(0.0, 2.8, (balls, 1)) / np.linalg.norm(vectors, axis=1)[:, None]
    quaternions = Rotation.from_rotvec(vectors).as_quat()[:, [3, 0, 1, 2]]
    # A quaternion and its negative are one rotation.
    quaternions *= random.choice((-1.0, 1.0), (balls, 1))
    angles = random.uniform(-2.5, 2.5, hinges)
    return quaternions, angles, random.normal(size=(balls, 3)), random.normal(size=hinges)


def expected(case, springs, quaternions, angles, spins, rates):
    """Torques of balls in the tips' axes and of hinges, and the energy, by `springs`."""
    balls, hinges, energy = [], [], 0.0
    for link, quaternion, spin in zip(case.tree.balls, quaternions, spins, strict=True):
        assert link.sign > 0.0
        axes = springs.joints[link.joint].axes if link.joint in springs.joints else ()
        turn = Rotation.from_quat(quaternion[[1, 2, 3, 0]])
        r = turn.as_rotvec()
        half = Rotation.from_rotvec(0.5 * r)
        rate = half.apply(spin)
        torque = elastic_torque(springs.law, axes, r) + damping_torque(axes, r, rate)
        balls.append(half.inv().apply(torque))
        energy += float(conservative_energy(axes, r))
    for link, angle, rate in zip(case.tree.hinges, angles, rates, strict=True):
        (axis,) = springs.joints[link.joint].axes
        sense = float(np.dot(axis.direction, case.figure.joints[link.joint].chain[0].axis))
        torque = total_torque(axis.elastic, sense * angle) + axis.damping.torque(sense * rate)
        hinges.append(sense * torque)
        energy += float(total_energy(axis.elastic, sense * angle))
    return np.array(balls), np.array(hinges), energy


def assert_agreed(case, springs, state, **close):
    balls, hinges, energy = expected(case, springs, *state)
    found = case.law.torques(*state)
    assert found[0] == pytest.approx(balls, **close)
    assert found[1] == pytest.approx(hinges, **close)
    assert case.law.energy(*state[:2]) == pytest.approx(energy, **close)


@pytest.mark.parametrize("seed", range(5))
def test_the_prototype_s_curves(seed) -> None:
    assert_agreed(CASE, OWN, random_state(CASE, seed), rel=1e-6, abs=1e-5)


@pytest.mark.parametrize("size", [0.0, 1e-12, 1e-5, 1e-3, 3e-3])
def test_small_turns(size) -> None:
    """Small angles, at which the law uses a series."""
    state = random_state(CASE, 9)
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    state[0][:] = np.append(np.cos(0.5 * size), np.sin(0.5 * size) * axis)
    assert_agreed(CASE, OWN, state, rel=1e-6, abs=1e-5)


@pytest.mark.parametrize("seed", range(5))
def test_six_axes_make_a_law_of_the_size_alone(seed) -> None:
    case = cases.reference()
    springs = radial_springs(case.figure, case.radial)
    assert_agreed(case, springs, random_state(case, seed), rel=1e-9, abs=1e-9)
