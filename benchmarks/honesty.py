"""Random runs against their estimates: `python -m benchmarks.honesty [RUNS [KIND]]`.

Figures, poses, durations and tolerances are random. The truth is a run of the same kind whose
tolerance is a thousand times smaller, as far as that run is sure of itself; every sixteenth run is
also compared with Exudyn's integrator, unless it is a fall. Two processes share the work.
`python -m benchmarks.honesty 200 falls` makes falls only.

A run is *broken* if its true error exceeds the tolerance before the time until which the run says
that it is met.
"""

import sys
from collections import defaultdict
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from benchmarks import cases
from benchmarks.engines.exudyn_engine import radial_springs
from generator.contact.scene import Scene
from generator.figure import Figure, Joint
from generator.figure_file.read import read_figure
from generator.input_files.scene import read_scene
from generator.recording import Recording
from generator.rotations import matrix_from_rotation_vector, rotation_vector_from_matrix
from generator.run_options import Integrator
from generator.simulation.plan import Plan
from generator.simulation.preconditions import import_exudyn

RUNS = 300
FALLS = ("floor", "box", "person on floor")
KINDS = ("prototype", "coupled", "clavicles", "person", "free flight", "chain", *FALLS)
REFERENCE_RATIO = 1e-3
FALL_TOLERANCES = -4.0, -2.0
"""Decades of the tolerances of falls, whose method of order 3 has to reach the truth as well."""
EXUDYN_EVERY = 16
EXUDYN_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Outcome:
    """Errors of one run.

    Attributes:
        kind: of the figure.
        tolerance: asked for [rad].
        held: whether the run says that its tolerance holds to the end.
        broken: whether an error exceeds the tolerance while the run says that it is met.
        share: share of the duration until which the tolerance is met.
        errors: true errors of the frames that the truth reaches, shape (n,) [rad].
        estimates: of the same frames.
        exudyn: largest difference from Exudyn's integrator over both estimates; NaN without it.
    """

    kind: str
    tolerance: float
    held: bool
    broken: bool
    share: float
    errors: np.ndarray
    estimates: np.ndarray
    exudyn: float


