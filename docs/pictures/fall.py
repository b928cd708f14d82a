"""Draws docs/pictures/fall.png: the prototype's fall, a frame every 0.3 s.

Run with `python docs/pictures/fall.py` in the project's folder.
"""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection

from generator import Plan, Recording, read_figure, simulate
from generator.figure import Figure
from generator.geometry.read import read_segment_surface

FRAME = 0.3
FRAMES = 6
LIGHT = np.array([0.45, 0.7, 0.55])
SKIN = np.array([0.93, 0.67, 0.50])
TURN = np.radians(35.0)
"""How far the view is turned from the front to the figure's left."""


def polygons(figure: Figure, recording: Recording, frame: int) -> list[np.ndarray]:
    """All faces of the figure at a frame, in world axes."""
    found: list[np.ndarray] = []
    for name, segment in figure.segments.items():
        if segment.psurf is not None:
            surface = read_segment_surface(figure, segment)
            pose = recording.poses[name][frame]
            placed = surface.vertices @ pose[:3, :3].T + pose[:3, 3]
            found += [placed[list(face)] for face in surface.faces]
    return found


def draw(axes: plt.Axes, faces: list[np.ndarray]) -> None:
    """Faces that look at us, the farthest first, lit from above."""
    view = np.array([np.sin(TURN), 0.12, np.cos(TURN)])
    view /= np.linalg.norm(view)
    right = np.cross([0.0, 1.0, 0.0], view)
    right /= np.linalg.norm(right)
    up = np.cross(view, right)
    normals = [np.cross(face[1] - face[0], face[2] - face[1]) for face in faces]
    seen = [
        (face, normal / np.linalg.norm(normal))
        for face, normal in zip(faces, normals, strict=True)
        if normal @ view > 0.0
    ]
    seen.sort(key=lambda pair: float(np.mean(pair[0] @ view)))
    colours = [SKIN * (0.45 + 0.55 * max(0.0, float(n @ LIGHT))) for _, n in seen]
    flat = [np.stack([face @ right, face @ up], axis=1) for face, _ in seen]
    axes.add_collection(
        PolyCollection(flat, facecolors=colours, edgecolors=colours, linewidths=0.3)
    )


def main() -> None:
    """Simulate, draw, write."""
    figure = read_figure("prototype")
    recording = simulate(figure, Plan(stop=FRAME * (FRAMES - 1), frame=FRAME))
    picture, row = plt.subplots(1, FRAMES, figsize=(12, 3.7), sharex=True, sharey=True)
    for frame, axes in enumerate(row):
        axes.axhline(0.0, color="0.8", linewidth=1.0, zorder=0)
        draw(axes, polygons(figure, recording, frame))
        axes.set(aspect="equal", xlim=(-0.75, 0.75), ylim=(-0.2, 1.95))
        axes.set_axis_off()
        axes.text(0.0, -0.18, f"{recording.times[frame]:.1f} s", ha="center", fontsize=11)
    picture.subplots_adjust(left=0.0, right=1.0, bottom=0.02, top=1.0, wspace=0.0)
    picture.savefig(Path(__file__).with_suffix(".png"), dpi=100)


if __name__ == "__main__":
    main()
