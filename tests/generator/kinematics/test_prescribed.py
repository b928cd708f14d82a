"""What is locked, linked and driven: what follows from what, and what cannot be asked for."""

from dataclasses import replace

import numpy as np
import pytest

from generator import read_figure
from generator.diagnostics import ModelError
from generator.drive import Drive
from generator.kinematics.links import Coordinate, Link, Links
from generator.kinematics.placement import initial_displacements
from generator.kinematics.prescribed import PrescribedMotion
from generator.kinematics.tree import build_tree
from generator.simulation.plan import Plan
from generator.simulation.run_model import initial_state
from tests.chains import BALL, chain, row

MADE = row(4, (BALL, chain("Rz")), bend=0.3)
TABLE = Drive((0.0, 1.0), ((0.1,), (0.5,)))


def freedom(joint, number=1):
    return Coordinate(joint, number - 1)


def prescribed(links=(), locked=(), drives=None, made=MADE):
    tree = build_tree(made)
    drawn = initial_displacements(tree)
    return PrescribedMotion(
        tree, Links(tuple(links)), {name: drawn[name] for name in locked}, drives or {}
    )


def test_what_follows_a_driven_joint_is_driven_and_a_locked_one_is_locked() -> None:
    """And the rest is free."""
    asked = prescribed(
        links=[
            Link(freedom("joint0", 2), freedom("joint1"), 2.0, 0.1),
            Link(freedom("joint2", 1), freedom("joint3"), -1.0),
            Link(freedom("joint2", 3), freedom("joint2", 2), 0.5),
        ],
        locked=["joint3"],
        drives={"joint1": TABLE},
    )
    times = np.array([0.0, 0.5, 1.0])
    given = {
        name: np.tile(row, (3, 1)) for name, row in initial_displacements(build_tree(MADE)).items()
    }
    q = asked.impose_displacements(given, times)
    rates = asked.impose_rates(given, times, q)
    assert q["joint1"][:, 0] == pytest.approx([0.1, 0.3, 0.5])
    assert q["joint0"][:, 1] == pytest.approx([0.3, 0.7, 1.1])
    assert rates["joint0"][:, 1] == pytest.approx([0.8, 0.8, 0.8])
    assert q["joint2"][:, 0] == pytest.approx(-q["joint3"][:, 0])
    assert np.all(rates["joint3"] == 0.0)
    assert np.all(rates["joint2"][:, 0] == 0.0)
    assert q["joint2"][:, 2] == pytest.approx(0.5 * given["joint2"][:, 1])
    assert asked.free_coordinates == (
        freedom("joint0", 1),
        freedom("joint0", 3),
        freedom("joint2", 2),
    )
    slopes = np.zeros((8, 3))
    slopes[[0, 2, 5, 6], [0, 1, 2, 2]] = 1.0, 1.0, 1.0, 0.5
    assert np.allclose(asked.free_jacobian({name: row[0] for name, row in q.items()}), slopes)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"locked": ("joint9",)}, "no joint joint9, so it cannot be locked; did you mean `joint"),
        ({"drives": {"joint9": TABLE}}, "no joint joint9, so it cannot be driven"),
        (
            {"links": [Link(freedom("joint9"), freedom("joint0"))]},
            "no joint joint9, so it cannot be linked",
        ),
        ({"locked": ("joint1",), "drives": {"joint1": TABLE}}, "both locked and driven"),
        (
            {"links": [Link(freedom("joint1"), freedom("joint3"))], "locked": ("joint1",)},
            "joint1 1 follows joint3 1 and is locked",
        ),
        (
            {"links": [Link(freedom("joint1"), freedom("joint3"))], "drives": {"joint1": TABLE}},
            "joint1 1 follows joint3 1 and is driven",
        ),
        ({"drives": {"joint0": TABLE}}, "3 degrees of freedom, but its drive of 1 columns"),
        (
            {"drives": {"joint1": Drive((0.0, 1.0), ((0.0,), (1.0,)), (1,))}},
            "1 degrees of freedom, but its drive",
        ),
        ({"links": [Link(freedom("joint1", 2), freedom("joint3"))]}, "joint1 2 cannot be linked"),
    ],
)
def test_what_cannot_be_asked_for(given, said) -> None:
    given = {name: values for name, values in given.items() if name != "locked"} | {
        "locked": given.get("locked", ())
    }
    tree = build_tree(MADE)
    locked = {name: np.zeros(3) for name in given["locked"]}
    with pytest.raises(ModelError, match=said):
        PrescribedMotion(
            tree, Links(tuple(given.get("links", ()))), locked, given.get("drives", {})
        )


