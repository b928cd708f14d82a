"""`mover fit`: fit a curve to measured moments, and write it as a spring and a picture."""

from collections import Counter
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
from generator.diagnostics import MoverError, UsageError, shorten, spelling_hint
from generator.figure_file.read import FIGURE_FILE
from generator.input_files.moments import MOMENTS_FILE
from generator.springs_file.bind import describe_sense_rule
from generator.springs_file.laws import CubicEntry, describe_law, law_data
from generator.springs_file.parse import SpringEntry, SpringsFile
from generator.springs_file.write import write_springs
from plots.plate import PICTURE_FORMATS
from springs import Cubic
from springs.fit import CubicFit, fit_cubic
from springs.fit_forms import Form, FormFit, choose_form, fit_forms, form_doubts

COEFFICIENT_UNITS = ("N m", "N m/rad", "N m/rad^2", "N m/rad^3")


class Axis(StrEnum):
    """Axis of a spring in its joint."""

    X = "x"
    Y = "y"
    Z = "z"
    JOINT = "joint"


@dataclass(frozen=True)
class FitResult(CommandResult):
    """Curve fitted to moments [N m], with the cubic in any case."""

    data: str
    columns: Mapping[str, str]
    passive: bool
    bounds_hold: bool
    coefficients: Sequence[float]
    standard_errors: Sequence[float] | None
    r_squared: float | None
    rms: float
    form: Form | None
    forms: Sequence[Mapping[str, object]]
    law: Mapping[str, object] | None
    points: Sequence[Mapping[str, float]]
    doubts: Sequence[str]
    files: Sequence[Path]
    fitted: CubicFit = field(metadata=HIDDEN)
    chosen: FormFit | None = field(metadata=HIDDEN)

    def paragraphs(self) -> Paragraphs:
        """Return the forms, the law and its doubts, and a table of the points."""
        angle, moment = self.columns.values()
        yield f"{self.data}: {_format_range(self.fitted)}; columns `{angle}` and `{moment}`"
        rows = [["form", "parameters", "rms [N m]", "error at angles left out [N m]"]]
        for one in self.forms:
            values = (one[key] for key in ("rms", "error"))
            numbers = ["-" if value is None else f"{value:.4g}" for value in values]
            mark = " (chosen)" if one["form"] == self.form else ""
            rows.append([f"{one['form']}{mark}", str(one["parameters"]), *numbers])
        yield Table(rows)
        if self.chosen is None or self.form is Form.CUBIC:
            yield from self._cubic_paragraphs()
        else:
            assert self.chosen.law is not None
            lines = [describe_law(self.chosen.law), f"sense {self.chosen.sense:+d}"]
            yield "\n".join([*lines, *(f"doubt: {doubt}" for doubt in self.doubts)])
        yield Table(self._points_table(), 0)
        yield format_written(self.files)

    def _points_table(self) -> list[list[str]]:
        """Return the points with the moments of the curves, and what is left of the chosen one."""
        titles, points = ["moment", "law", "residual"], self.points
        if self.chosen is None or self.form is Form.CUBIC:
            titles = ["moment", "cubic", "residual", *["law"] * bool(self.law)]
        else:
            points = [one | {"residual": one["moment"] - one["law"]} for one in map(dict, points)]
        head = ["angle [deg]", *titles, "[N m]"]
        return [head, *([f"{one[key]:.4g}" for key in ("angle_deg", *titles)] for one in points)]

    def _cubic_paragraphs(self) -> Paragraphs:
        """Return the coefficients, the residuals and the rule of the sense."""
        errors = self.standard_errors
        rows = [["M = c0 + c1 a + c2 a^2 + c3 a^3, a in rad", "", "standard error", "unit"]]
        for k, (value, unit) in enumerate(zip(self.coefficients, COEFFICIENT_UNITS, strict=True)):
            rows.append([f"c{k}", f"{value:.6g}", f"{errors[k]:.2g}" if errors else "-", unit])
        yield Table(rows)
        explained = "undefined, all moments are equal"
        if self.r_squared is not None:
            explained = f"{self.r_squared:.6f}"
        lines = [f"R^2 {explained}; rms residual {self.rms:.4g} N m"]
        if self.law is not None:
            law = self.fitted.law
            lines[0] += f", of the law with its dead zone {self.law['rms']:.4g} N m"
            rule = describe_sense_rule(law.coefficients, law, zone_is_stated=False)
            lines.append(f"sense {law.sense:+d}: {rule}")
        yield "\n".join([*lines, *(f"doubt: {doubt}" for doubt in self.doubts)])


