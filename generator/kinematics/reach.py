"""Inverse kinematics: the pose in which a point of a segment is nearest to a target.

The squared distance is reduced by damped Newton steps (Levenberg and Marquardt's damping) on the
Jacobian of the tree. Its eigenvalues are taken by their size, so that a stretched limb, at which
the gradient may be zero although bending it would help, is left along the direction of negative
curvature, and a joint at a pole has bounded steps. A step is taken only if it shortens the
distance: a target out of reach ends at the nearest pose, not in oscillations. Limits are an active
set; loops are constraints, to which every step is projected.
"""

from collections.abc import Sequence, Set
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from generator.diagnostics import ModelError
from generator.figure import Joint
from generator.kinematics.links import Coordinate, figure_links
from generator.kinematics.loops import (
    MAX_LOOP_GAP,
    close_loops,
    closing_displacements,
    twists_at_child,
)
from generator.kinematics.placement import (
    Displacements,
    Placement,
    forward_kinematics,
    relative_jacobian,
    segment_jacobians,
    with_followers,
)
from generator.kinematics.tree import Tree
from generator.rotations import Array, cross_matrix, rotation_vector_from_matrix

ROTATION_LENGTH = 0.2
"""Length by which an error of the orientation counts beside one of the position [m/rad]."""

MAX_ITERATIONS = 60

MAX_STEP = 0.3
"""Largest change of a displacement in a step [rad or m]."""

CLOSE_ENOUGH = 1e-7
"""Distance at which the target counts as reached [m]."""

MIN_GRADIENT = 1e-9
"""Slope of the squared distance at which a pose counts as the nearest one [m2/rad]."""

FIRST_DAMPING, MIN_DAMPING = 1e-4, 1e-9
"""Damping added to the curvature of half the squared distance, at first and at last [m2]."""

_MIN_STEP = 1e-10

_ESCAPE_STEP = 0.03
"""Step along a direction of negative curvature where the gradient is zero [rad or m]."""

_MIN_CURVATURE = 1e-6

_MAX_CURVED_COORDINATES = 80
"""Displacements up to which the curvature of the motion is taken into account; its cost is that of
an eigenvalue problem. Steps of longer chains use the Jacobian alone."""

_AT_LIMIT = 1e-6
"""Distance from its limit at which a closing joint counts as being at it [rad or m]."""

_MAX_PROJECTION_STEPS = 20


@dataclass(frozen=True, eq=False)
class Target:
    """A point of a segment and the position at which it is wanted.

    Attributes:
        segment: its name.
        point: point in the segment's frame [m], shape (3,).
        position: position in the world [m], shape (3,).
        orientation: orientation of the segment in the world, shape (3, 3); None if any will do.
    """

    segment: str
    point: Array
    position: Array
    orientation: Array | None = None

    def error(self, pose: Array) -> Array:
        """Rotation vector times `ROTATION_LENGTH` and translation to the target [m], shape (6,)."""
        turn = np.zeros(3)
        if self.orientation is not None:
            turn = ROTATION_LENGTH * rotation_vector_from_matrix(self.orientation @ pose[:3, :3].T)
        return np.concatenate([turn, self.position - self.place(pose)])

    def place(self, pose: Array) -> Array:
        """Position of the point in the world [m] at a pose (4, 4) of the segment, shape (3,)."""
        return pose[:3, :3] @ self.point + pose[:3, 3]


def reach(
    tree: Tree,
    displacements: Displacements,
    target: Target,
    locked: Set[str] = frozenset(),
) -> Placement:
    """Return the placement nearby in which a point of a segment is nearest to its target.

    Joints stay within the limits of the figure; one that starts outside does not move further out.

    Args:
        tree: tree of the figure.
        displacements: displacements at which the search starts, of all joints [rad or m].
        target: target of a point of a segment.
        locked: names of the joints that do not move.

    Raises:
        ModelError: the target is not finite or not of this figure.
        OpenLoopError: the loops cannot be closed at the start.
    """
    if target.segment not in tree.figure.segments:
        raise ModelError(f"the figure has no segment `{target.segment}`")
    if not np.all(np.isfinite(np.concatenate([target.point, target.position]))):
        raise ModelError("the target must be finite")
    space = _Space(tree, frozenset(locked), displacements)
    return _Search(space, target, space.consistent(displacements)).run()


