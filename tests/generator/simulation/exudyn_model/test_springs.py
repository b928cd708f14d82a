"""Springs hung on joints: which connectors they become, and what cannot be hung."""

from dataclasses import replace

import numpy as np
import pytest

from generator.diagnostics import ModelError
from generator.model import Model
from generator.run_options import Integrator
from generator.simulation.exudyn_model.exudyn_api import exu
from generator.simulation.exudyn_model.model import build_model
from generator.simulation.plan import Plan
from generator.simulation.preconditions import simulation_obstacles
from generator.simulation.run import simulate
from springs import AxisSpring, Damping, JointSprings, Linear, SpringSet, Stop
from springs.hysteresis import Hysteresis
from tests.chains import BALL, SKEW, X, Y, Z, body, chain, one_body, two_bodies
from tests.runs import energy_error, springs_of

SPRING = (Linear(10.0),)


def hung(text: str, axes=(), slides=(), joint: str = "pin", **plan):
    figure = one_body(chain(text))
    springs = SpringSet({joint: JointSprings(joint, axes, slides)})
    return build_model(Model(figure, springs), Plan(**plan))


@pytest.mark.parametrize(
    ("text", "axes", "slides", "kinds"),
    [
        ("Rz", (Z,), (), ["revolute"]),
        ("Rs", (SKEW,), (), ["revolute"]),
        ("Rx Ry", (X, Y), (), ["spherical"]),
        ("Rx Ry Rz", (X, Y, Z), (), ["spherical"]),
        ("Rz Tz", (Z,), (Z,), ["revolute", "prismatic"]),
        ("Tx Ty", (), (X, Y), ["prismatic", "prismatic"]),
        ("Rx Ry Rz Tx", (X,), (X,), ["spherical", "prismatic"]),
        ("Rx Ry Rz Tx Ty Tz", (X, Y, Z), (), ["spherical"]),
        ("Rz Tx Ty", (Z,), (X,), ["revolute", "prismatic"]),
        ("Tx Ty Tz Rx Ry Rz", (X,), (X, Z), ["spherical", "prismatic", "prismatic"]),
    ],
)
def test_connectors_by_chain(text, axes, slides, kinds) -> None:
    assembly = hung(
        text,
        tuple(AxisSpring(a, SPRING) for a in axes),
        tuple(AxisSpring(s, SPRING) for s in slides),
    )
    assert [c.kind.value for c in assembly.springs["pin"]] == kinds


@pytest.mark.parametrize(
    ("text", "axes", "slides", "reason"),
    [
        ("Tx", (X,), (), "no rotation"),
        ("Rz", (Z,), (X,), "no translation"),
        ("Tx", (), (Y,), "has no translation along"),
    ],
)
def test_springs_that_cannot_be_hung(text, axes, slides, reason) -> None:
    with pytest.raises(ModelError, match=reason) as caught:
        hung(
            text,
            tuple(AxisSpring(a, SPRING) for a in axes),
            tuple(AxisSpring(s, SPRING) for s in slides),
        )
    assert "pin" in str(caught.value)


@pytest.mark.parametrize(
    "spring",
    [
        AxisSpring(X, (), Damping(1.0)),
        AxisSpring(X, (Hysteresis.from_mean_and_width(Linear(40.0), 2.0, slip=0.05),)),
    ],
)
@pytest.mark.parametrize("text", ["Tx Ty", "Rx Ry Tx Ty Tz", "Tx Ty Rx Ry"])
def test_damping_among_slides_of_two_moving_bodies(spring, text) -> None:
    """Friction of a law is damping, too; the dissipated energy is what the balance lacks."""
    start = [0.1 * k for k in range(1, 1 + len(text.split()))]
    figure = two_bodies(chain(text), start)
    springs = SpringSet({"tested": JointSprings("tested", (), (spring,))})
    plan = Plan(stop=0.3, springs=springs, tolerance=1e-5)
    assert simulation_obstacles(Model(figure, springs)) == ()
    run = simulate(figure, plan)
    assert run.agreement_with_exudyn < 1e-10
    other = simulate(figure, replace(plan, stop=0.02, integrator=Integrator.EXUDYN))
    for one in (run, other):
        dissipated = one.energy["dissipated"][-1]
        assert dissipated > 1e-6
        assert energy_error(one) < 0.01 * dissipated


