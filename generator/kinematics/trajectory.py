"""A figure along a motion: the same joints, and their displacements frame by frame."""

from collections.abc import Iterator, Mapping, Sequence

from generator.diagnostics import MoverError, spelling_hint
from generator.figure import Figure, JointAxis
from generator.kinematics.free_root import detach_root
from generator.kinematics.placement import Placement, forward_kinematics, initial_displacements
from generator.kinematics.tree import Tree, build_tree
from generator.rotations import Array

MAX_FRAMES_PER_PLACEMENT = 2000
"""So many poses of a figure like the prototype take some 30 MB."""

JointChains = Mapping[str, Sequence[JointAxis]]


class MotionMismatchError(MoverError):
    """A motion whose joints are not those of the figure."""


def tree_for_motion(figure: Figure, chains: JointChains) -> Tree:
    """The tree that a motion with these joints moves: the figure's, or that of the figure let go.

    Args:
        figure: as its file describes it.
        chains: the factors of each joint of the motion.

    Raises:
        OtherMotionError: the motion is one of another figure.
        ChainError: a joint's chain is none that one joint can hold.
    """
    tree = build_tree(figure)
    if not tree.joints:
        raise MotionMismatchError("none of the figure's segments moves, so it has no motion")
    if _has_chains(tree.figure, chains):
        return tree
    freed, _ = detach_root(figure, initial_displacements(tree))
    if _has_chains(freed, chains):
        return build_tree(freed)
    for name in chains:
        if name not in figure.joints and name not in freed.joints:
            hint = spelling_hint(name, figure.joints)
            raise MotionMismatchError(
                f"the motion moves joint `{name}`, unknown to the figure; {hint}"
            )
    for name, joint in figure.joints.items():
        if name not in chains and name in freed.joints:
            raise MotionMismatchError(f"the motion does not tell of joint `{name}` of the figure")
        if name in chains and tuple(chains[name]) != joint.chain:
            raise MotionMismatchError(
                f"joint `{name}` has other axes in the motion than in the figure"
            )
    raise MotionMismatchError("the joints of the motion are not those of the figure")


def batched_placements(
    tree: Tree, displacements: Mapping[str, Array], batch_size: int = MAX_FRAMES_PER_PLACEMENT
) -> Iterator[Placement]:
    """The placements of a motion, many frames in each, one after the other.

    Args:
        tree: what moves.
        displacements: of its joints, shape (frames, n) each [rad or m]. Those of joints that close
            loops are taken as they are, and do not place anything.
        batch_size: most frames in a placement.
    """
    frames = len(next(iter(displacements.values()), ()))
    for start in range(0, frames, batch_size):
        some = slice(start, start + batch_size)
        yield forward_kinematics(tree, {name: rows[some] for name, rows in displacements.items()})


def _has_chains(figure: Figure, chains: JointChains) -> bool:
    return {name: joint.chain for name, joint in figure.joints.items()} == {
        name: tuple(chain) for name, chain in chains.items()
    }
