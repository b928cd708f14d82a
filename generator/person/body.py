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
from generator.person.measures import Measures
from generator.person.segment_regression import (
    BuildChange,
    build_change,
    zatsiorsky_regressions,
)
from generator.person.segment_table import SegmentRow, SegmentTable, de_leva_table
from generator.person.sources import Origin, SourcedNumber
from generator.person.survey import Sex, survey
from springs.published.reference import Reference, Sureness
from springs.short_repr import short_repr

TRUNK_SEGMENTS = ("lower_torso", "middle_torso", "upper_torso", "head")
"""From the hips up."""

ARM_SEGMENTS = ("upper_arm", "lower_arm", "hand")
LEG_SEGMENTS = ("upper_leg", "lower_leg", "foot")
LIMB_SEGMENTS = (*ARM_SEGMENTS, *LEG_SEGMENTS)
"""From the trunk outward; each of them on both sides."""

SIDES = ("left", "right")


def side_names(segment: str) -> tuple[str, ...]:
    """Return the names in the figure of a segment: `head`, or `left_foot` and `right_foot`."""
    return tuple(f"{side}_{segment}" for side in SIDES) if segment in LIMB_SEGMENTS else (segment,)


@short_repr
@dataclass(frozen=True)
class BodySegment:
    """A rigid segment of a person.

    Attributes:
        name: name without side.
        length: length from its own joint to the next one [m]; of the head to the vertex, of the
            hand to the third fingertip, of the foot from heel to toe.
        mass: [kg].
        centre: centre of mass in the segment's frame [m].
        inertia: principal moments about the centre of mass, along the segment's axes [kg m2].
    """

    name: str
    length: float
    mass: float
    centre: Vector
    inertia: Vector


@short_repr
@dataclass(frozen=True)
class Body:
    """A person's body, standing upright with arms down, thumbs forward.

    Attributes:
        measures: measures from which it was made.
        segments: segments by their names without side.
        hip_spacing: distance of the hip centres [m].
        shoulder_spacing: distance of the shoulder centres [m].
        shoulder_height: shoulder height of the shoulder centres above the thorax joint, in the
            upper torso [m].
        ankle_height: ankle height of the ankle centres above the sole [m].
        heel_distance: heel distance of the rear of the heel behind the ankle centre [m].
        sources: sources of the numbers above.
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
        legs = self.segments["upper_leg"].length + self.segments["lower_leg"].length
        return legs + self.ankle_height


@dataclass(frozen=True)
class _Part:
    """Segment of a body in the terms of the published table.

    Attributes:
        name: name of ours.
        segment: segment of the table.
        ends: end points of the row.
        axes: axes of the table (0 sagittal, 1 transverse, 2 longitudinal) along x, y, z of ours.
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

# Offsets between landmarks and joint centres; `_offset` scales them beyond the sample.
ANKLE_BELOW_MALLEOLUS = 0.006
"""Ankle centre below the tip of the lateral malleolus [m]: KJC-AJC less KJC-LMAL, 6.3 mm."""

WRIST_BEYOND_STYLION = 0.002
"""Wrist centre beyond the radial stylion [m]: length STYL-DAC3 less WJC-DAC3."""

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
"""Dimensions that change the length of a segment by their ratio to the expected ones."""

_SURVEYED_LENGTHS = {
    "hand": "hand length less {} (de Leva 1996: STYL-DAC3 less WJC-DAC3)",
    "foot": "foot length",
}
"""Lengths that are the survey's: those of the table are 9 to 13 % shorter in women.

Centres of mass are the table's fractions of them; radii of gyration are in metres the table's.
"""


