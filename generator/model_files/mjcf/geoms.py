"""Geoms of MJCF: their mass, and their shapes.

Meshes have their mass by the rules of MuJoCo's compiler: `legacy` counts the pyramid between each
triangle and the centroid of the surface as positive, so that concave meshes have too much; `exact`
has their signed volumes, `convex` those of the hull, and `shell` the areas (MuJoCo 4.0, XML
reference, asset/mesh/inertia, and user_mesh.cc).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import pi
from pathlib import Path
from typing import Final

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from generator.diagnostics import InputError, error, shorten, spelling_hint
from generator.geometry.primitives import box, capsule, cylinder, ellipsoid, sphere
from generator.geometry.surface import Surface, build_edges, merge_vertices
from generator.inertia import MassProperties
from generator.losses import Losses
from generator.model_files.body_tree.shapes import MeshFiles, Shape, scaled
from generator.model_files.body_tree.tree import rotation_from_z_to
from generator.model_files.mjcf.document import MAIN, Document
from generator.model_files.mjcf.joints import AngleConvention, parse_orientation, parse_pose
from generator.model_files.xml import XmlElement
from generator.rotations import Array, matrix_from_quaternion, pose_matrix
from generator.text_io import open_regular_file

DENSITY = 1000.0
"""Default density of a geom [kg/m3]."""

SIZES: Final = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}
"""Number of sizes of each solid shape."""

FROMTO_SHAPES: Final = ("capsule", "cylinder", "ellipsoid", "box")
"""Shapes that `fromto` can define."""

WEIGHTLESS: Final = ("plane", "hfield")
"""Shapes without mass, in the world only."""

NO_MESH: Final = "this geom names no mesh"


def primitive_mass(element: XmlElement, angles: AngleConvention) -> MassProperties | None:
    """Return the mass properties of a geom of a simple shape in its body's frame; None if wrong.

    `element` has the values of its default class.
    """
    shape = element.get("type") or "sphere"
    if shape not in SIZES:
        element.error(f"unknown geom type `{shorten(shape)}`", spelling_hint(shape, SIZES), "type")
        return None
    if element.get("shellinertia") == "true":
        element.error(
            "the inertia of a shell is not computed here",
            "give the body an `inertial` with its mass and inertia",
            "shellinertia",
        )
        return None
    place = _placed(element, shape, angles)
    if place is None:
        return None
    pose, size = place
    return _with_mass(_unit_mass(shape, size), element, pose)


def _unit_mass(shape: str, size: Sequence[float]) -> MassProperties:
    """Return the mass properties of a shape of 1 kg/m3 in its own frame."""
    volume, moments = _volume_and_moments(shape, size)
    return MassProperties(volume, np.zeros(3), np.diag(moments) * volume)


def _with_mass(unit: MassProperties, geom: XmlElement, pose: Array) -> MassProperties | None:
    """Return a shape of unit density with the mass or the density of its geom, at a pose, (4, 4).

    None, with an error, for a negative one.
    """
    mass = geom.number("density", DENSITY) * unit.mass
    if "mass" in geom.attributes:
        mass = geom.number("mass")
    if not mass > 0.0:
        geom.error("a mass must not be negative", "", "mass")
        return None
    return unit.with_mass(mass).transform(pose)


def _placed(
    element: XmlElement, shape: str, angles: AngleConvention
) -> tuple[Array, Sequence[float]] | None:
    """Return the pose of a shape in its body, shape (4, 4), and its sizes [m]."""
    count = SIZES[shape]
    has_ends = "fromto" in element.attributes and shape in FROMTO_SHAPES
    read = element.numbers("size", 0, 3)
    if read is None and "size" in element.attributes:
        return None
    sizes_read = list(read or ())
    needed = 1 if has_ends else count
    if len(sizes_read) < needed or not all(part > 0.0 for part in sizes_read[:needed]):
        plural, article = "s" if needed > 1 else "", "an" if shape == "ellipsoid" else "a"
        element.error(
            f"{article} {shape} needs {needed} positive size{plural}",
            "half lengths and radii [m]",
            "size",
        )
        return None
    if not has_ends:
        at = element.vector("pos")
        return pose_matrix(parse_orientation(element, angles), at), sizes_read[:count]
    read = element.numbers("fromto", 6)
    if read is None:
        return None
    start, end = np.array(read[:3]), np.array(read[3:])
    along = element.direction((start - end).tolist(), "fromto")
    half = float(np.linalg.norm(end - start)) / 2.0
    sizes = (sizes_read[0], half) if count == 2 else (sizes_read[0], sizes_read[0], half)
    return pose_matrix(rotation_from_z_to(along), (start + end) / 2.0), sizes


def _volume_and_moments(
    shape: str, size: Sequence[float]
) -> tuple[float, tuple[float, float, float]]:
    """Return the volume [m3] and the principal moments for unit mass [m2] of a shape."""
    match shape:
        case "sphere":
            r = size[0]
            round_about = 0.4 * r * r
            return 4.0 / 3.0 * pi * r**3, (round_about, round_about, round_about)
        case "cylinder":
            r, h = size[:2]
            across = r * r / 4.0 + h * h / 3.0
            return 2.0 * pi * r * r * h, (across, across, r * r / 2.0)
        case "capsule":  # a cylinder with half spheres, whose centres are 3/8 r from their flats
            r, h = size[:2]
            middle, ends = 2.0 * pi * r * r * h, 4.0 / 3.0 * pi * r**3
            volume, arm = middle + ends, h + 0.375 * r
            along = middle * r * r / 2.0 + ends * 0.4 * r * r
            across = middle * (r * r / 4.0 + h * h / 3.0)
            across += ends * (0.4 * r * r - (0.375 * r) ** 2 + arm * arm)
            return volume, (across / volume, across / volume, along / volume)
        case "ellipsoid":
            a, b, c = (part * part for part in size[:3])
            volume = 4.0 / 3.0 * pi * size[0] * size[1] * size[2]
            return volume, ((b + c) / 5.0, (a + c) / 5.0, (a + b) / 5.0)
        case _:
            a, b, c = (part * part for part in size[:3])
            volume = 8.0 * size[0] * size[1] * size[2]
            return volume, ((b + c) / 3.0, (a + c) / 3.0, (a + b) / 3.0)


DEFAULT_RGBA = (0.5, 0.5, 0.5, 1.0)
"""Colour and opacity of a geom without any; a geom of this colour takes that of its material."""

_SMALLEST_QUATERNION = 1e-15
"""Length below which MuJoCo takes the reference orientation of a mesh for the identity."""

_MAX_MESH_NUMBERS = 3_000_000
"""Numbers in the longest list of a mesh within the model."""

UNDRAWN: Final = {"plane": "planes", "hfield": "height fields", "sdf": "shapes of plugins"}


@dataclass
class GeomReader:
    """Reads the shapes of geoms.

    Attributes:
        document: the model.
        directory: directory of the model's file.
        losses: collects what a figure does not hold.
    """

    document: Document
    directory: Path
    losses: Losses
    _files: MeshFiles = field(init=False)
    _meshes: dict[str, XmlElement] = field(default_factory=dict[str, XmlElement])
    _materials: dict[str, XmlElement] = field(default_factory=dict[str, XmlElement])
    _surfaces: dict[str, Surface | None] = field(default_factory=dict[str, Surface | None])
    _unit_masses: dict[str, MassProperties] = field(default_factory=dict[str, MassProperties])

    def __post_init__(self) -> None:
        """Collect the meshes and the materials of the model."""
        self._files = MeshFiles(self.losses, {".msh": read_msh})
        for asset in self.document.root.find_all("asset"):
            for element in asset.children:
                if element.tag in ("mesh", "material"):
                    whole = self.document.with_defaults(element, element.get("class") or MAIN)
                    known = self._meshes if element.tag == "mesh" else self._materials
                    known[whole.get("name") or Path(whole.get("file") or "").stem] = whole

    def mass(self, geom: XmlElement) -> MassProperties | None:
        """Return the mass properties of a geom in its body's frame; None for a weightless one.

        A mesh that has none is an error.
        """
        shape = geom.get("type") or "sphere"
        word, default = ("mass", 0.0) if "mass" in geom.attributes else ("density", DENSITY)
        if shape in WEIGHTLESS or geom.number(word, default) == 0.0:
            return None
        mesh, angles = geom.get("mesh"), self.document.angle_convention
        if shape == "sdf":
            geom.error("the mass of a shape of a plugin is not known", "", "type")
        elif mesh is None and shape == "mesh":
            geom.error(NO_MESH, 'write `mesh="..."`')
        elif mesh is None:
            return primitive_mass(geom, angles)
        elif (unit := self._unit_mass(mesh, geom)) is not None:
            if shape == "mesh":
                pose = parse_pose(geom, angles)
                return _with_mass(unit, geom, pose)
            return self._fitted_mass(geom, shape, unit)
        return None

    def _unit_mass(self, mesh: str, geom: XmlElement) -> MassProperties | None:
        """Return the mass properties of a mesh at unit density; None, with an error, for none."""
        element, surface = self._meshes.get(mesh), self._mesh_surface(mesh, geom)
        if element is None:
            return None
        if mesh in self._unit_masses:
            return self._unit_masses[mesh]
        rule = element.get("inertia") or LEGACY
        if rule not in RULES:
            hint = spelling_hint(rule, RULES)
            message = f"`{shorten(rule)}` is not a rule for the inertia of a mesh"
            element.error(message, hint, "inertia")
            return None
        if rule == "convex" and (element.get("maxhullvert") or "-1") != "-1":
            self.losses.add_description(
                "convex hulls with fewer vertices, which are whole here", mesh
            )
        reason, unit = "it cannot be read", None
        try:
            unit = None if surface is None else unit_mass_properties(surface, rule)
        except ValueError as failure:
            reason = str(failure)
        if unit is None:
            message = f"the mesh `{shorten(mesh)}` has no mass: {reason}"
            hint = "give the body an `inertial` with its mass and inertia"
            geom.error(message, hint, "mesh")
            return None
        self._unit_masses[mesh] = unit
        return unit

    def _fitted_mass(
        self, geom: XmlElement, shape: str, unit: MassProperties
    ) -> MassProperties | None:
        """Return the mass properties of a simple shape that is fitted to a mesh."""
        if shape not in SIZES or self.document.setting("fitaabb", "false") == "true":
            geom.error(
                f"the mass of this `{shorten(shape)}` fitted to a mesh is not computed",
                "give the body an `inertial` with its mass and inertia",
                "type",
            )
            return None
        box_pose, (short, middle, long) = inertia_box(unit)
        across = (short + middle) / 2.0
        sizes = {
            "sphere": ((short + middle + long) / 3.0,),
            "capsule": (across, max(0.0, long - across / 2.0)),
            "cylinder": (across, long),
        }.get(shape, (short, middle, long))
        factor = geom.number("fitscale", 1.0)
        fitted = _unit_mass(shape, [factor * size for size in sizes])
        pose = parse_pose(geom, self.document.angle_convention)
        return _with_mass(fitted, geom, pose @ box_pose)

    def shapes(self, geoms: Sequence[tuple[XmlElement, Array]]) -> tuple[Shape, ...]:
        """Return the shapes of the geoms of a body: those without contact, if it has such ones.

        Models draw a body with detailed geoms that touch nothing, and let simple ones touch.

        Args:
            geoms: each with the pose of its frame in the body, shape (4, 4).
        """
        seen = [
            (geom, pose)
            for geom, pose in geoms
            if (geom.get("type") or "sphere") not in UNDRAWN and self._rgba(geom)[3] > 0.0
        ]
        visual = [(geom, pose) for geom, pose in seen if _is_visual(geom)]
        for geom, _ in geoms:
            if (shape := geom.get("type")) in UNDRAWN:
                self.losses.add_description(UNDRAWN[shape or ""], *filter(None, [geom.get("name")]))
        if any(not _is_visual(geom) for geom, _ in geoms):
            self.losses.add(_CONTACT)
        return tuple(self._read_shapes(visual or seen))

    def _read_shapes(self, geoms: Sequence[tuple[XmlElement, Array]]) -> Iterator[Shape]:
        for geom, pose in geoms:
            surface = self._surface(geom)
            if surface is not None:
                red, green, blue, _ = self._rgba(geom)
                yield Shape(surface.transformed(pose), (red, green, blue))

    def _surface(self, geom: XmlElement) -> Surface | None:
        """Return the surface of a geom in its body's frame."""
        shape, angles = geom.get("type") or "sphere", self.document.angle_convention
        mesh = geom.get("mesh")
        if mesh is not None:
            if shape != "mesh":
                self.losses.add_description(
                    "simple shapes fitted to meshes, which are the meshes here", mesh
                )
            surface = self._mesh_surface(mesh, geom)
            return surface and surface.transformed(parse_pose(geom, angles))
        if shape == "mesh":
            geom.error(NO_MESH, 'write `mesh="..."`')
            return None
        if shape not in SIZES:
            hint = spelling_hint(shape, (*SIZES, *UNDRAWN, "mesh"))
            geom.error(f"unknown geom type `{shorten(shape)}`", hint, "type")
            return None
        place = _placed(geom, shape, angles)
        if place is None:
            return None
        pose, sizes = place
        return _PRIMITIVES[shape](*sizes).transformed(pose)

    def _mesh_surface(self, name: str, geom: XmlElement) -> Surface | None:
        """Return the surface of a mesh of the model; None, with a loss, if it cannot be read."""
        element = self._meshes.get(name)
        if element is None:
            geom.error(f"unknown mesh `{shorten(name)}`", spelling_hint(name, self._meshes), "mesh")
            return None
        if name not in self._surfaces:
            self._surfaces[name] = self._read_mesh(element, name)
        return self._surfaces[name]

    def _read_mesh(self, element: XmlElement, name: str) -> Surface | None:
        file = element.get("file")
        if file:
            named = self.document.setting("meshdir", self.document.setting("assetdir", ""))
            if self.document.setting("strippath", "false") == "true":
                file = file.replace("\\", "/").rsplit("/", 1)[-1]
            folders = dict.fromkeys((self.directory / named, self.directory))
            surface = self._files.find(folders, file)
        else:
            surface = self._inline_mesh(element, name)
        if surface is None:
            return None
        shift = np.array(element.vector("refpos"))
        read = element.numbers("refquat", 4)
        turn = np.eye(3)
        if read is not None and np.linalg.norm(read) > _SMALLEST_QUATERNION:
            turn = matrix_from_quaternion(np.array(read))
        surface = surface.transformed(pose_matrix(turn.T, -turn.T @ shift))
        scale = element.vector("scale", (1.0, 1.0, 1.0))
        if not all(scale):
            element.error("a scale is not zero", "", "scale")
            return None
        return scaled(surface, scale)

    def _inline_mesh(self, element: XmlElement, name: str) -> Surface | None:
        """Return a mesh that is written in the model; without faces its convex hull."""
        if "vertex" not in element.attributes:
            self.losses.add_description("meshes that MuJoCo makes itself", name)
            return None
        numbers = element.numbers("vertex", 9, _MAX_MESH_NUMBERS)
        corners = element.numbers("face", 3, _MAX_MESH_NUMBERS)
        if numbers is None or ("face" in element.attributes and corners is None):
            return None
        for name, listed in (("vertex", numbers), ("face", corners or ())):
            if len(listed) % 3:
                element.error("a mesh has three numbers for each vertex and face", at=name)
                return None
        points = np.array(numbers).reshape(-1, 3)
        if corners is None:
            try:
                return convex_hull(points)
            except ValueError:
                self.losses.add_description("meshes whose points lie in a plane", name)
                return None
        faces = np.array(corners).reshape(-1, 3)
        if (faces != np.round(faces)).any() or not 0 <= faces.min() <= faces.max() < len(points):
            hint = f"vertices are counted from 0 to {len(points) - 1}"
            element.error("a face of this mesh has a corner that is not a vertex", hint, "face")
            return None
        return Surface.from_faces(points, faces.astype(np.int64))

    def _rgba(self, geom: XmlElement) -> tuple[float, float, float, float]:
        """Return colour and opacity of a geom: its own, or those of its material."""
        own = self._parse_rgba(geom, DEFAULT_RGBA)
        material = self._materials.get(geom.get("material") or "")
        if material is None or own != DEFAULT_RGBA:
            return own
        if material.get("texture"):
            what = "textures: a material has its colour alone"
            self.losses.add_description(what, material.get("name") or "")
        return self._parse_rgba(material, (1.0, 1.0, 1.0, 1.0))

    def _parse_rgba(
        self, element: XmlElement, default: tuple[float, float, float, float]
    ) -> tuple[float, float, float, float]:
        read = element.numbers("rgba", 4) or default
        red, green, blue, opacity = np.clip(read, 0.0, 1.0).tolist()
        return red, green, blue, opacity

    def add_asset_losses(self) -> None:
        """Report the assets that are neither meshes nor materials."""
        for asset in self.document.root.find_all("asset"):
            for element in asset.children:
                if element.tag not in ("mesh", "material", "texture", "hfield"):
                    self.losses.add_description("unknown assets", element.tag)


