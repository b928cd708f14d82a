"""`mover simulate`: from a figure to the files of its motion."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from math import isfinite
from os.path import realpath
from pathlib import Path
from typing import TYPE_CHECKING, Any

from generator.animation import UnknownFormatError, format_of, write_recording
from generator.commands.answer import Answer, ExitCode, UsageError
from generator.commands.inputs import figure_of, insist_on_motion, springs_of
from generator.commands.interrupt import interrupted_at_a_frame
from generator.commands.options import chains_of, displacements_given, vector_given
from generator.commands.outputs import insist_writable, unwritable
from generator.commands.postures import start_of
from generator.commands.summary import failure_text, summary_data, summary_text
from generator.engine.door import open_exudyn
from generator.engine.plan import Plan
from generator.errors import Fault, InputError, errors_among
from generator.figure import Figure
from generator.reader.loads_file import examine_loads
from generator.recording import Recording
from generator.whole_file import reason_of
from springs import Joining

if TYPE_CHECKING:
    from generator.engine.simulate import Progress

MOST_FRAMES = 1_000_000
"""A recording of more frames would fill the memory."""


Watch = Callable[["Progress"], None]

Watcher = Callable[[float, float], AbstractContextManager[Watch | None]]
"""Opens what is told the progress of a run from a start to a stop [s]."""


def unwatched(start: float, stop: float) -> AbstractContextManager[None]:
    """Tells nobody."""
    del start, stop
    return nullcontext()


@dataclass(frozen=True)
class Request:
    """The command line of `mover simulate`; None where an option is not given.

    Times in s, `tolerance` in rad; `displacements` and `velocities` are of the form `JOINT=a,b,c`
    in degrees or cm (a second), `gravity` of the form `X,Y,Z` in m/s^2.
    """

    figure: str
    stop: float | None = None
    start: float | None = None
    frame: float | None = None
    tolerance: float | None = None
    step: float | None = None
    springs: str | None = None
    law: str | None = None
    gravity: str | None = None
    free_root: bool = False
    pose: Path | None = None
    displacements: Sequence[str] = ()
    velocities: Sequence[str] = ()
    loads: Path | None = None
    python_torques: bool = False
    wall_limit: float | None = None
    outputs: Sequence[Path] = ()


def simulate(request: Request, watcher: Watcher = unwatched) -> Answer:
    """Run what is asked for and write the files.

    Args:
        request: the command line.
        watcher: opened for the run, and told the progress after every frame.

    Raises:
        UsageError: an option cannot be read or does not fit the figure.
        InputError: the figure, its springs or loads are wrong, or a file cannot be written.
        MoverError: the figure cannot be built as asked.
    """
    plan = _bare_plan(request)
    _check_outputs(request.outputs)
    figure, warnings = figure_of(request.figure)
    insist_on_motion(figure, warnings)
    plan, more = _whole_plan(plan, request, figure)
    inputs = (figure.path, request.springs, request.loads, request.pose)
    insist_writable(request.outputs, inputs, reader="run")
    open_exudyn()
    from generator.engine.simulate import simulate as run  # Exudyn takes its time

    with interrupted_at_a_frame() as check, watcher(plan.start, plan.stop) as watch:

        def reached(progress: "Progress") -> None:
            if watch is not None:
                watch(progress)
            check()

        recording = run(figure, plan, reached)
        _write(recording, figure, request.outputs)
    failure = failure_text(recording, request.outputs)
    return Answer(
        text=summary_text(recording, request.outputs),
        data=summary_data(request.figure, recording, request.outputs),
        faults=(*warnings, *more),
        code=ExitCode.RUN_FAILED if failure else ExitCode.GOOD,
        failure=failure,
    )


def _bare_plan(request: Request) -> Plan:
    """The part of the plan that needs no figure. Raises UsageError."""
    if request.step is not None and request.tolerance is not None:
        raise UsageError("--step fixes the step, so --tolerance has no meaning beside it")
    given: dict[str, Any] = {
        "stop": request.stop,
        "start": request.start,
        "frame": request.frame,
        "tolerance": request.tolerance,
        "step": request.step,
        "wall_limit": request.wall_limit,
    }
    given = {name: value for name, value in given.items() if value is not None}
    for name, value in given.items():
        if not isfinite(value):
            raise UsageError(f"--{name.replace('_', '-')} {value}: the number must be finite")
    if request.gravity is not None:
        given["gravity"] = vector_given("--gravity", request.gravity)
    if request.law is not None:
        given["joining"] = Joining(request.law)
    try:
        plan = Plan(free_root=request.free_root, python_torques=request.python_torques, **given)
    except ValueError as failure:
        raise UsageError(str(failure)) from None
    if (plan.stop - plan.start) / plan.frame > MOST_FRAMES:
        raise UsageError(
            f"the run would have more than {MOST_FRAMES:,} frames; "
            "use a longer --frame or an earlier --stop"
        )
    return plan


def _whole_plan(plan: Plan, request: Request, figure: Figure) -> tuple[Plan, tuple[Fault, ...]]:
    """The plan with all that needs the figure, and warnings."""
    springs, faults = springs_of(figure, request.springs, plan.joining)
    loads = ()
    if request.loads is not None:
        reading = examine_loads(request.loads, figure)
        if errors_among(reading.faults):
            raise InputError((*faults, *reading.faults))
        loads, faults = reading.loads, (*faults, *reading.faults)
    displacements, more = start_of(figure, request.pose, request.displacements)
    whole = replace(
        plan,
        springs=springs,
        loads=loads,
        displacements=displacements,
        velocities=displacements_given(
            "--velocity", request.velocities, chains_of(figure, free_root=plan.free_root)
        ),
    )
    return whole, (*faults, *more)


def _check_outputs(paths: Sequence[Path]) -> None:
    """Raise UsageError for a suffix that names no format, and for one file given twice."""
    targets: set[str] = set()
    for path in paths:
        try:
            format_of(path)
        except UnknownFormatError as failure:
            raise UsageError(str(failure)) from None
        if realpath(path) in targets:
            raise UsageError(f"-o {path}: the file was given before")
        targets.add(realpath(path))


def _write(recording: Recording, figure: Figure, paths: Sequence[Path]) -> None:
    for path in paths:
        try:
            write_recording(recording, figure, path)
        except OSError as failure:
            raise InputError((unwritable(path, reason_of(failure)),)) from None