def build_body(measures: Measures) -> Body:
    """Build the body of a person: de Leva's segments, with legs that close the stature.

    Far from the build of de Leva's bodies, masses and radii of gyration change with it by
    Zatsiorsky's regressions (`segment_regression`).

    Raises:
        ModelError: for dimensions that do not fit each other or the stature.
    """
    table = de_leva_table(measures.sex)
    skeleton = _build_skeleton(measures, table)
    fractions = {part.name: table.mass_fraction(part.segment) for part in _PARTS}
    total = sum(fractions[part.name] * (2 if part.is_limb else 1) for part in _PARTS)
    change = build_change(measures.sex, measures.stature, measures.mass)
    heel_distance = HEEL_DISTANCE_OVER_FOOT_LENGTH * skeleton.lengths["foot"]
    segments: dict[str, BodySegment] = {}
    for part in _PARTS:
        row, length = table.row(part.segment, *part.ends), skeleton.lengths[part.name]
        mass = measures.mass * fractions[part.name] / total
        if change is not None:
            mass = measures.mass * change.blend(fractions[part.name] / total, part.segment)
        moments = [mass * (radius * skeleton.table_lengths[part.name]) ** 2 for radius in row.radii]
        if change is not None:
            factors = change.moment_factors(part.segment)
            moments = [one * factor for one, factor in zip(moments, factors, strict=True)]
        x, y, z = (moments[axis] for axis in part.axes)
        along = (row.centre if part.is_limb else 1 - row.centre) * length
        centre = (0.0, 0.0, along)
        if part.name == "foot":
            centre = (along - heel_distance, 0.0, skeleton.ankle_height / 2)
        segments[part.name] = BodySegment(part.name, length, mass, centre, (x, y, z))
    neck_height = measures.stature - segments["head"].length
    thorax_height = neck_height - segments["upper_torso"].length
    shoulder_below = _offset(measures, SHOULDER_BELOW_ACROMION)
    shoulder_height = measures.length("acromial_height") - shoulder_below - thorax_height
    body = Body(
        measures=measures,
        segments=segments,
        hip_spacing=HIP_SPACING_OVER_STATURE * measures.stature,
        shoulder_spacing=measures.length("biacromial_breadth")
        - 2 * _offset(measures, SHOULDER_INSIDE_ACROMION),
        shoulder_height=shoulder_height,
        ankle_height=skeleton.ankle_height,
        heel_distance=heel_distance,
    )
    _check_shoulders(body)
    sources = (
        *_segment_sources(body, table, skeleton, total, change),
        *_joint_sources(body, table),
    )
    return replace(body, sources=sources)


def _offset(measures: Measures, metres: float) -> float:
    """Offset between a landmark and a joint centre, beyond the sample scaled as its lengths [m]."""
    return metres * survey().length_factor(measures.sex, measures.stature)


def _offset_text(measures: Measures, metres: float) -> str:
    """The offset in mm."""
    return f"{1000 * _offset(measures, metres):.3g} mm"


@dataclass(frozen=True)
class _Skeleton:
    """Lengths that close the stature.

    Attributes:
        lengths: lengths of the segments [m].
        table_lengths: table lengths of the table, to which its radii of gyration refer, changed as
            the segments [m]; those of hand and foot differ from the lengths.
        expected: expected of `table_lengths` by sex, stature and mass alone [m].
        ankle_height: ankle height of the ankle centres above the sole [m].
        leg_factor: leg factor of the expected thigh and shank, over the table's scaled to the
            stature.
    """

    lengths: Mapping[str, float]
    table_lengths: Mapping[str, float]
    expected: Mapping[str, float]
    ankle_height: float
    leg_factor: float


def _build_skeleton(measures: Measures, table: SegmentTable) -> _Skeleton:
    """Scale the table with the stature, close the legs, and change measured dimensions."""
    stature, scale = measures.stature, measures.stature / table.stature
    expected = {part.name: scale * table.row(part.segment, *part.ends).length for part in _PARTS}
    malleolus = measures.dimensions["lateral_malleolus_height"]
    ankle_below = _offset(measures, ANKLE_BELOW_MALLEOLUS)
    ankle = malleolus.expected - ankle_below
    hip = stature - sum(expected[name] for name in TRUNK_SEGMENTS)
    leg_factor = (hip - ankle) / (expected["upper_leg"] + expected["lower_leg"])
    expected["upper_leg"] *= leg_factor
    expected["lower_leg"] *= leg_factor
    knee, waist = ankle + expected["lower_leg"], hip + expected["lower_torso"]

    # Each joint of legs and trunk is moved as the landmark at its height.
    ankle = malleolus.value - ankle_below
    knee *= measures.ratio("lateral_femoral_epicondyle_height")
    hip *= measures.ratio("trochanterion_height")
    waist *= measures.ratio("waist_height")
    cervicale = measures.dimensions["cervicale_height"]
    head = expected["head"] * (stature - cervicale.value) / (stature - cervicale.expected)
    above_waist = expected["middle_torso"] + expected["upper_torso"]
    chest_factor = (stature - head - waist) / above_waist
    table_lengths = {
        **expected,
        "lower_torso": waist - hip,
        "middle_torso": chest_factor * expected["middle_torso"],
        "upper_torso": chest_factor * expected["upper_torso"],
        "head": head,
        "upper_leg": hip - knee,
        "lower_leg": knee - ankle,
    }
    for name, dimension in _LENGTH_DIMENSIONS.items():
        table_lengths[name] *= measures.ratio(dimension)
    lengths = {
        **table_lengths,
        "hand": measures.length("hand_length") - _offset(measures, WRIST_BEYOND_STYLION),
        "foot": measures.length("foot_length"),
    }
    _check_lengths({**lengths, "ankle_height": ankle}, stature)
    return _Skeleton(lengths, table_lengths, expected, ankle, leg_factor)


