"""Laws in words and in data, one by one, in degrees as people read them.

Springs in words and in data: each axis with its laws, and the laws over several joints.
"""

from collections.abc import Iterator
from math import degrees, exp

from generator.cli.answer import finite_or_none
from springs import AxisSpring, CoupledSpring, Cubic, Elastic, JointSprings, Linear, SpringSet, Stop
from springs.coupled import CoupledExponential, CoupledTerm
from springs.elastic import Range, valid_range
from springs.exponential import Exponential, ExponentialTerm
from springs.hysteresis import Hysteresis
from springs.interpolated import Interpolated
from springs.joint import UNKNOWN_AXIS
from springs.smooth_limit import SmoothLimit
from springs.transformed import Transformed


def format_law(law: Elastic, *, translational: bool = False) -> str:
    """One line on a law; `a` is the angle in rad.

    Args:
        law: of an axis, or of a slide.
        translational: whether its angle is a length [m].
    """
    unit = "N/m" if translational else "N m/rad"
    if isinstance(law, Cubic):
        c0, c1, c2, c3 = law.coefficients
        words = f"cubic {c0:g} {c1:+g} a {c2:+g} a^2 {c3:+g} a^3 N m, sense {law.sense:+d}"
        zone = "none" if law.dead_zone is None else _format_range(*law.dead_zone, translational)
        rest = f", rest {_format_displacement(law.rest, translational)}" if law.rest else ""
        return f"{words}, dead zone {zone}{rest}"
    if isinstance(law, Linear):
        return (
            f"linear {law.stiffness:g} {unit}, rest {_format_displacement(law.rest, translational)}"
        )
    if isinstance(law, Stop):
        return f"stops at {_format_range(law.lower, law.upper, translational)}, {law.stiffness:g} {unit}"
    if isinstance(law, Exponential):
        terms = " ".join(map(_format_term, law.terms))
        return f"exponentials {law.constant:g} {terms} N m{_format_measured_range(law.valid_range)}"
    if isinstance(law, Interpolated):
        (low, first), (high, last) = law.points[0], law.points[-1]
        ends = f"{first + 0.0:.4g} N m at {_format_displacement(low, translational)} to {last + 0.0:.4g} N m at"
        return f"curve through {len(law.points)} points, {ends} {_format_displacement(high, translational)}"
    if isinstance(law, SmoothLimit):
        below, above = law.lower_stiffness, law.upper_stiffness
        grown = f"fully grown {_format_displacement(law.transition, translational)} beyond"
        zone = _format_range(law.lower, law.upper, translational)
        return f"limits {zone}, {below:.4g} and {above:.4g} {unit}, {grown}{_format_measured_range(law.valid_range)}"
    if isinstance(law, Transformed):
        return f"{format_law(law.law, translational=translational)}{_format_transform(law, translational)}"
    if isinstance(law, Hysteresis):
        return _format_directional(law, translational)
    return repr(law)


def law_data(law: Elastic) -> dict[str, object]:
    """A law for `--json`; angles in deg where the key says so, else rad and SI."""
    if isinstance(law, Cubic):
        return {
            "law": "cubic",
            "coefficients": list(law.coefficients),
            "sense": law.sense,
            "dead_zone_deg": _range_in_degrees(law.dead_zone),
            "rest_deg": degrees(law.rest),
        }
    if isinstance(law, Linear):
        return {"law": "linear", "stiffness": law.stiffness, "rest": law.rest}
    if isinstance(law, Stop):
        return {
            "law": "stop",
            "lower": law.lower,
            "upper": law.upper,
            "stiffness": law.stiffness,
            "onset": law.onset,
        }
    if isinstance(law, Transformed):
        return {
            "law": "scaled",
            "of": law_data(law.law),
            "scale": law.scale,
            "offset_deg": degrees(law.offset),
            "constant_Nm": law.constant,
        }
    return {**_measured_law_data(law), "measured_deg": _range_in_degrees(valid_range(law))}


def _measured_law_data(law: Elastic) -> dict[str, object]:
    """A law that knows its range, without it."""
    if isinstance(law, Exponential):
        terms = [
            {"amplitude_Nm": t.amplitude, "rate_1_rad": t.rate, "centre_deg": degrees(t.centre)}
            for t in law.terms
        ]
        return {"law": "exponentials", "terms": terms, "constant_Nm": law.constant}
    if isinstance(law, Interpolated):
        points = [[degrees(angle), torque] for angle, torque in law.points]
        return {"law": "points", "points_deg_Nm": points}
    if isinstance(law, SmoothLimit):
        return {
            "law": "smooth limits",
            "limits_deg": [degrees(law.lower), degrees(law.upper)],
            "limit_stiffness_Nm_rad": [law.lower_stiffness, law.upper_stiffness],
            "transition_deg": degrees(law.transition),
        }
    if isinstance(law, Hysteresis):
        return {
            "law": "directional",
            "increasing": law_data(law.increasing),
            "decreasing": law_data(law.decreasing),
            "slip_rad_s": law.slip,
        }
    return {"law": repr(law)}


def coupled_law_lines(law: CoupledExponential) -> Iterator[str]:
    """A law over several joints: a line a torque, and one on its range and its energy."""
    letters = _coordinate_symbols(law.coordinates)
    for i, name in enumerate(law.coordinates):
        terms = [_format_coupled_term(t, i, letters) for t in law.terms if t.amplitudes[i] != 0.0]
        yield f"{name}: {' '.join([f'{law.constants[i]:g}', *terms])} N m"
    angles = ", ".join(f"{a} {name}" for a, name in zip(letters, law.coordinates, strict=True))
    energy = "conservative" if law.is_conservative else "not conservative"
    known = [
        f"{name} {_format_range(*one, False)}"
        for name, one in zip(law.coordinates, law.valid_ranges, strict=True)
        if one is not None
    ]
    held = f"; known for {', '.join(known)}" if known else ""
    yield f"{angles} in rad; {energy}{held}"


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
        "measured_deg": [_range_in_degrees(known) for known in law.valid_ranges],
        "conservative": law.is_conservative,
    }


