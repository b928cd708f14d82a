"""Recordings of compiled runs against those of Exudyn's integrator, and the choice of the two."""

from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from generator import read_figure
from generator.drive import Drive
from generator.figure import Figure, SiteRef
from generator.loads import LoadKind, TimedLoad
from generator.recording import Ending, Integrator, Recording
from generator.simulation import compiled_run
from generator.simulation.compiled import mechanism, refinement
from generator.simulation.compiled.layout import MASS
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import AxisSpring, Cubic, Damping, Joining, JointSprings, Linear, SpringSet
from springs.hysteresis import Hysteresis
from tests.chains import BALL, SKEW, X, Z, chain, one_body, row
from tests.runs import springs_of

PROTOTYPE = read_figure("prototype")
TIMES = np.linspace(0.0, 1.0, 9)
TOLERANCE = 1e-6


def wave(columns: int) -> Drive:
    return Drive(TIMES, 0.3 * np.sin(4.0 * TIMES[:, None] + np.arange(columns)))


BENT = {
    "displacements": {"waist": (0.3, 0.2, -0.4), "left_hip_joint": (0.2, 0.3, 0.5)},
    "velocities": {"right_elbow": (3.0,)},
}
ROWS = ((1.0, 2.0, 3.0), (4.0, -9.0, 2.0))
LOADS = tuple(
    TimedLoad(SiteRef("bar1", "far"), kind, (0.05, 0.21), ROWS)
    for kind in (LoadKind.GLOBAL_FORCE, LoadKind.LOCAL_MOMENT)
)
SLIDE = AxisSpring(X, (Linear(200.0, 0.1),), Damping(3.0))
ABOUT = AxisSpring(X, (Linear(5.0),), Damping(0.2))
RUBBING = AxisSpring(Z, (Hysteresis.from_mean_and_width(Linear(8.0, 0.3), 2.0, 0.5),), Damping(0.1))
SKEWED = AxisSpring(SKEW, (Cubic((0.3, 4.0, 1.0, 6.0)),), Damping(0.1))
THREE = SpringSet(
    {
        "joint0": JointSprings("joint0", (ABOUT,)),
        "joint1": JointSprings("joint1", (RUBBING,)),
        "joint2": JointSprings("joint2", (ABOUT,)),
    }
)
WEIGHTED = replace(
    THREE,
    joining=Joining.WEIGHTED,
    joints={**THREE.joints, "joint0": JointSprings("joint0", (ABOUT, SKEWED))},
)
MIXED = (BALL, chain("Rz"), chain("Rx Ry"))


@dataclass(frozen=True)
class Case:
    figure: Figure
    plan: dict[str, Any] = field(default_factory=dict)


CASES = {
    "prototype": Case(PROTOTYPE, BENT),
    "weighted": Case(row(3, MIXED), {"joining": Joining.WEIGHTED, "springs": WEIGHTED}),
    "free root": Case(PROTOTYPE, {"free_root": True, "velocities": {"right_elbow": (3.0,)}}),
    "slides": Case(
        row(3, (chain("Rx Ry Tx"), BALL)),
        {"springs": SpringSet({"joint0": JointSprings("joint0", (ABOUT,), (SLIDE,))})},
    ),
    "locked and driven": Case(
        row(4, (BALL, chain("Rz"), chain("Rx Ry"), chain("Rz"))),
        {"springs": THREE, "locked": ("joint1",), "drives": {"joint2": wave(2), "joint3": wave(1)}},
    ),
    "driven ball": Case(row(3, MIXED), {"springs": THREE, "drives": {"joint0": wave(3)}}),
    "loads": Case(row(3, MIXED), {"springs": THREE, "loads": LOADS}),
}


@cache
def runs(name: str) -> tuple[Recording, Recording]:
    """The compiled run and Exudyn's."""
    case = CASES[name]
    plan = Plan(stop=0.3, tolerance=TOLERANCE, **case.plan)
    compiled = simulate(case.figure, plan)
    exudyn = simulate(case.figure, replace(plan, integrator=Integrator.EXUDYN))
    return compiled, exudyn


