"""Frames of an OpenSim model: which body each stands on, and where.

A socket names a frame by its path among the components of the model, either from the model
(`/bodyset/femur_r`) or from the component that has the socket (`..`, `hip_offset`).
"""

from dataclasses import dataclass, field
from posixpath import join, normpath

import numpy as np

from generator.errors import nearest
from generator.exchange.incoming.osim_values import numbers_in
from generator.exchange.incoming.xml_text import Element
from generator.frames import Array, homogeneous, matrix_from_xyz
from generator.reader.findings import Findings
from generator.reader.vocabulary import shown

GROUND = "ground"

_OFFSET = "PhysicalOffsetFrame"
_BASES = ("Body", "Ground")


@dataclass
class Frames:
    """The frames of a model by their paths.

    Attributes:
        findings: for faults.
        paths: of every component with a name, by its place in memory.
        found: frames and bodies by path.
        named: likewise by name, the first of each.
    """

    findings: Findings
    paths: dict[int, str] = field(default_factory=dict[int, str])
    found: dict[str, Element] = field(default_factory=dict[str, Element])
    named: dict[str, Element] = field(default_factory=dict[str, Element])

    @classmethod
    def of(cls, model: Element, findings: Findings) -> "Frames":
        """The frames of a model."""
        frames, waiting = cls(findings), [(model, "/")]
        while waiting:
            element, path = waiting.pop()
            frames.paths[id(element)] = path
            for child in reversed(element.children):
                name = child.get("name")
                if name is None and child.tag.endswith("Set"):
                    name = child.tag.lower()
                waiting.append((child, path if name is None else join(path, name)))
            if element.tag in (_OFFSET, *_BASES):
                frames.found.setdefault(path, element)
                frames.named.setdefault(path.rsplit("/", 1)[-1], element)
        return frames

    def base(self, holder: Element, socket: str) -> tuple[str, Array] | None:
        """The body on which the frame stands that a socket names, and the frame's pose in it.

        The ground is called `ground`. None, with the fault noted, where there is no such frame.
        """
        pose = np.eye(4)
        for _ in range(len(self.found) + 1):
            held = holder.first(socket)
            if held is None or not held.text.text:
                self.findings.error(
                    f"`{holder.tag}` has no `{socket}`", holder.span, "it names a frame"
                )
                return None
            frame = self._meant(holder, held.text.text)
            if frame is None and held.text.text.rsplit("/", 1)[-1] == GROUND:
                return GROUND, pose
            if frame is None:
                self.findings.error(
                    f"there is no frame `{shown(held.text.text)}`",
                    held.text.span,
                    nearest(held.text.text.rsplit("/", 1)[-1], self.named),
                )
                return None
            if frame.tag in _BASES:
                return GROUND if frame.tag == "Ground" else frame.get("name") or "", pose
            pose = self._offset(frame) @ pose
            holder, socket = frame, "socket_parent"
        self.findings.error("these frames stand on each other in a ring", holder.span)
        return None

    def _meant(self, holder: Element, path: str) -> Element | None:
        """The frame at a path; else the one of its last name, since early files told no more."""
        whole = normpath(join(self.paths[id(holder)], path))
        name = path.rsplit("/", 1)[-1]
        return self.found.get(whole) or (None if name == ".." else self.named.get(name))

    def _offset(self, frame: Element) -> Array:
        """Pose of an offset frame in its parent, shape (4, 4)."""
        a, b, c = numbers_in(frame, "orientation", (0.0, 0.0, 0.0), self.findings)
        offset = numbers_in(frame, "translation", (0.0, 0.0, 0.0), self.findings)
        return homogeneous(matrix_from_xyz(a, b, c), np.array(offset))
