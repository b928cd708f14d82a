"""The bodies of an MJCF model with their joints, masses and sites."""

from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from generator.diagnostics import Findings, nearest, shorten
from generator.inertia import MassProperties
from generator.losses import Report
from generator.model_files.body_tree.tree import Body
from generator.model_files.mjcf.document import MAIN, Document
from generator.model_files.mjcf.geoms import geom_mass
from generator.model_files.mjcf.joints import READ as READ_OF_JOINTS
from generator.model_files.mjcf.joints import WAYS, JointReader, orientation_of, pose_of
from generator.model_files.xml_read import Element, number, numbers, vector
from generator.rotations import Array

_REFUSED: Final = {
    "composite": "a composite of many bodies",
    "flexcomp": "a flexible body",
    "attach": "a model that is attached",
    "replicate": "a part that is replicated",
}
_READ: Final = {
    "body": {"name", "pos", *WAYS, "childclass", "mocap"},
    "frame": {"name", "pos", *WAYS, "childclass"},
    "inertial": {"pos", *WAYS, "mass", "diaginertia", "fullinertia"},
    "joint": READ_OF_JOINTS,
    "freejoint": {"name"},
}
_IN_BODY: Final = (
    "body",
    "frame",
    "joint",
    "freejoint",
    "inertial",
    "geom",
    "site",
    "camera",
    "light",
    "plugin",
    *_REFUSED,
)


@dataclass
class _Gathered:
    """What stands in a body, also within its frames."""

    joints: list[Element] = field(default_factory=list[Element])
    inertial: Element | None = None
    geoms: list[tuple[Element, Array]] = field(default_factory=list[tuple[Element, Array]])
    sites: dict[str, Array] = field(default_factory=dict[str, Array])
    bodies: list[tuple[Element, Array, str]] = field(
        default_factory=list[tuple[Element, Array, str]]
    )


