"""Bushings of OpenSim's models at joints: springs and dampers of the joint's axes.

A bushing acts between two frames, by the three body-fixed angles (x, y, z) and the three
displacements of the second in the first. Where the frames coincide with a joint's, and its axes are
theirs, each moment is a law of one degree of freedom.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from generator.figure import is_rotation
from generator.losses import Losses
from generator.model_files.body_tree.tree import Body, DegreeOfFreedom
from generator.model_files.opensim.frames import GROUND, FrameIndex
from generator.model_files.opensim.lepton import ExpressionError, parse_expression
from generator.model_files.opensim.passive_forces import BUSHINGS, with_function
from generator.model_files.xml import XmlElement
from generator.rotations import Array, inverse_pose

_VARIABLES = ("theta_x", "theta_y", "theta_z", "delta_x", "delta_y", "delta_z")
_EXPRESSIONS = tuple(f"{kind}{axis}_expression" for kind in "MF" for axis in "xyz")

_ALIGNMENT_TOLERANCE = 1e-9
"""Largest difference of frames, and of axes, that count as the same."""


def apply_bushings(
    frames: FrameIndex, bodies: Iterable[Body], forces: Iterable[XmlElement], losses: Losses
) -> list[Body]:
    """Return the bodies with the laws of bushings at their joints; report the other bushings."""
    found = {body.name: body for body in bodies}
    for force in forces:
        if force.tag not in BUSHINGS or force.is_child("appliesForce", "false"):
            continue
        name = force.label
        changed = _with_bushing(frames, found, force, name, losses)
        if changed is None:
            losses.add("bushings that are not at a joint with their axes", name)
        else:
            found[changed.name] = changed
    return list(found.values())


def _with_bushing(
    frames: FrameIndex, bodies: Mapping[str, Body], force: XmlElement, name: str, losses: Losses
) -> Body | None:
    """Return the body whose joint has a bushing; None where no joint has its frames and axes."""
    sockets = ("socket_frame1", "socket_frame2")
    if not all(force.child_text(socket) for socket in sockets):
        return None
    ends = [frames.resolve(force, socket) for socket in sockets]
    if ends[0] is None or ends[1] is None:
        return None
    (first, first_pose), (second, second_pose) = ends[0], ends[1]
    sign, body = 1.0, bodies.get(second)
    if body is None or (body.parent or GROUND) != first:
        sign, body = -1.0, bodies.get(first)
        first_pose, second_pose = second_pose, first_pose
        if body is None or (body.parent or GROUND) != second:
            return None
    offset = inverse_pose(first_pose) @ body.pose @ second_pose
    if np.abs(offset - np.eye(4)).max() > _ALIGNMENT_TOLERANCE:
        return None
    dofs: list[DegreeOfFreedom] = []
    for dof in body.dofs:
        place = _place(dof, second_pose)
        if place is None:
            return None
        index, sense = place
        dofs.append(_with_moment(force, name, dof, index, sign * sense, losses))
    return replace(body, dofs=tuple(dofs))


def _place(dof: DegreeOfFreedom, frame: Array) -> tuple[int, float] | None:
    """Return the number of a degree of freedom among a bushing's, and its sense along the axis."""
    axis = frame[:3, :3].T @ np.asarray(dof.axis)
    k = int(np.argmax(np.abs(axis)))
    if np.abs(np.abs(axis[k]) - 1.0) > _ALIGNMENT_TOLERANCE:
        return None
    if not is_rotation(dof.kind):
        return k + 3, float(np.sign(axis[k]))
    arm = np.cross(np.asarray(dof.point) - frame[:3, 3], dof.axis)
    if np.abs(arm).max() > _ALIGNMENT_TOLERANCE:
        return None
    return k, float(np.sign(axis[k]))


def _with_moment(
    force: XmlElement,
    name: str,
    dof: DegreeOfFreedom,
    index: int,
    sense: float,
    losses: Losses,
) -> DegreeOfFreedom:
    """Return a degree of freedom with the moment or force of a bushing and its damping."""
    word = "rotational" if index < 3 else "translational"
    damping = force.child_numbers(f"{word}_damping", (0.0, 0.0, 0.0))[index % 3]
    stiffness = force.child_numbers(f"{word}_stiffness", (0.0, 0.0, 0.0))[index % 3]
    function, text = None, force.child_text(_EXPRESSIONS[index])
    if force.tag == "ExpressionBasedBushingForce":
        try:
            function = parse_expression(text or "0", frozenset(_VARIABLES))
        except ExpressionError as failure:
            losses.add("forces with expressions that are not read", f"{name} ({failure})")
            return dof

    def moment_at(values: Array, rate: float) -> Array:
        """Generalized force of the displacement, at displacements and a rate of it."""
        angle = sense * values
        if function is None:
            resisting = stiffness * angle
        else:
            zero = np.zeros_like(angle)
            known = {other: zero for other in _VARIABLES} | {_VARIABLES[index]: angle}
            with np.errstate(all="ignore"):
                resisting = function(known) * np.ones_like(angle)
        return -sense * resisting - damping * rate

    others = [other for k, other in enumerate(_VARIABLES) if k != index]
    if function is not None and any(other in text for other in others):
        losses.add("terms of bushings that depend on several angles or displacements", name)
    return with_function(dof, name, moment_at, losses)
