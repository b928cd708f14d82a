"""OpenSim's own format (`.osim`), as version 4 reads it.

Every displacement of the figure is a coordinate with the same name, value and sign, so that a
motion in `.mot` or `.sto` plays on the model as it is. Therefore a joint of three rotations is a
CustomJoint about the axes of its chain: the coordinates of a BallJoint are angles about x, y and z
of its frame, in this order. A revolute is a PinJoint, a prismatic joint a SliderJoint.

A joint has the parent and the child that the figure gives it; OpenSim itself reverses joints whose
child is nearer to the ground. Joints that close loops are constraints.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from generator.figure import AxisKind, Figure, Joint, Segment, SiteRef
from generator.losses import Losses
from generator.model_files.embedded import embed
from generator.model_files.export_model import (
    ExportModel,
    add_common_losses,
    build_export_model,
)
from generator.model_files.fit_error import joint_limits, normal_ends
from generator.model_files.model_files import MeshFile, ModelFiles, segment_meshes
from generator.model_files.opensim.forces import ForceWriter
from generator.model_files.opensim.loops import LoopWriter, add_frame
from generator.model_files.xml import (
    Element,
    add_element,
    format_document,
    format_numbers,
)
from generator.names import plain_names, renaming_loss, reserve_name
from generator.rotations import Array, pose_matrix, rotation_with_z_axis, unit_vector
from springs import JointSprings, SpringSet
from springs.elastic import Range

VERSION = "40000"

GRAVITY = (0.0, -9.81, 0.0)


def format_files(figure: Figure, springs: SpringSet, path: Path) -> ModelFiles:
    """Format a figure and its springs as the OpenSim model at `path`, with its meshes.

    Raises InputError for a segment that moves without a mass, an inertia or a centre of mass.
    """
    meshes, mesh_losses = segment_meshes(figure, plain_names(figure.segments), path)
    text, losses = format_osim(figure, springs, meshes)
    for loss in mesh_losses:
        losses.add_loss(loss)
    contents: dict[Path, str | bytes] = {mesh.path: mesh.content for mesh in meshes.values()}
    return ModelFiles(path, contents | {path: text}, losses)


def format_osim(
    figure: Figure, springs: SpringSet, meshes: Mapping[str, MeshFile] | None = None
) -> tuple[str, Losses]:
    """Return the text of an OpenSim model, and its losses; raises InputError as `format_files`.

    Args:
        figure: the figure.
        springs: of its joints.
        meshes: by segment; None for a model without meshes.
    """
    losses = Losses("OpenSim model")
    model = build_export_model(figure, losses)
    root = Element("OpenSimDocument", Version=VERSION)
    top = add_element(root, "Model", name=figure.name or "figure")
    if springs.references:
        add_element(top, "publications", "; ".join(springs.references))
    add_element(top, "gravity", format_numbers(GRAVITY))
    ground = add_element(add_element(top, "Ground", name="ground"), "components")
    bodies, joints, constraints, forces, markers = (
        add_element(add_element(top, f"{kind}Set", name=f"{kind.lower()}set"), "objects")
        for kind in ("Body", "Joint", "Constraint", "Force", "Marker")
    )
    frames = _add_bodies(model, ground, bodies, meshes or {}, losses)
    _add_markers(model, markers)
    builder = _JointWriter(model, springs, frames, bodies, joints)
    moving = {branch.joint.name for branch in model.tree.joints}
    for name, joint in figure.joints.items():
        if name in moving:
            builder.add_joint(joint)
    singular = [name for name in figure.joints if name in moving and _is_singular(model, name)]
    if singular:
        losses.add("joints at a singularity of their angles, which OpenSim cannot leave", *singular)
    force_writer = ForceWriter(model, builder.coordinate_paths, forces)
    force_writer.add_springs(springs)
    force_writer.add_loads()
    loops = LoopWriter(model, frames, losses)
    loops.add_constraints(constraints)
    loops.add_springs(springs, force_writer)
    add_common_losses(model, springs, losses, has_references=True, has_coupled=True, has_loops=True)
    others = [name for name, one in figure.attributes.items() if set(one.fields) != {"rgb"}]
    if others:
        losses.add("attributes other than a colour", *others)
    embed(root, figure, springs)
    return format_document(root, _COMMENTS), losses


_COMMENTS = ("Units are metres, kilograms, seconds and radians; y is up.",)


def _add_bodies(
    model: ExportModel,
    ground: Element,
    bodies: Element,
    meshes: Mapping[str, MeshFile],
    losses: Losses,
) -> Mapping[SiteRef, str]:
    """Add the bodies with their meshes and their sites as frames; return the path of each site."""
    figure = model.figure
    refs = [SiteRef(name, site) for name, one in figure.segments.items() for site in one.sites]
    ground_names = plain_names(str(ref) for ref in refs if ref.segment in figure.ground)
    taken = set(ground_names.values())
    paths: dict[SiteRef, str] = {}
    for name, segment in figure.segments.items():
        body = model.segments[name]
        if name in figure.ground:
            place, path, pose = ground, "/ground", model.placement.poses[name]
            names = {site: ground_names[str(SiteRef(name, site))] for site in segment.sites}
            if name in meshes:
                frame = add_frame(place, reserve_name(f"{body}_frame", taken), "..", pose)
                _add_mesh(frame, f"{body}_mesh", meshes[name])
        else:
            names = plain_names(segment.sites)
            element = _add_body(bodies, body, segment)
            if name in meshes:
                label = reserve_name(f"{body}_mesh", set(names.values()))
                _add_mesh(element, label, meshes[name])
            place = add_element(element, "components")
            path, pose = f"/bodyset/{body}", np.eye(4)
            losses.add_loss(renaming_loss(names))
        for site, own in names.items():
            add_frame(place, own, "..", pose @ segment.sites[site].pose_in_segment)
            paths[SiteRef(name, site)] = f"{path}/{own}"
    return paths


def _add_body(bodies: Element, name: str, segment: Segment | None) -> Element:
    """Add the body of a segment; without one, a body without mass."""
    body = add_element(bodies, "Body", name=name)
    moments = (0.0, 0.0, 0.0) if segment is None else segment.inertia
    centre = (0.0, 0.0, 0.0) if segment is None else segment.centre_of_mass
    mass = 0.0 if segment is None else segment.mass
    assert mass is not None
    assert moments is not None
    assert centre is not None
    add_element(body, "mass", format_numbers(mass))
    add_element(body, "mass_center", format_numbers(centre))
    add_element(body, "inertia", format_numbers([*moments, 0.0, 0.0, 0.0]))
    return body


def _add_mesh(frame: Element, name: str, mesh: MeshFile) -> None:
    """Attach a mesh to a body or a frame."""
    geometry = add_element(frame, "attached_geometry")
    element = add_element(geometry, "Mesh", name=name)
    add_element(element, "socket_frame", "..")
    add_element(add_element(element, "Appearance"), "color", format_numbers(mesh.colour))
    add_element(element, "mesh_file", mesh.reference)


def _add_markers(model: ExportModel, markers: Element) -> None:
    """Add a marker at each site, which has the name `SEGMENT.SITE`."""
    figure, taken = model.figure, set[str]()
    for name, segment in figure.segments.items():
        is_ground = name in figure.ground
        body, pose = f"/bodyset/{model.segments[name]}", np.eye(4)
        if is_ground:
            body, pose = "/ground", model.placement.poses[name]
        for site, own in plain_names(segment.sites).items():
            place = (pose @ segment.sites[site].pose_in_segment)[:3, 3]
            label = reserve_name(f"{model.segments[name]}.{own}", taken)
            marker = add_element(markers, "Marker", name=label)
            add_element(marker, "socket_parent_frame", body)
            add_element(marker, "location", format_numbers(place))
            add_element(marker, "fixed", "true")


@dataclass(frozen=True)
class _Coordinate:
    """A coordinate of a joint.

    Attributes:
        name: of the coordinate.
        kind: rotation or translation.
        axis: unit vector in the frame of the joint's parent, shape (3,).
        value: at the start [rad or m].
        limits: its range [rad or m].
    """

    name: str
    kind: str
    axis: Array
    value: float
    limits: Range | None


_MIN_TRIPLE_PRODUCT = 1e-3
"""Triple product of three axes of rotation below which the angles of a joint are singular."""


def _is_singular(model: ExportModel, joint: str) -> bool:
    """Return True for a joint whose three axes of rotation are in one plane at the start."""
    chain = model.tree.chains[joint]
    if len(chain.rotations) != 3:
        return False
    axes = chain.twists(model.placement.displacements[joint])[list(chain.rotations), :3]
    return abs(float(np.linalg.det(axes))) < _MIN_TRIPLE_PRODUCT


class _JointWriter:
    """The joints, in the order in which they are added.

    Attributes:
        coordinate_paths: by the name of the coordinate.
    """

    def __init__(
        self,
        model: ExportModel,
        springs: SpringSet,
        frames: Mapping[SiteRef, str],
        bodies: Element,
        joints: Element,
    ) -> None:
        self._model, self._frames = model, frames
        self._springs = springs.joints
        self._bodies, self._joints = bodies, joints
        self.coordinate_paths: dict[str, str] = {}
        self._body_names = set(model.segments.values())
        self._joint_names = set(model.joints.values())

    def add_joint(self, joint: Joint) -> None:
        """Add a joint; one whose first and last axis are collinear is two, with a body between.

        Translations come first, as in a CustomJoint: where they are along axes of the child, the
        parent moves in the child's frame, with the opposite sense.
        """
        name, chain = self._model.joints[joint.name], self._model.tree.chains[joint.name]
        parent, child = (self._frames[ref] for ref in joint.ends)
        outside = chain.translations_are_outer
        sign = 1.0 if outside else -1.0
        places = [*chain.translations, *(chain.rotations[::-1] if outside else chain.rotations)]
        coordinates = [self._coordinate(joint, k, sign) for k in places]
        if not outside:
            parent, child = child, parent
        turns = [one.axis for one in coordinates if one.kind is AxisKind.ROTATION]
        if len(turns) == 3 and np.linalg.norm(np.cross(turns[0], turns[2])) < _MAX_COLLINEAR_SINE:
            between = reserve_name(f"{name}_between", self._body_names)
            _add_body(self._bodies, between, None)
            outer = reserve_name(f"{name}_outer", self._joint_names)
            self._add_joint_element(outer, parent, f"/bodyset/{between}", coordinates[:-1])
            parent, coordinates = f"/bodyset/{between}", coordinates[-1:]
        self._add_joint_element(name, parent, child, coordinates)

    def _coordinate(self, joint: Joint, index: int, sign: float) -> _Coordinate:
        factor = joint.chain[index]
        value = float(self._model.placement.displacements[joint.name][index])
        name = self._model.coordinates[joint.name][index]
        springs = self._springs.get(joint.name, JointSprings(joint.name))
        ends = coordinate_range(joint, springs, index, value)
        return _Coordinate(name, factor.kind, sign * unit_vector(factor.axis), value, ends)

    def _add_joint_element(
        self, name: str, parent: str, child: str, coordinates: Sequence[_Coordinate]
    ) -> None:
        kinds = [one.kind for one in coordinates]
        match kinds:
            case []:
                tag = "WeldJoint"
            case [AxisKind.ROTATION]:
                tag = "PinJoint"
            case [AxisKind.TRANSLATION]:
                tag = "SliderJoint"
            case _:
                tag = "CustomJoint"
        element = add_element(self._joints, tag, name=name)
        turned = _FRAME_COLUMNS.get(tag)
        ends = (parent, child) if turned is None else ("parent", "child")
        for role, end in zip(("parent", "child"), ends, strict=True):
            add_element(element, f"socket_{role}_frame", end)
        if coordinates:
            _add_coordinates(element, coordinates)
            for one in coordinates:
                self.coordinate_paths[one.name] = f"/jointset/{name}/{one.name}"
        if turned is not None:
            frames = add_element(element, "frames")
            pose = pose_matrix(rotation_with_z_axis(coordinates[0].axis)[:, turned], np.zeros(3))
            add_frame(frames, "parent", parent, pose)
            add_frame(frames, "child", child, pose)
        if tag == "CustomJoint":
            _add_transform(element, coordinates)


_MAX_COLLINEAR_SINE = 1e-6
"""Largest sine of the angle between two axes that OpenSim refuses as collinear."""

_FRAME_COLUMNS = {"PinJoint": [0, 1, 2], "SliderJoint": [2, 0, 1]}
"""Columns of a frame with the axis as its z that are x, y, z of the joint's frames: a PinJoint
rotates about z, a SliderJoint translates along x."""


def coordinate_range(joint: Joint, springs: JointSprings, index: int, start: float) -> Range | None:
    """Return the range of a displacement [rad or m]; None for a translation without limits.

    An end is the joint's limit; else the end of the published normal range of motion, which the
    motion of the spring about this axis names; else half a turn. The range holds `start`.
    """
    ends = zip(joint_limits(joint, index), normal_ends(joint, springs, index), strict=True)
    low, high = (normal if limit is None else limit for limit, normal in ends)
    if joint.chain[index].kind is AxisKind.ROTATION:
        low, high = (-np.pi if low is None else low), (np.pi if high is None else high)
    return None if low is None or high is None else (min(low, start), max(high, start))


def _add_coordinates(joint: Element, coordinates: Sequence[_Coordinate]) -> None:
    parent = add_element(joint, "coordinates")
    # A CustomJoint counts its coordinates in the order in which its axes name them.
    for one in sorted(coordinates, key=lambda each: each.kind):
        coordinate = add_element(parent, "Coordinate", name=one.name)
        add_element(coordinate, "default_value", format_numbers(one.value))
        if one.limits is not None:
            add_element(coordinate, "range", format_numbers(one.limits))
        add_element(coordinate, "clamped", "false")


def _add_transform(joint: Element, coordinates: Sequence[_Coordinate]) -> None:
    """Add the axes of a CustomJoint: three of rotation and three of translation, some unused."""
    transform = add_element(joint, "SpatialTransform")
    for kind, word in ((AxisKind.ROTATION, "rotation"), (AxisKind.TRANSLATION, "translation")):
        used = [one for one in coordinates if one.kind is kind]
        axes = [one.axis for one in used]
        axes += _complementary_axes(axes)
        for k, axis in enumerate(axes):
            element = add_element(transform, "TransformAxis", name=f"{word}{k + 1}")
            add_element(element, "coordinates", used[k].name if k < len(used) else "")
            add_element(element, "axis", format_numbers(axis))
            if k < len(used):
                function = add_element(element, "LinearFunction", name="function")
                add_element(function, "coefficients", "1 0")
            else:
                add_element(add_element(element, "Constant", name="function"), "value", "0")


def _complementary_axes(axes: Sequence[Array]) -> list[Array]:
    """Return axes that complete fewer than three independent axes to three."""
    if len(axes) == 3:
        return []
    if not axes:
        return list(np.eye(3))
    if len(axes) == 2:
        return [unit_vector(np.cross(axes[0], axes[1]))]
    frame = rotation_with_z_axis(axes[0])
    return [frame[:, 0], frame[:, 1]]
