"""Shapes of bodies, which become the psurfs of segments."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path

import numpy as np

from generator.diagnostics import InputError
from generator.figure import Attribute, Figure
from generator.geometry.read import FORMAT_UNITS, read_mesh
from generator.geometry.surface import Surface, join_surfaces, simplify
from generator.identifiers import reserve_name
from generator.losses import Losses
from generator.model_files.xml import XmlElement
from generator.rotations import Array

Colour = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Shape:
    """A surface that is fixed to a body.

    Attributes:
        surface: surface in the body's frame [m].
        colour: red, green and blue from 0 to 1; None for a shape without any.
    """

    surface: Surface
    colour: Colour | None = None

    def transformed(self, pose: Array) -> "Shape":
        """Return the shape in another frame, in which its own has the affine map `pose`, (4, 4)."""
        return replace(self, surface=self.surface.transformed(pose))


MAX_LEVELS = 8
"""Folders, from that of the model upwards, in which mesh files are looked for."""


def folders_above(directory: Path) -> list[Path]:
    """Return the folder of a model and those above it, the nearest first."""
    here = directory.absolute()
    return [here, *here.parents][:MAX_LEVELS]


MeshReader = Callable[[Path], Surface]
"""Reads a mesh file whose lengths are in m; it may raise InputError."""


@dataclass
class MeshFiles:
    """Reads the mesh files that a model names, each once.

    Attributes:
        losses: notes the files that cannot be read.
        readers: readers of formats of their own, by suffix.
    """

    losses: Losses
    readers: Mapping[str, MeshReader] = field(default_factory=dict[str, MeshReader])
    _surfaces: dict[Path, Surface | None] = field(default_factory=dict[Path, Surface | None])

    def find(self, folders: Iterable[Path], file: str, name: str | None = None) -> Surface | None:
        """Return the surface in a file of the first folder that has it; None, with a loss, if none.

        Args:
            folders: folders at least one.
            file: path from the folder.
            name: name of the file in the model; None for `file`.
        """
        paths = [folder / file for folder in folders]
        path = next((path for path in paths if _exists(path)), paths[0])
        if path not in self._surfaces:
            self._surfaces[path] = self._read(path, file if name is None else name)
        return self._surfaces[path]

    def _read(self, path: Path, name: str) -> Surface | None:
        suffix = path.suffix.lower()
        reader = self.readers.get(suffix)
        if reader is None and suffix not in FORMAT_UNITS:
            self.losses.add_description("shapes in mesh files of a format that is not read", name)
            return None
        if not _exists(path):
            self.losses.add_description("shapes whose mesh file is missing", name)
            return None
        try:
            surface = read_mesh(path, Fraction(1)) if reader is None else reader(path)
            return surface.without_unused_vertices
        except InputError as failure:
            del failure  # it may quote the file, which may be any file of the system
            self.losses.add_description("shapes whose mesh file cannot be read", name)
            return None


def _exists(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name that no file can have
        return False


def clipped_colour(parts: Iterable[float]) -> Colour:
    """Return the colour of numbers, the first three of which are its parts."""
    red, green, blue = np.clip([*parts][:3], 0.0, 1.0).tolist()
    return red, green, blue


def has_size(element: XmlElement, name: str, sizes: Iterable[float], losses: Losses) -> bool:
    """Return whether all sizes of a shape are positive; report an element that has others."""
    smallest = min(sizes)
    if smallest < 0.0:
        element.error(f"a size of this {element.tag.lower()} is negative")
    elif smallest == 0.0:
        losses.add_description("shapes of size zero", name)
    return smallest > 0.0


def scaled(surface: Surface, scale: Iterable[float]) -> Surface:
    """Return a surface scaled along x, y and z."""
    return surface.transformed(np.diag([*scale, 1.0]))


MAX_FACES = 4000
"""Faces of the shapes of a segment; meshes of CAD programs have 100,000."""


def join_shapes(
    shapes: Mapping[str, Iterable[Shape]], losses: Losses
) -> tuple[dict[str, Surface], dict[str, Colour]]:
    """Return one surface and one colour for each segment that has shapes in its frame.

    The colour is that of the largest part of its surface.
    """
    surfaces: dict[str, Surface] = {}
    colours: dict[str, Colour] = {}
    for segment, parts in shapes.items():
        listed = [part for part in parts if part.surface.face_count]
        if not listed:
            continue
        surface = join_surfaces([part.surface for part in listed]).with_distinct_corners
        if surface.face_count > MAX_FACES:
            count = surface.face_count
            surface, moved = simplify(surface, MAX_FACES)
            what = f"shapes of more than {MAX_FACES:,} faces, whose vertices move by at most"
            losses.add_description(what, f"{segment} ({count:,} faces, {1e3 * moved:.3g} mm)")
        if not surface.face_count:
            losses.add_description("shapes whose faces are all lines or points", segment)
            continue
        surfaces[segment] = surface
        areas: dict[Colour | None, float] = {}
        for part in listed:
            areas[part.colour] = areas.get(part.colour, 0.0) + _area(part.surface)
        if len(areas) > 1:
            losses.add_description(
                "further colours: a segment has that of its largest surface", segment
            )
        colour = max(areas, key=lambda each: areas[each])
        if colour is not None:
            colours[segment] = colour
    return surfaces, colours


def _area(surface: Surface) -> float:
    points = surface.vertices[surface.fan_triangles[0]]
    across = np.cross(points[1] - points[0], points[2] - points[0])
    return float(np.linalg.norm(across, axis=1).sum()) / 2.0


def with_colours(figure: Figure, colours: Mapping[str, Colour]) -> Figure:
    """Return a figure with one attribute more for each colour of its segments."""
    names: dict[Colour, str] = {}
    taken = set(figure.attributes)
    for k, colour in enumerate(dict.fromkeys(colours.values()), 1):
        names[colour] = reserve_name(f"colour_{k}", taken)
    attributes = [Attribute(name, {"rgb": colour}) for colour, name in names.items()]
    segments = [figure.segments[name] for name in colours]
    return figure.with_parts(
        *attributes,
        *(
            replace(segment, attributes=(names[colours[segment.name]], *segment.attributes))
            for segment in segments
        ),
    )
