"""A figure prepared for the writers of models.

It has a tree, closed loops and plain names; the springs of a joint as forces of single
displacements; the joints that close loops as point constraints.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from generator.contact.states import ContactModel
from generator.diagnostics import Diagnostic, InputError, error
from generator.figure import Figure, Joint, Segment, SiteRef, Vector
from generator.figure_file.resolve import origin_span
from generator.identifiers import coordinate_names, plain_names, renaming_loss
from generator.joint_chain import Chain
from generator.kinematics.links import figure_links
from generator.kinematics.loops import close_loops
from generator.kinematics.placement import Displacements, Placement, initial_displacements
from generator.kinematics.tree import Tree, TreeJoint, build_tree
from generator.loads import site_loads
from generator.losses import Losses
from generator.rotations import Array, unit_axis, unit_vector
from generator.springs_file.axes import parallel_sign
from springs import (
    AxisSpring,
    CoupledSpring,
    JointSprings,
    Reach,
    SphericalLaw,
    SpringSet,
    rotation_law,
)
from springs.coordinates import CoordinateLaw
from springs.elastic import Frictional
from springs.spherical import VectorLaw


@dataclass(frozen=True)
class Start:
    """Contact and rates of a figure at the start of a run.

    Attributes:
        contact: Props, contact spheres and laws of parts; None for a figure that touches nothing.
        rates: Rates of the displacements of each joint [rad/s or m/s].
        left_out: What else acts in the run, which no model has.
    """

    contact: ContactModel | None
    rates: Displacements
    left_out: tuple[str, ...] = ()


@dataclass(frozen=True)
class ExportModel:
    """A figure with springs that every other program can represent.

    Attributes:
        placement: the figure in the pose in which it is drawn, its loops closed.
        springs: springs of its joints.
        segments: plain names by segment.
        joints: plain names by joint.
        coordinates: names of each joint's displacements, in the order of its chain.
    """

    placement: Placement
    springs: SpringSet
    segments: Mapping[str, str]
    joints: Mapping[str, str]
    coordinates: Mapping[str, tuple[str, ...]]

    @property
    def tree(self) -> Tree:
        """The tree of the figure's joints."""
        return self.placement.tree

    @property
    def figure(self) -> Figure:
        """The figure."""
        return self.tree.figure

    def site(self, ref: SiteRef) -> Array:
        """Pose of a site in its segment, shape (4, 4)."""
        return self.figure.site(ref).pose_in_segment

    def branch_sites(self, branch: TreeJoint) -> tuple[Array, Array]:
        """Poses of a joint's sites in its inboard and in its outboard segment, shape (4, 4)."""
        parent, child = (self.site(ref) for ref in branch.joint.ends)
        return (parent, child) if branch.parent_is_inboard else (child, parent)

    def mass_properties(self, segment: str) -> tuple[float, Array, Vector]:
        """Mass [kg], centre of mass [m] and principal moments [kg m2] of a segment that moves."""
        body = self.figure.segments[segment]
        assert body.mass is not None
        assert body.centre_of_mass is not None
        assert body.inertia is not None
        return body.mass, body.centre_of_mass, body.inertia

    @cached_property
    def tree_springs(self) -> Mapping[str, JointSprings]:
        """Springs of the tree's joints that have any, in the order of the figure."""
        branches = {branch.joint.name for branch in self.tree.joints}
        names = [name for name in self.figure.joints if name in branches]
        return {name: self.springs.joints[name] for name in names if name in self.springs.joints}

    def joint_springs(self, joint: str) -> JointSprings:
        """Springs of a joint, which may be none."""
        return self.springs.joints.get(joint, JointSprings(joint))

    def laws(self, joint: str) -> "JointLaws":
        """Springs of a joint by their arguments; raises as `split_joint_laws`."""
        chain = self.tree.chains[joint]
        laws = split_joint_laws(chain, self.joint_springs(joint), self.springs.law)
        return replace(laws, keeps_angles=joint in self.linked_joints)

    @cached_property
    def linked_joints(self) -> frozenset[str]:
        """Joints with displacements that follow others, or that are followed."""
        links = figure_links(self.figure).links
        return frozenset(end.joint for one in links for end in (one.follower, one.control))

    def is_in_tree(self, spring: CoupledSpring) -> bool:
        """Return True for a law over joints of which none closes a loop."""
        joints = {branch.joint.name for branch in self.tree.joints}
        return all(axis.joint in joints for axis in spring.axes)


