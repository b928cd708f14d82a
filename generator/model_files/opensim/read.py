"""Reader of OpenSim's models (`.osim`): their passive tree as a figure.

A socket names a frame by its path among the components of the model, either from the model
(`/bodyset/femur_r`) or from the component that has the socket (`..`, `hip_offset`).
"""

import subprocess
import sys
from collections import deque
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from generator.diagnostics import Diagnostics, InputError, error, shorten
from generator.figure import is_rotation
from generator.follower_curve import FollowerCurve
from generator.geometry.primitives import box, cylinder, ellipsoid, sphere
from generator.geometry.surface import Surface, join_surfaces
from generator.inertia import MassProperties
from generator.losses import Losses
from generator.model_files.body_tree.shapes import (
    MeshFiles,
    Shape,
    clipped_colour,
    folders_above,
    has_size,
    scaled,
)
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
from generator.model_files.model_files import Imported
from generator.model_files.opensim.frames import GROUND, FrameIndex
from generator.model_files.opensim.joints import (
    BALLS,
    FUNCTION_TAGS,
    Followed,
    parse_curve,
    parse_joint,
)
from generator.model_files.opensim.passive_forces import apply_bushings, apply_forces
from generator.model_files.opensim.reach_forces import find_reaches
from generator.model_files.opensim.rotation_springs import (
    RotationSpring,
    find_rotation_springs,
    with_rotation_springs,
)
from generator.model_files.opensim.write import coupled_elements
from generator.model_files.xml import XmlElement, parse_xml
from generator.rotations import Array, inverse_pose, pose_matrix
from generator.text_io import load_text
from springs import SphericalLaw

WHITE = (1.0, 1.0, 1.0)
"""Colour of a geometry without any."""

GEOMETRY_FOLDER = "Geometry"
"""Folder of mesh files: OpenSim looks for it beside a model, and repositories have one for all."""

_READ: Final = ("Mesh", "Brick", "Sphere", "Cylinder", "Ellipsoid")

_UNREAD: Final = ("Arrow", "Cone", "FrameGeometry", "LineGeometry", "Line", "Torus")
"""Geometry that is left out; frames and lines have no surface."""

