"""Frames of an OpenSim model, by the paths that sockets name."""

from dataclasses import dataclass, field
from posixpath import join, normpath

import numpy as np

from generator.diagnostics import shorten, spelling_hint
from generator.model_files.xml import XmlElement
from generator.rotations import Array, matrix_from_xyz, pose_matrix

GROUND = "ground"

_OFFSET_FRAME_TAG = "PhysicalOffsetFrame"
_BODY_TAGS = ("Body", "Ground")


@dataclass
class FrameIndex:
    """The frames of a model by their paths.

    Attributes:
        paths: paths of every component with a name, by its place in memory.
        by_path: frames and bodies by path.
        by_name: likewise by name, the first of each.
    """

    paths: dict[int, str] = field(default_factory=dict[int, str])
    by_path: dict[str, XmlElement] = field(default_factory=dict[str, XmlElement])
    by_name: dict[str, XmlElement] = field(default_factory=dict[str, XmlElement])

    @classmethod
    def from_model(cls, model: XmlElement) -> "FrameIndex":
        """The frames of a model."""
        frames, waiting = cls(), [(model, "/")]
        while waiting:
            element, path = waiting.pop()
            frames.paths[id(element)] = path
            for child in reversed(element.children):
                name = child.get("name")
                if name is None and child.tag.endswith("Set"):
                    name = child.tag.lower()
                waiting.append((child, path if name is None else join(path, name)))
            if element.tag in (_OFFSET_FRAME_TAG, *_BODY_TAGS):
                frames.by_path.setdefault(path, element)
                frames.by_name.setdefault(path.rsplit("/", 1)[-1], element)
        return frames

    def resolve(
        self, owner: XmlElement, socket: str, default: XmlElement | None = None
    ) -> tuple[str, Array] | None:
        """Return the body to which the frame of a socket is fixed, and the frame's pose in it.

        The ground is called `ground`. None, with an error, for a frame that does not exist;
        `default` is the frame of a component without the socket.
        """
        pose = np.eye(4)
        if default is not None and not owner.child_text(socket):
            if default.tag in _BODY_TAGS:
                return _body_name(default), pose
            pose, owner, socket = self._offset_pose(default), default, "socket_parent"
        for _ in range(len(self.by_path) + 1):
            reference = owner.find(socket)
            if reference is None or not reference.text.text:
                owner.error(f"`{owner.tag}` has no `{socket}`", "it names a frame")
                return None
            frame = self._find_frame(owner, reference.text.text)
            if frame is None and reference.text.text.rsplit("/", 1)[-1] == GROUND:
                return GROUND, pose
            if frame is None:
                reference.error(
                    f"unknown frame `{shorten(reference.text.text)}`",
                    spelling_hint(reference.text.text.rsplit("/", 1)[-1], self.by_name),
                    reference.text.span,
                )
                return None
            if frame.tag in _BODY_TAGS:
                return _body_name(frame), pose
            pose = self._offset_pose(frame) @ pose
            owner, socket = frame, "socket_parent"
        owner.error("these frames refer to each other in a circle")
        return None

    def _find_frame(self, owner: XmlElement, path: str) -> XmlElement | None:
        """Return the frame at a path; else that of its last name, as early files have it."""
        whole = normpath(join(self.paths[id(owner)], path))
        name = path.rsplit("/", 1)[-1]
        return self.by_path.get(whole) or (None if name == ".." else self.by_name.get(name))

    def _offset_pose(self, frame: XmlElement) -> Array:
        """Pose of an offset frame in its parent, shape (4, 4)."""
        a, b, c = frame.child_numbers("orientation", (0.0, 0.0, 0.0))
        offset = frame.child_numbers("translation", (0.0, 0.0, 0.0))
        return pose_matrix(matrix_from_xyz(a, b, c), np.array(offset))


def _body_name(element: XmlElement) -> str:
    return GROUND if element.tag == "Ground" else element.get("name") or ""
