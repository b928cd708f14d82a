"""Laws as text: what is written gives what the law gives."""

import numpy as np
import pytest

from generator.model_files.opensim.expression import (
    EXPRESSION_OPERATIONS,
    Expression,
    with_definitions,
)
from springs import AxisSpring, Damping, total_torque
from springs.smooth_limit import SmoothLimit
from tests.generator.model_files.model_cases import CURVES, OTHER_CURVES
from tests.generator.model_files.opensim.lepton import evaluate

LAWS = {**CURVES, **OTHER_CURVES, "limit": (SmoothLimit(-0.5, 0.4, 20.0, 30.0, 0.3),)}


@pytest.mark.parametrize("name", LAWS)
def test_the_text_of_a_law_gives_its_torque(name: str) -> None:
    spring = AxisSpring((1.0, 0.0, 0.0), LAWS[name], Damping(0.3, 0.7, 0.1))
    q, rate = Expression("q"), Expression("qdot")
    written = total_torque(spring.elastic, q, EXPRESSION_OPERATIONS) + spring.resistance(
        q, rate, EXPRESSION_OPERATIONS
    )
    for value, speed in zip(np.linspace(-2, 2, 81), np.linspace(1, -1, 81), strict=True):
        expected = total_torque(spring.elastic, value) + spring.resistance(value, speed)
        given = evaluate(written.text, {"q": float(value), "qdot": float(speed)})
        assert given == pytest.approx(float(expected), rel=1e-12, abs=1e-12)


def test_what_changes_nothing_is_not_written() -> None:
    q = Expression("q")
    assert (q * 1.0 + 0.0).text == "q"
    assert (0.0 + 1.0 * q / 1.0).text == "q"
    assert (q * 0.0 + q).text == "q"
    assert (q - 0.0 * q).text == "q"
    assert (0.0 - q).text == "(0.0-q)"
    assert (-q).text == "((-1.0)*q)"


def test_an_expression_is_no_vector() -> None:
    with pytest.raises(TypeError, match="not a vector"):
        EXPRESSION_OPERATIONS.vector([Expression("q")])


def test_definitions_are_those_that_are_needed() -> None:
    definitions = {
        "b": Expression("2*c"),
        "unused": Expression("d"),
        "c": Expression("cos(q)"),
        "d": Expression("1"),
    }
    assert with_definitions(Expression("q"), definitions) == "q"
    text = with_definitions(Expression("a*b"), definitions)
    assert text == "a*b;b=2*c;c=cos(q)"
    assert evaluate(text, {"a": 3.0, "q": 0.0}) == 6.0
