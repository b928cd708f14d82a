"""Forms of a curve through measured moments, compared by cross-validation.

A form is fitted with blocks of neighbouring angles left out, and its error there compared: of the
forms whose mean square error is within one standard error of the smallest, the one with the fewest
parameters is chosen (Hastie, Tibshirani & Friedman, The Elements of Statistical Learning, 2nd ed.
2009, section 7.10). The two end angles stay in, so that no form is judged by an extrapolation.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from math import degrees, exp, inf, log, radians

import numpy as np

from springs.backends import Array
from springs.cubic import NotRestoringError, polynomial
from springs.elastic import Elastic
from springs.exponential import Exponential, ExponentialTerm
from springs.fit import fit_cubic
from springs.interpolated import Interpolated

MIN_ANGLES = 6
"""Fewest different angles for which forms are compared."""

MAX_FOLDS = 10
"""Most blocks of angles that are left out, one at a time."""

MAX_POINTS = 500
"""Most moments that are fitted; more are averaged in so many groups of neighbours."""

_KNOTS = (3, 4, 5, 6, 8, 10)
"""Numbers of points that are compared, where there are twice as many different angles."""

_ROUNDS = 4
"""Rounds of least squares for the values of points."""

_RATES = (0.1, 20.0)
"""Smallest and largest rate of an exponential, per half of the range of the data."""

_MAX_EXPONENT = 200.0
"""Largest exponent within 200 deg of the angle zero, so that torques stay finite."""


class Form(StrEnum):
    """Form of a fitted curve."""

    CUBIC = "cubic"
    EXPONENTIALS = "exponentials"
    POINTS = "points"


@dataclass(frozen=True)
class FormFit:
    """A form fitted to moments, and how well it predicts those that are left out.

    Attributes:
        form: Form of the curve.
        parameters: Number of fitted parameters.
        law: Law of the torque on the child; None if the form makes none.
        sense: Torque on the child over the measured moment, -1 or +1.
        error: Root mean square error at angles that were left out [N m]; None if it is unknown.
        spread: Standard error of the mean square error [(N m)^2].
        obstacle: Reason why the form cannot be chosen; "" if it can.
    """

    form: Form
    parameters: int
    law: Elastic | None = None
    sense: int = -1
    error: float | None = None
    spread: float = 0.0
    obstacle: str = ""

    def moments(self, angles: Array) -> Array:
        """Return the moments of the law as they are measured, shape as the angles [N m]."""
        assert self.law is not None
        return self.sense * (np.asarray(self.law.torque(angles)) + np.zeros_like(angles))


def fit_forms(angles: Array, moments: Array, *, passive: bool = False) -> list[FormFit]:
    """Return the best fit of each form, cubic, exponentials and points.

    Args:
        angles: Measured angles, at least four different ones, shape (n,) [rad].
        moments: Measured moments, shape (n,) [N m].
        passive: Whether the torque must restore at both ends; then points and exponentials fall
            with the angle.
    """
    if len(angles) > MAX_POINTS:
        order = np.argsort(angles, kind="stable")
        groups = np.array_split(order, MAX_POINTS)
        angles, moments = (np.array([one[k].mean() for k in groups]) for one in (angles, moments))
    distinct = np.unique(angles)
    first, last = polynomial(fit_cubic(angles, moments).coefficients, distinct[[0, -1]]).tolist()
    sense = 1 if last < first else -1

    def fit(form: Form, parameters: int, a: Array, m: Array) -> FormFit:
        match form:
            case Form.CUBIC:
                cubic = fit_cubic(a, m, passive=passive).law
                return FormFit(form, parameters, cubic, cubic.sense)
            case Form.EXPONENTIALS:
                law = _exponentials(a, sense * m, passive)
            case Form.POINTS:
                law = _points(a, sense * m, parameters, passive)
        return FormFit(form, parameters, law, sense)

    def compare(form: Form, parameters: int) -> FormFit:
        try:
            found = fit(form, parameters, angles, moments)
            _require_falling(found, distinct)
            return _with_error(found, partial(fit, form, parameters), angles, moments, distinct)
        except NotRestoringError as failure:
            return FormFit(form, parameters, obstacle=f"it restores in neither sense: {failure}")

    counts = [k for k in _KNOTS if 2 * k <= len(distinct)] or _KNOTS[:1]
    points = [compare(Form.POINTS, knots) for knots in counts]
    best = choose_form(points) or points[-1]
    return [compare(Form.CUBIC, 4), compare(Form.EXPONENTIALS, 5), best]


def _require_falling(fit: FormFit, angles: Array) -> None:
    """Raise NotRestoringError for a torque that is not smaller at the last angle."""
    assert fit.law is not None
    first, last = (float(fit.law.torque(angle)) for angle in angles[[0, -1]])
    if first - last <= 1e-9 * max(abs(first), abs(last)) and fit.form is not Form.CUBIC:
        raise NotRestoringError("the torque is not smaller at the last angle than at the first")


def form_doubts(fit: FormFit, angles: Array) -> list[str]:
    """Return the doubts about the law of a fit of exponentials or points, one sentence each.

    Args:
        fit: Fit with a law.
        angles: Measured angles, shape (n,) [rad].
    """
    assert fit.law is not None
    at = np.linspace(float(angles.min()), float(angles.max()), 361)
    torques = np.asarray(fit.law.torque(at))
    negligible = 1e-9 * float(np.abs(torques).max())
    doubts: list[str] = []
    for place, drive in ((0, -torques[0]), (-1, torques[-1])):
        if drive > negligible:
            end = f"{degrees(at[place]):.4g} deg"
            doubts.append(f"at {end} the torque drives the joint on, with {drive:.3g} N m")
    rising = np.flatnonzero(np.diff(torques) > negligible)
    if len(rising):
        low, high = degrees(at[rising[0]]), degrees(at[rising[-1] + 1])
        doubts.append(
            f"from {low:.4g} to {high:.4g} deg the torque grows with the angle at some angles, a "
            "negative stiffness; --passive permits none"
        )
    return doubts


def choose_form(fits: Sequence[FormFit]) -> FormFit | None:
    """Return the simplest fit whose error is that of the best one within its standard error.

    Without errors the first that can be chosen; None if none can.
    """
    usable = [one for one in fits if one.law is not None and not one.obstacle]
    compared = [one for one in usable if one.error is not None]
    if not compared:
        return next(iter(usable), None)
    best = min(compared, key=_square)
    near = [one for one in compared if _square(one) <= _square(best) + best.spread]
    return min(near, key=lambda one: (one.parameters, _square(one)))


def _square(fit: FormFit) -> float:
    return inf if fit.error is None else fit.error**2


def _with_error(
    found: FormFit,
    fit: Callable[[Array, Array], FormFit],
    angles: Array,
    moments: Array,
    distinct: Array,
) -> FormFit:
    """Return a fit with its error at blocks of inner angles that are left out in turn."""
    if len(distinct) < MIN_ANGLES:
        return found
    inner = distinct[1:-1]
    squares: list[float] = []
    for block in np.array_split(inner, min(MAX_FOLDS, len(inner))):
        out = (angles >= block[0]) & (angles <= block[-1])
        law = fit(angles[~out], moments[~out])
        squares.append(float(np.mean((moments[out] - law.moments(angles[out])) ** 2)))
    spread = float(np.std(squares, ddof=1)) / len(squares) ** 0.5
    return replace(found, error=float(np.mean(squares)) ** 0.5, spread=spread)


def _points(angles: Array, torques: Array, count: int, passive: bool) -> Interpolated:
    """Return the nearest curve through points at measured angles, both ends among them.

    The curve is homogeneous of degree 1 in its values, so that it is its Jacobian times them: least
    squares with the Jacobian of the last values, a few times from straight lines on, approach it.
    """
    from scipy.optimize import nnls

    distinct = np.unique(angles)
    count = min(count, len(distinct))
    knots = distinct[np.round(np.linspace(0, len(distinct) - 1, count)).astype(int)]
    # Falling values, of which the first is not negative and the last not positive, are sums of
    # steps down to zero and of steps down from it.
    down = np.triu(np.ones((count, count)))
    basis = np.hstack([down[:, :-1], -down.T[:, 1:]]) if passive else np.eye(count)
    step = 1e-6 * max(float(np.abs(torques).max()), np.finfo(float).tiny)

    def law(values: Array) -> Interpolated:
        return Interpolated(tuple(zip(knots.tolist(), values.tolist(), strict=True)))

    def at_angles(values: Array) -> Array:
        return np.asarray(law(values).torque(angles))

    design = np.column_stack([np.interp(angles, knots, row) for row in np.eye(count)])
    tried: list[Array] = []
    for _ in range(_ROUNDS):
        bound = design @ basis
        found = nnls(bound, torques)[0] if passive else np.linalg.lstsq(bound, torques)[0]
        tried.append(basis @ found)
        here = at_angles(tried[-1])
        moved = [(at_angles(tried[-1] + step * row) - here) / step for row in np.eye(count)]
        design = np.column_stack(moved)
    best = min(tried, key=lambda values: float(np.sum((at_angles(values) - torques) ** 2)))
    # Without the rounding of conversions, which a file would show.
    pairs = zip(np.degrees(knots).tolist(), best.tolist(), strict=True)
    return Interpolated(tuple((radians(round(a, 9)), float(f"{t:.9g}")) for a, t in pairs))


def _exponentials(angles: Array, torques: Array, passive: bool) -> Exponential:
    """Return the nearest sum of a falling exponential of either end and a constant.

    For given rates the amplitudes are those of non-negative least squares; the rates are searched
    on a grid and from its best place on.
    """
    from scipy.optimize import minimize, nnls

    low, high = float(angles.min()), float(angles.max())
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    x = (angles - middle) / half
    ones = np.ones_like(x)

    def shifts(below: float, above: float) -> Array:
        """Return the constants of the columns, shape (4,).

        Those of a torque that restores at both ends let an exponential vanish at either of them.
        """
        far = -exp(-2.0 * below), exp(-2.0 * above)
        return np.array([far[0], -1.0, far[1], 1.0] if passive else [0.0, 0.0, 1.0, -1.0])

    def columns(rates: Iterable[float]) -> Array:
        below, above = rates
        first, last = np.exp(-below * (x + 1.0)), -np.exp(above * (x - 1.0))
        parts = (first, first, last, last) if passive else (first, last, 0.0 * x, 0.0 * x)
        return np.column_stack(parts) + np.outer(ones, shifts(below, above))

    largest = min(_RATES[1], _MAX_EXPONENT * half / (radians(200.0) + abs(middle)))
    ends = log(_RATES[0]), log(largest)

    def distance(logarithms: Array) -> float:
        return float(nnls(columns(np.exp(np.clip(logarithms, *ends))), torques)[1])

    grid = np.linspace(*ends, 10)
    best = min(((p, q) for p in grid for q in grid), key=lambda one: distance(np.array(one)))
    found = minimize(distance, np.array(best), method="Nelder-Mead", options={"xatol": 1e-6})
    below, above = np.exp(np.clip(found.x, *ends)).tolist()
    amplitudes = nnls(columns((below, above)), torques)[0]
    constant = float(amplitudes @ shifts(below, above))
    pairs = amplitudes.reshape(2, 2).sum(axis=1) if passive else amplitudes[:2]
    first, last = pairs.tolist()
    terms = (
        ExponentialTerm(first * exp(-below * (1.0 - middle / half)), -below / half),
        ExponentialTerm(-last * exp(-above * (1.0 + middle / half)), above / half),
    )
    kept = tuple(term for term in terms if term.amplitude != 0.0)
    if not kept:
        raise NotRestoringError("the moments do not change with the angle")
    return Exponential(kept, constant, (low, high))
