"""The joints of an OpenSim model as degrees of freedom in the joint's child frame."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple

import numpy as np

from generator.diagnostics import ModelError, shorten, spelling_hint
from generator.figure import AxisKind, Vector
from generator.follower_curve import CurveKind, FollowerCurve
from generator.losses import Losses
from generator.model_files.body_tree.tree import DegreeOfFreedom
from generator.model_files.xml import XmlElement
from generator.rotations import Array, inverse_pose

FUNCTION_TAGS = (
    "Constant",
    "LinearFunction",
    "MultiplierFunction",
    "PolynomialFunction",
    "PiecewiseLinearFunction",
    "NaturalCubicSpline",
    "SimmSpline",
)


class Polygon(NamedTuple):
    """A displacement as a function of another whose slope jumps at points [rad or m].

    Attributes:
        x: Arguments, increasing, shape (n,).
        y: Displacements, shape (n,).
    """

    x: Array
    y: Array

    def at(self, value: float) -> float:
        """Return the displacement at an argument; beyond the ends it goes straight on."""
        x, y = self
        place = int(np.clip(np.searchsorted(x, value) - 1, 0, len(x) - 2))
        slope = (y[place + 1] - y[place]) / (x[place + 1] - x[place])
        return float(y[place] + slope * (value - x[place]))

    def scaled(self, factor: float) -> "Polygon":
        """Return factor * curve."""
        return Polygon(self.x, factor * self.y)


def parse_curve(function: XmlElement) -> FollowerCurve | Polygon | None:
    """Parse a function of a coordinate; None, with an error, for an unknown or a wrong one."""
    match function.tag:
        case "Constant":
            numbers = _list(function, "value")[:1]
            return FollowerCurve(CurveKind.POLYNOMIAL, numbers or (0.0,))
        case "LinearFunction":
            slope, constant = (*_list(function, "coefficients"), 0.0, 0.0)[:2]
            return FollowerCurve.line(slope, constant)
        case "PolynomialFunction":
            powers = _list(function, "coefficients")[::-1] or (0.0,)
            return _curve(function, CurveKind.POLYNOMIAL, powers)
        case "MultiplierFunction":
            below = (one for one in function.walk() if one is not function)
            inner = next((one for one in below if one.tag in FUNCTION_TAGS), None)
            if inner is None:
                function.error("this function multiplies nothing")
                return None
            curve, scale = parse_curve(inner), (*_list(function, "scale"), 1.0)[0]
            return None if curve is None else curve.scaled(scale)
        case "PiecewiseLinearFunction" | "NaturalCubicSpline" | "SimmSpline":
            return _curve_of_points(function)
        case tag:
            hint = f"known are {', '.join(FUNCTION_TAGS)}"
            function.error(f"the function `{tag}` is not read", hint)
            return None


def _curve_of_points(function: XmlElement) -> FollowerCurve | Polygon | None:
    """Return the curve of points; a line where they are on one."""
    x, y = (np.array(_list(function, word)) for word in ("x", "y"))
    if len(x) != len(y) or len(x) < 2 or not bool(np.all(np.diff(x) > 0.0)):
        function.error(
            "the points of this function make no curve",
            "as many `y` as `x`, two at least, and `x` increasing",
        )
        return None
    slopes = np.diff(y) / np.diff(x)
    if np.ptp(slopes) < 1e-12 * max(1.0, float(np.abs(slopes).max())):
        return FollowerCurve.line(float(slopes[0]), float(y[0] - slopes[0] * x[0]))
    if function.tag == "PiecewiseLinearFunction":
        return Polygon(x, y)
    # The name of the other one was older; OpenSim 4 takes it for the same.
    points = tuple(np.stack([x, y], axis=1).ravel().tolist())
    return _curve(function, CurveKind.SIMM_SPLINE, points)


def _curve(
    function: XmlElement, kind: CurveKind, numbers: tuple[float, ...]
) -> FollowerCurve | None:
    try:
        return FollowerCurve(kind, numbers)
    except ModelError as failure:
        function.error(str(failure))
        return None


def _list(function: XmlElement, name: str) -> tuple[float, ...]:
    element = function.find(name)
    if element is None:
        return ()
    return element.text_numbers(0, 100_000) or ()


X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)

R, T = AxisKind.ROTATION, AxisKind.TRANSLATION

ROWS: Final[Mapping[str, tuple[tuple[int, AxisKind, Vector], ...]]] = {
    "WeldJoint": (),
    "PinJoint": ((0, R, Z),),
    "SliderJoint": ((0, T, X),),
    "UniversalJoint": ((0, R, X), (1, R, Y)),
    "GimbalJoint": ((0, R, X), (1, R, Y), (2, R, Z)),
    "BallJoint": ((0, R, X), (1, R, Y), (2, R, Z)),
    "PlanarJoint": ((1, T, X), (2, T, Y), (0, R, Z)),
    "FreeJoint": ((3, T, X), (4, T, Y), (5, T, Z), (0, R, X), (1, R, Y), (2, R, Z)),
}
"""By type: number of the coordinate, kind and axis of each freedom, from the parent outwards."""

BALLS: Final = ("BallJoint", "FreeJoint")
"""Types whose speeds are angular velocities about the parent's axes, not rates of coordinates."""

