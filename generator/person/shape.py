"""Surfaces of a person's segments, lofted through cross sections.

Sections have the girths, breadths and depths of the person's measures at their anatomical levels.
Between and beyond them, and where nothing is measured, they are estimates. Neighbours share the
section at their joint, and each ends beyond it in a round cap within the other, so that bent joints
stay closed. Limbs are symmetric about their sagittal plane: left and right share one surface.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from math import pi
from typing import NamedTuple

import numpy as np

from generator.figure import ContactSphere
from generator.geometry.surface import Surface
from generator.person.body import Body
from generator.person.loft import (
    DECIMALS,
    Cap,
    Loft,
    Relief,
    Section,
    loft_surface,
    ring_places,
    section_girth,
)
from generator.person.sources import Origin, SourcedNumber
from generator.person.survey import Sex
from springs.published.reference import Reference, Sureness

LIMB_SIDES, TRUNK_SIDES, HEAD_SIDES = 20, 32, 30
"""Corners of each ring."""

UPWARD = np.eye(3)
"""Axes of a loft along z, forward x, in the frames of limbs and trunk."""

FOOT_AXES = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
"""Axes of a loft along the foot: its sections stand upright, with the instep in front."""

RELAXED_BICEPS, RELAXED_FOREARM = 0.93, 0.95
"""Girth of the relaxed arm over the flexed one that is measured; estimates."""

ELBOW_OVER_FOREARM, KNEE_OVER_LOWER_THIGH = 0.92, 0.94
"""Girths of elbow and knee over those of the relaxed forearm and the lower thigh; estimates."""

SLIMMEST_OVER_MEAN = {Sex.MALE: 0.97, Sex.FEMALE: 0.88}
"""Breadth and depth between navel and chest over the means of those there; estimates."""

ACROMION_ABOVE_SHOULDER, ACROMION_OUTSIDE_SHOULDER = 0.0197, 0.010
"""Acromion relative to the shoulder centre, over the stature; the second is an estimate."""

MIN_HIP_BREADTH_OVER_SPACING = 1.25
"""Breadth of the hips over the distance of the hip centres, so that these stay within the trunk of
tall people who weigh very little; an estimate."""

SPINE_ABOVE_HIP = 0.050
"""Upper end of the thigh above the hip centre, over the stature: the pelvis's front spine, where
the published tables divide thigh and trunk."""

CHEST_EXPONENT = 2.8
"""Exponent of the chest's section; an estimate."""

NECK_BALL = 0.92
"""Radius of the neck's lower end, a ball about its joint, over that of the neck; an estimate."""


def body_surfaces(body: Body) -> Mapping[str, Surface]:
    """Return closed surfaces that point outward, in the segments' frames [m], by their names."""
    surfaces = (*_trunk(body), _head(body), *_arm(body), *_leg(body), _foot(body))
    return {surface.name: surface for surface in surfaces}


def _number_of_girth(
    girth_of: Callable[[float], float], girth: float, low: float, high: float
) -> float:
    """Return the number from `low` to `high` at which an increasing girth has a value [m]."""
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if girth_of(middle) < girth else (low, middle)
    return 0.5 * (low + high)


def _half_axis(girth: float, other: float) -> float:
    """Half axis of the ellipse of a girth and its other half axis, at least a third of that [m]."""

    def ramanujan(half: float) -> float:
        product = (3.0 * half + other) * (half + 3.0 * other)
        return pi * (3.0 * (half + other) - product**0.5)

    return _number_of_girth(ramanujan, girth, other / 3.0, girth)


def _superellipse_girth(breadth: float, depth: float, exponent: float) -> float:
    half = depth / 2.0
    return section_girth(Section(0.0, breadth, half, half, 0.0, exponent, exponent))


def _exponent(girth: float, breadth: float, depth: float) -> float:
    """Exponent from 2 to 3.5 of the superellipse of a breadth and depth nearest to a girth."""
    return _number_of_girth(lambda n: _superellipse_girth(breadth, depth, n), girth, 2.0, 3.5)


