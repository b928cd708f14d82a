"""Accelerations of the compiled evaluation against Exudyn's, at random states."""

from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
import pytest

from generator import read_figure
from generator.drive import Drive
from generator.figure import Figure, SiteRef
from generator.loads import LoadKind, TimedLoad
from generator.simulation.exudyn_model.agreement import ExudynEquations
from generator.simulation.exudyn_model.model import build_model
from generator.simulation.plan import Plan
from springs import (
    AxisSpring,
    CoupledAxis,
    CoupledSpring,
    Cubic,
    Damping,
    JointSprings,
    Linear,
    SphericalLaw,
    SpringSet,
    Stop,
)
from springs.coupled import CoupledExponential, CoupledTerm
from tests.chains import (
    BALL,
    SKEW,
    X,
    Y,
    Z,
    at,
    body,
    chain,
    figure,
    ground,
    joint,
    one_body,
    row,
    two_bodies,
)
from tests.compiled_models import SettableModel
from tests.poses import random_pose

TIMES = np.linspace(0.0, 1.0, 9)
NONE = SpringSet()


def wave(columns: int, coordinates: tuple[int, ...] | None = None) -> Drive:
    values = 0.4 * np.sin(3.0 * TIMES[:, None] + np.arange(columns))
    return Drive(TIMES, values, coordinates)


@dataclass(frozen=True)
class Case:
    """A figure and a plan; the states are random within `size` of the figure's pose [rad]."""

    figure: Figure
    plan: dict[str, Any] = field(default_factory=dict)
    size: float = 0.4


PROTOTYPE = read_figure("prototype")
MIXED = (BALL, chain("Rz"), chain("Rx Ry"))
KINDS = (LoadKind.GLOBAL_FORCE, LoadKind.LOCAL_FORCE, LoadKind.GLOBAL_MOMENT, LoadKind.LOCAL_MOMENT)
ROWS = ((1, 2, 3), (4, -9, 2), (0, 1, 5))
LOADS = tuple(
    TimedLoad(SiteRef(f"bar{k % 3}", "far"), kind, (0.0, 0.2, 1.0), ROWS)
    for k, kind in enumerate(KINDS)
)

LAW = CoupledExponential(
    ("one", "two", "three", "four"),
    (
        CoupledTerm((1.5, -0.5, 2.0, 0.3), (0.6, -0.4, 0.3, 0.2), 0.1),
        CoupledTerm((0.0, -2.0, 0.4, -1.0), (-0.8, 0.5, 0.0, 0.1), -0.2, 0.1),
    ),
    (0.4, -0.3, 0.8, 0.1),
    (None,) * 4,
)


def coupled_row(**fields: Any) -> Case:
    """A ball, a hinge and a universal joint under a law over all of them."""
    places = (("joint0", Y), ("joint1", (0.0, 0.0, -1.0)), ("joint2", X), ("joint0", SKEW))
    coupled = CoupledSpring(LAW, tuple(CoupledAxis(*place) for place in places))
    stop, cubic = Stop(-0.2, 0.2, 50.0, 0.1), Cubic((0.0, 4.0, 0.0, 3.0), dead_zone=(-0.1, 0.1))
    joints = {
        "joint0": JointSprings("joint0", (AxisSpring(SKEW, (cubic,), Damping(0.3)),)),
        "joint1": JointSprings("joint1", (AxisSpring(Z, (stop,), Damping(0.1, 0.4)),)),
    }
    springs = SpringSet(joints, coupled=(coupled,))
    return Case(row(3, MIXED), {"springs": springs, **fields})


def sliding(chains: str, *directions: tuple[float, float, float], **fields: Any) -> Case:
    """A row of which one joint slides on springs."""
    slides = tuple(AxisSpring(one, (Linear(200.0, 0.1),), Damping(3.0)) for one in directions)
    about = (AxisSpring(X, (Linear(5.0),), Damping(0.2)),) if "Rx" in chains else ()
    springs = SpringSet({"joint0": JointSprings("joint0", about, slides)})
    return Case(row(3, (chain(chains), BALL)), {"springs": springs, **fields})


