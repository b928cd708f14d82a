"""The axis of a joint to which a spring is bound, by name or number."""

from collections.abc import Iterable, Mapping
from itertools import compress
from math import hypot

from generator.diagnostics import Diagnostics, Span, shorten, spelling_hint
from generator.figure import Figure, Joint, Vector, is_rotation
from generator.rotations import PERPENDICULAR_TOLERANCE, unit_axis
from springs.axis import UNKNOWN_AXIS
from springs.joint import CoupledSpring

AXIS_NAMES = ("x", "y", "z")
"""Axes of the joint frame: the frame of the site after `connect`."""

SLIDE_PREFIX = "along "
"""Begin of the name of a translation's axis in a springs file: `along z`."""

SLIDE_NAMES = tuple(f"{SLIDE_PREFIX}{letter}" for letter in AXIS_NAMES)
"""Names of the translations of a joint in a springs file."""

ONLY_AXIS = "joint"
"""Name of the only axis of a joint in a file."""

REVOLUTE_AXIS_NUMBER = 3
"""Axis number of a revolute's spring in an `optional` file: the joint was made a z joint."""


class AxisError(ValueError):
    """The joint has no such axis; the hint says which it has."""

    def __init__(self, message: str, hint: str) -> None:
        """Keep message and hint apart: they are shown on two lines."""
        super().__init__(message)
        self.hint = hint


def rotation_axes(joint: Joint) -> tuple[Vector, ...]:
    """Unit axes of the rotations of a joint's chain, in its order."""
    return tuple(unit_axis(factor.axis) for factor in joint.chain if is_rotation(factor.kind))


def slide_axes(joint: Joint) -> tuple[Vector, ...]:
    """Unit axes of the translations of a joint's chain, in its order."""
    return tuple(unit_axis(factor.axis) for factor in joint.chain if not is_rotation(factor.kind))


def is_slide(name: str | None) -> bool:
    """Return whether an axis of a springs file is that of a translation."""
    return name in SLIDE_NAMES


def parallel_sign(direction: Vector, axis: Vector) -> int:
    """+1 or -1 where two unit vectors are parallel or opposite, 0 where they are neither."""
    (a, b, c), (x, y, z) = direction, axis
    if hypot(b * z - c * y, c * x - a * z, a * y - b * x) > PERPENDICULAR_TOLERANCE:
        return 0
    return 1 if a * x + b * y + c * z > 0.0 else -1


def axis_label(axis: Vector) -> str:
    """Return a unit axis as text: `x`, `-y`, or its components, such as `(0.6, 0.8, 0)`."""
    for letter in AXIS_NAMES:
        x, y, z = (float(letter == name) for name in AXIS_NAMES)
        sign = parallel_sign(axis, (x, y, z))
        if sign:
            return letter if sign > 0 else f"-{letter}"
    x, y, z = (part + 0.0 for part in axis)
    return f"({x:g}, {y:g}, {z:g})"


def axis_by_name(joint: Joint, name: str | None) -> Vector:
    """Return the axis of a spring's positive angle, in the joint's frame.

    It is the axis that the joint's chain declares, with its sign; a spherical joint whose chain
    does not use the named axis turns about its positive direction.

    Args:
        joint: the joint.
        name: "x", "y" or "z" of the joint frame, None for the only axis of the joint, or one of
            `SLIDE_NAMES` for a translation.

    Raises:
        AxisError: the joint does not turn about that axis, or slide along it.
    """
    if name in SLIDE_NAMES:
        return _slide_by_name(joint, name)
    turns, who = rotation_axes(joint), f"joint `{shorten(joint.name)}`"
    if not turns:
        raise AxisError(f"{who} does not turn", "only turning joints have such springs")
    if name is None:
        if len(turns) == 1:
            return turns[0]
        raise AxisError(f"{who} turns about {len(turns)} axes", "say which: x, y or z")
    x, y, z = (float(letter == name) for letter in AXIS_NAMES)
    declared = list(compress(turns, [parallel_sign((x, y, z), turn) for turn in turns]))
    if declared:
        return declared[0]
    if len(turns) == 3:
        return x, y, z
    raise AxisError(f"{who} does not turn about {name}", f"it turns about {_format_axes(turns)}")


