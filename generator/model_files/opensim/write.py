"""OpenSim's own format (`.osim`), as version 4 reads it.

Every displacement of the figure is a coordinate with the same name, value and sign, so that a
motion in `.mot` or `.sto` plays on the model as it is. Therefore a joint of three rotations is a
CustomJoint about the axes of its chain: the coordinates of a BallJoint are angles about x, y and z
of its frame, in this order. A revolute is a PinJoint, a prismatic joint a SliderJoint.

A joint has the parent and the child that the figure gives it; OpenSim itself reverses joints whose
child is nearer to the ground. Joints that close loops are constraints.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial, reduce
from operator import add
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from generator.figure import AxisKind, Figure, Joint, SiteRef, Vector, is_rotation
from generator.follower_curve import CurveKind, FollowerCurve
from generator.identifiers import plain_names, renaming_loss, reserve_name
from generator.input_files.coordinates import coordinates_of_figure, names_in_models
from generator.kinematics.free_root import FREE_SITE
from generator.losses import Losses
from generator.model import Model
from generator.model_files.coupled_laws import CoupledElements
from generator.model_files.embedded import embed
from generator.model_files.export_model import (
    ExportModel,
    JointLaws,
    Loop,
    add_common_losses,
    build_export_model,
    has_friction,
    loop_closures,
)
from generator.model_files.fit_error import joint_limits, normal_ends
from generator.model_files.model_files import MeshFile, ModelFiles, format_with_meshes
from generator.model_files.opensim.expression import (
    EXPRESSION_OPERATIONS,
    Expression,
    with_definitions,
)
from generator.model_files.opensim.forces import ForceWriter
from generator.model_files.opensim.rotation import RotationExpressions
from generator.model_files.xml import (
    Element,
    add_element,
    body_fixed_angles,
    format_document,
    format_numbers,
)
from generator.rotations import Array, pose_matrix, rotation_with_z_axis, unit_vector
from springs import AxisSpring, JointSprings, SphericalLaw, SpringSet, total_torque
from springs.elastic import Range

VERSION = "40000"

COUPLER = "CoordinateCouplerConstraint"

GRAVITY = (0.0, -9.81, 0.0)


def format_files(figure: Figure, springs: SpringSet, path: Path) -> ModelFiles:
    """Format a figure and its springs as the OpenSim model at `path`, with its meshes.

    Raises InputError for a segment that moves without a mass, an inertia or a centre of mass.
    """
    return format_with_meshes(figure, path, partial(format_osim, figure, springs))


def format_osim(
    figure: Figure, springs: SpringSet, meshes: Mapping[str, MeshFile] | None = None
) -> tuple[str, Losses]:
    """Return the text of an OpenSim model, and its losses; raises InputError as `format_files`.

    Args:
        figure: the figure.
        springs: springs of its joints.
        meshes: meshes by segment; None for a model without meshes.
    """
    losses = Losses("OpenSim model")
    model = build_export_model(figure, springs, losses)
    own_names = coordinates_of_figure(figure, has_all_joints=False)
    chains = {name: joint.chain for name, joint in figure.joints.items()}
    model = replace(model, coordinates=names_in_models(chains, own_names))
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
    builder = _JointWriter(model, frames, bodies, joints)
    moving = {branch.joint.name for branch in model.tree.joints}
    for name, joint in figure.joints.items():
        if name in moving:
            builder.add_joint(joint)
    singular = [name for name in figure.joints if name in moving and _is_singular(model, name)]
    if singular:
        losses.add("joints at a singularity of their angles, which OpenSim cannot leave", *singular)
    force_writer = ForceWriter(model, builder.coordinate_paths, forces)
    force_writer.add_springs()
    force_writer.add_loads()
    loops = _LoopWriter(model, frames, losses)
    loops.add_constraints(constraints)
    builder.add_couplings(constraints)
    loops.add_springs(force_writer)
    add_common_losses(
        model, losses, has_coupled=True, has_loops=True, has_reaches=True, has_followers=True
    )
    used = {name for names in model.coordinates.values() for name in names}
    if renamed := [name for name in own_names if name not in used]:
        what = "names of coordinates that are scaled, shifted or not plain: here they are JOINT_k"
        losses.add_description(what, *renamed)
    embed(root, figure, springs, own_names)
    return format_document(root, _COMMENTS), losses


def coupled_elements(model: Model) -> CoupledElements:
    """Return the laws over several joints of a model, each with its forces."""
    losses = Losses("")
    export = build_export_model(model.figure, model.springs, losses)
    frames = _add_bodies(export, Element("components"), Element("objects"), {}, losses)
    builder = _JointWriter(export, frames, Element("objects"), Element("objects"))
    for branch in export.tree.joints:
        builder.add_joint(branch.joint)
    writer = ForceWriter(export, builder.coordinate_paths, Element("objects"))
    writer.add_springs()
    return writer.coupled


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
                frame = _add_frame(place, reserve_name(f"{body}_frame", taken), "..", pose)
                _add_mesh(frame, f"{body}_mesh", meshes[name])
        else:
            names = plain_names(segment.sites)
            element = _add_body(bodies, body, model.mass_properties(name))
            if name in meshes:
                label = reserve_name(f"{body}_mesh", set(names.values()))
                _add_mesh(element, label, meshes[name])
            place = add_element(element, "components")
            path, pose = f"/bodyset/{body}", np.eye(4)
            written = {site: own for site, own in names.items() if site != FREE_SITE}
            losses.add_loss(renaming_loss(written))
        for site, own in names.items():
            _add_frame(place, own, "..", pose @ segment.sites[site].pose_in_segment)
            paths[SiteRef(name, site)] = f"{path}/{own}"
    return paths


def _add_body(
    bodies: Element,
    name: str,
    properties: tuple[float, ArrayLike, Vector] = (0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
) -> Element:
    """Add a body with a mass, its centre and its moments."""
    body = add_element(bodies, "Body", name=name)
    mass, centre, moments = properties
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
    taken = set[str]()
    for name, segment in model.figure.segments.items():
        for site, own in plain_names(segment.sites).items():
            body, pose = _body_and_pose(model, SiteRef(name, site))
            label = reserve_name(f"{model.segments[name]}.{own}", taken)
            marker = add_element(markers, "Marker", name=label)
            add_element(marker, "socket_parent_frame", body)
            add_element(marker, "location", format_numbers(pose[:3, 3]))
            add_element(marker, "fixed", "true")


def _body_and_pose(model: ExportModel, ref: SiteRef) -> tuple[str, Array]:
    """Return the path of a site's body, or of the ground, and its pose there, shape (4, 4)."""
    if ref.segment in model.figure.ground:
        return "/ground", model.placement.poses[ref.segment] @ model.site(ref)
    return f"/bodyset/{model.segments[ref.segment]}", model.site(ref)


