"""Runs under the law of coordinates: both integrators, energy, the pole, two rotations."""

from dataclasses import replace

import numpy as np
import pytest

from generator.diagnostics import ModelError
from generator.figure import AxisKind, JointAxis
from generator.kinematics.placement import forward_kinematics
from generator.kinematics.tree import build_tree
from generator.model import Model
from generator.recording import Ending
from generator.simulation.exudyn_model.model import build_model
from generator.simulation.plan import Integrator, Plan
from generator.simulation.run import simulate
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
    total_torque,
)
from springs.coupled import CoupledExponential, CoupledTerm
from tests.chains import (
    ACROSS,
    BALL,
    SKEW,
    X,
    Y,
    Z,
    body,
    chain,
    figure,
    ground,
    joint,
    negative,
    one_body,
)
from tests.command import run as run_command
from tests.compiled_models import SettableModel
from tests.poses import Pose

CURVES = (Linear(6.0, 0.2), Cubic((0.5, 8.0, -2.0, 10.0)), Linear(3.0, -0.3))


def springs(axes, *, damping=0.0) -> SpringSet:
    about = tuple(
        AxisSpring(axis, (law,), Damping(damping)) for axis, law in zip(axes, CURVES, strict=False)
    )
    return SpringSet({"pin": JointSprings("pin", about)}, SphericalLaw.COORDINATES)


@pytest.mark.parametrize(
    ("factors", "axes"), [(BALL, (X, Y, Z)), (chain("Rz Rx"), (Z, X)), (chain("Rx Ry"), (X, Y))]
)
def test_both_integrators_agree(factors, axes):
    figure = one_body(factors, (0.3, 0.4, -0.2)[: len(factors)])
    model = Model(figure, springs(axes, damping=0.05))
    plan = Plan(stop=0.2, tolerance=1e-5)
    compiled = simulate(model, plan)
    stepped = simulate(model, replace(plan, step=2e-3, integrator=Integrator.EXUDYN))
    assert compiled.displacements["pin"] == pytest.approx(stepped.displacements["pin"], abs=1e-4)
    moved = compiled.displacements["pin"]
    assert np.ptp(moved, axis=0).min() > 0.01


def test_a_tumbling_body_keeps_its_energy():
    link = body("link", centre=(0.0, -0.1, 0.0))
    figure = one_body(BALL, (0.2, 0.1, 0.3), link)
    plan = Plan(stop=1.0, tolerance=1e-10, velocities={"pin": (3.0, -2.0, 1.0)})
    run = simulate(Model(figure, springs((X, Y, Z))), plan)
    total = run.energy_balance
    assert np.ptp(run.displacements["pin"][:, 1]) > 0.3
    assert np.ptp(total) < 1e-8


@pytest.mark.parametrize("integrator", Integrator)
def test_a_run_ends_at_the_pole(integrator):
    """The middle rotation is thrown through 90 deg while the others are at rest."""
    link = body("link", centre=(0.0, -0.05, 0.0))
    figure = one_body(BALL, (0.0, 1.0, 0.0), link)
    plan = Plan(
        stop=1.0,
        gravity=(0.0, 0.0, 0.0),
        velocities={"pin": (0.0, 20.0, 0.0)},
        integrator=integrator,
    )
    if integrator is Integrator.EXUDYN:
        plan = replace(plan, step=1e-3)
    about = tuple(AxisSpring(axis, (Linear(5.0),)) for axis in (X, Y, Z))
    law = SpringSet({"pin": JointSprings("pin", about)}, SphericalLaw.COORDINATES)
    run = simulate(Model(figure, law), plan)
    assert run.outcome.ending is Ending.POLE
    assert run.outcome.joint == "pin"
    assert "pole" in run.outcome.message
    assert abs(run.displacements["pin"][-1, 1]) < np.pi / 2


def test_a_run_ends_where_the_angle_of_a_law_jumps():
    """Half a turn from the middle of the range, which only weak springs let a joint pass.

    A hinge beside it has no part in the end.
    """
    link = body("link", centre=(0.0, -0.05, 0.0), inertia=(0.03, 0.03, 0.03))
    hinge = joint("hinge", "ground.base", "other.near", chain("Rz"))
    plan = Plan(stop=0.2, velocities={"pin": (40.0, 0.0, 0.0)})

    def run(about):
        beside = JointSprings("hinge", (AxisSpring(Z, (Linear(1.0),)),))
        springs = {"pin": JointSprings("pin", about), "hinge": beside}
        law = SpringSet(springs, SphericalLaw.COORDINATES)
        pin = joint("pin", "ground.base", "link.near", BALL, (0.1, 0.0, 0.0))
        return simulate(Model(figure([ground(), link, body("other")], [pin, hinge]), law), plan)

    ended = run((AxisSpring(X, (Linear(0.5, 0.3),)),))
    assert ended.outcome.ending is Ending.TURNED_OVER
    assert "half a turn from the middle of its range" in ended.outcome.message
    assert ended.displacements["pin"][-1, 0] < np.pi
    free = run((AxisSpring(Y, (Linear(0.5),)),))
    assert free.outcome.ending is Ending.DONE
    assert free.displacements["pin"][-1, 0] > 3.5


