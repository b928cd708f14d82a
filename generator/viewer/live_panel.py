"""The tab of the live simulation: a figure that falls while it is changed."""

import signal
from collections.abc import Mapping
from dataclasses import replace
from math import floor
from pathlib import Path
from typing import Any

import numpy as np

from generator.contact.arrows import ArrowScale
from generator.contact.scene import NO_SCENE, Scene, with_floor
from generator.diagnostics import MoverError, UsageError
from generator.figure import SiteRef
from generator.input_files import live
from generator.kinematics.tree import build_tree
from generator.model import Model
from generator.motion_files import MOTION_FORMATS
from generator.rotations import Array, inverse_pose
from generator.run_options import MAX_LIVE_SEED
from generator.simulation.preconditions import model_obstacles
from generator.springs_file.edit import springs_and_text
from generator.springs_file.parse import SPRINGS_FILE
from generator.text_io import os_error_reason
from generator.viewer import live_process, live_start
from generator.viewer.folder import name_in_folder, path_in_folder
from generator.viewer.scene import points_in_world
from generator.viewer.surroundings import ForceArrows
from generator.viewer.viewer import Driver, FigureState, Panel, Viewer, html_lines, value_in_range
from springs import SpringSet

TEXT_INTERVAL = 0.2
"""Shortest time between two updates of the texts [s]."""

MAX_GRAVITY, MAX_SCALE = 20.0, 4.0
"""Largest gravity [m/s2], and largest factor of stiffness and damping, of the sliders."""

FLOOR_GAP = 0.005
"""Distance of the floor below the lowest vertex of the figure at a reset [m]."""

MAX_HEIGHT = 1e4
"""Largest height of the floor, above or below the origin [cm]."""

PULL_COLOUR, PIN_COLOUR = (235, 120, 20), (70, 74, 82)

PIN_LENGTH, PIN_RADIUS = 0.35, 0.012
"""Of the bar that is drawn where a joint to the ground holds the figure, over its size."""

_ACROSS = (0.5**0.5, 0.0, 0.5**0.5, 0.0)
"""Turn of a bar along z to one along x, w first."""

_GRAVITY_DIGITS, _POINT_DIGITS = 6, 5
"""Decimal digits of numbers of the log: gravity [m/s2] and pulled points [m]."""


def live_obstacle(model: Model) -> str | None:
    """Return why a model cannot be simulated live; None where nothing is known against it."""
    if build_tree(model.figure).closures:
        return "the figure has closed loops, which only `mover simulate` supports"
    return next((each.message for each in model_obstacles(model)), None)


def floor_height(points: Array) -> float:
    """Height of a floor below points, shape (n, 3) [m], in whole millimetres."""
    return floor(1000.0 * (float(points[:, 1].min()) - FLOOR_GAP)) / 1000.0


def _ground_around(points: Array) -> Array:
    """Return points of the ground around a figure, as far as it may fall, shape (4, 3) [m]."""
    low, high = points.min(axis=0), points.max(axis=0)
    reach = 0.6 * float(np.max(high - low))
    middle = 0.5 * (low + high)
    return np.array(
        [[middle[0] + x, low[1], middle[2] + z] for x in (-reach, reach) for z in (-reach, reach)]
    )


def point_in_segment(pose: Array, point: Array) -> live.Vector:
    """Return a point of the world in the frame of a segment with a pose (4, 4), rounded [m]."""
    x, y, z = (inverse_pose(pose) @ np.append(point, 1.0))[:3].tolist()
    return round(x, _POINT_DIGITS), round(y, _POINT_DIGITS), round(z, _POINT_DIGITS)


def live_path(folder: Path, text: str) -> Path:
    """Return the path of a file of a motion or of a live simulation. Raises UsageError."""
    path = path_in_folder(folder, text, (*MOTION_FORMATS, ".toml"))
    if path.suffix.lower() == ".toml" and not path.name.endswith(live.LIVE_FILE.suffix):
        raise UsageError(
            f"`{path.name}` must end in {live.LIVE_FILE.suffix}: it holds a live simulation"
        )
    return path


