"""What a plan may ask for."""

import pytest

from generator.simulation.plan import Plan


def test_defaults() -> None:
    plan = Plan()
    assert plan.gravity == (0.0, -9.81, 0.0)
    assert plan.tolerance == 1e-3
    assert plan.frame == 0.02
    assert plan.step is None


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"stop": 0.0}, "not after the start"),
        ({"start": 2.0}, "not after the start"),
        ({"stop": float("nan")}, "stop must be finite"),
        ({"stop": float("inf")}, "stop must be finite"),
        ({"start": float("-inf")}, "start must be finite"),
        ({"frame": 0.0}, "frame must be positive"),
        ({"frame": float("nan")}, "frame must be finite"),
        ({"tolerance": -1e-3}, "tolerance must be positive"),
        ({"tolerance": float("inf")}, "tolerance must be finite"),
        ({"wall_limit": 0.0}, "wall limit must be positive"),
        ({"wall_limit": float("nan")}, "wall limit must be positive"),
        ({"step": 0.0}, "step must be positive"),
        ({"step": -1e-3}, "step must be positive"),
        ({"step": float("inf")}, "step must be finite"),
        ({"gravity": (0.0, -9.81)}, "three finite components"),
        ({"gravity": (0.0, float("nan"), 0.0)}, "three finite components"),
    ],
)
def test_what_makes_no_run(given, reason) -> None:
    with pytest.raises(ValueError, match=reason):
        Plan(**given)


def test_a_run_may_start_before_zero_and_take_all_day() -> None:
    assert Plan(start=-1.0, stop=0.0, wall_limit=float("inf")).start == -1.0
