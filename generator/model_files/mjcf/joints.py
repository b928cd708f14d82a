"""The joints of an MJCF body as freedoms, from the parent outwards to the body.

The five ways in which MJCF tells an orientation.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import radians
from typing import Final

import numpy as np

from generator.diagnostics import Findings, nearest, shorten
from generator.figure import Vector
from generator.losses import Report
from generator.model_files.body_tree.tree import Freedom
from generator.model_files.xml_read import Element, Written, direction, number, numbers, vector
from generator.rotations import Array, homogeneous, matrix_from_axis_angle

WAYS = ("quat", "axisangle", "xyaxes", "zaxis", "euler")


@dataclass(frozen=True)
class Angles:
    """How a model tells angles.

    Attributes:
        degrees: whether in degrees instead of radians.
        sequence: axes of `euler` in the order of the turns; small letters turn with the frame.
    """

    degrees: bool = True
    sequence: str = "xyz"

    def radians(self, value: float) -> float:
        """An angle of the model [rad]."""
        return radians(value) if self.degrees else value


def pose_of(element: Element, angles: Angles, findings: Findings) -> Array:
    """The pose that `pos` and an orientation give, shape (4, 4)."""
    place = element.attributes.get("pos")
    offset = None if place is None else numbers(place, findings, 3)
    return homogeneous(orientation_of(element, angles, findings), offset or np.zeros(3))


def orientation_of(element: Element, angles: Angles, findings: Findings) -> Array:
    """The orientation of an element in its parent, shape (3, 3)."""
    said = [name for name in WAYS if name in element.attributes]
    if len(said) > 1:
        findings.error(
            f"`{said[0]}` and `{said[1]}` both tell one orientation",
            element.place(said[1]),
            "an element has one of them at most",
        )
    if not said:
        return np.eye(3)
    written = element.attributes[said[0]]
    match said[0]:
        case "quat":
            return _from_quaternion(written, findings)
        case "axisangle":
            read = numbers(written, findings, 4)
            if read is None:
                return np.eye(3)
            axis = direction(read[:3], written.span, findings)
            return matrix_from_axis_angle(axis, angles.radians(read[3]))
        case "xyaxes":
            return _from_xy(written, findings)
        case "zaxis":
            read = numbers(written, findings, 3)
            return z_onto(direction(read or (0.0, 0.0, 1.0), written.span, findings))
        case _:
            return _from_euler(written, angles, findings)


def z_onto(axis: tuple[float, float, float]) -> Array:
    """The shortest turn that brings z onto a unit axis; half a turn about x onto -z."""
    target = np.asarray(axis)
    across = np.cross([0.0, 0.0, 1.0], target)
    sine = float(np.linalg.norm(across))
    if sine < 1e-10:
        return np.eye(3) if target[2] > 0.0 else np.diag([1.0, -1.0, -1.0])
    return matrix_from_axis_angle(across / sine, float(np.arctan2(sine, target[2])))


def matrix_from_quaternion(quaternion: Array) -> Array:
    """The rotation of a quaternion with the scalar first, of any length above zero, (3, 3)."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def _from_quaternion(written: Written, findings: Findings) -> Array:
    read = numbers(written, findings, 4)
    if read is None:
        return np.eye(3)
    quaternion = np.array(read)
    if not np.linalg.norm(quaternion) > 1e-10:
        findings.error("the zero quaternion is no orientation", written.span, "write `1 0 0 0`")
        return np.eye(3)
    return matrix_from_quaternion(quaternion)


def _from_xy(written: Written, findings: Findings) -> Array:
    read = numbers(written, findings, 6)
    if read is None:
        return np.eye(3)
    x = np.asarray(direction(read[:3], written.span, findings))
    y = np.asarray(read[3:]) - float(x @ np.asarray(read[3:])) * x
    y = np.asarray(direction(y.tolist(), written.span, findings))
    if abs(float(x @ y)) > 0.5:
        return np.eye(3)
    return np.stack([x, y, np.cross(x, y)], axis=1)


def _from_euler(written: Written, angles: Angles, findings: Findings) -> Array:
    read = numbers(written, findings, 3)
    matrix = np.eye(3)
    for letter, value in zip(angles.sequence, read or (), strict=False):
        turn = matrix_from_axis_angle(np.eye(3)["xyz".index(letter.lower())], angles.radians(value))
        matrix = matrix @ turn if letter.islower() else turn @ matrix
    return matrix


KINDS: Final = ("hinge", "slide", "ball", "free")

READ: Final = {
    "name",
    "type",
    "pos",
    "axis",
    "limited",
    "range",
    "ref",
    "springref",
    "stiffness",
    "damping",
    "frictionloss",
    "armature",
    "springdamper",
    "solreflimit",
    "solimplimit",
    "solreffriction",
    "solimpfriction",
    "margin",
    "group",
}

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
LETTERS = (("z", Z), ("y", Y), ("x", X))
"""From the outermost inwards, so that a chain is written x, y, z."""

ARMATURE = "armature: inertia of motors, which bodies here do not have"
LIMITS = (
    "limits, which are stops of 1000 N m/rad or 100 kN/m here instead of MuJoCo's soft constraints"
)
FRICTION = "friction losses, which are smooth below 0.01 rad/s here"


