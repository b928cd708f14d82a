"""`mover identify`: fit springs to measured joint angles, and write them and a picture."""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from math import degrees, inf, isfinite
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from generator.cli.answer import HIDDEN, MERGED, OMITTED_IF_NONE, CommandResult, Paragraphs, Table
from generator.cli.inputs import (
    constraints_from_options,
    given_options,
    load_figure,
    require_simulatable,
    springs_from_option,
    start_displacements_from_options,
)
from generator.cli.interrupts import defer_interrupt, hold_interrupts
from generator.cli.options import (
    FigureName,
    Gravity,
    JointValues,
    LawChoice,
    LockedJoints,
    PoseFile,
    SpringsChoice,
    angle_from_option,
    format_rounded,
    vector_from_option,
    velocities_from_options,
)
from generator.cli.outputs import check_writable, write_files
from generator.cli.progress import load_compiled_integrator, run_counter
from generator.diagnostics import UsageError, format_count
from generator.identification.doubts import GIVEN_MASSES, GIVEN_TORQUES, fit_doubts
from generator.identification.fit import (
    CONFIDENCE,
    Estimate,
    Fit,
    FitOptions,
    UnfinishedFitError,
    fit_springs,
)
from generator.identification.fitted_springs import decimals, fitted_springs_text
from generator.identification.law_tails import TORQUE_CHANGE
from generator.identification.measured_angles import format_time, read_measured_angles
from generator.model import Model
from generator.simulation.plan import Plan
from generator.simulation.preconditions import import_exudyn
from generator.study.parameter_paths import Case, ParameterPath, parse_path
from plots.fit import check_fit_outputs
from plots.pendulum_test import PendulumTest, pendulum_tests

NEGLIGIBLE_CHANGE = 1e-3
"""Change of an estimate with the masses that is printed as 0, in standard deviations."""


WALL_LIMIT = 3600.0
"""Limit of the computing time of the command [s]."""


class Protocol(StrEnum):
    """Test of joints whose numbers are reported."""

    PENDULUM = "pendulum"


@dataclass(frozen=True)
class SwingResult(CommandResult):
    """Numbers of the swings of joints."""

    figure: str
    data: str
    pendulum: Sequence[PendulumTest] | None = field(metadata=OMITTED_IF_NONE)

    def paragraphs(self) -> Paragraphs:
        """Return the paragraphs of each test."""
        return (text for test in self.pendulum or () for text in test.paragraphs())


@dataclass(frozen=True)
class UnfinishedResult(CommandResult):
    """Best values of a fit that reached the limit of the computing time."""

    figure: str
    data: str
    error: str
    best: Mapping[str, float] | None
    pendulum: Sequence[PendulumTest] | None = field(metadata=OMITTED_IF_NONE)

    def paragraphs(self) -> Paragraphs:
        """Return the tests, and that there is no fit."""
        yield from (text for test in self.pendulum or () for text in test.paragraphs())
        yield "the fit is not finished; nothing was written"


@dataclass(frozen=True)
class FitResult(CommandResult):
    """Fit of springs to measured angles."""

    figure: str
    numbers: Mapping[str, object] = field(metadata=MERGED)
    files: Sequence[Path]
    pendulum: Sequence[PendulumTest] | None = field(metadata=OMITTED_IF_NONE)
    fit: Fit = field(metadata=HIDDEN)

    def paragraphs(self) -> Paragraphs:
        """Return the tests, the estimates, what they are worth, and the files."""
        yield from (text for test in self.pendulum or () for text in test.paragraphs())
        data, fit = self.fit.data, self.fit
        yield (
            f"{data.name}: {format_count(data.angles.size, 'angle')} of "
            f"{', '.join(dict.fromkeys(joint for joint, _ in data.columns))}, "
            f"{format_time(data.times[0])} to {format_time(data.times[-1])} s"
        )
        yield Table([*_estimate_rows(fit)], 2)
        masses = GIVEN_TORQUES if fit.has_fitted_masses else GIVEN_MASSES
        yield "\n".join([*_residual_lines(fit), masses])
        yield "\n".join(f"doubt: {doubt}" for doubt in fit_doubts(fit))
        lines = [f"wrote {path}" for path in self.files]
        paths = [one.path for one in fit.estimates if not one.is_start]
        others = [path for path in paths if not path.startswith("springs.")]
        springs = [path for path in self.files if path.suffix == ".toml"]
        if springs and others:
            names = ", ".join(others)
            lines.append(f"{springs[0]} has springs only: {names} is in its comment alone")
        yield "\n".join(lines)

    def details(self) -> Paragraphs:
        """Return tables of the starts and the correlations."""
        names = [one.path for one in self.fit.estimates]
        rows = [["start", *names, "rms [deg]", ""]]
        for number, one in enumerate(self.fit.starts, 1):
            rms = "failed" if one.rms is None else f"{degrees(one.rms):.4g}"
            values = [f"{value:.4g}" for value in one.values]
            rows.append([str(number), *values, rms, "least" if one.is_best else ""])
        correlations = [["correlation", *names]]
        for name, row in zip(names, self.fit.correlations.tolist(), strict=True):
            correlations.append([name, *(f"{value:+.3f}" for value in row)])
        return Table(rows), Table(correlations)


