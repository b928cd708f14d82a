"""Springs, and other quantities of a figure, fitted to measured joint angles.

The sum of squared differences of simulated and measured angles is minimised from several starts
(`scipy.optimize.least_squares`). The time of the release and the start angle of each measured joint
are estimated beside the quantities asked for: a release that is wrong by one sample, or the noise
of the first angle, would become errors of the springs.
"""

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import degrees, inf, isfinite

import numpy as np

from generator.diagnostics import ModelError, MoverError, UsageError, format_count
from generator.identification.comparison import (
    Accuracy,
    Comparison,
    FailedRunError,
    Unknown,
    WallLimitReachedError,
    make_unknown,
    unknown_release,
)
from generator.identification.law_tails import LawTail, change_tail, find_tails
from generator.identification.measured_angles import MeasuredAngles
from generator.identification.release import Release, find_release
from generator.identification.uncertainty import (
    MAX_CONDITION,
    LinearUncertainty,
    Profile,
    compute_profile,
    gauss_newton_move,
    linear_uncertainty,
    move_within_bounds,
)
from generator.identification.whiteness import Whiteness, check_residuals
from generator.notebook import html_table
from generator.rotations import Array
from generator.simulation.plan import resolve_model
from generator.study.parameter_paths import Case, ParameterPath, Quantity, parse_path
from springs.short_repr import short_repr

MAX_BIAS = 0.1
"""Largest bias of an estimate by the error of the runs [sd]."""

FIRST_TOLERANCE, SMALLEST_TOLERANCE = 1e-5, 1e-11
"""Joint-angle error tolerances of the first fit, and of the finest one [rad]."""

_REFINEMENT = 1e-2
"""Ratio of the tolerances of a fit and of the run that tests it."""

CONFIDENCE = 0.95
"""Level of the intervals."""

_SCREENED = 8
"""Number of drawn points of which the best one becomes a start of the fit."""

_MAX_EVALUATIONS = 60
"""Largest number of evaluations of a fit from one start."""

_SEARCH_GAIN = 1e-4
"""Relative gain of the sum of squares at which the fit from a start ends."""

_MAX_POLISHES, _SMALL_MOVE = 8, 0.1
"""Largest number of Gauss-Newton steps at the best values, and the size of the last one [sd]."""

_SAME_MINIMUM = 1e-3
"""Relative difference of the sums of squares below which two starts have found the same."""

_MASSES = (Quantity.MASS, Quantity.MASS_SCALE, Quantity.INERTIA_SCALE)

HELD_TIME = 0.2
"""Time before the release of which samples are used [s]: a hand does not hold still for long."""

_NO_RESPONSE = 1e-7
"""Change of the angles over the typical change of a quantity that counts as none [rad]."""


@short_repr
@dataclass(frozen=True)
class FitOptions:
    """Choices of a fit.

    Attributes:
        sd: standard deviation of the noise of an angle [rad]; None estimates it from the residuals.
        starts: number of starts: the nominal values, and points about them.
        seed: seed of these.
        tolerance: joint-angle error tolerance of the runs [rad]; None refines it until the bias of
            all estimates is below `MAX_BIAS`.
        step: fixed step of the runs [s]; None for error control.
        profiles: whether profiles are computed.
        known_starts: joints whose start angles in the plan are exact; None for those that the
            plan sets. Those of other measured joints are estimated.
        release: time of the release, if it is known [s]; None estimates it for a motion from rest
            without loads and drives. Earlier samples are left out.
    """

    sd: float | None = None
    starts: int = 3
    seed: int = 0
    tolerance: float | None = None
    step: float | None = None
    profiles: bool = True
    known_starts: tuple[str, ...] | None = None
    release: float | None = None

    def __post_init__(self) -> None:
        """Check the values. Raises UsageError."""
        if self.starts < 1:
            raise UsageError(f"a fit needs one start or more, not {self.starts}")
        if self.release is not None and not isfinite(self.release):
            raise UsageError(f"the release of a fit must be finite, not {self.release:g}")
        for name, value in (("sd", self.sd), ("tolerance", self.tolerance), ("step", self.step)):
            if value is not None and not 0.0 < value < inf:
                raise UsageError(f"the {name} of a fit must be positive, not {value:g}")


