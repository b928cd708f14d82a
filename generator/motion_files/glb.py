"""A motion as binary glTF: what browsers, Blender and game engines play.

A node for every segment, within that of the segment it hangs from, with its psurf as a mesh, its
sites as nodes within it, and channels for its orientation. Lengths are metres, y is up, the figure
faces +z: glTF's own convention is that of a figure's world.

The container of a binary glTF file (`.glb`): one JSON document and one block of numbers.

glTF 2.0, Khronos Group (ISO/IEC 12113:2022), sections 3.6 (buffers, accessors) and 4 (GLB).
"""

import json
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from generator.diagnostics import MoverError
from generator.figure import Segment
from generator.geometry.appearance import (
    Appearance,
    Colour,
    linear_colour,
    segment_appearances,
    triangles_with_normals,
)
from generator.losses import Loss, Losses
from generator.motion_files.motion import NO_MASSES, FigureMotion, unrepresented
from generator.motion_files.skeleton import Bone, Skeleton, build_skeleton, continuous_quaternions
from generator.rotations import Array
from generator.text_io import write_atomic

_MAGIC, _VERSION = b"glTF", 2
_JSON, _BIN = b"JSON", b"BIN\x00"
_FLOAT = 5126
_VERTICES = 34962

AccessorType = Literal["SCALAR", "VEC3", "VEC4"]


class Buffer:
    """The block of numbers, and the accessors that say what lies where in it."""

    def __init__(self) -> None:
        """Begin without any."""
        self._data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(
        self, values: Array, kind: AccessorType, *, bounds: bool = False, vertices: bool = False
    ) -> int:
        """Put values, a row each, into the block as floats of 32 bits; the accessor's number.

        Args:
            values: shape (n,) for scalars, (n, 3) or (n, 4) for vectors.
            kind: what a row is.
            bounds: whether the accessor must tell least and greatest, as positions and times do.
            vertices: whether the values belong to the vertices of a mesh.
        """
        rounded: NDArray[np.float32] = np.ascontiguousarray(values, dtype="<f4")
        view: dict[str, Any] = {
            "buffer": 0,
            "byteOffset": len(self._data),
            "byteLength": rounded.nbytes,
        }
        if vertices:
            view["target"] = _VERTICES
        self._data += rounded.tobytes()
        self.views.append(view)
        accessor: dict[str, Any] = {
            "bufferView": len(self.views) - 1,
            "componentType": _FLOAT,
            "count": len(rounded),
            "type": kind,
        }
        if bounds:
            flat = rounded.reshape(len(rounded), -1).astype(float)
            accessor["min"] = flat.min(axis=0).tolist()
            accessor["max"] = flat.max(axis=0).tolist()
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def to_glb(self, document: dict[str, Any]) -> bytes:
        """The file of a document, which gets buffer, views and accessors. Lists may be empty."""
        whole = {
            **document,
            "buffers": [{"byteLength": len(self._data)}] if self._data else [],
            "bufferViews": self.views,
            "accessors": self.accessors,
        }
        present = {name: part for name, part in whole.items() if part != []}
        text = json.dumps(present, separators=(",", ":"), allow_nan=False).encode()
        chunks = _chunk(_JSON, text, b" ")
        if self._data:
            chunks += _chunk(_BIN, bytes(self._data), b"\x00")
        return _MAGIC + struct.pack("<II", _VERSION, 12 + len(chunks)) + chunks


def _chunk(kind: bytes, content: bytes, filler: bytes) -> bytes:
    padded = content + filler * (-len(content) % 4)
    return struct.pack("<I", len(padded)) + kind + padded


_MIN_TRANSLATION = 1e-7
"""A segment gets a channel for its position when its joint moves it by more than this [m]."""

_ROUNDED = Loss("digits: numbers have 24 bits, some 7 digits")


def write(motion: FigureMotion, path: Path) -> Losses:
    """Write a motion as a `.glb`, whole or not at all.

    Raises:
        OSError: the file cannot be written.
        ModelError: the motion is of another figure.
        MoverError: frames follow each other too closely to be told apart.
    """
    content, losses = format_glb(motion)
    write_atomic(path, content)
    start = float(motion.times[0])
    return Losses.collect(
        "glTF",
        [
            *losses,
            Loss(f"the time of the first frame, {start:g} s; the file begins at 0 s")
            if start
            else None,
            Loss("displacements: the file holds orientations, without whole turns"),
            NO_MASSES,
            unrepresented(motion),
            _ROUNDED,
        ],
    )


def format_glb(motion: FigureMotion) -> tuple[bytes, list[Loss]]:
    """Return the bytes of a `.glb`, and the losses of bones and surfaces.

    Raises:
        ModelError: the motion is of another figure.
        MoverError: frames follow each other too closely to be told apart.
    """
    skeleton = build_skeleton(motion)
    appearances, unseen = segment_appearances(motion.figure)
    document = _GlbBuilder(motion, skeleton)
    for name, segment in motion.figure.segments.items():
        document.add_segment(segment, appearances.get(name))
    document.add_animation()
    return document.to_bytes(), [*skeleton.losses(_MIN_TRANSLATION), *unseen]


