"""Displacements whose sites are nearest to measured markers, frame by frame.

The sum of weighted squared distances is minimised by the method of Levenberg and Marquardt, in all
frames at once. Limits of joints are kept by leaving out displacements that press against them, as a
projected gradient method does; linked displacements follow their controls.
"""

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from generator.diagnostics import InputError, error
from generator.inverse.dynamics import curve_columns
from generator.inverse.markers import Markers, MarkerSite
from generator.inverse.moments import body_height
from generator.kinematics.links import NO_LINKS, Coordinate, Links
from generator.kinematics.placement import initial_displacements
from generator.kinematics.tree import Tree
from generator.rotations import Array

Bools = NDArray[np.bool_]

MAX_ITERATIONS = 200
"""Steps of a frame."""

STEP_TOLERANCE = 1e-9
"""Largest change of a displacement at which a frame is done [rad or m]."""

COST_TOLERANCE = 1e-14
"""Relative decrease of the sum of squares at which a frame is done."""

FIRST_DAMPING, LEAST_DAMPING, LARGEST_DAMPING = 1e-3, 1e-15, 1e12
"""Damping of the normal equations, relative to their diagonal."""

MAX_TURN = 0.5
"""Largest change of an angle in a step, so that no joint turns over [rad]."""

_FRAMES_AT_ONCE = 500
"""Frames of a batch, for the memory."""

_WORSE = 2.0
"""Root-mean-square distance over the median at which a frame is solved again from its neighbour."""

_OPEN_EIGENVALUE = 1e-9
"""Eigenvalue of the scaled normal equations below which a direction is not determined."""

_OPEN_SHARE = 1e-3
"""Part of a displacement in such directions from which it counts as open."""

MIN_MARKERS = 3
"""Least number of markers by which the position of a body is known."""


@dataclass(frozen=True, eq=False)
class Tracked:
    """Displacements of a tree over n frames, and how near its sites are to k markers.

    Attributes:
        displacements: Displacements by joint, shape (n, degrees of freedom) [rad or m].
        distances: Distance of each marker from its site, shape (n, k), nan where it is missing [m].
        markers: Names of the markers.
        undetermined: Number of frames in which markers leave a displacement open.
        at_limits: Displacements that are at a limit in some frame.
    """

    displacements: Mapping[str, Array]
    distances: Array
    markers: tuple[str, ...]
    undetermined: Mapping[Coordinate, int]
    at_limits: tuple[Coordinate, ...]

    @property
    def rms_mm(self) -> float:
        """Root mean square of all distances [mm]."""
        return 1e3 * float(np.sqrt(np.nanmean(self.distances**2)))


