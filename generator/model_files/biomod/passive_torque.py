"""The passive torques of a `.bioMod` file: a line or two exponentials for each displacement.

biorbd's exponential torque is

    (b1 exp(k1 (q - m)) + b2 exp(k2 (q - m))) (q - d) + t

without its factor of the rate. A law of another form is approximated by least squares over the
range of the joint, as is that of several rotations for a turn about each of their axes alone.
Beyond `TYPICAL_TORQUE` the relative error counts: a stiff end of the range does not spoil the rest.
"""

from dataclasses import dataclass
from itertools import combinations, product
from typing import cast

import numpy as np
from scipy.optimize import least_squares

from generator.figure import Joint
from generator.joint_chain import Chain
from generator.model_files.export_model import JointLaws
from generator.model_files.fit_error import FitError
from generator.passive_curve import rotation_vector
from generator.rotations import Array, matrix_from_rotation_vector
from springs import AxisSpring, Joining, Linear, elastic_torque, total_torque
from springs.elastic import Range

_SAMPLES_OF_ONE_ANGLE = 181
_SAMPLES_OF_SEVERAL_ANGLES = 2000
_SEED = 0

_RATES = (0.7, 2.0, 5.0, 12.0, 30.0)
"""Sizes of the rates from which the fit starts, times half of the range."""

_ZEROS = (-0.9, -0.5, 0.0, 0.5, 0.9)
"""Zeros of the factor q - d from which the fit starts, relative to half of the range."""

_LARGEST_RATE = 120.0
"""Bound of the rates, times half of the range."""

_STARTS = 3
"""Number of starts from which the fit is refined."""

TYPICAL_TORQUE = 20.0
"""Torque beyond which the fit is to the relative error [N m or N]."""

