"""Runs at tolerances a decade apart until two agree.

The estimated error is twice the difference between two runs whose tolerances are a decade apart.
Two runs agree if the estimate does not exceed the tolerance in any frame and both pass the same
breakpoints; different breakpoints are accepted if the previous pair of runs agreed as well. The
finer run of the pair is the result, so its error is usually far below the estimate.

A fall is chaotic, so that by default its two runs tell until when the tolerance is met.
"""

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from threading import Event, Thread

import numpy as np

from generator.recording import EARLY_STOP_ENDINGS, Ending
from generator.rotations import Array
from generator.simulation.compiled.frames import record_frames
from generator.simulation.compiled.layout import (
    COORDINATE,
    KIND,
    MEASURED_FORM,
    ORIENTATION,
    RECORDED_COLUMNS,
    SLIDE,
    THREE_ANGLES,
    IndexArray,
    Scratch,
)
from generator.simulation.compiled.marching import COLLAPSED, FINISHED, PAUSED, TURNED_OVER, march
from generator.simulation.compiled.mechanism import CompiledModel
from generator.simulation.compiled.runge_kutta import (
    COUNTS,
    EVENTS,
    FRAME,
    MAX_EVENTS,
    NEEDS_FIRST_STAGE,
    PATH,
    REJECTED,
    STEPS,
    SWITCH,
    TIME,
    Progress,
)
from generator.simulation.compiled.tableau import BS23, DOP853, MAX_STAGES

DECADE = 0.1
"""Ratio of the tolerances of two runs that are compared."""

FIRST_SHARE, FIRST_SHARE_WITH_BREAKPOINTS = 0.03, 0.01
"""Tolerance of the first run as a share of the one asked for: chosen so that two runs usually
suffice. The errors of located breakpoints grow as well."""

FIRST_SHARE_WITH_CONTACT = 1e-2
"""The same with contact: a fall amplifies errors some thousand times until it comes to rest."""

ESTIMATE_FACTOR = 2.0
"""Estimated error over the difference of two runs. The finer run usually errs a tenth of it, but in
a few of a hundred falls the errors of both are alike, up to 1.7 times their difference."""

_RATIO_AFTER_EQUAL_STEPS = 1e-4
"""Ratio of the tolerances of a run and the next where the last two took the same steps."""

MAX_RUNS = 8
"""Number of runs after which a difference above the tolerance is accepted and reported."""

SMALLEST_TOLERANCE = 1e-13
"""Tolerance of the steps below which rounding errors dominate."""

MAX_PATH_STEPS = 200_000
"""Number of steps of a run of which all are kept."""

PATH_THINNING = 10
"""Of later steps, each of this number is kept; a run of hours would not fit into memory."""

_FIRST_STEP = 1e-3
"""First step of a run [s]; the error control changes it at once."""

_LINK_STEPS_PER_CALL = 16_000
"""Steps times links between two checks of the clock and for Ctrl-C: some 25 ms."""

_PATH_STEPS = 4_000
"""Steps for whose records there is memory; those of a fall of a study fit."""

_MIN_STEPS_PER_CALL = 20
"""Steps between two checks for mechanisms of many links."""

MAX_STEPS_PER_SECOND = 100_000
"""Steps per simulated second above which a motion is called stiff, four times as many with contact.
A step costs some 25 us, with contact a quarter, so that the implicit method of Exudyn is cheaper
above that."""

_MIN_STIFF_TIME = 1e-3
"""Shortest simulated time by which `MAX_STEPS_PER_SECOND` limits the steps [s]."""

_MAX_DIVERGENCE = 0.1
"""Difference above which two runs follow different motions, and predicts nothing [rad or m]."""

_TARGET_SHARE = 0.5
"""Share of the tolerance that the next difference should have."""


class StiffMotionError(Exception):
    """A motion that needs so many steps that an implicit method is cheaper."""


