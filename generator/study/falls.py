"""Many falls of a kind, each from a start of its own: how the falls of people scatter.

A fall is a run of a study whose parameter is the seed of its start (`generator.simulation.falls`),
with the method and the processes of studies.
"""

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from math import degrees, hypot
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from generator.diagnostics import ModelError, MoverError
from generator.figure import Figure
from generator.model import Model
from generator.rotations import Array
from generator.simulation.falls import fall_direction, fall_plan
from generator.simulation.plan import Plan
from generator.study.parameter_paths import Case
from generator.study.parameters import apply_parameters
from generator.study.run_case import measure_case
from generator.study.run_results import RunResults
from generator.study.study import (
    WRONG_INPUT,
    Design,
    DesignKind,
    Measure,
    Parameter,
    RunMethod,
    RunResult,
    Statistic,
    Study,
    failed_run,
)
from generator.study.worker_pool import FinishedRun, Task, run_locally
from springs.short_repr import short_repr

PELVIS, HEAD, HANDS = "lower_torso", "head", ("left_hand", "right_hand")
"""Segments that are measured."""

HIP = "pelvis"
"""Part of the body whose force is measured in place of that of the segment, where there is one. It
spans the upper ends of the thighs."""

HEADS = (HEAD, "face")
"""Parts of the body that are measured in place of the segment `HEAD`, where there are some. The
segment has the neck as well, which touches where a person lies on the back."""

_SEED, _DIRECTION = "seed", "direction_deg"


def _measures(of: str, column: str, force: str, taken: Statistic) -> list[Measure]:
    """Return the measures of a segment or a part of the body, whose columns begin with `column`."""
    return [
        Measure(f"{of}_touch_s", f"{column}.first_touch [s]", Statistic.LAST),
        Measure(f"{of}_speed_m_per_s", f"{column}.impact_speed [m/s]", Statistic.LAST),
        Measure(f"{of}_force_N", f"{column}.{force} [N]", taken),
    ]


_HEAD_PEAK = Measure(f"{HEAD}_acceleration_g", f"{HEAD}.peak_acceleration [g]", Statistic.LAST)
"""Measure of the head alone."""

Scales = Sequence[tuple[str, float]]
"""Paths of parameters with their values."""


class Summary(NamedTuple):
    """Mean and standard deviation of some falls."""

    mean: float
    sd: float


