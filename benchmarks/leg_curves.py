"""Silder's twelve curves of hip, knee and ankle as the gradient of one energy.

    python -m benchmarks.leg_curves

Fits the exponentials of `silder_2007/leg_curves` anew, by least squares of the moments at every
digitised degree, each residual over the error of its curve (`rms_error_Nm`), and prints how far
the law of the table, the fit and the law of the mean parameters are from the curves.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from springs.backends import Array
from springs.coupled import CoupledExponential, CoupledTerm
from springs.interpolated import Interpolated
from springs.published.tables import coupled_law, publication

IndexArray = NDArray[np.int64]


def curve_points(law: CoupledExponential) -> tuple[Array, IndexArray, Array, Array]:
    """Points of all curves: angles [rad], shape (3, n), places of the moments, moments, errors."""
    joints = [name.partition(" ")[0] for name in law.coordinates]
    rows: list[tuple[list[float], int, float, float]] = []
    for curve in publication("silder_2007").curves.values():
        points, error = curve.law, curve.rms_error
        assert isinstance(points, Interpolated)
        assert error is not None
        held = [curve.held_angles.get(joint, 0.0) for joint in joints]
        place = law.coordinates.index(curve.motion)
        for angle, moment in points.points:
            rows.append(([*held[:place], angle, *held[place + 1 :]], place, moment, error))
    angles, places, moments, errors = zip(*rows, strict=True)
    return np.array(angles).T, np.array(places), np.array(moments), np.array(errors)


def residuals(law: CoupledExponential) -> tuple[Array, IndexArray, Array]:
    """Differences from the curves [N m], with the places of the moments and the errors [N m]."""
    angles, places, moments, errors = curve_points(law)
    torques: Array = np.array(law.torques(tuple(angles)))
    return np.choose(places, torques) - moments, places, errors


def rms_errors(law: CoupledExponential) -> list[float]:
    """Root mean square of the differences from the curves, about each coordinate [N m]."""
    differences, places, _ = residuals(law)
    return [float(np.sqrt(np.mean(differences[places == k] ** 2))) for k in range(3)]


def weighted_rms(law: CoupledExponential) -> float:
    """Root mean square of all differences over the errors of their curves."""
    differences, _, errors = residuals(law)
    return float(np.sqrt(np.mean((differences / errors) ** 2)))


def fit(start: CoupledExponential) -> CoupledExponential:
    """Return the nearest law with the same rates that are zero."""
    free = [[k for k, rate in enumerate(term.rates) if rate] for term in start.terms]

    def law(values: Array) -> CoupledExponential:
        left = iter(values.tolist())
        terms: list[CoupledTerm] = []
        for term, places in zip(start.terms, free, strict=True):
            exponent, rates = next(left), [0.0] * 3
            for place in places:
                rates[place] = next(left)
            amplitudes = tuple(-rate for rate in rates)
            terms.append(
                replace(
                    term, amplitudes=amplitudes, rates=tuple(rates), exponent=exponent, end=None
                )
            )
        return replace(start, terms=tuple(terms))

    def difference(values: Array) -> Array:
        differences, _, errors = residuals(law(values))
        return differences / errors

    first = [
        value
        for term, places in zip(start.terms, free, strict=True)
        for value in (term.exponent, *(term.rates[place] for place in places))
    ]
    return law(least_squares(difference, first, x_scale="jac").x)


def main() -> None:
    """Print the terms and the errors."""
    stored = coupled_law("silder_2007/leg_curves").law
    fitted = fit(stored)
    for one, other in zip(stored.terms, fitted.terms, strict=True):
        print(
            f"{one.exponent:8.4f} {one.rates}  fitted {other.exponent:8.4f}",
            np.round(other.rates, 3),
        )
    mean = coupled_law("silder_2007/leg").law
    for name, law in (("stored", stored), ("fitted", fitted), ("mean parameters", mean)):
        hip, knee, ankle = rms_errors(law)
        print(f"{name}: hip {hip:.2f}, knee {knee:.2f}, ankle {ankle:.2f} N m")


if __name__ == "__main__":
    main()
