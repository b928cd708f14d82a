"""The passive torques of a `.bioMod` file: a line or two exponentials for each displacement.

biorbd's exponential torque is

    (b1 exp(k1 (q - m)) + b2 exp(k2 (q - m))) (q - d) + t

without its factor of the rate. A law of another form is approximated by weighted least squares over
the range of the joint and a little beyond.

The springs of several rotations depend on all of them. Each displacement gets the torque of a
rotation about its axis alone; their sum differs from the law in between.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, product
from typing import cast

import numpy as np
from scipy.optimize import least_squares

from generator.figure import Joint
from generator.model_files.export_model import JointLaws
from generator.model_files.fit_error import FitError, orientation_error, within_half_turns
from generator.passive_curve import rotation_vector
from generator.rotations import Array, matrix_from_rotation_vector
from springs import AxisSpring, Linear, total_torque
from springs.elastic import Range

COUPLING_LOSS = "springs of several rotations, approximated by a sum of torques about single axes"

TYPICAL_TORQUE = 20.0
"""Torque beyond which the relative error of a fit counts [N m or N]."""

NEGLIGIBLE_TORQUE = 1e-9
"""Torque or error that is nothing [N m or N]."""

_SAMPLES_OF_ONE_ANGLE = 181


@dataclass(frozen=True, eq=False)
class SampledTorque:
    """The torque of springs about one displacement, the others of its joint at zero.

    Attributes:
        displacements: throughout a range, shape (n,) [rad or m].
        torques: shape (n,) [N m or N].
        range: range of the displacement.
        unit: unit of the torques.
    """

    displacements: Array
    torques: Array
    range: Range
    unit: str = "N m"

    @cached_property
    def weights(self) -> Array:
        """Weights of the differences: a stiff end of the range does not spoil the rest."""
        return 1.0 / (1.0 + np.abs(self.torques) / TYPICAL_TORQUE)

    @property
    def is_negligible(self) -> bool:
        """True without a torque."""
        return bool(np.abs(self.torques).max() < NEGLIGIBLE_TORQUE)

    def error_of(self, torque: Callable[[Array], Array]) -> FitError:
        """Return the error of another torque."""
        return FitError.from_differences(torque(self.displacements) - self.torques, self.unit)

    def misfit_of(self, torque: Callable[[Array], Array]) -> float:
        """Return the weighted sum of the squared errors of another torque."""
        return float(np.sum((self.weights * (torque(self.displacements) - self.torques)) ** 2))

    def solve(self, columns: Array) -> Array:
        """Return factors of columns whose sum is nearest to the torques, shape (n, m) to (m,)."""
        weighted = columns * self.weights[:, None]
        sizes = np.linalg.norm(weighted, axis=0)
        sizes[sizes == 0.0] = 1.0
        target = self.torques * self.weights
        solution = cast("Array", np.linalg.lstsq(weighted / sizes, target, rcond=1e-10)[0])
        return solution / sizes


def sampled_torques(
    joint: Joint, laws: JointLaws, ranges: tuple[Range, ...]
) -> dict[int, SampledTorque]:
    """Return the torques about the displacements that have springs, by index in the chain.

    Args:
        joint: the joint.
        laws: its springs.
        ranges: ranges of the displacements [rad or m].
    """
    found: dict[int, SampledTorque] = {}
    for k, spring in laws.uncoupled.items():
        x = np.linspace(*ranges[k], _SAMPLES_OF_ONE_ANGLE)
        torques = np.asarray(total_torque(spring.elastic, x)) + np.zeros_like(x)
        found[k] = SampledTorque(x, torques, ranges[k], joint.chain[k].units.effort)
    if any(axis.elastic for axis in laws.combined):
        for k in laws.chain.rotations:
            ends = within_half_turns(ranges[k])
            x = np.linspace(*ends, _SAMPLES_OF_ONE_ANGLE)
            alone = np.zeros((len(x), len(joint.chain)))
            alone[:, k] = x
            torques = generalized_torques(laws, alone)[:, k]
            found[k] = SampledTorque(x, torques, ends)
    return {k: one for k, one in found.items() if not one.is_negligible}


def coupling_error(
    laws: JointLaws, ranges: tuple[Range, ...], torques: Mapping[int, Callable[[Array], Array]]
) -> FitError | None:
    """Return the error of torques of single displacements at orientations throughout the ranges.

    None for a joint without springs of several rotations.

    Args:
        laws: springs of the joint.
        ranges: ranges of the displacements [rad or m].
        torques: torques by index in the chain, functions of the displacement; zero for others.
    """
    if not any(axis.elastic for axis in laws.combined):
        return None
    turns = laws.chain.rotations

    def differences(displacements: Array) -> Array:
        found = -generalized_torques(laws, displacements)
        for k in turns:
            if k in torques:
                found[:, k] += torques[k](displacements[:, k])
        return found[:, list(turns)]

    error = orientation_error(differences, laws.chain, ranges)
    return None if error.largest < NEGLIGIBLE_TORQUE else error


def generalized_torques(laws: JointLaws, displacements: Array) -> Array:
    """Generalized torques of the springs of several rotations, shape (n, factors) [N m].

    Args:
        laws: springs of the joint.
        displacements: displacements of the chain, shape (n, factors) [rad or m].
    """
    vectors = rotation_vector(laws.chain, displacements)
    half_way = np.asarray(laws.of_vector.torque(vectors))
    torques = np.einsum("nij,nj->ni", matrix_from_rotation_vector(0.5 * vectors), half_way)
    return np.einsum("nki,ni->nk", laws.chain.twists(displacements)[..., :3], torques)


_RATES = (0.7, 2.0, 5.0, 12.0, 30.0)
"""Sizes of the rates from which the fit starts, times half of the range."""

_ZEROS = (-0.9, -0.5, 0.0, 0.5, 0.9)
"""Zeros of the factor q - d from which the fit starts, relative to half of the range."""

_ANGLE_MARGIN, _DISTANCE_MARGIN = np.radians(10.0), 0.01
"""Distances beyond the range to which laws are fitted, so that torques hold a joint at its ends
[rad, m]."""

_LARGEST_RATE = 120.0
"""Bound of the rates, times half of the range."""

_STARTS = 3
"""Number of starts from which the fit is refined."""


@dataclass(frozen=True)
class LinearTorque:
    """The torque `at_zero + slope q` [N m or N]."""

    at_zero: float
    slope: float

    def torque(self, q: Array) -> Array:
        """Torque at displacements, shape (n,) [N m or N]."""
        return self.at_zero + self.slope * q

    @property
    def tags(self) -> dict[str, float]:
        """The numbers of the format by tag."""
        return {"t0": self.at_zero, "slope": self.slope}


@dataclass(frozen=True)
class ExponentialTorque:
    """Two exponentials times the distance from an angle, and a constant.

    Attributes:
        amplitudes: b1 and b2 [N m/rad].
        rates: k1 and k2 [1/rad].
        middle: m [rad].
        zero: d [rad].
        constant: t [N m].
    """

    amplitudes: tuple[float, float]
    rates: tuple[float, float]
    middle: float
    zero: float
    constant: float

    def torque(self, q: Array) -> Array:
        """Torque at displacements, shape (n,) [N m or N]."""
        terms = [
            amplitude * np.exp(rate * (q - self.middle))
            for amplitude, rate in zip(self.amplitudes, self.rates, strict=True)
        ]
        return (terms[0] + terms[1]) * (q - self.zero) + self.constant

    @property
    def tags(self) -> dict[str, float]:
        """The numbers of the format by tag; the rate of the joint does not count."""
        return {
            "k1": self.rates[0],
            "k2": self.rates[1],
            "b1": self.amplitudes[0],
            "b2": self.amplitudes[1],
            "qmid": self.middle,
            "deltap": self.zero,
            "taueq": self.constant,
            "wmax": 1.0,
            "pbeta": 0.0,
        }


PassiveTorque = LinearTorque | ExponentialTorque


@dataclass(frozen=True)
class FittedTorque:
    """The passive torque of a displacement.

    Attributes:
        torque: torque as the format holds it.
        error: error of the approximation over `range`, the other rotations at zero; None without
            one.
        range: range in which it was fitted [rad or m].
    """

    torque: PassiveTorque
    error: FitError | None
    range: Range


@dataclass(frozen=True)
class JointTorques:
    """The passive torques of a joint.

    Attributes:
        fitted: fitted by index in the chain.
        coupling_error: coupling error of several rotations, at orientations throughout their
            ranges; else None.
    """

    fitted: dict[int, FittedTorque]
    coupling_error: FitError | None


def passive_torques(joint: Joint, laws: JointLaws, ranges: tuple[Range, ...]) -> JointTorques:
    """Return the passive torques of a joint's displacements.

    Args:
        joint: the joint.
        laws: its springs.
        ranges: ranges of the displacements, over which laws are fitted [rad or m].
    """
    fitted: dict[int, FittedTorque] = {}
    margins = [_ANGLE_MARGIN if one.units.is_angle else _DISTANCE_MARGIN for one in joint.chain]
    ends = [(low - by, high + by) for (low, high), by in zip(ranges, margins, strict=True)]
    wider = sampled_torques(joint, laws, tuple(ends))
    for k, sampled in sampled_torques(joint, laws, ranges).items():
        exact = _linear_law(laws.uncoupled[k]) if k in laws.uncoupled else None
        if exact is None:
            fitted[k] = _fit(wider[k], sampled)
        else:
            fitted[k] = FittedTorque(exact, None, ranges[k])
    torques = {k: one.torque.torque for k, one in fitted.items()}
    return JointTorques(fitted, coupling_error(laws, ranges, torques))


def _linear_law(spring: AxisSpring) -> LinearTorque | None:
    """Return the law of a spring where it is linear, else None."""
    linear = [law for law in spring.elastic if isinstance(law, Linear)]
    if len(linear) < len(spring.elastic):
        return None
    slope = -sum(law.stiffness for law in linear)
    return LinearTorque(sum(law.stiffness * law.rest for law in linear), slope)


def _fit(sampled: SampledTorque, in_range: SampledTorque) -> FittedTorque:
    """Return the best torque of the format for samples of a displacement.

    Its error is that in the range, without the margins.
    """
    x = sampled.displacements
    at_zero, slope = sampled.solve(np.stack([np.ones_like(x), x], axis=1)).tolist()
    best: PassiveTorque = LinearTorque(at_zero, slope)
    if sampled.range[1] > sampled.range[0]:
        curve = _fit_exponentials(sampled)
        if sampled.misfit_of(curve.torque) < 0.99 * sampled.misfit_of(best.torque):
            best = curve
    error = in_range.error_of(best.torque)
    return FittedTorque(best, None if error.largest < NEGLIGIBLE_TORQUE else error, in_range.range)


def _fit_exponentials(sampled: SampledTorque) -> ExponentialTorque:
    """Fit rates and the zero, for each of which the amplitudes and the constant are linear."""
    low, high = sampled.range
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    x = (sampled.displacements - middle) / half
    weights = sampled.weights

    def residual(shape: Array) -> Array:
        columns, _ = _columns(shape, x)
        return weights * (columns @ _solve_restoring(columns, sampled) - sampled.torques)

    def misfit(shape: Array) -> float:
        return float(np.sum(residual(shape) ** 2))

    rates = [sign * rate for rate in _RATES for sign in (1.0, -1.0)]
    starts = [np.array([*pair, zero]) for pair, zero in product(combinations(rates, 2), _ZEROS)]
    starts.sort(key=misfit)
    bounds = ([-_LARGEST_RATE, -_LARGEST_RATE, -3.0], [_LARGEST_RATE, _LARGEST_RATE, 3.0])
    fits = [
        cast("Array", least_squares(residual, start, bounds=bounds, x_scale=(5.0, 5.0, 0.3)).x)
        for start in starts[:_STARTS]
    ]
    best = min(fits, key=misfit)
    first, second, zero = best.tolist()
    columns, scales = _columns(best, x)
    b1, b2, constant = (_solve_restoring(columns, sampled) * scales).tolist()
    return ExponentialTorque(
        (b1 / half, b2 / half),
        (first / half, second / half),
        middle,
        middle + half * zero,
        constant,
    )


def _columns(shape: Array, x: Array) -> tuple[Array, Array]:
    """Return the columns of the amplitudes and the constant, and the factors of the amplitudes."""
    first, second, zero = shape.tolist()
    columns = [np.exp(rate * x - abs(rate)) * (x - zero) for rate in (first, second)]
    scales = np.exp([-abs(first), -abs(second), 0.0])
    return np.stack([*columns, np.ones_like(x)], axis=1), scales


def _solve_restoring(columns: Array, sampled: SampledTorque) -> Array:
    """Return the least-squares amplitudes and constant with amplitudes that are not positive.

    Otherwise two large terms of opposite sign would fit a stiff end better, and drive the joint on
    beyond it.
    """
    best, least = np.zeros(3), np.inf
    for kept in ([0, 1, 2], [0, 2], [1, 2], [2]):
        solution = np.zeros(3)
        solution[kept] = sampled.solve(columns[:, kept])
        if np.any(solution[:2] > 0.0):
            continue
        residual = sampled.weights * (columns @ solution - sampled.torques)
        misfit = float(np.sum(residual**2))
        if misfit < least:
            best, least = solution, misfit
        if len(kept) == 3:
            break
    return best