def follow_and_close(
    tree: Tree,
    displacements: Displacements,
    fixed: Set[str] = frozenset(),
) -> Placement:
    """Return the placement at displacements with loops closed.

    Args:
        tree: tree of the figure.
        displacements: displacements of all joints [rad or m]; those of followers are ignored.
        fixed: names of the joints whose displacements must not change to close loops.

    Raises:
        OpenLoopError: no pose nearby closes the loops.
    """
    return _Space(tree, frozenset(fixed), displacements).consistent(displacements)


class _Space:
    """The displacements of a tree that are independent of each other: no followers, not locked.

    Attributes:
        basis: change of the m displacements of the tree by the k independent ones, shape (m, k), at
            the start.
        lower: limits of the m displacements [rad or m]; infinite where there is none.
        upper: the same.
    """

    def __init__(self, tree: Tree, locked: frozenset[str], start: Displacements) -> None:
        """Number the independent displacements."""
        self.tree, self.locked = tree, locked
        coordinates = [
            Coordinate(name, k)
            for name, columns in tree.kinematics.columns.items()
            for k in range(columns.stop - columns.start)
        ]
        columns = {coordinate: k for k, coordinate in enumerate(coordinates)}
        own = [one for one in figure_links(tree.figure).links if one.follower in columns]
        followers = {link.follower for link in own}
        groups = {
            coordinate: np.eye(len(columns))[k]
            for coordinate, k in columns.items()
            if coordinate not in followers
        }
        for link in own:
            slope = link.at(start[link.control.joint][link.control.index], 1)
            for group in groups.values():
                group[columns[link.follower]] = slope * group[columns[link.control]]
        free = [group for coordinate, group in groups.items() if coordinate.joint not in locked]
        self.basis = np.array(free).reshape(-1, len(columns)).T
        joints = [branch.joint for branch in tree.joints]
        self.lower, self.upper = (_limits(joints, end) for end in ("lower_limit", "upper_limit"))
        self.closing_lower, self.closing_upper = (
            _limits(tree.closures, end) for end in ("lower_limit", "upper_limit")
        )

    def consistent(self, displacements: Displacements) -> Placement:
        """Return the placement with loops closed. Raises OpenLoopError."""
        followed = with_followers(self.tree.figure, displacements)
        if not self.tree.closures:
            return forward_kinematics(self.tree, followed)
        start = self.place(self.tree.kinematics.displacement_vector(followed), followed)
        rows = _Constraints(self, start, followed)
        if rows.largest <= MAX_LOOP_GAP:
            return start
        closed = self.project(start, np.ones(self.basis.shape[1], bool), followed)
        if closed is not None:
            return closed
        return close_loops(self.tree, followed, self.locked)

    def place(self, values: Array, near: Displacements) -> Placement:
        """Return the placement at displacements of the tree, closing joints nearest to `near`."""
        tree = self.tree
        rows = {name: values[columns] for name, columns in tree.kinematics.columns.items()}
        rows = with_followers(tree.figure, rows)
        rigid = {name: np.zeros(0) for name, joint in tree.figure.joints.items() if not joint.chain}
        placement = forward_kinematics(tree, {**rigid, **rows})
        ordered = {**rigid, **rows, **closing_displacements(placement, near)}
        names = [name for name in tree.figure.joints if name in ordered]
        return Placement(tree, {name: ordered[name] for name in names}, placement.poses)

    def project(
        self, placement: Placement, free: NDArray[np.bool_], locked_at: Displacements
    ) -> Placement | None:
        """Return the placement with loops closed by the free displacements; None if none is found.

        Args:
            placement: nearby.
            free: which of the independent displacements may change, shape (k,).
            locked_at: displacements of locked closing joints [rad or m].
        """
        basis = self.basis[:, free]
        for _ in range(_MAX_PROJECTION_STEPS):
            rows = _Constraints(self, placement, locked_at)
            if rows.largest <= 0.1 * MAX_LOOP_GAP:
                return placement
            step = np.linalg.lstsq(rows.jacobian @ basis, -rows.residual, rcond=1e-8)[0]
            if not np.max(np.abs(step), initial=0.0) <= 1.0:
                return None
            values = self.tree.kinematics.displacement_vector(placement.displacements)
            placement = self.place(values + basis @ step, placement.displacements)
        return (
            placement if _Constraints(self, placement, locked_at).largest <= MAX_LOOP_GAP else None
        )


