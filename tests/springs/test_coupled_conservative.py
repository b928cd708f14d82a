"""Work round closed loops, and the nearest gradient: Riener & Edrich's hip and knee."""

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


def test_work_round_a_loop_is_the_sum_of_the_work_round_its_halves():
    (low, high), knee = RECTANGLE
    halves = [loop_work(PAIR, ((low, 0.5), knee)), loop_work(PAIR, ((0.5, high), knee))]
    assert sum(halves) == pytest.approx(loop_work(PAIR, RECTANGLE), abs=1e-10)


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


def test_it_keeps_what_the_pair_is_used_for():
    bent = NEAREST.law.torques((radians(90.0), radians(90.0)))[0]
    straight = NEAREST.law.torques((radians(90.0), radians(15.0)))[0]
    assert straight == pytest.approx(-34.3, abs=3.0)
    assert bent == pytest.approx(0.3, abs=1.5)


def test_no_other_law_of_its_form_is_nearer():
    # At the minimum a small change of any energy makes the distance greater.
    base = sum(rms**2 for rms in NEAREST.rms_difference)
    for place in range(len(NEAREST.law.terms)):
        for factor in (0.99, 1.01):
            terms = list(NEAREST.law.terms)
            amplitudes = tuple(factor * a for a in terms[place].amplitudes)
            terms[place] = CoupledTerm(amplitudes, terms[place].rates)
            changed = CoupledExponential(
                NEAREST.law.coordinates,
                tuple(terms),
                NEAREST.law.constants,
                NEAREST.law.valid_ranges,
            )
            assert distance(changed) > base


def distance(law) -> float:
    """Mean square over the rectangle of the difference to the pair, both torques together."""
    x, w = legendre.leggauss(40)
    hip, knee = (low + 0.5 * (high - low) * (x + 1.0) for low, high in RECTANGLE)
    angles = np.meshgrid(hip, knee, indexing="ij")
    weights = np.outer(w, w) / 4.0
    pairs = zip(law.torques(angles), PAIR.torques(angles), strict=True)
    return float(sum((weights * (one - other) ** 2).sum() for one, other in pairs))


def least_distance(degree: int) -> tuple[float, float]:
    """Root mean squares [N m] of hip and knee by which the nearest of all gradients is off.

    The Helmholtz part of the pair, from energies that are polynomials of a degree in either angle.
    """
    x, w = legendre.leggauss(40)
    halves = [0.5 * (high - low) for low, high in RECTANGLE]
    hip, knee = (low + 0.5 * (high - low) * (x + 1.0) for low, high in RECTANGLE)
    torques = PAIR.torques(np.meshgrid(hip, knee, indexing="ij"))
    root = np.sqrt(np.outer(w, w) / 4.0)
    count = degree + 1
    values = legendre.legvander(x, degree)
    slopes = np.array([legendre.legval(x, legendre.legder(one)) for one in np.eye(count)]).T
    columns = [
        np.concatenate(
            [
                (root * np.outer(slopes[:, i], values[:, j]) / halves[0]).ravel(),
                (root * np.outer(values[:, i], slopes[:, j]) / halves[1]).ravel(),
            ]
        )
        for i in range(count)
        for j in range(count)
        if i + j > 0
    ]
    target = np.concatenate([(root * t).ravel() for t in torques])
    basis = np.linalg.qr(np.array(columns).T)[0]
    hip, knee = (target - basis @ (basis.T @ target)).reshape(2, -1)
    return float(np.linalg.norm(hip)), float(np.linalg.norm(knee))


def sizes() -> tuple[float, float]:
    """Root mean squares of the pair's own torques [N m]."""
    x, w = legendre.leggauss(40)
    hip, knee = (low + 0.5 * (high - low) * (x + 1.0) for low, high in RECTANGLE)
    weights = np.outer(w, w) / 4.0
    torques = PAIR.torques(np.meshgrid(hip, knee, indexing="ij"))
    first, second = (float(np.sqrt((weights * torque**2).sum())) for torque in torques)
    return first, second


def test_another_energy_comes_nearer_by_a_ninth():
    """The page of the springs file tells both distances."""
    least = least_distance(14)
    assert least == pytest.approx((0.922, 1.282), abs=0.001)
    assert least_distance(16) == pytest.approx(least, abs=1e-4)
    reached, own = float(np.linalg.norm(NEAREST.rms_difference)), sizes()
    assert reached == pytest.approx(1.766, abs=0.001)
    assert np.linalg.norm(least) == pytest.approx(1.579, abs=0.001)
    rms = NEAREST.rms_difference
    for row in (
        f"less the published one | {rms[0]:.2f} | {rms[1]:.2f} | {reached:.2f} |",
        f"less the published one | {least[0]:.2f} | {least[1]:.2f} | {np.hypot(*least):.2f} |",
        f"its torques | {own[0]:.2f} | {own[1]:.2f} | {np.hypot(*own):.2f} |",
    ):
        assert row in PAGE


def test_a_gradient_is_its_own_nearest():
    nearest = nearest_conservative_law(MUSCLES, ((-0.2, 1.0), (0.1, 1.5)))
    assert max(nearest.max_difference) < 1e-9


def test_three_joints_at_once():
    leg = coupled_law("riener_edrich_1999/leg").law
    nearest = nearest_conservative_law(leg, (*RECTANGLE, (radians(-20.0), radians(20.0))))
    assert nearest.law.is_conservative
    # The ankle's part in the knee's moment has no counterpart in the ankle's.
    assert nearest.rms_difference == pytest.approx((0.88, 3.50, 1.25), abs=0.01)
