"""The process of a live simulation: its pace, its commands, its end."""

import os
import signal
import subprocess
import sys
from multiprocessing import Pipe
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator import read_figure
from generator.input_files import live
from generator.motion_files import read_action
from generator.simulation.live.live_run import replay
from generator.viewer import live_process
from tests.generator.viewer.conftest import wait_until

WAIT = 120.0
FRAME = 1.0 / 60.0


def test_frames_that_are_on_time_are_due_at_their_interval():
    pace = live_process.Pace(0.1)
    pace.start(5.0)
    assert pace.wait(5.0) == 0.0
    for k in range(30):
        pace.advance(5.0 + 0.1 * k, 0.1 * k)
        assert pace.wait(5.0 + 0.1 * k + 0.02) == pytest.approx(0.08)
    assert pace.rate == pytest.approx(1.0)
    assert live_process.format_rate(pace.rate) == "real time"


def test_frames_that_need_too_long_are_not_all_caught_up():
    pace = live_process.Pace(0.01)
    pace.start(0.0)
    for k in range(100):
        pace.advance(0.02 * k, 0.01 * k)
        assert pace.wait(0.02 * k + 0.02) == 0.0
    assert pace.rate == pytest.approx(0.5)
    assert live_process.format_rate(pace.rate) == "0.50 x real time"
    now = 0.02 * 99
    late = 0
    while pace.wait(now) == 0.0:
        pace.advance(now, 1.0)
        late += 1
    assert late <= live_process.MAX_LAG / pace.interval + 1


def test_the_rate_is_that_of_the_last_second():
    pace = live_process.Pace(0.1)
    pace.start(0.0)
    pace.advance(0.0, 0.0)
    assert pace.rate is None
    assert live_process.format_rate(pace.rate) == ""
    for k in range(1, 20):
        pace.advance(1.0 * k, 0.1 * k)
    for k in range(1, 20):
        pace.advance(19.0 + 0.1 * k, 1.9 + 0.1 * k)
    assert pace.rate == pytest.approx(1.0)
    pace.start(100.0)
    assert pace.rate is None


vectors = st.tuples(*[st.floats(-5.0, 5.0)] * 3).map(np.array)


@given(st.floats(0.1, 50.0), vectors, vectors, vectors)
def test_a_pull_is_bounded_and_points_to_its_target(mass, point, velocity, target):
    force = np.array(live_process.pull_force(mass, 700.0, point, velocity, target))
    assert np.linalg.norm(force) <= live_process.MAX_PULL * 700.0 + 1e-2
    at_rest = np.array(live_process.pull_force(mass, 700.0, point, np.zeros(3), target))
    assert at_rest @ (target - point) >= -1e-2
    assert live_process.pull_force(mass, 700.0, point, np.zeros(3), point) == (0.0, 0.0, 0.0)


def test_the_mass_at_the_centre_is_that_of_the_segment_and_less_beside_it():
    segment = read_figure("prototype").segments["left_lower_leg"]
    x, y, z = segment.centre_of_mass
    assert live_process.effective_mass(segment, (x, y, z)) == pytest.approx(segment.mass)
    arm, turned = 0.2, min(segment.inertia[:2])
    beside = live_process.effective_mass(segment, (x, y, z + arm))
    assert beside == pytest.approx(1.0 / (1.0 / segment.mass + arm**2 / turned))


@pytest.fixture
def engine(tmp_path: Path) -> live_process.Engine:
    return live_process.Engine(read_figure("pendulum"), tmp_path)


START = live.LiveStart()


def test_a_start_and_frames(engine):
    first, *others = engine.carry_out(live_process.Begin(3, START), 0.0)
    assert isinstance(first, live_process.LiveFrame)
    assert others == []
    assert (first.generation, first.number, first.time, first.is_running) == (3, 0, 0.0, False)
    assert first.poses.shape == (len(read_figure("pendulum").segments), 3, 4)
    (frame,) = engine.carry_out(live_process.OneFrame(), 0.0)
    assert (frame.number, frame.time) == (1, pytest.approx(FRAME))
    poses = frame.poses_by_segment(read_figure("pendulum"))
    assert all(pose.shape == (4, 4) for pose in poses.values())
    assert not engine.is_running
    engine.carry_out(live_process.Run(is_running=True), 10.0)
    assert engine.is_running
    (frame,) = engine.advance(10.0)
    assert frame.is_running
    assert engine.pace.wait(10.0) == pytest.approx(FRAME)


def test_commands_before_the_start_have_no_answer(engine):
    for command in (
        live_process.Run(is_running=True),
        live_process.OneFrame(),
        live_process.Change(live.SetScales(1.0, 1.0)),
    ):
        assert engine.carry_out(command, 0.0) == []
    assert engine.advance(0.0) == []


