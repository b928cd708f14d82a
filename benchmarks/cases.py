"""The falls that are compared: the prototype with its own springs, the reference figure, chains."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from benchmarks.passive_law import CurveLaw, PassiveLaw, RadialLaw
from benchmarks.tree import TreeModel, tree_model
from generator.figure import (
    AxisKind,
    Figure,
    Joint,
    JointAxis,
    Location,
    Segment,
    Site,
    SiteRef,
    Translation,
)
from generator.figure_file.read import read_figure

STOP = 1.0
"""Of every fall of a figure [s]."""

_SPRINGS = "prototype.springs.toml"

STANDING: Mapping[str, tuple[float, ...]] = {}
STRIDING = {
    "left_hip_joint": (5.0, 8.0, 40.0),
    "right_hip_joint": (-5.0, 4.0, -10.0),
    "left_knee": (50.0,),
    "right_knee": (15.0,),
    "right_elbow": (-30.0,),
    "left_shoulder": (10.0, 5.0, -20.0),
}
REACHING = {
    "waist": (5.0, 10.0, -8.0),
    "left_shoulder": (15.0, 40.0, -20.0),
    "right_shoulder": (10.0, 60.0, 10.0),
    "left_elbow": (30.0,),
    "right_elbow": (60.0,),
    "left_hip_joint": (5.0, -5.0, 15.0),
    "right_hip_joint": (-8.0, 10.0, 30.0),
    "left_knee": (95.0,),
    "right_knee": (70.0,),
}
POSES = {"standing": STANDING, "striding": STRIDING, "reaching": REACHING}
"""Starts of the prototype [deg], at rest; in the last a knee is beyond its dead zone."""

BENT = {
    "waist": (10.0, 20.0, -15.0),
    "root_torso": (5.0, -10.0, 8.0),
    "left_shoulder": (20.0, 40.0, -30.0),
    "right_shoulder": (-15.0, 25.0, 35.0),
    "right_elbow": (-40.0,),
    "left_elbow": (-25.0,),
    "right_hip_joint": (10.0, 15.0, -30.0),
    "left_hip_joint": (-10.0, 8.0, 25.0),
    "right_knee": (30.0,),
    "left_knee": (45.0,),
}


@dataclass(frozen=True)
class Case:
    """A figure, where it starts, and the law of its joints.

    Attributes:
        figure: as the program has it.
        displacements: of its joints at the start [rad].
        tree: the same for other engines.
        law: of the joints, for other engines.
        radial: the law, where it is one that all engines hold by themselves; else None.
    """

    figure: Figure
    displacements: Mapping[str, tuple[float, ...]]
    tree: TreeModel
    law: PassiveLaw
    radial: RadialLaw | None = None


def prototype(pose: str) -> Case:
    """The prototype with its own springs, in a pose of `POSES`."""
    figure = read_figure("prototype")
    start = _radians(POSES[pose])
    tree = tree_model(figure, start)
    return Case(figure, start, tree, CurveLaw.from_file(tree, figure, _SPRINGS))


def reference() -> Case:
    """The prototype, all joints bent, each with (20 + 60 a^2) r and 0.08 N m s/rad."""
    figure = read_figure("prototype")
    start, law = _radians(BENT), RadialLaw()
    return Case(figure, start, tree_model(figure, start), law, law)


def chain(count: int) -> Case:
    """Bars of 0.3 m and 1 kg on spherical joints with 20 N m/rad and 0.08 N m s/rad, level."""
    ground = Segment("ground", mass=-1.0, sites={"base": Site("base")})
    segments, joints = {"ground": ground}, {}
    last = SiteRef("ground", "base")
    factors = tuple(
        JointAxis(AxisKind.ROTATION, axis)
        for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    )
    for k in range(count):
        places = {"near": 0.0, "CM": 0.15, "far": 0.3}
        sites = {
            name: Site(name, Location((Translation((along, 0.0, 0.0)),)))
            for name, along in places.items()
        }
        bar, name = f"bar{k}", f"joint{k}"
        segments[bar] = Segment(bar, 1.0, (0.001, 0.008, 0.008), sites=sites)
        bend = tuple(0.1 * np.cos(1.3 * k + np.arange(3.0)))
        joints[name] = Joint(name, last, SiteRef(bar, "near"), factors, bend)
        last = SiteRef(bar, "far")
    figure = Figure(segments, joints, SiteRef("ground", "base"))
    law = RadialLaw(cubic=0.0)
    start = {name: joint.displacement for name, joint in joints.items()}
    return Case(figure, start, tree_model(figure), law, law)


def _radians(pose: Mapping[str, tuple[float, ...]]) -> dict[str, tuple[float, ...]]:
    return {name: tuple(np.radians(angles)) for name, angles in pose.items()}