class _GlbBuilder:
    """The parts of the JSON document, as they are added."""

    def __init__(self, motion: FigureMotion, skeleton: Skeleton) -> None:
        self._motion, self._skeleton = motion, skeleton
        self._buffer = Buffer()
        self._meshes: list[dict[str, Any]] = []
        self._materials: dict[Colour, int] = {}
        self._nodes: list[dict[str, Any]] = []
        self._node_indices: dict[str, int] = {}
        self._animations: list[dict[str, Any]] = []
        self._quaternions: dict[str, Array] = {}
        moving = {bone.segment for bone in skeleton.bones}
        self._roots: list[int] = []
        for name in motion.figure.segments:
            if name not in moving:
                self._roots.append(self._add_node(name, {"name": name}))
        for bone in skeleton.bones:
            self._add_bone(bone)

    def _add_node(self, segment: str, node: dict[str, Any]) -> int:
        self._nodes.append(node)
        self._node_indices[segment] = len(self._nodes) - 1
        return self._node_indices[segment]

    def _add_bone(self, bone: Bone) -> None:
        """The node of a bone, as it is in the first frame."""
        self._quaternions[bone.segment] = continuous_quaternions(bone.rotations)
        shift = bone.translations[0] if bone.max_translation > _MIN_TRANSLATION else 0.0
        place = self._add_node(
            bone.segment,
            {
                "name": bone.segment,
                "translation": (bone.offset + shift).tolist(),
                "rotation": self._quaternions[bone.segment][0].tolist(),
                "extras": {"joint": bone.joint},
            },
        )
        if bone.depth == 0:
            self._roots.append(place)
        else:
            self._add_child(bone.parent, place)

    def _add_child(self, segment: str, child: int) -> None:
        self._nodes[self._node_indices[segment]].setdefault("children", []).append(child)

    def add_segment(self, segment: Segment, appearance: Appearance | None) -> None:
        """Give a segment its mesh and its sites."""
        centres = {bone.segment: bone.centre for bone in self._skeleton.bones}
        centre = centres.get(segment.name, np.zeros(3))
        for site in segment.sites.values():
            pose = self._skeleton.rest_poses[segment.name] @ site.pose_in_segment
            turn = continuous_quaternions(pose[None, :3, :3])[0]
            self._nodes.append(
                {
                    "name": f"{segment.name}.{site.name}",
                    "translation": (pose[:3, 3] - centre).tolist(),
                    "rotation": turn.tolist(),
                }
            )
            self._add_child(segment.name, len(self._nodes) - 1)
        if appearance is None:
            return
        corners, normals = triangles_with_normals(appearance.surface)
        points = self._skeleton.points_at_rest(segment, corners) - centre
        turned = normals @ self._skeleton.rest_poses[segment.name][:3, :3].T
        attributes = {
            "POSITION": self._buffer.add(points, "VEC3", bounds=True, vertices=True),
            "NORMAL": self._buffer.add(turned, "VEC3", vertices=True),
        }
        primitive = {"attributes": attributes, "material": self._material_index(appearance.colour)}
        self._meshes.append({"name": segment.name, "primitives": [primitive]})
        self._nodes[self._node_indices[segment.name]]["mesh"] = len(self._meshes) - 1

    def _material_index(self, colour: Colour) -> int:
        return self._materials.setdefault(colour, len(self._materials))

    def add_animation(self) -> None:
        """Add the channels of the bones. Raises MoverError when the times cannot be told apart."""
        seconds = self._motion.times - self._motion.times[0]
        if np.any(np.diff(seconds.astype(np.float32)) <= 0.0):
            raise MoverError(
                "the frames follow each other too closely for glTF, whose times have 7 digits"
            )
        times = self._buffer.add(seconds, "SCALAR", bounds=True)
        samplers: list[dict[str, Any]] = []
        channels: list[dict[str, Any]] = []
        for bone, path, output in self._channel_outputs():
            samplers.append({"input": times, "output": output, "interpolation": "LINEAR"})
            target = {"node": self._node_indices[bone.segment], "path": path}
            channels.append({"sampler": len(samplers) - 1, "target": target})
        animation = {"name": "motion", "samplers": samplers, "channels": channels}
        self._animations.append(animation)

    def _channel_outputs(self) -> Iterator[tuple[Bone, str, int]]:
        for bone in self._skeleton.bones:
            turns = self._quaternions[bone.segment]
            yield bone, "rotation", self._buffer.add(turns, "VEC4")
            if bone.max_translation > _MIN_TRANSLATION:
                moved = bone.offset + bone.translations
                yield bone, "translation", self._buffer.add(moved, "VEC3")

    def to_bytes(self) -> bytes:
        """The whole file."""
        header = dict(line.split(" ", 1) for line in self._motion.header.lines())
        return self._buffer.to_glb(
            {
                "asset": {"version": "2.0", "generator": "exudyn-mover", "extras": header},
                "scene": 0,
                "scenes": [{"name": self._motion.header.figure, "nodes": self._roots}],
                "nodes": self._nodes,
                "meshes": self._meshes,
                "materials": [_material_json(colour) for colour in self._materials],
                "animations": self._animations,
            }
        )


def _material_json(colour: Colour) -> dict[str, Any]:
    surface = {
        "baseColorFactor": [*linear_colour(colour), 1.0],
        "metallicFactor": 0.0,
        "roughnessFactor": 0.8,
    }
    return {"pbrMetallicRoughness": surface, "doubleSided": True}