@dataclass
class BodyReader:
    """Reads the bodies below `worldbody`.

    Attributes:
        document: the model.
        findings: for faults.
        report: for what a figure does not hold.
        bodies: what was read, each parent before its children.
        sites: frames fixed to the world.
    """

    document: Document
    findings: Findings
    report: Report
    bodies: list[Body] = field(default_factory=list[Body])
    sites: dict[str, Array] = field(default_factory=dict[str, Array])
    _names: dict[str, Element] = field(default_factory=dict[str, Element])
    _fixed: set[str | None] = field(default_factory=lambda: {None})

    def read_world(self, world: Element) -> None:
        """All that hangs on a `worldbody`."""
        held = self._gathered(world, world.get("childclass") or MAIN)
        for element in held.joints:
            self.findings.error("the world has no joints", element.span, "joints stand in a body")
        self.sites |= held.sites
        for element, before, childclass in held.bodies:
            self._read_body(element, None, before, childclass)

    def _read_body(
        self, element: Element, parent: str | None, before: Array, childclass: str
    ) -> None:
        name = element.get("name") or f"body_{len(self.bodies) + 1}"
        first = self._names.setdefault(name, element)
        if first is not element:
            self.findings.error(
                f"a second body named `{shorten(name)}`",
                element.place("name"),
                f"the first stands in line {first.span.line}",
            )
            return
        if element.get("mocap") == "true":
            self.report.lose("bodies that are moved from outside, which are held here", name)
        self._tell_unread(element)
        childclass = element.get("childclass") or childclass
        held = self._gathered(element, childclass)
        joints = JointReader(self.document.angles, self._autolimits, self.findings, self.report)
        freedoms = joints.read(name, held.joints, is_outermost=parent is None)
        # A body that nothing can move needs no mass, but has its share in a total that is told.
        fixed = not freedoms and parent in self._fixed
        if fixed:
            self._fixed.add(name)
        needless = fixed and not self._setting("settotalmass") > 0.0
        mass = None if needless else self._mass(held)
        self.bodies.append(
            Body(
                name,
                parent,
                before @ pose_of(element, self.document.angles, self.findings),
                freedoms,
                mass,
                held.sites,
                element.place("name"),
            )
        )
        for child, pose, inner in held.bodies:
            self._read_body(child, name, pose, inner)

    @property
    def _autolimits(self) -> bool:
        return self.document.setting("autolimits", "true") == "true"

    def _gathered(self, element: Element, childclass: str) -> _Gathered:
        held = _Gathered()
        self._gather(element, np.eye(4), childclass, held)
        return held

    def _gather(self, element: Element, before: Array, childclass: str, held: _Gathered) -> None:
        """What stands in a body or a frame whose pose in its body is `before`."""
        angles, findings = self.document.angles, self.findings
        for child in element.children:
            match child.tag:
                case "body":
                    held.bodies.append((child, before, childclass))
                case "frame":
                    self._tell_unread(child)
                    inner = child.get("childclass") or childclass
                    self._gather(child, before @ pose_of(child, angles, findings), inner, held)
                case "joint" | "freejoint":
                    self._gather_joint(child, element, childclass, held)
                case "inertial":
                    self._tell_unread(child)
                    held.inertial = child
                case "geom":
                    whole = self.document.with_defaults(child, childclass, findings)
                    held.geoms.append((whole, before))
                    self.report.lose(
                        "shapes of geoms: segments have no shape and touch nothing",
                        child.get("name") or whole.get("type") or "sphere",
                    )
                case "site":
                    whole = self.document.with_defaults(child, childclass, findings)
                    pose = before @ pose_of(whole, angles, findings)
                    held.sites[child.get("name") or f"site_{len(held.sites) + 1}"] = pose
                case "camera" | "light" | "plugin":
                    self.report.lose(f"{child.tag}s", child.get("name") or f"a {child.tag}")
                case tag if tag in _REFUSED:
                    findings.error(
                        f"{_REFUSED[tag]} (`{tag}`) is not read",
                        child.span,
                        "save the model as MuJoCo compiles it, in which it is written out",
                    )
                case tag:
                    findings.error(
                        f"unknown element `{shorten(tag)}` in `{element.tag}`",
                        child.span,
                        nearest(tag, _IN_BODY),
                    )

    def _gather_joint(
        self, child: Element, parent: Element, childclass: str, held: _Gathered
    ) -> None:
        if parent.tag == "frame":
            self.findings.error(
                "a joint stands in a frame", child.span, "a joint stands in its body"
            )
            return
        whole = child
        if child.tag == "joint":
            whole = self.document.with_defaults(child, childclass, self.findings)
        self._tell_unread(whole)
        held.joints.append(whole)

    def _mass(self, held: _Gathered) -> MassProperties | None:
        """The mass properties of a body: its `inertial`, or the sum of its geoms."""
        choice = self.document.setting("inertiafromgeom", "auto")
        if held.inertial is not None and choice != "true":
            return self._bounded(self._told_mass(held.inertial))
        if choice == "false":
            return self._bounded(None)
        total: MassProperties | None = None
        for element, before in held.geoms:
            if not self._in_group(element):
                continue
            part = geom_mass(element, self.document.angles, self.findings)
            if part is not None:
                moved = part.in_frame(before)
                total = moved if total is None else total + moved
        return self._bounded(total)

    def _in_group(self, geom: Element) -> bool:
        written = self.document.compiler.get("inertiagrouprange")
        bounds = None if written is None else numbers(written, self.findings, 2)
        return bounds is None or bounds[0] <= number(geom, "group", self.findings) <= bounds[1]

    def _told_mass(self, element: Element) -> MassProperties | None:
        findings = self.findings
        if "mass" not in element.attributes:
            findings.error("`inertial` tells no mass", element.span, "add `mass`")
            return None
        mass = number(element, "mass", findings)
        if mass == 0.0:
            return None
        turn = orientation_of(element, self.document.angles, findings)
        tensor = np.diag(vector(element, "diaginertia", findings))
        full = element.attributes.get("fullinertia")
        if full is not None:
            xx, yy, zz, xy, xz, yz = numbers(full, findings, 6) or (1.0,) * 3 + (0.0,) * 3
            tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        elif "diaginertia" not in element.attributes:
            findings.error(
                "`inertial` tells no inertia", element.span, "add `diaginertia` or `fullinertia`"
            )
            return None
        moments, axes = np.linalg.eigh(tensor)
        balance = self.document.setting("balanceinertia", "false") == "true"
        if balance and moments[2] > moments[0] + moments[1]:
            moments = np.full(3, moments.mean())
        tensor = turn @ axes @ np.diag(moments) @ axes.T @ turn.T
        try:
            return MassProperties(mass, np.array(vector(element, "pos", findings)), tensor)
        except ValueError as failure:
            findings.error(str(failure), element.span, "MuJoCo refuses it as well")
            return None

    def _bounded(self, mass: MassProperties | None) -> MassProperties | None:
        """The mass properties with the least values that the compiler is told."""
        least = self._setting("boundmass")
        least_inertia = self._setting("boundinertia")
        if mass is None:
            if not (least > 0.0 and least_inertia > 0.0):
                return None
            return MassProperties(least, np.zeros(3), least_inertia * np.eye(3))
        moments, axes = np.linalg.eigh(mass.inertia)
        tensor = axes @ np.diag(np.maximum(moments, least_inertia)) @ axes.T
        return MassProperties(max(mass.mass, least), mass.centre, tensor)

    def _setting(self, name: str) -> float:
        written = self.document.compiler.get(name)
        read = None if written is None else numbers(written, self.findings, 1)
        return 0.0 if read is None else read[0]

    def _tell_unread(self, element: Element) -> None:
        unread = element.attributes.keys() - _READ[element.tag] - {"class"}
        for name in sorted(unread):
            self.report.lose("attributes without a meaning here", f"{element.tag} {name}")

    def scaled(self) -> list[Body]:
        """The bodies, with the total mass that the compiler is told."""
        total = self._setting("settotalmass")
        if not total > 0.0:
            return self.bodies
        factor = total / sum(body.mass.mass for body in self.bodies if body.mass is not None)
        return [_scaled(body, factor) for body in self.bodies]


def _scaled(body: Body, factor: float) -> Body:
    if body.mass is None:
        return body
    return replace(body, mass=body.mass.with_mass(body.mass.mass * factor))
