"""The formats of models: one table, in which a format is a row."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from generator.diagnostics import (
    Diagnostics,
    InputError,
    Parsed,
    Source,
    TooManyErrors,
    UsageError,
    shorten,
    spelling_hint,
)
from generator.figure import Figure
from generator.figure_file.write import write_figure
from generator.input_files.coordinates import (
    COORDINATE_NAMES,
    coordinates_of_figure,
    write_coordinates,
)
from generator.losses import Effect, Loss, Losses
from generator.model_files import curves_csv
from generator.model_files.biomod import write as biomod
from generator.model_files.dyspam import write as dyspam
from generator.model_files.dyspam.read import imported_from_dyspam, parse_dyspam
from generator.model_files.export_model import Start
from generator.model_files.mjcf import write as mjcf
from generator.model_files.mjcf.read import figure_from_mjcf
from generator.model_files.model_files import Imported, ModelFiles, springs_path
from generator.model_files.opensim import write as osim
from generator.model_files.opensim.read import figure_from_osim
from generator.model_files.urdf import write as urdf
from generator.model_files.urdf.read import figure_from_urdf
from generator.model_files.xml import parse_xml
from generator.springs_file.read import FIGURE_ORIGIN, WITHIN_FIGURE
from generator.text_io import load_text
from springs import SpringSet


def format_fig(figure: Figure, springs: SpringSet, path: Path) -> ModelFiles:
    """Format a figure file (`.fig`); reading it gives an equal figure.

    The springs that a figure brings along become a springs file beside it, and so do its names of
    coordinates.

    Raises ValueError for a name or a string of the figure that the language cannot say.
    """
    losses = [
        Loss(
            "the comments of the figure's file, and the units it was written in",
            effect=Effect.DESCRIPTION,
        )
    ]
    psurfs = tuple(seg.psurf for seg in figure.segments.values() if seg.psurf is not None)
    if psurfs and (figure.path is None or figure.path.parent.resolve() != path.resolve().parent):
        losses.append(
            Loss(
                "the psurfs, which stay where they are",
                tuple(dict.fromkeys(map(str, psurfs))),
                effect=Effect.DESCRIPTION,
            )
        )
    beside: dict[Path, str] = {}
    if figure.springs_text is not None and springs.origin == WITHIN_FIGURE:
        beside[springs_path(path)] = figure.springs_text
    elif springs.origin != FIGURE_ORIGIN and (springs.joints or springs.coupled):
        losses.append(Loss(f"the springs of {springs.origin}", tuple(springs.joints)))
    coordinates = coordinates_of_figure(figure)
    if coordinates:
        beside[COORDINATE_NAMES.beside(path)] = write_coordinates(coordinates, figure)
    files = {**beside, path: write_figure(figure)}
    return ModelFiles(path, files, Losses.collect("figure file", losses))


SUFFIXES = (".xml", ".mjcf", ".urdf", ".osim")
"""Suffixes of models; their root element decides the format."""

READERS: Mapping[str, Callable[..., Imported | None]] = {
    "mujoco": figure_from_mjcf,
    "robot": figure_from_urdf,
    "OpenSimDocument": figure_from_osim,
}
"""Readers by root element."""


def read_model(path: str | Path, *, separate: bool = False) -> Imported:
    """Read a model in MJCF, URDF, OpenSim's format or DYSPAM's.

    Args:
        path: the file, or the folder of DYSPAM's input files.
        separate: make each revolute with springs, damping or limits a joint of its own.

    Raises:
        InputError: with all diagnostics.
    """
    if Path(path).is_dir():
        return imported_from_dyspam(parse_dyspam(Path(path)).require_value())
    source, fault = load_text(Path(path), str(path))
    if fault is not None:
        raise InputError([fault])
    folder = Path(path).parent
    return parse_model(source, folder, separate=separate).require_value()


def parse_model(
    source: Source, directory: Path | None = None, *, separate: bool = False
) -> Parsed[Imported]:
    """Parse the text of a model; included files are looked for in `directory`."""
    collector = Diagnostics()
    imported = None
    with suppress(TooManyErrors):
        root = parse_xml(source, collector)
        if root is not None:
            reader = READERS.get(root.tag)
            if reader is None:
                near = spelling_hint(root.tag, READERS)
                known = "mujoco (MJCF), robot (URDF) or OpenSimDocument"
                hint = near if near.startswith("did") else f"the root element of a model is {known}"
                message = f"`{shorten(root.tag)}` is not a model that can be read"
                root.error(message, hint)
            else:
                imported = reader(root, directory, separate=separate)
    diagnostics = collector.sorted_by_position()
    return Parsed(None if collector.has_errors else imported, diagnostics)


ModelFormatter = Callable[[Figure, SpringSet, Path], ModelFiles]
"""Formats a figure with its springs as the model at a path.