def _check_lengths(lengths: Mapping[str, float], stature: float) -> None:
    """Raise ModelError for the first length that is not positive."""
    for name, length in lengths.items():
        if not length > 0:
            raise ModelError(
                f"the measured dimensions do not fit a stature of {stature:g} m: "
                f"the {name.replace('_', ' ')} would be {length:.3g} m"
            )


def _check_shoulders(body: Body) -> None:
    """Raise ModelError for shoulders beyond the upper torso or without a distance."""
    length = body.segments["upper_torso"].length
    if not 0 < body.shoulder_height < length:
        raise ModelError(
            "the acromial height does not fit the other dimensions: the shoulders would be "
            f"{body.shoulder_height:.3g} m above the lower end of the upper torso, "
            f"which is {length:.3g} m long"
        )
    if not body.shoulder_spacing > 0:
        raise ModelError(
            "the biacromial breadth is too small: "
            f"the shoulder centres would be {body.shoulder_spacing:.3g} m from each other"
        )


def _segment_sources(
    body: Body,
    table: SegmentTable,
    skeleton: _Skeleton,
    total: float,
    change: BuildChange | None,
) -> Iterator[SourcedNumber]:
    """Sources of masses, lengths, centres and moments of inertia, and of the legs' factor.

    `total` is the sum of the fractions of mass.
    """
    if change is not None:
        yield _weight_source(change, body.measures.sex)
    published, by_sum = table.reference, ""
    if abs(total - 1) > 1e-9:
        by_sum = f", over the sum of all segments, {100 * total:.4g} %"
    yield SourcedNumber(
        *("person", "length factor of the legs", skeleton.leg_factor, "", Origin.SCALED, published),
        "one factor of thigh and shank brings the ankle from the hip to its height; "
        "the table's lengths alone do not sum to the stature",
    )
    for part in _PARTS:
        row, segment = table.row(part.segment, *part.ends), body.segments[part.name]
        ends = "-".join(row.ends)
        percent = 100 * table.mass_fraction(part.segment)
        origin, reference = _segment_origin(change, body.measures.sex, published)
        rule = f"{percent:.4g} % of the body's mass{by_sum}"
        if change is not None:
            rule = _changed_mass_rule(change, part.segment, body.measures.sex, rule)
        yield SourcedNumber(*(part.name, "mass", segment.mass, "kg", origin, reference), rule)
        rule, measured = _length_rule(part, row, table, skeleton), _SURVEYED_LENGTHS.get(part.name)
        if measured is None:
            yield SourcedNumber(
                *(part.name, "length", segment.length, "m", Origin.SCALED, published, rule)
            )
        else:
            table_length = skeleton.table_lengths[part.name]
            wrist_beyond = _offset_text(body.measures, WRIST_BEYOND_STYLION)
            yield SourcedNumber(
                *(part.name, "length", segment.length, "m", Origin.PUBLISHED),
                *(survey().reference, measured.format(wrist_beyond)),
            )
            yield SourcedNumber(
                *(part.name, "length of the radii of gyration", table_length, "m"),
                *(Origin.SCALED, published, rule),
            )
        centre = f"{100 * row.centre:.2f} % of the length from {row.ends[0]} ({ends})"
        if part.name == "foot":
            yield SourcedNumber(
                *(part.name, "centre of mass in front of the ankle centre", segment.centre[0]),
                *("m", Origin.ESTIMATE, published),
                f"{centre}; the distance from heel to ankle is an estimate",
            )
            yield SourcedNumber(
                *(part.name, "centre of mass below the ankle centre", segment.centre[2]),
                *("m", Origin.ESTIMATE, None),
                "midway between ankle centre and sole; not published",
            )
        else:
            side = "below" if part.is_limb else "above"
            yield SourcedNumber(
                *(part.name, f"centre of mass {side} its own joint", segment.centre[2], "m"),
                *(Origin.PUBLISHED, published, centre),
            )
        for axis, index, moment in zip("xyz", part.axes, segment.inertia, strict=True):
            rule = (
                f"mass times the square of {100 * row.radii[index]:.1f} % of the "
                f"{'length' if measured is None else 'length of the radii of gyration'} "
                f"({ends}), the {_AXIS_NAMES[index]} radius"
            )
            if change is not None:
                factor = change.moment_factors(part.segment)[index]
                rule += f" (de Leva 1996), times {factor:.4f}, its change with the build"
            yield SourcedNumber(
                *(part.name, f"moment of inertia about {axis}", moment, "kg m2"),
                *(origin, reference, rule),
            )


