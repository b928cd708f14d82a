"""Draws docs/pictures/persons.png: persons of different build.

Run with `python docs/pictures/persons.py` in the project's folder.
"""

from math import radians
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from generator import Scene, Sex, build_person, estimate_measures, read_figure
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.person.person_files import person_files
from plots.figure_image import Body, Strip, View, draw_moments

PERSONS = (
    (Sex.FEMALE, 1.628, 67.8),
    (Sex.MALE, 1.756, 85.5),
    (Sex.FEMALE, 1.75, 50.0),
    (Sex.MALE, 1.72, 120.0),
)
"""Sex, stature [m] and mass [kg]."""

STRIP = Strip(
    View(turn=radians(35.0), tilt=radians(8.0)),
    spacing=1.0,
    left=-0.5,
    right=0.5,
    bottom=-0.2,
    top=1.9,
    floor=None,
    scale=220.0,
)
DPI = 100


def main() -> None:
    """Build, draw, write."""
    images: list[np.ndarray] = []
    for sex, stature, mass in PERSONS:
        person = build_person(estimate_measures(sex, stature, mass))
        with TemporaryDirectory() as folder:
            path = Path(folder) / "person.fig"
            person_files(person, path).write()
            figure = read_figure(path)
            body = Body.of_figure(figure)
        tree = build_tree(figure)
        placement = forward_kinematics(tree, initial_displacements(tree))
        images.append(draw_moments(body, [placement.poses], STRIP, Scene()))
    image = np.concatenate(images, axis=1)
    height, width = image.shape[:2]
    picture = Figure(figsize=(width / DPI, height / DPI), dpi=DPI)
    axes = picture.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.imshow(image, aspect="auto")
    for place, (_, stature, mass) in enumerate(PERSONS):
        axes.text(
            (place + 0.5) * width / len(PERSONS),
            height - 12,
            f"{stature:.2f} m, {mass:.0f} kg",
            fontsize=12,
            ha="center",
        )
    FigureCanvasAgg(picture)
    picture.savefig(Path(__file__).with_suffix(".png"), dpi=DPI, transparent=True)


if __name__ == "__main__":
    main()
