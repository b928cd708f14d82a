"""URDF, the robot descriptions of ROS: the tree of links of one as a figure."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from generator.errors import nearest
from generator.exchange.imported import Imported
from generator.exchange.incoming.figure_of_tree import figure_of
from generator.exchange.incoming.passive_tree import Z_UP, Body, Freedom, PassiveTree, loosely
from generator.exchange.incoming.urdf_joints import FIXED, freedoms_of, pose_of
from generator.exchange.incoming.world_up import gravity_words
from generator.exchange.incoming.xml_text import Element
from generator.exchange.incoming.xml_values import number
from generator.exchange.report import Report
from generator.frames import Array
from generator.inertia import MassProperties
from generator.reader.findings import Findings
from generator.reader.vocabulary import shown

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
                f"`{shown(child.tag)}` is a macro",
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
                f"a second joint carries the link `{shown(child)}`: this loop is no tree",
                joint.span,
                f"the first is `{shown(first.get('name') or '')}` in line {first.span.line}",
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
            f"a second {element.tag} named `{shown(name)}`",
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
            f"there is no link `{shown(name)}`", element.place("link"), nearest(name, links)
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
            f"no joint carries the link `{shown(roots[1])}`, nor `{shown(roots[0])}`",
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
            f"the joints from `{shown(lost[0])}` lead back to it: this loop is no tree",
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