def assert_close(found, expected, relative: float, absolute: float) -> None:
    """Compare arrays by name; the error counts relative to the largest number of all."""
    assert found.keys() == expected.keys()
    scale = max((float(np.max(np.abs(v), initial=0.0)) for v in expected.values()), default=0.0)
    for name, values in expected.items():
        assert found[name].shape == values.shape
        difference = float(np.max(np.abs(found[name] - values), initial=0.0))
        assert difference <= relative * scale + absolute, name


@pytest.mark.parametrize("name", CASES)
def test_recordings_are_those_of_exudyn_s_integrator(name) -> None:
    """Motions within the tolerances of both; forces, which are as accurate as accelerations."""
    found, expected = runs(name)
    assert found.integrator is Integrator.COMPILED
    assert found.integrator_reason == ""
    assert found.agreement_with_exudyn < 1e-12
    assert expected.integrator is Integrator.EXUDYN
    assert expected.integrator_reason == "it was asked for"
    assert expected.agreement_with_exudyn is None
    assert found.outcome.succeeded
    assert expected.outcome.succeeded
    assert np.array_equal(found.times, expected.times)
    assert found.accuracy.estimate <= TOLERANCE
    assert found.accuracy.held_until == found.times[-1]
    assert_close(found.displacements, expected.displacements, 0.0, 3e-6)
    assert_close(found.rotation_vectors, expected.rotation_vectors, 0.0, 3e-6)
    assert_close(found.poses, expected.poses, 0.0, 1e-5)
    assert_close(found.velocities, expected.velocities, 1e-5, 1e-4)
    assert_close(found.passive_torques, expected.passive_torques, 1e-4, 1e-4)
    assert_close(found.reactions, expected.reactions, 1e-3, 1e-3)
    assert_close(found.drive_torques, expected.drive_torques, 1e-3, 1e-3)
    assert_close(found.energy, expected.energy, 1e-4, 1e-4)
    assert np.max(np.abs(found.centre_of_mass - expected.centre_of_mass)) < 1e-5
    assert found.constraint_drift < 1e-12
    assert found.strayed < 1e-12


@pytest.mark.parametrize("name", CASES)
def test_the_energy_balance_closes(name) -> None:
    """To 1e-6 of what is exchanged: by springs and weights, damping, loads and drives."""
    run, _ = runs(name)
    potential = run.energy["gravity"] + run.energy["spring"]
    exchanged = np.ptp(potential) + np.ptp(run.energy["dissipated"]) + np.ptp(run.energy["work"])
    assert exchanged > 0.05
    assert np.max(np.abs(run.energy_balance - run.energy_balance[0])) < 1e-6 * exchanged
    assert np.all(np.diff(run.energy["dissipated"]) >= -1e-12)


def test_work_is_done_where_it_is_tested() -> None:
    for name in ("loads", "locked and driven", "driven ball"):
        assert np.ptp(runs(name)[0].energy["work"]) > 0.01
    for name in ("prototype", "weighted", "slides", "loads"):
        assert runs(name)[0].energy["dissipated"][-1] > 1e-3


# The choice of the integrator


@pytest.mark.parametrize(
    ("made", "fields", "reason"),
    [
        (row(1), {"step": 1e-3}, "a fixed step was asked for"),
        (row(1), {"python_torques": True}, "the torques are Python functions"),
        (row(1), {"integrator": Integrator.EXUDYN}, "it was asked for"),
    ],
)
def test_exudyn_s_integrator_is_used_for_a_reason(made, fields, reason) -> None:
    run = simulate(made, Plan(stop=0.04, springs=SpringSet(), **fields))
    assert run.outcome.succeeded
    assert run.integrator is Integrator.EXUDYN
    assert run.integrator_reason == reason
    assert run.agreement_with_exudyn is None


def test_a_stiff_motion_is_left_to_exudyn(monkeypatch) -> None:
    monkeypatch.setattr(refinement, "_LINK_STEPS_PER_CALL", 20)
    monkeypatch.setattr(compiled_run, "MAX_STEPS_PER_SECOND", 10)
    run = simulate(row(1), Plan(stop=2.0, springs=SpringSet()))
    assert run.integrator is Integrator.EXUDYN
    assert run.integrator_reason == "the motion needs more than 10 steps a second"
    assert run.outcome.succeeded
    assert run.agreement_with_exudyn is None


