"""Frames on which locked, linked and driven joints are where they must be, to the last digit.

The integrator holds constraints on velocity level, and positions drift away from them, as those of
joints do. The free displacements stay as the run found them, the others are put where these and the
time have them, and all bodies are placed anew: sites that had parted come together as well.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from generator.kinematics.loops import OpenLoopError, close_loops, consistent_rates
from generator.kinematics.placement import forward_kinematics
from generator.kinematics.prescribed import PrescribedMotion, loop_closure_jacobian
from generator.recording import Ending, Outcome
from generator.rotations import Array
from generator.simulation.integrate import Trace
from generator.simulation.joint_motion import JointMotion
from generator.simulation.model import ExudynModel

_RANK_TOLERANCE = 1e-7
"""Singular values below this are of rows that follow from others [m or 1]."""

_MAX_FRAMES_TO_DEAD_POINT = 2.0
"""A dead point that is no more frames away has ended the run."""

_MIN_AXES_SINGULAR_VALUE = 0.15
"""Smallest singular value of a joint's three axes that is so called; for angles of 12 deg."""


def constraint_drift(
    assembly: ExudynModel, trace: Trace, joints: Mapping[str, JointMotion]
) -> dict[str, Array]:
    """How far each prescribed joint has drifted from where it must be, shape (n,) [rad or m]."""
    prescribed = assembly.prescribed
    given = {name: moved.displacements for name, moved in joints.items()}
    meant = prescribed.impose_displacements(given, trace.times)
    return {
        name: np.max(np.abs(meant[name] - given[name]), axis=1)
        for name in joints
        if name in prescribed.held
    }


def explain_singularity(
    assembly: ExudynModel, outcome: Outcome, joints: Mapping[str, JointMotion]
) -> Outcome:
    """A failure with its reason, where a joint is at the end near a pole of its displacements.

    There two of its axes fall together, and single displacements have no rates to hold.
    """
    if outcome.ending is not Ending.SOLVER_FAILED:
        return outcome
    single = {
        term.joint
        for servo in assembly.coordinate_constraints
        for row in servo.equations
        for term in row
        if isinstance(term.component, int)
    }
    for name in joints:
        chain = assembly.placement.tree.chains[name]
        if name not in single or len(chain.rotations) < 3:
            continue
        axes = chain.twists(joints[name].displacements[-1])[list(chain.rotations), :3]
        if np.linalg.svd(axes, compute_uv=False)[-1] < _MIN_AXES_SINGULAR_VALUE:
            message = (
                f"joint {name}, which is linked or driven by single displacements, came after "
                f"{outcome.last_time:.4g} s near a pose in which two of its axes fall together "
                "and their rates are not defined"
            )
            return replace(outcome, message=message, joint=name)
    return outcome


def explain_dead_point(
    assembly: ExudynModel, outcome: Outcome, joints: Mapping[str, JointMotion]
) -> Outcome:
    """A failure with its reason, where loops were driven to a dead point at the end.

    There the rates of the free displacements do not close the loops. The square of what is left of
    their slope falls to zero in proportion to the time that is left, so two frames tell when.
    """
    prescribed = assembly.prescribed
    tree, ends = prescribed.tree, {name: moved.displacements for name, moved in joints.items()}
    count = min(map(len, ends.values()), default=0)
    failed = outcome.ending is Ending.SOLVER_FAILED
    if not (failed and prescribed.drives and tree.closures) or count < 2:
        return outcome
    left: list[float] = []
    for k in (count - 2, count - 1):
        rows = loop_closure_jacobian(
            forward_kinematics(tree, {name: rows[k] for name, rows in ends.items()})
        )
        rank = int(np.linalg.matrix_rank(rows, _RANK_TOLERANCE))
        slopes = np.linalg.svd(rows @ prescribed.free_jacobian, compute_uv=False)
        left.append(float(slopes[rank - 1]) ** 2 if 0 < rank <= len(slopes) else 0.0)
    before, last = left
    if last > _MAX_FRAMES_TO_DEAD_POINT * (before - last):
        return outcome
    closing = ", ".join(joint.name for joint in tree.closures)
    driven = ", ".join(prescribed.drives)
    message = (
        f"the loop that {closing} closes came after {outcome.last_time:.4g} s near a dead point, "
        f"beyond which it cannot follow the drive of {driven}"
    )
    return replace(outcome, message=message, joint=next(iter(prescribed.drives)))


def project_to_constraints(
    assembly: ExudynModel, trace: Trace, joints: Mapping[str, JointMotion]
) -> Trace:
    """The trace with all joints where they must be.

    Args:
        assembly: what was simulated.
        trace: n frames.
        joints: the motion of every joint in them.
    """
    prescribed = assembly.prescribed
    displacements = prescribed.impose_displacements(
        {name: moved.displacements for name, moved in joints.items()}, trace.times
    )
    rates = prescribed.impose_rates(
        {name: moved.rates for name, moved in joints.items()}, trace.times
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
    places, turns, velocities, spins = (np.empty_like(part) for part in _state_arrays(trace))
    for k, (name, segment) in enumerate(assembly.figure.bodies.items()):
        centre = segment.centre_of_mass
        assert centre is not None
        motion = ((speeds * kinematics.motion_masks[name])[:, None, :] @ twists)[:, 0]
        turns[:, k] = poses[name][:, :3, :3]
        places[:, k] = poses[name][:, :3, 3] + turns[:, k] @ centre
        spins[:, k] = motion[:, :3]
        velocities[:, k] = motion[:, 3:] + np.cross(motion[:, :3], places[:, k])
    return trace.with_motion(places, turns, velocities, spins)


def _state_arrays(trace: Trace) -> tuple[Array, Array, Array, Array]:
    return trace.positions, trace.rotations, trace.velocities, trace.angular_velocities


def _close_loops_by_frame(
    prescribed: PrescribedMotion, displacements: Mapping[str, Array], rates: Mapping[str, Array]
) -> tuple[Array, Array]:
    """Displacements and rates of the tree with loops closed, frame by frame, shape (n, m) each.

    A frame whose loops cannot be closed stays as it is.
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
                held=prescribed.held,
            )
            speeds[k] = consistent_rates(
                placement, {name: rows[k] for name, rows in rates.items()}, held=prescribed.held
            )
            values[k] = kinematics.displacement_vector(placement.displacements)
        except OpenLoopError:
            continue
    return values, speeds
