"""Joints and orientations of MJCF: degrees of freedom from the parent outwards to the body."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import radians
from typing import Final

import numpy as np

from generator.diagnostics import shorten, spelling_hint
from generator.figure import AxisKind
from generator.losses import Losses
from generator.model_files.body_tree.tree import (
    DegreeOfFreedom,
    ball_dofs,
    free_dofs,
    rotation_from_z_to,
)
from generator.model_files.xml import XmlElement
from generator.rotations import Array, matrix_from_axis_angle, matrix_from_quaternion, pose_matrix

ORIENTATION_ATTRIBUTES = {"quat": 4, "axisangle": 4, "xyaxes": 6, "zaxis": 3, "euler": 3}
"""Attributes of an orientation, and how many numbers they have."""


@dataclass(frozen=True)
class AngleConvention:
    """The convention of a model's angles.

    Attributes:
        in_degrees: degrees instead of radians.
        euler_sequence: axes of `euler` in order; lower-case letters rotate with the frame.
    """

    in_degrees: bool = True
    euler_sequence: str = "xyz"

    def radians(self, value: float) -> float:
        """Return an angle of the model [rad]."""
        return radians(value) if self.in_degrees else value


def parse_pose(element: XmlElement, angles: AngleConvention) -> Array:
    """Parse `pos` and an orientation as a pose, shape (4, 4)."""
    offset = element.vector("pos")
    return pose_matrix(parse_orientation(element, angles), offset)


def parse_orientation(element: XmlElement, angles: AngleConvention) -> Array:
    """Parse the orientation of an element in its parent, shape (3, 3)."""
    present = [name for name in ORIENTATION_ATTRIBUTES if name in element.attributes]
    if len(present) > 1:
        element.error(
            f"`{present[0]}` and `{present[1]}` both give the orientation",
            "an element has one of them at most",
            present[1],
        )
    form = present[0] if present else ""
    read = element.numbers(form, ORIENTATION_ATTRIBUTES.get(form, 0))
    if read is None:
        return np.eye(3)
    match form:
        case "quat":
            if np.linalg.norm(read) > 1e-10:
                return matrix_from_quaternion(np.array(read))
            element.error("the zero quaternion is not an orientation", "write `1 0 0 0`", form)
            return np.eye(3)
        case "axisangle":
            axis = element.direction(read[:3], form)
            return matrix_from_axis_angle(axis, angles.radians(read[3]))
        case "xyaxes":
            x = np.asarray(element.direction(read[:3], form))
            y = np.asarray(read[3:]) - float(x @ np.asarray(read[3:])) * x
            y = np.asarray(element.direction(y.tolist(), form))
            parallel = abs(float(x @ y)) > 0.5
            return np.eye(3) if parallel else np.stack([x, y, np.cross(x, y)], axis=1)
        case "zaxis":
            return rotation_from_z_to(element.direction(read, form))
        case _:
            matrix = np.eye(3)
            for letter, value in zip(angles.euler_sequence, read, strict=True):
                axis = np.eye(3)["xyz".index(letter.lower())]
                turn = matrix_from_axis_angle(axis, angles.radians(value))
                matrix = matrix @ turn if letter.islower() else turn @ matrix
            return matrix


KINDS: Final = ("hinge", "slide", "ball", "free")

READ_ATTRIBUTES: Final = (
    {"name", "type", "pos", "axis", "limited", "range", "ref", "springref", "stiffness", "damping"}
    | {"frictionloss", "armature", "springdamper", "solreflimit", "solimplimit", "solreffriction"}
    | {"solimpfriction", "margin", "group"}
)

ARMATURE = "armature, the inertia of motors"
LIMITS = "soft limits of joints become stops of 1000 N m/rad or 100 kN/m"
FRICTION = "friction losses become smooth below 0.01 rad/s"


@dataclass(frozen=True)
class JointReader:
    """Reads the joints of bodies.

    Attributes:
        angle_convention: how the model tells angles.
        autolimits: whether a range alone makes a limit.
        losses: collects what a figure does not hold.
    """

    angle_convention: AngleConvention
    autolimits: bool
    losses: Losses

    def read(
        self, body: str, joints: Sequence[XmlElement], *, is_outermost: bool
    ) -> tuple[DegreeOfFreedom, ...]:
        """The freedoms of a body; `is_outermost` says whether it hangs on the world."""
        freedoms: list[DegreeOfFreedom] = []
        turning: list[str] = []
        for k, element in enumerate(joints, start=1):
            kind = "free" if element.tag == "freejoint" else element.get("type") or "hinge"
            name = element.get("name") or (
                f"{body}_joint" if len(joints) == 1 else f"{body}_joint_{k}"
            )
            if kind not in KINDS:
                element.error(
                    f"unknown joint type `{shorten(kind)}`", spelling_hint(kind, KINDS), "type"
                )
                continue
            if kind == "free" and not (is_outermost and len(joints) == 1):
                element.error("a free joint is the only one of a body that hangs on the world")
                continue
            if (kind == "ball" and turning) or (kind == "hinge" and "ball" in turning):
                element.error("a body with a ball joint has no other joint that turns")
                continue
            if kind in ("ball", "hinge"):
                turning.append(kind)
            freedoms += self._freedoms(name, kind, element)
        return tuple(freedoms)

    def _freedoms(self, name: str, joint_type: str, element: XmlElement) -> list[DegreeOfFreedom]:
        if element.number("armature") > 0.0:
            self.losses.add(ARMATURE, name)
        if any(element.numbers("springdamper", 2) or ()):
            self.losses.add("springs and dampers by time constants (`springdamper`)", name)
        if joint_type in ("hinge", "slide"):
            return [self._single(name, joint_type, element)]
        if joint_type == "free":
            row = free_dofs(name)
        else:
            row = ball_dofs(name, element.vector("pos"))
            if self._limits(element) is not None:
                self.losses.add("limits of ball joints", name)
        return [self._with_passive_law(dof, element) for dof in row]

    def _single(self, name: str, joint_type: str, element: XmlElement) -> DegreeOfFreedom:
        """A hinge or a slide."""
        axis = element.vector("axis", (0.0, 0.0, 1.0))
        axis = element.direction(axis, "axis")
        point = element.vector("pos")
        turns = joint_type == "hinge"
        shift = self._in_radians(element.number("ref"), turns)
        rest = self._in_radians(element.number("springref"), turns) - shift
        kind = AxisKind.ROTATION if turns else AxisKind.TRANSLATION
        dof = DegreeOfFreedom(name, kind, axis, point, offset=shift, rest=rest)
        dof = self._with_passive_law(dof, element)
        bounds = self._limits(element)
        if bounds is None:
            low, high = element.numbers("range", 2) or (0.0, 0.0)
            ends = (self._in_radians(low, turns) - shift, self._in_radians(high, turns) - shift)
            return replace(dof, expected_range=ends if low < high else None)
        if not bounds[0] < bounds[1]:
            element.error(
                f"the limits of `{shorten(name)}` leave no range",
                "the lower one stands first",
                "range",
            )
            return dof
        self.losses.add(LIMITS, name)
        lower, upper = (self._in_radians(bound, turns) - shift for bound in bounds)
        return replace(dof, lower=lower, upper=upper)

    def _in_radians(self, value: float, is_rotation: bool) -> float:
        return self.angle_convention.radians(value) if is_rotation else value

    def _limits(self, element: XmlElement) -> tuple[float, float] | None:
        """Return the limits of a joint as they are written; None for an unlimited one."""
        limited = element.get("limited") or "auto"
        low, high = element.numbers("range", 2) or (0.0, 0.0)
        is_limited = limited == "true" or (limited == "auto" and self.autolimits and low < high)
        return (low, high) if is_limited else None

    def _with_passive_law(self, dof: DegreeOfFreedom, element: XmlElement) -> DegreeOfFreedom:
        """The freedom with stiffness, damping and friction of its joint."""
        if element.tag == "freejoint":
            return dof
        stiffness = parse_coefficients(element, "stiffness")
        damping = parse_coefficients(element, "damping")
        friction = element.number("frictionloss")
        name = dof.joint or dof.name
        if any(damping[1:]):
            self.losses.add("quadratic and cubic damping", name)
        for word, value in (
            ("stiffness", stiffness[0]),
            ("damping", damping[0]),
            ("frictionloss", friction),
        ):
            if value < 0.0:
                element.error(
                    f"the {word} of `{shorten(name)}` is negative",
                    "a passive joint has none below zero",
                    word,
                )
        if friction > 0.0:
            self.losses.add(FRICTION, name)
        cubic = (stiffness[1], stiffness[2])
        if dof.joint and any(cubic):
            self.losses.add("quadratic and cubic springs of ball joints", name)
            cubic = (0.0, 0.0)
        return replace(
            dof,
            stiffness=max(stiffness[0], 0.0),
            cubic=cubic,
            damping=max(damping[0], 0.0),
            friction=max(friction, 0.0),
        )


def parse_coefficients(element: XmlElement, name: str) -> tuple[float, float, float]:
    """Parse a linear, a quadratic and a cubic coefficient, zero where they are left out."""
    read = element.numbers(name, 1, 3) or ()
    first, second, third = (*read, 0.0, 0.0, 0.0)[:3]
    return first, second, third
