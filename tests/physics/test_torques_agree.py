"""Torques as expression trees and as Python functions: the same at equal states."""

import numpy as np
import pytest

from generator import read_figure
from generator.model import Model
from generator.simulation.exudyn_model.exudyn_api import exu
from generator.simulation.exudyn_model.model import build_model
from generator.simulation.exudyn_model.springs import JointKind
from generator.simulation.plan import Plan
from generator.springs_file.read import read_springs
from springs import AxisSpring, Cubic, Damping, JointSprings, Linear, SphericalLaw, SpringSet, Stop
from tests.chains import SKEW, body, chain, figure, ground, joint, one_body

PROTOTYPE = read_figure("prototype")

LAWS = (Cubic((1.0, 20.0, 5.0, 30.0), dead_zone=(-0.1, 0.3)), Linear(12.0, 0.1), Stop(-0.5, 0.4))
SPRING = AxisSpring(SKEW, LAWS, Damping(0.2, 0.1))


def torques(assembly) -> np.ndarray:
    """Present output of every connector [N m or N]."""
    kinds = exu.OutputVariableType
    given = []
    for connectors in assembly.springs.values():
        for connector in connectors:
            kind = kinds.ForceLocal if connector.kind is JointKind.PRISMATIC else kinds.TorqueLocal
            given.append(np.atleast_1d(assembly.mbs.GetObjectOutput(connector.item, kind)))
    return np.concatenate(given)


@pytest.mark.parametrize("law", list(SphericalLaw))
@pytest.mark.parametrize("seed", range(2))
def test_every_joint_of_the_prototype(law, seed) -> None:
    springs = read_springs(None, PROTOTYPE, law)
    rng = np.random.default_rng(seed)
    plan = {
        "law": law,
        "displacements": {
            n: rng.uniform(-1.2, 1.2, j.degrees_of_freedom) for n, j in PROTOTYPE.joints.items()
        },
        "velocities": {
            n: rng.uniform(-3, 3, j.degrees_of_freedom) for n, j in PROTOTYPE.joints.items()
        },
    }
    both = [
        torques(build_model(Model(PROTOTYPE, springs), Plan(python_torques=python, **plan)))
        for python in (False, True)
    ]
    assert np.max(np.abs(both[0])) > 1.0
    assert np.max(np.abs(both[0] - both[1])) < 1e-9


@pytest.mark.parametrize("value", [-0.9, -0.505, 0.0, 0.35, 1.1])
@pytest.mark.parametrize("text", ["Rs", "Ts", "Ts Rz", "Rz Ts"])
def test_every_branch_of_the_laws(text, value) -> None:
    factors = chain(text)
    values = [value if f.axis == SKEW else 0.3 for f in factors]
    springs = JointSprings("pin", (SPRING,)) if text == "Rs" else JointSprings("pin", (), (SPRING,))
    both = [
        torques(
            build_model(
                Model(one_body(factors, values), SpringSet({"pin": springs})),
                Plan(python_torques=python, velocities={"pin": np.ones(len(factors))}),
            )
        )
        for python in (False, True)
    ]
    expected = float(sum(law.torque(value) for law in LAWS)) + float(SPRING.damping.torque(1.0))
    assert abs(both[0] - both[1]).max() < 1e-9
    assert abs(abs(both[0][-1]) - abs(expected)) < 1e-9


def test_a_loop_with_a_spring_on_its_closing_joint() -> None:
    """The angle of a hinge is counted from the pose in which its loop was closed."""
    made = figure(
        [ground(), body("link")], [joint("pin", "link.near", "ground.base", chain("Rz"), (0.4,))]
    )
    springs = SpringSet({"pin": JointSprings("pin", (AxisSpring((0.0, 0.0, 1.0), LAWS),))})
    both = [
        torques(build_model(Model(made, springs), Plan(python_torques=p))) for p in (False, True)
    ]
    expected = float(sum(law.torque(0.4) for law in LAWS))
    assert np.allclose(np.abs(both), abs(expected))
