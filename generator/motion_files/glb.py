"""A motion as binary glTF: what browsers, Blender and game engines play.

One skeleton: the node of the figure, and within it a bone for every segment that moves, with the
segment's name, within the bone of its parent segment. The skin lists the bones and
their poses at rest, with all displacements zero, in which y of a bone points along its limb. The
shape of a segment is the mesh of its bone, which it follows rigidly: programs that know nothing of
skins draw the same. Props are nodes beside the figure, a plane a sheet around the motion. Lengths
are metres, y is up, the figure faces +z: glTF's own convention is that of a figure's world.

The container of a binary glTF file (`.glb`): one JSON document and one block of numbers.

glTF 2.0, Khronos Group (ISO/IEC 12113:2022), sections 3.6 (buffers, accessors), 3.7.3 (skins) and 4
(GLB).
"""

import json
import struct
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from generator.contact.appearance import is_level, prop_colour, prop_surface
from generator.contact.scene import Prop
from generator.diagnostics import MoverError
from generator.figure import Segment
from generator.geometry.appearance import (
    Appearance,
    Colour,
    linear_colour,
    segment_appearances,
    triangles_with_normals,
)
from generator.identifiers import free_name
from generator.losses import Effect, Loss, Losses
from generator.motion_files.motion import (
    NO_MASSES,
    FigureMotion,
    late_start,
    unknown_props,
    unrepresented,
)
from generator.motion_files.skeleton import Bone, Skeleton, build_skeleton, continuous_quaternions
from generator.rotations import Array, inverse_pose
from generator.text_io import write_atomic

_MAGIC, _VERSION = b"glTF", 2
_JSON, _BIN = b"JSON", b"BIN\x00"
_FLOAT = 5126
_VERTICES = 34962

AccessorType = Literal["SCALAR", "VEC3", "VEC4", "MAT4"]


