"""Motions that formats are tested with: what was simulated, and where its sites truly are."""

from functools import cache

import numpy as np

from generator import Plan, read_figure, simulate
from generator.figure import Figure
from generator.motion_files import FigureMotion, motion_from_recording
from tests.chains import BALL, at, body, chain, figure, ground, joint
from tests.paths import FIGURES

MOTIONS = ("prototype", "fourbar", "slides", "flying")
"""A human figure, a closed loop, a machine with slides, and a figure that nothing holds."""


def slides() -> Figure:
    """Slides outside and inside turns, a joint written the other way round, and a rigid one."""
    far = at((0.4, -0.7, 0.3), (0.1, -0.3, 0.2))
    return figure(
        [
            ground(rail=at((0.2, 0.1, -0.3), (0.5, 1.0, 0.0))),
            body("sledge", sites={"hook": far}),
            body("arm", mass=1.3, sites={"tip": at((-0.3, 0.9, 0.5), (0.02, 0.04, -0.03))}),
            body("rod", mass=0.4, sites={"end": at(shift=(0.0, 0.2, 0.6))}),
            body("cap", mass=0.1, sites={"top": at((0.1, 0.2, 0.3), (0.0, 0.1, 0.0))}),
        ],
        [
            joint(
                "rail", "ground.rail", "sledge.near", chain("Rx Tz"), (0.3, 0.1), damp=(0.1, 9.0)
            ),
            joint("swing", "arm.tip", "sledge.hook", BALL, (0.3, -0.2, 0.4)),
            joint("telescope", "arm.near", "rod.near", chain("Ts Ra"), (0.1, 0.2), damp=(7.0, 0.1)),
            joint("weld", "rod.end", "cap.near", ()),
        ],
    )


@cache
def clip(name: str) -> FigureMotion:
    """A motion of one second."""
    match name:
        case "slides":
            made = slides()
            return motion_from_recording(simulate(made, Plan(stop=1.0, tolerance=1e-4)), made)
        case "flying":
            made = read_figure(FIGURES / "prototype.fig")
            spun = {"lower_torso": (1.0, 2.0, -3.0, 0.5, 1.0, 0.2)}
            plan = Plan(stop=1.0, tolerance=1e-4, free_root=True, velocities=spun)
            return motion_from_recording(simulate(made, plan), made)
        case _:
            made = read_figure(FIGURES / f"{name}.fig")
            return motion_from_recording(simulate(made, Plan(stop=1.0, tolerance=1e-4)), made)


def ten_frames(motion: FigureMotion) -> list[int]:
    """The numbers of ten frames, the first and the last among them."""
    return np.linspace(0, motion.times.size - 1, 10).round().astype(int).tolist()


def site(motion: FigureMotion, segment: str, name: str, frames: list[int]) -> np.ndarray:
    """Places of a site in the world as they were simulated, shape (frames, 3) [m]."""
    pose = motion.figure.segments[segment].sites[name].pose_in_segment
    return (motion.poses[segment][frames] @ pose)[:, :3, 3]


def all_sites(motion: FigureMotion) -> list[tuple[str, str]]:
    """Every segment with each of its sites."""
    return [(s.name, name) for s in motion.figure.segments.values() for name in s.sites]
