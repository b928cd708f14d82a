"""Draws docs/pictures/falls.png: the six falls of docs/contact.md, a row each.

Run with `python docs/pictures/falls.py` in the project's folder.
"""

import shlex
from dataclasses import dataclass
from math import radians
from pathlib import Path
from tempfile import TemporaryDirectory

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from generator import read_figure, read_npz
from generator.cli.app import app
from generator.contact.scene import Scene
from generator.input_files.scene import read_scene
from plots.figure_image import Body, Strip, View, draw_moments, poses_at

WIDTH, SCALE = 11.4, 100
"""Width of the picture [m], pixels per metre."""

FLOOR = (-2.0, 2.5)
"""Range of the floor towards the viewer [m]."""

GREY = "#808080"


@dataclass(frozen=True)
class Fall:
    """A row.

    Attributes:
        title: above the row.
        command: without the file that it writes.
        times: of the moments [s]; even hundredths.
        spacing: between moments [m].
        left: edge, from the origin of the first moment [m].
        bottom: lower edge, from the origin [m].
        top: upper edge, from the origin [m].
        turn: of the view [deg].
        tilt: of the view [deg].
    """

    title: str
    command: str
    times: tuple[float, ...]
    spacing: float = 1.9
    left: float = -0.8
    bottom: float = -0.45
    top: float = 1.9
    turn: float = -50.0
    tilt: float = 12.0

    @property
    def strip(self) -> Strip:
        """Arrangement of the row."""
        right = self.left + WIDTH - self.spacing * (len(self.times) - 1)
        view = View(radians(self.turn), radians(self.tilt))
        edges = (self.left, right, self.bottom, self.top)
        return Strip(view, self.spacing, *edges, floor=FLOOR, scale=SCALE)

    @property
    def scene(self) -> Scene:
        """Scene that the command names."""
        words = shlex.split(self.command)
        return read_scene(words[words.index("--scene") + 1]) if "--scene" in words else Scene()


FALLS = (
    Fall(
        "collapse: the knees give way",
        "mover simulate prototype --floor --set left_knee=10 --set right_knee=20 --stop 4",
        (0.0, 0.3, 0.6, 0.8, 1.0, 4.0),
    ),
    Fall(
        "lean to the left",
        "mover simulate prototype --floor --set root_torso=-8,0,0 --set left_knee=20"
        " --set right_knee=25 --stop 3",
        (0.0, 0.3, 0.6, 0.8, 1.2, 3.0),
        spacing=1.85,
        left=-0.6,
    ),
    Fall(
        "push of 2 m/s",
        "mover simulate prototype --floor --velocity lower_torso=0,0,0,0,0,2 --stop 3",
        (0.0, 0.2, 0.4, 0.6, 0.8, 3.0),
        spacing=1.72,
        left=-0.5,
    ),
    Fall(
        "trip: the same push before a step",
        "mover simulate prototype --floor --scene step --velocity lower_torso=0,0,0,0,0,2 --stop 3",
        (0.0, 0.2, 0.4, 0.6, 0.8, 3.0),
        spacing=1.72,
        left=-0.5,
    ),
    Fall(
        "roll off a bed",
        "mover simulate prototype --floor --scene bed --set root_torso=0,-90,0 --height 0.5"
        " --stop 3",
        (0.0, 0.2, 0.4, 0.6, 0.8, 3.0),
        spacing=1.85,
        left=-0.85,
        bottom=-0.72,
        top=1.25,
        turn=-25.0,
        tilt=22.0,
    ),
    Fall(
        "sit down on an easy chair",
        "mover simulate prototype --floor --scene seat --velocity lower_torso=0,0,0,0,0,-1.4"
        " --stop 4",
        (0.0, 0.2, 0.4, 0.6, 1.0, 4.0),
        left=-1.25,
    ),
)


def main() -> None:
    """Simulate, draw, write."""
    figure = read_figure("prototype")
    heights = [fall.top - fall.bottom for fall in FALLS]
    picture = Figure(figsize=(WIDTH, sum(heights)), dpi=SCALE)
    panels = picture.subplots(len(FALLS), 1, height_ratios=heights)
    picture.subplots_adjust(left=0.0, right=1.0, bottom=0.0, top=1.0, hspace=0.0)
    for fall, axes in zip(FALLS, panels, strict=True):
        with TemporaryDirectory() as folder:
            file = Path(folder) / "fall.npz"
            words = shlex.split(fall.command)[1:]
            app([*words, "--quiet", "-o", str(file)], standalone_mode=False)
            _, recording = read_npz(file)
        strip = fall.strip
        frames = [round(time / recording.times[1]) for time in fall.times]
        axes.set_axis_off()
        axes.imshow(
            draw_moments(
                Body.of_figure(figure), poses_at(recording.poses, frames), strip, fall.scene
            ),
            extent=(
                strip.left,
                strip.right + strip.spacing * (len(frames) - 1),
                strip.bottom,
                strip.top,
            ),
            aspect="auto",
        )
        axes.text(
            strip.left + WIDTH - 0.1,
            strip.top - 0.25,
            fall.title,
            fontsize=14,
            color=GREY,
            ha="right",
        )
        for place, time in enumerate(fall.times):
            axes.text(
                place * strip.spacing,
                strip.bottom + 0.04,
                f"{time:.1f} s",
                fontsize=11,
                ha="center",
            )
    FigureCanvasAgg(picture)
    picture.savefig(Path(__file__).with_suffix(".png"), dpi=SCALE, transparent=True)


if __name__ == "__main__":
    main()