class _Problem:
    """Markers on a tree: distances, their slopes, limits and links."""

    def __init__(
        self,
        tree: Tree,
        sites: Sequence[MarkerSite],
        weights: Array,
        links: Links,
    ) -> None:
        kinematics = tree.kinematics
        self.tree, self.sites, self.roots = tree, sites, np.sqrt(weights)
        own = initial_displacements(tree)
        self.start = kinematics.displacement_vector({n: own[n] for n in kinematics.columns})
        self.freedoms = [
            Coordinate(joint, k - columns.start)
            for joint, columns in kinematics.columns.items()
            for k in range(columns.start, columns.stop)
        ]
        self.curves = list(curve_columns(tree))
        curved = {self.freedoms[own] for own, *_ in self.curves}
        self.matrix, self.offset = _free_matrix(self.freedoms, links, curved)
        self.is_plain = not links.links and not curved
        self.places: dict[str, list[int]] = {}
        for k, site in enumerate(sites):
            self.places.setdefault(site.segment, []).append(k)
        self.lower, self.upper = self._bounds()
        self.owners = [self.freedoms[int(np.argmax(np.abs(row)))] for row in self.matrix.T]
        joints = tree.figure.joints
        is_angle = [joints[at.joint].chain[at.index].units.is_angle for at in self.owners]
        self.is_angle: Array = np.array(is_angle, dtype=float)
        self.largest_step = np.where(is_angle, MAX_TURN, np.inf)

    def _bounds(self) -> tuple[Array, Array]:
        """Return the limits of the free displacements, shape (f,) [rad or m]."""
        free = self.matrix.shape[1]
        lower, upper = np.full(free, -np.inf), np.full(free, np.inf)
        for row, offset, at in zip(self.matrix, self.offset, self.freedoms, strict=True):
            if not row.any():
                continue
            joint = self.tree.figure.joints[at.joint]
            ends = (joint.lower_limit or (-np.inf,) * 9, joint.upper_limit or (np.inf,) * 9)
            k = int(np.argmax(np.abs(row)))
            low, high = sorted((ends[s][at.index] - offset) / row[k] for s in (0, 1))
            lower[k], upper[k] = max(lower[k], low), min(upper[k], high)
        return lower, np.maximum(lower, upper)

    def values(self, free: Array) -> Array:
        """Return all displacements, shape (n, m), of free ones, shape (n, f) [rad or m]."""
        values = free @ self.matrix.T + self.offset
        for own, control, curve in self.curves:
            values[:, own] = curve.at(values[:, control])
        return values

    def residuals(self, free: Array, targets: Array) -> Array:
        """Return weighted differences, shape (n, k, 3), zero for missing markers."""
        poses = self.tree.kinematics.poses(self.values(free))
        return self._weighted(targets - self.positions(poses))

    def positions(self, poses: Mapping[str, Array]) -> Array:
        """Return the positions of the sites, shape (n, k, 3) [m]."""
        found: list[Array] = []
        for site in self.sites:
            pose = poses[site.segment]
            found.append(pose[:, :3, :3] @ np.array(site.place) + pose[:, :3, 3])
        return np.stack(found, axis=1)

    def _weighted(self, differences: Array) -> Array:
        return np.nan_to_num(differences * self.roots[:, None], nan=0.0)

    def system(self, free: Array, targets: Array) -> tuple[Array, Array]:
        """Return the normal equations, shapes (n, f, f) and (n, f).

        The velocity of a point x for a twist (w, v) is v + w x x, for all markers of a segment.
        """
        kinematics = self.tree.kinematics
        values = self.values(free)
        poses, twists = kinematics.poses(values), kinematics.twists(values)
        positions = self.positions(poses)
        residuals = self._weighted(targets - positions)
        seen = self.roots * (1.0 - np.isnan(targets).max(axis=2))
        normal: Array = np.zeros((len(free), free.shape[1], free.shape[1]))
        right: Array = np.zeros_like(free)
        for segment, places in self.places.items():
            x, y, z = np.moveaxis(positions[:, places], 2, 0)
            zero, one = np.zeros_like(x), np.ones_like(x)
            rows = [zero, z, -y, one, zero, zero, -z, zero, x, zero, one, zero, y, -x, zero]
            rows += [zero, zero, one]
            arms = np.stack(rows, axis=2).reshape(len(free), -1, 6)
            arms = arms * np.repeat(seen[:, places], 3, axis=1)[:, :, None]
            slopes = twists * kinematics.motion_masks[segment][None, :, None]
            for own, control, curve in self.curves:
                slope = curve.at(values[:, control], 1)
                slopes[:, control] += slope[:, None] * slopes[:, own]
            slopes = slopes if self.is_plain else np.einsum("nma,mf->nfa", slopes, self.matrix)
            slopes = slopes @ np.swapaxes(arms, 1, 2)
            normal += slopes @ np.swapaxes(slopes, 1, 2)
            right += (slopes @ residuals[:, places].reshape(len(free), -1, 1))[..., 0]
        return normal, right

    def solve(self, free: Array, targets: Array) -> tuple[Array, Array]:
        """Minimise from a start, shape (n, f); return displacements and sums of squares, (n,)."""
        free = np.clip(free, self.lower, self.upper)
        cost = (self.residuals(free, targets) ** 2).sum(axis=(1, 2))
        damping, active = np.full(len(free), FIRST_DAMPING), np.arange(len(free))
        for _ in range(MAX_ITERATIONS):
            if not len(active):
                break
            at, aims = free[active], targets[active]
            normal, right = self.system(at, aims)
            pressed = ((at <= self.lower) & (right < 0.0)) | ((at >= self.upper) & (right > 0.0))
            moved = self._step(normal, right, pressed, damping[active])
            moved = np.clip(moved, -self.largest_step, self.largest_step)
            new = np.clip(at + moved, self.lower, self.upper)
            step = np.abs(new - at).max(axis=1)
            costs = (self.residuals(new, aims) ** 2).sum(axis=(1, 2))
            better = costs <= cost[active]
            step[better & (cost[active] - costs <= COST_TOLERANCE * costs)] = 0.0
            chosen = active[better]
            free[chosen], cost[chosen] = new[better], costs[better]
            damping[chosen] = np.maximum(damping[chosen] * 0.1, LEAST_DAMPING)
            worse = active[~better]
            damping[worse] *= 10.0
            active = active[(step > STEP_TOLERANCE) & (damping[active] < LARGEST_DAMPING)]
        return free, cost

    def _step(self, normal: Array, right: Array, pressed: Bools, damping: Array) -> Array:
        """Return the damped step of displacements that are not pressed, shape (n, f)."""
        size = normal.shape[1]
        diagonal = np.einsum("nii->ni", normal)
        scale = diagonal + 1e-12 * diagonal.max(axis=1, keepdims=True) + 1e-300
        loose = ~pressed
        matrix = normal * (loose[:, :, None] & loose[:, None, :])
        added = np.where(pressed, 1.0, damping[:, None] * scale + 1e-14 * scale.max())
        matrix = matrix + added[:, :, None] * np.eye(size)
        step = np.asarray(np.linalg.solve(matrix, (right * loose)[..., None]), dtype=float)
        return step[..., 0]


