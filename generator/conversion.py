"""Conversion of motions, figures and other programs' models, as `mover convert` does it."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from numpy.typing import ArrayLike

from generator.diagnostics import Diagnostic, InputError, UsageError, error
from generator.figure import Figure
from generator.figure_file.read import FIGURE_FILE, read_figure
from generator.input_files.coordinates import Coordinates
from generator.kinematics.free_root import detach_root
from generator.kinematics.loops import close_loops
from generator.kinematics.placement import (
    Placement,
    checked_joint_values,
    initial_displacements,
    pose_figure,
)
from generator.kinematics.tree import build_tree
from generator.losses import Losses
from generator.model_files.formats import (
    MODEL_FORMATS,
    SUFFIXES,
    ModelFormat,
    model_format,
    read_model,
)
from generator.model_files.imported import imported_files
from generator.motion_files import (
    COORDINATES_FILE,
    MOTION_FORMATS,
    FigureMotion,
    motion_from_action,
    motion_from_coordinates,
    motion_from_recording,
    motion_writer,
    read_action,
    read_npz,
)
from generator.motion_files.motion import file_sha256, motion_from_figure
from generator.motion_files.resample import resample
from generator.recording import Recording
from generator.springs_file.read import read_springs
from springs import SpringSet

ACTION_SUFFIX, NPZ_SUFFIX, COORDINATE_SUFFIXES = ".action", ".npz", (".mot", ".sto")
BVH_SUFFIX = ".bvh"
MACRO_SUFFIX = ".xacro"
READABLE_SUFFIXES = (ACTION_SUFFIX, NPZ_SUFFIX, *COORDINATE_SUFFIXES)
"""Motion formats that can be read."""


def is_model(source: str) -> bool:
    """Return whether a source is a model: a file by its suffix, or a folder."""
    path = Path(source)
    is_folder = path.is_dir() and source not in FIGURE_FILE.shipped()
    return is_folder or path.suffix.lower() in SUFFIXES


def check_no_macros(source: str) -> None:
    """Raise UsageError for a model that is still to be written out."""
    path = Path(source)
    if path.suffix.lower() == MACRO_SUFFIX:
        written = path.stem if Path(path.stem).suffix else f"{path.stem}.urdf"
        raise UsageError(
            f"{path}: the macros of xacro are not read; write the model out with "
            f"`xacro {path.name} -o {written}` and convert {written}"
        )


def check_readable(path: Path) -> None:
    """Raise UsageError unless the suffix is that of a motion that can be read."""
    if path.suffix.lower() not in READABLE_SUFFIXES:
        known = ", ".join(READABLE_SUFFIXES)
        raise UsageError(f"{path}: motions are read from {known}, not from other formats")


def find_named_figure(figure: str, sha256: str | None, motion: Path) -> Path:
    """Return the file of a figure of this name: beside a motion, or shipped.

    A file with the checksum has precedence. Raises InputError without any.
    """
    beside = motion.parent / figure
    shipped = {each.name: each for each in FIGURE_FILE.shipped().values()}.get(figure)
    digests = {each: file_sha256(each) for each in (beside, shipped) if each is not None}
    found = [each for each, digest in digests.items() if digest is not None]
    if not found:
        message = f"`{motion}` is a motion of `{figure}`, which is not beside it"
        raise InputError([error(message, hint="name the figure with --figure")])
    return next((each for each in found if digests[each] == sha256), found[0])


def convert(
    source: str | Path | Figure | Recording,
    *outputs: str | Path,
    figure: str | Path | Figure | None = None,
    springs: str | Path | SpringSet | None = None,
    displacements: Mapping[str, ArrayLike] | None = None,
    free_root: bool = False,
    fps: float | None = None,
    scale: float | None = None,
) -> Mapping[Path, Losses]:
    """Write a motion, a figure or a model in the formats of the outputs' suffixes.

    In a format of motions a figure is a motion of one frame, its pose.

    Args:
        source: a `Recording`; the path of a motion (`.action .npz .mot .sto`); a `Figure`, its path
            or the name of a shipped one; or another program's model, which becomes a figure.
        outputs: paths of files; each is written whole or not at all, one after the other.
        figure: figure of the motion; of a motion's file None takes the one that it names.
        springs: springs of a figure, as `read_springs` takes them; None for those that a run has.
        displacements: displacements of joints of a figure [rad or m], in place of those of its
            file; loops are closed as at the start of a run.
        free_root: remove the joints of a figure to the ground, as a run with a free root does.
        fps: frames per second to which a motion is interpolated; None keeps its frames.
        scale: units of length of a `.bvh` in a metre [default: 100].

    Returns:
        What each file could not hold.

    Raises:
        UsageError: a format is unknown, or an argument does not fit the source.
        InputError: a file cannot be read or is wrong.
        MoverError: a format cannot hold the source.
        OSError: a file cannot be written.
    """
    paths = [Path(output) for output in outputs]
    check_scale(paths, scale)
    if isinstance(source, str | Path):
        check_no_macros(str(source))
    motion = _motion(source, figure)
    has_model = motion is None and not isinstance(source, Figure) and is_model(str(source))
    starts = springs is not None or displacements is not None or free_root
    if starts and (motion is not None or has_model):
        raise UsageError("`springs`, `displacements` and `free_root` are for figures")
    if motion is not None:
        writers = [motion_writer(path, scale) for path in paths]
        motion = motion if fps is None else resample(motion, fps)
        return {path: write(motion, path) for path, write in zip(paths, writers, strict=True)}
    if figure is not None or fps is not None:
        raise UsageError("`figure` and `fps` are for motions")
    if has_model:
        return _convert_model(str(source), paths)
    described = source if isinstance(source, Figure) else read_figure(str(source))
    if not isinstance(springs, SpringSet):
        springs = read_springs(springs, described)
    start = StartedFigure(described, springs)
    if displacements is not None or free_root:
        placement = start_placement(described, displacements or {})
        start = figure_at_start(placement, springs, free_root=free_root)
    formats = [(path, figure_format(path, free_root=free_root)) for path in paths]
    writes: list[Callable[[], Losses]] = [
        partial(motion_writer(path, scale), start.motion(described), path)
        if each is None
        else each.format_files(start.figure, start.springs, path).write
        for path, each in formats
    ]
    return {path: write() for path, write in zip(paths, writes, strict=True)}


def check_scale(paths: Iterable[Path], scale: float | None) -> None:
    """Raise UsageError for a scale without a file that has one."""
    if scale is not None and all(path.suffix.lower() != BVH_SUFFIX for path in paths):
        raise UsageError(f"a scale is for {BVH_SUFFIX} files")


@dataclass(frozen=True)
class StartedFigure:
    """A figure as it is at the start of a run, with its springs."""

    figure: Figure
    springs: SpringSet

    def motion(self, described: Figure) -> FigureMotion:
        """The pose as a motion of one frame, of the figure as its file describes it."""
        motion = motion_from_figure(self.figure)
        law = self.springs.law.value
        header = replace(motion.header, springs=self.springs.origin, law=law)
        return replace(motion, figure=described, header=header, springs=self.springs)


def start_placement(figure: Figure, displacements: Mapping[str, ArrayLike]) -> Placement:
    """Place a figure as a run from these displacements of some joints [rad or m] starts.

    Raises:
        UnknownNameError: the figure has no joint of a name.
        ModelError: the values do not fit a joint.
        OpenLoopError: the loops cannot be closed.
    """
    tree, chosen = build_tree(figure), checked_joint_values(figure, displacements)
    return close_loops(tree, {**initial_displacements(tree), **chosen}, fixed=set(chosen))


def figure_at_start(
    placement: Placement, springs: SpringSet, *, free_root: bool = False
) -> StartedFigure:
    """Return a figure and its springs as they are at the start of a run.

    Args:
        placement: placement of the figure at the start.
        springs: springs of the figure.
        free_root: remove the joints to the ground, and their springs.
    """
    figure, displacements = placement.tree.figure, placement.displacements
    if free_root:
        figure, displacements = detach_root(figure, displacements)
        springs = springs.of_joints(figure.joints)
    return StartedFigure(pose_figure(figure, displacements), springs)


def figure_format(
    path: Path, name: str | None = None, *, free_root: bool = False
) -> ModelFormat | None:
    """Return the format in which a figure is written; None for a format of motions.

    Args:
        path: path of the output.
        name: name of a format of models, whatever the suffix.
        free_root: the figure is without its joints to the ground.

    Raises:
        UsageError: the suffix or the name is unknown, or a figure file shall have a free root.
    """
    suffix = path.suffix.lower()
    of_models = any(each.has_suffix(path) for each in MODEL_FORMATS.values())
    if name is None and suffix in MOTION_FORMATS and not of_models:
        if suffix == NPZ_SUFFIX:
            raise UsageError(
                f"{path}: an {NPZ_SUFFIX} is the motion of a run, and this is a figure"
            )
        return None
    found = model_format(path, name)
    if free_root and FIGURE_FILE.suffix in found.suffixes:
        raise UsageError(
            f"{path}: a figure file keeps its joints to the ground; `mover simulate --free-root` "
            "lets the figure go"
        )
    return found


def _motion(
    source: str | Path | Figure | Recording, figure: str | Path | Figure | None
) -> FigureMotion | None:
    """Return the motion that a source is; None for a figure or a model."""
    if isinstance(figure, str | Path):
        figure = read_figure(figure)
    if isinstance(source, Recording):
        return motion_from_recording(source, figure)
    if isinstance(source, Figure):
        return None
    path = Path(source)
    return read_motion(path, figure) if path.suffix.lower() in READABLE_SUFFIXES else None


def read_motion(path: Path, figure: Figure | None = None) -> FigureMotion:
    """Read a motion from a file; warnings pass.

    Args:
        path: one of `READABLE_SUFFIXES`.
        figure: figure whose motion it is; None for the figure that the file names.

    Raises:
        UsageError: motions are not read from files of this suffix.
        InputError: the file or the figure cannot be read.
    """
    return read_motion_with_warnings(path, figure)[0]


def read_motion_with_warnings(
    path: Path, figure: Figure | None = None, coordinates: Coordinates | None = None
) -> tuple[FigureMotion, tuple[Diagnostic, ...]]:
    """Read a motion as `read_motion` does, with warnings about the columns of a table.

    `coordinates` are those of the model that the figure is from; None for those beside its file.
    """
    check_readable(path)
    suffix = path.suffix.lower()
    if suffix == ACTION_SUFFIX:
        action = read_action(path)
        owner = figure or _read_named_figure(action.header.figure, action.header.sha256, path)
        return motion_from_action(action, owner), ()
    if suffix in COORDINATE_SUFFIXES:
        table = COORDINATES_FILE.parse_file(path).require_value()
        owner = figure or _read_named_figure(table.figure, table.sha256, path)
        parsed = motion_from_coordinates(table, owner, coordinates)
        return parsed.require_value(), parsed.diagnostics
    header, recording = read_npz(path)
    owner = figure or _read_named_figure(header.figure, header.sha256, path)
    return replace(motion_from_recording(recording, owner), header=header), ()


def _read_named_figure(name: str | None, sha256: str | None, motion: Path) -> Figure:
    """Read the figure that a motion names. Raises InputError."""
    if name is None:
        message = f"`{motion}` does not name its figure"
        raise InputError([error(message, hint="name the figure with --figure")])
    return read_figure(find_named_figure(name, sha256, motion))


def _convert_model(source: str, paths: list[Path]) -> dict[Path, Losses]:
    """Write the figure of a model, with a springs file beside it if it has springs."""
    for path in paths:
        if path.suffix.lower() != FIGURE_FILE.suffix:
            raise UsageError(f"{path}: a model becomes a figure, {FIGURE_FILE.suffix}")
    imported = read_model(source)
    return {path: imported_files(imported, path).write() for path in paths}
