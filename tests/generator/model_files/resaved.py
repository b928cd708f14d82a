"""Passive torques of a figure and of the figure that its model brings back, side by side."""

import re
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np

from generator.figure import Figure, Joint, Location, Rotation, SiteRef
from generator.figure_file import read_figure
from generator.joint_chain import Chain
from generator.losses import Losses
from generator.model_files.body_tree.to_figure import FRAME
from generator.model_files.fit_error import joint_ranges
from generator.passive_curve import rotation_vector
from generator.rotations import Array, unit_vector
from generator.springs_file.read import read_springs
from springs import JointSprings, SpringSet
from springs.spherical import elastic_torque

_VALUES = 7
"""Values of each displacement."""

LARGEST_FACTOR = float(np.sqrt(3.0) * 0.5 * np.pi)
"""Of the errors of three axes in a torque: across a rotation vector it is (a/2)/sin(a/2) larger."""


REVERSED = "clavicles, joints reversed and turned"

NAMES = ("prototype", "clavicles", REVERSED)


def sprung_figure(name: str) -> tuple[Figure, SpringSet]:
    """A figure by its name, and its springs."""
    figure = read_figure(name.partition(",")[0])
    springs = read_springs(None, figure)
    if name == REVERSED:
        joints = {
            each: replace(figure.joints[each], parent=joint.child, child=joint.parent)
            for each in ("waist", "left_hip_joint", "left_clavicle")
            for joint in (figure.joints[each],)
        }
        figure = replace(figure, joints={**figure.joints, **joints})
        for ref in figure.joints["right_hip_joint"].ends:
            segment = figure.segments[ref.segment]
            site = segment.sites[ref.site]
            location = Location((Rotation((0.3, -0.5, 0.7)), *site.location.factors))
            site = replace(site, location=location)
            turned = replace(segment, sites={**segment.sites, ref.site: site})
            figure = figure.with_parts(turned)
    return figure, springs


class Comparison(NamedTuple):
    """Differences of a joint's springs.

    Attributes:
        difference: largest of a component of the elastic torque [N m].
        size: of the largest component of that torque [N m].
        damping: largest difference of the viscous damping about any axes [N m s/rad].
    """

    difference: float
    size: float
    damping: float


def rotation_vectors(joint: Joint, springs: JointSprings) -> Array:
    """Orientations in the range of a joint, also as components of the rotation vector, (n, 3)."""
    ranges = joint_ranges(joint, springs)
    grid = np.array(list(product(*(np.linspace(low, high, _VALUES) for low, high in ranges))))
    chain = Chain(joint.chain)
    vectors = rotation_vector(chain, grid)
    inside = np.linalg.norm(vectors, axis=1) < np.pi - 1e-3
    for k in chain.rotations:
        component = vectors @ unit_vector(joint.chain[k].axis)
        inside &= (component >= ranges[k][0] - 1e-9) & (component <= ranges[k][1] + 1e-9)
    return vectors[inside]


def compare(figure: Figure, springs: SpringSet, back: Figure, found: SpringSet, name: str):
    """Compare the springs of a joint with those of the figure that came back."""
    vectors = rotation_vectors(figure.joints[name], springs.joints[name])
    joint, own = back.joints[name], figure.joints[name]
    flipped = joint.child.segment != own.child.segment
    turn = _turn(back, joint.child).T @ _turn(figure, own.parent if flipped else own.child)
    turn = -turn if flipped else turn
    axes, new = (one.joints[name].axes if name in one.joints else () for one in (springs, found))
    expected = np.asarray(elastic_torque(springs.law, axes, vectors)) @ turn.T
    torques = np.asarray(elastic_torque(found.law, new, vectors @ turn.T)) if new else 0.0
    damping = [
        sum(
            (a.damping.viscous * np.outer(a.direction, a.direction) for a in each), np.zeros((3, 3))
        )
        for each in (axes, new)
    ]
    return Comparison(
        float(np.abs(torques - expected).max()),
        float(np.abs(expected).max()),
        float(np.abs(turn @ damping[0] @ turn.T - damping[1]).max()),
    )


def _turn(figure: Figure, ref: SiteRef) -> Array:
    """Rotation of a site in the body of the model."""
    sites = figure.segments[ref.segment].sites
    body = sites[FRAME].pose_in_segment if FRAME in sites else np.eye(4)
    return body[:3, :3].T @ sites[ref.site].pose_in_segment[:3, :3]


def stated(losses: Losses, name: str) -> float:
    """Largest error that a list of losses states for a joint or one of its axes [N m]."""
    text = "; ".join(f"{loss.what}: {', '.join(loss.where)}" for loss in losses.entries)
    found = re.findall(rf"\b{name}(?:_\w)? ?[:(] ?([0-9.e-]+) N m at most", text)
    return max(map(float, found), default=0.0)
