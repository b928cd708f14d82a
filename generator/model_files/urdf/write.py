"""The format of robots (`.urdf`): links in a tree, joints of one freedom, no gravity and no start.

Meshes of the segments are in a folder beside the file, and the springs in a table.

A joint of several freedoms is a row of joints of one, in the order of its chain, with links between
them that have no mass: the angles are the figure's displacements. The frame of a link is that in
which its joint moves it, so a segment whose site is not at its origin hangs by a fixed joint from a
link at the site.

The link `world` has z up and x ahead, as programs that read the format expect; the ground's
segments are turned in it, so that their frames and all further out are the figure's.
"""

from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np

from generator.figure import Figure, Joint, is_rotation
from generator.geometry.appearance import Colour
from generator.identifiers import reserve_name
from generator.joint_chain import Chain
from generator.kinematics.tree import TreeJoint
from generator.losses import Effect, Losses
from generator.model_files.body_tree.tree import Y_UP_FROM_Z_UP
from generator.model_files.curves_csv import FAST, with_curves
from generator.model_files.export_model import (
    ExportModel,
    JointLaws,
    add_common_losses,
    add_tree_losses,
    build_export_model,
    has_friction,
)
from generator.model_files.fit_error import Ends, joint_limits
from generator.model_files.model_files import MeshFile, ModelFiles, format_with_meshes
from generator.model_files.xml import (
    Element,
    add_element,
    format_document,
    format_numbers,
    roll_pitch_yaw,
)
from generator.rotations import Array, inverse_pose, pose_matrix, unit_vector
from springs import AxisSpring, SpringSet, Stop
from springs.elastic import total_friction

SPRINGS_LOSS = "springs, which are in the table beside the file"

NO_LIMIT = 1e9
"""Limit that the format requires and the figure does not have [N m, N, rad/s, m/s, m]."""

_FRICTION_TOLERANCE = 1e-9
"""Relative change of friction with the angle below which it is a number."""


def format_files(figure: Figure, springs: SpringSet, path: Path) -> ModelFiles:
    """Format a figure as the URDF model at `path`.

    Raises InputError for a segment that moves without a mass, an inertia or a centre of mass.
    """
    files = format_with_meshes(figure, path, partial(format_urdf, figure, springs))
    return with_curves(files, figure, springs)


def format_urdf(
    figure: Figure, springs: SpringSet, meshes: Mapping[str, MeshFile] | None = None
) -> tuple[str, Losses]:
    """The text of a URDF model, and its losses; raises InputError as `format_files`.

    Args:
        figure: the figure.
        springs: springs of its joints.
        meshes: visuals by segment; None for a model without.
    """
    losses = Losses("URDF model")
    model = build_export_model(figure, springs, losses)
    root = Element("robot", name=figure.name or "figure")
    materials = _add_materials(root, meshes or {})
    writer = _LinkWriter(model, root, losses)
    writer.add_links()
    for name, mesh in (meshes or {}).items():
        _add_visual(writer.link(name), mesh, materials[mesh.colour])
    _add_losses(model, losses)
    return format_document(root, _COMMENTS), losses


_COMMENTS = (
    "Units are metres, kilograms, seconds and radians. The link `world` has z up, x ahead.",
    "Links between the joints of one joint of the figure have no mass.",
)


def _add_materials(root: Element, meshes: Mapping[str, MeshFile]) -> dict[Colour, str]:
    """Add a material for each colour; return their names."""
    colours = dict.fromkeys(mesh.colour for mesh in meshes.values())
    names = {colour: f"colour_{k}" for k, colour in enumerate(colours, start=1)}
    for colour, name in names.items():
        material = add_element(root, "material", name=name)
        add_element(material, "color", rgba=f"{format_numbers(colour)} 1")
    return names


def _add_visual(link: Element, mesh: MeshFile, material: str) -> None:
    """Add the mesh of a segment, which is in the frame of the link."""
    visual = add_element(link, "visual")
    geometry = add_element(visual, "geometry")
    add_element(geometry, "mesh", filename=mesh.reference)
    add_element(visual, "material", name=material)


_FIXED_FOLLOWERS = (
    "curves by which displacements follow others: they are fixed where the others are 0"
)