_Z_ALONG_Y = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Rotation of a cylinder about z to one about y."""


@dataclass
class GeometryReader:
    """Reads the geometry of a model.

    Attributes:
        frames: frames of the model.
        directory: directory of the model's file.
        losses: collects what a figure does not hold.
    """

    frames: FrameIndex
    directory: Path
    losses: Losses
    _files: MeshFiles = field(init=False)

    def __post_init__(self) -> None:
        """Prepare the reading of mesh files."""
        self._files = MeshFiles(self.losses, {".vtp": read_vtp})

    def read(self, model: XmlElement) -> dict[str, tuple[Shape, ...]]:
        """Return the shapes of bodies and of the ground, by name."""
        shapes: dict[str, tuple[Shape, ...]] = {}
        for element, owner in _geometry(model):
            if element.tag in _UNREAD:
                if element.tag in ("Cone", "Torus"):
                    self.losses.add_description("cones and tori", element.label)
                continue
            appearance = element.find("Appearance")
            if appearance is not None and appearance.is_child("visible", "false"):
                continue
            frame = self.frames.resolve(element, "socket_frame", default=owner)
            surface = None if frame is None else self._surface(element)
            if frame is None or surface is None:
                continue
            body, pose = frame
            colour = WHITE
            if appearance is not None:
                parts = appearance.child_numbers("color", WHITE)
                colour = clipped_colour(parts)
            shape = Shape(surface.transformed(pose), colour)
            shapes[body] = (*shapes.get(body, ()), shape)
        return shapes

    def _surface(self, element: XmlElement) -> Surface | None:
        """Return the surface of a geometry in its frame."""
        surface = self._unscaled(element)
        if surface is None:
            return None
        factors = element.child_numbers("scale_factors", (1.0, 1.0, 1.0))
        if not all(factors):
            self.losses.add_description("shapes that are scaled to nothing", element.label)
            return None
        return scaled(surface, factors)

    def _unscaled(self, element: XmlElement) -> Surface | None:
        unit = (1.0, 1.0, 1.0)
        match element.tag:
            case "Mesh":
                name = element.child_text("mesh_file").replace("\\", "/")
                above = folders_above(self.directory)
                folders = (self.directory, *(folder / GEOMETRY_FOLDER for folder in above))
                return self._files.find(folders, name) if name else None
            case "Brick":
                sizes = element.child_numbers("half_lengths", unit)
                return box(*sizes) if self._have_size(element, *sizes) else None
            case "Ellipsoid":
                sizes = element.child_numbers("radii", unit)
                return ellipsoid(*sizes) if self._have_size(element, *sizes) else None
            case "Sphere":
                radius = element.child_number("radius")
                return sphere(radius) if self._have_size(element, radius) else None
            case _:
                radius = element.child_number("radius")
                half = element.child_number("half_height")
                if not self._have_size(element, radius, half):
                    return None
                upright = pose_matrix(_Z_ALONG_Y, np.zeros(3))
                return cylinder(radius, half).transformed(upright)

    def _have_size(self, element: XmlElement, *sizes: float) -> bool:
        name = element.label
        return has_size(element, name, sizes, self.losses)


def _geometry(model: XmlElement) -> Iterator[tuple[XmlElement, XmlElement]]:
    """Yield the geometry of a model, each with the frame in which it stands."""
    waiting = [(model, model)]
    while waiting:
        element, owner = waiting.pop()
        if element.tag in (*_READ, *_UNREAD):
            yield element, owner
        inner = element if element.tag in ("Body", "Ground", "PhysicalOffsetFrame") else owner
        waiting += [(child, inner) for child in reversed(element.children)]


def read_vtp(path: Path) -> Surface:
    """Read the polygons of a VTK file (`.vtp`) whose arrays are text.

    Raises InputError for another file.
    """
    unread = error(f"`{path}` cannot be read as vtp: its arrays are not text, or it is damaged")
    source, fault = load_text(path, str(path))
    root = None if fault is not None else parse_xml(source, Diagnostics())
    if root is None or root.tag != "VTKFile":
        raise InputError([unread])
    try:
        pieces = [_vtp_piece(piece) for piece in root.walk() if piece.tag == "Piece"]
    except (ValueError, KeyError, OverflowError):
        raise InputError([unread]) from None
    if not pieces:
        raise InputError([unread])
    return join_surfaces(pieces)


def _vtp_piece(piece: XmlElement) -> Surface:
    """Return the polygons of a part of a file. Raises ValueError, KeyError or OverflowError."""
    arrays = {
        (group.tag, array.get("Name") or ""): array
        for group in piece.children
        for array in group.find_all("DataArray")
    }
    points = [array for (group, _), array in arrays.items() if group == "Points"]
    if len(points) != 1:
        raise ValueError("a piece has one array of points")
    corners = _vtp_numbers(arrays["Polys", "connectivity"], np.int64)
    ends = _vtp_numbers(arrays["Polys", "offsets"], np.int64)
    starts = np.concatenate([[0], ends])
    return Surface(_vtp_numbers(points[0], np.float64).reshape(-1, 3), corners, starts)


def _vtp_numbers(array: XmlElement, kind: type[np.int64] | type[np.float64]) -> NDArray[Any]:
    """Return the numbers of an array. Raises ValueError or OverflowError for other contents."""
    if array.get("format") != "ascii":
        raise ValueError("this array is not text")
    return np.array(array.text.text.split(), dtype=kind)


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
    forces: list[XmlElement] = []
    for force in _set_objects(element, "ForceSet"):
        if force.is_child("appliesForce", "false"):
            losses.add("forces that are switched off", force.label)
        else:
            forces.append(force)
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


_SCRIPT = """
import sys
import opensim
opensim.Logger.setLevelString("off")
opensim.Model(sys.argv[1]).printToXML(sys.argv[2])
print(opensim.GetVersion().partition("-")[0])
"""

_TIME_LIMIT = 120.0
"""Longest time that OpenSim may take [s]; a model of 90 muscles takes 2 s."""


def upgraded_document(root: XmlElement, losses: Losses) -> XmlElement | None:
    """Return a document in the format of OpenSim 4; None, with an error, without OpenSim's package.

    It runs in a process of its own, in a folder of its own: it writes a log there, and may crash.

    Args:
        root: the element `OpenSimDocument` of the older format.
        losses: notes that the model was upgraded.
    """
    message = "this model was written by OpenSim 3 or older"
    if find_spec("opensim") is None:
        hint = "install OpenSim's package, which converts it (`pip install opensim`)"
        root.error(message, f"{hint}, or save it with OpenSim 4", "Version")
        return None
    with TemporaryDirectory() as name:
        folder = Path(name)
        model, written = folder / "older.osim", folder / "model.osim"
        source = root.span.source
        if source.path is None:
            model.write_text(source.text, encoding="utf-8")
        else:  # it may name other files beside it
            model = source.path.absolute()
        command = [sys.executable, "-c", _SCRIPT, str(model), str(written)]
        try:
            done = subprocess.run(
                command, cwd=folder, capture_output=True, timeout=_TIME_LIMIT, check=False
            )
            output = done.stderr.decode(errors="replace").strip().splitlines()
            reason = next((line for line in output if ": std::exception" in line), "")
            reason = reason.partition("what(): ")[2] or (output[-1] if output else "it crashed")
        except subprocess.TimeoutExpired:
            done, reason = None, f"it takes more than {_TIME_LIMIT:.0f} s"
        if done is None or done.returncode != 0 or not written.exists():
            root.error(f"{message}, and OpenSim cannot convert it", shorten(reason), "Version")
            return None
        upgraded, fault = load_text(written, f"{source.name} as OpenSim 4 writes it")
        version = done.stdout.decode(errors="replace").split()
    losses.add_description(
        f"older format: OpenSim {' '.join(version[-1:])} has converted the model first"
    )
    if fault is not None:
        what = f"{message}, and the converted one cannot be read: {fault.message}"
        root.error(what, at="Version")
        return None
    return parse_xml(upgraded, root.diagnostics)
