"""The joints of an OpenSim model as freedoms, told in the joint's child frame."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from generator.diagnostics import Diagnostics, shorten, spelling_hint
from generator.figure import Vector
from generator.losses import LossReport
from generator.model_files.body_tree.tree import DegreeOfFreedom
from generator.model_files.opensim.functions import KINDS as FUNCTIONS
from generator.model_files.opensim.functions import AxisMotion, evaluate_function
from generator.model_files.opensim.values import child_number, is_child_true
from generator.model_files.xml_read import XmlElement, parse_numbers, unit_direction
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
class OsimCoordinate:
    """A coordinate of a joint: its name, default value [rad or m], and whether it is locked."""

    name: str
    default: float = 0.0
    locked: bool = False


@dataclass
class DofChain:
    """Freedoms and fixed displacements put together, from the parent outwards.

    Attributes:
        pose: of the child frame in the parent frame with all freedoms at zero, shape (4, 4).
        dofs: told in the child frame.
    """

    pose: Array = field(default_factory=lambda: np.eye(4))
    dofs: list[DegreeOfFreedom] = field(default_factory=list[DegreeOfFreedom])

    def add_fixed(self, dof: DegreeOfFreedom) -> None:
        """A fixed displacement: that of the freedom at its value."""
        fixed = dof.pose
        self.pose = self.pose @ fixed
        self.dofs = [one.in_frame(inverse_pose(fixed)) for one in self.dofs]


def parse_joint(joint: XmlElement, diagnostics: Diagnostics, report: LossReport) -> DofChain:
    """The freedoms of a joint."""
    name, row = joint.get("name") or joint.tag, DofChain()
    coordinates = _coordinates(joint, diagnostics, report)
    if joint.tag == CUSTOM:
        _custom(joint, name, coordinates, row, diagnostics, report)
        return row
    if joint.tag not in ROWS:
        diagnostics.error(
            f"the joint type `{shorten(joint.tag)}` is not read",
            joint.span,
            spelling_hint(joint.tag, [*ROWS, CUSTOM]),
        )
        return row
    for number, kind, axis in ROWS[joint.tag]:
        one = OsimCoordinate(f"{name}_coord_{number}")
        if number < len(coordinates):
            one = coordinates[number]
        freedom = DegreeOfFreedom(one.name, "R" if kind == "R" else "T", axis, value=one.default)
        if one.locked:
            row.add_fixed(freedom)
        else:
            row.dofs.append(freedom)
    return row


def _coordinates(
    joint: XmlElement, diagnostics: Diagnostics, report: LossReport
) -> list[OsimCoordinate]:
    """The coordinates of a joint; what a figure does not have of them is reported."""
    held = joint.find("coordinates")
    found: list[OsimCoordinate] = []
    for k, element in enumerate(() if held is None else held.find_all("Coordinate")):
        name = element.get("name") or f"{joint.get('name')}_coord_{k}"
        default = child_number(element, "default_value", diagnostics)
        locked = is_child_true(element, "locked")
        if locked:
            report.add("locked coordinates, which are fixed at their default values", name)
        if is_child_true(element, "prescribed"):
            report.add("motions that are prescribed", name)
        if child_number(element, "default_speed_value", diagnostics):
            report.add("default speeds, which `--velocity` can give", name)
        _add_range_loss(element, name, locked, diagnostics, report)
        found.append(OsimCoordinate(name, default, locked))
    return found


def _add_range_loss(
    element: XmlElement, name: str, locked: bool, diagnostics: Diagnostics, report: LossReport
) -> None:
    held = element.find("range")
    bounds = None if held is None else parse_numbers(held.text, diagnostics, 2, allow_infinite=True)
    if bounds is None or locked:
        return
    report.add(
        "ranges of coordinates, which OpenSim's forward runs do not hold either",
        f"{name} {bounds[0]:.4g} .. {bounds[1]:.4g}",
    )


def _custom(
    joint: XmlElement,
    name: str,
    coordinates: list[OsimCoordinate],
    row: DofChain,
    diagnostics: Diagnostics,
    report: LossReport,
) -> None:
    """The row of a CustomJoint: straight functions of a coordinate move, all else is fixed."""
    known = {one.name: one for one in coordinates}
    moves = _moves(joint, known, diagnostics)
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
        freedom = DegreeOfFreedom("", "R" if which in _TRANSFORMS[3:] else "T", move.axis)
        freedom = replace(freedom, value=move.motion.value)
        one, slope = move.coordinate, move.motion.slope
        if one is not None and not one.locked and slope and leading[one.name] == which:
            _add_coordinate_dof(row, freedom, one, slope)
            continue
        if one is not None and not one.locked and slope != 0.0:
            report.add(
                "motions of a joint that follow a coordinate, fixed where its default has them",
                f"{name} {which} ({one.name})",
            )
        row.add_fixed(freedom)
    for one in coordinates:
        if one.name not in leading and not one.locked:
            report.add("coordinates that move nothing in a straight way, which are fixed", one.name)


def _add_coordinate_dof(
    row: DofChain, dof: DegreeOfFreedom, coordinate: OsimCoordinate, slope: float
) -> None:
    """The freedom that a coordinate moves by `slope` times its value, after a constant."""
    row.add_fixed(replace(dof, value=dof.value - slope * coordinate.default))
    x, y, z = (part if slope > 0.0 else -part for part in dof.axis)
    size = abs(slope)
    row.dofs.append(
        replace(
            dof,
            name=coordinate.name,
            axis=(x, y, z),
            value=size * coordinate.default,
            scale=1.0 / size,
        )
    )


@dataclass(frozen=True)
class _TransformAxis:
    """How the child moves along or about an axis."""

    axis: Vector
    coordinate: OsimCoordinate | None
    motion: AxisMotion


def _moves(
    joint: XmlElement, known: Mapping[str, OsimCoordinate], diagnostics: Diagnostics
) -> dict[str, _TransformAxis]:
    transform = next((e for e in joint.walk() if e.tag == "SpatialTransform"), None)
    if transform is None:
        diagnostics.error("this joint has no `SpatialTransform`", joint.span)
        return {}
    moves: dict[str, _TransformAxis] = {}
    for axis in transform.find_all("TransformAxis"):
        which = axis.get("name") or ""
        if which not in _TRANSFORMS:
            diagnostics.error(
                f"unknown axis `{shorten(which)}`",
                axis.span_of("name"),
                spelling_hint(which, _TRANSFORMS),
            )
            continue
        move = _move(axis, known, diagnostics)
        if move is not None:
            moves[which] = move
    return moves


def _move(
    axis: XmlElement, known: Mapping[str, OsimCoordinate], diagnostics: Diagnostics
) -> _TransformAxis | None:
    held = axis.find("coordinates")
    names = [] if held is None else held.text.text.split()
    function = next((e for e in axis.walk() if e.tag in FUNCTIONS or _is_function(e)), None)
    if function is None:
        return None
    if len(names) > 1:
        diagnostics.error(
            "an axis that several coordinates move is not read",
            axis.span if held is None else held.text.span,
        )
        return None
    one = None
    if names:
        one = known.get(names[0])
        if one is None and held is not None:
            diagnostics.error(
                f"this joint has no coordinate `{shorten(names[0])}`",
                held.text.span,
                spelling_hint(names[0], known),
            )
            return None
    motion = evaluate_function(function, 0.0 if one is None else one.default, diagnostics)
    if motion is None:
        return None
    told = axis.find("axis")
    read = None if told is None else parse_numbers(told.text, diagnostics, 3)
    along = unit_direction(read or X, axis.span if told is None else told.text.span, diagnostics)
    return _TransformAxis(along, one, motion)


def _is_function(element: XmlElement) -> bool:
    return element.tag.endswith(("Function", "Spline")) and element.tag != "function"
