"""A fall of the prototype here, and of the files of it that MuJoCo and OpenSim read."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import radians

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from generator import Model, Plan, Recording, read_figure, read_springs, simulate
from generator.figure import Figure as Body
from generator.kinematics.placement import forward_kinematics
from generator.kinematics.tree import build_tree
from plots.canvas import (
    BLACK,
    BLUE,
    GREEN,
    PALE,
    VERMILION,
    LineStyle,
    Look,
    create_panels,
    draw_line,
    draw_outline,
    draw_strip,
    draw_strip_labels,
)
from plots.figure_image import Body as Surfaces
from plots.figure_image import Strip, View, poses_at
from plots.literature import Measurements, read_measurements, thesis_reference
from plots.plate import Claim
from plots.plate_definition import PlateDefinition
from plots.whole_body import posture_in_radians
from springs import SphericalLaw
from springs.backends import Array

RUN_TOLERANCE = 1e-6
"""Tolerance of the run made for the plate [rad]."""

CLAIM_TIME = 0.4
"""Time until which the fall of MuJoCo's file is claimed [s]."""

BOUND = 1e-4
"""Largest distance of a site [m]."""

START_ANGLES: Mapping[str, tuple[float, ...]] = {
    "right_hip_joint": (0.0, 0.0, 60.0),
    "left_hip_joint": (0.0, 0.0, -15.0),
    "left_shoulder": (0.0, 0.0, 110.0),
    "waist": (0.0, 0.0, 25.0),
}
"""Start of the fall, at rest, as in the benchmarks [deg]."""

MUJOCO, OUR_LAWS, OPENSIM = "MuJoCo", "MuJoCo, our laws", "OpenSim"
"""Programs in the table of motions; MuJoCo's file is under the law of coordinates."""

_STYLES = {
    MUJOCO: (LineStyle(VERMILION, "-", "s"), "MuJoCo, the file as it is"),
    OUR_LAWS: (LineStyle(GREEN, "-.", "^"), "MuJoCo, our laws in a callback"),
    OPENSIM: (LineStyle(BLUE, "--", "o"), "OpenSim, the file as it is"),
}

_MOMENTS = (0.0, 0.1, 0.2, 0.3, 0.4)
"""Times of the pictures [s]."""

_JOINTS = ("right_hip_joint", "left_shoulder", "waist", "right_knee")
"""Joints whose angles are drawn."""

_MARKED_FRAMES = 5
"""Frames between markers."""

_STRIP = Strip(
    View(turn=radians(-60.0), tilt=radians(8.0)),
    spacing=1.45,
    left=-0.75,
    right=0.75,
    bottom=-0.25,
    top=2.1,
    floor=None,
    scale=160.0,
)


@dataclass(frozen=True)
class Fall:
    """The falls here, and the displacements in the other programs at the same times.

    Attributes:
        body: the figure.
        conservative: its fall under the conservative law.
        coordinates: its fall under the law of coordinates.
        measured: displacements in the other programs.
    """

    body: Body
    conservative: Recording
    coordinates: Recording
    measured: Measurements

    @property
    def times(self) -> Array:
        """Times of the frames [s]."""
        return self.coordinates.times

    def run(self, program: str) -> Recording:
        """The fall here under the law of a program's springs."""
        return self.coordinates if program == MUJOCO else self.conservative

    @cached_property
    def poses(self) -> Mapping[str, Mapping[str, Array]]:
        """Poses of the segments by program, shape (n, 4, 4)."""
        tree = build_tree(self.body)
        found: dict[str, Mapping[str, Array]] = {}
        for program in self.measured.values("program"):
            rows = self.measured.select_rows(program=program)
            values = {
                name: np.stack(
                    [rows.column(f"{name}_{k + 1} [rad]") for k in range(len(joint.chain))], axis=-1
                )
                for name, joint in self.body.joints.items()
            }
            found[program] = forward_kinematics(tree, values).poses
        return found

    def distances(self, program: str) -> Array:
        """Largest distance of a site from its place here, by frame [m]."""
        run = self.run(program)
        return np.max(
            [
                np.linalg.norm((poses @ site - own @ site)[:, :3, 3], axis=-1)
                for name, segment in self.body.bodies.items()
                for poses, own in [(self.poses[program][name], run.poses[name])]
                for site in (site.pose_in_segment for site in segment.sites.values())
            ],
            axis=0,
        )

    def joint_angles(self, program: str, joint: str) -> Array:
        """Magnitude of a joint's rotation, by frame [deg]; "" is the law of coordinates here."""
        one = self.body.joints[joint]
        poses = self.coordinates.poses if program == "" else self.poses[program]
        turns = [
            (poses[ref.segment] @ self.body.site(ref).pose_in_segment)[:, :3, :3]
            for ref in (one.parent, one.child)
        ]
        between = np.swapaxes(turns[0], -1, -2) @ turns[1]
        trace = np.trace(between, axis1=1, axis2=2)
        return np.degrees(np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0)))


def simulate_fall() -> Fall:
    """Simulate the falls at the times of the table."""
    measured, body = read_measurements("exports_motion"), read_figure("prototype")
    times = measured.select_rows(program=MUJOCO).column("time [s]")
    plan = Plan(
        stop=float(times[-1]),
        frame=float(times[1]),
        tolerance=RUN_TOLERANCE,
        displacements=posture_in_radians(START_ANGLES),
    )
    springs = read_springs(None, body)
    conservative, coordinates = (
        simulate(Model(body, replace(springs, law=law)), plan)
        for law in (SphericalLaw.CONSERVATIVE, SphericalLaw.COORDINATES)
    )
    return Fall(body, conservative, coordinates, measured)


