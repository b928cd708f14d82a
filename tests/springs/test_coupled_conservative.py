"""Work round closed loops, and the nearest gradient: Riener & Edrich's hip and knee."""

from dataclasses import replace
from math import exp, radians

import numpy as np
import pytest
from numpy.polynomial import legendre

from springs.coupled import CoupledExponential, CoupledTerm, loop_work, nearest_conservative_law
from springs.published.tables import coupled_law
from tests.paths import DOCS

PAIR = coupled_law("riener_edrich_1999/leg").law.hold_coordinate("ankle dorsiflexion", 0.0)
MUSCLES = coupled_law("silder_2007/leg").law.hold_coordinate("ankle dorsiflexion", 0.0)
RECTANGLE = ((radians(-15.0), radians(100.0)), (0.0, radians(135.0)))
NEAREST = nearest_conservative_law(PAIR, RECTANGLE)


PAGE = (DOCS / "springs-file.md").read_text(encoding="utf-8")


def sampled(law, count=41):
    """Torques over the rectangle on an even grid, shape (2, count, count)."""
    hip, knee = (np.linspace(low, high, count) for low, high in RECTANGLE)
    return np.array(law.torques(np.meshgrid(hip, knee, indexing="ij")))


def test_work_round_a_loop_by_hand():
    # T1 = exp(y), T2 = 0: there along y = 0 and back along y = 1, over a length of 2.
    law = CoupledExponential(
        ("x", "y"), (CoupledTerm((1.0, 0.0), (0.0, 1.0)),), (7.0, -3.0), (None, None)
    )
    assert loop_work(law, ((0.0, 2.0), (0.0, 1.0))) == pytest.approx(2.0 * (1.0 - exp(1.0)))


def test_the_published_pair_does_work_round_a_loop():
    assert not PAIR.is_conservative
    assert loop_work(PAIR, RECTANGLE) == pytest.approx(-12.67, abs=0.01)


def test_the_muscles_of_silder_do_none():
    assert MUSCLES.is_conservative
    assert loop_work(MUSCLES, RECTANGLE) == pytest.approx(0.0, abs=1e-9)


def test_the_nearest_pair_does_no_work_round_any_loop():
    assert NEAREST.law.is_conservative
    for rectangle in (RECTANGLE, ((0.1, 0.9), (0.4, 2.0))):
        assert loop_work(NEAREST.law, rectangle) == pytest.approx(0.0, abs=1e-11)


def test_the_nearest_pair_is_near():
    # Against torques whose root mean squares are 11.3 and 8.7 N m.
    assert NEAREST.rms_difference == pytest.approx((0.84, 1.55), abs=0.01)
    hip, knee = np.abs(sampled(NEAREST.law) - sampled(PAIR))
    assert np.sqrt(np.mean(hip**2)) == pytest.approx(NEAREST.rms_difference[0], rel=0.15)
    assert np.sqrt(np.mean(knee**2)) == pytest.approx(NEAREST.rms_difference[1], rel=0.15)
    # Every node is within the rectangle, so the corners of the grid may differ by more.
    assert NEAREST.max_difference == pytest.approx((6.0, 7.4), abs=0.1)
    assert NEAREST.max_difference[0] <= hip.max() < 6.5
    assert NEAREST.max_difference[1] <= knee.max() < 8.0


NODES, _WEIGHTS = legendre.leggauss(30)
HALVES = [0.5 * (high - low) for low, high in RECTANGLE]
GRID = np.meshgrid(
    *(low + half * (NODES + 1.0) for (low, _), half in zip(RECTANGLE, HALVES, strict=True)),
    indexing="ij",
)
ROOTS = np.sqrt(np.outer(_WEIGHTS, _WEIGHTS) / 4.0)
"""Roots of the weights of a mean over the rectangle."""


def rms(torques) -> np.ndarray:
    """Root mean squares [N m] of hip and knee over the rectangle."""
    return np.array([np.linalg.norm(ROOTS * torque) for torque in torques])


def distance(law) -> float:
    """Root mean square [N m] of the difference to the pair, both torques combined."""
    return float(np.linalg.norm(rms(np.subtract(law.torques(GRID), PAIR.torques(GRID)))))


def test_no_other_law_of_its_form_is_nearer():
    # At the minimum a small change of any energy makes the distance greater.
    base, terms = np.linalg.norm(NEAREST.rms_difference), NEAREST.law.terms
    for place, term in enumerate(terms):
        for factor in (0.99, 1.01):
            changed = CoupledTerm(tuple(factor * a for a in term.amplitudes), term.rates)
            others = (*terms[:place], changed, *terms[place + 1 :])
            assert distance(replace(NEAREST.law, terms=others)) > base


def least_distance(degree: int) -> np.ndarray:
    """Root mean squares [N m] of hip and knee by which the nearest of all gradients is off.

    The Helmholtz part of the pair, from energies that are polynomials of a degree in either angle.
    """
    values = legendre.legvander(NODES, degree).T
    slopes = [legendre.legval(NODES, legendre.legder(one)) for one in np.eye(degree + 1)]
    columns = [
        np.ravel(
            [
                ROOTS * np.outer(slopes[i], values[j]) / HALVES[0],
                ROOTS * np.outer(values[i], slopes[j]) / HALVES[1],
            ]
        )
        for i in range(degree + 1)
        for j in range(degree + 1)
        if i + j > 0
    ]
    target = np.ravel([ROOTS * torque for torque in PAIR.torques(GRID)])
    basis = np.linalg.qr(np.array(columns).T)[0]
    return np.linalg.norm((target - basis @ (basis.T @ target)).reshape(2, -1), axis=1)


def test_another_energy_comes_nearer_by_a_ninth():
    """The page of the springs file tells both distances."""
    least = least_distance(10)
    assert least == pytest.approx((0.922, 1.282), abs=0.001)
    assert least_distance(12) == pytest.approx(least, abs=1e-4)
    assert np.linalg.norm(NEAREST.rms_difference) == pytest.approx(1.766, abs=0.001)
    assert np.linalg.norm(least) == pytest.approx(1.579, abs=0.001)
    for name, (hip, knee) in (
        ("less the published one", NEAREST.rms_difference),
        ("less the published one", least),
        ("its torques", rms(PAIR.torques(GRID))),
    ):
        assert f"{name} | {hip:.2f} | {knee:.2f} | {np.hypot(hip, knee):.2f} |" in PAGE


def test_three_joints_at_once():
    leg = coupled_law("riener_edrich_1999/leg").law
    nearest = nearest_conservative_law(leg, (*RECTANGLE, (radians(-20.0), radians(20.0))))
    assert nearest.law.is_conservative
    # The ankle's part in the knee's moment has no counterpart in the ankle's.
    assert nearest.rms_difference == pytest.approx((0.88, 3.50, 1.25), abs=0.01)
