"""`mover inverse`: joint moments of a measured motion, and how much of them is passive."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from math import degrees
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from generator.cli import inputs, options, outputs
from generator.cli.answer import CommandResult, Paragraphs, Table, format_written
from generator.cli.options import option, output_option
from generator.diagnostics import Diagnostic, InputError, ModelError, UsageError, error, warning
from generator.figure import Figure
from generator.input_files.coordinates import (
    Coordinates,
    coordinates_of_figure,
    displacement_columns,
)
from generator.inverse.external_loads import read_external_loads
from generator.inverse.legs import find_legs
from generator.inverse.moments import (
    MIN_SURE,
    STANDARD_GRAVITY,
    JointMoments,
    format_moments,
    joint_moments,
)
from generator.inverse.passive import (
    DEFAULT_LAWS,
    MEAN_PARAMETERS,
    ZERO_WITH_NEUTRAL,
    ZERO_WITHOUT,
    LegLaw,
    PassiveBand,
    PassiveLaw,
    SpringsLaw,
    format_bands,
    passive_bands,
    published_law,
    require_legs,
)
from generator.inverse.run_contact import contact_of_run
from generator.motion_files import FigureMotion
from generator.run_options import MAX_GRAVITY
from springs.elastic import Range
from springs.published.tables import publications

_FREQUENCY = re.compile(r"\s*([0-9.eE+-]+)\s*Hz\s*", re.IGNORECASE)

MOMENTS_SUFFIX, SHARE_SUFFIX, PAGE_SUFFIX = ".sto", ".csv", ".html"
"""Suffixes of the tables of moments, and of net and passive moments, and of the page."""


MAX_NAMED_BODIES = 6
"""Bodies with forces that the title names."""

MAX_MEAN_RESIDUAL = 0.1
"""Mean residual force of the root above which moments are in doubt [body weights]; an estimate."""

MAX_RESIDUAL_OF_RUN = 0.05
"""Largest residual force of the root above which moments of a run are [body weights]; an estimate.

