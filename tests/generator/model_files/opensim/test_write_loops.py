"""Joints that close loops in OpenSim: their springs are bushings."""

from dataclasses import replace
from pathlib import Path

import pytest

from generator.figure import Figure
from generator.model_files.opensim.write import format_osim
from springs import AxisSpring, Damping, JointSprings, Linear, SphericalLaw, SpringSet
from tests.chains import SKEW, X, Y, Z, chain, negative
from tests.generator.model_files.engines import OpenSim, moved
from tests.generator.model_files.model_cases import (
    AGREEMENT,
    CURVES,
    FOURBAR,
    LOOPS,
    OTHER_CURVES,
    apart,
    hinge,
    linked,
    ours,
    spring_set,
)
from tests.laws import VECTOR_LAWS

STOP = 0.15

BALL_LAWS = tuple(
    AxisSpring(direction, CURVES[name])
    for direction, name in ((X, "several"), (SKEW, "cubic"), (negative(Y), "stop"))
)


def check(of: Figure, springs: SpringSet, folder: Path) -> None:
    """Compare motions, which the springs change."""
    loaded = OpenSim(of, springs, folder)
    loaded.accuracy = 1e-7
    assert not any("springs" in one.what for one in loaded.losses.entries)
    expected = ours(of, springs, STOP).poses
    assert apart(ours(of, SpringSet(), STOP).poses, expected) > 100.0 * AGREEMENT
    assert apart(moved(loaded, STOP), expected) < AGREEMENT


@pytest.mark.verify
@pytest.mark.parametrize("axis", [Z, negative(Z)])
def test_springs_of_hinges(axis: tuple[float, float, float], tmp_path: Path) -> None:
    spring = hinge("rocker_pin", Linear(30.0, 0.4), *CURVES["table"], axis=axis, viscous=0.5)
    check(FOURBAR, spring_set(spring), tmp_path)


@pytest.mark.verify
@pytest.mark.parametrize("law", VECTOR_LAWS)
def test_springs_of_balls(law: SphericalLaw, tmp_path: Path) -> None:
    springs = spring_set(JointSprings("closing", BALL_LAWS))
    check(LOOPS["closed by a ball"], replace(springs, law=law), tmp_path)


def losses_of(of: Figure, springs: JointSprings) -> set[str]:
    entries = format_osim(of, spring_set(springs))[1].entries
    return {one.what for one in entries} - {
        "displacements of joints that close loops, which do not become coordinates"
    }


def test_friction_is_lost() -> None:
    rubbing = hinge("rocker_pin", Linear(1.0), axis=Z, viscous=0.1, coulomb=0.1)
    assert losses_of(FOURBAR, rubbing) == {"friction of joints that close loops"}
    two_ways = hinge("rocker_pin", *OTHER_CURVES["hysteresis"], axis=Z)
    assert losses_of(FOURBAR, two_ways) == {"friction of joints that close loops"}
    assert not losses_of(FOURBAR, hinge("rocker_pin", Linear(1.0), axis=Z, viscous=0.1))


def test_damping_of_balls_is_lost() -> None:
    of, law = LOOPS["closed by a ball"], AxisSpring(X, (Linear(1.0),))
    assert not losses_of(of, JointSprings("closing", (law,)))
    damped = JointSprings("closing", (replace(law, damping=Damping(0.1)),))
    lost = {"damping and friction of several rotations in joints that close loops"}
    assert losses_of(of, damped) == lost


def test_springs_of_open_loops_are_lost() -> None:
    springs = hinge("closing", Linear(1.0), axis=Z)
    assert "springs of joints that close loops" in losses_of(linked(chain("Rz Tz")), springs)
