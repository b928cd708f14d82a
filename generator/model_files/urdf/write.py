"""The format of robots (`.urdf`): links in a tree, joints of one freedom, no gravity and no start.

A joint of several freedoms is a row of joints of one, in the order of its chain, with links between
them that have no mass: the angles are the figure's displacements. The frame of a link is that in
which its joint moves it, so a segment whose site is not at its origin hangs by a fixed joint from a
link at the site.

The link `world` has z up and x ahead, as programs that read the format expect; the ground's
segments are turned in it, so that their frames and all further out are the figure's.
"""

from pathlib import Path
from typing import assert_never

import numpy as np

from generator.figure import AxisKind, Figure, Joint, Site
from generator.kinematics.tree import TreeJoint
from generator.losses import Losses
from generator.model_files.body_tree.tree import Y_UP_FROM_Z_UP
from generator.model_files.export_model import (
    ExportModel,
    JointLaws,
    add_common_losses,
    build_export_model,
    has_friction,
    split_joint_laws,
    tree_joint_springs,
)
from generator.model_files.model_files import ModelFiles
from generator.model_files.xml import (
    Element,
    add_element,
    format_document,
    format_numbers,
    roll_pitch_yaw,
)
from generator.names import reserve_name
from generator.rotations import Array, inverse_pose, pose_matrix, unit_vector
from springs import AxisSpring, JointSprings, SpringSet, Stop

NO_LIMIT = 1e9
"""Limit that the format requires and the figure does not have [N m, N, rad/s, m/s, m]."""


def format_files(figure: Figure, springs: SpringSet, path: Path) -> ModelFiles:
    """Format a figure as the URDF model at `path`.

    Raises InputError for a segment that moves without a mass, an inertia or a centre of mass.
    """
    text, losses = format_urdf(figure, springs)
    return ModelFiles(path, {path: text}, losses)


def format_urdf(figure: Figure, springs: SpringSet) -> tuple[str, Losses]:
    """The text of a URDF model, and its losses; raises InputError as `format_files`."""
    losses = Losses("URDF model")
    model = build_export_model(figure, losses)
    root = Element("robot", name=figure.name or "figure")
    _LinkWriter(model, springs, root, losses).add_links()
    _add_losses(model, springs, losses)
    return format_document(root, _COMMENTS), losses


_COMMENTS = (
    "Units are metres, kilograms, seconds and radians. The link `world` has z up, x ahead.",
    "Links between the joints of one joint of the figure have no mass.",
)


class _LinkWriter:
    """Links and joints, from the world outwards."""

    def __init__(
        self, model: ExportModel, springs: SpringSet, root: Element, losses: Losses
    ) -> None:
        self._model, self._root, self._losses = model, root, losses
        self._springs = dict(tree_joint_springs(model, springs))
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

    def _add_tree_joint(self, branch: TreeJoint) -> None:
        """Add the row of joints between a segment and its base."""
        model, joint = self._model, branch.joint
        ends = joint.ends if branch.parent_is_inboard else joint.ends[::-1]
        pose, tip = (model.site(ref) for ref in ends)
        rest = inverse_pose(tip)
        at_origin = np.array_equal(rest, np.eye(4))
        name, link = model.joints[joint.name], model.segments[branch.inboard]
        laws = split_joint_laws(model.tree.chains[joint.name], self._joint_springs(joint))
        count = len(joint.chain)
        # The outermost factor comes first; hung the other way round, that is the first, backwards.
        places = range(count)[::-1] if branch.parent_is_inboard else range(count)
        for place in places:
            last = at_origin and place == places[-1]
            below = (
                model.segments[branch.outboard]
                if last
                else reserve_name(f"{name}_link", self._links)
            )
            own = (
                name
                if count == 1
                else reserve_name(model.coordinates[joint.name][place], self._joints)
            )
            factor = joint.chain[place]
            spring = laws.uncoupled.get(place)
            element = self._add_joint(
                own, _joint_type(joint, place), link, self._add_link(below), pose
            )
            sign = 1.0 if branch.parent_is_inboard else -1.0
            add_element(element, "axis", xyz=format_numbers(sign * unit_vector(factor.axis)))
            _add_limits(element, joint, place)
            _add_friction(element, spring)
            link, pose = below, np.eye(4)
        if not (at_origin and count):
            fixed = name if not count else reserve_name(f"{name}_fixed", self._joints)
            self._add_joint(
                fixed, "fixed", link, self._add_link(model.segments[branch.outboard]), pose @ rest
            )
        self._add_inertia(branch.outboard)
        if count > 1:
            self._losses.add(
                "joints of several degrees of freedom: each is a row of single ones, with massless "
                "links between them",
                joint.name,
            )

    def _joint_springs(self, joint: Joint) -> JointSprings:
        return self._springs.get(joint.name, JointSprings(joint.name))

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
        segment = self._model.figure.segments[name]
        assert segment.mass is not None
        assert segment.inertia is not None
        assert segment.centre_of_mass is not None
        inertial = add_element(self._link_elements[self._model.segments[name]], "inertial")
        add_element(inertial, "origin", xyz=format_numbers(segment.centre_of_mass), rpy="0 0 0")
        add_element(inertial, "mass", value=format_numbers(segment.mass))
        moments = {
            f"i{axis}{axis}": format_numbers(m)
            for axis, m in zip("xyz", segment.inertia, strict=True)
        }
        add_element(inertial, "inertia", **moments, ixy="0", ixz="0", iyz="0")


