"""The laws of all joints as one generated function.

Uses of laws that leave the same lines of code share a loop over rows of the constants' table, so
the function depends on the forms of the laws only: other coefficients need no compilation.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, wraps
from typing import ParamSpec, TypeAlias, cast

import numpy as np

from generator.rotations import Array
from generator.simulation.compiled.compiler import compile_source
from generator.simulation.compiled.layout import LAW_SIGNATURE, TONE, CompiledLaw, IndexArray
from generator.simulation.compiled.recorder import (
    RECORDING,
    BranchingLawError,
    Recorder,
    Symbol,
    Triple,
)
from springs import (
    AxisSpring,
    CoupledSpring,
    ReachLaw,
    Real,
    RotationLaw,
    total_torque,
)
from springs.tone.law import AxisTone, vector_tone

_HEADER = '''"""Generated from the definitions of laws; constants are in the table P."""
import math

from generator.simulation.compiled.piecewise_cubic import piecewise_cubic


def laws(X, V, P, Z, rows, bounds, T, G, power):
    elastic, viscous = P[0], P[1]
'''

SCALES = 2
"""Number of parameters before those of the laws: scales of the elastic torques and of damping."""

Place: TypeAlias = tuple[int, int]
"""A measured joint, and the component of its displacement."""


@dataclass(frozen=True)
class LawUse:
    """A law recorded for certain joints.

    Attributes:
        form: lines of code, with `i0`, `i1`, ... as the columns.
        constants: entries of its table.
        switches: number of its switching functions.
        columns: rows of the measured joints, and components of displacements.
    """

    form: tuple[str, ...]
    constants: tuple[float, ...]
    switches: int
    columns: tuple[int, ...]


def build_law_tables(
    uses: Sequence[LawUse],
) -> tuple[CompiledLaw, Array, IndexArray, IndexArray, int]:
    """Return one compiled function for the uses, its tables and its switching functions' number.

    The tables are `parameters`, `law_rows` and `law_bounds` of `Mechanism`. Uses of equal forms are
    adjacent; the forms are in the order of their first use.
    """
    by_form: dict[tuple[str, ...], list[LawUse]] = {}
    for use in uses:
        by_form.setdefault(use.form, []).append(use)
    lines, bounds = [_HEADER], [0]
    rows: list[list[int]] = []
    parameters, switches = [1.0] * SCALES, 0
    for number, (form, same) in enumerate(by_form.items()):
        lines.append(f"    for u in range(bounds[{number}], bounds[{number + 1}]):\n")
        lines.append("        o, s = rows[u, 0], rows[u, 1]\n")
        lines.extend(f"        {line}\n" for line in form)
        for use in same:
            rows.append([len(parameters), switches, *use.columns])
            parameters.extend(use.constants)
            switches += use.switches
        bounds.append(len(rows))
    width = max(map(len, rows), default=2)
    table = np.zeros((len(rows), width), dtype=np.int64)
    for row, values in zip(table, rows, strict=True):
        row[: len(values)] = values
    function = compile_source("".join(lines), "laws", LAW_SIGNATURE)
    return function, np.array(parameters), table, np.array(bounds, dtype=np.int64), switches


Recorded = ParamSpec("Recorded")


def _recorded_once(record: Callable[Recorded, LawUse]) -> Callable[Recorded, LawUse]:
    """Keep what was recorded of laws that are values: most are those of the run before as well."""
    kept = lru_cache(maxsize=512)(record)

    @wraps(record)
    def recorded(*args: Recorded.args, **options: Recorded.kwargs) -> LawUse:
        return (kept if _is_value(args) else record)(*args, **options)

    return recorded


_PARTS = (
    *("law", "increasing", "decreasing"),
    *("elastic", "springs", "axes", "reach", "beyond", "turn"),
)
"""Attributes of springs and laws that are laws, or hold some."""


def _is_value(part: object) -> bool:
    """Return whether what is equal stays equal: not so for a law of a class that can change."""
    if isinstance(part, tuple):
        return all(map(_is_value, cast("tuple[object, ...]", part)))
    if type(part).__hash__ in (object.__hash__, None):
        return False
    own = getattr(part, "__dict__", {})
    return all(_is_value(own[name]) for name in _PARTS if name in own)


@_recorded_once
def displacement_law(
    spring: AxisSpring | None, place: Place, *, holds_pieces: bool = False
) -> LawUse:
    """Record the law of one displacement; without a spring, no torque."""
    code = _Code(holds_pieces)
    x, v, torque = code.read(place)
    if spring is None:
        return code.use([f"{torque} = 0.0"])
    with _NamedLaw(spring):
        elastic = total_torque(spring.elastic, x, RECORDING)
        damping = spring.resistance(x, v, RECORDING)
    e, d = code.name(elastic), code.name(damping)
    return code.use(
        [f"{torque} = elastic * {e} + viscous * {d}", f"power[0] -= viscous * {d} * {v.name}"]
    )


@_recorded_once
def rotation_vector_law(law: RotationLaw, joint: int, *, holds_pieces: bool = False) -> LawUse:
    """Record the law of a rotation vector; without springs, no torque."""
    code = _Code(holds_pieces)
    r, rate, torque = code.read_vector(joint)
    if not law.axes and not isinstance(law, ReachLaw):
        return code.use([f"{torque[k]} = 0.0" for k in range(3)])
    parts = (law.reach.beyond, law.reach.turn) if isinstance(law, ReachLaw) else ()
    with _NamedLaw(*law.axes, *parts):
        elastic, damping = law.torque(r, RECORDING), law.damping(r, rate, RECORDING)
    e, d, v = ([code.name(vector[k]) for k in range(3)] for vector in (elastic, damping, rate))
    ends = [f"{torque[k]} = elastic * {e[k]} + viscous * {d[k]}" for k in range(3)]
    ends += [f"power[0] -= viscous * {d[k]} * {v[k]}" for k in range(3)]
    if not law.is_conservative:
        ends += [f"power[1] -= elastic * {e[k]} * {v[k]}" for k in range(3)]
    return code.use(ends)


@_recorded_once
def coupled_law(
    spring: CoupledSpring,
    places: tuple[tuple[Place, float] | None, ...],
    vectors: tuple[tuple[str, int, RotationLaw], ...],
    *,
    holds_pieces: bool = False,
) -> LawUse:
    """Record a law over several joints, which adds to their torques.

    Args:
        spring: the law and its axes.
        places: displacement of the coordinate of each axis of the law, with 1 or -1 for the sense
            in which it is counted; None where the joint is measured by its rotation vector.
        vectors: joints with rotation vectors: name, measured joint and law.
        holds_pieces: whether the bounds of the pieces of curves are breakpoints.
    """
    code = _Code(holds_pieces)
    rotations = {name: (law, *code.read_vector(joint)) for name, joint, law in vectors}
    singles: dict[int, tuple[Symbol, Symbol, str]] = {}
    angles: list[Real] = []
    for k, (axis, place) in enumerate(zip(spring.axes, places, strict=True)):
        if place is None:
            law, r, *_ = rotations[axis.joint]
            angles.extend(law.angles([axis.direction], r, RECORDING))
        else:
            singles[k] = code.read(place[0])
            angles.append(place[1] * singles[k][0])
    with _NamedLaw(spring):
        torques = spring.law.torques(angles, RECORDING)
    forces: list[tuple[str, str, str]] = []
    for k, (_, v, torque) in singles.items():
        place = places[k]
        assert place is not None
        forces.append((torque, code.name(place[1] * torques[k]), v.name))
    for name, (law, r, rate, torque) in rotations.items():
        own = [
            (a.direction, t) for a, t in zip(spring.axes, torques, strict=True) if a.joint == name
        ]
        total = law.torque_about([d for d, _ in own], [t for _, t in own], r, RECORDING)
        forces += [(torque[k], code.name(total[k]), code.name(rate[k])) for k in range(3)]
    ends = [f"{torque} += elastic * {force}" for torque, force, _ in forces]
    if not spring.law.is_conservative:
        ends += [f"power[1] -= elastic * {force} * {rate}" for _, force, rate in forces]
    return code.use(ends)


@_recorded_once
def tone_law(tone: AxisTone, place: Place, activation: int) -> LawUse:
    """Record the tone about an axis, which adds to the torque of a displacement.

    Args:
        tone: Tone about the axis of the displacement.
        place: Displacement.
        activation: Row that measures the activation.
    """
    code = _Code(holds_pieces=False)
    active, _, _ = code.read((activation, 0))
    x, v, torque = code.read(place)
    own = code.name(tone.torque(x, v, active, RECORDING))
    return code.use([f"{torque} += {own}", f"power[{TONE}] += {own} * {v.name}"])


@_recorded_once
def vector_tone_law(
    axes: tuple[AxisTone, ...], joint: int, activation: int, *, is_righting: bool = False
) -> LawUse:
    """Record tones about the components of a rotation vector.

    They add to the torques of a joint. Those of righting stand alone, and their power is that of
    the torques where they act.
    """
    code = _Code(holds_pieces=False)
    active, _, _ = code.read((activation, 0))
    r, rate, torque = code.read_vector(joint)
    total = vector_tone(axes, r, rate, active, RECORDING)
    own = [code.name(total[k]) for k in range(3)]
    if is_righting:
        return code.use([f"{torque[k]} = {own[k]}" for k in range(3)])
    ends = [f"{torque[k]} += {own[k]}" for k in range(3)]
    ends += [f"power[{TONE}] += {own[k]} * {code.name(rate[k])}" for k in range(3)]
    return code.use(ends)


class _Code:
    """A recorder, and the lines that read the displacements and rates of its law."""

    def __init__(self, holds_pieces: bool) -> None:
        self._recorder, self._holds_pieces = Recorder(), holds_pieces
        self._reads: list[str] = []
        self._columns: list[int] = []

    def read(self, place: Place) -> tuple[Symbol, Symbol, str]:
        """Return a displacement, its rate, and where its torque is stored."""
        entry = f"[{self._column(place[0])}, {self._column(place[1])}]"
        return self._symbol("X" + entry), self._symbol("V" + entry), "T" + entry

    def read_vector(self, joint: int) -> tuple[Triple, Triple, list[str]]:
        """Return a rotation vector, its rate, and where the components of its torque are stored."""
        row = self._column(joint)
        entries = [f"[{row}, {k}]" for k in range(3)]
        x, v = ([self._symbol(name + entry) for entry in entries] for name in "XV")
        return Triple((x[0], x[1], x[2])), Triple((v[0], v[1], v[2])), ["T" + e for e in entries]

    def _column(self, value: int) -> str:
        """Return the name of a number in the row of the use."""
        self._columns.append(value)
        name = f"i{len(self._columns) - 1}"
        self._reads.append(f"{name} = rows[u, {len(self._columns) + 1}]")
        return name

    def _symbol(self, entry: str) -> Symbol:
        name = f"x{len(self._reads)}"
        self._reads.append(f"{name} = {entry}")
        return Symbol(self._recorder, name)

    def name(self, value: Real) -> str:
        """Return the name of a number in the code."""
        return self._recorder.name(value)

    def use(self, ends: Sequence[str]) -> LawUse:
        """Return the use that reads, evaluates the law, and ends with these lines."""
        recorder = self._recorder
        switching = [f"G[s + {k}] = {name}" for k, name in enumerate(recorder.switching)]
        constants, switches = recorder.tables(holds_pieces=self._holds_pieces)
        form = (*self._reads, *recorder.lines, *switching, *ends)
        return LawUse(form, tuple(constants), switches, tuple(self._columns))


class _NamedLaw:
    """Add the names of the laws to the error of one that cannot be recorded."""

    def __init__(self, *springs: AxisSpring | CoupledSpring) -> None:
        self._springs = springs

    def __enter__(self) -> None: ...

    def __exit__(self, kind: object, failure: BaseException | None, trace: object) -> None:
        if isinstance(failure, BranchingLawError):
            laws = [
                type(law).__name__
                for spring in self._springs
                for law in (spring.elastic if isinstance(spring, AxisSpring) else (spring.law,))
            ]
            names = ", ".join(dict.fromkeys(laws))
            raise BranchingLawError(f"{names} cannot be compiled: {failure}") from None
