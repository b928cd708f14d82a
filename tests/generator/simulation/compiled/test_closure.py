"""Closed loops and linked hinges: accelerations are Exudyn's, motions those of its integrator."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from generator import read_figure
from generator.drive import Drive
from generator.figure import Figure, Location, Site, SiteRef
from generator.joint_chain import build_chain
from generator.kinematics.links import Links
from generator.kinematics.tree import build_tree
from generator.loads import LoadKind, TimedLoad
from generator.model import Model
from generator.rotations import inverse_pose, quaternion_from_matrix
from generator.run_options import Integrator
from generator.simulation.compiled.frames import record_frames
from generator.simulation.compiled.layout import (
    MEASURED_ANGLE,
    POWERS,
    RECORDED_COLUMNS,
    ROW_RATE,
    ROW_VALUE,
)
from generator.simulation.compiled.projection import MAX_GAP, project_state
from generator.simulation.compiled.refinement import have_same_breakpoints, run_once
from generator.simulation.compiled_run import build_trace, compile_model
from generator.simulation.exudyn_model.agreement import BodyState, ExudynEquations
from generator.simulation.exudyn_model.model import ExudynModel, build_model
from generator.simulation.joint_motion import SegmentMotion
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from generator.simulation.run_model import initial_state
from generator.simulation.trace import Trace
from springs import AxisSpring, Damping, JointSprings, Linear, SpringSet, Stop
from tests.chains import (
    BALL,
    FREE,
    SKEW,
    Vector,
    X,
    Y,
    Z,
    at,
    body,
    chain,
    figure,
    ground,
    joint,
    link,
    row,
)
from tests.runs import energy_error

FOURBAR = read_figure("fourbar")
SPREAD = 0.3
"""Standard deviation of the coordinates and rates of random states from those of the start."""


def site_at(pose: np.ndarray) -> Location:
    """Location of a pose (4, 4)."""
    turn = Rotation.from_matrix(pose[:3, :3]).as_euler("XYZ")
    return at(tuple(map(float, turn)), tuple(map(float, pose[:3, 3])))


def ring(bars: Figure, closing: str, *, reverse: bool = False) -> Figure:
    """Three bars whose last end is on a ball joint of the ground, where it is at the start.

    The joint between the second and the third, with the chain `closing`, closes the loop.
    """
    poses = initial_state(bars, Plan()).placement.poses
    far = poses["bar2"] @ bars.site(SiteRef("bar2", "far")).pose_in_segment
    before = site_at(inverse_pose(poses["bar1"]) @ poses["bar2"])
    second = bars.segments["bar1"]
    second = replace(second, sites={**second.sites, "cut": Site("cut", before)})
    ends = ("bar2.near", "bar1.cut") if reverse else ("bar1.cut", "bar2.near")
    made = figure(
        [ground(anchor=site_at(far)), bars.segments["bar0"], second, bars.segments["bar2"]],
        [
            bars.joints["joint0"],
            bars.joints["joint1"],
            joint("anchor", "ground.anchor", "bar2.far", BALL),
            joint("closing", *ends, chain(closing)),
        ],
    )
    assert [each.name for each in build_tree(made).closures] == ["closing"]
    return made


def springs(*names: str, stiff: float = 2.0, damp: float = 0.02) -> SpringSet:
    return SpringSet(
        {
            name: JointSprings(
                name,
                tuple(AxisSpring(axis, (Linear(stiff),), Damping(damp)) for axis in (X, Y, Z)),
            )
            for name in names
        }
    )


def hinge_springs(name: str) -> JointSprings:
    return JointSprings(name, (AxisSpring(Z, (Linear(1.5),), Damping(0.03)),))


def slide_springs(
    name: str, *axes: Vector, about: Vector | None = None, damp: float = 0.8
) -> SpringSet:
    damping = Damping(damp) if damp else Damping()
    slides = tuple(AxisSpring(axis, (Linear(60.0),), damping) for axis in axes)
    turns = () if about is None else (AxisSpring(about, (Linear(2.0),), Damping(0.05)),)
    return SpringSet({name: JointSprings(name, turns, slides)})


def figure_with_joints_in_order(made: Figure, *names: str) -> Figure:
    """The figure with another tree: a joint that comes later closes the loop."""
    return replace(made, joints={name: made.joints[name] for name in names})


@dataclass(frozen=True)
class Case:
    """A figure with springs, further fields of a plan, and initial rates."""

    figure: Figure
    springs: SpringSet = field(default_factory=SpringSet)
    plan: dict[str, object] = field(default_factory=dict)
    rates: dict[str, tuple[float, ...]] = field(default_factory=dict)

    def full_plan(self, **changes: object) -> Plan:
        settings = {"springs": self.springs, "velocities": self.rates, **self.plan, **changes}
        return Plan(**settings)  # type: ignore[arg-type]


DRIVE = Drive(np.linspace(0.0, 1.0, 6), 0.3 * np.sin(np.linspace(0.0, 4.0, 6))[:, None] + 0.3)


def shoulders(factors: str = "Rx Ry Rz") -> Figure:
    """Two arms of two bodies each, side by side."""
    bodies, joints = [ground(left=at(shift=(0.3, 0.0, 0.0)))], []
    for side, site in (("right", "base"), ("left", "left")):
        far = {"far": at(shift=(0.0, -0.3, 0.05))}
        bodies += [
            body(f"{side}_arm", 1.5, (0.02, 0.01, 0.03), (0.02, -0.15, 0.01), far),
            body(f"{side}_hand", 0.5, (0.002, 0.003, 0.001), (0.01, -0.1, 0.02)),
        ]
        joints += [
            joint(
                f"{side}_shoulder",
                f"ground.{site}",
                f"{side}_arm.near",
                chain(factors),
                (0.3, 0.2, -0.4),
            ),
            joint(f"{side}_elbow", f"{side}_arm.far", f"{side}_hand.near", chain("Rz"), (0.2,)),
        ]
    return figure(bodies, joints)


def floating_loop() -> Figure:
    """A body that moves freely, with a loop of three bars on it."""
    made = ring(row(3, (BALL, chain("Rz"), chain("Ry Rz"))), "Rx Ry Rz")
    ground_sites = made.segments["ground"].sites
    platform = body(
        "platform",
        3.0,
        (0.06, 0.05, 0.07),
        sites={"base": ground_sites["base"], "anchor": ground_sites["anchor"]},
    )
    joints = [
        joint(
            j.name,
            *(str(ref).replace("ground.", "platform.") for ref in j.ends),
            j.chain,
            j.displacement,
        )
        for j in made.joints.values()
    ]
    bars = [s for name, s in made.segments.items() if name != "ground"]
    root = joint("float", "ground.base", "platform.near", FREE, (0.2, -0.1, 0.3, 0.1, 0.2, -0.1))
    return figure([ground(), platform, *bars], [root, *joints])


BALLS = row(3, (BALL,))
LINK_OFFSET = 0.3 * np.cos(1.3) - 0.5 * 0.3 * np.cos(2.0)
"""Offset of a link of joints of `row` where they are at the start [rad]."""
CASES = {
    "four-bar": Case(FOURBAR, rates={"crank_bearing": (16.0,)}),
    "four-bar with springs": Case(
        FOURBAR,
        SpringSet({n: hinge_springs(n) for n in ("crank_bearing", "crank_pin", "rocker_bearing")}),
    ),
    "four-bar with stops": Case(
        FOURBAR,
        SpringSet(
            {
                name: JointSprings(name, (AxisSpring(Z, (Stop(lower, upper, 60.0, 0.02),)),))
                for name, lower, upper in (
                    ("crank_bearing", np.radians(150.0), np.radians(190.0)),
                    ("rocker_pin", np.radians(80.0), np.radians(95.0)),
                )
            }
        ),
    ),
    "four-bar with a spring where it closes": Case(
        FOURBAR,
        SpringSet({"rocker_pin": hinge_springs("rocker_pin")}),
        rates={"crank_bearing": (16.0,)},
    ),
    "a closing angle that winds up": Case(
        figure_with_joints_in_order(
            FOURBAR, "rocker_bearing", "crank_bearing", "rocker_pin", "crank_pin"
        ),
        SpringSet({"crank_pin": hinge_springs("crank_pin")}),
        rates={"crank_bearing": (25.0,)},
    ),
    "closing hinge, reversed": Case(
        ring(BALLS, "Rs", reverse=True),
        SpringSet(
            {"closing": JointSprings("closing", (AxisSpring(SKEW, (Linear(3.0),), Damping(0.1)),))}
        ),
        rates={"joint1": (1.0, 2.0, -1.0)},
    ),
    "spring along a closing slide": Case(ring(BALLS, "Ts"), slide_springs("closing", SKEW)),
    "springs of a closing slide and turn": Case(
        ring(BALLS, "Tx Rz"), slide_springs("closing", X, about=Z)
    ),
    "springs of a closing turn and slide, reversed": Case(
        ring(BALLS, "Rz Tx", reverse=True), slide_springs("closing", X, about=Z)
    ),
    "springs along two closing slides": Case(
        ring(row(3, (BALL,)), "Tx Ty"), slide_springs("closing", X, Y, damp=0.0)
    ),
    "driven four-bar": Case(
        FOURBAR,
        plan={"drives": {"crank_bearing": Drive(DRIVE.times, DRIVE.values * 0.5 + np.pi)}},
    ),
    "ball": Case(ring(BALLS, "Rx Ry Rz"), springs("joint0", "closing")),
    "ball, reversed": Case(ring(BALLS, "Rx Ry Rz", reverse=True), springs("joint1", "closing")),
    "welded": Case(ring(BALLS, ""), springs("joint0")),
    "hinge": Case(ring(BALLS, "Rs")),
    "two turns": Case(ring(BALLS, "Rx Ry"), springs("joint1")),
    "two turns, reversed": Case(ring(BALLS, "Rz Rx", reverse=True)),
    "turn and slide": Case(ring(BALLS, "Rz Tx")),
    "slide and turn": Case(ring(BALLS, "Tx Rz")),
    "slide and turn, reversed": Case(ring(BALLS, "Ts Rz", reverse=True)),
    "slide": Case(ring(BALLS, "Ts")),
    "plane": Case(ring(BALLS, "Rz Tx Ty")),
    "slides in the tree": Case(
        ring(row(3, (BALL, chain("Rz Tx"), chain("Ry Rz"))), "Rx Ry Rz"),
        SpringSet({"joint1": JointSprings("joint1", (), (AxisSpring(X, (Linear(80.0),)),))}),
    ),
    "floating": Case(floating_loop(), springs("closing"), rates={"joint1": (3.0,)}),
    "linked hinges": Case(
        row(5, (chain("Rz"), chain("Ry"))),
        plan={"links": Links((link("joint1", "joint0", 0.5, 0.1), link("joint2", "joint1", -2.0)))},
    ),
    "linked shoulders": Case(
        shoulders(),
        springs("right_shoulder"),
        {
            "links": Links(
                tuple(
                    link(f"left_shoulder {k}", f"right_shoulder {k}", f)
                    for k, f in ((1, 1.0), (2, -0.7), (3, -1.0))
                )
            )
        },
    ),
    "linked to a part of a ball": Case(
        shoulders(),
        springs("left_shoulder"),
        {"links": Links((link("left_elbow", "right_shoulder 2", 0.8, 0.1),))},
    ),
    "linked to a drive": Case(
        shoulders(),
        plan={
            "links": Links((link("left_elbow", "right_elbow", -0.8, 0.1),)),
            "drives": {"right_elbow": DRIVE},
        },
    ),
    "linked to a lock": Case(
        shoulders(),
        plan={
            "links": Links((link("left_elbow", "right_elbow", -0.8, 0.1),)),
            "locked": ("right_elbow",),
        },
    ),
    "linked in a loop": Case(
        ring(row(3, (BALL, chain("Rz"))), "Rx Ry Rz"),
        plan={"links": Links((link("joint1", "joint0 3", 0.5, LINK_OFFSET),))},
    ),
    "loaded loop": Case(
        ring(BALLS, "Rx Ry Rz"),
        plan={
            "loads": (
                TimedLoad(
                    SiteRef("bar1", "far"),
                    LoadKind.GLOBAL_FORCE,
                    (0.0, 1.0),
                    ((1.0, 2.0, -3.0), (4.0, 0.0, 1.0)),
                ),
            )
        },
    ),
}


def random_states(case: Case, count: int) -> Iterator[tuple[ExudynModel, Trace, BodyState]]:
    """States on the constraints, evaluated by the compiled code."""
    plan = case.full_plan()
    model = build_model(case.figure, plan)
    compiled = compile_model(model)
    mechanism, scratch = compiled.mechanism, compiled.scratch
    arguments = (compiled.equations, mechanism, scratch)
    angles = {
        name: connector.axis_index
        for name, connectors in model.springs.items()
        for connector in connectors
        if connector.angle_node is not None
    }
    rng = np.random.default_rng(1)
    while count:
        time = np.array([rng.uniform(0.0, 1.0)])
        interval = int(np.searchsorted(mechanism.knots, time[0], side="right")) - 1
        state = compiled.initial_state.copy()
        free = len(state) - POWERS - np.count_nonzero(mechanism.measured[:, MEASURED_ANGLE] >= 0)
        state[:free] += SPREAD * rng.normal(size=free)
        if not project_state(
            compiled.equations.laws, *arguments[1:], interval, time[0], state, np.empty_like(state)
        ):
            continue  # too far from any closed pose
        states = state[None].copy()
        links = np.empty((1, len(mechanism.links), RECORDED_COLUMNS))
        rates, wrenches = np.empty_like(states), np.empty((1, len(mechanism.rows), 6))
        record_frames(*arguments, time, states, links, rates, wrenches)
        assert np.max(np.abs(scratch.row_work[:, ROW_VALUE])) <= MAX_GAP
        speed = np.max(np.abs(state))
        assert np.max(np.abs(scratch.row_work[:, ROW_RATE])) < 1e-12 * (1.0 + speed)
        trace = build_trace(model, compiled, time, states, links)
        motion = SegmentMotion(model, trace)
        starts, joints = model.placement.displacements, model.figure.joints
        closures = [motion.joint(each, starts[each.name]) for each in model.placement.tree.closures]
        gaps = [
            build_chain(each.chain).pose(moved.displacements) - moved.pose_in_parent
            for each, moved in zip(model.placement.tree.closures, closures, strict=True)
        ]
        if np.max(np.abs(gaps), initial=0.0) > 1e-9:
            continue  # an axis is reversed: the rows hold, the joint does not
        near = {name: motion.joint(joints[name], starts[name]).displacements[0] for name in angles}
        yield (
            model,
            trace,
            BodyState(
                float(time[0]),
                trace.positions[0],
                np.array([quaternion_from_matrix(turn) for turn in trace.rotations[0]]),
                trace.velocities[0],
                trace.angular_velocities[0],
                {name: float(near[name][k]) for name, k in angles.items()},
            ),
        )
        count -= 1


@pytest.mark.parametrize("name", CASES)
def test_accelerations_are_those_of_exudyns_equations(name: str) -> None:
    """At 50 random states on the constraints, to 1e-10 of the largest."""
    equations = None
    for model, trace, state in random_states(CASES[name], 50):
        equations = equations or ExudynEquations(model)
        exact = equations.accelerations(state)
        scale = max(1.0, float(np.max(np.abs(exact))))
        assert trace.accelerations is not None
        assert np.max(np.abs(trace.accelerations[0] - exact)) < 1e-10 * scale


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_motions_and_reactions_are_those_of_exudyns_integrator(name: str) -> None:
    """Motions to 1e-6 rad or m, reactions to 1e-4 of the largest; no energy is lost."""
    case, tight = CASES[name], {"stop": 0.2, "tolerance": 1e-7}
    ours = simulate(case.figure, case.full_plan(**tight))
    assert (ours.integrator, ours.integrator_reason) == (Integrator.COMPILED, "")
    assert ours.agreement_with_exudyn is not None
    assert ours.agreement_with_exudyn < 1e-10
    # The extrapolation of two passes is much more accurate than their difference, the estimate.
    loose = {**tight, "tolerance": 1e-5 if name == "floating" else 1e-4}
    theirs = simulate(case.figure, case.full_plan(integrator=Integrator.EXUDYN, **loose))
    assert ours.outcome.succeeded
    assert theirs.outcome.succeeded
    assert max(ours.constraint_drift, ours.prescribed_motion_drift) < 1e-9
    assert energy_error(ours) < 1e-6 * max(1.0, float(np.max(ours.energy["kinetic"])))
    for name in case.figure.joints:
        assert np.allclose(ours.displacements[name], theirs.displacements[name], atol=1e-6)
        size = np.max(np.abs(theirs.reactions[name]))
        assert np.allclose(ours.reactions[name], theirs.reactions[name], atol=1e-4 * (1.0 + size))
    for name, torque in ours.drive_torques.items():
        assert np.allclose(torque, theirs.drive_torques[name], atol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["four-bar", "ball", "welded", "hinge", "slide", "floating", "linked shoulders"]
)
def test_constraints_hold_for_seconds(name: str) -> None:
    """Of the loops and of the links in all frames of a coarse run, to 1e-9."""
    case = CASES[name]
    run = simulate(case.figure, case.full_plan(stop=4.0, tolerance=1e-3))
    assert run.integrator is Integrator.COMPILED
    assert run.outcome.succeeded
    assert max(np.max(np.ptp(v, axis=0), initial=0.0) for v in run.displacements.values()) > 0.5
    for each in case.figure.joints.values():
        parents, children = (
            run.poses[ref.segment] @ case.figure.site(ref).pose_in_segment for ref in each.ends
        )
        reached = build_chain(each.chain)
        assert np.allclose(
            inverse_pose(parents) @ children,
            reached.pose(run.displacements[each.name]),
            rtol=0.0,
            atol=1e-9,
        )
    for one in case.full_plan().links.resolved:
        control, follower = (
            run.displacements[end.joint][:, end.index] for end in (one.control, one.follower)
        )
        assert np.max(np.abs(follower - one.factor * control - one.offset)) < 1e-9


def test_an_angle_of_a_closing_joint_is_unwrapped() -> None:
    """Its spring winds up over more than a turn, as that of any other joint does."""
    case = CASES["a closing angle that winds up"]
    assert [joint.name for joint in build_tree(case.figure).closures] == ["crank_pin"]
    run = simulate(case.figure, case.full_plan(stop=1.0, tolerance=1e-5))
    assert np.ptp(run.displacements["crank_pin"]) > 2.0 * np.pi
    stored = 0.75 * run.displacements["crank_pin"][:, 0] ** 2
    assert np.allclose(run.energy["spring"], stored, rtol=1e-9)


def test_a_loop_passes_the_breakpoints_of_its_laws() -> None:
    """The steps end at the same breakpoints at any tolerance."""
    case = CASES["four-bar with stops"]
    plan = case.full_plan()
    compiled = compile_model(build_model(case.figure, plan))
    coarse, fine = (run_once(compiled, np.linspace(0.0, 1.0, 11), size) for size in (1e-8, 1e-11))
    assert len(fine.event_times) > 10
    assert have_same_breakpoints(coarse, fine)
    assert np.allclose(coarse.event_times, fine.event_times, rtol=0.0, atol=1e-5)


def test_a_pose_that_no_closed_one_is_near_is_not_projected() -> None:
    """A crank far from its axis: no step of Newton's method ends on the constraints."""
    compiled = compile_model(build_model(Model(FOURBAR, SpringSet())))
    state = compiled.initial_state.copy()
    compiled.mechanism.row_constants[:, :3] += 10.0
    arguments = (compiled.equations, compiled.mechanism, compiled.scratch)
    assert not project_state(
        compiled.equations.laws, *arguments[1:], 0, 0.0, state, np.empty_like(state)
    )
