"""Surfaces of a person's segments, lofted through cross sections.

Sections have the girths, breadths and depths of the person's measures at their anatomical levels.
Between and beyond them, and where nothing is measured, they are estimates. Neighbours share the
section at their joint, and each ends beyond it in a round cap within the other, so that bent joints
stay closed. Limbs are symmetric about their sagittal plane: left and right share one surface.
"""

from collections.abc import Callable, Mapping
from math import pi

import numpy as np

from generator.geometry.surface import Array, Surface
from generator.person.body import Body
from generator.person.loft import Cap, Loft, Section, loft_surface, section_girth
from generator.person.measures import Sex

LIMB_SIDES, TRUNK_SIDES = 20, 28
"""Corners of each ring."""

UPWARD = np.eye(3)
"""Axes of a loft along z, forward x, in the frames of limbs and trunk."""

FOOT_AXES = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
"""Axes of a loft along the foot: its sections stand upright, with the instep in front."""

RELAXED_BICEPS, RELAXED_FOREARM = 0.93, 0.95
"""Girth of the relaxed arm relative to the flexed one that is measured; estimates."""


def body_surfaces(body: Body) -> Mapping[str, Surface]:
    """Return closed surfaces that point outward, in the segments' frames [m], by their names."""
    return {name: build(body) for name, build in _BUILDERS.items()}


def hip_height(body: Body) -> float:
    """Height of the hip centres above the soles [m]."""
    legs = body.segments["upper_leg"].length + body.segments["lower_leg"].length
    return body.ankle_height + legs


def _half_axis(girth: float, other: float) -> float:
    """Half axis of the ellipse of a girth and its other half axis, at least a third of that [m].

    Ramanujan's first approximation of the girth, solved by bisection.
    """
    low, high = other / 3.0, girth
    for _ in range(60):
        middle = 0.5 * (low + high)
        a, b = middle, other
        perimeter = pi * (3.0 * (a + b) - ((3.0 * a + b) * (a + 3.0 * b)) ** 0.5)
        low, high = (middle, high) if perimeter < girth else (low, middle)
    return 0.5 * (low + high)


def _exponent(girth: float, breadth: float, depth: float) -> float:
    """Exponent from 2 to 3.5 of the superellipse of a breadth and depth nearest to a girth."""
    low, high = 2.0, 3.5
    for _ in range(30):
        middle = 0.5 * (low + high)
        section = Section(0.0, breadth, depth / 2.0, depth / 2.0, 0.0, middle, middle)
        low, high = (middle, high) if section_girth(section) < girth else (low, middle)
    return 0.5 * (low + high)


def _ring(
    at: float, girth: float, flatness: float = 1.0, forward: float = 0.5, centre: float = 0.0
) -> Section:
    """Elliptic section of a girth.

    Args:
        at: position along the axis [m].
        girth: [m].
        flatness: depth over breadth.
        forward: part of the depth in front of the axis.
        centre: of the section, forward [m].
    """
    radius = girth / (2.0 * pi)
    half_breadth = radius * (2.0 / (1.0 + flatness**2)) ** 0.5
    depth = 2.0 * half_breadth * flatness
    middle = centre + (2.0 * forward - 1.0) * 0.5 * depth
    return Section(at, 2.0 * half_breadth, depth / 2.0, depth / 2.0, middle)


def _places(first: float, last: float, spacing: float) -> Array:
    """Evenly spaced positions from first to last, near a spacing [m]."""
    return np.linspace(first, last, max(2, round((last - first) / spacing) + 1))


