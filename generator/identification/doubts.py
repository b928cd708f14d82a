"""Doubts about a fit, as sentences."""

from collections.abc import Iterator
from itertools import combinations
from math import degrees, sqrt

import numpy as np

from generator.identification.comparison import RELEASE
from generator.identification.fit import MAX_BIAS, Estimate, Fit
from generator.identification.law_tails import TORQUE_CHANGE, LawTail
from generator.identification.whiteness import SIGNIFICANCE
from generator.rotations import Array

MAX_UNEXPLAINED = 0.5
"""Rms of the residuals over that of the measured angles about their mean, above which a fit
explains hardly any of the motion."""

MAX_CORRELATION = 0.95
"""Correlation of two estimates above which they are named."""

MAX_FRICTION_CORRELATION = 0.8
"""The same of viscous damping and Coulomb friction of a joint."""

MAX_TAIL_CHANGE = 1.0
"""Change of an estimate with the torque of a tail above which it is named [sd]."""

GIVEN_MASSES = (
    "These estimates hold given the masses of the figure: a free swing shows only the ratios of\n"
    "stiffness and damping to mass, so that wrong masses leave the residuals as they are."
)

GIVEN_TORQUES = (
    "The masses follow from the torques that are not fitted, such as damping: a free swing shows\n"
    "only the ratios of stiffness and damping to mass."
)


def fit_doubts(fit: Fit) -> tuple[str, ...]:
    """Return the doubts about a fit, most serious first."""
    return (
        *_motion_doubts(fit),
        *_residual_doubts(fit),
        *_bias_doubts(fit),
        *_correlation_doubts(fit),
        *_bound_doubts(fit),
        *_start_doubts(fit),
        *_tail_doubts(fit),
    )


def _motion_doubts(fit: Fit) -> Iterator[str]:
    """Doubt about a fit whose residuals are as large as the motion."""
    variances = np.array([np.var(column) for column in fit.data.angles.T], dtype=np.float64)
    motion = sqrt(float(np.mean(variances)))
    if fit.tests.rms > MAX_UNEXPLAINED * motion:
        yield (
            "the model explains hardly any of the motion: rms residual "
            f"{degrees(fit.tests.rms):.3g} deg, rms of the measured angles about their mean "
            f"{degrees(motion):.3g} deg"
        )


def _residual_doubts(fit: Fit) -> Iterator[str]:
    tests = fit.tests
    negligible = max(fit.accuracy.tolerance, 0.5 * (fit.options.sd or 0.0))
    if tests.are_autocorrelated and tests.rms > negligible:
        if tests.lag_one > 0.0:
            effect = f"the intervals are too narrow, by a factor of {tests.widening:.1f} or more"
            alike = "alike"
        else:
            effect, alike = "the intervals are wrong", "not independent"
        yield (
            f"successive residuals are {alike} (autocorrelation {tests.lag_one:.2f}): {effect}; "
            "a law is wrong, the release is not from rest, or the noise is not white"
        )
    if tests.misfit is None or fit.options.sd is None:
        return
    ratio = tests.rms / fit.options.sd
    if tests.misfit < SIGNIFICANCE:
        yield (
            f"the residuals are {ratio:.2f} times the stated noise (chi-square "
            f"{tests.chi_square:.4g} for {tests.degrees_of_freedom} degrees of freedom): the model "
            "does not explain the data, or their noise is larger"
        )
    elif tests.misfit > 1.0 - SIGNIFICANCE:
        yield (
            f"the residuals are only {ratio:.2f} times the stated noise, which is too large: "
            "so are the intervals"
        )


def _bias_doubts(fit: Fit) -> Iterator[str]:
    worst = max(fit.estimates, key=lambda one: abs(one.bias))
    if abs(worst.bias) <= MAX_BIAS:
        return
    size = f"{worst.path} is biased by {abs(worst.bias):.1f} of its standard deviations"
    if fit.accuracy.step is not None:
        step = min(fit.accuracy.step, fit.nominal.plan.frame)  # a step ends at each frame
        shorter = step * (MAX_BIAS / abs(worst.bias)) ** 0.5
        yield (
            f"{size} by the step of {step:g} s, which is too long: leave it out, or "
            f"take at most {shorter:.2g} s"
        )
    else:
        hint = "" if fit.options.tolerance is None else ": leave it out, or take a smaller one"
        yield f"{size} by the tolerance of {fit.accuracy.tolerance:g} rad of the runs{hint}"


