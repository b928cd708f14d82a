"""The body of a person: segments with their masses, and the places of the joint centres.

Frames: the origin of a limb segment is at its proximal joint, x forward, y to the right, z down
along the limb; that of a foot at the ankle, x forward along the foot, y right, z down. The parts of
the trunk and the head have theirs at the lower joint, x forward, y left, z up. Segments are named
without side: the left and the right one are equal in their own frames.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from generator.diagnostics import ModelError
from generator.figure import Vector
from generator.person.measures import Measures, Sex
from generator.person.segment_table import SegmentRow, SegmentTable, de_leva_table
from generator.person.sources import Origin, SourcedNumber
from springs.published.reference import Reference, Sureness

TRUNK_SEGMENTS = ("lower_torso", "middle_torso", "upper_torso", "head")
"""From the hips up."""

LIMB_SEGMENTS = ("upper_arm", "lower_arm", "hand", "upper_leg", "lower_leg", "foot")
"""Each of them on both sides, as `left_upper_arm` and `right_upper_arm`."""


@dataclass(frozen=True)
class BodySegment:
    """A rigid segment of a person.

    Attributes:
        name: without side.
        length: from its own joint to the next one [m]; of the head to the vertex, of the hand to
            the third fingertip, of the foot from heel to toe.
        mass: [kg].
        centre: of mass in the segment's frame [m].
        inertia: principal moments about the centre of mass, along the segment's axes [kg m2].
    """

    name: str
    length: float
    mass: float
    centre: Vector
    inertia: Vector


@dataclass(frozen=True)
class Body:
    """A person's body, standing upright with arms down, thumbs forward.

    Attributes:
        measures: from which it was made.
        segments: by their names without side.
        hip_spacing: distance of the hip centres [m].
        shoulder_spacing: distance of the shoulder centres [m].
        shoulder_height: of the shoulder centres above the thorax joint, in the upper torso [m].
        ankle_height: of the ankle centres above the sole [m].
        heel_distance: of the rear of the heel behind the ankle centre [m].
        sources: of the numbers above.
    """

    measures: Measures
    segments: Mapping[str, BodySegment]
    hip_spacing: float
    shoulder_spacing: float
    shoulder_height: float
    ankle_height: float
    heel_distance: float
    sources: tuple[SourcedNumber, ...] = ()

    @property
    def hip_height(self) -> float:
        """Height of the hip centres above the sole, standing [m]."""
        return self.knee_height + self.segments["upper_leg"].length

    @property
    def knee_height(self) -> float:
        """Height of the knee centres above the sole, standing [m]."""
        return self.ankle_height + self.segments["lower_leg"].length

    @property
    def origin_heights(self) -> Mapping[str, float]:
        """Heights of the origins of the segments above the sole, standing [m], by their names."""
        heights = {
            "foot": self.ankle_height,
            "lower_leg": self.knee_height,
            "upper_leg": self.hip_height,
        }
        height = self.hip_height
        for name in TRUNK_SEGMENTS:
            heights[name] = height
            height += self.segments[name].length
        height = heights["upper_torso"] + self.shoulder_height
        for name in ("upper_arm", "lower_arm", "hand"):
            heights[name] = height
            height -= self.segments[name].length
        return heights

    @property
    def centre_height(self) -> float:
        """Height of the body's centre of mass above the sole, standing [m]."""
        heights, moment, mass = self.origin_heights, 0.0, 0.0
        for name, segment in self.segments.items():
            up, count = (1, 1) if name in TRUNK_SEGMENTS else (-1, 2)
            moment += count * segment.mass * (heights[name] + up * segment.centre[2])
            mass += count * segment.mass
        return moment / mass


@dataclass(frozen=True)
class _Part:
    """Segment of a body in the terms of the published table.

    Attributes:
        name: of ours.
        segment: of the table.
        ends: end points of the row.
        axes: of the table (0 sagittal, 1 transverse, 2 longitudinal) along x, y, z of ours.
        is_limb: whether the origin is the first end point and z points down.
    """

    name: str
    segment: str
    ends: tuple[str, str]
    axes: tuple[int, int, int] = (0, 1, 2)
    is_limb: bool = True