def _trunk_sections(body: Body) -> tuple[Section, ...]:
    """Sections from the crotch to the neck, at heights above the hip centres."""
    measures, length = body.measures, body.measures.length
    stature, is_female = measures.stature, measures.sex is Sex.FEMALE
    waist = body.segments["lower_torso"].length
    thorax = waist + body.segments["middle_torso"].length
    neck = thorax + body.segments["upper_torso"].length
    shoulder = thorax + body.shoulder_height
    crotch = length("crotch_height") - length("trochanterion_height") - 0.003

    hip_breadth, buttock = length("hip_breadth"), length("buttock_depth")
    waist_breadth, waist_depth = length("waist_breadth"), length("waist_depth")
    chest_depth = length("chest_depth")
    hip_exponent = _exponent(length("buttock_circumference"), hip_breadth, buttock)
    waist_exponent = _exponent(length("waist_circumference"), waist_breadth, waist_depth)
    chest_girth = length("chest_circumference")
    full = 2.0 * _half_axis(chest_girth / 1.06, chest_depth / 2.0)
    chest_breadth = 0.5 * (length("chest_breadth") + full)
    slim = 0.90 if is_female else 0.97
    neck_radius = length("neck_circumference") / (2.0 * pi)
    spacing = body.shoulder_spacing

    def section(
        at: float, breadth: float, depth: float, forward: float, exponent: float
    ) -> Section:
        return Section(
            at, breadth, forward * depth, (1.0 - forward) * depth, 0.0, exponent, exponent
        )

    return (
        section(crotch, 0.30 * hip_breadth, 0.50 * buttock, 0.5, 2.0),
        section(0.55 * crotch, 0.58 * hip_breadth, 0.80 * buttock, 0.46, 2.2),
        section(0.0, 0.84 * hip_breadth, buttock, 0.45, hip_exponent),
        section(
            0.55 * waist,
            0.5 * (hip_breadth + waist_breadth),
            0.97 * (0.5 * buttock + 0.5 * waist_depth),
            0.48,
            0.5 * (hip_exponent + waist_exponent),
        ),
        section(waist, waist_breadth, waist_depth, 0.52, waist_exponent),
        section(
            waist + 0.5 * (thorax - waist),
            slim * 0.5 * (waist_breadth + chest_breadth),
            slim * 0.5 * (waist_depth + chest_depth),
            0.51,
            2.4,
        ),
        section(thorax + 0.006 * stature, chest_breadth, chest_depth, 0.5, 3.0),
        section(shoulder - 0.045 * stature, 1.04 * chest_breadth, 0.93 * chest_depth, 0.48, 2.6),
        section(shoulder, spacing + 0.012 * stature, 0.66 * chest_depth, 0.47, 2.2),
        section(shoulder + 0.0197 * stature, 0.88 * spacing, 0.52 * chest_depth, 0.44, 2.0),
        section(0.45 * shoulder + 0.55 * neck, 2.7 * neck_radius, 2.0 * neck_radius, 0.42, 2.0),
        section(neck, 1.9 * neck_radius, 1.7 * neck_radius, 0.4, 2.0),
    )


def _trunk_part(body: Body, name: str, low: float, high: float, caps: tuple[Cap, Cap]) -> Surface:
    """Surface of the trunk between two heights above the hip centres, in a frame at the lower."""
    origin = {"lower_torso": 0.0}.get(name, low)
    loft = Loft(_trunk_sections(body), _places(low, high, 0.022), TRUNK_SIDES, *caps)
    rings, poles = loft.outlines()
    shift = np.array([0.0, 0.0, origin])
    return loft_surface(rings - shift, poles - shift, UPWARD, name)


def _lower_torso(body: Body) -> Surface:
    low = _trunk_sections(body)[0].at
    waist = body.segments["lower_torso"].length
    depth = body.measures.length("waist_depth")
    return _trunk_part(body, "lower_torso", low, waist, (Cap(0.012), Cap(0.35 * depth)))


def _middle_torso(body: Body) -> Surface:
    waist = body.segments["lower_torso"].length
    thorax = waist + body.segments["middle_torso"].length
    below, above = body.measures.length("waist_depth"), body.measures.length("chest_depth")
    return _trunk_part(body, "middle_torso", waist, thorax, (Cap(0.35 * below), Cap(0.35 * above)))


def _upper_torso(body: Body) -> Surface:
    thorax = body.segments["lower_torso"].length + body.segments["middle_torso"].length
    neck = thorax + body.segments["upper_torso"].length
    below = body.measures.length("chest_depth")
    return _trunk_part(body, "upper_torso", thorax, neck, (Cap(0.35 * below), Cap(0.02)))


