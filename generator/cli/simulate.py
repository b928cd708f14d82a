"""`mover simulate`: from a figure to the files of its motion."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from generator.cli import answer, inputs
from generator.cli.contact import (
    StartsChoice,
    StartsResult,
    add_sphere_warnings,
    contact_data,
    contact_rows,
    contact_table,
    parts_table,
    range_data,
    range_rows,
    sensitivity_rows,
    starts_from_options,
    touch_warnings,
)
from generator.cli.interrupts import defer_interrupt
from generator.cli.options import (
    OptionalFigureName,
    velocities_from_options,
    with_run_options,
)
from generator.cli.outputs import (
    NO_MOTION_FILES,
    LossesByPath,
    check_motion_formats,
    check_writable,
    losses_text,
    write_motion,
)
from generator.cli.progress import (
    item_progress_bar,
    load_compiled_integrator,
    load_exudyn,
    no_monitor,
    progress_bar,
)
from generator.diagnostics import InputError, ModelError, UsageError, warning
from generator.input_files.loads import LOADS_FILE
from generator.kinematics.range_of_motion import RangeExcess
from generator.model import Model, contact_of_figure
from generator.motion_files import motion_from_recording
from generator.recording import Ending, EnergyChange, Recording
from generator.run_options import FILES_PANEL, RUN_OPTIONS, Integrator
from generator.simulation.muscle_tone import tone_of_model
from generator.simulation.plan import Plan, WallLimit
from generator.springs_file.read import joints_without_elastic_law
from springs import SphericalLaw

if TYPE_CHECKING:
    from generator.simulation.run import Progress
    from generator.simulation.starts import StartStudy


class FallStart(NamedTuple):
    """Kind and seed of the start of a fall."""

    kind: str
    seed: int

    def __str__(self) -> str:
        """Say that it is one fall of many."""
        return f"{self.kind}, seed {self.seed}: one of many, whose spread --starts 40 shows"


@dataclass(frozen=True)
class SimulationResult(answer.CommandResult):
    """Summary of a run."""

    figure: str
    recording: Recording
    files: Sequence[Path]
    losses: LossesByPath
    elastic_joints: int
    moving_joints: int
    range_excesses: Sequence[RangeExcess]
    contact_rows: Sequence[tuple[str, str]]
    scale: Mapping[str, float]
    fall: FallStart | None
    starts: StartsResult | None
    tone: str | None

    def to_json(self) -> dict[str, object]:
        """Return outcome, accuracy, energy, contact, and what was chosen."""
        run, accuracy, outcome = self.recording, self.recording.accuracy, self.recording.outcome
        is_estimated = answer.finite_or_none(accuracy.estimate) is not None
        chosen = {
            "scale": self.scale or None,
            "fall": self.fall,
            "starts": self.starts,
            "tone": self.tone,
        }
        return {
            "figure": self.figure,
            "outcome": outcome.ending,
            "message": outcome.message,
            "joint": outcome.joint,
            "simulated_s": run.times[-1] - run.times[0],
            "integrator": run.integrator,
            "integrator_reason": run.integrator_reason,
            "agreement_with_exudyn": run.agreement_with_exudyn,
            "wall_s": run.wall_time,
            "build_s": run.build_time,
            "steps": accuracy.steps,
            "step_s": accuracy.step,
            "tolerance_rad": accuracy.tolerance,
            "error_estimate_rad": accuracy.estimate,
            "held_until_s": accuracy.tolerance_met_until if is_estimated else None,
            "chaotic_from_s": run.contact and run.contact.chaotic_from(run.times),
            "energy": run.energy_changes,
            "constraint_drift_m": run.constraint_drift,
            "strayed_rad_or_m": run.prescribed_motion_drift,
            "springs": run.springs,
            "law": run.law,
            "files": self.files,
            **({"contact": contact_data(run.contact)} if run.contact else {}),
            "range": range_data(self.range_excesses) if self.range_excesses else (),
            "elastic_joints": self.elastic_joints,
            "moving_joints": self.moving_joints,
            "losses": self.losses,
            **{key: value for key, value in chosen.items() if value is not None},
        }

    def paragraphs(self) -> answer.Paragraphs:
        """Return outcome, error, springs, energy, times and files in a few lines."""
        run, wall = self.recording, self.recording.wall_time
        lines, outcome = [run.outcome.message], run.outcome.ending
        if outcome is not Ending.DONE or answer.finite_or_none(run.accuracy.estimate) is None:
            reason = ""
            if run.accuracy.tolerance is None:
                is_implicit = run.integrator is Integrator.IMPLICIT
                reason = ": the implicit method has none" if is_implicit else ": the step was fixed"
            lines.append(run.accuracy_text + reason)
        method = f"Exudyn's integrator, because {run.integrator_reason}"
        if run.agreement_with_exudyn is not None:
            difference = f"{run.agreement_with_exudyn:.1e} of the largest"
            method = f"{run.integrator.value}; accelerations differ from Exudyn's by {difference}"
        simulated = float(run.times[-1] - run.times[0])
        rate = f", {simulated / wall:.3g} x real time" if wall > 0.0 else ""
        elastic = f"{self.elastic_joints} of {self.moving_joints} joints are elastic"
        rows = [
            ("springs", f"{run.springs}, {run.law} law; {elastic}"),
            *([] if self.fall is None else [("fall", str(self.fall))]),
            *(("scale", f"{path} = {value:g}") for path, value in self.scale.items()),
            *((("tone", self.tone),) if self.tone else ()),
            ("energy", run.energy_text),
            *self.contact_rows,
            *(range_rows(self.range_excesses) if self.range_excesses else ()),
            ("method", method),
            ("time", f"{run.build_time:.2f} s building, {wall:.2f} s stepping{rate}"),
            ("wrote", ", ".join(map(str, self.files)) or NO_MOTION_FILES),
        ]
        yield "\n".join([*lines, str(answer.Table(rows, 2))])
        if run.contact is not None:
            yield parts_table(run.contact)
        yield str(self.starts or "")

    def details(self) -> answer.Paragraphs:
        """Return forces of starts, contact, energies, drift and steps, and losses."""
        if self.starts is not None:
            yield self.starts.details()
        run = self.recording
        if run.contact is not None:
            yield contact_table(run.contact)
        energies: list[tuple[str, ...]] = [("energy [J]", "first frame", "last frame", "change")]
        balance = EnergyChange(*map(float, run.energy_balance[[0, -1]]))
        for kind, (first, last) in (*run.energy_changes.items(), ("sum less work", balance)):
            energies.append((kind, *(f"{value:.6g}" for value in (first, last, last - first))))
        yield answer.Table(energies)
        drift = f"{run.constraint_drift:.2g} m, largest gap between sites of one joint"
        rows = [("drift", drift)]
        if run.prescribed_motion_drift > 0.0:
            drift = f"{run.prescribed_motion_drift:.2g} rad or m in locked, linked or driven joints"
            rows.append(("", drift))
        step = 1000.0 * run.accuracy.step
        rows.append(("steps", f"{run.accuracy.steps}; in the finest pass {step:.4g} ms"))
        yield answer.Table(rows, 2)
        if self.losses:
            yield losses_text(self.losses)


@with_run_options
def simulate(
    name: OptionalFigureName = None,
    stop: float | None = None,
    start: float | None = None,
    springs: str | None = None,
    fall: str | None = None,
    law: SphericalLaw | None = None,
    starts: int | None = None,
    spread: str | None = None,
    seed: int | None = None,
    pose: Path | None = None,
    displacements: Sequence[str] | None = None,
    velocities: Sequence[str] | None = None,
    scales: Sequence[str] | None = None,
    loads: Path | None = None,
    links: Path | None = None,
    locks: Sequence[str] | None = None,
    drive: Path | None = None,
    driven: Sequence[str] | None = None,
    outputs: Annotated[
        list[Path] | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="Motion file to write: .html to watch it; .csv .npz .action .glb .bvh .mot .sto.",
            rich_help_panel=FILES_PANEL,
        ),
    ] = None,
    replay: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.live.toml",
            help="Compute a live simulation of the page again.",
            rich_help_panel=FILES_PANEL,
        ),
    ] = None,
    *,
    show_progress: bool = False,
    **options: Any,
) -> answer.CommandResult:
    """Simulate a figure under gravity, loads, springs and contact.

    The options --set, --velocity, --scale, --lock, --driven and -o may be repeated.
    """
    settings = inputs.given_options({**locals(), **options})
    files = outputs or []
    if replay is not None:
        from generator.cli.replay import replay_live

        for key in settings:
            flag = RUN_OPTIONS[key].flag
            raise UsageError(f"--replay takes the whole run from its file: leave out {flag}")
        return replay_live(replay, name, files, show_progress=show_progress)
    if name is None:
        raise UsageError("Missing argument 'FIGURE'.")
    if fall is not None and starts is not None:
        from generator.cli.falls import check_tables  # imports all of a study

        check_tables(files)
    elif files:
        check_motion_formats(files)
    if fall is None:
        plan, of_plan = inputs.plan_from_options(settings)
        figure, diagnostics = inputs.load_figure(name)
    else:
        figure, diagnostics = inputs.load_figure(name)
        plan, of_plan = inputs.fall_from_options(figure, settings)
    more_starts = None if starts is None else starts_from_options(starts, spread, seed)
    plan = inputs.with_tone(plan, figure, settings)
    diagnostics += of_plan
    spring_set, more = inputs.springs_from_option(figure, springs, law)
    diagnostics += more
    applied = ()
    if loads is not None:
        reading = LOADS_FILE.parse_file(loads, figure)
        if reading.value is None:
            raise InputError((*more, *reading.diagnostics))
        applied, diagnostics = reading.value, diagnostics + reading.diagnostics
    free_root = plan.free_root
    start_displacements, more = inputs.start_displacements_from_options(
        figure, pose, displacements or ()
    )
    plan = replace(plan, loads=applied)
    if fall is None:
        plan = replace(
            plan,
            displacements=start_displacements,
            velocities=velocities_from_options(velocities, figure, free_root=free_root)
            if velocities
            else {},
        )
    unscaled_model = Model(figure, spring_set, contact_of_figure(figure))
    if plan.tone and not settings.keys() & {"tone", "right", "hold"}:
        try:
            tone_of_model(unscaled_model, plan.tone)
        except ModelError as failure:  # the tone of the kind of fall, which was not asked for
            plan = replace(plan, tone=None)
            diagnostics += (warning(f"the body is limp in this fall: {failure}"),)
    unscaled_plan = plan
    scaled = inputs.scale_parameters(unscaled_model, unscaled_plan, scales or ())
    model, plan = scaled.model, scaled.plan
    figure, spring_set = model.figure, model.springs
    diagnostics += (*more, *inputs.range_warnings(figure, spring_set, plan.displacements))
    is_prescribed = bool(links or locks or drive)
    inputs.require_simulatable(model, None if is_prescribed else plan.displacements, diagnostics)
    constraints, more = inputs.constraints_from_options(
        figure, links, locks or (), drive, driven or ()
    )
    diagnostics += more
    plan = _limit_to_drive_times(plan, start, stop, constraints)
    inputs.refuse_contradictions({**settings, "start": plan.start, "stop": plan.stop})
    constraints.check_consistency(
        figure,
        displacements or (),
        plan.start,
        velocities or (),
        free_root=free_root,
        scaled=scaled.starts,
    )
    plan = _replace_plan(
        plan, links=constraints.links, locked=constraints.locked, drives=constraints.drives
    )
    if files:
        check_writable(files, (figure.path, springs, loads, pose, links, drive), reader="run")
    if plan.scene.props:
        diagnostics = add_sphere_warnings(figure, diagnostics)
    load_exudyn()
    if fall is not None and more_starts is not None:
        from generator.cli.falls import simulate_falls  # imports all of a study

        own = {key: getattr(plan, key) for key in ("start", "stop", "links", "locked", "drives")}
        result = simulate_falls(
            name,
            unscaled_model,
            fall,
            replace(unscaled_plan, **own),
            more_starts,
            scaled.values,
            files,
            tone=_tone_text(model, plan),
            is_fast="integrator" not in settings,
            show_progress=show_progress,
        )
        return replace(result, diagnostics=diagnostics)
    if plan.integrator is not Integrator.EXUDYN and plan.step is None and not plan.python_torques:
        load_compiled_integrator(show_progress=show_progress)
    from generator.simulation.run import simulate as run  # the import of Exudyn is slow

    limit = WallLimit.begin(plan.wall_limit)
    monitor = progress_bar if show_progress else no_monitor
    with defer_interrupt() as check, monitor(plan.start, plan.stop) as update:

        def watch(progress: "Progress") -> None:
            update(progress)
            check()

        recording = run(model, plan, watch)
        written: LossesByPath = {}
        if files:
            written = write_motion(motion_from_recording(recording), files)
    study = None
    if more_starts is not None and recording.outcome.reached_stop:
        study = _run_starts(model, plan, more_starts, limit, show_progress=show_progress)
    failure = failure_text(recording, files)
    if study is not None and limit.is_reached:
        failure = f"the wall-time limit of {limit.seconds:g} s was reached before the last start"
    if study is not None and more_starts is not None and len(study) < more_starts.number:
        failure = f"interrupted after {len(study)} of {more_starts.number} starts"
    moving = {name for name, joint in figure.joints.items() if joint.chain} & set(recording.chains)
    elastic = moving - set(joints_without_elastic_law(figure, spring_set))
    contact = None
    if recording.contact is not None:
        diagnostics += tuple(touch_warnings(recording))
    if plan.scene.props:
        from generator.contact.spheres import fit_contact_spheres  # slow import

        spheres = fit_contact_spheres(figure)
        contact = contact_rows(
            recording, spheres, self_contact=plan.self_contact, covers=plan.scene.covers
        )
        contact += sensitivity_rows(recording)
    return SimulationResult(
        figure=name,
        recording=recording,
        files=files,
        losses=written,
        elastic_joints=len(elastic),
        moving_joints=len(moving),
        range_excesses=recording.range_excesses,
        contact_rows=contact or (),
        scale=scaled.values,
        fall=None if fall is None else FallStart(fall, seed or 0),
        starts=None if study is None else StartsResult(study),
        tone=_tone_text(model, plan),
        diagnostics=diagnostics,
        failure=failure,
    )


def _run_starts(
    model: Model, plan: Plan, choice: StartsChoice, limit: WallLimit, *, show_progress: bool
) -> "StartStudy":
    """Repeat a run from several starts."""
    from generator.simulation.starts import study_starts  # the import of Exudyn is slow

    monitor = item_progress_bar if show_progress else no_monitor
    with defer_interrupt() as check, monitor(choice.number, "starts") as update:

        def watch(number: int) -> bool:
            update(f"start {number}")
            try:
                check()
            except KeyboardInterrupt:
                return True
            return False

        return study_starts(model, plan, choice.number, choice.spread, choice.seed, watch, limit)


def _tone_text(model: Model, plan: Plan) -> str | None:
    """Return the tone of a run with the classes of its strengths; None without tone."""
    found = tone_of_model(model, plan.tone) if plan.tone else None
    return None if found is None else f"{plan.tone}; {found.origins_text}"


def _limit_to_drive_times(
    plan: Plan, start: float | None, stop: float | None, constraints: inputs.KinematicConstraints
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


def failure_text(recording: Recording, files: Sequence[Path]) -> str | None:
    """Return the failure of a run and the last frame that is kept; None for a finished run."""
    if recording.outcome.succeeded:
        return None
    kept = f"the frames up to {recording.times[-1]:.4g} s were"
    return f"{recording.outcome.message}; {kept} {'written' if files else 'simulated'}"
