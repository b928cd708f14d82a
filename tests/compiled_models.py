"""Evaluation of recorded laws in plain Python, and of compiled models at chosen states."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast
from unittest.mock import patch

import numpy as np

from generator.simulation.compiled import law_code
from generator.simulation.compiled.law_code import LawUse, build_law_tables
from generator.simulation.compiled.layout import (
    CENTRE,
    POINT_ACCELERATION,
    POWERS,
    ROTATION,
    SPIN,
    SPIN_RATE,
)
from generator.simulation.compiled.marching import settle_branches
from generator.simulation.compiled.mechanism import CompiledModel, MechanismBuilder
from generator.simulation.compiled.piecewise_cubic import piecewise_cubic
from generator.simulation.exudyn_model.model import ExudynModel
from springs import FLOATS
from tests.poses import Pose


class _Sequential(type(FLOATS)):
    """Floats whose scalar product adds in the order of the recorded code, to the last digit."""

    def dot(self, one, other):
        return float(one[0] * other[0] + one[1] * other[1] + one[2] * other[2])


SEQUENTIAL = _Sequential()


@dataclass(frozen=True)
class Evaluation:
    """Torques (m, 3), switching functions with their settled signs (s,), and powers (3,)."""

    torques: np.ndarray
    switching: np.ndarray
    signs: np.ndarray
    powers: np.ndarray


def source_of(uses: Sequence[LawUse]) -> str:
    """The generated module of some uses."""
    sources: list[str] = []
    with patch.object(law_code, "compile_source", lambda source, *_: sources.append(source)):
        build_law_tables(uses)
    return sources[0]


Tables = tuple[Any, np.ndarray, np.ndarray, np.ndarray, int]
"""What `build_law_tables` returns."""


def plain_tables(uses: Sequence[LawUse]) -> Tables:
    """Tables whose function is the generated one in plain Python."""

    def execute(source: str, name: str, _signature: object):
        names: dict[str, object] = {}
        exec(source, names)
        names["piecewise_cubic"] = cast("Any", piecewise_cubic).py_func
        return names[name]

    with patch.object(law_code, "compile_source", execute):
        return build_law_tables(uses)


def evaluate(tables: Tables, displacements, rates) -> Evaluation:
    """Evaluate laws with settled branches; displacements and rates have the shape (m, 3)."""
    X, V = (np.atleast_2d(np.asarray(values, float)) for values in (displacements, rates))
    function, parameters, rows, bounds, switches = tables
    signs = np.ones(switches)
    for _ in range(switches + 2):
        torques, switching, powers = np.zeros(X.shape), np.zeros(switches), np.zeros(POWERS)
        function(X, V, parameters, signs, rows, bounds, torques, switching, powers)
        wrong = signs * switching < 0.0
        if not wrong.any():
            break
        signs = np.where(wrong, -signs, signs)
    else:
        raise AssertionError("the branches do not settle")
    return Evaluation(torques, switching, signs, powers)


@dataclass(frozen=True)
class SettableModel:
    """A compiled model with the means to set its state from displacements and rates."""

    model: ExudynModel
    compiled: CompiledModel
    builder: MechanismBuilder

    @classmethod
    def of(cls, model: ExudynModel) -> "SettableModel":
        plan = model.plan
        builder = MechanismBuilder(
            model.placement,
            model.rates,
            model.spring_set,
            model.prescribed,
            model.loads,
            plan.gravity,
            (plan.start, plan.stop),
            model.contacts,
        )
        return cls(model, builder.build(), builder)

    def state(self, pose: Pose) -> np.ndarray:
        """The state of a pose of the model."""
        self.builder.placement, self.builder.rates = pose.placement, pose.rates
        return self.builder._initial_state(self.compiled.mechanism.links)

    def settle(self, pose: Pose) -> np.ndarray:
        """Return the rates of a pose's state with settled branches; its forces are in scratch."""
        compiled, mechanism = self.compiled, self.compiled.mechanism
        state = self.state(pose)
        rates = np.zeros_like(state)
        interval = int(np.searchsorted(mechanism.knots, pose.time, "right")) - 1
        mechanism.branches[:] = 1.0
        settle_branches(
            compiled.equations,
            mechanism,
            compiled.scratch,
            interval,
            pose.time,
            state,
            rates,
            -1,
            0.0,
        )
        return rates

    def accelerations(self, pose: Pose) -> np.ndarray:
        """Angular accelerations and those of the centres of mass of all bodies, shape (B, 6)."""
        compiled, mechanism = self.compiled, self.compiled.mechanism
        self.settle(pose)
        bodies = [compiled.segment_links[name] for name in self.model.figure.bodies]
        work = compiled.scratch.work[bodies]
        spins, spin_rates = work[:, SPIN : SPIN + 3], work[:, SPIN_RATE : SPIN_RATE + 3]
        turns = work[:, ROTATION : ROTATION + 9].reshape(-1, 3, 3)
        centres = mechanism.constants[bodies, CENTRE : CENTRE + 3]
        arms = (turns @ centres[..., None])[..., 0]
        linear = work[:, POINT_ACCELERATION : POINT_ACCELERATION + 3] + self.builder.gravity
        linear = linear + np.cross(spin_rates, arms) + np.cross(spins, np.cross(spins, arms))
        return np.concatenate([spin_rates, linear], axis=1)
