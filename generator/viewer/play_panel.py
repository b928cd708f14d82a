"""Play: a motion on the page, with its curves, the path of a site and a second motion."""

import time
from collections.abc import Callable, Sequence
from functools import partial
from itertools import cycle
from pathlib import Path
from threading import Thread

import numpy as np
from viser import GuiUplotHandle, LineSegmentsHandle, uplot

from generator.contact.arrows import ArrowScale
from generator.conversion import READABLE_SUFFIXES, read_motion_with_warnings
from generator.diagnostics import Diagnostic, MoverError, UsageError
from generator.motion_files.motion import FigureMotion, file_sha256
from generator.passive_curve import joint_label
from generator.rotations import Array
from generator.viewer import playback
from generator.viewer.folder import names_in_folder, path_in_folder
from generator.viewer.scene import FigureScene, points_in_world
from generator.viewer.surroundings import ForceArrows
from generator.viewer.viewer import Driver, FigureState, Panel, Viewer, html_lines
from springs import SpringSet

READOUT_INTERVAL = 0.2
"""Shortest time between two readouts, and between two lines of the path so far [s]."""

CHART_INTERVAL = 0.5
"""Shortest time between two computations of the moments with changed springs [s]."""

CURSOR_INTERVAL = 0.1
"""Shortest time between two positions of the slider and of the cursors in the charts [s]."""

PATH_POINTS = 1000
"""Largest number of points of a path."""

FRAMED_FRAMES = 6
"""Frames of a motion that the camera sees when it is loaded."""

PATH_COLOUR = (214, 90, 24)
PATH_THICKNESS = 2.0
"""Thickness of a path on the screen."""

CHART_COLOURS = ("#4c78a8", "#f58518", "#54a24b", "#e45756", "#b279a2", "#9d755d", "#72b7b2")
CURSOR_COLOUR = "#888888"

NO_SITE = "None"
_NO_SITES: tuple[str, ...] = (NO_SITE,)
NO_FILE = "No motion in the folder"
_NO_FILES: tuple[str, ...] = (NO_FILE,)
_NO_JOINTS: tuple[str, ...] = ("",)
FIRST, PREVIOUS, NEXT, LAST = "First", "Previous", "Next", "Last"


class TimeChart:
    """A chart of the panel with a cursor at the present time."""

    def __init__(self, viewer: Viewer, chart: playback.Chart) -> None:
        """Add the chart to the panel that is being built."""
        self._chart, self.title = chart, chart.title
        self._cursor = -1
        low, high = chart.limits
        self._plot: GuiUplotHandle = viewer.server.gui.add_uplot(
            self._data(0),
            (
                uplot.Series(label="Time [s]"),
                *(
                    uplot.Series(label=label, stroke=colour, width=2)
                    for (label, _), colour in zip(chart.curves, cycle(CHART_COLOURS), strict=False)
                ),
                uplot.Series(label="Now", stroke=CURSOR_COLOUR, width=1),
            ),
            title=chart.title,
            scales={"x": uplot.Scale(time=False), "y": uplot.Scale(range=(low, high))},
            legend=uplot.Legend(live=False),
            height=170,
        )

    def move_cursor(self, frame: int) -> None:
        """Move the cursor to a frame of the motion."""
        cursor = int(np.searchsorted(self._chart.frames, frame))
        if cursor != self._cursor:
            self._cursor = cursor
            self._plot.data = self._data(cursor)

    def _data(self, cursor: int) -> tuple[Array, ...]:
        """Times, curves, and a step whose edge is the cursor."""
        low, high = self._chart.limits
        step = np.where(np.arange(len(self._chart.times)) <= cursor, high, low)
        return (self._chart.times, *(values for _, values in self._chart.curves), step)

    def remove(self) -> None:
        """Remove the chart from the page."""
        self._plot.remove()