@short_repr
@dataclass(frozen=True)
class Estimate:
    """An estimate, in the unit of its path.

    Attributes:
        path: path of the quantity.
        unit: unit of the values; "" for a factor.
        value: estimate.
        sd: standard deviation.
        interval: 95 % interval from the standard deviation.
        profile: profile of the sum of squares; None where it was not computed.
        profile_interval: 95 % interval from the profile, which ends at the smallest value of the
            quantity at the latest; None for an open end.
        mass_slope: change of the estimate per relative change of all masses; None where masses are
            fitted.
        bias: change of the estimate with more accurate runs [sd].
        at_bound: whether the estimate is at the smallest value of the quantity.
        is_start: whether it is the release, or the start angle of a measured joint, which are
            estimated beside the others.
    """

    path: str
    unit: str
    value: float
    sd: float
    interval: tuple[float, float]
    profile: Profile | None
    profile_interval: tuple[float | None, float | None] | None
    mass_slope: float | None
    bias: float
    at_bound: bool
    is_start: bool


@short_repr
@dataclass(frozen=True)
class StartResult:
    """Result of the fit from one start.

    Attributes:
        values: values of the unknowns at the start.
        rms: rms of the residuals at the end [rad]; None if the runs failed.
        is_best: whether it found the least sum of squares.
    """

    values: tuple[float, ...]
    rms: float | None
    is_best: bool


@short_repr
@dataclass(frozen=True, eq=False)
class Fit:
    """Result of a fit.

    Attributes:
        case: figure and plan with the estimates. The time of the plan begins at the release, but
            with loads or drives it is that of the samples.
        nominal: the same before the fit.
        data: measured angles that were used.
        release: time of the release [s].
        simulated: angles of the fit at their times, shape (n, k) [rad].
        estimates: estimates of the quantities asked for, then of start angles.
        correlations: correlations of the estimates, shape (p, p).
        condition: condition of the Jacobian with columns of length 1.
        noise_sd: standard deviation of the noise of an angle [rad].
        options: options of the fit.
        tests: tests of the residuals.
        accuracy: accuracy of the runs.
        starts: results of all starts.
        runs: number of runs.
        failed_runs: those of them that failed.
        tails: Tails of the elastic laws of measured joints, with the changes of the estimates.
        unfinished: sentence about the profiles that the wall-time limit left out; "" for none.
    """

    case: Case
    nominal: Case
    data: MeasuredAngles
    release: float
    simulated: Array
    estimates: tuple[Estimate, ...]
    correlations: Array
    condition: float
    noise_sd: float
    options: FitOptions
    tests: Whiteness
    accuracy: Accuracy
    starts: tuple[StartResult, ...]
    runs: int
    failed_runs: int
    tails: tuple[LawTail, ...] = ()
    unfinished: str = ""

    @property
    def residuals(self) -> Array:
        """Simulated less measured angles, shape (n, k) [rad]."""
        return self.simulated - self.data.angles

    @property
    def has_fitted_masses(self) -> bool:
        """Return whether a mass or an inertia is among the estimates."""
        return any(one.mass_slope is None for one in self.estimates)

    @property
    def values(self) -> dict[str, float]:
        """Estimates by path."""
        return {one.path: one.value for one in self.estimates}

    def _repr_html_(self) -> str:
        """Table of the estimates, for notebooks."""
        rows = [
            (
                one.path,
                one.unit,
                *(f"{number:.4g}" for number in (one.value, one.sd, *one.interval)),
            )
            for one in self.estimates
        ]
        count = format_count(self.data.angles.size, "angle")
        rms = degrees(float(np.sqrt(np.mean(self.residuals**2))))
        title = f"{count} of {self.data.name}, residuals of {rms:.2g} deg (rms)"
        columns = ("quantity", "unit", "estimate", "sd", "from", "to (95 %)")
        return html_table(title, columns, rows)

    def change_by_tail(self, path: str) -> float | None:
        """Largest change of an estimate by a tail, in its unit; None without tails."""
        place = [one.path for one in self.estimates].index(path)
        return max((abs(tail.changes[place]) for tail in self.tails), default=None)