@dataclass(frozen=True)
class _Coordinate:
    """A coordinate of a joint: `axis` is a unit vector in the frame of the joint's parent.

    With a curve the axis follows another coordinate, `name`, and is none of its own.
    """

    name: str
    kind: AxisKind
    axis: Array
    value: float
    limits: Range | None
    curve: FollowerCurve | None = None


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
    """The joints, in the order in which they are added, and the paths of their coordinates."""

    def __init__(
        self, model: ExportModel, frames: Mapping[SiteRef, str], bodies: Element, joints: Element
    ) -> None:
        self._model, self._frames = model, frames
        self._bodies, self._joints = bodies, joints
        self.coordinate_paths: dict[str, str] = {}
        self.coupled: dict[str, tuple[str, FollowerCurve]] = {}
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
        rotations = chain.rotations[::-1] if outside else chain.rotations
        places = [*chain.translations[::-1], *rotations]
        coordinates = [self._coordinate(joint, k, sign) for k in places]
        if not outside:
            parent, child = child, parent
        turns = [one.axis for one in coordinates if is_rotation(one.kind)]
        if len(turns) == 3 and np.linalg.norm(np.cross(turns[0], turns[2])) < _MAX_COLLINEAR_SINE:
            between = reserve_name(f"{name}_between", self._body_names)
            _add_body(self._bodies, between)
            outer = reserve_name(f"{name}_outer", self._joint_names)
            self._add_joint_element(outer, parent, f"/bodyset/{between}", coordinates[:-1])
            parent, coordinates = f"/bodyset/{between}", coordinates[-1:]
        self._add_joint_element(name, parent, child, coordinates)

    def _coordinate(self, joint: Joint, index: int, sign: float) -> _Coordinate:
        factor = joint.chain[index]
        value = float(self._model.placement.displacements[joint.name][index])
        name = self._model.coordinates[joint.name][index]
        springs = self._model.joint_springs(joint.name)
        ends, axis = coordinate_range(joint, springs, index, value), sign * unit_vector(factor.axis)
        follower = joint.followers[index] if joint.followers else None
        if follower is None:
            return _Coordinate(name, factor.kind, axis, value, ends)
        control = self._model.coordinates[follower.joint][follower.index]
        laws = self._model.laws(joint.name)
        is_resisted = index in laws.uncoupled or (is_rotation(factor.kind) and laws.combined)
        if follower.joint == joint.name and not is_resisted:
            return _Coordinate(control, factor.kind, axis, value, ends, follower.curve)
        self.coupled[name] = control, follower.curve
        return _Coordinate(name, factor.kind, axis, value, ends)

    def add_couplings(self, constraints: Element) -> None:
        """Add the constraints of coordinates that follow those of other joints, or have forces."""
        for name, (control, curve) in self.coupled.items():
            constraint = add_element(constraints, COUPLER, name=f"{name}_follows_{control}")
            add_element(constraint, "isEnforced", "true")
            function = add_element(constraint, "coupled_coordinates_function")
            _add_function(function, curve)
            add_element(constraint, "independent_coordinate_names", control)
            add_element(constraint, "dependent_coordinate_name", name)

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
                if one.curve is None:
                    self.coordinate_paths[one.name] = f"/jointset/{name}/{one.name}"
        if turned is not None:
            frames = add_element(element, "frames")
            pose = pose_matrix(rotation_with_z_axis(coordinates[0].axis)[:, turned], np.zeros(3))
            _add_frame(frames, "parent", parent, pose)
            _add_frame(frames, "child", child, pose)
        if tag == "CustomJoint":
            _add_transform(element, coordinates)


