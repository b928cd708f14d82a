"""Exudyn's equations at any state, against equations in the displacements of the joints.

The reference has the bodies' motions from forward kinematics, the torques of `springs`, and the
closures, locks, links and drives as linear equations of the displacements' accelerations.
"""

import gc
import resource
import time
from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csc_array

from generator import read_figure
from generator.diagnostics import ModelError
from generator.drive import Drive
from generator.figure import SiteRef
from generator.kinematics.closures import constraint_jacobian, independent_constraints
from generator.kinematics.links import Coordinate, Link, Links
from generator.kinematics.placement import (
    forward_kinematics,
    relative_jacobian,
    segment_jacobians,
)
from generator.loads import LoadKind, TimedLoad
from generator.simulation.exudyn_model import agreement
from generator.simulation.exudyn_model.agreement import (
    BodyState,
    ExudynEquations,
    _solve_constrained,
)
from generator.simulation.exudyn_model.bodies import body_pose, load_pose
from generator.simulation.exudyn_model.exudyn_api import rigid
from generator.simulation.exudyn_model.model import ExudynModel, build_model
from generator.simulation.exudyn_model.springs import JointKind, generalized_force
from generator.simulation.exudyn_run import integrate
from generator.simulation.joint_motion import SegmentMotion
from generator.simulation.plan import Plan
from generator.simulation.trace import Trace, frame_times
from springs import NUMPY, AxisSpring, Damping, Linear, SphericalLaw, SpringSet
from tests.chains import BALL, SKEW, X, Y, Z, chain, free_body, one_body, row
from tests.poses import Pose, motion_matrix, random_pose
from tests.runs import springs_of

STENCIL = tuple(zip((1, 2, 3, 4), (4 / 5, -1 / 5, 4 / 105, -1 / 280), strict=True))


def slope(function, step):
    """Derivative at zero, to rounding where the function is smooth over the step."""
    return sum(w * (function(k * step) - function(-k * step)) for k, w in STENCIL) / step


def closure_matrix(placement, locks):
    """Rates of the closures' constraints by rates."""
    jacobians = segment_jacobians(placement)
    rows = [np.zeros((0, placement.tree.kinematics.size))]
    for closing in placement.tree.closures:
        motion = relative_jacobian(placement, jacobians, closing)
        pose = placement.pose_in_parent(closing)
        rows += [constraint_jacobian(lock, pose) @ motion for lock in locks[closing.name]]
    return np.vstack(rows)


def passive_forces(pose: Pose, matrix):
    """Generalized forces of springs, damping and coupled laws."""
    model, tree, state = pose.model, pose.placement.tree, pose.state
    rotations = np.array(
        [body_pose(pose.placement, s)[:3, :3] for s in model.figure.bodies.values()]
    )
    none = np.zeros(1)
    motions = (state.positions, rotations, state.velocities, state.angular_velocities)
    trace = Trace(none, *(part[None] for part in motions), {}, none, none, none)
    segments = SegmentMotion(model, trace)
    moving = {
        name: segments.joint(each, pose.placement.displacements[name])
        for name, each in model.figure.joints.items()
    }
    torques = segments.passive_torques(moving)
    forces = np.zeros(tree.kinematics.size)
    bodies = {name: k for k, name in enumerate(model.figure.bodies)}
    for name, torque in torques.items():
        each = model.figure.joints[name]
        world = segments.site(each.parent)[0, :3, :3] @ torque[0]
        for ref, sign in ((each.child, 1.0), (each.parent, -1.0)):
            if ref.segment in bodies:
                forces += sign * world @ matrix[bodies[ref.segment], :3]
    for name, connectors in model.springs.items():
        for connector in connectors:
            if connector.kind is JointKind.PRISMATIC:
                column = tree.kinematics.columns[name].start + connector.axis_index
                value = pose.placement.displacements[name][connector.axis_index]
                rate = pose.rates[column]
                forces[column] += generalized_force(connector.springs[0], value, rate, NUMPY)
    return forces


def load_forces(pose: Pose, matrix):
    """Generalized forces of loads."""
    model, forces = pose.model, np.zeros(matrix.shape[2])
    for load in model.loads:
        segment = pose.placement.poses[load.site.segment]
        point = (segment @ load_pose(model.figure, load.site))[:3, 3]
        value = load.components(pose.time)
        value = segment[:3, :3] @ value if load.kind.is_local else value
        k = list(model.figure.bodies).index(load.site.segment)
        moment, force = value, np.zeros(3)
        if load.kind.is_force:
            moment, force = np.cross(point - pose.state.positions[k], value), value
        forces += np.concatenate([moment, force]) @ matrix[k]
    return forces


