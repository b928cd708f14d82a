"""Readers of the motion formats that the packages only write, by the formats' specifications."""

import json
import struct
import zlib
from base64 import b64decode
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from generator.rotations import Array

Poses = dict[str, Array]
"""Poses in the world by name, shape (frames, 4, 4)."""


def poses_of(turns: Array, shifts: Array) -> Array:
    """Poses of rotations (n or 1, 3, 3) and translations (n or 1, 3), shape (n, 4, 4)."""
    made = np.tile(np.eye(4), (max(len(turns), len(shifts)), 1, 1))
    made[:, :3, :3], made[:, :3, 3] = turns, shifts
    return made


def compose(local: Mapping[str, Array], parents: Mapping[str, str]) -> Poses:
    """Poses in the world from those in the parents."""

    def world(name: str) -> Array:
        return world(parents[name]) @ local[name] if name in parents else local[name]

    return {name: world(name) for name in local}


@dataclass(frozen=True)
class Table:
    """A table of OpenSim: header, column labels, and rows."""

    header: dict[str, str]
    labels: list[str]
    rows: Array


def read_table(path: Path) -> Table:
    lines = path.read_text(encoding="utf-8").splitlines()
    end = lines.index("endheader")
    rows = np.array([line.split("\t") for line in lines[end + 2 :]], dtype=float)
    header = dict(line.split("=", 1) for line in lines[1:end])
    return Table(header, lines[end + 1].split("\t"), rows)


class Glb:
    """A binary glTF 2.0 file (sections 3.5.3 and 4.4 of the specification)."""

    def __init__(self, path: Path) -> None:
        self._parse(path.read_bytes())

    @classmethod
    def of_bytes(cls, data: bytes) -> "Glb":
        """The file of these bytes."""
        made = cls.__new__(cls)
        made._parse(data)
        return made

    def _parse(self, data: bytes) -> None:
        assert struct.unpack_from("<4sII", data) == (b"glTF", 2, len(data))
        size, kind = struct.unpack_from("<I4s", data, 12)
        assert (kind, size % 4) == (b"JSON", 0)
        self.document: dict[str, Any] = json.loads(data[20 : 20 + size])
        assert data[24 + size : 28 + size] == b"BIN\0"
        self.blob = data[28 + size :]
        self.nodes: list[dict[str, Any]] = self.document["nodes"]
        self.channels = {
            (channel["target"]["node"], channel["target"]["path"]): animation["samplers"][
                channel["sampler"]
            ]
            for animation in self.document.get("animations", ())
            for channel in animation["channels"]
        }
        inputs = {sampler["input"] for sampler in self.channels.values()}
        self.times = self.numbers(inputs.pop())[:, 0] if inputs else np.zeros(1)
        assert not inputs

    def numbers(self, accessor: int) -> Array:
        held = self.document["accessors"][accessor]
        assert held["componentType"] == 5126
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}[held["type"]]
        start = self.document["bufferViews"][held["bufferView"]].get("byteOffset", 0)
        flat = np.frombuffer(self.blob, "<f4", held["count"] * width, start)
        return flat.reshape(held["count"], width).astype(float)

    def values(self, node: int, path: str) -> Array:
        """Rotations (quaternions, x first) or translations of a node, shape (frames, 4 or 3)."""
        if (node, path) in self.channels:
            return self.numbers(self.channels[node, path]["output"])
        default = [0.0, 0.0, 0.0, 1.0] if path == "rotation" else [0.0, 0.0, 0.0]
        return np.array([self.nodes[node].get(path, default)] * len(self.times))

    def poses(self, resample: Callable[[Array], Array] = np.asarray) -> Poses:
        """Poses of the nodes; `resample` makes quaternions and translations of other frames."""
        local, parents = {}, {}
        for k, node in enumerate(self.nodes):
            turns = Rotation.from_quat(resample(self.values(k, "rotation")))
            shifts = resample(self.values(k, "translation"))
            local[node["name"]] = poses_of(turns.as_matrix(), shifts)
            parents |= {
                self.nodes[child]["name"]: node["name"] for child in node.get("children", ())
            }
        return compose(local, parents)