class PlayPanel(Panel):
    """Plays a motion, with its curves, the path of a site and a second motion beside it."""

    title = "Play"

    def __init__(self, viewer: Viewer, clock: Callable[[], float] = time.monotonic) -> None:
        """Remember the viewer, and the clock, which returns the time on the wall [s]."""
        super().__init__(viewer)
        self.clock = clock
        self.frames: playback.MotionFrames | None = None
        self.playback: playback.Playback | None = None
        self.ghost: playback.MotionFrames | None = None
        self._ghost_scene: FigureScene | None = None
        self.charts: list[TimeChart] = []
        self._path: LineSegmentsHandle | None = None
        self._path_frames, self._path_points = np.zeros(0, dtype=int), np.zeros((0, 3))
        self._path_drawn = -1
        self._arrows: ForceArrows | None = None
        self._points = np.zeros((0, 3))
        self._chart_number = 0
        self._shown_frame = -1
        self._slider_frame = 0
        self._must_show = False
        self._was_playing: bool = False
        self._sites: dict[str, tuple[str, str]] = {}
        self._joints: dict[str, str] = {}
        self._readout_time = self._cursor_time = self._chart_time = -np.inf
        self._has_other_springs = False

    def build(self) -> None:
        """Add the controls; a motion of the page appears at the first tick."""
        gui, listen = self.viewer.server.gui, self.viewer.listen
        self._summary = gui.add_html("")
        self._controls = gui.add_folder("Motion", visible=False)
        with self._controls:
            self._play = gui.add_button("Play")
            self._slider = gui.add_slider("Frame", 0, 1, 1, 0)
            self._readout = gui.add_text("Time", "", disabled=True)
            self._step = gui.add_button_group("Go to", (FIRST, PREVIOUS, NEXT, LAST))
            self._speed = gui.add_slider("Speed", playback.MIN_SPEED, playback.MAX_SPEED, 0.05, 1.0)
            self._loop = gui.add_checkbox("Loop", initial_value=False)
            self._site = gui.add_dropdown("Path of site", _NO_SITES)
            self._whole_path = gui.add_checkbox("Whole path", initial_value=True)
            self._show_forces = gui.add_checkbox("Contact forces", True, visible=False)
            self._force_scale = gui.add_html("", visible=False)
            self._show_ghost = gui.add_checkbox("Second motion", initial_value=True, visible=False)
            self._joint = gui.add_dropdown("Joint", _NO_JOINTS)
        self._chart_folder = gui.add_folder("Curves", visible=False)
        with gui.add_folder("Files", expand_by_default=self.viewer.content.motion is None):
            self._file = gui.add_dropdown("File", self._motion_names())
            self._load = gui.add_button("Load")
            self._load_second = gui.add_button("Load as second motion")
            self._refresh = gui.add_button("List files again")
        listen(self._load.on_click, lambda _: self._read(self.load))
        listen(self._load_second.on_click, lambda _: self._read(self.load_ghost))
        listen(self._refresh.on_click, lambda _: self._list_files())
        listen(self._play.on_click, lambda _: self._toggle())
        listen(self._slider.on_update, lambda _: self._scrub(), "play frame")
        listen(self._step.on_click, lambda _: self._go(self._step.value))
        listen(self._speed.on_update, lambda _: self._set_speed(), "play speed")
        listen(self._loop.on_update, lambda _: self._set_loop())
        listen(self._site.on_update, lambda _: self._trace())
        listen(self._whole_path.on_update, lambda _: self._draw_path())
        listen(self._show_forces.on_update, lambda _: self._draw_forces(self._shown_frame))
        listen(self._show_ghost.on_update, lambda _: self._toggle_ghost())
        listen(self._joint.on_update, lambda _: self._choose_joint())
        content = self.viewer.content
        if content.motion is not None:
            self.load(content.motion)
        if content.ghost is not None:
            self.load_ghost(content.ghost)

    def _motion_names(self) -> tuple[str, ...]:
        """Names of the motions in the folder of the page."""
        folder = self.viewer.content.folder
        names = [name for suffix in READABLE_SUFFIXES for name in names_in_folder(folder, suffix)]
        return tuple(sorted(names)) or _NO_FILES

    def _list_files(self) -> None:
        name, names = self._file.value, self._motion_names()
        self._file.options = names
        self._file.value = name if name in names else names[0]

    def _read(self, use: Callable[[FigureMotion], None]) -> None:
        """Read the chosen file in a thread, and then use the motion in the loop."""
        if self._file.value == NO_FILE:
            raise UsageError("the folder of the page has no motion")
        path = path_in_folder(self.viewer.content.folder, self._file.value, READABLE_SUFFIXES)

        def read() -> None:
            try:
                motion, warnings = read_motion_with_warnings(path, self.viewer.figure)
                self.viewer.post(lambda: self._use(motion, warnings, path, use))
            except (MoverError, OSError) as failure:
                self.viewer.post(partial(self.viewer.tell_error, failure))

        Thread(target=read, daemon=True).start()

    def _use(
        self,
        motion: FigureMotion,
        warnings: Sequence[Diagnostic],
        path: Path,
        use: Callable[[FigureMotion], None],
    ) -> None:
        use(motion)
        for each in warnings:
            self.viewer.notify(path.name, f"{each.message[:1].upper()}{each.message[1:]}.")
        file = motion.figure.path
        if file is not None and motion.header.sha256 not in (None, file_sha256(file)):
            self.viewer.notify(
                path.name, f"This is a motion of another version of {motion.header.figure}."
            )

    def load(self, motion: FigureMotion) -> None:
        """Show another motion. Raises ModelError if it is of another figure."""
        self.frames, self.playback = playback.MotionFrames(motion), playback.Playback(motion.times)
        self.playback.set_speed(self._speed.value, self.clock())
        self.playback.set_loop(self._loop.value, self.clock())
        self._slider.max = max(self.frames.count - 1, 1)
        self._slider.value = self._slider_frame = 0
        self._summary.content = html_lines(playback.summary_lines(motion))
        segments = motion.figure.segments
        self._sites = {
            f"{one}.{site}": (one, site) for one in segments for site in segments[one].sites
        }
        self._site.options = (NO_SITE, *self._sites)
        self._site.value = NO_SITE
        self._joints = {joint_label(name): name for name, chain in motion.chains.items() if chain}
        self._joint.options = tuple(self._joints) or _NO_JOINTS
        joint = self.viewer.joint or playback.liveliest_joint(motion)
        self._joint.value = next(
            (label for label, name in self._joints.items() if name == joint),
            self._joint.options[0],
        )
        self._controls.visible = self._chart_folder.visible = True
        self._trace()
        self._draw_charts()
        framed = playback.sample_frames(self.frames.count, FRAMED_FRAMES)
        poses = [self.frames.poses(int(frame)) for frame in framed]
        self._points = np.concatenate([points_in_world(self.viewer.scene, each) for each in poses])
        if self._arrows is not None:
            self._arrows.hide()
        scale = ArrowScale.of_figure(motion.figure, poses[0])
        self._arrows = ForceArrows(self.viewer.server, "/contact_forces", scale)
        has_forces = playback.contact_forces(motion, 0) is not None
        self._show_forces.visible = self._force_scale.visible = has_forces
        self._force_scale.content = html_lines([scale.text])
        self.viewer.frame_camera(poses)
        self._shown_frame, self._must_show = -1, True

    def load_ghost(self, motion: FigureMotion) -> None:
        """Show a second motion beside the first. Raises ModelError if it is of another figure."""
        frames = playback.MotionFrames(motion)
        if self._ghost_scene is not None:
            self._ghost_scene.remove()
        self.ghost = frames
        self._ghost_scene = FigureScene(
            self.viewer.server.scene, motion.figure, root="ghost", ghost=True
        )
        self._show_ghost.visible, self._show_ghost.value = True, True
        self._move_ghost(motion.times[0])
        self._shown_frame, self._must_show = -1, self.frames is not None

    def shown_changed(self, shown: FigureState) -> None:
        """Pause when something else moves the figure."""
        if shown.driver is not Driver.MOTION and self.playback is not None:
            self.playback.pause(self.clock())
            self._shown_frame, self._was_playing = -1, False
            if self._arrows is not None:
                self._arrows.hide()

    def selection_changed(self, segment: str | None, joint: str | None) -> None:
        """Draw the curves of the selected joint."""
        label = next((label for label, name in self._joints.items() if name == joint), None)
        if label is not None and label != self._joint.value:
            self._joint.value = label
            self._draw_charts()

    def tick(self, now: float) -> None:
        """Show the frame that is due, and the readouts at their own rates."""
        if self.frames is None or self.playback is None:
            return
        is_playing = self.playback.is_playing(now)
        frame = self.playback.frame(now)
        if self._must_show or ((is_playing or self._was_playing) and frame != self._shown_frame):
            self._show(frame)
        label = "Pause" if is_playing else "Play"
        if self._play.label != label:
            self._play.label = label
        rests = not is_playing
        if rests or now - self._cursor_time >= CURSOR_INTERVAL:
            self._cursor_time = now
            self._move_cursors(frame)
        if rests or now - self._readout_time >= READOUT_INTERVAL:
            self._readout_time = now
            self._write_time(self.playback.time(now))
            self._draw_path(frame)
        if self._has_other_springs and now - self._chart_time >= CHART_INTERVAL:
            self._has_other_springs, self._chart_time = False, now
            self._draw_charts()
        self._was_playing, self._must_show = is_playing, False

    def _show(self, frame: int) -> None:
        """Show a frame of the motion, and the second motion at its time."""
        if self.frames is None:
            return
        at = float(self.frames.motion.times[frame])
        poses = self.frames.poses(frame)
        displacements = self.frames.displacements(frame)
        self._move_ghost(at)
        self._draw_forces(frame)
        self.viewer.surroundings.show_scene(self.frames.motion.scene, self._points)
        self.viewer.show(FigureState(Driver.MOTION, displacements, poses, at))
        self._shown_frame = frame

    def _draw_forces(self, frame: int) -> None:
        """Draw the contact forces in a frame, or none."""
        if self._arrows is None or self.frames is None:
            return
        found = playback.contact_forces(self.frames.motion, frame)
        if found is None or not self._show_forces.value:
            self._arrows.hide()
        else:
            self._arrows.show(*found)

    def _move_ghost(self, at: float) -> None:
        if self.ghost is not None and self._ghost_scene is not None and self._show_ghost.value:
            frame = playback.nearest_frame(self.ghost.motion.times, at)
            self._ghost_scene.move(self.ghost.poses(frame))

    def _move_cursors(self, frame: int) -> None:
        if frame != self._slider_frame:  # else the slider may already be farther on
            self._slider.value = self._slider_frame = frame
        for chart in self.charts:
            chart.move_cursor(frame)

    def _write_time(self, at: float) -> None:
        text = "" if self.playback is None else f"{at:.3f} s of {self.playback.stop:.3f} s"
        if self._readout.value != text:
            self._readout.value = text

    def _toggle(self) -> None:
        """Play, or pause."""
        if self.playback is None:
            return
        now = self.clock()
        if self.playback.is_playing(now):
            self.playback.pause(now)
        else:
            self.playback.play(now)
        self._must_show = True

    def _scrub(self) -> None:
        """Pause at the frame of the slider."""
        if self.playback is None or self.frames is None:
            return
        now = self.clock()
        frame = min(max(int(self._slider.value), 0), self.frames.count - 1)
        self._slider_frame = frame
        self.playback.pause(now)
        self.playback.seek(float(self.frames.motion.times[frame]), now)
        self._must_show = True

    def _go(self, where: str) -> None:
        """Pause at another frame."""
        if self.playback is None or self.frames is None:
            return
        steps = {PREVIOUS: -1, NEXT: 1, FIRST: -self.frames.count, LAST: self.frames.count}
        self.playback.step(steps[where], self.clock())
        self._must_show = True

    def _set_speed(self) -> None:
        if self.playback is not None:
            self.playback.set_speed(float(self._speed.value), self.clock())

    def _set_loop(self) -> None:
        if self.playback is not None:
            self.playback.set_loop(self._loop.value, self.clock())

    def _choose_joint(self) -> None:
        """Draw the curves of another joint, and select it."""
        self._draw_charts()
        joint = self._joints.get(self._joint.value)
        if joint is not None and joint in self.viewer.figure.joints:
            self.viewer.select_joint(joint)

    def _draw_charts(self) -> None:
        for chart in self.charts:
            chart.remove()
        self.charts = []
        if self.frames is None:
            return
        motion, joint = self.frames.motion, self._joints.get(self._joint.value)
        found = (
            [*playback.displacement_charts(motion, joint), *playback.moment_chart(motion, joint)]
            if joint
            else []
        )
        found += [*playback.energy_chart(motion), *playback.ground_reaction_chart(motion)]
        with self._chart_folder:
            self.charts = [TimeChart(self.viewer, chart) for chart in found]
        self._chart_number += 1
        if joint and motion.recording is None:
            self._add_elastic_moments(motion, joint)
        for chart in self.charts:
            chart.move_cursor(max(self._shown_frame, 0))

    def _add_elastic_moments(self, motion: FigureMotion, joint: str) -> None:
        """Compute the moments with the present springs in a thread, and add their chart."""
        number, springs = self._chart_number, self.viewer.springs

        def add(charts: list[playback.Chart]) -> None:
            if number == self._chart_number:
                with self._chart_folder:
                    self.charts += [TimeChart(self.viewer, chart) for chart in charts]

        def compute() -> None:
            charts = playback.elastic_moment_chart(motion, joint, springs)
            self.viewer.post(lambda: add(charts))

        Thread(target=compute, daemon=True).start()

    def springs_changed(self, springs: SpringSet) -> None:
        """Draw the moments again in a tick, if they are computed."""
        self._has_other_springs = self.frames is not None and self.frames.motion.recording is None

    def _toggle_ghost(self) -> None:
        if self._ghost_scene is not None:
            self._ghost_scene.root.visible = self._show_ghost.value
            self._must_show = self.frames is not None

    def _trace(self) -> None:
        """Find the path of the chosen site."""
        self._path_frames, self._path_points = np.zeros(0, dtype=int), np.zeros((0, 3))
        if self.frames is not None and self._site.value != NO_SITE:
            self._path_frames = playback.sample_frames(self.frames.count, PATH_POINTS)
            self._path_points = self.frames.site_path(
                *self._sites[self._site.value], self._path_frames
            )
        self._path_drawn = -1
        self._draw_path()

    def _draw_path(self, frame: int | None = None) -> None:
        """Draw the whole path, or as much of it as was played."""
        count = len(self._path_frames)
        if not self._whole_path.value:
            at = self._shown_frame if frame is None else frame
            count = int(np.searchsorted(self._path_frames, at, side="right"))
        if count == self._path_drawn:
            return
        self._path_drawn = count
        if self._path is not None:
            self._path.remove()
            self._path = None
        if count > 1:
            points = self._path_points[:count]
            self._path = self.viewer.server.scene.add_line_segments(
                "/path",
                np.stack([points[:-1], points[1:]], axis=1),
                PATH_COLOUR,
                thickness=PATH_THICKNESS,
                thickness_units="screen",
            )