def prescribed_rows(pose: Pose):
    """Matrix and right side of locks, links and drives."""
    prescribed, columns = pose.model.prescribed, pose.placement.tree.kinematics.columns
    rows, right = [np.zeros(pose.rates.size)], [0.0]

    def add(value, *terms):
        rows.append(np.zeros(pose.rates.size))
        right.append(value)
        for name, index, factor in terms:
            rows[-1][columns[name].start + index] += factor

    for name, values in prescribed.locked.items():
        for k in range(len(values)):
            add(0.0, (name, k, 1.0))
    for link in prescribed.links.resolved:
        one, other = link.follower, link.control
        add(0.0, (one.joint, one.index, 1.0), (other.joint, other.index, -link.factor))
    for name, drive in prescribed.drives.items():
        second = slope(lambda s, drive=drive: drive.rates(pose.time + s), 1e-3)
        for k, value in zip(prescribed._driven_indices(name), second, strict=True):
            add(value, (name, k, 1.0))
    return np.array(rows[1:]).reshape(-1, pose.rates.size), np.array(right[1:])


def reference(pose: Pose):
    """Accelerations of the bodies and of the displacements."""
    matrix, state = motion_matrix(pose.placement), pose.state
    step = 0.02 / (np.max(np.abs(pose.rates)) or 1.0)
    bias = slope(lambda s: motion_matrix(pose.shifted(s)) @ pose.rates, step)
    size = pose.rates.size
    masses, forces = np.zeros((size, size)), passive_forces(pose, matrix)
    forces += load_forces(pose, matrix)
    for k, segment in enumerate(pose.model.figure.bodies.values()):
        rotation = body_pose(pose.placement, segment)[:3, :3]
        inertia = rotation @ np.diag(segment.inertia) @ rotation.T
        own = np.block([[inertia, np.zeros((3, 3))], [np.zeros((3, 3)), segment.mass * np.eye(3)]])
        spin = state.angular_velocities[k]
        wrench = np.concatenate(
            [-np.cross(spin, inertia @ spin), segment.mass * np.array(pose.model.plan.gravity)]
        )
        masses += matrix[k].T @ own @ matrix[k]
        forces += matrix[k].T @ (wrench - own @ bias[k])
    locks = independent_constraints(pose.placement) if pose.placement.tree.closures else {}
    closing = closure_matrix(pose.placement, locks)
    turning = slope(lambda s: closure_matrix(pose.shifted(s), locks) @ pose.rates, step)
    rows, right = prescribed_rows(pose)
    rows, right = np.vstack([closing, rows]), np.concatenate([-turning, right])
    zero = np.zeros((len(rows), len(rows)))
    solved = np.linalg.solve(
        np.block([[masses, rows.T], [rows, zero]]), np.concatenate([forces, right])
    )[:size]
    return matrix @ solved + bias, solved


def error(model: ExudynModel, pose: Pose) -> float:
    """Relative error of all accelerations."""
    expected, _ = reference(pose)
    found = ExudynEquations(model).accelerations(pose.state)
    return float(np.max(np.abs(found - expected)) / np.max(np.abs(expected)))


TIMES = np.linspace(0.0, 1.0, 9)


def wave(columns, scale=0.4):
    return Drive(TIMES, scale * np.sin(3.0 * TIMES[:, None] + np.arange(columns)))


def link(follower, control, factor):
    one, other = (Coordinate(*place) for place in (follower, control))
    return Link(one, other, factor)


LOADED = (
    TimedLoad(SiteRef("bar1", "far"), LoadKind.LOCAL_FORCE, (0.0, 1.0), ((1, 2, 3), (4, -9, 2))),
    TimedLoad(SiteRef("bar0", "far"), LoadKind.GLOBAL_MOMENT, (0.0, 1.0), ((1, 0, 2), (3, -1, 2))),
)
SLIDING = (chain("Rx Ry Tx"), chain("Tx Ty"), chain("Ra Ts"), chain("Rs"))
SLIDES = springs_of(
    "joint0",
    slides=(AxisSpring(X, (Linear(200.0, 0.1),), Damping(3.0)),),
)
SPRUNG = tuple(
    AxisSpring(axis, (Linear(stiffness, 0.02),), Damping(damping))
    for axis, stiffness, damping in ((X, 200.0, 3.0), (Y, 400.0, 5.0), (Z, 900.0, 2.0))
)
"""Springs along three translations."""

