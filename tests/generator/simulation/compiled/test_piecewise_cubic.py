"""Curves of many pieces: the compiled search finds numpy's piece."""

from typing import Any, cast

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from generator.simulation.compiled.piecewise_cubic import PIECE_SIZE, piecewise_cubic
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


@given(pieces=PIECES, x=NUMBER)
def test_the_search_finds_the_piece_of_the_displacement(pieces, x):
    table = np.array([0.0] * 3 + [n for origin, row in pieces for n in (origin, *row)])
    assert len(table) == 3 + PIECE_SIZE * len(pieces)
    assert evaluate(x, table, 3, len(pieces) - 1) == NUMPY.piecewise_cubic(x, pieces)


@given(pieces=PIECES, xs=st.lists(NUMBER, min_size=1, max_size=9))
def test_arrays_floats_and_conditions_agree(pieces, xs):
    on_arrays = NUMPY.piecewise_cubic(np.array(xs), pieces)
    assert [FLOATS.piecewise_cubic(x, pieces) for x in xs] == on_arrays.tolist()
    assert select_cubic(NUMPY, np.array(xs), pieces).tolist() == on_arrays.tolist()