def clock_text(frame: live_process.LiveFrame | None, *, is_compiling: bool) -> str:
    """Describe the time of a simulation and its rate."""
    if is_compiling:
        return "Compiling the equations; the first time on a machine this takes some 15 s."
    if frame is None:
        return "Not started."
    if not frame.is_running:
        return f"{frame.time:.2f} s, paused"
    rate = live_process.format_rate(frame.rate)
    return f"{frame.time:.2f} s, {rate}" if rate else f"{frame.time:.2f} s"


def energy_lines(energy: Mapping[str, float]) -> list[str]:
    """Describe the energies in lines."""
    return [f"{kind.capitalize()} energy {value:.2f} J" for kind, value in energy.items()]


def death_text(exit_code: int | None) -> str:
    """Describe the end of a process that nobody asked for."""
    how = "ended unexpectedly"
    if exit_code is not None and exit_code < 0:
        try:
            how = f"was ended by {signal.Signals(-exit_code).name}"
        except ValueError:
            how = f"was ended by signal {-exit_code}"
    elif exit_code:
        how = f"ended with code {exit_code}"
    return f"The process of the simulation {how}. Start begins again from the same start."


class LivePanel(Panel):
    """Start and pause of a live simulation, and what is changed while it runs."""

    title = "Live"

    def __init__(self, viewer: Viewer) -> None:
        """Start nothing yet."""
        super().__init__(viewer)
        self.process = live_process.LiveProcess(viewer.figure, viewer.content.folder)
        self._obstacle = live_obstacle(Model(viewer.figure, viewer.content.springs))
        self._generation = 0
        self._start_shown = viewer.shown
        self._frame: live_process.LiveFrame | None = None
        self._is_begun = self._is_compiling = self._is_running = False
        self._is_covered = self._waits_for_page = False
        self._notice = self._saving = self._saved_text = ""
        self._is_own_height = False
        self._presets = live_start.presets_of(viewer.figure)
        self._shown_scene: Scene | None = None
        self._framed = 0
        self._pulled: tuple[str, live.Vector] | None = None
        self._texts: dict[str, str] = {}
        self._next_text = 0.0

    @property
    def newest(self) -> live_process.LiveFrame | None:
        """The newest frame; None before the first one."""
        return self._frame

    def build(self) -> None:
        """Add the controls."""
        viewer, gui, scene = self.viewer, self.viewer.server.gui, self.viewer.server.scene
        disabled = self._obstacle is not None
        self._preset = gui.add_dropdown(
            "Preset", tuple(map(str, self._presets)), disabled=disabled,
            hint="Fall: free, on a floor. Hang: by the joint to the ground. Sit: on a chair.",
        )  # fmt: skip
        self._kind = gui.add_dropdown(
            "Kind of fall", live_start.KINDS, hint="As --fall of mover simulate, without tone"
        )
        self._seed = gui.add_number("Seed", 0, min=0, max=MAX_LIVE_SEED, step=1)
        self._scene = gui.add_dropdown(
            "Scene", live_start.scene_names(viewer.content.folder), hint="Beside that of the fall"
        )
        self._lift = gui.add_number(
            "Start height [cm]", 0.0, min=-MAX_HEIGHT, max=MAX_HEIGHT, step=1.0,
            hint="Of the lowest point; 0: that of the kind of fall",
        )  # fmt: skip
        self._clock = gui.add_html("")
        self._start = gui.add_button("Start", disabled=disabled)
        self._step = gui.add_button("Step", disabled=disabled, hint="One frame of 1/60 s")
        self._reset = gui.add_button(
            "Reset", disabled=disabled, hint="Go to the start, from the pose that the page shows"
        )
        self._show_forces = gui.add_checkbox("Contact forces", True, disabled=disabled)
        scale = ArrowScale.of_figure(viewer.figure, viewer.shown.poses)
        gui.add_html(html_lines([scale.text]))
        self._arrows = ForceArrows(viewer.server, "/live_forces", scale)
        self._gravity = gui.add_slider(
            "Gravity [m/s2]", 0.0, MAX_GRAVITY, 0.01, live.DEFAULT_GRAVITY, disabled=disabled
        )
        self._stiffness, self._damping = (
            gui.add_slider(label, 0.0, MAX_SCALE, 0.05, 1.0, disabled=disabled, hint=hint)
            for label, hint in (
                ("Stiffness factor", "Torques of springs"),
                ("Damping factor", "Damping and friction"),
            )
        )
        with gui.add_folder("Floor and root", expand_by_default=len(self._presets) == 1):
            self._floor = gui.add_checkbox("Floor", False, disabled=disabled)
            self._height = gui.add_number(
                "Floor height [cm]",
                0.0,
                min=-MAX_HEIGHT,
                max=MAX_HEIGHT,
                step=0.1,
                disabled=disabled,
            )
            self._free = gui.add_checkbox(
                "Free root", False, disabled=disabled, hint="Without the joints to the ground"
            )
        with gui.add_folder("Energy", expand_by_default=False):
            self._energy = gui.add_html("")
        self._file = gui.add_text("File", f"fall{live.LIVE_FILE.suffix}", disabled=disabled)
        suffixes = " ".join((live.LIVE_FILE.suffix, *MOTION_FORMATS))
        self._save = gui.add_button("Save as", disabled=disabled, hint=suffixes)
        gui.add_html(html_lines(["Shift and drag a segment with the left button to pull it."]))
        self._pins = self._add_pins()
        self._line = scene.add_line_segments(
            "/live_pull", np.zeros((1, 2, 3)), PULL_COLOUR, thickness=0.01, visible=False
        )
        self._set_default_height(self._start_shown)
        self._follow_preset()
        listen = viewer.listen
        listen(self._preset.on_update, lambda _: self._choose_start())
        for control in (self._kind, self._scene, self._seed, self._lift):
            listen(control.on_update, lambda _: self._choose_start(), "start")
        listen(self._show_forces.on_update, lambda _: self._draw_forces())
        listen(self._start.on_click, lambda _: self._toggle())
        listen(self._step.on_click, lambda _: self._take_step())
        listen(self._reset.on_click, lambda _: self.reset())
        listen(self._gravity.on_update, lambda _: self._change(self._gravity_change()), "gravity")
        for slider in (self._stiffness, self._damping):
            listen(slider.on_update, lambda _: self._change(self._scales_change()), "scales")
        listen(self._floor.on_update, lambda _: self._change_floor())
        listen(self._height.on_update, lambda _: self._change_height(), "floor height")
        listen(self._free.on_update, lambda _: self._change(live.SetRoot(self._free.value)))
        listen(self._save.on_click, lambda _: self._save_file())
        if not disabled:
            for name in viewer.figure.bodies:
                if name in viewer.scene.meshes:
                    listen(
                        viewer.scene.meshes[name].on_drag("left", modifier="shift"),
                        lambda event, name=name: self._drag(name, event),
                        "pull",
                    )
        self._show_texts()

    def _add_pins(self) -> list[tuple[SiteRef, Any]]:
        """Add a bar for each joint to the ground, not yet seen, with the site that it holds."""
        figure = self.viewer.figure
        points = points_in_world(self.viewer.scene, self._start_shown.poses)
        size = float(np.linalg.norm(np.ptp(points, axis=0)))
        sites = [
            joint.child
            for joint in figure.joints.values()
            if joint.parent.segment in figure.ground and joint.child.segment in figure.bodies
        ]
        return [
            (
                site,
                self.viewer.server.scene.add_cylinder(
                    f"/live_pin/{k}",
                    PIN_RADIUS * size,
                    PIN_LENGTH * size,
                    PIN_COLOUR,
                    wxyz=_ACROSS,
                    visible=False,
                ),
            )
            for k, site in enumerate(sites)
        ]

    def _draw_pins(self, poses: Mapping[str, Array], *, is_pinned: bool) -> None:
        """Show the bars where the figure is held, or none."""
        for site, bar in self._pins:
            bar.visible = is_pinned
            pose = self.viewer.figure.site(site).pose_in_segment
            bar.position = (poses[site.segment] @ pose)[:3, 3]

    def _draw_forces(self) -> None:
        """Show the contact forces of the newest frame, or none."""
        frame = self._frame
        is_live = self.viewer.shown.driver is Driver.LIVE
        if frame is None or frame.forces is None or not is_live or not self._show_forces.value:
            self._arrows.hide()
        else:
            self._arrows.show(*frame.forces)

    # Starts

    @property
    def _choice(self) -> live_start.StartChoice:
        """Choices of the controls. Raises UsageError and InputError for a scene."""
        preset = live_start.Preset(self._preset.value)
        if preset is not live_start.Preset.FALL:
            return live_start.StartChoice(preset)
        scene = live_start.chosen_scene(self.viewer.content.folder, self._scene.value)
        height = round(value_in_range(self._lift) / 100.0, _POINT_DIGITS)
        seed = int(value_in_range(self._seed))
        return live_start.StartChoice(preset, self._kind.value, seed, scene, height)

    def _follow_preset(self) -> None:
        """Show the controls of the preset; its floor and root are those of the run."""
        preset = live_start.Preset(self._preset.value)
        is_fall, hangs = preset is live_start.Preset.FALL, preset is live_start.Preset.PIN
        self._preset.visible = len(self._presets) > 1
        for control in (self._kind, self._scene, self._lift):
            control.visible = is_fall
        self._seed.visible = is_fall and self._kind.value != live_start.PAGE_POSE
        self._floor.value = self._free.value = not hangs
        if hangs:
            self._set_default_height(self._start_shown)
        else:
            self._height.value = 0.0

    def _choose_start(self) -> None:
        """Go to the start that was chosen."""
        self._follow_preset()
        self._scene.options = live_start.scene_names(self.viewer.content.folder)
        self.reset()

    # Commands

    def _toggle(self) -> None:
        if self._is_begun and self._is_running:
            self._is_running = False
            self.process.send(live_process.Run(is_running=False))
        else:
            if not self._is_begun:
                self._begin()
            self._is_running = True
            self._take_page()
            self.process.send(live_process.Run(is_running=True))
        self._label_start()

    def _take_step(self) -> None:
        if not self._is_begun:
            self._begin()
        self._is_running = False
        self._take_page()
        self.process.send(live_process.OneFrame())
        self._label_start()

    def reset(self) -> None:
        """Go to the start: the pose that the page shows, or from which the simulation began."""
        if self.viewer.shown.driver is not Driver.LIVE:
            self._start_shown = self.viewer.shown
        if not self._is_own_height and self._preset.value == live_start.Preset.PIN:
            self._set_default_height(self._start_shown)
        self._is_running = False
        self._begin()
        self._take_page()
        self._label_start()

    def _take_page(self) -> None:
        """Show the simulation, or its start until there is a frame: a motion that plays pauses."""
        self._is_covered = False
        if self.viewer.shown.driver is Driver.LIVE:
            return
        frame, shown = self._frame, replace(self._start_shown, driver=Driver.LIVE, time=0.0)
        if frame is not None:
            poses = frame.poses_by_segment(self.viewer.figure)
            shown = FigureState(Driver.LIVE, frame.displacements, poses, frame.time)
        self.viewer.show(shown)

    def _begin(self) -> None:
        """Compile, from the pose that the page shows, or the former start where it shows a run."""
        if self.viewer.shown.driver is not Driver.LIVE:
            self._start_shown = self.viewer.shown
        figure, content = self.viewer.figure, self.viewer.content
        start = live.LiveStart(
            springs=None if content.springs_choice is None else str(content.springs_choice),
            law=content.springs.law,
            gravity=self._gravity_change().gravity,
            free_root=self._free.value,
        )
        choice, is_free = self._choice, self._free.value
        start = choice.apply(start, figure, self._start_shown.displacements)
        changes: list[live.LiveChange] = []
        if self.viewer.springs != content.springs:
            changes.append(self._springs_change())
        if (self._stiffness.value, self._damping.value) != (1.0, 1.0):
            changes.append(self._scales_change())
        own_floor = None if choice.preset is live_start.Preset.PIN else 0.0
        if self._floor_height() != own_floor:
            changes.append(live.SetFloor(self._floor_height()))
        if start.free_root and not is_free:
            changes.append(live.SetRoot(is_free=False))
        self._generation += 1
        self._frame, self._notice, self._pulled = None, "", None
        self._is_begun = self._is_compiling = True
        self._is_covered = self._waits_for_page = False
        try:
            self.process.send(live_process.Begin(self._generation, start, tuple(changes)))
        except OSError as failure:
            self._is_begun = self._is_compiling = False
            reason = os_error_reason(failure)
            raise UsageError(f"the simulation cannot be started: {reason}") from None

    def _change(self, change: live.LiveChange) -> None:
        """Make a change in the simulation, if there is one; else it is part of the next start."""
        if self._is_begun:
            self.process.send(live_process.Change(change))

    def _gravity_change(self) -> live.SetGravity:
        return live.SetGravity((0.0, -round(value_in_range(self._gravity), _GRAVITY_DIGITS), 0.0))

    def _scales_change(self) -> live.SetScales:
        return live.SetScales(value_in_range(self._stiffness), value_in_range(self._damping))

    def _springs_change(self) -> live.SetSprings:
        content = self.viewer.content
        _, text = springs_and_text(
            content.figure,
            content.springs,
            self.viewer.springs,
            content.folder / f"changed{SPRINGS_FILE.suffix}",
            content.springs_choice,
        )
        return live.SetSprings(text)

    def _floor_height(self) -> float | None:
        """Height of the floor of the controls [m]; None without a floor."""
        height = round(value_in_range(self._height) / 100.0, _POINT_DIGITS)
        return height if self._floor.value else None

    def _change_floor(self) -> None:
        self._change(live.SetFloor(self._floor_height()))
        if not self._is_begun:
            self._show_scene(with_floor(NO_SCENE, self._floor_height()), self._start_shown.poses)

    def _change_height(self) -> None:
        self._is_own_height = True
        if self._floor.value:
            self._change_floor()

    def _set_default_height(self, shown: FigureState) -> None:
        points = points_in_world(self.viewer.scene, shown.poses)
        self._height.value = 100.0 * floor_height(points)

    def _show_scene(self, scene: Scene, poses: Mapping[str, Array]) -> None:
        self.viewer.surroundings.show_scene(scene, points_in_world(self.viewer.scene, poses))

    def _drag(self, segment: str, event: Any) -> None:
        """Pull a segment towards the pointer."""
        if event.phase == "end" or self._frame is None:
            if self._pulled is not None:
                self.process.send(live_process.Pull(*self._pulled, target=None))
            self._pulled = None
            self._line.visible = False
            return
        if self._pulled is None or self._pulled[0] != segment:
            pose = self.viewer.shown.poses[segment]
            self._pulled = segment, point_in_segment(pose, np.array(event.start_position))
        x, y, z = (float(part) for part in event.end_position)
        self._target = np.array([x, y, z])
        self.process.send(live_process.Pull(*self._pulled, target=(x, y, z)))

    def _save_file(self) -> None:
        if self._frame is None:
            raise UsageError("nothing has been computed yet: press Start, and wait for the clock")
        path = live_path(self.viewer.content.folder, self._file.value)
        self._saving = f"Saving {path.name}; the simulation waits meanwhile."
        self._saved_text = self._file.value
        self.process.send(live_process.Save(path))

    # Answers

    def tick(self, now: float) -> None:
        """Show what the process has sent."""
        for answer in self.process.take():
            self._follow(answer)
        if now >= self._next_text:
            self._next_text = now + TEXT_INTERVAL
            self._show_texts()

    def _follow(self, answer: live_process.Answer) -> None:
        match answer:
            case live_process.LiveFrame():
                if answer.generation == self._generation:
                    self._show_frame(answer)
            case live_process.Paused():
                if answer.generation == self._generation:
                    self._notice = answer.sentence
                    self.viewer.notify("Paused", answer.sentence, is_error=True)
            case live_process.Refused():
                self._return_controls(answer)
                self.viewer.notify("Error", answer.sentence, is_error=True)
            case live_process.Saved():
                self._saving = ""
                if self._file.value == self._saved_text:  # nothing else was typed meanwhile
                    self._file.value = name_in_folder(self.viewer.content.folder, answer.path)
                self.viewer.notify("Saved", answer.sentence)
            case live_process.Died():
                self._is_begun = self._is_compiling = self._is_running = False
                self._waits_for_page = False
                self._frame, self._pulled, self._saving = None, None, ""
                self._line.visible = False
                self._notice = death_text(answer.exit_code)
                self.viewer.notify("Simulation ended", self._notice, is_error=True)
                self._label_start()

    def _show_frame(self, frame: live_process.LiveFrame) -> None:
        self._is_compiling = False
        self._frame, self._is_running = frame, frame.is_running
        if frame.is_running:
            self._notice = ""
        self._label_start()
        if self._is_covered:
            return
        poses = frame.poses_by_segment(self.viewer.figure)
        self._line.visible = frame.pulled is not None and self._pulled is not None
        if frame.pulled is not None and self._pulled is not None:
            self._line.points = np.array([[frame.pulled, self._target]], dtype=np.float32)
        self.viewer.show(FigureState(Driver.LIVE, frame.displacements, poses, frame.time))
        self._draw_forces()
        self._draw_pins(poses, is_pinned=not frame.has_free_root)
        if frame.scene != self._shown_scene:
            self._shown_scene = frame.scene
            self._show_scene(frame.scene, poses)
        if frame.number == 0 and self._framed != self._generation:
            self._framed = self._generation
            self.viewer.frame_camera(
                around=_ground_around(points_in_world(self.viewer.scene, poses))
            )

    def _return_controls(self, refused: live_process.Refused) -> None:
        """Set floor and root to what is in force."""
        command = refused.command
        if isinstance(command, live_process.Begin):
            self._is_begun = self._is_compiling = self._is_running = False
            self._notice = refused.sentence
            self._label_start()
        elif isinstance(command, live_process.Save):
            self._saving = ""
        elif isinstance(command, live_process.Change) and self._frame is not None:
            self._floor.value = self._frame.floor is not None
            if self._frame.floor is not None:
                self._height.value = 100.0 * self._frame.floor
            self._free.value = self._frame.has_free_root

    def shown_changed(self, shown: FigureState) -> None:
        """Pause where another panel moves the figure, and leave the page to it."""
        if shown.driver is Driver.LIVE:
            return
        self._arrows.hide()
        self._draw_pins(shown.poses, is_pinned=False)
        self._shown_scene = None
        self._is_covered = self._is_begun
        if self._is_running:
            self._is_running = False
            self.process.send(live_process.Run(is_running=False))
            self._label_start()

    def pages_changed(self, *, is_any_open: bool) -> None:
        """Pause while no page is open; a page that is opened then, or again, continues."""
        must_wait = not is_any_open and self._is_running
        if must_wait or (is_any_open and self._waits_for_page):
            self._waits_for_page, self._is_running = must_wait, not must_wait
            self.process.send(live_process.Run(is_running=self._is_running))
            self._label_start()

    def springs_changed(self, springs: SpringSet) -> None:
        """Change the springs of the simulation."""
        if self._is_begun:
            try:
                self.process.send(live_process.Change(self._springs_change()))
            except MoverError as failure:
                self.viewer.tell_error(failure)

    def _label_start(self) -> None:
        label = "Pause" if self._is_running else "Start"
        if self._start.label != label:
            self._start.label = label

    def _show_texts(self) -> None:
        lines = [clock_text(self._frame, is_compiling=self._is_compiling)]
        if self._obstacle is not None:
            lines = [f"This figure cannot be simulated live: {self._obstacle}."]
        if self._saving:
            lines.append(self._saving)
        if self._notice:
            lines.append(self._notice)
        elif self._frame is not None and self.viewer.shown.driver is not Driver.LIVE:
            lines.append("The page shows another pose: Reset starts from it.")
        self._set_text("clock", html_lines(lines))
        lines = [] if self._frame is None else energy_lines(self._frame.energy)
        self._set_text("energy", html_lines(lines))

    def _set_text(self, name: str, content: str) -> None:
        """Send a text to the page if it differs from the one there."""
        if self._texts.get(name) != content:
            self._texts[name] = content
            node = self._clock if name == "clock" else self._energy
            node.content = content

    def close(self) -> None:
        """End the process."""
        self.process.close()
