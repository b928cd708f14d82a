from math import inf

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.study.run_results import RunResults
from generator.study.study import OUTCOMES, RunResult

MEASURES = ("swing", "end")

numbers = st.none() | st.floats(allow_nan=False) | st.sampled_from([inf, -0.0, 5e-324])
rows = st.builds(
    RunResult,
    st.sampled_from(sorted(OUTCOMES)),
    st.text(),
    st.fixed_dictionaries(dict.fromkeys(MEASURES, numbers)),
)


@given(st.dictionaries(st.integers(0, 9), st.lists(rows, min_size=1, max_size=3)))
def test_results_are_those_stored_last(stored: dict[int, list[RunResult]]) -> None:
    results = RunResults(MEASURES, 10)
    for index, several in stored.items():
        for row in several:
            results[index] = row
    assert len(results) == 10
    assert np.flatnonzero(results.finished).tolist() == sorted(stored)
    last = {index: stored[index][-1] for index in sorted(stored)}
    assert {index: results[index] for index in last} == last
    for name in MEASURES:
        found = [row.measures[name] for row in last.values()]
        assert repr(results.numbers(name).tolist()) == repr([x for x in found if x is not None])
    outcomes = [row.outcome for row in last.values()]
    expected = {outcome: outcomes.count(outcome) for outcome in outcomes}
    assert list(results.count_outcomes().items()) == list(expected.items())
    for outcome in OUTCOMES:
        found = np.flatnonzero(results.have_outcome(outcome)).tolist()
        assert found == [index for index, row in last.items() if row.outcome == outcome]


def test_a_run_without_a_result_is_refused() -> None:
    results = RunResults(MEASURES, 3)
    with pytest.raises(IndexError, match="run 1 has no result"):
        results[1]
    with pytest.raises(IndexError):
        results[3]


def test_results_are_a_sequence() -> None:
    one, other = RunResults(MEASURES, 3), RunResults(MEASURES, 3)
    for index in range(3):
        for results in (one, other):
            results[index] = RunResult("done", "", {"swing": float(index), "end": None})
    assert one == other
    assert one[-1] == one[2] == list(one)[2]
    assert one[1:] == [one[1], one[2]]
    other[2] = RunResult("died", "A sentence.", dict.fromkeys(MEASURES))
    assert one != other
