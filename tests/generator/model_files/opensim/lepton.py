"""Evaluates expressions as OpenSim's parser Lepton does."""

from collections.abc import Mapping
from math import atan, cos, exp, sin, sqrt, tanh

KNOWN = {
    "abs": abs,
    "atan": atan,
    "cos": cos,
    "exp": exp,
    "max": max,
    "sin": sin,
    "sqrt": sqrt,
    "step": lambda x: float(x >= 0.0),
    "tanh": tanh,
}


def evaluate(text: str, values: Mapping[str, float]) -> float:
    """The value of an expression, which may be followed by definitions."""
    assert " " not in text
    expression, *definitions = text.split(";")
    known = {**KNOWN, **values}
    for definition in reversed(definitions):
        name, _, meaning = definition.partition("=")
        known[name] = eval(meaning, {"__builtins__": {}}, known)
    return float(eval(expression, {"__builtins__": {}}, known))