@short_repr
@dataclass(frozen=True, eq=False)
class Falls:
    """Falls of one kind from N starts.

    Numbers of a fall are NaN where it failed, or where its part touched nothing.

    Attributes:
        study: Model, plan and measures of the falls.
        starts: Seed and direction of each start, 0 forward and 90 to the left, shape (N, 2)
            [1, deg].
        rows: Result of each fall, with the measures of each part.
        weight: Weight of the figure [N].
    """

    study: Study
    starts: Array
    rows: RunResults
    weight: float

    def __len__(self) -> int:
        """Number of falls."""
        return len(self.rows)

    def measure(self, name: str) -> Array:
        """Return a measure of each fall, NaN without it, shape (N,)."""
        if name not in self.study.measures:
            return np.full(len(self), np.nan)
        values = [row.measures[name] for row in self.rows]
        return np.array([np.nan if value is None else value for value in values])

    @property
    def is_done(self) -> NDArray[np.bool_]:
        """Return whether each fall reached its stop time, shape (N,)."""
        return np.array([row.succeeded for row in self.rows], bool)

    @property
    def seeds(self) -> Array:
        """Return the seed of each start, shape (N,)."""
        return self.starts[:, 0]

    @property
    def direction(self) -> Array:
        """Return the direction of lean and speed, 0 forward, 90 to the left, shape (N,) [deg]."""
        return self.starts[:, 1]

    @property
    def pelvis_speed(self) -> Array:
        """Return the speed of the pelvis at its first touch, shape (N,) [m/s]."""
        return self.measure(f"{PELVIS}_speed_m_per_s")

    @property
    def head_speed(self) -> Array:
        """Return the speed of the head at its first touch, shape (N,) [m/s]."""
        return self._first_speed(HEADS)

    @property
    def hand_speed(self) -> Array:
        """Return the speed of the hand that touches first, shape (N,) [m/s]."""
        return self._first_speed(HANDS)

    def _first_speed(self, parts: Sequence[str]) -> Array:
        """Return the speed of the one of two parts that touches first, shape (N,) [m/s]."""
        first, other = (self.measure(f"{part}_touch_s") for part in parts)
        speeds = [self.measure(f"{part}_speed_m_per_s") for part in parts]
        return np.where((first <= other) | np.isnan(other), *speeds)

    @property
    def descent(self) -> Array:
        """Return the time from the start until the pelvis touches, shape (N,) [s]."""
        return self.measure(f"{PELVIS}_touch_s") - self.study.plan.start

    @property
    def hand_lead(self) -> Array:
        """Return the time from the first touch of a hand to that of the pelvis, shape (N,) [s]."""
        hand = np.fmin(*(self.measure(f"{one}_touch_s") for one in HANDS))
        return self.measure(f"{PELVIS}_touch_s") - hand

    @property
    def hip_force(self) -> Array:
        """Return the peak force on the pelvis, where it touches, shape (N,) [N].

        It is that of the part `HIP` of a body with parts, else that of the segment `PELVIS`.
        """
        name = HIP if f"{HIP}_force_N" in self.study.measures else PELVIS
        return np.where(self.hits(name), self.measure(f"{name}_force_N"), np.nan)

    @property
    def head_force(self) -> Array:
        """Return the peak force on the head, where it touches, shape (N,) [N]."""
        forces = np.fmax(*(self.measure(f"{part}_force_N") for part in HEADS))
        return np.where(self.hits(*HEADS), forces, np.nan)

    @property
    def head_acceleration(self) -> Array:
        """Return the peak acceleration of the head's centre of mass, where it touches, shape (N,).

        It is in multiples of g.
        """
        return np.where(self.hits(*HEADS), self.measure(_HEAD_PEAK.name), np.nan)

    def hits(self, *parts: str) -> NDArray[np.bool_]:
        """Return whether one of some segments touches a prop in each fall, shape (N,)."""
        touches = [np.isfinite(self.measure(f"{part}_touch_s")) for part in parts]
        return np.any(touches, axis=0)

    def hit_share(self, *parts: str) -> float:
        """Return the share of falls in which one of some segments touches.

        It is NaN for a figure without any of them, and without a fall.
        """
        if not any(f"{part}_touch_s" in self.study.measures for part in parts):
            return np.nan
        hits = self.hits(*parts)[self.is_done]
        return float(hits.mean()) if hits.size else np.nan

    @property
    def head_hit_share(self) -> float:
        """Return the share of falls in which the head touches; NaN without a head or a fall."""
        return self.hit_share(*HEADS)

    def quantities(self) -> dict[str, Array]:
        """Return the numbers of the falls by the keys of `--json`, each of shape (N,)."""
        return {
            "pelvis_speed_m_per_s": self.pelvis_speed,
            "head_speed_m_per_s": self.head_speed,
            "hand_speed_m_per_s": self.hand_speed,
            "descent_ms": 1000.0 * self.descent,
            "hand_lead_ms": 1000.0 * self.hand_lead,
            "hip_force_N": self.hip_force,
            "hip_force_body_weights": self.hip_force / self.weight,
            "head_force_N": self.head_force,
            "head_acceleration_g": self.head_acceleration,
        }

    def summary(self) -> dict[str, int | float | Summary]:
        """Return number, means and standard deviations of the falls, as `--json` has them."""
        return {
            "n": int(self.is_done.sum()),
            **{name: summarize(values) for name, values in self.quantities().items()},
            "head_hit_share": self.head_hit_share,
            "hand_hit_share": self.hit_share(*HANDS),
            "pelvis_hit_share": self.hit_share(PELVIS),
        }


def summarize(values: Array) -> Summary:
    """Return mean and standard deviation of the numbers that are known; NaN of too few."""
    known = values[np.isfinite(values)]
    mean = float(np.mean(known)) if known.size else np.nan
    return Summary(mean, float(np.std(known, ddof=1)) if known.size > 1 else np.nan)


