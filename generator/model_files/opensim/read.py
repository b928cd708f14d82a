"""OpenSim's models (`.osim`, since OpenSim 4): the passive tree of one as a figure.

Frames of an OpenSim model: which body each stands on, and where.

A socket names a frame by its path among the components of the model, either from the model
(`/bodyset/femur_r`) or from the component that has the socket (`..`, `hip_offset`).
"""

from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from posixpath import join, normpath
from typing import Final

import numpy as np

from generator.diagnostics import Findings, nearest, shorten
from generator.inertia import MassProperties
from generator.losses import Report
from generator.model_files.body_tree.names import gravity_words, turned_up
from generator.model_files.body_tree.to_figure import figure_of
from generator.model_files.body_tree.tree import Body, Freedom, PassiveTree, loosely
from generator.model_files.imported import Imported
from generator.model_files.opensim.forces import with_forces
from generator.model_files.opensim.joints import row_of
from generator.model_files.opensim.values import numbers_in
from generator.model_files.xml_read import Element, numbers
from generator.rotations import Array, homogeneous, inverse_pose, matrix_from_xyz

GROUND = "ground"

_OFFSET = "PhysicalOffsetFrame"
_BASES = ("Body", "Ground")


@dataclass
class Frames:
    """The frames of a model by their paths.

    Attributes:
        findings: for faults.
        paths: of every component with a name, by its place in memory.
        found: frames and bodies by path.
        named: likewise by name, the first of each.
    """

    findings: Findings
    paths: dict[int, str] = field(default_factory=dict[int, str])
    found: dict[str, Element] = field(default_factory=dict[str, Element])
    named: dict[str, Element] = field(default_factory=dict[str, Element])

    @classmethod
    def of(cls, model: Element, findings: Findings) -> "Frames":
        """The frames of a model."""
        frames, waiting = cls(findings), [(model, "/")]
        while waiting:
            element, path = waiting.pop()
            frames.paths[id(element)] = path
            for child in reversed(element.children):
                name = child.get("name")
                if name is None and child.tag.endswith("Set"):
                    name = child.tag.lower()
                waiting.append((child, path if name is None else join(path, name)))
            if element.tag in (_OFFSET, *_BASES):
                frames.found.setdefault(path, element)
                frames.named.setdefault(path.rsplit("/", 1)[-1], element)
        return frames

    def base(self, holder: Element, socket: str) -> tuple[str, Array] | None:
        """The body on which the frame stands that a socket names, and the frame's pose in it.

        The ground is called `ground`. None, with the fault noted, where there is no such frame.
        """
        pose = np.eye(4)
        for _ in range(len(self.found) + 1):
            held = holder.first(socket)
            if held is None or not held.text.text:
                self.findings.error(
                    f"`{holder.tag}` has no `{socket}`", holder.span, "it names a frame"
                )
                return None
            frame = self._meant(holder, held.text.text)
            if frame is None and held.text.text.rsplit("/", 1)[-1] == GROUND:
                return GROUND, pose
            if frame is None:
                self.findings.error(
                    f"there is no frame `{shorten(held.text.text)}`",
                    held.text.span,
                    nearest(held.text.text.rsplit("/", 1)[-1], self.named),
                )
                return None
            if frame.tag in _BASES:
                return GROUND if frame.tag == "Ground" else frame.get("name") or "", pose
            pose = self._offset(frame) @ pose
            holder, socket = frame, "socket_parent"
        self.findings.error("these frames stand on each other in a ring", holder.span)
        return None

    def _meant(self, holder: Element, path: str) -> Element | None:
        """The frame at a path; else the one of its last name, since early files told no more."""
        whole = normpath(join(self.paths[id(holder)], path))
        name = path.rsplit("/", 1)[-1]
        return self.found.get(whole) or (None if name == ".." else self.named.get(name))

    def _offset(self, frame: Element) -> Array:
        """Pose of an offset frame in its parent, shape (4, 4)."""
        a, b, c = numbers_in(frame, "orientation", (0.0, 0.0, 0.0), self.findings)
        offset = numbers_in(frame, "translation", (0.0, 0.0, 0.0), self.findings)
        return homogeneous(matrix_from_xyz(a, b, c), np.array(offset))