def _ring(at: float, girth: float, flatness: float = 1.0, forward: float = 0.0) -> Section:
    """Elliptic section of a girth.

    Args:
        at: position along the axis [m].
        girth: [m].
        flatness: depth over breadth.
        forward: forward of its middle, over half of its depth.
    """
    half_breadth = girth / (2.0 * pi) * (2.0 / (1.0 + flatness**2)) ** 0.5
    half_depth = half_breadth * flatness
    section = Section(at, 2.0 * half_breadth, half_depth, half_depth, forward * half_depth)
    factor = girth / section_girth(section)
    return replace(
        section,
        breadth=factor * section.breadth,
        front=factor * section.front,
        back=factor * section.back,
    )


def _trunk_sections(body: Body) -> tuple[Section, ...]:
    """Sections from the crotch to the neck, at heights above the hip centres."""
    measures, length = body.measures, body.measures.length
    stature, is_female = measures.stature, measures.sex is Sex.FEMALE
    waist = body.segments["lower_torso"].length
    thorax = waist + body.segments["middle_torso"].length
    neck = thorax + body.segments["upper_torso"].length
    shoulder = thorax + body.shoulder_height
    crotch = length("crotch_height") - length("trochanterion_height") - 0.003

    hip = max(length("hip_breadth"), MIN_HIP_BREADTH_OVER_SPACING * body.hip_spacing)
    buttock = length("buttock_depth")
    belly, belly_depth = length("waist_breadth"), length("waist_depth")
    depth = length("chest_depth")
    hip_exponent = _exponent(length("buttock_circumference"), hip, buttock)
    belly_exponent = _exponent(length("waist_circumference"), belly, belly_depth)
    chest = _chest_breadth(body)
    slim = SLIMMEST_OVER_MEAN[measures.sex]
    radius = length("neck_circumference") / (2.0 * pi)
    acromion = shoulder + min(ACROMION_ABOVE_SHOULDER * stature, 0.6 * (neck - shoulder))
    across = body.shoulder_spacing
    bust = 0.72 if is_female else 1.0

    def section(
        at: float, breadth: float, front: float, back: float, n: float, m: float | None = None
    ) -> Section:
        return Section(at, breadth, front, back, 0.0, n, m or n)

    middle_depth = slim * 0.5 * (belly_depth + depth)
    return (
        section(crotch, 0.26 * hip, 0.22 * buttock, 0.24 * buttock, 2.0),
        section(0.5 * crotch, 0.62 * hip, 0.34 * buttock, 0.40 * buttock, 2.2),
        section(0.0, 0.88 * hip, 0.42 * buttock, 0.50 * buttock, 2.4),
        section(0.3 * waist, 0.98 * hip, 0.46 * buttock, 0.51 * buttock, hip_exponent),
        section(
            0.65 * waist,
            0.5 * (hip + belly),
            0.25 * buttock + 0.26 * belly_depth,
            0.22 * buttock + 0.23 * belly_depth,
            0.5 * (hip_exponent + belly_exponent),
        ),
        section(waist, belly, 0.55 * belly_depth, 0.45 * belly_depth, belly_exponent),
        section(
            waist + 0.45 * (thorax - waist),
            slim * 0.5 * (belly + chest),
            0.53 * middle_depth,
            0.47 * middle_depth,
            2.5,
        ),
        section(thorax, chest, 0.48 * bust * depth, 0.52 * depth, CHEST_EXPONENT),
        section(
            thorax + 0.45 * (shoulder - thorax),
            1.03 * chest,
            0.44 * (0.5 + 0.5 * bust) * depth,
            0.51 * depth,
            2.6,
        ),
        section(
            thorax + 0.67 * (shoulder - thorax),
            0.5 * (1.06 * chest + across),
            0.35 * depth,
            0.48 * depth,
            2.5,
        ),
        section(shoulder, across + 0.016 * stature, 0.29 * depth, 0.42 * depth, 2.4),
        section(
            acromion,
            across + ACROMION_OUTSIDE_SHOULDER * stature,
            0.19 * depth,
            0.33 * depth,
            2.5,
        ),
        section(
            acromion + 0.35 * (neck - acromion),
            0.5 * across + 1.1 * radius,
            0.18 * depth,
            0.30 * depth,
            2.0,
        ),
        section(
            acromion + 0.7 * (neck - acromion), 2.5 * radius, 0.84 * radius, 1.04 * radius, 2.0
        ),
        section(neck, 1.65 * radius, 0.72 * radius, 0.80 * radius, 2.0),
    )


