"""Springs in words and in data: each axis with its laws, and the laws over several joints."""

from collections.abc import Iterator

from generator.commands.law_words import (
    coupled_data,
    coupled_lines,
    law_data,
    law_words,
)
from springs import AxisSpring, CoupledSpring, JointSprings, SpringSet
from springs.joint import UNKNOWN_AXIS

Vector = tuple[float, float, float]

_AXES = {(1.0, 0.0, 0.0): "x", (0.0, 1.0, 0.0): "y", (0.0, 0.0, 1.0): "z"}


def axis_name(spring: AxisSpring) -> str:
    """`x`, `-x`, `(0.6, 0.8, 0)`: the axis of a spring in the joint's frame; or `its axis`."""
    return direction_name(spring.direction)


def direction_name(direction: Vector) -> str:
    """The same of an axis alone."""
    if direction == UNKNOWN_AXIS:
        return "its axis"
    x, y, z = (part + 0.0 for part in direction)
    if (x, y, z) in _AXES:
        return _AXES[x, y, z]
    if (-x, -y, -z) in _AXES:
        return f"-{_AXES[-x, -y, -z]}"
    return f"({x:g}, {y:g}, {z:g})"


def places_of(spring: CoupledSpring) -> tuple[str, ...]:
    """`left_knee -y` for each coordinate of a coupled law; the joint alone where that is all."""
    return tuple(
        axis.joint
        if axis.direction == UNKNOWN_AXIS
        else f"{axis.joint} {direction_name(axis.direction)}"
        for axis in spring.axes
    )


def springs_data(springs: SpringSet) -> dict[str, object]:
    """All springs for `--json`; angles in deg where the key says so, else rad and SI."""
    return {
        "origin": springs.origin,
        "law": springs.joining.value,
        "joints": {
            name: {
                "axes": [_axis_data(spring) for spring in joint.axes],
                "slides": [_axis_data(spring) for spring in joint.slides],
            }
            for name, joint in springs.joints.items()
        },
        "coupled": [_coupled_data(spring) for spring in springs.coupled],
    }


def spring_lines(joint: JointSprings) -> Iterator[str]:
    """A line for each law of each axis or slide of a joint, and one for where it is from."""
    for spring, slides in [(s, False) for s in joint.axes] + [(s, True) for s in joint.slides]:
        motion = f" ({spring.motion})" if spring.motion else ""
        yield f"{'along' if slides else 'about'} {axis_name(spring)}{motion}"
        for law in spring.elastic:
            yield f"  {law_words(law, slides=slides)}"
        damping = spring.damping
        if damping.viscous or damping.coulomb:
            force, rate = ("N", "N s/m") if slides else ("N m", "N m s/rad")
            yield f"  damping {damping.viscous:g} {rate}, friction {damping.coulomb:g} {force}"
        if spring.reference:
            yield f"  reference: {spring.reference}"


def coupled_spring_lines(spring: CoupledSpring) -> Iterator[str]:
    """Where a coupled law is hung, the law, and where it is from."""
    pairs = zip(spring.law.coordinates, places_of(spring), strict=True)
    yield ", ".join(f"{name} at {place}" for name, place in pairs)
    for line in coupled_lines(spring.law):
        yield f"  {line}"
    if spring.reference:
        yield f"  reference: {spring.reference}"


def _axis_data(spring: AxisSpring) -> dict[str, object]:
    return {
        "axis": axis_name(spring),
        "direction": list(spring.direction),
        "motion": spring.motion,
        "laws": [law_data(law) for law in spring.elastic],
        "viscous": spring.damping.viscous,
        "coulomb": spring.damping.coulomb,
        "reference": spring.reference,
        "why": spring.why,
    }


def _coupled_data(spring: CoupledSpring) -> dict[str, object]:
    return {
        "axes": [
            {
                "joint": axis.joint,
                "axis": direction_name(axis.direction),
                "direction": list(axis.direction),
            }
            for axis in spring.axes
        ],
        **coupled_data(spring.law),
        "reference": spring.reference,
        "why": spring.why,
    }