_PRIMITIVES: Final[Mapping[str, Callable[..., Surface]]] = {
    "sphere": sphere,
    "capsule": capsule,
    "cylinder": cylinder,
    "ellipsoid": ellipsoid,
    "box": box,
}

_CONTACT = "contact of geoms: `mover simulate --floor` and `--scene` have their own"


def _is_visual(geom: XmlElement) -> bool:
    """Return whether a geom touches nothing."""
    return geom.get("contype") == "0" and geom.get("conaffinity") == "0"


def read_msh(path: Path) -> Surface:
    """Read a mesh in MuJoCo's own binary format.

    Four counts (vertices, normals, texture coordinates, faces) as 32-bit integers; the vertices,
    normals and coordinates as 32-bit floats; the faces as three integers each.

    Raises InputError for another file.
    """
    damaged = error(f"`{path}` cannot be read as msh: it is cut short, or holds something else")
    try:
        with open_regular_file(path) as file:
            data = file.read(_MAX_MSH_BYTES + 1)
    except OSError:
        raise InputError([damaged]) from None
    if not 16 <= len(data) <= _MAX_MSH_BYTES:
        raise InputError([damaged])
    vertices, normals, textures, faces = np.frombuffer(data, "<i4", 4).tolist()
    counts = (3 * vertices, 3 * normals, 2 * textures, 3 * faces)
    if min(counts) < 0 or len(data) != 16 + 4 * sum(counts):
        raise InputError([damaged])
    points = np.frombuffer(data, "<f4", counts[0], 16).astype(float).reshape(-1, 3)
    corners = np.frombuffer(data, "<i4", counts[3], 16 + 4 * sum(counts[:3])).reshape(-1, 3)
    try:
        return Surface.from_faces(points, corners.astype(np.int64))
    except ValueError:
        raise InputError([damaged]) from None