def _chest_breadth(body: Body) -> float:
    """Breadth of the chest with its muscles, from girth and depth [m].

    The survey's breadth is that between the arms: with its depth it is far too small for the girth.
    """
    length = body.measures.length
    depth, girth = length("chest_depth"), length("chest_circumference")
    return _number_of_girth(
        lambda breadth: _superellipse_girth(breadth, depth, CHEST_EXPONENT),
        *(girth, 0.5 * depth, 0.5 * girth),
    )


def _trunk_reliefs(body: Body) -> tuple[Relief, ...]:
    """Breast, shoulder blades, groove of the spine and buttocks."""
    length, stature = body.measures.length, body.measures.stature
    waist = body.segments["lower_torso"].length
    thorax = waist + body.segments["middle_torso"].length
    shoulder = thorax + body.shoulder_height
    depth, hip, buttock = length("chest_depth"), length("hip_breadth"), length("buttock_depth")
    chest = _chest_breadth(body)
    if body.measures.sex is Sex.FEMALE:
        level = thorax - 0.002 * stature
        breast = Relief(
            level, 0.23 * chest, 0.19 * depth, 0.036 * stature, 0.020 * stature, 0.13 * chest
        )
    else:
        level = thorax + 0.022 * stature
        breast = Relief(
            level, 0.22 * chest, 0.045 * depth, 0.032 * stature, 0.012 * stature, 0.14 * chest
        )
    middle = 0.5 * (waist + shoulder)
    return (
        breast,
        Relief(
            0.6 * (shoulder - thorax) + thorax,
            0.24 * chest,
            0.03 * depth,
            0.03 * stature,
            0.03 * stature,
            0.12 * chest,
            is_behind=True,
        ),
        Relief(
            middle, 0.0, -0.05 * depth, 0.07 * stature, 0.08 * stature, 0.07 * chest, is_behind=True
        ),
        Relief(
            0.006 * stature,
            0.23 * hip,
            0.10 * buttock,
            0.04 * stature,
            0.025 * stature,
            0.14 * hip,
            is_behind=True,
        ),
    )


def _part(
    name: str, loft: Loft, span: tuple[float, float], origin: float, caps: tuple[Cap, Cap]
) -> Surface:
    """Surface of a part of a loft along z.

    Args:
        name: name of the segment.
        loft: loft of the trunk or a limb.
        span: first and last position of the part.
        origin: position of the segment's frame.
        caps: round ends.
    """
    rings, poles = loft.part(*span, *caps)
    shift = np.array([0.0, 0.0, origin])
    return loft_surface(rings - shift, poles - shift, UPWARD, name)


def trunk_loft(body: Body) -> Loft:
    """Loft of the trunk, whose positions are heights above the hip centres."""
    segments, sections = body.segments, _trunk_sections(body)
    waist = segments["lower_torso"].length
    thorax = waist + segments["middle_torso"].length
    shoulder = thorax + body.shoulder_height
    ends = [(sections[0].at, 0.02), (0.0, 0.026), (shoulder, 0.026), (sections[-1].at, 0.0)]
    return Loft(sections, TRUNK_SIDES, ring_places(ends, [waist, thorax]), _trunk_reliefs(body))


def _trunk(body: Body) -> Iterator[Surface]:
    """Surfaces of the three parts of the trunk."""
    length, segments, loft = body.measures.length, body.segments, trunk_loft(body)
    crotch, neck = loft.sections[0].at, loft.sections[-1].at
    waist = segments["lower_torso"].length
    thorax = waist + segments["middle_torso"].length
    bottom, top = Cap(0.012, rings=2), Cap(0.02, rings=2)
    # Nearly as high as deep, so that a bent trunk stays round.
    at_waist = Cap(min(0.45 * length("waist_depth"), 0.7 * waist, 0.7 * (thorax - waist)))
    at_thorax = Cap(min(0.45 * length("chest_depth"), 0.7 * (thorax - waist)))
    yield _part("lower_torso", loft, (crotch, waist), 0.0, (bottom, at_waist))
    yield _part("middle_torso", loft, (waist, thorax), waist, (at_waist, at_thorax))
    yield _part("upper_torso", loft, (thorax, neck), thorax, (at_thorax, top))