Its forces are known, so that only the spacing of the frames, or other loads, leave one."""


@dataclass(frozen=True, kw_only=True)
class InverseResult(CommandResult):
    """Moments that a motion needs.

    Attributes:
        figure: Figure or model.
        motion: File of the motion.
        forces: Bodies with measured forces.
        moments: Generalized forces along the motion.
        bands: Passive moments by coordinate.
        uncertainty: Shift of the zeros of angles, either way, in the ranges of shares [rad].
        files: Files that were written.
    """

    figure: str
    motion: Path
    forces: Sequence[str]
    moments: JointMoments
    bands: Mapping[str, PassiveBand]
    uncertainty: float
    files: Sequence[Path]

    @property
    def sure(self) -> tuple[float, float] | None:
        """First and last time at which accelerations are sure [s]; None where none is."""
        times = self.moments.times[self.moments.is_sure]
        return (float(times[0]), float(times[-1])) if len(times) else None

    def to_json(self) -> dict[str, object]:
        """Return extremes and works by coordinate, residuals, shares, and all samples."""
        moments, every = self.moments, self.moments.coordinates
        return {
            "figure": self.figure,
            "motion": self.motion,
            "forces": self.forces,
            "cutoff_Hz": moments.cutoff,
            "mass_kg": moments.mass,
            "height_m": moments.height,
            "sure_s": self.sure,
            "coordinates": dict(_summaries(moments)),
            "residuals": dict(_residuals(moments)),
            "times_s": moments.times,
            "moments": {one.label: one.forces for one in every.values()},
            "powers_W": {name: one.powers for name, one in every.items()},
            "zero_uncertainty_deg": degrees(self.uncertainty) if self.bands else None,
            "passive": {
                name: {
                    "share": band.share_range,
                    "by_law": _shares_by_law(band),
                    "known": band.known_range,
                    "net_positive_work_J": moments.works(every[name].powers).positive,
                }
                for name, band in self.bands.items()
            },
            "files": self.files,
        }

    def paragraphs(self) -> Paragraphs:
        """Return the tables of moments and residuals."""
        done = _filter_and_forces(self.moments.cutoff, self.forces)
        frames = options.format_frames(self.moments.times)
        yield f"{frames}, {done}; {self.moments.mass:.4g} kg"
        rows = [["", "largest", "at [s]", "smallest", "at [s]", "", "work + [J]", "work - [J]"]]
        for name, one in _summaries(self.moments):
            unit, *numbers = one.values()
            texts = [f"{number:.4g}" for number in numbers]
            rows.append([name, *texts[:4], unit, *texts[4:]])
        yield Table(rows)
        rows = [["residual of the root", "largest", "", "share", ""]]
        for name, one in _residuals(self.moments):
            largest, unit, share, share_unit = one.values()
            rows.append([name, f"{largest:.4g}", unit, f"{share:.3g}", share_unit])
        is_free = len(rows) > 1
        yield Table(rows) if is_free else "the figure is attached to the ground: no residual"
        if self.sure is not None:
            yield f"extremes, works and shares are from {self.sure[0]:g} to {self.sure[1]:g} s"
        if self.bands:
            yield self._shares_table()
        yield format_written(self.files)

    def _shares_table(self) -> Table:
        """Return the table of passive shares."""
        laws = list(dict.fromkeys(law for band in self.bands.values() for law in band.shares))
        title = f"passive share of work +, zeros +-{degrees(self.uncertainty):g} deg"
        rows = [[title, "all laws", *(laws if len(laws) > 1 else []), "known part"]]
        for name, band in self.bands.items():
            by_law = _shares_by_law(band)
            shares = [band.share_range, *(map(by_law.get, laws) if len(laws) > 1 else ())]
            rows.append([name, *map(_format_share, shares), _format_share(band.known_range)])
        return Table(rows)


def _filter_and_forces(cutoff: float | None, bodies: Sequence[str]) -> str:
    """Return what a motion passed and what acts on it, in words."""
    filtered = "not filtered" if cutoff is None else f"filtered at {cutoff:g} Hz"
    names = ", ".join(bodies) if len(bodies) <= MAX_NAMED_BODIES else f"{len(bodies)} bodies"
    forces = f"forces on {names}" if bodies else "no forces but gravity"
    return f"{filtered}; {forces}"


def _format_share(share: tuple[float, float] | None) -> str:
    return "-" if share is None else f"{100.0 * share[0]:.0f} .. {100.0 * share[1]:.0f} %"


def inverse(
    model: options.BodyName,
    motion: Annotated[
        Path, typer.Argument(metavar="MOTION", help="Its motion: .mot .sto .action .npz.")
    ],
    forces: Annotated[
        Path | None,
        option(
            "GRF.xml|GRF.mot", "Measured forces: OpenSim's external loads, or a table with --force."
        ),
    ] = None,
    force: Annotated[
        list[str] | None,
        option(
            "BODY=PREFIX", "Body of a force whose columns are PREFIX_vx, PREFIX_px ...; repeat it."
        ),
    ] = None,
    cutoff: Annotated[
        str | None, option("6Hz", "Filter displacements: Butterworth, both ways. [default: none]")
    ] = None,
    springs: Annotated[
        list[str] | None,
        option(
            "LAW|FILE|NAME",
            "Passive laws: published ones as publication/name, or springs of the figure; "
            f"repeat it. [default: {', '.join(DEFAULT_LAWS)}]",
        ),
    ] = None,
    neutral: Annotated[
        Path | None, option("STATIC.mot", "Upright standing, at which angles of laws are zero.")
    ] = None,
    hip_zero: Annotated[
        str | None, option("10deg", "Hip flexion there in published laws. [default: 0]")
    ] = None,
    gravity: options.Gravity = None,
    output: Annotated[
        list[Path] | None,
        output_option(
            "FILE", "Moments as OpenSim's, .sto; net and passive ones, powers, .csv; a page, .html."
        ),
    ] = None,
) -> CommandResult:
    """Find joint moments of a measured motion, and the passive share."""
    files = list(output or ())
    _check_outputs(files)
    zero = 0.0 if hip_zero is None else options.angle_from_option("--hip-zero", hip_zero)
    if force and forces is None:
        raise UsageError("--force names the columns of a table: add --forces TABLE")
    hertz = None if cutoff is None else frequency_from_option("--cutoff", cutoff)
    down = STANDARD_GRAVITY
    if gravity is not None:
        down = options.vector_from_option("--gravity", gravity, MAX_GRAVITY)
    figure, coordinates, warnings = load_body(model)
    outputs.check_writable(files, (figure.path, model, motion, forces))
    moved, more = _read_motion(motion, figure, coordinates, is_whole=True)
    loads, table = (), None
    if forces is not None:
        loads, table = read_external_loads(forces, moved.tree.figure, force or ())
        outputs.check_writable(files, (table,))
    try:
        measured = None if forces is None and moved.recording is not None else loads
        loads = contact_of_run(moved) if measured is None else loads
        moments = joint_moments(moved, coordinates, loads, hertz, down)
    except InputError as failure:
        raise InputError(
            one if one.span is not None else error(f"{motion}: {one.message}", hint=one.hint)
            for one in failure.diagnostics
        ) from None
    except ModelError as failure:
        raise InputError([error(f"{model}: {failure}")]) from None
    zeros, seen = ({}, ()) if neutral is None else _neutral_values(neutral, figure, coordinates)
    laws, own = _passive_laws(
        springs,
        model,
        moved,
        moments,
        coordinates,
        zeros,
        zero,
        needed=any(file.suffix == SHARE_SUFFIX for file in files),
    )
    uncertainty = ZERO_WITHOUT if neutral is None else ZERO_WITH_NEUTRAL
    bands = passive_bands(moments, laws, uncertainty) if laws else {}
    upward = {
        one.body: np.interp(moments.times, one.times, one.force[:, 1])
        for one in loads
        if one.force_frame is None
    }
    doubts = _doubts(moments, moved, hertz)
    what = f"{motion.name}, {_filter_and_forces(hertz, [one.body for one in loads])}"
    formats = {
        MOMENTS_SUFFIX: lambda: "\n".join([*format_moments(moments), ""]),
        SHARE_SUFFIX: lambda: "".join(format_bands(moments, bands, upward)),
        PAGE_SUFFIX: lambda: import_module("generator.inverse.page").moments_page(
            moved, moments, bands, coordinates, measured, uncertainty, what, doubts
        ),
    }
    outputs.write_files({path: formats[path.suffix.lower()]() for path in files})
    return InverseResult(
        figure=model,
        motion=motion,
        forces=[one.body for one in loads],
        moments=moments,
        bands=bands,
        uncertainty=uncertainty,
        files=files,
        diagnostics=(*warnings, *more, *seen, *own, *doubts),
    )


def _check_outputs(files: Sequence[Path]) -> None:
    for path in files:
        if path.suffix.lower() not in (MOMENTS_SUFFIX, SHARE_SUFFIX, PAGE_SUFFIX):
            raise UsageError(
                f"-o {path}: {outputs.suffix_fault(path)}; moments are a {MOMENTS_SUFFIX}, net and "
                f"passive moments a {SHARE_SUFFIX} file, the motion with both a {PAGE_SUFFIX} page"
            )
    outputs.check_distinct_paths(files)


def _neutral_values(
    path: Path, figure: Figure, coordinates: Coordinates
) -> tuple[dict[str, float], tuple[Diagnostic, ...]]:
    """Return the mean of each coordinate over a static trial [rad or m], and warnings."""
    static, warnings = _read_motion(path, figure, coordinates, is_whole=False)
    found: dict[str, float] = {}
    for name, at in displacement_columns(static.chains, coordinates).items():
        mean = float(np.mean(static.displacements[at.joint][:, at.index]))
        found[name] = at.scale * mean + at.offset
    return found, warnings


def _passive_laws(
    choices: Sequence[str] | None,
    model: str,
    motion: FigureMotion,
    moments: JointMoments,
    coordinates: Coordinates,
    zeros: Mapping[str, float],
    hip_zero: float,
    *,
    needed: bool,
) -> tuple[list[PassiveLaw], tuple[Diagnostic, ...]]:
    """Return the laws of `--springs` with warnings; none by default for a figure without legs.

    Raises UsageError and InputError.
    """
    columns = displacement_columns(motion.chains, coordinates)
    legs = find_legs(motion.tree, columns)
    if not choices and not legs and not needed:
        return [], ()
    found: list[PassiveLaw] = []
    warnings: list[Diagnostic] = []
    for name in dict.fromkeys(choices or DEFAULT_LAWS):
        publication, _, row = name.partition("/")
        if row and publication in publications():
            published_law(name)
            require_legs(legs, model)
            found.append(LegLaw(name, legs, moments, zeros, hip_zero))
            if name in MEAN_PARAMETERS:
                what = f"--springs {name}: parameters that are means of subjects"
                warnings.append(warning(what, hint="their moments are not mean moments"))
            continue
        springs, more = inputs.springs_from_option(motion.figure, name)
        warnings += more
        law = SpringsLaw(name, motion, springs, moments, columns, zeros)
        if not law.groups:
            raise UsageError(f"--springs {name}: these springs have no elastic law")
        found.append(law)
    return found, tuple(warnings)


def _shares_by_law(band: PassiveBand) -> dict[str, Range | None]:
    """Return the smallest and the largest share of each law; None where it is not known."""
    return {law: (min(all_), max(all_)) if all_ else None for law, all_ in band.shares.items()}


def frequency_from_option(option: str, text: str) -> float:
    """Parse a frequency [Hz] such as `6Hz`. Raises UsageError."""
    match = _FREQUENCY.fullmatch(text)
    try:
        value = float(match[1] if match else "")
    except ValueError:
        raise UsageError(f"{option} {text}: expected a frequency such as 6Hz") from None
    if not 0.0 < value < np.inf:
        raise UsageError(f"{option} {text}: a frequency is above zero")
    return value


def load_body(source: str) -> tuple[Figure, Coordinates, tuple[Diagnostic, ...]]:
    """Load a figure, or a model as one, with coordinates and warnings. Raises InputError.

    Args:
        source: Path or name of a figure, or path of a model.
    """
    from generator.conversion import check_no_macros, is_model  # imports all formats of models
    from generator.model_files.formats import read_model
    from generator.model_files.opensim.joints import FIXED_CURVES

    check_no_macros(source)
    if is_model(source):
        imported = read_model(source)
        lost = [loss for loss in imported.losses.entries if loss.what == FIXED_CURVES]
        found = tuple(
            warning(f"{source}: {loss}", hint="their moments are those of the fixed axes")
            for loss in lost
        )
        return imported.figure, imported.coordinates, found
    figure, warnings = inputs.load_figure(source)
    inputs.check_chains(figure)
    return figure, coordinates_of_figure(figure), warnings


def _read_motion(
    path: Path, figure: Figure, coordinates: Coordinates, *, is_whole: bool
) -> tuple[FigureMotion, tuple[Diagnostic, ...]]:
    from generator.conversion import read_motion_with_warnings

    motion, warnings = read_motion_with_warnings(path, figure, coordinates, is_whole=is_whole)
    return motion, (*warnings, *inputs.changed_figure_warnings(figure, motion.header, path))


def _doubts(
    moments: JointMoments, motion: FigureMotion, cutoff: float | None
) -> Sequence[Diagnostic]:
    """Return warnings about a motion whose moments are unsure."""
    found: list[Diagnostic] = []
    if not moments.is_sure.any():
        few = f"fewer than {MIN_SURE} frames are half a second from both ends of the motion"
        hint = "record half a second more at both ends"
        found.append(warning(f"{few}: moments are unsure", hint=hint))
    residual, largest = moments.mean_residual_share, moments.largest_residual_share
    if motion.recording is not None and largest > MAX_RESIDUAL_OF_RUN:
        spacing = float(np.median(np.diff(motion.times)))
        what = f"the residual of the root reaches {largest:.2g} body weights"
        what += f", {residual:.2g} on average, with frames {spacing:.3g} s apart"
        cause = "blows need shorter frames, such as `mover simulate ... --frame 0.0005`"
        cause += ", or loads or self-contact act, which are not known here"
        found.append(warning(f"{what}: do not trust the moments; {cause}"))
    elif residual > MAX_MEAN_RESIDUAL:
        what = f"the residual of the root is {residual:.2g} body weights on average"
        cause = "forces on the figure are missing or wrong (--forces)"
        found.append(warning(f"{what}: do not trust the moments; {cause}"))
    if cutoff is None and motion.recording is None:
        found.append(
            warning(
                "the motion is not filtered: noise of markers is amplified in accelerations",
                hint="walking is usually filtered with --cutoff 6Hz",
            )
        )
    if len(moments.times) < len(motion.times):
        first, last = moments.times[0], moments.times[-1]
        found.append(
            warning(f"forces are known from {first:g} to {last:g} s, so that moments are, too")
        )
    return found


def _summaries(moments: JointMoments) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield extremes and works of each coordinate's moment while accelerations are sure."""
    for name, one in moments.coordinates.items():
        if not one.is_root:
            times, forces = moments.times[moments.kept], one.forces[moments.kept]
            high, low, works = np.argmax(forces), np.argmin(forces), moments.works(one.powers)
            yield (
                name,
                {
                    "unit": one.unit,
                    "largest": forces[high],
                    "largest_at_s": times[high],
                    "smallest": forces[low],
                    "smallest_at_s": times[low],
                    "positive_work_J": works.positive,
                    "negative_work_J": works.negative,
                },
            )


def _residuals(moments: JointMoments) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the largest residual of each coordinate of the root, also as a share.

    The share is of body weight for a force; a moment is over mass times height.
    """
    for name, one in moments.coordinates.items():
        if one.is_root:
            yield (
                name,
                {
                    "largest": np.abs(one.forces[moments.kept]).max(),
                    "unit": one.unit,
                    "share": moments.residual_share(name),
                    "share_unit": "N m/(kg m)" if one.is_angle else "of body weight",
                },
            )
