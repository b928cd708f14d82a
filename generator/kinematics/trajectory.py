"""A figure along a motion: the same joints, and their displacements frame by frame."""

from collections.abc import Iterator, Mapping, Sequence

from generator.diagnostics import MoverError, nearest
from generator.figure import Factor, Figure
from generator.kinematics.free_root import let_go
from generator.kinematics.placement import Placement, drawn_displacements, place
from generator.kinematics.tree import Tree, hang
from generator.rotations import Array

FRAMES_AT_ONCE = 2000
"""So many poses of a figure like the prototype take some 30 MB."""

Chains = Mapping[str, Sequence[Factor]]


class OtherMotionError(MoverError):
    """A motion whose joints are not those of the figure."""


def tree_of_motion(figure: Figure, chains: Chains) -> Tree:
    """The tree that a motion with these joints moves: the figure's, or that of the figure let go.

    Args:
        figure: as its file describes it.
        chains: the factors of each joint of the motion.

    Raises:
        OtherMotionError: the motion is one of another figure.
        ChainError: a joint's chain is none that one joint can hold.
    """
    tree = hang(figure)
    if not tree.branches:
        raise OtherMotionError("none of the figure's segments moves, so it has no motion")
    if _same(tree.figure, chains):
        return tree
    freed, _ = let_go(figure, drawn_displacements(tree))
    if _same(freed, chains):
        return hang(freed)
    for name in chains:
        if name not in figure.joints and name not in freed.joints:
            hint = nearest(name, figure.joints)
            raise OtherMotionError(
                f"the motion moves joint `{name}`, unknown to the figure; {hint}"
            )
    for name, joint in figure.joints.items():
        if name not in chains and name in freed.joints:
            raise OtherMotionError(f"the motion does not tell of joint `{name}` of the figure")
        if name in chains and tuple(chains[name]) != joint.chain:
            raise OtherMotionError(
                f"joint `{name}` has other axes in the motion than in the figure"
            )
    raise OtherMotionError("the joints of the motion are not those of the figure")


def placements_along(
    tree: Tree, displacements: Mapping[str, Array], at_once: int = FRAMES_AT_ONCE
) -> Iterator[Placement]:
    """The placements of a motion, many frames in each, one after the other.

    Args:
        tree: what moves.
        displacements: of its joints, shape (frames, n) each [rad or m]. Those of joints that close
            loops are taken as they are, and do not place anything.
        at_once: most frames in a placement.
    """
    frames = len(next(iter(displacements.values()), ()))
    for start in range(0, frames, at_once):
        some = slice(start, start + at_once)
        yield place(tree, {name: rows[some] for name, rows in displacements.items()})


def _same(figure: Figure, chains: Chains) -> bool:
    return {name: joint.chain for name, joint in figure.joints.items()} == {
        name: tuple(chain) for name, chain in chains.items()
    }