_PARTS = (
    _Part("lower_torso", "lower_trunk", ("OMPH", "MIDH"), is_limb=False),
    _Part("middle_torso", "middle_trunk", ("XYPH", "OMPH"), is_limb=False),
    _Part("upper_torso", "upper_trunk", ("CERV", "XYPH"), is_limb=False),
    _Part("head", "head", ("VERT", "CERV"), is_limb=False),
    _Part("upper_arm", "upper_arm", ("SJC", "EJC")),
    _Part("lower_arm", "forearm", ("EJC", "WJC")),
    # The palm faces the thigh: the axis normal to it, sagittal in the anatomical position, is y.
    _Part("hand", "hand", ("WJC", "DAC3"), axes=(1, 0, 2)),
    _Part("upper_leg", "thigh", ("HJC", "KJC")),
    _Part("lower_leg", "shank", ("KJC", "AJC")),
    _Part("foot", "foot", ("HEEL", "TTIP"), axes=(2, 1, 0)),
)

_AXIS_NAMES = ("sagittal", "transverse", "longitudinal")

ANKLE_BELOW_MALLEOLUS = 0.006
"""Ankle centre below the tip of the lateral malleolus [m]: lengths KJC-AJC less KJC-LMAL."""

SHOULDER_BELOW_ACROMION = 0.0345
"""Shoulder centre below the acromion [m], of men."""

SHOULDER_INSIDE_ACROMION = 0.0175
"""Shoulder centre inward of the acromion [m]; an estimate."""

HIP_SPACING_OVER_STATURE = 0.102
"""Distance of the hip centres over the stature; an estimate."""

HEEL_DISTANCE_OVER_FOOT_LENGTH = 0.25
"""Rear of the heel behind the ankle centre, over the foot's length; an estimate."""

_LENGTH_DIMENSIONS = {
    "upper_arm": "acromion_radiale_length",
    "lower_arm": "radiale_stylion_length",
    "hand": "hand_length",
    "foot": "foot_length",
}
"""Measured dimensions that change the length of a segment by their ratio."""


def build_body(measures: Measures) -> Body:
    """Build the body of a person: de Leva's segments, with legs and trunk that close the stature.

    Raises:
        ModelError: for dimensions that do not fit each other or the stature.
    """
    table = de_leva_table(measures.sex)
    skeleton = _build_skeleton(measures, table)
    heel_distance = HEEL_DISTANCE_OVER_FOOT_LENGTH * skeleton.lengths["foot"]
    total = sum(table.mass_fraction(part.segment) * (2 if part.is_limb else 1) for part in _PARTS)
    segments: dict[str, BodySegment] = {}
    for part in _PARTS:
        row, length = table.row(part.segment, *part.ends), skeleton.lengths[part.name]
        mass = measures.mass * table.mass_fraction(part.segment) / total
        moments = [mass * (radius * length) ** 2 for radius in row.radii]
        x, y, z = (moments[axis] for axis in part.axes)
        along = (row.centre if part.is_limb else 1 - row.centre) * length
        centre = (0.0, 0.0, along)
        if part.name == "foot":
            centre = (along - heel_distance, 0.0, skeleton.ankle_height / 2)
        segments[part.name] = BodySegment(part.name, length, mass, centre, (x, y, z))
    body = Body(
        measures=measures,
        segments=segments,
        hip_spacing=HIP_SPACING_OVER_STATURE * measures.stature,
        shoulder_spacing=measures.length("biacromial_breadth") - 2 * SHOULDER_INSIDE_ACROMION,
        shoulder_height=_shoulder_height(measures, skeleton),
        ankle_height=skeleton.ankle_height,
        heel_distance=heel_distance,
    )
    _check_shoulders(body)
    return replace(body, sources=tuple(_list_sources(body, table, skeleton, total)))


@dataclass(frozen=True)
class _Skeleton:
    """Lengths that close the stature.

    Attributes:
        lengths: of the segments [m].
        expected: lengths by stature and mass alone [m].
        ankle_height: of the ankle centres above the sole [m].
        leg_factor: of thigh and shank of the table, scaled to the stature, by stature and mass.
    """

    lengths: Mapping[str, float]
    expected: Mapping[str, float]
    ankle_height: float
    leg_factor: float