def main() -> None:
    """Print a table of the kinds, and the verdicts."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else RUNS
    chosen = sys.argv[2:3]
    choice = FALLS if chosen == ["falls"] else chosen or KINDS
    kinds = [choice[seed % len(choice)] for seed in range(count)]
    with ProcessPoolExecutor(2) as pool:
        outcomes = list(pool.map(run, range(count), kinds))
    by_kind: dict[str, list[Outcome]] = defaultdict(list)
    for outcome in outcomes:
        by_kind[outcome.kind].append(outcome)
    print("| kind | runs | held | met until | broken | frames told | too small | worst | Exudyn |")
    print("|---|---|---|---|---|---|---|---|---|")
    for kind, some in [*by_kind.items(), ("all", outcomes)]:
        print(f"| {kind} | {' | '.join(summary(some))} |")


def summary(outcomes: list[Outcome]) -> list[str]:
    """Return the cells of a row."""
    told, small, worst = 0, 0, 0.0
    for outcome in outcomes:
        counted = (outcome.errors > 0.1 * outcome.tolerance) & np.isfinite(outcome.estimates)
        ratios = outcome.errors[counted] / outcome.estimates[counted]
        told += ratios.size
        small += int(np.sum(ratios > 1.0))
        worst = max(worst, float(np.max(ratios, initial=0.0)))
    exudyn = [o.exudyn for o in outcomes if np.isfinite(o.exudyn)]
    return [
        str(len(outcomes)),
        str(sum(o.held for o in outcomes)),
        f"{np.mean([o.share for o in outcomes]):.2f} of the time",
        str(sum(o.broken for o in outcomes)),
        str(told),
        f"{small} ({100.0 * small / max(told, 1):.2f} %)",
        f"{worst:.2f}",
        f"{max(exudyn, default=float('nan')):.2f} in {len(exudyn)}",
    ]


def run(seed: int, kind: str) -> Outcome:
    """Make one random run with its truth."""
    import_exudyn()
    from generator.simulation.run import simulate

    random = np.random.default_rng(seed)
    figure, plan = random_case(kind, random)
    made = simulate(figure, plan)
    assert made.integrator is Integrator.COMPILED, made.integrator_reason
    truth = simulate(figure, replace(plan, tolerance=REFERENCE_RATIO * plan.tolerance))
    sure = truth.accuracy.by_frame <= 0.01 * plan.tolerance
    count = min(len(made.times), int(np.argmin(sure)) if not sure.all() else len(truth.times))
    errors = differences(made, truth)[:count]
    exudyn = np.nan
    if seed % EXUDYN_EVERY == 0 and kind not in FALLS:  # of a fall it takes many minutes
        other = simulate(
            figure, replace(plan, tolerance=EXUDYN_TOLERANCE, integrator=Integrator.EXUDYN)
        )
        common = min(count, len(other.times))
        both = made.accuracy.by_frame[:common] + other.accuracy.by_frame[:common]
        exudyn = float(np.max(differences(made, other)[:common] / np.maximum(both, 1e-9)))
    met_until = made.accuracy.tolerance_met_until
    told = errors[made.times[:count] <= met_until]
    return Outcome(
        kind,
        plan.tolerance,
        made.outcome.succeeded and met_until >= plan.stop,
        bool(np.max(told, initial=0.0) > plan.tolerance),
        met_until / plan.stop,
        errors,
        made.accuracy.by_frame[:count],
        exudyn,
    )


def random_case(kind: str, random: np.random.Generator) -> tuple[Figure, Plan]:
    """Return a figure with a random plan."""
    plan = Plan(
        stop=float(random.uniform(0.1, 2.0)), tolerance=float(10.0 ** random.uniform(-6.0, -2.0))
    )
    if kind == "chain":
        case = cases.chain(int(random.integers(2, 13)))
        figure = case.figure
        plan = replace(plan, springs=radial_springs(figure, case.radial))
    else:
        names = {"clavicles": "clavicles", "person": "male50", "person on floor": "male50"}
        figure = read_figure(names.get(kind, "prototype"))
    if kind == "coupled":
        plan = replace(plan, spring_choice="coupled")
    if kind == "free flight":
        plan = replace(plan, free_root=True)
    if kind in FALLS:
        scene = Scene.floor(plan.up)
        if kind == "box":
            scene = Scene((*scene.props, *read_scene("step").props))
        tolerance = float(10.0 ** random.uniform(*FALL_TOLERANCES))
        height = 0.3 if kind == "box" else 0.0  # above the step
        plan = replace(plan, free_root=True, height=height, scene=scene, tolerance=tolerance)
    turned = {
        name: tuple(
            np.asarray(joint.displacement)
            + _sizes(joint) * random.uniform(-1.0, 1.0, len(joint.chain))
        )
        for name, joint in figure.joints.items()
        if joint.chain
    }
    return figure, replace(plan, displacements=turned)


def _sizes(joint: Joint) -> np.ndarray:
    """Return the largest changes of the displacements of a joint: 15 deg or 2 mm."""
    return np.array([np.radians(15.0) if any(one.twist.angular) else 0.002 for one in joint.chain])


def differences(one: Recording, other: Recording) -> np.ndarray:
    """Return the largest angle between the joints of two recordings, by common frame [rad]."""
    count = min(len(one.times), len(other.times))

    def turns(vectors: Mapping[str, np.ndarray]) -> np.ndarray:
        return matrix_from_rotation_vector(np.stack([v[:count] for v in vectors.values()]))

    first, second = turns(one.rotation_vectors), turns(other.rotation_vectors)
    between = rotation_vector_from_matrix(np.swapaxes(first, -1, -2) @ second)
    return np.max(np.linalg.norm(between, axis=-1), axis=0)


if __name__ == "__main__":
    main()
