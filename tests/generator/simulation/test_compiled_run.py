"""Recordings of compiled runs against those of Exudyn's integrator, and the choice of the two."""

import math
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from generator import read_figure
from generator.drive import Drive
from generator.figure import AxisKind, Figure, SiteRef
from generator.loads import LoadKind, TimedLoad
from generator.recording import Ending, Recording
from generator.rotations import rotation_vector_from_matrix
from generator.run_options import Integrator
from generator.simulation import compiled_run
from generator.simulation.compiled import layout, mechanism, refinement
from generator.simulation.compiled.layout import ROTATION
from generator.simulation.compiled.refinement import record_links
from generator.simulation.compiled_run import build_trace, compile_model, disturbed_start
from generator.simulation.exudyn_model.model import ExudynModel, build_model
from generator.simulation.plan import NO_LIMIT, Plan
from generator.simulation.run import simulate
from generator.simulation.trace import mean_position
from springs import AxisSpring, Cubic, Damping, JointSprings, Linear, SphericalLaw, SpringSet
from springs.hysteresis import Hysteresis
from tests.chains import BALL, SKEW, X, Z, chain, row
from tests.contact_figures import FLOOR, MASS, ball, two_segments

PROTOTYPE = read_figure("prototype")
TIMES = np.linspace(0.0, 1.0, 9)
TOLERANCE = 1e-6

EXUDYN_TOLERANCE = 1e-4
"""Tolerance of Exudyn's integrator, whose extrapolation is much more accurate [rad]."""


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
    law=SphericalLaw.WEIGHTED,
    joints={**THREE.joints, "joint0": JointSprings("joint0", (ABOUT, SKEWED))},
)
MIXED = (BALL, chain("Rz"), chain("Rx Ry"))


@dataclass(frozen=True)
class Case:
    figure: Figure
    plan: dict[str, Any] = field(default_factory=dict)


