"""The springs of a joint, as programs with a force for each displacement want them.

What the writers of models share: a figure hung up, in its pose, with plain names.

The joints that close loops, as constraints of points: what most programs have for them.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import count

import numpy as np

from generator.diagnostics import Fault, InputError, error
from generator.figure import Figure, Joint, Segment, SiteRef
from generator.figure_file.resolve import place_of
from generator.joint_chain import Chain
from generator.kinematics.loops import assemble
from generator.kinematics.placement import Placement, drawn_displacements
from generator.kinematics.tree import Tree, hang
from generator.losses import Report
from generator.names import coordinate_names, loss_of_names, plain_names
from generator.rotations import PERPENDICULAR, Array, unit
from springs import AxisSpring, JointSprings, Linear, SpringSet
from springs.elastic import Frictional


@dataclass(frozen=True)
class Model:
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


def model_of(figure: Figure, report: Report) -> Model:
    """A figure hung up and named.

    Raises:
        InputError: segments that move lack a mass, an inertia or a centre of mass, or none moves.
        ChainError: a joint's chain is none that one joint can hold.
        OpenLoopError: the figure is drawn in a pose that opens a loop, which cannot be closed.
    """
    faults = [fault for segment in figure.bodies.values() if (fault := _incomplete(segment))]
    if not figure.bodies:
        faults = [error("none of the figure's segments moves: there is no model to write")]
    if faults:
        raise InputError(faults)
    tree = hang(figure)
    segments, joints = plain_names(figure.segments), plain_names(figure.joints)
    report.add(loss_of_names(segments))
    report.add(loss_of_names(joints))
    chains = {name: joint.chain for name, joint in figure.joints.items()}
    placement = assemble(tree, drawn_displacements(tree))
    return Model(placement, segments, joints, coordinate_names(chains))


def unused_name(name: str, taken: set[str]) -> str:
    """The name, or one made of it that is not taken yet; from now on it is."""
    new = next(one for k in count(1) if (one := name if k == 1 else f"{name}_{k}") not in taken)
    taken.add(new)
    return new


def _incomplete(segment: Segment) -> Fault | None:
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
        place_of(segment.origins),
        "`mover complete` estimates them from psurfs",
    )


_EQUAL = 1e-9


@dataclass(frozen=True)
class JointLaws:
    """The springs of a joint, told by what they are functions of.

    Attributes:
        alone: by the place in the chain, springs that are functions of this displacement alone,
            told about its axis.
        together: springs of several turns, which are functions of the rotation vector.
    """

    alone: Mapping[int, AxisSpring]
    together: tuple[AxisSpring, ...]


def laws_of(chain: Chain, springs: JointSprings) -> JointLaws:
    """The springs of a joint with the chain `chain`.

    Raises InputError for a spring along a slide that the joint has not.
    """
    alone: dict[int, AxisSpring] = {}
    if len(chain.turns) == 1 and springs.axes:
        alone[chain.turns[0]] = _along(springs.axes[0], chain, chain.turns[0])
    for spring in springs.slides:
        place = next((k for k in chain.slides if _is_along(spring, chain, k)), None)
        if place is None:
            said = f"joint `{springs.joint}` has a spring along which it cannot slide"
            raise InputError([error(said)])
        alone[place] = _along(spring, chain, place)
    return JointLaws(alone, springs.axes if len(chain.turns) > 1 else ())


def _is_along(spring: AxisSpring, chain: Chain, place: int) -> bool:
    across = np.cross(unit(chain.factors[place].axis), spring.direction)
    return float(np.linalg.norm(across)) < PERPENDICULAR


def _along(spring: AxisSpring, chain: Chain, place: int) -> AxisSpring:
    same = float(np.dot(spring.direction, chain.factors[place].axis)) > 0.0
    return spring if same else spring.turned()


def used_springs(model: Model, springs: SpringSet) -> Iterator[tuple[str, JointSprings]]:
    """The springs of the tree's joints, in the order of the figure."""
    branches = {branch.joint.name for branch in model.tree.branches}
    for name in model.figure.joints:
        if name in springs.joints and name in branches:
            yield name, springs.joints[name]


def are_perpendicular(axes: tuple[AxisSpring, ...]) -> bool:
    """Whether these are springs about three axes, each perpendicular to the others."""
    if len(axes) != 3:
        return False
    rows: Array = np.array([axis.direction for axis in axes])
    return bool(np.abs(rows @ rows.T - np.eye(3)).max() < _EQUAL)


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


def rubs(spring: AxisSpring) -> bool:
    """Whether a spring's elastic laws have a friction of their own."""
    return any(isinstance(law, Frictional) for law in spring.elastic)


def lose_what_no_format_has(model: Model, springs: SpringSet, report: Report) -> None:
    """Note the laws over several joints and of what closes a loop, and where numbers are from."""
    for joint in model.tree.closures:
        if joint.name in springs.joints:
            report.lose("springs of joints that close loops", joint.name)
    for spring in springs.coupled:
        joints = dict.fromkeys(axis.joint for axis in spring.axes)
        report.lose("laws over several joints", " and ".join(joints))
    if springs.references:
        report.lose("the references of the springs")


ARM = 0.1
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


def loops_of(model: Model, report: Report) -> Iterator[Loop]:
    """The loops that points can close; the others are noted as left open."""
    for joint in model.tree.closures:
        chain = model.tree.chains[joint.name]
        turns, slides = len(chain.turns), len(chain.slides)
        if turns == slides == 3:
            continue
        if slides:
            report.lose("joints that slide and close a loop: the loop is open", joint.name)
            continue
        if turns == 2:
            report.lose("joints of two turns that close a loop: they turn freely", joint.name)
        points = [np.zeros(3)] if turns else []
        if turns == 1:
            points.append(ARM * unit(joint.chain[0].axis))
        yield Loop(joint, tuple(points))