def _limits(joint: Joint, index: int) -> tuple[float | None, float | None]:
    """The limits of one displacement; those of several turns are none of one turn."""
    kinds = [factor.kind for factor in joint.chain]
    if kinds[index] is AxisKind.ROTATION and kinds.count(AxisKind.ROTATION) > 1:
        return None, None
    lower, upper = joint.lower_limit, joint.upper_limit
    return None if lower is None else lower[index], None if upper is None else upper[index]


def _joint_type(joint: Joint, index: int) -> str:
    kind = joint.chain[index].kind
    match kind:
        case AxisKind.ROTATION:
            return "continuous" if _limits(joint, index) == (None, None) else "revolute"
        case AxisKind.TRANSLATION:
            return "prismatic"
        case _:
            assert_never(kind)


def _add_limits(element: Element, joint: Joint, index: int) -> None:
    """The range, where there is one; without effort and velocity no range can be written."""
    if element.get("type") == "continuous":
        return
    lower, upper = _limits(joint, index)
    ends = {
        "lower": format_numbers(-NO_LIMIT if lower is None else lower),
        "upper": format_numbers(NO_LIMIT if upper is None else upper),
    }
    add_element(
        element, "limit", **ends, effort=format_numbers(NO_LIMIT), velocity=format_numbers(NO_LIMIT)
    )


def _add_friction(element: Element, spring: AxisSpring | None) -> None:
    damping = None if spring is None else spring.damping
    if damping is not None and (damping.viscous or damping.coulomb):
        coefficients = {"damping": damping.viscous, "friction": damping.coulomb}
        add_element(
            element,
            "dynamics",
            **{key: format_numbers(value) for key, value in coefficients.items()},
        )


def _add_losses(model: ExportModel, springs: SpringSet, losses: Losses) -> None:
    """Report the parts that URDF cannot hold."""
    figure = model.figure
    losses.add("gravity: set it in the program that reads the file")
    for joint in model.tree.closures:
        losses.add("joints that close loops: the loops are open", joint.name)
    for name, own in tree_joint_springs(model, springs):
        laws = split_joint_laws(model.tree.chains[name], own)
        if _has_springs(figure.joints[name], laws):
            losses.add("springs", name)
        if any(has_friction(spring) for spring in (*own.axes, *own.translations)):
            losses.add("friction that depends on the angle", name)
        if any(spring.damping.coulomb for spring in laws.uncoupled.values()):
            losses.add("the rate at which Coulomb friction sets in", name)
        if any(axis.damping.viscous or axis.damping.coulomb for axis in laws.combined):
            losses.add("damping and friction of several rotations", name)
    for name, joint in figure.joints.items():
        if joint.lower_limit is None and joint.upper_limit is None:
            continue
        if model.tree.chains[name].rotations[1:]:
            losses.add("limits of several rotations", name)
        else:
            losses.add("how stops grow beyond limits: those of the file are hard", name)
    moved = [name for name, joint in figure.joints.items() if any(joint.displacement)]
    if moved:
        losses.add("the pose in which the figure is drawn: all displacements are 0", *moved)
    add_common_losses(model, springs, losses)
    for name, segment in figure.segments.items():
        if name not in figure.ground and any(_has_loads(site) for site in segment.sites.values()):
            losses.add("forces and moments at sites", name)
        if segment.psurf is not None:
            losses.add("psurfs", name)
    losses.add("sites, but for those of joints")
    if figure.attributes:
        losses.add("attributes", *figure.attributes)


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


def _has_loads(site: Site) -> bool:
    loads = (site.global_force, site.local_force, site.global_moment, site.local_moment)
    return any(any(load) for load in loads if load is not None)
