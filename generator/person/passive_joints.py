"""The passive joints of a person: published curves, scaled to the body, with damping by a ratio.

`data/passive_joints.toml` names the curve of each rotation and the reason for its choice. Torques
are those of the curve's own sample times m H^2 over that of the sample's mean body. Damping follows
from a damping ratio of the limb that swings about the joint (`generator.person.limb_pendulum`).
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import repeat
from math import degrees, pi, radians, sqrt
from textwrap import fill

from generator.diagnostics import UsageError
from generator.person.body import SIDES, Body
from generator.person.joints import (
    PERSON_JOINTS,
    SLIDING_JOINT,
    JointRotation,
    JointSlide,
    PersonJoint,
    motion_range,
    slide_rows,
)
from generator.person.limb_pendulum import LimbPendulum, limb_pendulum
from generator.person.passive_laws import (
    LawContext,
    PassiveLaw,
    Row,
    angle_from_degrees,
    build_law,
    rest_stiffness,
)
from generator.person.sources import DataFile, Origin, SourcedNumber, load_data_file
from generator.springs_file.axes import SLIDE_PREFIX
from generator.springs_file.coupled import CoupledEntry
from generator.springs_file.laws import SlideEntry
from generator.springs_file.parse import REACH_AXES, SpringEntry, SpringsFile
from generator.springs_file.published import PublishedLaw
from generator.springs_file.reach import ReachEntry
from springs import Damping, ReachPoint, SphericalLaw, TurnRange
from springs.elastic import Elastic, Range
from springs.exponential import Exponential
from springs.interpolated import Interpolated
from springs.linear import Linear
from springs.published.parse import parse_reference
from springs.published.reference import Reference
from springs.published.tables import coupled_law
from springs.short_repr import short_repr
from springs.smooth_limit import SmoothLimit

PERSON_SPRINGS = ("published", "riener", "coupled", "none")
"""Springs of a person: "coupled" is the former name of what is now "published"."""

HIP_DATUM, MAX_HIP_DATUM = radians(10.0), radians(15.0)
"""Hip flexion of an upright person in the coordinate of Silder et al., and the largest [rad]."""

_DATA_FILE = "passive_joints"
_COMMENT_WIDTH = 96
_ESTIMATE = "An estimate, not from a study"

_ROTATIONS = {
    (joint.name, rotation.motion): (joint, rotation)
    for joint in PERSON_JOINTS
    for rotation in joint.rotations
}
"""Joint and rotation of a row of the data file."""


@short_repr
@dataclass(frozen=True)
class PassiveAxis:
    """The passive law about an axis of a joint of a person, and on both sides.

    Attributes:
        joint: joint without side.
        axis: "x", "y" or "z", or None for a hinge.
        motion: name of a positive angle.
        names: names of the joints in the figure.
        origin: origin of the law.
        law: law of the sample's mean body.
        scale: factor of its torques for the person.
        scale_rule: how the factor follows.
        ratio: damping ratio of the limb.
        ratio_origin: ratio origin of the ratio.
        ratio_reference: ratio reference of the ratio, or None.
        ratio_rule: how the ratio was found.
        pendulum: what swings about the axis.
        stiffness: stiffness of the scaled law at rest [N m/rad].
        choice: why this law was chosen.
    """

    joint: str
    axis: str | None
    motion: str
    names: tuple[str, ...]
    origin: Origin
    law: PassiveLaw
    scale: float
    scale_rule: str
    ratio: float
    ratio_origin: Origin
    ratio_reference: Reference | None
    ratio_rule: str
    pendulum: LimbPendulum
    stiffness: float
    choice: str

    @property
    def damping(self) -> Damping:
        """Viscous damping of the ratio."""
        return Damping(round_significant(self.pendulum.damping(self.ratio, self.stiffness)))

    @property
    def reference(self) -> str:
        """Publications of law and damping, with the label of an estimate."""
        damping = () if self.ratio_reference is None else (f"damping: {self.ratio_reference}",)
        cited = "; ".join((*map(str, self.law.references), *damping))
        match self.origin:
            case Origin.ESTIMATE:
                return _ESTIMATE
            case Origin.SCALED:
                return f"Partly an estimate, after {cited}"
            case _:
                return cited

    @property
    def why(self) -> str:
        """Choice and rule of the law, its factor and its damping, in sentences."""
        label = "An estimate. " if self.origin is Origin.ESTIMATE else ""
        parts = (f"{label}{self.choice}", self.law.rule, self.scale_rule, self.damping_rule)
        return " ".join(part for part in parts if part)

    @property
    def damping_rule(self) -> str:
        """Rule of the damping, in a sentence."""
        label = ", an estimate" if self.ratio_origin is Origin.ESTIMATE else ""
        frequency = self.pendulum.frequency(self.stiffness)
        return (
            f"Damping: {self.ratio:g} of the critical one{label} ({self.ratio_rule}), for a limb "
            f"that swings at {frequency:.3g} rad/s."
        )

    @property
    def damping_reference(self) -> str:
        """Publication of the damping ratio, or that it is an estimate."""
        return _ESTIMATE if self.ratio_reference is None else str(self.ratio_reference)


@short_repr
@dataclass(frozen=True)
class PassiveSlide:
    """The spring and the damping along a translation of an elastic neck.

    Attributes:
        slide: translation.
        stiffness: stiffness of its spring [N/m].
        limit: displacement at which a stop begins, in both senses [m].
        origin: origin of stiffness and limit.
        mass: mass that moves along it, that of the head [kg].
        ratio: damping ratio of this mass on the spring.
        ratio_origin: origin of the ratio.
        ratio_rule: how the ratio was found.
        choice: why the stiffness was chosen.
    """

    slide: JointSlide
    stiffness: float
    limit: float
    origin: Origin
    mass: float
    ratio: float
    ratio_origin: Origin
    ratio_rule: str
    choice: str

    @property
    def damping(self) -> Damping:
        """Viscous damping of the ratio [N s/m]."""
        return Damping(round_significant(2.0 * self.ratio * sqrt(self.stiffness * self.mass)))

    @property
    def damping_rule(self) -> str:
        """Rule of the damping, in a sentence."""
        frequency = sqrt(self.stiffness / self.mass)
        return (
            f"Damping: {self.ratio:g} of the critical one, an estimate ({self.ratio_rule}), for "
            f"the head, {self.mass:.4g} kg, which swings along it at {frequency:.3g} rad/s."
        )

    @property
    def entry(self) -> SpringEntry:
        """Table of a springs file."""
        return SpringEntry(
            (SLIDING_JOINT,),
            f"{SLIDE_PREFIX}{self.slide.axis_name}",
            SlideEntry(self.stiffness),
            damping=self.damping,
            motion=self.slide.motion,
            reference=_ESTIMATE,
            why=f"An estimate. {self.choice} {self.damping_rule}",
        )

    @property
    def sources(self) -> tuple[SourcedNumber, ...]:
        """Its numbers with their origin."""
        rows = (
            ("stiffness", self.stiffness, "N/m", self.origin, self.choice),
            ("limit in both senses", self.limit, "m", self.origin, self.choice),
            ("damping ratio of the head", self.ratio, "", self.ratio_origin, self.ratio_rule),
            ("viscous damping", self.damping.viscous, "N s/m", Origin.ESTIMATE, self.damping_rule),
        )
        return tuple(
            SourcedNumber(
                SLIDING_JOINT, f"{self.slide.motion}: {name}", value, unit, origin, None, rule
            )
            for name, value, unit, origin, rule in rows
        )


def neck_slides(body: Body) -> tuple[PassiveSlide, ...]:
    """Return the springs along the translations of an elastic neck, the same for all persons."""
    damping = load_data_file(_DATA_FILE).content["damping"]
    slides: list[PassiveSlide] = []
    for slide, row in slide_rows():
        ratio = damping[row["damping"]]
        slides.append(
            PassiveSlide(
                slide,
                row["stiffness_N_m"],
                row["limit_m"],
                Origin(row["kind"]),
                body.segments["head"].mass,
                ratio["ratio"],
                Origin(ratio["kind"]),
                ratio["why"].strip(),
                row["why"].strip(),
            )
        )
    return tuple(slides)


def springs_comment() -> str:
    """Lines on the scaling of the torques and on the damping, for the head of a springs file."""
    scale = "Torques are scaled with mass times stature squared."
    damping = (
        "Damping follows from a damping ratio of the limb that swings about the joint. Arms and "
        "legs hang straight, and a limb that turns about its length is bent at a right angle. At a "
        "joint of the trunk the parts above it swing as if they hung."
    )
    notes = (f"{scale} {load_data_file(_DATA_FILE).note}", damping)
    return "\n\n".join(fill(note, _COMMENT_WIDTH) for note in notes)


def person_springs(
    axes: Iterable[PassiveAxis],
    leg: SpringsFile,
    reach: SpringsFile,
    slides: Iterable[PassiveSlide] = (),
) -> SpringsFile:
    """Return the passive springs of a person: one curve an axis but for those of leg and reach.

    Args:
        axes: the `passive_axes` of the person.
        leg: its `leg_springs`.
        reach: its `reach_springs`.
        slides: its `neck_slides`, for an elastic neck.
    """
    axes = tuple(axes)
    own = {(entry.joints, entry.axis): entry for entry in (*leg.entries, *reach.entries)}
    entries = [own.pop((axis.names, axis.axis), None) or _entry(axis) for axis in axes]
    return SpringsFile(
        (*entries, *own.values(), *(slide.entry for slide in slides)),
        law=SphericalLaw.COORDINATES,
        coupled=leg.coupled,
        reaches=reach.reaches,
    )


def reach_springs(body: Body, axes: Iterable[PassiveAxis]) -> SpringsFile:
    """Return the reach of the arms with its laws, and the damping of the shoulders.

    Args:
        body: the person.
        axes: the `passive_axes` of the person, of which the damping is taken.
    """
    data = load_data_file(_DATA_FILE)
    row = data.content["reach"]
    shoulders = [axis for axis in axes if axis.joint == row["joint"]]
    names, (scale, rule) = shoulders[0].names, _scale(body, row, data)
    plane, elevation = _radians(row["centre_deg"])
    reach = ReachEntry(
        names,
        row["long_axis"],
        tuple(row["planes"]),
        (plane, elevation),
        tuple(ReachPoint(*_radians(point)) for point in row["boundary_deg"]),
        tuple(
            TurnRange(ReachPoint(plane, elevation), lower, upper)
            for plane, elevation, lower, upper in map(_radians, row["turns_deg"])
        ),
        reference=str(parse_reference(row)),
        why=row["why"].strip(),
    )
    laws = [
        SpringEntry(
            names,
            axis,
            _wall(row[key]).law,
            scale,
            reference="; ".join(map(str, _wall(row[key]).references)),
            why=rule,
        )
        for axis, key in zip(REACH_AXES, ("beyond", "turn"), strict=True)
    ]
    return SpringsFile((*map(_damping_entry, shoulders), *laws), reaches=(reach,))


def _wall(row: Row) -> PassiveLaw:
    """Return the wall of an angle beyond an end."""
    wall = build_law({"wall": row}, LawContext((-pi, 0.0)))
    assert isinstance(wall.law, SmoothLimit)
    law = replace(wall.law, lower=-pi, lower_stiffness=0.0, valid_range=None)
    return replace(wall, law=law)


def _radians(values: Iterable[float]) -> tuple[float, ...]:
    return tuple(map(angle_from_degrees, values))


def leg_springs(
    body: Body, axes: Sequence[PassiveAxis], kind: str = "published", hip_datum: float = HIP_DATUM
) -> SpringsFile:
    """Return the springs of hip, knee and ankle in the sagittal plane, with one law over them.

    Args:
        body: the person.
        axes: the `passive_axes` of the person, of which the damping is taken.
        kind: "published" for the law of all three, "riener" for that of hip and knee.
        hip_datum: hip flexion of the upright person in the coordinate of the source of
            "published", from 0 to `MAX_HIP_DATUM` [rad].

    Raises:
        UsageError: for another hip datum.
    """
    check_hip_datum(hip_datum)
    data = load_data_file(_DATA_FILE)
    leg = data.content["leg"][kind]
    own = {f"{each.joint} {each.motion}": each for each in axes}
    damped = [own[f"{joint} {name.split()[1]}"] for name, joint in leg["angles"].items()]
    ankle = own["ankle dorsiflexion"]
    is_whole = ankle in damped
    last = _entry(dorsiflexors(body, ankle) if is_whole else ankle)
    hip, knee = damped[:2]
    entries = (_damping_entry(hip), _entry(thigh_calf_contact(body, knee)), last)
    scale, rule = _scale(body, leg, data)
    row = coupled_law(leg["published"])
    coupled = CoupledEntry(
        joints=tuple(tuple(f"{side}_{name}" for name in leg["angles"].values()) for side in SIDES),
        coordinates=tuple(leg["angles"]),
        axes=tuple(each.axis for each in damped),
        senses=(1,) * len(damped),
        published=leg["published"],
        held_angles=tuple(
            (name, angle_from_degrees(angle)) for name, angle in leg["held_deg"].items()
        ),
        is_nearest_conservative=not is_whole,
        scale=scale,
        offsets=(-hip_datum if is_whole else 0.0,) + (0.0,) * (len(damped) - 1),
        reference=str(row.reference),
        why=f"{leg['why'].strip()} {rule}",
    )
    return SpringsFile(entries, coupled=(coupled,))


def check_hip_datum(value: float) -> None:
    """Raise UsageError for a hip datum [rad] that no person has."""
    if not 0.0 <= value <= MAX_HIP_DATUM:
        limits = f"from 0 to {degrees(MAX_HIP_DATUM):g} deg"
        raise UsageError(f"the hip datum is {limits}, not {degrees(value):g} deg")


def dorsiflexors(body: Body, ankle: PassiveAxis) -> PassiveAxis:
    """Return the ankle with what resists plantarflexion beside the law of the leg."""
    row = load_data_file(_DATA_FILE).content["dorsiflexors"]
    whole = build_law(row, LawContext(_normal_range(body, ankle.joint, ankle.motion)))
    assert isinstance(whole.law, Exponential)
    terms = tuple(term for term in whole.law.terms if term.amplitude > 0.0)
    law = replace(whole, law=replace(whole.law, terms=terms, constant=0.0))
    return replace(ankle, law=law, origin=Origin(row["kind"]), choice=row["why"].strip())


def thigh_calf_contact(body: Body, knee: PassiveAxis) -> PassiveAxis:
    """Return the knee with the contact of thigh and calf, which stands beside a law of the leg."""
    row = load_data_file(_DATA_FILE).content["thigh_calf"]
    law = build_law(row, LawContext(_normal_range(body, knee.joint, knee.motion)))
    return replace(knee, law=law, origin=Origin(row["kind"]), choice=row["why"].strip())


def _normal_range(body: Body, joint: str, motion: str) -> Range:
    """Ends of the normal range of a rotation [rad]."""
    low, high = motion_range(*_ROTATIONS[joint, motion], body.measures.sex)
    return low.angle, high.angle


def passive_axes(body: Body) -> tuple[PassiveAxis, ...]:
    """Return the passive laws of all joints of a person, one an axis."""
    data = load_data_file(_DATA_FILE)
    laws: dict[tuple[str, str], tuple[Elastic, Range]] = {}
    axes: list[PassiveAxis] = []
    for row in data.content["axis"]:
        joint, rotation = _ROTATIONS[row["joint"], row["motion"]]
        limits = _normal_range(body, joint.name, rotation.motion)
        series = laws.get((row.get("in_series_with", ""), rotation.axis_name))
        law = build_law(row, LawContext(limits, series))
        laws[joint.name, rotation.axis_name] = law.elastic, limits
        axes.append(_passive_axis(body, data, row, joint, rotation, law, limits))
    return tuple(axes)


def _passive_axis(
    body: Body,
    data: DataFile,
    row: Row,
    joint: PersonJoint,
    rotation: JointRotation,
    law: PassiveLaw,
    limits: Range,
) -> PassiveAxis:
    scale, scale_rule = _scale(body, row, data)
    ratio = data.content["damping"][row["damping"]]
    return PassiveAxis(
        joint=joint.name,
        axis=rotation.axis_name if len(joint.rotations) > 1 else None,
        motion=rotation.motion,
        names=joint.names,
        origin=Origin(row["kind"]),
        law=law,
        scale=scale,
        scale_rule=scale_rule,
        ratio=ratio["ratio"],
        ratio_origin=Origin(ratio["kind"]),
        ratio_reference=parse_reference(ratio) if "reference" in ratio else None,
        ratio_rule=ratio["why"].strip(),
        pendulum=limb_pendulum(body, joint.name, rotation.axis_name),
        stiffness=scale * rest_stiffness(law.elastic, limits),
        choice=row["why"].strip(),
    )


def _scale(body: Body, row: Row, data: DataFile) -> tuple[float, str]:
    """Factor of torques from the sample's mean body to the person, and its rule in words."""
    sample = data.content["bodies"][row["body"]]
    mass, stature = body.measures.mass, body.measures.stature
    scale = mass * stature**2 / (sample["mass_kg"] * sample["stature_m"] ** 2)
    rule = (
        f"Torques are scaled by m H^2, {mass:.4g} kg x ({stature:.4g} m)^2 over "
        f"{sample['mass_kg']:g} kg x ({sample['stature_m']:g} m)^2, {sample['why']}; "
        f"the rule is that of {data.reference.text.partition(', ')[0]} 1999 for children's knees."
    )
    return round_significant(scale), rule


