"""The five ways in which MJCF tells an orientation."""

from dataclasses import dataclass
from math import radians

import numpy as np

from generator.exchange.incoming.xml_text import Element, Written
from generator.exchange.incoming.xml_values import direction, numbers
from generator.frames import Array, homogeneous, matrix_from_axis_angle
from generator.reader.findings import Findings

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
