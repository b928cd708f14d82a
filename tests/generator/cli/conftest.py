"""A motion that the commands read."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeAlias

import numpy as np
import pytest

from generator import read_figure
from generator.figure import Figure
from generator.kinematics.placement import initial_displacements
from generator.kinematics.tree import Tree, build_tree
from generator.motion_files import format_action
from generator.motion_files.action import ActionFile
from generator.motion_files.motion import Header
from generator.recording import Ending

MotionWriter: TypeAlias = Callable[[str, Figure, Mapping[str, np.ndarray], list[float]], Path]


@pytest.fixture(scope="session")
def prototype() -> Tree:
    return build_tree(read_figure("prototype"))


@pytest.fixture(scope="session")
def write_motion(tmp_path_factory: pytest.TempPathFactory) -> MotionWriter:
    """Writer of an action file of the prototype, from made-up displacements at some times [s]."""
    folder = tmp_path_factory.mktemp("motions")

    def write(name: str, figure: Figure, displacements: Mapping, times: list[float]) -> Path:
        header = Header(
            "prototype.fig", None, times[0], times[-1], None, "none", "none", Ending.DONE, "done"
        )
        chains = {name: joint.chain for name, joint in figure.joints.items()}
        path = folder / name
        action = ActionFile(header, chains, np.array(times), displacements)
        path.write_text(format_action(action), encoding="utf-8")
        return path

    return write


@pytest.fixture(scope="session")
def bending(prototype: Tree, write_motion: MotionWriter) -> Path:
    """The waist bends back by 5 degrees a frame."""
    rows = {name: np.tile(v, (8, 1)) for name, v in initial_displacements(prototype).items()}
    rows["waist"] = np.radians(np.outer(np.arange(8), [0.0, 0.0, -5.0]))
    times = [0.1 * k for k in range(8)]
    return write_motion("bending.action", prototype.figure, rows, times)
