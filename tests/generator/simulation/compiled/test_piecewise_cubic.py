"""Curves of many pieces: the compiled search finds numpy's piece."""

from typing import Any, cast

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from generator.simulation.compiled.piecewise_cubic import piecewise_cubic
from generator.simulation.compiled.recorder import Recorder, Symbol
from springs.backends import FLOATS, NUMPY, select_cubic

NUMBER = st.floats(-10.0, 10.0)
PIECES = st.integers(1, 12).flatmap(
    lambda count: st.tuples(
        st.lists(NUMBER, min_size=count, max_size=count).map(sorted),
        st.lists(st.tuples(*[NUMBER] * 4), min_size=count, max_size=count),
    ).map(lambda both: list(zip(*both, strict=True)))
)

evaluate = cast("Any", piecewise_cubic).py_func
"""The function before it is compiled: tests of runs call the compiled one."""

LAW, SWITCH = 3, 1
"""Constants and switching functions of other laws that come before those of the curve."""


def table_of(pieces, *, holds_pieces: bool) -> np.ndarray:
    """Constants of a law with one curve, after those of another."""
    recorder = Recorder()
    recorder.record_piecewise_cubic(Symbol(recorder, "x"), pieces)
    constants, switches = recorder.tables(holds_pieces=holds_pieces)
    assert switches == (len(pieces) - 1 if holds_pieces else 0)
    return np.array([np.nan] * LAW + constants)


@given(pieces=PIECES, x=NUMBER)
def test_the_search_finds_the_piece_of_the_displacement(pieces, x):
    table, none = table_of(pieces, holds_pieces=False), np.zeros(0)
    assert evaluate(x, table, LAW, 0, none, none, 0) == NUMPY.piecewise_cubic(x, pieces)


@given(pieces=PIECES, x=NUMBER)
def test_the_branches_select_the_piece_of_the_displacement(pieces, x):
    count = len(pieces) - 1 + SWITCH
    table = table_of(pieces, holds_pieces=True)
    branches, switching = np.ones(count), np.full(count, np.nan)
    evaluate(x, table, LAW, 0, branches, switching, SWITCH)
    assert np.isnan(switching[0])
    assert np.array_equal(switching[1:], [origin - x for origin, _ in pieces[1:]])
    branches[1:] = np.where(switching[1:] > 0.0, 1.0, -1.0)
    found = evaluate(x, table, LAW, 0, branches, switching, SWITCH)
    assert found == NUMPY.piecewise_cubic(x, pieces)


def test_a_held_branch_continues_its_piece_beyond_the_breakpoint():
    pieces = [(0.0, (1.0, 0.0, 0.0, 0.0)), (2.0, (7.0, 3.0, 0.0, 0.0))]
    table, switching = table_of(pieces, holds_pieces=True), np.zeros(1)
    assert evaluate(3.0, table, LAW, 0, np.array([1.0]), switching, 0) == 1.0
    assert evaluate(1.0, table, LAW, 0, np.array([-1.0]), switching, 0) == 4.0


def test_curves_of_any_number_of_pieces_leave_the_same_line():
    recorders = Recorder(), Recorder()
    for recorder, count in zip(recorders, (2, 9), strict=True):
        pieces = [(float(k), (1.0, 2.0, 3.0, float(k))) for k in range(count)]
        recorder.record_piecewise_cubic(Symbol(recorder, "x"), pieces)
    assert recorders[0].lines == recorders[1].lines


@given(pieces=PIECES, xs=st.lists(NUMBER, min_size=1, max_size=9))
def test_arrays_floats_and_conditions_agree(pieces, xs):
    on_arrays = NUMPY.piecewise_cubic(np.array(xs), pieces)
    assert [FLOATS.piecewise_cubic(x, pieces) for x in xs] == on_arrays.tolist()
    assert select_cubic(NUMPY, np.array(xs), pieces).tolist() == on_arrays.tolist()
