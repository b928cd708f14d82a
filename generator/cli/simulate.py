"""`mover simulate`: from a figure to the files of its motion.

What holds joints in a simulation: `--links`, `--lock` and `--drive`, read for a figure.

What a run says of itself when it is over.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from math import isclose, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from generator.cli.answer import CommandResult, ExitCode, UsageError, finite_or_none, format_table
from generator.cli.inputs import (
    load_figure,
    require_simulatable,
    springs_from_option,
    start_displacements_from_options,
)
from generator.cli.options import displacements_from_options, settable_chains, vector_from_option
from generator.cli.outputs import (
    check_motion_formats,
    check_writable,
    losses_data,
    losses_text,
    write_motion,
)
from generator.cli.progress import defer_interrupt
from generator.diagnostics import Diagnostic, InputError, spelling_hint
from generator.drive import Drive
from generator.figure import Figure
from generator.input_files.loads import parse_loads_file
from generator.kinematics.links import Links, parse_links_file
from generator.kinematics.placement import Displacements, initial_displacements
from generator.kinematics.prescribed import PrescribedMotion, PrescriptionError
from generator.kinematics.tree import build_tree
from generator.motion_files import motion_from_recording
from generator.motion_files.drives import read_drives_with_warnings
from generator.recording import ENERGY_KINDS, Recording
from generator.simulation.import_exudyn import import_exudyn
from generator.simulation.plan import Plan
from springs import Joining

if TYPE_CHECKING:
    from generator.simulation.run import Progress

_AGREEMENT_TOLERANCE = 1e-9
"""Largest difference of displacements that count as one [rad or m]."""


@dataclass(frozen=True)
class KinematicConstraints:
    """Links, locked joints and drives of a run."""

    links: Links = field(default_factory=Links)
    locked: tuple[str, ...] = ()
    drives: Mapping[str, Drive] = field(default_factory=dict[str, Drive])

    def check_consistency(
        self,
        figure: Figure,
        sets: Sequence[str],
        start: float,
        velocities: Sequence[str] = (),
        *,
        free_root: bool = False,
    ) -> None:
        """Raise UsageError where options contradict each other.

        Args:
            figure: whose joints are held.
            sets: of `--set`: a joint cannot start elsewhere than it is held at the start.
            start: time of it [s].
            velocities: of `--velocity`: nor with another velocity.
            free_root: whether `--free-root` lets the figure go.

        Raises:
            UsageError: they do; or a joint is locked that cannot be.
            PrescriptionError: the links or the drives by themselves cannot be held.
        """
        tree = build_tree(figure)
        given = displacements_from_options("--set", sets, settable_chains(figure))
        PrescribedMotion(tree, self.links, {}, {})
        PrescribedMotion(tree, Links(), {}, self.drives)
        asked: Displacements = {
            **initial_displacements(tree),
            **{name: np.array(values) for name, values in given.items()},
        }
        locked = {name: asked[name] for name in self.locked}
        try:
            prescribed = PrescribedMotion(tree, self.links, locked, self.drives)
        except PrescriptionError as failure:
            raise UsageError(str(failure)) from None
        put = prescribed.impose_displacements(asked, start)
        for name in given:
            if not all(
                isclose(one, other, rel_tol=_AGREEMENT_TOLERANCE, abs_tol=_AGREEMENT_TOLERANCE)
                for one, other in zip(asked[name], put[name], strict=True)
            ):
                raise UsageError(
                    f"--set {name}: the joint is linked or driven, and starts elsewhere"
                )
        chains = settable_chains(figure, free_root=free_root)
        for name in sorted(prescribed.held - chains.keys()):
            raise UsageError(
                f"--free-root lets the figure go from the ground, to which joint {name} holds it: "
                "it cannot be locked, linked or driven"
            )
        _check_rates(
            prescribed, displacements_from_options("--velocity", velocities, chains), start
        )


def _check_rates(
    prescribed: PrescribedMotion, velocities: Mapping[str, Sequence[float]], start: float
) -> None:
    """Raise UsageError for velocities other than what is prescribed at the start [s]."""
    asked = {
        name: np.array(velocities.get(name, np.zeros(joint.degrees_of_freedom)), dtype=float)
        for name, joint in prescribed.tree.figure.joints.items()
    }
    put = prescribed.impose_rates(asked, start)
    for name in velocities.keys() & asked.keys():
        if not np.allclose(
            asked[name], put[name], rtol=_AGREEMENT_TOLERANCE, atol=_AGREEMENT_TOLERANCE
        ):
            raise UsageError(
                f"--velocity {name}: the joint is locked, linked or driven, and starts with "
                "another velocity"
            )


def constraints_from_options(
    figure: Figure,
    links: Path | None,
    locks: Sequence[str],
    drive: Path | None = None,
    driven: Sequence[str] = (),
) -> tuple[KinematicConstraints, tuple[Diagnostic, ...]]:
    """What the options say, with warnings.

    Args:
        figure: whose joints they are.
        links: a links file.
        locks: names of joints.
        drive: an action file or a table.
        driven: names of the joints that it drives; all when there are none.

    Raises:
        UsageError: a joint is unknown.
        InputError: a file is wrong.
    """
    for option, names in (("--lock", locks), ("--driven", driven)):
        for name in names:
            if name not in figure.joints:
                hint = spelling_hint(name, figure.joints)
                raise UsageError(f"{option} {name}: the figure has no joint `{name}`; {hint}")
    if driven and drive is None:
        raise UsageError("--driven chooses joints of the --drive file, which is missing")
    read, faults = Links(), ()
    if links is not None:
        reading = parse_links_file(links, figure)
        if reading.value is None:
            raise InputError(reading.diagnostics)
        read, faults = reading.value, reading.diagnostics
    drives: Mapping[str, Drive] = {}
    if drive is not None:
        drives, more = read_drives_with_warnings(drive, figure, driven)
        faults = (*faults, *more)
    return KinematicConstraints(read, tuple(dict.fromkeys(locks)), drives), faults


def summary_data(figure: str, recording: Recording, files: Sequence[Path]) -> dict[str, object]:
    """The object that `simulate --json` prints."""
    accuracy, outcome = recording.accuracy, recording.outcome
    return {
        "figure": figure,
        "outcome": outcome.ending.value,
        "message": outcome.message,
        "joint": outcome.joint,
        "simulated_s": _simulated_time(recording),
        "wall_s": recording.wall_time,
        "build_s": recording.build_time,
        "steps": accuracy.steps,
        "step_s": accuracy.step,
        "tolerance_rad": accuracy.asked,
        "error_estimate_rad": finite_or_none(accuracy.estimate),
        "held_until_s": accuracy.held_until,
        "energy": {
            kind: {"first": first, "last": last} for kind, first, last in _energies(recording)
        },
        "constraint_drift_m": recording.constraint_drift,
        "strayed_rad_or_m": recording.strayed,
        "springs": recording.springs,
        "law": recording.law,
        "files": [str(path) for path in files],
    }


def summary_text(recording: Recording, files: Sequence[Path]) -> str:
    """Outcome, error, energies, drift, times and files, for people."""
    energies = [("energy [J]", "first frame", "last frame", "change")]
    energies += [
        (kind, *(f"{value:.6g}" for value in (first, last, last - first)))
        for kind, first, last in _energies(recording)
    ]
    balance = recording.energy_balance
    kept = [float(balance[0]), float(balance[-1]), float(balance[-1] - balance[0])]
    energies.append(("sum less work", *(f"{value:.6g}" for value in kept)))
    lines = [recording.outcome.message, _accuracy(recording), "", format_table(energies), ""]
    lines.append(format_table(_run_statistics(recording, files), left_columns=2))
    return "\n".join(lines)


def failure_text(recording: Recording, files: Sequence[Path]) -> str | None:
    """Why a run failed and what became of its frames; None for a run that is done."""
    if recording.outcome.succeeded:
        return None
    kept = f"the frames up to {recording.times[-1]:.4g} s were"
    return f"{recording.outcome.message}; {kept} {'written' if files else 'simulated'}"


def _run_statistics(recording: Recording, files: Sequence[Path]) -> list[tuple[str, str]]:
    simulated, wall = _simulated_time(recording), recording.wall_time
    rate = f", {simulated / wall:.3g} x real time" if wall > 0.0 else ""
    accuracy = recording.accuracy
    rows = [
        ("springs", f"{recording.springs}, {recording.law} law"),
        ("drift", f"{recording.constraint_drift:.2g} m between sites that joints hold together"),
        ("steps", f"{accuracy.steps} in all, the shortest {1000.0 * accuracy.step:.4g} ms"),
        ("time", f"{recording.build_time:.2f} s building, {wall:.2f} s stepping{rate}"),
    ]
    if recording.strayed > 0.0:
        strayed = f"{recording.strayed:.2g} rad or m in what is locked, linked or driven"
        rows.insert(2, ("", strayed))
    return rows + [("wrote", str(path)) for path in files]


def _accuracy(recording: Recording) -> str:
    accuracy = recording.accuracy
    if accuracy.asked is None:
        return "error not estimated, since the step was fixed"
    estimate, asked = finite_or_none(accuracy.estimate), f"{accuracy.asked:.1e} rad"
    if estimate is None:
        return f"error not estimated, since too few passes ended; {asked} was asked for"
    held = f"held until {accuracy.held_until:g} s"
    return f"estimated error {estimate:.1e} rad; {asked} was asked for and {held}"


def _simulated_time(recording: Recording) -> float:
    return float(recording.times[-1] - recording.times[0])


def _energies(recording: Recording) -> list[tuple[str, float, float]]:
    rows = ((kind, recording.energy[kind]) for kind in ENERGY_KINDS)
    return [(kind, float(values[0]), float(values[-1])) for kind, values in rows]


MAX_FRAMES = 1_000_000
"""A recording of more frames would fill the memory."""


RunCallback = Callable[["Progress"], None]

RunMonitor = Callable[[float, float], AbstractContextManager[RunCallback | None]]
"""Opens what is told the progress of a run from a start to a stop [s]."""


def no_run_monitor(start: float, stop: float) -> AbstractContextManager[None]:
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


def simulate(request: Request, watcher: RunMonitor = no_run_monitor) -> CommandResult:
    """Run what is asked for and write the files.

    Args:
        request: the command line.
        watcher: opened for the run, and told the progress after every frame.

    Raises:
        UsageError: an option cannot be read or does not fit the figure.
        InputError: the figure, its springs or loads are wrong, or a file cannot be written.
        MoverError: the figure cannot be built as asked.
    """
    plan = _plan_without_figure(request)
    check_motion_formats(request.outputs)
    figure, warnings = load_figure(request.figure)
    require_simulatable(figure, warnings)
    plan, more = _plan_for_figure(plan, request, figure)
    files = (request.loads, request.pose, request.links, request.drive)
    inputs = (figure.path, request.springs, *files)
    check_writable(request.outputs, inputs, reader="run")
    import_exudyn()
    from generator.simulation.run import simulate as run  # Exudyn takes its time

    with defer_interrupt() as check, watcher(plan.start, plan.stop) as watch:

        def reached(progress: "Progress") -> None:
            if watch is not None:
                watch(progress)
            check()

        recording = run(figure, plan, reached)
        written = write_motion(motion_from_recording(recording, figure), request.outputs)
    lost = losses_text(written)
    failure = failure_text(recording, request.outputs)
    return CommandResult(
        text="\n".join([summary_text(recording, request.outputs), *([lost] if lost else [])]),
        data={
            **summary_data(request.figure, recording, request.outputs),
            "losses": losses_data(written),
        },
        diagnostics=(*warnings, *more),
        code=ExitCode.RUN_FAILED if failure else ExitCode.SUCCESS,
        failure=failure,
    )


def _plan_without_figure(request: Request) -> Plan:
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
        given["gravity"] = vector_from_option("--gravity", request.gravity)
    if request.law is not None:
        given["joining"] = Joining(request.law)
    try:
        plan = Plan(free_root=request.free_root, python_torques=request.python_torques, **given)
    except ValueError as failure:
        raise UsageError(str(failure)) from None
    if (plan.stop - plan.start) / plan.frame > MAX_FRAMES:
        raise UsageError(
            f"the run would have more than {MAX_FRAMES:,} frames; "
            "use a longer --frame or an earlier --stop"
        )
    return plan


def _plan_for_figure(
    plan: Plan, request: Request, figure: Figure
) -> tuple[Plan, tuple[Diagnostic, ...]]:
    """The plan with all that needs the figure, and warnings."""
    springs, faults = springs_from_option(figure, request.springs, plan.joining)
    loads = ()
    if request.loads is not None:
        reading = parse_loads_file(request.loads, figure)
        if reading.value is None:
            raise InputError((*faults, *reading.diagnostics))
        loads, faults = reading.value, (*faults, *reading.diagnostics)
    displacements, more = start_displacements_from_options(
        figure, request.pose, request.displacements
    )
    holding, others = constraints_from_options(
        figure, request.links, request.locks, request.drive, request.driven
    )
    plan = _limit_to_drive_times(plan, request, holding)
    holding.check_consistency(
        figure,
        request.displacements,
        plan.start,
        request.velocities,
        free_root=plan.free_root,
    )
    whole = _replace_plan(
        plan,
        links=holding.links,
        locked=holding.locked,
        drives=holding.drives,
        springs=springs,
        loads=loads,
        displacements=displacements,
        velocities=displacements_from_options(
            "--velocity", request.velocities, settable_chains(figure, free_root=plan.free_root)
        ),
    )
    return whole, (*faults, *more, *others)


def _limit_to_drive_times(plan: Plan, request: Request, constraints: KinematicConstraints) -> Plan:
    """The plan from the first to the last time that all drives tell of, unless others are given."""
    if not constraints.drives:
        return plan
    drives = constraints.drives.values()
    first, last = max(one.start for one in drives), min(one.stop for one in drives)
    start = first if request.start is None else plan.start
    stop = last if request.stop is None else plan.stop
    if start >= last:
        raise UsageError(
            f"the run starts at {start:g} s, but the drives are from {first:g} s to {last:g} s"
        )
    return _replace_plan(plan, start=start, stop=stop)


def _replace_plan(plan: Plan, **changes: Any) -> Plan:
    """The plan with changes. Raises UsageError for a plan that there is not."""
    try:
        return replace(plan, **changes)
    except ValueError as failure:
        raise UsageError(str(failure)) from None