It may raise MoverError (InputError, with places) for a figure that the format cannot hold at all.
"""


@dataclass(frozen=True)
class ModelFormat:
    """A format of models.

    Attributes:
        suffixes: suffixes of its files, in lower case with the dot; empty for a format that only
            its name selects, such as a folder of files.
        format_files: returns its files.
        what: its description in a few words.
        motion_suffixes: suffixes that a format of motions has too; of a figure they select this
            format.
        format_with_start: Returns the files of a model with contact and rates; None for a format
            that does not hold them.
    """

    suffixes: tuple[str, ...]
    format_files: ModelFormatter
    what: str
    motion_suffixes: tuple[str, ...] = ()
    format_with_start: Callable[[Figure, SpringSet, Path, Start], ModelFiles] | None = None

    def files(
        self, figure: Figure, springs: SpringSet, path: Path, start: Start | None
    ) -> ModelFiles:
        """Return the files of a model, with the contact and the rates of a start if it has one."""
        if start is None:
            return self.format_files(figure, springs, path)
        if self.format_with_start is not None:
            model = self.format_with_start(figure, springs, path, start)
        else:
            model = self.format_files(figure, springs, path)
            if start.contact is not None:
                model.losses.add("the floor, the props and the contact with them")
            if any(map(any, start.rates.values())):
                model.losses.add("the velocities of the start")
        if start.left_out:
            model.losses.add("what acts in `mover simulate` alone", *start.left_out)
        return model

    def has_suffix(self, path: Path) -> bool:
        """Return whether the suffix of a path selects this format for a figure."""
        return path.suffix.lower() in (*self.suffixes, *self.motion_suffixes)


MODEL_FORMATS: Mapping[str, ModelFormat] = {
    "peabody": ModelFormat((".fig",), format_fig, "figure file of this program"),
    "mjcf": ModelFormat(
        (".xml", ".mjcf"), mjcf.format_files, "MuJoCo model", format_with_start=mjcf.format_files
    ),
    "urdf": ModelFormat(
        (".urdf",), urdf.format_files, "robot model without loops, its springs as a table"
    ),
    "osim": ModelFormat((".osim",), osim.format_files, "OpenSim model"),
    "dyspam": ModelFormat(
        (), dyspam.format_files, "folder of the thesis's simulator's input files"
    ),
    "biomod": ModelFormat((".biomod",), biomod.format_files, "biorbd model"),
    "curves": ModelFormat(
        (), curves_csv.format_files, "table of passive curves", motion_suffixes=(".csv",)
    ),
}
"""The formats by name: `NAME: ModelFormat((".suffix",), module.format_files, "what it is")`.

A format is a module of this package with a `ModelFormatter`, and a row here: `mover convert` takes
its suffixes, and its name after `--to`. A suffix belongs to one row, and to no format of motions
(`generator.motion_files.MOTION_FORMATS`); the exceptions are `motion_suffixes`.
"""


def suffixes() -> list[str]:
    """Return the suffixes of all formats of models that no format of motions has."""
    return [suffix for each in MODEL_FORMATS.values() for suffix in each.suffixes]


def model_format(path: Path, name: str | None = None) -> ModelFormat:
    """The format of this name, or without one that of the path's suffix or of a folder's name.

    Raises UsageError, which names those that are known.
    """
    if name is not None:
        if name not in MODEL_FORMATS:
            raise UsageError(f"unknown format `{name}`; {spelling_hint(name, MODEL_FORMATS)}")
        return MODEL_FORMATS[name]
    for each in MODEL_FORMATS.values():
        if each.has_suffix(path):
            return each
    named = MODEL_FORMATS.get(path.name)
    if named is not None and not (named.suffixes or named.motion_suffixes):
        return named
    problem = f"`{path.suffix}` is not a known suffix" if path.suffix else "the suffix is missing"
    known = [s for each in MODEL_FORMATS.values() for s in (*each.suffixes, *each.motion_suffixes)]
    raise UsageError(f"{path}: {problem} of a model; known are {', '.join(known)}")
