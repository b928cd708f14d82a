"""Simulated angles of a case at the times of measured ones, and their derivatives."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import ceil, exp, inf, log

import numpy as np

from generator.diagnostics import MoverError
from generator.identification.measured_angles import MeasuredAngles
from generator.recording import Ending, RecordingPart
from generator.rotations import Array
from generator.study.parameter_paths import Case, ParameterPath, Quantity
from generator.study.parameters import apply_values, nominal_value

MIN_FRAME, MAX_FRAME = 0.002, 0.02
"""Interval between the frames that are interpolated to the times of the samples [s]."""

FAILED_RUN_ERROR = 2.0 * np.pi
"""Difference of the samples that a failed run does not reach [rad]."""

RESPONSE = 1e-3
"""Root mean square of the change of the angles over a step of a difference quotient [rad]."""

MIN_WALL_LIMIT, WALL_LIMIT_FACTOR = 10.0, 20.0
"""Limit of the computing time of a run: this [s], or this times the longest run so far. At values
far from any body's a run may need a million steps."""

_MASS_STEP = 2e-3
"""Relative step of the masses in a difference quotient."""


RELEASE = "release"
"""Name of the time of the release among the unknowns."""


class FailedRunError(MoverError):
    """A run failed at values from which a fit cannot go on."""


class WallLimitReachedError(MoverError):
    """The computing time of a fit is used up."""


@dataclass(frozen=True)
class Unknown:
    """A quantity that is fitted.

    Attributes:
        path: Path of the quantity; None for the time of release [s], counted from the first sample.
        nominal: value from which the fit starts, in its unit.
        lower: smallest value.
        size: typical change.
        factor: factor by which starts of a fit differ from the nominal value; None where they
            differ by the size.
        is_start: whether it is the release, or the start angle of a measured joint, which are
            estimated beside the others.
    """

    path: ParameterPath | None
    nominal: float
    lower: float
    size: float
    factor: float | None
    is_start: bool = False

    @property
    def name(self) -> str:
        """Path as written, or `RELEASE`."""
        return RELEASE if self.path is None else str(self.path)

    @property
    def unit(self) -> str:
        """Unit of the values; "" for a factor."""
        return "s" if self.path is None else self.path.unit

    def has_quantity(self, *quantities: Quantity) -> bool:
        """Return whether it is one of some kinds of quantities."""
        return self.path is not None and self.path.quantity in quantities

    def spread(self, quantile: float) -> float:
        """Value of a start of the fit for a number from 0 to 1."""
        away = 2.0 * quantile - 1.0
        if self.factor is None:
            return self.nominal + away * self.size
        middle = self.nominal if self.nominal > 0.0 else self.size
        return middle * exp(away * log(self.factor))


_SCALES = (
    Quantity.SCALE,
    Quantity.COUPLED_SCALE,
    Quantity.DAMPING_SCALE,
    Quantity.MASS,
    Quantity.MASS_SCALE,
    Quantity.INERTIA_SCALE,
)
_RESISTANCES = (Quantity.VISCOUS, Quantity.COULOMB)
_SHIFTS = (Quantity.OFFSET, Quantity.POSE, Quantity.VELOCITY)

_SHIFT, _MEASURED_SHIFT = 10.0, 2.0
"""Typical changes of offsets and start angles, and of start angles that are measured [deg]."""


def unknown_release(time: float, interval: float) -> Unknown:
    """Return the time of the release as an unknown [s].

    Args:
        time: estimate of it, from the first sample.
        interval: Interval between samples [s].
    """
    return Unknown(None, time, -inf, 2.0 * interval, None, is_start=True)


def make_unknown(path: ParameterPath, case: Case, start_angle: float | None = None) -> Unknown:
    """Return the unknown of a path, with its range.

    Args:
        path: path of the quantity.
        case: case with its nominal value.
        start_angle: measured value of a start angle [deg]; None for other quantities.
    """
    if start_angle is not None:
        return Unknown(path, start_angle, -inf, _MEASURED_SHIFT, None, is_start=True)
    nominal = nominal_value(path, case)
    if path.quantity in _SCALES:
        return Unknown(path, nominal, 1e-3 * nominal, 0.1 * nominal, 3.0)
    if path.quantity in _RESISTANCES:
        return Unknown(path, nominal, 0.0, max(0.1 * nominal, 0.05), 5.0)
    if path.quantity in _SHIFTS:
        return Unknown(path, nominal, -inf, _SHIFT, None)
    return Unknown(path, nominal, 0.0 if nominal > 0.0 else -inf, 0.1 * abs(nominal) or 0.1, None)


@dataclass(frozen=True)
class Accuracy:
    """Accuracy of the runs of a fit.

    Attributes:
        tolerance: joint-angle error tolerance [rad]; ignored with a fixed step.
        step: fixed step [s]; None for control of the error.
    """

    tolerance: float
    step: float | None = None


