"""Runs of one figure from several starts, whose joints differ at random."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from generator.contact_record import first_impact, mean_at_end
from generator.diagnostics import MoverError
from generator.figure import AxisKind, Figure
from generator.kinematics.loops import close_loops
from generator.kinematics.placement import initial_displacements
from generator.kinematics.tree import build_tree
from generator.recording import Ending, Recording
from generator.rotations import Array
from generator.simulation.model import initial_state
from generator.simulation.plan import Plan
from generator.simulation.run import simulate


@dataclass(frozen=True)
class StartStudy:
    """Falls from N starts; NaN where a run failed or touched nothing.

    Attributes:
        impact_times: first touch of a segment with more than 0.5 m/s, shape (N,) [s].
        max_forces: largest total force over all steps, shape (N,) [N].
        peak_forces: largest force on each segment over all steps, shape (N,) [N].
        rest_heights: mean height of the centre of mass in the last 0.2 s, shape (N,) [m].
        weights_carried: mean vertical force in the last 0.2 s over the weight, shape (N,).
        is_accurate: whether each run reached its stop time within the tolerance, shape (N,); None
            with a fixed step.
        failures: sentence of each start that failed, by its number, from 1.
        spread: standard deviation of the starts' angles [rad].
        seed: of the random numbers.
    """

    impact_times: Array
    max_forces: Array
    peak_forces: Mapping[str, Array]
    rest_heights: Array
    weights_carried: Array
    is_accurate: Array | None
    failures: Mapping[int, str]
    spread: float
    seed: int

    def __len__(self) -> int:
        """Number of starts."""
        return len(self.impact_times)


def vary_start(figure: Figure, plan: Plan, spread: float, generator: np.random.Generator) -> Plan:
    """Return the plan with normally distributed changes of the start.

    Every rotation of every joint changes, those to the ground as well, before a root is freed;
    joints that are locked, driven or linked stay. Loops are closed again by the other joints.

    Args:
        figure: as its file describes it.
        plan: of the run.
        spread: standard deviation of the changes [rad].
        generator: of the random numbers.

    Raises OpenLoopError for a loop that cannot be closed.
    """
    tree = build_tree(figure)
    start = {
        name: np.asarray(values, dtype=float)
        for name, values in {**initial_displacements(tree), **plan.displacements}.items()
    }
    fixed = {*plan.locked, *plan.drives}
    fixed |= {end.joint for link in plan.links.links for end in (link.follower, link.control)}
    varied: dict[str, Array] = {}
    for name, joint in figure.joints.items():
        changes = generator.normal(0.0, spread, len(joint.chain))
        turns = np.array([factor.kind is AxisKind.ROTATION for factor in joint.chain], dtype=bool)
        if name in start and joint.chain and name not in fixed:
            varied[name] = start[name] + np.where(turns, changes, 0.0)
    if tree.closures:
        closed = close_loops(tree, {**start, **varied}, fixed).displacements
        varied = {name: closed[name] for name in varied}
    return replace(plan, displacements={**plan.displacements, **varied})


def study_starts(
    figure: Figure,
    plan: Plan,
    count: int,
    spread: float,
    seed: int = 0,
    watch: Callable[[int], None] | None = None,
) -> StartStudy:
    """Run a figure from several starts; see `vary_start`.

    A start that cannot be built, such as one inside a prop, counts as failed.

    Args:
        figure: the figure.
        plan: of the run, with a scene.
        count: number of starts.
        spread: standard deviation of the starts' angles [rad].
        seed: of the random numbers.
        watch: called with the number of each run that has ended.

    Raises:
        MoverError: the plan itself cannot be built.
        KeyboardInterrupt: a run was interrupted.
    """
    initial_state(figure, plan)
    generator = np.random.default_rng(seed)
    runs: list[Recording | MoverError] = []
    for number in range(1, count + 1):
        try:
            run = simulate(figure, vary_start(figure, plan, spread, generator))
        except MoverError as failure:
            run = failure
        if isinstance(run, Recording) and run.outcome.ending is Ending.INTERRUPTED:
            raise KeyboardInterrupt
        runs.append(run)
        if watch is not None:
            watch(number)
    return summarize_starts(runs, np.array(plan.up), spread, seed)


def summarize_starts(
    runs: Sequence[Recording | MoverError], up: Array, spread: float, seed: int
) -> StartStudy:
    """Return the study of N runs, or errors of starts that could not be built.

    Args:
        runs: with contact.
        up: upward unit vector, shape (3,).
        spread: standard deviation of the starts' angles [rad].
        seed: of the random numbers.
    """
    failures: dict[int, str] = {}
    finished: list[Recording | None] = []
    for number, run in enumerate(runs, 1):
        if isinstance(run, MoverError):
            failures[number] = str(run)
        elif not run.outcome.succeeded:
            failures[number] = run.outcome.message
        finished.append(None if isinstance(run, MoverError) or number in failures else run)
    done = [run for run in finished if run is not None]
    names = dict.fromkeys(name for one in done if one.contact for name in one.contact.segments)
    is_estimated = all(one.accuracy.asked is not None for one in done)

    def peak(name: str) -> Callable[[Recording], float | None]:
        return lambda one: one.contact.segments[name].peak_force if one.contact else None

    def values(read: Callable[[Recording], float | None]) -> Array:
        found = (None if one is None else read(one) for one in finished)
        return np.array([np.nan if value is None else value for value in found])

    def met(one: Recording) -> bool:
        return bool(one.accuracy.held_until >= one.times[-1])

    return StartStudy(
        values(lambda one: first_impact(one.contact.segments) if one.contact else None),
        values(lambda one: one.contact.max_force if one.contact else None),
        {name: values(peak(name)) for name in names},
        values(lambda one: mean_at_end(one.times, one.centre_of_mass @ up)),
        values(lambda one: one.contact.weight_carried if one.contact else None),
        np.array([one is not None and met(one) for one in finished]) if is_estimated else None,
        failures,
        spread,
        seed,
    )
