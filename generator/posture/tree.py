"""The figure as a tree hung from the ground, with the joints that close its loops."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from generator.chain import Chain, chain_of
from generator.figure import Figure, Joint
from generator.posture.branch import Branch
from generator.posture.kinematics import Kinematics


@dataclass(frozen=True)
class Tree:
    """Joints oriented from the root, never by the order within `connect`.

    Attributes:
        branches: in an order in which every base is placed before its tip.
        closures: joints whose two segments are placed without them.
        chains: the chain of every joint.
    """

    figure: Figure
    branches: tuple[Branch, ...]
    closures: tuple[Joint, ...]
    chains: Mapping[str, Chain]

    @cached_property
    def kinematics(self) -> Kinematics:
        """What places the segments, prepared when it is first asked for."""
        return Kinematics(self.figure, self.branches)


def hang(figure: Figure) -> Tree:
    """The tree of a figure, breadth first from the ground, joints in the order of the file.

    Raises:
        ChainError: a joint's chain is none that one joint can hold.
        ValueError: a segment cannot be reached from the root.
    """
    chains = {name: chain_of(joint.chain) for name, joint in figure.joints.items()}
    reached = set(figure.ground)
    branches: list[Branch] = []
    used = {
        name
        for name, joint in figure.joints.items()
        if {joint.parent.segment, joint.child.segment} <= figure.ground
    }
    waiting = deque(name for name in figure.segments if name in reached)
    while waiting:
        base = waiting.popleft()
        for name, joint in figure.joints.items():
            ends = (joint.parent.segment, joint.child.segment)
            if name in used or base not in ends:
                continue
            tip = ends[1] if ends[0] == base else ends[0]
            if tip in reached:
                continue
            used.add(name)
            reached.add(tip)
            waiting.append(tip)
            branches.append(Branch(joint, base, tip, forward=ends[0] == base))
    missing = [name for name in figure.segments if name not in reached]
    if missing:
        raise ValueError(f"no joint leads from the root to {', '.join(missing)}")
    closures = tuple(joint for name, joint in figure.joints.items() if name not in used)
    return Tree(figure, tuple(branches), closures, chains)
