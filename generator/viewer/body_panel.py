"""The body: mass properties of a segment, and the balance of the figure."""

from collections.abc import Mapping
from threading import Thread
from typing import Any

import numpy as np
import viser

from generator.diagnostics import InputError, MoverError
from generator.rotations import Array
from generator.viewer import balance
from generator.viewer.scene import node_name, points_in_world
from generator.viewer.segment_mass import (
    SegmentVolume,
    equimomental_semi_axes,
    mass_lines,
    segment_volume,
)
from generator.viewer.surroundings import FrameAxes, joint_frames, site_frames
from generator.viewer.viewer import FigureState, Panel, Viewer, html_lines

BALANCED_COLOUR, UNBALANCED_COLOUR = (32, 150, 60), (214, 45, 32)

_EDGE_COLOUR = (255, 196, 0)

_LINE_COLOUR, _ELLIPSOID_COLOUR = (90, 110, 200), (190, 60, 150)

_NODE_INTERVAL, _TEXT_INTERVAL = 1.0 / 15.0, 1.0 / 5.0
"""Shortest time between two changes of nodes and of texts [s]."""

_FIRST_CORNERS = 32
"""Number of corners for which the nodes of the support are made; more than most supports have."""

_LIFT = 0.002
"""Height of the drawn support above the plane of support [m]."""

_NO_SEGMENT = "(none)"


class BalanceNodes:
    """Centre of mass, plumb line and support in the scene, in the colour of the balance.

    The foot is below the centre of mass, on the plane of support; over the edge the figure tips.
    """

    def __init__(self, scene: viser.SceneApi, size: float) -> None:
        """Add the nodes for a figure of a size [m], hidden."""
        self._scene, self._size = scene, size
        self._root = scene.add_frame("/balance", show_axes=False, visible=False)
        self.centre = scene.add_icosphere("/balance/centre", 0.012 * size, UNBALANCED_COLOUR)
        self.foot = scene.add_icosphere("/balance/foot", 0.006 * size, UNBALANCED_COLOUR)
        self.plumb = self._lines("plumb", 1, _LINE_COLOUR, 0.004)
        self.margin = scene.add_label("/balance/margin", "", anchor="center-left")
        self._make_support(_FIRST_CORNERS)

    def _make_support(self, count: int) -> None:
        self._count = count
        fan = np.stack([np.zeros(count - 2), np.arange(1, count - 1), np.arange(2, count)], axis=1)
        self.area = self._scene.add_mesh_simple(
            "/balance/support",
            np.zeros((count, 3)),
            fan.astype(np.int64),
            color=UNBALANCED_COLOUR,
            opacity=0.45,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )
        self.outline = self._lines("outline", count, UNBALANCED_COLOUR, 0.003)
        self.edge = self._lines("edge", 1, _EDGE_COLOUR, 0.008)

    def _lines(
        self, name: str, count: int, colour: tuple[int, int, int], thickness: float
    ) -> viser.LineSegmentsHandle:
        return self._scene.add_line_segments(
            f"/balance/{name}", np.zeros((count, 2, 3)), colour, thickness=thickness * self._size
        )

    def show(self, state: balance.BalanceState) -> None:
        """Draw a state."""
        corners = state.corners + np.array([0.0, _LIFT * self._size, 0.0])
        foot = state.foot
        if len(corners) > self._count:
            self._make_support(2 * len(corners))
        if len(corners):
            ring = np.append(corners, np.repeat(corners[-1:], self._count - len(corners), 0), 0)
            self.area.vertices = ring.astype(np.float32)
            outline = np.stack([ring, np.roll(ring, -1, axis=0)], axis=1)
            self.outline.points = outline.astype(np.float32)
            self.edge.points = state.pivot[None].astype(np.float32)
        for node in (self.area, self.outline, self.edge):
            node.visible = bool(len(corners))
        colour = BALANCED_COLOUR if state.is_balanced else UNBALANCED_COLOUR
        if self.area.color != colour:
            self.area.color = self.centre.color = self.foot.color = colour
            self.outline.colors = np.array(colour, dtype=np.uint8)
        self.centre.position = state.centre
        self.foot.position = foot
        self.margin.position = foot + np.array([0.03 * self._size, 0.0, 0.0])
        if self.margin.text != (text := balance.margin_text(state)):
            self.margin.text = text
        self.plumb.points = np.array([[state.centre, foot]], dtype=np.float32)
        self._root.visible = True

    def hide(self) -> None:
        """Hide the nodes."""
        self._root.visible = False