def _caption(fall: Fall) -> str:
    return (
        "The prototype hangs by its pelvis, one thigh raised by 60 deg and the other 15 deg back, "
        "an arm raised by 110 deg and the waist bent by 25 deg, and is released. The file of "
        "OpenSim is that of `mover convert prototype`, under the conservative law; that of MuJoCo "
        "has `--law coordinates`, as it can hold no other law of these balls. Each motion is "
        "compared with the one here under the same law. Above: five moments, the figure as it "
        "falls here and the outline of its fall in MuJoCo. Middle: the angles of four joints here "
        "(black) and in MuJoCo (orange). Below: the distance between the motions, on a "
        "logarithmic scale; in MuJoCo the conservative law acts in a callback as well. "
        + fall.measured.origin
    )


def _claims(fall: Fall) -> Iterator[Claim]:
    until = fall.times <= CLAIM_TIME + 1e-9
    for program, words in (
        (OPENSIM, "in OpenSim by the file's own springs"),
        (MUJOCO, "in MuJoCo by the file's own springs"),
        (OUR_LAWS, "in MuJoCo with our laws in a callback"),
    ):
        distance = 1e3 * float(fall.distances(program)[until].max())
        place = "within 0.1 mm of its place here, simulated now"
        sentence = f"Until {CLAIM_TIME:g} s every site is, {words}, {place}"
        yield Claim(sentence, distance, "mm", at_most=1e3 * BOUND)


def _draw(fall: Fall) -> Figure:
    figure, panels = create_panels(7.8, 3, 1, (2.1, 1.0, 1.0))
    strip, angles, distance = (row[0] for row in panels)
    _draw_strip(strip, fall)
    _draw_angles(angles, fall)
    _draw_distances(distance, fall)
    for axes in (angles, distance):
        axes.grid(visible=False, axis="x")
        for time in _MOMENTS:
            axes.axvline(time, color=PALE, lw=0.8, zorder=0.5)
    distance.set(xlim=(0.0, float(fall.times[-1])), xlabel="time [s]")
    figure.align_ylabels([angles, distance])
    return figure


def _draw_strip(axes: Axes, fall: Fall) -> None:
    """Draw the moments; the panel does not share the times of those below."""
    frames = [int(np.argmin(np.abs(fall.times - time))) for time in _MOMENTS]
    surfaces = Surfaces.of_figure(fall.body)
    own, other = (poses_at(poses, frames) for poses in (fall.coordinates.poses, fall.poses[MUJOCO]))
    inner = axes.inset_axes((-0.08, 0.0, 1.1, 1.0))
    axes.set_axis_off()
    draw_strip(inner, _STRIP, surfaces, own)
    draw_outline(inner, _STRIP, surfaces, other, VERMILION, 0.9)
    draw_strip_labels(inner, _STRIP, (f"{time:.1f} s" for time in _MOMENTS), fontsize=7.5)
    handles = [
        Patch(color=tuple(surfaces.colours[0]), label="this program"),
        Line2D([], [], color=VERMILION, lw=1.2, label="MuJoCo, outline"),
    ]
    place: Look = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0)}
    inner.legend(handles=handles, ncols=2, fontsize=7.5, **place)


_ANGLE_LOOK: Look = {"lw": 0.9, "mfc": "none", "ms": 3.0}


def _draw_angles(axes: Axes, fall: Fall) -> None:
    mujoco, _ = _STYLES[MUJOCO]
    for joint, dash in zip(_JOINTS, ("-", "--", "-.", ":"), strict=True):
        label = joint.replace("_", " ").removesuffix(" joint")
        own = fall.joint_angles("", joint)
        axes.plot(fall.times, own, dash, color=BLACK, lw=1.2, label=label)
        look: Look = {"ls": dash, "markevery": _MARKED_FRAMES, **_ANGLE_LOOK}
        draw_line(axes, fall.times, fall.joint_angles(MUJOCO, joint), mujoco, **look)
    draw_line(axes, [], [], mujoco, "in MuJoCo", **_ANGLE_LOOK)
    axes.set(ylim=(0.0, 1.35 * axes.get_ylim()[1]), ylabel="angle [deg]")
    axes.legend(loc="upper center", fontsize=7.0, ncols=5)


def _draw_distances(axes: Axes, fall: Fall) -> None:
    axes.set_yscale("log")
    for program, (style, label) in _STYLES.items():
        distances = 1e3 * np.maximum(fall.distances(program)[1:], 1e-9)
        draw_line(axes, fall.times[1:], distances, style, label, markevery=_MARKED_FRAMES)
    axes.axhline(1e3 * BOUND, color=BLACK, lw=0.8)
    axes.text(fall.times[-1], 1.1e3 * BOUND, "0.1 mm ", ha="right", va="bottom", fontsize=7.0)
    axes.set(ylabel="largest distance\nof a site [mm]", ylim=(1e-4, 1e2))
    axes.set_yticks([1e-3, 1e-1, 1e1], ["0.001", "0.1", "10"])
    axes.legend(loc="upper center", fontsize=7.0, ncols=3)


exported_fall = PlateDefinition(
    name="exported_fall",
    title="The same fall here, in MuJoCo and in OpenSim",
    sign="The distance is the largest of any site of the figure between the motion here and that "
    "of the other program. The angle of a joint is the magnitude of its rotation vector.",
    references=(thesis_reference("appendix A, the figure and its springs"),),
    collect=simulate_fall,
    caption=_caption,
    draw=_draw,
    claims=_claims,
    tables=lambda fall: {
        "exported_fall": {
            "time [s]": fall.times,
            **{f"{name}: largest distance of a site [m]": fall.distances(name) for name in _STYLES},
        }
    },
)