def identify(
    name: FigureName,
    data: Annotated[
        Path,
        typer.Argument(
            metavar="DATA",
            help="Measured angles over time: .csv with columns such as `time [s]` and "
            "`left_knee [deg]`, or .mot .sto .npz .action.",
        ),
    ],
    fit: Annotated[
        list[str] | None,
        typer.Option("--fit", metavar="PATH", help="Quantity to fit, as springs.knee.scale."),
    ] = None,
    protocol: Annotated[
        Protocol | None,
        typer.Option(
            help="Report the numbers of a test: `pendulum`, the swing of a released limb. Without "
            "--fit nothing is fitted."
        ),
    ] = None,
    sd: Annotated[
        str | None,
        typer.Option(
            metavar="0.5deg",
            help="Standard deviation of the noise. [default: that of the residuals]",
        ),
    ] = None,
    start: Annotated[
        float | None,
        typer.Option(help="Time of the release [s], if it is known. [default: estimated]"),
    ] = None,
    stop: Annotated[float | None, typer.Option(help="End time [s]. [default: last sample]")] = None,
    springs: SpringsChoice = None,
    law: LawChoice = None,
    gravity: Gravity = None,
    pose: PoseFile = None,
    displacements: JointValues = None,
    velocities: Annotated[
        list[str] | None,
        typer.Option("--velocity", metavar="JOINT=a,b,c", help="Initial rates [deg/s or cm/s]."),
    ] = None,
    locks: LockedJoints = None,
    starts: Annotated[int, typer.Option(min=1, help="Number of starts of the fit.")] = 3,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the starts.")] = 0,
    tolerance: Annotated[
        float | None,
        typer.Option(help="Joint-angle error tolerance [rad]. [default: bias below 0.1 sd]"),
    ] = None,
    step: Annotated[
        float | None, typer.Option(help="Fixed time step [s]; disables error control.")
    ] = None,
    wall_limit: Annotated[
        float | None, typer.Option(help="Limit of computing time [s]. [default: 3600]")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write a .springs.toml file."),
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the fit as .svg or .png.")
    ] = None,
    *,
    show_progress: bool = False,
) -> CommandResult:
    """Fit springs to measured joint angles over time.

    The joints are held, then released; time and start angle are estimated too, unless --start and
    --set state them. The options --fit, --set, --velocity and --lock may be repeated.
    """
    given_options({"step": step, "tolerance": tolerance})
    check_fit_outputs(output, plot)
    limit = WALL_LIMIT if wall_limit is None else wall_limit
    if not limit > 0.0:
        raise UsageError(f"--wall-limit {limit:g}: the limit must be positive")
    deadline = time.monotonic() + limit
    if not fit and (protocol is None or output is not None or plot is not None):
        raise UsageError("nothing to fit: name a quantity, such as --fit springs.knee.scale")
    noise = None if sd is None else angle_from_option("--sd", sd)
    if noise is not None and not noise > 0.0:
        raise UsageError(f"--sd {sd}: the standard deviation of the noise must be positive")
    options = FitOptions(
        sd=noise,
        starts=starts,
        seed=seed,
        tolerance=tolerance,
        step=step,
        known_starts=tuple(text.partition("=")[0].strip() for text in displacements or ()),
        release=start,
    )
    figure, diagnostics = load_figure(name)
    spring_set, more = springs_from_option(figure, springs, law)
    diagnostics += more
    measured, more = read_measured_angles(data, figure)
    diagnostics += more
    for option, value in (("start", start), ("stop", stop)):
        if value is not None and not isfinite(value):
            raise UsageError(f"--{option} {value}: the number must be finite")
    measured = measured.between(-inf if start is None else start, inf if stop is None else stop)
    tests = pendulum_tests(measured) if protocol is Protocol.PENDULUM else ()
    if not fit:
        return SwingResult(name, measured.name, tests or None, diagnostics=diagnostics)
    start_values, more = start_displacements_from_options(figure, pose, displacements or ())
    diagnostics += more
    model = Model(figure, spring_set)
    require_simulatable(model, None if locks else start_values, diagnostics)
    constraints, more = constraints_from_options(figure, None, locks or ())
    diagnostics += more
    constraints.check_consistency(figure, displacements or (), 0.0, velocities or ())
    plan = Plan(
        displacements=start_values,
        velocities=velocities_from_options(velocities or (), figure),
        locked=constraints.locked,
    )
    if gravity is not None:
        plan = replace(plan, gravity=vector_from_option("--gravity", gravity))
    case = Case(model, plan)
    paths = [_parse_fitted_path(text, case) for text in fit]
    files = [path for path in (output, plot) if path is not None]
    check_writable(files, (figure.path, springs, pose, data))
    with hold_interrupts():  # Exudyn would report Ctrl-C as a damaged installation
        import_exudyn()
    load_compiled_integrator(show_progress=show_progress)
    with defer_interrupt() as check, run_counter(show_progress=show_progress) as count:

        def watch() -> None:
            count()
            check()

        try:
            fitted = fit_springs(case, measured, paths, options, watch, deadline=deadline)
        except UnfinishedFitError as unfinished:
            failure = f"--wall-limit {limit:g}: {unfinished}"
            return UnfinishedResult(
                name,
                measured.name,
                failure,
                unfinished.values,
                tests or None,
                diagnostics=diagnostics,
                failure=failure,
            )
    contents: dict[Path, str | bytes] = {}
    if output is not None:
        contents[output] = fitted_springs_text(fitted, output, springs)
    if plot is not None:
        # Matplotlib is slow to import.
        from plots.canvas import render_figure
        from plots.identification_drawing import draw_identification

        contents[plot] = render_figure(draw_identification(fitted), plot.suffix.lower()[1:])
    write_files(contents)
    return FitResult(
        figure=name,
        numbers=_fit_data(fitted),
        files=files,
        pendulum=tests or None,
        fit=fitted,
        diagnostics=diagnostics,
        failure=f"--wall-limit {limit:g}: {fitted.unfinished}" if fitted.unfinished else None,
    )


