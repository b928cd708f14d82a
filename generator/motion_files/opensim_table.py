"""OpenSim's tables of coordinates, `.mot` (deg) and `.sto` (rad), written and read.

A displacement is a coordinate of the model that the figure is from, else `JOINT_k`, k from 1 in the
order of the chain, the innermost axis first; times are seconds, lengths metres. After them the
tables of a run with contact have the ground reaction in the columns of OpenSim's force files. The
header of the motion and the chains of its joints are entries `KEY=VALUE` above `endheader`.

Tables that OpenSim has written name no figure; their columns may be paths such as
`/jointset/JOINT/JOINT_k/value`, among columns of other quantities.
"""

import re
from array import array
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import islice
from math import isfinite
from pathlib import Path

import numpy as np

from generator.contact.record import centre_of_pressure
from generator.diagnostics import (
    Diagnostics,
    InputError,
    ModelError,
    Parsed,
    Source,
    Span,
    shorten,
    spelling_hint,
)
from generator.figure import Figure, JointAxis
from generator.file_kind import FileKind
from generator.identifiers import coordinate_names, plain_names, renaming_loss
from generator.input_files.coordinates import (
    NO_COORDINATES,
    CoordinateMapping,
    Coordinates,
    coordinates_of_figure,
    displacement_columns,
)
from generator.kinematics.free_root import (
    detach_root,
    free_joints,
    tree_for_motion,
)
from generator.kinematics.placement import initial_displacements, with_followers
from generator.kinematics.tree import build_tree
from generator.losses import Effect, Loss, Losses
from generator.motion_files.action import DIGEST, format_chain, parse_chain, words_of_line
from generator.motion_files.motion import (
    GROUND_REACTION,
    NO_FIGURE,
    NONE,
    FigureMotion,
    Header,
    first_frame_interval,
    lost_props,
    unrepresented,
)
from generator.recording import Ending
from generator.rotations import Array
from generator.text_io import parse_source, write_atomic

GROUND_REACTION_LABELS = tuple(
    f"ground_{quantity}{axis}" for quantity in ("force_v", "force_p", "torque_") for axis in "xyz"
)
"""Force, its point and a moment, with the names in OpenSim's examples of ground reactions."""


def _write_coordinates(motion: FigureMotion, path: Path, *, in_degrees: bool) -> Losses:
    """Write the displacements of a motion, whole or not at all. Raises OSError."""
    write_atomic(path, "".join(f"{line}\n" for line in _coordinate_lines(motion, in_degrees)))
    is_free = not motion.chains.keys() <= motion.figure.joints.keys()
    losses = [
        NO_FIGURE,
        Loss(_FREE_ROOT) if is_free else None,
        renaming_loss(plain_names(motion.chains)),
        lost_props(motion),
        unrepresented(motion, GROUND_REACTION),
        Loss(
            "digits: degrees are rounded to 17, which may change the last bit of an angle",
            effect=Effect.ROUNDING,
        )
        if in_degrees
        else None,
    ]
    return Losses.collect("OpenSim table", losses)


_FREE_ROOT = (
    "a joint to the ground: this motion of a free figure plays on a model that `mover convert "
    "FIGURE MODEL.osim --free-root` writes, and leaves others standing"
)

write_mot = partial(_write_coordinates, in_degrees=True)
"""Write a `.mot`: rotations in degrees, as in OpenSim's own motions."""

write_sto = partial(_write_coordinates, in_degrees=False)
"""Write a `.sto`: rotations in radians, as in OpenSim's own results; no digit is lost."""


