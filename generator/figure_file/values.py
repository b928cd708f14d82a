"""From written values to SI numbers, vectors, locations and chains."""

from collections.abc import Sequence
from math import hypot

from generator.diagnostics import Findings, Span, nearest, shorten
from generator.figure import Factor, Location, Shift, Turn, Vector
from generator.figure_file.parser import Call, Items, Number, Product, Text, Value, Word
from generator.units import (
    BOUNDS,
    EXAMPLES,
    POWERS,
    Bound,
    Dimension,
    UnitError,
    bare_factor,
    converted,
    unit_named,
)

UNIT_AXIS = 1e-6
"""Largest difference from one that the length of a printed unit axis may have."""

ROUNDED_AXIS = 1e-12
"""Above this difference an axis is scaled to length one; below it is taken as it is."""


def number(node: Value, dimension: Dimension, findings: Findings) -> float | None:
    """One number in SI; None, with a fault noted, when `node` is none of this dimension."""
    if not isinstance(node, Number):
        _not_a_number(node, dimension, findings)
        return None
    try:
        factor = bare_factor(dimension)
        if node.unit:
            unit = unit_named(node.unit)
            if unit.powers != POWERS[dimension]:
                raise UnitError(
                    f"`{shorten(node.unit)}` is no unit of {dimension.value}",
                    f"units here: {EXAMPLES[dimension]}",
                )
            factor = unit.factor
        return converted(node.text, factor)
    except UnitError as fault:
        findings.error(str(fault), node.unit_span, fault.hint)
    except OverflowError:
        findings.error(f"`{shorten(node.text)}` is too large", node.span, "a number must be finite")
    return None


def numbers(
    node: Value, dimensions: Sequence[Dimension], what: str, findings: Findings
) -> tuple[float, ...] | None:
    """A list with one number for each of `dimensions`, in SI; None when something is wrong.

    A single number without brackets counts as a list of one.
    """
    items, span = _listed(node)
    if len(items) != len(dimensions):
        findings.error(f"{_count(len(items))} instead of {len(dimensions)}", span, what)
        return None
    read = [number(item, dim, findings) for item, dim in zip(items, dimensions, strict=True)]
    values = tuple(value for value in read if value is not None)
    if len(values) < len(read):
        return None
    _warn_of_bare_angles(items, dimensions, values, span, findings)
    return values


def vector(node: Value, dimension: Dimension, findings: Findings) -> Vector | None:
    """A list of three numbers."""
    what = "a vector has three components: `(x, y, z)`"
    read = numbers(node, [dimension] * 3, what, findings)
    return None if read is None else (read[0], read[1], read[2])


def words(node: Value, findings: Findings) -> tuple[Word, ...]:
    """One name, or a list of names in brackets."""
    items, _ = _listed(node)
    for item in items:
        if not isinstance(item, Word):
            findings.error("a name is expected here", item.span, "names stand without quotes")
    return tuple(item for item in items if isinstance(item, Word))


def free_value(node: Value, findings: Findings) -> tuple[float, ...] | str | None:
    """A field of an attribute: plain numbers, a name or a string."""
    if isinstance(node, Word | Text):
        return node.text
    items, _ = _listed(node)
    return numbers(node, [Dimension.NUMBER] * len(items), "", findings)


def location(node: Value, findings: Findings) -> Location | None:
    """`xyz(...)` and `trans(...)`, joined by `*` in any number and order."""
    factors: list[Turn | Shift | None] = []
    for factor in _factors(node):
        if not isinstance(factor, Call) or factor.name.text not in ("xyz", "trans"):
            _unknown_factor(factor, ("xyz", "trans"), "`xyz(a,b,c)` and `trans(x,y,z)`", findings)
            factors.append(None)
        elif factor.name.text == "xyz":
            angles = vector(factor.arguments, Dimension.ANGLE, findings)
            factors.append(angles and Turn(angles))
        else:
            offset = vector(factor.arguments, Dimension.LENGTH, findings)
            factors.append(offset and Shift(offset))
    read = tuple(factor for factor in factors if factor is not None)
    return Location(read) if len(read) == len(factors) else None


