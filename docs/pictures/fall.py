"""Draws docs/pictures/fall.gif: a man slips, trips over a step, and falls onto a chair.

Run with `python docs/pictures/fall.py` in the project's folder.
"""

from dataclasses import replace
from math import radians
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from generator import Recording, fall_plan, read_figure, simulate
from generator.contact.scene import Scene
from plots.figure_image import Body, Strip, View, draw_moments

LEFT_EDGES = {"slip": -1.35, "trip": -0.7, "seat": -1.5}
"""Left edge of the picture of each kind of fall [m]."""

WIDTH = 2.7
"""Width of a picture [m]."""

STOP, FRAMES_PER_SECOND = 1.6, 20
REST = 1000
"""Time for which the last frame stays [ms]."""

STRIP = Strip(
    View(turn=radians(-72.0), tilt=radians(10.0)),
    spacing=0.0,
    left=0.0,
    right=WIDTH,
    bottom=-0.4,
    top=2.05,
    floor=(-1.5, 1.5),
    scale=110.0,
)
COLOURS = 64
WHITE, TEXT = (255, 255, 255), (40, 40, 40)


def drawn_frames(body: Body, recording: Recording, scene: Scene, kind: str) -> list[Image.Image]:
    """Draw the frames of a fall on white."""
    left = LEFT_EDGES[kind]
    strip = replace(STRIP, left=left, right=left + WIDTH)
    frames: list[Image.Image] = []
    for k in range(len(recording.times)):
        moment = {name: poses[k] for name, poses in recording.poses.items()}
        drawn = Image.fromarray(draw_moments(body, [moment], strip, scene))
        frame = Image.new("RGB", drawn.size, WHITE)
        frame.paste(drawn, mask=drawn.getchannel("A"))
        at = (frame.width // 2, 8)
        font = ImageFont.load_default(18)
        ImageDraw.Draw(frame).text(at, f"--fall {kind}", TEXT, font, anchor="ma")
        frames.append(frame)
    return frames


def main() -> None:
    """Simulate, draw, write."""
    figure = read_figure("male50")
    body = Body.of_figure(figure)
    columns: list[list[Image.Image]] = []
    for kind in LEFT_EDGES:
        plan = replace(fall_plan(figure, kind), stop=STOP, frame=1.0 / FRAMES_PER_SECOND)
        recording = simulate(figure, plan)
        columns.append(drawn_frames(body, recording, plan.scene or Scene(), kind))
    wide = [
        Image.fromarray(np.hstack([np.asarray(one) for one in moment]))
        for moment in zip(*columns, strict=True)
    ]
    palette = wide[0].quantize(COLOURS, dither=Image.Dither.NONE)
    frames = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in wide]
    durations = [1000 // FRAMES_PER_SECOND] * (len(frames) - 1) + [REST]
    path = Path(__file__).with_suffix(".gif")
    frames[0].save(
        path, save_all=True, append_images=frames[1:], duration=durations, loop=0, optimize=True
    )


if __name__ == "__main__":
    main()
