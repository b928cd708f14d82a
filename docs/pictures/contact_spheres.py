"""Draws docs/pictures/contact_spheres.png: the standing prototype and its contact spheres.

Run with `python docs/pictures/contact_spheres.py` in the project's folder.
"""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import EllipseCollection, PolyCollection

from generator import read_figure
from generator.contact.spheres import fit_contact_spheres
from generator.geometry.read import read_segment_surface
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree

SKIN, SPHERE = "#edc9ac", "#1f5f9e"
VIEWS = {"front": (0, 1), "right side": (2, 1)}
"""Axes of the world that point to the right and up."""


def main() -> None:
    """Draw both views."""
    figure = read_figure("prototype")
    tree = build_tree(figure)
    poses = forward_kinematics(tree, initial_displacements(tree)).poses
    picture, axes = plt.subplots(1, 2, figsize=(6.4, 5.6), dpi=120, sharey=True)
    for (title, plane), ax in zip(VIEWS.items(), axes, strict=True):
        for name, fit in fit_contact_spheres(figure).items():
            turn, origin = poses[name][:3, :3], poses[name][:3, 3]
            surface = read_segment_surface(figure, figure.segments[name])
            flat = (surface.vertices @ turn.T + origin)[:, plane]
            faces = [flat[list(face)] for face in surface.faces]
            ax.add_collection(PolyCollection(faces, facecolors=SKIN, edgecolors="none"))
            centres = np.array([each.centre for each in fit.spheres]) @ turn.T + origin
            width = 2.0 * np.array([each.radius for each in fit.spheres])
            ax.add_collection(
                EllipseCollection(
                    width,
                    width,
                    np.zeros(len(width)),
                    units="xy",
                    offsets=centres[:, plane],
                    offset_transform=ax.transData,
                    facecolors="none",
                    edgecolors=SPHERE,
                    linewidths=0.9,
                    zorder=3,
                )
            )
        ax.set_title(title)
        ax.autoscale_view()
        ax.set_aspect("equal")
        ax.set_axis_off()
    picture.tight_layout()
    picture.savefig(Path(__file__).with_suffix(".png"))


if __name__ == "__main__":
    main()
