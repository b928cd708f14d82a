"""Generalized forces that a given motion of a tree needs, by Newton and Euler's equations.

All vectors are spatial: (angular, linear) in world axes, the linear part that of the material point
at the world's origin. With the twist s_k of a unit rate of displacement k and the velocity V of the
frame that it is fixed to, d s_k/dt = V x s_k (Featherstone 2008, Rigid Body Dynamics Algorithms,
sections 2.9 and 5.3).
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generator.diagnostics import ModelError, shorten
from generator.follower_curve import FollowerCurve
from generator.kinematics.tree import Tree
from generator.rotations import Array


@dataclass(frozen=True, eq=False)
class Motion:
    """Displacements of a tree over n times, with both derivatives.

    Attributes:
        times: Times [s], shape (n,).
        values: Displacements, shape (n, m) [rad or m].
        rates: Their rates, likewise [rad/s or m/s].
        accelerations: Their second derivatives, likewise [rad/s2 or m/s2].
    """

    times: Array
    values: Array
    rates: Array
    accelerations: Array


def check_masses(tree: Tree) -> None:
    """Raise ModelError unless inverse dynamics of the tree is determined.

    Bodies need masses, and joints must not close loops, whose forces equilibrium leaves open.
    """
    if tree.closures:
        names = ", ".join(shorten(joint.name) for joint in tree.closures)
        raise ModelError(
            f"the joints {names} close loops, in which equilibrium does not determine the moments"
        )
    for name, body in tree.figure.bodies.items():
        if not (body.mass and body.inertia and body.centre_of_mass is not None):
            raise ModelError(
                f"segment `{shorten(name)}` moves without mass, inertia or centre of mass; "
                "`mover complete` estimates them"
            )


def generalized_forces(
    tree: Tree, motion: Motion, wrenches: Mapping[str, Array], gravity: ArrayLike
) -> Array:
    """Return the forces along the displacements that a motion needs, shape (n, m) [N m or N].

    Args:
        tree: Tree without loops, whose bodies have masses.
        motion: Motion of its displacements.
        wrenches: Moment about the world's origin and force on segments, shape (n, 6) [N m, N].
        gravity: Acceleration of gravity, shape (3,) [m/s2].

    Raises:
        ModelError: A body has no mass, or a joint closes a loop.
    """
    check_masses(tree)
    kinematics, figure = tree.kinematics, tree.figure
    twists, poses = kinematics.twists(motion.values), kinematics.poses(motion.values)
    count = len(motion.times)
    at_rest = np.zeros((count, 6))
    velocities: dict[str, Array] = dict.fromkeys(figure.ground, at_rest)
    accelerations: dict[str, Array] = dict(velocities)
    forces = np.zeros((count, kinematics.size, 6))
    for branch in tree.joints:
        velocity, acceleration = velocities[branch.inboard], accelerations[branch.inboard]
        columns = kinematics.columns[branch.joint.name]
        order = range(columns.start, columns.stop)
        for k in order[::-1] if branch.parent_is_inboard else order:
            twist, rate = twists[:, k], motion.rates[:, k, None]
            bend = _cross_motion(velocity, twist)
            acceleration = acceleration + twist * motion.accelerations[:, k, None] + bend * rate
            velocity = velocity + twist * rate
        velocities[branch.outboard], accelerations[branch.outboard] = velocity, acceleration
        name = branch.outboard
        needed = _momentum_rate(tree, name, poses[name], velocity, acceleration, gravity)
        needed = needed - wrenches.get(name, at_rest)
        forces += kinematics.motion_masks[name][None, :, None] * needed[:, None, :]
    return np.einsum("nki,nki->nk", twists, forces)


def _cross_motion(velocity: Array, twist: Array) -> Array:
    """Return the rate of twists, shape (n, 6), fixed to frames of these velocities."""
    angular = np.cross(velocity[:, :3], twist[:, :3])
    linear = np.cross(velocity[:, :3], twist[:, 3:]) + np.cross(velocity[:, 3:], twist[:, :3])
    return np.hstack([angular, linear])


def _momentum_rate(
    tree: Tree, name: str, pose: Array, velocity: Array, acceleration: Array, gravity: ArrayLike
) -> Array:
    """Return the wrench about the origin that a segment needs beside its weight, shape (n, 6)."""
    body = tree.figure.segments[name]
    assert body.mass is not None
    assert body.centre_of_mass is not None
    turn: Array = pose[:, :3, :3]
    arm: Array = turn @ body.centre_of_mass + pose[:, :3, 3]
    spin, bend = velocity[:, :3], acceleration[:, :3]
    speed = velocity[:, 3:] + np.cross(spin, arm)
    at_centre = acceleration[:, 3:] + np.cross(bend, arm) + np.cross(spin, speed)
    force = body.mass * (at_centre - np.asarray(gravity))
    inertia = (turn * np.asarray(body.inertia)) @ np.swapaxes(turn, 1, 2)
    momentum = np.einsum("nij,nj->ni", inertia, spin)
    moment = np.einsum("nij,nj->ni", inertia, bend) + np.cross(spin, momentum)
    return np.hstack([moment + np.cross(arm, force), force])


def follow_curves(tree: Tree, motion: Motion) -> Motion:
    """Return the motion with the displacements set that follow others in the figure's file."""
    values, rates, accelerations = (
        part.copy() for part in (motion.values, motion.rates, motion.accelerations)
    )
    for own, control, curve in curve_columns(tree):
        y, y1, y2 = (part[:, control] for part in (values, rates, accelerations))
        slope, bend = curve.at(y, 1), curve.at(y, 2)
        values[:, own] = curve.at(y)
        rates[:, own] = slope * y1
        accelerations[:, own] = slope * y2 + bend * y1**2
    return Motion(motion.times, values, rates, accelerations)


def add_followers_forces(tree: Tree, motion: Motion, forces: Array) -> Array:
    """Return the forces with those of followers added to their controls, by the chain rule."""
    total = forces.copy()
    for own, control, curve in curve_columns(tree):
        total[:, control] += curve.at(motion.values[:, control], 1) * forces[:, own]
    return total


def curve_columns(tree: Tree) -> Iterator[tuple[int, int, FollowerCurve]]:
    """Yield columns of displacements that follow, and of their controls, with the curves."""
    starts = {name: columns.start for name, columns in tree.kinematics.columns.items()}
    for name, start in starts.items():
        for k, one in enumerate(tree.figure.joints[name].followers):
            if one is not None:
                yield start + k, starts[one.joint] + one.index, one.curve
