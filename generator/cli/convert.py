"""`mover convert`: motions, figures and other programs' models in each other's formats."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from os.path import realpath
from pathlib import Path
from typing import Annotated

import typer

from generator.cli.answer import CommandResult, format_count
from generator.cli.inputs import (
    check_segment_distances,
    load_figure,
    load_motion,
    springs_from_option,
)
from generator.cli.options import SpringsChoice
from generator.cli.outputs import (
    LossesByPath,
    check_distinct_paths,
    check_motion_formats,
    check_writable,
    losses_data,
    unwritable_file_error,
    write_all_or_none,
    write_models,
)
from generator.conversion import (
    READABLE_SUFFIXES,
    is_model,
)
from generator.diagnostics import Diagnostic, InputError, UsageError, error
from generator.figure_file.read import FIGURE_SUFFIX
from generator.kinematics.placement import Placement
from generator.model_files.formats import (
    MODEL_FORMATS,
    ModelFormat,
    model_format,
    read_model,
    suffixes,
)
from generator.model_files.imported import (
    Imported,
    format_imported_springs,
    imported_files,
    springs_path,
)
from generator.model_files.model_files import geometry_folder
from generator.motion_files import (
    MOTION_FORMATS,
    motion_writer,
)

MAX_BRIEF_LOSSES = 4
"""Losses of all files that are listed without `--verbose`; at least one of each file."""

MAX_BRIEF_LOSS_LENGTH = 110
"""Length of the line of a loss without `--verbose`."""

ROUNDING_LOSS = "digits:"
"""Beginning of the losses that are left out without `--verbose`: they state how numbers round."""


def format_losses(written: LossesByPath, ending: str = "", *, in_full: bool) -> Iterator[str]:
    """Yield the lines that list the losses of files.

    Args:
        written: losses by file.
        ending: end of the title of a file.
        in_full: list all losses with all their places; otherwise a few, a line each.
    """
    for path, losses in written.items():
        entries = [str(loss) for loss in losses.entries]
        shown = entries
        if not in_full:
            entries = [entry for entry in entries if not entry.startswith(ROUNDING_LOSS)]
            shown = [_shorten_loss(e) for e in entries[: max(1, MAX_BRIEF_LOSSES // len(written))]]
        if shown:
            yield f"not in {path}{ending}:"
            yield from (f"  {entry}" for entry in shown)
        if len(shown) < len(entries):
            yield f"  {len(entries) - len(shown)} more: see them with --verbose"


def _shorten_loss(text: str) -> str:
    """Return a loss that fits a line."""
    limit = MAX_BRIEF_LOSS_LENGTH
    return text if len(text) <= limit else text[: limit - 4].rpartition(" ")[0] + " ..."


def import_model(
    source: str, outputs: Sequence[Path], *, separate: bool = False, verbose: bool = False
) -> CommandResult:
    """Write the figure of a model, with a springs file beside it if it has springs.

    Args:
        source: the model.
        outputs: figure files. A springs file beside one of them may replace an existing one only
            if it is listed as well.
        separate: keep hinges with springs, damping or limits as separate joints.
        verbose: list all losses in full.

    Raises:
        UsageError: an output is not a figure file.
        InputError: the model is wrong, a file cannot be written, or a springs file would be
            replaced that was not named.
    """
    figures = [output for output in outputs if output.suffix.lower() == FIGURE_SUFFIX]
    beside = {realpath(springs_path(figure)) for figure in figures}
    springs = [output for output in outputs if realpath(output) in beside]
    for output in outputs:
        if output not in figures and output not in springs:
            raise UsageError(
                f"{output}: {source} is a model of another program and becomes a figure, "
                f"{FIGURE_SUFFIX}; that can be converted further"
            )
    imported = read_model(source, separate=separate)
    files = [file for figure in figures for file in _output_files(imported, figure)]
    check_writable([file for file in files if not file.is_dir()], [source])
    _check_springs_files(imported, figures, springs)
    losses = write_models([imported_files(imported, figure) for figure in figures])
    return _import_result(source, imported, losses, verbose)


def _check_springs_files(
    imported: Imported, figures: Sequence[Path], requested: Sequence[Path]
) -> None:
    """Raise InputError for springs files that are not needed, or exist and are not listed."""
    if imported.springs is None:
        faults = [
            unwritable_file_error(path, "the model needs no springs file") for path in requested
        ]
    else:
        asked = {realpath(path) for path in requested}
        faults = [
            error(
                f"`{path}` exists with other springs and would be replaced",
                hint=f"move it, or list it among the outputs: `{figure} {path}`",
            )
            for figure in figures
            if (path := springs_path(figure)).exists()
            and realpath(path) not in asked
            and not _has_text(path, format_imported_springs(imported.springs, figure))
        ]
    if faults:
        raise InputError(faults)


def _has_text(path: Path, text: str) -> bool:
    """Return whether a file already has this text."""
    try:
        return path.read_bytes() == text.encode()
    except OSError:
        return False


def _output_files(imported: Imported, output: Path) -> list[Path]:
    """Return the files of the figure, and the folder of its psurfs."""
    springs = [] if imported.springs is None else [springs_path(output)]
    return [output, *springs, *([geometry_folder(output)] if imported.surfaces else [])]


def _import_result(
    source: str, imported: Imported, written: LossesByPath, verbose: bool
) -> CommandResult:
    figure = imported.figure
    files = [file for output in written for file in _output_files(imported, output)]
    title = (
        f"{source}: {format_count(len(figure.bodies), 'segment')} of {figure.total_mass:.4g} kg, "
        f"{format_count(figure.degrees_of_freedom, 'degree')} of freedom"
    )
    lost = format_losses(written, ", or not as in the model", in_full=verbose)
    return CommandResult(
        text="\n".join([title, *(f"wrote {file}" for file in files), *lost]),
        data={
            "source": source,
            "files": [str(file) for file in files],
            "coordinates": {
                name: {
                    "joint": where.joint,
                    "place": where.index + 1,
                    "scale": where.scale,
                    "shift": where.offset,
                }
                for name, where in imported.coordinates.items()
            },
            "losses": losses_data(written),
        },
    )


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
            ".action .csv .npz .glb .bvh .mot .sto .x3d .html. Of a model: figures, .fig.",
        ),
    ],
    figure: Annotated[
        str | None,
        typer.Option(metavar="FIGURE", help="Figure of the motion, if not the one named in it."),
    ] = None,
    springs: SpringsChoice = None,
    to: Annotated[
        str | None, typer.Option(metavar="NAME", help="Model format, whatever the suffix.")
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
    """Convert a motion, a figure or a model, and list what the format cannot store."""
    check_distinct_paths(outputs)
    if separate and not is_model(source):
        raise UsageError(f"{source}: --apart is for models of other programs")
    path = Path(source)
    if path.suffix.lower() in MOTION_FORMATS:
        if path.suffix.lower() not in READABLE_SUFFIXES:
            known = ", ".join(READABLE_SUFFIXES)
            raise UsageError(f"{path}: motions are read from {known}, not from other formats")
        if to is not None or springs is not None:
            raise UsageError(f"{path} is a motion; --to and --springs are for figures")
        return _convert_motion(source, outputs, figure, verbose)
    if is_model(source):
        if (figure, springs, to) != (None, None, None):
            raise UsageError(f"{source} is a model of another program, which takes --apart only")
        return import_model(source, outputs, separate=separate, verbose=verbose)
    if figure is not None:
        raise UsageError(f"{source} is a figure; --figure is for motions")
    return _convert_figure(source, outputs, springs, to, verbose)


def _convert_motion(
    source: str, outputs: Sequence[Path], figure_name: str | None, verbose: bool
) -> CommandResult:
    """Write a motion in other formats of motions."""
    path = Path(source)
    for output in outputs:
        if output.suffix.lower() in suffixes():
            raise UsageError(
                f"{output} is a figure and {path} a motion; convert the figure instead"
            )
    check_motion_formats(outputs)
    motion, warnings = load_motion(path, figure_name)
    figure = motion.figure
    check_writable(outputs, (path, figure.path))
    check_segment_distances(Placement(motion.tree, motion.displacements, motion.poses))
    written = write_all_or_none([(out, partial(motion_writer(out), motion)) for out in outputs])
    frames = format_count(motion.times.size, "frame")
    title = f"{frames} of {figure.path}, {motion.times[0]:g} to {motion.times[-1]:g} s"
    head = {"source": source, "figure": str(figure.path), "frames": motion.times.size}
    return _conversion_result(title, head, written, warnings, verbose)


def _convert_figure(
    source: str,
    outputs: Sequence[Path],
    springs_option: str | None,
    format_name: str | None,
    verbose: bool,
) -> CommandResult:
    """Write a figure with its springs in the formats of models."""
    formats = [(output, _choose_model_format(source, output, format_name)) for output in outputs]
    figure, warnings = load_figure(source)
    springs, more = springs_from_option(figure, springs_option)
    new = [out for out, each in formats if each.suffixes or not out.is_dir()]
    check_writable(new, (figure.path, springs_option))
    written = write_models([each.format_files(figure, springs, out) for out, each in formats])
    title = f"{source} with springs: {springs.origin}"
    head = {"source": source, "figure": str(figure.path)}
    return _conversion_result(title, head, written, warnings + more, verbose)


def _choose_model_format(source: str, output: Path, format_name: str | None) -> ModelFormat:
    """Return the format of an output. Raises UsageError."""
    shared = any(output.suffix.lower() in each.motion_suffixes for each in MODEL_FORMATS.values())
    if format_name is None and output.suffix.lower() in MOTION_FORMATS and not shared:
        raise UsageError(
            f"{output} is a motion and {source} a figure; "
            f"`mover simulate {source} -o {output}` simulates it"
        )
    return model_format(output, format_name)


def _conversion_result(
    title: str,
    head: Mapping[str, object],
    written: LossesByPath,
    diagnostics: tuple[Diagnostic, ...],
    verbose: bool,
) -> CommandResult:
    lost = format_losses(written, in_full=verbose)
    return CommandResult(
        text="\n".join([title, *(f"wrote {path}" for path in written), *lost]),
        data={
            **head,
            "files": [str(path) for path in written],
            "losses": losses_data(written),
        },
        diagnostics=diagnostics,
    )
