"""The passive joints of a person: published curves, scaled to the body, with damping by a ratio.

`data/passive_joints.toml` holds what was chosen for each axis, and why. Torques are those of the
curve's own sample times m H^2 over that of the sample's mean body. Damping is that of a damping
ratio of the limb which the joint swings (`generator.person.limb_pendulum`).
"""

from dataclasses import dataclass

from generator.diagnostics import ModelError
from generator.figure import AxisKind, Figure
from generator.person.body import Body
from generator.person.data_files import DataFile, load_data_file
from generator.person.joints import SIDES
from generator.person.limb_pendulum import LimbPendulum, limb_pendulum
from generator.person.passive_laws import (
    LawContext,
    PassiveLaw,
    Row,
    angle_from_degrees,
    build_law,
    rest_stiffness,
)
from generator.person.sources import Origin
from generator.springs_file.axes import axis_by_name, parallel_sign, unit_axis
from generator.springs_file.coupled import CoupledEntry
from generator.springs_file.parse import SpringEntry, SpringsFile
from springs import Damping, Joining
from springs.elastic import Range
from springs.published.parse import parse_reference
from springs.published.reference import Reference
from springs.published.tables import coupled_law

_DATA_FILE = "passive_joints"
_ESTIMATE = "An estimate, not from a study"
_NO_HINGE_AXIS = "y"
"""Axis of a hinge, as the pendulum of its limb names it."""


@dataclass(frozen=True)
class PassiveAxis:
    """The passive law about an axis of a joint of a person, and on both sides.

    Attributes:
        joint: without side.
        axis: "x", "y" or "z", or None for a hinge.
        motion: name of a positive angle.
        names: of the joints in the figure.
        origin: of the law.
        law: of the sample's mean body.
        scale: factor of its torques for the person.
        scale_rule: how the factor follows.
        ratio: damping ratio of the limb.
        ratio_origin: of the ratio.
        ratio_reference: of the ratio, or None.
        ratio_rule: how the ratio was found.
        pendulum: what swings about the axis.
        stiffness: of the scaled law at rest [N m/rad].
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
        """Publications of law and damping, with an estimate called so."""
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
        """What the law is, how it was scaled, and the damping, in sentences."""
        label = "An estimate. " if self.origin is Origin.ESTIMATE else ""
        parts = (f"{label}{self.choice}", self.law.rule, self.scale_rule, self.damping_rule)
        return " ".join(part for part in parts if part)

    @property
    def damping_rule(self) -> str:
        """How the damping follows, in a sentence."""
        label = ", an estimate" if self.ratio_origin is Origin.ESTIMATE else ""
        frequency = self.pendulum.frequency(self.stiffness)
        return (
            f"Damping: {self.ratio:g} of the critical one{label} ({self.ratio_rule}), for the limb "
            f"that the joint swings at {frequency:.3g} rad/s."
        )

    @property
    def damping_reference(self) -> str:
        """Publication of the damping ratio, or that it is an estimate."""
        return _ESTIMATE if self.ratio_reference is None else str(self.ratio_reference)


def person_springs(body: Body, figure: Figure) -> SpringsFile:
    """Return the passive springs of a person's figure, one curve an axis.

    Raises:
        ModelError: for a joint without limits.
    """
    axes = passive_axes(body, figure)
    return SpringsFile(tuple(map(_entry, axes)), figure.name, Joining.CONSERVATIVE)


def coupled_leg_springs(body: Body, figure: Figure) -> SpringsFile:
    """Return springs in which hip and knee know of each other; all others stay as they are.

    The damping of both angles is that of `person_springs`.
    """
    leg = load_data_file(_DATA_FILE).content["coupled_leg"]
    joints = tuple(leg["joints"])
    axes = tuple(None if axis == "joint" else axis for axis in leg["axes"])
    own = {(each.joint, each.axis): each for each in passive_axes(body, figure)}
    damped = [own[pair] for pair in zip(joints, axes, strict=True)]
    entries = tuple(map(_damping_entry, damped))
    scale, rule = _scale(body, leg, load_data_file(_DATA_FILE))
    row = coupled_law(leg["published"])
    coupled = CoupledEntry(
        joints=tuple(tuple(f"{side}_{name}" for name in joints) for side in SIDES),
        coordinates=tuple(leg["coordinates"]),
        axes=axes,
        senses=(1,) * len(joints),
        published=leg["published"],
        held_angles=tuple(
            (name, angle_from_degrees(angle)) for name, angle in leg["held_deg"].items()
        ),
        is_nearest_conservative=True,
        scale=scale,
        offsets=(0.0,) * len(joints),
        reference=str(row.reference),
        why=f"{leg['why'].strip()} {rule}",
    )
    return SpringsFile(entries, figure.name, coupled=(coupled,))


def scaling_reference() -> Reference:
    """Publication of the rule by which the torques are scaled."""
    return load_data_file(_DATA_FILE).reference


def passive_axes(body: Body, figure: Figure) -> tuple[PassiveAxis, ...]:
    """Return the passive laws of the joints that a figure has.

    Raises:
        ModelError: for a joint without limits.
    """
    data = load_data_file(_DATA_FILE)
    laws: dict[tuple[str, str | None], tuple[PassiveLaw, Range]] = {}
    axes: list[PassiveAxis] = []
    for row in data.content["axis"]:
        joint, axis = row["joint"], row.get("axis")
        names = _joint_names(figure, joint)
        if not names:
            continue
        limits = normal_range(figure, names[0], axis)
        series = laws.get((row.get("in_series_with", ""), axis))
        context = LawContext(limits, series and (series[0].elastic, series[1]))
        law = build_law(row, context)
        laws[joint, axis] = law, limits
        axes.append(_passive_axis(body, data, row, names, law, limits))
    return tuple(axes)


def _passive_axis(
    body: Body, data: DataFile, row: Row, names: tuple[str, ...], law: PassiveLaw, limits: Range
) -> PassiveAxis:
    scale, scale_rule = _scale(body, row, data)
    ratio = data.content["damping"][row["damping"]]
    axis = row.get("axis")
    return PassiveAxis(
        joint=row["joint"],
        axis=axis,
        motion=row["motion"],
        names=names,
        origin=Origin(row["kind"]),
        law=law,
        scale=scale,
        scale_rule=scale_rule,
        ratio=ratio["ratio"],
        ratio_origin=Origin(ratio["kind"]),
        ratio_reference=parse_reference(ratio) if "reference" in ratio else None,
        ratio_rule=ratio["why"].strip(),
        pendulum=limb_pendulum(body, row["joint"], axis or _NO_HINGE_AXIS),
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


def _joint_names(figure: Figure, joint: str) -> tuple[str, ...]:
    """Names in the figure of a joint, of both sides where it has sides."""
    names = (joint, *(f"{side}_{joint}" for side in SIDES))
    return tuple(name for name in names if name in figure.joints)


def normal_range(figure: Figure, name: str, axis: str | None) -> Range:
    """Limits of a joint about one of its axes [rad].

    Raises:
        ModelError: for a joint without them.
    """
    joint = figure.joints[name]
    direction = axis_by_name(joint, axis)
    for k, factor in enumerate(joint.chain):
        if factor.kind is not AxisKind.ROTATION or joint.lower_limit is None:
            continue
        if joint.upper_limit is not None and parallel_sign(unit_axis(factor.axis), direction):
            return joint.lower_limit[k], joint.upper_limit[k]
    raise ModelError(f"joint `{name}` has no limits, from which its passive law follows")


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
