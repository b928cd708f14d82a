"""Conversion of motions, figures and other programs' models, as `mover convert` does it."""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from generator.contact.scene import NO_SCENE
from generator.contact.states import ContactModel
from generator.diagnostics import Diagnostic, Diagnostics, InputError, UsageError, error
from generator.figure import Figure
from generator.figure_file.read import FIGURE_FILE, read_figure
from generator.input_files.coordinates import (
    Coordinates,
    coordinates_of_figure,
    displacement_columns,
)
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
from generator.model import Model, contact_of_figure
from generator.model_files.export_model import Start
from generator.model_files.formats import (
    MODEL_FORMATS,
    SUFFIXES,
    ModelFormat,
    model_format,
    read_model,
)
from generator.model_files.mjcf.track import Motion, track_of_motion
from generator.model_files.model_files import ModelFiles, imported_files
from generator.model_files.xml import XmlElement, parse_xml
from generator.motion_files import (
    COORDINATES_FILE,
    MOTION_FORMATS,
    FigureMotion,
    MotionWriter,
    motion_from_action,
    motion_from_coordinates,
    motion_from_recording,
    motion_writer,
    read_action,
    read_npz,
)
from generator.motion_files.motion import NO_FIGURE, file_sha256, motion_from_figure, unrepresented
from generator.motion_files.opensim_table import follows
from generator.motion_files.resample import resample
from generator.recording import Recording
from generator.simulation.plan import STANDARD_GRAVITY, Plan
from generator.springs_file.read import read_springs
from generator.text_io import load_text, write_atomic
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
    plan: Plan | None = None,
    fps: float | None = None,
    scale: float | None = None,
    model: str | Path | None = None,
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
        plan: Start of a run of a figure, such as `fall_plan(figure, "faint")`, in place of the last
            two, with the props of its scene; a MuJoCo model then has them and contact spheres.
        fps: frames per second to which a motion is interpolated; None keeps its frames.
        scale: units of length of a `.bvh` in a metre [default: 100].
        model: Model of another program on which the motion shall play: of MuJoCo for its positions
            in an `.npz`, of OpenSim for a `.mot` or `.sto`.

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
    moved = displacements is not None or free_root
    starts = springs is not None or moved or plan is not None
    if starts and (motion is not None or has_model):
        raise UsageError("`springs`, `displacements`, `free_root` and `plan` are for figures")
    if motion is not None:
        writers = [motion_writer_for(path, scale, model) for path in paths]
        motion = motion if fps is None else resample(motion, fps)
        return {path: write(motion, path) for path, write in zip(paths, writers, strict=True)}
    if figure is not None or fps is not None or model is not None:
        raise UsageError("`figure`, `fps` and `model` are for motions")
    if has_model:
        return _convert_model(str(source), paths)
    described = source if isinstance(source, Figure) else read_figure(str(source))
    if not isinstance(springs, SpringSet):
        springs = read_springs(springs, described)
    start = StartedFigure(described, springs)
    if plan is not None and moved:
        raise UsageError("a plan has the displacements and the free root of its start")
    if plan is not None:
        start = figure_of_plan(Model(described, springs, contact_of_figure(described)), plan)
        free_root = plan.free_root
    elif moved:
        placement = start_placement(described, displacements or {})
        start = figure_at_start(placement, springs, free_root=free_root)
    formats = [(path, figure_format(path, free_root=free_root)) for path in paths]
    writes: list[Callable[[], Losses]] = [
        partial(motion_writer(path, scale), start.motion(described), path)
        if each is None
        else start.files(each, path).write
        for path, each in formats
    ]
    return {path: write() for path, write in zip(paths, writes, strict=True)}


def check_scale(paths: Iterable[Path], scale: float | None) -> None:
    """Raise UsageError for a scale without a file that has one."""
    if scale is not None and all(path.suffix.lower() != BVH_SUFFIX for path in paths):
        raise UsageError(f"a scale is for {BVH_SUFFIX} files")


@dataclass(frozen=True)
class StartedFigure:
    """A figure as it is at the start of a run, with its springs, contact and rates."""

    figure: Figure
    springs: SpringSet
    start: Start | None = None

    def files(self, form: ModelFormat, path: Path) -> ModelFiles:
        """Return the files of the model at a path in a format."""
        return form.files(self.figure, self.springs, path, self.start)

    def motion(self, described: Figure) -> FigureMotion:
        """The pose as a motion of one frame, of the figure as its file describes it."""
        motion = motion_from_figure(self.figure)
        law = self.springs.law.value
        header = replace(motion.header, springs=self.springs.origin, law=law)
        contact = None if self.start is None else self.start.contact
        scene = NO_SCENE if contact is None else contact.scene
        return replace(motion, figure=described, header=header, springs=self.springs, scene=scene)


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