def _build_skeleton(measures: Measures, table: SegmentTable) -> _Skeleton:
    """Scale the table with the stature, close the legs, and change measured dimensions."""
    stature, scale = measures.stature, measures.stature / table.stature
    expected = {part.name: scale * table.row(part.segment, *part.ends).length for part in _PARTS}
    malleolus = measures.dimensions["lateral_malleolus_height"]
    expected_ankle = malleolus.expected - ANKLE_BELOW_MALLEOLUS
    expected_hip = stature - sum(expected[name] for name in TRUNK_SEGMENTS)
    legs = expected["upper_leg"] + expected["lower_leg"]
    leg_factor = (expected_hip - expected_ankle) / legs
    expected["upper_leg"] *= leg_factor
    expected["lower_leg"] *= leg_factor

    lengths = dict(expected)
    for name, dimension in _LENGTH_DIMENSIONS.items():
        lengths[name] *= measures.ratio(dimension)
    cervicale = measures.dimensions["cervicale_height"]
    if cervicale.is_measured:
        lengths["head"] *= (stature - cervicale.value) / (stature - cervicale.expected)

    hip = expected_hip * measures.ratio("trochanterion_height")
    cervical = stature - lengths["head"]
    trunk = ("lower_torso", "middle_torso", "upper_torso")
    lengths |= _divide(cervical - hip, trunk, expected)
    if measures.dimensions["waist_height"].is_measured:
        navel = (expected_hip + expected["lower_torso"]) * measures.ratio("waist_height")
        lengths["lower_torso"] = navel - hip
        lengths |= _divide(cervical - navel, trunk[1:], expected)

    ankle = malleolus.value - ANKLE_BELOW_MALLEOLUS
    lengths |= _divide(hip - ankle, ("upper_leg", "lower_leg"), expected)
    knee_ratios = [
        measures.ratio(name)
        for name in ("tibial_height", "lateral_femoral_epicondyle_height")
        if measures.dimensions[name].is_measured
    ]
    if knee_ratios:
        expected_knee = expected_ankle + expected["lower_leg"]
        knee = expected_knee * sum(knee_ratios) / len(knee_ratios)
        lengths["upper_leg"], lengths["lower_leg"] = hip - knee, knee - ankle
    _check_lengths({**lengths, "ankle_height": ankle}, stature)
    return _Skeleton(lengths, expected, ankle, leg_factor)


def _divide(
    total: float, names: tuple[str, ...], expected: Mapping[str, float]
) -> dict[str, float]:
    """Lengths of consecutive segments that sum to `total`, in proportion to the expected ones."""
    factor = total / sum(expected[name] for name in names)
    return {name: factor * expected[name] for name in names}


def _check_lengths(lengths: Mapping[str, float], stature: float) -> None:
    """Raise ModelError for the first length that is not positive."""
    for name, length in lengths.items():
        if not length > 0:
            raise ModelError(
                f"the measured dimensions do not fit a stature of {stature:g} m: "
                f"the {name.replace('_', ' ')} would be {length:.3g} m"
            )


def _shoulder_height(measures: Measures, skeleton: _Skeleton) -> float:
    """Height of the shoulder centres above the thorax joint [m].

    Without a measured acromial height it is a fixed fraction of the upper torso's length.
    """
    acromion = measures.dimensions["acromial_height"]
    if acromion.is_measured:
        above = skeleton.lengths["head"] + skeleton.lengths["upper_torso"]
        return acromion.value - SHOULDER_BELOW_ACROMION - (measures.stature - above)
    above = skeleton.expected["head"] + skeleton.expected["upper_torso"]
    expected = acromion.expected - SHOULDER_BELOW_ACROMION - (measures.stature - above)
    return expected * skeleton.lengths["upper_torso"] / skeleton.expected["upper_torso"]


def _check_shoulders(body: Body) -> None:
    """Raise ModelError for shoulders beyond the upper torso or on one another."""
    length = body.segments["upper_torso"].length
    if not 0 < body.shoulder_height < length:
        raise ModelError(
            f"the acromial height does not fit the other dimensions: the shoulders would be "
            f"{body.shoulder_height:.3g} m above the lower end of the upper torso, "
            f"which is {length:.3g} m long"
        )
    if not body.shoulder_spacing > 0:
        raise ModelError(
            f"the biacromial breadth is too small: "
            f"the shoulder centres would be {body.shoulder_spacing:.3g} m from each other"
        )


def _list_sources(
    body: Body, table: SegmentTable, skeleton: _Skeleton, total: float
) -> Iterator[SourcedNumber]:
    """Sources of the numbers of a body."""
    for part in _PARTS:
        row, segment = table.row(part.segment, *part.ends), body.segments[part.name]
        yield from _list_segment_sources(part, row, segment, body, table, skeleton, total)
    yield from _list_joint_sources(body, table, skeleton)