_FITTED_GROUPS = ("springs", "segments", "pose", "velocity", "gravity")


def _parse_fitted_path(text: str, case: Case) -> ParameterPath:
    """Return the quantity of a path. Raises UsageError for those of a floor or a person."""
    group = text.strip().partition(".")[0]
    if group in ("", "floor", "height", "person"):
        raise UsageError(f"--fit {text}: a fit knows {', '.join(_FITTED_GROUPS)}, not `{group}`")
    return parse_path(text, case)


def _estimate_rows(fit: Fit) -> Iterator[list[str]]:
    percent = f"{100.0 * CONFIDENCE:.0f} %"
    head = ["quantity", "unit", "estimate", "sd", f"{percent} interval", "by profile"]
    if not fit.has_fitted_masses:
        head.append("per +1 % of mass")
    if fit.tails:
        head.append(f"law tail {100.0 * TORQUE_CHANGE:.0f} %")
    yield head
    for one in fit.estimates:
        digits = decimals(one.sd)
        ends = [format_rounded(end, digits) for end in one.interval]
        profile = [
            "open" if end is None else format_rounded(end, digits)
            for end in one.profile_interval or ()
        ]
        row = [
            f"{one.path} (start)" if one.is_start else one.path,
            one.unit,
            format_rounded(one.value, digits),
            f"{one.sd:.2g}",
            " .. ".join(ends),
            " .. ".join(profile) or "-",
        ]
        if one.mass_slope is not None:
            change = 0.01 * one.mass_slope
            negligible = abs(change) < NEGLIGIBLE_CHANGE * one.sd
            row.append("0" if negligible else f"{change:+.2g}")
        if fit.tails:
            change = fit.change_by_tail(one.path) or 0.0
            row.append(f"{change:.2g} = {change / one.sd:.2g} sd" if one.sd > 0.0 else "-")
        yield row


