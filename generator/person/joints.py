"""The figure of a person: segments with sites, joints with axes and limits.

Joints are at the borders of de Leva's segments. Elbows and knees are hinges about the axis across
the limb: the carrying angle of the elbow is not modelled. The forearm turns at the elbow, so that
elbows, wrists and ankles have two axes; the other joints are spherical.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from math import degrees, pi
from typing import Any

from generator.diagnostics import UsageError, by_name
from generator.figure import (
    CENTRE_OF_MASS_SITE,
    Attribute,
    AxisKind,
    Figure,
    Joint,
    JointAxis,
    Location,
    Rotation,
    Segment,
    Site,
    SiteRef,
    Translation,
    Vector,
)
from generator.person.body import LIMB_SEGMENTS, SIDES, TRUNK_SEGMENTS, Body, BodySegment
from generator.person.identity import Identity, range_publications
from generator.person.shape import foot_contact_spheres
from generator.person.sources import Origin, SourcedNumber, load_data_file
from generator.person.stance import Stance, standing_stance
from generator.person.survey import Sex
from springs.published.range_of_motion import (
    PUBLICATIONS_OF_WOMEN,
    RangeEnd,
    normal_range,
)

GROUND_SEGMENT = "body_root"
"""Segment of the ground at the hips' height, by which the figure stands on the world's origin."""

_UPRIGHT = Rotation((-pi / 2.0, 0.0, -pi / 2.0))
"""Axes of the trunk (x forward, y left, z up) in the world's (x left, y up, z forward)."""

_DOWNWARDS = Rotation((-pi, 0.0, 0.0))
"""Axes of a limb (x forward, y right, z down) in those of the trunk."""

MAX_LIMIT = pi
"""Largest limit [rad]: a limb that is raised by 180 deg points upwards."""

_X, _Y, _Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class JointRotation:
    """A rotation of a joint.

    Attributes:
        motion: name of a positive angle, with the part of the body where that is not the joint's.
        axis: axis in the joint's frame; of the left one for a joint of both sides.
    """

    motion: str
    axis: Vector

    @property
    def axis_name(self) -> str:
        """Letter of the axis, as springs name it."""
        return "xyz"[[abs(part) for part in self.axis].index(1.0)]


class Neck(StrEnum):
    """Kinds of the neck of a person."""

    RIGID = "rigid"
    """It turns only."""

    ELASTIC = "elastic"
    """It has three translations beside its rotations."""


DEFAULT_NECK = Neck.ELASTIC
"""Neck of a person without a choice."""


def resolve_neck(neck: Neck | None, springs: str) -> Neck:
    """Return the neck of a person with some springs, `DEFAULT_NECK` without a choice.

    Raises UsageError for an elastic neck without springs; without a choice that neck is rigid.
    """
    if springs != "none":
        return DEFAULT_NECK if neck is None else Neck(neck)
    if neck is not None and Neck(neck) is Neck.ELASTIC:
        raise UsageError("an elastic neck needs springs: a person without any has a rigid one")
    return Neck.RIGID


SLIDING_JOINT = "neck"
"""Joint with the translations of an elastic neck."""


@dataclass(frozen=True)
class JointSlide:
    """A translation of a joint, along an axis of the parent's site.

    Attributes:
        motion: name of a positive displacement of the child.
        axis: axis in the joint's frame.
    """

    motion: str
    axis: Vector

    @property
    def axis_name(self) -> str:
        """Letter of the axis."""
        return "xyz"[self.axis.index(1.0)]


NECK_SLIDES = (
    JointSlide("forward shear", _X),
    JointSlide("shear to the left", _Y),
    JointSlide("lengthening", _Z),
)
"""Translations of an elastic neck."""


