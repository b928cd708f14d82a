"""Springs of a figure as text and as JSON data."""

from collections.abc import Iterator
from math import exp

from generator.figure import Vector
from generator.springs_file.axes import axis_label
from generator.springs_file.laws import describe_law, format_range, law_data, range_in_degrees
from generator.units import ROTATION_UNITS, TRANSLATION_UNITS
from springs import AxisSpring, CoupledSpring, JointSprings, SpringSet
from springs.coupled import CoupledExponential, CoupledTerm
from springs.joint import UNKNOWN_AXIS


def coupled_law_lines(law: CoupledExponential) -> Iterator[str]:
    """Yield a line for each torque of a coupled law, and one on its range and its energy."""
    letters = _coordinate_symbols(law.coordinates)
    for i, name in enumerate(law.coordinates):
        terms = [_format_coupled_term(t, i, letters) for t in law.terms if t.amplitudes[i] != 0.0]
        yield f"{name}: {' '.join([f'{law.constants[i]:g}', *terms])} N m"
    angles = ", ".join(f"{a} {name}" for a, name in zip(letters, law.coordinates, strict=True))
    energy = "conservative" if law.is_conservative else "not conservative"
    known = [
        f"{name} {format_range(*one)}"
        for name, one in zip(law.coordinates, law.valid_ranges, strict=True)
        if one is not None
    ]
    valid = f"; known for {', '.join(known)}" if known else ""
    yield f"{angles} in rad; {energy}{valid}"


def coupled_law_data(law: CoupledExponential) -> dict[str, object]:
    """A law over several joints for `--json`; lists have an entry for each coordinate."""
    return {
        "coordinates": list(law.coordinates),
        "constants_Nm": list(law.constants),
        "terms": [
            {
                "amplitudes_Nm": list(term.amplitudes),
                "rates_1_rad": list(term.rates),
                "exponent": term.exponent,
            }
            for term in law.terms
        ],
        "measured_deg": [range_in_degrees(known) for known in law.valid_ranges],
        "conservative": law.is_conservative,
    }


def _format_coupled_term(term: CoupledTerm, i: int, letters: tuple[str, ...]) -> str:
    pairs = [(r, a) for r, a in zip(term.rates, letters, strict=True) if r != 0.0]
    words = " ".join(f"{r:{'+' if k else ''}.4g} {a}" for k, (r, a) in enumerate(pairs))
    return f"{term.amplitudes[i] * exp(term.exponent):+.4g} exp({words})"


def _coordinate_symbols(coordinates: tuple[str, ...]) -> tuple[str, ...]:
    """A short name for each angle: its first letter where these differ, else a1, a2, ..."""
    first = tuple(name[:1].lower() for name in coordinates)
    numbered = tuple(f"a{k}" for k in range(1, len(coordinates) + 1))
    return first if len(set(first)) == len(first) and all(map(str.isalpha, first)) else numbered


def axis_name(spring: AxisSpring) -> str:
    """`x`, `-x`, `(0.6, 0.8, 0)`: the axis of a spring in the joint's frame; or `its axis`."""
    return direction_name(spring.direction)


def direction_name(direction: Vector) -> str:
    """The same of an axis alone."""
    return "its axis" if direction == UNKNOWN_AXIS else axis_label(direction)


def coupled_axis_names(spring: CoupledSpring) -> tuple[str, ...]:
    """`left_knee -y` for each coordinate of a coupled law; the joint alone where that is all."""
    return tuple(
        axis.joint
        if axis.direction == UNKNOWN_AXIS
        else f"{axis.joint} {direction_name(axis.direction)}"
        for axis in spring.axes
    )


def springs_data(springs: SpringSet) -> dict[str, object]:
    """Return all springs for `--json`; angles in deg where the key says so, else rad and SI."""
    return {
        "origin": springs.origin,
        "law": springs.joining.value,
        "joints": {
            name: {
                "axes": [_axis_data(spring) for spring in joint.axes],
                "slides": [_axis_data(spring) for spring in joint.translations],
            }
            for name, joint in springs.joints.items()
        },
        "coupled": [_coupled_spring_data(spring) for spring in springs.coupled],
    }


def spring_lines(joint: JointSprings) -> Iterator[str]:
    """Yield a line for each law of each axis of a joint, and one for its reference."""
    for spring, units in [(s, ROTATION_UNITS) for s in joint.axes] + [
        (s, TRANSLATION_UNITS) for s in joint.translations
    ]:
        motion = f" ({spring.motion})" if spring.motion else ""
        yield f"{units.preposition} {axis_name(spring)}{motion}"
        for law in spring.elastic:
            yield f"  {describe_law(law, units)}"
        damping = spring.damping
        if damping.viscous or damping.coulomb:
            viscous = f"{damping.viscous:g} {units.damping}"
            yield f"  damping {viscous}, friction {damping.coulomb:g} {units.effort}"
        if spring.reference:
            yield f"  reference: {spring.reference}"


def coupled_spring_lines(spring: CoupledSpring) -> Iterator[str]:
    """Yield the joints of a coupled law, the law, and its reference."""
    pairs = zip(spring.law.coordinates, coupled_axis_names(spring), strict=True)
    yield ", ".join(f"{name} at {place}" for name, place in pairs)
    for line in coupled_law_lines(spring.law):
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


def _coupled_spring_data(spring: CoupledSpring) -> dict[str, object]:
    return {
        "axes": [
            {
                "joint": axis.joint,
                "axis": direction_name(axis.direction),
                "direction": list(axis.direction),
            }
            for axis in spring.axes
        ],
        **coupled_law_data(spring.law),
        "reference": spring.reference,
        "why": spring.why,
    }
