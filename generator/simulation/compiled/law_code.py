"""The laws of all joints as one generated function.

Uses of laws that leave the same lines of code share a loop over rows of the constants' table, so
the function depends on the forms of the laws only: other coefficients need no compilation.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add

import numpy as np

from generator.joint_chain import Chain
from generator.rotations import Array
from generator.simulation.compiled.compiler import compile_source
from generator.simulation.compiled.layout import LAW_SIGNATURE, CompiledLaw, IndexArray
from generator.simulation.compiled.recorder import (
    RECORDING,
    BranchingLawError,
    Recorder,
    Symbol,
    Triple,
)
from springs import (
    AxisSpring,
    CoupledAxis,
    CoupledSpring,
    JointSprings,
    ReachLaw,
    Real,
    RotationLaw,
    SpringSet,
    rotation_law,
    total_torque,
)
from springs.backends import Vector

_HEADER = '''"""Generated from the definitions of laws; constants are in the table P."""
import math

from generator.simulation.compiled.piecewise_cubic import held_cubic, piecewise_cubic


def laws(X, V, P, Z, rows, bounds, T, G, power):
    elastic, viscous = P[0], P[1]
'''

SCALES = 2
"""Number of parameters before those of the laws: scales of the elastic torques and of damping."""


@dataclass(frozen=True)
class LawUse:
    """A law recorded for certain joints.

    Attributes:
        form: lines of code, with `j0`, `j1`, ... as rows of the measured joints.
        constants: entries of its table.
        switches: number of its switching functions.
        joints: rows of the measured joints.
    """

    form: tuple[str, ...]
    constants: tuple[float, ...]
    switches: int
    joints: tuple[int, ...]


@dataclass(frozen=True)
class LawTables:
    """The compiled laws with their tables; see `Mechanism` for the shapes."""

    function: CompiledLaw
    parameters: Array
    rows: IndexArray
    bounds: IndexArray
    switches: int


def build_law_tables(uses: Sequence[LawUse]) -> LawTables:
    """Return one compiled function for the uses, with its tables.

    Uses of equal forms are adjacent; the forms are in the order of their first use.
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
            rows.append([len(parameters), switches, *use.joints])
            parameters.extend(use.constants)
            switches += use.switches
        bounds.append(len(rows))
    width = max(map(len, rows), default=2)
    table = np.zeros((len(rows), width), dtype=np.int64)
    for row, values in zip(table, rows, strict=True):
        row[: len(values)] = values
    function = compile_source("".join(lines), "laws", LAW_SIGNATURE)
    return LawTables(
        function, np.array(parameters), table, np.array(bounds, dtype=np.int64), switches
    )


def displacement_law(
    spring: AxisSpring | None, joint: int, *, holds_pieces: bool = False
) -> LawUse:
    """Record the law of one angle or translation; without a spring, no torque."""
    code = _Code(holds_pieces)
    x, v = code.read("x", "X[j0, 0]"), code.read("v", "V[j0, 0]")
    if spring is None:
        return code.use(["T[j0, 0] = 0.0"], joint)
    with _NamedLaw(spring):
        elastic = total_torque(spring.elastic, x, RECORDING)
        damping = spring.resistance(x, v, RECORDING)
    e, d = code.name(elastic), code.name(damping)
    return code.use(
        [f"T[j0, 0] = elastic * {e} + viscous * {d}", f"power[0] -= viscous * {d} * v"], joint
    )


def rotation_vector_law(law: RotationLaw, joint: int, *, holds_pieces: bool = False) -> LawUse:
    """Record the law of a rotation vector; without springs, no torque."""
    code = _Code(holds_pieces)
    r, rate = code.read_vector("x", "X[j0, {}]"), code.read_vector("v", "V[j0, {}]")
    if not law.axes and not isinstance(law, ReachLaw):
        return code.use([f"T[j0, {k}] = 0.0" for k in range(3)], joint)
    parts = (law.reach.beyond, law.reach.turn) if isinstance(law, ReachLaw) else ()
    with _NamedLaw(*law.axes, *parts):
        elastic, damping = law.torque(r, RECORDING), law.damping(r, rate, RECORDING)
    e, d = ([code.name(vector[k]) for k in range(3)] for vector in (elastic, damping))
    ends = [f"T[j0, {k}] = elastic * {e[k]} + viscous * {d[k]}" for k in range(3)]
    ends += [f"power[0] -= viscous * {d[k]} * v{k}_" for k in range(3)]
    if not law.is_conservative:
        ends += [f"power[1] -= elastic * {e[k]} * v{k}_" for k in range(3)]
    return code.use(ends, joint)


