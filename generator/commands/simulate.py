"""`mover simulate`: from a figure to the files of its motion."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from generator.animation import clip_of_recording
from generator.commands.answer import Answer, ExitCode, UsageError
from generator.commands.driving import Holding, holding_of
from generator.commands.inputs import figure_of, insist_on_motion, springs_of
from generator.commands.interrupt import interrupted_at_a_frame
from generator.commands.motion_files import (
    insist_on_formats,
    losses_data,
    losses_text,
    write_motion,
)
from generator.commands.options import chains_of, displacements_given, vector_given
from generator.commands.outputs import insist_writable
from generator.commands.postures import start_of
from generator.commands.summary import failure_text, summary_data, summary_text
from generator.engine.door import open_exudyn
from generator.engine.plan import Plan
from generator.errors import Fault, InputError, errors_among
from generator.figure import Figure
from generator.reader.loads_file import examine_loads
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
    links: Path | None = None
    locks: Sequence[str] = ()
    drive: Path | None = None
    driven: Sequence[str] = ()
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
    insist_on_formats(request.outputs)
    figure, warnings = figure_of(request.figure)
    insist_on_motion(figure, warnings)
    plan, more = _whole_plan(plan, request, figure)
    files = (request.loads, request.pose, request.links, request.drive)
    inputs = (figure.path, request.springs, *files)
    insist_writable(request.outputs, inputs, reader="run")
    open_exudyn()
    from generator.engine.simulate import simulate as run  # Exudyn takes its time

    with interrupted_at_a_frame() as check, watcher(plan.start, plan.stop) as watch:

        def reached(progress: "Progress") -> None:
            if watch is not None:
                watch(progress)
            check()

        recording = run(figure, plan, reached)
        written = write_motion(clip_of_recording(recording, figure), request.outputs)
    lost = losses_text(written)
    failure = failure_text(recording, request.outputs)
    return Answer(
        text="\n".join([summary_text(recording, request.outputs), *([lost] if lost else [])]),
        data={
            **summary_data(request.figure, recording, request.outputs),
            "losses": losses_data(written),
        },
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
    holding, others = holding_of(
        figure, request.links, request.locks, request.drive, request.driven
    )
    plan = _over_the_drives(plan, request, holding)
    holding.insist_on(
        figure,
        request.displacements,
        plan.start,
        request.velocities,
        free_root=plan.free_root,
    )
    whole = _replaced(
        plan,
        links=holding.links,
        locked=holding.locked,
        drives=holding.drives,
        springs=springs,
        loads=loads,
        displacements=displacements,
        velocities=displacements_given(
            "--velocity", request.velocities, chains_of(figure, free_root=plan.free_root)
        ),
    )
    return whole, (*faults, *more, *others)


def _over_the_drives(plan: Plan, request: Request, holding: Holding) -> Plan:
    """The plan from the first to the last time that all drives tell of, unless others are given."""
    if not holding.drives:
        return plan
    drives = holding.drives.values()
    first, last = max(one.start for one in drives), min(one.stop for one in drives)
    start = first if request.start is None else plan.start
    stop = last if request.stop is None else plan.stop
    if start >= last:
        raise UsageError(
            f"the run starts at {start:g} s, but the drives are from {first:g} s to {last:g} s"
        )
    return _replaced(plan, start=start, stop=stop)


def _replaced(plan: Plan, **changes: Any) -> Plan:
    """The plan with changes. Raises UsageError for a plan that there is not."""
    try:
        return replace(plan, **changes)
    except ValueError as failure:
        raise UsageError(str(failure)) from None