def _slide_by_name(joint: Joint, name: str) -> Vector:
    """Return the axis of a translation in the sense that the chain declares. Raises AxisError."""
    slides, who = slide_axes(joint), f"joint `{shorten(joint.name)}`"
    x, y, z = (float(letter == name.removeprefix(SLIDE_PREFIX)) for letter in AXIS_NAMES)
    found = next((slide for slide in slides if parallel_sign((x, y, z), slide)), None)
    if found is None:
        hint = f"it slides along {_format_axes(slides)}" if slides else "it has no translation"
        raise AxisError(f"{who} does not slide {name}", hint)
    return found


def find_joint(
    figure: Figure, name: str, span: Span | None, diagnostics: Diagnostics
) -> Joint | None:
    """Return a joint of a figure; None with a fault noted."""
    joint = figure.joints.get(name)
    if joint is None:
        hint = spelling_hint(name, figure.joints)
        diagnostics.error(f"the figure has no joint `{shorten(name)}`", span, hint)
    return joint


def find_axis(
    figure: Figure | None,
    joint: str,
    name: str | None,
    diagnostics: Diagnostics,
    span: Span | None,
    axis_span: Span | None,
) -> Vector | None:
    """Return the axis of a spring's positive angle in the joint's frame; None with a fault noted.

    Without a figure, which axis is the only one is unknown, and others are taken as named.

    Args:
        figure: the figure; None if it is not known.
        joint: name of the joint.
        name: name of the axis, as for `axis_by_name`.
        diagnostics: diagnostics for faults.
        span: place of the joint's name.
        axis_span: place of the axis' name, if it is written.
    """
    if figure is None:
        letter = (name or "").removeprefix(SLIDE_PREFIX)
        x, y, z = (float(letter == each) for each in AXIS_NAMES)
        return (x, y, z) if letter else UNKNOWN_AXIS
    own = find_joint(figure, joint, span, diagnostics)
    if own is None:
        return None
    try:
        return axis_by_name(own, name)
    except AxisError as fault:
        diagnostics.error(str(fault), axis_span or span, fault.hint)
        return None


def axis_by_number(joint: Joint, number: int) -> Vector:
    """Return the axis of an axis number of an `optional` file.

    1, 2 and 3 are x, y and z of the joint frame; the only axis of a revolute is 3.
    """
    if len(rotation_axes(joint)) != 1:
        return axis_by_name(joint, AXIS_NAMES[number - 1])
    if number != REVOLUTE_AXIS_NUMBER:
        raise AxisError(
            f"joint `{shorten(joint.name)}` turns about one axis, and that has the number "
            f"{REVOLUTE_AXIS_NUMBER}",
            f"write {REVOLUTE_AXIS_NUMBER} instead of {number}",
        )
    return axis_by_name(joint, None)


def is_bounded(joint: Joint, direction: Vector) -> bool:
    """Return whether the joint's limits bound its range about an axis on both sides."""
    if joint.lower_limit is None or joint.upper_limit is None:
        return False
    return any(parallel_sign(direction, turn) for turn in rotation_axes(joint))


def _format_axes(axes: tuple[Vector, ...]) -> str:
    return " and ".join(f"({x:g}, {y:g}, {z:g})" for x, y, z in axes)


_BODY_PARTS: Mapping[str, str] = {
    **{part: part for part in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist", "neck")},
    "foot": "ankle",
    "arm": "shoulder",
    **dict.fromkeys(("waist", "lumbar", "trunk", "spine", "back"), "waist"),
}
"""Words of motions and of joints' names, and the joint that each means."""


def names_other_joint(motion: str, joint: str) -> bool:
    """Return whether a motion names another joint than the one it is bound to.

    False where either name does not contain a known joint.

    Args:
        motion: its name, such as "knee flexion".
        joint: name of a joint, such as "left_hip_joint".
    """
    moved, named = (
        _find_body_part(motion.lower().split()),
        _find_body_part(joint.lower().split("_")),
    )
    return moved is not None and named is not None and moved != named


def _find_body_part(words: Iterable[str]) -> str | None:
    return next((_BODY_PARTS[word] for word in words if word in _BODY_PARTS), None)


def axis_name(direction: Vector) -> str:
    """`x`, `-x`, `(0.6, 0.8, 0)`: the axis of a spring in the joint's frame; or `its axis`."""
    return "its axis" if direction == UNKNOWN_AXIS else axis_label(direction)


def coupled_axis_names(spring: CoupledSpring) -> tuple[str, ...]:
    """`left_knee -y` for each coordinate of a coupled law; the joint alone where that is all."""
    return tuple(
        axis.joint
        if axis.direction == UNKNOWN_AXIS
        else f"{axis.joint} {axis_name(axis.direction)}"
        for axis in spring.axes
    )
