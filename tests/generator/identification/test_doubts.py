"""Doubts about fits whose model is wrong, or whose data say too little."""

from dataclasses import replace

from generator.identification.doubts import fit_doubts
from generator.identification.fit import FitOptions, fit_springs
from tests.swings import COULOMB, NOISE, SCALE, TRUTH, VISCOUS, leg_case, paths, swing

ALONE = FitOptions(starts=1, profiles=False)


def doubts(data, texts, **changes) -> tuple[str, ...]:
    return fit_doubts(fit_springs(leg_case(), data, paths(*texts), replace(ALONE, **changes)))


def test_a_good_fit_has_none():
    assert doubts(swing(), TRUTH, sd=NOISE) == ()


def test_a_law_that_is_missing_shows_in_the_residuals():
    found = doubts(swing({**TRUTH, COULOMB: 0.3}), [SCALE, VISCOUS])
    assert "successive residuals are alike" in found[0]
    assert "the intervals are too narrow, by a factor of" in found[0]


def test_a_noise_that_is_too_small_or_too_large_is_named():
    assert "the model does not explain the data" in doubts(swing(), TRUTH, sd=0.5 * NOISE)[0]
    assert "which is too large" in doubts(swing(), TRUTH, sd=2.0 * NOISE)[0]


def test_a_coarse_step_is_named_with_its_bias():
    found = doubts(swing(), TRUTH, step=0.02)
    assert "of its standard deviations by the step of 0.02 s" in found[0]


def test_damping_and_friction_from_one_swing_are_named():
    found = doubts(swing({**TRUTH, COULOMB: 0.1}, stop=1.0), [SCALE, VISCOUS, COULOMB])
    assert "one swing hardly separates damping from friction" in "".join(found)


def test_an_estimate_at_its_bound_is_named():
    found = doubts(swing({**TRUTH, VISCOUS: 0.0}, seed=3), [VISCOUS])
    at_bound = [one for one in found if "is at its smallest value" in one]
    assert len(at_bound) <= 1
