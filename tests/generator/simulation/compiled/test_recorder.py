"""Lines of code that arithmetic with symbols leaves."""

import math

import numpy as np
import pytest

from generator.simulation.compiled.recorder import (
    RECORDING,
    BranchingLawError,
    Recorder,
    Symbol,
    Triple,
)


def value_of(recorder: Recorder, result: Symbol, signs=(), **arguments: float) -> float:
    """Execute the recorded lines with the arguments."""
    names = {"math": math, "P": recorder.constants, "o": 0, "Z": signs, "s": 0, **arguments}
    for line in recorder.lines:
        exec(line, names)
    return names[result.name]


@pytest.fixture
def recorder() -> Recorder:
    return Recorder()


def test_every_operation_with_numbers_on_either_side(recorder):
    x, y = Symbol(recorder, "x"), Symbol(recorder, "y")
    three = np.float64(3.0)  # numpy's numbers must not take over
    terms = (x + y, x + 2.0, 2.0 + x, x - y, x - 2.0, 2.0 - x, x * y, x * 2.0, three * x, x / y)
    terms = (*terms, x / three, three / x, -x, three - x, three + x)
    a, b = 0.7, -1.3
    expected = (a + b, a + 2.0, 2.0 + a, a - b, a - 2.0, 2.0 - a, a * b, a * 2.0, 3.0 * a, a / b)
    expected = (*expected, a / 3.0, 3.0 / a, -a, 3.0 - a, 3.0 + a)
    assert [value_of(recorder, term, x=a, y=b) for term in terms] == list(expected)


def test_functions_and_vectors(recorder):
    ops, x = RECORDING, Symbol(recorder, "x")
    v, w = ops.vector((x, 2.0, -x)), Triple((x, x, 3.0))
    cases = {
        ops.sin(x): math.sin(0.7),
        ops.tanh(x): math.tanh(0.7),
        ops.exp(x): math.exp(0.7),
        ops.dot(v, w): 0.7 * 0.7 + 2.0 * 0.7 - 0.7 * 3.0,
        ops.norm(v): math.sqrt(0.49 + 4.0 + 0.49),
        ops.part(ops.scaled(x, v - w), 1): 0.7 * 1.3,
        ops.part(v + w, 2): -0.7 + 3.0,
    }
    for term, expected in cases.items():
        assert value_of(recorder, term, x=0.7) == pytest.approx(expected, rel=1e-15)


def test_an_operation_is_recorded_once(recorder):
    x, y = Symbol(recorder, "x"), Symbol(recorder, "y")
    assert (x * y).name == (x * y).name != (y * x).name
    assert len(recorder.lines) == 2


def test_a_comparison_holds_its_branch_until_the_sign_changes(recorder):
    x, y = Symbol(recorder, "x"), Symbol(recorder, "y")
    result = RECORDING.where(x < y, 1.0, RECORDING.where(x > y, 2.0, 3.0))
    for signs, expected in (((-1, 1), 1.0), ((1, 1), 1.0), ((1, -1), 2.0), ((-1, -1), 3.0)):
        assert value_of(recorder, result, signs, x=5.0, y=6.0) == expected
    functions = [Symbol(recorder, name) for name in recorder.switching]
    assert [value_of(recorder, one, (1, 1), x=5.0, y=6.5) for one in functions] == [-1.5, 1.5]


def test_equal_comparisons_share_a_switching_function(recorder):
    x, y = Symbol(recorder, "x"), Symbol(recorder, "y")
    for _ in range(2):
        RECORDING.where(x < y, x, y)
    assert len(recorder.switching) == 1


def test_pieces_that_join_smoothly_have_no_breakpoint(recorder):
    x = Symbol(recorder, "x")
    result = RECORDING.smooth_where(x < 0.5, x, -x)
    assert [value_of(recorder, result, x=value) for value in (0.4, 0.6)] == [0.4, -0.6]
    assert recorder.switching == []


def test_conditions_of_constants_are_decided_at_once(recorder):
    x = Symbol(recorder, "x")
    assert RECORDING.where(1.0 < 2.0, x, 0.0) is x
    assert RECORDING.smooth_where(1.0 > 2.0, 0.0, x) is x
    assert recorder.lines == []


@pytest.mark.parametrize("decide", [bool, lambda x: x < 1.0 and x, lambda x: max(x, 0.0)])
def test_a_decision_by_if_is_refused(recorder, decide):
    with pytest.raises(BranchingLawError, match=r"decides by `ops.where`, not by `if`"):
        decide(Symbol(recorder, "x"))
