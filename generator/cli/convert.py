"""`mover convert`: a motion or a figure in the formats of other programs.

`mover convert` of another program's model: into a figure and its springs.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from os.path import realpath
from pathlib import Path

from generator.cli.answer import Answer, UsageError, counted
from generator.cli.inputs import doubts_of, figure_of, insist_on_chains, insist_on_reach, springs_of
from generator.cli.outputs import (
    Written,
    insist_distinct,
    insist_on_formats,
    insist_writable,
    losses_data,
    losses_text,
    unwritable,
    write_together,
    written_before,
)
from generator.diagnostics import Fault, InputError, MoverError, error
from generator.figure import Figure
from generator.figure_file import shipped_figures
from generator.kinematics.placement import Placement
from generator.losses import Losses
from generator.model_files.formats import (
    ModelFormat,
    UnknownModelFormatError,
    model_format,
    suffixes,
)
from generator.model_files.imported import Imported, springs_path, springs_text, write_imported
from generator.model_files.read import SUFFIXES, read_model
from generator.motion_files import (
    FORMATS,
    Clip,
    clip_of_action,
    clip_of_recording,
    format_of,
    read_action,
    read_npz,
)
from generator.motion_files.motion import Header, digest_of
from generator.text_io import reason_of

FIGURE = ".fig"


def is_model(source: str) -> bool:
    """Whether a source is a model of another program: a file by its suffix, or a folder."""
    path = Path(source)
    return path.suffix.lower() in SUFFIXES or (path.is_dir() and source not in shipped_figures())


def import_model(source: str, outputs: Sequence[Path], *, apart: bool = False) -> Answer:
    """Write the figure of a model, with a springs file beside it where it needs one.

    Args:
        source: the model.
        outputs: figure files. A springs file beside one of them is written where the model needs
            it; named here as well, it may replace another one.
        apart: whether hinges with springs, damping or limits each become a joint of their own.

    Raises:
        UsageError: an output is no figure file.
        InputError: the model is wrong, a file cannot be written, or a springs file would be
            replaced that was not named.
    """
    figures = [output for output in outputs if output.suffix.lower() == FIGURE]
    beside = {realpath(springs_path(figure)) for figure in figures}
    springs = [output for output in outputs if realpath(output) in beside]
    for output in outputs:
        if output not in figures and output not in springs:
            raise UsageError(
                f"{output}: {source} is a model of another program and becomes a figure, {FIGURE}; "
                "that can be converted further"
            )
    imported = read_model(source, apart=apart)
    insist_writable([file for figure in figures for file in _files(imported, figure)], [source])
    _insist_on_springs(imported, figures, springs)
    written: dict[Path, Losses] = {}
    for output in figures:
        try:
            written[output] = write_imported(imported, output)
        except OSError as failure:
            before = [file for done in written for file in _files(imported, done)]
            faults = unwritable(output, reason_of(failure)), *written_before(before)
            raise InputError(faults) from None
        except ValueError as failure:
            raise MoverError(f"`{output}` cannot be written: {failure}") from None
    return _import_answer(source, imported, written)


def _insist_on_springs(imported: Imported, figures: Sequence[Path], named: Sequence[Path]) -> None:
    """Raise InputError for springs files that are not needed, or are others' and were not named."""
    if imported.springs is None:
        faults = [unwritable(path, "the model needs no springs file") for path in named]
    else:
        asked = {realpath(path) for path in named}
        faults = [
            error(
                f"`{path}` stands already with other springs, and would be replaced",
                hint=f"move it away, or name it among the outputs: `{figure} {path}`",
            )
            for figure in figures
            if (path := springs_path(figure)).exists()
            and realpath(path) not in asked
            and not _holds(path, springs_text(imported.springs, figure))
        ]
    if faults:
        raise InputError(faults)


def _holds(path: Path, text: str) -> bool:
    """Whether a file has this text already."""
    try:
        return path.read_bytes() == text.encode()
    except OSError:
        return False


def _files(imported: Imported, output: Path) -> list[Path]:
    """The files that hold the figure."""
    return [output] if imported.springs is None else [output, springs_path(output)]


def _import_answer(source: str, imported: Imported, written: Written) -> Answer:
    figure = imported.figure
    files = [file for output in written for file in _files(imported, output)]
    title = (
        f"{source}: {counted(len(figure.bodies), 'segment')} of {figure.total_mass:.4g} kg, "
        f"{counted(figure.degrees_of_freedom, 'degree')} of freedom"
    )
    lost = [
        line
        for output, losses in written.items()
        if losses.each
        for line in (
            f"not in {output}, or not as in the model:",
            *(f"  {loss}" for loss in losses.each),
        )
    ]
    return Answer(
        text="\n".join([title, *(f"wrote {file}" for file in files), *lost]),
        data={
            "source": source,
            "files": [str(file) for file in files],
            "coordinates": {
                name: {
                    "joint": where.joint,
                    "place": where.place + 1,
                    "scale": where.scale,
                    "shift": where.shift,
                }
                for name, where in imported.coordinates.items()
            },
            "losses": losses_data(written),
        },
    )


ACTION, NPZ = ".action", ".npz"
READ = (ACTION, NPZ)
"""The formats of motions that can be read."""


