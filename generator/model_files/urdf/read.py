"""Reader of URDF, the robot descriptions of ROS: their tree of links as a figure."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

import numpy as np

from generator.diagnostics import shorten, spelling_hint
from generator.figure import AxisKind, Vector
from generator.geometry.primitives import box, capsule, cylinder, sphere
from generator.geometry.surface import Surface
from generator.inertia import MassProperties
from generator.losses import Losses
from generator.model_files.body_tree.shapes import (
    Colour,
    MeshFiles,
    Shape,
    clipped_colour,
    folders_above,
    has_size,
    scaled,
)
from generator.model_files.body_tree.to_figure import figure_from_tree
from generator.model_files.body_tree.tree import (
    Body,
    BodyTree,
    DegreeOfFreedom,
    free_dofs,
    inertia_tensor,
    rotation_from_z_to,
    rotation_to_y_up,
    split_extra_inertia,
)
from generator.model_files.model_files import Imported
from generator.model_files.urdf.collada import read_collada
from generator.model_files.xml import XmlElement
from generator.rotations import Array, matrix_from_xyz, pose_matrix

SHAPES = ("box", "cylinder", "sphere", "capsule", "mesh")

PACKAGE, FILE = "package://", "file://"


def parse_origin(element: XmlElement) -> Array:
    """Parse the `origin` of an element as a pose, shape (4, 4); rotations are about fixed axes."""
    origin = element.find("origin")
    if origin is None:
        return np.eye(4)
    roll, pitch, yaw = origin.vector("rpy")
    # Rz(yaw) Ry(pitch) Rx(roll) is the inverse of a turn about the turned axes.
    turn = matrix_from_xyz(-roll, -pitch, -yaw).T
    return pose_matrix(turn, np.array(origin.vector("xyz")))


@dataclass
class VisualReader:
    """Reads the visuals of links.

    Attributes:
        root: the element `robot`.
        directory: directory of the model's file.
        losses: collects what a figure does not hold.
    """

    root: XmlElement
    directory: Path
    losses: Losses
    _files: MeshFiles = field(init=False)

    def __post_init__(self) -> None:
        """Prepare the reading of mesh files."""
        self._files = MeshFiles(self.losses, {".dae": read_collada})

    def shapes(self, link: XmlElement) -> tuple[Shape, ...]:
        """Return the visuals of a link; without any, its collision shapes."""
        visuals, collisions = list(link.find_all("visual")), list(link.find_all("collision"))
        if collisions:
            self.losses.add("contact: `mover simulate --floor` and `--scene` have their own")
        return tuple(self._read(link.get("name") or "", visuals or collisions))

    def _read(self, link: str, elements: list[XmlElement]) -> Iterator[Shape]:
        for element in elements:
            geometry = element.find("geometry")
            shapes = () if geometry is None else geometry.children
            known = next((shape for shape in shapes if ":" not in shape.tag), None)
            for shape in shapes:
                if shape is not known:
                    self.losses.add_description("unknown elements", shape.tag)
                    continue
                surface = self._surface(link, shape)
                if surface is not None:
                    pose = parse_origin(element)
                    yield Shape(surface.transformed(pose), self._colour(element))

    def _surface(self, link: str, shape: XmlElement) -> Surface | None:
        match shape.tag:
            case "box":
                sizes = shape.vector("size")
                if self._have_size(link, shape, *sizes):
                    return box(*(0.5 * size for size in sizes))
            case "sphere":
                radius = shape.number("radius")
                if self._have_size(link, shape, radius):
                    return sphere(radius)
            case "cylinder" | "capsule":
                radius, length = (shape.number(word) for word in ("radius", "length"))
                if self._have_size(link, shape, radius, length):
                    return (cylinder if shape.tag == "cylinder" else capsule)(radius, 0.5 * length)
            case "mesh":
                surface = self._mesh(shape.get("filename") or "")
                scale = shape.vector("scale", (1.0, 1.0, 1.0))
                if surface is not None and self._have_size(link, shape, *map(abs, scale)):
                    return scaled(surface, scale)
            case tag:
                shape.error(f"unknown shape `{shorten(tag)}`", spelling_hint(tag, SHAPES))
        return None

    def _have_size(self, link: str, shape: XmlElement, *sizes: float) -> bool:
        return has_size(shape, f"{shape.tag} of {link}", sizes, self.losses)

    def _mesh(self, name: str) -> Surface | None:
        """Return the surface in a mesh file; of a package, in a folder above the model."""
        if not name:
            self.losses.add_description("meshes without a file")
            return None
        if not name.startswith(PACKAGE):
            return self._files.find((self.directory,), name.removeprefix(FILE))
        package, _, rest = name.removeprefix(PACKAGE).partition("/")
        above = folders_above(self.directory)
        folders = [folder for each in above for folder in (each / package, each)]
        return self._files.find(folders, rest, name)

    def _colour(self, visual: XmlElement) -> Colour | None:
        """Return the colour of a visual's material, which may stand in the robot."""
        material = visual.find("material")
        if material is None:
            return None
        named = [one for one in self.root.find_all("material") if one.get("name") is not None]
        same = [one for one in named if one.get("name") == material.get("name")]
        for one in (material, *same):
            if one.find("texture") is not None:
                self.losses.add_description(
                    "textures: a material has its colour alone", one.get("name") or ""
                )
            colour = one.find("color")
            read = None if colour is None else colour.numbers("rgba", 4)
            if read is not None:
                return clipped_colour(read)
        return None


