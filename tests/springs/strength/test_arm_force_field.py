"""Strength of a hand, against the sample of the authors' program."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from springs.strength.arm_force_field import (
    ArmWeight,
    HandStrength,
    arm_force_field_numbers,
    arm_force_field_spread,
    hand_force,
)

# Knuckle, wrist and elbow of each arm, shoulders, C7/T1 and L5/S1: x left, y up, z forwards.
LEFT = ((0.29034, 0.91934, 0.29134), (0.2617, 0.96619, 0.23538), (0.191, 1.11068, 0.09171))
RIGHT = ((-0.37368, 1.20097, 0.360862), (-0.36905, 1.20173, 0.2826), (-0.42676, 1.28636, 0.0928))
SHOULDERS = np.array([(0.09191, 1.30461, -0.06136), (-0.21538, 1.32291, -0.06481)])
NECK, BACK = (-0.06385, 1.35457, -0.06182), (-0.063, 0.95253, -0.07984)
UP = np.array([0.0, 1.0, 0.0])
QUANTILE_75 = -0.6744897501960817


def sample(side: int, *, mirror_gravity: bool = True) -> HandStrength:
    """Strength of a hand of the sample upwards; side 0 is the left."""
    lateral = SHOULDERS[1] - SHOULDERS[0]
    lateral /= np.linalg.norm(lateral)
    forwards = np.cross(np.subtract(NECK, BACK), lateral)
    forwards /= np.linalg.norm(forwards)
    axes = np.array([forwards, np.cross(lateral, forwards), lateral * (1 if side else -1)])
    hand, wrist, elbow = (axes @ (np.array(p) - SHOULDERS[side]) for p in (LEFT, RIGHT)[side])
    woman = arm_force_field_numbers()
    ends = np.array([np.zeros(3), elbow, wrist, hand])
    centres = ends[:-1] + np.array(woman["segment_centres"])[:, None] * np.diff(ends, axis=0)
    masses = woman["mass_kg"] * np.array(woman["segment_masses"])
    down = axes @ -UP
    if not mirror_gravity:
        down[2] = -down[2]
    along = axes @ UP
    weight = float(ArmWeight(masses, centres, down).force_at(hand) @ along)
    return HandStrength(hand_force(hand, along), weight, arm_force_field_spread())


@pytest.mark.parametrize(
    ("side", "mirror_gravity", "force", "percent"),
    [
        # The program mirrors the left arm, but not the sideward part of gravity.
        (0, False, 78.148, 94.80),
        (0, True, 78.588, 94.96),
        (1, True, 61.836, 86.90),
    ],
)
def test_sample_of_the_program(side: int, mirror_gravity: bool, force: float, percent: float):
    found = sample(side, mirror_gravity=mirror_gravity)
    at_75 = found.mean * (1.0 + QUANTILE_75 * found.spread) + found.assistance
    assert at_75 == pytest.approx(force, abs=5e-4)
    assert found.percent_capable(50.0) == pytest.approx(percent, abs=5e-3)
    assert found.percent_capable(found.capacity) == pytest.approx(50.0)
    assert found.percent_capable(found.capacity_5) == pytest.approx(95.0)


UNIT = st.floats(-1.0, 1.0)


@given(st.tuples(UNIT, UNIT, UNIT), st.tuples(UNIT, UNIT, UNIT))
def test_force_is_within_what_was_measured(place, direction):
    size = np.linalg.norm(direction)
    if size < 1e-3:
        return
    assert 44.2 <= hand_force(0.5 * np.array(place), np.array(direction) / size) <= 223.2


def test_weight_of_an_arm_below_the_shoulder_is_no_help():
    arm = ArmWeight([2.0, 1.0, 0.5], [[0, -0.1, 0], [0, -0.3, 0], [0, -0.5, 0]], [0, -1, 0])
    assert np.array_equal(arm.force_at([0.0, -0.5, 0.0]), np.zeros(3))
    level = ArmWeight([2.0], [[0.3, 0.0, 0.0]], [0, -1, 0])
    assert level.force_at([0.6, 0.0, 0.0]) == pytest.approx([0.0, -2.0 * 9.81 * 0.5, 0.0])