CUSTOM = "CustomJoint"

FIXED_CURVES = "axes that follow a coordinate that does not move, or a polygon, are fixed"
"""Loss of axes whose slope jumps, or whose coordinate no axis follows linearly."""

_TRANSFORMS = tuple(f"{word}{k}" for word in ("translation", "rotation") for k in (1, 2, 3))
"""The axes of a CustomJoint from the parent outwards."""


@dataclass(frozen=True)
class OsimCoordinate:
    """A coordinate of a joint.

    Attributes:
        name: its name.
        default: default value [rad or m].
        locked: whether it keeps this value.
        range: [rad or m], or None.
    """

    name: str
    default: float = 0.0
    locked: bool = False
    range: tuple[float, float] | None = None


@dataclass
class DofChain:
    """Degrees of freedom and fixed displacements, from the parent outwards.

    Attributes:
        pose: pose of the child frame in the parent frame with all freedoms at zero, shape (4, 4).
        dofs: dofs in the child frame.
    """

    pose: Array = field(default_factory=lambda: np.eye(4))
    dofs: list[DegreeOfFreedom] = field(default_factory=list[DegreeOfFreedom])

    def add_fixed(self, dof: DegreeOfFreedom) -> None:
        """A fixed displacement: that of the freedom at its value."""
        fixed = dof.pose
        self.pose = self.pose @ fixed
        self.dofs = [one.in_frame(inverse_pose(fixed)) for one in self.dofs]


@dataclass(frozen=True)
class Followed:
    """The coordinates of a model that axes may follow.

    Attributes:
        free: Names of those that move and follow nothing.
        coupled: What others follow by constraints, a free one and a curve.
    """

    free: frozenset[str] = frozenset()
    coupled: Mapping[str, tuple[str, FollowerCurve]] = field(
        default_factory=dict[str, tuple[str, FollowerCurve]]
    )

    def resolve(self, name: str, curve: FollowerCurve) -> tuple[str, FollowerCurve] | None:
        """Return the free coordinate and the curve of it of what follows a coordinate by a curve.

        None where there is no such one.
        """
        lead, inner = self.coupled.get(name, (name, FollowerCurve.line(1.0, 0.0)))
        if lead not in self.free:
            return None
        slope = line_slope(inner)
        if slope is not None:
            return (lead, curve.of_line(slope, inner.numbers[0])) if slope else None
        slope = line_slope(curve)
        return None if slope is None else (lead, inner.scaled(slope, curve.numbers[0]))


