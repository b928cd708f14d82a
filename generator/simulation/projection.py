"""Projection of frames onto the constraints of locked, linked and driven joints.

The integrator satisfies constraints on velocity level, so positions drift. The projection keeps the
free displacements, computes the others from these and the time, and places all bodies again, which
also closes the gaps at joints.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from generator.kinematics.loops import OpenLoopError, close_loops, consistent_rates
from generator.kinematics.placement import forward_kinematics
from generator.kinematics.prescribed import PrescribedMotion, loop_closure_jacobian
from generator.recording import Outcome
from generator.rotations import Array
from generator.simulation.exudyn_model.model import ExudynModel
from generator.simulation.joint_motion import JointMotion
from generator.simulation.run_model import RunModel
from generator.simulation.trace import Trace

_RANK_TOLERANCE = 1e-7
"""Singular values below this count as zero [m or 1]."""

_MAX_FRAMES_TO_DEAD_POINT = 2.0
"""Largest number of frames to a dead point to which the end of a run is attributed."""

_MIN_AXES_SINGULAR_VALUE = 0.15
"""Smallest singular value of a joint's axes below which they count as singular; about 12 deg."""


def constraint_drift(
    model: RunModel, trace: Trace, joints: Mapping[str, JointMotion]
) -> dict[str, Array]:
    """Drift of each prescribed joint from its constraint, shape (n,) [rad or m]."""
    prescribed = model.prescribed
    actual = {name: moved.displacements for name, moved in joints.items()}
    imposed = prescribed.impose_displacements(actual, trace.times)
    return {
        name: np.max(np.abs(imposed[name] - actual[name]), axis=1)
        for name in joints
        if name in prescribed.fixed_joints
    }


def explain_singularity(
    model: ExudynModel, outcome: Outcome, joints: Mapping[str, JointMotion]
) -> Outcome:
    """Attribute a failure of the solver to a joint that ends near a pole of its displacements.

    Two of its axes coincide there, so the rates of single displacements are undefined.
    """
    constrained_joints = {
        term.joint
        for constraint in model.coordinate_constraints
        for row in constraint.equations
        for term in row
        if isinstance(term.component, int)
    }
    for name in joints:
        chain = model.placement.tree.chains[name]
        if name not in constrained_joints or len(chain.rotations) < 3:
            continue
        axes = chain.twists(joints[name].displacements[-1])[list(chain.rotations), :3]
        if np.linalg.svd(axes, compute_uv=False)[-1] < _MIN_AXES_SINGULAR_VALUE:
            message = (
                f"joint {name}, linked or driven by single displacements, reached after "
                f"{outcome.last_time:.4g} s a pose in which two of its axes coincide "
                "and their rates are not defined"
            )
            return replace(outcome, message=message, joint=name)
    return outcome


def explain_dead_point(
    model: RunModel, outcome: Outcome, joints: Mapping[str, JointMotion]
) -> Outcome:
    """Attribute a failure of the solver to a dead point of a driven loop.

    The rates of the free displacements do not close the loop there. The square of the smallest
    singular value decreases linearly to zero, so two frames give the time of the dead point.
    """
    prescribed = model.prescribed
    tree, displacements = (
        prescribed.tree,
        {name: moved.displacements for name, moved in joints.items()},
    )
    count = min(map(len, displacements.values()), default=0)
    if not (prescribed.drives and tree.closures) or count < 2:
        return outcome
    squared_slopes: list[float] = []
    for k in (count - 2, count - 1):
        at = {name: rows[k] for name, rows in displacements.items()}
        rows = loop_closure_jacobian(forward_kinematics(tree, at))
        rank = int(np.linalg.matrix_rank(rows, _RANK_TOLERANCE))
        slopes = np.linalg.svd(rows @ prescribed.free_jacobian(at), compute_uv=False)
        squared_slopes.append(float(slopes[rank - 1]) ** 2 if 0 < rank <= len(slopes) else 0.0)
    before, last = squared_slopes
    if last > _MAX_FRAMES_TO_DEAD_POINT * (before - last):
        return outcome
    closing = ", ".join(joint.name for joint in tree.closures)
    driven = ", ".join(prescribed.drives)
    message = (
        f"the loop closed by {closing} reached a dead point after {outcome.last_time:.4g} s, "
        f"beyond which it cannot follow the drive of {driven}"
    )
    return replace(outcome, message=message, joint=next(iter(prescribed.drives)))


def project_to_constraints(
    model: RunModel, trace: Trace, joints: Mapping[str, JointMotion]
) -> Trace:
    """Return the trace with all constraints satisfied.

    Args:
        model: the simulated model.
        trace: n frames.
        joints: motion of every joint in them.
    """
    prescribed = model.prescribed
    displacements = prescribed.impose_displacements(
        {name: moved.displacements for name, moved in joints.items()}, trace.times
    )
    rates = prescribed.impose_rates(
        {name: moved.rates for name, moved in joints.items()}, trace.times, displacements
    )
    kinematics = prescribed.tree.kinematics
    values, speeds = (
        kinematics.displacement_vector(displacements),
        kinematics.displacement_vector(rates),
    )
    if prescribed.tree.closures:
        values, speeds = _close_loops_by_frame(prescribed, displacements, rates)
    poses = kinematics.poses(values)
    twists = kinematics.twists(values)
    positions, rotations, velocities, angular_velocities = (
        np.empty_like(part) for part in _state_arrays(trace)
    )
    for k, (name, segment) in enumerate(model.figure.bodies.items()):
        centre = segment.centre_of_mass
        assert centre is not None
        motion = ((speeds * kinematics.motion_masks[name])[:, None, :] @ twists)[:, 0]
        rotations[:, k] = poses[name][:, :3, :3]
        positions[:, k] = poses[name][:, :3, 3] + rotations[:, k] @ centre
        angular_velocities[:, k] = motion[:, :3]
        velocities[:, k] = motion[:, 3:] + np.cross(motion[:, :3], positions[:, k])
    return trace.with_motion(positions, rotations, velocities, angular_velocities)


def _state_arrays(trace: Trace) -> tuple[Array, Array, Array, Array]:
    return trace.positions, trace.rotations, trace.velocities, trace.angular_velocities


def _close_loops_by_frame(
    prescribed: PrescribedMotion, displacements: Mapping[str, Array], rates: Mapping[str, Array]
) -> tuple[Array, Array]:
    """Displacements and rates of the tree with closed loops, shape (n, m) each.

    A frame whose loops cannot be closed is unchanged.
    """
    kinematics = prescribed.tree.kinematics
    values, speeds = (
        kinematics.displacement_vector(displacements),
        kinematics.displacement_vector(rates),
    )
    for k in range(len(values)):
        try:
            placement = close_loops(
                prescribed.tree,
                {name: rows[k] for name, rows in displacements.items()},
                fixed=prescribed.fixed_joints,
            )
            speeds[k] = consistent_rates(
                placement,
                {name: rows[k] for name, rows in rates.items()},
                fixed=prescribed.fixed_joints,
            )
            values[k] = kinematics.displacement_vector(placement.displacements)
        except OpenLoopError:
            continue
    return values, speeds