class Buffer:
    """The block of numbers, and the accessors of its parts."""

    def __init__(self) -> None:
        """Begin without any."""
        self._data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(
        self, values: Array, kind: AccessorType, *, bounds: bool = False, vertices: bool = False
    ) -> int:
        """Add values, a row each, to the block as floats of 32 bits; return the accessor's number.

        Args:
            values: shape (n,) for scalars, (n, 3) or (n, 4) for vectors, (n, 16) for matrices by
                columns.
            kind: what a row is.
            bounds: add the smallest and the largest values, which positions and times need.
            vertices: the values belong to the vertices of a mesh.
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

_WALL_OPACITY = 0.2

_ROUNDED = Loss("digits: numbers have 24 bits, some 7 digits", effect=Effect.ROUNDING)


def write(motion: FigureMotion, path: Path) -> Losses:
    """Write a motion as a `.glb`, whole or not at all.

    Raises:
        OSError: the file cannot be written.
        ModelError: the motion is of another figure.
        MoverError: the times of two frames are equal in single precision.
    """
    content, losses = format_glb(motion)
    write_atomic(path, content)
    return Losses.collect(
        "glTF",
        [
            *losses,
            late_start(motion),
            Loss("displacements: the file holds orientations, without whole turns"),
            NO_MASSES,
            unknown_props(motion),
            unrepresented(motion),
            _ROUNDED,
        ],
    )


def format_glb(motion: FigureMotion) -> tuple[bytes, list[Loss]]:
    """Return the bytes of a `.glb`, and the losses of bones and surfaces.

    Raises:
        ModelError: the motion is of another figure.
        MoverError: the times of two frames are equal in single precision.
    """
    skeleton = build_skeleton(motion)
    appearances, unseen = segment_appearances(motion.figure)
    document = _GlbBuilder(motion, skeleton)
    for name, segment in motion.figure.segments.items():
        document.add_segment(segment, appearances.get(name))
    for prop in motion.scene.props:
        document.add_prop(prop)
    document.add_animation()
    return document.to_bytes(), [*skeleton.losses(_MIN_TRANSLATION), *unseen]


class _GlbBuilder:
    """The parts of the JSON document, as they are added."""

    def __init__(self, motion: FigureMotion, skeleton: Skeleton) -> None:
        self._motion, self._skeleton = motion, skeleton
        self._buffer = Buffer()
        self._meshes: list[dict[str, Any]] = []
        self._materials: dict[tuple[Colour, float], int] = {}
        self._nodes: list[dict[str, Any]] = []
        self._node_indices: dict[str, int] = {}
        self._animations: list[dict[str, Any]] = []
        self._props: list[int] = []
        path = motion.figure.path
        self._name = motion.figure.name or ("figure" if path is None else path.stem)
        self._channels: dict[str, tuple[Array, Array]] = {}
        self._rest = {name: np.eye(4) for name in motion.figure.segments}
        for name, axes in skeleton.limb_axes(motion.figure).items():
            self._rest[name][:3, :3] = axes
        for bone in skeleton.bones:
            self._rest[bone.segment][:3, 3] = bone.centre
        self._root = self._add_node({"name": free_name(self._name, motion.figure.segments)})
        moving = {bone.segment for bone in skeleton.bones}
        for name in motion.figure.segments:
            if name not in moving:
                self._node_indices[name] = self._add_node({"name": name}, self._root)
        for bone in skeleton.bones:
            self._add_bone(bone)

    def _add_node(self, node: dict[str, Any], parent: int | None = None) -> int:
        self._nodes.append(node)
        index = len(self._nodes) - 1
        if parent is not None:
            self._nodes[parent].setdefault("children", []).append(index)
        return index

    def _add_bone(self, bone: Bone) -> None:
        """Add the node of a bone, as it is in the first frame."""
        base = self._rest[bone.parent][:3, :3] if bone.depth else np.eye(3)
        shifts = bone.translations if bone.max_translation > _MIN_TRANSLATION else np.zeros((1, 3))
        turns = continuous_quaternions(base.T @ bone.rotations @ self._rest[bone.segment][:3, :3])
        places = (bone.offset + shifts) @ base
        self._channels[bone.segment] = turns, places
        node = {
            "name": bone.segment,
            "translation": places[0].tolist(),
            "rotation": turns[0].tolist(),
            "extras": {"joint": bone.joint},
        }
        parent = self._node_indices[bone.parent] if bone.depth else self._root
        self._node_indices[bone.segment] = self._add_node(node, parent)

    def add_segment(self, segment: Segment, appearance: Appearance | None) -> None:
        """Give a segment its mesh and its sites."""
        index = self._node_indices[segment.name]
        into_bone = inverse_pose(self._rest[segment.name]) @ self._skeleton.rest_poses[segment.name]
        for site in segment.sites.values():
            pose = into_bone @ site.pose_in_segment
            node = {
                "name": f"{segment.name}.{site.name}",
                "translation": pose[:3, 3].tolist(),
                "rotation": continuous_quaternions(pose[None, :3, :3])[0].tolist(),
            }
            self._add_node(node, index)
        if appearance is None:
            return
        corners, normals = triangles_with_normals(appearance.surface)
        turn = into_bone[:3, :3].T
        corners, normals = corners @ turn + into_bone[:3, 3], normals @ turn
        self._add_mesh(index, corners, normals, appearance.colour)

    def _add_mesh(
        self, node: int, corners: Array, normals: Array, colour: Colour, opacity: float = 1.0
    ) -> None:
        """Give a node a mesh of triangles in its axes."""
        attributes = {
            "POSITION": self._buffer.add(corners, "VEC3", bounds=True, vertices=True),
            "NORMAL": self._buffer.add(normals, "VEC3", vertices=True),
        }
        material = self._materials.setdefault((colour, opacity), len(self._materials))
        primitive = {"attributes": attributes, "material": material}
        self._meshes.append({"name": self._nodes[node]["name"], "primitives": [primitive]})
        self._nodes[node]["mesh"] = len(self._meshes) - 1

    def add_prop(self, prop: Prop) -> None:
        """Add a prop beside the figure; a plane that is not level is translucent."""
        shape, pose = prop.shape, prop.shape.pose
        index = self._add_node(
            {
                "name": free_name(prop.name, {node["name"] for node in self._nodes}),
                "translation": pose[:3, 3].tolist(),
                "rotation": continuous_quaternions(pose[None, :3, :3])[0].tolist(),
                "extras": {"prop": shape.name, "level": is_level(shape)},
            }
        )
        self._props.append(index)
        origins = [poses[:, :3, 3] for poses in self._motion.poses.values()]
        corners, normals = triangles_with_normals(prop_surface(shape, np.concatenate(origins)))
        opacity = _WALL_OPACITY if shape.is_endless and not is_level(shape) else 1.0
        self._add_mesh(index, corners, normals, prop_colour(shape), opacity)

    def add_animation(self) -> None:
        """Add the channels of the bones. Raises MoverError as `format_glb`.

        A single frame has none: it is the pose of the nodes.
        """
        if self._motion.times.size == 1:
            return
        with np.errstate(over="ignore"):
            seconds = self._motion.times - self._motion.times[0]
        if seconds[-1] > np.finfo(np.float32).max:
            raise MoverError("the motion lasts too long for glTF, whose times are below 3.4e38 s")
        if np.any(np.diff(seconds.astype(np.float32)) <= 0.0):
            raise MoverError(
                "the frames follow each other too closely for glTF, whose times have 7 digits"
            )
        times = self._buffer.add(seconds, "SCALAR", bounds=True)
        samplers: list[dict[str, Any]] = []
        channels: list[dict[str, Any]] = []
        for segment, (turns, places) in self._channels.items():
            outputs = {"rotation": self._buffer.add(turns, "VEC4")}
            if len(places) > 1:
                outputs["translation"] = self._buffer.add(places, "VEC3")
            for path, output in outputs.items():
                samplers.append({"input": times, "output": output, "interpolation": "LINEAR"})
                target = {"node": self._node_indices[segment], "path": path}
                channels.append({"sampler": len(samplers) - 1, "target": target})
        if channels:
            animation = {"name": "motion", "samplers": samplers, "channels": channels}
            self._animations.append(animation)

    def _skins(self) -> list[dict[str, Any]]:
        """Return the skin of the bones; none without bones."""
        segments = [bone.segment for bone in self._skeleton.bones]
        if not segments:
            return []
        inverse = inverse_pose(np.array([self._rest[segment] for segment in segments]))
        columns = np.swapaxes(inverse, 1, 2).reshape(-1, 16)
        return [
            {
                "name": self._name,
                "skeleton": self._root,
                "joints": [self._node_indices[segment] for segment in segments],
                "inverseBindMatrices": self._buffer.add(columns, "MAT4"),
            }
        ]

    def to_bytes(self) -> bytes:
        """The whole file."""
        header = dict(line.split(" ", 1) for line in self._motion.header.lines())
        skins, roots = self._skins(), [self._root, *self._props]
        return self._buffer.to_glb(
            {
                "asset": {"version": "2.0", "generator": "exudyn-mover", "extras": header},
                "scene": 0,
                "scenes": [{"name": self._motion.header.figure, "nodes": roots}],
                "nodes": self._nodes,
                "skins": skins,
                "meshes": self._meshes,
                "materials": [_material_json(*each) for each in self._materials],
                "animations": self._animations,
            }
        )


def _material_json(colour: Colour, opacity: float) -> dict[str, Any]:
    surface = {
        "baseColorFactor": [*linear_colour(colour), opacity],
        "metallicFactor": 0.0,
        "roughnessFactor": 0.8,
    }
    blend = {} if opacity == 1.0 else {"alphaMode": "BLEND"}
    return {"pbrMetallicRoughness": surface, "doubleSided": True, **blend}
