"""The connectors of a joint's springs and damping: of its hinge or ball, and of its slides."""

from generator.engine.ball import hang_ball
from generator.engine.connector import Connector, Hanger, SpringError
from generator.engine.hinge import hang_hinge
from generator.engine.slide import hang_slide
from generator.figure import Joint
from springs import Joining, JointSprings


def add_springs(
    hanger: Hanger, joint: Joint, springs: JointSprings, joining: Joining, *, read: bool = False
) -> tuple[Connector, ...]:
    """The connectors of one joint's springs.

    Args:
        hanger: where they are hung.
        joint: of the figure.
        springs: about its axes and along its slides.
        joining: how the axes of a ball join.
        read: whether the joint's turn is read in any case, also without springs about its axes.

    Raises:
        SpringError: springs about axes or along slides that the joint's chain does not have.
    """
    chain = hanger.placement.tree.chains[joint.name]
    if springs.axes and not chain.turns:
        raise SpringError(f"joint {joint.name} has springs about axes but no rotation")
    if springs.slides and not chain.slides:
        raise SpringError(f"joint {joint.name} has springs along slides but no translation")
    made: list[Connector] = []
    if springs.axes or read:
        if len(chain.turns) == 1:
            axis = springs.axes[0] if springs.axes else None
            made.append(hang_hinge(hanger, joint, chain, axis))
        else:
            made.append(hang_ball(hanger, joint, springs.axes, joining))
    made.extend(hang_slide(hanger, joint, chain, slide) for slide in springs.slides)
    return tuple(made)
