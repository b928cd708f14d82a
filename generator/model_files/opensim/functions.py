"""The functions by which an OpenSim joint moves along its axes."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline, PPoly

from generator.diagnostics import Diagnostics
from generator.model_files.xml_read import XmlElement, parse_numbers
from generator.rotations import Array

KINDS = (
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
    """How far an axis moves with its coordinate.

    Attributes:
        slope: of a straight line through the coordinate, None where the function is curved.
        value: at the coordinate's default [rad or m].
    """

    slope: float | None
    value: float


def evaluate_function(
    function: XmlElement, coordinate: float, diagnostics: Diagnostics
) -> AxisMotion | None:
    """What a function does at a coordinate's value `coordinate`; None, with the fault noted, if unknown."""
    match function.tag:
        case "Constant":
            value = _list(function, "value", diagnostics)
            return AxisMotion(0.0, value[0] if value else 0.0)
        case "LinearFunction":
            slope, first = (*_list(function, "coefficients", diagnostics), 0.0, 0.0)[:2]
            return AxisMotion(slope, slope * coordinate + first)
        case "MultiplierFunction":
            return _evaluate_multiplier(function, coordinate, diagnostics)
        case "PolynomialFunction":
            coefficients = _list(function, "coefficients", diagnostics)
            straight = len(coefficients) <= 2 or not any(coefficients[:-2])
            slope = (0.0, *coefficients)[-2] if straight else None
            return AxisMotion(slope, float(np.polyval(coefficients or (0.0,), coordinate)))
        case "PiecewiseLinearFunction" | "NaturalCubicSpline" | "SimmSpline":
            return _evaluate_points(function, coordinate, diagnostics)
        case tag:
            diagnostics.error(
                f"the function `{tag}` is not read", function.span, f"known are {', '.join(KINDS)}"
            )
            return None


def _evaluate_multiplier(
    function: XmlElement, coordinate: float, diagnostics: Diagnostics
) -> AxisMotion | None:
    scale = (*_list(function, "scale", diagnostics), 1.0)[0]
    inner = next((e for e in function.walk() if e is not function and e.tag in KINDS), None)
    if inner is None:
        diagnostics.error("this function multiplies nothing", function.span)
        return None
    held = evaluate_function(inner, coordinate, diagnostics)
    if held is None:
        return None
    return AxisMotion(None if held.slope is None else scale * held.slope, scale * held.value)


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
    bends = np.linalg.solve(matrix, aims)
    starts = slopes - steps * (2.0 * bends[:-1] + bends[1:]) / 6.0
    thirds = np.diff(bends) / steps
    return PPoly(np.stack([thirds / 6.0, bends[:-1] / 2.0, starts, y[:-1]]), x)


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