def _head(body: Body) -> Surface:
    """The head with the neck, whose lower end is a ball about its joint, in the trunk.

    So a bent neck turns within the trunk.
    """
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

    throat = chin - 0.13 * face
    low = min(throat, 0.0)
    ball = NECK_BALL * radius
    within = max(ball**2 - low**2, 0.25 * ball**2) ** 0.5
    nape = (0.91 * radius + centre) / deep
    jaw = min(1.0, 2.0 * radius / broad)
    sections = (
        # Fuller in front, where the throat joins the chin.
        Section(low, 2.0 * within, 1.12 * radius, within),
        skull(chin - 0.06 * face, 0.96 * jaw, 0.32, nape, 1.95, 2.0),
        skull(chin, 0.7 * jaw + 0.18, 0.385, nape, 1.8, 2.0),
        skull(chin + 0.10 * face, 0.3 * jaw + 0.52, 0.43, nape, 1.85, 2.0),
        skull(chin + 0.20 * face, 0.83, 0.445, nape, 1.9, 2.0),
        skull(chin + 0.50 * face, 0.90, 0.46, 0.5 * nape + 0.24, 2.1, 2.0),
        skull(top - tragion, 0.96, 0.465, 0.50, 2.1, 2.0),
        skull(sellion + 0.14 * face, 1.0, 0.48, 0.52, 2.15, 2.1),
        skull(top - 0.62 * tragion, 1.0, 0.475, 0.52, 2.2, 2.1),
    )
    reliefs = (
        Relief(sellion - 0.36 * face, 0.0, 0.09 * deep, 0.17 * face, 0.075 * face, 0.075 * broad),
        Relief(
            sellion - 0.06 * face,
            0.23 * broad,
            -0.04 * deep,
            0.06 * face,
            0.09 * face,
            0.09 * broad,
        ),
        Relief(chin + 0.09 * face, 0.0, 0.025 * deep, 0.07 * face, 0.07 * face, 0.14 * broad),
        Relief(chin + 0.36 * face, 0.0, 0.02 * deep, 0.05 * face, 0.05 * face, 0.12 * broad),
    )
    high = sections[-1].at
    places = ring_places([(low, 0.005), (chin, 0.0105), (high, 0.0)], [])
    caps = Cap(max(ball + low, 0.3 * ball), rings=5, pole=0.0), Cap(0.62 * tragion, 2.15, 6)
    rings, poles = Loft(sections, HEAD_SIDES, places, reliefs, 0.4).part(low, high, *caps)
    return loft_surface(rings, poles, UPWARD, "head")


class _ArmGirths(NamedTuple):
    """Girths of a relaxed arm [m].

    Attributes:
        deltoid: breadth of the upper arm below the shoulder.
        biceps: girth of the upper arm.
        elbow: girth of the elbow.
        forearm: girth of the forearm.
        wrist: girth of the wrist.
    """

    deltoid: float
    biceps: float
    elbow: float
    forearm: float
    wrist: float


def _arm_girths(body: Body) -> _ArmGirths:
    length = body.measures.length
    biceps = RELAXED_BICEPS * length("biceps_circumference_flexed")
    # In heavy people the trunk pushes the arms outward, which adds to the bideltoid breadth.
    deltoid = min(length("bideltoid_breadth") - body.shoulder_spacing, 1.25 * biceps / pi)
    forearm = RELAXED_FOREARM * length("forearm_circumference_flexed")
    elbow = ELBOW_OVER_FOREARM * forearm
    return _ArmGirths(deltoid, biceps, elbow, forearm, length("wrist_circumference"))