class BodyPanel(Panel):
    """Segments with their mass properties, balance, frames, and the view."""

    title = "Body"

    def __init__(self, viewer: Viewer) -> None:
        """Collect the vertices and masses of the figure."""
        super().__init__(viewer)
        self._volumes: Mapping[str, SegmentVolume] = {}
        self._obstacle = ""
        try:
            self._model = balance.BalanceModel(viewer.figure, viewer.scene.appearances)
        except InputError as failure:
            self._model, self._obstacle = None, failure.diagnostics[0].message
        except MoverError as failure:
            self._model, self._obstacle = None, str(failure)
        points = points_in_world(viewer.scene, viewer.shown.poses)
        self._size = max(float(np.linalg.norm(np.ptp(points, axis=0))), 1e-2)
        self._ellipsoid: viser.IcosphereHandle | None = None
        self._nodes_due = self._texts_due = True
        self._nodes_at = self._texts_at = 0.0

    def build(self) -> None:
        """Add the controls and the nodes."""
        viewer, gui, scene = self.viewer, self.viewer.server.gui, self.viewer.server.scene
        self._body_text = gui.add_html("")
        self._balance_box = gui.add_checkbox(
            "Balance", False, disabled=self._model is None, hint="Centre of mass over the support"
        )
        self._height = gui.add_number(
            "Support height [cm]",
            100.0 * balance.DEFAULT_SUPPORT_HEIGHT,
            min=0.0,
            max=20.0,
            step=0.1,
            disabled=self._model is None,
            hint="Height above the lowest point up to which points support the figure",
        )
        names = (_NO_SEGMENT, *viewer.figure.segments)
        self._segment = gui.add_dropdown("Segment", names, initial_value=_NO_SEGMENT)
        self._segment_text = gui.add_html("")
        self._ellipsoid_box = gui.add_checkbox(
            "Inertia ellipsoid", False, hint="Uniform ellipsoid of the same mass and moments"
        )
        self._sites_box = gui.add_checkbox("Site frames", False)
        self._joints_box = gui.add_checkbox("Joint frames", False)
        self._dark_box = gui.add_checkbox("Dark", False)
        camera = gui.add_button("Frame the figure")
        if viewer.scene.losses:
            gui.add_html(html_lines([f"Note: {loss}" for loss in viewer.scene.losses]))
        self._nodes = BalanceNodes(scene, self._size)
        self._sites = FrameAxes(viewer.server, "/site_frames", site_frames(viewer.figure))
        self._joints = FrameAxes(viewer.server, "/joint_frames", joint_frames(viewer.figure))
        viewer.listen(self._balance_box.on_update, self._mark_due)
        viewer.listen(self._height.on_update, self._change_height, "support height")
        viewer.listen(self._segment.on_update, self._choose_segment, "segment")
        viewer.listen(self._ellipsoid_box.on_update, self._change_ellipsoid)
        viewer.listen(self._sites_box.on_update, self._mark_due)
        viewer.listen(self._joints_box.on_update, self._mark_due)
        viewer.listen(
            self._dark_box.on_update,
            lambda _: viewer.surroundings.set_dark(is_dark=self._dark_box.value),
        )
        viewer.listen(camera.on_click, lambda _: viewer.frame_camera())
        Thread(target=self._compute_volumes, daemon=True).start()

    def _compute_volumes(self) -> None:
        """Compute the volumes of all segments, in a thread: closed surfaces are checked first."""
        figure = self.viewer.figure
        volumes = {name: segment_volume(figure, each) for name, each in figure.segments.items()}
        self.viewer.post(lambda: self._set_volumes(volumes))

    def _set_volumes(self, volumes: Mapping[str, SegmentVolume]) -> None:
        self._volumes = volumes
        self._show_segment()

    def _mark_due(self, _event: Any = None) -> None:
        self._nodes_due = self._texts_due = True
        self._nodes_at = self._texts_at = 0.0

    def _change_height(self, _event: Any) -> None:
        if self._model is not None:
            self._model.support_height = self._height.value / 100.0
        self._mark_due()

    def _change_ellipsoid(self, _event: Any) -> None:
        self._draw_ellipsoid()
        self._mark_due()

    def _choose_segment(self, _event: Any) -> None:
        if self._segment.value == _NO_SEGMENT:
            self.viewer.deselect()
        else:
            self.viewer.select_segment(self._segment.value)

    def selection_changed(self, segment: str | None, joint: str | None) -> None:
        """Show the numbers of the segment, and draw its ellipsoid."""
        value = _NO_SEGMENT if segment is None else segment
        if self._segment.value != value:
            self._segment.value = value
        self._show_segment()
        self._draw_ellipsoid()

    def _show_segment(self) -> None:
        name = self.viewer.segment
        lines = (
            ["Click a segment to see its mass properties."]
            if name is None
            else mass_lines(self.viewer.figure.segments[name], self._volumes.get(name))
        )
        self._segment_text.content = html_lines(lines)

    def _draw_ellipsoid(self) -> None:
        """Draw the ellipsoid of the selected segment in the segment."""
        if self._ellipsoid is not None:
            self._ellipsoid.remove()
            self._ellipsoid = None
        meshes, name = self.viewer.scene.meshes, self.viewer.segment
        if not self._ellipsoid_box.value or name not in meshes:
            return
        segment = self.viewer.figure.segments[name]
        centre = segment.centre_of_mass
        if segment.inertia is None or centre is None or not segment.mass or segment.mass < 0.0:
            return
        a, b, c = equimomental_semi_axes(segment.mass, segment.inertia).tolist()
        self._ellipsoid = self.viewer.server.scene.add_icosphere(
            f"{node_name(name)}/inertia",
            1.0,
            _ELLIPSOID_COLOUR,
            scale=(a, b, c),
            position=tuple(centre.tolist()),
            cast_shadow=False,
            receive_shadow=False,
        )

    def shown_changed(self, shown: FigureState) -> None:
        """Follow the figure, at the next tick that is due."""
        self._nodes_due = self._texts_due = True

    def tick(self, now: float) -> None:
        """Update nodes and texts that are due."""
        if self._nodes_due and now - self._nodes_at >= _NODE_INTERVAL:
            self._nodes_due, self._nodes_at = False, now
            self._update_nodes(self.viewer.shown.poses)
        if self._texts_due and now - self._texts_at >= _TEXT_INTERVAL:
            self._texts_due, self._texts_at = False, now
            self._update_text()

    def _update_nodes(self, poses: Mapping[str, Array]) -> None:
        boxes = (self._balance_box, self._ellipsoid_box, self._sites_box, self._joints_box)
        with self.viewer.server.atomic():
            self.viewer.scene.set_translucent(is_translucent=any(box.value for box in boxes))
            if self._model is not None and self._balance_box.value:
                self._nodes.show(self._model.state(poses))
            else:
                self._nodes.hide()
            for axes, box, length in (
                (self._sites, self._sites_box, 0.025),
                (self._joints, self._joints_box, 0.05),
            ):
                if box.value:
                    axes.show(poses, length * self._size)
                else:
                    axes.hide()

    def _update_text(self) -> None:
        lines: list[str] = []
        if self._model is None:
            lines.append(f"No balance: {self._obstacle}")
        else:
            state = self._model.state(self.viewer.shown.poses)
            height = 100.0 * float(state.centre[1])
            lines.append(f"Mass of the figure: {self._model.masses.total:.4g} kg")
            lines.append(f"Height of the centre of mass: {height:.1f} cm")
            if self._balance_box.value:
                lines.append(balance.balance_text(state))
                lowest = round(100.0 * state.height, 1) + 0.0
                lines.append(f"Height of the lowest point: {lowest:.1f} cm")
        content = html_lines(lines)
        if self._body_text.content != content:
            self._body_text.content = content
