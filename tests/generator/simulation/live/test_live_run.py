"""Live simulations: their recording, their log, and the same motion again."""

import json
from dataclasses import replace

import numpy as np
import pytest

from generator import Ending, Model, ModelError, Plan, read_figure, simulate
from generator.contact.box import Box
from generator.contact.scene import Prop, Scene
from generator.diagnostics import InputError, MoverError
from generator.figure import ContactSphere
from generator.input_files.live import (
    LIVE_FILE,
    LiveStart,
    SetFloor,
    SetForce,
    SetGravity,
    SetRoot,
    SetScales,
    SetSprings,
    StopMotion,
    write_live,
)
from generator.input_files.scene import write_scene
from generator.motion_files import MOTION_FORMATS, motion_from_recording, motion_writer, read_npz
from generator.simulation.falls import fall_plan
from generator.simulation.live.live_run import LiveRun, plan_of_start, replay
from springs.contact import DEFAULT_SURFACE
from tests.chains import BALL, chain, one_body, row

HINGE = chain("Ry")


@pytest.fixture(scope="module")
def bars():
    """Two bars on hinges, with a contact sphere at each end."""
    made = row(2, (HINGE,), stiff=2.0, damp=0.02)
    ends = tuple(ContactSphere((0.0, 0.0, z), 0.04) for z in (0.0, 0.3))
    return made.with_parts(*(replace(bar, contact_spheres=ends) for bar in made.bodies.values()))


@pytest.fixture(scope="module")
def balls():
    """Three bars on a ball, a hinge and a universal joint."""
    return row(3, (BALL, HINGE, chain("Rx Rz")), stiff=2.0, damp=0.02)


def advance(run: LiveRun, count: int) -> None:
    for _ in range(count):
        outcome = run.advance()
        assert outcome.succeeded, outcome.message


def difference(values, others) -> float:
    assert values.keys() == others.keys()
    return max(float(np.max(np.abs(values[name] - others[name]))) for name in others)


def assert_same(one, other) -> None:
    """Compare two recordings bit by bit."""
    assert np.array_equal(one.times, other.times)
    for field in ("poses", "displacements", "velocities", "energy", "reactions",
                  "passive_torques"):  # fmt: skip
        first, second = getattr(one, field), getattr(other, field)
        assert first.keys() == second.keys()
        for name in first:
            assert np.array_equal(first[name], second[name]), (field, name)
    assert np.array_equal(one.centre_of_mass, other.centre_of_mass)


def test_an_unchanged_run_is_that_of_simulate(balls):
    run = LiveRun(balls, LiveStart(tolerance=1e-10, frame=0.02))
    advance(run, 20)
    live = run.recording()
    exact = simulate(balls, Plan(stop=0.4, frame=0.02, tolerance=1e-7))
    assert np.allclose(live.times, exact.times, rtol=0.0, atol=1e-12)
    assert live.chains == exact.chains
    for field, bound in (
        ("poses", 1e-6),
        ("displacements", 1e-6),
        ("velocities", 1e-5),
        ("rotation_vectors", 1e-6),
        ("passive_torques", 1e-5),
        ("energy", 1e-5),
        ("reactions", 1e-4),
    ):
        assert difference(getattr(live, field), getattr(exact, field)) < bound, field
    assert np.max(np.abs(live.centre_of_mass - exact.centre_of_mass)) < 1e-6
    assert live.agreement_with_exudyn is not None
    assert live.agreement_with_exudyn < 1e-11
    assert live.outcome.ending is Ending.DONE
    assert live.accuracy.steps > 0


def changed_run(figure) -> LiveRun:
    """Return a run with every kind of change."""
    run = LiveRun(figure, LiveStart())
    advance(run, 5)
    run.apply(SetScales(2.0, 0.5))
    advance(run, 4)
    run.apply(SetRoot(True))
    run.apply(SetFloor(-0.7))
    advance(run, 10)
    for k in range(5):
        run.apply(SetForce("bar1", (0.0, 0.0, 0.3), (0.3 * k, 2.0 + k, 0.1)))
        advance(run, 1)
    run.apply(SetForce("bar1", (0.0, 0.0, 0.3), (0.0, 0.0, 0.0)))
    run.apply(SetGravity((1.0, -5.0, 0.0)))
    advance(run, 20)
    run.apply(SetRoot(False))
    advance(run, 3)
    run.apply(StopMotion())
    run.apply(SetFloor(None))
    run.apply(SetRoot(True))
    run.apply(SetScales(1.0, 1.0))
    advance(run, 5)
    return run


