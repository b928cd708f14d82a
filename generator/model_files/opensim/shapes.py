"""Geometry that is attached to the frames of an OpenSim model."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from generator.diagnostics import Diagnostics, InputError, error
from generator.geometry.primitives import box, cylinder, ellipsoid, sphere
from generator.geometry.surface import Surface, join_surfaces
from generator.losses import Losses
from generator.model_files.body_tree.shapes import (
    MeshFiles,
    Shape,
    clipped_colour,
    folders_above,
    has_size,
    scaled,
)
from generator.model_files.opensim.frames import FrameIndex
from generator.model_files.xml import XmlElement, parse_xml
from generator.rotations import pose_matrix
from generator.text_io import load_text

WHITE = (1.0, 1.0, 1.0)
"""Colour of a geometry without any."""

GEOMETRY_FOLDER = "Geometry"
"""Folder of mesh files: OpenSim looks for it beside a model, and repositories have one for all."""

_READ: Final = ("Mesh", "Brick", "Sphere", "Cylinder", "Ellipsoid")

_UNREAD: Final = ("Arrow", "Cone", "FrameGeometry", "LineGeometry", "Line", "Torus")
"""Geometry that is left out; frames and lines have no surface."""

_Z_ALONG_Y = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Rotation of a cylinder about z to one about y."""


@dataclass
class GeometryReader:
    """Reads the geometry of a model.

    Attributes:
        frames: frames of the model.
        directory: directory of the model's file.
        losses: collects what a figure does not hold.
    """

    frames: FrameIndex
    directory: Path
    losses: Losses
    _files: MeshFiles = field(init=False)

    def __post_init__(self) -> None:
        """Prepare the reading of mesh files."""
        self._files = MeshFiles(self.losses, {".vtp": read_vtp})

    def read(self, model: XmlElement) -> dict[str, tuple[Shape, ...]]:
        """Return the shapes of bodies and of the ground, by name."""
        shapes: dict[str, tuple[Shape, ...]] = {}
        for element, owner in _geometry(model):
            if element.tag in _UNREAD:
                if element.tag in ("Cone", "Torus"):
                    self.losses.add_description("cones and tori", element.label)
                continue
            appearance = element.find("Appearance")
            if appearance is not None and appearance.is_child("visible", "false"):
                continue
            frame = self.frames.resolve(element, "socket_frame", default=owner)
            surface = None if frame is None else self._surface(element)
            if frame is None or surface is None:
                continue
            body, pose = frame
            colour = WHITE
            if appearance is not None:
                parts = appearance.child_numbers("color", WHITE)
                colour = clipped_colour(parts)
            shape = Shape(surface.transformed(pose), colour)
            shapes[body] = (*shapes.get(body, ()), shape)
        return shapes

    def _surface(self, element: XmlElement) -> Surface | None:
        """Return the surface of a geometry in its frame."""
        surface = self._unscaled(element)
        if surface is None:
            return None
        factors = element.child_numbers("scale_factors", (1.0, 1.0, 1.0))
        if not all(factors):
            self.losses.add_description("shapes that are scaled to nothing", element.label)
            return None
        return scaled(surface, factors)

    def _unscaled(self, element: XmlElement) -> Surface | None:
        unit = (1.0, 1.0, 1.0)
        match element.tag:
            case "Mesh":
                name = element.child_text("mesh_file").replace("\\", "/")
                above = folders_above(self.directory)
                folders = (self.directory, *(folder / GEOMETRY_FOLDER for folder in above))
                return self._files.find(folders, name) if name else None
            case "Brick":
                sizes = element.child_numbers("half_lengths", unit)
                return box(*sizes) if self._have_size(element, *sizes) else None
            case "Ellipsoid":
                sizes = element.child_numbers("radii", unit)
                return ellipsoid(*sizes) if self._have_size(element, *sizes) else None
            case "Sphere":
                radius = element.child_number("radius")
                return sphere(radius) if self._have_size(element, radius) else None
            case _:
                radius = element.child_number("radius")
                half = element.child_number("half_height")
                if not self._have_size(element, radius, half):
                    return None
                upright = pose_matrix(_Z_ALONG_Y, np.zeros(3))
                return cylinder(radius, half).transformed(upright)

    def _have_size(self, element: XmlElement, *sizes: float) -> bool:
        name = element.label
        return has_size(element, name, sizes, self.losses)


def _geometry(model: XmlElement) -> Iterator[tuple[XmlElement, XmlElement]]:
    """Yield the geometry of a model, each with the frame in which it stands."""
    waiting = [(model, model)]
    while waiting:
        element, owner = waiting.pop()
        if element.tag in (*_READ, *_UNREAD):
            yield element, owner
        inner = element if element.tag in ("Body", "Ground", "PhysicalOffsetFrame") else owner
        waiting += [(child, inner) for child in reversed(element.children)]


def read_vtp(path: Path) -> Surface:
    """Read the polygons of a VTK file (`.vtp`) whose arrays are text.

    Raises InputError for another file.
    """
    unread = error(f"`{path}` cannot be read as vtp: its arrays are not text, or it is damaged")
    source, fault = load_text(path, str(path))
    root = None if fault is not None else parse_xml(source, Diagnostics())
    if root is None or root.tag != "VTKFile":
        raise InputError([unread])
    try:
        pieces = [_vtp_piece(piece) for piece in root.walk() if piece.tag == "Piece"]
    except (ValueError, KeyError, OverflowError):
        raise InputError([unread]) from None
    if not pieces:
        raise InputError([unread])
    return join_surfaces(pieces)


def _vtp_piece(piece: XmlElement) -> Surface:
    """Return the polygons of a part of a file. Raises ValueError, KeyError or OverflowError."""
    arrays = {
        (group.tag, array.get("Name") or ""): array
        for group in piece.children
        for array in group.find_all("DataArray")
    }
    points = [array for (group, _), array in arrays.items() if group == "Points"]
    if len(points) != 1:
        raise ValueError("a piece has one array of points")
    corners = _vtp_numbers(arrays["Polys", "connectivity"], np.int64)
    ends = _vtp_numbers(arrays["Polys", "offsets"], np.int64)
    starts = np.concatenate([[0], ends])
    return Surface(_vtp_numbers(points[0], np.float64).reshape(-1, 3), corners, starts)


def _vtp_numbers(array: XmlElement, kind: type[np.int64] | type[np.float64]) -> NDArray[Any]:
    """Return the numbers of an array. Raises ValueError or OverflowError for other contents."""
    if array.get("format") != "ascii":
        raise ValueError("this array is not text")
    return np.array(array.text.text.split(), dtype=kind)