def _head(body: Body) -> Surface:
    """The head with the neck, whose front reaches below the joint at the last cervical vertebra."""
    length = body.measures.length
    top = body.segments["head"].length
    tragion, face = length("tragion_to_top_of_head"), length("menton_sellion_length")
    deep, broad = length("head_length"), length("head_breadth")
    radius = length("neck_circumference") / (2.0 * pi)
    sellion = top - 0.84 * tragion
    chin = sellion - face
    centre = 0.09 * deep

    def skull(at: float, breadth: float, front: float, back: float, n: float, m: float) -> Section:
        return Section(at, breadth * broad, front * deep, back * deep, centre, n, m)

    def neck(at: float, size: float, forward: float) -> Section:
        return Section(at, 2.0 * size * radius, size * radius, size * radius, forward)

    low = -0.25 * top
    sections = (
        neck(low, 1.12, 0.06 * deep),
        neck(0.45 * low, 1.03, 0.04 * deep),
        neck(min(-0.004, chin - 0.07 * face), 1.0, 0.04 * deep),
        skull(chin + 0.02 * face, 0.72, 0.40, 0.30, 2.0, 2.0),
        skull(chin + 0.16 * face, 0.78, 0.44, 0.36, 2.3, 2.0),
        skull(chin + 0.42 * face, 0.87, 0.46, 0.42, 2.2, 2.0),
        skull(top - tragion, 0.95, 0.47, 0.50, 2.1, 2.0),
        skull(sellion, 0.985, 0.475, 0.515, 2.1, 2.1),
        skull(top - 0.68 * tragion, 1.0, 0.48, 0.52, 2.2, 2.1),
    )
    loft = Loft(
        sections,
        _places(low, sections[-1].at, 0.013),
        TRUNK_SIDES,
        Cap(0.35 * radius),
        Cap(0.68 * tragion, 2.15, 6),
    )
    return loft_surface(*loft.outlines(), UPWARD, "head")


def _upper_arm(body: Body) -> Surface:
    measures, span = body.measures, body.segments["upper_arm"].length
    length = measures.length
    biceps = RELAXED_BICEPS * length("biceps_circumference_flexed")
    elbow = _elbow(body)
    deltoid = length("bideltoid_breadth") - body.shoulder_spacing
    sections = (
        Section(0.0, deltoid, 0.5 * deltoid, 0.5 * deltoid),
        _ring(0.28 * span, 1.06 * biceps, 1.08),
        _ring(0.55 * span, biceps, 1.1),
        _ring(0.82 * span, 0.5 * (biceps + elbow), 1.0),
        _ring(span, elbow, 1.0),
    )
    loft = Loft(
        sections,
        _places(0.0, span, 0.025),
        LIMB_SIDES,
        Cap(0.028 * measures.stature, 2.2),
        Cap(elbow / (2.0 * pi)),
    )
    return loft_surface(*loft.outlines(), UPWARD, "upper_arm")


def _elbow(body: Body) -> float:
    """Girth at the elbow [m]; an estimate."""
    return 0.92 * RELAXED_FOREARM * body.measures.length("forearm_circumference_flexed")


def _wrist(body: Body, at: float) -> Section:
    return _ring(at, body.measures.length("wrist_circumference"), 1.4)


def _lower_arm(body: Body) -> Surface:
    span = body.segments["lower_arm"].length
    forearm = RELAXED_FOREARM * body.measures.length("forearm_circumference_flexed")
    wrist = body.measures.length("wrist_circumference")
    elbow = _elbow(body)
    sections = (
        _ring(0.0, elbow, 1.0),
        _ring(0.2 * span, forearm, 1.08),
        _ring(0.5 * span, 0.55 * forearm + 0.45 * wrist, 1.15),
        _ring(0.82 * span, 0.12 * forearm + 0.88 * wrist, 1.3),
        _wrist(body, span),
    )
    loft = Loft(
        sections, _places(0.0, span, 0.025), LIMB_SIDES, Cap(elbow / (2.0 * pi)), Cap(0.12 * wrist)
    )
    return loft_surface(*loft.outlines(), UPWARD, "lower_arm")


def _hand(body: Body) -> Surface:
    """The hand, thumb forward beside the palm, fingers straight."""
    length, span = body.measures.length, body.segments["hand"].length
    broad, palm = length("hand_breadth"), length("palm_length") / length("hand_length")

    def section(at: float, thickness: float, front: float, back: float) -> Section:
        return Section(at * span, thickness * broad, front * broad, back * broad, 0.0, 2.4, 2.4)

    sections = (
        _wrist(body, 0.0),
        section(0.22, 0.40, 0.50, 0.42),
        section(0.70 * palm, 0.40, 0.72, 0.50),
        section(0.93 * palm, 0.32, 0.66, 0.50),
        section(1.12 * palm, 0.25, 0.47, 0.49),
        section(0.85, 0.20, 0.42, 0.44),
        section(0.93, 0.18, 0.36, 0.38),
    )
    loft = Loft(
        sections,
        _places(0.0, 0.93 * span, 0.013),
        LIMB_SIDES,
        Cap(0.1 * length("wrist_circumference")),
        Cap(0.07 * span, 2.0, 3),
    )
    return loft_surface(*loft.outlines(), UPWARD, "hand")


def _knee(body: Body) -> float:
    """Girth at the knee [m]; an estimate."""
    return 0.94 * body.measures.length("lower_thigh_circumference")


