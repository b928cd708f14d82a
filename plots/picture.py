"""`mover picture`: shaded pictures of a figure, a pose or moments of a motion, and videos."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray

from generator.cli.answer import CommandResult, Paragraphs, format_count
from generator.cli.inputs import (
    check_segment_distances,
    load_figure,
    load_motion,
    placement_from_options,
    range_warnings,
)
from generator.cli.outputs import (
    OutputWriter,
    check_distinct_paths,
    check_writable,
    suffix_fault,
    write_all_or_none,
)
from generator.cli.progress import item_progress_bar, no_monitor
from generator.contact.appearance import is_level
from generator.contact.arrows import ArrowScale, part_forces_at
from generator.contact.scene import NO_SCENE, Scene
from generator.conversion import check_readable
from generator.diagnostics import Diagnostic, MoverError, UsageError
from generator.figure import Figure
from generator.input_files.pose import POSE_FILE
from generator.input_files.scene import read_scene
from generator.kinematics.placement import Placement, batched_placements
from generator.losses import Loss, Losses
from generator.motion_files import MOTION_FORMATS, FigureMotion
from generator.rotations import Array
from generator.springs_file.read import read_springs
from generator.text_io import write_atomic
from plots.figure_image import Body, Poses, View, arrow_triangles, draw_moments
from plots.framing import (
    Size,
    bounds,
    floor_height,
    frame_moments,
    scaled,
    size_from_options,
    view_from_options,
)
from plots.video import VIDEO_FORMATS, Film

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

IMAGE_FORMATS = (".png", ".svg", ".pdf")

DEFAULT_FPS = 30.0
_FONT_SIZE, _LABEL_HEIGHT = 9.0, 2.0
"""Size of the labels [points], and height of their line relative to it."""

_LABEL_LENGTH = 4.5
"""Width of a label with its gap, relative to its size."""

_CAPTION_LETTER = 0.6
"""Width of a letter of the caption, relative to its size, at most on average."""

_LABEL_GREY = "#808080"
"""Colour of the labels on a transparent background: readable on white and on black."""


@dataclass(frozen=True)
class Subject:
    """A figure in a pose, or at moments of a motion, with the files and warnings of reading it.

    `with_forces` tells whether contact forces are drawn.
    """

    body: Body
    placement: Placement | None
    motion: FigureMotion | None
    inputs: tuple[str | Path | None, ...]
    warnings: tuple[Diagnostic, ...]
    with_forces: bool = True

    def moments(self, times: Sequence[float]) -> list[Poses]:
        """Poses at times of the motion [s], or the pose once."""
        return [self.placement.poses] if self.placement else list(self._interpolate(times))

    def arrows(self, times: Sequence[float]) -> list[Array]:
        """Triangles of the contact forces at times of the motion [s], shape (n, 3, 3) each [m].

        Those of a pose, and of a motion without such forces, have no triangle.
        """
        run = None if self.motion is None else self.motion.recording
        found: Mapping[str, tuple[Array, Array]] = {}
        if self.with_forces and run is not None and run.contact is not None:
            found = part_forces_at(run.contact, run.times, np.array(times))
        if self._arrow_scale is None or not found:
            return [np.empty((0, 3, 3))] * max(len(times), 1)
        forces, points = (np.stack(some, axis=1) for some in zip(*found.values(), strict=True))
        return [
            arrow_triangles(self._arrow_scale.arrows(*one), self._arrow_scale)
            for one in zip(forces, points, strict=True)
        ]

    def caption(self, arrows: Sequence[Array]) -> str:
        """The scale of arrows in words; "" where there are none."""
        if self._arrow_scale is None or not any(len(each) for each in arrows):
            return ""
        return self._arrow_scale.text

    @property
    def has_forces(self) -> bool:
        """Return whether contact forces of a run are drawn."""
        run = None if self.motion is None else self.motion.recording
        return self.with_forces and bool(run and run.contact and run.contact.part_forces)

    @cached_property
    def _arrow_scale(self) -> ArrowScale | None:
        if self.motion is None:
            return None
        first = {name: poses[0] for name, poses in self.motion.poses.items()}
        return ArrowScale.of_figure(self.motion.figure, first)

    def _interpolate(self, times: Sequence[float]) -> Iterator[Poses]:
        assert self.motion is not None, "a subject has a pose or a motion"
        motion = self.motion
        rows = {
            name: np.array([np.interp(times, motion.times, row) for row in values.T], dtype=float)
            .reshape(-1, len(times))
            .T
            for name, values in motion.displacements.items()
        }
        for placement in batched_placements(motion.tree, rows):
            check_segment_distances(placement)
            stacked = np.broadcast_arrays(*placement.poses.values())
            for poses in zip(*(each.reshape(-1, 4, 4) for each in stacked), strict=True):
                yield dict(zip(placement.poses, poses, strict=True))


def time_labels(times: Sequence[float]) -> list[str]:
    """Labels of times [s], with as many decimals, up to three, as they all need."""
    for digits in range(3):
        if all(abs(round(time, digits) - time) < 1e-6 for time in times):
            break
    else:
        steps = np.diff(sorted(times))
        digits = 2 if not len(steps) or steps.min() > 0.02 else 3
    return [f"{round(time, digits) + 0.0:.{digits}f} s" for time in times]


@dataclass(frozen=True)
class Picture:
    """Moments side by side, with labels.

    Attributes:
        image: shape (rows, columns, 4), rows from above.
        labels: column of the middle, and text.
        dpi: [dots/inch].
        transparent: leave out the background.
        caption: scale of the forces, below all; "" for none.
    """

    image: NDArray[np.uint8]
    labels: Sequence[tuple[float, str]]
    dpi: float
    transparent: bool
    caption: str = ""

    @cached_property
    def font_size(self) -> float:
        """Size of the labels, which must not overlap [points]."""
        middles = [column for column, _ in self.labels]
        widths = [self.image.shape[1], *np.diff(middles).tolist()]
        return min(_FONT_SIZE, min(widths) * 72.0 / self.dpi / _LABEL_LENGTH)

    @property
    def shape(self) -> tuple[int, int]:
        """Columns and rows with the labels and the caption [pixels]."""
        rows, columns = self.image.shape[:2]
        return columns, rows + sum(self._lines)

    @property
    def _lines(self) -> tuple[int, int]:
        """Heights of the lines of the labels and of the caption [pixels]."""
        label = _line_height(self.font_size, self.dpi) if self.labels else 0
        size = caption_size(self.caption, self.image.shape[1], self.dpi)
        return label, _line_height(size, self.dpi) if self.caption else 0

    def write(self, path: Path, kind: str) -> Losses:
        """Write the picture as png, svg or pdf. The last two hold pixels, and labels as outlines.

        Raises OSError if the file cannot be written.
        """
        from plots.canvas import render_figure  # matplotlib is slow to import

        write_atomic(path, render_figure(self._canvas(), kind, self.dpi))
        return Losses(kind)

    def _canvas(self) -> "Canvas":
        from matplotlib.figure import Figure

        from plots.canvas import plot_style

        columns, rows = self.shape
        share = self.image.shape[0] / rows
        with plot_style():
            # Matplotlib rounds the number of pixels down.
            size = ((columns + 0.01) / self.dpi, (rows + 0.01) / self.dpi)
            canvas = Figure(figsize=size, dpi=self.dpi)
            canvas.patch.set_facecolor("none" if self.transparent else "white")
            axes = canvas.add_axes((0.0, 1.0 - share, 1.0, share))
            axes.set_axis_off()
            image = self.image if self.transparent else on_white(self.image)
            axes.imshow(image, interpolation="none", aspect="auto", resample=False)
            colour = _LABEL_GREY if self.transparent else "black"
            line, caption = self._lines
            look: dict[str, Any] = {"ha": "center", "va": "center", "color": colour}
            height = (caption + 0.5 * line) / rows
            for column, text in self.labels:
                canvas.text(column / columns, height, text, fontsize=self.font_size, **look)
            _write_caption(canvas, self.caption, (columns, rows, caption), self.dpi, colour)
        return canvas


def _line_height(font_size: float, dpi: float) -> int:
    """Height of a line of text of a size [points], in pixels."""
    return round(_LABEL_HEIGHT * font_size * dpi / 72.0)


def caption_size(text: str, columns: int, dpi: float) -> float:
    """Size of a caption that fits so many columns [points]."""
    return min(_FONT_SIZE, columns * 72.0 / dpi / (_CAPTION_LETTER * max(len(text), 1)))


def _write_caption(
    canvas: "Canvas", text: str, size: tuple[int, int, int], dpi: float, colour: str
) -> None:
    """Write a caption at the lower edge of columns and rows, as a line of a height [pixels]."""
    columns, rows, line = size
    if text:
        look: dict[str, Any] = {"ha": "center", "va": "center", "color": colour}
        canvas.text(0.5, 0.5 * line / rows, text, fontsize=caption_size(text, columns, dpi), **look)


def caption_image(text: str, columns: int, dpi: float) -> NDArray[np.uint8]:
    """Return a caption on white, as a picture of shape (rows, columns, 3)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from plots.canvas import plot_style

    rows = _line_height(caption_size(text, columns, dpi), dpi)
    with plot_style():
        canvas = Figure(figsize=((columns + 0.01) / dpi, (rows + 0.01) / dpi), dpi=dpi)
        canvas.patch.set_facecolor("white")
        _write_caption(canvas, text, (columns, rows, rows), dpi, "black")
        agg = FigureCanvasAgg(canvas)
        agg.draw()
        return np.asarray(agg.buffer_rgba())[..., :3].copy()