def build_export_model(figure: Figure, springs: SpringSet, losses: Losses) -> ExportModel:
    """Build the tree of a figure with springs, close its loops and name its parts.

    Raises:
        InputError: segments that move lack a mass, an inertia or a centre of mass, or none moves.
        ModelError: a joint's chain is not one that a single joint can have.
        OpenLoopError: a loop is open in the pose of the figure and cannot be closed.
    """
    diagnostics = [
        fault for segment in figure.bodies.values() if (fault := _missing_properties(segment))
    ]
    if not figure.bodies:
        diagnostics = [error("none of the figure's segments moves: there is no model to write")]
    if diagnostics:
        raise InputError(diagnostics)
    tree = build_tree(figure)
    segments, joints = plain_names(figure.segments), plain_names(figure.joints)
    losses.add_loss(renaming_loss(segments))
    losses.add_loss(renaming_loss(joints))
    chains = {name: joint.chain for name, joint in figure.joints.items()}
    placement = close_loops(tree, initial_displacements(tree))
    return ExportModel(placement, springs, segments, joints, coordinate_names(chains))


def _missing_properties(segment: Segment) -> Diagnostic | None:
    """Return the diagnostic for properties that a body needs and the segment lacks."""
    missing = [
        word
        for word, value in (
            ("a positive mass", segment.mass if segment.mass and segment.mass > 0.0 else None),
            ("an inertia", segment.inertia),
            ("a site CM", segment.centre_of_mass),
        )
        if value is None
    ]
    if not missing:
        return None
    listed = " and ".join([", ".join(missing[:-1]), missing[-1]] if missing[1:] else missing)
    return error(
        f"segment `{segment.name}` moves and lacks {listed}, which a model needs",
        origin_span(segment.origins),
        "`mover complete` estimates them from psurfs",
    )


_ORTHOGONALITY_TOLERANCE = 1e-9


@dataclass(frozen=True)
class JointLaws:
    """The springs of a joint by their arguments.

    Attributes:
        chain: chain of the joint.
        law: law of joints of several rotations.
        uncoupled: springs that are functions of one displacement alone, in the sense of its axis,
            by index in the chain; under a law of coordinates all are.
        combined: springs of several rotations, which are functions of the rotation vector.
        reach: reach of the limb below the joint; `combined` has its damping.
        keeps_angles: whether the joint is of single displacements, as some follow others.
    """

    chain: Chain
    law: SphericalLaw
    uncoupled: Mapping[int, AxisSpring]
    combined: tuple[AxisSpring, ...]
    reach: Reach | None = None
    keeps_angles: bool = False

    @property
    def of_vector(self) -> VectorLaw:
        """The law of the springs of several rotations, without a reach."""
        return VectorLaw(self.combined, self.law is SphericalLaw.WEIGHTED)

    @property
    def is_ball(self) -> bool:
        """True for a joint written as a ball: three rotations whose springs do not part them.

        Hinges are exact, but near the pole of their axes inaccurate: a joint whose springs are not
        functions of its displacements stays a ball.
        """
        turns = self.chain.rotations
        are_apart = self.keeps_angles or any(k in self.uncoupled for k in turns)
        return len(turns) == 3 and not are_apart

    @property
    def combined_resist(self) -> bool:
        """True if springs of several rotations have damping or Coulomb friction."""
        return any(axis.damping.viscous or axis.damping.coulomb for axis in self.combined)


def split_joint_laws(chain: Chain, springs: JointSprings, law: SphericalLaw) -> JointLaws:
    """Split the springs of a joint.

    Args:
        chain: chain of the joint.
        springs: springs of the joint.
        law: law of joints of several rotations.

    Raises:
        InputError: a spring is about or along an axis that the joint does not have.
    """
    alone: dict[int, AxisSpring] = {}
    combined: tuple[AxisSpring, ...] = ()
    if len(chain.rotations) == 1 and springs.axes:
        (place,) = chain.rotations
        alone[place] = in_axis_sense(springs.axes[0], chain.joint_axes[place].axis)
    elif law is SphericalLaw.COORDINATES and springs.axes and springs.reach is None:
        try:
            coordinates = rotation_law(springs, law, chain.rotation_axes)
        except ValueError as failure:
            raise InputError([error(f"joint `{springs.joint}`: {failure}")]) from None
        assert isinstance(coordinates, CoordinateLaw)
        own = zip(chain.rotations, coordinates.springs, strict=True)
        alone = {index: spring for index, spring in own if spring is not None}
    else:
        combined = springs.axes
    axes = {k: unit_axis(chain.joint_axes[k].axis) for k in chain.translations}
    for spring in springs.translations:
        places = [k for k, axis in axes.items() if parallel_sign(spring.direction, axis)]
        if not places:
            message = (
                f"joint `{springs.joint}` has a spring along an axis on which it does not translate"
            )
            raise InputError([error(message)])
        alone[places[0]] = in_axis_sense(spring, axes[places[0]])
    return JointLaws(chain, law, alone, combined, springs.reach)