def _upper_leg(body: Body) -> Surface:
    """The thigh, which reaches to the pelvis's front spine as the segment of the tables does."""
    length, span = body.measures.length, body.segments["upper_leg"].length
    hip = length("hip_breadth") - body.hip_spacing
    thigh, low = length("thigh_circumference"), length("lower_thigh_circumference")
    fold = length("trochanterion_height") - length("crotch_height") + 0.003
    knee = _knee(body)
    depth = _half_axis(thigh, hip / 2.0)
    sections = (
        Section(0.0, hip, 0.9 * depth, 1.0 * depth, -0.05 * depth),
        Section(fold, 1.02 * hip, 0.98 * depth, 0.98 * depth, -0.05 * depth),
        _ring(0.5 * span, 0.6 * thigh + 0.4 * low, 1.08, 0.52),
        _ring(0.85 * span, low, 1.04, 0.52),
        _ring(span, knee, 1.02),
    )
    loft = Loft(
        sections,
        _places(0.0, span, 0.026),
        LIMB_SIDES,
        Cap(0.045 * body.measures.stature),
        Cap(knee / (2.0 * pi)),
    )
    return loft_surface(*loft.outlines(), UPWARD, "upper_leg")


def _lower_leg(body: Body) -> Surface:
    length, span = body.measures.length, body.segments["lower_leg"].length
    knee, calf, ankle = _knee(body), length("calf_circumference"), length("ankle_circumference")
    malleoli = length("bimalleolar_breadth")
    sections = (
        _ring(0.0, knee, 1.02),
        _ring(0.11 * span, 0.94 * calf, 1.04, 0.46),
        _ring(0.3 * span, calf, 1.06, 0.40),
        _ring(0.62 * span, 0.5 * (calf + ankle), 1.1, 0.45),
        _ring(0.87 * span, ankle, 1.2, 0.48),
        Section(span, malleoli, 0.6 * malleoli, 0.6 * malleoli),
    )
    loft = Loft(
        sections, _places(0.0, span, 0.026), LIMB_SIDES, Cap(knee / (2.0 * pi)), Cap(0.5 * malleoli)
    )
    return loft_surface(*loft.outlines(), UPWARD, "lower_leg")


def _foot(body: Body) -> Surface:
    """The foot, lofted from heel to toes; its sole is flat."""
    length, span = body.measures.length, body.segments["foot"].length
    heel, broad = length("heel_breadth"), length("foot_breadth")
    ball = length("ball_of_foot_length") / length("foot_length")
    ankle, behind = body.ankle_height, body.heel_distance
    malleoli = length("bimalleolar_breadth")
    at_ankle = behind / span

    def section(at: float, breadth: float, top: float, roundness: float = 2.0) -> Section:
        """Section whose height is `top`; lower parts are below its widest line."""
        widest = 0.35 * top
        return Section(
            at * span - behind, breadth, top - widest, widest * 1.06, widest - ankle, roundness, 5.0
        )

    sections = (
        section(0.12, 0.94 * heel, 0.85 * ankle),
        section(at_ankle, 1.0 * heel, ankle + 0.5 * malleoli),
        section(at_ankle + 0.13, 0.97 * heel, 1.18 * ankle),
        section(0.58, 0.90 * broad, 0.85 * ankle, 2.1),
        section(ball, broad, 0.58 * ankle, 2.3),
        section(0.88, 0.92 * broad, 0.40 * ankle, 2.5),
        section(0.95, 0.74 * broad, 0.34 * ankle, 2.5),
    )
    loft = Loft(
        sections,
        _places(sections[0].at, sections[-1].at, 0.015),
        LIMB_SIDES,
        Cap(0.12 * span, 2.4, 4, 0.4 * ankle - ankle),
        Cap(0.05 * span, 2.3, 3, 0.12 * ankle - ankle),
    )
    rings, poles = loft.outlines()
    rings[..., 0] = np.maximum(rings[..., 0], -ankle)
    return loft_surface(rings, poles, FOOT_AXES, "foot")


_BUILDERS: Mapping[str, Callable[[Body], Surface]] = {
    "lower_torso": _lower_torso,
    "middle_torso": _middle_torso,
    "upper_torso": _upper_torso,
    "head": _head,
    "upper_arm": _upper_arm,
    "lower_arm": _lower_arm,
    "hand": _hand,
    "upper_leg": _upper_leg,
    "lower_leg": _lower_leg,
    "foot": _foot,
}
