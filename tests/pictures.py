"""Figures and motions of which pictures are drawn."""

from functools import cache
from pathlib import Path

import numpy as np

from generator.contact.scene import Scene
from generator.motion_files import FigureMotion, motion_writer
from plots.figure_image import Body, View, draw_moments
from plots.framing import Size, bounds, frame_moments, scaled, view_from_options
from plots.picture import Subject, read_subject
from tests.motions import any_motion, shipped

NO_SCENE = Scene()


@cache
def standing(name: str = "prototype") -> Subject:
    return read_subject(name, None, None, ())


@cache
def swing() -> FigureMotion:
    return any_motion(shipped("pendulum"), np.linspace(0.1, 0.5, 9))


def moving() -> Subject:
    motion = swing()
    return Subject(Body.of_figure(motion.figure), None, motion, (), ())


def motion_file(folder: Path) -> Path:
    path = folder / "swing.action"
    motion_writer(path)(swing(), path)
    return path


def view_of(name: str) -> View:
    return view_from_options(name, None, None)


def drawn(subject: Subject, view: View, floor: float | None = None) -> np.ndarray:
    (poses,) = subject.moments(())
    strip = frame_moments([bounds(subject.body, poses, NO_SCENE, view)], view, floor)
    return draw_moments(subject.body, [poses], scaled(strip, 1, Size(120)), NO_SCENE)