def point_wrench(ground_reaction: Array) -> Array:
    """Force [N], its point in the plane y = 0 [m] and the moment there [N m], shape (n, 9).

    The moment is about y. Where the vertical force is below `MIN_VERTICAL_FORCE`, the point is the
    origin and the moment has all components, so that every row is equivalent to the ground
    reaction, shape (n, 6).
    """
    points, free_moments = centre_of_pressure(ground_reaction)
    has_point = np.isfinite(free_moments)[:, None]
    about_y = free_moments[:, None] * (0.0, 1.0, 0.0)
    return np.hstack(
        [
            ground_reaction[:, :3],
            np.where(has_point, points, 0.0),
            np.where(has_point, about_y, ground_reaction[:, 3:]),
        ]
    )


def follows(figure: Figure, at: CoordinateMapping) -> bool:
    """Return whether a displacement follows another in the figure's file: it has no column."""
    return at.joint in figure.joints and at.index not in figure.joints[at.joint].free_places


def _coordinate_lines(motion: FigureMotion, in_degrees: bool) -> Iterator[str]:
    labels = [TIME_LABEL]
    columns = [motion.times]
    coordinates = motion.coordinates
    if coordinates is None:
        coordinates = coordinates_of_figure(motion.figure)
    for label, at in displacement_columns(motion.chains, coordinates).items():
        if follows(motion.figure, at):
            continue
        values = motion.displacements[at.joint][:, at.index]
        if (at.scale, at.offset) != (1.0, 0.0):
            values = at.scale * values + at.offset
        is_angle = motion.chains[at.joint][at.index].units.is_angle
        labels.append(label)
        columns.append(np.degrees(values) if in_degrees and is_angle else values)
    contact = None if motion.recording is None else motion.recording.contact
    if contact is not None:
        labels += GROUND_REACTION_LABELS
        columns += list(point_wrench(contact.ground_reaction).T)
    yield "Coordinates"
    yield "version=1"
    yield f"nRows={len(motion.times)}"
    yield f"nColumns={len(labels)}"
    yield f"inDegrees={'yes' if in_degrees else 'no'}"
    for line in motion.header.lines():
        name, _, value = line.partition(" ")
        yield f"{name}={value}"
    plain = plain_names(motion.chains)
    for name, chain in motion.chains.items():
        yield f"{CHAIN_KEY}{plain[name]}={format_chain(chain)}"
    yield END_OF_HEADER
    yield "\t".join(labels)
    for row in np.stack(columns, axis=1).tolist():
        yield "\t".join(map(repr, row))


END_OF_HEADER = "endheader"
TIME_LABEL = "time"
CHAIN_KEY = "joint."
"""Beginning of the keys of the chains."""

UNKNOWN = "unknown"
"""Springs and law of a motion that OpenSim has written."""

VERSIONS = ("1", "2", "3")
_DEGREES = {"yes": True, "y": True, "no": False, "n": False}

_NUMBER = re.compile(
    r"[+-]?(?:(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?|nan|inf|infinity)", re.IGNORECASE
)
_COUNT = re.compile(r"[0-9]{1,9}")
_PATH_OF_VALUE = re.compile(r"(?:.*/)?([^/]+)/value")

MAX_HEADER_LINES = 10_000
MAX_LINE_LENGTH = 1_000_000
"""Number of characters of the longest line, for the memory."""

MAX_NAMED_COLUMNS = 8
"""Number of columns that a warning names."""


Chains = Mapping[str, tuple[JointAxis, ...]]


