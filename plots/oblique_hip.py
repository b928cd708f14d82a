"""The prototype's hip turned about axes between its own, its torques read out of Exudyn."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from generator import Plan, read_figure, static_torques
from generator.engine.chosen_springs import springs_of
from generator.frames import Sequence3, cross_matrix, matrix_from_rotation_vector
from springs import AxisSpring, Joining, SpringSet
from springs.operations import Array

JOINT = "left_hip_joint"

_NODES = 4
"""Gauss-Legendre nodes of a piece of a loop: exact for cubics and beyond."""

_PIECES = 6
"""Of a side of a loop, at least."""


@dataclass(frozen=True)
class Oblique:
    """Torques on the leg for turns of one size about several axes, shape (n,) each [N m].

    Attributes:
        along: the axis of the turn.
        across: it, in the half-way frame, towards flexion.
    """

    along: Array
    across: Array


@dataclass(frozen=True)
class Work:
    """Work of a joint that is carried along a way, shape (n,) each.

    Attributes:
        way: length covered in the space of rotation vectors [rad].
        work: done on the leg since the start [J].
    """

    way: Array
    work: Array


class ObliqueHip:
    """The left hip. Rotation vectors are given as components of abduction and flexion."""

    def __init__(self) -> None:
        """Take the figure, and the springs of this joint alone."""
        self._body = read_figure("prototype")
        self._springs = springs_of(self._body, Plan()).joints[JOINT]
        self._sequence = Sequence3(tuple(one.axis for one in self._body.joints[JOINT].chain))
        self._plane = np.array([self.about(m).direction for m in ("abduction", "flexion")])

    @property
    def axes(self) -> tuple[AxisSpring, ...]:
        """The springs about the joint's axes."""
        return self._springs.axes

    def about(self, motion: str) -> AxisSpring:
        """The spring about one axis: `abduction`, `flexion` or `medial rotation`."""
        return next(spring for spring in self.axes if spring.motion == motion)

    def torques(self, turns: Array, joining: Joining) -> Array:
        """Torque on the leg [N m] at rotation vectors [rad], pelvis's site axes, (n, 3) each."""
        matrices = matrix_from_rotation_vector(turns)
        poses = [{JOINT: self._sequence.angles(matrix)} for matrix in matrices]
        plan = Plan(springs=SpringSet({JOINT: self._springs}, joining))
        return static_torques(self._body, poses, plan)[JOINT]

    def oblique(self, turn: float, directions: Array, joining: Joining) -> Oblique:
        """Torques of a turn [rad] about axes at `directions` from abduction to flexion [rad]."""
        axes = np.stack([np.cos(directions), np.sin(directions)], axis=1) @ self._plane
        across = np.stack([-np.sin(directions), np.cos(directions)], axis=1) @ self._plane
        half = matrix_from_rotation_vector(0.5 * turn * axes)
        torques = np.einsum("nji,nj->ni", half, self.torques(turn * axes, joining))
        return Oblique(np.sum(torques * axes, axis=1), np.sum(torques * across, axis=1))

    def carried(self, corners: Sequence[tuple[float, float]], joining: Joining) -> Work:
        """Work on the leg carried along straight sides from corner to corner [rad].

        The torque is read at Gauss-Legendre nodes of pieces of the sides, which end where a law has
        a corner, and multiplied with the turn of the leg that belongs to the step between them.
        """
        nodes, weights = np.polynomial.legendre.leggauss(_NODES)
        turns: list[Array] = []
        steps: list[Array] = []
        way = [0.0]
        for start, end in pairwise(np.array(corners)):
            for low, high in pairwise(self._cuts(start, end)):
                share = low + 0.5 * (high - low) * (nodes + 1.0)
                turns.append((start + share[:, None] * (end - start)) @ self._plane)
                lengths: Array = 0.5 * (high - low) * weights
                steps.append(lengths[:, None] * ((end - start) @ self._plane))
                way.append(way[-1] + (high - low) * float(np.linalg.norm(end - start)))
        at = np.concatenate(turns)
        turned = np.einsum("nij,nj->ni", _turn_map(at), np.concatenate(steps))
        work = np.sum(self.torques(at, joining) * turned, axis=1)
        pieces = np.sum(work.reshape(-1, _NODES), axis=1)
        return Work(np.array(way), np.concatenate([[0.0], np.cumsum(pieces)]))

    def _cuts(self, start: Array, end: Array) -> list[float]:
        """Where a side is cut into pieces, from 0 to 1."""
        cuts = {k / _PIECES for k in range(_PIECES + 1)}
        for spring in self.axes:
            first, last = (float(p @ self._plane @ spring.direction) for p in (start, end))
            for corner in (corner for law in spring.elastic for corner in law.corners):
                if min(first, last) < corner < max(first, last):
                    cuts.add((corner - first) / (last - first))
        return sorted(cuts)


def _turn_map(turns: Array) -> Array:
    """What makes the turn of a body out of the change of its rotation vector, (n, 3, 3).

    1 + (1 - cos a)/a^2 [r]x + (a - sin a)/a^3 [r]x^2, in the axes of what it turns against.
    """
    a = np.linalg.norm(turns, axis=1)[:, None, None]
    k = cross_matrix(turns)
    return np.eye(3) + (1.0 - np.cos(a)) / a**2 * k + (a - np.sin(a)) / a**3 * (k @ k)
