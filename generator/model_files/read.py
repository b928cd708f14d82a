"""Models of other programs: a file in, a figure out, whatever its suffix says."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

from generator.diagnostics import (
    Diagnostics,
    InputError,
    Source,
    TooManyErrors,
    shorten,
    spelling_hint,
)
from generator.model_files.dyspam.read import imported_from_dyspam, parse_dyspam
from generator.model_files.imported import Imported
from generator.model_files.mjcf.read import figure_from_mjcf
from generator.model_files.opensim.read import figure_from_osim
from generator.model_files.urdf.read import figure_from_urdf
from generator.model_files.xml_read import XmlElement, parse_xml
from generator.text_io import load_text

SUFFIXES = (".xml", ".mjcf", ".urdf", ".osim")
"""Suffixes of files that are models; which one, their root element tells."""

READERS: Mapping[str, Callable[..., Imported | None]] = {
    "mujoco": figure_from_mjcf,
    "robot": figure_from_urdf,
    "OpenSimDocument": figure_from_osim,
}
"""By the root element, what makes a figure of it."""


def read_model(path: str | Path, *, separate: bool = False) -> Imported:
    """The figure of a model in MJCF, URDF, OpenSim's form or DYSPAM's.

    Args:
        path: the file, or the folder of DYSPAM's input files.
        separate: whether hinges with springs, damping or limits each become a joint of their own.

    Raises:
        InputError: with everything that is wrong, each with its place.
    """
    if Path(path).is_dir():
        return imported_from_dyspam(parse_dyspam(Path(path)))
    source, fault = load_text(Path(path), str(path))
    if fault is not None:
        raise InputError([fault])
    return parse_model(source, Path(path).parent, separate=separate)


def parse_model(
    source: Source, directory: Path | None = None, *, separate: bool = False
) -> Imported:
    """As `read_model`, of a text; included files are looked for in `directory`."""
    findings = Diagnostics()
    imported = None
    with suppress(TooManyErrors):
        root = parse_xml(source, findings)
        if root is not None:
            reader = READERS.get(root.tag)
            if reader is None:
                _report_unknown_root(root, findings)
            else:
                imported = reader(root, directory, findings, separate=separate)
    if imported is None or findings.has_errors:
        raise InputError(findings.sorted_by_position())
    return imported


def _report_unknown_root(root: XmlElement, diagnostics: Diagnostics) -> None:
    near = spelling_hint(root.tag, READERS)
    known = "mujoco (MJCF), robot (URDF) or OpenSimDocument"
    hint = near if near.startswith("did") else f"the root element of a model is {known}"
    diagnostics.error(f"`{shorten(root.tag)}` is no model that is read", root.span, hint)
