"""`mover fit`: a cubic through measured moments, as numbers, as a spring and as a picture.

The picture of a fit: data, cubic, law and dead zone, and below them the residuals.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import degrees
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from generator.cli.answer import CommandResult, UsageError, format_table
from generator.cli.outputs import check_writable
from generator.diagnostics import MoverError
from generator.input_files.moments import MeasuredMoments, read_moments
from generator.springs_file.bind import describe_sense_rule
from generator.springs_file.parse import SpringEntry, SpringsFile
from generator.springs_file.write import write_springs
from plots.canvas import BLACK, BLUE, GREY, PALE, VERMILION, plot_style
from plots.run import write_file
from springs import Cubic, NotRestoringError
from springs.backends import Array
from springs.fit import CubicFit, fit_cubic

FORMATS = ("svg", "png")
COEFFICIENT_UNITS = ("N m", "N m/rad", "N m/rad^2", "N m/rad^3")


@dataclass(frozen=True)
class Request:
    """The command line of `mover fit`; None or empty where an option is not given."""

    data: Path
    passive: bool = False
    output: Path | None = None
    joints: tuple[str, ...] = ()
    axis: str | None = None
    motion: str = ""
    reference: str = ""
    plot: Path | None = None


def fit(request: Request) -> CommandResult:
    """Fit what is asked for and write the files.

    Raises:
        UsageError: options that do not go together.
        InputError: the data are wrong, or a file cannot be written.
        MoverError: the cubic is no law, but a springs file is asked for.
    """
    _check_options(request)
    moments = read_moments(request.data)
    fitted = fit_cubic(moments.angles, moments.moments, passive=request.passive)
    law = _law_or_none(fitted)
    files = [path for path in (request.output, request.plot) if path is not None]
    check_writable(files, (request.data,))
    if request.output is not None:
        if law is None:
            raise MoverError(f"there is no spring to write: {fitted.doubts[0]}; try --passive")
        write_file(request.output, _format_springs_file(request, moments, fitted, law))
    if request.plot is not None:
        kind = request.plot.suffix.lower()[1:]
        write_file(request.plot, _render_fit(request, moments, fitted, kind))
    return CommandResult(
        text="\n\n".join(_format_paragraphs(moments, fitted, law, files)),
        data=_json_data(moments, fitted, law, request.passive, files),
    )


def _check_options(request: Request) -> None:
    if request.output is not None:
        if not request.joints:
            raise UsageError("-o writes a spring of a joint: name it with --joint")
        if request.output.suffix != ".toml":
            raise UsageError(f"-o {request.output}: springs files end in .springs.toml")
    elif request.joints:
        raise UsageError("--joint names the joints of a springs file: give one with -o")
    if request.plot is not None and request.plot.suffix.lower()[1:] not in FORMATS:
        raise UsageError(f"--plot {request.plot}: pictures end in .svg or .png")


def _law_or_none(fitted: CubicFit) -> Cubic | None:
    try:
        return fitted.law
    except NotRestoringError:
        return None


def _format_springs_file(
    request: Request, moments: MeasuredMoments, fitted: CubicFit, law: Cubic
) -> str:
    """The springs file of a fit; sense and dead zone are stated, so that no rule is needed."""
    explained = f", R^2 {fitted.r_squared:.4f}" if fitted.r_squared is not None else ""
    ruled = describe_sense_rule(law.coefficients, law, zone_is_stated=False)
    entry = SpringEntry(
        joints=request.joints,
        axis=request.axis,
        coefficients=law.coefficients,
        sense=law.sense,
        dead_zone=law.dead_zone,
        dead_zone_stated=True,
        motion=request.motion,
        reference=request.reference or f"the moments in {moments.name}, of unknown origin",
        why=f"Least squares{' bound to restore' if fitted.bounds_active else ''} over {_format_range(fitted)}, "
        f"rms {fitted.rms:.3g} N m{explained}. {ruled}",
    )
    try:
        return write_springs(SpringsFile((entry,)), f"Fitted to {moments.name} by mover fit.")
    except ValueError as failure:
        raise UsageError(str(failure)) from None


def _render_fit(request: Request, moments: MeasuredMoments, fitted: CubicFit, kind: str) -> bytes:
    pass  # matplotlib takes its time
    from plots.canvas import render_figure

    drawing = draw_fit(fitted, _title(request, moments), request.motion, request.reference)
    return render_figure(drawing, kind)


def _title(request: Request, moments: MeasuredMoments) -> str:
    about = " ".join([", ".join(request.joints), request.motion]).strip()
    return f"{about}: {moments.name}" if about else moments.name


def _format_range(fitted: CubicFit) -> str:
    first, last = degrees(fitted.angles.min()), degrees(fitted.angles.max())
    return f"{len(fitted.angles)} moments from {first:.4g} to {last:.4g} deg"


def _format_paragraphs(
    moments: MeasuredMoments, fitted: CubicFit, law: Cubic | None, files: list[Path]
) -> Iterator[str]:
    yield f"{moments.name}: {_format_range(fitted)}"
    errors = fitted.standard_errors
    rows = [["M = c0 + c1 a + c2 a^2 + c3 a^3, a in rad", "", "standard error", "unit"]]
    for k, (value, unit) in enumerate(zip(fitted.coefficients, COEFFICIENT_UNITS, strict=True)):
        rows.append([f"c{k}", f"{value:.6g}", f"{errors[k]:.2g}" if errors else "-", unit])
    yield format_table(rows)
    explained = (
        "none, all moments are equal" if fitted.r_squared is None else f"{fitted.r_squared:.6f}"
    )
    lines = [f"R^2 {explained}; rms residual {fitted.rms:.4g} N m"]
    if law is not None:
        lines[0] += f", of the law with its dead zone {_rms(fitted.law_residuals):.4g} N m"
        lines.append(
            f"sense {law.sense:+d}: {describe_sense_rule(law.coefficients, law, zone_is_stated=False)}"
        )
    lines += [f"doubt: {one}" for one in fitted.doubts]
    yield "\n".join(lines)
    table = [["angle [deg]", "moment", "cubic", "residual", *(["law"] if law else []), "[N m]"]]
    for row in _table_rows(fitted, law):
        table.append([f"{row['angle_deg']:.4g}", *(f"{v:.4g}" for v in list(row.values())[1:])])
    yield format_table(table, left_columns=0)
    if files:
        yield "\n".join(f"wrote {path}" for path in files)


def _table_rows(fitted: CubicFit, law: Cubic | None) -> Iterator[dict[str, float]]:
    """One row for each point: angle in deg, moments in N m."""
    columns = [np.degrees(fitted.angles), fitted.moments, fitted.fitted_moments, fitted.residuals]
    names = ["angle_deg", "moment", "cubic", "residual"]
    if law is not None:
        columns.append(fitted.moments - fitted.law_residuals)
        names.append("law")
    for values in zip(*columns, strict=True):
        yield {name: float(value) for name, value in zip(names, values, strict=True)}


def _rms(residuals: Array) -> float:
    return float(np.sqrt(np.mean(residuals**2)))


def _json_data(
    moments: MeasuredMoments,
    fitted: CubicFit,
    law: Cubic | None,
    passive: bool,
    files: list[Path],
) -> dict[str, object]:
    zone = None if law is None else law.dead_zone
    return {
        "data": moments.name,
        "passive": passive,
        "bounds_hold": fitted.bounds_active,
        "coefficients": list(fitted.coefficients),
        "standard_errors": fitted.standard_errors and list(fitted.standard_errors),
        "r_squared": fitted.r_squared,
        "rms": fitted.rms,
        "law": law
        and {
            "sense": law.sense,
            "dead_zone_deg": zone and [degrees(edge) for edge in zone],
            "rms": _rms(fitted.law_residuals),
        },
        "points": list(_table_rows(fitted, law)),
        "doubts": list(fitted.doubts),
        "files": [str(path) for path in files],
    }


# Matplotlib leaves the types of its keyword arguments open.
# pyright: reportUnknownMemberType=false


_POINTS = 400
_MARGIN = 0.04


def draw_fit(fit: CubicFit, title: str, motion: str = "", reference: str = "") -> Figure:
    """Draw a fit over the range of its data.

    Args:
        fit: of the data.
        title: what the data are.
        motion: what a positive angle is ("flexion"), or "".
        reference: where the data are from, or "".
    """
    try:
        law = fit.law
    except NotRestoringError:
        law = None
    with plot_style():
        figure = Figure(figsize=(6.4, 5.4), layout="constrained")
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[3, 1])
        _draw_moments(upper, fit, law)
        upper.set_title(title, loc="left")
        _draw_residuals(lower, fit)
        lower.set_xlabel(f"angle [deg]{f', positive in {motion}' if motion else ''}")
        said = [moment_convention(law), *([f"Data: {reference}"] if reference else [])]
        figure.supxlabel("\n".join(said), fontsize=8.0, x=0.01, ha="left", wrap=True)
    return figure


def moment_convention(law: Cubic | None) -> str:
    """The sign convention in words."""
    if law is None:
        return "M as measured. No sense makes this cubic restoring, so it is no law."
    if law.sense < 0:
        return "M is the resisting moment: the torque on the child is -M."
    return "M acts on the child: the torque on the child is +M."


def _draw_moments(axes: Axes, fit: CubicFit, law: Cubic | None) -> None:
    first, last = float(fit.angles.min()), float(fit.angles.max())
    margin = _MARGIN * (last - first)
    angles = np.linspace(first - margin, last + margin, _POINTS)
    if law is not None and law.dead_zone is not None:
        low, high = (degrees(np.clip(e, angles[0], angles[-1])) for e in law.dead_zone)
        axes.axvspan(
            low, high, facecolor="none", edgecolor=GREY, hatch="///", alpha=0.5, label="dead zone"
        )
    c0, c1, c2, c3 = fit.coefficients
    cubic = c0 + angles * (c1 + angles * (c2 + angles * c3))
    axes.plot(np.degrees(angles), cubic, color=BLUE, label="cubic")
    if law is not None:
        moment = law.sense * np.asarray(law.torque(angles))
        dashes = (0, (5, 2))
        label = "law, with its dead zone"
        axes.plot(np.degrees(angles), moment, color=VERMILION, linestyle=dashes, label=label)
    axes.plot(np.degrees(fit.angles), fit.moments, "o", color=BLACK, mfc="white", label="measured")
    axes.axhline(0.0, color=BLACK, linewidth=0.8)
    axes.set_ylabel("moment M [N m]")
    axes.legend()


def _draw_residuals(axes: Axes, fit: CubicFit) -> None:
    angles = np.degrees(fit.angles)
    axes.axhspan(-fit.rms, fit.rms, color=PALE, label=f"rms {fit.rms:.3g} N m")
    axes.axhline(0.0, color=BLACK, linewidth=0.8)
    axes.vlines(angles, 0.0, fit.residuals, color=GREY, linewidth=1.0)
    axes.plot(angles, fit.residuals, "o", color=BLACK, mfc="white", label="measured - cubic")
    axes.set_ylabel("residual [N m]")
    axes.legend(ncols=2)
