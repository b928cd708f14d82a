"""Sensitivity of the measures of a study to its parameters.

The variance of a measure is divided among the parameters: the first-order index of a parameter is
the share that it has alone, its total index the share with all interactions. Trajectories give the
effects of one parameter at a time instead, and a Latin hypercube correlations. Intervals are the
quantiles of bootstrap samples of whole base samples, trajectories or runs; with runs that failed,
all runs of that sample are left out.

References:
    Sobol, Math. Comput. Simul. 55 (2001) 271: indices.
    Saltelli et al., Comput. Phys. Commun. 181 (2010) 259: first order, Table 2 (b).
    Jansen, Comput. Phys. Commun. 117 (1999) 35: total index.
    Morris, Technometrics 33 (1991) 161: elementary effects.
    Campolongo, Cariboni & Saltelli, Environ. Model. Softw. 22 (2007) 1509: mu*.
    Helton & Davis, Reliab. Eng. Syst. Saf. 81 (2003) 23: ranks and regressions of Latin hypercubes.
    Archer, Saltelli & Sobol, J. Stat. Comput. Simul. 58 (1997) 99: bootstrap of indices.
"""

import json
import re
from collections.abc import Callable, Collection, Container, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import isfinite, nan
from pathlib import Path
from typing import Any

import numpy as np

from generator.diagnostics import Diagnostics, ModelError, Source
from generator.notebook import html_table
from generator.study.designs import design_points, unit_points
from generator.study.study import (
    DesignKind,
    Measure,
    RunResult,
    Sensitivity,
    Statistic,
    Study,
)
from generator.text_io import parse_file, write_atomic
from springs.backends import Array
from springs.short_repr import short_repr

INDICES_NAME = "sensitivity.json"
"""File of the indices in the folder of a study."""

MIN_SAMPLES = 8
"""Smallest number of base samples or trajectories from which indices are estimated."""

_ROUNDING = 1e-12
"""Relative range of a measure up to which it counts as constant."""

_MAX_WEIGHTS = 2**22
"""Largest number of weights in memory at a time."""


class IndexKind(StrEnum):
    """Kind of sensitivity index."""

    FIRST = "first"
    """Share of the variance that a parameter has alone."""
    TOTAL = "total"
    """Share of the variance that a parameter has alone and with others."""
    MU_STAR = "mu_star"
    """Mean size of the elementary effects, in the unit of the measure."""
    MU = "mu"
    """Mean of the elementary effects."""
    SIGMA = "sigma"
    """Standard deviation of the elementary effects: curvature and interactions."""
    RANK = "rank"
    """Spearman's correlation of the ranks, from -1 to 1."""
    REGRESSION = "regression"
    """Coefficient of a linear regression on all parameters, each number over its deviation."""


