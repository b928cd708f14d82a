"""Curves of many pieces: the compiled search finds numpy's piece."""

from typing import Any, cast

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from generator.simulation.compiled.piecewise_cubic import (
    PIECE_SIZE,
    held_cubic,
    piecewise_cubic,
)
from springs.backends import FLOATS, NUMPY, select_cubic

NUMBER = st.floats(-10.0, 10.0)
PIECES = st.integers(1, 12).flatmap(
    lambda count: st.tuples(
        st.lists(NUMBER, min_size=count, max_size=count).map(sorted),
        st.lists(st.tuples(*[NUMBER] * 4), min_size=count, max_size=count),
    ).map(lambda both: list(zip(*both, strict=True)))
)

evaluate, hold = (cast("Any", one).py_func for one in (piecewise_cubic, held_cubic))
"""The functions before they are compiled: tests of runs call the compiled ones."""


@given(pieces=PIECES, x=NUMBER)
def test_the_search_finds_the_piece_of_the_displacement(pieces, x):
    table = np.array([0.0] * 3 + [n for origin, row in pieces for n in (origin, *row)])
    assert len(table) == 3 + PIECE_SIZE * len(pieces)
    assert evaluate(x, table, 3, len(pieces) - 1) == NUMPY.piecewise_cubic(x, pieces)


@given(pieces=PIECES, x=NUMBER)
def test_the_branches_select_the_piece_of_the_displacement(pieces, x):
    breaks = len(pieces) - 1
    table = np.array([0.0] * 3 + [n for origin, row in pieces for n in (origin, *row)])
    branches, switching = np.ones(breaks + 1), np.full(breaks + 1, np.nan)
    hold(x, table, 3, breaks, branches, switching, 1)
    assert np.isnan(switching[0])
    assert np.array_equal(switching[1:], [origin - x for origin, _ in pieces[1:]])
    branches[1:] = np.where(switching[1:] > 0.0, 1.0, -1.0)
    assert hold(x, table, 3, breaks, branches, switching, 1) == NUMPY.piecewise_cubic(x, pieces)


def test_a_held_branch_continues_its_piece_beyond_the_breakpoint():
    pieces = [(0.0, (1.0, 0.0, 0.0, 0.0)), (2.0, (7.0, 3.0, 0.0, 0.0))]
    table = np.array([n for origin, row in pieces for n in (origin, *row)])
    assert len(table) == 2 * PIECE_SIZE
    switching = np.zeros(1)
    assert hold(3.0, table, 0, 1, np.array([1.0]), switching, 0) == 1.0
    assert hold(1.0, table, 0, 1, np.array([-1.0]), switching, 0) == 4.0


@given(pieces=PIECES, xs=st.lists(NUMBER, min_size=1, max_size=9))
def test_arrays_floats_and_conditions_agree(pieces, xs):
    on_arrays = NUMPY.piecewise_cubic(np.array(xs), pieces)
    assert [FLOATS.piecewise_cubic(x, pieces) for x in xs] == on_arrays.tolist()
    assert select_cubic(NUMPY, np.array(xs), pieces).tolist() == on_arrays.tolist()
