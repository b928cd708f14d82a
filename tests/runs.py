"""Shared parts of tests of runs: springs, energy, momentum, one degree of freedom, equal bits."""

from collections.abc import Iterable
from dataclasses import fields
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from generator.contact.record import (
    ContactRecord,
    HeadImpact,
    Overlap,
    PartContact,
    SegmentContact,
)
from generator.figure import Figure
from generator.kinematics.free_root import tree_for_motion
from generator.kinematics.placement import forward_kinematics, segment_jacobians
from generator.recording import Accuracy, Outcome, Recording
from generator.rotations import Array
from springs import JointSprings, SpringSet


def springs_of(joint, *axes, slides=(), **fields) -> SpringSet:
    """The springs of one joint, about axes and along slides."""
    return SpringSet({joint: JointSprings(joint, axes, tuple(slides))}, **fields)


def energy_error(run) -> float:
    """Largest change of the energy balance since the start [J]."""
    return float(np.max(np.abs(run.energy_balance - run.energy_balance[0])))


def momenta(
    figure: Figure, run: Recording, frames: Iterable[int] | None = None
) -> tuple[Array, Array]:
    """Linear [N s], and angular about the centre of mass [N m s], shape (n, 3) each.

    Found from the joints' displacements and rates by kinematics alone, by default in all frames.
    """
    tree = tree_for_motion(figure, run.chains)
    linear, angular = [], []
    for k in range(len(run.times)) if frames is None else frames:
        placed = forward_kinematics(tree, {name: row[k] for name, row in run.displacements.items()})
        rates = np.concatenate([run.velocities[b.joint.name][k] for b in tree.joints])
        maps = segment_jacobians(placed)
        pushes, turns = np.zeros(3), np.zeros(3)
        for name, segment in tree.figure.bodies.items():
            spin, at_origin = np.split(maps[name] @ rates, 2)
            pose = placed.poses[name]
            centre = pose[:3, :3] @ segment.centre_of_mass + pose[:3, 3]
            push = segment.mass * (at_origin + np.cross(spin, centre))
            inertia = pose[:3, :3] @ np.diag(segment.inertia) @ pose[:3, :3].T
            pushes += push
            turns += inertia @ spin + np.cross(centre - run.centre_of_mass[k], push)
        linear.append(pushes)
        angular.append(turns)
    return np.array(linear), np.array(angular)


def integrate_angle(acceleration, start, rate, times):
    """Angle and rate at some times, of an angle with an acceleration (angle, rate), to 1e-12."""
    found = solve_ivp(
        lambda _, y: [y[1], acceleration(y[0], y[1])],
        (times[0], times[-1]),
        [start, rate],
        "DOP853",
        t_eval=times,
        rtol=1e-12,
        atol=1e-12,
    )
    assert found.success
    return found.y


def same_bits(one: Any, other: Any) -> bool:
    """Equality of every bit of arrays and of the order of keys; NaN equals itself."""
    match one:
        case np.ndarray():
            return one.shape == other.shape and one.tobytes() == other.tobytes()
        case dict():
            return list(one) == list(other) and all(same_bits(one[k], other[k]) for k in one)
        case tuple():
            pairs = zip(one, other, strict=False)
            return type(one) is type(other) and all(same_bits(*pair) for pair in pairs)
        case (
            Accuracy()
            | Outcome()
            | ContactRecord()
            | SegmentContact()
            | Overlap()
            | PartContact()
            | HeadImpact()
        ):
            names = [field.name for field in fields(one)]
            return all(same_bits(getattr(one, n), getattr(other, n)) for n in names)
        case _:
            return type(one) is type(other) and (one == other or (one != one and other != other))
