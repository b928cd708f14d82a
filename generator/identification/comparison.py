"""Simulated angles of a case at the times of measured ones, and their derivatives."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import ceil, exp, inf, log

import numpy as np

from generator.diagnostics import MoverError
from generator.figure import Figure
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


class FailedRunError(MoverError):
    """A run failed at values from which a fit cannot go on."""


@dataclass(frozen=True)
class Unknown:
    """A quantity that is fitted.

    Attributes:
        path: of the quantity.
        nominal: value from which the fit starts, in the unit of the path.
        lower: smallest value.
        size: typical change.
        factor: by which starts of a fit differ from the nominal value; None where they differ by
            the size.
        is_start: whether it is the start angle of a measured joint, estimated beside the others.
    """

    path: ParameterPath
    nominal: float
    lower: float
    size: float
    factor: float | None
    is_start: bool = False

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


def make_unknown(path: ParameterPath, case: Case, start_angle: float | None = None) -> Unknown:
    """Return the unknown of a path, with its range.

    Args:
        path: of the quantity.
        case: with its nominal value.
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

    Attributes:
        case: figure and plan, before the unknowns change them.
        data: measured angles.
        unknowns: what is fitted.
        runs: number of runs so far.
        failed_runs: those of them that did not reach the last sample.
        failure: sentence about the first of these; "" without one.
    """

    def __init__(
        self,
        case: Case,
        data: MeasuredAngles,
        unknowns: Sequence[Unknown],
        watch: Callable[[], None] | None = None,
    ) -> None:
        """Prepare the comparison; `watch` is called before each run."""
        plan = replace(
            case.plan,
            start=float(data.times[0]),
            stop=float(data.times[-1]),
            frame=_frame_interval(data.times),
        )
        self.case, self.data, self.unknowns = Case(case.figure, plan), data, tuple(unknowns)
        self.runs = self.failed_runs = 0
        self.failure = ""
        self._watch, self._longest_run = watch, 0.0

    @property
    def lower_bounds(self) -> Array:
        """Smallest values of the unknowns, shape (p,)."""
        return np.array([one.lower for one in self.unknowns])

    def case_at(self, values: Array, mass_factor: float = 1.0) -> Case:
        """Return the case with values of the unknowns, and masses and inertias times a factor."""
        assignments = [
            (one.path, float(value)) for one, value in zip(self.unknowns, values, strict=True)
        ]
        case = apply_values(self.case, assignments)
        if mass_factor != 1.0:
            case = replace(case, figure=_scale_masses(case.figure, mass_factor))
        return case

    def residuals(self, values: Array, accuracy: Accuracy, mass_factor: float = 1.0) -> Array:
        """Simulated less measured angles, shape (n * k,) [rad].

        Samples that a failed run does not reach differ by `FAILED_RUN_ERROR`.
        """
        return self._run(values, accuracy, mass_factor)[0]

    def _run(
        self, values: Array, accuracy: Accuracy, mass_factor: float = 1.0
    ) -> tuple[Array, bool]:
        """Residuals, and whether the run reached all samples."""
        differences, failure = self._differences(values, accuracy, mass_factor)
        if failure is not None:
            self.failed_runs += 1
            self.failure = self.failure or failure
        return differences, failure is None

    def _differences(
        self, values: Array, accuracy: Accuracy, mass_factor: float
    ) -> tuple[Array, str | None]:
        """Residuals, and the sentence about a failed run."""
        from scipy.interpolate import CubicHermiteSpline

        from generator.simulation.run import simulate  # the import of Exudyn is slow

        if self._watch is not None:
            self._watch()
        self.runs += 1
        differences = np.full(self.data.angles.shape, FAILED_RUN_ERROR)
        try:
            case = self.case_at(values, mass_factor)
            plan = replace(
                case.plan,
                tolerance=accuracy.tolerance,
                step=accuracy.step,
                wall_limit=min(case.plan.wall_limit, self._wall_limit),
            )
            recording = simulate(case.figure, plan, record={RecordingPart.VELOCITIES})
        except MoverError as failure:
            return differences.ravel(), str(failure)
        times = self.data.times
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
        return max(MIN_WALL_LIMIT, WALL_LIMIT_FACTOR * self._longest_run)

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
            values: of the unknowns.
            accuracy: of the runs.
            steps: of the difference quotients.
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
                differences, is_complete = self._run(moved, accuracy)
                if is_complete:
                    sides.append((sign * float(step), differences))
            if len(sides) == 1:
                middle = at_values
                if middle is None:
                    middle = self.residuals(values, accuracy)
                sides.append((0.0, middle))
            if not sides:
                raise FailedRunError(f"the runs beside {unknown.path} = {values[j]:.4g} fail")
            (far, there), (near, here) = sides
            columns.append((there - here) / (far - near))
        return np.stack(columns, axis=1)

    def mass_derivative(self, values: Array, accuracy: Accuracy) -> Array:
        """Derivative of the residuals by a common factor of all masses, shape (n * k,) [rad]."""
        above, below = (
            self.residuals(values, accuracy, 1.0 + sign * _MASS_STEP) for sign in (1.0, -1.0)
        )
        return (above - below) / (2.0 * _MASS_STEP)

    def difference_steps(self, jacobian: Array | None = None) -> Array:
        """Steps of difference quotients, shape (p,): those that change the angles by `RESPONSE`.

        Args:
            jacobian: at values near by; None for a small share of the typical changes.
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


def _scale_masses(figure: Figure, factor: float) -> Figure:
    """Return the figure with all masses and inertias times a factor."""
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
        for name, segment in figure.segments.items()
    }
    return replace(figure, segments=segments)
