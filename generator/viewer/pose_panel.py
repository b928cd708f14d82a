"""The tab in which the figure is posed: sliders, a dragged segment, arms, mirror, undo, files."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import degrees, isfinite, radians
from typing import Any

import viser

from generator.diagnostics import MoverError
from generator.figure import Joint
from generator.input_files.pose import POSE_FILE
from generator.kinematics.links import Coordinate
from generator.kinematics.shoulder import Side
from generator.passive_curve import joint_label
from generator.springs_file.axes import axis_label
from generator.viewer.folder import (
    free_path,
    name_in_folder,
    names_in_folder,
    path_in_folder,
    save_text,
    written_text,
)
from generator.viewer.limb_drag import LimbDrag
from generator.viewer.pose_editor import (
    CoordinateRange,
    Mirroring,
    PoseEditor,
    coordinate_range,
)
from generator.viewer.viewer import Driver, FigureState, Panel, Viewer, html_lines, value_in_range
from springs import SpringSet

MAX_OPEN_FOLDERS = 8
"""Joints up to which all folders are expanded at first."""

MAX_FOLDERS = 24
"""Joints up to which each has a folder; of a larger figure the sliders of one joint are shown."""

FOLLOW_INTERVAL = 0.2
"""Shortest time between two updates of sliders that follow the figure [s]."""

TOUCH_TIME = 0.5
"""Time after a user's change during which a slider is not set by the program [s]."""

GROUP_TIME = 1.0
"""Pause after which the next change of a slider is undone alone [s]."""

FILES_INTERVAL = 2.0
"""Time between two looks into the folder of the page [s]."""

DECIMALS = 2
"""Decimals of a displacement in its field."""

MARK_DISTANCE = 0.06
"""Distance below which two marks share a place, as a part of the slider's range."""

UNDO, REDO, RESET = "Undo", "Redo", "Reset"

_LEGEND = "Marks: L limit, N normal range, D edge of the dead zone, M measured range of the law"


@dataclass(frozen=True)
class _Change:
    """A control's value when the user changed it: later the program may have set another."""

    client: Any
    value: Any


def with_value(control: Any) -> Callable[[Callable[[Any], Any]], Any]:
    """Return a function that registers a callback of a control's changes, for `Viewer.listen`."""

    def register(notify: Callable[[Any], Any]) -> None:
        async def first(event: Any) -> None:
            await notify(_Change(event.client, event.target.value))

        control.on_update(first)

    return register


@dataclass
class _Row:
    """The slider of a displacement, scaled from [rad or m] to [deg or cm].

    The user changed it last at the time `touched` [s].
    """

    handle: Any
    coordinate: Coordinate
    scale: float
    known: CoordinateRange
    touched: float = -1e9


