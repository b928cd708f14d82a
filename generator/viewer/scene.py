"""A figure as nodes of the page's scene: a mesh for each segment, moved by its pose."""

from collections.abc import Mapping, Sequence
from urllib.parse import quote

import numpy as np
import viser

from generator.figure import Figure
from generator.geometry.appearance import Colour, segment_appearances
from generator.geometry.intersections import triangulate
from generator.geometry.surface import Indices, Surface
from generator.rotations import Array, quaternion_from_matrix

GHOST_OPACITY, TRANSLUCENT_OPACITY = 0.35, 0.4

SELECTED_COLOUR: Colour = (0.16, 0.55, 1.0)
"""Colour of the selected segment."""

CREASE_ANGLE = np.radians(40.0)
"""Angle between the normals of two faces from which their common edge is drawn sharp [rad]."""

FILL = 0.8
"""Part of the height, or of the width beside the controls, that a framed figure takes at most."""

VIEW_ANGLE = np.radians(35.0)
"""Vertical angle of view [rad]."""

VIEW_DIRECTIONS: Mapping[str, Sequence[float]] = {
    "Free": (0.5, 0.25, 0.85),
    "Front": (0.0, 0.0, 1.0),
    "Side": (1.0, 0.0, 0.0),
    "Top": (0.0, 1.0, 1e-3),
}
"""From the figure to the camera, by name: at first from its front left, a little from above."""


def node_name(segment: str, root: str = "figure") -> str:
    """Return the name of a segment's node: names of segments may have any characters."""
    return f"/{root}/{quote(segment, safe=' ')}"


def rgb(colour: Colour) -> tuple[int, int, int]:
    """Return a colour in integers to 255."""
    red, green, blue = (round(255.0 * part) for part in colour)
    return red, green, blue


class FigureScene:
    """Meshes of the segments of a figure in the scene of a page.

    The losses name the segments that are not drawn as their files say.
    """

    def __init__(
        self, scene: viser.SceneApi, figure: Figure, root: str = "figure", *, ghost: bool = False
    ) -> None:
        """Add the meshes; a ghost is translucent and cannot be clicked."""
        self.appearances, self.losses = segment_appearances(figure)
        self.root = scene.add_frame(f"/{root}", show_axes=False)
        self.meshes: dict[str, viser.MeshHandle] = {}
        self._places = np.full((1, 7), np.nan)
        self._selected: str | None = None
        for name, appearance in self.appearances.items():
            vertices, triangles = mesh_with_creases(appearance.surface)
            self.meshes[name] = scene.add_mesh_simple(
                node_name(name, root),
                vertices,
                triangles,
                color=rgb(appearance.colour),
                opacity=GHOST_OPACITY if ghost else None,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            )

    def move(self, poses: Mapping[str, Array]) -> None:
        """Move the meshes to the poses of their segments in the world, shape (4, 4)."""
        if not self.meshes:
            return
        every = np.array([poses[name] for name in self.meshes])
        places = np.hstack([every[:, :3, 3], quaternion_from_matrix(every[:, :3, :3])])
        changed = np.any(places != self._places, axis=1)
        self._places = places
        for mesh, place, has_moved in zip(self.meshes.values(), places, changed, strict=True):
            if has_moved:
                _move_node(mesh, place[:3], place[3:])

    def select(self, segment: str | None) -> None:
        """Draw a segment in the colour of the selection, and the one before in its own."""
        if self._selected in self.meshes:
            colour = self.appearances[self._selected].colour
            self.meshes[self._selected].color = rgb(colour)
        self._selected = segment
        if segment in self.meshes:
            self.meshes[segment].color = rgb(SELECTED_COLOUR)

    def set_translucent(self, *, is_translucent: bool) -> None:
        """Show what is inside the segments, or not."""
        opacity = TRANSLUCENT_OPACITY if is_translucent else None
        for mesh in self.meshes.values():
            if mesh.opacity != opacity:
                mesh.opacity = opacity

    def remove(self) -> None:
        """Remove the meshes from the scene."""
        self.root.remove()


def _move_node(node: viser.SceneNodeHandle, position: Array, quaternion: Array) -> None:
    """Move a node by however little: viser itself does not send changes below 1e-5."""
    if not np.array_equal(node.position, position):
        node.position.fill(np.nan)
        node.position = position
    if not np.array_equal(node.wxyz, quaternion):
        node.wxyz.fill(np.nan)
        node.wxyz = quaternion


