"""Tone of a run bound to the joints of a figure, with their strengths."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from generator.diagnostics import ModelError, spelling_hint
from generator.figure import Figure
from generator.figure_file.check import sex_and_stature
from generator.joint_chain import Chain
from generator.kinematics.loops import close_loops
from generator.kinematics.placement import Placement, initial_displacements
from generator.kinematics.tree import build_tree
from generator.model import Model
from generator.rotations import Array, rotation_vector_from_matrix
from generator.tone import GROUPS, Tone, group_of
from springs import JointSprings, SpringSet, rotation_law
from springs.axis import Direction
from springs.published.range_of_motion import opposite_motions
from springs.strength.strengths import Body, Strength, StrengthClass, strength
from springs.tone.activation import Activation
from springs.tone.law import AxisTone, rest_angle


@dataclass(frozen=True)
class Righting:
    """Righting of the child of a joint.

    Attributes:
        upright: Orientation of the child's site in the world that it is turned to, shape (3, 3).
        axes: Tones about axes of the child's site.
    """

    upright: Array
    axes: tuple[AxisTone, ...]


@dataclass(frozen=True)
class JointTones:
    """Tone of the joints of a figure.

    Attributes:
        activation: Activation in time.
        hold: Tones about the axes of joints that hold their angles.
        righting: Righting by joint.
        strengths: Strengths of all axes with tone, by joint and motion.
    """

    activation: Activation
    hold: Mapping[str, tuple[AxisTone, ...]]
    righting: Mapping[str, Righting]
    strengths: Mapping[tuple[str, str], Strength]

    @property
    def origins(self) -> Mapping[StrengthClass, int]:
        """Numbers of axes by the class of their strength."""
        found = [each.origin for each in self.strengths.values()]
        return {origin: found.count(origin) for origin in StrengthClass if origin in found}

    @property
    def origins_text(self) -> str:
        """Numbers of axes by the class of their strength, in a phrase."""
        parts = [f"{count} {origin.value}" for origin, count in self.origins.items()]
        return f"strengths of axes: {', '.join(parts)}"


def upright_orientations(figure: Figure, tone: Tone) -> dict[str, Array]:
    """Return the orientations of the children's sites of righted joints, as the figure is written.

    Raises ModelError for an unknown joint or group, and for a child that is fixed.
    """
    righted = tone.righting_shares(figure.joints)
    if not righted:
        return {}
    tree = build_tree(figure)
    placement = close_loops(tree, initial_displacements(tree), set())
    found: dict[str, Array] = {}
    for name in righted:
        child = figure.joints[name].child
        if child.segment in figure.ground:
            raise ModelError(f"righting: segment {child.segment} of joint {name} is fixed")
        pose = placement.poses[child.segment] @ figure.site(child).pose_in_segment
        found[name] = np.array(pose[:3, :3])
    return found


def bind_tone(
    tone: Tone, upright: Mapping[str, Array], placement: Placement, springs: SpringSet, start: float
) -> JointTones | None:
    """Return the tone of the joints of a run; None without any.

    Args:
        tone: Tone that the run asks for.
        upright: Result of `upright_orientations`.
        placement: Placement at the start, whose angles are held.
        springs: Springs, which name the motions about axes.
        start: Start of the run [s].

    Raises:
        ModelError: A joint that is named has no known strength or no rotation, or no joint has.
    """
    if not tone:
        return None
    return _Binder(tone, placement, springs).bind(upright, start)


def tone_of_model(model: Model, tone: Tone) -> JointTones | None:
    """Return the tone of a figure as it is written; None without any.

    Raises ModelError, as `bind_tone` does.
    """
    tree = build_tree(model.figure)
    placement = close_loops(tree, initial_displacements(tree), set())
    upright = upright_orientations(model.figure, tone)
    return bind_tone(tone, upright, placement, model.springs, 0.0)


class _Binder:
    """Bind a tone to a figure."""

    def __init__(self, tone: Tone, placement: Placement, springs: SpringSet) -> None:
        self._tone, self._placement, self._springs = tone, placement, springs
        self._figure = placement.tree.figure
        self._body = body_of(self._figure)
        self._strengths: dict[tuple[str, str], Strength] = {}
        self._stated = stated_strengths(tone, placement.tree.chains, springs)

    def bind(self, upright: Mapping[str, Array], start: float) -> JointTones:
        tone, figure = self._tone, self._figure
        names = figure.moving_joints
        hold: dict[str, tuple[AxisTone, ...]] = {}
        for name, share in tone.hold_shares(figure.joints).items():
            if name in names:
                axes = tuple(self._held_axes(name, share))
                if axes:
                    hold[name] = axes
                elif name in tone.hold:
                    raise ModelError(f"tone: {self._missing(name)}")
        self._check_groups("tone", tone.hold, hold)
        righting: dict[str, Righting] = {}
        for name, share in tone.righting_shares(figure.joints).items():
            if name not in names:
                continue
            axes = tuple(
                AxisTone(direction, _times(share, own), 0.0, tone.width, tone.lead)
                for direction, own in self._axes(name)
            )
            if axes:
                righting[name] = Righting(upright[name], axes)
            elif name in tone.righting:
                raise ModelError(f"righting: {self._missing(name)}")
        self._check_groups("righting", tone.righting, righting)
        if not hold and not righting:
            raise ModelError(
                "tone: no joint of this figure has a known strength; its springs name no motions "
                "of a person's joints"
            )
        return JointTones(tone.activation(start), hold, righting, self._strengths)

    def _check_groups(self, noun: str, shares: Mapping[str, float], found: Collection[str]) -> None:
        """Raise ModelError for a group of which no joint has a known strength."""
        for group in (name for name, share in shares.items() if name in GROUPS and share > 0.0):
            if group not in map(group_of, found):
                raise ModelError(
                    f"{noun}: no strength of a joint of the group `{group}` is known; state them "
                    "in [[strength]] of a tone file"
                )

    def _missing(self, joint: str) -> str:
        """Return why a joint has no tone."""
        if not self._placement.tree.chains[joint].rotations:
            return f"joint {joint} has no rotation"
        return (
            f"no strength of joint {joint} is known; state it in [[strength]] of a tone file, or "
            "name the motions about its axes in the springs"
        )

    def _held_axes(self, name: str, share: float) -> Iterator[AxisTone]:
        """Yield tones that hold the angles of a joint."""
        tone, placement = self._tone, self._placement
        chain, joint = placement.tree.chains[name], self._figure.joints[name]
        if not chain.rotations:
            return
        first, *others = chain.rotations
        law, r = None, np.zeros(3)
        if others:
            own = self._springs.joints.get(name, JointSprings(name))
            law = rotation_law(own, self._springs.law, chain.rotation_axes)
            r = rotation_vector_from_matrix(placement.pose_in_parent(joint)[:3, :3])
        for direction, strength_of_axis in self._axes(name):
            if law is None:
                angle = float(placement.displacements[name][first])
                rest = angle * float(np.sign(np.dot(direction, chain.rotation_axes[0])))
            else:
                rest = rest_angle(law, direction, r)
            largest = _times(share, strength_of_axis)
            yield AxisTone(direction, largest, rest, tone.width, tone.lead)

    def _axes(self, name: str) -> Iterator[tuple[Direction, Strength]]:
        """Yield the axes of a joint whose strength is known."""
        chain, springs = self._placement.tree.chains[name], self._springs.joints.get(name)
        for direction, motion in named_rotations(chain, springs):
            own = self._strength(name, motion)
            if own is not None:
                self._strengths[name, motion] = own
                yield direction, own

    def _strength(self, name: str, motion: str) -> Strength | None:
        for key in ((name, motion), (name, "")):
            if key in self._stated:
                return self._stated[key]
        return strength(name, motion, self._body) if motion else None


_PARALLEL = 1.0 - 1e-9
"""Cosine of the angle of two axes above which they are one."""


def named_rotations(chain: Chain, springs: JointSprings | None) -> Iterator[tuple[Direction, str]]:
    """Yield the axes of the rotations of a joint, and the motion about each that springs name.

    Axes are those of the springs, or else unit vectors along those of the chain; "" for no motion.
    """
    motions = {spring.direction: spring.motion for spring in springs.axes} if springs else {}
    for axis in chain.rotation_axes:
        x, y, z = map(float, np.asarray(axis) / np.linalg.norm(axis))
        direction, motion = (x, y, z), ""
        for other, named in motions.items():
            along = float(np.dot(other, direction))
            if abs(along) > _PARALLEL:
                direction, motion = other, named
        yield direction, motion


def stated_strengths(
    tone: Tone, chains: Mapping[str, Chain], springs: SpringSet
) -> dict[tuple[str, str], Strength]:
    """Return the strengths that a tone states, by joint and motion; "" for a whole joint.

    Raises ModelError for an unknown joint or motion, and for two strengths of one motion.
    """
    names: dict[str, tuple[str, str, bool]] = {}
    motions: dict[str, list[str]] = {}
    for joint in chains:
        names[joint] = joint, "", False
        motions[joint] = []
        for _, motion in named_rotations(chains[joint], springs.joints.get(joint)):
            opposites = opposite_motions(motion)
            names |= {f"{joint} {one}": (joint, motion, True) for one in opposites}
            if motion:
                names[f"{joint} {motion}"] = joint, motion, False
                motions[joint] += [motion, *opposites]
    found: dict[tuple[str, str], Strength] = {}
    keys: dict[tuple[str, str], str] = {}
    for row, (key, pair) in enumerate(tone.strengths.items(), 1):
        where = f"strength {row}"
        if tone.name:
            where = f"{tone.name}.tone.toml, row {row} of [[strength]]"
        if key not in names:
            joint = next((one for one in motions if key.startswith(f"{one} ")), "")
            hint = spelling_hint(key, names)
            if joint:
                known = ", ".join(motions[joint]) or f"none; leave it out, as `{joint}`"
                hint = f"motions of joint {joint}: {known}"
            raise ModelError(f"{where}: the figure has no motion `{key}`; {hint}")
        joint, motion, is_opposite = names[key]
        if (joint, motion) in keys:
            other = keys[joint, motion]
            raise ModelError(f"{where}: `{key}` has a strength already, that of `{other}`")
        keys[joint, motion] = key
        origin = tone.strength_classes.get(key, StrengthClass.ESTIMATE)
        along, against = pair[::-1] if is_opposite else pair
        found[joint, motion] = Strength((along, against), origin)
    return found


def _times(share: float, own: Strength) -> tuple[float, float]:
    return share * own.largest[0], share * own.largest[1]


def body_of(figure: Figure) -> Body | None:
    """Return mass, stature and sex of a person; None for another figure."""
    found = sex_and_stature(figure)
    if found is None:
        return None
    sex, stature = found
    mass = sum(float(segment.mass or 0.0) for segment in figure.segments.values())
    return Body(mass, stature, sex == "female")