def coupled_law(
    spring: CoupledSpring,
    rows: Mapping[str, int],
    chains: Mapping[str, Chain],
    springs: SpringSet,
    *,
    holds_pieces: bool = False,
) -> LawUse:
    """Record a law over several joints, which adds to their torques.

    Args:
        spring: the law and its axes.
        rows: row of the measured joint, by joint name.
        chains: chain of every joint.
        springs: springs of the joints, whose rule says what a coordinate of the law is.
        holds_pieces: whether the bounds of the pieces of curves are breakpoints.
    """
    code = _Code(holds_pieces)
    laws = {
        axis.joint: rotation_law(
            springs.joints.get(axis.joint, JointSprings(axis.joint)),
            springs.law,
            chains[axis.joint].rotation_axes,
        )
        for axis in spring.axes
        if len(chains[axis.joint].rotations) > 1
    }
    names = list(dict.fromkeys(axis.joint for axis in spring.axes))
    rotations: dict[str, Real | Vector] = {}
    for number, name in enumerate(names):
        single = len(chains[name].rotations) == 1
        place = f"X[j{number}, "
        rotations[name] = (
            code.read(f"x{number}", place + "0]")
            if single
            else code.read_vector(f"x{number}", place + "{}]")
        )
    angles: list[Real] = []
    for axis in spring.axes:
        rotation, chain = rotations[axis.joint], chains[axis.joint]
        if isinstance(rotation, Triple):
            angles.extend(laws[axis.joint].angles([axis.direction], rotation, RECORDING))
        else:
            angles.append(_sense(axis, chain) * rotation)
    with _NamedLaw(spring):
        torques = spring.law.torques(angles, RECORDING)
    ends: list[str] = []
    for number, name in enumerate(names):
        rotation, chain = rotations[name], chains[name]
        own = [(a, t) for a, t in zip(spring.axes, torques, strict=True) if a.joint == name]
        if isinstance(rotation, Triple):
            directions, sizes = [a.direction for a, _ in own], [t for _, t in own]
            total = laws[name].torque_about(directions, sizes, rotation, RECORDING)
            components = [code.name(total[k]) for k in range(3)]
        else:
            components = [code.name(reduce(add, [_sense(a, chain) * t for a, t in own]))]
        for k, component in enumerate(components):
            ends.append(f"T[j{number}, {k}] += elastic * {component}")
            if not spring.law.is_conservative:
                ends.append(f"power[1] -= elastic * {component} * V[j{number}, {k}]")
    return code.use(ends, *(rows[name] for name in names))


def _sense(axis: CoupledAxis, chain: Chain) -> float:
    """Sign of the only rotation of a joint about the axis of a law."""
    return float(np.sign(np.dot(axis.direction, chain.rotation_axes[0])))


class _Code:
    """A recorder, and the lines that read its operands."""

    def __init__(self, holds_pieces: bool) -> None:
        self._recorder = Recorder(holds_pieces=holds_pieces)
        self._reads: list[str] = []

    def read(self, name: str, place: str) -> Symbol:
        self._reads.append(f"{name}_ = {place}" if name[-1].isdigit() else f"{name} = {place}")
        return Symbol(self._recorder, self._reads[-1].split(" = ")[0])

    def read_vector(self, name: str, place: str) -> Triple:
        x, y, z = (self.read(f"{name}{k}", place.format(k)) for k in range(3))
        return Triple((x, y, z))

    def name(self, value: Real) -> str:
        return self._recorder.name(value)

    def use(self, ends: Sequence[str], *joints: int) -> LawUse:
        """Return the use that reads, evaluates the law, and ends with these lines."""
        recorder = self._recorder
        starts = [f"j{k} = rows[u, {2 + k}]" for k in range(len(joints))]
        switching = [f"G[s + {k}] = {name}" for k, name in enumerate(recorder.switching) if name]
        return LawUse(
            (*starts, *self._reads, *recorder.lines, *switching, *ends),
            tuple(recorder.constants),
            len(recorder.switching),
            joints,
        )


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
