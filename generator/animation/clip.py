"""A motion of a figure, ready to be written: from a recording, or from an action file."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from generator.animation.header import Header, header_of
from generator.exchange.losses import Loss
from generator.figure import Factor, Figure
from generator.frames import Array
from generator.posture.along import placements_along, tree_of_motion
from generator.posture.tree import Tree
from generator.recording import Recording


@dataclass(frozen=True, eq=False)
class Clip:
    """What every format can take from: displacements, poses, and the figure they belong to.

    Attributes:
        figure: as its file describes it.
        header: where the motion is from.
        chains: the factors of each joint of the motion, innermost first; with a free root they are
            those of the figure let go.
        times: of the n frames [s], shape (n,).
        displacements: of each joint, shape (n, degrees of freedom) [rad or m].
        recording: the run that the motion is from; None for one from an action file.
    """

    figure: Figure
    header: Header
    chains: Mapping[str, tuple[Factor, ...]]
    times: Array
    displacements: Mapping[str, Array]
    recording: Recording | None = None

    @cached_property
    def tree(self) -> Tree:
        """The tree that moves. Raises OtherMotionError when the motion is of another figure."""
        return tree_of_motion(self.figure, self.chains)

    @cached_property
    def poses(self) -> Mapping[str, Array]:
        """Poses of the segments in the world, shape (n, 4, 4): the run's, or by kinematics.

        Raises OtherMotionError when the motion is of another figure.
        """
        if self.recording is not None:
            return self.recording.poses
        parts = [some.poses for some in placements_along(self.tree, self.displacements)]
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def clip_of_recording(recording: Recording, figure: Figure) -> Clip:
    """The motion of a run of a figure."""
    return Clip(
        figure,
        header_of(recording, figure),
        recording.chains,
        recording.times,
        recording.displacements,
        recording,
    )


_QUANTITIES = ("velocities", "reactions", "passive torques", "energies", "error estimate")


def unheld(clip: Clip, *held: str) -> Loss | None:
    """What a run knows of itself and a format does not hold; None for a motion without a run.

    Args:
        clip: the motion.
        held: the quantities that the format does hold.
    """
    if clip.recording is None:
        return None
    driven = ["drive torques"] if clip.recording.drive_torques else []
    left = [name for name in (*_QUANTITIES, *driven) if name not in held]
    return Loss("what the run says beside the motion", tuple(left))


NO_FIGURE = Loss("the figure: its segments, masses and shapes; the joints alone are named")
"""Said of files that hold displacements and leave the figure to its own file."""

NO_MASSES = Loss("the masses, inertias and springs of the figure")
"""Said of files that hold what a figure looks like."""