class _Constraints:
    """Equations of closed loops and of locked closing joints in a placement.

    Attributes:
        residual: zero where they hold [m or rad], shape (c,).
        jacobian: jacobian by the displacements of the tree, shape (c, m).
        closing: displacements of all closing joints [rad or m], shape (j,).
        closing_rates: their Jacobian by the displacements of the tree, shape (j, m).
        largest: residual of the placement itself [m or rad].
    """

    def __init__(self, space: _Space, placement: Placement, locked_at: Displacements) -> None:
        """Evaluate them."""
        tree = placement.tree
        size = tree.kinematics.size
        maps = segment_jacobians(placement)
        residuals, rows = [np.zeros(0)], [np.zeros((0, size))]
        values, rates = [np.zeros(0)], [np.zeros((0, size))]
        for joint in tree.closures:
            motion = relative_jacobian(placement, maps, joint)
            pose = placement.pose_in_parent(joint)
            own = placement.displacements[joint.name]
            chain = tree.chains[joint.name]
            twists = twists_at_child(chain.twists(own), pose[:3, 3]).T
            inverse = np.linalg.pinv(twists) if twists.size else np.zeros((0, 6))
            gap = chain.pose_residual(pose)
            gap = np.concatenate([pose[:3, :3] @ gap[:3], pose[:3, :3] @ gap[3:]])
            residuals.append(gap)
            rows.append(motion - twists @ (inverse @ motion))
            values.append(own)
            rates.append(inverse @ motion)
            if joint.name in space.locked:
                residuals.append(own - locked_at[joint.name])
                rows.append(inverse @ motion)
        self.closing, self.closing_rates = np.concatenate(values), np.vstack(rates)
        self.residual, self.jacobian = np.concatenate(residuals), np.vstack(rows)
        self.largest = float(np.max(np.abs(self.residual), initial=0.0))