@dataclass(frozen=True)
class Estimate:
    """An estimated index with its confidence interval."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        """Value and interval ("0.65 [0.48, 0.87]")."""
        return f"{self.value:.3g} [{self.low:.3g}, {self.high:.3g}]"


_KINDS = {
    DesignKind.SOBOL: (IndexKind.FIRST, IndexKind.TOTAL),
    DesignKind.MORRIS: (IndexKind.MU_STAR, IndexKind.MU, IndexKind.SIGMA),
    DesignKind.LATIN_HYPERCUBE: (IndexKind.RANK, IndexKind.REGRESSION),
}
"""Indices of each design."""

MAIN_KINDS: Mapping[DesignKind, IndexKind] = {
    DesignKind.SOBOL: IndexKind.TOTAL,
    DesignKind.MORRIS: IndexKind.MU_STAR,
    DesignKind.LATIN_HYPERCUBE: IndexKind.RANK,
}
"""Index of each design by whose size the parameters are ranked."""

Indices = Mapping[str, Mapping[IndexKind, Estimate]]
"""Indices of a measure, by parameter."""


@short_repr
@dataclass(frozen=True)
class MeasureIndices:
    """Indices of one measure.

    Attributes:
        column: column of the motion from which the measure is taken.
        take: number that is taken from the column.
        samples: base samples or trajectories that are complete.
        parameters: indices by parameter; empty where they cannot be estimated.
        message: sentence about samples that are left out, or about missing indices; "" otherwise.
        r2: Share of the variance that the linear regression explains; None without one.
    """

    column: str
    take: str
    samples: int
    parameters: Indices
    message: str = ""
    r2: Estimate | None = None

    def ranked(self, kind: IndexKind) -> list[str]:
        """Return the parameters from the largest size of an index to the smallest."""
        sizes = {name: abs(each[kind].value) for name, each in self.parameters.items()}
        return sorted(sizes, key=lambda name: -sizes[name] if isfinite(sizes[name]) else 1.0)


@short_repr
@dataclass(frozen=True)
class StudyIndices:
    """Sensitivity indices of a study.

    Attributes:
        name: name of the study's figure.
        kind: kind of its design, Sobol, Morris or Latin hypercube.
        samples: base samples, trajectories or points of the design.
        confidence: level of the intervals.
        resamples: number of bootstrap samples.
        paths: paths of the quantities that get the value of a parameter, by parameter.
        measures: indices by measure.
    """

    name: str
    kind: DesignKind
    samples: int
    confidence: float
    resamples: int
    paths: Mapping[str, tuple[str, ...]]
    measures: Mapping[str, MeasureIndices]

    def rankings(self) -> Iterator[tuple[str, list[list[str]], str]]:
        """Yield title, table with headings, and note of each measure, the largest effect first.

        The table is empty where there are no indices; the note then tells why.
        """
        main = MAIN_KINDS[self.kind]
        for name, measure in self.measures.items():
            title, rows = f"sensitivity of {name}", list[list[str]]()
            if measure.parameters:
                title += f", {100.0 * self.confidence:g} % intervals"
                kinds = [main, *(kind for kind in _KINDS[self.kind] if kind is not main)]
                rows.append(["parameter", *(kind.value for kind in kinds)])
                for one in measure.ranked(main):
                    rows.append([one, *(str(measure.parameters[one][kind]) for kind in kinds)])
            if measure.r2 is not None:
                title += f", R2 of the regression {measure.r2}"
            yield title, rows, measure.message

    def _repr_html_(self) -> str:
        """Table of each measure, for notebooks."""
        return "".join(
            html_table(f"{title}. {note}".removesuffix(". "), rows[0] if rows else (), rows[1:])
            for title, rows, note in self.rankings()
        )

    def to_json(self) -> dict[str, Any]:
        """Return the indices as JSON data, with None for numbers that are not finite."""
        return {
            "figure": self.name,
            "design": self.kind.value,
            "samples": self.samples,
            "confidence": self.confidence,
            "resamples": self.resamples,
            "parameters": {name: list(paths) for name, paths in self.paths.items()},
            "measures": {name: _measure_json(each) for name, each in self.measures.items()},
        }


def _estimate_json(estimate: Estimate) -> dict[str, float | None]:
    return {key: number if isfinite(number) else None for key, number in vars(estimate).items()}


def _measure_json(measure: MeasureIndices) -> dict[str, Any]:
    r2 = {} if measure.r2 is None else {"r2": _estimate_json(measure.r2)}
    return {
        "column": measure.column,
        "take": measure.take,
        "samples": measure.samples,
        "message": measure.message,
        **r2,
        "indices": {
            parameter: {kind.value: _estimate_json(one) for kind, one in kinds.items()}
            for parameter, kinds in measure.parameters.items()
        },
    }


def write_indices(indices: StudyIndices, path: Path) -> None:
    """Write indices as JSON, all or nothing. Raises OSError."""
    write_atomic(path, json.dumps(indices.to_json(), indent=2, allow_nan=False) + "\n")


def read_indices(path: Path) -> StudyIndices:
    """Read indices as `write_indices` writes them. Raises InputError."""
    return parse_file(path, _parse_indices).require_value()


def _parse_indices(source: Source, diagnostics: Diagnostics) -> StudyIndices | None:
    try:
        data = json.loads(source.text)
        kind, paths = DesignKind(data["design"]), data["parameters"]
        return StudyIndices(
            name=str(data["figure"]),
            kind=kind,
            samples=int(data["samples"]),
            confidence=float(data["confidence"]),
            resamples=int(data["resamples"]),
            paths={name: tuple(map(str, each)) for name, each in paths.items()},
            measures={
                name: _measure(each, paths, _KINDS[kind]) for name, each in data["measures"].items()
            },
        )
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError):
        diagnostics.error("this is not a file of sensitivity indices", None, "run the sweep again")
        return None


def _measure(data: Any, paths: Container[str], expected: Collection[IndexKind]) -> MeasureIndices:
    """Return the indices of one measure of JSON data; raises as wrong data do."""
    parameters: dict[str, dict[IndexKind, Estimate]] = {}
    for parameter, kinds in data["indices"].items():
        if parameter not in paths or set(kinds) != set(expected):
            raise ValueError
        parameters[parameter] = {kind: _read_estimate(kinds[kind]) for kind in expected}
    column, take, message = (str(data[key]) for key in ("column", "take", "message"))
    r2 = _read_estimate(data["r2"]) if "r2" in data else None
    return MeasureIndices(column, take, int(data["samples"]), parameters, message, r2)


def _read_estimate(data: Any) -> Estimate:
    numbers = (data[key] for key in ("value", "low", "high"))
    return Estimate(*(nan if number is None else float(number) for number in numbers))


def estimate_indices(study: Study, results: Sequence[RunResult]) -> StudyIndices:
    """Estimate the sensitivity indices of a study from the results of its runs, in their order.

    Raises:
        ModelError: the design has no indices, or results are missing.
    """
    settings = study.sensitivity or Sensitivity()
    unit = _sampled_points(study)
    samples, points, _ = unit.shape
    if len(results) != samples * points:
        raise ModelError(f"indices need all {samples * points} runs, but {len(results)} are there")

    def indices_of(measure: Measure) -> MeasureIndices:
        outputs = np.array([_output(result, measure.name) for result in results])
        outputs = outputs.reshape(samples, points)
        complete = np.isfinite(outputs).all(axis=1)
        count = int(complete.sum())
        kind, seed = study.design.kind, study.design.seed
        is_sobol = kind is DesignKind.SOBOL
        used = outputs[complete, :2] if is_sobol else outputs[complete]
        message = _obstacle(measure, used, samples)
        if not message and kind is DesignKind.LATIN_HYPERCUBE and count < len(study.parameters) + 2:
            message = f"{count} of {samples} runs are complete: a regression needs more."
        parameters: Indices = {}
        r2 = None
        if not message:
            if is_sobol:
                found = sobol_indices(outputs[complete], settings, seed)
            elif kind is DesignKind.MORRIS:
                found = morris_effects(unit[complete], outputs[complete], settings, seed)
            else:
                found, r2 = correlations(unit[complete, 0], outputs[complete, 0], settings, seed)
            parameters = dict(zip(study.parameters, found, strict=True))
            if count < samples:
                message = (
                    f"Left out because of failed runs: {samples - count} of {samples} samples."
                )
        return MeasureIndices(measure.column, measure.take.value, count, parameters, message, r2)

    return StudyIndices(
        name=study.name,
        kind=study.design.kind,
        samples=samples,
        confidence=settings.confidence,
        resamples=settings.resamples,
        paths={name: each.paths for name, each in study.parameters.items()},
        measures={name: indices_of(each) for name, each in study.measures.items()},
    )


def _sampled_points(study: Study) -> Array:
    """Return the probabilities of the runs, shape (samples, points of a sample, parameters).

    Of a Latin hypercube, values of the parameters.
    """
    dimension = len(study.parameters)
    if study.design.kind is DesignKind.MORRIS:
        return unit_points(study).reshape(-1, dimension + 1, dimension)
    if study.design.kind is DesignKind.SOBOL and study.sensitivity is not None:
        return unit_points(study).reshape(-1, dimension + 2, dimension)
    if study.design.kind is DesignKind.LATIN_HYPERCUBE:
        return design_points(study)[:, None]
    raise ModelError(
        f"the design `{study.design.kind}` has no sensitivity indices: use sobol, morris or "
        "latin-hypercube"
    )


def _output(result: RunResult, measure: str) -> float:
    """Return a measure of a run, nan if it failed."""
    value = result.measures.get(measure) if result.succeeded else None
    return nan if value is None else value


_PEAK_FORCE = re.compile(r"(?:part\.(.+)\.peak_force|(.+)\.contact_force) \[N\]")
"""Columns of the forces on parts and segments, of which the largest is 0 without a touch."""


def _obstacle(measure: Measure, outputs: Array, samples: int) -> str:
    """Return the reason why a measure has no indices, or ""."""
    if len(outputs) < MIN_SAMPLES:
        return f"{len(outputs)} of {samples} samples are complete: indices need {MIN_SAMPLES}."
    if np.ptp(outputs) <= _ROUNDING * np.abs(outputs).max():
        reason = "it depends on no parameter"
        force = _PEAK_FORCE.fullmatch(measure.column)
        if force and not outputs.any() and (force[1] or measure.take is Statistic.LARGEST):
            reason = f"`{force[1] or force[2]}` touches nothing in any run"
        return f"All samples have the value {outputs[0, 0]:.6g}: {reason}."
    return ""


def sobol_indices(
    outputs: Array, settings: Sensitivity, seed: int
) -> list[Mapping[IndexKind, Estimate]]:
    """Estimate first-order and total indices.

    Args:
        outputs: outputs at A, B and A with one coordinate from B, shape (samples, 2 + parameters).
        settings: settings of the intervals.
        seed: seed of the bootstrap.

    Returns:
        The estimates of each parameter.
    """
    # Without the mean, the variance loses no digits.
    outputs = outputs - outputs[:, :2].mean()
    a, b, mixed = outputs[:, :1], outputs[:, 1:2], outputs[:, 2:]
    dimension = mixed.shape[1]
    terms = np.hstack([a + b, a**2 + b**2, b * (mixed - a), mixed - a, (mixed - a) ** 2])

    def indices(means: Array) -> Array:
        """Return the indices from means of the terms, shape (..., 2, parameters)."""
        mean = means[..., :1] / 2.0
        variance = means[..., 1:2] / 2.0 - mean**2
        covariance, difference, square = np.split(means[..., 2:], 3, axis=-1)
        # A bootstrap sample of equal outputs has no indices.
        variance = np.where(variance > 0.0, variance, nan)
        first = (covariance - mean * difference) / variance
        return np.stack([first, 0.5 * square / variance], axis=-2)

    value, low, high = _estimate(terms, indices, settings, seed)
    return _by_parameter(_KINDS[DesignKind.SOBOL], value, low, high, dimension)


def morris_effects(
    unit: Array, outputs: Array, settings: Sensitivity, seed: int
) -> list[Mapping[IndexKind, Estimate]]:
    """Estimate the mean size, the mean and the standard deviation of elementary effects.

    An elementary effect is the change of the output in a step, divided by the change of the
    parameter's probability: for a uniform distribution, the slope times the range.

    Args:
        unit: probabilities, shape (trajectories, parameters + 1, parameters).
        outputs: shape (trajectories, parameters + 1).
        settings: settings of the intervals.
        seed: seed of the bootstrap.

    Returns:
        The estimates of each parameter.
    """
    steps = np.diff(unit, axis=1)
    count, dimension = len(unit), unit.shape[2]
    place = np.argmax(steps != 0.0, axis=1)
    change = np.take_along_axis(np.diff(outputs, axis=1), place, axis=1)
    effects = change / np.take_along_axis(steps, place[:, None, :], axis=1)[:, 0]
    centre = effects.mean(axis=0)
    centred = effects - centre
    terms = np.hstack([np.abs(effects), centred, centred**2])

    def moments(means: Array) -> Array:
        """Return mu*, mu and sigma from means of the terms, shape (..., 3, parameters)."""
        size, mean, square = np.split(means, 3, axis=-1)
        variance = np.maximum(square - mean**2, 0.0) * count / (count - 1)
        return np.stack([size, centre + mean, np.sqrt(variance)], axis=-2)

    value, low, high = _estimate(terms, moments, settings, seed)
    return _by_parameter(_KINDS[DesignKind.MORRIS], value, low, high, dimension)


def correlations(
    values: Array, outputs: Array, settings: Sensitivity, seed: int
) -> tuple[list[Mapping[IndexKind, Estimate]], Estimate]:
    """Estimate Spearman's rank correlations, and a linear regression on all parameters.

    Args:
        values: values of the parameters, shape (runs, parameters).
        outputs: shape (runs,).
        settings: settings of the intervals.
        seed: seed of the bootstrap.

    Returns:
        The estimates of each parameter, and the share of the variance that the regression explains.
    """
    count, dimension = values.shape
    columns = np.column_stack([values, outputs])
    random = np.random.default_rng(seed)
    sampled = [
        _correlate(columns[random.integers(count, size=(size, count))])
        for size in _batches(settings, count * dimension)
    ]
    value = _correlate(columns[None])[0]
    tail = (1.0 - settings.confidence) / 2.0
    low, high = np.nanquantile(np.concatenate(sampled), [tail, 1.0 - tail], axis=0)
    kinds = _KINDS[DesignKind.LATIN_HYPERCUBE]
    found = _by_parameter(kinds, value[:, :-1], low[:, :-1], high[:, :-1], dimension)
    return found, Estimate(float(value[1, -1]), float(low[1, -1]), float(high[1, -1]))


def _correlate(columns: Array) -> Array:
    """Return correlations and regressions of parameters and outputs.

    Args:
        columns: samples, shape (n, runs, parameters + 1), the outputs last.

    Returns:
        Of the ranks, and of the regression with its r2 last, shape (n, 2, parameters + 1).
    """
    from scipy.stats import rankdata

    ranks = _correlation_matrices(rankdata(columns, axis=1))[:, -1]
    of_values = _correlation_matrices(columns)
    with_output = of_values[:, :-1, -1]
    # A parameter that is constant in a bootstrap sample has no part in its regression.
    inverse = np.linalg.pinv(np.nan_to_num(of_values[:, :-1, :-1]), hermitian=True)
    beta = np.einsum("nij,nj->ni", inverse, np.nan_to_num(with_output))
    r2 = np.einsum("ni,ni->n", beta, np.nan_to_num(with_output))
    return np.stack([ranks, np.column_stack([beta, r2])], axis=1)


def _correlation_matrices(numbers: Array) -> Array:
    """Return the correlations of columns, shape (n, runs, k) to (n, k, k)."""
    centred = numbers - numbers.mean(axis=1, keepdims=True)
    length = np.sqrt(np.sum(centred**2, axis=1, keepdims=True))
    unit = centred / np.where(length > 0.0, length, nan)
    return np.einsum("nri,nrj->nij", unit, unit)


def _estimate(
    terms: Array, function: Callable[[Array], Array], settings: Sensitivity, seed: int
) -> tuple[Array, Array, Array]:
    """Return a function of the means of terms, and its percentile bootstrap interval.

    Args:
        terms: shape (samples, terms).
        function: function of means, shape (..., terms).
        settings: confidence and number of bootstrap samples.
        seed: seed of the bootstrap.
    """
    random = np.random.default_rng(seed)
    count = len(terms)
    means = [
        random.multinomial(count, np.full(count, 1.0 / count), size=size) @ terms / count
        for size in _batches(settings, count)
    ]
    tail = (1.0 - settings.confidence) / 2.0
    low, high = np.nanquantile(function(np.concatenate(means)), [tail, 1.0 - tail], axis=0)
    return function(terms.mean(axis=0)), low, high


def _batches(settings: Sensitivity, weights: int) -> Iterator[int]:
    """Yield numbers of bootstrap samples, each with so many weights, that fit into memory."""
    left = settings.resamples
    while left:
        size = min(left, max(1, _MAX_WEIGHTS // weights))
        yield size
        left -= size


def _by_parameter(
    kinds: Sequence[IndexKind], value: Array, low: Array, high: Array, dimension: int
) -> list[Mapping[IndexKind, Estimate]]:
    return [
        {
            kind: Estimate(float(value[i, k]), float(low[i, k]), float(high[i, k]))
            for i, kind in enumerate(kinds)
        }
        for k in range(dimension)
    ]
