"""DYSPAM's file `ndyspamfile` (figure 3.2): a mechanism in six tables, in cgs.

1. body joint table: joint, body, body, type
2. joint triads: body and joint, then three rows of turn and position; two for each joint
3. masses: body, point of its centre of mass, mass, three principal moments of inertia
4. points of interest: point, body, and x,y,z with commas between
5. springs: joint, stiffness, damping, rest angle, axis
6. initial conditions: joint, angles, rates; of a spherical joint about z, y and x
"""

from collections.abc import Iterator
from contextlib import suppress

import numpy as np

from generator.diagnostics import Diagnostics, Source, Span
from generator.model_files.dyspam.mechanism import (
    Connection,
    JointType,
    LinearSpring,
    Mechanism,
    MechanismBody,
    Point,
    Row4,
    Triad,
)
from generator.model_files.dyspam.records import (
    BrokenTableError,
    Row,
    RowReader,
    Structure,
    format_number,
)
from generator.units import Dimension

MAX_TRIAD_ERROR = 0.02
"""A triad printed with two decimals, as figure 3.2's, has dot products as far from those of unit
axes at right angles; reading takes the nearest turn."""

_TRIAD_WARNING_ERROR = 1e-6
"""A triad that is nearer to a turn than this is taken for one without a word."""

_SPRING_FORM = "joint stiffness damping rest axis"

_KNOWN_JOINT_TYPES = " or ".join(f"{each.value} ({each.name.lower()})" for each in JointType)


def format_tables(mechanism: Mechanism) -> str:
    """The text of the file."""
    return "".join(f"{line}\n" for line in _lines(mechanism))


def parse_tables(
    source: Source, structure: Structure, diagnostics: Diagnostics
) -> Mechanism | None:
    """The mechanism of a text, as far as it can be told; faults go to `diagnostics`.

    Args:
        source: the text.
        structure: how many rows the tables have.
        diagnostics: for faults.
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
    found = [body for body, _ in bodies]
    return Mechanism(tuple(connections), tuple(found), tuple(points), springs)


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
        rows.diagnostics.error(f"{what} is no turn", span, hint)
        turns = np.eye(3)
    elif off > _TRIAD_WARNING_ERROR:
        rows.diagnostics.warning(f"{what} is not exactly a turn", span, "the nearest one is taken")
        left, _, right = np.linalg.svd(turns)
        turns = left @ right
    made: list[Row4] = []
    for row, offset in zip(turns.tolist(), position, strict=True):
        x, y, z = row
        made.append((x, y, z, offset))
    return made[0], made[1], made[2]


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

    As printed they are told from springs by their commas. In a table without commas they are what
    the tables below leave.
    """
    points: list[Point] = []
    with_commas = rows.next_row is not None and rows.next_row.has_commas
    below = structure.springs + structure.joints
    while rows.next_row is not None and (
        rows.next_row.has_commas if with_commas else rows.remaining > below
    ):
        points.append(_point(rows, len(points) + 1, structure.bodies))
    return points


def _point(rows: RowReader, number: int, bodies: int) -> Point:
    row = rows.take_row(f"point of interest {number}", "point body x y z")
    rows.parse_integer(row.words[0], "number of the point", number, number)
    body = rows.parse_integer(row.words[1], "number of the body", 0, bodies)
    x, y, z = rows.parse_numbers(row.words[2:], Dimension.LENGTH)
    return Point(body, (x, y, z), row.span)


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
        if (
            rows.diagnostic_count == before
            and springs.setdefault((joint, axis), spring) is not spring
        ):
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
            said = f"point {body.centre}, the centre of mass of body {k}, is on body {other}"
            rows.diagnostics.error(said, word)
