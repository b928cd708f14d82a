"""Arrows on a segment, by which it is dragged with the mouse, and the joints that follow."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import viser

from generator.kinematics.reach import Target
from generator.rotations import Array, matrix_from_quaternion, quaternion_from_matrix
from generator.viewer.pose_editor import PoseEditor, drag_point, end_segments, limb_joints
from generator.viewer.viewer import Viewer

NO_SEGMENT = "none"

LIMB, WHOLE_FIGURE = "limb", "whole figure"

GIZMO = "/pose drag"
"""Node of the arrows."""

GIZMO_SIZE = 0.15
"""Length of the arrows as a part of the figure's size."""


@dataclass(frozen=True)
class _Pull:
    """An event of the arrows, with their pose at that time."""

    client: Any
    client_id: int
    phase: str
    position: Array
    wxyz: Array


@dataclass
class _Drag:
    """The segment that is dragged by a point in its frame [m], with its arrows, if any.

    By `restore` the meshes of the limb react to the mouse again; `clients` are pages that drag it,
    and the target is None when it has been taken.
    """

    segment: str = ""
    point: Array = field(default_factory=lambda: np.zeros(3))
    handle: viser.TransformControlsHandle | None = None
    restore: list[Callable[[], None]] = field(default_factory=list[Callable[[], None]])
    clients: set[int] = field(default_factory=set[int])
    target: Target | None = None


class LimbDrag:
    """Controls that choose a segment, and the arrows on it."""

    def __init__(self, viewer: Viewer, editor: PoseEditor) -> None:
        """Begin without a segment."""
        self.viewer, self.tree = viewer, editor.tree
        self._drag = _Drag()

    @property
    def arrows(self) -> viser.TransformControlsHandle | None:
        """The arrows, if a segment is chosen."""
        return self._drag.handle

    @property
    def is_dragged(self) -> bool:
        """Return whether somebody drags the segment."""
        return bool(self._drag.clients)

    def build(self) -> None:
        """Add the controls to the page."""
        gui = self.viewer.server.gui
        ends = end_segments(self.tree)
        if not ends:
            return
        with gui.add_folder("Drag"):
            self.segments = gui.add_dropdown(
                "Segment", (NO_SEGMENT, *ends), hint="Segment that gets arrows to drag it by"
            )
            self._moving = gui.add_dropdown(
                "Moving joints", (LIMB, WHOLE_FIGURE), hint="Joints that follow the drag"
            )
            self.turning = gui.add_checkbox(
                "With orientation", False, hint="Rotate the segment by the rings of the arrows"
            )
        for control in (self.segments, self.turning):
            self.viewer.listen(control.on_update, lambda _: self._choose())

    def take(self) -> tuple[Target, frozenset[str]] | None:
        """Return the last target, once, and the joints that do not move; None without a new one."""
        drag = self._drag
        drag.clients &= self.viewer.server.get_clients().keys()  # a page may be gone
        if drag.target is None:
            return None
        target, drag.target = drag.target, None
        joints = self.tree.figure.joints.keys()
        moving = set(joints)
        if self._moving.value == LIMB:
            moving = set(limb_joints(self.tree, drag.segment))
            moving |= {joint.name for joint in self.tree.closures}
        return target, frozenset(joints - moving)

    def follow(self) -> None:
        """Put the arrows to the segment, unless somebody drags it."""
        drag = self._drag
        if drag.handle is None or drag.clients:
            return
        position, wxyz = self._gizmo_pose()
        if np.max(np.abs(drag.handle.position - position)) > 1e-6:
            drag.handle.position = position
        if np.max(np.abs(drag.handle.wxyz - wxyz)) > 1e-6:
            drag.handle.wxyz = wxyz

    def _choose(self) -> None:
        """Move the arrows to the chosen segment."""
        if self._drag.handle is not None:
            self._drag.handle.remove()
            for restore in self._drag.restore:
                restore()
        self._drag = _Drag()
        segment = self.segments.value
        if segment == NO_SEGMENT:
            return
        self._drag = drag = _Drag(segment, drag_point(self.tree, segment))
        position, wxyz = self._gizmo_pose()
        drag.handle = self.viewer.server.scene.add_transform_controls(
            GIZMO,
            scale=GIZMO_SIZE * self._figure_size(),
            disable_rotations=not self.turning.value,
            depth_test=False,
            position=position,
            wxyz=wxyz,
        )
        joints = limb_joints(self.tree, segment)
        limb = [branch.outboard for branch in self.tree.joints if branch.joint.name in joints]
        meshes = self.viewer.scene.meshes
        drag.restore = [_ignore_mouse(meshes[name]) for name in limb if name in meshes]
        handle = drag.handle

        def register(notify: Callable[[Any], Any]) -> None:
            async def first(event: Any) -> None:
                position, wxyz = np.array(handle.position), np.array(handle.wxyz)
                await notify(_Pull(event.client, event.client_id, event.phase, position, wxyz))

            handle.on_update(first)

        self.viewer.listen(register, lambda event: self._pull(drag, event))

    def _figure_size(self) -> float:
        """Largest extent of the origins of the segments along an axis of the world [m]."""
        origins = np.array([pose[:3, 3] for pose in self.viewer.shown.poses.values()])
        return float(np.max(np.ptp(origins, axis=0))) or 1.0

    def _pull(self, drag: _Drag, event: _Pull) -> None:
        """Note where the segment is dragged to; `take` returns it."""
        if drag is not self._drag:
            return
        if event.phase == "end":
            drag.clients.discard(event.client_id)
            return
        drag.clients.add(event.client_id)
        if event.phase == "update":
            turn = matrix_from_quaternion(event.wxyz) if self.turning.value else None
            drag.target = Target(drag.segment, drag.point, event.position, turn)

    def _gizmo_pose(self) -> tuple[Array, Array]:
        """Position [m] and quaternion of the arrows at the segment's present pose."""
        pose = self.viewer.shown.poses[self._drag.segment]
        turn = pose[:3, :3] if self.turning.value else np.eye(3)
        return pose[:3, :3] @ self._drag.point + pose[:3, 3], quaternion_from_matrix(turn)


def _ignore_mouse(mesh: Any) -> Callable[[], None]:
    """Let the mouse reach the arrows inside a mesh; return a function that undoes it."""
    clicks, drags = list(mesh._impl.click_cb), list(mesh._impl.drag_cb)
    mesh.remove_click_callback("all")
    mesh.remove_drag_callback("all")

    def restore() -> None:
        for entry in clicks:
            mesh.on_click(modifier=entry.modifier)(entry.callback)
        for entry in drags:
            mesh.on_drag(entry.button, modifier=entry.modifier)(entry.callback)

    return restore