@dataclass(frozen=True)
class PersonJoint:
    """A joint of a person.

    Attributes:
        name: name in the figure, without side.
        parent: segment and site, without side; a site of the trunk is `llateral` for the left.
        child: likewise.
        rotations: innermost first.
        has_sides: whether there is a left and a right one.
    """

    name: str
    parent: tuple[str, str]
    child: tuple[str, str]
    rotations: tuple[JointRotation, ...]
    has_sides: bool = True

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the joints in the figure."""
        return tuple(f"{side}_{self.name}" for side in SIDES) if self.has_sides else (self.name,)


def _trunk_joint(name: str, below: str, above: str, part: str = "") -> PersonJoint:
    """A joint of the spine; `part` precedes its motions."""
    rotations = (
        JointRotation(f"{part}twist to the left", _Z),
        JointRotation(f"{part}lateral bend to the right", _X),
        JointRotation(f"{part}flexion", _Y),
    )
    return PersonJoint(name, (below, "distal"), (above, "proximal"), rotations, has_sides=False)


_BALL = (
    JointRotation("medial rotation", _Z),
    JointRotation("abduction", _X),
    JointRotation("flexion", _Y),
)

_ROOT_JOINT = PersonJoint(
    "root_torso",
    (GROUND_SEGMENT, "distal"),
    ("lower_torso", "proximal"),
    (JointRotation("", _X), JointRotation("", _Y), JointRotation("", _Z)),
    has_sides=False,
)

PERSON_JOINTS: tuple[PersonJoint, ...] = (
    _trunk_joint("waist", "lower_torso", "middle_torso", "lumbar "),
    _trunk_joint("thorax", "middle_torso", "upper_torso"),
    _trunk_joint("neck", "upper_torso", "head"),
    PersonJoint("shoulder", ("upper_torso", "cl_lateral"), ("upper_arm", "proximal"), _BALL),
    PersonJoint(
        "elbow",
        ("upper_arm", "distal"),
        ("lower_arm", "proximal"),
        (JointRotation("forearm pronation", _Z), JointRotation("flexion", _Y)),
    ),
    PersonJoint(
        "wrist",
        ("lower_arm", "distal"),
        ("hand", "proximal"),
        (
            JointRotation("flexion", (-1.0, 0.0, 0.0)),
            JointRotation("radial deviation", _Y),
        ),
    ),
    PersonJoint("hip_joint", ("lower_torso", "lateral"), ("upper_leg", "proximal"), _BALL),
    PersonJoint(
        "knee",
        ("upper_leg", "distal"),
        ("lower_leg", "proximal"),
        (JointRotation("flexion", (0.0, -1.0, 0.0)),),
    ),
    PersonJoint(
        "ankle",
        ("lower_leg", "distal"),
        ("foot", "proximal"),
        (JointRotation("inversion", (-1.0, 0.0, 0.0)), JointRotation("dorsiflexion", _Y)),
    ),
)
"""The joints between the segments, without that to the ground."""


def person_figure(body: Body, neck: Neck = DEFAULT_NECK) -> Figure:
    """Return the figure of a person, standing upright at the world's origin in its stance."""
    segments = [_trunk_segment(body, body.segments[name]) for name in TRUNK_SEGMENTS]
    for name in LIMB_SEGMENTS:
        segments += [_limb_segment(body, body.segments[name], side) for side in SIDES]
    stance = standing_stance(body)
    joints = [_joint(_ROOT_JOINT, "", body, stance)]
    for joint in PERSON_JOINTS:
        sides = SIDES if joint.has_sides else ("",)
        joints += [_joint(joint, side, body, stance) for side in sides]
    if neck is Neck.ELASTIC:
        joints = [_with_slides(one) if one.name == SLIDING_JOINT else one for one in joints]
    base = Site("base", Location.at(0.0, -stance.hip_height(body), 0.0))
    sites = by_name(Site("distal", Location((_UPRIGHT,))), base)
    ground = Segment(GROUND_SEGMENT, mass=-1e-3, sites=sites)
    return Figure(
        segments=by_name(*segments, ground),
        joints=by_name(*joints),
        root=SiteRef(GROUND_SEGMENT, "base"),
        attributes=by_name(
            Identity(body.measures.sex, body.measures.stature).attribute,
            Attribute("clothing", {"rgb": (0.25, 0.35, 0.55)}),
            Attribute("skin", {"rgb": (0.87, 0.68, 0.55)}),
        ),
    )


def motion_range(
    joint: PersonJoint, rotation: JointRotation, sex: Sex
) -> tuple[RangeEnd, RangeEnd]:
    """Ends of the normal range of a rotation, for women of women where these were measured."""
    low, high = normal_range(joint.name, rotation.motion, range_publications(sex))
    assert low is not None
    assert high is not None
    return low, high


def limit_sources(body: Body) -> tuple[SourcedNumber, ...]:
    """Return the limits of the joints with their sources."""
    sources: list[SourcedNumber] = []
    for joint in PERSON_JOINTS:
        for rotation in joint.rotations:
            low, high = motion_range(joint, rotation, body.measures.sex)
            # The trunk turns and bends alike to both sides: both ends have one name.
            names = ("lower ", "upper ") if low.motion == high.motion else ("", "")
            for name, end in zip(names, (low, high), strict=True):
                origin = Origin.ESTIMATE if end.is_estimate else Origin.PUBLISHED
                quantity, rule = f"{name}limit of {end.motion}", _limit_rule(end, body.measures.sex)
                sources.append(
                    SourcedNumber(
                        *(joint.name, quantity, _limit(end), "rad", origin, end.reference, rule)
                    )
                )
    return tuple(sources)


def _limit(end: RangeEnd) -> float:
    """Angle of the stop at an end of the normal range [rad]."""
    return max(-MAX_LIMIT, min(end.angle, MAX_LIMIT))


def _limit_rule(end: RangeEnd, sex: Sex) -> str:
    rule = "end of the normal range of motion"
    if _limit(end) != end.angle:
        rule += f" ({degrees(end.angle):.4g} deg), but not beyond {degrees(MAX_LIMIT):.4g} deg"
    if sex is Sex.FEMALE and end.source not in PUBLICATIONS_OF_WOMEN:
        rule += "; not measured in women, who move more in nearly every joint"
    return rule