@dataclass(frozen=True, eq=False)
class CoordinateTable:
    """A table of n rows, as it is in the file.

    Attributes:
        source: the text.
        entries: values of the header by key.
        title_line: the line of the titles.
        titles: titles of the columns after the time, in their order.
        in_degrees: rotations are in degrees, not in radians.
        times: shape (n,), increasing [s].
        numbers: shape (n, number of titles); they need not be finite.
        row_starts: offsets of the rows in the text.
    """

    source: Source
    entries: Mapping[str, Span]
    title_line: Span
    titles: tuple[Span, ...]
    in_degrees: bool
    times: Array
    numbers: Array
    row_starts: "array[int]"

    @property
    def figure(self) -> str | None:
        """Name of the figure's file; None in tables of OpenSim's own."""
        return self._entry("figure")

    @property
    def sha256(self) -> str | None:
        """SHA-256 of the figure's file."""
        return self._entry("sha256")

    def _entry(self, key: str) -> str | None:
        text = self.entries[key].text if key in self.entries else NONE
        return None if text == NONE else text

    def chains(self, figure: Figure) -> Chains:
        """Chains of the joints: those of the file, else those that the titles fit.

        These are the figure's, or those of the figure with a free root if a title names one of
        their displacements. Raises InputError for a chain that cannot be read.
        """
        freed, _ = detach_root(figure, initial_displacements(build_tree(figure)))
        names = {
            plain: name
            for joints in (freed.joints, figure.joints)
            for name, plain in plain_names(joints).items()
        }
        listed = {
            key.removeprefix(CHAIN_KEY): parse_chain(value)
            for key, value in self.entries.items()
            if key.startswith(CHAIN_KEY)
        }
        if listed:
            return {names.get(plain, plain): chain for plain, chain in listed.items()}
        free = {name: joint.chain for name, joint in free_joints(freed).items()}
        of_free = {name for names in coordinate_names(free).values() for name in names}
        is_free = any(_coordinate(title.text) in of_free for title in self.titles)
        return {name: one.chain for name, one in (freed if is_free else figure).joints.items()}

    def finite_column(self, column: int, diagnostics: Diagnostics) -> Array:
        """Return the numbers of a column, shape (n,); an error for each that is not finite."""
        values = self.numbers[:, column]
        for row in np.flatnonzero(~np.isfinite(values)):
            cell = words_of_line(_line_at(self.source, self.row_starts[row]))[column + 1]
            diagnostics.error(f"`{shorten(cell.text)}` is not finite", cell)
        return values

    def displacements(
        self, chains: Chains, diagnostics: Diagnostics, coordinates: Coordinates
    ) -> dict[tuple[str, int], Array]:
        """Columns by joint and number of the displacement from 0, shape (n,) [rad or m].

        Other columns are left out with a warning.

        Args:
            chains: Chains of the joints.
            diagnostics: Collects errors and warnings.
            coordinates: Coordinates of the model that the figure is from.
        """
        places = {
            **displacement_columns(chains, NO_COORDINATES),
            **displacement_columns(chains, coordinates),
        }
        found: dict[tuple[str, int], Array] = {}
        unknown: list[Span] = []
        for column, title in enumerate(self.titles):
            at = places.get(_coordinate(title.text))
            if at is None:
                if title.text not in GROUND_REACTION_LABELS:
                    unknown.append(title)
                continue
            place = at.joint, at.index
            if place in found:
                diagnostics.error(f"a second column of `{_coordinate(title.text)}`", title)
            values = self.finite_column(column, diagnostics)
            is_angle = chains[at.joint][at.index].units.is_angle
            values = np.radians(values) if self.in_degrees and is_angle else values
            found[place] = (values - at.offset) / at.scale
        example = next(iter(displacement_columns(chains, coordinates)), "JOINT_1")
        named = "as those of the model" if coordinates else "JOINT_k"
        hint = f"displacements are called {named}, such as `{example}`"
        if not found:
            message = "no column is a displacement of a joint of the figure"
            diagnostics.error(message, self.title_line, hint)
        elif unknown:
            names = _listed(title.text for title in unknown)
            diagnostics.warning(
                f"columns that are not displacements of the figure are left out: {names}",
                unknown[0],
                hint,
            )
        return found


def _coordinate(title: str) -> str:
    """Name of the coordinate in a title: the last but one part of a path that ends in `/value`."""
    match = _PATH_OF_VALUE.fullmatch(title)
    return title if match is None else match[1]


