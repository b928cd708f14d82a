"""Values of the parameters in each run of a study.

Points are chosen in the unit cube, where each coordinate is a probability, and mapped to values by
the quantiles of the parameters' distributions. A design with a seed is the same in each process.

References:
    McKay, Beckman & Conover, Technometrics 21 (1979) 239: Latin hypercube.
    Matousek, J. Complexity 14 (1998) 527: scrambled Sobol sequence.
    Saltelli et al., Comput. Phys. Commun. 181 (2010) 259: radial design.
    Morris, Technometrics 33 (1991) 161: trajectories.
"""

from math import log, prod
from typing import Any

import numpy as np

from generator.diagnostics import ModelError
from generator.study.study import (
    DesignKind,
    Distribution,
    Levels,
    LogNormal,
    Normal,
    Parameter,
    Study,
    Uniform,
)
from springs.backends import Array

MORRIS_LEVELS = 4
"""Values of each parameter in trajectories: the medians of four equally probable intervals."""

MORRIS_STEP = 0.5
"""Change of probability in a step of a trajectory: half of the levels, as Morris proposes."""

_BITS = 30
_MARGIN = 2.0 ** -(_BITS + 1)
"""Smallest distance of a probability from 0 and 1, so that all quantiles are finite."""


def design_points(study: Study) -> Array:
    """Return the values of the parameters, shape (runs, parameters), in their order.

    The last parameter of a grid varies fastest. The radial design of Saltelli et al. lists each
    base sample's points together: A, B, and A with one parameter after another from B.

    Raises:
        ModelError: a parameter or the design lacks what the kind of design needs.
    """
    parameters = list(study.parameters.values())
    match study.design.kind:
        case DesignKind.LIST:
            return np.array(study.design.rows, dtype=float).reshape(-1, len(parameters))
        case DesignKind.GRID:
            columns = np.meshgrid(*map(_grid_values, parameters), indexing="ij")
            return np.stack([column.ravel() for column in columns], axis=1).astype(float)
        case DesignKind.LATIN_HYPERCUBE | DesignKind.SOBOL | DesignKind.MORRIS:
            unit = unit_points(study)
            columns = [
                _quantiles(_distribution(parameter), unit[:, k])
                for k, parameter in enumerate(parameters)
            ]
            return np.stack(columns, axis=1)


def run_count(study: Study) -> int:
    """Return the number of points of a study's design. Raises ModelError as `design_points`."""
    dimension = len(study.parameters)
    match study.design.kind:
        case DesignKind.LIST:
            return len(study.design.rows)
        case DesignKind.GRID:
            return prod(len(_grid_values(each)) for each in study.parameters.values())
        case DesignKind.LATIN_HYPERCUBE:
            return _runs(study)
        case DesignKind.SOBOL:
            return _runs(study) * (1 if study.sensitivity is None else dimension + 2)
        case DesignKind.MORRIS:
            return _runs(study) * (dimension + 1)


def unit_points(study: Study) -> Array:
    """Return the probabilities of a random design, inside (0, 1), shape (runs, parameters).

    Raises:
        ModelError: the design has no number of runs.
        ValueError: the design is a grid or a list.
    """
    runs, dimension, seed = _runs(study), len(study.parameters), study.design.seed
    match study.design.kind:
        case DesignKind.LATIN_HYPERCUBE:
            unit = _latin_hypercube(runs, dimension, seed)
        case DesignKind.SOBOL if study.sensitivity is None:
            unit = _sobol(runs, dimension, seed)
        case DesignKind.SOBOL:
            unit = _radial(_sobol(runs, 2 * dimension, seed))
        case DesignKind.MORRIS:
            unit = _trajectories(runs, dimension, seed)
        case DesignKind.GRID | DesignKind.LIST:
            raise ValueError(f"a {study.design.kind} has no probabilities")
    return np.clip(unit, _MARGIN, 1.0 - _MARGIN)