def fit(
    data: Annotated[
        Path,
        typer.Argument(
            metavar="DATA.csv",
            help="Measured moments; columns such as `angle [deg]` and `moment [N m]`.",
        ),
    ],
    form: Annotated[
        Form | None, typer.Option(help="Form of the curve. [default: chosen by cross-validation]")
    ] = None,
    passive: Annotated[
        bool,
        typer.Option("--passive", help="Constrain the curve to restore at both ends."),
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
    """Fit a curve to measured moments and write it as a spring.

    The option --joint may be repeated.
    """
    named_joints = joints or ()
    _check_options(output, named_joints, plot)
    moments = MOMENTS_FILE.read(data)
    fitted = fit_cubic(moments.angles, moments.moments, passive=passive)
    forms = fit_forms(fitted.angles, fitted.moments, passive=passive)
    asked = [one for one in forms if form in (None, one.form)]
    chosen = choose_form(asked)
    files = [path for path in (output, plot) if path is not None]
    contents: dict[Path, str | bytes] = {}
    check_writable(files, (data,))
    doubts = fitted.doubts
    if chosen is not None and chosen.form is not Form.CUBIC:
        doubts = tuple(form_doubts(chosen, fitted.angles))
    if output is not None:
        if chosen is None:
            reason = doubts[0] if asked[0].form is Form.CUBIC else asked[0].obstacle
            raise MoverError(f"no spring to write: {reason}; try --passive")
        law = chosen.law
        if isinstance(law, Cubic):  # a springs file states its sense and its dead zone
            law = CubicEntry(law.coefficients, law.sense, law.dead_zone, True)
        assert law is not None
        entry = SpringEntry(
            joints=tuple(named_joints),
            axis=None if axis is Axis.JOINT else axis.value,
            law=law,
            motion=motion,
            reference=reference or f"the moments in {moments.name}, of unknown origin",
            why=_describe_fit(fitted, chosen, forms, is_asked=form is not None),
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
        drawing = draw_fit(fitted, chosen, title, motion, reference)
        contents[plot] = render_figure(drawing, plot.suffix.lower()[1:])
    write_files(contents)
    data_of_law = None
    if chosen is not None and chosen.law is not None:
        beside = {"sense": chosen.sense, "rms": _form_rms(chosen, fitted)}
        data_of_law = law_data(chosen.law) | beside
    return FitResult(
        data=moments.name,
        columns=dict(zip(("angle", "moment"), moments.titles, strict=True)),
        passive=passive,
        bounds_hold=fitted.bounds_active,
        coefficients=fitted.coefficients,
        standard_errors=fitted.standard_errors,
        r_squared=fitted.r_squared,
        rms=fitted.rms,
        form=None if chosen is None else chosen.form,
        forms=[
            {
                "form": one.form,
                "parameters": one.parameters,
                "rms": _form_rms(one, fitted),
                "error": one.error,
                "obstacle": one.obstacle,
            }
            for one in forms
        ],
        law=data_of_law,
        points=list(_table_rows(fitted, chosen)),
        doubts=doubts,
        files=files,
        fitted=fitted,
        chosen=chosen,
    )


def _form_rms(form: FormFit, fitted: CubicFit) -> float | None:
    """Return the root mean square of a form's residuals [N m]; None without a law."""
    if form.law is None:
        return None
    return float(np.sqrt(np.mean((fitted.moments - form.moments(fitted.angles)) ** 2)))


def _check_options(output: Path | None, joints: Sequence[str], plot: Path | None) -> None:
    if output is not None and not joints:
        raise UsageError("-o writes the spring of a joint: name the joint with --joint")
    if output is None and joints:
        raise UsageError("--joint applies to a springs file: add -o FILE.springs.toml")
    check_fit_outputs(output, plot)
    if output is not None:
        _check_joints(output, joints)


def check_fit_outputs(output: Path | None, plot: Path | None) -> None:
    """Raise UsageError for names that are not those of a springs file and a picture."""
    if output is not None and output.suffix != ".toml":
        raise UsageError(f"-o {output}: the name of a springs file must end in .springs.toml")
    if plot is not None and plot.suffix.lower()[1:] not in PICTURE_FORMATS:
        raise UsageError(f"--plot {plot}: the name of a picture must end in .svg or .png")


def _check_joints(output: Path, joints: Sequence[str]) -> None:
    """Raise UsageError for a joint of no figure, shipped or beside the springs file, or twice."""
    for name, count in Counter(joints).items():
        if count > 1:
            raise UsageError(f"--joint {shorten(name)}: the joint is named twice")
    known = {name for one in FIGURE_FILE.shipped() for name in FIGURE_FILE.read(one).joints}
    if known.issuperset(joints):
        return
    for path in output.parent.glob(f"*{FIGURE_FILE.suffix}"):
        figure = FIGURE_FILE.parse_file(path).value
        known |= set() if figure is None else figure.joints.keys()
    for name in joints:
        if name not in known:
            raise UsageError(
                f"--joint {shorten(name)}: no figure, shipped or beside {output.name}, has such a "
                f"joint; {spelling_hint(name, known)}"
            )


def _describe_fit(
    fitted: CubicFit, chosen: FormFit, forms: Sequence[FormFit], *, is_asked: bool
) -> str:
    """Return what a springs file says of its fit."""
    compared = ", ".join(
        f"{one.form} {one.error:.3g} N m" for one in forms if one.error is not None
    )
    cross = "" if is_asked or not compared else f" Errors at angles left out: {compared}."
    if chosen.form is Form.CUBIC:
        explained = f", R^2 {fitted.r_squared:.4f}" if fitted.r_squared is not None else ""
        bound, rms = fitted.bounds_active, fitted.rms
        ruled = describe_sense_rule(fitted.law.coefficients, fitted.law, zone_is_stated=False)
    else:
        explained, bound, ruled = "", False, f"Sense {chosen.sense:+d}."
        rms = _form_rms(chosen, fitted)
    return (
        f"Least squares of {chosen.form}{' constrained to restore' if bound else ''} over "
        f"{_format_range(fitted)}, rms {rms:.3g} N m{explained}. {ruled}{cross}"
    )


def _format_range(fitted: CubicFit) -> str:
    first, last = degrees(fitted.angles.min()), degrees(fitted.angles.max())
    return f"{len(fitted.angles)} moments from {first:.4g} to {last:.4g} deg"


def _table_rows(fitted: CubicFit, chosen: FormFit | None) -> Iterator[dict[str, float]]:
    """One row per point: angle in deg, moments in N m."""
    columns = {
        "angle_deg": np.degrees(fitted.angles),
        "moment": fitted.moments,
        "cubic": fitted.fitted_moments,
        "residual": fitted.residuals,
    }
    if chosen is not None:
        columns["law"] = chosen.moments(fitted.angles)
    for values in zip(*columns.values(), strict=True):
        yield dict(zip(columns, map(float, values), strict=True))
