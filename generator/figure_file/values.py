"""From written values to SI numbers, vectors, locations and chains."""

from collections.abc import Sequence
from math import hypot
from typing import assert_never

from generator.diagnostics import Diagnostics, Span, shorten, spelling_hint
from generator.figure import (
    AxisKind,
    ContactSphere,
    JointAxis,
    Location,
    Rotation,
    Translation,
    Vector,
)
from generator.figure_file.parser import Call, ItemList, Number, Product, String, Value, Word
from generator.units import (
    DIMENSION_POWERS,
    INPUT_BOUNDS,
    UNIT_EXAMPLES,
    Dimension,
    InputBound,
    UnitError,
    convert_to_si,
    default_unit_factor,
    parse_unit,
)

UNIT_AXIS_TOLERANCE = 1e-6
"""Largest difference from one that the length of a printed unit axis may have."""


def resolve_number(node: Value, dimension: Dimension, diagnostics: Diagnostics) -> float | None:
    """One number in SI; None, with an error reported, if `node` has another dimension."""
    if not isinstance(node, Number):
        _report_not_a_number(node, dimension, diagnostics)
        return None
    try:
        factor = default_unit_factor(dimension)
        if node.unit:
            unit = parse_unit(node.unit)
            if unit.powers != DIMENSION_POWERS[dimension]:
                raise UnitError(
                    f"`{shorten(node.unit)}` is not a unit of {dimension.value}",
                    f"units here: {UNIT_EXAMPLES[dimension]}",
                )
            factor = unit.factor
        return convert_to_si(node.text, factor)
    except UnitError as failure:
        diagnostics.error(str(failure), node.unit_span, failure.hint)
    except OverflowError:
        diagnostics.error(
            f"`{shorten(node.text)}` is too large", node.span, "a number must be finite"
        )
    return None


def resolve_numbers(
    node: Value, dimensions: Sequence[Dimension], what: str, diagnostics: Diagnostics
) -> tuple[float, ...] | None:
    """A list with one number for each of `dimensions`, in SI; None when something is wrong.

    A single number without brackets counts as a list of one.
    """
    items, span = _list_items(node)
    if len(items) != len(dimensions):
        diagnostics.error(f"{_format_count(len(items))} instead of {len(dimensions)}", span, what)
        return None
    read = [
        resolve_number(item, dim, diagnostics) for item, dim in zip(items, dimensions, strict=True)
    ]
    values = tuple(value for value in read if value is not None)
    if len(values) < len(read):
        return None
    _warn_unitless_angles(items, dimensions, values, span, diagnostics)
    return values


def resolve_vector(node: Value, dimension: Dimension, diagnostics: Diagnostics) -> Vector | None:
    """A list of three numbers."""
    what = "a vector has three components: `(x, y, z)`"
    read = resolve_numbers(node, [dimension] * 3, what, diagnostics)
    return None if read is None else (read[0], read[1], read[2])


def resolve_names(node: Value, diagnostics: Diagnostics) -> tuple[Word, ...]:
    """One name, or a list of names in brackets."""
    items, _ = _list_items(node)
    for item in items:
        if not isinstance(item, Word):
            diagnostics.error(
                "a name is expected here", item.span, "names are written without quotes"
            )
    return tuple(item for item in items if isinstance(item, Word))


def resolve_attribute_value(
    node: Value, diagnostics: Diagnostics
) -> tuple[float, ...] | str | None:
    """A field of an attribute: plain numbers, a name or a string."""
    if isinstance(node, Word | String):
        return node.text
    items, _ = _list_items(node)
    return resolve_numbers(node, [Dimension.NUMBER] * len(items), "", diagnostics)


def resolve_location(node: Value, diagnostics: Diagnostics) -> Location | None:
    """`xyz(...)` and `trans(...)`, joined by `*` in any number and order."""
    factors: list[Rotation | Translation | None] = []
    for factor in _factors(node):
        if not isinstance(factor, Call) or factor.name.text not in ("xyz", "trans"):
            _report_unknown_factor(
                factor, ("xyz", "trans"), "`xyz(a,b,c)` and `trans(x,y,z)`", diagnostics
            )
            factors.append(None)
        elif factor.name.text == "xyz":
            angles = resolve_vector(factor.arguments, Dimension.ANGLE, diagnostics)
            factors.append(angles and Rotation(angles))
        else:
            offset = resolve_vector(factor.arguments, Dimension.LENGTH, diagnostics)
            factors.append(offset and Translation(offset))
    read = tuple(factor for factor in factors if factor is not None)
    return Location(read) if len(read) == len(factors) else None


def resolve_spheres(
    node: Value, diagnostics: Diagnostics
) -> tuple[tuple[ContactSphere, Span], ...]:
    """One `sphere(x,y,z,radius)`, or a list of them, each with its place."""
    items, span = _list_items(node)
    if not items:
        diagnostics.error(
            "this list has no spheres", span, "without `contact` spheres are fitted to the psurf"
        )
    read = [(_resolve_sphere(item, diagnostics), item.span) for item in items]
    return tuple((sphere, place) for sphere, place in read if sphere is not None)