FIXED = "fixed"
KINDS: Final = ("revolute", "continuous", "prismatic", FIXED, "floating", "planar")

_X: Final = (1.0, 0.0, 0.0)


def parse_joint_dofs(joint: XmlElement, losses: Losses) -> tuple[DegreeOfFreedom, ...]:
    """Parse the degrees of freedom of a joint, from the parent outwards, in the child's frame."""
    kind, name = joint.get("type"), joint.get("name") or ""
    if kind is None or kind not in KINDS:
        joint.error(
            "this joint has no type" if kind is None else f"unknown joint type `{shorten(kind)}`",
            spelling_hint(kind or "", KINDS),
            "type",
        )
        return ()
    _add_extra_losses(joint, name, losses)
    if kind == FIXED:
        return ()
    if kind in ("floating", "planar"):
        return _several(joint, kind, name)
    turns = kind != "prismatic"
    axis_kind = AxisKind.ROTATION if turns else AxisKind.TRANSLATION
    freedom = DegreeOfFreedom(name, axis_kind, _axis(joint))
    dynamics, limit = joint.find("dynamics"), joint.find("limit")
    if dynamics is not None:
        freedom = replace(
            freedom,
            damping=_not_negative(dynamics, "damping"),
            friction=_not_negative(dynamics, "friction"),
        )
    if limit is None or kind == "continuous":
        return (freedom,)
    lower, upper = (limit.number(word) for word in ("lower", "upper"))
    if lower > upper:
        limit.error(
            f"the limits of `{shorten(name)}` leave no range", "`lower` is below `upper`", "lower"
        )
    elif lower == upper:
        losses.add("limits without a range", name)
    else:
        losses.add("limits of joints become stops of 1000 N m/rad or 100 kN/m", name)
        freedom = replace(freedom, lower=lower, upper=upper)
    return (freedom,)


def _several(joint: XmlElement, kind: str, name: str) -> tuple[DegreeOfFreedom, ...]:
    """The six freedoms of a floating joint, or the three of a planar one."""
    if kind == "floating":
        return tuple(free_dofs(name))
    normal = _axis(joint)
    first, second, _ = map(tuple, rotation_from_z_to(normal).T.tolist())
    return (
        DegreeOfFreedom(f"{name}_ty", AxisKind.TRANSLATION, second, joint=name),
        DegreeOfFreedom(f"{name}_tx", AxisKind.TRANSLATION, first, joint=name),
        DegreeOfFreedom(f"{name}_turn", AxisKind.ROTATION, normal, joint=name),
    )