def round_significant(value: float) -> float:
    """Return a number with five significant digits."""
    return float(f"{value:.5g}")


def _entry(axis: PassiveAxis) -> SpringEntry:
    return SpringEntry(
        joints=axis.names,
        axis=axis.axis,
        law=axis.law.law,
        scale=axis.scale,
        damping=axis.damping,
        motion=axis.motion,
        reference=axis.reference,
        why=axis.why,
    )


def _damping_entry(axis: PassiveAxis) -> SpringEntry:
    return SpringEntry(
        joints=axis.names,
        axis=axis.axis,
        damping=axis.damping,
        motion=axis.motion,
        reference=axis.damping_reference,
        why=axis.damping_rule,
    )


def spring_sources(
    body: Body, axes: Iterable[PassiveAxis], others: Iterable[SpringsFile]
) -> tuple[SourcedNumber, ...]:
    """Return every number of a person's springs with its source, those of legs and reach last.

    Args:
        body: the person.
        axes: axes of `passive_axes`.
        others: springs of `leg_springs` and `reach_springs`.
    """
    axes, others = tuple(axes), tuple(others)
    leg_axes = [
        {*zip(zip(*entry.joints, strict=True), entry.axes, strict=True)}
        for one in others
        for entry in one.coupled
    ]

    reached = {name for one in others for entry in one.reaches for name in entry.joints}

    def has_own_law(axis: PassiveAxis) -> bool:
        is_covered = all((axis.names, axis.axis) in covered for covered in leg_axes)
        return not is_covered and not reached & set(axis.names)

    rows = [row for axis in axes for row in _axis_sources(axis, has_own_law(axis))]
    knee = next(axis for axis in axes if axis.joint == "knee")
    rows += _law_sources(thigh_calf_contact(body, knee), "thigh-calf contact")
    ankle = next(axis for axis in axes if (axis.joint, axis.motion) == ("ankle", "dorsiflexion"))
    rows += _law_sources(dorsiflexors(body, ankle), "dorsiflexors")
    rows += [row for one in others for entry in one.coupled for row in _coupled_sources(entry)]
    rows += [row for one in others for entry in one.reaches for row in _reach_sources(entry, one)]
    return tuple(rows)


