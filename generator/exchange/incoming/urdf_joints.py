"""The joints of a URDF document as freedoms."""

from dataclasses import replace
from typing import Final

import numpy as np

from generator.errors import nearest
from generator.exchange.incoming.mjcf_orientation import z_onto
from generator.exchange.incoming.passive_tree import Freedom
from generator.exchange.incoming.xml_text import Element
from generator.exchange.incoming.xml_values import direction, number, vector
from generator.exchange.report import Report
from generator.figure import Vector
from generator.frames import Array, homogeneous, matrix_from_xyz
from generator.reader.findings import Findings
from generator.reader.vocabulary import shown

FIXED = "fixed"
KINDS: Final = ("revolute", "continuous", "prismatic", FIXED, "floating", "planar")

_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def pose_of(element: Element, findings: Findings) -> Array:
    """The pose that the `origin` of an element tells, shape (4, 4); turns are about fixed axes."""
    origin = element.first("origin")
    if origin is None:
        return np.eye(4)
    roll, pitch, yaw = vector(origin, "rpy", findings)
    # Rz(yaw) Ry(pitch) Rx(roll) is the inverse of a turn about the turned axes.
    turn = matrix_from_xyz(-roll, -pitch, -yaw).T
    return homogeneous(turn, np.array(vector(origin, "xyz", findings)))


def freedoms_of(joint: Element, findings: Findings, report: Report) -> tuple[Freedom, ...]:
    """The freedoms of a joint, from the parent outwards, told in the child's frame."""
    kind, name = joint.get("type"), joint.get("name") or ""
    if kind is None or kind not in KINDS:
        findings.error(
            "this joint has no type" if kind is None else f"unknown joint type `{shown(kind)}`",
            joint.place("type"),
            nearest(kind or "", KINDS),
        )
        return ()
    _tell_extras(joint, name, report)
    if kind == FIXED:
        return ()
    if kind in ("floating", "planar"):
        return _several(joint, kind, name, findings)
    turns = kind != "prismatic"
    freedom = Freedom(name, "R" if turns else "T", _axis(joint, findings))
    dynamics, limit = joint.first("dynamics"), joint.first("limit")
    if dynamics is not None:
        freedom = replace(
            freedom,
            damping=_not_negative(dynamics, "damping", findings),
            friction=_not_negative(dynamics, "friction", findings),
        )
    if limit is None or kind == "continuous":
        return (freedom,)
    lower, upper = (number(limit, word, findings) for word in ("lower", "upper"))
    if lower > upper:
        findings.error(
            f"the limits of `{shown(name)}` leave no range",
            limit.place("lower"),
            "`lower` is below `upper`",
        )
    elif lower == upper:
        report.lose("limits that leave no range", name)
    else:
        report.lose("limits, which are stops of 1000 N m/rad or 100 kN/m here", name)
        freedom = replace(freedom, lower=lower, upper=upper)
    return (freedom,)


def _several(joint: Element, kind: str, name: str, findings: Findings) -> tuple[Freedom, ...]:
    """The six freedoms of a floating joint, or the three of a planar one."""
    if kind == "floating":
        slides = [
            Freedom(f"{name}_t{letter}", "T", axis, whole=name)
            for letter, axis in reversed(_AXES.items())
        ]
        turns = [
            Freedom(f"{name}_{letter}", "R", axis, whole=name)
            for letter, axis in reversed(_AXES.items())
        ]
        return (*slides, *turns)
    normal = _axis(joint, findings)
    across = z_onto(normal)
    first, second = (_tuple(across[:, k]) for k in (0, 1))
    return (
        Freedom(f"{name}_ty", "T", second, whole=name),
        Freedom(f"{name}_tx", "T", first, whole=name),
        Freedom(f"{name}_turn", "R", normal, whole=name),
    )


def _axis(joint: Element, findings: Findings) -> Vector:
    element = joint.first("axis")
    if element is None:
        return _AXES["x"]
    read = vector(element, "xyz", findings, _AXES["x"])
    return direction(read, element.place("xyz"), findings)


def _tuple(axis: Array) -> Vector:
    x, y, z = axis.tolist()
    return x, y, z


def _not_negative(element: Element, name: str, findings: Findings) -> float:
    value = number(element, name, findings)
    if value < 0.0:
        findings.error(
            f"the {name} is negative", element.place(name), "a passive joint has none below zero"
        )
    return max(value, 0.0)


def _tell_extras(joint: Element, name: str, report: Report) -> None:
    """What a figure's joint does not have."""
    limit = joint.first("limit")
    if limit is not None and (limit.get("effort") or limit.get("velocity")):
        report.lose("limits of effort and speed", name)
    mimic = joint.first("mimic")
    if mimic is not None:
        report.lose(
            "joints that follow others (`mimic`), which move freely here",
            f"{name} ({mimic.get('joint')})",
        )
    for word in ("safety_controller", "calibration"):
        if joint.first(word) is not None:
            report.lose("settings of controllers", name)