_NEGLIGIBLE = 1e-9
"""Torque or error that is nothing [N m or N]."""


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
        torque: as the format holds it.
        error: of the approximation over `range`, the other rotations at zero; None without one.
        range: in which it was fitted [rad or m].
    """

    torque: PassiveTorque
    error: FitError | None
    range: Range


@dataclass(frozen=True)
class JointTorques:
    """The passive torques of a joint.

    Attributes:
        fitted: by index in the chain.
        coupling_error: of several rotations, at orientations throughout their ranges; else None.
    """

    fitted: dict[int, FittedTorque]
    coupling_error: FitError | None


def passive_torques(
    joint: Joint, chain: Chain, laws: JointLaws, joining: Joining, ranges: tuple[Range, ...]
) -> JointTorques:
    """Return the passive torques of a joint's displacements.

    Args:
        joint: the joint.
        chain: its chain.
        laws: its springs.
        joining: the law that joins the axes of several rotations.
        ranges: of the displacements, over which laws are fitted [rad or m].
    """
    fitted: dict[int, FittedTorque] = {}
    for k, spring in laws.uncoupled.items():
        exact = _linear_law(spring)
        if exact is not None:
            fitted[k] = FittedTorque(exact, None, ranges[k])
        else:
            angles = np.linspace(*ranges[k], _SAMPLES_OF_ONE_ANGLE)
            torques = np.asarray(total_torque(spring.elastic, angles)) + np.zeros_like(angles)
            fitted[k] = _fit(angles, torques, ranges[k])
    if not any(axis.elastic for axis in laws.combined):
        return JointTorques(_acting(fitted), None)
    for k in chain.rotations:
        angles = np.linspace(*ranges[k], _SAMPLES_OF_ONE_ANGLE)
        alone = np.zeros((len(angles), len(joint.chain)))
        alone[:, k] = angles
        torques = generalized_torques(chain, joining, laws.combined, alone)[:, k]
        fitted[k] = _fit(angles, torques, ranges[k])
    samples = _sampled_angles(joint, chain, ranges)
    differences = -generalized_torques(chain, joining, laws.combined, samples)
    for k in chain.rotations:
        differences[:, k] += fitted[k].torque.torque(samples[:, k])
    error = FitError.from_differences(differences[:, list(chain.rotations)])
    return JointTorques(_acting(fitted), error)


def _acting(fitted: dict[int, FittedTorque]) -> dict[int, FittedTorque]:
    return {k: one for k, one in fitted.items() if not _is_zero(one)}


def generalized_torques(
    chain: Chain, joining: Joining, axes: tuple[AxisSpring, ...], displacements: Array
) -> Array:
    """Generalized torques of the springs of several rotations, shape (n, factors) [N m].

    Args:
        chain: of the joint.
        joining: the law that joins the axes.
        axes: the springs.
        displacements: of the chain, shape (n, factors) [rad or m].
    """
    vectors = rotation_vector(chain, displacements)
    half_way = np.asarray(elastic_torque(joining, axes, vectors))
    torques = np.einsum("nij,nj->ni", matrix_from_rotation_vector(0.5 * vectors), half_way)
    return np.einsum("nki,ni->nk", chain.twists(displacements)[..., :3], torques)


def _sampled_angles(joint: Joint, chain: Chain, ranges: tuple[Range, ...]) -> Array:
    """Displacements within the ranges of the rotations, at random, shape (n, factors)."""
    rng = np.random.default_rng(_SEED)
    samples = np.tile(np.array(joint.displacement), (_SAMPLES_OF_SEVERAL_ANGLES, 1))
    for k in chain.rotations:
        samples[:, k] = rng.uniform(*ranges[k], len(samples))
    return samples


def _linear_law(spring: AxisSpring) -> LinearTorque | None:
    """Return the law of a spring where it is linear, else None."""
    linear = [law for law in spring.elastic if isinstance(law, Linear)]
    if len(linear) < len(spring.elastic):
        return None
    slope = -sum(law.stiffness for law in linear)
    return LinearTorque(sum(law.stiffness * law.rest for law in linear), slope)


def _is_zero(fitted: FittedTorque) -> bool:
    ends = fitted.torque.torque(np.linspace(*fitted.range, _SAMPLES_OF_ONE_ANGLE))
    return bool(np.abs(ends).max() < _NEGLIGIBLE)


def _fit(angles: Array, torques: Array, ends: Range) -> FittedTorque:
    """Return the best torque of the format for samples of a displacement."""
    weights = 1.0 / (1.0 + np.abs(torques) / TYPICAL_TORQUE)
    best: PassiveTorque = _fit_line(angles, torques, weights)
    if ends[1] > ends[0]:
        curve = _fit_exponentials(angles, torques, weights, ends)
        misfits = [np.sum((weights * (one.torque(angles) - torques)) ** 2) for one in (best, curve)]
        best = curve if misfits[1] < 0.99 * misfits[0] else best
    error = FitError.from_differences(best.torque(angles) - torques)
    return FittedTorque(best, None if error.largest < _NEGLIGIBLE else error, ends)


def _fit_line(angles: Array, torques: Array, weights: Array) -> LinearTorque:
    columns = np.stack([np.ones_like(angles), angles], axis=1)
    at_zero, slope = _solve(columns, torques, weights).tolist()
    return LinearTorque(at_zero, slope)


def _fit_exponentials(
    angles: Array, torques: Array, weights: Array, ends: Range
) -> ExponentialTorque:
    """Fit rates and the zero, for each of which the amplitudes and the constant are linear."""
    middle, half = 0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0])
    x = (angles - middle) / half

    def residual(shape: Array) -> Array:
        columns, _ = _columns(shape, x)
        return weights * (columns @ _solve_restoring(columns, torques, weights) - torques)

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
    b1, b2, constant = (_solve_restoring(columns, torques, weights) * scales).tolist()
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


def _solve_restoring(columns: Array, torques: Array, weights: Array) -> Array:
    """Return the least-squares amplitudes and constant with amplitudes that are not positive.

    Otherwise two large terms of opposite sign would fit a stiff end better, and drive the joint on
    beyond it.
    """
    best, least = np.zeros(3), np.inf
    for kept in ([0, 1, 2], [0, 2], [1, 2], [2]):
        solution = np.zeros(3)
        solution[kept] = _solve(columns[:, kept], torques, weights)
        if np.any(solution[:2] > 0.0):
            continue
        misfit = float(np.sum((weights * (columns @ solution - torques)) ** 2))
        if misfit < least:
            best, least = solution, misfit
        if len(kept) == 3:
            break
    return best


def _solve(columns: Array, torques: Array, weights: Array) -> Array:
    """Return the least-squares solution of columns of any size."""
    weighted = columns * weights[:, None]
    sizes = np.linalg.norm(weighted, axis=0)
    sizes[sizes == 0.0] = 1.0
    solution = cast("Array", np.linalg.lstsq(weighted / sizes, torques * weights, rcond=1e-10)[0])
    return solution / sizes