def rigid_in_the_middle() -> Figure:
    """A rigid joint between two moving segments, written from the outboard one."""
    places = {"far": at((0.4, -0.7, 0.3), (0.1, -0.3, 0.2)), "tip": at((-0.3, 0.9, 0.5))}
    parts = [ground(), *(body(name, sites=places) for name in "abc")]
    return figure(
        parts,
        [
            joint("one", "ground.base", "a.near", BALL, (0.3, -0.2, 0.4)),
            joint("fixed", "b.tip", "a.far", ()),
            joint("two", "b.far", "c.tip", chain("Rs"), (0.5,)),
        ],
    )


CHAINS = (
    *("Rx Ry Rz", "Rz Rx Rz", "Ry R-z Rx", "Rs", "R-s", "Rs Ra", "Tx Rs", "Rs Tx", "Rs Ts", "Tx"),
    *("Tx Ty Rz", "Rz Tx Ty", "Tx Ty Tz", "Rx Ry Rz Tx Ty Tz", "Tx Ty Tz Rx Ry Rz", "Rx Ry Tz"),
)
STIFF = JointSprings("pin", (AxisSpring(SKEW, (Linear(500.0, 0.1),), Damping(0.3)),))

CASES = {
    "prototype": Case(PROTOTYPE),
    "male50": Case(read_figure("male50")),
    "prototype, free": Case(PROTOTYPE, {"free_root": True}),
    "clavicles": Case(read_figure("clavicles")),
    "pendulum": Case(read_figure("pendulum"), size=8.0),
    "loads": Case(
        row(3, MIXED), {"springs": NONE, "loads": LOADS, "gravity": (1.0, -9.0, 3.0)}, 2.5
    ),
    "coupled": coupled_row(),
    "coupled, weighted": coupled_row(law=SphericalLaw.WEIGHTED),
    "coupled, hinge driven": coupled_row(drives={"joint1": wave(1)}),
    "coupled, hinge locked": coupled_row(locked=("joint1",)),
    "coupled, ball driven": coupled_row(drives={"joint0": wave(3)}),
    "coupled, ball locked": coupled_row(locked=("joint0",)),
    "driven in part": Case(
        row(3, MIXED),
        {"springs": NONE, "drives": {"joint0": wave(1, (1,)), "joint2": wave(1, (0,))}},
    ),
    "hinges of many turns": Case(row(4, (chain("Rz"), chain("Rs"))), {"springs": NONE}, 15.0),
    "a stiff hinge of many turns": Case(
        one_body(chain("Rs"), (0.5,)), {"springs": SpringSet({"pin": STIFF})}, 15.0
    ),
    "slide outside": sliding("Rx Ry Tx", X),
    "slide inside": sliding("Tx Rx", X),
    "slide locked": sliding("Tx Rx", X, locked=("joint0",)),
    "slides": sliding("Tx Ty", X, Y),
    "rigid": Case(rigid_in_the_middle(), {"springs": NONE}),
    "long": Case(row(30, MIXED, bend=0.1), {"springs": NONE}, 0.2),
    **{
        f"{text}{', reversed' * reverse}": Case(
            two_bodies(chain(text), np.full(len(text.split()), 0.2).tolist(), reverse=reverse),
            {"springs": NONE},
            1.2,
        )
        for text in CHAINS
        for reverse in (False, True)
    },
}  # fmt: skip


@cache
def settable(name: str) -> tuple[SettableModel, ExudynEquations]:
    case = CASES[name]
    model = build_model(case.figure, Plan(**case.plan))
    return SettableModel.of(model), ExudynEquations(model)


def disagreement(name: str, seed: int, speed: float = 2.0, moment: float = 0.35) -> float:
    """Largest difference of the accelerations over the largest one."""
    compiled, equations = settable(name)
    pose = random_pose(compiled.model, seed, CASES[name].size, speed, moment)
    exact, found = equations.accelerations(pose.state), compiled.accelerations(pose)
    return float(np.max(np.abs(found - exact)) / np.max(np.abs(exact)))


@pytest.mark.parametrize("name", CASES)
def test_accelerations_are_exudyn_s(name) -> None:
    """At nine states of different speeds and times."""
    for seed in range(9):
        speed, moment = (0.0, 2.0, 10.0)[seed % 3], (0.1, 0.35, 0.9)[seed // 3 % 3]
        assert disagreement(name, seed, speed, moment) < 1e-10