def _listed(names: Iterator[str]) -> str:
    """List names, at most `MAX_NAMED_COLUMNS` of them."""
    listed = list(map(shorten, names))
    left = len(listed) - MAX_NAMED_COLUMNS
    return ", ".join(listed[:MAX_NAMED_COLUMNS]) + (f" and {left} more" if left > 0 else "")


def _parse_coordinates(
    source: Source, diagnostics: Diagnostics, *, has_angles: bool = True
) -> CoordinateTable | None:
    lines = _lines(source, diagnostics)
    entries = _parse_header(source, lines, diagnostics)
    in_degrees = None
    if entries is not None:
        in_degrees = _check_header(entries, diagnostics, has_angles)
    title_line = next(lines, None)
    if entries is None or in_degrees is None or diagnostics.has_errors:
        return None
    if title_line is None:
        end = entries[END_OF_HEADER]
        diagnostics.error("the titles of the columns are missing", end, "the file is not whole")
        return None
    titles = words_of_line(title_line)
    if titles[0].text != TIME_LABEL:
        diagnostics.error(f"the first column is not `{TIME_LABEL}`", titles[0])
    first: dict[str, Span] = {}
    for title in titles:
        if first.setdefault(title.text, title) is not title:
            diagnostics.error(f"a second column `{shorten(title.text)}`", title)
    starts, table = _parse_rows(lines, len(titles), diagnostics)
    if not len(table) and not diagnostics.has_errors:
        diagnostics.error("the table has no rows", title_line, "the file is not whole")
    if diagnostics.has_errors:
        return None
    _check_times(source, table[:, 0], starts, diagnostics)
    _check_counts(entries, len(table), len(titles), diagnostics)
    times, numbers = table[:, 0].copy(), table[:, 1:]
    others = tuple(titles[1:])
    return CoordinateTable(source, entries, title_line, others, in_degrees, times, numbers, starts)


COORDINATES_FILE = FileKind("table of coordinates", ".mot", _parse_coordinates)


def _parse_header(
    source: Source, lines: Iterator[Span], diagnostics: Diagnostics
) -> dict[str, Span] | None:
    """Return the values by key, with the last line of the header under `endheader`."""
    entries: dict[str, Span] = {}
    for line in islice(lines, MAX_HEADER_LINES):
        text = line.text.strip()
        if text.lower() == END_OF_HEADER:
            entries[END_OF_HEADER] = line
            return entries
        key, equals, value = text.partition("=")
        key, value = key.strip(), value.strip()
        if not equals or not key or not value:
            continue  # OpenSim ignores other lines
        start = source.text.index("=", line.start) + 1
        start = source.text.index(value, start)
        place = Span(source, start, start + len(value))
        if key in entries:
            diagnostics.error(f"a second `{shorten(key)}` in the header", place)
        entries[key] = place
    if diagnostics.has_errors:
        return None
    place = Span(source, 0, min(1, len(source.text)))
    diagnostics.error(f"the line `{END_OF_HEADER}` is missing", place,
                      "it ends the header of OpenSim's tables")  # fmt: skip
    return None


def _check_header(
    entries: Mapping[str, Span], diagnostics: Diagnostics, has_angles: bool
) -> bool | None:
    """Return whether angles are in degrees; None if the header does not say it."""
    version = entries.get("version")
    if version is not None and version.text not in VERSIONS:
        diagnostics.error(
            f"unknown version `{shorten(version.text)}` of the table",
            version,
            f"this program reads versions {', '.join(VERSIONS)}",
        )
    kind = entries.get("DataType")
    if kind is not None and kind.text != "double":
        message = f"the columns have the type `{shorten(kind.text)}`"
        diagnostics.error(message, kind, "displacements are numbers, `double`")
    digest = entries.get("sha256")
    if digest is not None and digest.text != NONE and not DIGEST.fullmatch(digest.text):
        hint = f"64 hexadecimal digits, or `{NONE}`"
        diagnostics.error("this is not a SHA-256 digest", digest, hint)
    outcome = entries.get("outcome")
    if outcome is not None and outcome.text not in _ENDINGS:
        hint = spelling_hint(outcome.text, _ENDINGS)
        diagnostics.error(f"unknown outcome `{shorten(outcome.text)}`", outcome, hint)
    units = entries.get("inDegrees")
    if units is None and not has_angles:
        return False
    if units is None:
        diagnostics.error(
            "the header does not say whether angles are in degrees",
            entries[END_OF_HEADER],
            f"write `inDegrees=yes` or `inDegrees=no` above `{END_OF_HEADER}`",
        )
        return None
    if units.text.lower() not in _DEGREES:
        diagnostics.error(f"`{shorten(units.text)}` is neither `yes` nor `no`", units)
    return _DEGREES.get(units.text.lower())