class UnfinishedFitError(MoverError):
    """The wall-time limit was reached before the estimates had their uncertainty.

    Attributes:
        values: best values so far by path, without uncertainty.
    """

    def __init__(self, message: str, values: Mapping[str, float]) -> None:
        """Keep the values beside the sentence."""
        super().__init__(message)
        self.values = dict(values)


def fit_springs(
    case: Case,
    data: MeasuredAngles,
    paths: Sequence[ParameterPath | str],
    options: FitOptions | None = None,
    watch: Callable[[], None] | None = None,
    *,
    deadline: float = inf,
) -> Fit:
    """Fit quantities of a case to measured joint angles.

    The joints are held until the release, and move from rest unless the plan has other rates. The
    time of the release is estimated unless the options state it; with loads, drives or rates it is
    the first sample. The start angles of the measured joints are estimated, unless the plan sets
    them or a path names them.

    Args:
        case: figure and plan; start, stop and frames of the plan are those of the data.
        data: measured angles.
        paths: paths of the quantities, such as "springs.knee.scale".
        options: options of the fit.
        watch: called before each run.
        deadline: `time.monotonic` after which no run starts [s]. Profiles may be missing then.

    Raises:
        UsageError: the data have too few samples.
        ModelError: the data do not determine the quantities; the message names the combination.
        UnfinishedFitError: the deadline came before the uncertainty was known.
        MoverError: all runs fail.
    """
    options = options or FitOptions()
    data = data.without((*case.plan.locked, *case.plan.drives))
    known = case.plan.displacements if options.known_starts is None else options.known_starts
    case = Case(*resolve_model(case.model, case.plan))
    wanted = [parse_path(path, case) if isinstance(path, str) else path for path in paths]
    unknowns = [make_unknown(path, case) for path in wanted]
    if not paths:
        raise UsageError("nothing to fit: name a quantity with --fit")
    if len({str(path) for path in wanted}) < len(wanted):
        raise UsageError("a quantity is fitted twice")
    release, is_fitted = options.release, False
    if release is not None:
        data.check_time(release)
        data = data.between(release)
    found, first = Release(0.0, data.angles[0]), float(data.times[0])
    if release is None and _starts_from_rest(case, wanted):
        found, is_fitted = find_release(data.times, data.angles), True
        data = data.between(first + found.time - HELD_TIME)
    unknowns += start_angles(case, data, wanted, known, found.angles)
    if is_fitted:
        interval = float(np.median(np.diff(data.times)))
        unknowns.append(unknown_release(found.time - (float(data.times[0]) - first), interval))
    if data.angles.size <= len(unknowns):
        raise UsageError(
            f"{format_count(data.angles.size, 'angle')} cannot determine "
            f"{format_count(len(unknowns), 'unknown')}: measure more samples"
        )
    comparison = Comparison(case, data, unknowns, watch, release=release, deadline=deadline)
    try:
        return _fit(comparison, options)
    except WallLimitReachedError as failure:
        raise _unfinished_fit(comparison, str(failure)) from None


def _starts_from_rest(case: Case, paths: Sequence[ParameterPath]) -> bool:
    """Return whether the motion begins at rest, and depends on the time since then only."""
    plan = case.plan
    has_rates = any(any(rates) for rates in plan.velocities.values()) or any(
        path.quantity is Quantity.VELOCITY for path in paths
    )
    return not (plan.drives or plan.loads or has_rates)


