"""Runs of one figure from several starts, whose joints differ at random."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from generator.contact_record import first_impact, mean_at_end
from generator.figure import AxisKind, Figure
from generator.kinematics.placement import initial_displacements
from generator.kinematics.tree import build_tree
from generator.recording import Ending, Recording
from generator.rotations import Array
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
        is_accurate: whether each run held the tolerance to its end, shape (N,).
        spread: standard deviation of the starts' angles [rad].
        seed: of the random numbers.
    """

    impact_times: Array
    max_forces: Array
    peak_forces: Mapping[str, Array]
    rest_heights: Array
    weights_carried: Array
    is_accurate: Array
    spread: float
    seed: int

    def __len__(self) -> int:
        """Number of starts."""
        return len(self.impact_times)


def vary_start(figure: Figure, plan: Plan, spread: float, generator: np.random.Generator) -> Plan:
    """Return the plan with normally distributed changes of the start.

    Every rotation of every joint changes, those to the ground as well, before a root is freed;
    joints that are locked, driven or linked stay.

    Args:
        figure: as its file describes it.
        plan: of the run.
        spread: standard deviation of the changes [rad].
        generator: of the random numbers.
    """
    start = {**initial_displacements(build_tree(figure)), **plan.displacements}
    fixed = {*plan.locked, *plan.drives}
    fixed |= {end.joint for link in plan.links.links for end in (link.follower, link.control)}
    varied: dict[str, Array] = {}
    for name, joint in figure.joints.items():
        changes = generator.normal(0.0, spread, len(joint.chain))
        turns = np.array([factor.kind is AxisKind.ROTATION for factor in joint.chain], dtype=bool)
        if name in start and joint.chain and name not in fixed:
            varied[name] = np.asarray(start[name], dtype=float) + np.where(turns, changes, 0.0)
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

    Args:
        figure: the figure.
        plan: of the run, with a scene.
        count: number of starts.
        spread: standard deviation of the starts' angles [rad].
        seed: of the random numbers.
        watch: called with the number of each run that has ended.

    Raises:
        MoverError: a start cannot be built.
        KeyboardInterrupt: a run was interrupted.
    """
    generator = np.random.default_rng(seed)
    recordings: list[Recording] = []
    for number in range(1, count + 1):
        recording = simulate(figure, vary_start(figure, plan, spread, generator))
        if recording.outcome.ending is Ending.INTERRUPTED:
            raise KeyboardInterrupt
        recordings.append(recording)
        if watch is not None:
            watch(number)
    return _summarize(recordings, np.array(plan.up), spread, seed)


def _summarize(recordings: list[Recording], up: Array, spread: float, seed: int) -> StartStudy:
    names = dict.fromkeys(
        name for one in recordings if one.contact for name in one.contact.segments
    )

    def peak(name: str) -> Callable[[Recording], float | None]:
        return lambda one: one.contact.segments[name].peak_force if one.contact else None

    def values(read: Callable[[Recording], float | None]) -> Array:
        found = (read(one) if one.outcome.succeeded else None for one in recordings)
        return np.array([np.nan if value is None else value for value in found])

    return StartStudy(
        values(lambda one: first_impact(one.contact.segments) if one.contact else None),
        values(lambda one: one.contact.max_force if one.contact else None),
        {name: values(peak(name)) for name in names},
        values(lambda one: mean_at_end(one.times, one.centre_of_mass @ up)),
        values(lambda one: one.contact.weight_carried if one.contact else None),
        np.array([one.accuracy.held_until >= one.times[-1] for one in recordings]),
        spread,
        seed,
    )