@dataclass(frozen=True)
class CompiledRun:
    """One run.

    Attributes:
        times: times of the f frames reached, shape (f,) [s].
        states: shape (f, n).
        links: recorded columns of every link, shape (f, links, RECORDED_COLUMNS).
        rates: rates of the states, shape (f, n).
        wrenches: force of each row of a closing joint on its second link and moment about the
            world's origin, shape (f, rows, 6) [N, N m]; zero for links.
        ending: reason of its end.
        last_time: time reached [s].
        turned_joint: the joint that reached 180 deg, if one did.
        tolerance: tolerance of its steps.
        steps: accepted and rejected steps.
        event_times: event times of the breakpoints passed [s].
        event_switches: switching functions of the breakpoints.
        path_times: start, and ends of the steps, shape (p,) [s]; empty without contact. See
            `MAX_PATH_STEPS`.
        path_rows: their records of contact, shape (p, r).
    """

    times: Array
    states: Array
    links: Array
    rates: Array
    wrenches: Array
    ending: Ending
    last_time: float
    turned_joint: str | None
    tolerance: float
    steps: int
    event_times: Array
    event_switches: IndexArray
    path_times: Array
    path_rows: Array


@dataclass(frozen=True)
class AgreedRun:
    """The finest run, and its difference from the one before.

    Attributes:
        run: the finest run.
        errors: estimated errors of its frames, shape (f,) [rad or m].
        steps: accepted and rejected steps of all runs.
        runs: number of runs.
        disturbed: a run from another start; None if there was none.
    """

    run: CompiledRun
    errors: Array
    steps: int
    runs: int
    disturbed: CompiledRun | None = None


Watch = Callable[[int, float, float], None]
"""Called with the number of the run, its mean step [s] and its simulated time [s]."""


def run_once(
    model: CompiledModel,
    times: Array,
    tolerance: float,
    deadline: float = np.inf,
    watch: Callable[[float, float], None] | None = None,
    stopped: Event | None = None,
    max_steps_per_second: float = MAX_STEPS_PER_SECOND,
    *,
    records_steps: bool = False,
    is_implicit: bool = False,
) -> CompiledRun:
    """Run a model from its initial state.

    Args:
        model: its branches are set anew.
        times: times of the frames, shape (f,) [s]; the first is the start.
        tolerance: tolerance of the steps.
        deadline: `time.monotonic()` after which to stop.
        watch: called with the mean step and the simulated time [s] several times a second.
        stopped: set by another thread to interrupt the run.
        max_steps_per_second: steps per simulated second above which a motion is called stiff.
        records_steps: whether to record contact after every step.
        is_implicit: whether to use the linearly implicit method, for models without constraints
            beyond the tree.

    Raises:
        StiffMotionError: the motion needs too many steps.
    """
    if is_implicit:
        added = np.zeros((len(model.mechanism.links), 6))
        model = replace(model, scratch=model.scratch._replace(added_inertia=added))
    mechanism = model.mechanism
    mechanism.branches[:] = 1.0
    start, stop = float(times[0]), float(times[-1])
    progress = start_progress(
        model.initial_state,
        start,
        min(_FIRST_STEP, stop - start),
        len(mechanism.branches),
        model.integrals,
        path=(max(_PATH_STEPS, 2 * _steps_per_call(model)), model.step_record)
        if records_steps
        else (0, 0),
    )
    states = np.empty((len(times), len(model.initial_state)))
    if len(mechanism.rows):
        equations, spare = model.equations, np.empty_like(progress.state)
        equations.project.function(
            equations.laws, mechanism, model.scratch, 0, start, progress.state, spare
        )
    states[0] = progress.state
    progress.counts[FRAME] = 1
    path = _Path(progress, _steps_per_call(model))
    ending = _march_to_end(
        model,
        progress,
        path,
        _implicit_march(model, progress) if is_implicit else _explicit_march(model, progress),
        times,
        states,
        tolerance,
        deadline,
        watch,
        stopped,
        max_steps_per_second,
    )
    turned = None
    if ending is Ending.TURNED_OVER:
        row = int(progress.counts[SWITCH]) - len(mechanism.branches) + len(mechanism.measured)
        turned = model.measured_joints[row]
        if mechanism.measured[row, MEASURED_FORM] == THREE_ANGLES:
            ending = Ending.POLE
    count = int(progress.counts[FRAME])
    states = states[:count]
    model.scratch.added_inertia[:] = 0.0
    links = np.empty((count, len(mechanism.links), RECORDED_COLUMNS))
    rates = np.empty_like(states)
    wrenches = np.empty((count, len(mechanism.rows), 6))
    record_frames(
        model.equations, mechanism, model.scratch, times[:count], states, links, rates, wrenches
    )
    events = min(int(progress.counts[EVENTS]), MAX_EVENTS)
    return CompiledRun(
        times[:count],
        states,
        links,
        rates,
        wrenches,
        ending,
        float(progress.clock[TIME]),
        turned,
        tolerance,
        int(progress.counts[STEPS] + progress.counts[REJECTED]),
        progress.event_times[:events].copy(),
        progress.event_switches[:events].copy(),
        *path.arrays(),
    )


