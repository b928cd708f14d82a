"""URDF, the robot descriptions of ROS: the tree of links of one as a figure.

The joints of a URDF document as freedoms.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

import numpy as np

from generator.diagnostics import Findings, nearest, shorten
from generator.figure import Vector
from generator.inertia import MassProperties
from generator.losses import Report
from generator.model_files.body_tree.names import gravity_words
from generator.model_files.body_tree.to_figure import figure_of
from generator.model_files.body_tree.tree import Z_UP, Body, Freedom, PassiveTree, loosely
from generator.model_files.imported import Imported
from generator.model_files.mjcf.joints import z_onto
from generator.model_files.xml_read import Element, direction, number, vector
from generator.rotations import Array, homogeneous, matrix_from_xyz

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
            "this joint has no type" if kind is None else f"unknown joint type `{shorten(kind)}`",
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
            f"the limits of `{shorten(name)}` leave no range",
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


ROOT_JOINT = "base"

GRAVITY = np.array([0.0, 0.0, -9.81])

_LOST: Final = {
    "gazebo": "settings of Gazebo",
    "transmission": "transmissions",
    "material": "materials",
    "sensor": "sensors",
}

_MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


@dataclass
class _Robot:
    """The links and joints of a robot by name, and the joint that carries each link."""

    links: dict[str, Element] = field(default_factory=dict[str, Element])
    joints: dict[str, Element] = field(default_factory=dict[str, Element])
    carrier: dict[str, Element] = field(default_factory=dict[str, Element])
    parent: dict[str, str] = field(default_factory=dict[str, str])


def figure_from_urdf(
    root: Element, directory: Path | None, findings: Findings, *, apart: bool = False
) -> Imported | None:
    """The figure of a URDF document; None, with the faults noted, when it makes none.

    The root link is held: where it has a mass, as a segment on a rigid joint to the world.

    Args:
        root: the element `robot`.
        directory: not needed; URDF includes nothing.
        findings: for faults.
        apart: see `figure_of`.
    """
    report = Report("URDF")
    robot = _robot(root, findings, report)
    order = _order(robot, root, findings)
    if order is None:
        return None
    bodies = [_body(robot, name, findings, report) for name in order]
    held = frozenset({order[0]} if bodies[0].mass is not None else ())
    if held:
        report.lose(
            "the root link is held to the world; `mover simulate --free-root` lets it go", order[0]
        )
    for sentence in gravity_words(GRAVITY, Z_UP):
        report.lose(sentence)
    tree = PassiveTree(tuple(bodies), {}, Z_UP, root.get("name"), root.span)
    return figure_of(tree, findings, report, apart=apart, held=held)


def _robot(root: Element, findings: Findings, report: Report) -> _Robot:
    robot = _Robot()
    for child in root.children:
        if ":" in child.tag:
            findings.error(
                f"`{shorten(child.tag)}` is a macro",
                child.span,
                "expand the file with `xacro` first",
            )
        elif child.tag in ("link", "joint"):
            _add(robot.links if child.tag == "link" else robot.joints, child, findings)
        else:
            what = _LOST.get(child.tag, "elements that are not known here")
            report.lose(what, child.get("name") or child.get("reference") or child.tag)
    for joint in robot.joints.values():
        parent, child = (_end(joint, end, robot.links, findings) for end in ("parent", "child"))
        if parent is None or child is None:
            continue
        first = robot.carrier.setdefault(child, joint)
        if first is not joint:
            findings.error(
                f"a second joint carries the link `{shorten(child)}`: this loop is no tree",
                joint.span,
                f"the first is `{shorten(first.get('name') or '')}` in line {first.span.line}",
            )
            continue
        robot.parent[child] = parent
    return robot


def _add(known: dict[str, Element], element: Element, findings: Findings) -> None:
    name = element.get("name")
    if not name:
        findings.error(f"this {element.tag} has no name", element.span, 'write `name="..."`')
        return
    first = known.setdefault(name, element)
    if first is not element:
        findings.error(
            f"a second {element.tag} named `{shorten(name)}`",
            element.place("name"),
            f"the first stands in line {first.span.line}",
        )


def _end(joint: Element, end: str, links: Mapping[str, Element], findings: Findings) -> str | None:
    """The name of a joint's parent or child link."""
    element = joint.first(end)
    name = None if element is None else element.get("link")
    if element is None or name is None:
        findings.error(f"this joint has no {end}", joint.span, f'write `<{end} link="..."/>`')
        return None
    if name not in links:
        findings.error(
            f"there is no link `{shorten(name)}`", element.place("link"), nearest(name, links)
        )
        return None
    return name