class PosePanel(Panel):
    """Controls of the pose."""

    title = "Pose"

    def __init__(self, viewer: Viewer) -> None:
        """Begin with the first pose of the page."""
        super().__init__(viewer)
        self.editor = PoseEditor(viewer.content.placement, springs=viewer.springs)
        self._rows: dict[Coordinate, _Row] = {}
        self._folders: dict[str, Any] = {}
        self._first = 1e6
        self._arms: dict[Side, tuple[Any, Any]] = {}
        self._arm_touched = -1e9
        self.limb = LimbDrag(viewer, self.editor)
        self._now = 0.0
        self._is_stale, self._synced = True, -1e9
        self._changed = -1e9
        self._files: tuple[str, ...] | None = None
        self._files_read = -1e9
        self._last_error = ("", -1e9)
        self._stale_joints: set[str] = set()

    @property
    def is_dragged(self) -> bool:
        """Return whether somebody drags a segment."""
        return self.limb.is_dragged

    @property
    def sliders(self) -> Mapping[Coordinate, viser.GuiSliderHandle[float]]:
        """Sliders of the displacements that have one, in degrees or cm."""
        return {coordinate: row.handle for coordinate, row in self._rows.items()}

    def build(self) -> None:
        """Add the controls."""
        gui, listen = self.viewer.server.gui, self.viewer.listen
        history = gui.add_button_group("Pose", (UNDO, REDO, RESET))
        listen(history.on_click, lambda event: self._history(event.target.value))
        if self.editor.can_mirror:
            mirror = gui.add_button_group(
                "Mirror",
                tuple(each.value.capitalize() for each in Mirroring),
                hint="Mirror the pose in the plane x = 0",
            )
            listen(mirror.on_click, lambda event: self._mirror(event.target.value))
        self.limb.build()
        self._build_arms()
        self._build_joints()
        self._build_files()

    def _build_arms(self) -> None:
        gui = self.viewer.server.gui
        sides = [side for side in Side if self.editor.arm_direction(side) is not None]
        if not sides:
            return
        with gui.add_folder("Shoulder", expand_by_default=False):
            for side in sides:
                name = side.value.capitalize()
                self._arms[side] = (
                    gui.add_slider(
                        f"{name} latitude [deg]", 0.0, 180.0, 0.5, 180.0,
                        marks=((0.0, "up"), (90.0, "level"), (180.0, "down")),
                    ),
                    gui.add_slider(
                        f"{name} longitude [deg]", -180.0, 180.0, 0.5, 0.0,
                        marks=((-90.0, "inward"), (0.0, "ahead"), (90.0, "outward")),
                    ),
                )  # fmt: skip
                for handle in self._arms[side]:
                    self.viewer.listen(
                        handle.on_update, lambda _, side=side: self._pose_arm(side), f"arm {side}"
                    )

    def _build_joints(self) -> None:
        gui = self.viewer.server.gui
        self._moved = {name: j for name, j in self.viewer.figure.joints.items() if j.chain}
        self._all_folders = len(self._moved) <= MAX_FOLDERS
        if not self._moved:
            gui.add_html(html_lines(["This figure has no joint that moves."]))
            return
        self._joints_folder = gui.add_folder("Joints")
        with self._joints_folder:
            gui.add_html(html_lines([_LEGEND]))
            if not self._all_folders:
                self._choice = gui.add_dropdown("Joint", tuple(self._moved))
                self.viewer.listen(
                    with_value(self._choice),
                    lambda event: self.viewer.select_joint(event.value),
                )
        if not self._all_folders:
            self._show_joint(next(iter(self._moved)), expanded=True)
            return
        for name in self._moved:
            self._show_joint(name, expanded=len(self._moved) <= MAX_OPEN_FOLDERS)

    def _show_joint(self, name: str, *, expanded: bool, first: bool = False) -> None:
        """Add the folder of a joint with its sliders, in place of the one before or above all."""
        if not self._all_folders:
            for other in list(self._folders):
                self._remove_joint(other)
        self._remove_joint(name)
        joint, gui = self._moved[name], self.viewer.server.gui
        order = 1e6 + list(self._moved).index(name)
        if first:
            self._first -= 1.0
            order = self._first
        with self._joints_folder:
            self._folders[name] = gui.add_folder(
                joint_label(name), expand_by_default=expanded, order=order
            )
            with self._folders[name]:
                for k in range(len(joint.chain)):
                    self._add_slider(joint, k)
        self._is_stale, self._synced = True, -1e9

    def _remove_joint(self, name: str) -> None:
        folder = self._folders.pop(name, None)
        if folder is not None:
            folder.remove()
            for coordinate in [each for each in self._rows if each.joint == name]:
                del self._rows[coordinate]

    def _add_slider(self, joint: Joint, index: int) -> None:
        factor, coordinate = joint.chain[index], Coordinate(joint.name, index)
        known = coordinate_range(joint, index, self.viewer.springs)
        scale, unit = factor.units.scale, factor.units.displacement
        if known.motion:
            sense = "" if known.sign > 0 else " (negative)"
            label = f"{known.motion.capitalize()}{sense} [{unit}]"
        else:
            label = f"{factor.units.preposition.capitalize()} {axis_label(factor.axis)} [{unit}]"
        value = self._value(coordinate) * scale
        low, high = (scale * end for end in (known.low, known.high))
        handle = self.viewer.server.gui.add_slider(
            label,
            min(low, value),
            max(high, value),
            0.1,
            value,
            marks=_marks(known, scale) or None,
            hint=_hint(known, scale, unit),
        )
        handle.precision = DECIMALS
        self._rows[coordinate] = _Row(handle, coordinate, scale, known)
        self.viewer.listen(
            with_value(handle),
            lambda event: self._move_slider(coordinate, event.value),
            f"slider {coordinate}",
        )

    def _build_files(self) -> None:
        gui, listen = self.viewer.server.gui, self.viewer.listen
        with gui.add_folder("File"):
            self._name = gui.add_text(
                "Save as", f"new{POSE_FILE.suffix}", hint="In the folder of the page"
            )
            buttons = gui.add_button_group("Pose file", ("Save", "Load"))
            self._list = gui.add_html("")
        listen(
            buttons.on_click,
            lambda event: (self._save if event.target.value == "Save" else self._load)(),
        )

    # -- changes by the user

    def _begin(self) -> None:
        """Take over the pose that a motion or a simulation shows."""
        if self.viewer.shown.driver is not Driver.POSE:
            self.editor.take_over(self.viewer.shown.displacements)

    def _show(self) -> None:
        """Show the editor's pose."""
        self._changed = self._now
        placement = self.editor.placement
        self.viewer.show(FigureState(Driver.POSE, placement.displacements, placement.poses))

    def _history(self, command: str) -> None:
        {UNDO: self.editor.undo, REDO: self.editor.redo, RESET: self.editor.reset}[command]()
        self._synced = -1e9
        self._show()

    def _mirror(self, label: str) -> None:
        self._begin()
        self.editor.mirror(Mirroring(label.lower()))
        self._synced = -1e9
        self._show()

    def _move_slider(self, coordinate: Coordinate, value: float) -> None:
        row = self._rows.get(coordinate)
        if row is None:  # the slider was removed meanwhile
            return
        row.touched = self._now
        self._is_stale = True
        value = min(max(value, row.handle.min), row.handle.max)  # a field sends any number typed
        if not self._attempt(lambda: self.editor.set_coordinate(coordinate, value / row.scale)):
            row.touched = -1e9

    def _pose_arm(self, side: Side) -> None:
        latitude, longitude = map(value_in_range, self._arms[side])
        self._arm_touched = self._now
        self._attempt(lambda: self.editor.pose_arm(side, radians(latitude), radians(longitude)))

    def _save(self) -> None:
        folder = self.viewer.content.folder
        requested = path_in_folder(folder, self._name.value, (POSE_FILE.suffix,))
        path = free_path(requested)
        self._begin()
        save_text(path, self.editor.text())
        self._files_read = -1e9
        self._name.value = name_in_folder(folder, path)  # which `Load` reads
        self.viewer.notify("Pose saved", written_text(requested, path))

    def _load(self) -> None:
        path = path_in_folder(self.viewer.content.folder, self._name.value, (POSE_FILE.suffix,))
        self._begin()
        self.editor.load(path)
        self._synced = -1e9
        self._show()

    def _attempt(self, change: Callable[[], None]) -> bool:
        """Change the pose and show it, or its error, but not again while that goes on."""
        self._begin()
        try:
            change()
        except MoverError as failure:
            text, when = self._last_error
            if str(failure) != text or self._now - when > 3.0:
                self.viewer.tell_error(failure)
            self._last_error = (str(failure), self._now)
            return False
        self._show()
        return True

    # -- changes by others

    def shown_changed(self, shown: FigureState) -> None:
        """Let the sliders follow."""
        self._is_stale = True
        if shown.driver is Driver.POSE and shown.displacements is not self.editor.displacements:
            self.editor.take_over(shown.displacements)

    def springs_changed(self, springs: SpringSet) -> None:
        """Renew the marks of the joints whose ranges have changed."""
        for row in self._rows.values():
            name, index = row.coordinate.joint, row.coordinate.index
            if coordinate_range(self._moved[name], index, springs) != row.known:
                self._stale_joints.add(name)

    def selection_changed(self, segment: str | None, joint: str | None) -> None:
        """Show the sliders of the selected joint."""
        if joint is None or joint not in self._moved:
            return
        if not self._all_folders:
            if joint not in self._folders:
                self._choice.value = joint
                self._show_joint(joint, expanded=True)
        elif len(self._moved) > MAX_OPEN_FOLDERS:
            self._show_joint(joint, expanded=True, first=True)

    def tick(self, now: float) -> None:
        """Move the dragged segment, and let controls follow at a moderate rate."""
        self._now = now
        pull = self.limb.take()
        if pull is not None:
            self._attempt(lambda: self.editor.drag(*pull))
        if now - self._changed > GROUP_TIME and not self.limb.is_dragged:
            self.editor.end_group()
        if now - self._synced >= FOLLOW_INTERVAL:
            if self._stale_joints:
                name = self._stale_joints.pop()
                if name in self._folders:
                    self._show_joint(name, expanded=True)
            if self._is_stale:
                self._synced = now
                self._is_stale = False
                self._follow()
            self.limb.follow()
        if now - self._files_read >= FILES_INTERVAL:
            self._files_read = now
            self._list_files()

    def _follow(self) -> None:
        """Set the sliders to what the page shows, but not one that the user moves."""
        for row in self._rows.values():
            if self._now - row.touched < TOUCH_TIME:
                self._is_stale = True
                continue
            shown = self.viewer.shown.displacements.get(row.coordinate.joint)
            is_known = shown is not None and row.coordinate.index < len(shown)
            if row.handle.disabled is is_known:
                row.handle.disabled = not is_known
            _set_slider(row.handle, row.scale * self._value(row.coordinate))
        if not self._arms or self.viewer.shown.driver is not Driver.POSE:
            return
        if self._now - self._arm_touched < TOUCH_TIME:
            self._is_stale = True
            return
        for side, handles in self._arms.items():
            direction = self.editor.arm_direction(side)
            for handle, angle in zip(handles, direction or (), strict=False):
                _set_slider(handle, degrees(angle))

    def _value(self, coordinate: Coordinate) -> float:
        """The displacement that the page shows [rad or m], or that of the editor."""
        for source in (self.viewer.shown.displacements, self.editor.displacements):
            values = source.get(coordinate.joint)
            if values is not None and coordinate.index < len(values):
                return float(values[coordinate.index])
        return 0.0

    def _list_files(self) -> None:
        names = names_in_folder(self.viewer.content.folder, POSE_FILE.suffix)
        if names != self._files:
            self._files = names
            text = ", ".join(names[:20]) + (", ..." if len(names) > 20 else "")
            self._list.content = html_lines([f"In the folder: {text}" if names else
                                             "The folder has no pose file yet."])  # fmt: skip


