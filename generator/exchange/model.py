"""What the writers of models share: a figure hung up, in its pose, with plain names."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import count

from generator.errors import Fault, InputError, error
from generator.exchange.names import coordinate_names, loss_of_names, plain_names
from generator.exchange.report import Report
from generator.figure import Figure, Segment, SiteRef
from generator.frames import Array
from generator.posture.assemble import assemble
from generator.posture.placement import Placement, drawn_displacements
from generator.posture.tree import Tree, hang
from generator.reader.draft import place_of


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