def _unfinished_fit(comparison: Comparison, reason: str) -> UnfinishedFitError:
    """Return the error of a fit that the deadline ended, with what is known so far."""
    if comparison.best is None:
        words = "before a run had reached the last sample: nothing is known yet"
        return UnfinishedFitError(f"{reason} {words}", {})
    after = f"{reason} after {format_count(comparison.runs, 'run')}"
    squares, values = comparison.best
    named = {
        unknown.name: float(value)
        for unknown, value in zip(
            comparison.unknowns, comparison.in_time_of_data(values), strict=True
        )
    }
    rms = degrees(float(np.sqrt(squares / comparison.data.angles.size)))
    shown = ", ".join(f"{name} {value:.10g}" for name, value in named.items())
    return UnfinishedFitError(
        f"{after}, before any uncertainty was known; the best values so far, with an rms residual "
        f"of {rms:.3g} deg: {shown}",
        named,
    )


def _fit(comparison: Comparison, options: FitOptions) -> Fit:
    """Fit, and return the result. Raises as `fit_springs` does, and WallLimitReachedError."""
    data, unknowns = comparison.data, comparison.unknowns
    accuracy = Accuracy(options.tolerance or FIRST_TOLERANCE, options.step)
    values, starts = _search(comparison, accuracy, options)
    while True:
        found = _polish(comparison, accuracy, options, values)
        bias = found.bias()
        finer = _REFINEMENT * accuracy.tolerance
        is_fixed = options.step is not None or options.tolerance is not None
        if is_fixed or np.max(np.abs(bias)) <= MAX_BIAS or finer < SMALLEST_TOLERANCE:
            break
        values, accuracy = found.values, replace(accuracy, tolerance=finer)
    tails = found.tails()
    estimates, unfinished = found.with_profiles(found.estimates(bias))
    residuals = found.residuals.reshape(data.angles.shape)
    return Fit(
        case=comparison.case_at(found.values),
        nominal=comparison.case,
        data=data,
        release=comparison.release(found.values) + comparison.origin,
        simulated=residuals + data.angles,
        estimates=estimates,
        correlations=found.uncertainty.correlations,
        condition=found.uncertainty.condition,
        noise_sd=found.noise_sd,
        options=options,
        tests=check_residuals(residuals, len(unknowns), options.sd),
        accuracy=accuracy,
        starts=starts,
        runs=comparison.runs,
        failed_runs=comparison.failed_runs,
        tails=tails,
        unfinished=unfinished,
    )


def start_angles(
    case: Case,
    data: MeasuredAngles,
    paths: Sequence[ParameterPath],
    known: Container[str],
    angles: Array,
) -> list[Unknown]:
    """Return the start angles of measured joints, without known ones and those of the paths.

    Args:
        case: figure and plan.
        data: measured angles, of k columns.
        paths: Paths of the quantities that are fitted.
        known: joints whose start angles are exact.
        angles: Angles from which the fit starts, shape (k,) [rad].
    """
    named = {str(path) for path in paths}
    found: list[Unknown] = []
    for k, (joint, coordinate) in enumerate(data.columns):
        has_one = len(case.figure.joints[joint].chain) == 1
        text = f"pose.{joint}" if has_one else f"pose.{joint}.{coordinate + 1}"
        if coordinate not in case.figure.joints[joint].free_places:
            continue
        if joint in known or {text, f"pose.{joint}.{coordinate + 1}"} & named:
            continue
        path = parse_path(text, case)
        found.append(make_unknown(path, case, degrees(float(angles[k]))))
    return found


