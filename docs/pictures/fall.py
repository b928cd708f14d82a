"""Draws docs/pictures/fall.png: `male50` lets go of all muscles and falls on a floor.

Run with `python docs/pictures/fall.py` in the project's folder.
"""

from math import radians
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from generator import Plan, read_figure, simulate
from generator.contact.scene import Scene
from plots.figure_image import Strip, View, strip_image

TIMES = (0.0, 0.3, 0.5, 0.7, 0.9, 1.2, 2.0)
"""Moments that are drawn [s]."""

FRAME = 0.1
STRIP = Strip(
    View(turn=radians(-50.0), tilt=radians(12.0)),
    spacing=1.7,
    left=-0.6,
    right=1.25,
    bottom=-0.3,
    top=1.98,
    floor=(-1.6, 1.6),
    scale=130.0,
)
DPI = 100
LABEL_SHIFT = 0.1
"""Of the times to the right [m]."""


def main() -> None:
    """Simulate, draw, write."""
    figure = read_figure("male50")
    scene = Scene.floor()
    plan = Plan(stop=TIMES[-1], frame=FRAME, free_root=True, height=0.0, scene=scene)
    recording = simulate(figure, plan)
    frames = [round(time / FRAME) for time in TIMES]
    image = strip_image(figure, recording, frames, STRIP, scene)
    height, width = image.shape[:2]
    picture = Figure(figsize=(width / DPI, height / DPI), dpi=DPI)
    axes = picture.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    right = STRIP.left + STRIP.width(len(TIMES))
    axes.imshow(image, extent=(STRIP.left, right, STRIP.bottom, STRIP.top), aspect="auto")
    for place, time in enumerate(TIMES):
        axes.text(
            place * STRIP.spacing + LABEL_SHIFT,
            STRIP.bottom + 0.03,
            f"{time:.1f} s",
            fontsize=13,
            ha="center",
        )
    FigureCanvasAgg(picture)
    picture.savefig(Path(__file__).with_suffix(".png"), dpi=DPI, transparent=True)


if __name__ == "__main__":
    main()
