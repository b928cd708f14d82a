"""MJCF, the models of MuJoCo: the passive tree of one as a figure."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

import numpy as np

from generator.diagnostics import shorten, spelling_hint
from generator.figure import is_rotation
from generator.inertia import MassProperties
from generator.losses import Effect, Losses
from generator.model_files.body_tree.shapes import Shape
from generator.model_files.body_tree.tree import (
    Body,
    BodyTree,
    DegreeOfFreedom,
    FunctionCurve,
    inertia_tensor,
    own_site_names,
    rotation_to_y_up,
)
from generator.model_files.coupled_laws import CarriedLaws, find_carried_laws, imported_with_laws
from generator.model_files.embedded import MARK
from generator.model_files.mjcf.document import COMPILER_CHOICES, MAIN, Document, parse_document
from generator.model_files.mjcf.geoms import GeomReader
from generator.model_files.mjcf.joints import (
    ORIENTATION_ATTRIBUTES,
    JointReader,
    parse_coefficients,
    parse_orientation,
    parse_pose,
)
from generator.model_files.mjcf.joints import READ_ATTRIBUTES as READ_OF_JOINTS
from generator.model_files.mjcf.write import coupled_elements
from generator.model_files.model_files import Imported
from generator.model_files.xml import XmlElement
from generator.rotations import Array
from springs import Cubic

_UNSUPPORTED_ELEMENTS: Final = {
    "composite": "a composite of many bodies",
    "flexcomp": "a flexible body",
    "attach": "a model that is attached",
    "replicate": "a part that is replicated",
}
_READ_ATTRIBUTES: Final = {
    "body": {"name", "pos", *ORIENTATION_ATTRIBUTES, "childclass", "mocap"},
    "frame": {"name", "pos", *ORIENTATION_ATTRIBUTES, "childclass"},
    "inertial": {"pos", *ORIENTATION_ATTRIBUTES, "mass", "diaginertia", "fullinertia"},
    "joint": READ_OF_JOINTS,
    "freejoint": {"name"},
}
_BODY_ELEMENTS: Final = (
    *(*_READ_ATTRIBUTES, "geom", "site", "camera", "light", "plugin"),
    *_UNSUPPORTED_ELEMENTS,
)


@dataclass
class _BodyContents:
    """Contents of a body and its frames."""

    joints: list[XmlElement] = field(default_factory=list[XmlElement])
    inertial: XmlElement | None = None
    geoms: list[tuple[XmlElement, Array]] = field(default_factory=list[tuple[XmlElement, Array]])
    sites: dict[str, Array] = field(default_factory=dict[str, Array])
    bodies: list[tuple[XmlElement, Array, str]] = field(
        default_factory=list[tuple[XmlElement, Array, str]]
    )


@dataclass
class BodyReader:
    """Reads the bodies below `worldbody`.

    Attributes:
        document: the model.
        losses: collects what a figure does not hold.
        geoms: reads the shapes of geoms.
        bodies: what was read, each parent before its children.
        sites: frames fixed to the world.
        shapes: fixed to the world.
    """

    document: Document
    losses: Losses
    geoms: GeomReader
    bodies: list[Body] = field(default_factory=list[Body])
    sites: dict[str, Array] = field(default_factory=dict[str, Array])
    shapes: tuple[Shape, ...] = ()
    _names: dict[str, XmlElement] = field(default_factory=dict[str, XmlElement])
    _joint_names: dict[str, XmlElement] = field(default_factory=dict[str, XmlElement])
    _fixed: set[str | None] = field(default_factory=lambda: {None})

    def read_world(self, world: XmlElement) -> None:
        """Read the bodies of a `worldbody`."""
        contents = self._collect_contents(world, world.get("childclass") or MAIN)
        for element in contents.joints:
            element.error("the world has no joints", "joints stand in a body")
        self.sites |= contents.sites
        self.shapes += self.geoms.shapes(contents.geoms)
        for element, before, childclass in contents.bodies:
            self._read_body(element, None, before, childclass)

    def _read_body(
        self, element: XmlElement, parent: str | None, parent_pose: Array, childclass: str
    ) -> None:
        name = element.get("name") or f"body_{len(self.bodies) + 1}"
        if not element.is_first_of_name(name, self._names):
            return
        if element.get("mocap") == "true":
            self.losses.add("mocap bodies are fixed", name)
        self._add_unread_losses(element)
        childclass = element.get("childclass") or childclass
        contents = self._collect_contents(element, childclass)
        autolimits = self.document.setting("autolimits", "true") == "true"
        angles = self.document.angle_convention
        joints = JointReader(angles, autolimits, self.losses)
        freedoms = joints.read(name, contents.joints, is_outermost=parent is None)
        # A body that cannot move needs no mass, but has its share in a prescribed total mass.
        fixed = not freedoms and parent in self._fixed
        if fixed:
            self._fixed.add(name)
        needless = fixed and not self._number_setting("settotalmass") > 0.0
        mass, inertia = (None, np.zeros((3, 3))) if needless else self._body_mass(contents)
        self.bodies.append(
            Body(
                name,
                parent,
                parent_pose @ parse_pose(element, angles),
                freedoms,
                mass,
                own_site_names(name, contents.sites),
                element.span_of("name"),
                extra_inertia=inertia,
                shapes=self.geoms.shapes(contents.geoms),
            )
        )
        for child, pose, inner in contents.bodies:
            self._read_body(child, name, pose, inner)

    def _collect_contents(self, element: XmlElement, childclass: str) -> _BodyContents:
        contents = _BodyContents()
        self._collect_children(element, np.eye(4), childclass, contents)
        return contents

    def _collect_children(
        self, element: XmlElement, pose_in_body: Array, childclass: str, contents: _BodyContents
    ) -> None:
        """Collect the contents of a body, or of a frame with the pose `pose_in_body` in it."""
        angles = self.document.angle_convention
        for child in element.children:
            match child.tag:
                case "body":
                    contents.bodies.append((child, pose_in_body, childclass))
                case "frame":
                    self._add_unread_losses(child)
                    inner = child.get("childclass") or childclass
                    self._collect_children(
                        child, pose_in_body @ parse_pose(child, angles), inner, contents
                    )
                case "joint" | "freejoint":
                    self._collect_joint(child, element, childclass, contents)
                case "inertial":
                    self._add_unread_losses(child)
                    contents.inertial = child
                case "geom":
                    whole = self.document.with_defaults(child, childclass)
                    contents.geoms.append((whole, pose_in_body))
                case "site":
                    whole = self.document.with_defaults(child, childclass)
                    pose = pose_in_body @ parse_pose(whole, angles)
                    contents.sites[child.get("name") or f"site_{len(contents.sites) + 1}"] = pose
                case "camera" | "light" | "plugin":
                    effect = Effect.MOTION if child.tag == "plugin" else Effect.DESCRIPTION
                    names = filter(None, [child.get("name")])
                    self.losses.add(f"{child.tag}s", *names, effect=effect)
                case tag if tag in _UNSUPPORTED_ELEMENTS:
                    child.error(
                        f"{_UNSUPPORTED_ELEMENTS[tag]} (`{tag}`) is not read",
                        "save the model as MuJoCo compiles it, in which it is written out",
                    )
                case tag:
                    child.error(
                        f"unknown element `{shorten(tag)}` in `{element.tag}`",
                        spelling_hint(tag, _BODY_ELEMENTS),
                    )

    def _collect_joint(
        self, child: XmlElement, parent: XmlElement, childclass: str, contents: _BodyContents
    ) -> None:
        if parent.tag == "frame":
            child.error("a joint stands in a frame", "a joint stands in its body")
            return
        name = child.get("name")
        if name and not child.is_first_of_name(name, self._joint_names):
            return
        whole = child
        if child.tag == "joint":
            whole = self.document.with_defaults(child, childclass)
        self._add_unread_losses(whole)
        contents.joints.append(whole)

    def _body_mass(self, contents: _BodyContents) -> tuple[MassProperties | None, Array]:
        """Return the mass properties of a body, and its inertia if that has no mass.

        They are those of its `inertial` or the sum of its geoms, within the compiler's bounds.
        """
        choice = self.document.setting("inertiafromgeom", "auto")
        if contents.inertial is not None and choice != "true":
            return self._parse_inertial(contents.inertial)
        total: MassProperties | None = None
        bounds = self.document.compiler.numbers("inertiagrouprange", 2)
        for element, before in contents.geoms if choice != "false" else ():
            group = 0.0 if bounds is None else element.number("group")
            if bounds is not None and not bounds[0] <= group <= bounds[1]:
                continue
            part = self.geoms.mass(element)
            if part is not None:
                moved = part.transform(before)
                total = moved if total is None else total + moved
        if total is None:
            return self._with_bounds(0.0, np.zeros(3), np.zeros((3, 3)))
        return self._with_bounds(total.mass, total.centre, total.inertia)

    def _parse_inertial(self, element: XmlElement) -> tuple[MassProperties | None, Array]:
        nothing = None, np.zeros((3, 3))
        if "mass" not in element.attributes:
            element.error("`inertial` has no mass", "add `mass`")
            return nothing
        mass = element.number("mass")
        turn = parse_orientation(element, self.document.angle_convention)
        tensor = np.diag(element.vector("diaginertia"))
        if "fullinertia" in element.attributes:
            default = (1.0,) * 3 + (0.0,) * 3
            tensor = inertia_tensor(element.numbers("fullinertia", 6) or default)
        elif "diaginertia" not in element.attributes and mass != 0.0:
            element.error("`inertial` has no inertia", "add `diaginertia` or `fullinertia`")
            return nothing
        place = np.array(element.vector("pos"))
        try:
            return self._with_bounds(mass, place, turn @ tensor @ turn.T)
        except ValueError as failure:
            element.error(str(failure), "MuJoCo refuses it as well")
            return nothing

    def _with_bounds(
        self, mass: float, centre: Array, tensor: Array
    ) -> tuple[MassProperties | None, Array]:
        """Return mass properties within the compiler's bounds, and inertia without mass.

        As in MuJoCo the lower bounds apply first: with them the moments may need no balance.
        Raises ValueError for numbers that no body has.
        """
        least, least_inertia = map(self._number_setting, ("boundmass", "boundinertia"))
        moments, axes = np.linalg.eigh(tensor)
        if least > 0.0:
            mass = max(mass, least)
        if least_inertia > 0.0:
            moments = np.maximum(moments, least_inertia)
        balance = self.document.setting("balanceinertia", "false") == "true"
        if balance and moments.max() > moments.sum() - moments.max():
            moments = np.full(3, moments.mean())
        tensor = axes @ np.diag(moments) @ axes.T
        if mass == 0.0:
            return None, tensor
        return MassProperties(mass, centre, tensor), np.zeros((3, 3))

    def _number_setting(self, name: str) -> float:
        return self.document.compiler.number(name)

    def _add_unread_losses(self, element: XmlElement) -> None:
        unread = element.attributes.keys() - _READ_ATTRIBUTES[element.tag] - {"class"}
        for name in sorted(unread):
            self.losses.add("attributes that a figure does not have", f"{element.tag} {name}")

    def scaled_bodies(self) -> list[Body]:
        """Return the bodies, scaled to the total mass of the compiler settings."""
        total = self._number_setting("settotalmass")
        if not total > 0.0:
            return self.bodies
        factor = total / sum(body.mass.mass for body in self.bodies if body.mass is not None)
        return [
            replace(
                body,
                mass=body.mass and body.mass.with_mass(body.mass.mass * factor),
                extra_inertia=body.extra_inertia * factor,
            )
            for body in self.bodies
        ]


STANDARD_GRAVITY = (0.0, 0.0, -9.81)

_LOST: Final = {
    "actuator": "actuators",
    "equality": "equality constraints",
    "contact": "contact pairs and exclusions",
    "sensor": "sensors",
    "keyframe": "key frames",
    "custom": "custom fields",
    "extension": "plugins",
    "deformable": "flexible bodies and skins",
    "visual": "rendering settings",
    "statistic": "rendering settings",
    "size": "memory sizes",
}
_MOVING: Final = ("actuator", "equality", "contact", "extension", "deformable")
_READ_SECTIONS: Final = ("asset", "compiler", "option", "default", "tendon", "worldbody")

_COMPILER: Final = {
    *COMPILER_CHOICES,
    *("eulerseq", "inertiagrouprange", "boundmass", "boundinertia", "settotalmass"),
    *("meshdir", "assetdir", "texturedir", "strippath"),
}


def figure_from_mjcf(
    root: XmlElement, directory: Path | None, *, separate: bool = False
) -> Imported | None:
    """Convert an MJCF document into a figure; None, with diagnostics, if that is impossible.

    Args:
        root: the element `mujoco`.
        directory: directory of included files.
        separate: see `figure_from_tree`.
    """
    losses = Losses("MJCF")
    document = parse_document(root, directory)
    up = _up_rotation(document, losses)
    geoms = GeomReader(document, directory or Path(), losses)
    reader = BodyReader(document, losses, geoms)
    worlds = list(document.root.find_all("worldbody"))
    if not worlds:
        root.error("this model has no `worldbody`", "its bodies stand in one")
    for world in worlds:
        reader.read_world(world)
    springs = [
        child
        for section in document.root.find_all("tendon", "actuator")
        for child in section.children
    ]
    laws = find_carried_laws(root, springs, coupled_elements)
    bodies = with_tendons(document, reader.scaled_bodies(), laws, losses)
    _add_section_losses(document, laws, losses)
    geoms.add_asset_losses()
    tree = BodyTree(
        tuple(bodies), reader.sites, up, document.root.get("model"), root.span, reader.shapes
    )
    return imported_with_laws(root, tree, laws, losses, separate=separate)


def _up_rotation(document: Document, losses: Losses) -> Array:
    """Return the rotation that makes y up, from the direction of gravity; report it."""
    gravity = STANDARD_GRAVITY
    for option in document.root.find_all("option"):
        gravity = option.vector("gravity", gravity)
        flag = option.find("flag")
        if flag is not None and flag.get("gravity") == "disable":
            gravity = (0.0, 0.0, 0.0)
        for name in option.attributes:
            if name != "gravity":
                losses.add_description("settings of the simulation", name)
        for name in () if flag is None else flag.attributes:
            losses.add_description("settings of the simulation", f"flag {name}")
    return rotation_to_y_up(gravity, losses)


def _add_section_losses(document: Document, laws: CarriedLaws, losses: Losses) -> None:
    """Report sections and settings that a figure does not have."""
    for section in document.root.children:
        if section.tag in _READ_SECTIONS:
            continue
        what = _LOST.get(section.tag)
        effect = Effect.MOTION if section.tag in _MOVING else Effect.DESCRIPTION
        if what is None:
            losses.add("unknown sections", section.tag)
        elif section.tag == "visual" or not section.children:
            losses.add_description(what)
        else:
            left = laws.without(section.children)
            names = [element.label for element in left]
            others = [shorten(name) for name in names if not name.startswith(f"{MARK} ")]
            if others:
                losses.add(what, *others, effect=effect)
    for name in document.compiler.attributes:
        if name not in _COMPILER:
            losses.add("attributes that a figure does not have", f"compiler {name}")


_LOST_ATTRIBUTES = ("armature", "frictionloss", "range", "actuatorfrcrange")


def with_tendons(
    document: Document, bodies: Sequence[Body], laws: CarriedLaws, losses: Losses
) -> list[Body]:
    """Return the bodies with the springs of fixed tendons on one joint; report the others.

    Those of laws over several joints that come back are left out.
    """
    dofs = {dof.name: dof for body in bodies for dof in body.dofs}
    for section in document.root.find_all("tendon"):
        for element in laws.without(section.children):
            whole = document.with_defaults(replace(element, tag="tendon"), MAIN)
            name = whole.get("name") or element.tag
            joints = list(whole.find_all("joint"))
            if element.tag != "fixed" or len(joints) != 1:
                losses.add("tendons over several joints or along paths", name)
                continue
            dof = dofs.get(joints[0].get("joint") or "")
            if dof is None or dof.joint:
                losses.add("tendons on joints that are missing or balls", name)
                continue
            coefficient = joints[0].number("coef", 1.0)
            dofs[dof.name] = _with_tendon(dof, whole, name, coefficient, losses)
    return [replace(body, dofs=tuple(dofs[dof.name] for dof in body.dofs)) for body in bodies]


def _with_tendon(
    dof: DegreeOfFreedom, element: XmlElement, name: str, coefficient: float, losses: Losses
) -> DegreeOfFreedom:
    """Return a degree of freedom with the spring and the damper of a tendon."""
    for word in _LOST_ATTRIBUTES:
        if word in element.attributes:
            losses.add("friction, limits and armature of tendons", name)
    stiffness = parse_coefficients(element, "stiffness")
    damping = parse_coefficients(element, "damping")
    if any(damping[1:]):
        losses.add("quadratic and cubic damping", name)
    if damping[0] > 0.0:
        dof = replace(dof, damping=dof.damping + damping[0] * coefficient * coefficient)
    if not any(stiffness) or not coefficient:
        return dof
    slack = _slack_range(dof, element, coefficient)
    if slack[0] > slack[1]:
        element.error("this slack range has no length", "", "springlength")
        return dof
    if not is_rotation(dof.kind):
        losses.add("springs of tendons on sliding joints", name)
        return dof
    if coefficient == 1.0 and stiffness[0] > 0.0 and not any(stiffness[1:]):
        law = Cubic(
            (0.0, stiffness[0], 0.0, 0.0), -1, (slack[0] - dof.offset, slack[1] - dof.offset)
        )
        return replace(dof, laws=(*dof.laws, law))

    def torque(angles: Array) -> Array:
        length = coefficient * (angles + dof.offset)
        x = length - np.clip(length, slack[0], slack[1])
        linear, square, cube = stiffness
        return -coefficient * x * (linear + x * (square + x * cube))

    ends = tuple(sorted(end / coefficient - dof.offset for end in slack))
    return replace(dof, laws=(*dof.laws, FunctionCurve(torque, ends)))


def _slack_range(
    dof: DegreeOfFreedom, element: XmlElement, coefficient: float
) -> tuple[float, float]:
    """Return the lengths between which a tendon has no force.

    Without any it is the length where the joint's own spring has none.
    """
    read = element.numbers("springlength", 1, 2) or (-1.0,)
    low, high = read[0], read[-1]
    if (low, high) == (-1.0, -1.0):
        low = high = coefficient * (dof.rest + dof.offset)
    return low, high
