"""Exudyn's equations at any state, against equations in the displacements of the joints.

The reference has the bodies' motions from forward kinematics, the torques of `springs`, and the
closures, locks, links and drives as linear equations of the displacements' accelerations.
"""

import gc
import resource
import time
from dataclasses import dataclass

import numpy as np
import pytest

from generator import read_figure
from generator.diagnostics import ModelError
from generator.drive import Drive
from generator.figure import SiteRef
from generator.kinematics.links import Coordinate, Link, Links
from generator.kinematics.loops import close_loops, consistent_rates
from generator.kinematics.placement import (
    forward_kinematics,
    relative_jacobian,
    segment_jacobians,
)
from generator.loads import LoadKind, TimedLoad
from generator.rotations import cross_matrix
from generator.simulation.agreement import BodyState, ExudynEquations
from generator.simulation.bodies import body_pose, load_pose
from generator.simulation.constraints import RateConstraint
from generator.simulation.exudyn_api import rigid
from generator.simulation.integrate import Trace, frame_times, integrate
from generator.simulation.joint_motion import SegmentMotion
from generator.simulation.joints import constraint_jacobian, independent_constraints
from generator.simulation.model import ExudynModel
from generator.simulation.plan import Plan
from generator.simulation.springs import JointKind, generalized_force
from springs import NUMPY, AxisSpring, Damping, Joining, JointSprings, Linear, SpringSet
from tests.chains import BALL, SKEW, X, Y, Z, at, body, chain, figure, ground, joint, one_body, row
from tests.runs import springs_of

STENCIL = tuple(zip((1, 2, 3, 4), (4 / 5, -1 / 5, 4 / 105, -1 / 280), strict=True))


def slope(function, step):
    """Derivative at zero, to rounding where the function is smooth over the step."""
    return sum(w * (function(k * step) - function(-k * step)) for k, w in STENCIL) / step


@dataclass(frozen=True)
class Pose:
    """Displacements and rates of a model's tree at a time; `placement` has both kinds of joints."""

    model: ExudynModel
    placement: object
    rates: np.ndarray
    time: float

    @property
    def rates_by_joint(self):
        columns = self.placement.tree.kinematics.columns
        return {name: self.rates[columns[name]] for name in columns}

    def shifted(self, step):
        """The placement after the displacements have moved with their rates."""
        moved = {
            name: self.placement.displacements[name] + step * rates
            for name, rates in self.rates_by_joint.items()
        }
        return forward_kinematics(self.placement.tree, moved)

    @property
    def state(self) -> BodyState:
        figure = self.model.figure
        poses = [body_pose(self.placement, segment) for segment in figure.bodies.values()]
        motions = motion_matrix(self.placement) @ self.rates
        return BodyState(
            self.time,
            np.array([pose[:3, 3] for pose in poses]),
            np.array([rigid.RotationMatrix2EulerParameters(pose[:3, :3]) for pose in poses]),
            motions[:, 3:],
            motions[:, :3],
            {
                name: float(self.placement.displacements[name][connector.axis_index])
                for name, connectors in self.model.springs.items()
                for connector in connectors
                if connector.angle_node is not None
            },
        )


def motion_matrix(placement):
    """Angular velocities and velocities of the centres of mass by rates, shape (B, 6, n)."""
    jacobians = segment_jacobians(placement)
    matrices = []
    for name, segment in placement.tree.figure.bodies.items():
        matrix = jacobians[name]
        centre = body_pose(placement, segment)[:3, 3]
        matrices.append(np.vstack([matrix[:3], matrix[3:] - cross_matrix(centre) @ matrix[:3]]))
    return np.array(matrices)


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
    for load, *_ in model.loads:
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
    step = 0.02 / np.max(np.abs(pose.rates))
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


def random_pose(model: ExudynModel, seed=0, size=0.4, speed=2.0, moment=0.35) -> Pose:
    """A pose and rates that closures, locks, links and drives allow."""
    rng, start = np.random.default_rng(seed), model.placement
    figure, prescribed = model.figure, model.prescribed
    displacements = {
        name: values + size * rng.uniform(-1.0, 1.0, values.size)
        for name, values in start.displacements.items()
    }
    displacements = prescribed.impose_displacements(displacements, moment)
    placement = close_loops(start.tree, displacements, fixed=prescribed.fixed_joints)
    rates = {n: speed * rng.normal(size=j.degrees_of_freedom) for n, j in figure.joints.items()}
    rates = prescribed.impose_rates(rates, moment)
    moving = consistent_rates(placement, rates, fixed=prescribed.fixed_joints)
    return Pose(model, placement, moving, moment)


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
MIXED = (BALL, chain("Rz"), chain("Rx Ry"))
KNEES = Links((link(("right_knee", 0), ("left_knee", 0), 0.7),))

CASES = {
    "prototype": (read_figure("prototype"), {}),
    "prototype, coupled": (read_figure("prototype"), {"spring_choice": "coupled"}),
    "prototype, weighted": (read_figure("prototype"), {"joining": Joining.WEIGHTED}),
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
}


def build(name: str) -> ExudynModel:
    made, fields = CASES[name]
    if name == "loads" or name.startswith("driven in"):
        fields = {"springs": SpringSet(), **fields}
    return ExudynModel.of(made, Plan(**fields))


@pytest.mark.parametrize("name", CASES)
def test_accelerations_are_those_of_the_displacements(name) -> None:
    model = build(name)
    for seed in range(3):
        size = 0.1 if name == "fourbar" else 0.4
        assert error(model, random_pose(model, seed, size)) < 1e-11
