"""Reader of OpenSim's models (`.osim`): their passive tree as a figure.

A socket names a frame by its path among the components of the model, either from the model
(`/bodyset/femur_r`) or from the component that has the socket (`..`, `hip_offset`).
"""

from collections import deque
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from generator.diagnostics import shorten
from generator.figure import is_rotation
from generator.follower_curve import FollowerCurve
from generator.inertia import MassProperties
from generator.losses import Losses
from generator.model_files.body_tree.tree import (
    Body,
    BodyTree,
    DegreeOfFreedom,
    inertia_tensor,
    own_site_names,
    rotation_to_y_up,
    split_extra_inertia,
)
from generator.model_files.coupled_laws import find_carried_laws, imported_with_laws
from generator.model_files.embedded import carried_model
from generator.model_files.imported import Imported
from generator.model_files.opensim.bushings import apply_bushings
from generator.model_files.opensim.frames import GROUND, FrameIndex
from generator.model_files.opensim.joints import (
    BALLS,
    FUNCTION_TAGS,
    Followed,
    parse_curve,
    parse_joint,
)
from generator.model_files.opensim.passive_forces import apply_forces
from generator.model_files.opensim.reach_forces import find_reaches
from generator.model_files.opensim.rotation_springs import (
    RotationSpring,
    find_rotation_springs,
    with_rotation_springs,
)
from generator.model_files.opensim.shapes import GeometryReader
from generator.model_files.opensim.upgrade import upgraded_document
from generator.model_files.opensim.write import coupled_elements
from generator.model_files.xml import XmlElement
from generator.rotations import Array, inverse_pose, pose_matrix
from springs import SphericalLaw

GRAVITY = (0.0, -9.80665, 0.0)

OPENSIM_4 = 40000
"""Version of the first files of OpenSim 4, in which joints stand beside bodies."""

COUPLER = "CoordinateCouplerConstraint"

_LOST: Final = {
    "ConstraintSet": "constraints",
    "ControllerSet": "controllers",
    "ContactGeometrySet": "contact",
    "ProbeSet": "probes",
    "ComponentSet": "other components",
    "components": "other components",
}


def figure_from_osim(
    root: XmlElement, directory: Path | None, *, separate: bool = False
) -> Imported | None:
    """Convert an OpenSim model into a figure; None, with diagnostics, if that is impossible.

    Args:
        root: the element `OpenSimDocument`.
        directory: directory of the model's file, from which mesh files are looked for.
        separate: see `figure_from_tree`.
    """
    losses = Losses("OpenSim model")
    (version,) = root.numbers("Version", 1) or (OPENSIM_4,)
    element = root.find("Model")
    if version < OPENSIM_4 and element is not None and element.find("JointSet") is None:
        upgraded = upgraded_document(root, losses)
        if upgraded is None:
            return None
        root, element = upgraded, upgraded.find("Model")
    if element is None:
        root.error("this document has no `Model`", "a model stands in it")
        return None
    if element.find("JointSet") is None:
        element.error("this model has no `JointSet`", "nothing in it moves")
        return None
    known: dict[str, XmlElement] = {}
    for body in _set_objects(element, "BodySet"):
        name = body.get("name") or ""
        if known.setdefault(name, body) is not body:
            body.error(f"a second body named `{shorten(name)}`")
    frames = FrameIndex.from_model(element)
    followed = _followed(element)
    bodies = _build_bodies(_links(frames, element, losses, followed), known)
    balls = {each.get("name") for each in _set_objects(element, "JointSet") if each.tag in BALLS}
    forces = list(_set_objects(element, "ForceSet"))
    laws = find_carried_laws(root, forces, coupled_elements)
    forces = laws.without(forces)
    bodies, forces = find_reaches(bodies, forces, carried_model(root))
    rotation_springs, forces = find_rotation_springs(bodies, forces)
    bodies = apply_forces(bodies, forces, losses)
    bodies = apply_bushings(frames, bodies, forces, losses)
    rotation_springs = _without_lone_damping(bodies, rotation_springs, losses)
    bodies = with_rotation_springs(bodies, rotation_springs, losses)
    law = next((spring.law for spring in rotation_springs if spring.law), None)
    if law is None and any(_has_ball_law(body, balls) for body in bodies):
        law = SphericalLaw.CONSERVATIVE
    sites = _add_markers(frames, element, bodies)
    shapes = GeometryReader(frames, directory or Path(), losses).read(element)
    bodies = [replace(body, shapes=shapes.get(body.name, ())) for body in bodies]
    _add_part_losses(element, losses, followed)
    up = rotation_to_y_up(element.child_numbers("gravity", GRAVITY), losses)
    name, ground = element.get("name"), shapes.get(GROUND, ())
    tree = BodyTree(tuple(bodies), sites, up, name, root.span, ground, law)
    return imported_with_laws(root, tree, laws, losses, separate=separate)