_MAX_COLLINEAR_SINE = 1e-6
"""Largest sine of the angle between two axes that OpenSim refuses as collinear."""

_Z_AS_X = [2, 0, 1]
"""Columns of a frame that are x, y and z of one with its z axis as x axis."""

_FRAME_COLUMNS = {"PinJoint": [0, 1, 2], "SliderJoint": _Z_AS_X}
"""Columns of a frame with the axis as its z that are x, y, z of the joint's frames: a PinJoint
rotates about z, a SliderJoint translates along x."""


def coordinate_range(joint: Joint, springs: JointSprings, index: int, start: float) -> Range | None:
    """Return the range of a displacement [rad or m]; None for a translation without limits.

    An end is the joint's limit; else the end of the published normal range of motion, which the
    motion of the spring about this axis names; else half a turn. The range holds `start`.
    """
    ends = zip(joint_limits(joint, index), normal_ends(joint, springs, index), strict=True)
    low, high = (normal if limit is None else limit for limit, normal in ends)
    if is_rotation(joint.chain[index].kind):
        low, high = (-np.pi if low is None else low), (np.pi if high is None else high)
    return None if low is None or high is None else (min(low, start), max(high, start))


def _add_coordinates(joint: Element, coordinates: Sequence[_Coordinate]) -> None:
    parent = add_element(joint, "coordinates")
    # A CustomJoint counts its coordinates in the order in which its axes name them.
    order = dict.fromkeys(one.name for one in sorted(coordinates, key=lambda each: each.kind))
    own = {one.name: one for one in coordinates if one.curve is None}
    for one in (own[name] for name in order):
        coordinate = add_element(parent, "Coordinate", name=one.name)
        add_element(coordinate, "default_value", format_numbers(one.value))
        if one.limits is not None:
            add_element(coordinate, "range", format_numbers(one.limits))
        add_element(coordinate, "clamped", "false")


