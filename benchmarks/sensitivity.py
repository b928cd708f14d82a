"""Coverage of the intervals of sensitivity indices.

    python -m benchmarks.sensitivity [SEEDS]

Functions of known indices are estimated again and again, from the radial design of a study (Sobol
points) and from independent random points, for which the bootstrap is made. The coverage is the
share of seeds whose interval contains the known index; the error is that of the estimates.
"""

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import sqrt

import numpy as np

from benchmarks import tables
from generator import Plan, read_figure
from generator.model import Model
from generator.study.designs import unit_points
from generator.study.sensitivity import IndexKind, morris_effects, sobol_indices
from generator.study.study import Design, DesignKind, Parameter, Sensitivity, Study, Uniform
from springs.backends import Array

SEEDS = 200
SAMPLES = (64, 128, 256, 512, 1024)
TRAJECTORIES = (10, 20, 50, 100)
RESAMPLES = 1000
CONFIDENCE = 0.95


@dataclass(frozen=True)
class KnownFunction:
    """A function of the unit cube with known indices.

    Attributes:
        name: in the table.
        function: of points, shape (n, parameters).
        first: first-order indices.
        total: total indices.
    """

    name: str
    function: Callable[[Array], Array]
    first: Array
    total: Array


def ishigami() -> KnownFunction:
    """Ishigami & Homma 1990 with a = 7, b = 0.1."""
    a, b = 7.0, 0.1
    one, two = 0.5 * (1.0 + b * np.pi**4 / 5.0) ** 2, a**2 / 8.0
    both = b**2 * np.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    variance = one + two + both

    def function(unit: Array) -> Array:
        x = np.pi * (2.0 * unit - 1.0)
        return np.sin(x[:, 0]) * (1.0 + b * x[:, 2] ** 4) + a * np.sin(x[:, 1]) ** 2

    first, total = np.array([one, two, 0.0]), np.array([one + both, two, both])
    return KnownFunction("Ishigami", function, first / variance, total / variance)


def sobol_g() -> KnownFunction:
    """Sobol's g function with a = 0, 1, 4.5, 9."""
    a = np.array([0.0, 1.0, 4.5, 9.0])
    alone = 1.0 / (3.0 * (1.0 + a) ** 2)
    product = np.prod(1.0 + alone)

    def function(unit: Array) -> Array:
        return np.prod((np.abs(4.0 * unit - 2.0) + a) / (1.0 + a), axis=1)

    total = alone * product / (1.0 + alone)
    return KnownFunction("g", function, alone / (product - 1.0), total / (product - 1.0))


def main() -> None:
    """Print the coverage of the intervals of both kinds of indices."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS
    print(f"{seeds} seeds, {RESAMPLES} resamples, intervals of {CONFIDENCE:.0%}; a share of")
    print(f"{CONFIDENCE:.0%} is known to {sqrt(CONFIDENCE * (1 - CONFIDENCE) / seeds):.3f}.\n")
    tables.show(sobol_rows(seeds))
    print()
    tables.show(morris_rows(seeds))


def sobol_rows(seeds: int) -> Iterator[tables.Row]:
    """Yield the coverage of Sobol indices of both functions."""
    for known in (ishigami(), sobol_g()):
        truth = np.concatenate([known.first, known.total])
        dimension = len(known.first)
        for samples in SAMPLES:
            for points, is_random in (("Sobol", False), ("random", True)):
                found = np.array(
                    [_sobol(known, samples, seed, is_random=is_random) for seed in range(seeds)]
                )
                yield {
                    "function": known.name,
                    "samples": samples,
                    "points": points,
                    **_coverage("first", found[:, :dimension], truth[:dimension]),
                    **_coverage("total", found[:, dimension:], truth[dimension:]),
                }


def _coverage(kind: str, found: Array, truth: Array) -> tables.Row:
    """Return mean and least coverage of the parameters, width and error of the worst.

    Args:
        kind: of the index.
        found: value, low and high, shape (seeds, parameters, 3).
        truth: shape (parameters,).
    """
    value, low, high = np.moveaxis(found, -1, 0)
    covered = ((low <= truth) & (truth <= high)).mean(axis=0)
    return {
        f"{kind}: mean coverage": f"{covered.mean():.3f}",
        f"{kind}: least": f"{covered.min():.3f}",
        f"{kind}: largest mean width": f"{(high - low).mean(axis=0).max():.3f}",
        f"{kind}: largest rms error": f"{np.sqrt(((value - truth) ** 2).mean(axis=0)).max():.3f}",
    }


def _study(kind: DesignKind, dimension: int, runs: int, seed: int) -> Study:
    parameters = {f"p{k}": Parameter(f"p{k}", (), Uniform(0.0, 1.0)) for k in range(dimension)}
    settings = Sensitivity(CONFIDENCE, RESAMPLES)
    plan, design = Plan(stop=0.1), Design(kind, runs, seed)
    return Study("f", Model(_FIGURE), plan, parameters, design, {}, sensitivity=settings)


_FIGURE = read_figure("pendulum")


def _sobol(known: KnownFunction, samples: int, seed: int, *, is_random: bool) -> Array:
    """Return estimates and ends of intervals, first-order before total, shape (2 d, 3)."""
    dimension = len(known.first)
    unit = unit_points(_study(DesignKind.SOBOL, dimension, samples, seed))
    radial = unit.reshape(samples, dimension + 2, dimension)
    if is_random:
        a, b = np.random.default_rng(seed).random((2, samples, 1, dimension))
        from_b = np.vstack([np.zeros(dimension), np.ones(dimension), np.eye(dimension)])
        radial = (1.0 - from_b) * a + from_b * b
    outputs = known.function(radial.reshape(-1, dimension)).reshape(samples, -1)
    each = sobol_indices(outputs, Sensitivity(CONFIDENCE, RESAMPLES), seed)
    kinds = (IndexKind.FIRST, IndexKind.TOTAL)
    return np.array([[one[k].value, one[k].low, one[k].high] for k in kinds for one in each])


def morris_rows(seeds: int) -> Iterator[tables.Row]:
    """Yield the coverage of mu* of the product of two parameters: 1/2 for both."""
    for trajectories in TRAJECTORIES:
        found = np.array([_morris(trajectories, seed) for seed in range(seeds)])
        yield {"trajectories": trajectories, **_coverage("mu*", found, np.full(2, 0.5))}


def _morris(trajectories: int, seed: int) -> Array:
    unit = unit_points(_study(DesignKind.MORRIS, 2, trajectories, seed)).reshape(-1, 3, 2)
    settings = Sensitivity(CONFIDENCE, RESAMPLES)
    each = morris_effects(unit, unit.prod(axis=-1), settings, seed)
    ends = [one[IndexKind.MU_STAR] for one in each]
    return np.array([[one.value, one.low, one.high] for one in ends])


if __name__ == "__main__":
    main()
