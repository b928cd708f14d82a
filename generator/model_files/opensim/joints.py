"""The joints of an OpenSim model as degrees of freedom in the joint's child frame."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from generator.diagnostics import Diagnostics, ModelError, shorten, spelling_hint
from generator.figure import AxisKind, Vector
from generator.follower_curve import CurveKind, FollowerCurve
from generator.losses import Losses
from generator.model_files.body_tree.tree import DegreeOfFreedom
from generator.model_files.xml import XmlElement, parse_numbers, unit_direction
from generator.rotations import Array, inverse_pose


def child_numbers(
    element: XmlElement, name: str, default: tuple[float, ...], diagnostics: Diagnostics
) -> tuple[float, ...]:
    """Parse as many numbers as `default` has; `default` if they are missing or wrong."""
    child = element.find(name)
    read = None
    if child is not None and child.text.text:
        read = parse_numbers(child.text, diagnostics, len(default))
    return default if read is None else read


def child_number(element: XmlElement, name: str, diagnostics: Diagnostics) -> float:
    """Parse one number; zero if it is missing or wrong."""
    return child_numbers(element, name, (0.0,), diagnostics)[0]


def child_text(element: XmlElement, name: str) -> str:
    """Return the text of a child; empty without one."""
    child = element.find(name)
    return "" if child is None else child.text.text


def is_child_true(element: XmlElement, name: str) -> bool:
    """Return True if the text of a child is `true`."""
    return child_text(element, name).lower() == "true"


FUNCTION_TAGS = (
    "Constant",
    "LinearFunction",
    "MultiplierFunction",
    "PolynomialFunction",
    "PiecewiseLinearFunction",
    "NaturalCubicSpline",
    "SimmSpline",
)


@dataclass(frozen=True)
class AxisMotion:
    """The displacement along an axis as a function of its coordinate.

    Attributes:
        slope: slope of a straight line through the coordinate, None where the function is curved.
        value: value at the coordinate's default [rad or m].
    """

    slope: float | None
    value: float


def evaluate_function(
    function: XmlElement, coordinate: float, diagnostics: Diagnostics
) -> AxisMotion | None:
    """Evaluate a function at `coordinate`; None, with an error, for an unknown one."""
    match function.tag:
        case "Constant":
            value = _list(function, "value", diagnostics)
            return AxisMotion(0.0, value[0] if value else 0.0)
        case "LinearFunction":
            slope, first = (*_list(function, "coefficients", diagnostics), 0.0, 0.0)[:2]
            return AxisMotion(slope, slope * coordinate + first)
        case "MultiplierFunction":
            scale = (*_list(function, "scale", diagnostics), 1.0)[0]
            below = (one for one in function.walk() if one is not function)
            inner = next((one for one in below if one.tag in FUNCTION_TAGS), None)
            if inner is None:
                diagnostics.error("this function multiplies nothing", function.span)
                return None
            motion = evaluate_function(inner, coordinate, diagnostics)
            if motion is None:
                return None
            slope = None if motion.slope is None else scale * motion.slope
            return AxisMotion(slope, scale * motion.value)
        case "PolynomialFunction":
            coefficients = _list(function, "coefficients", diagnostics)
            straight = len(coefficients) <= 2 or not any(coefficients[:-2])
            slope = (0.0, *coefficients)[-2] if straight else None
            return AxisMotion(slope, float(np.polyval(coefficients or (0.0,), coordinate)))
        case "PiecewiseLinearFunction" | "NaturalCubicSpline" | "SimmSpline":
            return _evaluate_points(function, coordinate, diagnostics)
        case tag:
            diagnostics.error(
                f"the function `{tag}` is not read",
                function.span,
                f"known are {', '.join(FUNCTION_TAGS)}",
            )
            return None


def _evaluate_points(
    function: XmlElement, coordinate: float, diagnostics: Diagnostics
) -> AxisMotion | None:
    curve = _curve_of_points(function, diagnostics)
    if curve is None and not diagnostics.has_errors:
        x, y = (np.array(_list(function, word, diagnostics)) for word in ("x", "y"))
        place = int(np.clip(np.searchsorted(x, coordinate) - 1, 0, len(x) - 2))
        slope = (y[place + 1] - y[place]) / (x[place + 1] - x[place])
        return AxisMotion(None, float(y[place] + slope * (coordinate - x[place])))
    if curve is None:
        return None
    slope = curve.numbers[1] if curve.kind is CurveKind.POLYNOMIAL else None
    return AxisMotion(slope, float(curve.at(coordinate)))


def parse_curve(function: XmlElement, diagnostics: Diagnostics) -> FollowerCurve | None:
    """Parse a function of a coordinate; None for one whose slope jumps, or with an error."""
    match function.tag:
        case "Constant":
            numbers = _list(function, "value", diagnostics)[:1]
            return FollowerCurve(CurveKind.POLYNOMIAL, numbers or (0.0,))
        case "LinearFunction":
            slope, constant = (*_list(function, "coefficients", diagnostics), 0.0, 0.0)[:2]
            return FollowerCurve.line(slope, constant)
        case "PolynomialFunction":
            powers = _list(function, "coefficients", diagnostics)[::-1] or (0.0,)
            return _curve(function, CurveKind.POLYNOMIAL, powers, diagnostics)
        case "MultiplierFunction":
            below = (one for one in function.walk() if one is not function)
            inner = next((one for one in below if one.tag in FUNCTION_TAGS), None)
            curve = None if inner is None else parse_curve(inner, diagnostics)
            scale = (*_list(function, "scale", diagnostics), 1.0)[0]
            return None if curve is None else curve.scaled(scale)
        case "PiecewiseLinearFunction" | "NaturalCubicSpline" | "SimmSpline":
            return _curve_of_points(function, diagnostics)
        case _:
            return None


def _curve_of_points(function: XmlElement, diagnostics: Diagnostics) -> FollowerCurve | None:
    """Return the curve of points; a line where they are on one."""
    x, y = (np.array(_list(function, word, diagnostics)) for word in ("x", "y"))
    if len(x) != len(y) or len(x) < 2 or not bool(np.all(np.diff(x) > 0.0)):
        diagnostics.error(
            "the points of this function make no curve",
            function.span,
            "as many `y` as `x`, two at least, and `x` increasing",
        )
        return None
    slopes = np.diff(y) / np.diff(x)
    if np.ptp(slopes) < 1e-12 * max(1.0, float(np.abs(slopes).max())):
        return FollowerCurve.line(float(slopes[0]), float(y[0] - slopes[0] * x[0]))
    if function.tag == "PiecewiseLinearFunction":
        return None
    # The name of the other one was older; OpenSim 4 takes it for the same.
    points = tuple(np.stack([x, y], axis=1).ravel().tolist())
    return _curve(function, CurveKind.SIMM_SPLINE, points, diagnostics)


def _curve(
    function: XmlElement, kind: CurveKind, numbers: tuple[float, ...], diagnostics: Diagnostics
) -> FollowerCurve | None:
    try:
        return FollowerCurve(kind, numbers)
    except ModelError as failure:
        diagnostics.error(str(failure), function.span)
        return None


def _list(function: XmlElement, name: str, diagnostics: Diagnostics) -> tuple[float, ...]:
    element = function.find(name)
    if element is None:
        return ()
    return parse_numbers(element.text, diagnostics, 0, 100_000) or ()


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
        if is_line(inner):
            constant, slope = (*inner.numbers, 0.0)[:2]
            return (lead, curve.of_line(slope, constant)) if slope else None
        if is_line(curve):
            constant, slope = (*curve.numbers, 0.0)[:2]
            return lead, inner.scaled(slope, constant)
        return None


def is_line(curve: FollowerCurve) -> bool:
    """Return whether a curve is a straight line."""
    return curve.kind is CurveKind.POLYNOMIAL and not any(curve.numbers[2:])


def parse_joint(
    joint: XmlElement, diagnostics: Diagnostics, losses: Losses, followed: Followed
) -> DofChain:
    """Parse the degrees of freedom of a joint; those that follow others have curves."""
    name, row = joint.get("name") or joint.tag, DofChain()
    coordinates = _coordinates(joint, diagnostics, losses)
    if joint.tag == CUSTOM:
        _custom(joint, name, coordinates, row, diagnostics, losses, followed)
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
        freedom = DegreeOfFreedom(one.name, kind, axis, value=one.default, expected_range=one.range)
        follows = followed.resolve(one.name, FollowerCurve.line(1.0, 0.0))
        if one.locked:
            row.add_fixed(freedom)
        elif one.name in followed.coupled and follows is not None:
            row.dofs.append(replace(freedom, control=follows[0], curve=follows[1]))
        else:
            row.dofs.append(freedom)
    return row


def _coordinates(
    joint: XmlElement, diagnostics: Diagnostics, losses: Losses
) -> list[OsimCoordinate]:
    """The coordinates of a joint; what a figure does not have of them is reported."""
    listed = joint.find("coordinates")
    parsed: list[OsimCoordinate] = []
    for k, element in enumerate(() if listed is None else listed.find_all("Coordinate")):
        name = element.get("name") or f"{joint.get('name')}_coord_{k}"
        default = child_number(element, "default_value", diagnostics)
        locked = is_child_true(element, "locked")
        if locked:
            losses.add("locked coordinates are fixed at their default values", name)
        if is_child_true(element, "prescribed"):
            losses.add("prescribed motions", name)
        if child_number(element, "default_speed_value", diagnostics):
            losses.add("default speeds: use `--velocity`", name)
        bounds = _parse_range(element, name, locked, diagnostics, losses)
        parsed.append(OsimCoordinate(name, default, locked, bounds))
    return parsed


def _parse_range(
    element: XmlElement, name: str, locked: bool, diagnostics: Diagnostics, losses: Losses
) -> tuple[float, float] | None:
    """Return the range of a coordinate, which does not become a limit."""
    child = element.find("range")
    bounds = (
        None if child is None else parse_numbers(child.text, diagnostics, 2, allow_infinite=True)
    )
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
    joint: XmlElement,
    name: str,
    coordinates: list[OsimCoordinate],
    row: DofChain,
    diagnostics: Diagnostics,
    losses: Losses,
    followed: Followed,
) -> None:
    """The row of a CustomJoint: straight functions of a coordinate move, others follow it."""
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
        kind = R if which in _TRANSFORMS[3:] else T
        freedom = DegreeOfFreedom("", kind, move.axis, value=move.motion.value)
        one, slope = move.coordinate, move.motion.slope
        moves_it = one is not None and not one.locked and slope != 0.0
        follows = None
        if one is not None and moves_it and move.curve is not None:
            follows = followed.resolve(one.name, move.curve)
        if one is not None and moves_it and leading.get(one.name) == which:
            if one.name not in followed.coupled:
                _add_coordinate_dof(row, freedom, one, slope or 0.0)
                continue
            freedom = replace(freedom, name=one.name)
        if follows is not None:
            name_of_axis = freedom.name or f"{name}_{which}"
            lead, curve = follows
            row.dofs.append(replace(freedom, name=name_of_axis, control=lead, curve=curve))
            continue
        if one is not None and moves_it:
            losses.add(FIXED_CURVES, f"{name} {which} ({one.name})")
        row.add_fixed(freedom)
    for one in coordinates:
        if one.name not in (*leading, *followed.coupled) and not one.locked:
            losses.add("coordinates without an axis that follows them linearly are fixed", one.name)


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
    motion: AxisMotion
    curve: FollowerCurve | None


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
    listed = axis.find("coordinates")
    names = [] if listed is None else listed.text.text.split()
    function = next((e for e in axis.walk() if e.tag in FUNCTION_TAGS or _is_function(e)), None)
    if function is None:
        return None
    if len(names) > 1:
        diagnostics.error(
            "an axis that several coordinates move is not read",
            axis.span if listed is None else listed.text.span,
        )
        return None
    one = None
    if names:
        one = known.get(names[0])
        if one is None and listed is not None:
            diagnostics.error(
                f"this joint has no coordinate `{shorten(names[0])}`",
                listed.text.span,
                spelling_hint(names[0], known),
            )
            return None
    motion = evaluate_function(function, 0.0 if one is None else one.default, diagnostics)
    if motion is None:
        return None
    axis_element = axis.find("axis")
    read = None if axis_element is None else parse_numbers(axis_element.text, diagnostics, 3)
    along = unit_direction(
        read or X, axis.span if axis_element is None else axis_element.text.span, diagnostics
    )
    curve = None if diagnostics.has_errors else parse_curve(function, diagnostics)
    return _TransformAxis(along, one, motion, curve)


def _is_function(element: XmlElement) -> bool:
    return element.tag.endswith(("Function", "Spline")) and element.tag != "function"