def _trunk_segment(body: Body, part: BodySegment) -> Segment:
    """A part of the trunk, or the head, with the sites of the limbs."""
    sites = [Site("proximal"), Site("distal", Location.at(0.0, 0.0, part.length))]
    if part.name == "lower_torso":
        sites += _lateral_sites("lateral", body.hip_spacing, 0.0)
    elif part.name == "upper_torso":
        sites += _lateral_sites("cl_lateral", body.shoulder_spacing, body.shoulder_height)
    colour = "skin" if part.name == "head" else "clothing"
    return _moving_segment(part.name, part, sites, colour)


def _lateral_sites(name: str, spacing: float, height: float) -> Iterator[Site]:
    """Sites of a pair of limbs on the trunk, with the axes of the limbs."""
    for side, sign in zip(SIDES, (0.5, -0.5), strict=True):
        offset = Translation((0.0, sign * spacing, height))
        yield Site(f"{side[0]}{name}", Location((_DOWNWARDS, offset)))


def _limb_segment(body: Body, part: BodySegment, side: str) -> Segment:
    sites = [Site("proximal")]
    if part.name == "foot":
        toe = part.length - body.heel_distance
        sites += [
            Site("distal", Location.at(toe, 0.0, body.ankle_height)),
            Site("heel", Location.at(-body.heel_distance, 0.0, body.ankle_height)),
            Site("sole", Location.at(0.0, 0.0, body.ankle_height)),
        ]
    else:
        sites.append(Site("distal", Location.at(0.0, 0.0, part.length)))
    bare = part.name in ("lower_arm", "hand")
    colour = "skin" if bare else "clothing"
    segment = _moving_segment(f"{side}_{part.name}", part, sites, colour)
    if part.name == "foot":
        return replace(segment, contact_spheres=foot_contact_spheres(body))
    return segment


def _moving_segment(name: str, part: BodySegment, sites: list[Site], colour: str) -> Segment:
    centre = Site(CENTRE_OF_MASS_SITE, Location.at(*part.centre))
    return Segment(name, part.mass, part.inertia, None, (colour,), by_name(*sites, centre))


def _standing(joint: PersonJoint, stance: Stance) -> tuple[float, ...]:
    """Displacement of a joint in a stance."""
    angles = {
        ("shoulder", "abduction"): stance.arms,
        ("hip_joint", "abduction"): stance.legs,
        ("ankle", "inversion"): stance.legs,
    }
    return tuple(angles.get((joint.name, each.motion), 0.0) for each in joint.rotations)


def _joint(joint: PersonJoint, side: str, body: Body, stance: Stance) -> Joint:
    prefix = f"{side}_" if side else ""

    def site(ref: tuple[str, str]) -> SiteRef:
        segment, name = ref
        if name.endswith("lateral"):
            return SiteRef(segment, f"{side[0]}{name}")
        return SiteRef(f"{prefix if segment in LIMB_SEGMENTS else ''}{segment}", name)

    chain = tuple(
        JointAxis(AxisKind.ROTATION, _mirrored(each.axis) if side == "right" else each.axis)
        for each in joint.rotations
    )
    name, ends = f"{prefix}{joint.name}", (site(joint.parent), site(joint.child))
    figure_joint = Joint(name, *ends, chain, displacement=_standing(joint, stance))
    if joint is _ROOT_JOINT:
        return figure_joint
    limits = [motion_range(joint, rotation, body.measures.sex) for rotation in joint.rotations]
    lower, upper = (tuple(map(_limit, row)) for row in zip(*limits, strict=True))
    return replace(figure_joint, lower_limit=lower, upper_limit=upper)


def _with_slides(joint: Joint) -> Joint:
    """Return the neck with its translations, the outermost factors of its chain."""
    slides = tuple(JointAxis(AxisKind.TRANSLATION, each.axis) for each in NECK_SLIDES)
    limits = [row["limit_m"] for _, row in slide_rows()]
    chain, zeros = (*joint.chain, *slides), (0.0,) * len(slides)
    assert joint.lower_limit is not None
    assert joint.upper_limit is not None
    return replace(
        joint,
        chain=chain,
        displacement=(*joint.displacement, *zeros),
        lower_limit=(*joint.lower_limit, *(-limit for limit in limits)),
        upper_limit=(*joint.upper_limit, *limits),
    )


def slide_rows() -> tuple[tuple[JointSlide, Mapping[str, Any]], ...]:
    """Return the translations of an elastic neck, each with its row of the data file."""
    rows = {row["motion"]: row for row in load_data_file("passive_joints").content["slide"]}
    return tuple((slide, rows[slide.motion]) for slide in NECK_SLIDES)


def _mirrored(axis: Vector) -> Vector:
    """Axis of the right joint of which that of the left one is `axis`, both in limb axes."""
    x, y, z = axis
    return 0.0 - x, y, 0.0 - z