class _LinkWriter:
    """Links and joints, from the world outwards."""

    def __init__(self, model: ExportModel, root: Element, losses: Losses) -> None:
        self._model, self._root, self._losses = model, root, losses
        self._links = set(model.segments.values())
        self._joints = {
            model.joints[name]
            for name, chain in model.tree.chains.items()
            if len(chain.joint_axes) < 2
        }
        self._link_elements: dict[str, Element] = {}

    def add_links(self) -> None:
        """All links, each base before its tip."""
        model = self._model
        world = self._add_link(reserve_name("world", self._links))
        upright = pose_matrix(Y_UP_FROM_Z_UP.T, np.zeros(3))
        for name in model.figure.ground:
            link = self._add_link(model.segments[name])
            fixed = reserve_name(f"{link}_fixed", self._joints)
            self._add_joint(fixed, "fixed", world, link, upright @ model.placement.poses[name])
        for branch in model.tree.joints:
            self._add_tree_joint(branch)

    def link(self, segment: str) -> Element:
        """The link of a segment."""
        return self._link_elements[self._model.segments[segment]]

    def _add_tree_joint(self, branch: TreeJoint) -> None:
        """Add the row of joints between a segment and its base."""
        model, joint = self._model, branch.joint
        pose, tip = model.branch_sites(branch)
        rest = inverse_pose(tip)
        at_origin = np.array_equal(rest, np.eye(4))
        name, link = model.joints[joint.name], model.segments[branch.inboard]
        laws = model.laws(joint.name)
        count = len(joint.chain)
        # The outermost factor comes first; hung the other way round, that is the first, backwards.
        places = range(count)[::-1] if branch.parent_is_inboard else range(count)
        for place in places:
            last = at_origin and place == places[-1]
            below, own = model.segments[branch.outboard], name
            if not last:
                below = reserve_name(f"{name}_link", self._links)
            if count > 1:
                own = reserve_name(model.coordinates[joint.name][place], self._joints)
            spring = laws.uncoupled.get(place)
            kind = _joint_type(joint, place, spring)
            follower = joint.followers[place] if joint.followers else None
            if follower is not None:
                step = Chain((joint.chain[place],)).pose([follower.curve.at(0.0)])
                pose = pose @ (step if branch.parent_is_inboard else inverse_pose(step))
                self._add_joint(own, "fixed", link, self._add_link(below), pose)
                self._losses.add(_FIXED_FOLLOWERS, f"{joint.name} {place + 1}")
                link, pose = below, np.eye(4)
                continue
            element = self._add_joint(own, kind, link, self._add_link(below), pose)
            sign = 1.0 if branch.parent_is_inboard else -1.0
            axis = sign * unit_vector(joint.chain[place].axis)
            add_element(element, "axis", xyz=format_numbers(axis))
            _add_limits(element, joint, place, spring)
            _add_friction(element, spring)
            link, pose = below, np.eye(4)
        if not (at_origin and count):
            fixed = name if not count else reserve_name(f"{name}_fixed", self._joints)
            last_link = self._add_link(model.segments[branch.outboard])
            self._add_joint(fixed, "fixed", link, last_link, pose @ rest)
        self._add_inertia(branch.outboard)
        if count > 1:
            self._losses.add(
                "joints of several degrees of freedom: each becomes a chain of single ones with "
                "massless links between them",
                joint.name,
            )

    def _add_link(self, name: str) -> str:
        self._link_elements[name] = add_element(self._root, "link", name=name)
        return name

    def _add_joint(self, name: str, kind: str, parent: str, child: str, pose: Array) -> Element:
        element = add_element(self._root, "joint", name=name, type=kind)
        add_element(element, "parent", link=parent)
        add_element(element, "child", link=child)
        turn = format_numbers(roll_pitch_yaw(pose[:3, :3]))
        add_element(element, "origin", xyz=format_numbers(pose[:3, 3]), rpy=turn)
        return element

    def _add_inertia(self, name: str) -> None:
        mass, centre, principal = self._model.mass_properties(name)
        inertial = add_element(self.link(name), "inertial")
        add_element(inertial, "origin", xyz=format_numbers(centre), rpy="0 0 0")
        add_element(inertial, "mass", value=format_numbers(mass))
        moments = {
            f"i{axis}{axis}": format_numbers(m) for axis, m in zip("xyz", principal, strict=True)
        }
        add_element(inertial, "inertia", **moments, ixy="0", ixz="0", iyz="0")


