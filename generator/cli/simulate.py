"""`mover simulate`: from a figure to the files of its motion."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
import typer

from generator.cli.answer import CommandResult, ExitCode, finite_or_none, format_table
from generator.cli.contact import (
    FloorOption,
    FrictionOption,
    HeightOption,
    SceneOption,
    SeedOption,
    SelfContactOption,
    SpreadOption,
    StartsChoice,
    StartsOption,
    add_sphere_warnings,
    contact_data,
    contact_rows,
    contact_table,
    scene_from_options,
    sensitivity_rows,
    starts_data,
    starts_details,
    starts_from_options,
    starts_text,
    touch_warnings,
)
from generator.cli.inputs import (
    KinematicConstraints,
    constraints_from_options,
    load_figure,
    require_simulatable,
    springs_from_option,
    start_displacements_from_options,
    start_warnings,
)
from generator.cli.interrupts import defer_interrupt, hold_interrupts
from generator.cli.options import (
    FreeRoot,
    Gravity,
    JoiningLaw,
    JointValues,
    LinksFile,
    LockedJoints,
    OptionalFigureName,
    PoseFile,
    SpringsChoice,
    vector_from_option,
    velocities_from_options,
)
from generator.cli.outputs import (
    check_motion_formats,
    check_writable,
    losses_data,
    losses_text,
    write_motion,
)
from generator.cli.progress import (
    item_progress_bar,
    load_compiled_integrator,
    no_item_monitor,
    no_run_monitor,
    progress_bar,
)
from generator.diagnostics import InputError, UsageError
from generator.figure import Figure
from generator.input_files.loads import LOADS_FILE
from generator.motion_files import MOTION_FORMATS, motion_from_recording
from generator.recording import Integrator, Recording, energy_kinds
from generator.simulation.import_exudyn import import_exudyn
from generator.simulation.plan import MAX_FRAMES, Plan
from generator.springs_file.read import limp_joints
from springs import SpringSet

if TYPE_CHECKING:
    from generator.geometry.contact_spheres import SegmentSpheres
    from generator.simulation.run import Progress
    from generator.simulation.starts import StartStudy
    from generator.simulation.wall_limit import WallLimit


def simulate(
    name: OptionalFigureName = None,
    stop: Annotated[float | None, typer.Option(help="End time [s]. [default: 1]")] = None,
    start: Annotated[float | None, typer.Option(help="Start time [s]. [default: 0]")] = None,
    frame: Annotated[float | None, typer.Option(help="Frame interval [s]. [default: 0.02]")] = None,
    tolerance: Annotated[
        float | None, typer.Option(help="Joint-angle error tolerance [rad]. [default: 1e-3]")
    ] = None,
    step: Annotated[
        float | None, typer.Option(help="Fixed time step [s]; disables error control.")
    ] = None,
    springs: SpringsChoice = None,
    law: JoiningLaw = None,
    gravity: Gravity = None,
    free_root: FreeRoot = False,
    floor: FloorOption = False,
    height: HeightOption = None,
    friction: FrictionOption = None,
    scene: SceneOption = None,
    self_contact: SelfContactOption = False,
    starts: StartsOption = None,
    spread: SpreadOption = None,
    seed: SeedOption = None,
    pose: PoseFile = None,
    displacements: JointValues = None,
    velocities: Annotated[
        list[str] | None,
        typer.Option(
            "--velocity",
            metavar="JOINT=a,b,c",
            help="Initial joint velocities [deg/s or cm/s]. Of a free figure also "
            "SEGMENT=wx,wy,wz,vx,vy,vz: angular velocity [deg/s] and velocity of that segment's "
            "own centre of mass [m/s], world axes.",
        ),
    ] = None,
    loads: Annotated[
        Path | None, typer.Option(metavar="FILE.csv", help="Time-varying forces and moments.")
    ] = None,
    links: LinksFile = None,
    locks: LockedJoints = None,
    drive: Annotated[
        Path | None,
        typer.Option(metavar="MOTION|FILE.csv", help="Prescribed motion of joints."),
    ] = None,
    driven: Annotated[
        list[str] | None,
        typer.Option(metavar="JOINT", help="Joint to drive from the --drive file. [default: all]"),
    ] = None,
    integrator: Annotated[
        Integrator | None,
        typer.Option(help="Method of integration (docs/simulation.md). [default: compiled]"),
    ] = None,
    python_torques: Annotated[
        bool,
        typer.Option("--python-torques", help="Evaluate torques in Python: slower, same result."),
    ] = False,
    wall_limit: Annotated[
        float | None, typer.Option(help="Limit of computing time [s]. [default: 600]")
    ] = None,
    replay: Annotated[
        Path | None,
        typer.Option(metavar="FILE.live.toml", help="Compute a live simulation of the page again."),
    ] = None,
    outputs: Annotated[
        list[Path] | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="Motion file to write: .action .csv .npz .glb .bvh .mot .sto .html.",
        ),
    ] = None,
    *,
    show_progress: bool = False,
) -> CommandResult:
    """Simulate a figure under gravity, loads, springs and contact.

    The options --set, --velocity, --lock, --driven and -o may be repeated.
    """
    options: dict[str, Any] = dict(locals())
    files = outputs or []
    if replay is not None:
        from generator.cli.replay import check_only_replay, replay_live

        check_only_replay(options)
        return replay_live(replay, name, files, show_progress=show_progress)
    if name is None:
        raise UsageError("Missing argument 'FIGURE'.")
    if step is not None and tolerance is not None:
        raise UsageError(
            "--step and --tolerance exclude each other: a fixed step has no error control"
        )
    numbers = {
        "stop": stop,
        "start": start,
        "frame": frame,
        "tolerance": tolerance,
        "step": step,
        "wall_limit": wall_limit,
        "height": height,
    }
    options = {name: value for name, value in numbers.items() if value is not None}
    for option, value in options.items():
        if not isfinite(value):
            raise UsageError(f"--{option.replace('_', '-')} {value}: the number must be finite")
    if integrator is not None:
        options["integrator"] = integrator
    if gravity is not None:
        options["gravity"] = vector_from_option("--gravity", gravity)
    free_root = free_root or floor or scene is not None
    plan = Plan()
    first, last, interval = (options.get(k, getattr(plan, k)) for k in ("start", "stop", "frame"))
    _check_frame_count(first, last, interval)
    plan = _replace_plan(
        plan, **options, joining=law, free_root=free_root, python_torques=python_torques
    )
    check_motion_formats(files)
    props = scene_from_options(
        floor=floor, friction=friction, scene=scene, height=plan.height, up=plan.up
    )
    if self_contact and not props.scene.props:
        raise UsageError("--self-contact needs --floor or --scene")
    plan = _replace_plan(plan, scene=props.scene, height=props.height, self_contact=self_contact)
    more_starts = starts_from_options(starts, spread, seed, has_props=bool(props.scene.props))
    figure, diagnostics = load_figure(name)
    diagnostics += props.diagnostics
    spring_set, more = springs_from_option(figure, springs, law)
    diagnostics += more
    applied = ()
    if loads is not None:
        reading = LOADS_FILE.parse_file(loads, figure)
        if reading.value is None:
            raise InputError((*more, *reading.diagnostics))
        applied, diagnostics = reading.value, diagnostics + reading.diagnostics
    start_displacements, more = start_displacements_from_options(figure, pose, displacements or ())
    diagnostics += (*more, *start_warnings(figure, spring_set, start_displacements))
    is_prescribed = bool(links or locks or drive)
    require_simulatable(
        figure, spring_set, None if is_prescribed else start_displacements, diagnostics
    )
    constraints, more = constraints_from_options(figure, links, locks or (), drive, driven or ())
    diagnostics += more
    plan = _limit_to_drive_times(plan, start, stop, constraints)
    _check_frame_count(plan.start, plan.stop, plan.frame)
    constraints.check_consistency(
        figure, displacements or (), plan.start, velocities or (), free_root=free_root
    )
    plan = _replace_plan(
        plan,
        links=constraints.links,
        locked=constraints.locked,
        drives=constraints.drives,
        springs=spring_set,
        loads=applied,
        displacements=start_displacements,
        velocities=velocities_from_options(velocities or (), figure, free_root=free_root),
    )
    check_writable(files, (figure.path, springs, loads, pose, links, drive), reader="run")
    if plan.scene.props:
        diagnostics = add_sphere_warnings(figure, diagnostics)
    with hold_interrupts():  # Exudyn would report Ctrl-C as a damaged installation
        import_exudyn()
    if plan.integrator is Integrator.COMPILED and plan.step is None and not python_torques:
        load_compiled_integrator(show_progress=show_progress)
    from generator.simulation.run import simulate as run  # the import of Exudyn is slow
    from generator.simulation.wall_limit import WallLimit

    limit = WallLimit.begin(plan.wall_limit)
    monitor = progress_bar if show_progress else no_run_monitor
    with defer_interrupt() as check, monitor(plan.start, plan.stop) as update:

        def watch(progress: "Progress") -> None:
            update(progress)
            check()

        recording = run(figure, plan, watch)
        written = write_motion(motion_from_recording(recording, figure, spring_set), files)
    study = None
    if more_starts is not None and recording.outcome.reached_stop:
        study = _run_starts(figure, plan, more_starts, limit, show_progress=show_progress)
    failure = failure_text(recording, files)
    if study is not None and limit.is_reached:
        failure = f"the wall-time limit of {limit.seconds:g} s was reached before the last start"
    joints = _count_elastic_joints(figure, spring_set, recording)
    diagnostics += tuple(touch_warnings(recording))
    spheres: Mapping[str, SegmentSpheres] = {}
    if plan.scene.props:
        from generator.geometry.contact_spheres import fit_contact_spheres  # slow import

        spheres = fit_contact_spheres(figure)
    return CommandResult(
        text="\n\n".join(
            [
                summary_text(recording, files, joints, spheres, self_contact=self_contact),
                *([] if study is None else [starts_text(study)]),
            ]
        ),
        details="\n\n".join(
            filter(
                None,
                [
                    "" if study is None else starts_details(study),
                    details_text(recording),
                    losses_text(written),
                ],
            )
        ),
        data={
            **summary_data(name, recording, files),
            "elastic_joints": joints.elastic,
            "moving_joints": joints.moving,
            "losses": losses_data(written),
            **({} if study is None else {"starts": starts_data(study)}),
        },
        diagnostics=diagnostics,
        code=ExitCode.RUN_FAILED if failure else ExitCode.SUCCESS,
        failure=failure,
    )


def _run_starts(
    figure: Figure, plan: Plan, choice: StartsChoice, limit: "WallLimit", *, show_progress: bool
) -> "StartStudy":
    """Repeat a run from several starts."""
    from generator.simulation.starts import study_starts  # the import of Exudyn is slow

    monitor = item_progress_bar if show_progress else no_item_monitor
    with defer_interrupt() as check, monitor(choice.number, "starts") as update:

        def watch(number: int) -> None:
            update(f"start {number}")
            check()

        return study_starts(figure, plan, choice.number, choice.spread, choice.seed, watch, limit)


class JointCounts(NamedTuple):
    """Joints of a run that move, and those of them with an elastic law."""

    elastic: int
    moving: int


def _count_elastic_joints(figure: Figure, springs: SpringSet, recording: Recording) -> JointCounts:
    """Count the joints of a figure that move in a run, and those with an elastic law."""
    moving = {name for name, joint in figure.joints.items() if joint.chain} & set(recording.chains)
    return JointCounts(len(moving - set(limp_joints(figure, springs))), len(moving))


def _check_frame_count(first: float, last: float, interval: float) -> None:
    """Raise UsageError for a recording that is too long for the memory."""
    if interval > 0.0 and (last - first) / interval > MAX_FRAMES:
        raise UsageError(
            f"more than {MAX_FRAMES:,} frames; use a longer --frame or an earlier --stop"
        )


def _limit_to_drive_times(
    plan: Plan, start: float | None, stop: float | None, constraints: KinematicConstraints
) -> Plan:
    """Limit a plan to the common time range of all drives, unless the user set start or stop."""
    if not constraints.drives:
        return plan
    drives = constraints.drives.values()
    first, last = max(one.start for one in drives), min(one.stop for one in drives)
    plan_start = first if start is None else plan.start
    if plan_start >= last:
        raise UsageError(
            f"the run starts at {plan_start:g} s, but the drives are from {first:g} s to {last:g} s"
        )
    return _replace_plan(plan, start=plan_start, stop=last if stop is None else plan.stop)


def _replace_plan(plan: Plan, **changes: Any) -> Plan:
    """Return the plan with changes. Raises UsageError for invalid values."""
    try:
        return replace(plan, **changes)
    except ValueError as failure:
        raise UsageError(str(failure)) from None


def summary_data(figure: str, recording: Recording, files: Sequence[Path]) -> dict[str, object]:
    """Return the summary of a run for `--json`."""
    accuracy, outcome = recording.accuracy, recording.outcome
    return {
        "figure": figure,
        "outcome": outcome.ending.value,
        "message": outcome.message,
        "joint": outcome.joint,
        "simulated_s": _simulated_time(recording),
        "integrator": recording.integrator.value,
        "integrator_reason": recording.integrator_reason,
        "agreement_with_exudyn": recording.agreement_with_exudyn,
        "wall_s": recording.wall_time,
        "build_s": recording.build_time,
        "steps": accuracy.steps,
        "step_s": accuracy.step,
        "tolerance_rad": accuracy.asked,
        "error_estimate_rad": finite_or_none(accuracy.estimate),
        "held_until_s": None if finite_or_none(accuracy.estimate) is None else accuracy.held_until,
        "energy": {
            kind: {"first": first, "last": last} for kind, first, last in _energies(recording)
        },
        "constraint_drift_m": recording.constraint_drift,
        "strayed_rad_or_m": recording.strayed,
        "springs": recording.springs,
        "law": recording.law,
        "files": [str(path) for path in files],
        **({} if recording.contact is None else {"contact": contact_data(recording.contact)}),
    }


def summary_text(
    recording: Recording,
    files: Sequence[Path],
    joints: JointCounts,
    spheres: "Mapping[str, SegmentSpheres] | None" = None,
    *,
    self_contact: bool = False,
) -> str:
    """Format outcome, error, springs, energy, times and files in a few lines."""
    accuracy, outcome, wall = recording.accuracy, recording.outcome, recording.wall_time
    lines = [outcome.message]
    if not outcome.succeeded or finite_or_none(accuracy.estimate) is None:
        reason = ": the step was fixed" if accuracy.asked is None else ""
        lines.append(recording.accuracy_text + reason)
    balance = recording.energy_balance
    imbalance = float(np.max(np.abs(balance - balance[0])))
    exchanged = max(float(np.ptp(values)) for values in recording.energy.values())
    rate = f", {_simulated_time(recording) / wall:.3g} x real time" if wall > 0.0 else ""
    wrote = ", ".join(map(str, files)) or f"nothing; -o FILE writes {' '.join(MOTION_FORMATS)}"
    contact: list[tuple[str, str]] = []
    if recording.contact is not None:
        contact = contact_rows(recording, spheres or {}, self_contact=self_contact)
    rows = [
        (
            "springs",
            f"{recording.springs}, {recording.law} law; "
            f"{joints.elastic} of {joints.moving} joints are elastic",
        ),
        ("energy", f"balanced to {imbalance:.2g} J, with {exchanged:.4g} J exchanged"),
        *contact,
        *sensitivity_rows(recording),
        ("method", _method(recording)),
        ("time", f"{recording.build_time:.2f} s building, {wall:.2f} s stepping{rate}"),
        ("wrote", wrote),
    ]
    return "\n".join([*lines, format_table(rows, left_columns=2)])


def _method(recording: Recording) -> str:
    """Name the integrator, with its agreement with Exudyn or the reason for Exudyn's."""
    if recording.agreement_with_exudyn is not None:
        difference = recording.agreement_with_exudyn
        return f"compiled; accelerations differ from Exudyn's by {difference:.1e} of the largest"
    return f"Exudyn's integrator, because {recording.integrator_reason}"


