from math import cos, pi, radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.joint_chain import Chain, build_chain
from generator.model_files.opensim.expression import Expression, with_definitions
from generator.model_files.opensim.rotation import RotationExpressions
from generator.passive_curve import rotation_vector
from generator.rotations import Array, matrix_from_rotation_vector
from tests.chains import BALL, SKEW, X, Y, Z, chain, negative
from tests.generator.model_files.opensim.lepton import evaluate

CHAINS = [
    BALL,
    chain("Rz R-x Ry"),
    chain("Rs Ra Rs"),
    chain("Rs Ra"),
    chain("Rx Ry Rz Tx Ty Tz"),
    chain("Ty Rx Rs"),
]
DIRECTIONS = [X, negative(Y), Z, SKEW]

angles = st.lists(st.floats(-pi, pi), min_size=3, max_size=3)
chains = st.sampled_from([build_chain(axes) for axes in CHAINS[:-1]])
directions = st.sampled_from(DIRECTIONS)


def expressions(of: Chain) -> RotationExpressions:
    names = tuple(f"q{k}" for k in range(1, len(of.rotations) + 1))
    return RotationExpressions(of.rotation_axes, names)


def value_of(rotation: RotationExpressions, expression: Expression, values: Array) -> float:
    text = with_definitions(expression, rotation.definitions)
    return evaluate(text, dict(zip(rotation.angles, map(float, values), strict=True)))


def turns_of(of: Chain, values: list[float]) -> tuple[Array, Array]:
    """Values of the rotations, and of all displacements."""
    displacements = np.zeros(len(of.joint_axes))
    displacements[list(of.rotations)] = values[: len(of.rotations)]
    return displacements[list(of.rotations)], displacements


@given(chains, angles, directions)
def test_component_of_the_rotation_vector(
    of: Chain, values: list[float], direction: tuple[float, float, float]
) -> None:
    turns, displacements = turns_of(of, values)
    vector = rotation_vector(of, displacements)
    rotation = expressions(of)
    found = value_of(rotation, rotation.component(direction), turns)
    if np.linalg.norm(vector) < 3.1:  # where its sign is not rounding
        assert found == pytest.approx(float(vector @ direction), abs=1e-11)


@given(chains, angles, directions)
def test_slopes_of_the_component(
    of: Chain, values: list[float], direction: tuple[float, float, float]
) -> None:
    turns, displacements = turns_of(of, values)
    if np.linalg.norm(rotation_vector(of, displacements)) > 3.0:
        return  # a difference might cross half a turn
    rotation, step = expressions(of), 1e-5
    for k, index in enumerate(of.rotations):
        ahead, behind = displacements.copy(), displacements.copy()
        ahead[index] += step
        behind[index] -= step
        slope = (rotation_vector(of, ahead) - rotation_vector(of, behind)) / (2.0 * step)
        found = value_of(rotation, rotation.component_slope(direction, k), turns)
        assert found == pytest.approx(float(slope @ direction), abs=1e-7)


@given(chains, angles, directions)
def test_turn_rates_are_those_in_the_half_way_frame(
    of: Chain, values: list[float], direction: tuple[float, float, float]
) -> None:
    turns, displacements = turns_of(of, values)
    vector = rotation_vector(of, displacements)
    if np.linalg.norm(vector) > 3.1:
        return
    half_way = matrix_from_rotation_vector(0.5 * vector)
    rotation = expressions(of)
    for k, index in enumerate(of.rotations):
        rate = half_way.T @ of.twists(displacements)[index, :3]
        found = value_of(rotation, rotation.turn_rate(direction, k), turns)
        assert found == pytest.approx(float(rate @ direction), abs=1e-11)


@given(chains, angles, directions)
def test_angle_and_alignment(
    of: Chain, values: list[float], direction: tuple[float, float, float]
) -> None:
    turns, displacements = turns_of(of, values)
    vector = rotation_vector(of, displacements)
    along, angle = float(vector @ direction), float(np.linalg.norm(vector))
    if not 1e-3 < angle < 3.1 or abs(along) < 1e-9:
        return
    rotation = expressions(of)
    signed = value_of(rotation, rotation.signed_angle(direction), turns)
    assert signed == pytest.approx(float(np.copysign(angle, along)), abs=1e-9)
    alignment = value_of(rotation, rotation.alignment(direction), turns)
    assert alignment == pytest.approx(abs(along) / angle, abs=1e-9)


def test_a_hinge_turns_beyond_a_turn() -> None:
    rotation = RotationExpressions((X,), ("q1",))
    assert value_of(rotation, rotation.component(negative(X)), np.array([7.0])) == -7.0
    assert value_of(rotation, rotation.component_slope(negative(X), 0), np.array([7.0])) == -1.0


def test_at_rest() -> None:
    rotation, rest = RotationExpressions((X, Y, Z), ("a", "b", "c")), np.zeros(3)
    for k, direction in enumerate((X, Y, Z)):
        assert value_of(rotation, rotation.component(direction), rest) == 0.0
        assert value_of(rotation, rotation.turn_rate(direction, k), rest) == 1.0
        slope = value_of(rotation, rotation.component_slope(direction, k), rest)
        assert slope == pytest.approx(1.0, abs=1e-12)


def test_rotations_of_more_than_half_a_turn_are_the_shorter_ones() -> None:
    rotation, turns = RotationExpressions((X, Z), ("a", "b")), np.radians([200.0, 0.0])
    found = value_of(rotation, rotation.component(X), turns)
    assert found == pytest.approx(radians(-160.0))
    assert value_of(rotation, rotation.turn_rate(X, 0), turns) == pytest.approx(1.0)


def test_two_joints_in_one_expression() -> None:
    first = RotationExpressions((X, Y), ("q1", "q2"), "_1")
    second = RotationExpressions((Y, X), ("q3", "q4"), "_2")
    both = first.component(X) + second.component(X)
    text = with_definitions(both, {**first.definitions, **second.definitions})
    values = {"q1": 0.3, "q2": 0.4, "q3": 0.4, "q4": 0.3}
    alone = evaluate(with_definitions(first.component(X), first.definitions), values)
    other = evaluate(with_definitions(second.component(X), second.definitions), values)
    assert evaluate(text, values) == pytest.approx(alone + other, abs=1e-15)
    assert alone == pytest.approx(other, abs=1e-15)
    assert abs(alone) < 0.3 / cos(0.2)