_MAX_MSH_BYTES = 200_000_000


RULES: Final = ("convex", "exact", "legacy", "shell")

LEGACY: Final = "legacy"
"""Rule of meshes without any."""

_LEAST_VOLUME = 1e-15
"""Volume [m3] or area [m2] that MuJoCo takes for none."""


def unit_mass_properties(surface: Surface, rule: str) -> MassProperties:
    """Return the mass properties of a mesh at unit density by one of the `RULES`.

    The density is 1 kg/m3, of a shell 1 kg/m2, so that the mass is the volume or the area.

    Raises ValueError, with a sentence, for a mesh that MuJoCo refuses as well.
    """
    if rule == "convex":
        surface = convex_hull(surface.vertices)
    elif rule == "exact" and build_edges(merge_vertices(surface)[0]).same_direction.any():
        raise ValueError("its triangles do not all face outwards")
    corners = surface.vertices[surface.fan_triangles[0]]
    centres = corners.mean(axis=0)
    normals = np.cross(corners[1] - corners[0], corners[2] - corners[0]) / 2.0
    weights = np.linalg.norm(normals, axis=1)
    if weights.sum() < _LEAST_VOLUME:
        raise ValueError("its triangles have no area")
    centre = weights @ centres / weights.sum()
    if rule != "shell":
        weights = _pyramids(centres - centre, normals, rule)
        centre = weights @ (0.75 * centres + 0.25 * centre) / weights.sum()
        weights = _pyramids(centres - centre, normals, rule)
    edges = corners - centre
    total = edges.sum(axis=0)
    second = np.einsum("t,ti,tj->ij", weights, total, total)
    second += np.einsum("t,cti,ctj->ij", weights, edges, edges)
    second /= 12.0 if rule == "shell" else 20.0
    inertia = np.trace(second) * np.eye(3) - second
    return MassProperties(float(weights.sum()), centre, inertia)


