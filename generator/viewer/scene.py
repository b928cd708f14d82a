"""A figure as nodes of the page's scene: a mesh for each segment, moved by its pose."""

from collections.abc import Mapping
from urllib.parse import quote

import numpy as np
import viser

from generator.figure import Figure
from generator.geometry.intersections import triangulate
from generator.motion_files.appearance import segment_appearances
from generator.rotations import Array, quaternion_from_matrix

GHOST_OPACITY = 0.35


def node_name(segment: str, root: str = "figure") -> str:
    """Return the name of a segment's node: names of segments may have any characters."""
    return f"/{root}/{quote(segment, safe=' ')}"


class FigureScene:
    """Meshes of the segments of a figure in the scene of a page.

    Attributes:
        meshes: node of each segment that has a surface, by segment.
        losses: segments that are not drawn as their files say.
    """

    def __init__(
        self, scene: viser.SceneApi, figure: Figure, root: str = "figure", *, ghost: bool = False
    ) -> None:
        """Add the meshes; a ghost is translucent and cannot be clicked."""
        appearances, self.losses = segment_appearances(figure)
        self.root = scene.add_frame(f"/{root}", show_axes=False)
        self.meshes: dict[str, viser.MeshHandle] = {}
        for name, appearance in appearances.items():
            corners, _ = triangulate(appearance.surface)
            red, green, blue = (round(255.0 * part) for part in appearance.colour)
            self.meshes[name] = scene.add_mesh_simple(
                node_name(name, root),
                corners.reshape(-1, 3),
                np.arange(3 * len(corners)).reshape(-1, 3),
                color=(red, green, blue),
                opacity=GHOST_OPACITY if ghost else None,
                flat_shading=True,
                side="double",
                cast_shadow=not ghost,
            )

    def move(self, poses: Mapping[str, Array]) -> None:
        """Move the meshes to the poses of their segments in the world, shape (4, 4)."""
        for name, mesh in self.meshes.items():
            pose = poses[name]
            mesh.position = pose[:3, 3]
            mesh.wxyz = quaternion_from_matrix(pose[:3, :3])

    def remove(self) -> None:
        """Remove the meshes from the scene."""
        self.root.remove()


def bounds(figure_scene: FigureScene, poses: Mapping[str, Array]) -> tuple[Array, Array]:
    """Return the lowest and highest corner of a box around all meshes, shape (3,) each [m]."""
    points = [
        mesh.vertices @ poses[name][:3, :3].T + poses[name][:3, 3]
        for name, mesh in figure_scene.meshes.items()
    ] or [np.array([pose[:3, 3] for pose in poses.values()])]
    every = np.concatenate(points)
    return every.min(axis=0), every.max(axis=0)
