"""Demands of a posture with loads on joints, spine, hands and balance, beside strengths.

A posture is static: the moments that joints must supply, less the passive ones, are what muscles
must do, and are compared with the largest voluntary torque in that direction at that angle.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from generator.diagnostics import ModelError
from generator.figure import Figure
from generator.hold.capacity import JointAxisStrength, axis_strengths
from generator.hold.hands import HandDemand, hand_demands
from generator.hold.passive import PassiveMoments, ranges_exceeded
from generator.hold.spine import SpineLoad, spine_of
from generator.hold.statics import (
    Load,
    Wrench,
    load_wrenches,
    net_moments,
    total_wrench,
    weight_wrenches,
)
from generator.hold.support import (
    FEET,
    Area,
    OutOfBalanceError,
    Standing,
    balance_sentence,
    body_points,
    carry,
    check_on_ground,
    default_supports,
    lifted,
    support_areas,
)
from generator.kinematics.centre_of_mass import segment_masses
from generator.kinematics.placement import (
    Displacements,
    Placement,
    forward_kinematics,
    initial_displacements,
    segment_jacobians,
)
from generator.kinematics.tree import Tree, build_tree
from generator.model import Model
from generator.rotations import Array
from generator.simulation.muscle_tone import body_of
from generator.tone import Tone
from springs import SpringSet
from springs.elastic import Range
from springs.strength.strengths import (
    Age,
    Body,
    StrengthClass,
    endurance,
    percent_capable,
    percentile_5,
)

LEAST_USE = 0.05
"""Use of a joint from which it may decide the percentage of capable people."""

LARGEST_LOAD = 500.0
"""Mass up to which the heaviest load is searched [kg]."""

_LOAD_TOLERANCE = 1e-3
"""Accuracy of the heaviest load [kg]."""

NO_MOMENT = 1e-9
"""Moment that counts as none [N m]."""

_USE_DIGITS = 9
"""Decimals in which uses are compared: both sides of a body are equal but for rounding."""


@dataclass(frozen=True)
class JointDemand:
    """Demand on a joint about an axis. Moments are in the sense of the direction.

    Attributes:
        joint: Name of the joint.
        direction: Motion in the sense of which muscles work ("extension").
        angle: Angle in the sense of the motion of the axis's springs [rad].
        net: Moment that holds the posture [N m].
        passive: Moment of passive laws [N m].
        active: Moment of muscles, not below zero [N m].
        capacity: Largest voluntary moment of the mean person at this angle [N m]; None where it is
            not known.
        spread: Standard deviation between people over the mean.
        origin: Class of the capacity; None without one.
        source: Reference of the capacity; "" for an estimate.
    """

    joint: str
    direction: str
    angle: float
    net: float
    passive: float
    active: float
    capacity: float | None
    spread: float
    origin: StrengthClass | None
    source: str

    @property
    def is_antagonist(self) -> bool:
        """True where muscles work against the passive moment, which exceeds the net one."""
        return -self.passive > abs(self.net) + NO_MOMENT

    @property
    def use(self) -> float | None:
        """Active moment over the capacity; infinite without any capacity."""
        if self.capacity is None:
            return None
        if self.capacity > 0.0:
            return self.active / self.capacity
        return float("inf") if self.active > NO_MOMENT else 0.0

    @property
    def capacity_5(self) -> float | None:
        """Moment of which 95 % of people are capable [N m]."""
        return None if self.capacity is None else percentile_5(self.capacity, self.spread)

    @property
    def percent_capable(self) -> float | None:
        """Percentage of people who are capable of the active moment."""
        if self.capacity is None:
            return None
        if self.active <= NO_MOMENT:
            return 100.0
        return percent_capable(self.active, self.capacity, self.spread)

    @property
    def endurance(self) -> float | None:
        """Time for which it can be held [s]; None where it is long or not known."""
        return None if self.use is None else endurance(self.joint, self.use)


@dataclass(frozen=True)
class Posture:
    """Statics of a posture with loads.

    Attributes:
        placement: Posture.
        loads: Loads.
        net: Moments that joints must supply, shape (n,) per joint [N m or N].
        passive: Passive moments likewise, of joints with laws [N m].
        joints: Demands about the axes of all joints.
        standing: Supports; None for a figure that is fixed to the ground.
        spine: Load of L5/S1; None for another figure.
        hands: Forces of hands that bear loads.
        notes: What a reader must know, a sentence each.
        beyond: Angle and range of joints that are far beyond it, of which no strength is known
            [rad].
    """

    placement: Placement
    loads: tuple[Load, ...]
    net: Mapping[str, Array]
    passive: Mapping[str, Array]
    joints: tuple[JointDemand, ...]
    standing: Standing | None
    spine: SpineLoad | None
    hands: tuple[HandDemand, ...]
    notes: tuple[str, ...]
    beyond: Mapping[str, tuple[float, Range]]

    @property
    def weakest(self) -> JointDemand | None:
        """The joint with the largest use; None where no strength is known."""
        known = [one for one in self.joints if one.use is not None]
        return max(known, key=lambda one: round(one.use or 0.0, _USE_DIGITS), default=None)

    @property
    def largest_use(self) -> float:
        """Largest use of all joints; 0 where no strength is known."""
        weakest = self.weakest
        return 0.0 if weakest is None else weakest.use or 0.0

    @property
    def percent_capable(self) -> float | None:
        """Percentage of people who can hold it: that of the least capable joint.

        Strengths of the joints of a person count as fully correlated. None for a posture beyond
        the range of a joint.
        """
        if self.beyond or self.least_capable is None:
            return None
        return self.least_capable.percent_capable

    @property
    def least_capable(self) -> JointDemand | None:
        """The joint with the smallest percentage of capable people, the weaker one of equal ones.

        It may differ from the weakest one, since joints have different spreads. Joints with a use
        below `LEAST_USE` do not count: a normal distribution has people without any strength.
        """
        known = [one for one in self.joints if one.use is not None and one.use >= LEAST_USE]
        if not known:
            return self.weakest
        return min(
            known,
            key=lambda one: (round(one.percent_capable or 0.0, _USE_DIGITS), -(one.use or 0.0)),
        )

    @property
    def residual(self) -> float:
        """Largest force or moment that weights, loads and supports leave [N or N m]."""
        if self.standing is None:
            return 0.0
        force, moment = total_wrench(self._wrenches)
        return float(np.abs(np.concatenate([force, moment])).max())

    @property
    def _wrenches(self) -> list[Wrench]:
        standing = () if self.standing is None else self.standing.wrenches
        figure = self.placement.tree.figure
        weights, loads = (
            weight_wrenches(self.placement, figure),
            load_wrenches(self.placement, self.loads),
        )
        return [*weights, *loads, *standing]


@dataclass(frozen=True)
class Holder:
    """A person whose postures are judged.

    Attributes:
        model: Figure with springs.
        body: Measures on which strengths depend; None where they are not known.
        stated: Strengths of the user, which precede those of the table.
        supports: Segments that bear it, `SEGMENT.SITE`, `seat`, or `ground`; None for the feet that
            are lowest.
        motions: Springs that name the motions about axes; None for those of the model.
    """

    model: Model
    body: Body | None = None
    stated: Tone | None = None
    supports: tuple[str, ...] | None = None
    motions: SpringSet | None = None

    @classmethod
    def of(
        cls,
        model: Model | Figure,
        age: Age = Age.YOUNG,
        *,
        is_female: bool | None = None,
        stated: Tone | None = None,
        supports: Sequence[str] | None = None,
        motions: SpringSet | None = None,
    ) -> "Holder":
        """Return the holder of a figure, with its own springs where it has no others.

        Args:
            model: Figure with springs.
            age: Ages of the sample of strengths.
            is_female: Sex of the sample; None for that of the figure.
            stated: Strengths of the user.
            supports: What bears the body; None for the feet that are lowest.
            motions: Springs that name the motions about axes; None for those of the model.

        Raises:
            InputError: A segment has no mass or centre of mass, or a psurf cannot be read.
            UsageError: A support is unknown.
            ModelError: A strength is of an unknown joint, or the figure has loops.
        """
        model = Model.of(model) if isinstance(model, Figure) else model
        body = body_of(model.figure)
        if body is not None:
            sex = body.is_female if is_female is None else is_female
            body = replace(body, age=age, is_female=sex)
        holder = cls(model, body, stated, tuple(supports) if supports else None, motions)
        _ = segment_masses(model.figure)
        if holder.tree.closures:
            names = ", ".join(joint.name for joint in holder.tree.closures)
            raise ModelError(f"the loop closed by {names} makes the moments of joints ambiguous")
        _ = holder.strengths, holder._areas
        return holder

    @cached_property
    def tree(self) -> Tree:
        """Tree of the figure."""
        return build_tree(self.model.figure)

    @cached_property
    def strengths(self) -> tuple[JointAxisStrength, ...]:
        """Strengths about the axes of joints."""
        springs = self.motions or self.model.springs
        return axis_strengths(self.tree, springs, self.body, self.stated)

    @cached_property
    def _passive(self) -> PassiveMoments:
        return PassiveMoments(self.tree, self.model.springs)

    @cached_property
    def _points(self) -> Mapping[str, Array]:
        return body_points(self.model.figure)

    @cached_property
    def _areas(self) -> tuple[Area, ...]:
        names = self.supports or default_supports(self.model.figure)
        return support_areas(self.model.figure, names)

    def posture(
        self,
        displacements: Displacements | None = None,
        loads: Sequence[Load] = (),
        *,
        must_balance: bool = True,
    ) -> Posture:
        """Return the statics of a posture with loads.

        Args:
            displacements: Displacements of joints [rad or m]; others have those of the figure.
            loads: Loads.
            must_balance: Whether a centre of pressure outside the support is refused; else joints
                are those of a body that pulls at the ground.

        Raises:
            OutOfBalanceError: The centre of pressure is outside the support.
            OffGroundError: Both feet are off the ground.
            UsageError: A load is on an unknown segment or site.
        """
        values = {**initial_displacements(self.tree), **(displacements or {})}
        placement = forward_kinematics(self.tree, values)
        passive = self._passive.moments(placement.displacements)
        jacobians = segment_jacobians(placement)
        wrenches = weight_wrenches(placement, self.model.figure)
        wrenches += load_wrenches(placement, loads)
        standing, notes = None, list[str]()
        if self._areas:
            areas, notes = self.bearing_areas(placement)
            standing = carry(areas, placement, *total_wrench(wrenches))
            if must_balance and standing.margin < 0.0:
                raise OutOfBalanceError(balance_sentence(standing, self.forwards(placement)))
            notes += standing_notes(standing)
            wrenches += standing.wrenches
        net = net_moments(placement, wrenches, jacobians)
        spine = spine_of(placement)
        beyond = ranges_exceeded(placement)
        return Posture(
            placement,
            tuple(loads),
            net,
            passive,
            tuple(self._demands(placement, net, passive, beyond)),
            standing,
            None if spine is None or self.body is None else spine.load(placement, wrenches),
            tuple(hand_demands(placement, loads, self.body)),
            (*notes, *self._passive.notes(placement)),
            beyond,
        )

    def bearing_areas(self, placement: Placement) -> tuple[tuple[Area, ...], list[str]]:
        """Return the supports of a posture, and what is said of the others."""
        if self.supports is not None:
            return self._areas, []
        check_on_ground(self._points, self._areas, placement)
        off = lifted(self._areas, placement)
        return tuple(area for area in self._areas if area not in off), [
            f"{area.name} is lifted, and bears nothing" for area in off
        ]

    def _demands(
        self,
        placement: Placement,
        net: Mapping[str, Array],
        passive: Mapping[str, Array],
        beyond: Mapping[str, tuple[float, Range]],
    ) -> Iterator[JointDemand]:
        for axis in self.strengths:
            total = axis.sense * float(net[axis.joint][axis.index])
            own = (
                axis.sense * float(passive[axis.joint][axis.index])
                if axis.joint in passive
                else 0.0
            )
            angle = axis.sense * float(placement.displacements[axis.joint][axis.index])
            active = total - own
            is_opposite = active < -NO_MOMENT
            sign = -1.0 if is_opposite else 1.0
            strength = None if axis.joint in beyond else axis.strength
            yield JointDemand(
                axis.joint,
                axis.direction(is_opposite),
                angle,
                sign * total,
                sign * own,
                abs(active),
                None if strength is None else float(strength.capacity(angle, is_opposite)),
                axis.spread(is_opposite),
                None if strength is None else strength.origins[is_opposite],
                "" if strength is None else strength.reference,
            )

    def heaviest(
        self,
        segment: str,
        displacements: Displacements | None = None,
        loads: Sequence[Load] = (),
        *,
        balance: bool = False,
    ) -> "HeaviestLoad":
        """Return the largest mass that the mean person can hold beside other loads.

        Args:
            segment: Segment, or `SEGMENT.SITE`, from which it hangs.
            displacements: Posture, as in `posture`.
            loads: Other loads.
            balance: Whether the pelvis is shifted anew for each load, as by `balanced`.

        Raises:
            OutOfBalanceError: The posture is out of balance without it.
            UsageError: The segment or site is unknown.
            ModelError: The posture is beyond the range of a joint.
        """
        name, _, site = segment.partition(".")

        def at(mass: float) -> Posture:
            more = (*loads, Load(name, mass, site=site))
            pose = self.balanced(displacements, more) if balance else displacements
            return self.posture(pose, more)

        low, high = 0.0, LARGEST_LOAD
        found = at(low)
        for joint in found.beyond:
            raise ModelError(f"no load is sought in a posture beyond the range of {joint}")
        if found.largest_use > 1.0:
            return HeaviestLoad(segment, 0.0, _limit(found), found)
        limit = ""
        while high - low > _LOAD_TOLERANCE:
            middle = 0.5 * (low + high)
            try:
                tried = at(middle)
            except OutOfBalanceError:
                high, limit = middle, "balance"
                continue
            if tried.beyond or tried.largest_use > 1.0:
                high, limit = middle, _limit(tried)
            else:
                low, found = middle, tried
        return HeaviestLoad(segment, low, limit or f"more than {LARGEST_LOAD:g} kg", found)

    def balanced(
        self, displacements: Displacements | None = None, loads: Sequence[Load] = ()
    ) -> Displacements:
        """Return a posture whose centre of pressure is over the middle of its support.

        The pelvis is shifted forwards or back: both hips turn by one angle, and ankles so that the
        feet keep their orientation. Trunk, arms and knees keep theirs.

        Raises:
            OutOfBalanceError: No angle of up to 40 deg balances the posture.
            ModelError: The figure has no hips and ankles whose springs name their motions.
        """
        values = {**initial_displacements(self.tree), **(displacements or {})}
        if not self._legs:
            raise ModelError("--balance needs hips and ankles whose springs name their motions")

        def turned(angle: float) -> Displacements:
            return _turn_legs(self.tree, values, self._legs, angle)

        def error(angle: float) -> float:
            placement = forward_kinematics(self.tree, turned(angle))
            wrenches = weight_wrenches(placement, self.model.figure)
            wrenches += load_wrenches(placement, tuple(loads))
            areas, _ = self.bearing_areas(placement)
            standing = carry(areas, placement, *total_wrench(wrenches))
            forwards = self.forwards(placement)
            assert forwards is not None
            corners = standing.stability.corners @ forwards
            middle = 0.5 * (corners.min() + corners.max())
            return float(standing.stability.centre @ forwards - middle)

        from scipy.optimize import brentq

        trials = np.radians(np.arange(-40.0, 41.0, 5.0))
        errors = [error(angle) for angle in trials]
        crossings = [
            (low, high)
            for low, high, one, other in zip(
                trials[:-1], trials[1:], errors[:-1], errors[1:], strict=True
            )
            if one * other <= 0.0
        ]
        if not crossings:
            raise OutOfBalanceError("no shift of the pelvis balances this posture with its loads")
        low, high = min(crossings, key=lambda pair: abs(pair[0] + pair[1]))
        return turned(float(brentq(error, low, high, xtol=1e-10)))

    def forwards(self, placement: Placement) -> Array | None:
        """Return the horizontal direction in which `balanced` shifts the pelvis, shape (3,).

        None for a figure without legs that can be turned.
        """
        if not self._legs:
            return None
        hip, kinematics = self._legs[0].hip, self.tree.kinematics
        twists = kinematics.twists(kinematics.displacement_vector(placement.displacements))
        axis = twists[kinematics.columns[hip.joint].start + hip.index, :3]
        return hip.sense * np.array([axis[2], 0.0, -axis[0]])

    @cached_property
    def _legs(self) -> "list[_Leg]":
        found: list[_Leg] = []
        for hip in self.strengths:
            if "hip" not in hip.joint.split("_") or hip.motion != "flexion":
                continue
            side = hip.joint.partition("_")[0]
            ankle = next(
                (
                    one.joint
                    for one in self.strengths
                    if one.motion == "dorsiflexion" and one.joint.startswith(side)
                ),
                None,
            )
            if ankle is not None:
                found.append(_Leg(hip, ankle))
        return found


@dataclass(frozen=True)
class HeaviestLoad:
    """The heaviest load that the mean person can hold.

    Attributes:
        segment: Segment, or `SEGMENT.SITE`, from which it hangs.
        mass: Mass [kg].
        limited_by: Joint and direction, the range of a joint, or `balance`.
        posture: Statics with the load.
    """

    segment: str
    mass: float
    limited_by: str
    posture: Posture


@dataclass(frozen=True)
class _Leg:
    """Flexion of a hip, and the ankle on its side."""

    hip: JointAxisStrength
    ankle: str


def _limit(posture: Posture) -> str:
    for joint in posture.beyond:
        return f"the range of {joint}"
    weakest = posture.weakest
    return "" if weakest is None else f"{weakest.joint} {weakest.direction}"


def _turn_legs(
    tree: Tree, values: Displacements, legs: Sequence[_Leg], angle: float
) -> Displacements:
    """Return a posture with the hips turned by an angle and the feet as they were."""
    before = forward_kinematics(tree, values)
    changed = {name: np.array(row, dtype=float) for name, row in values.items()}
    for leg in legs:
        changed[leg.hip.joint][leg.hip.index] += leg.hip.sense * angle
    after = forward_kinematics(tree, changed)
    for leg in legs:
        joint = tree.figure.joints[leg.ankle]
        shank, foot = (after.poses[joint.parent.segment], before.poses[joint.child.segment])
        sites = [tree.figure.site(ref).pose_in_segment[:3, :3] for ref in joint.ends]
        target = np.eye(4)
        target[:3, :3] = (shank[:3, :3] @ sites[0]).T @ foot[:3, :3] @ sites[1]
        changed[leg.ankle] = tree.chains[leg.ankle].displacements(target, changed[leg.ankle])
    return changed


def standing_notes(standing: Standing) -> list[str]:
    """Return what must be known of supports: forces, and those that would have to pull."""
    outside = [one.name for one in standing.bearings if not one.is_inside]
    notes = [f"{' and '.join(outside)} would have to push outside its own area"] * bool(outside)
    if len(standing.bearings) > 1:
        parts = ", ".join(f"{one.name} {one.force[1]:.0f} N" for one in standing.bearings)
        what = "feet" if all(one.segment in FEET for one in standing.bearings) else "supports"
        notes.append(f"{parts}; {what} are assumed not to push against each other")
    return notes


def hold(
    model: Model | Figure,
    displacements: Displacements | None = None,
    loads: Sequence[Load] = (),
    supports: Sequence[str] | None = None,
    age: Age = Age.YOUNG,
) -> Posture:
    """Return whether a person can hold a posture with loads.

    For many postures keep a `Holder`.

    Args:
        model: Figure with springs.
        displacements: Displacements of joints [rad or m]; others have those of the figure.
        loads: Loads.
        supports: What bears the body; None for the feet that are lowest.
        age: Ages of the sample of strengths.

    Raises:
        OutOfBalanceError: The centre of pressure is outside the support.
        MoverError: The figure cannot be judged; see `Holder.of`.
    """
    return Holder.of(model, age, supports=supports).posture(displacements, loads)