class _Path:
    """Ends of the accepted steps of a run with contact, collected from call to call.

    Beyond `MAX_PATH_STEPS` those of the last two calls are kept, and a share of those before. They
    stay in the memory of the integration until that of another call may not fit.
    """

    def __init__(self, progress: Progress, steps_per_call: int) -> None:
        """Begin without steps."""
        self._progress, self._steps_per_call = progress, steps_per_call
        self._times = [progress.path_times[:0]]
        self._rows = [progress.path_rows[:0]]
        self._size = self._begin = 0
        self._is_whole = True

    def collect(self) -> None:
        """Take the steps that were kept since the last call."""
        progress, count = self._progress, int(self._progress.counts[PATH])
        if self._size - sum(map(len, self._times[-2:])) >= MAX_PATH_STEPS:
            for parts in (self._times, self._rows):
                parts[-2] = parts[-2][::PATH_THINNING].copy()
            self._is_whole = False
        self._size += count - self._begin
        self._times.append(progress.path_times[self._begin : count])
        self._rows.append(progress.path_rows[self._begin : count])
        self._begin = count
        if count + self._steps_per_call >= len(progress.path_times):
            for parts in (self._times, self._rows):
                parts[:] = [part.copy() if part.base is not None else part for part in parts]
            self._progress.counts[PATH] = self._begin = 0
            self._is_whole = False

    def arrays(self) -> tuple[Array, Array]:
        """Times and records of all steps."""
        if self._is_whole:
            return self._progress.path_times[: self._begin], self._progress.path_rows[: self._begin]
        return np.concatenate(self._times), np.concatenate(self._rows)