def test_a_log_gives_the_same_motion_bit_by_bit(bars):
    run = changed_run(bars)
    log = run.log("bars.fig", None)
    read = LIVE_FILE.parse_text(write_live(log)).require_value()
    assert read == log
    times = []
    again = replay(bars, read, times.append)
    assert_same(again.recording(), run.recording())
    assert len(times) == run.frame == log.end_frame
    assert again.log("bars.fig", None) == log


def test_reading_a_run_does_not_change_it(bars):
    read, alone = LiveRun(bars, LiveStart()), LiveRun(bars, LiveStart())
    for run in (read, alone):
        for _ in range(10):
            advance(run, 1)
            if run is read:
                _ = run.poses, run.displacements, run.energy, run.recording()
        run.apply(SetRoot(True))
        run.apply(SetRoot(False))
        run.apply(SetRoot(True))
        advance(run, 5)
    assert_same(read.recording(), alone.recording())


def test_a_recording_has_one_figure_and_its_balance_of_energy(bars):
    run = changed_run(bars)
    recording = run.recording()
    assert "bar0" in recording.chains
    assert "joint0" not in recording.chains
    assert len(recording.times) == run.frame + 1
    motion = motion_from_recording(recording, bars)
    by_kinematics = replace(motion, recording=None).poses
    for name, poses in by_kinematics.items():
        assert np.max(np.abs(poses - recording.poses[name])) < 1e-9, name
    assert np.ptp(recording.energy_balance) < 1e-2 * np.ptp(recording.energy["kinetic"])
    assert recording.energy["friction"][-1] > 0.0
    assert recording.energy["contact"][0] == 0.0


def test_what_held_the_root_carries_the_figure_before_it_is_freed(bars):
    held, freed = LiveRun(bars, LiveStart()), LiveRun(bars, LiveStart())
    for run in (held, freed):
        advance(run, 4)
    freed.apply(SetRoot(True))
    advance(freed, 2)
    forces = freed.recording().reactions["bar0"][:, :3]
    carried = held.recording().reactions["joint0"][:, :3]
    sizes = np.linalg.norm(carried, axis=1)
    assert np.allclose(np.linalg.norm(forces[:5], axis=1), sizes, rtol=0.0, atol=1e-9)
    assert sizes.min() > 1.0
    assert np.max(np.abs(forces[5:])) < 1e-9


def test_recordings_are_written(bars, tmp_path):
    recording = changed_run(bars).recording()
    motion = motion_from_recording(recording, bars)
    for suffix in MOTION_FORMATS:
        motion_writer(tmp_path / f"a{suffix}")(motion, tmp_path / f"a{suffix}")
    _, read = read_npz(tmp_path / "a.npz")
    assert_same(read, recording)
    page = (tmp_path / "a.html").read_text(encoding="utf-8")
    content = page.partition('id="motion">')[2].partition("</script>")[0]
    json.loads(content, parse_constant=pytest.fail)


def test_a_stop_of_the_motion_leaves_the_last_frame():
    spinning = one_body(BALL, stiff=(0.1, 0.1, 0.1))
    run = LiveRun(spinning, LiveStart(gravity=(0.0, 0.0, 0.0)))
    run.apply(SetForce("link", (0.0, 0.0, 0.3), (30.0, 0.0, 0.0)))
    while run.advance().succeeded:
        assert run.frame < 600
    assert "joint pin rotated through 180 deg" in run.last_outcome.message
    frame, poses = run.frame, run.poses
    assert not run.advance().succeeded
    assert run.frame == frame
    assert difference(run.poses, poses) == 0.0
    run.apply(SetForce("link", (0.0, 0.0, 0.3), (0.0, 0.0, 0.0)))
    run.apply(StopMotion())
    advance(run, 5)
    assert_same(replay(spinning, run.log("a", None)).recording(), run.recording())


