"""The formats of models: one table, in which a format is a row."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from generator.diagnostics import MoverError, spelling_hint
from generator.figure import Figure
from generator.losses import Losses
from generator.model_files import peabody
from generator.model_files.dyspam import write as dyspam
from generator.model_files.mjcf import write as mjcf
from generator.model_files.opensim import write as osim
from generator.model_files.urdf import write as urdf
from springs import SpringSet

ModelWriter = Callable[[Figure, SpringSet, Path], Losses]
"""Writes a figure with its springs to a path, whole or not at all, and tells what was lost.

It may raise OSError when the path cannot be written, and MoverError (InputError, with places) for a
figure that the format cannot hold at all.
"""


@dataclass(frozen=True)
class ModelFormat:
    """A format of models.

    Attributes:
        suffixes: of its files, in lower case with the dot; none for a format that is chosen by its
            name alone, such as one that is a folder of files.
        write: what writes it.
        what: what it is, in a few words.
    """

    suffixes: tuple[str, ...]
    write: ModelWriter
    what: str


MODEL_FORMATS: Mapping[str, ModelFormat] = {
    "peabody": ModelFormat((".fig",), peabody.write, "figure file of this program"),
    "mjcf": ModelFormat((".xml", ".mjcf"), mjcf.write, "MuJoCo model"),
    "urdf": ModelFormat((".urdf",), urdf.write, "robot model without loops or springs"),
    "osim": ModelFormat((".osim",), osim.write, "OpenSim model"),
    "dyspam": ModelFormat((), dyspam.write, "folder of the thesis's simulator's input files"),
}
"""The formats by name: `NAME: ModelFormat((".suffix",), module.write, "what it is")`.

A format is a module of this package with a function `write` of the form `Write`, and a row here:
`mover convert` then takes its suffixes, and its name after `--to`. No suffix may stand in two rows,
nor among those of motions (`generator.motion_files.FORMATS`).
"""


class UnknownModelFormatError(MoverError):
    """A name or a path that means no format of models."""


def suffixes() -> list[str]:
    """All suffixes that mean a format of models."""
    return [suffix for each in MODEL_FORMATS.values() for suffix in each.suffixes]


def model_format(path: Path, name: str | None = None) -> ModelFormat:
    """The format of this name, or without one that of the path's suffix or of a folder's name.

    Raises UnknownModelFormatError, which names those that are known.
    """
    if name is not None:
        if name not in MODEL_FORMATS:
            raise UnknownModelFormatError(
                f"unknown format `{name}`; {spelling_hint(name, MODEL_FORMATS)}"
            )
        return MODEL_FORMATS[name]
    for each in MODEL_FORMATS.values():
        if path.suffix.lower() in each.suffixes:
            return each
    if path.name in MODEL_FORMATS and not MODEL_FORMATS[path.name].suffixes:
        return MODEL_FORMATS[path.name]
    said = f"`{path.suffix}` is no known suffix" if path.suffix else "the suffix is missing"
    raise UnknownModelFormatError(f"{path}: {said} of a model; known are {', '.join(suffixes())}")