def _search(
    comparison: Comparison, accuracy: Accuracy, options: FitOptions
) -> tuple[Array, tuple[StartResult, ...]]:
    """Fit from several starts; return the best values, and the results.

    Raises MoverError if all fail.
    """
    from scipy.stats import qmc

    unknowns = comparison.unknowns
    nominal = np.array([max(one.nominal, one.lower) for one in unknowns])
    points = [nominal]
    draws = qmc.LatinHypercube(len(unknowns), rng=options.seed)
    for _ in range(options.starts - 1):
        drawn = [
            np.array([one.spread(float(u)) for one, u in zip(unknowns, row, strict=True)])
            for row in draws.random(_SCREENED)
        ]
        costs = [float(np.sum(comparison.residuals(point, accuracy) ** 2)) for point in drawn]
        points.append(drawn[int(np.argmin(costs))])
    ends: list[tuple[float, Array] | None] = []
    for point in points:
        try:
            ends.append(_descend(comparison, accuracy, point))
        except FailedRunError:
            ends.append(None)
    reached = [end for end in ends if end is not None]
    if not reached:
        raise MoverError(f"no run reaches the last sample: {comparison.failure}")
    least, best = min(reached, key=lambda end: end[0])
    count = comparison.data.angles.size
    results = tuple(
        StartResult(
            tuple(comparison.in_time_of_data(point).tolist()),
            None if end is None else float(np.sqrt(end[0] / count)),
            end is not None and end[0] <= least * (1.0 + _SAME_MINIMUM),
        )
        for point, end in zip(points, ends, strict=True)
    )
    return best, results


def _descend(comparison: Comparison, accuracy: Accuracy, start: Array) -> tuple[float, Array]:
    """Fit from a start with forward differences; return the sum of squares, and the values.

    Raises FailedRunError.
    """
    from scipy.optimize import least_squares

    steps = comparison.difference_steps()
    latest: dict[bytes, Array] = {}

    def residuals(values: Array) -> Array:
        latest.clear()
        latest[values.tobytes()] = found = comparison.residuals(values, accuracy)
        return found

    def jacobian(values: Array) -> Array:
        nonlocal steps
        here = latest.get(values.tobytes())
        here = comparison.residuals(values, accuracy) if here is None else here
        found = comparison.jacobian(values, accuracy, steps, here)
        steps = comparison.difference_steps(found)
        return found

    lower = comparison.lower_bounds
    inside = np.where(start > lower, start, lower + 0.1 * _sizes(comparison))
    solution = least_squares(
        residuals,
        inside,
        jac=jacobian,
        bounds=(lower, np.full(len(lower), np.inf)),
        x_scale="jac",
        ftol=_SEARCH_GAIN,
        xtol=1e-9,
        gtol=None,
        max_nfev=_MAX_EVALUATIONS,
    )
    return 2.0 * float(solution.cost), np.asarray(solution.x, dtype=float)


def _polish(
    comparison: Comparison, accuracy: Accuracy, options: FitOptions, values: Array
) -> "_Minimum":
    """Fit with central differences near the minimum, by Gauss and Newton's method.

    The Jacobian of the result may be that of values less than `_SMALL_MOVE` away.

    Raises:
        FailedRunError: runs beside the values fail.
        ModelError: a quantity has no effect.
    """
    jacobian = comparison.jacobian(values, accuracy, comparison.difference_steps())
    _require_response(comparison, jacobian)
    residuals = comparison.residuals(values, accuracy)
    everything = range(len(values))
    for _ in range(_MAX_POLISHES):
        jacobian = comparison.jacobian(values, accuracy, comparison.difference_steps(jacobian))
        trial = move_within_bounds(values, everything, comparison.lower_bounds, jacobian, residuals)
        found = comparison.residuals(trial, accuracy)
        if not np.sum(found**2) < np.sum(residuals**2):
            break
        sd = _noise_sd(found, len(values), None) * linear_uncertainty(jacobian).sd
        is_small = bool(np.all(np.abs(trial - values) <= _SMALL_MOVE * sd))
        values, residuals = trial, found
        if is_small:
            break
    return _Minimum(comparison, accuracy, options, values, residuals, jacobian)


