"""The planar walk of OpenSim, as a figure."""

from functools import lru_cache
from pathlib import Path

from generator.conversion import read_motion
from generator.figure_file import read_figure
from generator.model_files.formats import read_model
from generator.model_files.model_files import imported_files
from generator.motion_files import FigureMotion

WALK = Path(__file__).parent / "walk"
MODEL, MOTION = WALK / "gait10.osim", WALK / "walk.mot"
FORCES, LOADS = WALK / "walk_grf.mot", WALK / "walk_grf.xml"


def write_figure_of_walk(folder: Path) -> Path:
    """Convert the model into a figure in a folder, and return the figure's path."""
    path = folder / "gait10.fig"
    imported_files(read_model(MODEL), path).write()
    return path


@lru_cache(maxsize=2)
def walk_of(figure: Path) -> FigureMotion:
    """The walk of the figure at a path."""
    return read_motion(MOTION, read_figure(figure))