class _Search:
    """A descent from a consistent placement to the nearest one to a target."""

    def __init__(self, space: _Space, target: Target, start: Placement) -> None:
        """Set the limits around the start."""
        self.space, self.target, self.placement = space, target, start
        self.start = start.displacements
        kinematics = space.tree.kinematics
        self.order = _columns_from_root(space.tree, target.segment)
        self.values = kinematics.displacement_vector(start.displacements)
        self.lower = np.minimum(space.lower, self.values)
        self.upper = np.maximum(space.upper, self.values)
        closing = [start.displacements[joint.name] for joint in space.tree.closures]
        at_start = np.concatenate([np.zeros(0), *closing])
        self.closing_lower = np.minimum(space.closing_lower, at_start)
        self.closing_upper = np.maximum(space.closing_upper, at_start)

    def run(self) -> Placement:
        """Return the placement at the end of the descent."""
        if not self.space.basis.size or not self.order.size:
            return self.placement
        longest, damping = MAX_STEP, FIRST_DAMPING
        slope, curvature, constraints = self._model()
        for _ in range(MAX_ITERATIONS):
            distance = self._distance(self.placement)
            if distance <= CLOSE_ENOUGH or longest < _MIN_STEP:
                break
            changes = self._changes(slope, curvature, constraints, damping, longest)
            if not changes:
                break
            gain = expected = 0.0
            for change in changes:
                step = self._cut(change, constraints)
                placement = self._placement_after(step, constraints)
                if placement is not None:
                    gain = 0.5 * (distance**2 - self._distance(placement) ** 2)
                    expected = float(slope @ step - 0.5 * step @ curvature @ step)
                    if gain > 0.0:
                        self.placement = placement
                        break
            if len(changes) == 1:
                # The size of steps in which the quadratic model is good (a trust region).
                if gain < 0.25 * expected or gain <= 0.0:
                    longest = 0.3 * min(longest, float(np.max(np.abs(changes[0]))))
                elif gain > 0.7 * expected:
                    longest = min(2.0 * longest, MAX_STEP)
            elif gain <= 0.0:
                break
            if gain > 0.0:
                damping = max(0.1 * damping, MIN_DAMPING)
                displacements = self.placement.displacements
                self.values = self.space.tree.kinematics.displacement_vector(displacements)
                slope, curvature, constraints = self._model()
        return self.placement

    def _distance(self, placement: Placement) -> float:
        """Distance to the target, with that of the orientation [m]."""
        return float(np.linalg.norm(self.target.error(placement.poses[self.target.segment])))

    def _model(self) -> tuple[Array, Array, _Constraints | None]:
        """Return the descent direction (k,) and the curvature of half the squared distance."""
        space, target = self.space, self.target
        pose = self.placement.poses[target.segment]
        twists = space.tree.kinematics.twists(self.values)
        mask = space.tree.kinematics.motion_masks[target.segment]
        angular = (twists[:, :3] * mask[:, None]).T
        linear = (twists[:, 3:] * mask[:, None]).T + (cross_matrix(target.place(pose)).T @ angular)
        error = target.error(pose)
        weight = ROTATION_LENGTH if target.orientation is not None else 0.0
        rows = np.vstack([weight * angular, linear]) @ space.basis
        slope = rows.T @ error
        curvature = rows.T @ rows
        if len(self.order) <= _MAX_CURVED_COORDINATES:
            bent = np.zeros((space.tree.kinematics.size,) * 2)
            # Of two axes of a branch the inner one turns the velocity due to the outer one.
            inner = np.cross(angular[:, self.order].T[:, None], linear[:, self.order].T[None])
            part = np.triu(inner @ error[3:])
            bent[np.ix_(self.order, self.order)] = part + np.triu(part, 1).T
            curvature = curvature - space.basis.T @ bent @ space.basis
        closed = _Constraints(space, self.placement, self.start) if space.tree.closures else None
        return slope, curvature, closed

    def _changes(
        self,
        slope: Array,
        curvature: Array,
        constraints: _Constraints | None,
        damping: float,
        longest: float,
    ) -> list[Array]:
        """Return the step (k,) of the independent displacements; at a saddle two, out of it.

        Where the distance is the smallest one nearby there is none.
        """
        space = self.space
        size = len(slope)
        at_low, at_high = self._at_limits()
        free = np.ones(size, bool)
        if constraints is None:
            free = ~((at_low & (slope < 0.0)) | (at_high & (slope > 0.0)))
        rows = np.zeros((0, size))
        closing = np.zeros((0, size))
        at_closing_low = at_closing_high = np.zeros(0, bool)
        if constraints is not None:
            rows = constraints.jacobian @ space.basis
            closing = constraints.closing_rates @ space.basis
            at_closing_low = constraints.closing <= self.closing_lower + _AT_LIMIT
            at_closing_high = constraints.closing >= self.closing_upper - _AT_LIMIT
        while True:
            step, escape = _newton_step(slope, curvature, rows, free, damping, longest)
            out = free & ((at_low & (step < 0.0)) | (at_high & (step > 0.0)))
            rates = closing @ step
            stopped = (at_closing_low & (rates < -1e-12)) | (at_closing_high & (rates > 1e-12))
            if not np.any(out) and not np.any(stopped):
                break
            free &= ~out
            rows = np.vstack([rows, closing[stopped]])
            at_closing_low, at_closing_high = at_closing_low & ~stopped, at_closing_high & ~stopped
        if escape is not None:
            return [_ESCAPE_STEP * escape, -_ESCAPE_STEP * escape]
        return [step] if np.any(step) else []

    def _at_limits(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return which of the independent displacements cannot fall and which cannot rise."""
        basis = self.space.basis
        low, high = (self.values <= self.lower)[:, None], (self.values >= self.upper)[:, None]
        falls = np.any((low & (basis > 0.0)) | (high & (basis < 0.0)), axis=0)
        rises = np.any((low & (basis < 0.0)) | (high & (basis > 0.0)), axis=0)
        return falls, rises

    def _cut(self, step: Array, constraints: _Constraints | None) -> Array:
        """Return a step cut where the first limits are met."""
        step = np.clip(step, *self._room())
        if constraints is None:
            return step
        rates = constraints.closing_rates @ self.space.basis @ step
        room = np.where(rates > 0.0, self.closing_upper, self.closing_lower) - constraints.closing
        moves = (np.abs(rates) > 1e-12) & (np.abs(room) > _AT_LIMIT)
        return step * min(1.0, float(np.min(0.95 * room[moves] / rates[moves], initial=inf)))

    def _placement_after(self, step: Array, constraints: _Constraints | None) -> Placement | None:
        """Return the placement after a step within the limits; None if loops do not close."""
        space = self.space
        values = np.clip(self.values + space.basis @ step, self.lower, self.upper)
        placed = space.place(values, self.placement.displacements)
        if constraints is None:
            return placed
        low, high = self._room()
        closed = space.project(placed, (low < step) & (step < high), self.start)
        return closed if closed is not None and self._within_limits(closed) else None

    def _room(self) -> tuple[Array, Array]:
        """Return the largest fall and rise of each independent displacement, shape (k,) each."""
        basis = self.space.basis
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = [
                np.where(basis != 0.0, (end - self.values)[:, None] / basis, np.nan)
                for end in (self.lower, self.upper)
            ]
        low, high = np.fmin(*ends), np.fmax(*ends)
        return np.fmax.reduce(low, axis=0), np.fmin.reduce(high, axis=0)

    def _within_limits(self, placement: Placement) -> bool:
        """Return whether all displacements are within the limits, those of closing joints too."""
        values = self.space.tree.kinematics.displacement_vector(placement.displacements)
        closing = [placement.displacements[joint.name] for joint in self.space.tree.closures]
        every = np.concatenate([values, *closing])
        lower = np.concatenate([self.lower, self.closing_lower])
        upper = np.concatenate([self.upper, self.closing_upper])
        return bool(np.all((lower <= every) & (every <= upper)))


def _newton_step(
    slope: Array,
    curvature: Array,
    rows: Array,
    free: NDArray[np.bool_],
    damping: float,
    longest: float,
) -> tuple[Array, Array | None]:
    """Return the damped step (k,), and a direction of negative curvature where the slope is zero.

    Args:
        slope: slope of the descent, shape (k,).
        curvature: curvature of half the squared distance, shape (k, k).
        rows: constraints that the step keeps, shape (c, k).
        free: displacements that may change, shape (k,).
        damping: least damping [m2].
        longest: change of a displacement, to which more damping restricts the step [rad or m].
    """
    step = np.zeros_like(slope)
    places = np.flatnonzero(free)
    if not places.size:
        return step, None
    span = np.eye(places.size)
    if rows.size:
        _, sizes, right = np.linalg.svd(rows[:, places])
        rank = int(np.sum(sizes > 1e-8 * max(1.0, float(sizes[0]))))
        span = right[rank:].T
        if not span.size:
            return step, None
    down = span.T @ slope[places]
    sizes, directions = np.linalg.eigh(span.T @ curvature[np.ix_(places, places)] @ span)
    along = directions.T @ down
    if np.max(np.abs(along)) <= MIN_GRADIENT:
        if sizes[0] >= -_MIN_CURVATURE:
            return step, None
        escape = np.zeros_like(slope)
        escape[places] = span @ directions[:, 0]
        return step, escape
    directions = span @ directions
    while True:
        step[places] = directions @ (along / (np.abs(sizes) + damping))
        if np.max(np.abs(step)) <= longest:
            return step, None
        damping *= 3.0


def _limits(joints: Sequence[Joint], end: str) -> Array:
    """Return the limits of all displacements of joints [rad or m]; infinite where none is set."""
    none = -inf if end == "lower_limit" else inf
    rows = [getattr(joint, end) or (none,) * len(joint.chain) for joint in joints]
    return np.array([value for row in rows for value in row], dtype=float)


def _columns_from_root(tree: Tree, segment: str) -> NDArray[np.intp]:
    """Return the places of the displacements that move a segment, from the root outwards."""
    kinematics = tree.kinematics
    mask = kinematics.motion_masks[segment]
    found: list[int] = []
    for branch in tree.joints:
        columns = kinematics.columns[branch.joint.name]
        places = [k for k in range(columns.start, columns.stop) if mask[k]]
        found += places[::-1] if branch.parent_is_inboard else places
    return np.array(found, dtype=np.intp)