def _sizes(comparison: Comparison) -> Array:
    return np.array([one.size for one in comparison.unknowns])


def _noise_sd(residuals: Array, unknowns: int, stated: float | None) -> float:
    """Standard deviation of the noise [rad]: as stated, or that of the residuals."""
    if stated is not None:
        return stated
    return float(np.sqrt(np.sum(residuals**2) / (residuals.size - unknowns)))


def _require_response(comparison: Comparison, jacobian: Array) -> None:
    """Raise ModelError for a quantity that does not change the angles."""
    response = np.sqrt(np.mean(jacobian**2, axis=0)) * _sizes(comparison)
    for unknown, change in zip(comparison.unknowns, response, strict=True):
        if not change > _NO_RESPONSE:
            raise ModelError(
                f"{unknown.name} does not change the measured angles of {comparison.data.name}: "
                + ("leave it out" if unknown.path else "state its time with --start")
            )


def _describe_null_direction(
    comparison: Comparison, values: Array, uncertainty: LinearUncertainty
) -> str:
    """Name the combination of unknowns that the data do not determine, in a sentence."""
    direction = uncertainty.null_direction
    scales = np.maximum(np.abs(values), _sizes(comparison))
    relative = direction / scales
    relative = relative / relative[np.argmax(np.abs(relative))]
    names: list[str] = []
    changes: list[str] = []
    masses: list[str] = []
    for k in np.flatnonzero(np.abs(relative) > 0.05):
        unknown = comparison.unknowns[int(k)]
        names.append(unknown.name)
        if abs(values[k]) >= scales[k]:
            changes.append(f"{10.0 * relative[k] * np.sign(values[k]):+.2g} %")
        else:
            changes.append(f"{0.1 * relative[k] * scales[k]:+.2g} {unknown.unit}".rstrip())
        if unknown.has_quantity(*_MASSES):
            masses.append(unknown.name)
    hint = (
        f"measure the mass and leave out {masses[0]}"
        if masses
        else f"leave out one of them, or measure a motion in which {names[-1]} acts otherwise"
    )
    return (
        f"{comparison.data.name} does not determine {_listed(names)} together: the changes "
        f"{_listed(changes)} leave the angles as they are (condition "
        f"{uncertainty.condition:.1e}, at most {MAX_CONDITION:.0e}); {hint}"
    )


def _listed(words: Sequence[str]) -> str:
    if len(words) < 2:
        return "".join(words)
    return f"{', '.join(words[:-1])} and {words[-1]}"