CASES = {
    "prototype": Case(PROTOTYPE, BENT),
    "weighted": Case(row(3, MIXED), {"law": SphericalLaw.WEIGHTED, "springs": WEIGHTED}),
    "free root": Case(
        row(3, MIXED), {"springs": THREE, "free_root": True, "velocities": {"joint1": (3.0,)}}
    ),
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
    exudyn = simulate(
        case.figure, replace(plan, integrator=Integrator.EXUDYN, tolerance=EXUDYN_TOLERANCE)
    )
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
    assert found.accuracy.tolerance_met_until == found.times[-1]
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
    assert found.prescribed_motion_drift < 1e-12


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
    build = mechanism.MechanismBuilder.build

    def build_wrong(builder):
        made = build(builder)
        made.mechanism.constants[:, layout.MASS] *= np.array([1.0, 1.0 + share])
        return made

    monkeypatch.setattr(mechanism.MechanismBuilder, "build", build_wrong)
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


@pytest.mark.parametrize(("stop", "tolerance"), [(6.0, 1e-3), (0.5, 1e-14)])
def test_a_run_beyond_its_tolerance_is_not_done(stop: float, tolerance: float) -> None:
    """A wild triple pendulum amplifies any error; and no run is more exact than its numbers."""
    speeds = {"joint0": (12.0, 10.0, 8.0)}
    plan = Plan(stop=stop, tolerance=tolerance, springs=SpringSet(), velocities=speeds)
    run = simulate(row(3), plan)
    assert run.integrator is Integrator.COMPILED
    assert run.outcome.ending is Ending.INACCURATE
    assert run.outcome.last_time == run.times[-1] == stop
    assert run.accuracy.estimate is not None
    assert run.accuracy.estimate > tolerance
    assert run.accuracy.tolerance_met_until < stop
    assert (
        f"only until {run.accuracy.tolerance_met_until:.4g} s of {stop:g} s" in run.outcome.message
    )


# Contact


def relative_rotations(model: ExudynModel, links) -> np.ndarray:
    """Rotation of each joint's outboard link in its inboard one, of one state, shape (j, 3, 3)."""
    compiled = compile_model(model)
    turns = links[0, :, ROTATION : ROTATION + 9].reshape(-1, 3, 3)
    turns = np.concatenate([turns, np.eye(3)[None]])
    return np.array([turns[a].T @ turns[b] for a, b in compiled.joint_links])


DISTURBED = {
    "prototype": (PROTOTYPE, {"free_root": True, "height": 0.1, "scene": FLOOR}),
    "prototype, bent": (
        PROTOTYPE,
        {
            "free_root": True,
            "height": 0.5,
            "scene": FLOOR,
            "displacements": {"left_hip_joint": (0.4, 0.2, -0.3), "right_knee": (0.7,)},
            "velocities": {"right_elbow": (3.0,), "lower_torso": (0.1, 0.2, 0.3, 1.0, 2.0, 3.0)},
        },
    ),
    "rows": (
        row(4, (BALL, chain("Rs"), chain("Rx Ry"))),
        {"springs": SpringSet(), "velocities": {"joint0": (1.0, 2.0, 3.0), "joint1": (4.0,)}},
    ),
    "driven": (
        row(4, (BALL, chain("Rs"), BALL, chain("Rz"))),
        {"springs": SpringSet(), "drives": {"joint1": wave(1), "joint2": wave(3)}},
    ),
    "slides": (
        row(2, (chain("Rz Tx"), chain("Tx Ty"))),
        {"springs": SpringSet(), "velocities": {"joint0": (1.0, 2.0)}},
    ),
}


@pytest.mark.parametrize("name", DISTURBED)
def test_a_disturbed_start_turns_every_joint_by_a_milliradian(name) -> None:
    """Relative to its inboard segment; a universal joint about both axes, a prescribed one not."""
    made, fields = DISTURBED[name]
    model = build_model(made, Plan(**fields))
    compiled = compile_model(model)
    state = disturbed_start(compiled, 0.0)
    one, other = (
        relative_rotations(model, record_links(compiled, np.zeros(1), each[None]))
        for each in (compiled.initial_state, state)
    )
    between = rotation_vector_from_matrix(np.swapaxes(one, 1, 2) @ other)
    angles = np.linalg.norm(between, axis=1)
    assert len(angles) == len(model.figure.joints)
    for angle, (joint, each) in zip(angles, model.figure.joints.items(), strict=True):
        turns = sum(factor.kind is AxisKind.ROTATION for factor in each.chain)
        if joint in model.prescribed.fixed_joints or turns == 0:
            assert angle < 1e-14
        elif turns == 2:
            assert 0.9e-3 < angle < 2.0e-3
        else:
            assert angle == pytest.approx(1e-3, rel=1e-9)
    balls = state[: 4 * compiled.balls].reshape(-1, 4)
    assert np.linalg.norm(balls, axis=1) == pytest.approx(1.0, abs=1e-15)


def test_the_sensitivity_begins_with_the_disturbance() -> None:
    """And that of height with what it moves the centre of mass; it ends with the frames."""
    made = two_segments()
    plan = Plan(
        stop=0.5,
        tolerance=1e-6,
        springs=SpringSet(),
        scene=FLOOR,
        displacements={"root": (0.1, 0.2, -0.3, 0.0, 1.0, 0.0)},
    )
    contact = simulate(made, plan).contact
    assert contact is not None
    assert contact.sensitivity.shape == contact.height_sensitivity.shape == (26,)
    assert contact.sensitivity[0] == pytest.approx(1e-3, rel=1e-9)
    assert 1e-6 < contact.height_sensitivity[0] < 2e-3
    assert np.all(np.isfinite(contact.sensitivity))
    assert np.max(contact.sensitivity) > 2e-3
    # The same difference, of a run that starts with the disturbed displacements.
    model = build_model(made, plan)
    compiled = compile_model(model)
    moved = replace(compiled, initial_state=disturbed_start(compiled, 0.0))
    times = np.linspace(0.0, 0.5, 26)
    one, other = (
        refinement.run_once(each, times, 1e-10, records_steps=True) for each in (compiled, moved)
    )
    expected = refinement.joint_differences(compiled, one, other)
    assert contact.sensitivity == pytest.approx(expected, rel=1e-3, abs=1e-6)
    heights = [
        mean_position(
            model.figure, build_trace(model, compiled, r.times, r.states, r.links).positions
        )
        for r in (one, other)
    ]
    shifts = np.abs(heights[0] - heights[1])[:, 1]
    assert contact.height_sensitivity == pytest.approx(shifts, rel=1e-3, abs=1e-7)
    spheres = len(compiled.mechanism.sphere_constants)
    shift = abs(first_touch(other, spheres) - first_touch(one, spheres))
    assert shift > 1e-6
    assert contact.impact_shift == pytest.approx(shift, abs=2e-7)


def first_touch(run: refinement.CompiledRun, spheres: int) -> float:
    """The time of the first touch, between two steps much shorter than any of a usual run."""
    depths = np.max(run.path_rows[:, -2 * spheres :: 2], axis=1)
    after = int(np.argmax(depths > 0.0))
    times, ends = run.path_times[after - 1 : after + 1], depths[after - 1 : after + 1]
    return float(np.interp(0.0, ends, times))


def test_ctrl_c_in_a_fall_leaves_its_contact_so_far(monkeypatch) -> None:
    """Steps, frames and integrals until then, without a disturbed run."""
    monkeypatch.setattr(refinement, "_LINK_STEPS_PER_CALL", 20)

    def watch(progress) -> None:
        if progress.pass_number == 2 and progress.time > 0.28:
            raise KeyboardInterrupt

    plan = Plan(stop=0.6, springs=SpringSet(), scene=FLOOR, tolerance=1e-5)
    run = simulate(ball(0.2), plan, watch, threads=1)
    assert run.outcome.ending is Ending.INTERRUPTED
    contact = run.contact
    assert contact is not None
    assert 0.26 < run.times[-1] < 0.6
    assert contact.sensitivity is None
    assert contact.segments["link"].first_time == pytest.approx(math.sqrt(0.4 / 9.81), abs=1e-7)
    change = MASS * (run.velocities["pin"][-1, 4] + 9.81 * run.times[-1])
    assert contact.segments["link"].impulse[1] == pytest.approx(change, rel=1e-4)
    assert contact.segments["link"].impulse[1] > 1.0
    assert len(contact.forces["link"]) == len(contact.ground_reaction) == len(run.times)
    assert contact.dissipated == pytest.approx(
        run.energy["contact damping"][-1] + run.energy["friction"][-1]
    )


def test_a_run_of_one_frame_has_a_contact_record() -> None:
    """A wall limit that has passed when the run begins."""
    run = simulate(
        ball(0.2), Plan(stop=0.6, springs=SpringSet(), scene=FLOOR, wall_limit=1e-9, tolerance=1e-9)
    )
    assert run.contact is not None
    assert run.contact.max_depth == 0.0 or len(run.times) > 1
    assert len(run.contact.ground_reaction) == len(run.times)


@pytest.mark.parametrize("start", [-3.0, 7.0])
def test_contact_does_not_depend_on_the_start_time(start) -> None:
    plan = Plan(start=start, stop=start + 0.4, springs=SpringSet(), scene=FLOOR, tolerance=1e-6)
    run = simulate(ball(0.2), plan)
    assert run.integrator is Integrator.COMPILED
    touch = run.contact.segments["link"]
    assert touch.first_time - start == pytest.approx(math.sqrt(0.4 / 9.81), abs=1e-9)
    assert start < touch.peak_time < start + 0.4
    exact = simulate(ball(0.2), replace(plan, start=0.0, stop=0.4)).contact
    assert run.contact.dissipated == pytest.approx(exact.dissipated, rel=1e-6)
    assert run.contact.weight_carried == pytest.approx(exact.weight_carried, rel=1e-3)


@pytest.mark.parametrize("figure", [ball(0.05), two_segments()], ids=["ball", "two segments"])
def test_falls_are_those_of_exudyn_s_integrator(figure) -> None:
    """Frames within the tolerances of both; forces, losses and impulses within what they make."""
    root = next(iter(figure.joints))
    start = {"root": (0.1, 0.2, -0.3, 0.0, 0.8, 0.0)} if root == "root" else {}
    plan = Plan(stop=0.35, springs=SpringSet(), scene=FLOOR, tolerance=1e-4, displacements=start)
    found = simulate(figure, plan)
    expected = simulate(figure, replace(plan, integrator=Integrator.EXUDYN))
    assert found.integrator is Integrator.COMPILED
    assert found.agreement_with_exudyn < 1e-12
    assert expected.accuracy.estimate <= 1e-4
    assert_close(found.rotation_vectors, expected.rotation_vectors, 0.0, 2e-4)
    assert_close(found.poses, expected.poses, 0.0, 1e-3)
    assert_close(found.energy, expected.energy, 5e-3, 0.0)
    one, other = found.contact, expected.contact
    assert_close(one.forces, other.forces, 2e-2, 0.0)
    assert_close({"": one.ground_reaction}, {"": other.ground_reaction}, 2e-2, 0.0)
    for name, segment in one.segments.items():
        assert segment.impulse == pytest.approx(other.segments[name].impulse, rel=5e-3, abs=2e-2)
    assert one.dissipated == pytest.approx(other.dissipated, rel=5e-3)
    assert one.dissipated > 0.5


def test_the_contact_of_a_stopped_run_ends_with_its_frames(monkeypatch) -> None:
    """Its steps go on to where it was stopped, but integrals and forces of frames do not."""
    monkeypatch.setattr(refinement, "_LINK_STEPS_PER_CALL", 20)

    def watch(_number: int, _step: float, now: float) -> None:
        if now > 0.21:
            raise KeyboardInterrupt

    model = build_model(ball(0.2), Plan(stop=0.6, springs=SpringSet(), scene=FLOOR))
    times = np.array([0.0, 0.1, 0.2, 0.3, 0.6])
    refined = compiled_run.run_compiled(model, times, NO_LIMIT, watch)
    assert refined.outcome.ending is Ending.INTERRUPTED
    assert refined.trace.times.tolist() == [0.0, 0.1, 0.2]
    contact = refined.trace.contact
    assert contact.steps.times[0] == 0.0
    assert 0.19 < contact.steps.times[-1] <= 0.2
    assert np.max(contact.steps.depths) < 0.0
    assert np.all(contact.impulses == 0.0)


COARSE_FALL = Plan(
    stop=0.4,
    tolerance=1e-5,
    springs=SpringSet(),
    scene=FLOOR,
    displacements={"root": (0.1, 0.2, -0.3, 0.0, 0.9, 0.0)},
    velocities={"hinge": (2.0,)},
)


def test_a_fall_says_until_when_its_tolerance_is_met(monkeypatch) -> None:
    """From runs that are too coarse; certified, it is repeated, or does not succeed."""
    monkeypatch.setattr(refinement, "FIRST_SHARE_WITH_CONTACT", 1e2)
    told = simulate(two_segments(), COARSE_FALL)
    until = told.accuracy.tolerance_met_until
    assert told.outcome.ending is Ending.DONE
    assert 0.0 <= until < 0.4
    assert f"Joint angles within 1e-05 rad until {until:.4g} s." in told.outcome.message
    assert told.accuracy.estimate > 1e-5
    plan = replace(COARSE_FALL, certify=True)
    certified = simulate(two_segments(), plan)
    assert certified.outcome.ending is Ending.DONE
    assert certified.accuracy.tolerance_met_until == 0.4
    assert certified.accuracy.estimate <= 1e-5
    monkeypatch.setattr(refinement, "MAX_RUNS", 2)
    failed = simulate(two_segments(), plan)
    assert failed.outcome.ending is Ending.INACCURATE
    assert failed.accuracy.tolerance_met_until == until