def test_slides_can_be_locked_but_not_linked_or_driven() -> None:
    made = row(2, (chain("Tx"),))
    prescribed(locked=["joint0"], made=made)
    for given in (
        {"drives": {"joint0": TABLE}},
        {"links": [Link(freedom("joint1"), freedom("joint0"))]},
    ):
        with pytest.raises(ModelError, match="is a translation: only rotations can be"):
            prescribed(made=made, **given)


def test_a_fixed_joint_does_not_move() -> None:
    with pytest.raises(ModelError, match="joint0 does not move, so it cannot be locked"):
        prescribed(locked=["joint0"], made=row(2, ((), chain("Rz"))))


def test_a_loop_takes_one_prescription_and_not_two() -> None:
    """A four-bar has one motion; the joint that closes it follows from the others."""
    made = read_figure("fourbar")
    start = initial_state(made, Plan(locked=("crank_bearing",)))
    assert start.placement.pose_in_parent(made.joints["rocker_pin"])[:3, 3] == pytest.approx(
        0, abs=1e-9
    )
    with pytest.raises(ModelError, match="closed by rocker_pin is over-constrained"):
        initial_state(made, Plan(locked=("crank_bearing", "crank_pin")))
    with pytest.raises(ModelError, match="rocker_pin closes a loop and cannot be locked"):
        initial_state(made, Plan(locked=("rocker_pin",)))


def test_a_free_root_takes_joints_to_the_ground_away() -> None:
    made = read_figure("prototype")
    with pytest.raises(ModelError, match="root_torso connects the figure to the ground"):
        initial_state(made, Plan(free_root=True, locked=("root_torso",)))
    assert initial_state(
        made, Plan(free_root=True, locked=("waist",))
    ).prescribed.locked.keys() == {"waist"}


def test_a_run_starts_as_it_is_prescribed() -> None:
    """Displacements and rates of the table, of links, and of locked joints."""
    plan = Plan(
        links=Links((Link(freedom("joint3"), freedom("joint1"), 2.0),)),
        locked=("joint0",),
        drives={"joint1": TABLE},
        displacements={"joint0": (0.4, 0.5, 0.6)},
        velocities={"joint2": (1.0, 2.0, 3.0)},
        start=0.25,
    )
    start = initial_state(MADE, plan)
    q = start.placement.displacements
    assert q["joint0"] == pytest.approx([0.4, 0.5, 0.6])
    assert q["joint1"] == pytest.approx([0.2])
    assert q["joint3"] == pytest.approx([0.4])
    assert start.rates["joint1"] == pytest.approx([0.4])
    assert start.rates["joint3"] == pytest.approx([0.8])
    assert start.rates["joint2"] == pytest.approx([1.0, 2.0, 3.0])
    for name in ("joint0", "joint1", "joint3"):
        velocities = {name: (7.0,) * len(MADE.joints[name].chain)}
        with pytest.raises(ModelError, match="cannot start with another velocity"):
            initial_state(MADE, replace(plan, velocities=velocities))


def test_a_run_does_not_go_beyond_its_drive() -> None:
    with pytest.raises(ValueError, match="the run goes from 0 s to 2 s, but the drive of joint1"):
        Plan(stop=2.0, drives={"joint1": TABLE})
    with pytest.raises(ValueError, match="only from 0 s to 1 s"):
        Plan(start=-1.0, stop=1.0, drives={"joint1": TABLE})
    Plan(stop=1.0 + 1e-12, drives={"joint1": TABLE})
