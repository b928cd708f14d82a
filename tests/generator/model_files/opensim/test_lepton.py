"""Expressions as OpenSim's parser reads them."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.model_files.opensim.lepton import MAX_DEPTH, ExpressionError, parse_expression
from generator.rotations import Array

Q = np.array([-1.3, 0.0, 0.4, 2.0])

EXPRESSIONS = {
    "-q^2": -(Q**2),
    "2^3^0.5": 2.0 ** (3.0**0.5) * np.ones(4),
    "2^-q": 2.0**-Q,
    "1-2-3*q/4/5": -1.0 - 0.15 * Q,
    "-q*-2": 2.0 * Q,
    "1.5e-1*q+.5": 0.15 * Q + 0.5,
    "step(q)+delta(q)": np.where(Q >= 0.0, 1.0, 0.0) + (Q == 0.0),
    "select(q, 1, 2)": np.where(Q != 0.0, 1.0, 2.0),
    "max(q, 1)-min(q, 0)+abs(q)": np.maximum(Q, 1.0) - np.minimum(Q, 0.0) + np.abs(Q),
    "exp(sin(q))*tanh(cos(q))": np.exp(np.sin(Q)) * np.tanh(np.cos(Q)),
    "erf(q)+erfc(q)": np.ones(4),
    "square(q)-cube(q)+recip(q+9)": Q**2 - Q**3 + 1.0 / (Q + 9.0),
    "atan2(q,2)+atan(q)": np.arctan2(Q, 2.0) + np.arctan(Q),
    "a+b;a=2*b;b=q+1": 3.0 * (Q + 1.0),
    " q + ( q ) ; ": 2.0 * Q,
}


def value(text: str, q: Array = Q) -> Array:
    with np.errstate(all="ignore"):
        return parse_expression(text, frozenset({"q"}))({"q": q})


@pytest.mark.parametrize("text", EXPRESSIONS)
def test_expressions_have_their_values(text: str):
    np.testing.assert_allclose(value(text) * np.ones(4), EXPRESSIONS[text], rtol=1e-14)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "ends too early"),
        ("q+", "ends too early"),
        ("(q", "`)` is missing"),
        ("q q", "`q` is not expected"),
        ("gust(q)", "the function `gust` is not known"),
        ("sin(q, 1)", "`sin` has 1 arguments"),
        ("q.real", "`.` is not known"),
        ("__import__('os')", "`'` is not known"),
        ("qdot", "`qdot` is not known"),
        ("a;b=1", "`a` is not known"),
        ("a;a=a", "`a` is not known"),
        ("q;1", "a definition"),
        ("(" * 1000 + "q", f"more than {MAX_DEPTH} deep"),
        ("-" * 1000 + "q", f"more than {MAX_DEPTH} deep"),
        ("q+" * 100_000 + "q", "more than 100,000 characters"),
    ],
)
def test_other_texts_are_refused(text: str, reason: str):
    with pytest.raises(ExpressionError) as refusal:
        value(text)
    assert reason in str(refusal.value)
    assert len(str(refusal.value)) < 100


def test_definitions_are_evaluated_once():
    doubled = ";".join(f"a{k}=a{k + 1}+a{k + 1}" for k in range(60))
    assert value(f"a0;{doubled};a60=q", np.array([1.0]))[0] == 2.0**60


def test_long_chains_of_definitions_are_read():
    chain = ";".join(f"a{k}=a{k + 1}+1" for k in range(5000))
    assert value(f"a0;{chain};a5000=q", np.array([1.0]))[0] == 5001.0


def test_long_sums_are_read():
    assert value("+".join(["q"] * 40_000), np.array([1.0]))[0] == 40_000.0


NUMBERS = st.floats(0.01, 100.0).map(lambda number: f"{number:.6g}")


def joined(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    operators = st.sampled_from(["+", "-", "*", "/"])
    return st.one_of(
        st.tuples(inner, operators, inner).map("".join),
        inner.map(lambda text: f"({text})"),
        inner.map(lambda text: f"-{text}"),
        inner.map(lambda text: f"sin({text})"),
    )


@given(st.recursive(NUMBERS | st.just("q"), joined, max_leaves=20))
def test_arithmetic_is_that_of_python(text: str):
    try:
        names: dict[str, Any] = {"q": 0.7, "sin": math.sin}
        expected = float(eval(text, {"__builtins__": {}}, names))
    except (ZeroDivisionError, ValueError, OverflowError):
        return
    found = float(np.asarray(value(text, np.array(0.7))))
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-9)
