"""The reach of a limb as expressions: lengths, moment arms, and what OpenSim has to read."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest

from generator.joint_chain import Chain, build_chain
from generator.model_files.opensim.expression import Expression, with_definitions
from generator.model_files.opensim.lepton import parse_expression
from generator.model_files.opensim.reach import ReachExpressions
from generator.model_files.opensim.rotation import RotationExpressions
from generator.passive_curve import rotation_vector
from generator.rotations import Array, matrix_from_rotation_vector
from springs import total_torque
from springs.backends import NUMPY
from tests.chains import BALL, X, Y, Z, chain, negative
from tests.springs.test_reach import ARM, MIRRORED, point

LONG_AXIS_FIRST = chain("Rz Rx Ry")
REACHES = {
    "innermost": (LONG_AXIS_FIRST, ARM),
    "mirrored": (chain("R-z R-x Ry"), MIRRORED),
    "outermost": (BALL, ARM),
    "middle": (chain("Rx Rz Ry"), ARM),
    "against its axis": (BALL, replace(ARM, long_axis=negative(Z))),
    "across, without turns": (BALL, replace(ARM, long_axis=X, planes=(Y, Z), turns=())),
    "with translations": (chain("Rz Rx Ry Tx Ty Tz"), ARM),
}


def expressions(name: str) -> tuple[Chain, ReachExpressions]:
    axes, reach = REACHES[name]
    of = build_chain(axes)
    names = ("q1", "q2", "q3")
    return of, ReachExpressions(reach, RotationExpressions(of.rotation_axes, names))


def evaluated(made: ReachExpressions, one: Expression, turns: Array) -> Array:
    text = with_definitions(one, made.definitions)
    values = dict(zip(made.rotation.angles, turns.T, strict=True))
    return parse_expression(text, frozenset(values))(values) * np.ones(len(turns))


def poses(of: Chain, count: int = 500) -> tuple[Array, Array]:
    """Random values of the rotations, and of all displacements."""
    turns = np.random.default_rng(7).uniform(-2.5, 2.5, (count, 3))
    displacements = np.zeros((count, len(of.joint_axes)))
    displacements[:, list(of.rotations)] = turns
    return turns, displacements


@pytest.mark.parametrize("name", REACHES)
def test_lengths_are_the_angles_beyond_the_ends(name: str) -> None:
    of, made = expressions(name)
    turns, displacements = poses(of)
    at = made.reach.at(rotation_vector(of, displacements))
    expected = {"reach": at.theta - at.boundary(NUMPY)[0]}
    if made.reach.turns:
        expected["turn_upper"] = at.turn - at.upper[0]
        expected["turn_lower"] = at.lower[0] - at.turn
    found = {end.label: evaluated(made, end.length, turns) for end in made.lengths()}
    inside = at.theta < radians(175.0)
    assert found.keys() == expected.keys()
    for label, values in expected.items():
        assert found[label][inside] == pytest.approx(values[inside], abs=1e-11), label


@pytest.mark.parametrize("name", REACHES)
def test_tensions_times_arms_are_the_torque_along_the_rotations(name: str) -> None:
    of, made = expressions(name)
    turns, displacements = poses(of)
    r = rotation_vector(of, displacements)
    half = matrix_from_rotation_vector(0.5 * r)
    twists = of.twists(displacements)[:, list(of.rotations), :3]
    rates = np.einsum("nji,nkj->nki", half, twists)
    expected = np.einsum("nki,ni->nk", rates, made.reach.torque(r))
    found = np.zeros_like(expected)
    for end in made.lengths():
        tension = -total_torque(end.law, evaluated(made, end.length, turns))
        arms = [evaluated(made, arm, turns) for arm in end.arms]
        found += tension[:, None] * np.stack(arms, axis=1)
    inside = made.reach.at(r).theta < radians(175.0)
    assert np.abs(expected[inside]).max() > 100.0
    size = 1.0 + np.abs(expected[inside])
    assert np.abs((found - expected)[inside] / size).max() < 1e-9


def test_a_limb_that_turns_about_its_own_axis_first_changes_no_direction() -> None:
    """Moment arms of zero are left out of the file: OpenSim is slow to read long expressions."""
    _, made = expressions("innermost")
    (beyond, *_) = made.lengths()
    assert beyond.arms[0].text == "0"
    longest = max(len(with_definitions(one, made.definitions)) for one in beyond.arms)
    assert longest < 2000


def test_at_the_centre_all_numbers_are_finite() -> None:
    axes, reach = REACHES["innermost"]
    ends = (point(90, 150), point(90, 30), point(40, 90), point(140, 90))
    reach = replace(reach, centre=point(90, 90), boundary=ends, harmonics=1)
    of = build_chain(axes)
    made = ReachExpressions(reach, RotationExpressions(of.rotation_axes, ("q1", "q2", "q3")))
    at_centre = np.array([[0.0, 0.0, radians(90.0)], [0.4, 0.0, radians(90.0)]])
    for end in made.lengths():
        for one in (end.length, *end.arms):
            assert np.isfinite(evaluated(made, one, at_centre)).all()


def test_a_reach_without_laws_has_no_paths() -> None:
    made = expressions("innermost")[1]
    limp = replace(
        made.reach,
        beyond=replace(made.reach.beyond, elastic=()),
        turn=replace(made.reach.turn, elastic=()),
    )
    assert not list(replace(made, reach=limp).lengths())
