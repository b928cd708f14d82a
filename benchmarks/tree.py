"""A figure as a tree of links on balls and hinges: what every other engine is built from.

Shared with the program is the figure as it was read; the tree, its frames and its start are made
here a second time. A joint's frame is its site: in the zero pose the sites of base and tip agree.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from generator.figure import AxisKind, Figure, Joint, SiteRef
from generator.rotations import Array

GRAVITY = 9.81
"""Along -y of the world [m/s^2]."""

Values = Mapping[str, Sequence[float]]


@dataclass(frozen=True)
class Link:
    """A moving segment and the joint to its parent. SI units.

    Attributes:
        name: of the segment.
        joint: name of the joint.
        base: place of the link that carries it, -1 for the ground.
        axis: of a hinge in the joint's frame, of the tip's turns, shape (3,); None for a ball.
        sign: +1 where the tip is the joint's child, else -1.
        in_base: pose of the joint's frame in the base; in the world where that is the ground.
        in_tip: pose of the joint's frame in the segment.
        mass: [kg].
        centre: of mass, in the segment, shape (3,) [m].
        inertia: principal moments about it along the segment's axes, shape (3,) [kg m^2].
        is_free: whether the joint is left out, so that the segment floats. Its turns are those of a
            ball, and `in_base` is the place of the joint's frame at the start, not turned.
    """

    name: str
    joint: str
    base: int
    axis: Array | None
    sign: float
    in_base: Array
    in_tip: Array
    mass: float
    centre: Array
    inertia: Array
    is_free: bool = False


@dataclass(frozen=True)
class TreeModel:
    """A tree and where it starts.

    Attributes:
        links: every base before its tips.
        turns: rotation of the tip's site in the base's at the start, by joint, shape (3, 3).
        angles: of the hinges at the start, of the tip's turn about the link's axis [rad].
        spins: of the balls at the start, in the tips' axes, shape (3,) [rad/s].
        rates: of the hinges at the start [rad/s].
    """

    links: tuple[Link, ...]
    turns: Mapping[str, Array]
    angles: Mapping[str, float]
    spins: Mapping[str, Array]
    rates: Mapping[str, float]

    @property
    def balls(self) -> list[Link]:
        """The links on balls, in order."""
        return [link for link in self.links if link.axis is None]

    @property
    def hinges(self) -> list[Link]:
        """The links on hinges, in order."""
        return [link for link in self.links if link.axis is not None]

    @property
    def start(self) -> Array:
        """The state: quaternions of the balls (w, x, y, z), angles, spins and rates."""
        quaternions = [quaternion(self.turns[link.joint]) for link in self.balls]
        angles = [self.angles[link.joint] for link in self.hinges]
        spins = [self.spins[link.joint] for link in self.balls]
        return np.concatenate(
            [*quaternions, angles, *spins, [self.rates[link.joint] for link in self.hinges]]
        )

    def parts(self, state: Array) -> tuple[Array, Array, Array, Array]:
        """Quaternions (.., b, 4), angles (.., h), spins in the tips (.., b, 3), rates (.., h)."""
        b, h = len(self.balls), len(self.hinges)
        cuts = np.cumsum([4 * b, h, 3 * b])
        q, angles, spins, rates = np.split(state, cuts, axis=-1)
        lead = state.shape[:-1]
        return q.reshape(*lead, b, 4), angles, spins.reshape(*lead, b, 3), rates

    def rotations(self, states: Array) -> dict[str, Array]:
        """Rotation of each joint's child in its parent, shape (n, 3, 3)."""
        quaternions, angles, _, _ = self.parts(states)
        made: dict[str, Array] = {}
        for k, link in enumerate(self.balls):
            turn = Rotation.from_quat(quaternions[:, k][:, [1, 2, 3, 0]])
            made[link.joint] = (turn if link.sign > 0.0 else turn.inv()).as_matrix()
        for k, link in enumerate(self.hinges):
            turn = Rotation.from_rotvec(link.sign * np.outer(angles[:, k], link.axis))
            made[link.joint] = turn.as_matrix()
        return made