class Comparison:
    """Differences of simulated and measured angles, as functions of the unknowns.

    A motion from rest without loads and drives, which depends on the time since its release only,
    is simulated from the time 0, whatever the epoch of the samples. Before the release the joints
    are at their start angles.

    Attributes:
        case: figure and plan, before the unknowns change them.
        data: measured angles.
        unknowns: what is fitted.
        origin: time from which that of the release counts [s].
        runs: number of runs so far.
        failed_runs: those of them that did not reach the last sample.
        failure: sentence about the first of these; "" without one.
        best: least sum of squares so far, and its values; None before the first complete run.
    """

    def __init__(
        self,
        case: Case,
        data: MeasuredAngles,
        unknowns: Sequence[Unknown],
        watch: Callable[[], None] | None = None,
        *,
        release: float | None = None,
        deadline: float = inf,
    ) -> None:
        """Prepare the comparison.

        Args:
            case: figure and plan.
            data: measured angles.
            unknowns: what is fitted.
            watch: called before each run.
            release: time of it, unless it is an unknown [s]; None for the first sample.
            deadline: `time.monotonic` after which no run starts [s].
        """
        first, last = float(data.times[0]), float(data.times[-1])
        depends_on_time = bool(case.plan.drives or case.plan.loads)
        self.origin = 0.0 if depends_on_time else first
        self._release = (first if release is None else release) - self.origin
        start = self._release if depends_on_time else 0.0
        plan = replace(
            case.plan,
            start=start,
            stop=start + last - self.origin - self._release,
            frame=_frame_interval(data.times),
        )
        self.case, self.data, self.unknowns = Case(case.model, plan), data, tuple(unknowns)
        self.runs = self.failed_runs = 0
        self.failure = ""
        self.best: tuple[float, Array] | None = None
        self._watch, self._longest_run, self._deadline = watch, 0.0, deadline

    @property
    def lower_bounds(self) -> Array:
        """Smallest values of the unknowns, shape (p,)."""
        return np.array([one.lower for one in self.unknowns])

    def in_time_of_data(self, values: Array) -> Array:
        """Return values of the unknowns, with the release in the time of the samples [s]."""
        return values + np.array(
            [self.origin if one.path is None else 0.0 for one in self.unknowns]
        )

    def release(self, values: Array) -> float:
        """Time of the release at values of the unknowns, counted from the origin [s]."""
        pairs = zip(self.unknowns, values, strict=True)
        return next((float(value) for one, value in pairs if one.path is None), self._release)

    def case_at(self, values: Array) -> Case:
        """Return the case with values of the unknowns; its run lasts to the last sample."""
        assignments = [
            (one.path, float(value))
            for one, value in zip(self.unknowns, values, strict=True)
            if one.path is not None
        ]
        case = apply_values(self.case, assignments)
        if len(assignments) == len(self.unknowns):
            return case
        # Whole frames: a small change of the release leaves the frames where they are.
        plan = case.plan
        duration = float(self.data.times[-1]) - self.origin - self.release(values)
        frames = max(1, ceil(duration / plan.frame - 1e-9))
        return replace(case, plan=replace(plan, stop=plan.start + frames * plan.frame))

    def residuals(
        self,
        values: Array,
        accuracy: Accuracy,
        change: Callable[[Case], Case] | None = None,
    ) -> Array:
        """Simulated less measured angles, shape (n * k,) [rad].

        Samples that a failed run does not reach differ by `FAILED_RUN_ERROR`.

        Args:
            values: Values of the unknowns.
            accuracy: Accuracy of the run.
            change: Change of the case at these values; None leaves it as it is.

        Raises WallLimitReachedError.
        """
        return self.run(values, accuracy, change)[0]

    def run(
        self,
        values: Array,
        accuracy: Accuracy,
        change: Callable[[Case], Case] | None = None,
    ) -> tuple[Array, bool]:
        """Return what `residuals` does, and whether the run reached all samples."""
        self._require_time()
        differences, failure = self._differences(values, accuracy, change)
        if failure is not None:
            self._require_time()  # a run that the limit has cut has not failed
            self.failed_runs += 1
            self.failure = self.failure or failure
        elif change is None:
            squares = float(np.sum(differences**2))
            if self.best is None or squares < self.best[0]:
                self.best = squares, values.copy()
        return differences, failure is None

    def _require_time(self) -> None:
        if time.monotonic() >= self._deadline:
            raise WallLimitReachedError("the wall-time limit was reached")

    def _differences(
        self, values: Array, accuracy: Accuracy, change: Callable[[Case], Case] | None
    ) -> tuple[Array, str | None]:
        """Residuals, and the sentence about a failed run."""
        from scipy.interpolate import CubicHermiteSpline

        from generator.simulation.run import simulate  # the import of Exudyn is slow

        if self._watch is not None:
            self._watch()
        self.runs += 1
        differences = np.full(self.data.angles.shape, FAILED_RUN_ERROR)
        start, release = self.case.plan.start, self.release(values)
        times = np.maximum(start, self.data.times - self.origin - release + start)
        span = float(self.data.times[-1] - self.data.times[0])
        if not start < times[-1] <= start + 2.0 * span:
            return differences.ravel(), f"a release at {release + self.origin:g} s is too far away"
        try:
            case = self.case_at(values)
            case = case if change is None else change(case)
            plan = replace(
                case.plan,
                tolerance=accuracy.tolerance,
                step=accuracy.step,
                wall_limit=min(case.plan.wall_limit, self._wall_limit),
            )
            recording = simulate(case.model, plan, record={RecordingPart.VELOCITIES})
        except MoverError as failure:
            return differences.ravel(), str(failure)
        reached = times <= recording.times[-1] + 1e-9
        if len(recording.times) > 1:
            for k, (joint, coordinate) in enumerate(self.data.columns):
                curve = CubicHermiteSpline(
                    recording.times,
                    recording.displacements[joint][:, coordinate],
                    recording.velocities[joint][:, coordinate],
                )
                measured = self.data.angles[reached, k]
                differences[reached, k] = curve(times[reached]) - measured
        differences[~np.isfinite(differences)] = FAILED_RUN_ERROR
        if recording.outcome.succeeded:
            self._longest_run = max(self._longest_run, recording.wall_time)
        has_failed = recording.outcome.ending is not Ending.DONE or not bool(reached.all())
        return differences.ravel(), recording.outcome.message if has_failed else None

    @property
    def _wall_limit(self) -> float:
        """Limit of the computing time of the next run [s]."""
        left = max(self._deadline - time.monotonic(), 1e-3)
        return min(left, max(MIN_WALL_LIMIT, WALL_LIMIT_FACTOR * self._longest_run))

    def jacobian(
        self,
        values: Array,
        accuracy: Accuracy,
        steps: Array,
        at_values: Array | None = None,
    ) -> Array:
        """Derivatives of the residuals, shape (n * k, p) [rad per unit].

        Differences are central, or forward if the residuals at the values are stated; and to one
        side where the other is beyond a bound or fails.

        Args:
            values: Values of the unknowns.
            accuracy: accuracy of the runs.
            steps: steps of the difference quotients.
            at_values: residuals there, for forward differences.

        Raises:
            FailedRunError: the runs on both sides fail.
        """
        columns: list[Array] = []
        for j, (step, unknown) in enumerate(zip(steps, self.unknowns, strict=True)):
            sides: list[tuple[float, Array]] = []
            for sign in (1.0, -1.0):
                moved = values.copy()
                moved[j] += sign * step
                if moved[j] < unknown.lower or (len(sides) == 1 and at_values is not None):
                    continue
                differences, is_complete = self.run(moved, accuracy)
                if is_complete:
                    sides.append((sign * float(step), differences))
            if len(sides) == 1:
                middle = at_values
                if middle is None:
                    middle = self.residuals(values, accuracy)
                sides.append((0.0, middle))
            if not sides:
                raise FailedRunError(f"the runs beside {unknown.name} = {values[j]:.4g} fail")
            (far, there), (near, here) = sides
            columns.append((there - here) / (far - near))
        return np.stack(columns, axis=1)

    def mass_derivative(self, values: Array, accuracy: Accuracy) -> Array:
        """Derivative of the residuals by a common factor of all masses, shape (n * k,) [rad]."""
        above, below = (
            self.residuals(values, accuracy, partial(_scale_masses, factor=1.0 + sign * _MASS_STEP))
            for sign in (1.0, -1.0)
        )
        return (above - below) / (2.0 * _MASS_STEP)

    def difference_steps(self, jacobian: Array | None = None) -> Array:
        """Steps of difference quotients, shape (p,): those that change the angles by `RESPONSE`.

        Args:
            jacobian: jacobian at values near by; None for a small share of the typical changes.
        """
        sizes = np.array([one.size for one in self.unknowns])
        if jacobian is None:
            return 1e-2 * sizes
        response = np.sqrt(np.mean(jacobian**2, axis=0))
        with np.errstate(divide="ignore"):
            return np.clip(RESPONSE / response, 1e-7 * sizes, 0.3 * sizes)


def _frame_interval(times: Array) -> float:
    """Interval between frames [s]: that of the samples or a part of it, so that many coincide."""
    interval = float(np.median(np.diff(times)))
    if interval < MIN_FRAME:
        interval *= ceil(MIN_FRAME / interval)
    interval /= ceil(interval / MAX_FRAME - 1e-9)
    return min(interval, float(times[-1] - times[0]))


def _scale_masses(case: Case, factor: float) -> Case:
    """Return the case with all masses and inertias times a factor."""
    segments = {
        name: segment
        if segment.mass is None or segment.has_ground_mass
        else replace(
            segment,
            mass=factor * segment.mass,
            inertia=None
            if segment.inertia is None
            else (
                factor * segment.inertia[0],
                factor * segment.inertia[1],
                factor * segment.inertia[2],
            ),
        )
        for name, segment in case.figure.segments.items()
    }
    return case.with_figure(replace(case.figure, segments=segments))