def in_axis_sense(spring: AxisSpring, axis: Vector) -> AxisSpring:
    """Return a spring about or along an axis, or its opposite, as one in the sense of the axis."""
    return spring if np.dot(spring.direction, axis) > 0.0 else spring.with_opposite_axis()


def common_damping(axes: tuple[AxisSpring, ...]) -> float | None:
    """Return the viscous damping [N m s/rad] that is equal about all axes; None for others."""
    viscous = {axis.damping.viscous for axis in axes}
    if viscous == {0.0}:
        return 0.0
    if len(axes) != 3 or len(viscous) > 1:
        return None
    rows: Array = np.array([axis.direction for axis in axes])
    across = np.abs(rows @ rows.T - np.eye(3)).max() < _ORTHOGONALITY_TOLERANCE
    return viscous.pop() if across else None


def has_friction(spring: AxisSpring) -> bool:
    """Return True if an elastic law of a spring has friction of its own."""
    return any(isinstance(law, Frictional) for law in spring.elastic)


FREE_FOLLOWERS = "curves by which displacements follow others: they are free"

REACH_LOSS = (
    "the reach of limbs: their directions and turns have no ends in the file, whose motion is that "
    "of the figure until a limb comes to one (`.osim` holds them)"
)


def add_common_losses(
    model: ExportModel,
    losses: Losses,
    *,
    has_coupled: bool = False,
    has_loops: bool = False,
    has_reaches: bool = False,
    has_contact: bool = False,
    has_followers: bool = False,
) -> None:
    """Report the parts that no format holds, laws over several joints and springs of loops.

    `has_coupled` is True for a model with the laws over several joints of the tree, `has_loops`
    for one whose writer reports the springs that close loops, `has_reaches` for one with the
    reaches of the tree's joints, `has_contact` for one with the contact spheres, `has_followers`
    for one with the displacements that follow others, or whose writer reports them.
    """
    if not has_followers:
        for link in figure_links(model.figure).links:
            losses.add(FREE_FOLLOWERS, str(link.follower))
    for name, segment in model.figure.segments.items():
        if segment.contact_spheres and not has_contact:
            losses.add("contact spheres", name)
    for name, attribute in model.figure.attributes.items():
        if set(attribute.fields) - {"rgb"}:
            losses.add_description("attributes other than a colour", name)
    for joint in model.tree.closures:
        if joint.name in model.springs.joints and not has_loops:
            losses.add("springs of joints that close loops", joint.name)
    for name, springs in model.tree_springs.items():
        if springs.reach is not None and not has_reaches:
            losses.add(REACH_LOSS, name)
    for spring in model.springs.coupled:
        if has_coupled and model.is_in_tree(spring):
            continue
        joints = dict.fromkeys(axis.joint for axis in spring.axes)
        losses.add("laws over several joints", " and ".join(joints))


def add_tree_losses(model: ExportModel, losses: Losses) -> None:
    """Report the parts that a format with a tree of segments and their masses alone cannot hold."""
    figure = model.figure
    for joint in model.tree.closures:
        losses.add("joints that close loops: the loops are open", joint.name)
    moved = [name for name, joint in figure.joints.items() if any(joint.displacement)]
    if moved:
        losses.add("the pose in which the figure is drawn: all displacements are 0", *moved)
    for name, segment in figure.segments.items():
        loads = [load for site in segment.sites.values() for load in site_loads(site).values()]
        if name not in figure.ground and any(map(any, loads)):
            losses.add("forces and moments at sites", name)


AXIS_POINT_DISTANCE = 0.1
"""Distance along a revolute's axis of its second constrained point [m]."""


@dataclass(frozen=True)
class Loop:
    """The constraint of a joint that closes a loop.

    Attributes:
        joint: the joint.
        points: points that coincide in the frames of both sites [m]; empty for a weld.
    """

    joint: Joint
    points: tuple[Array, ...]


def loop_closures(model: ExportModel, losses: Losses) -> Iterator[Loop]:
    """Yield the loops that points can close; report the others as open."""
    for joint in model.tree.closures:
        chain = model.tree.chains[joint.name]
        turns, slides = len(chain.rotations), len(chain.translations)
        if turns == slides == 3:
            continue
        if slides:
            losses.add("joints with translations that close a loop: the loop is open", joint.name)
            continue
        if turns == 2:
            losses.add("joints of two rotations that close a loop: they rotate freely", joint.name)
        points = [np.zeros(3)] if turns else []
        if turns == 1:
            points.append(AXIS_POINT_DISTANCE * unit_vector(joint.chain[0].axis))
        yield Loop(joint, tuple(points))