def on_white(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a picture on a white background, shape (rows, columns, 3)."""
    alpha = image[..., 3:].astype(np.uint16)
    return ((image[..., :3] * alpha + 255 * (255 - alpha) + 127) // 255).astype(np.uint8)


def _moments(
    subject: Subject, times: Sequence[float], view: View, scene: Scene
) -> tuple[list[Poses], list[Array], list[Array]]:
    """Return the poses of a subject at times, its arrows and its bounds, one each."""
    moments, arrows = subject.moments(times), subject.arrows(times)
    both = zip(moments, arrows, strict=True)
    limits = [bounds(subject.body, poses, scene, view, own) for poses, own in both]
    return moments, arrows, limits


def draw_picture(
    subject: Subject,
    times: Sequence[float],
    view: View,
    scene: Scene,
    floor: float | None,
    size: Size,
    *,
    labelled: bool,
    transparent: bool,
) -> Picture:
    """Draw a pose, or moments of a motion [s]. Raises UsageError and MoverError."""
    moments, arrows, limits = _moments(subject, times, view, scene)
    strip = scaled(frame_moments(limits, view, floor), len(moments), size)
    labels: list[tuple[float, str]] = []
    if labelled:
        for place, text in enumerate(time_labels(times)):
            own = bounds(subject.body, moments[place], Scene(), view)
            middle = 0.5 * float(own[0, 0] + own[1, 0]) + place * strip.spacing
            labels.append((strip.scale * (middle - strip.left), text))
    image = draw_moments(subject.body, moments, strip, scene, arrows)
    return Picture(image, labels, size.dpi, transparent, subject.caption(arrows))


def film_times(times: Array, fps: float) -> list[float]:
    """Times of the frames of a video, from the first time of a motion to the last [s]."""
    count = int((times[-1] - times[0]) * fps + 1e-6) + 1
    return [min(float(times[0]) + k / fps, float(times[-1])) for k in range(count)]


def make_film(
    subject: Subject, view: View, scene: Scene, floor: float | None, size: Size, fps: float
) -> Film:
    """Return the video of a motion; its frames show what moves whole. Raises UsageError."""
    assert subject.motion is not None, "a video needs a motion"
    times = film_times(subject.motion.times, fps)
    moments, arrows, limits = _moments(subject, times, view, scene)
    low, high = np.swapaxes(limits, 0, 1)
    whole = np.stack([low.min(axis=0), high.max(axis=0)])
    strip = scaled(frame_moments([whole], view, floor), 1, size)
    caption = subject.caption(arrows)
    below = [caption_image(caption, strip.shape(1)[1], size.dpi)] if caption else []

    def draw(frame: int) -> NDArray[np.uint8]:
        drawn = draw_moments(subject.body, [moments[frame]], strip, scene, [arrows[frame]])
        image = np.concatenate([on_white(drawn), *below])
        # Encoders need even numbers of rows and columns.
        rows, columns = image.shape[0] % 2, image.shape[1] % 2
        return np.pad(image, ((rows, 0), (0, columns), (0, 0)), mode="edge")

    return Film(len(times), fps, draw)


def read_subject(
    source: str, figure_name: str | None, pose: Path | None, sets: Sequence[str]
) -> Subject:
    """Read what is drawn: a figure, a pose of one, or a motion.

    Raises:
        UsageError: options do not fit the source.
        InputError: a file is wrong.
        MoverError: loops cannot be closed, or the motion is of another figure.
    """
    path = Path(source)
    suffix = path.suffix.lower()
    if suffix in MOTION_FORMATS:
        return _read_moving(path, figure_name, pose, sets)
    if suffix == POSE_FILE.suffix:
        if figure_name is None:
            raise UsageError(f"{path}: a pose does not name its figure; add --figure FIGURE")
        if pose is not None:
            raise UsageError(f"{path} is a pose; leave out --pose")
        figure, warnings = load_figure(figure_name)
        pose = path
    elif figure_name is not None:
        raise UsageError(f"{source} is a figure; --figure is for poses and motions")
    else:
        figure, warnings = load_figure(source)
    placement, more = placement_from_options(figure, pose, sets)
    warnings = *warnings, *more, *_range_warnings(figure, placement)
    return Subject(Body.of_figure(figure), placement, None, (figure.path, pose), warnings)


def _range_warnings(figure: Figure, placement: Placement) -> Iterator[Diagnostic]:
    """Yield warnings of joints that a pose moves outside their ranges."""
    moved = {
        name: placement.displacements[name].tolist()
        for name, joint in figure.joints.items()
        if not np.array_equal(placement.displacements[name], joint.displacement)
    }
    with suppress(MoverError):  # of a springs file that cannot be read
        yield from range_warnings(figure, read_springs(None, figure), moved, is_start=False)


def _read_moving(
    path: Path, figure_name: str | None, pose: Path | None, sets: Sequence[str]
) -> Subject:
    """Read a motion; raises as `read_subject`."""
    check_readable(path)
    if pose is not None or sets:
        raise UsageError(f"{path} is a motion; --pose and --set are for figures")
    motion, warnings = load_motion(path, figure_name)
    inputs = motion.figure.path, path
    return Subject(Body.of_figure(motion.figure), None, motion, inputs, warnings)


def times_from_options(at: str | None, strip: int | None, motion: FigureMotion) -> list[float]:
    """Times of the moments of a picture [s]. Raises UsageError."""
    first, last = float(motion.times[0]), float(motion.times[-1])
    if at is not None and strip is not None:
        raise UsageError("--at and --strip exclude each other")
    if strip is not None:
        return np.linspace(first, last, strip).tolist()
    if at is None:
        return [first]
    try:
        times = [float(part) for part in at.split(",")]
    except ValueError:
        raise UsageError(f"--at {at}: expected times in s such as 0.5 or 0,0.5,1") from None
    for time in times:
        if not first - 1e-9 <= time <= last + 1e-9:
            raise UsageError(f"--at {at}: the motion lasts from {first:g} to {last:g} s")
    return times


def _check_options(
    outputs: Sequence[Path],
    subject: Subject,
    at: str | None,
    strip: int | None,
    fps: float | None,
    transparent: bool,
    no_forces: bool,
    no_scene: bool,
    scene: str | None,
) -> None:
    """Raise UsageError for options that exclude each other."""
    videos = [path for path in outputs if path.suffix.lower() in VIDEO_FORMATS]
    if subject.motion is None:
        if (at, strip, fps) != (None, None, None):
            raise UsageError("--at, --strip and --fps are for motions")
        if no_forces:
            raise UsageError("--no-forces is for motions")
        if no_scene:
            raise UsageError("--no-scene is for motions")
        if videos:
            raise UsageError(f"-o {videos[0]}: a video needs a motion, not a pose")
    if no_scene and scene is not None:
        raise UsageError("--no-scene and --scene exclude each other")
    if fps is not None and not videos:
        raise UsageError(f"--fps is for videos: add -o FILE{VIDEO_FORMATS[0]}")
    if len(videos) == len(outputs) and (at is not None or strip is not None):
        raise UsageError("--at and --strip are for pictures; a video shows the whole motion")
    if videos and transparent:
        raise UsageError(f"-o {videos[0]}: a video has a white background; omit --transparent")


class ViewName(StrEnum):
    """Direction from which a figure is seen."""

    FRONT = "front"
    SIDE = "side"
    BACK = "back"
    TOP = "top"
    THREE_QUARTER = "three-quarter"


def _undrawn_props(scene: Scene) -> Iterator[Loss]:
    """Yield the loss of planes other than the floor, which have no end."""
    endless = [prop for prop in scene.props if prop.shape.is_endless]
    floors = [prop for prop in endless if is_level(prop.shape)]
    if lost := [prop.name for prop in endless if prop not in floors[:1]]:
        yield Loss("planes that are not drawn", tuple(lost))


@dataclass(frozen=True)
class PictureResult(CommandResult):
    """Pictures and videos that were written."""

    source: str
    times_s: Sequence[float]
    files: Sequence[Path]
    sizes: Mapping[str, Sequence[int]]
    frames: int
    losses: Sequence[str]

    def paragraphs(self) -> Paragraphs:
        """Return the losses, and the files with their sizes."""
        lines = list(self.losses)
        for path in self.files:
            columns, rows = self.sizes.get(str(path), (0, 0))
            size = f"{columns} x {rows} pixels" if rows else format_count(self.frames, "frame")
            lines.append(f"wrote {path}, {size}")
        return ("\n".join(lines),)


def picture(
    source: Annotated[
        str,
        typer.Argument(
            metavar="FIGURE|POSE|MOTION",
            help="A figure as elsewhere, a .pose, or a motion: .action .npz .mot .sto.",
        ),
    ],
    outputs: Annotated[
        list[Path] | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="Picture, .png .svg .pdf, or video of a motion, .mp4 .gif.",
        ),
    ] = None,
    figure: Annotated[
        str | None,
        typer.Option(
            metavar="FIGURE", help="Figure of a pose, or of a motion in place of its own."
        ),
    ] = None,
    pose: Annotated[
        Path | None,
        typer.Option(metavar="FILE.pose", help="Pose file, as written by `mover pose`."),
    ] = None,
    displacements: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="JOINT=a,b,c", help="Displacements [deg or cm]."),
    ] = None,
    at: Annotated[
        str | None,
        typer.Option(metavar="T,...", help="Times of the moments [s]. [default: the first]"),
    ] = None,
    strip: Annotated[
        int | None,
        typer.Option(
            min=2,
            max=60,
            metavar="N",
            help="Number of moments at equal intervals from the first time to the last.",
        ),
    ] = None,
    view: Annotated[
        ViewName, typer.Option(help="Direction of the view of a figure that faces +z.")
    ] = ViewName.THREE_QUARTER,
    turn: Annotated[
        float | None,
        typer.Option(help="Angle of the viewer from +z towards +x, in place of the view's [deg]."),
    ] = None,
    tilt: Annotated[
        float | None,
        typer.Option(help="Angle by which the viewer looks down, in place of the view's [deg]."),
    ] = None,
    scene: Annotated[
        str | None,
        typer.Option(
            metavar="FILE|NAME",
            help="Scene whose boxes and level floor are drawn, in place of that of a motion.",
        ),
    ] = None,
    no_scene: Annotated[
        bool, typer.Option("--no-scene", help="Leave out the props of the motion.")
    ] = False,
    no_forces: Annotated[
        bool, typer.Option("--no-forces", help="Leave out the contact forces of the motion.")
    ] = False,
    floor: Annotated[bool, typer.Option("--floor", help="Draw a floor at the height 0.")] = False,
    width: Annotated[
        str | None,
        typer.Option(metavar="640|8cm", help="Width in pixels, cm, mm or in. [default: fits 1600]"),
    ] = None,
    scale: Annotated[
        float | None, typer.Option(help="Scale [pixels/m], in place of a width.")
    ] = None,
    dpi: Annotated[
        float | None,
        typer.Option(help="Resolution [dots/inch]. [default: 300 with a width in cm, else 100]"),
    ] = None,
    transparent: Annotated[
        bool, typer.Option("--transparent", help="Leave out the white background.")
    ] = False,
    no_labels: Annotated[
        bool, typer.Option("--no-labels", help="Leave out the times under several moments.")
    ] = False,
    fps: Annotated[
        float | None,
        typer.Option(min=1.0, max=100.0, help="Frames of a video per second. [default: 30]"),
    ] = None,
    *,
    as_json: bool = False,
    show_progress: bool = False,
) -> CommandResult:
    """Draw pictures and videos of a figure, a pose or a motion.

    The options -o and --set may be repeated. Each .svg and .pdf holds the body in pixels, the times
    as outlines. A video shows a motion from its first time to its last.
    """
    files, seen_from = outputs or [], view_from_options(view.value, turn, tilt)
    size = size_from_options(width, scale, dpi)
    progress = item_progress_bar if show_progress and not as_json else no_monitor
    if not files:
        raise UsageError("no output file: add -o FILE.png")
    known = (*IMAGE_FORMATS, *VIDEO_FORMATS)
    for path in files:
        if path.suffix.lower() not in known:
            raise UsageError(f"-o {path}: {suffix_fault(path)}; known are {', '.join(known)}")
    check_distinct_paths(files)
    for path in files:
        if path.suffix.lower() in VIDEO_FORMATS:
            Film.require_encoder(path.suffix.lower())
    subject = replace(
        read_subject(source, figure, pose, displacements or ()), with_forces=not no_forces
    )
    _check_options(files, subject, at, strip, fps, transparent, no_forces, no_scene, scene)
    check_writable(files, (*subject.inputs, scene))
    props = NO_SCENE if subject.motion is None or no_scene else subject.motion.scene
    if scene is not None:
        props = read_scene(scene)
    ground = floor_height(props, floor)
    times = [] if subject.motion is None else times_from_options(at, strip, subject.motion)
    losses = [str(loss) for loss in (*subject.body.losses, *_undrawn_props(props))]
    writers: list[tuple[Path, OutputWriter]] = []
    sizes: dict[str, list[int]] = {}
    images = [path for path in files if path.suffix.lower() in IMAGE_FORMATS]
    if images:
        drawn = draw_picture(
            subject,
            times,
            seen_from,
            props,
            ground,
            size,
            labelled=not no_labels and len(times) > 1,
            transparent=transparent,
        )
        if subject.has_forces and not drawn.caption:
            losses.append(f"nothing is touched at {', '.join(time_labels(times))}")
        for path in images:
            sizes[str(path)] = list(drawn.shape)
            writers.append((path, partial(drawn.write, kind=path.suffix.lower()[1:])))
    frames = 0
    if len(images) < len(files):
        film = make_film(subject, seen_from, props, ground, size, fps or DEFAULT_FPS)
        frames = film.count
        for path in files:
            if path not in images:
                write = partial(film.write, kind=path.suffix.lower(), progress=progress)
                writers.append((path, write))
    write_all_or_none(writers)
    return PictureResult(source, times, files, sizes, frames, losses, diagnostics=subject.warnings)
