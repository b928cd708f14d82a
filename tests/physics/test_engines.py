"""The prototype with its own springs in other engines, and the measured tables of the plates."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from benchmarks import cases
from benchmarks.cases import Case
from benchmarks.engines import exudyn_engine
from benchmarks.outside import Fall, fall
from benchmarks.tree import between
from generator.run_options import Integrator
from tests.physics.test_engines_law import random_state

pytestmark = pytest.mark.verify

CASE = cases.prototype("reaching")
STOP = 0.3
"""Until then the knee has come from beyond its dead zone into it [s]."""


def accelerator(name: str, case: Case):
    """An engine that gives accelerations; skips the test where it is not installed."""
    if name == "Pinocchio":
        pytest.importorskip("pinocchio")
        from benchmarks.engines.pinocchio_engine import Pinocchio

        return Pinocchio(case.tree)
    if name == "OpenSim":
        pytest.importorskip("opensim")
        from benchmarks.engines.opensim_engine import OpenSim

        return OpenSim(case.tree)
    pytest.importorskip("pydrake")
    from benchmarks.engines.drake_engine import Drake

    return Drake(case.tree)


def moved(name: str, case: Case) -> Fall:
    """The case in an engine, converged to about 5e-9 rad, Exudyn to 1e-7 rad."""
    if name == "MuJoCo":
        pytest.importorskip("mujoco")
        from benchmarks.engines.mujoco_engine import MuJoCo

        return MuJoCo(case.tree).fall(STOP, 1.25e-4, law=case.law)
    return fall(case.tree, case.law, accelerator(name, case), STOP, 1e-12)


@cache
def ours(stop: float = STOP) -> Fall:
    plan = exudyn_engine.plan_of(CASE.displacements, stop=stop, tolerance=1e-9)
    made, recording = exudyn_engine.fall(CASE.figure, plan)
    assert recording.integrator is Integrator.COMPILED
    return made


@cache
def exudyn_s(stop: float) -> Fall:
    """The same by Exudyn's integrator."""
    plan = exudyn_engine.exudyn_plan_of(CASE.displacements, stop=stop, tolerance=1e-7)
    made, recording = exudyn_engine.fall(CASE.figure, plan)
    assert recording.integrator is Integrator.EXUDYN
    return made


def apart(one: Fall, other: Fall) -> tuple[float, float, float]:
    """Largest differences: joints [rad], centre of mass [m], change of energy [J]."""
    changes = [f.energy - f.energy[0] for f in (one, other)]
    return (
        float(between(one.rotations, other.rotations).max()),
        float(np.linalg.norm(one.centre - other.centre, axis=1).max()),
        float(np.abs(changes[0] - changes[1]).max()),
    )


@pytest.mark.parametrize("name", ["MuJoCo", "OpenSim", "Pinocchio", "Drake"])
def test_the_compiled_run_agrees_with_the_other_engines(name: str) -> None:
    """Over a whole second, from more starts: `python -m benchmarks verification`."""
    joints, centre, energy = apart(ours(), moved(name, CASE))
    assert joints < 1e-8
    assert centre < 1e-9
    assert energy < 1e-7


@pytest.mark.slow
def test_the_compiled_run_agrees_with_exudyn_s_integrator() -> None:
    """For 0.04 s, which costs Exudyn's some 4 s."""
    joints, centre, energy = apart(ours(0.04), exudyn_s(0.04))
    assert joints < 1e-7
    assert centre < 1e-8
    assert energy < 1e-5


def test_the_comparison_sees_a_gram() -> None:
    """A heavier hand of 1 g breaks the agreement."""
    links = list(CASE.tree.links)
    place = next(k for k, link in enumerate(links) if link.name == "left_lower_arm")
    links[place] = replace(links[place], mass=links[place].mass + 1e-3)
    heavier = replace(CASE, tree=replace(CASE.tree, links=tuple(links)))
    assert apart(ours(), moved("Pinocchio", heavier))[0] > 1e-5


@pytest.mark.parametrize("name", ["OpenSim", "Drake"])
def test_accelerations_are_those_of_pinocchio(name: str) -> None:
    case = cases.prototype("striding")
    one, other = accelerator("Pinocchio", case), accelerator(name, case)
    for seed in range(5):
        state = random_state(case, seed)
        torques = case.law.torques(*state)
        for found, expected in zip(
            other.accelerations(*state, torques), one.accelerations(*state, torques), strict=True
        ):
            assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())
        assert other.book(*state)[0] == pytest.approx(one.book(*state)[0], abs=1e-12)


@pytest.mark.parametrize("name", ["MuJoCo", "OpenSim", "Drake"])
def test_the_reference_figure_is_the_same_with_each_engine_s_own_springs(name: str) -> None:
    """Native springs of the engines, as in the work-precision plate, against numpy's."""
    case = cases.reference()
    truth = fall(case.tree, case.law, accelerator("Pinocchio", case), 0.2, 1e-11, None)
    if name == "MuJoCo":
        mujoco = pytest.importorskip("benchmarks.engines.mujoco_engine")
        made = mujoco.MuJoCo(case.tree, case.radial).fall(0.2, 5e-4, frame=None)
    elif name == "OpenSim":
        opensim = pytest.importorskip("benchmarks.engines.opensim_engine")
        made = opensim.OpenSim(case.tree, case.radial).fall(0.2, 1e-8)
    else:
        drake = pytest.importorskip("benchmarks.engines.drake_engine")
        made = drake.Drake(case.tree, case.radial).fall(0.2, 1e-5)
    assert between(truth.rotations, made.rotations).max() < 1e-6


def test_the_reference_figure_is_the_same_here() -> None:
    case = cases.reference()
    truth = fall(case.tree, case.law, accelerator("Pinocchio", case), 0.2, 1e-11, None)
    springs = exudyn_engine.radial_springs(case.figure, case.radial)
    plan = exudyn_engine.plan_of(case.displacements, springs, stop=0.2, tolerance=1e-8)
    for made in (
        exudyn_engine.fall(case.figure, plan)[0],
        exudyn_engine.one_run(case.figure, plan),
    ):
        last = {name: turns[[0, -1]] for name, turns in made.rotations.items()}
        assert between(truth.rotations, last).max() < 1e-8