def _law_sources(axis: PassiveAxis, name: str) -> Iterator[SourcedNumber]:
    """The numbers of the elastic law of an axis."""
    law = axis.law
    rule = " ".join(filter(None, (axis.choice, law.rule)))
    first = law.references[0] if law.references else None
    references = law.point_references or repeat(first)
    for (quantity, value, unit), reference in zip(_law_numbers(law.law), references, strict=False):
        label = f"{name}: {quantity}"
        yield SourcedNumber(axis.joint, label, value, unit, axis.origin, reference, rule)


def _axis_sources(axis: PassiveAxis, is_elastic: bool) -> Iterator[SourcedNumber]:
    part, motion = axis.joint, axis.motion
    if is_elastic:
        yield from _law_sources(axis, motion)
    yield SourcedNumber(
        *(part, f"{motion}: factor of the torque", axis.scale, "", Origin.SCALED),
        _scaling_reference(),
        f"{axis.scale_rule} {load_data_file(_DATA_FILE).note}",
    )
    yield SourcedNumber(
        *(part, f"{motion}: damping ratio of the limb", axis.ratio, "", axis.ratio_origin),
        axis.ratio_reference,
        axis.ratio_rule,
    )
    published = axis.ratio_origin is Origin.PUBLISHED
    yield SourcedNumber(
        *(part, f"{motion}: viscous damping", axis.damping.viscous, "N m s/rad"),
        Origin.SCALED if published else Origin.ESTIMATE,
        axis.ratio_reference,
        axis.damping_rule,
    )