def test_what_is_wrong_is_refused_with_a_sentence(engine):
    (refused,) = engine.carry_out(live_process.Begin(1, live.LiveStart(springs="nowhere")), 0.0)
    assert isinstance(refused, live_process.Refused)
    assert "nowhere" in refused.sentence
    engine.carry_out(live_process.Begin(2, START), 0.0)
    (refused,) = engine.carry_out(live_process.Change(live.SetFloor(50.0)), 0.0)
    assert "cm inside floor" in refused.sentence
    (frame,) = engine.carry_out(live_process.OneFrame(), 0.0)
    assert frame.floor is None
    (refused,) = engine.carry_out(live_process.Save(Path("/nowhere/at/all.action")), 0.0)
    assert isinstance(refused, live_process.Refused)


def test_a_pull_moves_its_segment_and_is_logged(engine, tmp_path):
    engine.carry_out(live_process.Begin(1, START, (live.SetGravity((0.0, 0.0, 0.0)),)), 0.0)
    point = (0.75, 0.0, 0.0)
    target = np.array([0.4, 0.7, 0.4])
    (frame,) = engine.carry_out(live_process.Pull("link1", point, tuple(target)), 0.0)
    start = frame.pulled
    for _ in range(20):
        (frame,) = engine.advance(0.0)
    assert np.linalg.norm(frame.pulled - target) < np.linalg.norm(start - target) - 0.1
    (frame,) = engine.carry_out(live_process.Pull("link1", point, None), 0.0)
    assert frame.pulled is None
    engine.advance(0.0)
    path = tmp_path / "a.live.toml"
    (saved,) = engine.carry_out(live_process.Save(path), 0.0)
    assert isinstance(saved, live_process.Saved)
    log = live.LIVE_FILE.read(path)
    forces = [each.change for each in log.changes if isinstance(each.change, live.SetForce)]
    assert len(forces) == 21
    assert forces[-1].force == (0.0, 0.0, 0.0)
    engine.carry_out(live_process.Save(tmp_path / "a.action"), 0.0)
    again = replay(read_figure("pendulum"), log).recording()
    written = read_action(tmp_path / "a.action")
    for name, values in written.displacements.items():
        assert np.array_equal(values, again.displacements[name])


@pytest.mark.parametrize(
    ("name", "written"), [("a.csv", "a-2.csv"), ("a.live.toml", "a-2.live.toml")]
)
def test_a_motion_is_saved_beside_files_that_exist(engine, tmp_path, name: str, written: str):
    (tmp_path / name).write_text("precious")
    engine.carry_out(live_process.Begin(1, START), 0.0)
    engine.advance(0.0)
    (saved,) = engine.carry_out(live_process.Save(tmp_path / name), 0.0)
    assert saved.path == tmp_path / written
    assert saved.sentence.startswith(f"{written}; {name} exists and was kept: ")
    assert saved.path.stat().st_size > 100
    assert (tmp_path / name).read_text() == "precious"


def test_a_motion_that_cannot_go_on_pauses(engine):
    # the pendulum's joint has springs, so that it may not turn through 180 deg
    engine.carry_out(live_process.Begin(1, START), 0.0)
    engine.carry_out(
        live_process.Change(live.SetForce("link1", (0.05, 0.0, 0.2), (0.0, 0.0, 500.0))), 0.0
    )
    engine.carry_out(live_process.Run(is_running=True), 0.0)
    answers = []
    for _ in range(600):
        answers = engine.advance(0.0)
        if len(answers) > 1:
            break
    assert isinstance(answers[0], live_process.Paused), answers
    assert "180 deg" in answers[0].sentence
    assert not answers[1].is_running
    assert not engine.is_running


def newest(process: live_process.LiveProcess, condition) -> list:
    """Return all answers until one fulfils a condition."""
    got = []

    def look():
        got.extend(process.take())
        return any(condition(each) for each in got)

    wait_until(look, WAIT)
    return got


def test_a_process_that_is_killed_says_so_and_starts_again(tmp_path):
    process = live_process.LiveProcess(read_figure("pendulum"), tmp_path)
    try:
        assert not process.is_alive
        process.send(live_process.OneFrame())
        assert process.take() == []
        process.send(live_process.Begin(1, START))
        process.send(live_process.Run(is_running=True))
        newest(process, lambda each: isinstance(each, live_process.LiveFrame) and each.number > 3)
        first = process.process_id
        os.kill(first, signal.SIGKILL)
        died = newest(process, lambda each: isinstance(each, live_process.Died))[-1]
        assert died.exit_code == -signal.SIGKILL
        process.send(live_process.Run(is_running=True))
        process.send(live_process.Begin(2, START))
        answers = newest(process, lambda each: isinstance(each, live_process.LiveFrame))
        assert answers[-1].generation == 2
        assert answers[-1].number == 0
        assert process.process_id != first
    finally:
        process.close()
    assert not process.is_alive
    assert process.take() == []


