"""Passive torques of a figure and of the figure that a model brings back, side by side."""

import re
from itertools import product
from typing import NamedTuple

import numpy as np

from generator.figure import AxisKind, Figure, Joint
from generator.joint_chain import Chain
from generator.losses import Losses
from generator.model_files.displacement_torques import generalized_torques
from generator.model_files.fit_error import joint_ranges
from generator.model_files.imported import Imported
from generator.names import coordinate_names
from generator.passive_curve import rotation_vector
from generator.rotations import Array, unit_vector
from springs import JointSprings, SpringSet, total_torque

_VALUES = 7
"""Values of each displacement."""

LARGEST_FACTOR = np.sqrt(3.0) * 0.5 * np.pi
"""Of the errors of three axes in a torque: across a rotation vector it is (a/2)/sin(a/2) larger."""


class Comparison(NamedTuple):
    """Largest difference of the generalized torques of a joint, and their largest size [N m]."""

    difference: float
    size: float


def grid(joint: Joint, springs: JointSprings) -> Array:
    """Displacements in the range of a joint, also as components of its rotation vector, (n, k)."""
    ranges = joint_ranges(joint, springs)
    found = np.array(list(product(*(np.linspace(low, high, _VALUES) for low, high in ranges))))
    chain = Chain(joint.chain)
    if len(chain.rotations) < 2:
        return found
    vectors, inside = rotation_vector(chain, found), np.full(len(found), True)
    inside &= np.linalg.norm(vectors, axis=1) < np.pi - 1e-3
    for k in chain.rotations:
        component = vectors @ unit_vector(joint.chain[k].axis)
        inside &= (component >= ranges[k][0]) & (component <= ranges[k][1])
    return found[inside]


def torques(figure: Figure, springs: SpringSet, name: str, displacements: Array) -> Array:
    """Generalized elastic torques of a joint, shape (n, k) [N m]."""
    joint = figure.joints[name]
    axes = springs.joints[name].axes if name in springs.joints else ()
    chain = Chain(joint.chain)
    if len(chain.rotations) > 1:
        return generalized_torques(chain, springs.joining, axes, displacements)
    found = np.zeros_like(displacements)
    for axis in axes:
        (k,) = chain.rotations
        sign = np.sign(unit_vector(joint.chain[k].axis) @ axis.direction)
        angle = sign * displacements[:, k]
        found[:, k] += sign * (np.asarray(total_torque(axis.elastic, angle)) + 0.0 * angle)
    return found


def compare(
    figure: Figure, springs: SpringSet, imported: Imported, back: SpringSet, name: str
) -> Comparison:
    """Compare the torques of a joint with those of the figure that came back."""
    displacements = grid(figure.joints[name], springs.joints[name])
    places = [imported.coordinates[each] for each in _coordinates(imported, figure, name)]
    (joint,) = {place.joint for place in places}
    moved = np.zeros_like(displacements)
    for k, place in enumerate(places):
        moved[:, place.index] = displacements[:, k]
    expected = torques(figure, springs, name, displacements)
    found = torques(imported.figure, back, joint, moved)[:, [place.index for place in places]]
    return Comparison(float(np.abs(found - expected).max()), float(np.abs(expected).max()))


def _coordinates(imported: Imported, figure: Figure, name: str) -> tuple[str, ...]:
    """Names of the coordinates that the displacements of a joint have in the model."""
    names = coordinate_names({name: figure.joints[name].chain})[name]
    return tuple(name if each not in imported.coordinates else each for each in names)


def viscous(figure: Figure, springs: SpringSet, name: str) -> list[float]:
    """Viscous damping about the axes of a joint's chain [N m s/rad]."""
    axes = springs.joints[name].axes if name in springs.joints else ()
    return [
        sum(a.damping.viscous for a in axes if abs(unit_vector(each.axis) @ a.direction) > 0.99)
        for each in figure.joints[name].chain
        if each.kind is AxisKind.ROTATION
    ]


def stated(losses: Losses, name: str) -> float:
    """Largest error that a list of losses states for a joint or one of its axes [N m]."""
    text = "; ".join(f"{loss.what}: {', '.join(loss.where)}" for loss in losses.entries)
    found = re.findall(rf"\b{name}(?:_\w)? ?[:(] ?([0-9.e-]+) N m at most", text)
    return max(map(float, found), default=0.0)