def arm_loft(body: Body) -> Loft:
    """Loft of an arm with its hand, whose positions are distances below the shoulder."""
    length, segments = body.measures.length, body.segments
    elbow = segments["upper_arm"].length
    wrist = elbow + segments["lower_arm"].length
    finger = wrist + length("hand_length")
    deltoid, biceps, elbow_girth, forearm, wrist_girth = _arm_girths(body)
    broad = length("hand_breadth")
    palm = min(length("palm_length") / length("hand_length"), 0.7)

    def upper(part: float) -> float:
        return part * elbow

    def lower(part: float) -> float:
        return elbow + part * (wrist - elbow)

    def hand(part: float, thickness: float, front: float, back: float) -> Section:
        at = wrist + part * (finger - wrist)
        return Section(at, thickness * broad, front * broad, back * broad, 0.0, 2.4, 2.4)

    sections = (
        Section(0.0, 0.94 * deltoid, 0.46 * deltoid, 0.48 * deltoid),
        Section(upper(0.12), deltoid, 0.48 * deltoid, 0.50 * deltoid),
        _ring(upper(0.32), 1.05 * biceps, 1.06),
        _ring(upper(0.55), biceps, 1.12),
        _ring(upper(0.82), 0.4 * biceps + 0.6 * elbow_girth, 1.06),
        _ring(elbow, elbow_girth, 1.0),
        _ring(lower(0.2), forearm, 1.08, 0.06),
        _ring(lower(0.5), 0.58 * forearm + 0.42 * wrist_girth, 1.15),
        _ring(lower(0.82), 0.12 * forearm + 0.88 * wrist_girth, 1.3),
        _ring(wrist, wrist_girth, 1.4),
        hand(0.35 * palm, 0.46, 0.54, 0.44),
        hand(0.70 * palm, 0.44, 0.68, 0.50),
        hand(0.92 * palm, 0.36, 0.69, 0.51),
        hand(1.06 * palm, 0.29, 0.58, 0.50),
        hand(1.16 * palm, 0.26, 0.47, 0.49),
        hand(0.85, 0.22, 0.43, 0.44),
        hand(0.94, 0.19, 0.35, 0.37),
    )
    places = ring_places([(0.0, 0.03), (wrist, 0.014), (sections[-1].at, 0.0)], [elbow, wrist])
    return Loft(sections, LIMB_SIDES, places)


def _arm(body: Body) -> Iterator[Surface]:
    """Surfaces of upper arm, forearm and hand."""
    loft, girths, stature = arm_loft(body), _arm_girths(body), body.measures.stature
    elbow = body.segments["upper_arm"].length
    wrist = elbow + body.segments["lower_arm"].length
    end, finger = loft.sections[-1].at, wrist + body.measures.length("hand_length")
    top = Cap(max((ACROMION_ABOVE_SHOULDER + 0.002) * stature, 0.31 * girths.deltoid))
    at_elbow, at_wrist = Cap(girths.elbow / (2.0 * pi)), Cap(0.12 * girths.wrist)
    # Flatter than the end of the upper arm, which covers it in a bent elbow.
    covered = Cap(0.85 * at_elbow.height, 1.7)
    tip = Cap(0.06 * (finger - wrist), rings=3)
    yield _part("upper_arm", loft, (0.0, elbow), 0.0, (top, at_elbow))
    yield _part("lower_arm", loft, (elbow, wrist), elbow, (covered, at_wrist))
    yield _part("hand", loft, (wrist, end), wrist, (at_wrist, tip))