def _list_segment_sources(
    part: _Part,
    row: SegmentRow,
    segment: BodySegment,
    body: Body,
    table: SegmentTable,
    skeleton: _Skeleton,
    total: float,
) -> Iterator[SourcedNumber]:
    """Sources of mass, length, centre and moments of inertia of one segment."""
    published, ends = table.reference, f"{row.ends[0]}-{row.ends[1]}"
    fraction = table.mass_fraction(part.segment)
    rule = f"{100 * fraction:.4g} % of the body's mass"
    if abs(total - 1) > 1e-9:
        rule += f", divided by {100 * total:.4g} %, the sum over all segments"
    yield SourcedNumber(part.name, "mass", segment.mass, "kg", Origin.PUBLISHED, published, rule)

    rule = (
        f"{ends} of the reference body, {1000 * row.length:.1f} mm, "
        f"times the stature over {table.stature} m"
    )
    if part.name in ("upper_leg", "lower_leg"):
        rule += f", times {skeleton.leg_factor:.4f}, so that the legs reach the ankle's height"
    change = segment.length / skeleton.expected[part.name]
    if abs(change - 1) > 1e-9:
        rule += f", times {change:.4f} by measured dimensions"
    yield SourcedNumber(part.name, "length", segment.length, "m", Origin.SCALED, published, rule)

    centre = f"{100 * row.centre:.2f} % of the length from {row.ends[0]} ({ends})"
    if part.name == "foot":
        yield SourcedNumber(
            *(part.name, "centre of mass in front of the ankle centre", segment.centre[0], "m"),
            *(
                Origin.ESTIMATE,
                published,
                f"{centre}; the ankle's place in the foot is an estimate",
            ),
        )
        yield SourcedNumber(
            *(part.name, "centre of mass below the ankle centre", segment.centre[2], "m"),
            *(Origin.ESTIMATE, None, "midway between ankle centre and sole; not published"),
        )
    else:
        side = "below" if part.is_limb else "above"
        yield SourcedNumber(
            *(part.name, f"centre of mass {side} its own joint", segment.centre[2], "m"),
            *(Origin.PUBLISHED, published, centre),
        )

    for axis, index, moment in zip("xyz", part.axes, segment.inertia, strict=True):
        yield SourcedNumber(
            *(part.name, f"moment of inertia about {axis}", moment, "kg m2", Origin.PUBLISHED),
            published,
            f"mass times the square of {100 * row.radii[index]:.1f} % of the length ({ends}), "
            f"{_AXIS_NAMES[index]}",
        )


def _list_joint_sources(
    body: Body, table: SegmentTable, skeleton: _Skeleton
) -> Iterator[SourcedNumber]:
    """Sources of the places of the joint centres."""
    shoulders = Reference(table.reference.text, Sureness.ONE_CODE, table.reference.doi, "table 2")
    men_only = "" if body.measures.sex is Sex.MALE else "; measured in men only"
    yield SourcedNumber(
        *("person", "length factor of the legs", skeleton.leg_factor, "", Origin.SCALED),
        table.reference,
        "one factor of thigh and shank closes the chain from the vertex to the ankle centre: "
        "the table's legs do not",
    )
    yield SourcedNumber(
        *("foot", "height of the ankle centre", body.ankle_height, "m", Origin.PUBLISHED),
        table.reference,
        f"lateral malleolus height of ANSUR II less {1000 * ANKLE_BELOW_MALLEOLUS:g} mm, "
        "the shank's length to the ankle centre less that to the malleolus",
    )
    yield SourcedNumber(
        *("foot", "distance of the heel behind the ankle centre", body.heel_distance, "m"),
        *(Origin.ESTIMATE, None, f"{HEEL_DISTANCE_OVER_FOOT_LENGTH:g} of the foot's length"),
    )
    yield SourcedNumber(
        *("lower_torso", "distance of the hip centres", body.hip_spacing, "m", Origin.ESTIMATE),
        None,
        f"{HIP_SPACING_OVER_STATURE:g} of the stature, from regressions of men on the breadth of "
        "the pelvis that spread by 0.006",
    )
    yield SourcedNumber(
        *("upper_torso", "distance of the shoulder centres", body.shoulder_spacing, "m"),
        *(Origin.ESTIMATE, None),
        f"biacromial breadth less twice {1000 * SHOULDER_INSIDE_ACROMION:g} mm",
    )
    yield SourcedNumber(
        *("upper_torso", "height of the shoulder centres above its own joint"),
        *(body.shoulder_height, "m", Origin.ESTIMATE if men_only else Origin.SCALED, shoulders),
        f"acromial height of ANSUR II less {1000 * SHOULDER_BELOW_ACROMION:g} mm{men_only}",
    )