@dataclass(frozen=True)
class Request:
    """The command line of `mover convert`; None where an option is not given.

    Attributes:
        source: a file of a motion, or a figure.
        outputs: the files to write, each in the format of its suffix.
        figure: of a motion; without it the one that the motion names.
        springs: of a figure; without it the figure's own.
        to: name of a format of models, in place of the suffix.
        apart: of another program's model, whether hinges with springs stay joints of their own.
    """

    source: str
    outputs: Sequence[Path]
    figure: str | None = None
    springs: str | None = None
    to: str | None = None
    apart: bool = False


def convert(request: Request) -> Answer:
    """Write what is asked for, all of it or nothing.

    Raises:
        UsageError: the source and the outputs do not fit, or a format is not known.
        InputError: the motion or the figure is wrong, or a file cannot be written.
        MoverError: the motion is of another figure, or a format cannot hold it.
    """
    insist_distinct(request.outputs)
    if request.apart and not is_model(request.source):
        raise UsageError(f"{request.source}: --apart is for models of other programs")
    if Path(request.source).suffix.lower() in FORMATS:
        return _motion(request)
    if is_model(request.source):
        if (request.figure, request.springs, request.to) != (None, None, None):
            raise UsageError(
                f"{request.source} is a model of another program, which takes --apart only"
            )
        return import_model(request.source, request.outputs, apart=request.apart)
    return _model(request)


def _motion(request: Request) -> Answer:
    """A motion in other formats of motions."""
    path = Path(request.source)
    if path.suffix.lower() not in READ:
        raise UsageError(f"{path}: motions are read from {', '.join(READ)}, and only written else")
    if request.to is not None or request.springs is not None:
        raise UsageError(f"{path} is a motion; --to and --springs are for figures")
    for output in request.outputs:
        if output.suffix.lower() in suffixes():
            raise UsageError(
                f"{output} is a figure and {path} a motion; give the figure to convert"
            )
    insist_on_formats(request.outputs)
    header, clip_of = _read(path)
    figure, warnings = _figure_of(header, path, request.figure)
    insist_writable(request.outputs, (path, figure.path))
    insist_on_chains(figure)
    clip = clip_of(figure)
    insist_on_reach(Placement(clip.tree, clip.displacements, clip.poses))
    written = write_together([(out, partial(format_of(out), clip)) for out in request.outputs])
    frames = counted(clip.times.size, "frame")
    title = f"{frames} of {figure.path}, {clip.times[0]:g} to {clip.times[-1]:g} s"
    data = {"frames": clip.times.size}
    faults = (*warnings, *doubts_of(figure, header, path))
    return _answer(request, title, str(figure.path), data, written, faults)


def _read(path: Path) -> tuple[Header, Callable[[Figure], Clip]]:
    """Where the motion in a file is from, and what makes it one of a figure. Raises InputError."""
    if path.suffix.lower() == ACTION:
        action = read_action(path)
        return action.header, lambda figure: clip_of_action(action, figure)
    header, recording = read_npz(path)
    return header, lambda figure: replace(clip_of_recording(recording, figure), header=header)


def _figure_of(header: Header, path: Path, asked: str | None) -> tuple[Figure, tuple[Fault, ...]]:
    """The figure that is asked for, else the one that a motion names, with warnings.

    The file of that name beside the motion and the shipped one are looked at; the first that is the
    one the motion was made of is taken, else the first. Raises InputError.
    """
    if asked is not None:
        return figure_of(asked)
    beside = path.parent / header.figure
    shipped = {each.name: each for each in shipped_figures().values()}.get(header.figure)
    digests = {each: digest_of(each) for each in (beside, shipped) if each is not None}
    found = [each for each, digest in digests.items() if digest is not None]
    if not found:
        said = f"`{path}` is a motion of `{header.figure}`, which does not lie beside it"
        raise InputError([error(said, hint="name the figure with --figure")])
    same = [each for each in found if digests[each] == header.sha256]
    return figure_of(str((same or found)[0]))


def _model(request: Request) -> Answer:
    """A figure with its springs in the formats of models."""
    if request.figure is not None:
        raise UsageError(f"{request.source} is a figure; --figure is for motions")
    writers = [(output, _writer(request, output)) for output in request.outputs]
    figure, warnings = figure_of(request.source)
    springs, more = springs_of(figure, request.springs)
    new = [out for out, each in writers if each.suffixes or not out.is_dir()]
    insist_writable(new, (figure.path, request.springs))
    written = write_together(
        [(output, partial(each.write, figure, springs)) for output, each in writers]
    )
    title = f"{request.source} with springs: {springs.origin}"
    return _answer(request, title, str(figure.path), {}, written, (*warnings, *more))


def _writer(request: Request, output: Path) -> ModelFormat:
    """The format of an output. Raises UsageError."""
    if request.to is None and output.suffix.lower() in FORMATS:
        raise UsageError(
            f"{output} is a motion and {request.source} a figure; "
            f"`mover simulate {request.source} -o {output}` makes it move"
        )
    try:
        return model_format(output, request.to)
    except UnknownModelFormatError as failure:
        raise UsageError(str(failure)) from None


def _answer(
    request: Request,
    title: str,
    figure: str,
    data: Mapping[str, object],
    written: Written,
    faults: tuple[Fault, ...],
) -> Answer:
    lost = losses_text(written)
    return Answer(
        text="\n".join([title, *(f"wrote {path}" for path in written), *([lost] if lost else [])]),
        data={
            "source": request.source,
            "figure": figure,
            **data,
            "files": [str(path) for path in written],
            "losses": losses_data(written),
        },
        faults=faults,
    )
