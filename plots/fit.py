"""`mover fit`: a cubic through measured moments, as numbers, as a spring and as a picture."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import degrees
from pathlib import Path

import numpy as np

from generator.commands.answer import Answer, UsageError, aligned
from generator.commands.outputs import insist_writable
from generator.errors import MoverError
from generator.reader.given_springs import rule_said
from generator.reader.moments_file import MeasuredMoments, read_moments
from generator.reader.springs_file import SpringEntry, SpringsFile
from generator.springs_writer import write_springs
from plots.output import write
from springs import Cubic, NotRestoringError
from springs.fit import CubicFit, fit_cubic
from springs.operations import Array

FORMATS = ("svg", "png")
UNITS = ("N m", "N m/rad", "N m/rad^2", "N m/rad^3")


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


def fit(request: Request) -> Answer:
    """Fit what is asked for and write the files.

    Raises:
        UsageError: options that do not go together.
        InputError: the data are wrong, or a file cannot be written.
        MoverError: the cubic is no law, but a springs file is asked for.
    """
    _check_options(request)
    moments = read_moments(request.data)
    fitted = fit_cubic(moments.angles, moments.moments, passive=request.passive)
    law = _law_of(fitted)
    files = [path for path in (request.output, request.plot) if path is not None]
    insist_writable(files, (request.data,))
    if request.output is not None:
        if law is None:
            raise MoverError(f"there is no spring to write: {fitted.doubts[0]}; try --passive")
        write(request.output, _springs_text(request, moments, fitted, law))
    if request.plot is not None:
        kind = request.plot.suffix.lower()[1:]
        write(request.plot, _picture(request, moments, fitted, kind))
    return Answer(
        text="\n\n".join(_paragraphs(moments, fitted, law, files)),
        data=_data(moments, fitted, law, request.passive, files),
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


def _law_of(fitted: CubicFit) -> Cubic | None:
    try:
        return fitted.law
    except NotRestoringError:
        return None


def _springs_text(request: Request, moments: MeasuredMoments, fitted: CubicFit, law: Cubic) -> str:
    """The springs file of a fit; sense and dead zone are stated, so that no rule is needed."""
    explained = f", R^2 {fitted.r_squared:.4f}" if fitted.r_squared is not None else ""
    ruled = rule_said(law.coefficients, law, zone_given=False)
    entry = SpringEntry(
        joints=request.joints,
        axis=request.axis,
        coefficients=law.coefficients,
        sense=law.sense,
        dead_zone=law.dead_zone,
        dead_zone_stated=True,
        motion=request.motion,
        reference=request.reference or f"the moments in {moments.name}, of unknown origin",
        why=f"Least squares{' bound to restore' if fitted.bound else ''} over {_range(fitted)}, "
        f"rms {fitted.rms:.3g} N m{explained}. {ruled}",
    )
    try:
        return write_springs(SpringsFile((entry,)), f"Fitted to {moments.name} by mover fit.")
    except ValueError as failure:
        raise UsageError(str(failure)) from None


def _picture(request: Request, moments: MeasuredMoments, fitted: CubicFit, kind: str) -> bytes:
    from plots.fit_drawing import draw_fit  # matplotlib takes its time
    from plots.style import picture

    drawing = draw_fit(fitted, _title(request, moments), request.motion, request.reference)
    return picture(drawing, kind)


def _title(request: Request, moments: MeasuredMoments) -> str:
    about = " ".join([", ".join(request.joints), request.motion]).strip()
    return f"{about}: {moments.name}" if about else moments.name


def _range(fitted: CubicFit) -> str:
    first, last = degrees(fitted.angles.min()), degrees(fitted.angles.max())
    return f"{len(fitted.angles)} moments from {first:.4g} to {last:.4g} deg"


def _paragraphs(
    moments: MeasuredMoments, fitted: CubicFit, law: Cubic | None, files: list[Path]
) -> Iterator[str]:
    yield f"{moments.name}: {_range(fitted)}"
    errors = fitted.standard_errors
    rows = [["M = c0 + c1 a + c2 a^2 + c3 a^3, a in rad", "", "standard error", "unit"]]
    for k, (value, unit) in enumerate(zip(fitted.coefficients, UNITS, strict=True)):
        rows.append([f"c{k}", f"{value:.6g}", f"{errors[k]:.2g}" if errors else "-", unit])
    yield aligned(rows)
    explained = (
        "none, all moments are equal" if fitted.r_squared is None else f"{fitted.r_squared:.6f}"
    )
    lines = [f"R^2 {explained}; rms residual {fitted.rms:.4g} N m"]
    if law is not None:
        lines[0] += f", of the law with its dead zone {_rms(fitted.law_residuals):.4g} N m"
        lines.append(f"sense {law.sense:+d}: {rule_said(law.coefficients, law, zone_given=False)}")
    lines += [f"doubt: {one}" for one in fitted.doubts]
    yield "\n".join(lines)
    table = [["angle [deg]", "moment", "cubic", "residual", *(["law"] if law else []), "[N m]"]]
    for row in _rows(fitted, law):
        table.append([f"{row['angle_deg']:.4g}", *(f"{v:.4g}" for v in list(row.values())[1:])])
    yield aligned(table, left=0)
    if files:
        yield "\n".join(f"wrote {path}" for path in files)


def _rows(fitted: CubicFit, law: Cubic | None) -> Iterator[dict[str, float]]:
    """One row for each point: angle in deg, moments in N m."""
    columns = [np.degrees(fitted.angles), fitted.moments, fitted.fitted, fitted.residuals]
    names = ["angle_deg", "moment", "cubic", "residual"]
    if law is not None:
        columns.append(fitted.moments - fitted.law_residuals)
        names.append("law")
    for values in zip(*columns, strict=True):
        yield {name: float(value) for name, value in zip(names, values, strict=True)}


def _rms(residuals: Array) -> float:
    return float(np.sqrt(np.mean(residuals**2)))


def _data(
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
        "bounds_hold": fitted.bound,
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
        "points": list(_rows(fitted, law)),
        "doubts": list(fitted.doubts),
        "files": [str(path) for path in files],
    }
