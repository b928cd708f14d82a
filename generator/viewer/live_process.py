"""The process of a live simulation, which the page commands and whose frames it shows.

The page never waits for it: a thread takes what it sends, and keeps only the newest frame. The
process ends when the page does.
"""

import multiprocessing
import sys
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from threading import Condition, Lock, Thread
from time import monotonic

import numpy as np

from generator.child_processes import blocked_interrupt, serve_parent_only
from generator.contact.scene import NO_SCENE, Scene
from generator.diagnostics import MoverError
from generator.figure import Figure, Segment
from generator.input_files import live
from generator.motion_files import motion_from_recording, motion_writer
from generator.motion_files.motion import file_sha256
from generator.rotations import Array
from generator.text_io import os_error_reason, write_atomic
from generator.viewer.folder import free_path, written_text

REAL_TIME_RATE = 0.97
"""Rate from which a simulation counts as running in real time."""

RATE_SPAN = 1.0
"""Wall time over which the rate is measured [s]."""

MAX_LAG = 0.1
"""Lag behind real time that is still caught up [s]."""

ENERGY_INTERVAL = 12
"""Number of frames between two computations of the energy."""

FORCE_INTERVAL = 6
"""Number of frames between two computations of the contact forces."""

PULL_FREQUENCY = 4.0
"""Natural frequency of a pulled segment on the spring of the pull, without its joints [Hz]."""

PULL_DAMPING = 0.5
"""Damping ratio of this spring."""

MAX_PULL = 3.0
"""Largest force of a pull over the weight of the figure at `DEFAULT_GRAVITY`."""

_ROUNDED_DIGITS = 3
"""Decimal digits of the forces of a pull [N]: the log stays short, and the replay exact."""


@dataclass
class Pace:
    """Pace of frames at an interval in real time [s], and the rate that is reached."""

    interval: float
    _due: float = 0.0
    _history: deque[tuple[float, float]] = field(default_factory=deque[tuple[float, float]])

    def start(self, now: float) -> None:
        """Begin or continue at a time of a monotonic clock [s]; the first frame is due at once."""
        self._due = now
        self._history.clear()

    def wait(self, now: float) -> float:
        """Time until the next frame is due, zero if it is late [s]."""
        return max(0.0, self._due - now)

    def advance(self, now: float, time: float) -> None:
        """Note a frame at a simulated time. What lags by more than `MAX_LAG` is not caught up."""
        self._due = max(self._due + self.interval, now - MAX_LAG)
        self._history.append((now, time))
        while len(self._history) > 2 and self._history[1][0] <= now - RATE_SPAN:
            self._history.popleft()

    @property
    def rate(self) -> float | None:
        """Simulated time over wall time in the last second; None before two frames."""
        if len(self._history) < 2:
            return None
        (first, start), (last, end) = self._history[0], self._history[-1]
        return (end - start) / (last - first) if last > first else None


def format_rate(rate: float | None) -> str:
    """Describe a rate of simulated over wall time."""
    if rate is None:
        return ""
    return "real time" if rate >= REAL_TIME_RATE else f"{rate:.2f} x real time"


def effective_mass(segment: Segment, point: live.Vector) -> float:
    """Least mass of a free segment at a point: force there over the acceleration of the point [kg].

    Its inverse is the largest eigenvalue of 1 / m - [r] J^-1 [r], where r is the arm from the
    centre of mass, [r] its cross-product matrix, and J the tensor of inertia.
    The point is in the frame of the segment [m].
    """
    assert segment.mass is not None
    assert segment.centre_of_mass is not None
    x, y, z = np.array(point) - segment.centre_of_mass
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    mobility = np.eye(3) / segment.mass
    mobility -= cross @ np.diag(1.0 / np.asarray(segment.inertia, dtype=float)) @ cross
    return 1.0 / float(np.linalg.eigvalsh(mobility)[-1])


def pull_force(
    mass: float, weight: float, point: Array, velocity: Array, target: Array
) -> live.Vector:
    """Force of a damped spring from a point of a segment to a target, world axes, (3,) [N].

    Args:
        mass: mass of the segment at the point, as `effective_mass` returns it [kg].
        weight: weight of the figure [N]; the force is at most `MAX_PULL` times as large.
        point: shape (3,) [m].
        velocity: velocity of the point, shape (3,) [m/s].
        target: shape (3,) [m].
    """
    angular = 2.0 * np.pi * PULL_FREQUENCY
    force = mass * angular * (angular * (target - point) - 2.0 * PULL_DAMPING * velocity)
    size, largest = float(np.linalg.norm(force)), MAX_PULL * weight
    if size > largest:
        force = force * (largest / size)
    x, y, z = (round(float(part), _ROUNDED_DIGITS) + 0.0 for part in force)
    return x, y, z