_ENDINGS = {ending.value: ending for ending in Ending}


def _parse_rows(
    lines: Iterator[Span], width: int, diagnostics: Diagnostics
) -> "tuple[array[int], Array]":
    """Return the offsets of the rows and their numbers, shape (n, width)."""
    starts, numbers = array("q"), array("d")
    for line in lines:
        row = _parse_row(line.text)
        if row is None or len(row) != width:
            _report_row(line, width, diagnostics)
            continue
        starts.append(line.start)
        numbers.extend(row)
    return starts, np.array(numbers).reshape(-1, width)


def _parse_row(text: str) -> list[float] | None:
    """Return the numbers of a line; None if a word is not a number."""
    words = text.split()
    if ("_" in text or not text.isascii()) and not all(map(_NUMBER.fullmatch, words)):
        return None  # Python takes more words for numbers
    try:
        return list(map(float, words))
    except ValueError:
        return None


def _report_row(line: Span, width: int, diagnostics: Diagnostics) -> None:
    words = words_of_line(line)
    if len(words) != width:
        message = f"this row has {len(words)} columns, not {width}"
        diagnostics.error(message, line, "as many as there are titles")
        return
    for word in words:
        if not _NUMBER.fullmatch(word.text):
            diagnostics.error(f"`{shorten(word.text)}` is not a number", word)


def _check_times(
    source: Source, times: Array, starts: "array[int]", diagnostics: Diagnostics
) -> None:
    """Check that the times are finite and increase."""
    with np.errstate(invalid="ignore"):
        is_wrong = ~(np.diff(times, prepend=-np.inf) > 0.0) | ~np.isfinite(times)
    for row in np.flatnonzero(is_wrong):
        cell = words_of_line(_line_at(source, starts[row]))[0]
        if isfinite(times[row]):
            diagnostics.error("the time does not increase", cell)
        else:
            diagnostics.error(f"`{shorten(cell.text)}` is not finite", cell)


def _check_counts(
    entries: Mapping[str, Span], rows: int, columns: int, diagnostics: Diagnostics
) -> None:
    """Check the numbers of rows and columns, which OpenSim's tools do not keep up to date."""
    for key, name, count in (("nRows", "rows", rows), ("nColumns", "columns", columns)):
        place = entries.get(key)
        if place is None or "OpenSimVersion" in entries:
            continue
        if not _COUNT.fullmatch(place.text):
            diagnostics.error(f"`{shorten(place.text)}` is not a number of {name}", place)
        elif int(place.text) != count:
            message = f"the table has {count} {name}, not {place.text}"
            hint = "the file is not whole" if count < int(place.text) else ""
            diagnostics.error(message, place, hint)


def _lines(source: Source, diagnostics: Diagnostics) -> Iterator[Span]:
    """Yield the lines that are not blank, up to one that is too long."""
    for match in re.finditer(r"[^\n]+", source.text):
        if match.end() - match.start() > MAX_LINE_LENGTH:
            message = f"this line is longer than {MAX_LINE_LENGTH:,} characters"
            diagnostics.error(message, Span(source, match.start(), match.end()))
            return
        if match[0].strip():
            yield Span(source, match.start(), match.end())


