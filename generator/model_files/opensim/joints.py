"""The joints of an OpenSim model as freedoms, told in the joint's child frame."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from generator.diagnostics import Findings, nearest, shorten
from generator.figure import Vector
from generator.losses import Report
from generator.model_files.body_tree.tree import Freedom
from generator.model_files.opensim.functions import KINDS as FUNCTIONS
from generator.model_files.opensim.functions import Motion, motion_of
from generator.model_files.opensim.values import is_true, number_in
from generator.model_files.xml_read import Element, direction, numbers
from generator.rotations import Array, inverse_pose

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)

ROWS: Final[Mapping[str, tuple[tuple[int, str, Vector], ...]]] = {
    "WeldJoint": (),
    "PinJoint": ((0, "R", Z),),
    "SliderJoint": ((0, "T", X),),
    "UniversalJoint": ((0, "R", X), (1, "R", Y)),
    "GimbalJoint": ((0, "R", X), (1, "R", Y), (2, "R", Z)),
    "BallJoint": ((0, "R", X), (1, "R", Y), (2, "R", Z)),
    "PlanarJoint": ((1, "T", X), (2, "T", Y), (0, "R", Z)),
    "FreeJoint": (
        (3, "T", X),
        (4, "T", Y),
        (5, "T", Z),
        (0, "R", X),
        (1, "R", Y),
        (2, "R", Z),
    ),
}
"""By type: number of the coordinate, kind and axis of each freedom, from the parent outwards."""

CUSTOM = "CustomJoint"

_TRANSFORMS = (
    "translation1",
    "translation2",
    "translation3",
    "rotation1",
    "rotation2",
    "rotation3",
)
"""The axes of a CustomJoint from the parent outwards."""


@dataclass(frozen=True)
class CoordinateOf:
    """A coordinate of a joint: its name, default value [rad or m], and whether it is locked."""

    name: str
    default: float = 0.0
    locked: bool = False


@dataclass
class Row:
    """Freedoms and fixed displacements put together, from the parent outwards.

    Attributes:
        pose: of the child frame in the parent frame with all freedoms at zero, shape (4, 4).
        freedoms: told in the child frame.
    """

    pose: Array = field(default_factory=lambda: np.eye(4))
    freedoms: list[Freedom] = field(default_factory=list[Freedom])

    def hold(self, freedom: Freedom) -> None:
        """A fixed displacement: that of the freedom at its value."""
        fixed = freedom.pose
        self.pose = self.pose @ fixed
        self.freedoms = [one.seen_from(inverse_pose(fixed)) for one in self.freedoms]


def row_of(joint: Element, findings: Findings, report: Report) -> Row:
    """The freedoms of a joint."""
    name, row = joint.get("name") or joint.tag, Row()
    coordinates = _coordinates(joint, findings, report)
    if joint.tag == CUSTOM:
        _custom(joint, name, coordinates, row, findings, report)
        return row
    if joint.tag not in ROWS:
        findings.error(
            f"the joint type `{shorten(joint.tag)}` is not read",
            joint.span,
            nearest(joint.tag, [*ROWS, CUSTOM]),
        )
        return row
    for number, kind, axis in ROWS[joint.tag]:
        one = CoordinateOf(f"{name}_coord_{number}")
        if number < len(coordinates):
            one = coordinates[number]
        freedom = Freedom(one.name, "R" if kind == "R" else "T", axis, value=one.default)
        if one.locked:
            row.hold(freedom)
        else:
            row.freedoms.append(freedom)
    return row


def _coordinates(joint: Element, findings: Findings, report: Report) -> list[CoordinateOf]:
    """The coordinates of a joint; what a figure does not have of them is reported."""
    held = joint.first("coordinates")
    found: list[CoordinateOf] = []
    for k, element in enumerate(() if held is None else held.all("Coordinate")):
        name = element.get("name") or f"{joint.get('name')}_coord_{k}"
        default = number_in(element, "default_value", findings)
        locked = is_true(element, "locked")
        if locked:
            report.lose("locked coordinates, which are fixed at their default values", name)
        if is_true(element, "prescribed"):
            report.lose("motions that are prescribed", name)
        if number_in(element, "default_speed_value", findings):
            report.lose("default speeds, which `--velocity` can give", name)
        _tell_range(element, name, locked, findings, report)
        found.append(CoordinateOf(name, default, locked))
    return found


def _tell_range(
    element: Element, name: str, locked: bool, findings: Findings, report: Report
) -> None:
    held = element.first("range")
    bounds = None if held is None else numbers(held.text, findings, 2, infinite=True)
    if bounds is None or locked:
        return
    report.lose(
        "ranges of coordinates, which OpenSim's forward runs do not hold either",
        f"{name} {bounds[0]:.4g} .. {bounds[1]:.4g}",
    )


def _custom(
    joint: Element,
    name: str,
    coordinates: list[CoordinateOf],
    row: Row,
    findings: Findings,
    report: Report,
) -> None:
    """The row of a CustomJoint: straight functions of a coordinate move, all else is fixed."""
    known = {one.name: one for one in coordinates}
    moves = _moves(joint, known, findings)
    leading: dict[str, str] = {}
    # A coordinate turns an axis rather than it slides along one.
    for which in (*_TRANSFORMS[3:], *_TRANSFORMS[:3]):
        move = moves.get(which)
        if move is not None and move.coordinate is not None and move.motion.slope:
            leading.setdefault(move.coordinate.name, which)
    for which in _TRANSFORMS:
        move = moves.get(which)
        if move is None:
            continue
        freedom = Freedom("", "R" if which in _TRANSFORMS[3:] else "T", move.axis)
        freedom = replace(freedom, value=move.motion.value)
        one, slope = move.coordinate, move.motion.slope
        if one is not None and not one.locked and slope and leading[one.name] == which:
            _lead(row, freedom, one, slope)
            continue
        if one is not None and not one.locked and slope != 0.0:
            report.lose(
                "motions of a joint that follow a coordinate, fixed where its default has them",
                f"{name} {which} ({one.name})",
            )
        row.hold(freedom)
    for one in coordinates:
        if one.name not in leading and not one.locked:
            report.lose(
                "coordinates that move nothing in a straight way, which are fixed", one.name
            )


def _lead(row: Row, freedom: Freedom, one: CoordinateOf, slope: float) -> None:
    """The freedom that a coordinate moves by `slope` times its value, after a constant."""
    row.hold(replace(freedom, value=freedom.value - slope * one.default))
    x, y, z = (part if slope > 0.0 else -part for part in freedom.axis)
    size = abs(slope)
    row.freedoms.append(
        replace(freedom, name=one.name, axis=(x, y, z), value=size * one.default, scale=1.0 / size)
    )


@dataclass(frozen=True)
class _Move:
    """How the child moves along or about an axis."""

    axis: Vector
    coordinate: CoordinateOf | None
    motion: Motion


def _moves(
    joint: Element, known: Mapping[str, CoordinateOf], findings: Findings
) -> dict[str, _Move]:
    transform = next((e for e in joint.walk() if e.tag == "SpatialTransform"), None)
    if transform is None:
        findings.error("this joint has no `SpatialTransform`", joint.span)
        return {}
    moves: dict[str, _Move] = {}
    for axis in transform.all("TransformAxis"):
        which = axis.get("name") or ""
        if which not in _TRANSFORMS:
            findings.error(
                f"unknown axis `{shorten(which)}`", axis.place("name"), nearest(which, _TRANSFORMS)
            )
            continue
        move = _move(axis, known, findings)
        if move is not None:
            moves[which] = move
    return moves


def _move(axis: Element, known: Mapping[str, CoordinateOf], findings: Findings) -> _Move | None:
    held = axis.first("coordinates")
    names = [] if held is None else held.text.text.split()
    function = next((e for e in axis.walk() if e.tag in FUNCTIONS or _is_function(e)), None)
    if function is None:
        return None
    if len(names) > 1:
        findings.error(
            "an axis that several coordinates move is not read",
            axis.span if held is None else held.text.span,
        )
        return None
    one = None
    if names:
        one = known.get(names[0])
        if one is None and held is not None:
            findings.error(
                f"this joint has no coordinate `{shorten(names[0])}`",
                held.text.span,
                nearest(names[0], known),
            )
            return None
    motion = motion_of(function, 0.0 if one is None else one.default, findings)
    if motion is None:
        return None
    told = axis.first("axis")
    read = None if told is None else numbers(told.text, findings, 3)
    along = direction(read or X, axis.span if told is None else told.text.span, findings)
    return _Move(along, one, motion)


def _is_function(element: Element) -> bool:
    return element.tag.endswith(("Function", "Spline")) and element.tag != "function"
