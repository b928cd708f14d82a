"""Which locks a loop needs: rows that the others imply are left out."""

import numpy as np

from generator import read_figure
from generator.joint_chain import locked_axes_from_chain
from generator.kinematics.closures import independent_constraints
from generator.kinematics.loops import close_loops
from generator.kinematics.placement import initial_displacements
from generator.kinematics.tree import build_tree
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from generator.simulation.run_model import initial_state
from springs import SpringSet
from tests.chains import BALL, SKEW, at, body, chain, figure, ground, joint, row
from tests.runs import energy_error, integrate_angle

FOURBAR = read_figure("fourbar")
NONE = SpringSet()


def equations(locks) -> int:
    return sum(sum(k.translations) + sum(k.rotations) for ks in locks.values() for k in ks)


def test_a_tree_keeps_all_its_locks() -> None:
    tree = build_tree(row(3, (BALL, chain("Rz"))))
    placement = close_loops(tree, initial_displacements(tree))
    locks = independent_constraints(placement)
    assert [sum(k.translations) + sum(k.rotations) for ks in locks.values() for k in ks] == [
        3,
        5,
        3,
    ]


def test_a_planar_loop_of_revolutes_keeps_two_rows_of_its_last_joint() -> None:
    """Three bodies, one freedom: 17 equations, of 20 that four revolutes write."""
    placement = initial_state(FOURBAR, Plan()).placement
    assert equations({n: locked_axes_from_chain(c) for n, c in placement.tree.chains.items()}) == 20
    assert equations(independent_constraints(placement)) == 17


def test_a_dead_point_is_looked_through() -> None:
    """Crank and coupler folded on each other: for that moment more rows depend on each other."""
    span = np.hypot(0.2, 0.3)
    cosine = (0.1**2 + span**2 - 0.4**2) / (2.0 * 0.1 * span)
    crank = np.arctan2(0.3, 0.2) + np.arccos(cosine) + np.pi
    plan = Plan(displacements={"crank_bearing": (crank,), "crank_pin": (np.pi,)})
    placement = initial_state(FOURBAR, plan).placement
    assert equations(independent_constraints(placement)) == 17


def test_a_spatial_loop_of_balls_needs_all_its_rows() -> None:
    made = figure(
        [
            ground(post=at(shift=(0.5, 0.1, 0.2))),
            body("a", sites={"far": at(shift=(0.3, 0.0, 0.0))}),
            body("b", sites={"far": at(shift=(0.4, 0.0, 0.0))}),
        ],
        [
            joint("one", "ground.base", "a.near", BALL, (0.1, -0.2, 0.6)),
            joint("two", "a.far", "b.near", chain("Ry Rz"), (0.2, -1.2)),
            joint("three", "b.far", "ground.post", BALL),
        ],
    )
    placement = initial_state(made, Plan()).placement
    assert equations(independent_constraints(placement)) == 3 + 4 + 3
    run = simulate(made, Plan(stop=0.5, step=5e-4, springs=NONE))
    assert run.outcome.succeeded
    assert energy_error(run) < 1e-4 * np.ptp(run.energy["gravity"])


def test_a_joint_that_a_loop_makes_needless() -> None:
    """A second hinge on the axis of the first holds nothing that the first does not."""
    made = figure(
        [
            ground(top=at(shift=tuple(0.4 * c for c in SKEW))),
            body("a", sites={"top": at(shift=tuple(0.4 * c for c in SKEW))}),
        ],
        [
            joint("low", "ground.base", "a.near", chain("Rs"), (0.3,)),
            joint("high", "ground.top", "a.top", chain("Rs"), (0.3,)),
        ],
    )
    placement = initial_state(made, Plan()).placement
    locks = independent_constraints(placement)
    assert equations(locks) == 5
    runs = [
        simulate(f, Plan(stop=0.3, step=1e-3, springs=NONE))
        for f in (made, figure(list(made.segments.values()), [made.joints["low"]]))
    ]
    assert np.allclose(runs[0].displacements["low"], runs[1].displacements["low"], atol=1e-9)
    assert np.allclose(runs[0].displacements["high"], runs[1].displacements["low"], atol=1e-5)


def test_a_bar_too_many_swings_through_the_lowest_point() -> None:
    """Two parallel links with two bars across them: one bar's row along it says nothing there."""
    link = {"far": at(shift=(0.0, -0.2, 0.0)), "half": at(shift=(0.0, -0.1, 0.0))}
    made = figure(
        [
            ground(two=at(shift=(0.2, 0.0, 0.0))),
            body("left", 1.0, (0.01,) * 3, (0.0, -0.1, 0.0), link),
            body("right", 1.0, (0.01,) * 3, (0.0, -0.1, 0.0), link),
            body("low", 1.0, (0.01,) * 3, (0.1, 0.0, 0.0), {"end": at(shift=(0.2, 0.0, 0.0))}),
            body("high", 1.0, (0.01,) * 3, (0.1, 0.0, 0.0), {"end": at(shift=(0.2, 0.0, 0.0))}),
        ],
        [
            joint("left_pin", "ground.base", "left.near", chain("Rz"), (0.35,)),
            joint("right_pin", "ground.two", "right.near", chain("Rz"), (0.35,)),
            joint("low_pin", "left.far", "low.near", chain("Rz"), (-0.35,)),
            joint("low_end", "right.far", "low.end", chain("Rz"), (-0.35,)),
            joint("high_pin", "left.half", "high.near", chain("Rz"), (-0.35,)),
            joint("high_end", "right.half", "high.end", chain("Rz"), (-0.35,)),
        ],
    )
    run = simulate(made, Plan(stop=1.0, springs=NONE, tolerance=1e-6))
    assert run.outcome.succeeded
    # Links turn about their ends; bars only shift with the links' points.
    inertia = 2.0 * (0.01 + 0.1**2) + 0.2**2 + 0.1**2
    moment = 9.81 * (2.0 * 0.1 + 0.2 + 0.1)
    angle, _ = integrate_angle(lambda a, _: -moment / inertia * np.sin(a), 0.35, 0.0, run.times)
    assert np.min(angle) < -0.3
    assert np.max(np.abs(run.displacements["left_pin"][:, 0] - angle)) < 1e-6