def _line_at(source: Source, start: int) -> Span:
    """The line that starts at an offset."""
    end = source.text.find("\n", start)
    return Span(source, start, len(source.text) if end == -1 else end)


MAX_NUMBERS = 16_000_000
"""Largest number of displacements in all frames of a motion, for the memory."""


def motion_from_coordinates(
    table: CoordinateTable,
    figure: Figure,
    coordinates: Coordinates | None = None,
    *,
    is_whole: bool = False,
) -> Parsed[FigureMotion]:
    """Return the motion of a figure in a table, with all diagnostics.

    A displacement without a column has the figure's own value in all frames, with a warning.

    Args:
        table: Table of its coordinates.
        figure: Figure that moves.
        coordinates: Coordinates of the model that it is from; None for those beside its file.
        is_whole: Make a displacement without a column an error.
    """
    return parse_source(
        table.source,
        lambda _, found: _build_motion(table, figure, coordinates, found, is_whole=is_whole),
    )


def _build_motion(
    table: CoordinateTable,
    figure: Figure,
    coordinates: Coordinates | None,
    diagnostics: Diagnostics,
    *,
    is_whole: bool,
) -> FigureMotion | None:
    try:
        coordinates = coordinates_of_figure(figure) if coordinates is None else coordinates
        chains = table.chains(figure)
        own = initial_displacements(tree_for_motion(figure, chains))
    except InputError as failure:
        for each in failure.diagnostics:
            diagnostics.error(each.message, each.span, each.hint)
        return None
    except ModelError as failure:
        diagnostics.error(str(failure), table.title_line)
        return None
    columns = table.displacements(chains, diagnostics, coordinates)
    if len(table.times) * sum(map(len, chains.values())) > MAX_NUMBERS:
        message = f"{len(table.times):,} frames of this figure are too many"
        diagnostics.error(message, table.title_line, f"at most {MAX_NUMBERS:,} displacements")
    if diagnostics.has_errors:
        return None
    values = {name: np.tile(own[name], (len(table.times), 1)) for name in chains}
    for (name, k), column in columns.items():
        values[name][:, k] = column
    values = with_followers(figure, values)
    missing = [
        name
        for name, at in displacement_columns(chains, coordinates).items()
        if (at.joint, at.index) not in columns and not follows(figure, at)
    ]
    free = [name for name in chains if name not in figure.joints]
    if free and not any(key.startswith(CHAIN_KEY) for key in table.entries):
        diagnostics.warning(
            f"the file does not say the axes of {_listed(iter(free))}",
            table.title_line,
            "they are those of a free root in the figure's own pose",
        )
    if missing and is_whole:
        diagnostics.error(
            f"displacements without a column: {_listed(iter(missing))}",
            table.title_line,
            "of what does not move, add a column of one value",
        )
        return None
    if missing:
        diagnostics.warning(
            f"displacements without a column have the figure's own value: {_listed(iter(missing))}",
            table.title_line,
        )
    header = _header(table, figure)
    return FigureMotion(figure, header, chains, table.times, values, coordinates=coordinates)


def _header(table: CoordinateTable, figure: Figure) -> Header:
    """The header of a motion: that of the file, or what is known of a table of OpenSim's own."""
    own = {key: place.text for key, place in table.entries.items()}
    times = table.times
    return Header(
        figure=table.figure or (figure.name if figure.path is None else figure.path.name) or NONE,
        sha256=table.sha256,
        start=float(times[0]),
        stop=float(times[-1]),
        frame_interval=first_frame_interval(times),
        springs=own.get("springs", UNKNOWN),
        law=own.get("law", UNKNOWN),
        outcome=_ENDINGS[own.get("outcome", Ending.DONE.value)],
        message=own.get("message", f"coordinates of {Path(table.source.name).name}"),
    )