def _axis(joint: XmlElement) -> Vector:
    element = joint.find("axis")
    if element is None:
        return _X
    read = element.vector("xyz", _X)
    return element.direction(read, "xyz")


def _not_negative(element: XmlElement, name: str) -> float:
    value = element.number(name)
    if value < 0.0:
        element.error(f"the {name} is negative", "a passive joint has none below zero", name)
    return max(value, 0.0)


def _add_extra_losses(joint: XmlElement, name: str, losses: Losses) -> None:
    """Report the properties that a figure's joint does not have."""
    limit = joint.find("limit")
    if limit is not None and (limit.get("effort") or limit.get("velocity")):
        losses.add("limits of effort and speed", name)
    mimic = joint.find("mimic")
    if mimic is not None:
        losses.add(
            "joints that follow others (`mimic`) move freely", f"{name} ({mimic.get('joint')})"
        )
    for word in ("safety_controller", "calibration"):
        if joint.find(word) is not None:
            losses.add_description("settings of controllers", name)


ROOT_JOINT = "base"

GRAVITY = (0.0, 0.0, -9.81)

_LOST: Final = {
    "gazebo": "settings of Gazebo",
    "transmission": "transmissions",
    "sensor": "sensors",
}

_INERTIA_KEYS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


@dataclass
class _Robot:
    """The links and joints of a robot by name, and the joint that carries each link."""

    links: dict[str, XmlElement] = field(default_factory=dict[str, XmlElement])
    joints: dict[str, XmlElement] = field(default_factory=dict[str, XmlElement])
    parent_joint: dict[str, XmlElement] = field(default_factory=dict[str, XmlElement])
    parent_link: dict[str, str] = field(default_factory=dict[str, str])


def figure_from_urdf(
    root: XmlElement, directory: Path | None, *, separate: bool = False
) -> Imported | None:
    """Convert a URDF document into a figure; None, with diagnostics, if that is impossible.

    The root link is fixed: if it has a mass, as a segment on a rigid joint to the world.

    Args:
        root: the element `robot`.
        directory: directory of the model's file, from which mesh files are looked for.
        separate: see `figure_from_tree`.
    """
    losses = Losses("URDF")
    robot = _robot(root, losses)
    order = _depth_first_links(robot, root)
    if order is None:
        return None
    visuals = VisualReader(root, directory or Path(), losses)
    bodies = [_body(robot, name, visuals) for name in order]
    fixed = frozenset({order[0]} if bodies[0].mass is not None else ())
    if fixed:
        losses.add(
            "the root link is fixed to the world; `mover simulate --free-root` releases it",
            order[0],
        )
    up = rotation_to_y_up(GRAVITY, losses)
    tree = BodyTree(tuple(bodies), {}, up, root.get("name"), root.span)
    return figure_from_tree(tree, root.diagnostics, losses, separate=separate, fixed_bodies=fixed)


def _robot(root: XmlElement, losses: Losses) -> _Robot:
    robot = _Robot()
    for child in root.children:
        if child.tag.startswith("xacro:"):
            child.error(f"`{shorten(child.tag)}` is a macro", "expand the file with `xacro` first")
        elif child.tag in ("link", "joint"):
            _add_named(robot.links if child.tag == "link" else robot.joints, child)
        elif child.tag != "material":
            what = _LOST.get(child.tag, "unknown elements")
            losses.add(what, child.get("name") or child.get("reference") or child.tag)
    for joint in robot.joints.values():
        parent, child = (_end(joint, end, robot.links) for end in ("parent", "child"))
        if parent is None or child is None:
            continue
        first = robot.parent_joint.setdefault(child, joint)
        if first is not joint:
            joint.error(
                f"a second joint carries the link `{shorten(child)}`: loops cannot be read",
                f"the first is `{shorten(first.get('name') or '')}` in line {first.span.line}",
            )
            continue
        robot.parent_link[child] = parent
    return robot