def _order(robot: _Robot, root: Element, findings: Findings) -> list[str] | None:
    """The links, each parent before its children; None when they make no tree."""
    if findings.has_errors:
        return None
    roots = [name for name in robot.links if name not in robot.parent]
    if not robot.links:
        findings.error("this robot has no links", root.span, 'write `<link name="...">`')
        return None
    if len(roots) > 1:
        second = robot.links[roots[1]]
        findings.error(
            f"no joint carries the link `{shorten(roots[1])}`, nor `{shorten(roots[0])}`",
            second.place("name"),
            "a robot has one root",
        )
        return None
    children: dict[str, list[str]] = {name: [] for name in robot.links}
    for child, parent in robot.parent.items():
        children[parent].append(child)
    order, waiting = list[str](), list(roots)
    while waiting:
        order.append(waiting.pop())
        waiting += reversed(children[order[-1]])
    lost = [name for name in robot.links if name not in set(order)]
    if lost:
        findings.error(
            f"the joints from `{shorten(lost[0])}` lead back to it: this loop is no tree",
            robot.links[lost[0]].place("name"),
            "a robot's links hang on one root",
        )
        return None
    return order


def _body(robot: _Robot, name: str, findings: Findings, report: Report) -> Body:
    link, joint = robot.links[name], robot.carrier.get(name)
    for shape in link.all("visual", "collision"):
        del shape
        report.lose("shapes of links: segments have no shape and touch nothing", name)
    freedoms: tuple[Freedom, ...] = ()
    pose, title = np.eye(4), ROOT_JOINT
    if joint is not None:
        freedoms = freedoms_of(joint, findings, report)
        pose, title = pose_of(joint, findings), joint.get("name") or name
        if joint.get("type") == FIXED:
            title = ""
    mass, loose = _mass(link, findings) or (None, np.zeros((3, 3)))
    place = link.place("name")
    return Body(name, robot.parent.get(name), pose, freedoms, mass, {}, place, title, loose)


def _mass(link: Element, findings: Findings) -> tuple[MassProperties, Array] | None:
    """The mass properties of a link in its frame, and loose inertia; None without any."""
    inertial = link.first("inertial")
    if inertial is None:
        return None
    mass, inertia = inertial.first("mass"), inertial.first("inertia")
    if mass is None or "value" not in mass.attributes:
        findings.error("this inertial has no mass", inertial.span, 'write `<mass value="..."/>`')
        return None
    value = number(mass, "value", findings)
    if value == 0.0:
        return None
    if inertia is None:
        findings.error(
            "this inertial has no inertia", inertial.span, 'write `<inertia ixx="..." .../>`'
        )
        return None
    missing = [key for key in _MOMENTS[:3] if key not in inertia.attributes]
    if missing:
        findings.error(f"`{missing[0]}` is missing", inertia.span, "an inertia has six numbers")
        return None
    xx, yy, zz, xy, xz, yz = (number(inertia, key, findings) for key in _MOMENTS)
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    pose = pose_of(inertial, findings)
    try:
        return loosely(value, np.zeros(3), tensor, pose)
    except ValueError as failure:
        findings.error(str(failure), mass.span)
        return None