OUTSIDE, INSIDE = chain("Rz Rx Ry Tx Ty Tz"), chain("Tx Ty Tz Rz Rx Ry")
MIXED = (BALL, chain("Rz"), chain("Rx Ry"))
KNEES = Links((link(("right_knee", 0), ("left_knee", 0), 0.7),))

CASES = {
    "prototype": (read_figure("prototype"), {}),
    "prototype, coupled": (read_figure("prototype"), {"spring_choice": "coupled"}),
    "male50": (read_figure("male50"), {}),
    "prototype, weighted": (read_figure("prototype"), {"law": SphericalLaw.WEIGHTED}),
    "prototype, free": (read_figure("prototype"), {"free_root": True}),
    "prototype, Python": (read_figure("prototype"), {"python_torques": True}),
    "clavicles": (read_figure("clavicles"), {}),
    "fourbar": (read_figure("fourbar"), {}),
    "pendulum": (read_figure("pendulum"), {}),
    "locked": (read_figure("prototype"), {"locked": ("waist", "left_knee")}),
    "linked": (read_figure("prototype"), {"links": KNEES}),
    "driven": (
        read_figure("prototype"),
        {"drives": {"waist": wave(3), "left_knee": wave(1), "right_elbow": wave(1)}},
    ),
    "driven in part": (
        row(3, MIXED),
        {
            "drives": {
                "joint0": Drive(TIMES, 0.4 * np.cos(TIMES[:, None]), (1,)),
                "joint2": wave(2),
            },
        },
    ),
    "all prescribed": (
        row(5, (chain("Rz"),)),
        {
            "drives": {"joint0": wave(1)},
            "locked": ("joint3",),
            "links": Links((link(("joint2", 0), ("joint0", 0), -0.5),)),
        },
    ),
    "loads": (row(3, MIXED), {"loads": LOADED}),
    "slides": (row(4, SLIDING), {"springs": SLIDES}),
    "slides outside a ball": (
        row(3, (BALL, OUTSIDE, chain("Rz"))),
        {"springs": springs_of("joint1", slides=SPRUNG)},
    ),
    "slides within a ball": (
        row(3, (BALL, INSIDE, chain("Rz"))),
        {"springs": springs_of("joint1", slides=SPRUNG)},
    ),
    "slides at the ground": (
        row(2, (OUTSIDE, INSIDE)),
        {"springs": springs_of("joint0", slides=SPRUNG)},
    ),
    "two slides and a hinge": (
        row(2, (BALL, chain("Rz Tx Ts"))),
        {"springs": springs_of("joint1", slides=(SPRUNG[0],))},
    ),
    "slides between bodies": (
        row(2, (BALL, chain("Tx Ty Tz"))),
        {"springs": springs_of("joint1", slides=SPRUNG)},
    ),
}


def build(name: str) -> ExudynModel:
    made, fields = CASES[name]
    if name == "loads" or name.startswith("driven in"):
        fields = {"springs": SpringSet(), **fields}
    return build_model(made, Plan(**fields))


@pytest.mark.parametrize("name", CASES)
def test_accelerations_are_those_of_the_displacements(name) -> None:
    model = build(name)
    for seed in range(3):
        size = 0.1 if name == "fourbar" else 0.4
        assert error(model, random_pose(model, seed, size)) < 1e-12


@pytest.mark.parametrize("name", ["prototype", "all prescribed", "fourbar"])
def test_at_rest(name) -> None:
    model = build(name)
    pose = random_pose(model, 1, 0.1)
    at_rest = Pose(model, pose.placement, 0.0 * pose.rates, 0.0)
    if name == "all prescribed":
        at_rest = random_pose(model, 1, 0.1, speed=0.0)
    assert error(model, at_rest) < 1e-12


