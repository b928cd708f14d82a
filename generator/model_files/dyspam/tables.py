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

from generator.diagnostics import Findings, Source, Span
from generator.model_files.dyspam.mechanism import (
    Body,
    Connection,
    JointType,
    LinearSpring,
    Mechanism,
    Point,
    Row4,
    Triad,
)
from generator.model_files.dyspam.records import BrokenTableError, Row, Rows, Structure, number_text
from generator.units import Dimension

PERPENDICULAR = 0.02
"""A triad printed with two decimals, as figure 3.2's, has dot products as far from those of unit
axes at right angles; reading takes the nearest turn."""

_EXACT = 1e-6
"""A triad that is nearer to a turn than this is taken for one without a word."""

_SPRING = "joint stiffness damping rest axis"

_TYPES = " or ".join(f"{each.value} ({each.name.lower()})" for each in JointType)


def tables_text(mechanism: Mechanism) -> str:
    """The text of the file."""
    return "".join(f"{line}\n" for line in _lines(mechanism))


def tables_in(source: Source, structure: Structure, findings: Findings) -> Mechanism | None:
    """The mechanism of a text, as far as it can be told; faults go to `findings`.

    Args:
        source: the text.
        structure: how many rows the tables have.
        findings: for faults.
    """
    with suppress(BrokenTableError):
        return _mechanism(Rows(source, findings), structure)
    return None


def _lines(mechanism: Mechanism) -> Iterator[str]:
    joints = list(enumerate(mechanism.connections, start=1))
    for k, joint in joints:
        yield f"{k} {joint.first} {joint.second} {joint.type.value}"
    for k, joint in joints:
        for body, triad in zip((joint.first, joint.second), joint.triads, strict=True):
            yield f"{body} {k}"
            for row in triad:
                turn = [number_text(value) for value in row[:3]]
                yield " ".join([*turn, number_text(row[3], Dimension.LENGTH)])
    for k, body in enumerate(mechanism.bodies, start=1):
        moments = [number_text(value, Dimension.INERTIA, 6) for value in body.inertia]
        mass = number_text(body.mass, Dimension.MASS, 6)
        yield f"{k} {body.centre} {mass} {' '.join(moments)}"
    for k, point in enumerate(mechanism.points, start=1):
        place = [number_text(value, Dimension.LENGTH) for value in point.position]
        yield f"{k} {point.body} {','.join(place)}"
    for spring in mechanism.springs:
        stiffness = number_text(spring.stiffness, Dimension.ANGULAR_STIFFNESS, 6)
        damping = number_text(spring.damping, Dimension.ANGULAR_DAMPING, 6)
        rest = number_text(spring.rest, decimals=6)
        yield f"{spring.joint} {stiffness} {damping} {rest} {spring.axis}"
    for k, joint in joints:
        angles = [number_text(angle, decimals=6) for angle in joint.angles]
        yield " ".join([str(k), *angles, *map(number_text, joint.rates)])


def _mechanism(rows: Rows, structure: Structure) -> Mechanism:
    """Read table by table: every row of a table has its own form, and so a lost one shows."""
    heads = [_head(rows, k, structure.bodies) for k in range(1, structure.joints + 1)]
    if rows.findings.has_errors:
        raise BrokenTableError  # the other tables have rows for these joints
    triads = [
        (_triad(rows, first, k), _triad(rows, second, k))
        for k, (first, second, _, _) in enumerate(heads, start=1)
    ]
    bodies = [_body(rows, k) for k in range(1, structure.bodies + 1)]
    before = rows.count
    points = _points(rows, structure)
    if rows.count == before:
        _check_centres(bodies, points, rows)
    springs = _springs(rows, structure.springs, [head[2] for head in heads])
    starts = [_start(rows, k, kind) for k, (_, _, kind, _) in enumerate(heads, start=1)]
    rows.finish("the initial conditions of the last joint")
    connections = [
        Connection(*head[:3], triad, *start, place=head[3])
        for head, triad, start in zip(heads, triads, starts, strict=True)
    ]
    found = [body for body, _ in bodies]
    return Mechanism(tuple(connections), tuple(found), tuple(points), springs)


def _head(rows: Rows, number: int, bodies: int) -> tuple[int, int, JointType, Span]:
    row = rows.take(f"joint {number} of the body joint table", "joint body body type")
    rows.whole(row.words[0], "number of the joint", number, number)
    first, second = (rows.whole(word, "number of the body", 0, bodies) for word in row.words[1:3])
    kind, known = rows.number(row.words[3]), {float(each.value): each for each in JointType}
    if kind not in known:
        rows.findings.error(
            f"the joint type `{row.words[3].text}` is not known",
            row.words[3],
            f"this program knows {_TYPES}",
        )
    return first, second, known.get(kind, JointType.SPHERICAL), row.span


