"""The tab of a joint's passive moment: its curve, the literature, and what changes it."""

from collections.abc import Callable
from dataclasses import replace
from math import degrees, radians
from typing import Any

import numpy as np
import viser

from generator.diagnostics import MoverError
from generator.passive_curve import PassiveCurve, passive_torque
from generator.springs_file.edit import SpringEdit, cubic_dead_zone, elastic_law, plain_law
from generator.springs_file.parse import SPRINGS_FILE
from generator.viewer import curve_editor
from generator.viewer.folder import (
    free_path,
    name_in_folder,
    path_in_folder,
    save_text,
    written_text,
)
from generator.viewer.viewer import FigureState, Panel, Viewer, html_lines, value_in_range
from springs import Linear, SpringSet

CHART_INTERVAL = 1.0 / 15.0
"""Shortest time between two updates of the chart [s]."""

TEXT_INTERVAL = 0.2
"""Shortest time between two updates of the text [s]."""

CHART_HEIGHT = 300
"""Height of the chart [pixels]."""

MAX_SCALE = 4.0

MAX_OFFSET = 45.0
"""Largest shift of a curve [deg]."""

_MOVED = 1e-5
"""Change of an angle that the chart shows [rad]."""

ZONE_END = 150.0
"""End of the slider of a dead zone [deg]."""

_COUPLING_TORQUE = 0.05
"""Difference by which the other axes of a joint change its torque about one [N m]."""

_LARGEST_NUMBER = 1e4
"""Largest stiffness [N m/rad], damping [N m s/rad] and friction [N m] of the controls."""

_DECIMALS = 6
"""Decimals of the fields, of which viser keeps no more than those of the step."""