def chain(node: Value, findings: Findings) -> tuple[Factor, ...] | None:
    """`R(x,y,z)` and `T(x,y,z)`, joined by `*`."""
    factors: list[Factor | None] = []
    for factor in _factors(node):
        if not isinstance(factor, Call) or factor.name.text not in ("R", "T"):
            _unknown_factor(factor, ("R", "T"), "`R(x,y,z)` and `T(x,y,z)`", findings)
            factors.append(None)
            continue
        axis = _axis(factor, findings)
        kind = "R" if factor.name.text == "R" else "T"
        factors.append(axis and Factor(kind, axis))
    read = tuple(factor for factor in factors if factor is not None)
    return read if len(read) == len(factors) else None


def bound_of(factor: Factor) -> Bound:
    """How large a displacement about or along `factor`, or its rate, may be where one is given."""
    return BOUNDS[Dimension.ANGLE if factor.kind == "R" else Dimension.LENGTH]


def _axis(call: Call, findings: Findings) -> Vector | None:
    """The axis of one degree of freedom, of length one."""
    axis = vector(call.arguments, Dimension.NUMBER, findings)
    if axis is None:
        return None
    length = hypot(*axis)
    if length == 0.0:
        findings.error(
            "the zero vector is no axis", call.arguments.span, "an axis has length one: `(0,0,1)`"
        )
        return None
    x, y, z = (component / length for component in axis)
    if abs(length - 1.0) > UNIT_AXIS:
        findings.error(
            f"this axis has length {length:.7g} instead of 1",
            call.arguments.span,
            f"in this direction: `{call.name.text}({x:.9g},{y:.9g},{z:.9g})`",
        )
        return None
    return axis if abs(length - 1.0) <= ROUNDED_AXIS else (x, y, z)


def _factors(node: Value) -> Sequence[Value]:
    return node.factors if isinstance(node, Product) else (node,)


def _unknown_factor(node: Value, known: tuple[str, ...], expected: str, findings: Findings) -> None:
    """A factor of a location or a chain that is something else."""
    if isinstance(node, Call):
        near = nearest(node.name.text, known)
        findings.error(f"unknown factor `{shorten(node.name.text)}`", node.name.span, near)
    else:
        findings.error("this is no factor", node.span, f"factors here: {expected}")


def _listed(node: Value) -> tuple[tuple[Value, ...], Span]:
    """The items of a list, or the value itself as a list of one."""
    return (node.items if isinstance(node, Items) else (node,)), node.span


def _count(count: int) -> str:
    return "1 value" if count == 1 else f"{count} values"


def _not_a_number(node: Value, dimension: Dimension, findings: Findings) -> None:
    """Say that something else stands where a number belongs."""
    hint = f"units here: {EXAMPLES[dimension]}"
    if isinstance(node, Word) and node.text.lower() in ("nan", "inf", "infinity"):
        hint = "a number is finite and written in digits"
    elif isinstance(node, Items):
        hint = "one number without brackets"
    findings.error(f"{dimension.value} is expected here", node.span, hint)


def _warn_of_bare_angles(
    items: Sequence[Value],
    dimensions: Sequence[Dimension],
    values: Sequence[float],
    span: Span,
    findings: Findings,
) -> None:
    """One warning for a list in which an angle other than zero has no unit."""
    for item, dimension, value in zip(items, dimensions, values, strict=True):
        bare = isinstance(item, Number) and not item.unit
        if bare and dimension is Dimension.ANGLE and value != 0.0:
            findings.warning(
                f"an angle without a unit is in radians: {value:g} is {value * 57.2957795:.4g} deg",
                span,
                "write `rad` or `deg` behind it",
            )
            return