@dataclass(frozen=True)
class Begin:
    """Command: compile and go to the start with its changes, paused.

    The generation is the number of the simulation, which answers carry.
    """

    generation: int
    start: live.LiveStart
    changes: tuple[live.LiveChange, ...] = ()


@dataclass(frozen=True)
class Run:
    """Command: run or pause."""

    is_running: bool


@dataclass(frozen=True)
class OneFrame:
    """Command: pause and compute one frame."""


@dataclass(frozen=True)
class Change:
    """Command: make a change now."""

    change: live.LiveChange


@dataclass(frozen=True)
class Pull:
    """Command: pull a point in the frame of a segment [m] to a target in the world [m].

    Without a target the segment is released.
    """

    segment: str
    point: live.Vector
    target: live.Vector | None


@dataclass(frozen=True)
class Save:
    """Command: write the motion so far, or its log, in the format of the path's suffix.

    Where there is a file already, the name gets a number.
    """

    path: Path


Command = Begin | Run | OneFrame | Change | Pull | Save


@dataclass(frozen=True, eq=False)
class LiveFrame:
    """Answer: a frame.

    Attributes:
        generation: generation of the simulation.
        number: number of the frame; 0 is the start.
        time: [s].
        poses: poses of all segments in the order of the figure, first three rows, shape (n, 3, 4).
        displacements: displacements of the joints [rad or m].
        energy: energy by kind [J]; while frames follow, of one of the last `ENERGY_INTERVAL`
            frames.
        rate: simulated over wall time; None while it is paused.
        is_running: whether frames follow.
        floor: height of the floor [m]; None without a floor.
        has_free_root: whether the root moves freely.
        pulled: pulled point in the world, shape (3,) [m]; None without one.
        scene: Props.
        forces: Forces on the touched parts of the body [N] and their points [m], both of shape
            (k, 3); while frames follow, of one of the last `FORCE_INTERVAL` frames.
    """

    generation: int
    number: int
    time: float
    poses: Array
    displacements: Mapping[str, Array]
    energy: Mapping[str, float]
    rate: float | None
    is_running: bool
    floor: float | None
    has_free_root: bool
    pulled: Array | None = None
    scene: Scene = NO_SCENE
    forces: tuple[Array, Array] | None = None

    def poses_by_segment(self, figure: Figure) -> dict[str, Array]:
        """Poses of the segments in the world, shape (4, 4)."""
        poses = np.tile(np.eye(4), (len(self.poses), 1, 1))
        poses[:, :3] = self.poses
        return dict(zip(figure.segments, poses, strict=True))


@dataclass(frozen=True)
class Refused:
    """Answer: a command could not be carried out, with the reason."""

    generation: int
    sentence: str
    command: Command


@dataclass(frozen=True)
class Paused:
    """Answer: the motion cannot be continued as it is."""

    generation: int
    sentence: str


@dataclass(frozen=True)
class Saved:
    """Answer: a file was written."""

    path: Path
    sentence: str


@dataclass(frozen=True)
class Died:
    """Notice: the process ended by itself; its code is negative for the number of a signal."""

    exit_code: int | None


Answer = LiveFrame | Refused | Paused | Saved | Died


