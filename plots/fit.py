"""`mover fit`: fit a cubic to measured moments, and write it as a spring and a picture."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from math import degrees
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from generator.cli.answer import HIDDEN, CommandResult, Paragraphs, Table, format_written
from generator.cli.outputs import check_writable, write_files
from generator.diagnostics import MoverError, UsageError
from generator.input_files.moments import MOMENTS_FILE
from generator.springs_file.bind import describe_sense_rule
from generator.springs_file.laws import CubicEntry
from generator.springs_file.parse import SpringEntry, SpringsFile
from generator.springs_file.write import write_springs
from plots.plate import PICTURE_FORMATS
from springs import Cubic, NotRestoringError
from springs.backends import Array
from springs.fit import CubicFit, fit_cubic

COEFFICIENT_UNITS = ("N m", "N m/rad", "N m/rad^2", "N m/rad^3")


class Axis(StrEnum):
    """Axis of a spring in its joint."""

    X = "x"
    Y = "y"
    Z = "z"
    JOINT = "joint"


@dataclass(frozen=True)
class FitResult(CommandResult):
    """Cubic fitted to moments [N m]."""

    data: str
    columns: Mapping[str, str]
    passive: bool
    bounds_hold: bool
    coefficients: Sequence[float]
    standard_errors: Sequence[float] | None
    r_squared: float | None
    rms: float
    law: Mapping[str, object] | None
    points: Sequence[Mapping[str, float]]
    doubts: Sequence[str]
    files: Sequence[Path]
    fitted: CubicFit = field(metadata=HIDDEN)
    cubic: Cubic | None = field(metadata=HIDDEN)

    def paragraphs(self) -> Paragraphs:
        """Return the coefficients, the residuals and a table of the points."""
        angle, moment = self.columns.values()
        yield f"{self.data}: {_format_range(self.fitted)}; columns `{angle}` and `{moment}`"
        errors = self.standard_errors
        rows = [["M = c0 + c1 a + c2 a^2 + c3 a^3, a in rad", "", "standard error", "unit"]]
        for k, (value, unit) in enumerate(zip(self.coefficients, COEFFICIENT_UNITS, strict=True)):
            rows.append([f"c{k}", f"{value:.6g}", f"{errors[k]:.2g}" if errors else "-", unit])
        yield Table(rows)
        explained = "undefined, all moments are equal"
        if self.r_squared is not None:
            explained = f"{self.r_squared:.6f}"
        lines, law = [f"R^2 {explained}; rms residual {self.rms:.4g} N m"], self.cubic
        if law is not None:
            rms = _rms(self.fitted.law_residuals)
            lines[0] += f", of the law with its dead zone {rms:.4g} N m"
            rule = describe_sense_rule(law.coefficients, law, zone_is_stated=False)
            lines.append(f"sense {law.sense:+d}: {rule}")
        yield "\n".join([*lines, *(f"doubt: {doubt}" for doubt in self.doubts)])
        rows = [["angle [deg]", "moment", "cubic", "residual", *(["law"] if law else []), "[N m]"]]
        yield Table([*rows, *([f"{v:.4g}" for v in row.values()] for row in self.points)], 0)
        yield format_written(self.files)


def fit(
    data: Annotated[
        Path,
        typer.Argument(
            metavar="DATA.csv",
            help="Measured moments; columns such as `angle [deg]` and `moment [N m]`.",
        ),
    ],
    passive: Annotated[
        bool,
        typer.Option("--passive", help="Constrain the cubic to restore at both ends."),
    ] = False,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write a .springs.toml file."),
    ] = None,
    joints: Annotated[
        list[str] | None,
        typer.Option("--joint", metavar="NAME", help="Joint that gets the spring, with -o."),
    ] = None,
    axis: Annotated[Axis, typer.Option(help="Axis of the joint, if it has several.")] = Axis.JOINT,
    motion: Annotated[
        str, typer.Option(metavar="TEXT", help="Name of the positive sense, such as `flexion`.")
    ] = "",
    reference: Annotated[str, typer.Option(metavar="TEXT", help="Source of the data.")] = "",
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the fit as .svg or .png.")
    ] = None,
) -> CommandResult:
    """Fit a cubic to measured moments and write it as a spring.

    The option --joint may be repeated.
    """
    named_joints = joints or ()
    _check_options(output, named_joints, plot)
    moments = MOMENTS_FILE.read(data)
    fitted = fit_cubic(moments.angles, moments.moments, passive=passive)
    try:
        law = fitted.law
    except NotRestoringError:
        law = None
    files = [path for path in (output, plot) if path is not None]
    contents: dict[Path, str | bytes] = {}
    check_writable(files, (data,))
    if output is not None:
        if law is None:
            raise MoverError(f"no spring to write: {fitted.doubts[0]}; try --passive")
        entry = SpringEntry(
            joints=tuple(named_joints),
            axis=None if axis is Axis.JOINT else axis.value,
            # The file states sense and dead zone, so that no rule has to derive them.
            law=CubicEntry(law.coefficients, law.sense, law.dead_zone, True),
            motion=motion,
            reference=reference or f"the moments in {moments.name}, of unknown origin",
            why=_describe_fit(fitted, law),
        )
        comment = f"Fitted to {moments.name} by mover fit."
        try:
            contents[output] = write_springs(SpringsFile((entry,)), comment)
        except ValueError as failure:
            raise UsageError(str(failure)) from None
    if plot is not None:
        # Matplotlib is slow to import.
        from plots.canvas import render_figure
        from plots.fit_drawing import draw_fit

        about = " ".join([", ".join(named_joints), motion]).strip()
        title = f"{about}: {moments.name}" if about else moments.name
        drawing = draw_fit(fitted, law, title, motion, reference)
        contents[plot] = render_figure(drawing, plot.suffix.lower()[1:])
    write_files(contents)
    zone = None if law is None else law.dead_zone
    return FitResult(
        data=moments.name,
        columns=dict(zip(("angle", "moment"), moments.titles, strict=True)),
        passive=passive,
        bounds_hold=fitted.bounds_active,
        coefficients=fitted.coefficients,
        standard_errors=fitted.standard_errors,
        r_squared=fitted.r_squared,
        rms=fitted.rms,
        law=law
        and {
            "sense": law.sense,
            "dead_zone_deg": zone and [degrees(edge) for edge in zone],
            "rms": _rms(fitted.law_residuals),
        },
        points=list(_table_rows(fitted, law)),
        doubts=fitted.doubts,
        files=files,
        fitted=fitted,
        cubic=law,
    )


def _check_options(output: Path | None, joints: Sequence[str], plot: Path | None) -> None:
    if output is not None:
        if not joints:
            raise UsageError("-o writes the spring of a joint: name the joint with --joint")
        if output.suffix != ".toml":
            raise UsageError(f"-o {output}: the name of a springs file must end in .springs.toml")
    elif joints:
        raise UsageError("--joint applies to a springs file: add -o FILE.springs.toml")
    if plot is not None and plot.suffix.lower()[1:] not in PICTURE_FORMATS:
        raise UsageError(f"--plot {plot}: the name of a picture must end in .svg or .png")


def _describe_fit(fitted: CubicFit, law: Cubic) -> str:
    explained = f", R^2 {fitted.r_squared:.4f}" if fitted.r_squared is not None else ""
    ruled = describe_sense_rule(law.coefficients, law, zone_is_stated=False)
    return (
        f"Least squares{' constrained to restore' if fitted.bounds_active else ''} over "
        f"{_format_range(fitted)}, rms {fitted.rms:.3g} N m{explained}. {ruled}"
    )


def _format_range(fitted: CubicFit) -> str:
    first, last = degrees(fitted.angles.min()), degrees(fitted.angles.max())
    return f"{len(fitted.angles)} moments from {first:.4g} to {last:.4g} deg"


def _table_rows(fitted: CubicFit, law: Cubic | None) -> Iterator[dict[str, float]]:
    """One row per point: angle in deg, moments in N m."""
    columns = [np.degrees(fitted.angles), fitted.moments, fitted.fitted_moments, fitted.residuals]
    names = ["angle_deg", "moment", "cubic", "residual"]
    if law is not None:
        columns.append(fitted.moments - fitted.law_residuals)
        names.append("law")
    for values in zip(*columns, strict=True):
        yield {name: float(value) for name, value in zip(names, values, strict=True)}


def _rms(residuals: Array) -> float:
    return float(np.sqrt(np.mean(residuals**2)))
