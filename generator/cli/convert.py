"""`mover convert`: motions, figures and other programs' models in each other's formats."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from os.path import realpath
from pathlib import Path
from typing import Annotated, Any

import typer

from generator import conversion, motion_files
from generator.cli import inputs
from generator.cli.answer import HIDDEN, OMITTED_IF_NONE, CommandResult, Paragraphs, format_count
from generator.cli.options import (
    FallOption,
    FloorOption,
    FreeRoot,
    FrictionOption,
    HeightOption,
    JointValues,
    LawChoice,
    PoseFile,
    SceneOption,
    SeedOption,
    SpringsChoice,
    format_frames,
    option,
)
from generator.cli.outputs import (
    LossesByPath,
    OutputWriter,
    check_distinct_paths,
    check_motion_formats,
    check_writable,
    format_files,
    model_writers,
    unwritable_file_error,
    write_all_or_none,
    write_models,
    writing,
)
from generator.diagnostics import Diagnostic, InputError, UsageError, error
from generator.figure import Figure
from generator.figure_file.read import FIGURE_FILE
from generator.input_files.pose import POSE_FILE
from generator.kinematics.placement import Placement
from generator.losses import Effect, Loss, Losses
from generator.model import Model, contact_of_figure
from generator.model_files.formats import MODEL_FORMATS, read_model, suffixes
from generator.model_files.model_files import (
    Imported,
    ModelFiles,
    format_imported_springs,
    imported_files,
    springs_path,
    unreadable_file_error,
)
from generator.motion_files.resample import resample
from generator.run_options import RUN_OPTIONS
from generator.simulation.plan import Plan
from springs import SphericalLaw

MAX_BRIEF_LOSSES = 4
"""Losses of all files that are listed without `--verbose`; at least one of each file."""

MAX_BRIEF_LOSS_LENGTH = 110
"""Length of the line of a loss without `--verbose`."""


_RUN_KEYS = (
    *("springs", "law", "pose", "set", "free_root", "floor"),
    *("scene", "fall", "seed", "height", "friction"),
)
"""Options of a run that a conversion of a figure has."""


@dataclass(frozen=True, kw_only=True)
class Conversion(CommandResult):
    """Files that were written, and what they do not hold.

    Attributes:
        source: Motion, figure or model that was read.
        files: Outputs, and the files that belong to them.
        title: First line.
        is_import: True if the source is a model.
        lists_all: List all losses with all their places; otherwise a few, a line each.
    """

    source: str
    figure: str | None = field(default=None, metadata=OMITTED_IF_NONE)
    frames: int | None = field(default=None, metadata=OMITTED_IF_NONE)
    files: Sequence[Path]
    coordinates: Mapping[str, Mapping[str, object]] | None = field(
        default=None, metadata=OMITTED_IF_NONE
    )
    losses: LossesByPath
    title: str = field(metadata=HIDDEN)
    is_import: bool = field(default=False, metadata=HIDDEN)
    lists_all: bool = field(default=False, metadata=HIDDEN)

    def paragraphs(self) -> Paragraphs:
        """Return the title, the files and their losses."""
        lines = [self.title, *format_files(self.losses, self.files), *self._losses_lines()]
        return ("\n".join(lines),)

    def _losses_lines(self) -> Iterator[str]:
        """Yield the lines that list the losses of files."""
        for path, losses in self.losses.items():
            entries = losses.entries
            shown = [str(loss) for loss in entries]
            if not self.lists_all:
                entries = [one for one in entries if one.effect < Effect.ROUNDING]
                count = max(1, MAX_BRIEF_LOSSES // len(self.losses))
                shown = [_shorten_loss(loss) for loss in entries[:count]]
            if shown:
                yield f"not in {path}{', or not as in the model' if self.is_import else ''}:"
                yield from (f"  {entry}" for entry in shown)
            if len(shown) < len(entries):
                yield f"  {len(entries) - len(shown)} more: see them with --verbose"


def _shorten_loss(loss: Loss) -> str:
    """Return a loss that fits a line; a short place goes ahead of a sentence that is longer."""
    limit, text, first = MAX_BRIEF_LOSS_LENGTH, str(loss), next(iter(loss.where), "")
    if 0 < len(first) <= limit // 4 and len(f"{loss.what}: {first}") > limit - 4:
        more = f" and {len(loss.where) - 1} more" if len(loss.where) > 1 else ""
        text = f"{first}{more}: {loss.what}"
    return text if len(text) <= limit else text[: limit - 4].rpartition(" ")[0] + " ..."


def import_model(
    source: str, outputs: Sequence[Path], *, separate: bool = False, verbose: bool = False
) -> CommandResult:
    """Write the figure of a model, with a springs file beside it if it has springs.

    A springs file replaces an existing one only if it is among the outputs.

    Raises:
        UsageError: an output is not a figure file.
        InputError: the model is wrong, a file cannot be written, or a springs file would be
            replaced that was not named.
    """
    figures = [output for output in outputs if output.suffix.lower() == FIGURE_FILE.suffix]
    beside = {realpath(springs_path(figure)) for figure in figures}
    springs = [output for output in outputs if realpath(output) in beside]
    for output in outputs:
        if output not in figures and output not in springs:
            raise UsageError(
                f"{output}: {source} is a model of another program and becomes a figure, "
                f"{FIGURE_FILE.suffix}; that can be converted further"
            )
    imported = read_model(source, separate=separate)
    models = [imported_files(imported, figure) for figure in figures]
    files = [file for model in models for file in (model.path, *_other_files([model]))]
    check_writable([file for file in files if file.parent in {f.parent for f in figures}], [source])
    _check_springs_files(imported, figures, springs)
    losses = write_models(models)
    figure = imported.figure
    title = (
        f"{source}: {format_count(len(figure.bodies), 'segment')} of {figure.total_mass:.4g} kg, "
        f"{figure.freedoms}"
    )
    coordinates = {
        name: {
            "joint": where.joint,
            "place": where.index + 1,
            "scale": where.scale,
            "shift": where.offset,
        }
        for name, where in imported.coordinates.items()
    }
    return Conversion(
        source=source,
        files=files,
        coordinates=coordinates,
        losses=losses,
        title=title,
        is_import=True,
        lists_all=verbose,
    )


def _check_springs_files(
    imported: Imported, figures: Sequence[Path], requested: Sequence[Path]
) -> None:
    """Raise InputError for springs files that are not needed, or exist and are not listed."""
    if imported.springs is None:
        errors = [
            unwritable_file_error(path, "the model needs no springs file") for path in requested
        ]
    else:
        asked = {realpath(path) for path in requested}
        errors = [
            error(
                f"`{path}` exists with other springs and would be replaced",
                hint=f"move it, or list it among the outputs: `{figure} {path}`",
            )
            for figure in figures
            if (path := springs_path(figure)).exists()
            and realpath(path) not in asked
            and not _has_text(path, format_imported_springs(imported.springs, figure))
        ]
    if errors:
        raise InputError(errors)


def _has_text(path: Path, text: str) -> bool:
    """Return whether a file already has this text."""
    try:
        return path.read_bytes() == text.encode()
    except OSError:
        return False


def _other_files(models: Sequence[ModelFiles]) -> list[Path]:
    """Return the files that belong to models, without those of a model that is a folder itself."""
    files = [file for model in models for file in model.contents if file.parent != model.path]
    return list(dict.fromkeys(file for file in files if file not in {m.path for m in models}))


def convert(
    source: Annotated[
        str,
        typer.Argument(
            metavar="MOTION|FIGURE|MODEL",
            help="A motion, .action .npz .mot .sto, a figure as elsewhere, or another program's "
            "model: .xml .mjcf .urdf .osim (docs/import.md).",
        ),
    ],
    outputs: Annotated[
        list[Path],
        typer.Argument(
            metavar="OUTPUT...",
            help="Files to write, each in the format of its suffix (docs/formats.md). Of a motion: "
            ".action .csv .npz .glb .bvh .mot .sto .html. Of a figure: models, .osim .xml "
            ".urdf .bioMod .fig, its passive curves, .csv, or its pose as a motion. Of a model: "
            "figures, .fig.",
        ),
    ],
    figure: Annotated[
        str | None, option("FIGURE", "Figure of the motion, if not the one named in it.")
    ] = None,
    springs: SpringsChoice = None,
    law: LawChoice = None,
    pose: PoseFile = None,
    displacements: JointValues = None,
    free_root: FreeRoot = False,
    floor: FloorOption = False,
    scene: SceneOption = None,
    fall: FallOption = None,
    seed: SeedOption = None,
    height: HeightOption = None,
    friction: FrictionOption = None,
    fps: Annotated[
        float | None, typer.Option(help="Frames per second of the outputs. [default: the motion's]")
    ] = None,
    scale: Annotated[
        float | None,
        typer.Option(help="Units of length of a .bvh in a metre. [default: 100, centimetres]"),
    ] = None,
    model: Annotated[
        Path | None,
        option(
            "MODEL",
            "Model on which the motion shall play: of MuJoCo, whose positions an .npz then "
            "holds; of OpenSim, for a .mot or .sto.",
        ),
    ] = None,
    to: Annotated[
        str | None,
        option(
            "NAME", f"Format of a figure's output, whatever its suffix: {', '.join(MODEL_FORMATS)}."
        ),
    ] = None,
    separate: Annotated[
        bool,
        typer.Option(
            "--apart", help="Keep hinges of a model with springs or limits as separate joints."
        ),
    ] = False,
    *,
    verbose: bool = False,
) -> CommandResult:
    """Convert a motion, a figure or a model, and list the losses.

    --pose, --set, --free-root, --floor, --scene, --fall, --height and --friction set the start of a
    figure, as in mover simulate; a MuJoCo model has the floor, the props and contact spheres. In a
    format of motions a figure is a single frame.
    """
    check_distinct_paths(outputs)
    conversion.check_scale(outputs, scale)
    conversion.check_no_macros(source)
    arguments = locals()
    of_run = {key: arguments[RUN_OPTIONS[key].field] for key in _RUN_KEYS}
    of_figures = {"--to": to, **{RUN_OPTIONS[key].flag: value for key, value in of_run.items()}}
    of_motions: dict[str, object] = {"--figure": figure, "--fps": fps, "--model": model}
    path = Path(source)
    if separate and not conversion.is_model(source):
        raise UsageError(f"{source}: --apart is for models of other programs")
    if path.suffix.lower() == POSE_FILE.suffix:
        raise UsageError(f"{path} is a pose: convert its figure with --pose {path}")
    if path.suffix.lower() in motion_files.MOTION_FORMATS:
        conversion.check_readable(path)
        _refuse_options(f"{path} is a motion", of_figures, "figures")
        return _convert_motion(source, outputs, figure, fps, scale, model, verbose)
    if conversion.is_model(source):
        what = f"{source} is a model of another program"
        _refuse_options(what, {**of_figures, **of_motions}, "figures and motions")
        return import_model(source, outputs, separate=separate, verbose=verbose)
    _refuse_options(f"{source} is a figure", of_motions, "motions")
    of_start = {RUN_OPTIONS[key].field: value for key, value in of_run.items()}
    del of_start["springs"], of_start["law"]
    settings = inputs.given_options(of_start)
    start = _Start(springs, law, pose, tuple(displacements or ()), settings)
    return _convert_figure(source, outputs, start, to, scale, verbose)


def _refuse_options(what: str, options: Mapping[str, object], owners: str) -> None:
    """Raise UsageError for the first of the options that is used."""
    for name, value in options.items():
        if value is not None and value is not False and value != []:
            raise UsageError(f"{what}; {name} is for {owners}")


def _convert_motion(
    source: str,
    outputs: Sequence[Path],
    figure_name: str | None,
    fps: float | None,
    scale: float | None,
    model: Path | None,
    verbose: bool,
) -> CommandResult:
    """Write a motion in other formats of motions."""
    path = Path(source)
    for output in outputs:
        if output.suffix.lower() in suffixes():
            raise UsageError(
                f"{output} is a figure and {path} a motion; convert the figure instead"
            )
    check_motion_formats(outputs)
    motion, warnings = inputs.load_motion(path, figure_name)
    figure = motion.figure
    check_writable(outputs, (path, figure.path, model))
    if fps is not None:
        motion = resample(motion, fps)
    inputs.check_segment_distances(Placement(motion.tree, motion.displacements, motion.poses))
    written = write_all_or_none(
        [(out, _motion_writer(out, motion, scale, model)) for out in outputs]
    )
    return Conversion(
        source=source,
        figure=str(figure.path),
        frames=motion.times.size,
        files=outputs,
        losses=written,
        title=format_frames(motion.times, figure.path),
        lists_all=verbose,
        diagnostics=warnings,
    )


_MOTION_READERS: Mapping[str, Callable[[Path], object]] = {
    ".action": motion_files.read_action,
    ".mot": lambda path: motion_files.COORDINATES_FILE.parse_file(path).require_value(),
    ".sto": lambda path: motion_files.COORDINATES_FILE.parse_file(path).require_value(),
}
"""Readers of what a conversion writes, by suffix."""


def _motion_writer(
    path: Path, motion: motion_files.FigureMotion, scale: float | None, model: Path | None = None
) -> OutputWriter:
    """Return a writer that raises InputError if the file could not be read again."""
    write = conversion.motion_writer_for(path, scale, model)
    read = _MOTION_READERS.get(path.suffix.lower())

    def write_readable(part: Path) -> Losses:
        losses = write(motion, part)
        try:
            if read is not None:
                read(part)
        except InputError as failure:
            unreadable = unreadable_file_error(path, failure.diagnostics)
            message = unreadable.message.replace(str(part), path.name)
            raise InputError([replace(unreadable, message=message)]) from None
        return losses

    return write_readable


@dataclass(frozen=True)
class _Start:
    """Options for the start of a figure, with the values that `mover simulate` takes."""

    springs: str | None
    law: SphericalLaw | None
    pose: Path | None
    sets: tuple[str, ...]
    settings: Mapping[str, Any]

    @property
    def free_root(self) -> bool:
        """Return whether the joints to the ground are removed."""
        return bool(self.settings.keys() & {"free_root", "floor", "scene", "fall"})

    def of_figure(self, figure: Figure) -> tuple[conversion.StartedFigure, tuple[Diagnostic, ...]]:
        """Return the figure with its springs at the start, with warnings."""
        springs, warnings = inputs.springs_from_option(figure, self.springs, self.law)
        if not self.settings:
            return conversion.StartedFigure(figure, springs), warnings
        inputs.check_chains(figure)
        start, more = inputs.start_displacements_from_options(figure, self.pose, self.sets)
        warnings += (*more, *inputs.range_warnings(figure, springs, start))
        if self.settings.keys() & {"floor", "scene", "fall", "height"}:
            plan, more = self._plan(figure, start)
            model = Model(figure, springs, contact_of_figure(figure))
            return conversion.figure_of_plan(model, plan), warnings + more
        placement = conversion.start_placement(figure, start)
        inputs.check_segment_distances(placement)
        return conversion.figure_at_start(placement, springs, free_root=self.free_root), warnings

    def _plan(
        self, figure: Figure, start: Mapping[str, Sequence[float]]
    ) -> tuple[Plan, tuple[Diagnostic, ...]]:
        """Return the plan of a start with props or a height, and warnings."""
        if "fall" in self.settings:
            return inputs.fall_from_options(figure, self.settings)
        plan, warnings = inputs.plan_from_options(self.settings)
        return replace(plan, displacements=start), warnings


def _convert_figure(
    source: str,
    outputs: Sequence[Path],
    options: _Start,
    format_name: str | None,
    scale: float | None,
    verbose: bool,
) -> CommandResult:
    """Write a figure with its springs in formats of models, and its pose in those of motions."""
    formats = [
        (out, conversion.figure_format(out, format_name, free_root=options.free_root))
        for out in outputs
    ]
    figure, warnings = inputs.load_figure(source)
    start, more = options.of_figure(figure)
    new = [out for out, each in formats if each is None or each.suffixes or not out.is_dir()]
    check_writable(new, (figure.path, options.springs, options.pose))
    models: list[ModelFiles] = []
    frames: list[tuple[Path, OutputWriter]] = []
    for out, each in formats:
        if each is None:
            frames.append((out, _motion_writer(out, start.motion(figure), scale)))
            continue
        with writing(out):
            models.append(start.files(each, out))
    _check_files_of_figure(figure, models)
    lost = write_all_or_none([*model_writers(models), *frames])
    lost = {**lost, **{model.path: model.losses for model in models}}
    written = {out: lost[out] for out in outputs}
    title = f"{source} with springs: {start.springs.origin}"
    if frames:
        title += f"; its pose as a single frame: {', '.join(str(out) for out, _ in frames)}"
    return Conversion(
        source=source,
        figure=str(figure.path),
        files=(*outputs, *_other_files(models)),
        losses=written,
        title=title,
        lists_all=verbose,
        diagnostics=warnings + more,
    )


def _check_files_of_figure(figure: Figure, models: Sequence[ModelFiles]) -> None:
    """Raise InputError for files of models that are shapes of the figure itself."""
    if figure.path is not None:
        names = [segment.psurf for segment in figure.segments.values()]
        shapes = [figure.path.parent / name for name in names if name is not None]
        used = {realpath(shape) for shape in shapes}
        files = [file for model in models for file in model.contents if realpath(file) in used]
        check_writable(files, shapes)