def _has_ball_law(body: Body, balls: Container[str | None]) -> bool:
    """Return whether forces act on the rotations of a ball, which do so about the parent's axes."""
    return body.joint in balls and any(
        dof.is_passive and is_rotation(dof.kind) for dof in body.dofs
    )


def _without_lone_damping(
    bodies: Sequence[Body], springs: Sequence[RotationSpring], losses: Losses
) -> list[RotationSpring]:
    """Return the springs without damping that no law holds beside laws of coordinates; report it.

    It is that of a joint whose reach was lost.
    """
    turns = {
        body.name: [dof for dof in body.dofs if is_rotation(dof.kind)]
        for body in bodies
        if body.reach is None
    }
    hinged = any(len(row) > 1 and any(dof.is_passive for dof in row) for row in turns.values())
    if not hinged or any(spring.law for spring in springs):
        return list(springs)
    lone = {dof.name for row in turns.values() for dof in row}
    lost = [spring.name for spring in springs if spring.coordinate in lone]
    if lost:
        what = "damping that is not of each angle, of joints whose other springs are not read"
        losses.add(what, *lost)
    return [spring for spring in springs if spring.coordinate not in lone]


def _set_objects(model: XmlElement, name: str) -> Iterator[XmlElement]:
    """The elements of a set of the model."""
    for each in model.find_all(name):
        objects = each.find("objects")
        yield from () if objects is None else objects.children


def _followed(model: XmlElement) -> Followed:
    """Return the coordinates that axes may follow; what is wrong with them is reported later."""
    found: dict[str, tuple[str, FollowerCurve]] = {}
    moving: set[str] = set()
    with model.diagnostics.muted():
        for joint in _set_objects(model, "JointSet"):
            row = parse_joint(joint, Losses(""), Followed())
            moving |= {dof.name for dof in row.dofs}
        for constraint in _set_objects(model, "ConstraintSet"):
            coupling = _coupling(constraint)
            if coupling is not None:
                found[constraint.child_text("dependent_coordinate_name")] = coupling
    free = frozenset(moving - found.keys())
    coupled = {name: one for name, one in found.items() if one[0] in free}
    return Followed(free | (found.keys() & moving) - coupled.keys(), coupled)


def _coupling(constraint: XmlElement) -> tuple[str, FollowerCurve] | None:
    """Return what a coordinate follows by a constraint; None for another one."""
    names = constraint.child_text("independent_coordinate_names").split()
    function = next((one for one in constraint.walk() if one.tag in FUNCTION_TAGS), None)
    is_idle = constraint.is_child("isEnforced", "false")
    if constraint.tag != COUPLER or len(names) != 1 or function is None or is_idle:
        return None
    curve = parse_curve(function)
    has_scale = constraint.find("scale_factor") is not None
    scale = constraint.child_number("scale_factor") if has_scale else 1.0
    return (names[0], curve.scaled(scale)) if isinstance(curve, FollowerCurve) else None


@dataclass(frozen=True)
class _BodyJoint:
    """A joint between two bodies, from `inboard` to `outboard`.

    `pose` is that of the outboard body in the inboard one at zero displacements; `dofs` are in the
    outboard body.
    """

    joint: XmlElement
    inboard: str
    outboard: str
    pose: Array
    dofs: tuple[DegreeOfFreedom, ...]

    @property
    def flipped(self) -> "_BodyJoint":
        """The same joint seen from its other end."""
        freedoms = tuple(freedom.in_frame(self.pose).flipped for freedom in reversed(self.dofs))
        return _BodyJoint(
            self.joint, self.outboard, self.inboard, inverse_pose(self.pose), freedoms
        )


