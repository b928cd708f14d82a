"""Motions that formats are tested with, simulated or not."""

from dataclasses import replace
from functools import cache

import numpy as np

from generator import Plan, read_figure, simulate
from generator.figure import Figure
from generator.kinematics.free_root import detach_root
from generator.motion_files import FigureMotion, motion_from_recording
from generator.motion_files.motion import Header, first_frame_interval
from generator.recording import Ending
from generator.rotations import Array
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
    """A simulated motion of 0.4 s, with its run."""
    made = slides() if name == "slides" else read_figure(FIGURES / f"{FILES.get(name, name)}.fig")
    plan = Plan(stop=0.4, tolerance=1e-4)
    if name == "flying":
        spun = {"lower_torso": (1.0, 2.0, -3.0, 0.5, 1.0, 0.2)}
        plan = replace(plan, free_root=True, velocities=spun)
    return motion_from_recording(simulate(made, plan), made)


FILES = {"flying": "prototype"}


def header_of(times: Array) -> Header:
    start, stop, frame = float(times[0]), float(times[-1]), first_frame_interval(times)
    return Header("leg.fig", None, start, stop, frame, "none", "weighted", Ending.DONE, "done")


EVEN_TIMES = np.array([0.0, 0.02, 0.04])


def any_motion(
    made: Figure, times: Array = EVEN_TIMES, seed: int = 0, *, is_free: bool = False
) -> FigureMotion:
    """A motion of any displacements, which was not simulated; with `is_free` nothing holds it."""
    joints = made.joints
    if is_free:
        joints = detach_root(made, start_of(made))[0].joints
    rng = np.random.default_rng(seed)
    chains = {name: one.chain for name, one in joints.items()}
    values = {name: rng.uniform(-7.0, 7.0, (len(times), len(c))) for name, c in chains.items()}
    return FigureMotion(made, header_of(times), chains, times, values)


def standing(made: Figure) -> FigureMotion:
    """Two frames of the pose in which a figure is drawn."""
    times = np.array([0.0, 0.02])
    chains = {name: one.chain for name, one in made.joints.items()}
    values = {name: np.array([start, start]) for name, start in start_of(made).items()}
    return FigureMotion(made, header_of(times), chains, times, values)


def start_of(made: Figure) -> dict[str, Array]:
    return {name: np.array(one.displacement, dtype=float) for name, one in made.joints.items()}


def bent(made: Figure) -> dict[str, Array]:
    """Displacements of 0.4 rad or m everywhere."""
    return {name: np.full(len(one.chain), 0.4) for name, one in made.joints.items()}


@cache
def shipped(name: str) -> Figure:
    return read_figure(FIGURES / f"{name}.fig")


def site(motion: FigureMotion, segment: str, name: str) -> Array:
    """Places of a site in the world, shape (frames, 3) [m]."""
    pose = motion.figure.segments[segment].sites[name].pose_in_segment
    return (motion.poses[segment] @ pose)[:, :3, 3]