def _free_matrix(
    freedoms: Sequence[Coordinate], links: Links, curved: Container[Coordinate]
) -> tuple[Array, Array]:
    """Return Z and o of displacements q = Z z + o, with z those that follow nothing.

    Displacements that follow by curves are zero.
    """
    followers = {link.follower: link for link in links.resolved}
    free = [at for at in freedoms if at not in followers and at not in curved]
    columns = {at: k for k, at in enumerate(free)}
    matrix, offset = np.zeros((len(freedoms), len(free))), np.zeros(len(freedoms))
    for row, at in enumerate(freedoms):
        if at in curved:
            continue
        link = followers.get(at)
        matrix[row, columns[at if link is None else link.control]] = (
            1.0 if link is None else link.factor
        )
        offset[row] = 0.0 if link is None else link.offset
    return matrix, offset


def track_markers(
    tree: Tree,
    markers: Markers,
    sites: Mapping[str, MarkerSite],
    weights: Mapping[str, float] | None = None,
    links: Links = NO_LINKS,
) -> Tracked:
    """Return the displacements whose sites are nearest to markers.

    Args:
        tree: Tree of the figure, without loops.
        markers: Trajectories of markers; those without a site are left out.
        sites: Sites by the names of markers.
        weights: Weights of squared distances by marker; 1 by default, 0 leaves one out.
        links: Displacements that follow others, beside those of the figure's file.

    Raises:
        InputError: The markers do not determine the position of the figure, or have other units.
    """
    chosen = dict(weights or {})
    used = [n for n in markers.names if n in sites and chosen.get(n, 1.0) > 0.0]
    if len(used) < MIN_MARKERS:
        message = f"{len(used)} markers are sites of the figure; at least {MIN_MARKERS} are needed"
        hint = "a marker is on the site `SEGMENT.SITE`, or on the only site of its name"
        raise InputError([error(message, hint=hint)])
    places = [markers.names.index(name) for name in used]
    targets = markers.positions[:, places]
    _check_targets(markers.times, targets, body_height(tree.figure))
    problem = _Problem(
        tree,
        [sites[n] for n in used],
        np.array([chosen.get(n, 1.0) for n in used]),
        links,
    )
    free = _solve_frames(problem, targets)
    values = problem.values(free)
    stuck: Array = ((free <= problem.lower) | (free >= problem.upper)).max(axis=0)
    owners = problem.owners
    frames = _open_frames(problem.system(free, targets)[0])
    poses = tree.kinematics.poses(values)
    distances = np.linalg.norm(targets - problem.positions(poses), axis=2)
    return Tracked(
        {name: values[:, columns] for name, columns in tree.kinematics.columns.items()},
        distances,
        tuple(used),
        {at: count for at, count in zip(owners, frames, strict=True) if count},
        tuple(at for at, ends in zip(owners, stuck.tolist(), strict=True) if ends),
    )