def tree_model(
    figure: Figure,
    displacements: Values | None = None,
    velocities: Values | None = None,
    *,
    free_root: bool = False,
) -> TreeModel:
    """The tree of a figure.

    Args:
        figure: a tree of balls and hinges.
        displacements: by joint, in place of the figure's own [rad].
        velocities: rates of displacements by joint [rad/s]; 0 for the others.
        free_root: whether the joint to the ground is left out. Its velocities are then the angular
            velocity of the tip in the world's axes.
    """
    start = {name: joint.displacement for name, joint in figure.joints.items()}
    start.update({name: tuple(values) for name, values in (displacements or {}).items()})
    links: list[Link] = []
    places = {figure.root.segment: -1}
    turns: dict[str, Array] = {}
    angles: dict[str, float] = {}
    spins: dict[str, Array] = {}
    rates: dict[str, float] = {}
    waiting = list(figure.joints.values())
    while waiting:
        joint = next(j for j in waiting if {e.segment for e in j.ends} & places.keys())
        waiting.remove(joint)
        forward = joint.parent.segment in places
        link = _link(figure, joint, *(joint.ends if forward else joint.ends[::-1]), places)
        moving = np.zeros(len(joint.chain))
        moving = np.asarray((velocities or {}).get(joint.name, moving), dtype=float)
        turn, spin = _turned(joint, start[joint.name], moving)
        turn, spin = (turn, turn.T @ spin) if forward else (turn.T, -spin)
        if free_root and link.base < 0:
            turn = link.in_base[:3, :3] @ turn
            spin = turn.T @ moving
            place = np.eye(4)
            place[:3, 3] = link.in_base[:3, 3]
            link = replace(link, in_base=place, is_free=True)
        places[link.name] = len(links)
        links.append(link)
        turns[joint.name], spins[joint.name] = turn, spin
        if link.axis is not None:
            angles[joint.name], rates[joint.name] = float(start[joint.name][0]), float(moving[0])
    return TreeModel(tuple(links), turns, angles, spins, rates)


def _link(
    figure: Figure, joint: Joint, base: SiteRef, tip: SiteRef, places: Mapping[str, int]
) -> Link:
    segment = figure.segments[tip.segment]
    sign = 1.0 if tip is joint.child else -1.0
    axis = sign * np.array(joint.chain[0].axis) if len(joint.chain) == 1 else None
    if [factor.kind for factor in joint.chain] not in (
        [AxisKind.ROTATION],
        [AxisKind.ROTATION] * 3,
    ):
        raise ValueError(f"joint {joint.name} is neither a ball nor a hinge")
    in_base = figure.site(base).pose_in_segment
    if base.segment == figure.root.segment:
        in_base = np.linalg.inv(figure.site(figure.root).pose_in_segment) @ in_base
    return Link(
        segment.name,
        joint.name,
        places[base.segment],
        axis,
        sign,
        in_base,
        figure.site(tip).pose_in_segment,
        float(segment.mass or 0.0),
        np.asarray(segment.centre_of_mass),
        np.asarray(segment.inertia),
    )


def _turned(joint: Joint, displacement: Sequence[float], rates: Array) -> tuple[Array, Array]:
    """Rotation of the child in the parent, and its angular velocity in the parent's axes.

    The first factor of the chain is innermost.
    """
    turn, spin = np.eye(3), np.zeros(3)
    for factor, angle, rate in zip(joint.chain, displacement, rates, strict=True):
        axis = np.array(factor.axis)
        outer = Rotation.from_rotvec(angle * axis).as_matrix()
        turn, spin = outer @ turn, outer @ spin + rate * axis
    return turn, spin


def quaternion(turn: Array) -> Array:
    """(w, x, y, z) of a rotation matrix, w not negative."""
    return Rotation.from_matrix(turn).as_quat(canonical=True)[[3, 0, 1, 2]]


def between(one: Mapping[str, Array], other: Mapping[str, Array]) -> Array:
    """Largest angle of R_a^T R_b over the joints, at each frame [rad], shape (n,)."""
    apart = [np.swapaxes(one[name], -1, -2) @ turns for name, turns in other.items()]
    return np.max([Rotation.from_matrix(turn).magnitude() for turn in apart], axis=0)
