"""Visuals of URDF: the shapes and colours of links."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from generator.diagnostics import shorten, spelling_hint
from generator.geometry.primitives import box, capsule, cylinder, sphere
from generator.geometry.surface import Surface
from generator.losses import Losses
from generator.model_files.body_tree.shapes import (
    Colour,
    MeshFiles,
    Shape,
    clipped_colour,
    folders_above,
    has_size,
    scaled,
)
from generator.model_files.urdf.collada import read_collada
from generator.model_files.xml import XmlElement
from generator.rotations import Array, matrix_from_xyz, pose_matrix

SHAPES = ("box", "cylinder", "sphere", "capsule", "mesh")

PACKAGE, FILE = "package://", "file://"


def parse_origin(element: XmlElement) -> Array:
    """Parse the `origin` of an element as a pose, shape (4, 4); rotations are about fixed axes."""
    origin = element.find("origin")
    if origin is None:
        return np.eye(4)
    roll, pitch, yaw = origin.vector("rpy")
    # Rz(yaw) Ry(pitch) Rx(roll) is the inverse of a turn about the turned axes.
    turn = matrix_from_xyz(-roll, -pitch, -yaw).T
    return pose_matrix(turn, np.array(origin.vector("xyz")))


@dataclass
class VisualReader:
    """Reads the visuals of links.

    Attributes:
        root: the element `robot`.
        directory: directory of the model's file.
        losses: collects what a figure does not hold.
    """

    root: XmlElement
    directory: Path
    losses: Losses
    _files: MeshFiles = field(init=False)

    def __post_init__(self) -> None:
        """Prepare the reading of mesh files."""
        self._files = MeshFiles(self.losses, {".dae": read_collada})

    def shapes(self, link: XmlElement) -> tuple[Shape, ...]:
        """Return the visuals of a link; without any, its collision shapes."""
        visuals, collisions = list(link.find_all("visual")), list(link.find_all("collision"))
        if collisions:
            self.losses.add("contact: `mover simulate --floor` and `--scene` have their own")
        return tuple(self._read(link.get("name") or "", visuals or collisions))

    def _read(self, link: str, elements: list[XmlElement]) -> Iterator[Shape]:
        for element in elements:
            geometry = element.find("geometry")
            shapes = () if geometry is None else geometry.children
            known = next((shape for shape in shapes if ":" not in shape.tag), None)
            for shape in shapes:
                if shape is not known:
                    self.losses.add_description("unknown elements", shape.tag)
                    continue
                surface = self._surface(link, shape)
                if surface is not None:
                    pose = parse_origin(element)
                    yield Shape(surface.transformed(pose), self._colour(element))

    def _surface(self, link: str, shape: XmlElement) -> Surface | None:
        match shape.tag:
            case "box":
                sizes = shape.vector("size")
                if self._have_size(link, shape, *sizes):
                    return box(*(0.5 * size for size in sizes))
            case "sphere":
                radius = shape.number("radius")
                if self._have_size(link, shape, radius):
                    return sphere(radius)
            case "cylinder" | "capsule":
                radius, length = (shape.number(word) for word in ("radius", "length"))
                if self._have_size(link, shape, radius, length):
                    return (cylinder if shape.tag == "cylinder" else capsule)(radius, 0.5 * length)
            case "mesh":
                surface = self._mesh(shape.get("filename") or "")
                scale = shape.vector("scale", (1.0, 1.0, 1.0))
                if surface is not None and self._have_size(link, shape, *map(abs, scale)):
                    return scaled(surface, scale)
            case tag:
                shape.error(f"unknown shape `{shorten(tag)}`", spelling_hint(tag, SHAPES))
        return None

    def _have_size(self, link: str, shape: XmlElement, *sizes: float) -> bool:
        return has_size(shape, f"{shape.tag} of {link}", sizes, self.losses)

    def _mesh(self, name: str) -> Surface | None:
        """Return the surface in a mesh file; of a package, in a folder above the model."""
        if not name:
            self.losses.add_description("meshes without a file")
            return None
        if not name.startswith(PACKAGE):
            return self._files.find((self.directory,), name.removeprefix(FILE))
        package, _, rest = name.removeprefix(PACKAGE).partition("/")
        above = folders_above(self.directory)
        folders = [folder for each in above for folder in (each / package, each)]
        return self._files.find(folders, rest, name)

    def _colour(self, visual: XmlElement) -> Colour | None:
        """Return the colour of a visual's material, which may stand in the robot."""
        material = visual.find("material")
        if material is None:
            return None
        named = [one for one in self.root.find_all("material") if one.get("name") is not None]
        same = [one for one in named if one.get("name") == material.get("name")]
        for one in (material, *same):
            if one.find("texture") is not None:
                self.losses.add_description(
                    "textures: a material has its colour alone", one.get("name") or ""
                )
            colour = one.find("color")
            read = None if colour is None else colour.numbers("rgba", 4)
            if read is not None:
                return clipped_colour(read)
        return None
