"""Latency of a slider: a pose of the prototype, its centre of mass and its stability.

Run with `python -m benchmarks.posture`. Times are the best of many and noisy; the ratios of one run
are what counts.
"""

import platform
import time
from collections.abc import Callable
from importlib.metadata import version

import numpy as np

from generator.figure_file.read import read_figure
from generator.kinematics.centre_of_mass import segment_masses
from generator.kinematics.placement import (
    forward_kinematics,
    initial_displacements,
    segment_jacobians,
)
from generator.kinematics.stability import FixedSupport, LowFaces, patch_from_faces, stability
from generator.kinematics.tree import build_tree

ROUNDS, CALLS = 15, 40
FRAMES = 1000


def main() -> None:
    """Print the table."""
    tree = build_tree(read_figure("prototype"))
    drawn = initial_displacements(tree)
    placement = forward_kinematics(tree, drawn)
    masses = segment_masses(tree.figure)
    shanks = ("left_lower_leg", "right_lower_leg")
    chosen = FixedSupport([patch_from_faces(tree.figure, name) for name in shanks])
    low = LowFaces(tree.figure, 0.01)
    centre, points = masses.centre(placement.poses), low.points_in_pose(placement.poses).positions
    motion = {name: np.tile(values, (FRAMES, 1)) for name, values in drawn.items()}

    def whole(support: FixedSupport | LowFaces) -> None:
        poses = forward_kinematics(tree, drawn).poses
        stability(masses.centre(poses), support.points_in_pose(poses).positions)

    print(f"Python {platform.python_version()}, numpy {version('numpy')}, {platform.machine()}")
    print(f"prototype, best of {ROUNDS} rounds of {CALLS} calls")
    rows: list[tuple[str, Callable[[], object], int]] = [
        ("pose of all segments", lambda: forward_kinematics(tree, drawn), 1),
        (
            "  the same in a motion of 1000 frames, a frame",
            lambda: forward_kinematics(tree, motion),
            FRAMES,
        ),
        ("motion maps of all segments", lambda: segment_jacobians(placement), 1),
        ("centre of mass", lambda: masses.centre(placement.poses), 1),
        ("  its slopes by 22 displacements", lambda: masses.jacobian(placement), 1),
        ("support: faces below 1 cm, of 10 psurfs", lambda: low.points_in_pose(placement.poses), 1),
        ("support: all faces of both shanks", lambda: chosen.points_in_pose(placement.poses), 1),
        (f"stability over {len(points)} points", lambda: stability(centre, points), 1),
        ("pose, centre and stability on faces below 1 cm", lambda: whole(low), 1),
        ("pose, centre and stability on both shanks", lambda: whole(chosen), 1),
    ]
    for name, call, frames in rows:
        print(f"  {name:<50} {1e3 * _best(call) / frames:7.3f} ms")


def _best(call: Callable[[], object]) -> float:
    """Best time of a call [s]."""
    call()
    best = np.inf
    for _ in range(ROUNDS):
        start = time.perf_counter()
        for _ in range(CALLS):
            call()
        best = min(best, (time.perf_counter() - start) / CALLS)
    return float(best)


if __name__ == "__main__":
    main()