def _residual_lines(fit: Fit) -> Iterator[str]:
    tests = fit.tests
    origin = "stated" if fit.options.sd is not None else "from the residuals"
    rms, noise = degrees(tests.rms), degrees(fit.noise_sd)
    yield f"rms residual {rms:.3g} deg; sd of the noise {noise:.3g} deg, {origin}"
    if tests.chi_square is not None:
        yield (
            f"chi-square {tests.chi_square:.4g} for {tests.degrees_of_freedom} degrees of freedom "
            f"(probability of a larger one {tests.misfit:.2g})"
        )
    if tests.whiteness is not None:
        yield (
            f"autocorrelation of successive residuals {tests.lag_one:+.2f}; "
            f"{tests.effective_samples:.0f} independent of {tests.samples}; Ljung-Box "
            f"{tests.ljung_box:.3g} over {tests.lags} lags (probability {tests.whiteness:.2g})"
        )
    runs = f"{fit.runs} runs" + (f", {fit.failed_runs} failed" if fit.failed_runs else "")
    best = sum(one.is_best for one in fit.starts)
    step, how = fit.accuracy.step, f"tolerance {fit.accuracy.tolerance:g} rad"
    if step is not None:
        how = f"step {step:g} s"
    bias = max(abs(one.bias) for one in fit.estimates)
    yield (
        f"condition {fit.condition:.3g}; {best} of {len(fit.starts)} starts agree; {runs}, "
        f"{how}, largest bias {bias:.1g} sd"
    )


def _fit_data(fit: Fit) -> dict[str, object]:
    """Return the fit for `--json`."""
    tests, data, paths = fit.tests, fit.data, [one.path for one in fit.estimates]
    return {
        "data": data.name,
        "columns": [f"{joint}.{coordinate + 1}" for joint, coordinate in data.columns],
        "release_s": fit.release,
        "start_s": data.times[0],
        "stop_s": data.times[-1],
        "estimates": [
            {**_estimate_data(one), "change_by_tail": fit.change_by_tail(one.path)}
            for one in fit.estimates
        ],
        "tails": [
            {
                "joint": tail.joint,
                "inner_deg": degrees(tail.inner),
                "end_deg": degrees(tail.end),
                "known_deg": tail.known and [degrees(end) for end in tail.known],
                "torque_change": TORQUE_CHANGE,
                "changes": dict(zip(paths, tail.changes, strict=True)),
            }
            for tail in fit.tails
        ],
        "confidence": CONFIDENCE,
        "correlations": fit.correlations,
        "condition": fit.condition,
        "noise_sd_deg": degrees(fit.noise_sd),
        "noise_is_stated": fit.options.sd is not None,
        "residuals": {
            "rms_deg": degrees(tests.rms),
            "samples": tests.samples,
            "autocorrelation": tests.lag_one,
            "effective_samples": tests.effective_samples,
            "ljung_box": tests.ljung_box,
            "lags": tests.lags,
            "ljung_box_probability": tests.whiteness,
            "chi_square": tests.chi_square,
            "chi_square_probability": tests.misfit,
            "degrees_of_freedom": tests.degrees_of_freedom,
        },
        "tolerance_rad": None if fit.accuracy.step is not None else fit.accuracy.tolerance,
        "step_s": fit.accuracy.step,
        "starts": [
            {
                "values": one.values,
                "rms_deg": None if one.rms is None else degrees(one.rms),
                "is_best": one.is_best,
            }
            for one in fit.starts
        ],
        "runs": fit.runs,
        "failed_runs": fit.failed_runs,
        "unfinished": fit.unfinished,
        "doubts": fit_doubts(fit),
        "samples": [
            {"time_s": time, "measured_deg": measured, "simulated_deg": simulated}
            for time, measured, simulated in zip(
                data.times, np.degrees(data.angles), np.degrees(fit.simulated), strict=True
            )
        ],
    }


def _estimate_data(one: Estimate) -> dict[str, object]:
    profile = one.profile
    return {
        "path": one.path,
        "unit": one.unit,
        "estimate": one.value,
        "sd": one.sd,
        "interval": one.interval,
        "profile_interval": one.profile_interval,
        "profile": profile and {"values": profile.values, "distances_sd": profile.distances},
        "change_per_relative_mass": one.mass_slope,
        "bias_sd": one.bias,
        "at_bound": one.at_bound,
        "is_start": one.is_start,
    }