class Engine:
    """A live simulation that carries out commands; it runs in the process."""

    def __init__(self, figure: Figure, folder: Path) -> None:
        """Import the simulation, which takes some seconds."""
        from generator.simulation.live.live_run import LiveRun  # imports Exudyn

        self._make_run = partial(LiveRun, figure, folder=folder)
        self._figure = figure
        self._run: LiveRun | None = None
        self._generation = 0
        self._pull: Pull | None = None
        self._point_before: Array | None = None
        self._energy: Mapping[str, float] = {}
        self._forces: tuple[Array, Array] | None = None
        self.is_running = False
        self._weight = live.DEFAULT_GRAVITY * sum(
            body.mass or 0.0 for body in figure.bodies.values()
        )
        self.pace = Pace(1.0)

    def carry_out(self, command: Command, now: float) -> list[Answer]:
        """Carry out a command at a time of a monotonic clock [s]; return the answers."""
        try:
            return self._answers(command, now)
        except MoverError as failure:
            return [Refused(self._generation, str(failure), command)]
        except OSError as failure:
            what = f"`{command.path.name}` cannot be saved: " if isinstance(command, Save) else ""
            return [Refused(self._generation, what + os_error_reason(failure), command)]

    def _answers(self, command: Command, now: float) -> list[Answer]:
        if isinstance(command, Begin):
            self._begin(command)
            return [self._frame()]
        run = self._run
        if run is None:
            return []
        match command:
            case Run():
                self.is_running = command.is_running
                self.pace.start(now)
                return [self._frame()]
            case OneFrame():
                self.is_running = False
                return self.advance(now)
            case Change():
                run.apply(command.change)
                return []
            case Pull():
                self._set_pull(command)
                return [] if self.is_running else [self._frame()]
            case Save():
                answers: list[Answer] = [self._save(command.path)]
                self.pace.start(monotonic())
                return answers

    def _begin(self, command: Begin) -> None:
        self._run, self._pull, self.is_running = None, None, False
        self._generation = command.generation
        run = self._make_run(command.start)
        for change in command.changes:
            run.apply(change)
        self._run, self.pace = run, Pace(command.start.frame)

    def advance(self, now: float) -> list[Answer]:
        """Compute a frame; return it, or the reason why the motion pauses."""
        run = self._run
        if run is None:
            return []
        answers: list[Answer] = []
        try:
            if self._pull is not None:
                self._apply_pull(self._pull)
            outcome = run.advance()
            sentence = "" if outcome.succeeded else outcome.message
        except MoverError as failure:
            sentence = str(failure)
        self.pace.advance(now, run.time)
        if sentence:
            self.is_running = False
            answers.append(Paused(self._generation, sentence))
        return [*answers, self._frame()]

    def _set_pull(self, command: Pull) -> None:
        assert self._run is not None
        before = self._pull
        if before is not None and (before.segment, before.point) != (
            command.segment,
            command.point,
        ):
            self._release(before)
        if command.target is None:
            self._release(command)
        else:
            self._pull = command

    def _release(self, pull: Pull) -> None:
        assert self._run is not None
        if self._pull is not None:
            self._run.apply(live.SetForce(pull.segment, pull.point, (0.0, 0.0, 0.0)))
        self._pull = self._point_before = None

    def _pulled_point(self, pull: Pull) -> Array:
        """Pulled point in the world, shape (3,) [m]."""
        assert self._run is not None
        pose = self._run.poses[pull.segment]
        return pose[:3, :3] @ np.array(pull.point) + pose[:3, 3]

    def _apply_pull(self, pull: Pull) -> None:
        """Apply the force of the pull to the next frame, and log it."""
        assert self._run is not None
        point = self._pulled_point(pull)
        before, self._point_before = self._point_before, point
        velocity = np.zeros(3) if before is None else (point - before) / self.pace.interval
        mass = effective_mass(self._figure.segments[pull.segment], pull.point)
        force = pull_force(mass, self._weight, point, velocity, np.array(pull.target))
        self._run.apply(live.SetForce(pull.segment, pull.point, force))

    def _frame(self) -> LiveFrame:
        run = self._run
        assert run is not None
        poses = run.poses
        if not self.is_running or run.frame % ENERGY_INTERVAL == 0:
            self._energy = run.energy
        if not self.is_running or run.frame % FORCE_INTERVAL == 0:
            self._forces = run.contact_forces
        return LiveFrame(
            self._generation,
            run.frame,
            run.time,
            np.array([poses[name][:3] for name in self._figure.segments]),
            dict(run.displacements),
            self._energy,
            self.pace.rate if self.is_running else None,
            self.is_running,
            run.floor,
            run.has_free_root,
            None if self._pull is None else self._pulled_point(self._pull),
            run.scene,
            self._forces,
        )

    def _save(self, requested: Path) -> Saved:
        assert self._run is not None
        run, figure = self._run, self._figure
        path = free_path(requested)
        written = written_text(requested, path)
        digest = None if figure.path is None else file_sha256(figure.path)
        name = figure.name if figure.path is None else figure.path.name
        if path.name.endswith(live.LIVE_FILE.suffix):
            write_atomic(path, live.write_live(run.log(name or "", digest)))
            return Saved(path, f"{written}: {run.time:.4g} s and its changes")
        recording = run.recording()
        motion_writer(path)(motion_from_recording(recording), path)
        return Saved(path, f"{written}: {recording.outcome.message}")