def _weight_source(change: BuildChange, sex: Sex) -> SourcedNumber:
    """Source of the weight with which the regressions replace the table."""
    nearest = ", the nearest to the person in their range" if change.is_nearest else ""
    rule = (
        "0 for a build and stature near the table's body, 1 far from it; evaluated for a man of "
        f"{change.stature:.4g} m and {change.mass:.4g} kg{nearest}"
    )
    if sex is Sex.FEMALE:
        rule += ", who has the woman's build: they were not measured in women"
    return SourcedNumber(
        *("person", "weight of the regressions on mass and stature", change.weight, ""),
        *(Origin.ESTIMATE, zatsiorsky_regressions().reference, rule),
    )


def _segment_origin(
    change: BuildChange | None, sex: Sex, table: Reference
) -> tuple[Origin, Reference]:
    """Origin of the masses and moments of a person, and its reference."""
    if change is None:
        return Origin.PUBLISHED, table
    reference = zatsiorsky_regressions().reference
    if sex is Sex.FEMALE:
        return Origin.ESTIMATE, reference
    is_blend = change.is_nearest or change.weight < 1.0
    return Origin.SCALED if is_blend else Origin.PUBLISHED, reference


def _changed_mass_rule(change: BuildChange, segment: str, sex: Sex, rule: str) -> str:
    """Rule of a mass by the regressions, and by the table where these have part of the weight."""
    fit, percent = zatsiorsky_regressions().segments[segment].mass, 100 * change.shares[segment]
    if sex is Sex.FEMALE:
        changed = (
            f"{percent:.4g} % of the body's mass, the table's share changed as a man's of this "
            f"build by the regression {fit}"
        )
    else:
        changed = f"{percent:.4g} % of the body's mass by the regression {fit}, over their sum"
    if change.weight == 1.0:
        return changed
    own = 1.0 - change.weight
    return f"{change.weight:.4g} of {changed}; and {own:.4g} of {rule} (de Leva 1996)"


def _length_rule(part: _Part, row: SegmentRow, table: SegmentTable, skeleton: _Skeleton) -> str:
    """Computation of a segment's length in words."""
    rule = (
        f"{'-'.join(row.ends)} of the reference body, {1000 * row.length:.1f} mm, "
        f"times the stature over {table.stature} m"
    )
    if part.name in ("upper_leg", "lower_leg"):
        rule += f", times {skeleton.leg_factor:.4f}, the length factor of the legs"
    change = skeleton.table_lengths[part.name] / skeleton.expected[part.name]
    return rule if abs(change - 1) < 1e-9 else f"{rule}, times {change:.4f} by measured dimensions"


def _joint_sources(body: Body, table: SegmentTable) -> Iterator[SourcedNumber]:
    """Sources of the places of the joint centres."""
    yield SourcedNumber(
        *("foot", "height of the ankle centre", body.ankle_height, "m", Origin.PUBLISHED),
        survey().reference,
        f"lateral malleolus height less {_offset_text(body.measures, ANKLE_BELOW_MALLEOLUS)} "
        "(de Leva 1996: KJC-AJC less KJC-LMAL, 6.3 mm)",
    )
    yield SourcedNumber(
        *("foot", "distance of the heel behind the ankle centre", body.heel_distance, "m"),
        *(Origin.ESTIMATE, None, f"{HEEL_DISTANCE_OVER_FOOT_LENGTH:g} of the foot's length"),
    )
    yield SourcedNumber(
        *("lower_torso", "distance of the hip centres", body.hip_spacing, "m"),
        *(Origin.ESTIMATE, None),
        f"{HIP_SPACING_OVER_STATURE:g} of the stature; regressions of the hip centre "
        "(Bell 1990, Harrington 2007, Hara 2016) give 0.099 to 0.106 in a man of mean size",
    )
    yield SourcedNumber(
        *("upper_torso", "distance of the shoulder centres", body.shoulder_spacing, "m"),
        *(Origin.ESTIMATE, None),
        f"biacromial breadth less twice {_offset_text(body.measures, SHOULDER_INSIDE_ACROMION)}",
    )
    is_male = body.measures.sex is Sex.MALE
    yield SourcedNumber(
        *("upper_torso", "height of the shoulder centres above its own joint"),
        *(body.shoulder_height, "m", Origin.PUBLISHED if is_male else Origin.ESTIMATE),
        Reference(table.reference.text, Sureness.ONE_CODE, table.reference.doi, "table 2"),
        f"acromial height less {_offset_text(body.measures, SHOULDER_BELOW_ACROMION)}"
        + ("" if is_male else ", which was measured in men only"),
    )
