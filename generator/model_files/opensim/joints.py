"""The joints of an OpenSim model as degrees of freedom in the joint's child frame."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from scipy.interpolate import CubicSpline, PPoly

from generator.diagnostics import Diagnostics, shorten, spelling_hint
from generator.figure import AxisKind, Vector
from generator.input_files.coordinates import CoordinateCurve
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
    x, y = (np.array(_list(function, word, diagnostics)) for word in ("x", "y"))
    if len(x) != len(y) or len(x) < 2 or not bool(np.all(np.diff(x) > 0.0)):
        diagnostics.error(
            "the points of this function make no curve",
            function.span,
            "as many `y` as `x`, two at least, and `x` increasing",
        )
        return None
    slopes = np.diff(y) / np.diff(x)
    straight = bool(np.ptp(slopes) < 1e-12 * max(1.0, float(np.abs(slopes).max())))
    if straight or function.tag == "PiecewiseLinearFunction":
        place = int(np.clip(np.searchsorted(x, coordinate) - 1, 0, len(slopes) - 1))
        value = float(y[place] + slopes[place] * (coordinate - x[place]))
    elif function.tag == "NaturalCubicSpline":
        value = _evaluate_extrapolated(x, coordinate, CubicSpline(x, y, bc_type="natural"))
    else:
        value = _evaluate_extrapolated(x, coordinate, _simm_spline(x, y))
    return AxisMotion(float(slopes[0]) if straight else None, value)


def _simm_spline(x: Array, y: Array) -> PPoly:
    """The cubic spline of SIMM (Forsythe, Malcolm & Moler 1977).

    Its third derivatives at the ends are those of the cubics through the first and the last four
    points.
    """
    count, steps = len(x), np.diff(x)
    slopes = np.diff(y) / steps
    matrix, aims = np.zeros((count, count)), np.zeros(count)
    for k in range(1, count - 1):
        matrix[k, k - 1 : k + 2] = steps[k - 1], 2.0 * (steps[k - 1] + steps[k]), steps[k]
        aims[k] = 6.0 * (slopes[k] - slopes[k - 1])
    for row, inner, step, points in (
        (0, 1, steps[0], slice(0, 4)),
        (-1, -2, steps[-1], slice(-4, None)),
    ):
        matrix[row, row], matrix[row, inner] = -1.0, 1.0
        if count > 3:
            third = 6.0 * _divided_difference(x[points], y[points])
            aims[row] = step * third if row == 0 else -step * third
    bends = np.linalg.solve(matrix, aims) if count > 2 else aims  # two points: a line
    starts = slopes - steps * (2.0 * bends[:-1] + bends[1:]) / 6.0
    thirds = np.diff(bends) / steps
    return PPoly(np.stack([thirds / 6.0, bends[:-1] / 2.0, starts, y[:-1]]), x)


def parse_curve(function: XmlElement, diagnostics: Diagnostics) -> CoordinateCurve | None:
    """Parse a function of a coordinate that `evaluate_function` has accepted; None if constant."""
    match function.tag:
        case "LinearFunction" | "PolynomialFunction":
            powers = np.array([_list(function, "coefficients", diagnostics)]).T
            return CoordinateCurve(PPoly(powers, [0.0, 1.0]), is_straight_beyond=False)
        case "MultiplierFunction":
            below = (one for one in function.walk() if one is not function)
            inner = next(one for one in below if one.tag in FUNCTION_TAGS)
            curve = parse_curve(inner, diagnostics)
            scale = (*_list(function, "scale", diagnostics), 1.0)[0]
            return None if curve is None else replace(curve, scale=scale * curve.scale)
        case "PiecewiseLinearFunction" | "NaturalCubicSpline" | "SimmSpline":
            x, y = (np.array(_list(function, word, diagnostics)) for word in ("x", "y"))
            if function.tag == "PiecewiseLinearFunction":
                pieces = PPoly(np.stack([np.diff(y) / np.diff(x), y[:-1]]), x)
            elif function.tag == "NaturalCubicSpline":
                pieces = CubicSpline(x, y, bc_type="natural")
            else:
                pieces = _simm_spline(x, y)
            return CoordinateCurve(pieces, is_straight_beyond=True)
        case _:
            return None


def _divided_difference(x: Array, y: Array) -> float:
    """The divided difference of all points."""
    values = y.copy()
    for width in range(1, len(x)):
        values = np.diff(values) / (x[width:] - x[:-width])
    return float(values[0])


def _evaluate_extrapolated(x: Array, coordinate: float, curve: PPoly) -> float:
    """The value of a spline, which goes straight on beyond its ends."""
    inside = float(np.clip(coordinate, x[0], x[-1]))
    return float(curve(inside) + curve(inside, 1) * (coordinate - inside))


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

FIXED_CURVES = "axes that follow a coordinate by a curve or a second time are fixed"
"""Loss of joints such as a knee that slides as it bends."""

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


def parse_joint(
    joint: XmlElement, diagnostics: Diagnostics, losses: Losses, *, curves: bool = False
) -> DofChain:
    """Parse the degrees of freedom of a joint.

    With `curves` axes that follow a coordinate are degrees of freedom as well.
    """
    name, row = joint.get("name") or joint.tag, DofChain()
    coordinates = _coordinates(joint, diagnostics, losses)
    if joint.tag == CUSTOM:
        _custom(joint, name, coordinates, row, diagnostics, losses, curves=curves)
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
        if one.locked:
            row.add_fixed(freedom)
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
    *,
    curves: bool,
) -> None:
    """The row of a CustomJoint: straight functions of a coordinate move, all else is fixed.

    With `curves` functions of a coordinate that moves are degrees of freedom that follow it.
    """
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
        if one is not None and not one.locked and slope and leading[one.name] == which:
            _add_coordinate_dof(row, freedom, one, slope)
            continue
        curve = move.curve if curves and one is not None and one.name in leading else None
        if one is not None and not one.locked and slope != 0.0 and curve is not None:
            name_of_axis = f"{name}_{which}"
            row.dofs.append(replace(freedom, name=name_of_axis, control=one.name, curve=curve))
            continue
        if one is not None and not one.locked and slope != 0.0:
            losses.add(FIXED_CURVES, f"{name} {which} ({one.name})")
        row.add_fixed(freedom)
    for one in coordinates:
        if one.name not in leading and not one.locked:
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
    curve: CoordinateCurve | None


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
