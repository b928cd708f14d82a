"""DYSPAM's file `ndyspamfile` (figure 3.2): a mechanism in six tables, in cgs.

1. body joint table: joint, body, body, type
2. joint triads: body and joint, then three rows of turn and position; two for each joint
3. masses: body, point of its centre of mass, mass, three principal moments of inertia
4. points of interest: point, body, and x,y,z with commas between
5. springs: joint, stiffness, damping, rest angle, axis
6. initial conditions: joint, angles, rates; of a spherical joint about z, y and x
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from generator.diagnostics import Diagnostics, Source, Span, shorten
from generator.figure_file.lexer import MAX_WORD_LENGTH
from generator.loads import LoadKind
from generator.model_files.dyspam.mechanism import (
    LOAD_KINDS,
    Connection,
    JointType,
    LinearSpring,
    Mechanism,
    MechanismBody,
    Point,
    PointLoad,
    Triad,
    triad_from_rows,
)
from generator.units import (
    MAX_MODEL_NUMBER,
    Dimension,
    convert_to_si,
    default_unit_factor,
    shortest_decimal,
)

MAX_COUNT = 1_000_000
"""No mechanism has so many bodies, joints, points or springs."""

_WORD = re.compile(r"[^\s,]++")
_LINE_END = re.compile(r"[#/]")
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eEdD][+-]?[0-9]{1,6})?")


class BrokenTableError(Exception):
    """A row is malformed, so that the rows after it have no meaning. Its error is reported."""


@dataclass(frozen=True)
class Row:
    """The words of a line that has any, and whether commas stand between them."""

    words: tuple[Span, ...]
    has_commas: bool

    @property
    def span(self) -> Span:
        """From the first word to the last."""
        return self.words[0].extend_to(self.words[-1])


class RowReader:
    """The rows of a file, one after the other; errors go to `diagnostics`."""

    def __init__(self, source: Source, diagnostics: Diagnostics) -> None:
        """Split a text into rows."""
        self.source = source
        self.diagnostics = diagnostics
        self._rows = _split_rows(source)
        self._next = 0

    @property
    def next_row(self) -> Row | None:
        """The next row."""
        return self._rows[self._next] if self._next < len(self._rows) else None

    @property
    def remaining(self) -> int:
        """Number of rows left."""
        return len(self._rows) - self._next

    @property
    def diagnostic_count(self) -> int:
        """Number of diagnostics so far."""
        return len(self.diagnostics.entries)

    def take_row(self, what: str, form: str) -> Row:
        """Return the next row.

        Args:
            what: what it is, for sentences.
            form: a word for each of its numbers, with blanks between.

        Raises:
            BrokenTableError: the file has ended, or the row has another number of words.
        """
        row, count = self.next_row, len(form.split())
        if row is None:
            last = self._rows[-1].span if self._rows else Span(self.source, 0, 1)
            self.diagnostics.error(f"the file ends before {what}", last, f"it is `{form}`")
            raise BrokenTableError
        if len(row.words) != count:
            number = len(row.words)
            message = f"{number} value{'s' if number > 1 else ''} instead of {count}"
            self.diagnostics.error(message, row.span, f"here stands {what}, `{form}`")
            raise BrokenTableError
        self._next += 1
        return row

    def expect_end(self, last: str) -> None:
        """Report a row after the `last` one."""
        if self.next_row is not None:
            self.diagnostics.error(f"a line is left over after {last}", self.next_row.span)

    def parse_number(self, word: Span, dimension: Dimension = Dimension.NUMBER) -> float:
        """Return the number of a word [SI]; zero, with an error, for another word."""
        if word.end - word.start > MAX_WORD_LENGTH or not _NUMBER.fullmatch(word.text):
            hint = "a number looks like `12`, `-0.5` or `2.41e+09`, without a unit"
            self.diagnostics.error(f"`{shorten(word.text)}` is not a number", word, hint)
            return 0.0
        text, factor = word.text.lower().replace("d", "e"), default_unit_factor(dimension)
        with suppress(OverflowError):
            if abs(value := convert_to_si(text, factor)) <= MAX_MODEL_NUMBER:
                return value
        message = f"`{shorten(word.text)}` is too large"
        self.diagnostics.error(message, word, f"a number is at most {MAX_MODEL_NUMBER:.0e} in SI")
        return 0.0

    def parse_numbers(
        self, words: tuple[Span, ...], dimension: Dimension = Dimension.NUMBER
    ) -> tuple[float, ...]:
        """Return the numbers of words of one dimension [SI]."""
        return tuple(self.parse_number(word, dimension) for word in words)

    def parse_integer(
        self, word: Span, what: str, minimum: int = 0, maximum: int = MAX_COUNT
    ) -> int:
        """Return the integer of a word; `minimum`, with an error, outside the range."""
        before, value = self.diagnostic_count, self.parse_number(word)
        if self.diagnostic_count > before:
            return minimum
        if not value.is_integer() or not minimum <= value <= maximum:
            hint = f"it is {minimum}" if minimum == maximum else f"it is {minimum} to {maximum}"
            self.diagnostics.error(f"the {what} is `{shorten(word.text)}`", word, hint)
            return minimum
        return int(value)


def format_number(value: float, dimension: Dimension = Dimension.NUMBER, decimals: int = 2) -> str:
    """Return the shortest cgs number that is read as `value` [SI], with at least `decimals`."""
    text = shortest_decimal(value, default_unit_factor(dimension))
    if "e" in text:
        return text
    whole, _, fraction = text.partition(".")
    return f"{whole}.{fraction.ljust(decimals, '0')}"


def _split_rows(source: Source) -> list[Row]:
    rows: list[Row] = []
    start = 0
    for line in source.text.split("\n"):
        bare = _LINE_END.split(line, maxsplit=1)[0]
        words = tuple(
            Span(source, start + match.start(), start + match.end())
            for match in _WORD.finditer(bare)
        )
        if words:
            rows.append(Row(words, "," in bare))
        start += len(line) + 1
    return rows


_LOAD_FORM = "load point x y z"


def count_loads(loads: Iterable[PointLoad]) -> tuple[int, ...]:
    """Return the number of loads of each of `LOAD_KINDS`."""
    kinds = [load.kind for load in loads]
    return tuple(kinds.count(kind) for kind in LOAD_KINDS)


def format_jackforce(loads: Iterable[PointLoad]) -> str:
    """Format the file `jackforce`; empty without loads."""
    lines: list[str] = []
    for load in sorted(loads, key=lambda load: LOAD_KINDS.index(load.kind)):
        parts = [format_number(part, _dimension(load.kind)) for part in load.components]
        lines.append(f"{len(lines) + 1} {load.point} {' '.join(parts)}\n")
    return "".join(lines)


def parse_jackforce(
    source: Source, counts: Sequence[int], points: int, diagnostics: Diagnostics
) -> tuple[PointLoad, ...]:
    """Parse the loads of a text, up to a malformed row. Errors go to `diagnostics`.

    Args:
        source: the text.
        counts: how many loads there are of each of `LOAD_KINDS`.
        points: how many points of interest there are.
        diagnostics: collects errors.
    """
    rows, loads = RowReader(source, diagnostics), list[PointLoad]()
    with suppress(BrokenTableError):
        for kind, count in zip(LOAD_KINDS, counts, strict=True):
            for k in range(1, count + 1):
                row = rows.take_row(f"{kind.value} {k} of {count}", _LOAD_FORM)
                number = len(loads) + 1
                rows.parse_integer(row.words[0], "number of the load", number, number)
                point = rows.parse_integer(row.words[1], "number of the point", 1, points)
                x, y, z = rows.parse_numbers(row.words[2:], _dimension(kind))
                loads.append(PointLoad(kind, point, (x, y, z)))
        rows.expect_end(f"the {sum(counts)} loads that `structure` counts")
    return tuple(loads)


def _dimension(kind: LoadKind) -> Dimension:
    return Dimension.FORCE if kind.is_force else Dimension.MOMENT


_NUMERICS = "0.00000001, 0.00001, 0.000001, 7\n10.0 ,1.0 ,0.1/\n"
"""The parameters of the numerical procedures, as figure 3.1 has them."""


@dataclass(frozen=True)
class Times:
    """When a simulation starts and stops, its step, and the interval of what it writes [s]."""

    start: float = 0.0
    step: float = 0.001
    stop: float = 1.0
    frame: float = 0.02


@dataclass(frozen=True)
class Structure:
    """Contents of the file `structure`.

    Attributes:
        bodies: how many move.
        joints: how many there are.
        degrees_of_freedom: degrees of freedom of the whole.
        loads: how many of each of `LOAD_KINDS`.
        springs: how many linear springs `ndyspamfile` has.
        times: times of the simulation.
        has_flags: whether a flag is set; what it asks for is not known.
        span: span of the first line.
    """

    bodies: int
    joints: int
    degrees_of_freedom: int
    loads: tuple[int, ...]
    springs: int
    times: Times = Times()
    has_flags: bool = False
    span: Span | None = None


def format_structure(structure: Structure) -> str:
    """Format the file `structure`, with all flags zero."""
    times = structure.times
    instants = (times.start, times.step, times.stop, times.frame)
    return (
        f"{structure.bodies}, {structure.joints}, {structure.degrees_of_freedom}\n"
        f"{' '.join(map(str, structure.loads))}\n"
        f"0, 0, {structure.springs}\n"
        "0, 0\n"
        "0\n"
        f"{', '.join(format_number(time, decimals=6) for time in instants)}\n"
        f"{_NUMERICS}"
    )


def parse_structure(source: Source, diagnostics: Diagnostics) -> Structure | None:
    """Parse a text; None if a row is malformed. Errors go to `diagnostics`."""
    with suppress(BrokenTableError):
        return _structure(RowReader(source, diagnostics))
    return None


def _structure(rows: RowReader) -> Structure:
    first = rows.take_row("the first line", "bodies joints degrees_of_freedom")
    names = ("number of bodies", "number of joints", "number of degrees of freedom")
    bodies, joints, freedoms = (
        rows.parse_integer(word, name, minimum=low)
        for word, name, low in zip(first.words, names, (1, 1, 0), strict=True)
    )
    line = rows.take_row(
        "the line of loads", "global_forces local_forces global_moments local_moments"
    )
    loads = tuple(
        rows.parse_integer(word, f"number of loads `{kind.value}`")
        for word, kind in zip(line.words, LOAD_KINDS, strict=True)
    )
    line = rows.take_row("the line of springs", "flag flag rotational_springs")
    springs = rows.parse_integer(line.words[2], "number of rotational springs")
    flags = [*line.words[:2]]
    flags += rows.take_row("a line of flags", "flag flag").words
    flags += rows.take_row("a line of flags", "flag").words
    flagged = any([rows.parse_number(word) != 0.0 for word in flags])
    times = _times(rows.take_row("the line of times", "start step stop animation_step"), rows)
    for form in ("parameter parameter parameter parameter", "parameter parameter parameter"):
        rows.parse_numbers(rows.take_row("a line of numerical parameters", form).words)
    rows.expect_end("the numerical parameters")
    return Structure(bodies, joints, freedoms, loads, springs, times, flagged, first.span)


def _times(line: Row, rows: RowReader) -> Times:
    start, step, stop, frame = rows.parse_numbers(line.words)
    if not rows.diagnostics.has_errors:
        if stop <= start:
            rows.diagnostics.error("the stop time is not after the start", line.words[2])
        for word, what, value in ((line.words[1], "step", step), (line.words[3], "frame", frame)):
            if value <= 0.0:
                rows.diagnostics.error(f"the {what} is not above zero", word)
    return Times(start, step, stop, frame)


MAX_TRIAD_ERROR = 0.02
"""Largest error of the dot products of triad axes: that of figure 3.2, printed with two decimals.
Reading takes the nearest rotation."""

_TRIAD_WARNING_ERROR = 1e-6
"""Larger errors of a triad give a warning."""

_SPRING_FORM = "joint stiffness damping rest axis"

_KNOWN_JOINT_TYPES = " or ".join(f"{each.value} ({each.name.lower()})" for each in JointType)


def format_tables(mechanism: Mechanism) -> str:
    """Format the file `ndyspamfile`."""
    return "".join(f"{line}\n" for line in _lines(mechanism))


def parse_tables(
    source: Source, structure: Structure, diagnostics: Diagnostics
) -> Mechanism | None:
    """Parse a text; None if a row is malformed. Errors go to `diagnostics`.

    Args:
        source: the text.
        structure: how many rows the tables have.
        diagnostics: collects errors.
    """
    with suppress(BrokenTableError):
        return _mechanism(RowReader(source, diagnostics), structure)
    return None


def _lines(mechanism: Mechanism) -> Iterator[str]:
    joints = list(enumerate(mechanism.connections, start=1))
    for k, joint in joints:
        yield f"{k} {joint.first} {joint.second} {joint.type.value}"
    for k, joint in joints:
        for body, triad in zip((joint.first, joint.second), joint.triads, strict=True):
            yield f"{body} {k}"
            for row in triad:
                turn = [format_number(value) for value in row[:3]]
                yield " ".join([*turn, format_number(row[3], Dimension.LENGTH)])
    for k, body in enumerate(mechanism.bodies, start=1):
        moments = [format_number(value, Dimension.INERTIA, 6) for value in body.inertia]
        mass = format_number(body.mass, Dimension.MASS, 6)
        yield f"{k} {body.centre} {mass} {' '.join(moments)}"
    for k, point in enumerate(mechanism.points, start=1):
        place = [format_number(value, Dimension.LENGTH) for value in point.position]
        yield f"{k} {point.body} {','.join(place)}"
    for spring in mechanism.springs:
        stiffness = format_number(spring.stiffness, Dimension.ANGULAR_STIFFNESS, 6)
        damping = format_number(spring.damping, Dimension.ANGULAR_DAMPING, 6)
        rest = format_number(spring.rest, decimals=6)
        yield f"{spring.joint} {stiffness} {damping} {rest} {spring.axis}"
    for k, joint in joints:
        angles = [format_number(angle, decimals=6) for angle in joint.angles]
        yield " ".join([str(k), *angles, *map(format_number, joint.rates)])


def _mechanism(rows: RowReader, structure: Structure) -> Mechanism:
    """Read table by table: every row of a table has its own form, and so a lost one shows."""
    heads = [_head(rows, k, structure.bodies) for k in range(1, structure.joints + 1)]
    if rows.diagnostics.has_errors:
        raise BrokenTableError  # the other tables have rows for these joints
    triads = [
        (_triad(rows, first, k), _triad(rows, second, k))
        for k, (first, second, _, _) in enumerate(heads, start=1)
    ]
    bodies = [_body(rows, k) for k in range(1, structure.bodies + 1)]
    before = rows.diagnostic_count
    points = _points(rows, structure)
    if rows.diagnostic_count == before:
        _check_centres(bodies, points, rows)
    springs = _springs(rows, structure.springs, [head[2] for head in heads])
    starts = [_start(rows, k, kind) for k, (_, _, kind, _) in enumerate(heads, start=1)]
    rows.expect_end("the initial conditions of the last joint")
    connections = [
        Connection(*head[:3], triad, *start, span=head[3])
        for head, triad, start in zip(heads, triads, starts, strict=True)
    ]
    moving = [body for body, _ in bodies]
    return Mechanism(tuple(connections), tuple(moving), tuple(points), springs)


def _head(rows: RowReader, number: int, bodies: int) -> tuple[int, int, JointType, Span]:
    row = rows.take_row(f"joint {number} of the body joint table", "joint body body type")
    rows.parse_integer(row.words[0], "number of the joint", number, number)
    first, second = (
        rows.parse_integer(word, "number of the body", 0, bodies) for word in row.words[1:3]
    )
    kind, known = rows.parse_number(row.words[3]), {float(each.value): each for each in JointType}
    if kind not in known:
        rows.diagnostics.error(
            f"the joint type `{row.words[3].text}` is not known",
            row.words[3],
            f"this program knows {_KNOWN_JOINT_TYPES}",
        )
    return first, second, known.get(kind, JointType.SPHERICAL), row.span


def _triad(rows: RowReader, body: int, joint: int) -> Triad:
    what = f"the triad of body {body} at joint {joint}"
    head = rows.take_row(what, "body joint")
    rows.parse_integer(head.words[0], "number of the body", body, body)
    rows.parse_integer(head.words[1], "number of the joint", joint, joint)
    lines = [rows.take_row(f"a row of {what}", "turn turn turn position") for _ in range(3)]
    turns = np.array([rows.parse_numbers(line.words[:3]) for line in lines])
    position = [rows.parse_number(line.words[3], Dimension.LENGTH) for line in lines]
    span = lines[0].span.extend_to(lines[2].span)
    off = float(np.max(np.abs(turns @ turns.T - np.eye(3))))
    if rows.diagnostics.has_errors:
        turns = np.eye(3)
    elif off > MAX_TRIAD_ERROR or np.linalg.det(turns) < 0.0:
        hint = "its columns are unit axes at right angles, and right-handed"
        rows.diagnostics.error(f"{what} is not a rotation", span, hint)
        turns = np.eye(3)
    elif off > _TRIAD_WARNING_ERROR:
        rows.diagnostics.warning(f"{what} is not exactly a turn", span, "the nearest one is taken")
        left, _, right = np.linalg.svd(turns)
        turns = left @ right
    return triad_from_rows(np.column_stack([turns, position]).tolist())


def _body(rows: RowReader, number: int) -> tuple[MechanismBody, Row]:
    row = rows.take_row(
        f"body {number} of the mass table", "body point mass inertia inertia inertia"
    )
    rows.parse_integer(row.words[0], "number of the body", number, number)
    centre = rows.parse_integer(row.words[1], "point of the centre of mass", 1)
    mass = rows.parse_number(row.words[2], Dimension.MASS)
    a, b, c = rows.parse_numbers(row.words[3:], Dimension.INERTIA)
    return MechanismBody(centre, mass, (a, b, c), row.span), row


def _points(rows: RowReader, structure: Structure) -> list[Point]:
    """The points, of which nothing says how many there are.

    As printed, commas distinguish them from springs. In a table without commas they are the rows
    that the tables below leave.
    """
    points: list[Point] = []
    with_commas = rows.next_row is not None and rows.next_row.has_commas
    below = structure.springs + structure.joints
    while rows.next_row is not None and (
        rows.next_row.has_commas if with_commas else rows.remaining > below
    ):
        number = len(points) + 1
        row = rows.take_row(f"point of interest {number}", "point body x y z")
        rows.parse_integer(row.words[0], "number of the point", number, number)
        body = rows.parse_integer(row.words[1], "number of the body", 0, structure.bodies)
        x, y, z = rows.parse_numbers(row.words[2:], Dimension.LENGTH)
        points.append(Point(body, (x, y, z), row.span))
    return points


def _springs(rows: RowReader, count: int, kinds: list[JointType]) -> tuple[LinearSpring, ...]:
    springs: dict[tuple[int, int], LinearSpring] = {}
    for k in range(1, count + 1):
        row, before = rows.take_row(f"spring {k} of {count}", _SPRING_FORM), rows.diagnostic_count
        joint = rows.parse_integer(row.words[0], "number of the joint", 1, len(kinds))
        axes = kinds[joint - 1].axes
        axis = rows.parse_integer(row.words[4], "axis of the spring", axes[0], axes[-1])
        stiffness = rows.parse_number(row.words[1], Dimension.ANGULAR_STIFFNESS)
        damping = rows.parse_number(row.words[2], Dimension.ANGULAR_DAMPING)
        spring = LinearSpring(
            joint, axis, stiffness, damping, rows.parse_number(row.words[3]), row.span
        )
        if damping < 0.0:
            rows.diagnostics.error("damping is negative", row.words[2], "it would feed energy")
        is_right = rows.diagnostic_count == before
        if is_right and springs.setdefault((joint, axis), spring) is not spring:
            rows.diagnostics.error(f"a second spring of joint {joint}, axis {axis}", row.span)
    return tuple(springs.values())


def _start(
    rows: RowReader, number: int, kind: JointType
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    count = len(kind.axes)
    form = " ".join(["joint", *["angle"] * count, *["rate"] * count])
    row = rows.take_row(f"the initial conditions of joint {number}", form)
    rows.parse_integer(row.words[0], "number of the joint", number, number)
    values = rows.parse_numbers(row.words[1:])
    return values[:count], values[count:]


def _check_centres(
    bodies: list[tuple[MechanismBody, Row]], points: list[Point], rows: RowReader
) -> None:
    """The centre of mass of a body is a point of that body."""
    for k, (body, row) in enumerate(bodies, start=1):
        word = row.words[1]
        if body.centre > len(points):
            hint = f"there are {len(points)} points of interest"
            rows.diagnostics.error(f"there is no point {body.centre}", word, hint)
        elif points[body.centre - 1].body != k:
            other = points[body.centre - 1].body
            message = f"point {body.centre}, the centre of mass of body {k}, is on body {other}"
            rows.diagnostics.error(message, word)