def figure_of_plan(model: Model, plan: Plan) -> StartedFigure:
    """Return a figure as it is at the start of a plan, with its contact with the plan's props.

    Raises:
        ModelError: the figure cannot start so; see `initial_state`.
        InputError: a psurf cannot be read.
    """
    from generator.simulation.run_model import initial_state  # takes long

    state = initial_state(model.figure, plan, model.contact)
    figure = state.placement.tree.figure
    contact = ContactModel(plan.scene, state.spheres, (), state.part_laws)
    others = {
        "tone of muscles": plan.tone is not None,
        "self-contact": plan.self_contact,
        "loads that vary in time": bool(plan.loads),
        "drives, links and locks of joints": bool(plan.drives or plan.locked or plan.links.links),
        "gravity other than 9.81 m/s^2 downwards": plan.gravity != STANDARD_GRAVITY,
    }
    left_out = tuple(name for name, acts in others.items() if acts)
    start = Start(contact if state.spheres else None, state.rates, left_out)
    posed = pose_figure(figure, state.placement.displacements)
    return StartedFigure(posed, model.springs.of_joints(figure.joints), start)


def motion_writer_for(path: Path, scale: float | None, model: str | Path | None) -> MotionWriter:
    """Return the writer of a motion, for a model on which it shall play.

    Args:
        path: path of the output.
        scale: units of length of a `.bvh` in a metre.
        model: Path of the model; None for a file of the motion alone.

    Raises:
        UsageError: the suffix is unknown, or no file is for such a model.
        InputError: the model cannot be read.
    """
    if model is None:
        return motion_writer(path, scale)
    parsed = load_text(Path(model), str(model))
    if parsed[1] is not None:
        raise InputError([parsed[1]])
    diagnostics = Diagnostics()
    root = parse_xml(parsed[0], diagnostics)
    if root is None:
        raise InputError(diagnostics.sorted_by_position())
    kind, suffix = MODEL_TAGS.get(root.tag, ""), path.suffix.lower()
    if kind == "MuJoCo" and suffix == NPZ_SUFFIX:
        return partial(_write_track, root)
    if kind == "OpenSim" and suffix in COORDINATE_SUFFIXES:
        known = {each.get("name") for each in root.walk() if each.tag == "Coordinate"}
        return partial(_write_checked, motion_writer(path, scale), {*filter(None, known)})
    raise UsageError(
        f"{path}: a MuJoCo model plays the {NPZ_SUFFIX} of a motion, an OpenSim model its "
        f"{' or '.join(COORDINATE_SUFFIXES)}; {model} is {f'of {kind}' if kind else 'neither'}"
    )


MODEL_TAGS: Mapping[str, str] = {"mujoco": "MuJoCo", "OpenSimDocument": "OpenSim"}
"""Programs of models on which a motion plays, by the tags of their roots."""


def _write_track(root: XmlElement, motion: FigureMotion, path: Path) -> Losses:
    """Write `time`, `qpos` and, of a run, `qvel` of a MuJoCo model."""
    run = motion.recording
    rates = None if run is None or not run.velocities else run.velocities
    track = track_of_motion(root, Motion(motion.tree, motion.displacements, motion.poses, rates))
    arrays = {"time": motion.times, "qpos": track.qpos}
    losses = Losses.collect("positions of a MuJoCo model", [NO_FIGURE, unrepresented(motion)])
    geoms = {each.get("name") for each in root.walk() if each.tag == "geom"}
    lacking = [prop.name for prop in motion.scene.props if prop.name not in geoms]
    if lacking:
        losses.add("props of the scene, which the model lacks as well", *lacking)
    if track.qvel is None:
        losses.add("speeds, `qvel`, which the motion does not have")
    else:
        arrays["qvel"] = track.qvel
    stream = BytesIO()
    np.savez_compressed(stream, allow_pickle=False, **arrays)
    write_atomic(path, stream.getvalue())
    return losses


def _write_checked(
    write: MotionWriter, known: Collection[str], motion: FigureMotion, path: Path
) -> Losses:
    """Write the displacements of a motion for an OpenSim model with these coordinates.

    Raises InputError for a model that lacks some of them, such as one without a free root.
    """
    moving = {branch.joint.name for branch in motion.tree.joints}
    coordinates = motion.coordinates
    if coordinates is None:
        coordinates = coordinates_of_figure(motion.figure)
    missing = [
        name
        for name, at in displacement_columns(motion.chains, coordinates).items()
        if at.joint in moving and name not in known and not follows(motion.figure, at)
    ]
    if missing:
        message = f"the model has no coordinates {', '.join(missing[:6])}, which the motion moves"
        hint = "write the model with --free-root, and the start of the run"
        raise InputError([error(message, hint=hint)])
    return write(motion, path)


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
    path: Path,
    figure: Figure | None = None,
    coordinates: Coordinates | None = None,
    *,
    is_whole: bool = False,
) -> tuple[FigureMotion, tuple[Diagnostic, ...]]:
    """Read a motion as `read_motion` does, with warnings about the columns of a table.

    `coordinates` are those of the model that the figure is from; None for those beside its file.
    With `is_whole` a displacement without a column is an error.
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
        parsed = motion_from_coordinates(table, owner, coordinates, is_whole=is_whole)
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