def _runs(study: Study) -> int:
    runs = study.design.runs
    if runs is None or runs < 1:
        raise ModelError(f"the design `{study.design.kind}` needs a number of runs, at least 1")
    return runs


def _distribution(parameter: Parameter) -> Distribution:
    if parameter.distribution is None:
        raise ModelError(f"the parameter `{parameter.name}` needs a distribution or values")
    return parameter.distribution


def _grid_values(parameter: Parameter) -> tuple[float, ...]:
    match _distribution(parameter):
        case Levels(values=values):
            return values
        case Uniform() | Normal() | LogNormal():
            raise ModelError(
                f"the parameter `{parameter.name}` of a grid needs values, or low, high and points"
            )


def evenly_spaced(low: float, high: float, points: int) -> Levels:
    """Return `points` values from `low` to `high`, both included."""
    return Levels(tuple(np.linspace(low, high, points).tolist()))


def _quantiles(distribution: Distribution, probabilities: Array) -> Array:
    """Return the values below which a parameter lies with these probabilities."""
    from scipy.special import ndtri

    match distribution:
        case Uniform(low=low, high=high):
            return np.clip(low + (high - low) * probabilities, low, high)
        case Normal(mean=mean, sd=sd):
            return mean + sd * ndtri(probabilities)
        case LogNormal(median=median, factor=factor):
            return median * np.exp(log(factor) * ndtri(probabilities))
        case Levels(values=values):
            return np.array(values)[np.floor(len(values) * probabilities).astype(int)]


def _random_argument(seed: int) -> dict[str, Any]:
    """Return the seed under the name that this version of scipy gives to the argument."""
    import scipy

    major, minor = map(int, scipy.__version__.split(".")[:2])
    return {"rng" if (major, minor) >= (1, 15) else "seed": np.random.default_rng(seed)}


def _latin_hypercube(runs: int, dimension: int, seed: int) -> Array:
    from scipy.stats.qmc import LatinHypercube

    return LatinHypercube(dimension, **_random_argument(seed)).random(runs)


def _sobol(runs: int, dimension: int, seed: int) -> Array:
    """Return the first points of a scrambled Sobol sequence, each in the middle of its cell."""
    from scipy.stats.qmc import Sobol

    sequence = Sobol(dimension, bits=_BITS, **_random_argument(seed))
    return sequence.random_base2((runs - 1).bit_length())[:runs] + _MARGIN


def _radial(base: Array) -> Array:
    """Return the points A, B and A with one coordinate from B of each base sample.

    Args:
        base: A beside B, shape (samples, 2 d).

    Returns:
        Shape (samples * (d + 2), d).
    """
    samples, dimension = len(base), base.shape[1] // 2
    a, b = base[:, :dimension], base[:, dimension:]
    points = np.repeat(a[:, None, :], dimension + 2, axis=1)
    points[:, 1] = b
    for k in range(dimension):
        points[:, 2 + k, k] = b[:, k]
    return points.reshape(samples * (dimension + 2), dimension)


def _trajectories(count: int, dimension: int, seed: int) -> Array:
    """Return trajectories that change each coordinate once, in random order and direction.

    Returns:
        Probabilities at the middle of levels, shape (count * (d + 1), d).
    """
    random = np.random.default_rng(seed)
    lower = (random.integers(MORRIS_LEVELS // 2, size=(count, dimension)) + 0.5) / MORRIS_LEVELS
    rises = random.integers(2, size=(count, dimension)).astype(bool)
    order = random.permuted(np.tile(np.arange(dimension), (count, 1)), axis=1)
    # A coordinate has its second value from the step after its place in the order.
    is_second = np.arange(dimension + 1)[None, :, None] > order[:, None, :]
    points = lower[:, None, :] + MORRIS_STEP * (is_second == rises[:, None, :])
    return points.reshape(count * (dimension + 1), dimension)