@pytest.mark.parametrize("sparse", [False, True])
@pytest.mark.parametrize("share", [1e-6, 1e-10, 1e-14])
def test_links_almost_without_mass_lose_no_digits(share, sparse, monkeypatch) -> None:
    """As importers make them between hinges of one body."""
    made = row(4, (chain("Rx"), chain("Rs"), chain("Ry"), chain("Rz")))
    light = {
        name: replace(
            segment,
            mass=share * segment.mass,
            inertia=tuple(share * moment for moment in segment.inertia),
        )
        for name, segment in made.segments.items()
        if name in ("bar0", "bar2")
    }
    made = replace(made, segments={**made.segments, **light})
    model = build_model(made, Plan(springs=SpringSet()))
    if sparse:
        monkeypatch.setattr(agreement, "_MAX_DENSE_BODIES", 0)
    for seed in range(3):
        assert error(model, random_pose(model, seed)) < 1e-12


def test_a_free_body_has_no_constraints() -> None:
    model = build_model(free_body((0.4, 0.3, -0.2, 0.1, 0.5, 0.3)), Plan(springs=SpringSet()))
    assert error(model, random_pose(model)) < 1e-12
    assert model.joints["pin"] == ()


@pytest.mark.parametrize("angle", [-8.0, -4.0, 3.0, 3.5, 5.0, 7.0, 13.0])
def test_a_stiff_hinge_turned_beyond_half_turns(angle) -> None:
    """Exudyn counts turns from the stored angle, not from the start at 0.5 rad."""
    spring = AxisSpring(SKEW, (Linear(500.0, 0.1),), Damping(0.3))
    model = build_model(one_body(chain("Rs"), (0.5,)), Plan(springs=springs_of("pin", spring)))
    placement = forward_kinematics(model.placement.tree, {"pin": np.array([angle])})
    assert error(model, Pose(model, placement, np.array([2.0]), 0.0)) < 1e-12


def test_a_coupled_law_of_a_hinge_turned_beyond_half_turns() -> None:
    model = build("prototype, coupled")
    names = {axis.joint for one in model.coupled for axis in one.axes}
    hinges = [name for name in names if model.figure.joints[name].degrees_of_freedom == 1]
    assert hinges
    pose = random_pose(model, 2)
    displacements = dict(pose.placement.displacements)
    for name in hinges:
        displacements[name] = displacements[name] + np.where(name.startswith("left"), -4.0, 4.0)
    placement = forward_kinematics(pose.placement.tree, displacements)
    assert error(model, Pose(model, placement, pose.rates, 0.0)) < 1e-12


def test_prescribed_joints_accelerate_as_prescribed() -> None:
    """The displacements' accelerations, found from the bodies' alone."""
    for name in ("driven", "locked", "linked", "all prescribed"):
        model = build(name)
        pose = random_pose(model)
        found = ExudynEquations(model).accelerations(pose.state)
        matrix = motion_matrix(pose.placement).reshape(-1, pose.rates.size)
        step = 0.02 / (np.max(np.abs(pose.rates)) or 1.0)
        bias = slope(lambda s, pose=pose: motion_matrix(pose.shifted(s)) @ pose.rates, step)
        solved = np.linalg.lstsq(matrix, (found - bias).ravel())[0]
        rows, right = prescribed_rows(pose)
        assert len(rows) == {"driven": 5, "locked": 4, "linked": 1, "all prescribed": 3}[name]
        assert rows @ solved == pytest.approx(right, abs=1e-10)


def states(model, trace):
    """The states of a trace."""
    parameters = [
        [rigid.RotationMatrix2EulerParameters(rotation) for rotation in rotations]
        for rotations in trace.rotations
    ]
    segments = SegmentMotion(model, trace)
    angles = {
        name: segments.joint(
            model.figure.joints[name], model.placement.displacements[name]
        ).displacements[:, connector.axis_index]
        for name, connectors in model.springs.items()
        for connector in connectors
        if connector.angle_node is not None
    }
    return [
        BodyState(
            float(trace.times[k]),
            trace.positions[k],
            np.array(parameters[k]),
            trace.velocities[k],
            trace.angular_velocities[k],
            {name: float(values[k]) for name, values in angles.items()},
        )
        for k in range(len(trace))
    ]