def _correlation_doubts(fit: Fit) -> Iterator[str]:
    correlations = _correlations_with_known_release(fit)
    for j, k in combinations(range(len(fit.estimates)), 2):
        one, other, value = fit.estimates[j], fit.estimates[k], float(correlations[j, k])
        if one.is_start or other.is_start:
            continue
        pair = f"{one.path} and {other.path}"
        if _is_damping_and_friction(one, other) and abs(value) > MAX_FRICTION_CORRELATION:
            yield (
                f"one swing hardly separates damping from friction: {pair} have the correlation "
                f"{value:.2f}; fit one of them, or measure swings of several amplitudes"
            )
        elif abs(value) > MAX_CORRELATION:
            yield f"{pair} are hardly separated (correlation {value:.3f}): leave out one of them"


def _correlations_with_known_release(fit: Fit) -> Array:
    """Correlations of the estimates, for a known release, shape (p, p).

    A release that is estimated correlates all others, which widens their intervals but confounds
    none of them with another.
    """
    names = [one.path for one in fit.estimates]
    if RELEASE not in names:
        return fit.correlations
    with_release = np.where(
        [name == RELEASE for name in names], 0.0, fit.correlations[names.index(RELEASE)]
    )
    left = np.sqrt(1.0 - with_release**2)
    return (fit.correlations - np.outer(with_release, with_release)) / np.outer(left, left)


def _is_damping_and_friction(one: Estimate, other: Estimate) -> bool:
    words = {path.rpartition(".")[2] for path in (one.path, other.path)}
    return "coulomb_Nm" in words and bool(words & {"viscous_Nms_rad", "damping_scale"})


def _bound_doubts(fit: Fit) -> Iterator[str]:
    for one in fit.estimates:
        if one.at_bound:
            yield (
                f"{one.path} is at its smallest value: use the intervals by profile, since the "
                "standard deviations presume that it may be smaller"
            )


def _start_doubts(fit: Fit) -> Iterator[str]:
    best = sum(one.is_best for one in fit.starts)
    if best < len(fit.starts):
        found = [f"{degrees(one.rms):.3g}" for one in fit.starts if one.rms is not None]
        yield (
            f"{best} of {len(fit.starts)} starts found the least sum of squares (rms "
            f"{', '.join(found)} deg): more may find a lower one, with --starts"
        )


def _tail_doubts(fit: Fit) -> Iterator[str]:
    """Doubts about estimates that follow the law where only one swing came."""
    for tail in fit.tails:
        ratios = {
            one.path: abs(change) / one.sd
            for one, change in zip(fit.estimates, tail.changes, strict=True)
            if not one.is_start and one.sd > 0.0
        }
        moved = [path for path, ratio in ratios.items() if ratio > MAX_TAIL_CHANGE]
        if not moved:
            continue
        worst = max(ratios, key=lambda path: ratios[path])
        verb = "rests" if len(moved) == 1 else "rest"
        yield (
            f"{', '.join(moved)} {verb} on the law of {tail.joint} {_describe_tail(tail)}: "
            f"{100.0 * TORQUE_CHANGE:.0f} % of the torque at its end moves {worst} by "
            f"{ratios[worst]:.2g} sd"
        )


def _describe_tail(tail: LawTail) -> str:
    low, high = sorted((degrees(tail.inner), degrees(tail.end)))
    words = f"between {low + 0.0:.0f} and {high + 0.0:.0f} deg, where"
    if tail.known is None or not tail.is_extrapolated:
        return f"{words} the swing passed once"
    first, last = (degrees(end) + 0.0 for end in tail.known)
    return f"{words} it is extrapolated (known from {first:.0f} to {last:.0f} deg)"