def _law_numbers(law: Elastic | PublishedLaw) -> Iterator[tuple[str, float, str]]:
    """Quantity, value and unit of the numbers of a law, before its factor."""
    if isinstance(law, PublishedLaw):
        yield from _printed_numbers(law)
        return
    match law:
        case Interpolated():
            for angle, torque in law.points:
                yield f"torque at {degrees(angle):.6g} deg", torque, "N m"
        case SmoothLimit():
            yield "lower limit", law.lower, "rad"
            yield "upper limit", law.upper, "rad"
            yield "stiffness beyond the lower limit", law.lower_stiffness, "N m/rad"
            yield "stiffness beyond the upper limit", law.upper_stiffness, "N m/rad"
            yield "angle over which it grows", law.transition, "rad"
        case Exponential():
            for k, term in enumerate(law.terms, start=1):
                yield f"amplitude of exponential {k}", term.amplitude, "N m"
                yield f"rate of exponential {k}", term.rate, "1/rad"
            yield "constant torque", law.constant, "N m"
        case Linear():
            yield "stiffness", law.stiffness, "N m/rad"
            yield "rest", law.rest, "rad"
        case _:
            raise TypeError(f"a person has no law {type(law).__name__}")


def _printed_numbers(law: PublishedLaw) -> Iterator[tuple[str, float, str]]:
    """The law's numbers in SI: those of the law that the printed ones make."""
    made = law.law
    if isinstance(made, Interpolated | SmoothLimit | Exponential | Linear):
        yield from _law_numbers(made)
    else:
        for name, value in law.row.printed.coefficients.items():
            yield f"{name} as printed", value, ""


