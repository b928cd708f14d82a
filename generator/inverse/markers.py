"""Measured trajectories of markers: `.trc`, and `.c3d` by ezc3d (extra `c3d`)."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any, cast

import numpy as np

from generator.diagnostics import Diagnostics, InputError, Source, Span, UsageError, error, shorten
from generator.figure import Figure
from generator.file_kind import FileKind
from generator.identifiers import plain_name
from generator.model_files.xml import XmlElement, parse_xml
from generator.rotations import Array

METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
"""Units of lengths in files of markers."""

C3D_SUFFIX = ".c3d"


@dataclass(frozen=True, eq=False)
class Markers:
    """Trajectories of k markers over n frames.

    Attributes:
        times: Times [s], shape (n,), increasing.
        names: Names of the markers.
        positions: Positions [m], shape (n, k, 3), nan where a marker is missing.
    """

    times: Array
    names: tuple[str, ...]
    positions: Array


@dataclass(frozen=True)
class _Cell:
    """A cell of a line, with its place."""

    source: Source
    start: int
    text: str

    @property
    def span(self) -> Span:
        """Place of the text without blanks, or of the separator of an empty one."""
        inner = self.text.strip()
        first = self.start + (self.text.find(inner) if inner else 0)
        end = min(first + max(len(inner), 1), len(self.source.text))
        return Span(self.source, min(first, end), end)


def _cells(source: Source) -> Iterator[list[_Cell]]:
    """Yield the cells of the lines that are not blank, between tabs."""
    for line in re.finditer(r"[^\n]+", source.text):
        if line[0].strip():
            cells: list[_Cell] = []
            start = line.start()
            for text in line[0].split("\t"):
                cells.append(_Cell(source, start, text.strip("\r")))
                start += len(text) + 1
            yield cells


def _words(cells: Sequence[_Cell]) -> Iterator[_Cell]:
    """Yield the words of cells: the header of some files has more tabs than columns."""
    for cell in cells:
        for word in re.finditer(r"\S+", cell.text):
            yield _Cell(cell.source, cell.start + word.start(), word[0])


def _number(cell: _Cell, diagnostics: Diagnostics) -> float:
    """Return the number of a cell, nan for an empty one; an error for another text."""
    word = cell.text.strip()
    if not word or word.lower() == "nan":
        return np.nan
    try:
        value = float(word) if word.isascii() and "_" not in word else np.inf
    except ValueError:
        value = np.inf
    if not isfinite(value):
        diagnostics.error(f"`{shorten(word)}` is not a finite number", cell.span)
    return value


def _parse_trc(source: Source, diagnostics: Diagnostics) -> Markers | None:
    lines = _cells(source)
    head = [next(lines, None) for _ in range(5)]
    first = head[0]
    if first is None or not first[0].text.strip().startswith("PathFileType"):
        place = Span(source, 0, min(1, len(source.text)))
        diagnostics.error(
            "this is not a file of markers", place, "a .trc begins with `PathFileType`"
        )
        return None
    _, keys, values, titles, axes = head
    if keys is None or values is None or titles is None or axes is None:
        diagnostics.error("the header of the markers is not whole", first[0].span)
        return None
    known = {key.text: cell for key, cell in zip(_words(keys), _words(values), strict=False)}
    unit = known.get("Units")
    if unit is None or unit.text.strip() not in METRES:
        place = keys[0].span if unit is None else unit.span
        diagnostics.error(f"the `Units` are none of {', '.join(METRES)}", place)
        return None
    names: dict[str, _Cell] = {}
    for cell in titles[2::3]:
        name = cell.text.strip()
        if name and name in names:
            diagnostics.error(f"a second marker `{shorten(name)}`", cell.span)
        if name:
            names[name] = cell
    if not names:
        diagnostics.error("there are no names of markers", titles[0].span)
    _check_count(known.get("NumMarkers"), len(names), "markers", diagnostics)
    rows, frames = list[list[float]](), list[_Cell]()
    width = 2 + 3 * len(names)
    for cells in lines:
        if len(cells) > width and any(cell.text.strip() for cell in cells[width:]):
            message = f"this row has more than {len(names)} markers"
            diagnostics.error(message, cells[width].span)
            continue
        padded = cells[:width]
        numbers = [_number(cell, diagnostics) for cell in padded[1:]]
        if numbers and np.isnan(numbers[0]):
            diagnostics.error("the time is missing", padded[0].span)
        if len(cells) < 2:
            diagnostics.error("this row has no time", cells[0].span)
            continue
        rows.append(numbers + [np.nan] * (width - 1 - len(numbers)))
        frames.append(padded[1])
    if not rows and not diagnostics.has_errors:
        diagnostics.error("there are no frames", titles[0].span, "the file is not whole")
    if diagnostics.has_errors:
        return None
    table = np.array(rows)
    for k in np.flatnonzero(np.diff(table[:, 0]) <= 0.0):
        diagnostics.error("the time does not increase", frames[k + 1].span)
    _check_count(known.get("NumFrames"), len(table), "frames", diagnostics)
    positions = table[:, 1:].reshape(len(table), len(names), 3) * METRES[unit.text.strip()]
    return Markers(table[:, 0].copy(), tuple(names), positions)


TRC_FILE = FileKind("markers", ".trc", _parse_trc)


def _check_count(cell: _Cell | None, count: int, noun: str, diagnostics: Diagnostics) -> None:
    """Report a number in the header that the file does not have."""
    if cell is None:
        return
    text = cell.text.strip()
    if not text.isdigit():
        diagnostics.error(f"`{shorten(text)}` is not a number of {noun}", cell.span)
    elif int(text) != count:
        diagnostics.error(f"the file has {count} {noun}, not {text}", cell.span)


def read_c3d(path: Path) -> Markers:
    """Read the points of a `.c3d`; missing ones have a negative residual, or nan.

    Raises:
        UsageError: ezc3d is not installed.
        InputError: The file cannot be read.
    """
    try:
        from ezc3d import c3d  # pyright: ignore
    except ImportError:
        raise UsageError(
            f'{path}: reading .c3d needs ezc3d: in the project\'s folder, `pip install -e ".[c3d]"`'
        ) from None
    if not path.is_file():
        raise InputError([error(f"`{path}` cannot be read: no such file")])
    try:
        content = cast("Any", c3d(str(path)))
        points = np.asarray(content["data"]["points"], dtype=float)
        about = content["parameters"]["POINT"]
        names = [str(name) for name in about["LABELS"]["value"]]
        rate, unit = float(about["RATE"]["value"][0]), str(about["UNITS"]["value"][0])
        first = int(content["header"]["points"]["first_frame"])
        residuals = np.asarray(content["data"]["meta_points"]["residuals"], dtype=float)[0]
    except (RuntimeError, OSError, KeyError, IndexError, ValueError) as failure:
        raise InputError([error(f"`{path}` cannot be read as .c3d: {failure}")]) from None
    unit = unit.strip().lower()
    if unit not in METRES or not rate > 0.0 or points.size == 0:
        message = f"`{path}` has no points at a rate, in {', '.join(METRES)}"
        raise InputError([error(message)])
    count = min(len(names), points.shape[1])
    positions = np.moveaxis(points[:3, :count], 0, 2).swapaxes(0, 1) * METRES[unit]
    positions[residuals[:count].T < 0.0] = np.nan
    times: Array = (first + np.arange(float(points.shape[2]))) / rate
    return Markers(times, tuple(names[:count]), positions)


def read_markers(path: Path, up: str = "y") -> Markers:
    """Read markers from a `.trc` or a `.c3d`.

    Args:
        path: Path of the file.
        up: Axis of the laboratory that points up, "y" or "z"; z becomes y, and y becomes -z.

    Raises:
        UsageError: The suffix is another one, or ezc3d is missing.
        InputError: The file is wrong.
    """
    suffix = path.suffix.lower()
    if suffix == TRC_FILE.suffix:
        markers = TRC_FILE.read(path)
    elif suffix == C3D_SUFFIX:
        markers = read_c3d(path)
    else:
        raise UsageError(f"{path}: markers are read from .trc and .c3d")
    if up == "y":
        return markers
    x, y, z = np.moveaxis(markers.positions, 2, 0)
    return Markers(markers.times, markers.names, np.stack([x, z, -y], axis=2))


def format_trc(markers: Markers, name: str = "markers.trc") -> str:
    """Return the text of a `.trc` in metres; reading it returns the same markers, bit for bit."""
    times, count = markers.times, len(markers.names)
    rate = 1.0 / float(np.median(np.diff(times))) if len(times) > 1 else 1.0
    keys = ("DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units")
    values = (f"{rate:.6g}", f"{rate:.6g}", len(times), count, "m")
    axes = [f"{axis}{k}" for k in range(1, count + 1) for axis in "XYZ"]
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{name}",
        "\t".join([*keys, "OrigDataRate", "OrigDataStartFrame", "OrigNumFrames"]),
        "\t".join(map(str, (*values, f"{rate:.6g}", 1, len(times)))),
        "\t".join(["Frame#", "Time", "\t\t\t".join(markers.names), "", ""]),
        "\t".join(["", "", *axes]),
    ]
    for k, (time, row) in enumerate(zip(times.tolist(), markers.positions, strict=True), 1):
        cells = ["" if np.isnan(value) else repr(value) for value in row.ravel().tolist()]
        lines.append("\t".join([str(k), repr(time), *cells]))
    return "\n".join([*lines, ""])


@dataclass(frozen=True)
class MarkerSite:
    """A site of the figure that a marker is on.

    Attributes:
        marker: Name of the marker.
        segment: Segment of the site.
        place: Position in the segment, [m].
    """

    marker: str
    segment: str
    place: tuple[float, float, float]


def find_marker_sites(names: Sequence[str], figure: Figure) -> dict[str, MarkerSite]:
    """Return the sites of markers: `SEGMENT.SITE`, or the only site of this name.

    Names may have `_` for other characters than letters and digits, as those of imported models.
    """
    known: dict[str, list[MarkerSite]] = {}
    for segment, one in figure.segments.items():
        for site, at in one.sites.items():
            x, y, z = at.pose_in_segment[:3, 3].tolist()
            found = MarkerSite("", segment, (x, y, z))
            for name in {f"{segment}.{site}", site}:
                known.setdefault(name, []).append(found)
    sites: dict[str, MarkerSite] = {}
    for name in names:
        own = next((known[n] for n in (name, plain_name(name)) if len(known.get(n, ())) == 1), None)
        if own is not None:
            sites[name] = MarkerSite(name, own[0].segment, own[0].place)
    return sites


def _parse_tasks(source: Source, diagnostics: Diagnostics) -> Mapping[str, float] | None:
    root = parse_xml(source, diagnostics)
    if root is None:
        return None
    weights: dict[str, float] = {}
    for task in root.walk():
        if task.tag == "IKMarkerTask":
            weights[task.get("name") or ""] = _weight_of_task(task, diagnostics)
    if not weights and not diagnostics.has_errors:
        root.error("this file has no `IKMarkerTask`")
    return weights


def _weight_of_task(task: XmlElement, diagnostics: Diagnostics) -> float:
    """Return the weight of a task; zero for one that does not apply."""
    text = task.child_text("weight") or "1"
    try:
        weight = float(text)
    except ValueError:
        weight = -1.0
    if not 0.0 <= weight < np.inf:
        task.error(f"the weight `{shorten(text)}` is not a number from 0")
    return 0.0 if task.is_child("apply", "false") else weight


TASKS_FILE = FileKind("marker tasks", ".xml", _parse_tasks)
"""Weights of markers in a setup of OpenSim's inverse kinematics."""
