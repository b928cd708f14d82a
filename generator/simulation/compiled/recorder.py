"""A kind of number that records a law as lines of code.

The laws of `springs` are written once, for every kind of number. Evaluated with a `Symbol`, a law
leaves a line of code for each of its operations. Constants become entries of a table, so the code
depends on the form of a law and not on its coefficients. The comparison of a breakpoint becomes a
*switching function*, whose sign is data: the code holds one branch until the integrator has located
the zero of the function and changes the sign. Pieces that join smoothly are chosen by the value.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from generator.simulation.compiled.piecewise_cubic import FIRST_SWITCH, PIECES_AT
from springs import Operations, Real
from springs.backends import CubicPieces, Vector

_BRANCHING = "a law decides by `ops.where`, not by `if`"


class BranchingLawError(TypeError):
    """A law decides by `if` about a number that is not known before the run."""


@dataclass(eq=False)
class Recorder:
    """The lines of code of the laws of one joint or one coupled law.

    Attributes:
        lines: assignments, each to a new name.
        constants: entries of the table that the lines read as `P[o + k]`.
        switching: names of the switching functions, whose signs the lines read as `Z[s + k]`.
    """

    lines: list[str] = field(default_factory=list[str])
    constants: list[float] = field(default_factory=list[float])
    switching: list[str] = field(default_factory=list[str])
    _names: dict[str, str] = field(default_factory=dict[str, str])
    _curves: list[tuple[int, CubicPieces]] = field(default_factory=list[tuple[int, CubicPieces]])

    def name(self, value: "Real") -> str:
        """Return the name of a symbol, or the table's entry of a constant."""
        if isinstance(value, Symbol):
            return value.name
        self.constants.append(float(value))
        return f"P[o + {len(self.constants) - 1}]"

    def record(self, form: str, *operands: Real) -> "Symbol":
        """Record an operation; the same one on the same operands is recorded once."""
        text = form.format(*map(self.name, operands))
        if text not in self._names:
            self._names[text] = f"v{len(self._names)}"
            self.lines.append(f"{self._names[text]} = {text}")
        return Symbol(self, self._names[text])

    def record_piecewise_cubic(self, value: "Real", pieces: CubicPieces) -> "Symbol":
        """Record the cubic of one of the pieces; they are data, so all curves leave this line."""
        curve = len(self.constants)
        self.constants += [0.0, len(pieces) - 1, -1.0]
        self._curves.append((curve, pieces))
        return self.record(f"piecewise_cubic({{}}, P, o, {curve}, Z, G, s)", value)

    def tables(self, *, holds_pieces: bool) -> tuple[list[float], int]:
        """Return the constants with those of all pieces, and the number of switching functions.

        Args:
            holds_pieces: whether the bounds of pieces are breakpoints.
        """
        constants, switches = list(self.constants), len(self.switching)
        for curve, pieces in self._curves:
            constants[curve + PIECES_AT] = len(constants)
            if holds_pieces:
                constants[curve + FIRST_SWITCH] = switches
                switches += len(pieces) - 1
            for origin, coefficients in pieces:
                constants += [origin, *coefficients]
        return constants, switches

    def switch(self, comparison: "Comparison") -> str:
        """Return the held sign of a comparison's switching function."""
        difference = self.record("{} - {}", comparison.larger, comparison.smaller)
        if difference.name not in self.switching:
            self.switching.append(difference.name)
        return f"Z[s + {self.switching.index(difference.name)}]"


def _operator(form: str) -> "Callable[[Symbol, Real], Symbol]":
    """Return the method that records an operation with another number."""
    return lambda symbol, other: symbol.recorder.record(form, symbol, other)