def _reach_sources(entry: ReachEntry, springs: SpringsFile) -> Iterator[SourcedNumber]:
    """The numbers of the reach of the arms."""
    row = load_data_file(_DATA_FILE).content["reach"]
    source, origin = parse_reference(row), Origin(row["kind"])
    part = row["joint"]

    def number(quantity: str, value: float) -> SourcedNumber:
        return SourcedNumber(part, f"reach: {quantity}", value, "rad", origin, source, entry.why)

    plane, elevation = entry.centre
    yield number("plane of the centre", plane)
    yield number("elevation of the centre", elevation)
    for point in entry.boundary:
        where = f"in plane {degrees(point.plane):.4g} deg"
        yield number(f"elevation of the boundary {where}", point.elevation)
    for turn in entry.turns:
        where = f"in plane {degrees(turn.at.plane):.4g} deg at {degrees(turn.at.elevation):.4g} deg"
        yield number(f"lowest turn {where}", turn.lower)
        yield number(f"highest turn {where}", turn.upper)
    for law in springs.entries:
        if law.axis in REACH_AXES and isinstance(law.law, SmoothLimit):
            reference = _wall(row["beyond" if law.axis == REACH_AXES[0] else "turn"]).references[0]
            for quantity, value, unit in _law_numbers(law.law):
                label = f"{law.axis}: {quantity}"
                yield SourcedNumber(part, label, value, unit, Origin.SCALED, reference, law.why)
            label = f"{law.axis}: factor of the torque"
            yield SourcedNumber(
                part, label, law.scale, "", Origin.SCALED, _scaling_reference(), law.why
            )