def _steps_per_call(model: CompiledModel) -> int:
    """Steps between two checks of the clock and for Ctrl-C."""
    return max(_MIN_STEPS_PER_CALL, _LINK_STEPS_PER_CALL // len(model.mechanism.links))


def record_links(model: CompiledModel, times: Array, states: Array) -> Array:
    """Recorded columns of every link in f states, shape (f, links, RECORDED_COLUMNS).

    Args:
        model: model whose branches are set anew.
        times: times of the states, shape (f,) [s].
        states: shape (f, n).
    """
    links = np.empty((len(times), len(model.mechanism.links), RECORDED_COLUMNS))
    wrenches = np.empty((len(times), len(model.mechanism.rows), 6))
    rates = np.empty_like(states)
    record_frames(
        model.equations, model.mechanism, model.scratch, times, states, links, rates, wrenches
    )
    return links


_March = Callable[[Array, Array, float, float, int], int]
"""Continues an integration; see `march` for its arguments from `frames` on."""


def _explicit_march(model: CompiledModel, progress: Progress) -> _March:
    method = BS23 if model.has_contact else DOP853
    return partial(
        march, method, model.equations, model.mechanism, model.scratch, progress, model.balls
    )


def _implicit_march(model: CompiledModel, progress: Progress) -> _March:
    from generator.simulation.compiled.implicit import make_tangents, march_implicitly

    memory = model.scratch, make_tangents(model.mechanism), progress
    numbers = model.balls, min(model.rate_places, default=0)
    return partial(march_implicitly, model.equations, model.mechanism, *memory, *numbers)


def _march_to_end(
    model: CompiledModel,
    progress: Progress,
    path: _Path,
    advance: _March,
    times: Array,
    states: Array,
    tolerance: float,
    deadline: float,
    watch: Callable[[float, float], None] | None,
    stopped: Event | None,
    max_steps_per_second: float,
) -> Ending:
    """Integrate to the last frame in calls of some steps, and return the ending.

    The arguments are those of `run_once`, and the march; `states` are those of the frames, shape
    (f, n), a result.
    """
    start, stop = float(times[0]), float(times[-1])
    steps_per_call, has_contact = _steps_per_call(model), model.has_contact
    while True:
        try:
            status = advance(times, states, stop, tolerance, steps_per_call)
            path.collect()
            steps = int(progress.counts[STEPS] + progress.counts[REJECTED])
            passed = float(progress.clock[TIME]) - start
            if watch is not None:
                watch(passed / max(steps, 1), start + passed)
            if stopped is not None and stopped.is_set():
                return Ending.INTERRUPTED
        except KeyboardInterrupt:
            path.collect()  # mostly it comes when `march` returns
            return Ending.INTERRUPTED
        if status == FINISHED:
            return Ending.DONE
        if status == COLLAPSED and not len(model.mechanism.rows):
            # Without closed loops and links the equations hold in every pose.
            raise StiffMotionError("the motion needs steps that are too short for rounding")
        if status == COLLAPSED:
            return Ending.SOLVER_FAILED
        if status == TURNED_OVER:
            return Ending.TURNED_OVER
        assert status == PAUSED
        # A step of BS23 costs a quarter of one of DOP853.
        bound = max_steps_per_second * (DOP853.end_stage // BS23.end_stage if has_contact else 1)
        if steps > bound * max(passed, _MIN_STIFF_TIME):
            raise StiffMotionError(f"the motion needs more than {bound:,} steps a second")
        if time.monotonic() > deadline:
            return Ending.TOO_LONG


def start_progress(
    state: Array,
    time: float,
    step: float,
    switches: int,
    integrals: int,
    max_events: int = MAX_EVENTS,
    path: tuple[int, int] = (0, 0),
) -> Progress:
    """Return the integration of a state from a time with a first step [s].

    Args:
        state: shape (n,); copied.
        time: [s].
        step: length of the first step [s].
        switches: number of switching functions.
        integrals: number of integrals of powers and forces, which come last in a state.
        max_events: number of breakpoints whose times are kept.
        path: number of steps that are recorded, and size of their records.
    """
    size = len(state)
    counts = np.zeros(COUNTS, dtype=np.int64)
    counts[NEEDS_FIRST_STAGE] = 1
    return Progress(
        state.copy(),
        np.array([time, step, 0.0]),
        counts,
        np.zeros(max_events),
        np.zeros(max_events, dtype=np.int64),
        np.zeros((MAX_STAGES, size)),
        np.zeros(size),
        np.zeros(size),
        np.zeros(size),
        np.zeros(size),
        np.zeros((7, size)),
        np.zeros((2, size - integrals)),
        np.zeros(switches, dtype=np.int64),
        np.zeros(switches),
        np.zeros((MAX_STAGES, switches)),
        np.zeros(path[0]),
        np.zeros(path),
    )


def run_until_agreed(
    model: CompiledModel,
    times: Array,
    tolerance: float,
    deadline: float = np.inf,
    watch: Watch | None = None,
    max_steps_per_second: float = MAX_STEPS_PER_SECOND,
    disturbed_start: Array | None = None,
    threads: int = 2,
    *,
    records_steps: bool = False,
    certify: bool = False,
) -> AgreedRun:
    """Repeat a run at smaller tolerances until two agree within `tolerance`.

    With contact, two runs tell until when the tolerance is met, unless it is to be certified.

    Args:
        model: its branches are set anew.
        times: times of the frames, shape (f,) [s].
        tolerance: tolerance of the joint angles [rad].
        deadline: see `run_once`, as the next two.
        watch: see `Watch`.
        max_steps_per_second: see `run_once`.
        disturbed_start: another initial state, from which a run at ten times the tolerance of the
            coarser run starts.
        threads: 2 to run the coarser one and that from the disturbed start beside the finer one.
        records_steps: whether the finer runs and the disturbed one record contact.
        certify: whether to repeat runs with contact until the whole motion is within the tolerance.

    Raises:
        StiffMotionError: the motion needs too many steps.
    """
    has_contact = model.has_contact
    has_breakpoints = len(model.mechanism.branches) > len(model.mechanism.measured)
    share = FIRST_SHARE_WITH_BREAKPOINTS if has_breakpoints else FIRST_SHARE
    share = FIRST_SHARE_WITH_CONTACT if has_contact else share
    first = max(share * tolerance, SMALLEST_TOLERANCE)

    def run_number(
        number: int,
        step_tolerance: float,
        stopped: Event | None = None,
        start: Array = model.initial_state,
        *,
        records_steps: bool = False,
    ) -> CompiledRun:
        def report(step: float, now: float) -> None:
            if watch is not None and stopped is None:
                watch(number, step, now)

        own = replace(_fork(model), initial_state=start)
        return run_once(
            own,
            times,
            step_tolerance,
            deadline,
            report,
            stopped,
            max_steps_per_second,
            records_steps=records_steps,
        )

    def run_beside(stopped: Event) -> tuple[CompiledRun, CompiledRun | None]:
        coarse, disturbed = run_number(1, first, stopped), None
        if disturbed_start is not None and coarse.ending not in EARLY_STOP_ENDINGS:
            with suppress(StiffMotionError):
                disturbed = run_number(
                    3, first / DECADE, stopped, disturbed_start, records_steps=records_steps
                )
        return coarse, disturbed

    runs, disturbed = _run_together(
        partial(run_number, 2, DECADE * first, records_steps=records_steps), run_beside, threads
    )
    agreed_before = False
    while not _has_stopped(runs):
        before, latest = runs[-2:]
        if has_contact and not certify and not _have_same_steps(before, latest):
            break
        errors = estimated_errors(model, before, latest)
        agrees = _agree(before, latest, errors, tolerance)
        if agrees and (has_contact or agreed_before or have_same_breakpoints(before, latest)):
            break
        step_tolerance = _next_tolerance(runs, float(errors[-1]), tolerance)
        if len(runs) == MAX_RUNS or step_tolerance < SMALLEST_TOLERANCE:
            break
        runs.append(run_number(len(runs) + 1, step_tolerance, records_steps=records_steps))
        agreed_before = agrees
    return replace(_finest_agreed(runs, model), disturbed=disturbed)


def _has_stopped(runs: list[CompiledRun]) -> bool:
    """Return whether one of the runs was interrupted or reached the wall-time limit."""
    return any(run.ending in EARLY_STOP_ENDINGS for run in runs)


def _agree(one: CompiledRun, other: CompiledRun, errors: Array, tolerance: float) -> bool:
    """Return whether the estimated errors of the finer of two runs are below the tolerance."""
    has_same_frames = len(one.times) == len(other.times)
    return bool(errors[-1] <= tolerance) and has_same_frames and not _have_same_steps(one, other)


def _run_together(
    run_fine: Callable[[], CompiledRun],
    run_beside: Callable[[Event], tuple[CompiledRun, CompiledRun | None]],
    threads: int,
) -> tuple[list[CompiledRun], CompiledRun | None]:
    """Run the fine one here, and the coarse and the disturbed one beside it, or afterwards.

    Compiled code runs beside other threads. Returns the coarse and the fine run, and the disturbed
    one, which is None where it stopped early.
    """
    stopped, results = Event(), list[tuple[CompiledRun, CompiledRun | None] | BaseException]()

    def run_others() -> None:
        try:
            results.append(run_beside(stopped))
        except BaseException as failure:  # raised again in the calling thread
            results.append(failure)

    assert threads in (1, 2)
    thread = Thread(target=run_others, daemon=True)
    if threads > 1:
        thread.start()
    try:
        fine = run_fine()
        if fine.ending in EARLY_STOP_ENDINGS:
            stopped.set()
    except BaseException:
        stopped.set()
        raise
    finally:
        if threads > 1:
            thread.join()
    if threads == 1:
        run_others()
    (result,) = results
    if isinstance(result, BaseException):
        raise result
    coarse, disturbed = result
    if not stopped.is_set():
        for other in (coarse, disturbed):
            if other is not None and other.ending in EARLY_STOP_ENDINGS:
                fine = replace(fine, ending=other.ending)
    if disturbed is not None and disturbed.ending in EARLY_STOP_ENDINGS:
        disturbed = None
    return [coarse, fine], disturbed


def _fork(model: CompiledModel) -> CompiledModel:
    """Return the same model with branches and working memory of its own."""
    mechanism = model.mechanism._replace(branches=model.mechanism.branches.copy())
    scratch = Scratch._make(part.copy() for part in model.scratch)
    return replace(model, mechanism=mechanism, scratch=scratch)


def _next_tolerance(runs: list[CompiledRun], difference: float, tolerance: float) -> float:
    """Tolerance of the next run: a decade below the last, or further where that cannot suffice.

    The difference of the last two runs is the error of the first of them. The next difference will
    be smaller by the ratio of the tolerances.
    """
    last = runs[-1].tolerance
    if _have_same_steps(*runs[-2:]):
        return (
            max(_RATIO_AFTER_EQUAL_STEPS * last, SMALLEST_TOLERANCE)
            if last > SMALLEST_TOLERANCE
            else 0.0
        )
    is_sufficient = difference * DECADE <= _TARGET_SHARE * tolerance
    if is_sufficient or not difference <= _MAX_DIVERGENCE:  # or not finite
        return DECADE * last
    return max(DECADE * last * _TARGET_SHARE * tolerance / (difference * DECADE), DECADE**2 * last)


def _finest_agreed(runs: list[CompiledRun], model: CompiledModel) -> AgreedRun:
    """Return the last run that got furthest, with its difference from the one before.

    Of parallel runs that were stopped, the one before may have hardly begun; then the difference is
    that from the run that got furthest.
    """
    steps, last, before = sum(run.steps for run in runs), runs[-1], runs[-2]
    if last.ending in EARLY_STOP_ENDINGS:
        if len(runs) > 2 and len(before.times) > len(last.times):
            last = replace(before, ending=last.ending)
            runs = runs[:-1]
        before = max(runs[:-1], key=lambda run: (len(run.times), -run.tolerance))
    errors = np.full(len(last.times), np.inf)
    known = estimated_errors(model, before, last)
    errors[: len(known)] = known
    return AgreedRun(last, errors, steps, len(runs))


def _have_same_steps(one: CompiledRun, other: CompiledRun) -> bool:
    """Return whether two runs took the same steps, because these satisfy both tolerances.

    Their difference is then zero and does not estimate their error.
    """
    return np.array_equal(one.states, other.states)


def have_same_breakpoints(one: CompiledRun, other: CompiledRun) -> bool:
    """Return whether two runs have passed each breakpoint equally often.

    Then they have passed them in one order, except for breakpoints so near in time that the error
    of their times exchanges them.
    """
    return np.array_equal(np.sort(one.event_switches), np.sort(other.event_switches))


def estimated_errors(model: CompiledModel, one: CompiledRun, other: CompiledRun) -> Array:
    """Return the estimated largest error of the finer of two runs up to each common frame."""
    return ESTIMATE_FACTOR * np.maximum.accumulate(joint_differences(model, one, other))


def joint_differences(model: CompiledModel, one: CompiledRun, other: CompiledRun) -> Array:
    """Return the largest angle between the joints of two runs in each common frame [rad].

    Of slides, the difference of their displacements [m].
    """
    count = min(len(one.times), len(other.times))
    first, second = (_joint_quaternions(model, run.links[:count]) for run in (one, other))
    chord = np.minimum(
        np.linalg.norm(first - second, axis=-1), np.linalg.norm(first + second, axis=-1)
    )
    angles = 4.0 * np.arcsin(np.minimum(0.5 * chord, 1.0))
    links = model.mechanism.links
    slides = links[(links[:, KIND] == SLIDE) & (links[:, COORDINATE] >= 0), COORDINATE]
    shifts = np.abs(one.states[:count, slides] - other.states[:count, slides])
    return np.max(np.concatenate([angles, shifts], axis=1), axis=1, initial=0.0)


def _joint_quaternions(model: CompiledModel, links: Array) -> Array:
    """Orientation of the outboard links of all joints in the inboard ones, shape (f, j, 4)."""
    quaternions = links[:, :, ORIENTATION : ORIENTATION + 4]
    ground = np.zeros((len(links), 1, 4))
    ground[:, :, 0] = 1.0
    quaternions = np.concatenate([quaternions, ground], axis=1)
    p, q = (quaternions[:, model.joint_links[:, k]] for k in range(2))
    scalar = np.sum(p * q, axis=-1)
    vector = p[..., :1] * q[..., 1:] - q[..., :1] * p[..., 1:] - np.cross(p[..., 1:], q[..., 1:])
    return np.concatenate([scalar[..., None], vector], axis=-1)
