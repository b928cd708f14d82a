"""The coefficients of coordinate limit torques that PredSim reads (`.csv`).

PredSim (https://github.com/KULeuvenNeuromechanics/PredSim) has for each coordinate q the torque

    K_1 exp(K_2 (q - theta_2)) + K_3 exp(K_4 (q - theta_1))

of Anderson 1999, whose coefficients are a row of a table. Here theta_1 and theta_2 are the ends of
the range of the joint, so that -K_1 and K_3 are the resisting torques there.
"""

from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import cast

import numpy as np
from scipy.optimize import least_squares

from generator.diagnostics import InputError, error
from generator.figure import Figure, is_rotation
from generator.joint_chain import build_chain
from generator.losses import Losses
from generator.model_files.displacement_torques import (
    COUPLING_LOSS,
    NEGLIGIBLE_TORQUE,
    SampledTorque,
    coupling_error,
    sampled_torques,
)
from generator.model_files.export_model import split_joint_laws
from generator.model_files.fit_error import FitErrors, format_range, joint_ranges
from generator.model_files.model_files import ModelFiles
from generator.names import coordinate_names
from generator.rotations import Array
from generator.text_io import format_csv_rows
from springs import JointSprings, SpringSet
from springs.elastic import Range

TITLES = ("name", "K_1", "K_2", "K_3", "K_4", "theta_1", "theta_2")

FITTED_LOSS = "springs approximated by two exponentials"

_RATES = (0.5, 2.0, 6.0, 20.0, 60.0)
"""Rates from which the fit starts, times half of the range."""

_RATE_BOUNDS = (0.05, 200.0)
"""Bounds of the rates, times half of the range."""

_STARTS = 3
"""Number of starts from which the fit is refined."""


@dataclass(frozen=True)
class LimitTorque:
    """Two exponentials that resist at the ends of a range.

    Attributes:
        torques: at the upper end, not positive, and at the lower one, not negative [N m].
        rates: positive at the upper end, negative at the lower one [1/rad].
        range: whose ends are theta_1 and theta_2 [rad].
    """

    torques: tuple[float, float]
    rates: tuple[float, float]
    range: Range

    def torque(self, q: Array) -> Array:
        """Torque at angles, shape (n,) [N m]."""
        (upper, lower), (rise, fall), (low, high) = self.torques, self.rates, self.range
        return upper * np.exp(rise * (q - high)) + lower * np.exp(fall * (q - low))

    @property
    def coefficients(self) -> tuple[float, ...]:
        """Numbers of a row of the table."""
        (upper, lower), (rise, fall) = self.torques, self.rates
        return upper, rise, lower, fall, *self.range


def format_files(figure: Figure, springs: SpringSet, path: Path) -> ModelFiles:
    """Format the limit torques of a figure's rotations as the table at `path`.

    Raises InputError for a figure without springs of rotations.
    """
    losses = Losses("PredSim's limit torques")
    losses.add("everything but the elastic torques of rotations")
    names = coordinate_names({name: joint.chain for name, joint in figure.joints.items()})
    errors = FitErrors()
    table: list[tuple[str, ...]] = [TITLES]
    for name, joint in figure.joints.items():
        own = springs.joints.get(name, JointSprings(name))
        chain, ranges = build_chain(joint.chain), joint_ranges(joint, own)
        laws = split_joint_laws(chain, own)
        fitted: dict[int, LimitTorque] = {}
        for k, sampled in sampled_torques(joint, chain, laws, springs.joining, ranges).items():
            if not is_rotation(joint.chain[k].kind) or sampled.range[1] <= sampled.range[0]:
                continue
            fitted[k] = limit = fit_limit_torque(sampled)
            difference = sampled.error_of(limit.torque)
            if difference.largest > NEGLIGIBLE_TORQUE:
                over = f" over {format_range(sampled.range)}"
                errors.add(FITTED_LOSS, names[name][k], difference, over)
            table.append((names[name][k], *(f"{one:.9g}" for one in limit.coefficients)))
        torques = {k: limit.torque for k, limit in fitted.items()}
        coupling = coupling_error(chain, laws, springs.joining, ranges, torques)
        if coupling is not None:
            errors.add(COUPLING_LOSS, name, coupling)
    errors.report(losses)
    if len(table) == 1:
        message = "the figure has no springs of rotations and therefore no limit torques"
        raise InputError([error(message, hint="name springs with --springs")])
    for spring in springs.coupled:
        joints = dict.fromkeys(axis.joint for axis in spring.axes)
        losses.add("laws over several joints", " and ".join(joints))
    return ModelFiles(path, {path: format_csv_rows(table)}, losses)


def fit_limit_torque(sampled: SampledTorque) -> LimitTorque:
    """Fit rates, for each of which the torques at the ends of the range are linear."""
    low, high = sampled.range
    half = 0.5 * (high - low)
    x = (sampled.displacements - 0.5 * (low + high)) / half

    def residual(logarithms: Array) -> Array:
        columns = _columns(np.exp(logarithms), x)
        solution = _solve_restoring(columns, sampled)
        return sampled.weights * (columns @ solution - sampled.torques)

    def misfit(logarithms: Array) -> float:
        return float(np.sum(residual(logarithms) ** 2))

    starts = [np.log(pair) for pair in product(_RATES, repeat=2)]
    starts.sort(key=misfit)
    bounds = tuple(np.log(_RATE_BOUNDS).tolist())
    fits = [
        cast("Array", least_squares(residual, start, bounds=bounds).x) for start in starts[:_STARTS]
    ]
    rates = np.exp(min(fits, key=misfit))
    upper, lower = _solve_restoring(_columns(rates, x), sampled).tolist()
    rise, fall = (rates / half).tolist()
    return LimitTorque((upper + 0.0, lower + 0.0), (rise, -fall), sampled.range)


def _columns(rates: Array, x: Array) -> Array:
    """Return exponentials that are 1 at the upper and at the lower end, shape (n, 2)."""
    rise, fall = rates.tolist()
    return np.stack([np.exp(rise * (x - 1.0)), np.exp(-fall * (x + 1.0))], axis=1)


def _solve_restoring(columns: Array, sampled: SampledTorque) -> Array:
    """Return the least-squares torques at the ends, each against the joint's rotation there."""
    best, least = np.zeros(2), np.inf
    for kept in ([0, 1], [0], [1]):
        solution = np.zeros(2)
        solution[kept] = sampled.solve(columns[:, kept])
        if solution[0] > 0.0 or solution[1] < 0.0:
            continue
        residual = sampled.weights * (columns @ solution - sampled.torques)
        misfit = float(np.sum(residual**2))
        if misfit < least:
            best, least = solution, misfit
        if len(kept) == 2:
            break
    return best