def test_exudyn_s_steps_do_not_jump_over_the_pole():
    """At 6 deg a step; the two degrees around the pole are narrower."""
    about = tuple(AxisSpring(axis, (Linear(0.5),)) for axis in (X, Y, Z))
    law = SpringSet({"pin": JointSprings("pin", about)}, SphericalLaw.COORDINATES)
    link = body("link", centre=(0.0, -0.05, 0.0))
    plan = Plan(
        stop=0.1,
        step=1e-3,
        gravity=(0.0, 0.0, 0.0),
        velocities={"pin": (0.0, 100.0, 0.0)},
        integrator=Integrator.EXUDYN,
    )
    run = simulate(Model(one_body(BALL, (0.0, 1.0, 0.0), link), law), plan)
    assert run.outcome.ending is Ending.POLE


COUPLED = CoupledExponential(
    ("one", "other"), (CoupledTerm((-0.4, -0.3), (0.4, 0.3)),), (0.0, 0.0), (None, None)
)


def coupled(*axes) -> tuple[CoupledSpring, ...]:
    return (CoupledSpring(COUPLED, tuple(CoupledAxis("pin", axis) for axis in axes)),)


@pytest.mark.parametrize("integrator", Integrator)
def test_a_law_over_several_joints_ends_at_the_pole_as_well(integrator):
    law = SpringSet(law=SphericalLaw.COORDINATES, coupled=coupled(Y, X))
    plan = Plan(
        stop=0.1,
        gravity=(0.0, 0.0, 0.0),
        velocities={"pin": (0.0, 20.0, 0.0)},
        integrator=integrator,
        step=5e-4 if integrator is Integrator.EXUDYN else None,
    )
    link = body("link", centre=(0.0, -0.05, 0.0))
    run = simulate(Model(one_body(BALL, (0.0, 1.0, 0.0), link), law), plan)
    assert run.outcome.ending is Ending.POLE


def test_a_law_over_several_joints_reads_the_angle_of_the_joint_s_own_law():
    """Half a turn from the middle of its range, in compiled code as in Exudyn's model."""
    own = AxisSpring(X, (Linear(1e-3),), middle=1.5)
    law = SpringSet(
        {"pin": JointSprings("pin", (own,))}, SphericalLaw.COORDINATES, "", coupled(X, Y)
    )
    run = simulate(Model(one_body(BALL, (3.6, 0.1, 0.0)), law), Plan(stop=0.1))
    assert run.integrator_reason == ""
    assert run.agreement_with_exudyn is not None
    assert run.agreement_with_exudyn < 1e-10
    assert np.ptp(run.energy_balance) < 1e-4


@pytest.mark.parametrize("middle", [np.pi / 2, 2.0])
def test_a_start_at_the_pole_or_beyond_is_refused(middle):
    figure = one_body(BALL, (0.1, middle, 0.1))
    with pytest.raises(ModelError, match="at its pole or beyond"):
        simulate(Model(figure, springs((X, Y, Z))), Plan(stop=0.1))


def test_a_middle_axis_that_nears_its_pole_gets_a_warning(tmp_path):
    said = run_command("check", "prototype", "--springs", write_law(tmp_path)).output
    assert "`waist`: the middle one of its rotations may pass 80 deg (-inf to inf deg)" in said


LAW_FILE = """law = "coordinates"
[[spring]]
joints = ["waist"]
axis = "x"
stiffness_Nm_rad = 10.0
"""


def write_law(folder):
    path = folder / "angles.springs.toml"
    path.write_text(LAW_FILE, encoding="utf-8")
    return path


@pytest.mark.parametrize("words", ["Rx Ry Rz", "Rz R-y Rx", "Ra R-s Rt", "Rz Rx", "Rs R-a"])
def test_a_chain_is_measured_by_its_displacements_and_their_rates(words):
    """The outer angles are within half a turn of the middles of their ranges."""
    third = tuple(np.cross(SKEW, ACROSS).tolist())
    axes = {"x": X, "y": Y, "z": Z, "s": SKEW, "a": ACROSS, "t": third}
    factors = tuple(
        JointAxis(AxisKind.ROTATION, negative(axes[word[-1]]) if "-" in word else axes[word[-1]])
        for word in words.split()
    )
    middles = (2.5, 0.0, -1.0)[: len(factors)] if len(factors) == 3 else (2.5, -1.0)
    about = tuple(
        AxisSpring(factor.axis, (law,), middle=middle)
        for factor, law, middle in zip(factors, CURVES, middles, strict=False)
    )
    law = SpringSet({"pin": JointSprings("pin", about)}, SphericalLaw.COORDINATES)
    figure = one_body(factors, (0.0,) * len(factors))
    model = SettableModel.of(build_model(Model(figure, law), Plan()))
    generator = np.random.default_rng(3)
    for _ in range(20):
        values = np.array(middles) + generator.uniform(-1.5, 1.5, len(factors))
        rates = generator.uniform(-2.0, 2.0, len(factors))
        placement = forward_kinematics(build_tree(figure), {"pin": values})
        model.settle(Pose(model.model, placement, rates, 0.0))
        scratch, count = model.compiled.scratch, len(factors)
        assert scratch.displacements[0, :count] == pytest.approx(values, abs=1e-12)
        assert scratch.rates[0, :count] == pytest.approx(rates, abs=1e-12 / np.cos(1.5) ** 2)
        torques = [total_torque(each.elastic, q) for each, q in zip(about, values, strict=True)]
        assert scratch.torques[0, :count] == pytest.approx(torques, rel=1e-9)