def _add_named(known: dict[str, XmlElement], element: XmlElement) -> None:
    name = element.get("name")
    if not name:
        element.error(f"this {element.tag} has no name", 'write `name="..."`')
    else:
        element.is_first_of_name(name, known)


def _end(joint: XmlElement, end: str, links: Mapping[str, XmlElement]) -> str | None:
    """The name of a joint's parent or child link."""
    element = joint.find(end)
    name = None if element is None else element.get("link")
    if element is None or name is None:
        joint.error(f"this joint has no {end}", f'write `<{end} link="..."/>`')
        return None
    if name not in links:
        element.error(f"the file has no link `{shorten(name)}`", spelling_hint(name, links), "link")
        return None
    return name


def _depth_first_links(robot: _Robot, root: XmlElement) -> list[str] | None:
    """The links, each parent before its children; None when they make no tree."""
    if root.diagnostics.has_errors:
        return None
    roots = [name for name in robot.links if name not in robot.parent_link]
    if not robot.links:
        root.error("this robot has no links", 'write `<link name="...">`')
        return None
    if len(roots) > 1:
        second = robot.links[roots[1]]
        second.error(
            f"no joint carries the link `{shorten(roots[1])}`, nor `{shorten(roots[0])}`",
            "a robot has one root",
            "name",
        )
        return None
    children: dict[str, list[str]] = {name: [] for name in robot.links}
    for child, parent in robot.parent_link.items():
        children[parent].append(child)
    order, waiting = list[str](), list(roots)
    while waiting:
        order.append(waiting.pop())
        waiting += reversed(children[order[-1]])
    lost = [name for name in robot.links if name not in set(order)]
    if lost:
        robot.links[lost[0]].error(
            f"the joints from `{shorten(lost[0])}` lead back to it: loops cannot be read",
            "the links of a robot form a tree with one root",
            "name",
        )
        return None
    return order


def _body(robot: _Robot, name: str, visuals: VisualReader) -> Body:
    link, joint = robot.links[name], robot.parent_joint.get(name)
    freedoms: tuple[DegreeOfFreedom, ...] = ()
    pose, title = np.eye(4), ROOT_JOINT
    if joint is not None:
        freedoms = parse_joint_dofs(joint, visuals.losses)
        pose, title = parse_origin(joint), joint.get("name") or name
        if joint.get("type") == FIXED:
            title = ""
    mass, loose = _mass(link) or (None, np.zeros((3, 3)))
    place = link.span_of("name")
    shapes, parent = visuals.shapes(link), robot.parent_link.get(name)
    return Body(name, parent, pose, freedoms, mass, {}, place, title, loose, shapes)


def _mass(link: XmlElement) -> tuple[MassProperties | None, Array] | None:
    """The mass properties of a link in its frame, and loose inertia; None without any."""
    inertial = link.find("inertial")
    if inertial is None:
        return None
    mass, inertia = inertial.find("mass"), inertial.find("inertia")
    if mass is None or "value" not in mass.attributes:
        inertial.error("this inertial has no mass", 'write `<mass value="..."/>`')
        return None
    value = mass.number("value")
    if value == 0.0 and inertia is None:
        return None
    if inertia is None:
        inertial.error("this inertial has no inertia", 'write `<inertia ixx="..." .../>`')
        return None
    missing = [key for key in _INERTIA_KEYS[:3] if key not in inertia.attributes]
    if missing:
        inertia.error(f"`{missing[0]}` is missing", "an inertia has six numbers")
        return None
    tensor = inertia_tensor(inertia.number(key) for key in _INERTIA_KEYS)
    pose = parse_origin(inertial)
    try:
        return split_extra_inertia(value, np.zeros(3), tensor, pose)
    except ValueError as failure:
        mass.error(str(failure))
        return None