@dataclass(eq=False, slots=True)  # not frozen: a law makes hundreds
class Symbol:
    """A number that is known at run time; arithmetic with it is recorded."""

    recorder: Recorder
    name: str

    __array_ufunc__ = None  # so that numpy's numbers leave arithmetic with symbols to them

    __add__ = _operator("{0} + {1}")
    __radd__ = _operator("{1} + {0}")
    __sub__ = _operator("{0} - {1}")
    __rsub__ = _operator("{1} - {0}")
    __mul__ = _operator("{0} * {1}")
    __rmul__ = _operator("{1} * {0}")
    __truediv__ = _operator("{0} / {1}")
    __rtruediv__ = _operator("{1} / {0}")

    def __neg__(self) -> "Symbol":
        """Record the negative."""
        return self.recorder.record("-{}", self)

    def __lt__(self, other: Real) -> "Comparison":
        """Return the condition that a branch asks for."""
        return Comparison(other, self)

    def __gt__(self, other: Real) -> "Comparison":
        """Return the condition that a branch asks for."""
        return Comparison(self, other)

    def __bool__(self) -> bool:
        """Raise BranchingLawError: the value is not known while the law is recorded."""
        raise BranchingLawError(_BRANCHING)


@dataclass(frozen=True, eq=False)
class Comparison:
    """The condition larger > smaller."""

    larger: Real
    smaller: Real

    def __bool__(self) -> bool:
        """Raise BranchingLawError: the outcome is not known while the law is recorded."""
        raise BranchingLawError(_BRANCHING)


@dataclass(frozen=True)
class Triple:
    """A vector of three numbers."""

    parts: tuple[Real, Real, Real]

    def __getitem__(self, index: int) -> Real:
        """Return a component."""
        return self.parts[index]

    def __add__(self, other: "Triple") -> "Triple":
        """Return the sum."""
        x, y, z = (a + b for a, b in zip(self.parts, other.parts, strict=True))
        return Triple((x, y, z))

    def __sub__(self, other: "Triple") -> "Triple":
        """Return the difference."""
        x, y, z = (a - b for a, b in zip(self.parts, other.parts, strict=True))
        return Triple((x, y, z))


class _Recording:
    """Operations on symbols; the sign of its switching function selects a branch."""

    def where(self, condition: Real, yes: Real, no: Real) -> Real:
        if not isinstance(condition, Comparison):
            return yes if condition else no
        recorder = _recorder(condition.larger, condition.smaller)
        sign = recorder.switch(condition)
        return recorder.record("{} if " + sign + " > 0.0 else {}", yes, no)

    def smooth_where(self, condition: Real, yes: Real, no: Real) -> Real:
        if not isinstance(condition, Comparison):
            return yes if condition else no
        recorder = _recorder(condition.larger, condition.smaller)
        operands = yes, condition.larger, condition.smaller, no
        return recorder.record("{} if {} > {} else {}", *operands)

    def piecewise_cubic(self, value: Real, pieces: CubicPieces) -> Real:
        return _recorder(value).record_piecewise_cubic(value, pieces)

    def sin(self, value: Real) -> Real:
        return _recorder(value).record("math.sin({})", value)

    def cos(self, value: Real) -> Real:
        return _recorder(value).record("math.cos({})", value)

    def atan2(self, y: Real, x: Real) -> Real:
        return _recorder(y, x).record("math.atan2({}, {})", y, x)

    def sqrt(self, value: Real) -> Real:
        return _recorder(value).record("math.sqrt({})", value)

    def tanh(self, value: Real) -> Real:
        return _recorder(value).record("math.tanh({})", value)

    def exp(self, value: Real) -> Real:
        return _recorder(value).record("math.exp({})", value)

    def vector(self, parts: Sequence[Real]) -> Vector:
        x, y, z = parts
        return Triple((x, y, z))

    def part(self, vector: Vector, index: int) -> Real:
        return vector[index]

    def dot(self, one: Vector, other: Vector) -> Real:
        return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]

    def norm(self, vector: Vector) -> Real:
        square = self.dot(vector, vector)
        return _recorder(square).record("math.sqrt({})", square)

    def scaled(self, factor: Real, vector: Vector) -> Vector:
        return Triple((factor * vector[0], factor * vector[1], factor * vector[2]))


def _recorder(*values: Any) -> Recorder:
    return next(value.recorder for value in values if isinstance(value, Symbol))


RECORDING: Operations = _Recording()