def inertia_box(mass: MassProperties) -> tuple[Array, Array]:
    """Return the box that has this mass and inertia, as a mesh's primitive shape is fitted.

    The results are its pose, (4, 4), with the longest side along z, and its half sides [m], (3,).
    """
    principal = mass.principal_inertia
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = principal.axes[:, ::-1] * [1.0, 1.0, -1.0], mass.centre
    moments = principal.moments[::-1]
    squares = np.maximum(moments.sum() - 2.0 * moments, 0.0)
    return pose, np.sqrt(1.5 * squares / mass.mass)


def _pyramids(centres: Array, normals: Array, rule: str) -> Array:
    """Volumes between an apex and triangles with these centres from it, shape (t,) [m3].

    Raises ValueError unless their sum is positive.
    """
    volumes = np.einsum("ti,ti->t", centres, normals) / 3.0
    volumes = np.abs(volumes) if rule == LEGACY else volumes
    if volumes.sum() < 0.0:
        raise ValueError("its volume is negative: its triangles face inwards")
    if volumes.sum() < _LEAST_VOLUME:
        raise ValueError('its volume is zero; `inertia="shell"` takes its area')
    return volumes


def convex_hull(points: Array) -> Surface:
    """Return the convex hull of points, shape (n, 3).

    Raises ValueError for points in a plane.
    """
    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError):  # fewer than four
        raise ValueError("its points lie in a plane") from None
    faces = hull.simplices.astype(np.int64)
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inwards = np.einsum("ij,ij->i", normals, hull.equations[:, :3]) < 0.0
    faces[inwards] = faces[inwards][:, ::-1]
    return Surface.from_faces(points, faces).without_unused_vertices