GRAVITY = (0.0, -9.80665, 0.0)

OLDEST = 30000
"""Version of the first files in which joints stand beside bodies: OpenSim 4."""

_LOST: Final = {
    "ConstraintSet": "constraints",
    "ControllerSet": "controllers",
    "ContactGeometrySet": "contact",
    "ProbeSet": "probes",
    "ComponentSet": "other components",
    "components": "other components",
}
_SHAPES = "shapes: segments have no shape and touch nothing"


def figure_from_osim(
    root: Element, directory: Path | None, findings: Findings, *, apart: bool = False
) -> Imported | None:
    """The figure of an OpenSim model; None, with the faults noted, when it makes none.

    Args:
        root: the element `OpenSimDocument`.
        directory: not needed; nothing is included.
        findings: for faults.
        apart: see `figure_of`.
    """
    report = Report("OpenSim model")
    element = root.first("Model")
    if element is None or _is_old(root, element, findings):
        if element is None:
            findings.error("this document has no `Model`", root.span, "a model stands in it")
        return None
    known: dict[str, Element] = {}
    for body in _objects(element, "BodySet"):
        first = known.setdefault(body.get("name") or "", body)
        if first is not body:
            findings.error(f"a second body named `{shorten(body.get('name') or '')}`", body.span)
    frames = Frames.of(element, findings)
    bodies = _hung(_links(frames, element, report), known, findings)
    bodies = list(with_forces(bodies, _objects(element, "ForceSet"), findings, report))
    sites = _add_markers(frames, element, bodies)
    _tell_parts(element, report)
    gravity = numbers_in(element, "gravity", GRAVITY, findings)
    up = turned_up(np.array(gravity))
    for sentence in gravity_words(np.array(gravity), up):
        report.lose(sentence)
    tree = PassiveTree(tuple(bodies), sites, up, element.get("name"), root.span)
    return figure_of(tree, findings, report, apart=apart)


def _is_old(root: Element, model: Element, findings: Findings) -> bool:
    """Whether the file is older than OpenSim 4, in which joints stood in their bodies."""
    written = root.attributes.get("Version")
    read = None if written is None else numbers(written, findings, 1)
    if model.first("JointSet") is not None and (read is None or read[0] >= OLDEST):
        return False
    findings.error(
        "this model was written by OpenSim 3 or older"
        if read is not None and read[0] < OLDEST
        else "this model has no `JointSet`",
        root.place("Version") if read is not None and read[0] < OLDEST else model.span,
        "open it in OpenSim 4 and save it again",
    )
    return True


def _objects(model: Element, name: str) -> Iterator[Element]:
    """The elements of a set of the model."""
    for each in model.all(name):
        held = each.first("objects")
        yield from () if held is None else held.children


@dataclass(frozen=True)
class _Link:
    """A joint between two bodies, from `base` to `tip`.

    `pose` is of the tip in the base with all freedoms at zero, and these are told in the tip.
    """

    joint: Element
    base: str
    tip: str
    pose: Array
    freedoms: tuple[Freedom, ...]

    @property
    def reversed(self) -> "_Link":
        """The same joint seen from its other end."""
        freedoms = tuple(
            freedom.seen_from(self.pose).turned_round for freedom in reversed(self.freedoms)
        )
        return _Link(self.joint, self.tip, self.base, inverse_pose(self.pose), freedoms)


def _links(frames: Frames, element: Element, report: Report) -> Iterator[_Link]:
    """The joints of a model."""
    for joint in _objects(element, "JointSet"):
        parent, child = (frames.base(joint, f"socket_{end}_frame") for end in ("parent", "child"))
        row = row_of(joint, frames.findings, report)
        if parent is None or child is None:
            continue
        (base, base_pose), (tip, tip_pose) = parent, child
        if base == tip:
            frames.findings.error(
                f"the joint `{shorten(joint.get('name') or joint.tag)}` joins `{shorten(base)}` to "
                "itself",
                joint.span,
                "a joint connects two bodies",
            )
            continue
        pose = base_pose @ row.pose @ inverse_pose(tip_pose)
        moved = tuple(freedom.seen_from(tip_pose) for freedom in row.freedoms)
        yield _Link(joint, base, tip, pose, moved)