def details_text(recording: Recording) -> str:
    """Format energies, drift and steps."""
    energies = [("energy [J]", "first frame", "last frame", "change")]
    energies += [
        (kind, *(f"{value:.6g}" for value in (first, last, last - first)))
        for kind, first, last in _energies(recording)
    ]
    balance = recording.energy_balance
    kept = [float(balance[0]), float(balance[-1]), float(balance[-1] - balance[0])]
    energies.append(("sum less work", *(f"{value:.6g}" for value in kept)))
    accuracy = recording.accuracy
    rows = [
        ("drift", f"{recording.constraint_drift:.2g} m, largest gap between sites of one joint"),
        ("steps", f"{accuracy.steps}; in the finest pass {1000.0 * accuracy.step:.4g} ms"),
    ]
    if recording.strayed > 0.0:
        strayed = f"{recording.strayed:.2g} rad or m in locked, linked or driven joints"
        rows.insert(1, ("", strayed))
    tables = [format_table(energies), format_table(rows, left_columns=2)]
    if recording.contact is not None:
        tables.insert(0, format_table(contact_table(recording.contact)))
    return "\n\n".join(tables)


def failure_text(recording: Recording, files: Sequence[Path]) -> str | None:
    """Return the failure of a run and the last frame that is kept; None for a finished run."""
    if recording.outcome.succeeded:
        return None
    kept = f"the frames up to {recording.times[-1]:.4g} s were"
    return f"{recording.outcome.message}; {kept} {'written' if files else 'simulated'}"


def _simulated_time(recording: Recording) -> float:
    return float(recording.times[-1] - recording.times[0])


def _energies(recording: Recording) -> list[tuple[str, float, float]]:
    rows = ((kind, recording.energy[kind]) for kind in energy_kinds(recording.energy))
    return [(kind, float(values[0]), float(values[-1])) for kind, values in rows]
