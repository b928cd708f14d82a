"""Surroundings of the figure on the page: lights, the ground, props, and contact forces."""

from collections.abc import Mapping

import numpy as np
import viser

from generator.contact.appearance import FORCE_COLOUR, is_level, prop_colour, prop_surface
from generator.contact.arrows import ArrowScale
from generator.contact.scene import NO_SCENE, Scene
from generator.figure import Figure
from generator.geometry.intersections import triangulate
from generator.geometry.surface import Indices, Surface
from generator.rotations import Array, quaternion_from_matrix
from generator.viewer.scene import rgb
from generator.viewer.server import PageServer

_CELL_COLOURS = {False: (222, 225, 230), True: (52, 55, 60)}
_SECTION_COLOURS = {False: (190, 195, 203), True: (78, 82, 90)}

GRID_CELL = 0.25
"""Width of a cell of the ground [m]."""

MIN_GROUND_REACH = 4.0
"""Least distance from the world's origin to the sides of the ground [m]."""


_WALL_OPACITY, _PROP_OPACITY = 0.2, 0.7
"""Opacity of planes that are not level, and of other props: arrows below a body are seen."""


class Surroundings:
    """Lights, the ground, which is the level plane of the scene or else y = 0, and other props."""

    def __init__(self, server: PageServer, points: Array) -> None:
        """Add the nodes, with a ground that extends beyond points of a figure, (n, 3) [m]."""
        self._server, self._ground_width = server, ground_width(points)
        self._props: dict[str, viser.MeshHandle] = {}
        self._ground_place, self._is_dark, self.scene_shown = np.zeros(3), False, NO_SCENE
        scene = server.scene
        scene.configure_default_lights(False)
        scene.add_light_hemisphere(
            "/lights/sky", sky_color=(255, 255, 255), ground_color=(150, 145, 140), intensity=1.2
        )
        scene.add_light_directional("/lights/key", intensity=2.4, position=(1.5, 3.0, 2.5))
        scene.add_light_directional("/lights/fill", intensity=0.6, position=(-2.5, 1.0, 0.5))
        self.set_dark(is_dark=False)

    def set_dark(self, *, is_dark: bool) -> None:
        """Change background and controls, by the theme of the page, and the ground."""
        self._is_dark = is_dark
        self._server.set_theme(is_dark=is_dark)
        self._draw_ground()

    def show_scene(self, scene: Scene, points: Array) -> None:
        """Show the props of a scene in place of those before.

        Args:
            scene: Scene.
            points: Points that planes extend beyond, shape (n, 3) [m].
        """
        if scene == self.scene_shown:
            return
        self.scene_shown = scene
        for node in self._props.values():
            node.remove()
        floors = [prop.shape for prop in scene.props if is_level(prop.shape)]
        self._ground_place = floors[0].pose[:3, 3] if floors else np.zeros(3)
        self._ground_width = max(self._ground_width, ground_width(points))
        self._draw_ground()
        self._props = {
            prop.name: self._server.scene.add_mesh_simple(
                f"/props/{k}",
                *_prop_mesh(prop_surface(prop.shape, points)),
                color=rgb(prop_colour(prop.shape)),
                opacity=_WALL_OPACITY if prop.shape.is_endless else _PROP_OPACITY,
                flat_shading=True,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
                position=prop.shape.pose[:3, 3],
                wxyz=quaternion_from_matrix(prop.shape.pose[:3, :3]),
            )
            for k, prop in enumerate(scene.props)
            if not is_level(prop.shape)
        }

    def _draw_ground(self) -> None:
        is_dark = self._is_dark
        self._server.scene.add_grid(
            "/ground",
            self._ground_width,
            self._ground_width,
            plane="xz",
            cell_size=GRID_CELL,
            section_size=4.0 * GRID_CELL,
            cell_color=_CELL_COLOURS[is_dark],
            section_color=_SECTION_COLOURS[is_dark],
            fade_distance=0.7 * self._ground_width,  # half of its diagonal
            fade_from="origin",
            shadow_opacity=0.0,
            position=self._ground_place,
        )


def _prop_mesh(surface: Surface) -> tuple[Array, Indices]:
    """Return vertices and triangles of the surface of a prop."""
    corners, _ = triangulate(surface)
    return corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)


class ForceArrows:
    """Contact forces as arrows, as one node."""

    def __init__(self, server: PageServer, name: str, scale: ArrowScale) -> None:
        """Remember the scale; there are no arrows yet."""
        self._server, self._name, self._scale = server, name, scale
        self._node: viser.ArrowsHandle | None = None

    def show(self, forces: Array, points: Array) -> None:
        """Show forces [N] at points [m], both of shape (n, 3), in place of those before."""
        arrows = self._scale.arrows(forces, points).astype(np.float32)
        if not len(arrows):
            self.hide()
        elif self._node is None:
            self._node = self._server.scene.add_arrows(
                self._name,
                arrows,
                rgb(FORCE_COLOUR),
                shaft_radius=self._scale.shaft_radius,
                head_radius=self._scale.head_radius,
                head_length=self._scale.head_length,
            )
        else:
            self._node.points = arrows

    def hide(self) -> None:
        """Remove the arrows."""
        if self._node is not None:
            self._node.remove()
            self._node = None


def ground_width(points: Array) -> float:
    """Return the width of a square ground around the world's origin [m], of whole sections.

    It is finite because in software rendering an infinite one takes a third of the time of a frame.
    """
    section = 4.0 * GRID_CELL
    reach = max(MIN_GROUND_REACH, 2.0 * float(np.abs(points[:, [0, 2]]).max()))
    return 2.0 * section * float(np.ceil(reach / section))


class FrameAxes:
    """Axes of frames that are fixed to segments, as one node that is shown on demand."""

    def __init__(self, server: PageServer, name: str, frames: Mapping[str, Array]) -> None:
        """Remember the frames in their segments, shape (k, 4, 4), by segment."""
        self._server, self._name, self._frames = server, name, frames
        self._node = None

    def show(self, poses: Mapping[str, Array], length: float) -> None:
        """Show the axes, of a length [m], or move them."""
        placed = [poses[name] @ frames for name, frames in self._frames.items()]
        every = np.concatenate([np.zeros((0, 4, 4)), *placed])
        turns = quaternion_from_matrix(every[:, :3, :3])
        if self._node is None:
            self._node = self._server.scene.add_batched_axes(
                self._name,
                turns,
                every[:, :3, 3],
                axes_length=length,
                axes_radius=0.04 * length,
            )
            return
        self._node.batched_wxyzs = turns.astype(np.float32)
        self._node.batched_positions = every[:, :3, 3].astype(np.float32)

    def hide(self) -> None:
        """Remove the axes."""
        if self._node is not None:
            self._node.remove()
            self._node = None


def site_frames(figure: Figure) -> dict[str, Array]:
    """Return the frames of all sites in their segments, shape (k, 4, 4), by segment."""
    return {
        name: np.array([site.pose_in_segment for site in segment.sites.values()])
        for name, segment in figure.segments.items()
        if segment.sites
    }


def joint_frames(figure: Figure) -> dict[str, Array]:
    """Return the frames of both sites of all joints in their segments, (k, 4, 4), by segment."""
    refs = dict.fromkeys(end for joint in figure.joints.values() for end in joint.ends)
    frames: dict[str, list[Array]] = {}
    for ref in refs:
        frames.setdefault(ref.segment, []).append(figure.site(ref).pose_in_segment)
    return {name: np.array(poses) for name, poses in frames.items()}