@dataclass(frozen=True, eq=False)
class _Minimum:
    """Values of the unknowns at which the sum of squares is least.

    Attributes:
        comparison: comparison with the measured angles.
        accuracy: accuracy of the runs.
        options: options of the fit.
        values: values, shape (p,).
        residuals: residuals there, shape (n * k,) [rad].
        jacobian: Jacobian there, shape (n * k, p).
    """

    comparison: Comparison
    accuracy: Accuracy
    options: FitOptions
    values: Array
    residuals: Array
    jacobian: Array

    @cached_property
    def uncertainty(self) -> LinearUncertainty:
        """Uncertainty of the values. Raises ModelError if the data do not determine them."""
        found = linear_uncertainty(self.jacobian)
        if found.condition > MAX_CONDITION:
            raise ModelError(_describe_null_direction(self.comparison, self.values, found))
        return found

    @property
    def noise_sd(self) -> float:
        """Standard deviation of the noise of an angle [rad]."""
        return _noise_sd(self.residuals, len(self.values), self.options.sd)

    @property
    def sd(self) -> Array:
        """Standard deviations of the values, shape (p,)."""
        return self.noise_sd * self.uncertainty.sd

    @property
    def quantile(self) -> float:
        """Half width of the intervals [sd]."""
        from scipy.stats import norm, t

        level, freedom = 0.5 * (1.0 + CONFIDENCE), self.residuals.size - len(self.values)
        return float(t.ppf(level, freedom) if self.options.sd is None else norm.ppf(level))

    def bias(self) -> Array:
        """Change of the values with more accurate runs, shape (p,) [sd]: a Gauss-Newton step."""
        sd = self.sd
        tolerance = min(_REFINEMENT * self.accuracy.tolerance, FIRST_TOLERANCE)
        finer = self.comparison.residuals(self.values, Accuracy(tolerance))
        return gauss_newton_move(self.jacobian, finer - self.residuals) / sd

    def tails(self) -> tuple[LawTail, ...]:
        """Return the tails of the laws, with the changes of the values: one Gauss-Newton step."""
        comparison, data = self.comparison, self.comparison.data
        simulated = self.residuals.reshape(data.angles.shape) + data.angles
        tails: list[LawTail] = []
        for tail in find_tails(comparison.case_at(self.values), data.columns, simulated):
            change = partial(change_tail, tail=tail)
            changed, is_complete = comparison.run(self.values, self.accuracy, change)
            if is_complete:
                moves = gauss_newton_move(self.jacobian, changed - self.residuals)
                tails.append(replace(tail, changes=tuple(moves.tolist())))
        return tuple(tails)

    def estimates(self, bias: Array) -> list[Estimate]:
        """Return the estimates with their uncertainty, without profiles."""
        comparison, sd, quantile = self.comparison, self.sd, self.quantile
        mass_slopes = None
        if not any(one.has_quantity(*_MASSES) for one in comparison.unknowns):
            slopes = comparison.mass_derivative(self.values, self.accuracy)
            mass_slopes = gauss_newton_move(self.jacobian, slopes)
        reported = comparison.in_time_of_data(self.values)
        estimates: list[Estimate] = []
        for k, unknown in enumerate(comparison.unknowns):
            value, deviation = float(reported[k]), float(sd[k])
            estimates.append(
                Estimate(
                    path=unknown.name,
                    unit=unknown.unit,
                    value=value,
                    sd=deviation,
                    interval=(value - quantile * deviation, value + quantile * deviation),
                    profile=None,
                    profile_interval=None,
                    mass_slope=None if mass_slopes is None else float(mass_slopes[k]),
                    bias=float(bias[k]),
                    at_bound=float(self.values[k]) - unknown.lower < 0.05 * deviation,
                    is_start=unknown.is_start,
                )
            )
        return estimates

    def with_profiles(self, made: list[Estimate]) -> tuple[tuple[Estimate, ...], str]:
        """Return estimates with profiles, and a sentence about those that the deadline left out."""
        comparison, quantile = self.comparison, self.quantile
        sd = np.array([one.sd for one in made])
        wanted = [
            k
            for k, one in enumerate(made)
            if self.options.profiles and not one.is_start and one.sd > 0.0
        ]
        for done, k in enumerate(wanted):
            try:
                profile = compute_profile(
                    k,
                    self.values,
                    sd,
                    self.noise_sd**2,
                    quantile,
                    comparison.lower_bounds,
                    self.jacobian,
                    lambda moved: comparison.residuals(moved, self.accuracy),
                )
            except WallLimitReachedError as failure:
                missing = _listed([made[j].path for j in wanted[done:]])
                return tuple(made), (
                    f"{failure} after {format_count(comparison.runs, 'run')}: estimates and "
                    f"standard deviations are complete, the profiles of {missing} are missing"
                )
            interval = _profile_interval(profile, quantile, comparison.unknowns[k].lower)
            made[k] = replace(made[k], profile=profile, profile_interval=interval)
        return tuple(made), ""


def _profile_interval(
    profile: Profile, quantile: float, lower: float
) -> tuple[float | None, float | None]:
    """Interval of a profile; the end of a profile that reaches the smallest value is that value."""
    low, high = profile.interval(quantile)
    return lower if low is None and float(profile.values[0]) <= lower else low, high
