"""Surfaces of COLLADA files (`.dae`), the meshes of many robots.

The file's unit of length counts, and its axes are those of the link whatever `up_axis` says, as in
RViz and Pinocchio.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from generator.diagnostics import Diagnostics, InputError, error
from generator.geometry.surface import Surface, join_surfaces
from generator.model_files.xml import XmlElement, parse_xml
from generator.rotations import Array, matrix_from_axis_angle, pose_matrix
from generator.text_io import load_text

Indices = NDArray[np.int64]

_PRIMITIVES: Final = ("triangles", "polylist", "polygons", "tristrips", "trifans")

_MAX_DEPTH = 100
"""Largest depth of nodes, which may refer to one another."""

_MAX_FACES = 5_000_000
"""Most faces of a scene, which may have a geometry many times."""


def read_collada(path: Path) -> Surface:
    """Read the scene of a COLLADA file as one surface [m]; raises InputError for another file."""
    source, fault = load_text(path, str(path))
    root = None if fault is not None else parse_xml(source, Diagnostics())
    surface = None
    if root is not None and root.tag == "COLLADA":
        try:
            surface = _Scene.of_document(root).surface
        except (ValueError, KeyError, IndexError, OverflowError):
            surface = None
    if surface is None or not surface.face_count:
        raise InputError([error(f"`{path}` cannot be read as dae: it has no scene of meshes")])
    return surface


@dataclass
class _Scene:
    """A document by identifiers.

    Its methods raise ValueError, KeyError or IndexError for a damaged one.
    """

    root: XmlElement
    by_id: Mapping[str, XmlElement]
    _surfaces: dict[int, Surface] = field(default_factory=dict[int, Surface])

    @classmethod
    def of_document(cls, root: XmlElement) -> "_Scene":
        """Return the scene of a root element."""
        return cls(root, {each.get("id") or "": each for each in root.walk()})

    @property
    def surface(self) -> Surface:
        """All geometries of the scene in metres; without a scene each of them once."""
        tops = [each for each in self.root.walk() if each.tag == "visual_scene"]
        asset = self.root.find("asset")
        unit = None if asset is None else asset.find("unit")
        metres = float((None if unit is None else unit.get("meter")) or 1.0)
        scale = np.diag([metres, metres, metres, 1.0])
        parts = list(self._placed(tops[0], scale)) if tops else []
        if not tops:
            found = [each for each in self.root.walk() if each.tag == "geometry"]
            parts = [self._geometry(each).transformed(scale) for each in found]
        return join_surfaces(parts)

    def _placed(self, node: XmlElement, pose: Array) -> Iterator[Surface]:
        """Yield the geometries below a node, which has an affine map `pose`, (4, 4)."""
        waiting, count = [(node, pose, 0)], 0
        while waiting:
            here, place, depth = waiting.pop()
            if depth > _MAX_DEPTH:
                raise ValueError("nodes refer to each other in a circle")
            for child in here.children:
                place = place @ _transform(child)
            for child in here.children:
                if child.tag == "node":
                    waiting.append((child, place, depth + 1))
                elif child.tag == "instance_node":
                    waiting.append((self._referred(child, "url"), place, depth + 1))
                elif child.tag in ("instance_geometry", "instance_controller"):
                    surface = self._geometry(self._referred(child, "url"))
                    count += surface.face_count
                    if count > _MAX_FACES:
                        raise ValueError("the scene has too many faces")
                    yield surface.transformed(place)

    def _referred(self, element: XmlElement, key: str) -> XmlElement:
        return self.by_id[(element.get(key) or "").removeprefix("#")]

    def _geometry(self, element: XmlElement) -> Surface:
        """Return the faces of a geometry, or of that of a controller, in its own frame and unit."""
        skin = element.find("skin")
        if skin is not None:
            return self._geometry(self._referred(skin, "source"))
        if id(element) not in self._surfaces:
            mesh = element.find("mesh")
            groups = [] if mesh is None else list(mesh.find_all(*_PRIMITIVES))
            self._surfaces[id(element)] = join_surfaces([self._faces(group) for group in groups])
        return self._surfaces[id(element)]

    def _faces(self, group: XmlElement) -> Surface:
        """Return the faces of one group of a mesh."""
        inputs = {each.get("semantic"): each for each in group.find_all("input")}
        offsets = {name: int(each.get("offset") or 0) for name, each in inputs.items()}
        stride, offset = max(offsets.values()) + 1, offsets["VERTEX"]
        rows = [
            np.array(each.text.text.split(), dtype=np.int64).reshape(-1, stride)[:, offset]
            for each in group.find_all("p")
        ]
        points = self._points(inputs["VERTEX"])
        counts = group.find("vcount")
        if group.tag == "triangles":
            return Surface.from_faces(points, np.concatenate(rows).reshape(-1, 3))
        if group.tag == "polylist" and counts is not None:
            sizes = np.array(counts.text.text.split(), dtype=np.int64)
            starts = np.concatenate([[0], np.cumsum(sizes)])
            faces = [rows[0][a:b].tolist() for a, b in pairwise(starts.tolist())]
        else:
            faces = [face for row in rows for face in _fans(group.tag, row.tolist())]
        return Surface.from_faces(points, [face for face in faces if len(face) > 2])

    def _points(self, vertex: XmlElement) -> Array:
        """Return the positions to which the input of vertices refers, shape (n, 3)."""
        vertices = self._referred(vertex, "source").find_all("input")
        inputs = {each.get("semantic"): each for each in vertices}
        source = self._referred(inputs["POSITION"], "source")
        parts = {each.tag: each for each in source.walk()}
        numbers = parts["float_array"]
        stride = int((parts["accessor"].get("stride") if "accessor" in parts else None) or 3)
        return np.array(numbers.text.text.split(), dtype=float).reshape(-1, stride)[:, :3]


def _fans(tag: str, row: Sequence[int]) -> Iterator[Sequence[int]]:
    """Yield the faces of a strip, a fan or a polygon."""
    if tag == "tristrips":
        for k in range(len(row) - 2):
            yield row[k : k + 3] if k % 2 == 0 else [row[k + 1], row[k], row[k + 2]]
    elif tag == "trifans":
        yield from ([row[0], *pair] for pair in pairwise(row[1:]))
    else:
        yield row


def _transform(element: XmlElement) -> Array:
    """Return the affine map of a transformation of a node, (4, 4); the identity for others."""
    if element.tag not in ("matrix", "translate", "rotate", "scale"):
        return np.eye(4)
    numbers = np.array(element.text.text.split(), dtype=float)
    match element.tag:
        case "matrix":
            return numbers.reshape(4, 4)
        case "translate":
            return pose_matrix(np.eye(3), numbers.reshape(3))
        case "scale":
            return np.diag([*numbers.reshape(3), 1.0])
        case _:
            axis, angle = numbers[:3] / np.linalg.norm(numbers[:3]), np.radians(numbers[3])
            return pose_matrix(matrix_from_axis_angle(axis, float(angle)), np.zeros(3))