class Page(HTMLParser):
    """A page of a motion or a comparison as an HTML parser reads it.

    Attributes:
        tags: names and attributes of all elements.
        contents: texts within title, pre, style and script elements.
        scripts: texts of the scripts that run.
        data: those of the motion or the comparison.
    """

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.contents: dict[str, list[str]] = {"title": [], "pre": [], "style": [], "script": []}
        self._open: str | None = None
        self._kinds: list[str | None] = []
        self.feed(path.read_text(encoding="utf-8"))
        self.close()
        texts = list(zip(self._kinds, self.contents["script"], strict=True))
        self.scripts = [text for kind, text in texts if kind is None]
        (self.data,) = (json.loads(t) for kind, t in texts if kind == "application/json")
        self._glbs = [text for kind, text in texts if kind == "text/plain"]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, {key: value or "" for key, value in attrs}))
        if tag in self.contents:
            self._open = tag
            self.contents[tag].append("")
            if tag == "script":
                self._kinds.append(dict(attrs).get("type"))

    def handle_endtag(self, tag: str) -> None:
        if tag == self._open:
            self._open = None

    def handle_data(self, data: str) -> None:
        if self._open is not None:
            self.contents[self._open][-1] += data

    @property
    def policy(self) -> str:
        (found,) = (
            attributes["content"]
            for _, attributes in self.tags
            if attributes.get("http-equiv") == "Content-Security-Policy"
        )
        return found

    def glb(self) -> Glb:
        (text,) = self._glbs
        return self.glb_of(text)

    @staticmethod
    def glb_of(text: str) -> Glb:
        return Glb.of_bytes(zlib.decompress(b64decode(text, validate=True)))

    @staticmethod
    def floats(text: str) -> Array:
        return np.frombuffer(b64decode(text, validate=True), "<f4").astype(float)

    @staticmethod
    def doubles(text: str) -> Array:
        return np.frombuffer(b64decode(text, validate=True), "<f8")


class Bvh:
    """A BVH file; lengths in centimetres, and channels that act from left to right."""

    def __init__(self, path: Path) -> None:
        text = path.read_text(encoding="utf-8")
        hierarchy, _, motion = text.partition("MOTION\n")
        self.offsets: dict[str, list[float]] = {}
        self.channels: dict[str, list[str]] = {}
        self.parents: dict[str, str] = {}
        self._parse_hierarchy(iter(hierarchy.split("\n")))
        count, interval, *rows = motion.splitlines()
        self.rows = np.array([row.split() for row in rows], dtype=float)
        self.interval = float(interval.removeprefix("Frame Time:"))
        assert len(self.rows) == int(count.removeprefix("Frames:"))
        assert self.rows.shape[1] == sum(map(len, self.channels.values()))

    def _parse_hierarchy(self, lines: Iterator[str]) -> None:
        """Fill offsets, channels and parents; the end of joint `a` is called `a end`."""
        open_blocks: list[str] = []
        name = ""
        for line in lines:
            match line.split():
                case ["ROOT" | "JOINT", name]:
                    pass
                case ["End", "Site"]:
                    name = f"{open_blocks[-1]} end"
                case ["{"]:
                    if open_blocks:
                        self.parents[name] = open_blocks[-1]
                    open_blocks.append(name)
                case ["OFFSET", *offset]:
                    self.offsets[open_blocks[-1]] = list(map(float, offset))
                case ["CHANNELS", count, *channels]:
                    assert len(channels) == int(count)
                    self.channels[open_blocks[-1]] = channels
                case ["}"]:
                    open_blocks.pop()
        assert not open_blocks

    def poses(self) -> Poses:
        """Poses of joints and ends in the world [m]."""
        column, local = 0, {}
        for name, offset in self.offsets.items():
            here = poses_of(np.eye(3)[None], np.tile(offset, (len(self.rows), 1)))
            for channel in self.channels.get(name, ()):
                axis, values = np.eye(3)["XYZ".index(channel[0])], self.rows[:, column, None]
                if channel.endswith("position"):
                    step = poses_of(np.eye(3)[None], values * axis)
                else:
                    turn = Rotation.from_rotvec(np.radians(values) * axis).as_matrix()
                    step = poses_of(turn, np.zeros((1, 3)))
                here, column = here @ step, column + 1
            here[:, :3, 3] /= 100.0
            local[name] = here
        return compose(local, self.parents)