def run_falls(
    model: Model | Figure,
    kind: str,
    count: int,
    seed: int = 0,
    plan: Plan | None = None,
    scales: Scales = (),
    method: RunMethod = RunMethod.FAST,
    jobs: int | None = None,
    watch: Callable[[FinishedRun], bool | None] | None = None,
) -> Falls:
    """Run many falls of a kind, whose seeds follow each other, in processes of their own.

    A script calls it below `if __name__ == "__main__":`, since the processes import the script. A
    fall that fails has an outcome and a message in its row.

    Args:
        model: Model that falls, or a figure with its own springs.
        kind: Kind of the falls, a name of `FALLS`.
        count: Number of falls.
        seed: Seed of the first one.
        plan: Plan of `fall_plan`, of which each fall changes the start and the scene; its stop,
            tone and method may be changed, as `replace(fall_plan(figure, kind), stop=3.0)`. None
            for that of the kind.
        scales: Paths of parameters with values, set in each fall as in a study.
        method: Method of integration.
        jobs: Largest number of processes [default: one per core].
        watch: Function that is called with each fall that has ended. If it returns True, the others
            are given up, and the result has the falls that have ended.

    Raises:
        UnknownNameError: The kind is unknown.
        ModelError: The figure does not stand as persons do, or the plan is not one of `fall_plan`.
        MoverError: Processes cannot be started.
    """
    model = Model.of(model) if isinstance(model, Figure) else model
    start = fall_plan(model.figure, kind, seed)
    plan = start if plan is None else plan
    if not plan.free_root or plan.height is None:
        raise ModelError(
            "run_falls needs a plan of fall_plan, in which the figure is free: "
            f'replace(fall_plan(figure, "{kind}"), stop={plan.stop:g}) changes it'
        )
    study = _study(model, kind, plan, count, seed, method)
    tasks = [Task(index, row) for index, row in enumerate(study.design.rows)]
    found = dict[int, RunResult]()
    with closing(run_locally(study, tasks, jobs, partial(run_fall, kind, scales))) as arriving:
        for run in arriving:
            found[run.index] = run.result
            if watch is not None and watch(run):
                break
    rows = tuple(study.design.rows[index] for index in sorted(found))
    study = replace(study, design=replace(study.design, rows=rows))
    results = RunResults(study.measures, len(found))
    for k, index in enumerate(sorted(found)):
        results[k] = found[index]
    mass = sum(body.mass or 0.0 for body in model.figure.bodies.values())
    weight = mass * hypot(*plan.gravity) or np.nan
    return Falls(study, np.array(study.design.rows), results, weight)


def _study(model: Model, kind: str, plan: Plan, count: int, seed: int, method: RunMethod) -> Study:
    """Return the study of which each fall is a run."""
    known = () if model.contact is None else [part.name for part in model.contact.parts]
    parts = [name for name in (HIP, *HEADS) if name in known]
    segments = [
        name for name in (PELVIS, HEAD, *HANDS) if name in model.figure.bodies and name not in parts
    ]
    measures = [
        *(m for one in segments for m in _measures(one, one, "contact_force", Statistic.LARGEST)),
        *(m for one in parts for m in _measures(one, f"part.{one}", "peak_force", Statistic.LAST)),
    ]
    if HEAD in model.figure.bodies:
        measures.append(_HEAD_PEAK)
    seeds = range(seed, seed + count)
    rows = tuple((float(one), degrees(fall_direction(kind, one))) for one in seeds)
    return Study(
        kind,
        model,
        plan,
        {name: Parameter(name, (), None) for name in (_SEED, _DIRECTION)},
        Design(DesignKind.LIST, rows=rows),
        {each.name: each for each in measures},
        method=method,
    )


def run_fall(
    kind: str,
    scales: Scales,
    study: Study,
    values: Sequence[float],
    keep: Path | None = None,
    threads: int = 2,
) -> RunResult:
    """Run one fall and measure it; one that fails has no measures. See `run_case`.

    Args:
        kind: Kind of the fall.
        scales: Paths of parameters with values.
        study: Study of the falls.
        values: Seed, and the direction that follows from it.
        keep: `.npz` file for the motion; None to keep none.
        threads: 1 or 2.
    """
    try:
        case = fall_case(study.model, kind, int(values[0]), study.plan, scales)
    except (MoverError, ValueError) as failure:  # a plan raises ValueError
        return failed_run(study, WRONG_INPUT, str(failure))
    return measure_case(study, case, keep, threads)


def fall_case(model: Model, kind: str, seed: int, plan: Plan, scales: Scales = ()) -> Case:
    """Return the model and the plan of one fall.

    Args:
        model: Model that falls.
        kind: Kind of the fall.
        seed: Seed of its start.
        plan: Plan of which the fall changes the start and the scene.
        scales: Paths of parameters with values.

    Raises MoverError for a start that cannot be made.
    """
    start = fall_plan(model.figure, kind, seed)
    plan = replace(
        plan, displacements=start.displacements, velocities=start.velocities, scene=start.scene
    )
    return apply_parameters(model, plan, scales)
