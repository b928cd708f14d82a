"""Laws as text: what is written gives what the law gives."""

from math import exp, sin, tanh

import numpy as np
import pytest

from generator.model_files.opensim.write import EXPRESSION_OPERATIONS, Expression
from springs import AxisSpring, Damping, total_torque
from springs.smooth_limit import SmoothLimit
from tests.generator.model_files.model_cases import CURVES, OTHER_CURVES

LAWS = {**CURVES, **OTHER_CURVES, "limit": (SmoothLimit(-0.5, 0.4, 20.0, 30.0, 0.3),)}


def calculated(text: str, q: float, qdot: float) -> float:
    """As Lepton does it, whose `step` is 1 at zero."""
    known = {"exp": exp, "sin": sin, "tanh": tanh, "step": lambda x: float(x >= 0.0)}
    return float(eval(text, {"__builtins__": {}}, {**known, "q": q, "qdot": qdot}))


@pytest.mark.parametrize("name", LAWS)
def test_the_text_of_a_law_gives_its_torque(name: str) -> None:
    spring = AxisSpring((1.0, 0.0, 0.0), LAWS[name], Damping(0.3, 0.7, 0.1))
    q, rate = Expression("q"), Expression("qdot")
    written = total_torque(spring.elastic, q, EXPRESSION_OPERATIONS) + spring.resistance(
        q, rate, EXPRESSION_OPERATIONS
    )
    assert " " not in written.text
    for value, speed in zip(np.linspace(-2, 2, 81), np.linspace(1, -1, 81), strict=True):
        expected = total_torque(spring.elastic, value) + spring.resistance(value, speed)
        given = calculated(written.text, float(value), float(speed))
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
    with pytest.raises(TypeError, match="several turns"):
        EXPRESSION_OPERATIONS.vector([Expression("q")])
