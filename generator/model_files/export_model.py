"""The springs of a joint, as programs with a force for each displacement want them.

What the writers of models share: a figure hung up, in its pose, with plain names.

The joints that close loops, as constraints of points: what most programs have for them.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from generator.diagnostics import Diagnostic, InputError, error
from generator.figure import Figure, Joint, Segment, SiteRef
from generator.figure_file.resolve import origin_span
from generator.joint_chain import Chain
from generator.kinematics.loops import close_loops
from generator.kinematics.placement import Placement, initial_displacements
from generator.kinematics.tree import Tree, build_tree
from generator.losses import Losses
from generator.names import coordinate_names, plain_names, renaming_loss
from generator.rotations import PERPENDICULAR_TOLERANCE, Array, unit_vector
from springs import AxisSpring, JointSprings, Linear, SpringSet
from springs.elastic import Frictional


@dataclass(frozen=True)
class ExportModel:
    """A figure that every other program can take.

    Attributes:
        placement: the figure in the pose in which it is drawn, its loops closed.
        segments: plain names by segment.
        joints: plain names by joint.
        coordinates: names of each joint's displacements, in the order of its chain.
    """

    placement: Placement
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


def build_export_model(figure: Figure, losses: Losses) -> ExportModel:
    """A figure hung up and named.

    Raises:
        InputError: segments that move lack a mass, an inertia or a centre of mass, or none moves.
        ModelError: a joint's chain is none that one joint can hold.
        OpenLoopError: the figure is drawn in a pose that opens a loop, which cannot be closed.
    """
    faults = [
        fault for segment in figure.bodies.values() if (fault := _missing_properties(segment))
    ]
    if not figure.bodies:
        faults = [error("none of the figure's segments moves: there is no model to write")]
    if faults:
        raise InputError(faults)
    tree = build_tree(figure)
    segments, joints = plain_names(figure.segments), plain_names(figure.joints)
    losses.add_loss(renaming_loss(segments))
    losses.add_loss(renaming_loss(joints))
    chains = {name: joint.chain for name, joint in figure.joints.items()}
    placement = close_loops(tree, initial_displacements(tree))
    return ExportModel(placement, segments, joints, coordinate_names(chains))


def _missing_properties(segment: Segment) -> Diagnostic | None:
    """What a body of any program needs and the segment has not."""
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
    said = " and ".join([", ".join(missing[:-1]), missing[-1]] if missing[1:] else missing)
    return error(
        f"segment `{segment.name}` moves and lacks {said}, which a model needs",
        origin_span(segment.origins),
        "`mover complete` estimates them from psurfs",
    )


_ORTHOGONALITY_TOLERANCE = 1e-9


@dataclass(frozen=True)
class JointLaws:
    """The springs of a joint, told by what they are functions of.

    Attributes:
        uncoupled: by the place in the chain, springs that are functions of this displacement alone,
            told about its axis.
        combined: springs of several turns, which are functions of the rotation vector.
    """

    uncoupled: Mapping[int, AxisSpring]
    combined: tuple[AxisSpring, ...]


def split_joint_laws(chain: Chain, springs: JointSprings) -> JointLaws:
    """The springs of a joint with the chain `chain`.

    Raises InputError for a spring along a slide that the joint has not.
    """
    alone: dict[int, AxisSpring] = {}
    if len(chain.rotations) == 1 and springs.axes:
        alone[chain.rotations[0]] = _in_axis_sense(springs.axes[0], chain, chain.rotations[0])
    for spring in springs.translations:
        place = next(
            (k for k in chain.translations if _is_parallel_to_axis(spring, chain, k)), None
        )
        if place is None:
            said = f"joint `{springs.joint}` has a spring along which it cannot slide"
            raise InputError([error(said)])
        alone[place] = _in_axis_sense(spring, chain, place)
    return JointLaws(alone, springs.axes if len(chain.rotations) > 1 else ())


def _is_parallel_to_axis(spring: AxisSpring, chain: Chain, index: int) -> bool:
    across = np.cross(unit_vector(chain.joint_axes[index].axis), spring.direction)
    return float(np.linalg.norm(across)) < PERPENDICULAR_TOLERANCE


def _in_axis_sense(spring: AxisSpring, chain: Chain, index: int) -> AxisSpring:
    same = float(np.dot(spring.direction, chain.joint_axes[index].axis)) > 0.0
    return spring if same else spring.with_opposite_axis()


def tree_joint_springs(
    model: ExportModel, springs: SpringSet
) -> Iterator[tuple[str, JointSprings]]:
    """The springs of the tree's joints, in the order of the figure."""
    branches = {branch.joint.name for branch in model.tree.joints}
    for name in model.figure.joints:
        if name in springs.joints and name in branches:
            yield name, springs.joints[name]