def line_slope(curve: FollowerCurve | Polygon) -> float | None:
    """Return the slope of a curve that is a straight line; None of another."""
    if isinstance(curve, Polygon) or curve.kind is not CurveKind.POLYNOMIAL:
        return None
    return None if any(curve.numbers[2:]) else (*curve.numbers, 0.0)[1]


def parse_joint(joint: XmlElement, losses: Losses, followed: Followed) -> DofChain:
    """Parse the degrees of freedom of a joint; those that follow others have curves."""
    row, coordinates = DofChain(), _coordinates(joint, losses)
    if joint.tag == CUSTOM:
        return _custom(joint, coordinates, losses, followed)
    if joint.tag not in ROWS:
        hint = spelling_hint(joint.tag, [*ROWS, CUSTOM])
        joint.error(f"the joint type `{shorten(joint.tag)}` is not read", hint)
        return row
    for number, kind, axis in ROWS[joint.tag]:
        one = OsimCoordinate(f"{joint.label}_coord_{number}")
        if number < len(coordinates):
            one = coordinates[number]
        freedom = DegreeOfFreedom(one.name, kind, axis, value=one.default, expected_range=one.range)
        follows = followed.resolve(one.name, FollowerCurve.line(1.0, 0.0))
        if one.locked:
            row.add_fixed(freedom)
        elif one.name in followed.coupled and follows is not None:
            row.dofs.append(replace(freedom, control=follows[0], curve=follows[1]))
        else:
            row.dofs.append(freedom)
    return row


def _coordinates(joint: XmlElement, losses: Losses) -> list[OsimCoordinate]:
    """The coordinates of a joint; what a figure does not have of them is reported."""
    listed = joint.find("coordinates")
    parsed: list[OsimCoordinate] = []
    for k, element in enumerate(() if listed is None else listed.find_all("Coordinate")):
        name = element.get("name") or f"{joint.get('name')}_coord_{k}"
        default = element.child_number("default_value")
        locked = element.is_child("locked", "true")
        if locked:
            losses.add("locked coordinates are fixed at their default values", name)
        if element.is_child("prescribed", "true"):
            losses.add("prescribed motions", name)
        if element.child_number("default_speed_value"):
            losses.add("default speeds: use `--velocity`", name)
        bounds = _parse_range(element, name, locked, losses)
        parsed.append(OsimCoordinate(name, default, locked, bounds))
    return parsed


def _parse_range(
    element: XmlElement, name: str, locked: bool, losses: Losses
) -> tuple[float, float] | None:
    """Return the range of a coordinate, which does not become a limit."""
    child = element.find("range")
    bounds = None if child is None else child.text_numbers(2, allow_infinite=True)
    if bounds is None or locked:
        return None
    low, high = bounds
    losses.add(
        "ranges of coordinates, which OpenSim's own simulations ignore",
        f"{name} {low:.4g} .. {high:.4g}",
    )
    is_informative = high - low > _NARROWEST_RANGE and max(-low, high) < _LARGEST_BOUND
    return (low, high) if is_informative else None


_NARROWEST_RANGE, _LARGEST_BOUND = 1e-3, 100.0
"""A narrower range, or one with a larger bound, says nothing about a motion [rad or m]."""


