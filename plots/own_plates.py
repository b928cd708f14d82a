"""Plates of a user's own files: motions and springs."""

from collections.abc import Iterator
from pathlib import Path

from generator.cli.inputs import check_chains
from generator.conversion import read_motion
from generator.figure_file import read_figure
from generator.springs_file.read import parse_springs_file, read_springs
from plots.motion_plate import motion_plate, plate_name
from plots.plate import Plate
from plots.springs_plate import NamedSprings, springs_plates


def plates_of_motion(path: Path) -> Iterator[Plate]:
    """Yield the plate of a motion in a file, of the figure that the file names.

    Raises:
        InputError: the motion or its figure cannot be read.
        MoverError: the motion is not one of the figure.
    """
    motion = read_motion(path)
    check_chains(motion.figure)
    yield motion_plate(motion, read_springs(None, motion.figure), plate_name(path.stem))


def plates_of_springs(path: Path, against: str | None) -> Iterator[Plate]:
    """Yield a plate for each curve of a springs file.

    Args:
        path: of the springs file.
        against: springs to draw beside them: a springs file, or the name of a figure.

    Raises:
        InputError: a file cannot be read.
    """
    own = _named_springs(path)
    other = None
    if against is not None and Path(against).suffix == path.suffix:
        other = _named_springs(Path(against))
    elif against is not None:
        other = NamedSprings(against, read_springs(None, read_figure(against)))
    yield from springs_plates(own, other)


def _named_springs(path: Path) -> NamedSprings:
    return NamedSprings(path.name, parse_springs_file(path).require_value().springs)
