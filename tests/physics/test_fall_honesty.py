"""Random falls against much finer ones: what a fall says of its error holds.

`python -m benchmarks.honesty 200 falls` does the same with more figures and longer falls.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

from generator.contact.box import Box
from generator.contact.scene import Prop, Scene
from generator.rotations import Array
from generator.simulation.compiled.mechanism import CompiledModel
from generator.simulation.compiled.refinement import (
    joint_differences,
    run_once,
    run_until_agreed,
)
from generator.simulation.compiled_run import compile_model
from generator.simulation.exudyn_model.model import build_model
from generator.simulation.plan import Plan
from generator.simulation.trace import estimated_accuracy
from springs import SpringSet
from springs.contact import Surface
from tests.contact_figures import FLOOR, two_segments

TOLERANCES = (1e-2, 1e-4)

FALLS = 12

STOP = 1.0
"""Of a fall [s]."""

TIMES = np.linspace(0.0, STOP, 51)

REFERENCE = 1e-10
"""Tolerance of the fall that is taken for the true one; its own error is some 1e-7 rad."""

STEP = Prop("step", Box((0.3, 0.1, -0.2), (0.6, 0.5, 0.8), (0.0, 0.4, 0.0)), Surface())
HEIGHTS = {"floor": 1.2, "box": 1.5}
"""Of the first segment at the start [m]."""

SCENES = {"floor": FLOOR, "box": Scene((*FLOOR.props, STEP))}


@dataclass(frozen=True)
class Told:
    """Error estimates of a fall, and its true errors.

    Attributes:
        met_until: time until which the fall reports that its tolerance is met [s].
        estimates: by frame, shape (n,) [rad].
        errors: true errors by frame, shape (n,) [rad].
    """

    met_until: float
    estimates: Array
    errors: Array


def random_fall(scene: str, seed: int) -> CompiledModel:
    """Two segments that fall with random orientation and rates, from above the props."""
    rng = np.random.default_rng(seed)
    plan = Plan(
        stop=STOP,
        springs=SpringSet(),
        scene=SCENES[scene],
        displacements={
            "root": (*rng.uniform(-0.6, 0.6, 3), 0.0, HEIGHTS[scene], 0.0),
            "hinge": (rng.uniform(-0.5, 0.5),),
        },
        velocities={
            "hinge": (rng.uniform(-3.0, 3.0),),
            "root": (*rng.uniform(-2.0, 2.0, 3), *rng.uniform(-0.5, 0.5, 3)),
        },
    )
    return compile_model(build_model(two_segments(), plan))


@cache
def falls(scene: str) -> dict[float, list[Told]]:
    """What all falls in a scene say, by tolerance."""
    found: dict[float, list[Told]] = {tolerance: [] for tolerance in TOLERANCES}
    for seed in range(FALLS):
        model = random_fall(scene, seed)
        exact = run_once(model, TIMES, REFERENCE)
        for tolerance, some in found.items():
            agreed = run_until_agreed(model, TIMES, tolerance, threads=1)
            run = agreed.run
            accuracy = estimated_accuracy(run.times, agreed.errors, tolerance, 0.0, 1)
            errors = joint_differences(model, run, exact)
            some.append(Told(accuracy.tolerance_met_until, agreed.errors, errors))
    return found


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("scene", SCENES)
def test_until_the_time_that_a_fall_states_its_tolerance_is_met(scene, tolerance) -> None:
    some = falls(scene)[tolerance]
    for told in some:
        assert np.max(told.errors[told.met_until >= TIMES]) <= tolerance
    assert np.mean([told.met_until for told in some]) > 0.5 * STOP
    assert max(np.max(told.errors) for told in some) > 1e-2 * tolerance


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("scene", SCENES)
def test_no_fall_errs_more_than_thrice_its_estimate(scene, tolerance) -> None:
    """In flight both runs take the longest step, so that their difference says nothing; the error
    is a small share of the tolerance then.
    """
    compared = 0
    for told in falls(scene)[tolerance]:
        counts = told.errors > 0.05 * tolerance
        compared += np.count_nonzero(counts)
        assert np.all(told.errors[counts] <= 3.0 * told.estimates[counts])
    assert compared > 0 or tolerance > 1e-3  # coarse falls err less, as steps are bounded