def _add_transform(joint: Element, coordinates: Sequence[_Coordinate]) -> None:
    """Add the axes of a CustomJoint: three of rotation and three of translation, some unused."""
    transform = add_element(joint, "SpatialTransform")
    for word in ("rotation", "translation"):
        used = [one for one in coordinates if is_rotation(one.kind) == (word == "rotation")]
        axes = [one.axis for one in used]
        axes += _complementary_axes(axes)
        for k, axis in enumerate(axes):
            element = add_element(transform, "TransformAxis", name=f"{word}{k + 1}")
            add_element(element, "coordinates", used[k].name if k < len(used) else "")
            add_element(element, "axis", format_numbers(axis))
            curve = used[k].curve if k < len(used) else FollowerCurve.line(0.0, 0.0)
            _add_function(element, FollowerCurve.line(1.0, 0.0) if curve is None else curve)


def _add_function(place: Element, curve: FollowerCurve) -> None:
    """Add a curve as OpenSim's function."""
    numbers = curve.numbers
    if curve.kind is not CurveKind.POLYNOMIAL:
        function = add_element(place, "SimmSpline", name="function")
        add_element(function, "x", format_numbers(numbers[::2]))
        add_element(function, "y", format_numbers(numbers[1::2]))
    elif not any(numbers[1:]):
        function = add_element(place, "Constant", name="function")
        add_element(function, "value", format_numbers(numbers[0]))
    elif not any(numbers[2:]):
        function = add_element(place, "LinearFunction", name="function")
        add_element(function, "coefficients", format_numbers(numbers[1::-1]))
    else:
        function = add_element(place, "PolynomialFunction", name="function")
        add_element(function, "coefficients", format_numbers(numbers[::-1]))


def _complementary_axes(axes: Sequence[Array]) -> list[Array]:
    """Return axes that complete fewer than three independent axes to three."""
    match axes:
        case []:
            return list(np.eye(3))
        case [axis]:
            return list(rotation_with_z_axis(axis).T[:2])
        case [first, second]:
            return [unit_vector(np.cross(first, second))]
        case _:
            return []


def _add_frame(place: Element, name: str, parent: str, pose: Array) -> Element:
    """Add a frame that is fixed to another; `pose` is that in the other, shape (4, 4)."""
    frame = add_element(place, "PhysicalOffsetFrame", name=name)
    add_element(frame, "socket_parent", parent)
    add_element(frame, "translation", format_numbers(pose[:3, 3]))
    add_element(frame, "orientation", format_numbers(body_fixed_angles(pose[:3, :3])))
    return frame


_ANGLES = ("theta_z", "theta_y", "theta_x")
_X, _Y, _Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