def _open_frames(normal: Array) -> list[int]:
    """Return the number of frames in which the equations leave each displacement open, (f,)."""
    sizes = np.sqrt(np.einsum("nii->ni", normal))
    scale = np.where(sizes > 0.0, sizes, 1.0)
    values, vectors = np.linalg.eigh(normal / scale[:, :, None] / scale[:, None, :])
    is_open = values < _OPEN_EIGENVALUE
    shares = np.einsum("nfk,nk->nf", vectors**2, is_open.astype(float))
    return (shares > _OPEN_SHARE).sum(axis=0).tolist()


def _check_targets(times: Array, targets: Array, height: float) -> None:
    """Raise InputError for frames with too few markers, and for markers in another unit."""
    counts = (~np.isnan(targets).any(axis=2)).sum(axis=1)
    few = np.flatnonzero(counts < MIN_MARKERS)
    if len(few):
        message = f"at {times[few[0]]:g} s only {counts[few[0]]} markers are seen"
        others = f", and in {len(few) - 1} more frames" if len(few) > 1 else ""
        hint = f"at least {MIN_MARKERS}: fill the gap, or cut the trial there"
        raise InputError([error(f"{message}{others} are too few", hint=hint)])
    size = float(np.nanmax(np.nanmax(targets[0], axis=0) - np.nanmin(targets[0], axis=0)))
    if not height / 20.0 < size < 20.0 * height:
        message = f"the markers span {size:.3g} m, the figure {height:.3g} m"
        raise InputError([error(message, hint="the units of the file are others than it says")])


def _solve_frames(problem: _Problem, targets: Array) -> Array:
    """Return the free displacements of all frames, shape (n, f)."""
    first = _solve_first(problem, targets[:1])
    free = np.empty((len(targets), first.shape[1]))
    cost = np.empty(len(targets))
    start = first
    for k in range(0, len(targets), _FRAMES_AT_ONCE):
        some = slice(k, k + _FRAMES_AT_ONCE)
        count = len(targets[some])
        free[some], cost[some] = problem.solve(np.repeat(start, count, axis=0), targets[some])
        start = free[some][-1:]
    limit = _WORSE**2 * float(np.median(cost))
    for before, here in pairwise(range(len(targets))):
        if cost[here] > limit:
            again, sums = problem.solve(free[before : before + 1], targets[here : here + 1])
            if sums[0] < cost[here]:
                free[here], cost[here] = again[0], sums[0]
    return free


def _solve_first(problem: _Problem, targets: Array) -> Array:
    """Return the displacements of the first frame, the best of several turns of the root."""
    places = [problem.freedoms.index(at) for at in problem.owners]
    start: Array = (problem.start - problem.offset)[places] / np.diag(problem.matrix[places])
    figure = problem.tree.figure
    roots = {one.joint.name for one in problem.tree.joints if one.inboard in figure.ground}
    starts = [start]
    for k, at in enumerate(problem.owners):
        if at.joint in roots and problem.is_angle[k]:
            starts += [
                start + turn * np.eye(len(start))[k] for turn in (np.pi / 2, np.pi, -np.pi / 2)
            ]
    free, cost = problem.solve(np.array(starts), np.repeat(targets, len(starts), axis=0))
    best: Array = free[int(np.argmin(cost))]
    is_free = problem.is_angle * (problem.lower == -np.inf) * (problem.upper == np.inf)
    return (best - 2.0 * np.pi * np.round((best - start) / (2.0 * np.pi)) * is_free)[None]