def test_a_stiff_motion_on_which_exudyn_fails_takes_all_its_steps() -> None:
    """Dry friction in four joints, whose slip rate no implicit step of the solver resolves."""
    made = read_figure("prototype")
    springs = {
        name: JointSprings(
            name,
            (
                AxisSpring(
                    made.joints[name].chain[0].axis, (Linear(10.0),), Damping(0.0, 5.0, 1e-4)
                ),
            ),
        )
        for name in ("left_elbow", "right_elbow", "left_knee", "right_knee")
    }
    run = simulate(made, Plan(stop=0.02, springs=SpringSet(springs)))
    assert run.outcome.ending is Ending.DONE
    assert run.integrator is Integrator.COMPILED
    assert run.accuracy.steps > 0.02 * compiled_run.MAX_STEPS_PER_SECOND


@pytest.mark.parametrize(("share", "is_compiled"), [(1e-6, False), (1e-11, True)])
def test_accelerations_that_differ_from_exudyn_s_do_not_count(
    monkeypatch, share, is_compiled
) -> None:
    """A mass that is wrong by a millionth is noticed; one of 1e-11 is within the bound."""
    build = mechanism._Builder.build

    def build_wrong(builder):
        made = build(builder)
        made.mechanism.constants[:, MASS] *= np.array([1.0, 1.0 + share])
        return made

    monkeypatch.setattr(mechanism._Builder, "build", build_wrong)
    run = simulate(row(2), Plan(stop=0.1, springs=SpringSet()))
    assert run.outcome.succeeded
    if is_compiled:
        assert run.integrator is Integrator.COMPILED
        assert 1e-13 < run.agreement_with_exudyn < 1e-10
    else:
        assert run.integrator is Integrator.EXUDYN
        reason = "the compiled accelerations differ from Exudyn's by "
        assert float(run.integrator_reason.removeprefix(reason)) < 1e-5
        assert run.agreement_with_exudyn is None


# Endings


def test_an_elastic_ball_turned_over_is_told() -> None:
    springs = tuple(AxisSpring(axis, (Linear(1.0),)) for axis in (X, Z))
    plan = Plan(
        stop=1.0,
        springs=springs_of("pin", *springs),
        displacements={"pin": (2.8, 0.0, 0.0)},
        velocities={"pin": (8.0, 0.0, 0.0)},
    )
    run = simulate(one_body(BALL), plan)
    assert run.integrator is Integrator.COMPILED
    assert run.outcome.ending is Ending.TURNED_OVER
    assert run.outcome.joint == "pin"
    assert "pin" in run.outcome.message
    assert run.outcome.last_time == run.times[-1] < 0.1
    assert len(run.accuracy.by_frame) == len(run.times)


def test_ctrl_c_leaves_the_frames_so_far(monkeypatch) -> None:
    monkeypatch.setattr(refinement, "_LINK_STEPS_PER_CALL", 20)

    def watch(progress) -> None:
        if progress.time > 0.5:
            raise KeyboardInterrupt

    run = simulate(row(2, stiff=3.0, damp=0.1), Plan(stop=3.0), watch)
    assert run.integrator is Integrator.COMPILED
    assert run.outcome.ending is Ending.INTERRUPTED
    assert "interrupted at" in run.outcome.message
    assert 25 <= len(run.times) < 151
    assert run.outcome.last_time == run.times[-1]
    assert len(run.accuracy.by_frame) == len(run.poses["bar0"]) == len(run.times)
    assert run.accuracy.held_until <= run.times[-1]
    assert np.max(run.accuracy.by_frame[run.times <= run.accuracy.held_until]) <= 1e-3


def test_the_wall_limit_ends_a_run() -> None:
    run = simulate(row(10), Plan(stop=500.0, tolerance=1e-8, springs=SpringSet(), wall_limit=0.2))
    assert run.outcome.ending is Ending.TOO_LONG
    assert "wall-time limit" in run.outcome.message
    assert run.wall_time < 5.0