@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="the system has no SIGSTOP")
def test_the_page_never_waits_for_a_process_that_takes_nothing():
    process = live_process.LiveProcess(read_figure("pendulum"), Path())
    try:
        process.send(live_process.Begin(1, START))
        assert process.process_id is not None
        os.kill(process.process_id, signal.SIGSTOP)
        for k in range(100):  # a pipe holds some 64 kB
            process.send(live_process.Change(live.SetSprings(f"# {k}" + 10_000 * " ")))
            process.send(live_process.Change(live.SetScales(1.0, 1.0 + k)))
        os.kill(process.process_id, signal.SIGCONT)
        newest(process, lambda each: isinstance(each, live_process.LiveFrame))
    finally:
        process.close()
    assert not process.is_alive


def test_of_changes_of_one_quantity_in_a_row_the_last_one_is_sent():
    outbox, (connection, other) = live_process._Outbox(), Pipe()
    start, target = (0.0, 0.1, 0.2), (1.0, 1.0, 1.0)
    kept = [
        live_process.Begin(1, START),
        live_process.Change(live.SetScales(3.0, 1.0)),
        live_process.Change(live.SetFloor(0.1)),
        live_process.Change(live.SetScales(1.0, 1.0)),
        live_process.Pull("a", start, target),
        live_process.Pull("b", start, target),
        live_process.Run(is_running=True),
        live_process.Run(is_running=False),
    ]
    for command in kept:
        if isinstance(command, live_process.Change) and isinstance(command.change, live.SetScales):
            outbox.put(live_process.Change(live.SetScales(9.0, 9.0)))
        if isinstance(command, live_process.Pull):
            outbox.put(live_process.Pull(command.segment, start, start))
        outbox.put(command)
    outbox.put(None)
    outbox.send_all(connection)
    assert [other.recv() for _ in kept] == kept
    assert not other.poll()


def test_a_simulation_that_a_live_file_cannot_hold_is_said_and_goes_on(tmp_path: Path):
    engine = live_process.Engine(read_figure("pendulum"), tmp_path)
    engine.carry_out(live_process.Begin(1, START), 0.0)
    engine.carry_out(live_process.Change(live.SetFloor(-1e6)), 0.0)
    (refused,) = engine.carry_out(live_process.Save(tmp_path / "a.live.toml"), 0.0)
    assert isinstance(refused, live_process.Refused)
    assert "cannot hold this simulation" in refused.sentence
    (frame,) = engine.carry_out(live_process.OneFrame(), 0.0)
    assert isinstance(frame, live_process.LiveFrame)
    assert list(tmp_path.iterdir()) == []


SCRIPT = """
import sys, time
from pathlib import Path
from generator import read_figure
from generator.input_files.live import LiveStart
from generator.viewer.live_process import Begin, LiveFrame, LiveProcess, Run

if __name__ == "__main__":
    process = LiveProcess(read_figure("pendulum"), Path())
    process.send(Begin(1, LiveStart()))
    process.send(Run(is_running=True))
    print(process.process_id, flush=True)
    ends = (time.monotonic() + 120.0)
    while not any(isinstance(each, LiveFrame) and each.number > 1 for each in process.take()):
        assert time.monotonic() < ends
        time.sleep(0.02)
    print("runs", flush=True)
    time.sleep(120.0)
"""


def is_running(number: int) -> bool:
    try:
        return "State:\tZ" not in Path(f"/proc/{number}/status").read_text()
    except OSError:
        return False


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the system has no /proc")
@pytest.mark.parametrize(
    ("number", "is_early"),
    [
        (number, is_early)
        for number in (signal.SIGINT, signal.SIGKILL)
        for is_early in (True, False)
    ],
)
def test_the_process_ends_with_its_parent(number, is_early, tmp_path):
    script = tmp_path / "parent.py"
    script.write_text(SCRIPT)
    parent = subprocess.Popen(
        [sys.executable, script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True,
    )  # fmt: skip
    assert parent.stdout is not None
    try:
        child = int(parent.stdout.readline())
        assert is_early or parent.stdout.readline() == "runs\n"
        assert is_running(child)
        if number == signal.SIGINT:
            os.killpg(parent.pid, number)  # as a terminal does
        else:
            parent.kill()
        _, errors = parent.communicate(timeout=WAIT)
        wait_until(lambda: not is_running(child), WAIT)
    finally:
        parent.kill()
    if number == signal.SIGINT:
        assert errors.count("Traceback") == 1
        assert errors.rstrip().endswith("KeyboardInterrupt")