def _resolve_sphere(node: Value, diagnostics: Diagnostics) -> ContactSphere | None:
    form = "a sphere has a centre and a radius: `sphere(x,y,z,radius)`"
    if not isinstance(node, Call):
        diagnostics.error("a sphere is expected here", node.span, form)
        return None
    if node.name.text != "sphere":
        message = f"unknown shape `{shorten(node.name.text)}`"
        diagnostics.error(message, node.name.span, spelling_hint(node.name.text, ("sphere",)))
        return None
    numbers = resolve_numbers(node.arguments, [Dimension.LENGTH] * 4, form, diagnostics)
    if numbers is None:
        return None
    x, y, z, radius = numbers
    if radius <= 0.0:
        place = node.arguments.items[3].span
        diagnostics.error("this radius is not positive", place, form)
        return None
    return ContactSphere((x, y, z), radius)


_AXIS_LETTERS = tuple(kind.value for kind in AxisKind)


def resolve_chain(node: Value, diagnostics: Diagnostics) -> tuple[JointAxis, ...] | None:
    """`R(x,y,z)` and `T(x,y,z)`, joined by `*`."""
    factors: list[JointAxis | None] = []
    for factor in _factors(node):
        if not isinstance(factor, Call) or factor.name.text not in _AXIS_LETTERS:
            _report_unknown_factor(factor, _AXIS_LETTERS, "`R(x,y,z)` and `T(x,y,z)`", diagnostics)
            factors.append(None)
            continue
        axis = _resolve_axis(factor, diagnostics)
        factors.append(axis and JointAxis(AxisKind(factor.name.text), axis))
    read = tuple(factor for factor in factors if factor is not None)
    return read if len(read) == len(factors) else None


def displacement_bound(joint_axis: JointAxis) -> InputBound:
    """Bound of a displacement about or along `joint_axis`, or of its rate."""
    return INPUT_BOUNDS[axis_dimension(joint_axis.kind, Dimension.ANGLE, Dimension.LENGTH)]


def axis_dimension(kind: AxisKind, rotation: Dimension, translation: Dimension) -> Dimension:
    """The dimension of a quantity about or along a joint axis."""
    match kind:
        case AxisKind.ROTATION:
            return rotation
        case AxisKind.TRANSLATION:
            return translation
        case _:
            assert_never(kind)


def _resolve_axis(call: Call, diagnostics: Diagnostics) -> Vector | None:
    """The axis of one degree of freedom, as printed: of length one but for its rounding."""
    axis = resolve_vector(call.arguments, Dimension.NUMBER, diagnostics)
    if axis is None:
        return None
    length = hypot(*axis)
    if length == 0.0:
        diagnostics.error(
            "the zero vector is not an axis",
            call.arguments.span,
            "an axis has length one: `(0,0,1)`",
        )
        return None
    x, y, z = (component / length for component in axis)
    if abs(length - 1.0) > UNIT_AXIS_TOLERANCE:
        diagnostics.error(
            f"this axis has length {length:.7g} instead of 1",
            call.arguments.span,
            f"in this direction: `{call.name.text}({x:.9g},{y:.9g},{z:.9g})`",
        )
        return None
    return axis


def _factors(node: Value) -> Sequence[Value]:
    return node.factors if isinstance(node, Product) else (node,)


def _report_unknown_factor(
    node: Value, known: tuple[str, ...], expected: str, diagnostics: Diagnostics
) -> None:
    """Report an unknown factor of a location or a chain."""
    if isinstance(node, Call):
        near = spelling_hint(node.name.text, known)
        diagnostics.error(f"unknown factor `{shorten(node.name.text)}`", node.name.span, near)
    else:
        diagnostics.error("this is not a factor", node.span, f"factors here: {expected}")


def _list_items(node: Value) -> tuple[tuple[Value, ...], Span]:
    """The items of a list, or the value itself as a list of one."""
    return (node.items if isinstance(node, ItemList) else (node,)), node.span


def _format_count(count: int) -> str:
    return "1 value" if count == 1 else f"{count} values"


def _report_not_a_number(node: Value, dimension: Dimension, diagnostics: Diagnostics) -> None:
    """Report a value that is not a number."""
    hint = f"units here: {UNIT_EXAMPLES[dimension]}"
    if isinstance(node, Word) and node.text.lower() in ("nan", "inf", "infinity"):
        hint = "a number is finite and written in digits"
    elif isinstance(node, ItemList):
        hint = "one number without brackets"
    diagnostics.error(f"{dimension.value} is expected here", node.span, hint)


def _warn_unitless_angles(
    items: Sequence[Value],
    dimensions: Sequence[Dimension],
    values: Sequence[float],
    span: Span,
    diagnostics: Diagnostics,
) -> None:
    """One warning for a list in which an angle other than zero has no unit."""
    for item, dimension, value in zip(items, dimensions, values, strict=True):
        bare = isinstance(item, Number) and not item.unit
        if bare and dimension is Dimension.ANGLE and value != 0.0:
            diagnostics.warning(
                f"an angle without a unit is in radians: {value:g} is {value * 57.2957795:.4g} deg",
                span,
                "write `rad` or `deg` behind it",
            )
            return
