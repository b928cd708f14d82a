"""Joints that close loops in an OpenSim model: constraints, and springs as bushings.

OpenSim would split one body of such a joint in halves, and the motion would be wrong. A constraint
has no coordinates, so that its spring is an ExpressionBasedBushingForce: moments conjugate to the
angles about x, y and z of the child's frame in the parent's, in this order, each a function of all
three.
"""

from collections.abc import Mapping
from functools import cached_property, reduce
from operator import add

import numpy as np

from generator.figure import Joint, SiteRef
from generator.losses import Losses
from generator.model_files.export_model import (
    ExportModel,
    Loop,
    has_friction,
    loop_closures,
    split_joint_laws,
)
from generator.model_files.opensim.expression import (
    EXPRESSION_OPERATIONS,
    Expression,
    with_definitions,
)
from generator.model_files.opensim.forces import ForceWriter
from generator.model_files.opensim.rotation import RotationExpressions
from generator.model_files.xml import Element, add_element, body_fixed_angles, format_numbers
from generator.rotations import Array, pose_matrix, rotation_with_z_axis
from springs import AxisSpring, Joining, SpringSet, total_torque

_ANGLES = ("theta_z", "theta_y", "theta_x")
_X, _Y, _Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)

_Z_AS_X = [2, 0, 1]
"""Columns of a frame that are x, y and z of one with its z axis as x axis."""


class LoopWriter:
    """The joints that close loops."""

    def __init__(self, model: ExportModel, frames: Mapping[SiteRef, str], losses: Losses) -> None:
        """Prepare to add the loops of a model; `frames` are the paths of its sites."""
        self._model, self._frames, self._losses = model, frames, losses

    @cached_property
    def _loops(self) -> tuple[Loop, ...]:
        return tuple(loop_closures(self._model, self._losses))

    def add_constraints(self, constraints: Element) -> None:
        """Add the constraints that close the loops."""
        model = self._model
        for loop in self._loops:
            name = model.joints[loop.joint.name]
            if not loop.points:
                weld = add_element(constraints, "WeldConstraint", name=name)
                for number, ref in enumerate(loop.joint.ends, 1):
                    add_element(weld, f"socket_frame{number}", self._frames[ref])
            for count, point in enumerate(loop.points, 1):
                constraint = add_element(constraints, "PointConstraint", name=f"{name}_{count}")
                for number, ref in enumerate(loop.joint.ends, 1):
                    pose, body = model.site(ref), f"/bodyset/{model.segments[ref.segment]}"
                    if ref.segment in model.figure.ground:
                        pose, body = model.placement.poses[ref.segment] @ pose, "/ground"
                    add_element(constraint, f"socket_body_{number}", body)
                    place = pose @ [*point, 1.0]
                    add_element(constraint, f"location_body_{number}", format_numbers(place[:3]))
            if loop.joint.chain:
                self._losses.add(
                    "displacements of joints that close loops, which do not become coordinates",
                    loop.joint.name,
                )

    def add_springs(self, springs: SpringSet, forces: ForceWriter) -> None:
        """Add the springs of the joints that are constraints; report the others."""
        model, closed = self._model, {loop.joint.name for loop in self._loops}
        for joint in model.tree.closures:
            own = springs.joints.get(joint.name)
            if own is None:
                continue
            if joint.name not in closed:
                self._losses.add("springs of joints that close loops", joint.name)
                continue
            laws = split_joint_laws(model.tree.chains[joint.name], own)
            for spring in laws.uncoupled.values():
                self._add_hinge_spring(joint, spring, forces)
            if laws.combined:
                self._add_ball_spring(joint, laws.combined, springs.joining, forces)

    def _add_hinge_spring(self, joint: Joint, spring: AxisSpring, forces: ForceWriter) -> None:
        """Add a spring about the x axis of frames that are turned so."""
        if spring.damping.coulomb or has_friction(spring):
            self._losses.add("friction of joints that close loops", joint.name)
        bushing = forces.add_force(
            "ExpressionBasedBushingForce", f"{self._model.joints[joint.name]}_spring"
        )
        add_element(bushing, "socket_frame1", "parent")
        add_element(bushing, "socket_frame2", "child")
        frames, axis = add_element(bushing, "frames"), np.array(joint.chain[0].axis)
        pose = pose_matrix(rotation_with_z_axis(axis)[:, _Z_AS_X], np.zeros(3))
        for name, ref in zip(("parent", "child"), joint.ends, strict=True):
            add_frame(frames, name, self._frames[ref], pose)
        torque = total_torque(spring.elastic, Expression("theta_x"), EXPRESSION_OPERATIONS)
        add_element(bushing, "Mx_expression", (-1.0 * torque).text)
        damping = (spring.damping.viscous, 0.0, 0.0)
        add_element(bushing, "rotational_damping", format_numbers(damping))

    def _add_ball_spring(
        self,
        joint: Joint,
        springs: tuple[AxisSpring, ...],
        joining: Joining,
        forces: ForceWriter,
    ) -> None:
        """Add a law of several rotations, without its damping."""
        if any(one.damping.viscous or one.damping.coulomb for one in springs) or any(
            map(has_friction, springs)
        ):
            self._losses.add(
                "damping and friction of several rotations in joints that close loops", joint.name
            )
        bushing = forces.add_force(
            "ExpressionBasedBushingForce", f"{self._model.joints[joint.name]}_spring"
        )
        for number, ref in enumerate(joint.ends, 1):
            add_element(bushing, f"socket_frame{number}", self._frames[ref])
        rotation = RotationExpressions((_Z, _Y, _X), _ANGLES)
        torques: dict[str, Expression] = {}
        arguments: dict[str, Expression] = {}
        for number, spring in enumerate(springs, 1):
            x = Expression(f"x{number}")
            torque = total_torque(spring.elastic, x, EXPRESSION_OPERATIONS)
            if joining is Joining.CONSERVATIVE:
                arguments[x.text] = rotation.component(spring.direction)
            else:
                arguments[x.text] = rotation.signed_angle(spring.direction)
                at_rest = float(total_torque(spring.elastic, 0.0))
                torque = at_rest + rotation.alignment(spring.direction) * (torque - at_rest)
            torques[f"t{number}"] = torque
        definitions = {**torques, **arguments, **rotation.definitions}
        slope = rotation.component_slope if joining is Joining.CONSERVATIVE else rotation.turn_rate
        for k, angle in reversed(list(enumerate(_ANGLES))):
            terms = [
                Expression(name) * slope(spring.direction, k)
                for name, spring in zip(torques, springs, strict=True)
            ]
            moment = with_definitions(-1.0 * reduce(add, terms), definitions)
            add_element(bushing, f"M{angle[-1]}_expression", moment)


def add_frame(place: Element, name: str, parent: str, pose: Array) -> Element:
    """Add a frame that is fixed to another; `pose` is that in the other, shape (4, 4)."""
    frame = add_element(place, "PhysicalOffsetFrame", name=name)
    add_element(frame, "socket_parent", parent)
    add_element(frame, "translation", format_numbers(pose[:3, 3]))
    add_element(frame, "orientation", format_numbers(body_fixed_angles(pose[:3, :3])))
    return frame
