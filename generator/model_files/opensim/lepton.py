"""Expressions of OpenSim's forces, which its library Lepton parses.

    expression := sum (";" NAME "=" sum)*
    sum        := product (("+" | "-") product)*
    product    := factor (("*" | "/") factor)*
    factor     := "-" factor | power
    power      := operand ("^" factor)?
    operand    := NUMBER | NAME | FUNCTION "(" sum ("," sum)* ")" | "(" sum ")"

The definitions after the expression give names that it contains. Nothing else is evaluated.
"""

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import reduce
from operator import itemgetter
from typing import Any, Final, TypeAlias

import numpy as np
from scipy import special

from generator.rotations import Array

MAX_LENGTH: Final = 100_000
"""Characters of the longest expression that is read."""

MAX_DEPTH: Final = 120
"""Largest depth of parentheses, signs and powers."""

_TOKEN = re.compile(
    r"\s*(?:([0-9]+\.?[0-9]*(?:[eE][+-]?[0-9]+)?|\.[0-9]+(?:[eE][+-]?[0-9]+)?)"
    r"|([A-Za-z_][A-Za-z0-9_]*)|([-+*/^(),]))"
)


def _step(x: Array) -> Array:
    return np.where(x >= 0.0, 1.0, 0.0)


def _delta(x: Array) -> Array:
    return np.where(x == 0.0, 1.0, 0.0)


def _cube(x: Array) -> Array:
    return x * x * x


def _select(condition: Array, one: Array, other: Array) -> Array:
    return np.where(condition != 0.0, one, other)


def _reciprocal_of(function: Callable[[Array], Array]) -> Callable[[Array], Array]:
    return lambda x: 1.0 / function(x)


_FUNCTIONS: Final[Mapping[str, tuple[int, Callable[..., Any]]]] = {
    **{name: (1, getattr(np, name)) for name in ("sqrt", "exp", "log", "abs", "floor", "ceil")},
    **{name: (1, getattr(np, name)) for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh")},
    "sec": (1, _reciprocal_of(np.cos)),
    "csc": (1, _reciprocal_of(np.sin)),
    "cot": (1, _reciprocal_of(np.tan)),
    "asin": (1, np.arcsin),
    "acos": (1, np.arccos),
    "atan": (1, np.arctan),
    "atan2": (2, np.arctan2),
    "erf": (1, special.erf),
    "erfc": (1, special.erfc),
    "step": (1, _step),
    "delta": (1, _delta),
    "square": (1, np.square),
    "cube": (1, _cube),
    "recip": (1, np.reciprocal),
    "min": (2, np.minimum),
    "max": (2, np.maximum),
    "select": (3, _select),
}
"""By name: number of arguments, and the function."""

Values: TypeAlias = Mapping[str, Array]

_Node: TypeAlias = Callable[[Values], Array]


class ExpressionError(ValueError):
    """The text is not an expression, or not one of the variables that are known."""


def parse_expression(text: str, variables: frozenset[str]) -> _Node:
    """Return a function of the values of `variables`, arrays of one shape.

    Raises ExpressionError with a reason that quotes one word of the text at most.
    """
    if len(text) > MAX_LENGTH:
        raise ExpressionError(f"it has more than {MAX_LENGTH:,} characters")
    first, *definitions = [part for part in text.split(";") if part.strip()] or [""]
    known, steps = set(variables), list[tuple[str, _Node]]()
    for definition in reversed(definitions):  # each may contain the names of later ones
        name, equals, meaning = (part.strip() for part in definition.partition("="))
        if not equals or not name:
            raise ExpressionError("a definition after `;` is a name, `=` and an expression")
        steps.append((name, _Parser(meaning, known).parse()))
        known.add(name)
    result = _Parser(first, known).parse()

    def evaluate(values: Values) -> Array:
        found = dict(values)
        for name, node in steps:
            found[name] = node(found)
        return result(found)

    return evaluate


class _Parser:
    """Parser of one expression without definitions."""

    def __init__(self, text: str, known: Collection[str]) -> None:
        self._known = known
        self._tokens: list[tuple[str, str]] = []
        self._place, self._depth = 0, 0
        position, end = 0, len(text.rstrip())
        while position < end:
            match = _TOKEN.match(text, position)
            if match is None:
                raise ExpressionError(f"`{text[position:].strip()[:1]}` is not known in it")
            kind = ("number", "name", "sign")[match.lastindex - 1 if match.lastindex else 0]
            self._tokens.append((kind, match[match.lastindex or 0]))
            position = match.end()

    def parse(self) -> _Node:
        """Return the function of the expression. Raises ExpressionError."""
        node = self._sum()
        if self._place < len(self._tokens):
            raise ExpressionError(f"`{self._tokens[self._place][1][:20]}` is not expected")
        return node

    def _peek(self) -> str:
        return self._tokens[self._place][1] if self._place < len(self._tokens) else ""

    def _take(self, sign: str) -> bool:
        found = self._peek() == sign
        self._place += found
        return found

    def _expect(self, sign: str) -> None:
        if not self._take(sign):
            raise ExpressionError(f"`{sign}` is missing")

    def _sum(self) -> _Node:
        terms = [self._product()]
        while self._peek() in ("+", "-"):
            if self._take("+"):
                terms.append(self._product())
            else:
                self._place += 1
                terms.append(_called(np.negative, self._product()))
        return terms[0] if len(terms) == 1 else _joined(np.add, terms)

    def _product(self) -> _Node:
        factors = [self._factor()]
        while self._peek() in ("*", "/"):
            if self._take("*"):
                factors.append(self._factor())
            else:
                self._place += 1
                factors.append(_called(np.reciprocal, self._factor()))
        return factors[0] if len(factors) == 1 else _joined(np.multiply, factors)

    def _factor(self) -> _Node:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise ExpressionError(f"it is nested more than {MAX_DEPTH} deep")
        if self._take("-"):
            node = _called(np.negative, self._factor())
        else:
            node = self._operand()
            if self._take("^"):
                node = _called(np.power, node, self._factor())
        self._depth -= 1
        return node

    def _operand(self) -> _Node:
        if self._place >= len(self._tokens):
            raise ExpressionError("it ends too early")
        kind, word = self._tokens[self._place]
        self._place += 1
        if kind == "number":
            number = np.float64(word)
            return lambda values: np.asarray(number)
        if word == "(":
            node = self._sum()
            self._expect(")")
            return node
        if kind == "name" and self._take("("):
            return self._call(word)
        if kind != "name" or word not in self._known:
            raise ExpressionError(f"`{word[:20]}` is not known in it")
        return itemgetter(word)

    def _call(self, word: str) -> _Node:
        if word not in _FUNCTIONS:
            raise ExpressionError(f"the function `{word[:20]}` is not known")
        count, function = _FUNCTIONS[word]
        arguments = [self._sum()]
        while self._take(","):
            arguments.append(self._sum())
        self._expect(")")
        if len(arguments) != count:
            raise ExpressionError(f"`{word}` has {count} arguments")
        return _called(function, *arguments)


def _called(function: Callable[..., Any], *arguments: _Node) -> _Node:
    return lambda values: function(*(argument(values) for argument in arguments))


def _joined(function: Callable[..., Any], nodes: Sequence[_Node]) -> _Node:
    return lambda values: reduce(function, (node(values) for node in nodes))