@dataclass(frozen=True)
class JointReader:
    """Reads the joints of bodies.

    Attributes:
        angles: how the model tells angles.
        autolimits: whether a range alone makes a limit.
        findings: for faults.
        report: for what a figure does not hold.
    """

    angles: Angles
    autolimits: bool
    findings: Findings
    report: Report

    def read(
        self, body: str, joints: Sequence[Element], *, is_outermost: bool
    ) -> tuple[Freedom, ...]:
        """The freedoms of a body; `is_outermost` says whether it hangs on the world."""
        freedoms: list[Freedom] = []
        turning: list[str] = []
        for k, element in enumerate(joints, start=1):
            kind = "free" if element.tag == "freejoint" else element.get("type") or "hinge"
            name = element.get("name") or (
                f"{body}_joint" if len(joints) == 1 else f"{body}_joint_{k}"
            )
            if kind not in KINDS:
                self.findings.error(
                    f"unknown joint type `{shorten(kind)}`",
                    element.place("type"),
                    nearest(kind, KINDS),
                )
                continue
            if kind == "free" and not (is_outermost and len(joints) == 1):
                self.findings.error(
                    "a free joint is the only one of a body that hangs on the world",
                    element.span,
                )
                continue
            if (kind == "ball" and turning) or (kind == "hinge" and "ball" in turning):
                self.findings.error(
                    "a body with a ball joint has no other joint that turns", element.span
                )
                continue
            if kind in ("ball", "hinge"):
                turning.append(kind)
            freedoms += self._freedoms(name, kind, element)
        return tuple(freedoms)

    def _freedoms(self, name: str, kind: str, element: Element) -> list[Freedom]:
        if number(element, "armature", self.findings) > 0.0:
            self.report.lose(ARMATURE, name)
        tuned = element.attributes.get("springdamper")
        if tuned is not None and numbers(tuned, self.findings, 2) != (0.0, 0.0):
            self.report.lose("springs that are tuned by time constants", name)
        if kind in ("hinge", "slide"):
            return [self._single(name, kind, element)]
        point = (0.0, 0.0, 0.0) if kind == "free" else vector(element, "pos", self.findings)
        row: list[Freedom] = []
        if kind == "free":
            row = [
                self._law(Freedom(f"{name}_t{letter}", "T", axis, whole=name), element)
                for letter, axis in LETTERS
            ]
        elif self._is_limited(element):
            self.report.lose("limits of balls on the whole angle of their turn", name)
        for letter, axis in LETTERS:
            row.append(
                self._law(Freedom(f"{name}_{letter}", "R", axis, point, whole=name), element)
            )
        return row

    def _single(self, name: str, kind: str, element: Element) -> Freedom:
        """A hinge or a slide."""
        axis = vector(element, "axis", self.findings, Z)
        axis = direction(axis, element.place("axis"), self.findings)
        point: Vector = vector(element, "pos", self.findings)
        turns = kind == "hinge"
        shift = self._told(number(element, "ref", self.findings), turns)
        rest = self._told(number(element, "springref", self.findings), turns) - shift
        made = Freedom(name, "R" if turns else "T", axis, point, shift=shift, rest=rest)
        made = self._law(made, element)
        if not made.stiffness and not any(made.cubic):
            made = replace(made, rest=0.0)
        if not self._is_limited(element):
            return made
        written = element.attributes.get("range")
        bounds = None if written is None else numbers(written, self.findings, 2)
        if bounds is None or not bounds[0] < bounds[1]:
            self.findings.error(
                f"the limits of `{shorten(name)}` leave no range",
                element.place("range"),
                "the lower one stands first",
            )
            return made
        self.report.lose(LIMITS, name)
        lower, upper = (self._told(bound, turns) - shift for bound in bounds)
        return replace(made, lower=lower, upper=upper)

    def _told(self, value: float, turns: bool) -> float:
        return self.angles.radians(value) if turns else value

    def _is_limited(self, element: Element) -> bool:
        said = element.get("limited") or "auto"
        return said == "true" or (
            said == "auto" and self.autolimits and "range" in element.attributes
        )

    def _law(self, freedom: Freedom, element: Element) -> Freedom:
        """The freedom with stiffness, damping and friction of its joint."""
        if element.tag == "freejoint":
            return freedom
        stiffness = self._row(element, "stiffness")
        damping = self._row(element, "damping")
        friction = number(element, "frictionloss", self.findings)
        name = freedom.whole or freedom.name
        if any(damping[1:]):
            self.report.lose("damping that grows with the rate", name)
        for word, value in (
            ("stiffness", stiffness[0]),
            ("damping", damping[0]),
            ("frictionloss", friction),
        ):
            if value < 0.0:
                self.findings.error(
                    f"the {word} of `{shorten(name)}` is negative",
                    element.place(word),
                    "a passive joint has none below zero",
                )
        if friction > 0.0:
            self.report.lose(FRICTION, name)
        cubic = (stiffness[1], stiffness[2])
        if freedom.whole and any(cubic):
            self.report.lose("springs of balls that grow with the angle", name)
            cubic = (0.0, 0.0)
        return replace(
            freedom,
            stiffness=max(stiffness[0], 0.0),
            cubic=cubic,
            damping=max(damping[0], 0.0),
            friction=max(friction, 0.0),
        )

    def _row(self, element: Element, name: str) -> tuple[float, float, float]:
        """One to three numbers, zero where they are left out."""
        written = element.attributes.get(name)
        read = None if written is None else numbers(written, self.findings, 1, 3)
        first, second, third = (*(read or ()), 0.0, 0.0, 0.0)[:3]
        return first, second, third
