"""How the time of a pass is cut into legs, stretches and bites."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.simulation.integrate import frame_times
from generator.simulation.step_schedule import (
    MAX_STEPS_PER_CHUNK,
    BreakpointCrossing,
    StepHints,
    last_frame_of_batch,
    step_chunks,
    subintervals,
)

NONE = np.zeros(0)
FRAMES = frame_times(0.0, 0.19, 0.02)
"""Ten intervals, the last one half as long."""


def legs(times, most=20, jumps=NONE, guide=None) -> list[tuple[int, int]]:
    """(first, last) of the legs one after another."""
    found, frame = [], 0
    while frame + 1 < times.size:
        last = last_frame_of_batch(times, frame, most, jumps, guide or StepHints())
        found.append((frame, last))
        frame = last
    return found


def test_a_leg_goes_on_to_the_first_interval_of_another_length() -> None:
    assert legs(FRAMES) == [(0, 9), (9, 10)]


def test_a_leg_is_not_longer_than_allowed() -> None:
    assert legs(FRAMES, most=4) == [(0, 4), (4, 8), (8, 9), (9, 10)]
    assert legs(FRAMES, most=0) == [(k, k + 1) for k in range(10)]


def test_where_a_load_jumps_or_a_corner_is_passed_an_interval_is_a_leg_of_its_own() -> None:
    guide = StepHints(
        [BreakpointCrossing("pin hinge 0", 0.05, 1.0)], {"pin hinge 0": [0.0] * FRAMES.size}
    )
    assert legs(FRAMES, guide=guide) == [(0, 2), (2, 3), (3, 9), (9, 10)]
    assert legs(FRAMES, jumps=np.array([0.11])) == [(0, 5), (5, 6), (6, 9), (9, 10)]


@given(st.lists(st.floats(0.0, 1.0), max_size=6), st.lists(st.floats(0.0, 1.0), max_size=6))
def test_stretches_fill_the_interval_and_end_at_every_jump(jumps, corners) -> None:
    found = subintervals(0.0, 1.0, np.array(sorted(set(jumps))), np.array(sorted(corners)), 0.1)
    ends = [0.0, *(there for _, there in found)]
    assert [here for here, _ in found] == ends[:-1]
    assert ends[-1] == 1.0
    assert {time for time in jumps if 0.0 < time < 1.0} <= set(ends)


@pytest.mark.parametrize(
    "count", [1, MAX_STEPS_PER_CHUNK, MAX_STEPS_PER_CHUNK + 1, 7 * MAX_STEPS_PER_CHUNK + 3]
)
def test_bites_take_all_steps_at_one_length(count) -> None:
    found = list(step_chunks((2.0, 3.0), count))
    assert sum(some for _, some in found) == count
    assert found[0][0][0] == 2.0
    assert found[-1][0][1] == 3.0
    for (here, there), some in found:
        assert some <= MAX_STEPS_PER_CHUNK
        assert (there - here) / some == pytest.approx(1.0 / count)