class _LoopWriter:
    """Joints that close loops: constraints, and springs as bushings.

    OpenSim would split one body of such a joint in halves, and the motion would be wrong. A
    constraint has no coordinates, so that its spring is an ExpressionBasedBushingForce: moments
    conjugate to the angles about x, y and z of the child's frame in the parent's, in this order,
    each a function of all three.
    """

    def __init__(self, model: ExportModel, frames: Mapping[SiteRef, str], losses: Losses) -> None:
        """Prepare to add the loops of a model; `frames` are the paths of its sites."""
        self._model, self._frames, self._losses = model, frames, losses

    @cached_property
    def _loops(self) -> tuple[Loop, ...]:
        return tuple(loop_closures(self._model, self._losses))

    def add_constraints(self, constraints: Element) -> None:
        """Add the constraints that close the loops."""
        model = self._model
        for loop in self._loops:
            name = model.joints[loop.joint.name]
            if not loop.points:
                weld = add_element(constraints, "WeldConstraint", name=name)
                for number, ref in enumerate(loop.joint.ends, 1):
                    add_element(weld, f"socket_frame{number}", self._frames[ref])
            for count, point in enumerate(loop.points, 1):
                constraint = add_element(constraints, "PointConstraint", name=f"{name}_{count}")
                for number, ref in enumerate(loop.joint.ends, 1):
                    body, pose = _body_and_pose(model, ref)
                    add_element(constraint, f"socket_body_{number}", body)
                    place = pose @ [*point, 1.0]
                    add_element(constraint, f"location_body_{number}", format_numbers(place[:3]))
            if loop.joint.chain:
                self._losses.add(
                    "displacements of joints that close loops, which do not become coordinates",
                    loop.joint.name,
                )

    def add_springs(self, forces: ForceWriter) -> None:
        """Add the springs of the joints that are constraints; report the others."""
        model, closed = self._model, {loop.joint.name for loop in self._loops}
        for joint in model.tree.closures:
            if joint.name not in model.springs.joints:
                continue
            if joint.name not in closed:
                self._losses.add("springs of joints that close loops", joint.name)
                continue
            laws = model.laws(joint.name)
            for spring in laws.uncoupled.values():
                self._add_hinge_spring(joint, spring, forces)
            if laws.reach is not None:
                self._losses.add("the reach of limbs in joints that close loops", joint.name)
            if laws.combined:
                self._add_ball_spring(joint, laws, forces)

    def _add_bushing(self, joint: Joint, forces: ForceWriter) -> Element:
        name = f"{self._model.joints[joint.name]}_spring"
        return forces.add_force("ExpressionBasedBushingForce", name)

    def _add_hinge_spring(self, joint: Joint, spring: AxisSpring, forces: ForceWriter) -> None:
        """Add the spring of a revolute, about the x axis of frames along its axis."""
        if spring.damping.coulomb or has_friction(spring):
            self._losses.add("friction of joints that close loops", joint.name)
        bushing = self._add_bushing(joint, forces)
        add_element(bushing, "socket_frame1", "parent")
        add_element(bushing, "socket_frame2", "child")
        frames, axis = add_element(bushing, "frames"), np.array(joint.chain[0].axis)
        pose = pose_matrix(rotation_with_z_axis(axis)[:, _Z_AS_X], np.zeros(3))
        for name, ref in zip(("parent", "child"), joint.ends, strict=True):
            _add_frame(frames, name, self._frames[ref], pose)
        torque = total_torque(spring.elastic, Expression("theta_x"), EXPRESSION_OPERATIONS)
        add_element(bushing, "Mx_expression", (-1.0 * torque).text)
        damping = (spring.damping.viscous, 0.0, 0.0)
        add_element(bushing, "rotational_damping", format_numbers(damping))

    def _add_ball_spring(self, joint: Joint, laws: JointLaws, forces: ForceWriter) -> None:
        """Add a law of several rotations, without its damping."""
        springs, is_conservative = laws.combined, laws.law is SphericalLaw.CONSERVATIVE
        if laws.combined_resist or any(map(has_friction, springs)):
            self._losses.add(
                "damping and friction of several rotations in joints that close loops", joint.name
            )
        bushing = self._add_bushing(joint, forces)
        for number, ref in enumerate(joint.ends, 1):
            add_element(bushing, f"socket_frame{number}", self._frames[ref])
        rotation = RotationExpressions((_Z, _Y, _X), _ANGLES)
        torques: dict[str, Expression] = {}
        arguments: dict[str, Expression] = {}
        for number, spring in enumerate(springs, 1):
            x = Expression(f"x{number}")
            torque = total_torque(spring.elastic, x, EXPRESSION_OPERATIONS)
            if is_conservative:
                arguments[x.text] = rotation.component(spring.direction)
            else:
                arguments[x.text] = rotation.signed_angle(spring.direction)
                at_rest = float(total_torque(spring.elastic, 0.0))
                torque = at_rest + rotation.alignment(spring.direction) * (torque - at_rest)
            torques[f"t{number}"] = torque
        definitions = {**torques, **arguments, **rotation.definitions}
        slope = rotation.component_slope if is_conservative else rotation.turn_rate
        for k, angle in reversed(list(enumerate(_ANGLES))):
            terms = [
                Expression(name) * slope(spring.direction, k)
                for name, spring in zip(torques, springs, strict=True)
            ]
            moment = with_definitions(-1.0 * reduce(add, terms), definitions)
            add_element(bushing, f"M{angle[-1]}_expression", moment)
