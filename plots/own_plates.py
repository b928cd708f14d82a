"""Plates of a user's own files: motions and springs.

Matplotlib is slow to import, so the plates' modules are imported when they are drawn.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from generator.cli.inputs import check_chains
from generator.conversion import read_motion
from generator.diagnostics import Diagnostic, MoverError, UsageError, warning
from generator.figure import Figure
from generator.figure_file import read_figure
from generator.springs_file.read import load_springs, parse_springs_file, read_springs
from plots.plate import Plate, plate_name

if TYPE_CHECKING:
    from plots.springs_plate import NamedSprings


@dataclass(frozen=True)
class OwnFiles:
    """Files of a user that are drawn.

    Attributes:
        motions: files of motions.
        springs: a springs file: of the motions, or to be drawn itself.
        against: springs to draw beside it: a springs file, or the name of a figure.
    """

    motions: Sequence[Path] = ()
    springs: Path | None = None
    against: str | None = None

    def __bool__(self) -> bool:
        """Return whether there are any."""
        return bool(self.motions) or self.springs is not None

    @property
    def words(self) -> list[str]:
        """The words of the command that draws them."""
        words = [path.name for path in self.motions]
        if self.springs is not None:
            words += ["--springs", self.springs.name]
        return words + (["--against", self.against] if self.against is not None else [])

    def plates(self) -> tuple[list[Plate], list[Diagnostic]]:
        """Return the plates, with warnings.

        Raises:
            UsageError: two motions would have the same files.
            InputError: a file cannot be read.
            MoverError: a motion is not one of its figure, or there is nothing to draw.
        """
        if not self.motions:
            assert self.springs is not None
            return list(_plates_of_springs(self.springs, self.against)), []
        names = [plate_name(path.stem) for path in self.motions]
        for name in names:
            if names.count(name) > 1:
                raise UsageError(f"two motions would be written as `{name}`: draw them separately")
        drawn = [_plate_of_motion(path, self.springs) for path in self.motions]
        return [plate for plate, _ in drawn], [one for _, found in drawn for one in found]


def _plate_of_motion(path: Path, springs: Path | None) -> tuple[Plate, list[Diagnostic]]:
    """Return the plate of a motion of the figure that its file names, with warnings."""
    from plots.motion_plate import motion_plate

    motion = read_motion(path)
    check_chains(motion.figure)
    used = read_springs(springs, motion.figure)
    warnings: list[Diagnostic] = []
    if motion.recording is None and motion.header.springs != used.origin:
        warnings.append(
            warning(
                f"`{path}` is a motion with the springs `{motion.header.springs}`, but the moments "
                f"are drawn with `{used.origin}`",
                hint="name its springs with --springs, or draw the .npz of the run",
            )
        )
    return motion_plate(motion, used, plate_name(path.stem)), warnings


def _plates_of_springs(path: Path, against: str | None) -> Iterator[Plate]:
    """Yield a plate for each curve of a springs file."""
    from plots.springs_plate import NamedSprings, springs_plates

    own = parse_springs_file(path).require_value()
    figure = None if own.figure is None else _figure_of(own.figure, path)
    other = None
    if against is not None and Path(against).suffix == path.suffix:
        beside = parse_springs_file(Path(against)).require_value()
        if figure is None and beside.figure is not None:
            figure = _figure_of(beside.figure, Path(against))
        other = _named_springs(Path(against), figure)
    elif against is not None:
        figure = figure or read_figure(against)
        other = NamedSprings(against, read_springs(None, read_figure(against)))
    plates = list(springs_plates(_named_springs(path, figure), other))
    if not plates:
        raise MoverError(f"`{path}` has no curve to draw")
    if other is not None and not any(plate.has(other.name) for plate in plates):
        raise MoverError(f"`{against}` has no spring about an axis of `{path}`")
    yield from plates


def _figure_of(name: str, springs: Path) -> Figure | None:
    """Return the figure for which springs were written: beside them, or shipped."""
    beside = springs.parent / f"{name}.fig"
    return read_figure(beside if beside.is_file() else name)


def _named_springs(path: Path, figure: Figure | None) -> "NamedSprings":
    """Return a file's own springs, bound to a figure if one is known, so that axes have senses."""
    from plots.springs_plate import NamedSprings

    if figure is None:
        return NamedSprings(path.name, parse_springs_file(path).require_value().springs)
    bound = load_springs(figure, choice=path, with_base=False).require_value()
    return NamedSprings(path.name, bound.springs)