def mesh_with_creases(surface: Surface) -> tuple[Array, Indices]:
    """Return vertices and triangles of a mesh that is shaded smoothly up to its creases.

    The page takes as normal at a vertex the mean of its triangles. So a vertex of the surface is
    repeated for each group of its triangles that are not connected by edges without a crease.

    Returns:
        vertices [m], shape (n, 3), and their indices in the triangles, shape (t, 3).
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    corners, faces = triangulate(surface)
    points, place = np.unique(corners.reshape(-1, 3) + 0.0, axis=0, return_inverse=True)
    triangles = place.reshape(-1, 3)
    one, other = _corners_across_smooth_edges(triangles, _face_directions(corners, faces)[faces])
    count = triangles.size
    links = coo_array((np.ones(len(one), bool), (one, other)), shape=(count, count))
    _, groups = connected_components(links, directed=False)
    _, first, result = np.unique(groups, return_index=True, return_inverse=True)
    return points[triangles.ravel()[first]], result.reshape(-1, 3)


def _face_directions(corners: Array, faces: Indices) -> Array:
    """Return the unit normals of faces by their triangles, shape (m, 3); zero without an area."""
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sums = np.stack([np.bincount(faces, crosses[:, axis]) for axis in range(3)], axis=1)
    lengths = np.linalg.norm(sums, axis=1, keepdims=True)
    return np.divide(sums, lengths, where=lengths > 0.0, out=np.zeros_like(sums))


def _corners_across_smooth_edges(triangles: Indices, normals: Array) -> tuple[Indices, Indices]:
    """Return pairs of corners at one vertex, on the two sides of an edge without a crease.

    Triangles are indices of vertices, shape (t, 3), with normals of their faces, shape (t, 3).
    """
    corner = np.arange(triangles.size).reshape(-1, 3)
    here, there = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    ends = np.stack([corner.ravel(), np.roll(corner, -1, axis=1).ravel()], axis=1)
    ends = np.where((here <= there)[:, None], ends, ends[:, ::-1])
    low, high = np.minimum(here, there), np.maximum(here, there)
    order = np.lexsort((high, low))
    before, after = order[:-1], order[1:]
    cosines = np.sum(normals[before // 3] * normals[after // 3], axis=1)
    joined = (low[before] == low[after]) & (high[before] == high[after])
    joined &= cosines > np.cos(CREASE_ANGLE)
    return ends[before[joined]].ravel(), ends[after[joined]].ravel()


def points_in_world(figure_scene: FigureScene, poses: Mapping[str, Array]) -> Array:
    """Return the vertices of all meshes, or without any the origins of the segments, (n, 3) [m]."""
    points = [
        mesh.vertices @ poses[name][:3, :3].T + poses[name][:3, 3]
        for name, mesh in figure_scene.meshes.items()
    ]
    return np.concatenate(points or [np.array([pose[:3, 3] for pose in poses.values()])])


def camera_position(
    points: Array, aspect: float, covered: float, view: str = "Free"
) -> tuple[Array, Array]:
    """Return the position of a camera that sees all points, and the point that it looks at [m].

    Args:
        points: Points, shape (n, 3) [m].
        aspect: Width of the page over its height.
        covered: Part of the width, at the right, that the controls cover.
        view: Name of the direction, of `VIEW_DIRECTIONS`.
    """
    direction = np.array(VIEW_DIRECTIONS[view])
    direction /= np.linalg.norm(direction)
    low, high = points.min(axis=0), points.max(axis=0)
    centre = 0.5 * (low + high)
    right = np.cross([0.0, 1.0, 0.0], direction)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(direction, right)])
    half = np.tan(0.5 * VIEW_ANGLE)
    shift = np.array([covered * aspect * half, 0.0])  # of the camera, for each metre of distance
    slopes = FILL * half * np.array([aspect * (1.0 - covered), 1.0])
    arms = points - centre
    nearness = arms @ direction
    places = arms @ axes.T - nearness[:, None] * shift
    distances = nearness + np.max(np.abs(places) / slopes, axis=1)
    distance = max(float(distances.max()), 0.5 * float(np.linalg.norm(high - low)), 1e-2)
    centre = centre + distance * shift[0] * right
    return centre + distance * direction, centre
