"""Frames on which locked, linked and driven joints are where they must be, to the last digit.

The integrator holds constraints on velocity level, and positions drift away from them, as those of
joints do. The free displacements stay as the run found them, the others are put where these and the
time have them, and all bodies are placed anew: sites that had parted come together as well.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from generator.kinematics.loops import OpenLoopError, assemble, consistent_rates
from generator.kinematics.placement import place
from generator.kinematics.prescribed import Prescribed, loop_rows
from generator.recording import Ending, Outcome
from generator.rotations import Array
from generator.simulation.joint_motion import JointMotion
from generator.simulation.model import Assembly
from generator.simulation.states import Trace

_LOOSE = 1e-7
"""Singular values below this are of rows that follow from others [m or 1]."""

_FRAMES_LEFT = 2.0
"""A dead point that is no more frames away has ended the run."""

_NEAR_POLE = 0.15
"""Smallest singular value of a joint's three axes that is so called; for angles of 12 deg."""


def strays(assembly: Assembly, trace: Trace, joints: Mapping[str, JointMotion]) -> dict[str, Array]:
    """How far each prescribed joint has drifted from where it must be, shape (n,) [rad or m]."""
    prescribed = assembly.prescribed
    given = {name: moved.displacements for name, moved in joints.items()}
    meant = prescribed.displacements(given, trace.times)
    return {
        name: np.max(np.abs(meant[name] - given[name]), axis=1)
        for name in joints
        if name in prescribed.held
    }


def told_of_poles(
    assembly: Assembly, outcome: Outcome, joints: Mapping[str, JointMotion]
) -> Outcome:
    """A failure with its reason, where a joint is at the end near a pole of its displacements.

    There two of its axes fall together, and single displacements have no rates to hold.
    """
    if outcome.ending is not Ending.SOLVER_FAILED:
        return outcome
    single = {
        term.joint
        for servo in assembly.servos
        for row in servo.rows
        for term in row
        if isinstance(term.of, int)
    }
    for name in joints:
        chain = assembly.placement.tree.chains[name]
        if name not in single or len(chain.turns) < 3:
            continue
        axes = chain.twists(joints[name].displacements[-1])[list(chain.turns), :3]
        if np.linalg.svd(axes, compute_uv=False)[-1] < _NEAR_POLE:
            message = (
                f"joint {name}, which is linked or driven by single displacements, came after "
                f"{outcome.last_time:.4g} s near a pose in which two of its axes fall together "
                "and their rates are not defined"
            )
            return replace(outcome, message=message, joint=name)
    return outcome


def told_of_dead_points(
    assembly: Assembly, outcome: Outcome, joints: Mapping[str, JointMotion]
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
        rows = loop_rows(place(tree, {name: rows[k] for name, rows in ends.items()}))
        rank = int(np.linalg.matrix_rank(rows, _LOOSE))
        slopes = np.linalg.svd(rows @ prescribed.columns, compute_uv=False)
        left.append(float(slopes[rank - 1]) ** 2 if 0 < rank <= len(slopes) else 0.0)
    before, last = left
    if last > _FRAMES_LEFT * (before - last):
        return outcome
    closing = ", ".join(joint.name for joint in tree.closures)
    driven = ", ".join(prescribed.drives)
    message = (
        f"the loop that {closing} closes came after {outcome.last_time:.4g} s near a dead point, "
        f"beyond which it cannot follow the drive of {driven}"
    )
    return replace(outcome, message=message, joint=next(iter(prescribed.drives)))


def put_right(assembly: Assembly, trace: Trace, joints: Mapping[str, JointMotion]) -> Trace:
    """The trace with all joints where they must be.

    Args:
        assembly: what was simulated.
        trace: n frames.
        joints: the motion of every joint in them.
    """
    prescribed = assembly.prescribed
    displacements = prescribed.displacements(
        {name: moved.displacements for name, moved in joints.items()}, trace.times
    )
    rates = prescribed.rates({name: moved.rates for name, moved in joints.items()}, trace.times)
    kinematics = prescribed.tree.kinematics
    values, speeds = kinematics.values(displacements), kinematics.values(rates)
    if prescribed.tree.closures:
        values, speeds = _closed(prescribed, displacements, rates)
    poses = kinematics.poses(values)
    twists = kinematics.twists(values)
    places, turns, velocities, spins = (np.empty_like(part) for part in _parts(trace))
    for k, (name, segment) in enumerate(assembly.figure.bodies.items()):
        centre = segment.centre_of_mass
        assert centre is not None
        motion = ((speeds * kinematics.moves[name])[:, None, :] @ twists)[:, 0]
        turns[:, k] = poses[name][:, :3, :3]
        places[:, k] = poses[name][:, :3, 3] + turns[:, k] @ centre
        spins[:, k] = motion[:, :3]
        velocities[:, k] = motion[:, 3:] + np.cross(motion[:, :3], places[:, k])
    return trace.moved(places, turns, velocities, spins)


def _parts(trace: Trace) -> tuple[Array, Array, Array, Array]:
    return trace.positions, trace.rotations, trace.velocities, trace.spins


def _closed(
    prescribed: Prescribed, displacements: Mapping[str, Array], rates: Mapping[str, Array]
) -> tuple[Array, Array]:
    """Displacements and rates of the tree with loops closed, frame by frame, shape (n, m) each.

    A frame whose loops cannot be closed stays as it is.
    """
    kinematics = prescribed.tree.kinematics
    values, speeds = kinematics.values(displacements), kinematics.values(rates)
    for k in range(len(values)):
        try:
            placement = assemble(
                prescribed.tree,
                {name: rows[k] for name, rows in displacements.items()},
                held=prescribed.held,
            )
            speeds[k] = consistent_rates(
                placement, {name: rows[k] for name, rows in rates.items()}, held=prescribed.held
            )
            values[k] = kinematics.values(placement.displacements)
        except OpenLoopError:
            continue
    return values, speeds