@pytest.mark.parametrize("start", [0.4, 4.0, -9.0])
def test_a_hinge_spring_counts_turns_from_the_start(start) -> None:
    """The angle at the start is the displacement, whole turns and all."""
    figure = one_body(chain("Rz"), (start,))
    springs = SpringSet({"pin": JointSprings("pin", (AxisSpring(Z, SPRING),))})
    assembly = build_model(Model(figure, springs), Plan())
    (connector,) = assembly.springs["pin"]
    torque = assembly.mbs.GetObjectOutput(connector.item, exu.OutputVariableType.TorqueLocal)
    assert np.ravel(torque)[-1] == pytest.approx(10.0 * start)
    run = simulate(figure, Plan(stop=0.02, step=1e-3, springs=springs))
    assert run.passive_torques["pin"][0] == pytest.approx([0.0, 0.0, -10.0 * start])
    assert run.energy["spring"][0] == pytest.approx(5.0 * start**2)


def test_a_stop_along_a_slide_holds() -> None:
    """A body comes to rest a little beyond its limit: k (x - onset/2) carries the weight."""
    law = AxisSpring(SKEW, (Stop(None, 0.1, 2000.0, 0.01),), Damping(20.0))
    plan = Plan(
        stop=2.0,
        step=1e-3,
        gravity=tuple(9.81 * c for c in SKEW),
        springs=SpringSet({"pin": JointSprings("pin", (), (law,))}),
    )
    run = simulate(one_body(chain("Ts"), (0.0,)), plan)
    assert run.displacements["pin"][-1, 0] == pytest.approx(0.105 + 2.0 * 9.81 / 2000.0, abs=1e-5)


def test_a_stop_about_a_hinge_holds() -> None:
    stop = Stop(None, 0.1, 2000.0, 0.01)
    law = AxisSpring(Z, (stop,), Damping(10.0))
    link = body("link", centre=(0.0, -0.3, 0.0))
    plan = Plan(
        stop=2.0,
        step=1e-3,
        gravity=(9.81, 0.0, 0.0),
        springs=springs_of("pin", law),
    )
    run = simulate(one_body(chain("Rz"), (0.0,), link), plan)
    angle = run.displacements["pin"][-1, 0]
    assert 0.1 < angle < 0.11
    assert stop.torque(angle) == pytest.approx(-2.0 * 9.81 * 0.3 * np.cos(angle), abs=1e-3)


def test_a_universal_joint_takes_springs_on_its_rotation_vector() -> None:
    axes = (AxisSpring(X, SPRING), AxisSpring(Y, (Linear(20.0),)))
    figure = one_body(chain("Rx Ry"), (0.3, 0.5))
    springs = springs_of("pin", *axes)
    run = simulate(figure, Plan(stop=0.5, step=2.5e-4, springs=springs))
    r = run.rotation_vectors["pin"]
    assert np.allclose(run.energy["spring"], 5.0 * r[:, 0] ** 2 + 10.0 * r[:, 1] ** 2)
    assert energy_error(run) < 1e-4 * np.ptp(run.energy["kinetic"])


def test_the_passive_torque_turns_the_child() -> None:
    """A free ball joint at rest: the torque is the rate of the spin's momentum."""
    link = body("link", centre=(0.0, 0.0, 0.0), inertia=(0.02, 0.03, 0.04))
    axes = tuple(AxisSpring(a, (Linear(k),)) for a, k in ((X, 5.0), (Y, 8.0), (Z, 3.0)))
    springs = springs_of("pin", *axes)
    plan = Plan(stop=2e-3, step=1e-5, frame=1e-4, gravity=(0.0, 0.0, 0.0), springs=springs)
    run = simulate(one_body(BALL, (0.7, -0.4, 0.9), link), plan)
    rotation = run.poses["link"][:, :3, :3]
    inertia = rotation[0] @ np.diag(link.inertia) @ rotation[0].T
    # From rest the rotation grows as half the angular acceleration times the time squared.
    moved = rotation[10] @ rotation[0].T
    grown = np.array(
        [moved[2, 1] - moved[1, 2], moved[0, 2] - moved[2, 0], moved[1, 0] - moved[0, 1]]
    )
    acceleration = grown / run.times[10] ** 2
    assert inertia @ acceleration == pytest.approx(run.passive_torques["pin"][0], rel=1e-3)


def test_a_sprung_ball_does_not_start_at_half_a_turn() -> None:
    """Rounding would choose the side to which it falls; a damped one has no side."""
    springs = springs_of("pin", AxisSpring(Z, (Linear(1.0),)))
    damped = SpringSet({"pin": JointSprings("pin", (AxisSpring(Z, (), Damping(0.1)),))})
    for angle in (np.pi, -np.pi, 3.0 * np.pi):
        figure = one_body(BALL, (0.0, 0.0, angle))
        with pytest.raises(ModelError, match="joint pin starts at 180 deg"):
            build_model(Model(figure, springs), Plan())
        assert build_model(Model(figure, damped), Plan()).springs["pin"]
    assert build_model(Model(one_body(BALL, (0.0, 0.0, np.pi - 1e-3)), springs), Plan()).springs[
        "pin"
    ]