def serve(connection: Connection, figure: Figure, folder: Path) -> None:
    """Carry out commands until the other end of the connection is closed.

    Ctrl-C in the terminal is for the page, which then closes the connection.
    """
    serve_parent_only()
    try:
        engine = Engine(figure, folder)
        while True:
            now = monotonic()
            wait = engine.pace.wait(now) if engine.is_running else None
            if connection.poll(wait):
                answers = engine.carry_out(connection.recv(), monotonic())
            else:
                answers = engine.advance(monotonic())
            for answer in answers:
                connection.send(answer)
    except (EOFError, BrokenPipeError, ConnectionResetError):
        sys.exit()


class _Outbox:
    """Commands that wait to be sent."""

    def __init__(self) -> None:
        self._commands: deque[Command | None] = deque()
        self._has_more = Condition()

    def put(self, command: Command | None) -> None:
        """Add a command, or None after the last one; it replaces one that it supersedes."""
        with self._has_more:
            if self._commands and _supersedes(command, self._commands[-1]):
                self._commands.pop()
            self._commands.append(command)
            self._has_more.notify()

    def send_all(self, connection: Connection) -> None:
        """Send commands until None, or until the process has ended."""
        while True:
            with self._has_more:
                self._has_more.wait_for(lambda: self._commands)
                command = self._commands.popleft()
            if command is None:
                return
            try:
                connection.send(command)
            except OSError:  # the process has died: the reader notices
                return


def _supersedes(command: Command | None, other: Command | None) -> bool:
    """Return whether nothing remains of a command when another one follows it."""
    if isinstance(command, Change) and isinstance(other, Change):
        return type(command.change) is type(other.change)
    if isinstance(command, Pull) and isinstance(other, Pull):
        return (command.segment, command.point) == (other.segment, other.point)
    return False


class LiveProcess:
    """The process of a live simulation, started at the first command and again when it has died."""

    def __init__(self, figure: Figure, folder: Path) -> None:
        """Remember the figure, and the folder of its springs files."""
        self._figure, self._folder = figure, folder
        self._process: BaseProcess | None = None
        self._outbox: _Outbox | None = None
        self._lock = Lock()
        self._answers: list[Answer] = []

    @property
    def is_alive(self) -> bool:
        """Return whether the process runs."""
        return self._process is not None and self._process.is_alive()

    @property
    def process_id(self) -> int | None:
        """The number of the process; None without one."""
        return None if self._process is None else self._process.pid

    def send(self, command: Command) -> None:
        """Send a command; `Begin` starts the process if it does not run.

        A thread sends it: a process that compiles does not take what it is sent. Of changes of one
        quantity that wait in a row, and of pulls of one point, the last one is sent.
        """
        if isinstance(command, Begin) and not self.is_alive:
            self._start()
        if self._outbox is not None:
            self._outbox.put(command)

    def take(self) -> Sequence[Answer]:
        """Return the answers since the last call, in order; of all frames only the newest."""
        with self._lock:
            answers, self._answers = self._answers, []
        return answers

    def close(self) -> None:
        """End the process."""
        process, outbox = self._process, self._outbox
        self._process = self._outbox = None
        if outbox is not None:
            outbox.put(None)
        if process is not None:
            process.terminate()
            process.join(1.0)
            if process.is_alive():
                process.kill()
                process.join(1.0)

    def _start(self) -> None:
        self.close()
        context = multiprocessing.get_context("spawn")
        connection, other = context.Pipe()
        process = context.Process(
            target=serve, args=(other, self._figure, self._folder), name="live", daemon=True
        )
        with blocked_interrupt():
            process.start()
        other.close()
        self._process, self._outbox = process, _Outbox()
        Thread(target=self._read, args=(connection, process, self._outbox), daemon=True).start()

    def _read(self, connection: Connection, process: BaseProcess, outbox: _Outbox) -> None:
        """Take what the process sends until it ends; another thread sends the commands."""
        sender = Thread(target=outbox.send_all, args=(connection,), daemon=True)
        sender.start()
        while True:
            try:
                answer: Answer = connection.recv()
            except (EOFError, OSError):
                break
            with self._lock:
                if isinstance(answer, LiveFrame):
                    self._answers = [
                        each for each in self._answers if not isinstance(each, LiveFrame)
                    ]
                self._answers.append(answer)
        outbox.put(None)
        sender.join()
        connection.close()
        if self._process is process:  # it was not closed
            process.join(1.0)
            with self._lock:
                self._answers.append(Died(process.exitcode))