def leg_loft(body: Body) -> Loft:
    """Loft of thigh and shank, whose positions are distances below the hip."""
    length, segments = body.measures.length, body.segments
    knee = segments["upper_leg"].length
    ankle = knee + segments["lower_leg"].length
    thigh, low = length("thigh_circumference"), length("lower_thigh_circumference")
    # Bounds for people far from the survey: the hip centres grow with the stature alone.
    across = length("hip_breadth") - body.hip_spacing
    breadth = min(max(across, 0.75 * thigh / pi), 1.15 * thigh / pi)
    knee_girth, calf = KNEE_OVER_LOWER_THIGH * low, length("calf_circumference")
    ankle_girth, malleoli = length("ankle_circumference"), length("bimalleolar_breadth")
    fold = length("trochanterion_height") - length("crotch_height") + 0.003
    depth = _half_axis(thigh, breadth / 2.0)
    # Back of the buttock, from the hip centre.
    buttock = 0.57 * length("buttock_depth")

    def upper(part: float) -> float:
        return part * knee

    def lower(part: float) -> float:
        return knee + part * (ankle - knee)

    sections = (
        Section(0.0, breadth, 0.90 * depth, buttock),
        Section(fold, breadth, 0.96 * depth, 1.04 * depth),
        _ring(upper(0.5), 0.62 * thigh + 0.38 * low, 1.08, 0.02),
        _ring(upper(0.85), low, 1.04, 0.04),
        _ring(knee, knee_girth, 1.04, 0.03),
        _ring(lower(0.10), 0.5 * (knee_girth + calf), 1.06, -0.06),
        _ring(lower(0.29), calf, 1.06, -0.22),
        _ring(lower(0.62), 0.45 * calf + 0.55 * ankle_girth, 1.12, -0.14),
        _ring(lower(0.87), ankle_girth, 1.2, -0.10),
        Section(ankle, malleoli, 0.58 * malleoli, 0.62 * malleoli),
    )
    return Loft(sections, LIMB_SIDES, ring_places([(0.0, 0.033), (ankle, 0.0)], [knee]))


def thigh_cap(body: Body) -> Cap:
    """Upper end of the thigh, which reaches to the front spine as that of published tables does."""
    return Cap(SPINE_ABOVE_HIP * body.measures.stature, 2.5)


def _leg(body: Body) -> Iterator[Surface]:
    """Surfaces of thigh and shank."""
    loft, length = leg_loft(body), body.measures.length
    knee = body.segments["upper_leg"].length
    ankle = knee + body.segments["lower_leg"].length
    knee_girth = KNEE_OVER_LOWER_THIGH * length("lower_thigh_circumference")
    malleoli = length("bimalleolar_breadth")
    at_knee = Cap(knee_girth / (2.0 * pi))
    yield _part("upper_leg", loft, (0.0, knee), 0.0, (thigh_cap(body), at_knee))
    covered, at_ankle = Cap(0.85 * at_knee.height, 1.7), Cap(0.45 * malleoli)
    yield _part("lower_leg", loft, (knee, ankle), knee, (covered, at_ankle))


def _foot(body: Body) -> Surface:
    """The foot, lofted from heel to toes; its sole is flat."""
    length, span = body.measures.length, body.measures.length("foot_length")
    heel, broad = length("heel_breadth"), length("foot_breadth")
    ball = length("ball_of_foot_length") / length("foot_length")
    ankle, behind = body.ankle_height, body.heel_distance
    malleoli = length("bimalleolar_breadth")
    at_ankle = behind / span

    def section(at: float, breadth: float, top: float, roundness: float = 2.0) -> Section:
        """Section whose height is `top`; its widest line is low."""
        widest = 0.35 * top
        return Section(
            at * span - behind, breadth, top - widest, widest * 1.06, widest - ankle, roundness, 5.0
        )

    sections = (
        section(0.11, 0.94 * heel, 0.88 * ankle),
        section(at_ankle, 0.98 * heel, ankle + 0.42 * malleoli),
        section(0.73 * at_ankle + 0.27 * ball, heel, 1.24 * ankle, 2.1),
        section(0.33 * at_ankle + 0.67 * ball, 0.94 * broad, 0.90 * ankle, 2.2),
        section(ball, broad, 0.62 * ankle, 2.4),
        section(0.46 * ball + 0.54, 0.93 * broad, 0.42 * ankle, 2.5),
        section(0.19 * ball + 0.81, 0.78 * broad, 0.36 * ankle, 2.5),
    )
    low, high = sections[0].at, sections[-1].at
    places = ring_places([(low, 0.017), (high, 0.0)], [])
    caps = (
        Cap(0.11 * span, 2.4, 4, -0.6 * ankle),
        Cap(0.19 * (1.0 - ball) * span, 2.3, 3, -0.88 * ankle),
    )
    rings, poles = Loft(sections, LIMB_SIDES, places).part(low, high, *caps)
    rings[..., 0] = np.maximum(rings[..., 0], -ankle)
    return loft_surface(rings, poles, FOOT_AXES, "foot")