def _set_slider(handle: Any, value: float) -> None:
    """Set a slider if it differs, and widen it to contain the value."""
    if not isfinite(value) or abs(handle.value - value) < 1e-6:
        return
    if value < handle.min:
        handle.min = value
    if value > handle.max:
        handle.max = value
    handle.value = value


def _marks(known: CoordinateRange, scale: float) -> tuple[tuple[float, str], ...]:
    """Return places and letters of the marks of a slider; letters of places nearby are joined."""
    sources = (known.limits, known.normal, known.dead_zone, known.measured)
    places = sorted(
        (scale * end, letter)
        for letter, ends in zip("LNDM", sources, strict=True)
        for end in ends or ()
        if isfinite(end) and known.low <= end <= known.high
    )
    marks: list[tuple[float, str]] = []
    for place, letter in places:
        if marks and place - marks[-1][0] < MARK_DISTANCE * scale * (known.high - known.low):
            last, letters = marks.pop()
            marks.append((last, "".join(dict.fromkeys(letters + letter))))
        else:
            marks.append((round(place, 1), letter))
    return tuple(marks)


def _hint(known: CoordinateRange, scale: float, unit: str) -> str | None:
    """Return the ranges of a slider in words."""
    ranges = {
        "limits": known.limits,
        "normal range": known.normal,
        "dead zone": known.dead_zone,
        "measured": known.measured,
    }
    text = "; ".join(
        f"{name} {scale * ends[0]:.4g} to {scale * ends[1]:.4g} {unit}"
        for name, ends in ranges.items()
        if ends is not None
    )
    return text[:1].upper() + text[1:] if text else None