def _coupled_sources(entry: CoupledEntry) -> Iterator[SourcedNumber]:
    """The numbers of a law of the leg as published, with its factor and the hip's datum."""
    assert entry.published is not None
    reference: Reference = coupled_law(entry.published).reference
    law, part = entry.unmodified_law, " and ".join(entry.joints[0]).replace("left_", "")
    for k, term in enumerate(law.terms, start=1):
        numbers = [("exponent at zero angles", term.exponent, "")]
        for name, amplitude, rate in zip(law.coordinates, term.amplitudes, term.rates, strict=True):
            numbers += [(f"torque about {name}", amplitude, "N m"), (name, rate, "1/rad")]
        for quantity, value, unit in numbers:
            label = f"law of the leg, exponential {k}: {quantity}"
            yield SourcedNumber(part, label, value, unit, Origin.PUBLISHED, reference, entry.why)
    for name, constant in zip(law.coordinates, law.constants, strict=True):
        label = f"law of the leg, constant about {name}"
        yield SourcedNumber(part, label, constant, "N m", Origin.PUBLISHED, reference, entry.why)
    yield SourcedNumber(
        *(part, "law of the leg: factor of the torques", entry.scale, "", Origin.SCALED),
        _scaling_reference(),
        entry.why,
    )
    if not entry.held_angles:
        label, datum = "law of the leg: hip flexion of the upright person", -entry.offsets[0]
        yield SourcedNumber(part, label, datum, "rad", Origin.ESTIMATE, None, entry.why)


def _scaling_reference() -> Reference:
    """Publication of the rule by which the torques are scaled."""
    return load_data_file(_DATA_FILE).reference