def _triad(rows: Rows, body: int, joint: int) -> Triad:
    what = f"the triad of body {body} at joint {joint}"
    head = rows.take(what, "body joint")
    rows.whole(head.words[0], "number of the body", body, body)
    rows.whole(head.words[1], "number of the joint", joint, joint)
    lines = [rows.take(f"a row of {what}", "turn turn turn position") for _ in range(3)]
    turns = np.array([rows.numbers(line.words[:3]) for line in lines])
    position = [rows.number(line.words[3], Dimension.LENGTH) for line in lines]
    span = lines[0].span.to(lines[2].span)
    off = float(np.max(np.abs(turns @ turns.T - np.eye(3))))
    if rows.findings.has_errors:
        turns = np.eye(3)
    elif off > PERPENDICULAR or np.linalg.det(turns) < 0.0:
        hint = "its columns are unit axes at right angles, and right-handed"
        rows.findings.error(f"{what} is no turn", span, hint)
        turns = np.eye(3)
    elif off > _EXACT:
        rows.findings.warning(f"{what} is not exactly a turn", span, "the nearest one is taken")
        left, _, right = np.linalg.svd(turns)
        turns = left @ right
    made: list[Row4] = []
    for row, offset in zip(turns.tolist(), position, strict=True):
        x, y, z = row
        made.append((x, y, z, offset))
    return made[0], made[1], made[2]


def _body(rows: Rows, number: int) -> tuple[Body, Row]:
    row = rows.take(f"body {number} of the mass table", "body point mass inertia inertia inertia")
    rows.whole(row.words[0], "number of the body", number, number)
    centre = rows.whole(row.words[1], "point of the centre of mass", 1)
    mass = rows.number(row.words[2], Dimension.MASS)
    a, b, c = rows.numbers(row.words[3:], Dimension.INERTIA)
    return Body(centre, mass, (a, b, c), row.span), row


def _points(rows: Rows, structure: Structure) -> list[Point]:
    """The points, of which nothing says how many there are.

    As printed they are told from springs by their commas. In a table without commas they are what
    the tables below leave.
    """
    points: list[Point] = []
    with_commas = rows.ahead is not None and rows.ahead.has_commas
    below = structure.springs + structure.joints
    while rows.ahead is not None and (rows.ahead.has_commas if with_commas else rows.left > below):
        points.append(_point(rows, len(points) + 1, structure.bodies))
    return points


def _point(rows: Rows, number: int, bodies: int) -> Point:
    row = rows.take(f"point of interest {number}", "point body x y z")
    rows.whole(row.words[0], "number of the point", number, number)
    body = rows.whole(row.words[1], "number of the body", 0, bodies)
    x, y, z = rows.numbers(row.words[2:], Dimension.LENGTH)
    return Point(body, (x, y, z), row.span)


def _springs(rows: Rows, count: int, kinds: list[JointType]) -> tuple[LinearSpring, ...]:
    springs: dict[tuple[int, int], LinearSpring] = {}
    for k in range(1, count + 1):
        row, before = rows.take(f"spring {k} of {count}", _SPRING), rows.count
        joint = rows.whole(row.words[0], "number of the joint", 1, len(kinds))
        axes = kinds[joint - 1].axes
        axis = rows.whole(row.words[4], "axis of the spring", axes[0], axes[-1])
        stiffness = rows.number(row.words[1], Dimension.ANGULAR_STIFFNESS)
        damping = rows.number(row.words[2], Dimension.ANGULAR_DAMPING)
        spring = LinearSpring(joint, axis, stiffness, damping, rows.number(row.words[3]), row.span)
        if damping < 0.0:
            rows.findings.error("damping is negative", row.words[2], "it would feed energy")
        if rows.count == before and springs.setdefault((joint, axis), spring) is not spring:
            rows.findings.error(f"a second spring of joint {joint}, axis {axis}", row.span)
    return tuple(springs.values())


def _start(rows: Rows, number: int, kind: JointType) -> tuple[tuple[float, ...], tuple[float, ...]]:
    count = len(kind.axes)
    form = " ".join(["joint", *["angle"] * count, *["rate"] * count])
    row = rows.take(f"the initial conditions of joint {number}", form)
    rows.whole(row.words[0], "number of the joint", number, number)
    values = rows.numbers(row.words[1:])
    return values[:count], values[count:]


def _check_centres(bodies: list[tuple[Body, Row]], points: list[Point], rows: Rows) -> None:
    """The centre of mass of a body is a point of that body."""
    for k, (body, row) in enumerate(bodies, start=1):
        word = row.words[1]
        if body.centre > len(points):
            hint = f"there are {len(points)} points of interest"
            rows.findings.error(f"there is no point {body.centre}", word, hint)
        elif points[body.centre - 1].body != k:
            other = points[body.centre - 1].body
            said = f"point {body.centre}, the centre of mass of body {k}, is on body {other}"
            rows.findings.error(said, word)