def are_perpendicular(axes: tuple[AxisSpring, ...]) -> bool:
    """Whether these are springs about three axes, each perpendicular to the others."""
    if len(axes) != 3:
        return False
    rows: Array = np.array([axis.direction for axis in axes])
    return bool(np.abs(rows @ rows.T - np.eye(3)).max() < _ORTHOGONALITY_TOLERANCE)


def common_stiffness(axes: tuple[AxisSpring, ...]) -> float | None:
    """Stiffness [N m/rad] of a ball that resists turns about all axes alike; None for others.

    Both ways of joining axes give then the torque -k r, where r is the rotation vector.
    """
    laws = {axis.elastic for axis in axes}
    if laws == {()}:
        return 0.0
    if not are_perpendicular(axes) or len(laws) > 1:
        return None
    (law,) = laws
    linear = [one for one in law if isinstance(one, Linear) and one.rest == 0.0]
    return sum(one.stiffness for one in linear) if len(linear) == len(law) else None


def common_damping(axes: tuple[AxisSpring, ...]) -> float | None:
    """Viscous damping [N m s/rad] that all axes share; None where they do not."""
    viscous = {axis.damping.viscous for axis in axes}
    if viscous == {0.0}:
        return 0.0
    return viscous.pop() if are_perpendicular(axes) and len(viscous) == 1 else None


def has_friction(spring: AxisSpring) -> bool:
    """Whether a spring's elastic laws have a friction of their own."""
    return any(isinstance(law, Frictional) for law in spring.elastic)


def add_common_losses(model: ExportModel, springs: SpringSet, losses: Losses) -> None:
    """Note the laws over several joints and of what closes a loop, and where numbers are from."""
    for joint in model.tree.closures:
        if joint.name in springs.joints:
            losses.add("springs of joints that close loops", joint.name)
    for spring in springs.coupled:
        joints = dict.fromkeys(axis.joint for axis in spring.axes)
        losses.add("laws over several joints", " and ".join(joints))
    if springs.references:
        losses.add("the references of the springs")


AXIS_POINT_DISTANCE = 0.1
"""Distance along a hinge's axis of the second point that is held [m]."""


@dataclass(frozen=True)
class Loop:
    """What holds the two bodies of a joint that closes a loop.

    Attributes:
        joint: which it is.
        points: places in the frames of both sites that stay together [m]; none where the two frames
            stay together as a whole.
    """

    joint: Joint
    points: tuple[Array, ...]


def loop_closures(model: ExportModel, losses: Losses) -> Iterator[Loop]:
    """The loops that points can close; the others are noted as left open."""
    for joint in model.tree.closures:
        chain = model.tree.chains[joint.name]
        turns, slides = len(chain.rotations), len(chain.translations)
        if turns == slides == 3:
            continue
        if slides:
            losses.add("joints that slide and close a loop: the loop is open", joint.name)
            continue
        if turns == 2:
            losses.add("joints of two turns that close a loop: they turn freely", joint.name)
        points = [np.zeros(3)] if turns else []
        if turns == 1:
            points.append(AXIS_POINT_DISTANCE * unit_vector(joint.chain[0].axis))
        yield Loop(joint, tuple(points))
