"""`mover convert` of another program's model: into a figure and its springs."""

from collections.abc import Sequence
from os.path import realpath
from pathlib import Path

from generator.commands.answer import Answer, UsageError, counted
from generator.commands.motion_files import Written, losses_data
from generator.commands.outputs import insist_writable, unwritable
from generator.commands.together import written_before
from generator.errors import InputError, MoverError, error
from generator.exchange.imported import Imported, springs_path, springs_text, write_imported
from generator.exchange.losses import Losses
from generator.exchange.read_model import SUFFIXES, read_model
from generator.reader import shipped_figures
from generator.whole_file import reason_of

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
    return _answer(source, imported, written)


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


def _answer(source: str, imported: Imported, written: Written) -> Answer:
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