def _format_term(term: ExponentialTerm) -> str:
    angle = f"(a {-degrees(term.centre):+.4g} deg)" if term.centre else "a"
    return f"{term.amplitude:+.4g} exp({term.rate:.4g} {angle})"


def _format_coupled_term(term: CoupledTerm, i: int, letters: tuple[str, ...]) -> str:
    pairs = [(r, a) for r, a in zip(term.rates, letters, strict=True) if r != 0.0]
    words = " ".join(f"{r:{'+' if k else ''}.4g} {a}" for k, (r, a) in enumerate(pairs))
    return f"{term.amplitudes[i] * exp(term.exponent):+.4g} exp({words})"


def _coordinate_symbols(coordinates: tuple[str, ...]) -> tuple[str, ...]:
    """A short name for each angle: its first letter where these differ, else a1, a2, ..."""
    first = tuple(name[:1].lower() for name in coordinates)
    numbered = tuple(f"a{k}" for k in range(1, len(coordinates) + 1))
    return first if len(set(first)) == len(first) and all(map(str.isalpha, first)) else numbered


def _format_directional(law: Hysteresis, translational: bool) -> str:
    """Two curves, or one with a hysteresis where they are the same at a distance."""
    up, down, slip = law.increasing, law.decreasing, f"slip {law.slip:g} rad/s"
    if isinstance(up, Transformed) and isinstance(down, Transformed) and up.law == down.law:
        plain = (up.scale, up.offset) == (down.scale, down.offset) == (1.0, 0.0)
        if plain and up.constant == -down.constant:
            width = f"hysteresis {2.0 * down.constant:.4g} N m"
            return f"{format_law(up.law, translational=translational)}, {width}, {slip}"
    growing, falling = (format_law(one, translational=translational) for one in (up, down))
    return f"growing angle: {growing}; falling angle: {falling}; {slip}"


def _format_transform(law: Transformed, translational: bool) -> str:
    """What is done to a law."""
    times = f", times {law.scale:g}" if law.scale != 1.0 else ""
    moved = f", moved by {_format_displacement(law.offset, translational)}" if law.offset else ""
    return f"{times}{moved}" + (f", {law.constant:+g} N m" if law.constant else "")


def _format_measured_range(measured: Range | None) -> str:
    return f", known for {_format_range(*measured, False)}" if measured is not None else ""


def _format_displacement(value: float, translational: bool) -> str:
    return f"{100.0 * value + 0.0:.4g} cm" if translational else f"{degrees(value) + 0.0:.4g} deg"


def _format_range(low: float | None, high: float | None, translational: bool) -> str:
    ends = ["-" if end is None else _format_displacement(end, translational) for end in (low, high)]
    return " .. ".join(ends)


def _range_in_degrees(interval: Range | None) -> list[float | None] | None:
    """The ends in degrees, None for one that is open."""
    return None if interval is None else [finite_or_none(degrees(end)) for end in interval]


Vector = tuple[float, float, float]

_AXIS_NAMES = {(1.0, 0.0, 0.0): "x", (0.0, 1.0, 0.0): "y", (0.0, 0.0, 1.0): "z"}


def axis_name(spring: AxisSpring) -> str:
    """`x`, `-x`, `(0.6, 0.8, 0)`: the axis of a spring in the joint's frame; or `its axis`."""
    return direction_name(spring.direction)


def direction_name(direction: Vector) -> str:
    """The same of an axis alone."""
    if direction == UNKNOWN_AXIS:
        return "its axis"
    x, y, z = (part + 0.0 for part in direction)
    if (x, y, z) in _AXIS_NAMES:
        return _AXIS_NAMES[x, y, z]
    if (-x, -y, -z) in _AXIS_NAMES:
        return f"-{_AXIS_NAMES[-x, -y, -z]}"
    return f"({x:g}, {y:g}, {z:g})"


def coupled_axis_names(spring: CoupledSpring) -> tuple[str, ...]:
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
                "slides": [_axis_data(spring) for spring in joint.translations],
            }
            for name, joint in springs.joints.items()
        },
        "coupled": [_coupled_spring_data(spring) for spring in springs.coupled],
    }


def spring_lines(joint: JointSprings) -> Iterator[str]:
    """A line for each law of each axis or slide of a joint, and one for where it is from."""
    for spring, slides in [(s, False) for s in joint.axes] + [
        (s, True) for s in joint.translations
    ]:
        motion = f" ({spring.motion})" if spring.motion else ""
        yield f"{'along' if slides else 'about'} {axis_name(spring)}{motion}"
        for law in spring.elastic:
            yield f"  {format_law(law, translational=slides)}"
        damping = spring.damping
        if damping.viscous or damping.coulomb:
            force, rate = ("N", "N s/m") if slides else ("N m", "N m s/rad")
            yield f"  damping {damping.viscous:g} {rate}, friction {damping.coulomb:g} {force}"
        if spring.reference:
            yield f"  reference: {spring.reference}"


def coupled_spring_lines(spring: CoupledSpring) -> Iterator[str]:
    """Where a coupled law is hung, the law, and where it is from."""
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
