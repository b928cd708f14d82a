"""Plates of a user's own files: motions, springs and folders of studies.

Matplotlib is slow to import, so the plates' modules are imported when they are drawn.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from generator.cli.inputs import load_motion
from generator.diagnostics import Diagnostic, MoverError, UsageError, warning
from generator.figure import Figure
from generator.figure_file import read_figure
from generator.springs_file.read import load_springs, load_springs_file, read_springs
from plots.plate import Plate, plate_name
from springs import SphericalLaw, SpringSet


@dataclass(frozen=True)
class OwnFiles:
    """Files of a user that are drawn.

    Attributes:
        motions: files of motions.
        studies: folders of studies, as `mover sweep` writes them.
        shares: tables of net and passive moments, as `mover inverse` writes them.
        springs: a springs file: of the motions, or to be drawn itself.
        against: springs to draw beside it: a springs file, or the name of a figure.
        figure: figure of the motions; None for the figures that they name.
    """

    motions: Sequence[Path] = ()
    studies: Sequence[Path] = ()
    springs: Path | None = None
    against: str | None = None
    figure: str | None = None
    shares: Sequence[Path] = ()

    def __bool__(self) -> bool:
        """Return whether there are any."""
        files = (*self.motions, *self.studies, *self.shares)
        return bool(files) or self.springs is not None

    @property
    def words(self) -> list[str]:
        """The words of the command that draws them."""
        words = [path.name for path in (*self.motions, *self.studies, *self.shares)]
        if self.springs is not None:
            words += ["--springs", self.springs.name]
        return words + (["--against", self.against] if self.against is not None else [])

    def plates(self) -> tuple[list[Plate], list[Diagnostic]]:
        """Return the plates, with warnings.

        Raises:
            UsageError: two motions or two studies would have the same files.
            InputError: a file cannot be read.
            MoverError: a motion is not one of its figure, or there is nothing to draw.
        """
        if self.studies:
            from plots.study_plate import study_plates

            found = [plate for folder in self.studies for plate in study_plates(folder)]
            _check_distinct([plate.name for plate in found], "studies")
            return found, []
        if self.shares:
            from plots.share_plate import share_plate

            _check_distinct([plate_name(path.stem) for path in self.shares], "tables")
            return [share_plate(path, plate_name(path.stem)) for path in self.shares], []
        if not self.motions:
            assert self.springs is not None
            return _plates_of_springs(self.springs, self.against)
        _check_distinct([plate_name(path.stem) for path in self.motions], "motions")
        drawn = [_plate_of_motion(path, self.springs, self.figure) for path in self.motions]
        return [plate for plate, _ in drawn], [one for _, more in drawn for one in more]


def _check_distinct(names: Sequence[str], things: str) -> None:
    """Raise UsageError for a name that occurs twice."""
    for name in names:
        if names.count(name) > 1:
            raise UsageError(f"two {things} would be written as `{name}`: draw them separately")


def _plate_of_motion(
    path: Path, springs: Path | None, figure_name: str | None
) -> tuple[Plate, list[Diagnostic]]:
    """Return the plate of a motion, of its own figure or the one of this name, with warnings."""
    from plots.motion_plate import motion_plate

    motion, found = load_motion(path, figure_name)
    if motion.recording is not None and springs is not None:
        raise UsageError(f"`{path}` has the moments of its run: leave out --springs")
    figure, laws = motion.figure, [law.value for law in SphericalLaw]
    law = SphericalLaw(motion.header.law) if motion.header.law in laws else None
    used = read_springs(springs, figure, law)
    warnings = list(found)
    if motion.recording is None and motion.header.springs != used.origin:
        warnings.append(
            warning(
                f"`{path}` is a motion with the springs `{motion.header.springs}`, but the moments "
                f"are drawn with `{used.origin}`",
                hint="name its springs with --springs, or draw the .npz of the run",
            )
        )
    return motion_plate(motion, used, plate_name(path.stem)), warnings


def _plates_of_springs(path: Path, against: str | None) -> tuple[list[Plate], list[Diagnostic]]:
    """Return a plate for each curve of a springs file, with warnings.

    A file that names no figure is bound to that of the other springs, so that axes have senses.
    """
    from plots.springs_plate import NamedSprings, springs_plates

    parsed = load_springs_file(path)
    (own, _, own_figure), warnings = parsed.require_value(), list(parsed.diagnostics)
    other = owner = None
    if against is not None and Path(against).suffix == path.suffix:
        beside = load_springs_file(Path(against))
        warnings += beside.diagnostics
        name = Path(against).name if Path(against).name != path.name else against
        springs, _, owner = beside.require_value()
        if owner is None:
            springs = _bound(Path(against), springs, own_figure)
        other = NamedSprings(name, springs)
    elif against is not None:
        owner = read_figure(against)
        other = NamedSprings(against, read_springs(None, owner))
    if own_figure is None:
        own = _bound(path, own, owner)
    named = NamedSprings(path.name, own)
    if other is not None and other.name in (named.name, str(path)):
        named = NamedSprings(str(path), named.springs)
    plates = list(springs_plates(named, other))
    if not plates:
        raise MoverError(f"`{path}` has no curve to draw")
    if other is not None and not named.shares_axis(other):
        raise MoverError(f"`{against}` has no spring about an axis of `{path}`")
    return plates, warnings


def _bound(path: Path, springs: SpringSet, owner: Figure | None) -> SpringSet:
    """Return the springs of a file that names no figure, bound to `owner` if there is one."""
    if owner is None:
        return springs
    return load_springs(owner, choice=path, with_base=False).require_value()
