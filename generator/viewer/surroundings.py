"""Surroundings of the figure on the page: lights, the ground, and its background."""

from collections.abc import Mapping

import numpy as np

from generator.figure import Figure
from generator.rotations import Array, quaternion_from_matrix
from generator.viewer.server import PageServer

_CELL_COLOURS = {False: (222, 225, 230), True: (52, 55, 60)}
_SECTION_COLOURS = {False: (190, 195, 203), True: (78, 82, 90)}

GRID_CELL = 0.25
"""Width of a cell of the ground [m]."""

MIN_GROUND_REACH = 4.0
"""Least distance from the world's origin to the sides of the ground [m]."""


class Surroundings:
    """Lights and the ground at y = 0, light or dark."""

    def __init__(self, server: PageServer, points: Array) -> None:
        """Add the nodes, with a ground that extends beyond points of a figure, (n, 3) [m]."""
        self._server, self._ground_width = server, ground_width(points)
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
        self._server.set_theme(is_dark=is_dark)
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
        )


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
