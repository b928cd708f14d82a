"""OpenSim's own format (`.osim`), as version 4 reads it.

Every displacement of the figure is a coordinate of its own name, value and sign, so that a motion
in `.mot` or `.sto` plays on the model as it is. So a joint of three turns is a CustomJoint about
the axes of its chain: the coordinates of a BallJoint are angles about x, y and z of its frame, in
this order, which the chain of hardly any joint is. A hinge is a PinJoint, a slide a SliderJoint.

A joint's parent and child stand as the figure connects them: OpenSim turns round what leads to the
ground. What closes a loop is a constraint.
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
    loop_closures,
)
from generator.model_files.model_files import ModelFiles
from generator.model_files.opensim.forces import ForceWriter
from generator.model_files.xml import (
    Element,
    add_element,
    body_fixed_angles,
    format_document,
    format_numbers,
)
from generator.names import plain_names, renaming_loss, reserve_name
from generator.rotations import Array, pose_matrix, rotation_with_z_axis, unit_vector
from springs import SpringSet

VERSION = "40000"

GRAVITY = (0.0, -9.81, 0.0)


def format_files(figure: Figure, springs: SpringSet, path: Path) -> ModelFiles:
    """Format a figure and its springs as the OpenSim model at `path`.

    Raises InputError for a segment that moves without a mass, an inertia or a centre of mass.
    """
    text, losses = format_osim(figure, springs)
    return ModelFiles(path, {path: text}, losses)


def format_osim(figure: Figure, springs: SpringSet) -> tuple[str, Losses]:
    """The text of an OpenSim model, and its losses; raises InputError as `format_files`."""
    losses = Losses("OpenSim model")
    model = build_export_model(figure, losses)
    root = Element("OpenSimDocument", Version=VERSION)
    top = add_element(root, "Model", name=figure.name or "figure")
    add_element(top, "gravity", format_numbers(GRAVITY))
    ground = add_element(add_element(top, "Ground", name="ground"), "components")
    bodies, joints, constraints, forces = (
        add_element(add_element(top, f"{kind}Set", name=f"{kind.lower()}set"), "objects")
        for kind in ("Body", "Joint", "Constraint", "Force")
    )
    frames = _add_bodies(model, ground, bodies, losses)
    builder = _JointWriter(model, frames, bodies, joints)
    moving = {branch.joint.name for branch in model.tree.joints}
    for name, joint in figure.joints.items():
        if name in moving:
            builder.add_joint(joint)
    _add_loops(model, frames, constraints, losses)
    force_writer = ForceWriter(model, builder.coordinate_paths, forces)
    force_writer.add_springs(springs)
    force_writer.add_loads()
    add_common_losses(model, springs, losses, has_coupled=True)
    surfaces = [name for name, one in figure.segments.items() if one.psurf is not None]
    if surfaces:
        losses.add("psurfs", *surfaces)
    if figure.attributes:
        losses.add("attributes", *figure.attributes)
    embed(root, figure, springs)
    return format_document(root, _COMMENTS), losses


_COMMENTS = ("Units are metres, kilograms, seconds and radians; y is up.",)


def _add_bodies(
    model: ExportModel, ground: Element, bodies: Element, losses: Losses
) -> Mapping[SiteRef, str]:
    """Bodies with their sites as frames; returns the path of each site."""
    figure = model.figure
    refs = [SiteRef(name, site) for name, one in figure.segments.items() for site in one.sites]
    ground_names = plain_names(str(ref) for ref in refs if ref.segment in figure.ground)
    paths: dict[SiteRef, str] = {}
    for name, segment in figure.segments.items():
        body = model.segments[name]
        if name in figure.ground:
            place, path, pose = ground, "/ground", model.placement.poses[name]
            names = {site: ground_names[str(SiteRef(name, site))] for site in segment.sites}
        else:
            place = add_element(_add_body(bodies, body, segment), "components")
            path, pose = f"/bodyset/{body}", np.eye(4)
            names = plain_names(segment.sites)
            losses.add_loss(renaming_loss(names))
        for site, own in names.items():
            _add_frame(place, own, "..", pose @ segment.sites[site].pose_in_segment)
            paths[SiteRef(name, site)] = f"{path}/{own}"
    return paths


def _add_body(bodies: Element, name: str, segment: Segment | None) -> Element:
    """A body; without a segment one that has no mass."""
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


def _add_frame(place: Element, name: str, parent: str, pose: Array) -> None:
    frame = add_element(place, "PhysicalOffsetFrame", name=name)
    add_element(frame, "socket_parent", parent)
    add_element(frame, "translation", format_numbers(pose[:3, 3]))
    add_element(frame, "orientation", format_numbers(body_fixed_angles(pose[:3, :3])))


@dataclass(frozen=True)
class _CoordinateAxis:
    """A coordinate: the axis that it turns about or slides along, and its start."""

    name: str
    kind: str
    axis: Array
    value: float
    limits: tuple[float, float] | None


class _JointWriter:
    """The joints, as they are declared.

    Attributes:
        coordinate_paths: by the name of the coordinate.
    """

    def __init__(
        self, model: ExportModel, frames: Mapping[SiteRef, str], bodies: Element, joints: Element
    ) -> None:
        self._model, self._frames = model, frames
        self._bodies, self._joints = bodies, joints
        self.coordinate_paths: dict[str, str] = {}
        self._body_names = set(model.segments.values())
        self._joint_names = set(model.joints.values())

    def add_joint(self, joint: Joint) -> None:
        """A joint; one whose first and last axis are along one line is two, with a body between.

        Slides come first, as they do in a CustomJoint: where they are along axes of the child, the
        parent moves in the child's frame, the other way round.
        """
        name, chain = self._model.joints[joint.name], self._model.tree.chains[joint.name]
        parent, child = (self._frames[ref] for ref in joint.ends)
        outside = chain.translations_are_outer
        sign = 1.0 if outside else -1.0
        places = [*chain.translations, *(chain.rotations[::-1] if outside else chain.rotations)]
        freedoms = [self._coordinate_axis(joint, k, sign) for k in places]
        if not outside:
            parent, child = child, parent
        turns = [freedom.axis for freedom in freedoms if freedom.kind is AxisKind.ROTATION]
        if len(turns) == 3 and np.linalg.norm(np.cross(turns[0], turns[2])) < _MAX_COLLINEAR_SINE:
            between = reserve_name(f"{name}_between", self._body_names)
            _add_body(self._bodies, between, None)
            outer = reserve_name(f"{name}_outer", self._joint_names)
            self._add_joint_element(outer, parent, f"/bodyset/{between}", freedoms[:-1])
            parent, freedoms = f"/bodyset/{between}", freedoms[-1:]
        self._add_joint_element(name, parent, child, freedoms)

    def _coordinate_axis(self, joint: Joint, index: int, sign: float) -> _CoordinateAxis:
        factor = joint.chain[index]
        limits = None
        if len(joint.chain) == 1 or factor.kind is not AxisKind.ROTATION:
            lower, upper = joint.lower_limit, joint.upper_limit
            if lower is not None and upper is not None:
                limits = (lower[index], upper[index])
        value = float(self._model.placement.displacements[joint.name][index])
        name = self._model.coordinates[joint.name][index]
        return _CoordinateAxis(name, factor.kind, sign * unit_vector(factor.axis), value, limits)

    def _add_joint_element(
        self, name: str, parent: str, child: str, coordinate_axes: Sequence[_CoordinateAxis]
    ) -> None:
        kinds = [freedom.kind for freedom in coordinate_axes]
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
        if coordinate_axes:
            _add_coordinates(element, coordinate_axes)
            for one in coordinate_axes:
                self.coordinate_paths[one.name] = f"/jointset/{name}/{one.name}"
        if turned is not None:
            frames = add_element(element, "frames")
            pose = pose_matrix(
                rotation_with_z_axis(coordinate_axes[0].axis)[:, turned], np.zeros(3)
            )
            _add_frame(frames, "parent", parent, pose)
            _add_frame(frames, "child", child, pose)
        if tag == "CustomJoint":
            _add_transform(element, coordinate_axes)


_MAX_COLLINEAR_SINE = 1e-6
"""OpenSim takes no three axes of which two are along one line: sine of the angle between them."""

_FRAME_COLUMNS = {"PinJoint": [0, 1, 2], "SliderJoint": [2, 0, 1]}
"""Columns of a frame with the axis as its z that are x, y, z of the joint's frames: a PinJoint
rotates about z, a SliderJoint translates along x."""


def _add_coordinates(joint: Element, coordinate_axes: Sequence[_CoordinateAxis]) -> None:
    coordinates = add_element(joint, "coordinates")
    # A CustomJoint counts its coordinates in the order in which its axes name them.
    for freedom in sorted(coordinate_axes, key=lambda freedom: freedom.kind):
        coordinate = add_element(coordinates, "Coordinate", name=freedom.name)
        add_element(coordinate, "default_value", format_numbers(freedom.value))
        limits = freedom.limits or ((-np.pi, np.pi) if freedom.kind is AxisKind.ROTATION else None)
        if limits is not None:
            add_element(coordinate, "range", format_numbers(limits))


def _add_transform(joint: Element, coordinate_axes: Sequence[_CoordinateAxis]) -> None:
    """The axes of a CustomJoint: three to turn about, three to slide along, some of them unused."""
    transform = add_element(joint, "SpatialTransform")
    for kind, word in ((AxisKind.ROTATION, "rotation"), (AxisKind.TRANSLATION, "translation")):
        used = [freedom for freedom in coordinate_axes if freedom.kind is kind]
        axes = [freedom.axis for freedom in used] + _complementary_axes(
            [freedom.axis for freedom in used]
        )
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
    """Axes that make three independent ones of those given."""
    if len(axes) == 3:
        return []
    if not axes:
        return list(np.eye(3))
    if len(axes) == 2:
        return [unit_vector(np.cross(axes[0], axes[1]))]
    frame = rotation_with_z_axis(axes[0])
    return [frame[:, 0], frame[:, 1]]


def _add_loops(
    model: ExportModel, frames: Mapping[SiteRef, str], constraints: Element, losses: Losses
) -> None:
    """Add the joints that close loops as constraints.

    OpenSim would split a body of such a joint in halves, and the motion would be wrong.
    """
    figure = model.figure
    for loop in loop_closures(model, losses):
        name = model.joints[loop.joint.name]
        if not loop.points:
            weld = add_element(constraints, "WeldConstraint", name=name)
            for number, ref in enumerate(loop.joint.ends, 1):
                add_element(weld, f"socket_frame{number}", frames[ref])
        for count, point in enumerate(loop.points, 1):
            constraint = add_element(constraints, "PointConstraint", name=f"{name}_{count}")
            for number, ref in enumerate(loop.joint.ends, 1):
                pose, body = model.site(ref), f"/bodyset/{model.segments[ref.segment]}"
                if ref.segment in figure.ground:
                    pose, body = model.placement.poses[ref.segment] @ pose, "/ground"
                add_element(constraint, f"socket_body_{number}", body)
                place = pose @ [*point, 1.0]
                add_element(constraint, f"location_body_{number}", format_numbers(place[:3]))
        if loop.joint.chain:
            losses.add(
                "displacements of joints that close loops, which do not become coordinates",
                loop.joint.name,
            )
