"""A tree that another engine accelerates and SciPy integrates, and what is measured of a motion."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from math import nan
from typing import Protocol

import numpy as np
from scipy.integrate import DOP853, solve_ivp

from benchmarks.passive_law import CurveLaw, PassiveLaw
from benchmarks.tree import TreeModel
from generator.rotations import Array


@dataclass(frozen=True)
class Fall:
    """A motion of n frames; SI units.

    Attributes:
        rotations: of each joint's child in its parent, shape (n, 3, 3).
        centre: of mass, in the world, shape (n, 3) [m]; empty where it was not asked for.
        energy: kinetic, of gravity and of springs together, shape (n,) [J]; or empty.
        wall: time spent integrating [s].
        cpu: CPU time of it, of all threads [s].
        evaluations: of accelerations, or steps where the engine integrates by itself.
    """

    rotations: Mapping[str, Array]
    centre: Array
    energy: Array
    wall: float
    evaluations: int = 0
    cpu: float = nan


@dataclass(frozen=True)
class Landing:
    """A motion onto a floor at y = 0, at n steps or frames; SI units.

    Attributes:
        times: shape (n,) [s].
        centre: of mass, shape (n, 3) [m].
        forces: normal force of the floor on each segment that may touch it, shape (n,) [N].
        rotations: of each joint's child in its parent at the end, shape (3, 3).
    """

    times: Array
    centre: Array
    forces: Mapping[str, Array]
    rotations: Mapping[str, Array]

    @property
    def floor_force(self) -> Array:
        """Normal force on the whole figure, shape (n,) [N]."""
        return np.sum(list(self.forces.values()), axis=0)


class Clock:
    """Wall time and CPU time of all threads, summed over the blocks that it encloses [s]."""

    def __init__(self) -> None:
        """Set both to zero."""
        self.wall = self.cpu = 0.0

    def __enter__(self) -> "Clock":
        """Start."""
        self._begun = time.perf_counter(), time.process_time()
        return self

    def __exit__(self, *_: object) -> None:
        """Stop, and add what has passed."""
        self.wall += time.perf_counter() - self._begun[0]
        self.cpu += time.process_time() - self._begun[1]


class Accelerator(Protocol):
    """An engine that knows the accelerations of a tree under gravity."""

    def accelerations(
        self,
        quaternions: Array,
        angles: Array,
        spins: Array,
        rates: Array,
        torques: tuple[Array, Array],
    ) -> tuple[Array, Array]:
        """Of the balls' spins in the tips' axes, shape (b, 3), and of the hinges' rates (h,)."""
        ...

    def book(
        self, quaternions: Array, angles: Array, spins: Array, rates: Array
    ) -> tuple[Array, float]:
        """Centre of mass [m], and kinetic energy with that of gravity [J]."""
        ...


def fall(
    model: TreeModel,
    law: PassiveLaw,
    engine: Accelerator,
    stop: float,
    tolerance: float,
    frame: float | None = 0.02,
    split: bool = False,
) -> Fall:
    """Integrate with SciPy's DOP853; a relative and an absolute tolerance alike.

    `frame` [s] is that of the result; None keeps the last state only, and no book. `split` tells
    whether steps end where a curve enters or leaves its dead zone.
    """
    b = len(model.balls)

    def rate(_: float, state: Array) -> Array:
        q, angles, spins, rates = model.parts(state)
        q = q / np.sqrt(np.sum(q * q, axis=-1, keepdims=True))
        gained = engine.accelerations(q, angles, spins, rates, law.torques(q, angles, spins, rates))
        return np.concatenate(
            [_quaternion_rates(q, spins).ravel(), rates, gained[0].ravel(), gained[1]]
        )

    times = [0.0, stop] if frame is None else np.linspace(0.0, stop, round(stop / frame) + 1)
    clock = Clock()
    # Frame by frame: steps that end at frames need no interpolation, whose error is larger.
    states, evaluations = [model.start], 0
    first = None
    for here, there in pairwise(times):
        with clock:
            if split and isinstance(law, CurveLaw):

                def zones(state: Array) -> Array:
                    q, angles, _, _ = model.parts(state)
                    return law.zones(_unit(q), angles)

                state = _integrate_between_edges(rate, zones, here, there, states[-1], tolerance)
            else:
                done = solve_ivp(
                    rate,
                    (here, there),
                    states[-1],
                    "DOP853",
                    rtol=tolerance,
                    atol=tolerance,
                    first_step=first,
                )
                if not done.success:
                    raise RuntimeError(done.message)
                evaluations += done.nfev
                state = done.y[:, -1]
                first = min(float(np.max(np.diff(done.t))), there - here)
        state[: 4 * b] = _unit(state[: 4 * b].reshape(b, 4)).ravel()
        states.append(state)
    rows = np.array(states)
    centres, energies = [], []
    for state in rows if frame is not None else []:
        parts = model.parts(state)
        centre, energy = engine.book(*parts)
        centres.append(centre)
        energies.append(energy + law.energy(*parts[:2]))
    book = np.array(centres), np.array(energies)
    return Fall(model.rotations(rows), *book, clock.wall, evaluations, clock.cpu)


_EDGE_TIME = 1e-9
"""Time within which the crossing of an edge is located [s]; the law is continuous there."""


def _integrate_between_edges(
    rate: Callable[[float, Array], Array],
    zones: Callable[[Array], Array],
    start: float,
    stop: float,
    state: Array,
    tolerance: float,
) -> Array:
    """Return the state at `stop` by steps that end where `zones` change."""
    here = start
    while here < stop:
        solver = DOP853(rate, here, state, stop, rtol=tolerance, atol=tolerance)
        crossing = None
        while solver.status == "running" and crossing is None:
            failure = solver.step()
            if solver.status == "failed":
                raise RuntimeError(failure)
            before, after = float(solver.t_old), float(solver.t)
            crossing = _first_change(solver.dense_output(), zones, before, after)
        if crossing is None:
            return solver.y
        first = DOP853(rate, before, solver.y_old, crossing, rtol=tolerance, atol=tolerance)
        while first.status == "running":
            failure = first.step()
        if first.status == "failed":
            raise RuntimeError(failure)
        here, state = crossing, first.y
    return state


def _first_change(
    solution: Callable[[float], Array],
    zones: Callable[[Array], Array],
    before: float,
    after: float,
) -> float | None:
    """Return a time in a step just after its first change of zones; None if there is none."""
    if after - before <= 2.0 * _EDGE_TIME:
        return None
    # The step begins after the last edge, and its error may place it before.
    low = before + _EDGE_TIME
    zone = zones(solution(low))
    for high in np.linspace(low, after, 5)[1:].tolist():
        if not np.array_equal(zone, zones(solution(high))):
            while high - low > _EDGE_TIME:
                middle = 0.5 * (low + high)
                if np.array_equal(zone, zones(solution(middle))):
                    low = middle
                else:
                    high = middle
            return high if high < after else None
        low = high
    return None


def _quaternion_rates(q: Array, spins: Array) -> Array:
    """Of q' = q (0, spin) / 2 for spins in the tips' axes."""
    w, x, y, z = q.T
    a, b, c = spins.T
    parts = [
        -x * a - y * b - z * c,
        w * a + y * c - z * b,
        w * b + z * a - x * c,
        w * c + x * b - y * a,
    ]
    return 0.5 * np.stack(parts, axis=-1)


def _unit(q: Array) -> Array:
    return q / np.linalg.norm(q, axis=-1, keepdims=True)