def _links(
    frames: FrameIndex, element: XmlElement, losses: Losses, followed: Followed
) -> Iterator[_BodyJoint]:
    """The joints of a model."""
    for joint in _set_objects(element, "JointSet"):
        parent, child = (
            frames.resolve(joint, f"socket_{end}_frame") for end in ("parent", "child")
        )
        row = parse_joint(joint, losses, followed)
        if parent is None or child is None:
            continue
        (base, base_pose), (tip, tip_pose) = parent, child
        if base == tip:
            joint.error(
                f"the joint `{shorten(joint.get('name') or joint.tag)}` joins `{shorten(base)}` to "
                "itself",
                "a joint connects two bodies",
            )
            continue
        pose = base_pose @ row.pose @ inverse_pose(tip_pose)
        moved = tuple(freedom.in_frame(tip_pose) for freedom in row.dofs)
        yield _BodyJoint(joint, base, tip, pose, moved)


def _build_bodies(body_joints: Iterable[_BodyJoint], known: Mapping[str, XmlElement]) -> list[Body]:
    """The bodies, each parent before its children, from the ground whichever end is called so."""
    from_base: dict[str, list[_BodyJoint]] = {}
    for link in body_joints:
        from_base.setdefault(link.inboard, []).append(link)
        from_base.setdefault(link.outboard, []).append(link.flipped)
    bodies: dict[str, Body] = {}
    used, waiting = set[int](), deque([GROUND])
    while waiting:
        base = waiting.popleft()
        for link in from_base.get(base, ()):
            if id(link.joint) in used:
                continue
            used.add(id(link.joint))
            name = link.joint.label
            if link.outboard in bodies or link.outboard == GROUND:
                link.joint.error(
                    f"the joint `{shorten(name)}` closes a loop, and only trees are read",
                    "let a constraint close it",
                )
                continue
            body = known.get(link.outboard)
            if body is None:
                link.joint.error(f"the body `{shorten(link.outboard)}` is not in the `BodySet`")
                continue
            mass, loose = _mass(body) or (None, np.zeros((3, 3)))
            bodies[link.outboard] = Body(
                link.outboard,
                None if base == GROUND else base,
                link.pose,
                link.dofs,
                mass,
                span=body.span_of("name"),
                joint=name,
                extra_inertia=loose,
            )
            waiting.append(link.outboard)
    for name, body in known.items():
        if name not in bodies and not body.diagnostics.has_errors:
            body.error(
                f"no joints lead from the ground to the body `{shorten(name)}`",
                "bodies that fly have a `FreeJoint`",
                "name",
            )
    return list(bodies.values())


def _mass(body: XmlElement) -> tuple[MassProperties | None, Array] | None:
    """The mass properties of a body, and loose inertia; None without any."""
    (mass,) = body.child_numbers("mass", (0.0,))
    if mass == 0.0:
        return None
    centre = np.array(body.child_numbers("mass_center", (0.0, 0.0, 0.0)))
    tensor = inertia_tensor(body.child_numbers("inertia", (0.0,) * 6))
    try:
        return split_extra_inertia(mass, centre, tensor, np.eye(4))
    except ValueError as failure:
        (body.find("mass") or body).error(str(failure))
        return None


def _add_markers(frames: FrameIndex, element: XmlElement, bodies: list[Body]) -> dict[str, Array]:
    """Add markers to their bodies as sites; return those of the ground."""
    grounded: dict[str, Array] = {}
    places = {body.name: k for k, body in enumerate(bodies)}
    for marker in _set_objects(element, "MarkerSet"):
        frame = frames.resolve(marker, "socket_parent_frame")
        if frame is None:
            continue
        name, pose = frame
        at = np.array(marker.child_numbers("location", (0.0, 0.0, 0.0)))
        site = {marker.get("name") or "marker": pose @ pose_matrix(np.eye(3), at)}
        if name == GROUND:
            grounded |= site
        elif name in places:
            body = bodies[places[name]]
            bodies[places[name]] = replace(body, sites={**body.sites, **site})
    for k, body in enumerate(bodies):
        bodies[k] = replace(body, sites=own_site_names(body.name, body.sites))
    return grounded


def _add_part_losses(model: XmlElement, losses: Losses, followed: Followed) -> None:
    """Report the parts that a figure does not have."""
    for section in model.children:
        if section.tag in _LOST:
            objects = section.find("objects") or section
            for part in objects.children:
                coupled = part.child_text("dependent_coordinate_name") in followed.coupled
                if part.tag not in ("objects", "groups") and not coupled:
                    losses.add(_LOST[section.tag], part.label)
    for body in (*_set_objects(model, "BodySet"), *model.find_all("Ground")):
        for part in body.walk():
            if part.tag.startswith("Wrap") and part.get("name") and part.tag != "WrapObjectSet":
                losses.add_description("wrapping surfaces of muscles", part.label)
