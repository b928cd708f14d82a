"""Springs in words and in data: each axis with its laws, in degrees as people read them."""

from collections.abc import Iterator
from math import degrees

from springs import AxisSpring, Cubic, Elastic, JointSprings, Linear, SpringSet, Stop

_AXES = {(1.0, 0.0, 0.0): "x", (0.0, 1.0, 0.0): "y", (0.0, 0.0, 1.0): "z"}


def axis_name(spring: AxisSpring) -> str:
    """`x`, `-x` or `(0.6, 0.8, 0)`: the axis of a spring in the joint's frame."""
    x, y, z = (part + 0.0 for part in spring.direction)
    if (x, y, z) in _AXES:
        return _AXES[x, y, z]
    if (-x, -y, -z) in _AXES:
        return f"-{_AXES[-x, -y, -z]}"
    return f"({x:g}, {y:g}, {z:g})"


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
    }


def spring_lines(joint: JointSprings) -> Iterator[str]:
    """A line for each law of each axis or slide of a joint, and one for where it is from."""
    for spring, slides in [(s, False) for s in joint.axes] + [(s, True) for s in joint.slides]:
        motion = f" ({spring.motion})" if spring.motion else ""
        yield f"{'along' if slides else 'about'} {axis_name(spring)}{motion}"
        for law in spring.elastic:
            yield f"  {_law_words(law, slides)}"
        damping = spring.damping
        if damping.viscous or damping.coulomb:
            force, rate = ("N", "N s/m") if slides else ("N m", "N m s/rad")
            yield f"  damping {damping.viscous:g} {rate}, friction {damping.coulomb:g} {force}"
        if spring.reference:
            yield f"  reference: {spring.reference}"


def _law_words(law: Elastic, slides: bool) -> str:
    unit = "N/m" if slides else "N m/rad"
    if isinstance(law, Cubic):
        c0, c1, c2, c3 = law.coefficients
        words = f"cubic {c0:g} {c1:+g} a {c2:+g} a^2 {c3:+g} a^3 N m, sense {law.sense:+d}"
        zone = "none" if law.dead_zone is None else _range(*law.dead_zone, slides)
        rest = f", rest {_shown(law.rest, slides)}" if law.rest else ""
        return f"{words}, dead zone {zone}{rest}"
    if isinstance(law, Linear):
        return f"linear {law.stiffness:g} {unit}, rest {_shown(law.rest, slides)}"
    if isinstance(law, Stop):
        return f"stops at {_range(law.lower, law.upper, slides)}, {law.stiffness:g} {unit}"
    return repr(law)


def _shown(value: float, slides: bool) -> str:
    return f"{100.0 * value:.4g} cm" if slides else f"{degrees(value):.4g} deg"


def _range(low: float | None, high: float | None, slides: bool) -> str:
    ends = ["-" if end is None else _shown(end, slides) for end in (low, high)]
    return " .. ".join(ends)


def _axis_data(spring: AxisSpring) -> dict[str, object]:
    return {
        "axis": axis_name(spring),
        "direction": list(spring.direction),
        "motion": spring.motion,
        "laws": [_law_data(law) for law in spring.elastic],
        "viscous": spring.damping.viscous,
        "coulomb": spring.damping.coulomb,
        "reference": spring.reference,
        "why": spring.why,
    }


def _law_data(law: Elastic) -> dict[str, object]:
    if isinstance(law, Cubic):
        zone = law.dead_zone
        return {
            "law": "cubic",
            "coefficients": list(law.coefficients),
            "sense": law.sense,
            "dead_zone_deg": None if zone is None else [degrees(edge) for edge in zone],
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
    return {"law": repr(law)}