def test_wrong_changes_are_not_logged(bars):
    run = LiveRun(bars, LiveStart())
    advance(run, 2)
    poses = run.poses
    for change, error, message in (
        (SetForce("bar7", (0, 0, 0), (1, 0, 0)), ModelError, "bar7"),
        (SetScales(-1.0, 1.0), ModelError, "not negative"),
        (SetSprings("joints = 3"), InputError, "unknown key"),
        (SetFloor(5.0), ModelError, "cm inside floor"),
    ):
        with pytest.raises(error, match=message):
            run.apply(change)
    assert run.log("a", None).changes == ()
    assert difference(run.poses, poses) == 0.0


def test_springs_of_a_text_replace_those_of_their_axis():
    figure = read_figure("pendulum")
    joint = next(name for name, each in figure.joints.items() if each.chain)
    text = f'[[spring]]\njoints = ["{joint}"]\naxis = "x"\nstiffness_Nm_rad = 40\n'
    run, limp = LiveRun(figure, LiveStart()), LiveRun(figure, LiveStart())
    run.apply(SetSprings(text))
    for each in (run, limp):
        advance(each, 30)
    assert difference(run.displacements, limp.displacements) > 1e-2
    again = replay(figure, run.log("pendulum.fig", None)).recording()
    assert_same(again, run.recording())


def test_a_replay_of_another_figure_is_refused(bars):
    log = changed_run(bars).log("bars.fig", None)
    with pytest.raises(ModelError, match="bar1"):
        replay(row(1, (HINGE,), stiff=2.0), log)


@pytest.mark.slow
def test_a_fall_begins_as_its_plan_and_is_replayed():
    """With the props of the fall and own ones; another floor leaves the others where they are."""
    figure = read_figure("male50")
    crate = Prop("crate", Box((2.0, 0.2, 0.0), (0.3, 0.4, 0.3)), DEFAULT_SURFACE)
    start = LiveStart(fall="seat", seed=3, free_root=True, scene=write_scene(Scene((crate,))))
    run = LiveRun(figure, start)
    assert [prop.name for prop in run.scene.props] == ["floor", "seat", "back", "crate"]
    assert run.floor == 0.0
    plan = replace(fall_plan(figure, "seat", 3), tone=None, stop=0.02)
    first = simulate(Model.of(figure), plan)
    for name, poses in first.poses.items():
        assert np.abs(run.poses[name] - poses[0]).max() < 1e-9
    run.apply(SetFloor(-0.01))
    assert [prop.name for prop in run.scene.props] == ["floor", "seat", "back", "crate"]
    assert run.floor == -0.01
    advance(run, 20)
    forces, points = run.contact_forces
    assert forces.shape == points.shape
    recording = run.recording()
    assert recording.scene == run.scene
    log = LIVE_FILE.parse_text(write_live(run.log("male50.fig", None))).require_value()
    assert log.start == start
    again = replay(figure, log)
    assert_same(again.recording(), recording)
    assert again.scene == run.scene
    run.apply(SetFloor(None))
    assert run.floor is None
    assert len(run.scene.props) == 3


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"free_root": False}, "a free root"),
        ({"pose": 'figure = "male50"'}, "its own pose"),
        ({"fall": "flop"}, "unknown kind of fall"),
        ({"scene": "[[box]]"}, "size_m"),
    ],
)
def test_a_wrong_fall_is_refused(changes, sentence):
    start = replace(LiveStart(fall="faint", free_root=True), **changes)
    with pytest.raises(MoverError, match=sentence):
        plan_of_start(read_figure("male50"), start)


def test_a_full_log_is_refused_and_can_still_be_replayed(bars, monkeypatch):
    monkeypatch.setattr("generator.simulation.live.live_run.MAX_LOG_LENGTH", 1000)
    run = LiveRun(bars, LiveStart())

    def change_often() -> None:
        for changes in range(100):
            run.apply(SetGravity((0.1 * changes, -9.81, 0.0)))
            advance(run, 1)

    with pytest.raises(ModelError, match=r"the log is full after \d\d changes: save it, and reset"):
        change_often()
    frame = run.frame
    advance(run, 2)
    log = run.log("bars", None)
    assert len(log.changes) == frame
    written = write_live(log)
    starts = [written.index("[[change]]")]
    assert len(written) - starts[0] <= 1000
    again = replay(bars, LIVE_FILE.parse_text(written).require_value())
    assert again.frame == frame + 2
    assert_same(again.recording(), run.recording())