@pytest.mark.parametrize("name", ["prototype", "clavicles", "fourbar", "linked", "driven", "loads"])
def test_a_run_has_these_accelerations_and_multipliers(name) -> None:
    model, times = build(name), np.linspace(0.0, 0.02, 5)
    equations = ExudynEquations(model)
    deadline = time.monotonic() + 60.0
    trace = integrate(model, times, 1e-4, deadline, lambda _: None).trace
    velocities = np.concatenate([trace.angular_velocities, trace.velocities], axis=2)
    expected = (velocities[:-4] - 8.0 * velocities[1:-3] + 8.0 * velocities[3:-1] - velocities[4:])[
        0
    ] / (12.0 * 0.005)
    state = states(model, trace)[2]
    found = equations.accelerations(state)
    assert np.max(np.abs(found - expected)) < 2e-3 * np.max(np.abs(expected))
    multipliers = equations.multipliers(state)
    for joint, values in trace.multipliers.items():
        scale = max(1.0, float(np.max(np.abs(values), initial=0.0)))
        assert multipliers.joints[joint].shape == values[2].shape
        assert np.allclose(multipliers.joints[joint], values[2], rtol=0.0, atol=1e-3 * scale)
    assert np.allclose(multipliers.coordinates, trace.coordinate_multipliers[2], rtol=1e-3)


def test_the_model_keeps_its_state_and_can_be_integrated() -> None:
    def run(*, is_evaluated: bool):
        model = build("driven")
        data = model.mbs.systemData
        before = [*data.GetSystemState(), data.GetODE2Coordinates_tt(), data.GetTime()]
        if is_evaluated:
            equations, state = ExudynEquations(model), random_pose(model).state
            equations.accelerations(state)
            equations.multipliers(state)
            after = [*data.GetSystemState(), data.GetODE2Coordinates_tt(), data.GetTime()]
            assert all(np.array_equal(*pair) for pair in zip(before, after, strict=True))
        deadline = time.monotonic() + 60.0
        times = frame_times(0.0, 0.1, 0.02)
        return integrate(model, times, 1e-3, deadline, lambda _: None).trace

    one, other = run(is_evaluated=True), run(is_evaluated=False)
    assert np.array_equal(one.positions, other.positions)
    assert np.array_equal(one.coordinate_multipliers, other.coordinate_multipliers)


def test_it_may_be_made_before_or_after_a_run() -> None:
    model = build("prototype")
    state, before = random_pose(model).state, ExudynEquations(model)
    first = before.accelerations(state)
    deadline = time.monotonic() + 60.0
    integrate(model, frame_times(0.0, 0.04, 0.02), 1e-3, deadline, lambda _: None)
    assert np.array_equal(before.accelerations(state), first)
    assert np.array_equal(ExudynEquations(model).accelerations(state), first)


def test_the_current_multipliers_do_not_matter() -> None:
    """Exudyn's equations of unused rows are the multipliers themselves."""
    model = build("loads")
    state = random_pose(model).state
    equations = ExudynEquations(model)
    first = equations.accelerations(state)
    data = model.mbs.systemData
    data.SetAECoordinates(np.ones(data.AEsize()).tolist())
    assert np.array_equal(equations.accelerations(state), first)


def test_a_long_chain_loses_no_digits() -> None:
    """100 balls: the multipliers and the accelerations satisfy each body's own equations."""
    model = build_model(row(100), Plan(springs=SpringSet()))
    pose = random_pose(model, size=0.1, speed=0.5)
    state = pose.state
    equations = ExudynEquations(model)
    found = equations.accelerations(state)
    forces = -np.array(
        [equations.multipliers(state).joints[f"joint{k}"][0, :3] for k in range(100)]
    )
    scale = np.max(np.abs(forces))
    for k, segment in enumerate(model.figure.bodies.values()):
        weight = segment.mass * np.array(model.plan.gravity)
        outer = forces[k + 1] if k < 99 else 0.0
        missing = segment.mass * found[k, 3:] - weight - forces[k] + outer
        assert np.max(np.abs(missing)) < 1e-13 * scale


def test_dependent_constraints_are_refused() -> None:
    masses, forces = np.eye(6)[None], np.ones(6)
    jacobian = csc_array(np.array([[1.0, 0, 0, 0, 2, 0], [1.0, 0, 0, 0, 2, 0]]))
    with pytest.raises(ModelError, match="constraints of the model depend on each other"):
        _solve_constrained(masses, forces, jacobian, np.array([0.0, 1.0]))


@pytest.mark.slow
def test_memory_does_not_grow() -> None:
    """Exudyn frees the system although a solver was set up on it."""
    state = random_pose(build("driven")).state
    peaks = []
    for count in (30, 120):
        for _ in range(count):
            ExudynEquations(build("driven")).multipliers(state)
        gc.collect()
        peaks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    assert peaks[1] - peaks[0] < 4000