def foot_contact_spheres(body: Body) -> tuple[ContactSphere, ...]:
    """Spheres of the foot in its frame: two each at heel, ball and toes, instep and ankle.

    All but the last two touch the plane of the sole, so that the person stands on it.
    """
    length = body.measures.length
    span, ankle = length("foot_length"), body.ankle_height
    heel, broad = length("heel_breadth"), length("foot_breadth")
    rear = -body.heel_distance
    at_heel, at_ball, at_toe = 0.34 * heel, 0.20 * broad, 0.15 * broad
    instep, malleoli = 0.42 * heel, length("bimalleolar_breadth")
    rows = (
        (rear + at_heel, 0.14 * heel, at_heel),
        (rear + length("ball_of_foot_length"), 0.49 * broad - at_ball, at_ball),
        (rear + span - at_toe, 0.20 * broad, at_toe),
    )
    spheres = [
        (x, side * y, ankle - radius, radius) for x, y, radius in rows for side in (1.0, -1.0)
    ]
    spheres += [
        (0.14 * span, 0.0, instep - 0.17 * ankle, instep),
        (0.0, 0.0, -0.06 * malleoli, 0.44 * malleoli),
    ]
    rounded = np.round(spheres, DECIMALS).tolist()
    return tuple(ContactSphere((x, y, z), radius) for x, y, z, radius in rounded)


_HARRINGTON = Reference(
    "M. E. Harrington et al., Prediction of the hip joint centre in adults, children, and patients "
    "with cerebral palsy based on magnetic resonance imaging, J Biomech 40:595-602, 2007",
    Sureness.ONE_CODE,
    doi="10.1016/j.jbiomech.2006.02.003",
)
"""The regression is the same in several codes, the distance of the front spines stands in one."""


def shape_sources(body: Body) -> tuple[SourcedNumber, ...]:
    """Sources of the numbers by which surfaces differ from the measured dimensions."""
    stature = body.measures.stature
    estimates = (
        ("upper_arm", "girth over the flexed one that was measured", RELAXED_BICEPS, ""),
        ("lower_arm", "girth over the flexed one that was measured", RELAXED_FOREARM, ""),
        ("lower_arm", "girth of the elbow over that of the forearm", ELBOW_OVER_FOREARM, ""),
        ("lower_leg", "girth of the knee over that of the lower thigh", KNEE_OVER_LOWER_THIGH, ""),
        (
            "middle_torso",
            "breadth and depth above the navel over the means of navel and chest",
            SLIMMEST_OVER_MEAN[body.measures.sex],
            "",
        ),
        ("upper_torso", "exponent of the chest's superellipse", CHEST_EXPONENT, ""),
        *(
            ("foot", f"radius of the contact spheres at the {place}", sphere.radius, "m")
            for place, sphere in zip(
                ("heel", "ball", "toes", "instep", "ankle"),
                foot_contact_spheres(body)[0:5:2] + foot_contact_spheres(body)[6:],
                strict=True,
            )
        ),
    )
    chest = body.measures.length("chest_breadth")
    return (
        *(
            SourcedNumber(part, quantity, value, unit, Origin.ESTIMATE, None, "surface only")
            for part, quantity, value, unit in estimates
        ),
        SourcedNumber(
            *("upper_torso", "breadth of the chest", _chest_breadth(body), "m", Origin.ESTIMATE),
            None,
            "from circumference and depth of the chest; the measured breadth, "
            f"{1000 * chest:.0f} mm, is that between the arms",
        ),
        SourcedNumber(
            *("upper_leg", "upper end above the hip centre", SPINE_ABOVE_HIP * stature, "m"),
            *(Origin.SCALED, _HARRINGTON),
            f"{SPINE_ABOVE_HIP:g} of the stature: the pelvis's front spine, 88 mm above the hip "
            "centre of a man of 1.741 m whose front spines are 255.7 mm from each other (de Leva "
            "1996, table 3)",
        ),
    )
