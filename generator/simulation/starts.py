"""Runs of one figure from several starts, whose joints differ at random."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from generator.contact.record import first_impact, mean_at_end
from generator.diagnostics import ModelError, MoverError
from generator.figure import Figure, without_followers
from generator.kinematics.loops import close_loops
from generator.kinematics.placement import initial_displacements
from generator.kinematics.tree import build_tree
from generator.model import Model
from generator.recording import Ending, Recording
from generator.rotations import Array
from generator.simulation.plan import NO_LIMIT, Plan, WallLimit
from generator.simulation.run import simulate
from generator.simulation.run_model import initial_state


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
        seed: seed of the random numbers.
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


_LEAST_WALL_LIMIT = 1e-9
"""Wall-time limit of a start for which no time is left [s]."""


def vary_start(figure: Figure, plan: Plan, spread: float, generator: np.random.Generator) -> Plan:
    """Return the plan with normally distributed changes of the start.

    Every rotation of every joint changes, those to the ground as well, before a root is freed;
    joints that are locked, driven or linked stay. Loops are closed again by the other joints.

    Args:
        figure: figure as its file describes it.
        plan: plan of the run.
        spread: standard deviation of the changes [rad].
        generator: generator of the random numbers.

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
        turns = np.array([factor.units.is_angle for factor in joint.chain], dtype=bool)
        if name in start and joint.chain and name not in fixed:
            varied[name] = start[name] + np.where(turns, changes, 0.0)
    if tree.closures:
        closed = close_loops(tree, {**start, **varied}, fixed).displacements
        varied = {name: closed[name] for name in varied}
    changed = without_followers(figure.joints, {**plan.displacements, **varied})
    return replace(plan, displacements=changed)


def study_starts(
    model: Model | Figure,
    plan: Plan,
    count: int,
    spread: float,
    seed: int = 0,
    watch: Callable[[int], bool | None] | None = None,
    limit: WallLimit = NO_LIMIT,
) -> StartStudy:
    """Run a figure from several starts; see `vary_start`.

    A start that cannot be built, such as one inside a prop, counts as failed, and so does one that
    the wall-time limit of all starts leaves no time for.

    Args:
        model: Model, or a figure with the springs of the plan or its own.
        plan: plan of the run, with a scene.
        count: number of starts.
        spread: standard deviation of the starts' angles [rad].
        seed: seed of the random numbers.
        watch: called with the number of each run that has ended; True ends the study, which has
            the runs so far.
        limit: wall-time limit of all runs together, beside that of the plan for each.

    Raises:
        ModelError: the plan has no props.
        MoverError: the plan itself cannot be built.
        KeyboardInterrupt: a run was interrupted.
    """
    if not plan.scene.props:
        raise ModelError("falls from several starts need a plan whose scene has props")
    whole = Model.of(model) if isinstance(model, Figure) else model
    figure = whole.figure
    initial_state(figure, plan, whole.contact)
    generator = np.random.default_rng(seed)

    def runs() -> Iterator[Recording | MoverError]:
        for number in range(1, count + 1):
            try:
                limit.require_time(f"before start {number}")
                remaining = max(min(plan.wall_limit, limit.remaining), _LEAST_WALL_LIMIT)
                varied = vary_start(figure, plan, spread, generator)
                run = simulate(model, replace(varied, wall_limit=remaining))
            except MoverError as failure:
                yield failure
            else:
                if run.outcome.ending is Ending.INTERRUPTED:
                    raise KeyboardInterrupt
                yield run
            if watch is not None and watch(number):
                return

    return summarize_starts(runs(), np.array(plan.up), spread, seed)


def summarize_starts(
    runs: Iterable[Recording | MoverError], up: Array, spread: float, seed: int
) -> StartStudy:
    """Return the study of N runs, or errors of starts that could not be built.

    Args:
        runs: runs with contact; of each, only its numbers are kept.
        up: upward unit vector, shape (3,).
        spread: standard deviation of the starts' angles [rad].
        seed: seed of the random numbers.
    """
    failures: dict[int, str] = {}
    falls: list[_Fall] = []
    for number, run in enumerate(runs, 1):
        if isinstance(run, Recording) and run.outcome.reached_stop:
            falls.append(_read_fall(run, up))
        else:
            failures[number] = run.outcome.message if isinstance(run, Recording) else str(run)
            falls.append(_Fall())
    names = dict.fromkeys(name for one in falls for name in one.peak_forces)
    return StartStudy(
        impact_times=np.array([one.impact_time for one in falls]),
        max_forces=np.array([one.max_force for one in falls]),
        peak_forces={
            name: np.array([one.peak_forces.get(name, np.nan) for one in falls]) for name in names
        },
        rest_heights=np.array([one.rest_height for one in falls]),
        weights_carried=np.array([one.weight_carried for one in falls]),
        is_accurate=None
        if any(one.is_accurate is None for one in falls)
        else np.array([one.is_accurate for one in falls]),
        failures=failures,
        spread=spread,
        seed=seed,
    )


class _Fall(NamedTuple):
    """Numbers of one start for a `StartStudy`; by default of one that failed."""

    impact_time: float = np.nan
    max_force: float = np.nan
    peak_forces: Mapping[str, float] = MappingProxyType({})
    rest_height: float = np.nan
    weight_carried: float = np.nan
    is_accurate: bool | None = False


def _read_fall(run: Recording, up: Array) -> _Fall:
    """Return the numbers of a finished run with contact."""
    contact, accuracy = run.contact, run.accuracy
    assert contact is not None
    impact, carried = first_impact(contact.segments), contact.weight_carried
    return _Fall(
        np.nan if impact is None else impact,
        contact.max_force,
        {name: one.peak_force for name, one in contact.segments.items()},
        mean_at_end(run.times, run.centre_of_mass @ up),
        np.nan if carried is None else carried,
        None if accuracy.tolerance is None else bool(accuracy.tolerance_met_until >= run.times[-1]),
    )
