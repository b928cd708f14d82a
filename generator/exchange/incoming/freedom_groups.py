"""Which freedoms of a body make one joint: rotations about one point, each axis across the next."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from generator.chain import ChainError, chain_of
from generator.exchange.incoming.passive_tree import Freedom
from generator.figure import Factor, Vector
from generator.frames import PERPENDICULAR, Array

TOGETHER = 1e-9
"""Distance of axes that count as meeting [m]."""


@dataclass(frozen=True)
class Group:
    """Freedoms that make one joint.

    Attributes:
        freedoms: from the parent outwards to the child.
        centre: the point where the axes of the turns meet, in the body's frame [m].
        frame: axes of the joint in the body's, shape (3, 3): where the turns are about axes across
            each other, along them.
    """

    freedoms: tuple[Freedom, ...]
    centre: Vector
    frame: Array

    @property
    def turns(self) -> tuple[Freedom, ...]:
        """Those that turn."""
        return tuple(freedom for freedom in self.freedoms if freedom.kind == "R")

    @property
    def chain(self) -> tuple[Factor, ...]:
        """The factors of the joint in its frame, innermost first."""
        return _chain(self.freedoms, self.frame)


def groups_of(freedoms: Sequence[Freedom], *, apart: bool = False) -> tuple[Group, ...]:
    """The joints that a body's freedoms make, the fewest that do, from the parent outwards.

    Args:
        freedoms: in that order.
        apart: whether passive turns each get a joint of their own, so that their laws stay laws of
            their angles; in one joint with others they become laws of the rotation vector.
    """
    units: list[tuple[Freedom, ...]] = []
    for freedom in freedoms:
        if units and freedom.whole and units[-1][-1].whole == freedom.whole:
            units[-1] = (*units[-1], freedom)
        else:
            units.append((freedom,))
    groups: list[Group] = []
    held: tuple[Freedom, ...] = ()
    for unit in units:
        joined = _group((*held, *unit), apart=apart) if held else None
        if joined is not None:
            groups[-1] = joined
            held = joined.freedoms
            continue
        alone = _group(unit, apart=False)
        assert alone is not None, "a freedom, or those of a ball, make one joint"
        groups.append(alone)
        held = alone.freedoms
    return tuple(groups)


def _group(freedoms: tuple[Freedom, ...], *, apart: bool) -> Group | None:
    """The joint of these freedoms; None where one joint cannot hold them."""
    turns = [freedom for freedom in freedoms if freedom.kind == "R"]
    slides = [freedom for freedom in freedoms if freedom.kind == "T"]
    try:
        chain_of(_chain(freedoms, np.eye(3)))
    except ChainError:
        return None
    centre = _centre(turns)
    if centre is None:
        return None
    passive = any(freedom.is_passive for freedom in turns)
    is_ball = bool(turns) and len({freedom.whole or freedom.name for freedom in turns}) == 1
    if len(turns) > 1 and passive and not is_ball and (apart or not _orthogonal(turns)):
        return None
    if len(slides) > 1 and any(freedom.is_passive for freedom in slides):
        # Exudyn's connectors would lose a moment there.
        return None
    return Group(freedoms, centre, _frame(turns))


def _chain(freedoms: Sequence[Freedom], frame: Array) -> tuple[Factor, ...]:
    return tuple(
        Factor(freedom.kind, _clean(frame.T @ freedom.axis)) for freedom in reversed(freedoms)
    )


def _clean(axis: Array) -> Vector:
    """The axis with rounding errors taken off a coordinate axis."""
    x, y, z = (float(round(part)) if abs(part - round(part)) < 1e-15 else part for part in axis)
    return float(x) + 0.0, float(y) + 0.0, float(z) + 0.0


def _orthogonal(turns: Sequence[Freedom]) -> bool:
    axes = np.array([freedom.axis for freedom in turns])
    return bool(np.abs(axes @ axes.T - np.eye(len(turns))).max() < PERPENDICULAR)


def _centre(turns: Sequence[Freedom]) -> Vector | None:
    """The point where the axes meet, nearest to the point of the first; None where they do not."""
    if not turns:
        return 0.0, 0.0, 0.0
    start = np.asarray(turns[0].point)
    rows = np.vstack([np.eye(3) - np.outer(turn.axis, turn.axis) for turn in turns])
    arms = np.array([np.asarray(turn.point) - start for turn in turns]).reshape(-1, 1)
    aims = np.vstack([rows[3 * k : 3 * k + 3] @ arms[3 * k : 3 * k + 3] for k in range(len(turns))])
    moved = np.linalg.lstsq(rows, aims, rcond=1e-9)[0]
    if np.abs(rows @ moved - aims).max() > TOGETHER:
        return None
    x, y, z = (start + moved[:, 0]).tolist()
    return x, y, z


def _frame(turns: Sequence[Freedom]) -> Array:
    """The body's axes where the turns are about some of them; else axes along the turns."""
    axes = [np.asarray(turn.axis) for turn in turns]
    if len(axes) < 2 or all(np.abs(axis).max() > 1.0 - 1e-12 for axis in axes):
        return np.eye(3)
    third = np.cross(axes[0], axes[1])
    third /= np.linalg.norm(third)
    return np.stack([axes[0], axes[1], third], axis=1)