class CurvePanel(Panel):
    """Controls of the passive moment curve of one axis of one joint."""

    title = "Curve"

    def __init__(self, viewer: Viewer) -> None:
        """Begin without changes, with the first curve of the figure."""
        super().__init__(viewer)
        content = viewer.content
        self.editor = curve_editor.CurveEditor(
            content.figure, content.springs, content.folder, content.springs_choice
        )
        self.key: curve_editor.CurveKey | None = None
        self.curve: PassiveCurve | None = None
        self.loaded: PassiveCurve | None = None
        self._joints = self.editor.joints
        self._drawn_angle: float | None = None
        self._drawn_axes: tuple[str, tuple[float, float, float, float]] | None = None
        self._is_chart_due = self._is_text_due = True
        self._next_chart = self._next_text = 0.0

    def build(self) -> None:
        """Add the controls."""
        gui = self.viewer.server.gui
        if not self._joints:
            gui.add_html(
                html_lines(["No joint of this figure has a passive moment about an axis."])
            )
            return
        self._joint = gui.add_dropdown("Joint", tuple(self._joints))
        self._motion: viser.GuiDropdownHandle[str] = gui.add_dropdown("Motion", ["-"])
        self._chart = gui.add_uplot(
            tuple(np.zeros(2) for _ in curve_editor.chart_series()),
            curve_editor.chart_series(),  # pyright: ignore[reportArgumentType]
            bands=curve_editor.chart_bands(),  # pyright: ignore[reportArgumentType]
            scales={"x": {"time": False}, "y": {"range": (-1.0, 1.0)}},
            legend={"show": False},
            cursor={"drag": {"x": False, "y": False}, "points": {"show": False}},
            height=CHART_HEIGHT,
            padding=(8, 12, 0, 0),
        )
        self._text = gui.add_html("")
        self._legend = gui.add_html("")
        self._build_changes()
        with gui.add_folder("Sources"):
            self._sources = gui.add_html("")
        listen = self.viewer.listen
        listen(self._joint.on_update, lambda _: self._choose_joint(), "curve joint")
        listen(self._motion.on_update, lambda _: self._choose_motion(), "curve motion")
        self._select(self.editor.best_known_joint)

    def _build_changes(self) -> None:
        """Add the controls that change the curve."""
        gui = self.viewer.server.gui
        self._changes = gui.add_folder("Change")
        with self._changes:
            self._scale = gui.add_slider(
                "Scale", 0.0, MAX_SCALE, 0.05, 1.0, hint="Factor of the torque as loaded"
            )
            self._stiffness = gui.add_number(
                "Stiffness [N m/rad]", 0.0, min=0.0, max=_LARGEST_NUMBER, step=0.1
            )
            self._offset = gui.add_slider(
                "Shift [deg]", -MAX_OFFSET, MAX_OFFSET, 0.5, 0.0, hint="Towards larger angles"
            )
            self._zone = tuple(
                gui.add_slider(
                    f"Dead zone {end} [deg]", -ZONE_END, ZONE_END, 0.1, 0.0,
                    hint="As loaded, not shifted",
                )
                for end in ("from", "to")
            )  # fmt: skip
            self._viscous = gui.add_number(
                "Damping [N m s/rad]", 0.0, min=0.0, max=_LARGEST_NUMBER, step=0.01,
                hint="Torque against the rate of the angle",
            )  # fmt: skip
            self._coulomb = gui.add_number(
                "Friction [N m]", 0.0, min=0.0, max=_LARGEST_NUMBER, step=0.01,
                hint="Coulomb friction",
            )  # fmt: skip
            for number in (self._stiffness, self._viscous, self._coulomb):
                number.precision = _DECIMALS
            self._both = gui.add_checkbox(
                "Both sides", False, hint="Also change the joint on the other side"
            )
            self._undo = gui.add_button("Undo changes of this curve", disabled=True)
        self._file = gui.add_text("File", f"changed{SPRINGS_FILE.suffix}")
        self._save = gui.add_button("Save as .springs.toml", disabled=True)
        fields: dict[str, tuple[Any, Callable[[Any], Any]]] = {
            "scale": (self._scale, float),
            "stiffness": (self._stiffness, float),
            "offset": (self._offset, radians),
            "viscous": (self._viscous, float),
            "coulomb": (self._coulomb, float),
        }
        for name, (control, convert) in fields.items():
            self.viewer.listen(
                control.on_update,
                lambda _, name=name, control=control, convert=convert: self._change(
                    name, convert(value_in_range(control))
                ),
                f"curve {name}",
            )
        for place, control in enumerate(self._zone):
            self.viewer.listen(
                control.on_update, lambda _, place=place: self._change_zone(place), "curve zone"
            )
        self.viewer.listen(self._both.on_update, lambda _: self._change_both(), "curve both")
        self.viewer.listen(self._undo.on_click, lambda _: self._undo_changes())
        self.viewer.listen(self._save.on_click, lambda _: self._save_file())

    def _choose_joint(self) -> None:
        joint = self._joints[self._joint.value]
        self._select(joint)
        self.viewer.select_joint(joint)

    def _choose_motion(self) -> None:
        if self.key is not None:
            self._select(self.key[0], self._motion.value)

    def selection_changed(self, segment: str | None, joint: str | None) -> None:
        """Show the curve of a joint that was selected elsewhere."""
        is_other = self.key is not None and joint != self.key[0]
        if joint is not None and is_other and joint in self._joints.values():
            self._select(joint)

    def _select(self, joint: str, motion: str | None = None) -> None:
        """Show the curve of a motion of a joint, at first that of flexion."""
        motions = self.editor.motions(joint)
        if motion not in motions:
            motion = "flexion" if "flexion" in motions else next(iter(motions))
        self.key = joint, motions[motion]
        self._drawn_axes = None
        label = next(label for label, name in self._joints.items() if name == joint)
        with self.viewer.server.atomic():
            if self._joint.value != label:
                self._joint.value = label
            if self._motion.options != tuple(motions):
                self._motion.options = tuple(motions)
            if self._motion.value != motion:
                self._motion.value = motion
            self._set_controls()
            self._drawn_angle = None
            self._draw_chart()
            self._draw_text()

    def _set_controls(self) -> None:
        """Set the controls of the changes to those of the curve."""
        assert self.key is not None
        edit, spring = self.editor.edit(self.key), self.editor.loaded_spring(self.key)
        law, zone = elastic_law(spring), cubic_dead_zone(spring)
        plain = None if law is None else plain_law(law).law
        linear = plain if isinstance(plain, Linear) else None
        self._scale.visible = law is not None and linear is None
        self._offset.visible = law is not None
        self._stiffness.visible = linear is not None
        self._scale.value = edit.scale
        self._offset.value = round(degrees(edit.offset), 3)
        if linear is not None:
            self._stiffness.value = linear.stiffness if edit.stiffness is None else edit.stiffness
        ends = edit.dead_zone or zone or (0.0, 0.0)
        for control, end in zip(self._zone, ends, strict=True):
            control.visible = zone is not None
            angle = round(degrees(end), 1)
            control.min, control.max = min(angle, -ZONE_END), max(angle, ZONE_END)
            control.value = angle
        damping = spring.damping
        self._viscous.value = damping.viscous if edit.viscous is None else edit.viscous
        self._coulomb.value = damping.coulomb if edit.coulomb is None else edit.coulomb
        self._both.visible = self.editor.other_side(self.key) is not None
        self._set_buttons()

    def _set_buttons(self) -> None:
        assert self.key is not None
        self._undo.disabled = self.key not in self.editor.edits
        self._save.disabled = not self.editor.edits

    def _change(self, field: str, value: Any) -> None:
        """Change one property of the curve; a value as loaded undoes its change."""
        if self.key is not None:
            edit = replace(self.editor.edit(self.key), **{field: value})
            self._apply(edit)

    def _change_zone(self, place: int) -> None:
        """Change one edge of the dead zone; the other edge limits it."""
        assert self.key is not None
        zone = self.editor.edit(self.key).dead_zone
        zone = zone or cubic_dead_zone(self.editor.loaded_spring(self.key))
        if zone is not None:
            edge = radians(value_in_range(self._zone[place]))
            changed = (min(edge, zone[1]), zone[1]) if place == 0 else (zone[0], max(edge, zone[0]))
            self._change("dead_zone", changed)

    def _change_both(self) -> None:
        if self.key is not None and self._both.value:
            self._apply(self.editor.edit(self.key))

    def _undo_changes(self) -> None:
        if self.key is not None:
            self._apply(SpringEdit(*self.key))
            self._set_controls()

    def _apply(self, edit: SpringEdit) -> None:
        try:
            springs = self.editor.change(edit, both_sides=self._both.value)
        except MoverError:
            self._set_controls()
            raise
        self.viewer.set_springs(springs)
        self._set_buttons()

    def _save_file(self) -> None:
        name = self._file.value.strip()
        if name and not name.endswith(SPRINGS_FILE.suffix):
            name = name.removesuffix(".toml") + SPRINGS_FILE.suffix
        folder = self.viewer.content.folder
        requested = path_in_folder(folder, name, (".toml",))
        path = free_path(requested)
        save_text(path, self.editor.text(path))
        self._file.value = name_in_folder(folder, path)
        self.viewer.notify("Springs saved", written_text(requested, path))

    def shown_changed(self, shown: FigureState) -> None:
        """Move the point in the next tick."""
        self._is_chart_due = self._is_text_due = True

    def springs_changed(self, springs: SpringSet) -> None:
        """Draw the curve of other springs in the next tick."""
        self._drawn_angle = None
        self._is_chart_due = self._is_text_due = True

    def tick(self, now: float) -> None:
        """Move the point and renew the text, not too often."""
        if self.key is None:
            return
        if self._is_chart_due and now >= self._next_chart:
            self._next_chart, self._is_chart_due = now + CHART_INTERVAL, False
            self._draw_chart()
        if self._is_text_due and now >= self._next_text:
            self._next_text, self._is_text_due = now + TEXT_INTERVAL, False
            self._draw_text()

    def _draw_chart(self) -> None:
        """Draw the curve in the present pose; its law too where it is another one."""
        assert self.key is not None
        at = self.viewer.shown.displacements
        if self._drawn_angle is None or (self.curve is not None and self.curve.held_angles):
            self.curve = self.editor.curve(self.viewer.springs, self.key, at)
            self.loaded = self.editor.curve(self.editor.loaded, self.key, at)
            self._drawn_angle = None
        curve, loaded = self.curve, self.loaded
        if curve is None or loaded is None:
            return
        angle = float(curve.component(at))
        if self._drawn_angle is not None and abs(angle - self._drawn_angle) < _MOVED:
            return
        self._drawn_angle = angle
        limit = curve_editor.torque_limit(loaded, float(curve.moment_at(angle)))
        low, high = curve_editor.angle_limits(curve, loaded, angle)
        if self._drawn_axes is not None and self._drawn_axes[0] == curve.label:
            first, last, *_ = self._drawn_axes[1]  # the range of angles of a curve only grows
            low, high = min(low, first), max(high, last)
        limits = (low, high, -limit, limit)
        with self.viewer.server.atomic():
            if (curve.label, limits) != self._drawn_axes:
                self._drawn_axes = curve.label, limits
                self._chart.axes = curve_editor.chart_axes(curve)  # pyright: ignore[reportAttributeAccessIssue]
                self._chart.scales = {
                    "x": {"time": False, "range": limits[:2]},
                    "y": {"range": limits[2:]},
                }
            self._chart.data = curve_editor.chart_data(curve, loaded, angle, limit)

    def _draw_text(self) -> None:
        """Write the moment and the legend."""
        curve, at = self.curve, self.viewer.shown.displacements
        if curve is None or self.key is None:
            return
        angle = float(curve.component(at))
        first, *others = curve.describe(angle)
        joint, spring = curve.joint, curve.spring
        torque = passive_torque(self.viewer.figure, self.viewer.springs, joint, at)
        about, size = float(torque @ np.array(spring.direction)), float(np.linalg.norm(torque))
        if abs(about - float(curve.moment_at(angle))) > _COUPLING_TORQUE:
            others.append(
                f"With all axes of the joint: {about:.1f} N m about this one, {size:.1f} N m in all"
            )
        self._write(self._text, curve_editor.moment_html(first, others))
        is_changed = self.key in self.editor.edits
        self._write(self._legend, curve_editor.legend_html(curve, is_changed=is_changed))
        self._write(self._sources, curve_editor.sources_html(curve))

    def _write(self, control: Any, content: str) -> None:
        """Send text to the page if it is another one."""
        if control.content != content:
            control.content = content