def _limits(joint: Joint, index: int, spring: AxisSpring | None = None) -> Ends:
    """The limits of one displacement, or its stops; those of several turns are none of one turn."""
    turns = [is_rotation(factor.kind) for factor in joint.chain]
    if turns[index] and sum(turns) > 1:
        return None, None
    if joint.lower_limit is None and joint.upper_limit is None:
        stops = [law for law in (spring.elastic if spring else ()) if isinstance(law, Stop)]
        return (stops[0].lower, stops[0].upper) if stops else (None, None)
    return joint_limits(joint, index)


def _joint_type(joint: Joint, index: int, spring: AxisSpring | None) -> str:
    if not is_rotation(joint.chain[index].kind):
        return "prismatic"
    return "continuous" if _limits(joint, index, spring) == (None, None) else "revolute"


def _add_limits(element: Element, joint: Joint, index: int, spring: AxisSpring | None) -> None:
    """The range, where there is one; without effort and velocity no range can be written."""
    if element.get("type") == "continuous":
        return
    lower, upper = _limits(joint, index, spring)
    ends = {
        "lower": format_numbers(-NO_LIMIT if lower is None else lower),
        "upper": format_numbers(NO_LIMIT if upper is None else upper),
    }
    add_element(
        element, "limit", **ends, effort=format_numbers(NO_LIMIT), velocity=format_numbers(NO_LIMIT)
    )


def _add_friction(element: Element, spring: AxisSpring | None) -> None:
    if spring is None:
        return
    viscous, dry = spring.damping.viscous, spring.damping.coulomb + (_own_friction(spring) or 0.0)
    if viscous or dry:
        numbers = {"damping": format_numbers(viscous), "friction": format_numbers(dry)}
        add_element(element, "dynamics", **numbers)


def _own_friction(spring: AxisSpring) -> float | None:
    """Friction of the laws of a spring [N m or N]; None where it depends on the angle."""
    angles = np.linspace(-np.pi, np.pi, 181)
    friction = total_friction(spring.elastic, angles, FAST)
    if friction is None:
        return 0.0
    sizes = -np.asarray(friction)
    mean = float(sizes.mean())
    is_constant = np.ptp(sizes) <= _FRICTION_TOLERANCE * np.abs(sizes).max()
    return mean if is_constant and mean >= 0.0 else None


def _add_losses(model: ExportModel, losses: Losses) -> None:
    """Report the parts that URDF cannot hold."""
    figure = model.figure
    losses.add("gravity: set it in the program that reads the file")
    for name in model.tree_springs:
        laws = model.laws(name)
        if _has_springs(figure.joints[name], laws):
            losses.add(SPRINGS_LOSS, name)
        alone = laws.uncoupled.values()
        if any(has_friction(spring) for spring in laws.combined) or any(
            _own_friction(spring) is None for spring in alone
        ):
            losses.add("friction that depends on the angle", name)
        if any(spring.damping.coulomb or has_friction(spring) for spring in alone):
            losses.add(
                "the rate at which Coulomb friction sets in", name, effect=Effect.APPROXIMATION
            )
        if laws.combined_resist:
            losses.add("damping and friction of several rotations", name)
    for name, joint in figure.joints.items():
        if joint.lower_limit is None and joint.upper_limit is None:
            continue
        if model.tree.chains[name].rotations[1:]:
            losses.add("limits of several rotations", name)
        else:
            losses.add("the stiffness of stops: the limits of the file are rigid", name)
    add_common_losses(model, losses, has_followers=True)
    add_tree_losses(model, losses)
    losses.add_description("sites other than those of joints")


def _has_springs(joint: Joint, laws: JointLaws) -> bool:
    """Return True if there are springs other than the stops at the joint's limits."""
    limited = joint.lower_limit is not None or joint.upper_limit is not None
    several = any(
        not (limited and isinstance(law, Stop)) for axis in laws.combined for law in axis.elastic
    )
    return several or any(
        not (isinstance(law, Stop) and (law.lower, law.upper) == _limits(joint, place))
        for place, spring in laws.uncoupled.items()
        for law in spring.elastic
    )