def _hung(links: Iterable[_Link], known: Mapping[str, Element], findings: Findings) -> list[Body]:
    """The bodies, each parent before its children, from the ground whichever end is called so."""
    from_base: dict[str, list[_Link]] = {}
    for link in links:
        from_base.setdefault(link.base, []).append(link)
        from_base.setdefault(link.tip, []).append(link.reversed)
    found: dict[str, Body] = {}
    used, waiting = set[int](), deque([GROUND])
    while waiting:
        base = waiting.popleft()
        for link in from_base.get(base, ()):
            if id(link.joint) in used:
                continue
            used.add(id(link.joint))
            name = link.joint.get("name") or link.joint.tag
            if link.tip in found or link.tip == GROUND:
                findings.error(
                    f"the joint `{shorten(name)}` closes a loop, and only trees are read",
                    link.joint.span,
                    "let a constraint close it",
                )
                continue
            mass, loose = _mass(known[link.tip], findings) or (None, np.zeros((3, 3)))
            found[link.tip] = Body(
                link.tip,
                None if base == GROUND else base,
                link.pose,
                link.freedoms,
                mass,
                place=known[link.tip].place("name"),
                joint=name,
                loose=loose,
            )
            waiting.append(link.tip)
    for name, body in known.items():
        if name not in found and not findings.has_errors:
            findings.error(
                f"no joints lead from the ground to the body `{shorten(name)}`",
                body.place("name"),
                "bodies that fly have a `FreeJoint`",
            )
    return list(found.values())


def _mass(body: Element, findings: Findings) -> tuple[MassProperties, Array] | None:
    """The mass properties of a body, and loose inertia; None without any."""
    (mass,) = numbers_in(body, "mass", (0.0,), findings)
    if mass == 0.0:
        return None
    centre = np.array(numbers_in(body, "mass_center", (0.0, 0.0, 0.0), findings))
    xx, yy, zz, xy, xz, yz = numbers_in(body, "inertia", (0.0,) * 6, findings)
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    try:
        return loosely(mass, centre, tensor, np.eye(4))
    except ValueError as failure:
        findings.error(str(failure), (body.first("mass") or body).span)
        return None


def _add_markers(frames: Frames, element: Element, bodies: list[Body]) -> dict[str, Array]:
    """Give markers to their bodies as sites, and tell those of the ground."""
    grounded: dict[str, Array] = {}
    places = {body.name: k for k, body in enumerate(bodies)}
    for marker in _objects(element, "MarkerSet"):
        held = frames.base(marker, "socket_parent_frame")
        if held is None:
            continue
        name, pose = held
        at = np.array(numbers_in(marker, "location", (0.0, 0.0, 0.0), frames.findings))
        site = {marker.get("name") or "marker": pose @ homogeneous(np.eye(3), at)}
        if name == GROUND:
            grounded |= site
        elif name in places:
            body = bodies[places[name]]
            bodies[places[name]] = replace(body, sites={**body.sites, **site})
    return grounded


def _tell_parts(model: Element, report: Report) -> None:
    """What a figure does not have."""
    for section in model.children:
        if section.tag in _LOST:
            held = section.first("objects") or section
            for part in held.children:
                if part.tag not in ("objects", "groups"):
                    report.lose(_LOST[section.tag], part.get("name") or part.tag)
    for body in (*_objects(model, "BodySet"), *model.all("Ground")):
        for part in body.walk():
            if part.tag == "attached_geometry" and part.children:
                report.lose(_SHAPES, body.get("name") or body.tag)
            if part.tag.startswith("Wrap") and part.get("name") and part.tag != "WrapObjectSet":
                report.lose("surfaces that muscles wrap", part.get("name") or part.tag)