def _custom(
    joint: XmlElement, coordinates: list[OsimCoordinate], losses: Losses, followed: Followed
) -> DofChain:
    """Return the row of a CustomJoint: straight functions of a coordinate move, others follow."""
    moves, row = _moves(joint, {one.name: one for one in coordinates}), DofChain()
    leading: dict[str, str] = {}
    # A coordinate turns an axis rather than it slides along one.
    for which in (*_TRANSFORMS[3:], *_TRANSFORMS[:3]):
        move = moves.get(which)
        if move is not None and move.coordinate is not None and move.slope:
            leading.setdefault(move.coordinate.name, which)
    for which in _TRANSFORMS:
        move = moves.get(which)
        if move is None:
            continue
        one, name = move.coordinate, ""
        freedom = DegreeOfFreedom("", R if which in _TRANSFORMS[3:] else T, move.axis)
        freedom = replace(freedom, value=move.curve.at(0.0 if one is None else one.default))
        if one is None or one.locked or move.slope == 0.0:
            row.add_fixed(freedom)
            continue
        if leading.get(one.name) == which:
            if one.name not in followed.coupled:
                _add_coordinate_dof(row, freedom, one, move.slope or 0.0)
                continue
            name = one.name
        follows = None
        if isinstance(move.curve, FollowerCurve):
            follows = followed.resolve(one.name, move.curve)
        if follows is None:
            losses.add(FIXED_CURVES, f"{joint.label} {which} ({one.name})")
            row.add_fixed(replace(freedom, name=name))
        else:
            name = name or f"{joint.label}_{which}"
            row.dofs.append(replace(freedom, name=name, control=follows[0], curve=follows[1]))
    for one in coordinates:
        if one.name not in (*leading, *followed.coupled) and not one.locked:
            losses.add("coordinates without an axis that follows them linearly are fixed", one.name)
    return row


def _add_coordinate_dof(
    row: DofChain, dof: DegreeOfFreedom, coordinate: OsimCoordinate, slope: float
) -> None:
    """The freedom that a coordinate moves by `slope` times its value, after a constant."""
    row.add_fixed(replace(dof, value=dof.value - slope * coordinate.default))
    x, y, z = (part if slope > 0.0 else -part for part in dof.axis)
    size, ends = abs(slope), coordinate.range
    row.dofs.append(
        replace(
            dof,
            name=coordinate.name,
            axis=(x, y, z),
            value=size * coordinate.default,
            scale=1.0 / size,
            expected_range=None if ends is None else (size * ends[0], size * ends[1]),
        )
    )


@dataclass(frozen=True)
class _TransformAxis:
    """The motion of the child along or about an axis."""

    axis: Vector
    coordinate: OsimCoordinate | None
    curve: FollowerCurve | Polygon

    @property
    def slope(self) -> float | None:
        """Slope of a straight line through the coordinate; None where the function is curved."""
        return line_slope(self.curve)


def _moves(joint: XmlElement, known: Mapping[str, OsimCoordinate]) -> dict[str, _TransformAxis]:
    transform = next((e for e in joint.walk() if e.tag == "SpatialTransform"), None)
    if transform is None:
        joint.error("this joint has no `SpatialTransform`")
        return {}
    moves: dict[str, _TransformAxis] = {}
    for axis in transform.find_all("TransformAxis"):
        which = axis.get("name") or ""
        if which not in _TRANSFORMS:
            hint = spelling_hint(which, _TRANSFORMS)
            axis.error(f"unknown axis `{shorten(which)}`", hint, "name")
        elif (move := _move(axis, known)) is not None:
            moves[which] = move
    return moves


def _move(axis: XmlElement, known: Mapping[str, OsimCoordinate]) -> _TransformAxis | None:
    listed, one = axis.find("coordinates") or axis, None
    names = [] if listed is axis else listed.text.text.split()
    function = next((e for e in axis.walk() if e.tag in FUNCTION_TAGS or _is_function(e)), None)
    if function is None:
        return None
    if len(names) > 1:
        listed.error("an axis that several coordinates move is not read", at=listed.text.span)
        return None
    if names:
        one = known.get(names[0])
        if one is None:
            message = f"this joint has no coordinate `{shorten(names[0])}`"
            listed.error(message, spelling_hint(names[0], known), listed.text.span)
            return None
    curve = parse_curve(function)
    if curve is None:
        return None
    along = axis.find("axis")
    direction = X
    if along is not None:
        direction = along.direction(along.text_numbers(3) or X, along.text.span)
    return _TransformAxis(direction, one, curve)


def _is_function(element: XmlElement) -> bool:
    return element.tag.endswith(("Function", "Spline")) and element.tag != "function"
