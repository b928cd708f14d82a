"""Collapse of the standing prototype on a floor: reaction, height, energy, sensitivity."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import radians

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from generator import Plan, Recording, read_figure, simulate
from generator.contact.record import ContactRecord
from generator.contact.scene import Scene
from generator.figure import Figure as Body
from generator.kinematics.centre_of_mass import segment_masses
from generator.motion_files import motion_from_recording
from generator.rotations import matrix_from_rotation_vector, rotation_vector_from_matrix
from plots.canvas import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    PALE,
    VERMILION,
    Look,
    create_panels,
    draw_strip,
    draw_strip_labels,
)
from plots.figure_image import Body as Surfaces
from plots.figure_image import Strip, View, poses_at
from plots.literature import thesis_reference
from plots.plate import Claim
from plots.plate_definition import PlateDefinition
from plots.whole_body import centre_velocities, posture_in_radians
from springs.backends import Array

STOP_TIME, FRAME_INTERVAL, SHOWN_TIME = 4.0, 0.005, 2.0
"""End and frame interval of the run, and end of the time axes [s]."""

TOLERANCE, FINE_TOLERANCE = 1e-3, 1e-5
"""Tolerances of the run that is drawn and of its reference [rad]."""

ENERGY_BOUND, MOMENTUM_BOUND, AGREEMENT_BOUND, WEIGHT_BOUND = 1e-6, 1e-6, 1e-8, 1e-2
"""Bounds of relative errors: of energy, momentum, accelerations, and weight carried."""

HEIGHT_BOUND = 0.02
"""Bound of the change of the height from a start 0.001 rad off [m]."""

_INITIAL_ANGLES: Mapping[str, tuple[float, ...]] = {"left_knee": (10.0,), "right_knee": (20.0,)}
"""Initial angles that are not those of the figure [deg]."""

_MOMENTS = (0.0, 0.3, 0.5, 0.7, 0.9, 1.1, 1.5)
"""Times of the pictures [s]."""

_STRIP = Strip(
    View(turn=radians(-50.0), tilt=radians(12.0)),
    spacing=1.7,
    left=-0.6,
    right=1.0,
    bottom=-0.45,
    top=1.9,
    floor=(-1.6, 2.2),
    scale=120.0,
)

_GROUP_TIME = 0.08
"""Time between first contacts that share a mark [s]."""


@dataclass(frozen=True)
class Collapse:
    """A fall on a floor, with `TOLERANCE` and with `FINE_TOLERANCE`."""

    body: Body
    run: Recording
    fine_run: Recording

    @property
    def contact(self) -> ContactRecord:
        """Contact of the run that is drawn."""
        assert self.run.contact is not None, "the plan has a floor"
        return self.run.contact

    @property
    def sensitivity(self) -> Array:
        """Change of the joints from a start 0.001 rad off, shape (n,) [rad]."""
        assert self.contact.sensitivity is not None, "the run finished"
        return self.contact.sensitivity

    @property
    def weight(self) -> float:
        """Weight of the figure [N]."""
        return 9.81 * segment_masses(self.body).total

    @property
    def exchanged_energy(self) -> float:
        """Potential energy lost [J]."""
        return float(np.ptp(self.run.energy["gravity"]))

    @cached_property
    def errors(self) -> Array:
        """Largest rotation between the joints of both runs, shape (n,) [rad]."""
        fine, coarse = self.fine_run.rotation_vectors, self.run.rotation_vectors
        errors: list[Array] = []
        for name in fine:
            first, second = (matrix_from_rotation_vector(some[name]) for some in (fine, coarse))
            between = np.swapaxes(first, -1, -2) @ second
            errors.append(np.linalg.norm(rotation_vector_from_matrix(between), axis=-1))
        return np.max(errors, axis=0)

    @property
    def error_ratio(self) -> float:
        """Largest error over the estimate of the run."""
        estimate = self.run.accuracy.estimate
        return float("nan") if not estimate else float(self.errors.max() / estimate)

    @property
    def momentum_gap(self) -> float:
        """Change of momentum less the impulses of the floor and the weight, largest part [N s]."""
        floor = np.sum([one.impulse for one in self.contact.segments.values()], axis=0)
        fall = np.array([0.0, -self.weight * (self.run.times[-1] - self.run.times[0]), 0.0])
        motion = motion_from_recording(self.run)
        velocities = centre_velocities(motion, self.run.poses, self.run.velocities)
        masses = {name: segment.mass or 0.0 for name, segment in self.body.segments.items()}
        momentum = np.sum([masses[name] * linear for name, _, _, linear in velocities], axis=0)
        return float(np.abs(momentum[-1] - momentum[0] - floor - fall).max())


def simulate_collapse() -> Collapse:
    """Simulate the fall with both tolerances."""
    body = read_figure("prototype")
    plan = Plan(
        stop=STOP_TIME,
        frame=FRAME_INTERVAL,
        tolerance=TOLERANCE,
        certify=True,
        free_root=True,
        height=0.0,
        scene=Scene.floor(),
        displacements=posture_in_radians(_INITIAL_ANGLES),
    )
    fine = simulate(body, replace(plan, tolerance=FINE_TOLERANCE))
    return Collapse(body, simulate(body, plan), fine)


def _caption(fall: Collapse) -> str:
    contact = fall.contact
    parting_time = fall.run.times[int(np.argmax(fall.sensitivity > 0.1))]
    return (
        "The prototype stands on a floor, its left knee bent by 10 deg and its right one by 20 "
        "deg, and is released: its joints resist as its springs do, and no muscle holds it. From "
        "above: seven moments; the reaction of the floor, with the first contact of each segment; "
        "the height of the centre of mass; the energy, which moves from gravity into damping of "
        "the joints, damping of the contact and friction; the error of the joint angles, and how a "
        "start 0.001 rad off changes them. The largest force is "
        f"{contact.max_force / fall.weight:.1f} times the weight, at {contact.max_force_time:.2f} "
        f"s; the deepest penetration {1e3 * contact.max_depth:.0f} mm. From {parting_time:.1f} s "
        "on a start 0.001 rad off differs by more than 0.1 rad, so that "
        "the pose after the first impacts is one of many, whereas times, heights and sizes of "
        f"forces hold. Not shown: the run from {SHOWN_TIME:g} to {STOP_TIME:g} s, at rest. "
        "Stiffness, damping and friction of the floor are assumed."
    )


def _claims(fall: Collapse) -> list[Claim]:
    run, contact, exchanged = fall.run, fall.contact, fall.exchanged_energy
    assert contact.weight_carried is not None
    assert contact.height_sensitivity is not None
    return [
        Claim(
            "The sum of all energies stays constant to 1e-6 of the potential energy that is lost",
            float(np.abs(run.energy_balance - run.energy_balance[0]).max()),
            "J",
            at_most=ENERGY_BOUND * exchanged,
        ),
        Claim(
            "The momentum changes by the impulses of the floor and the weight, to 1e-6 of the "
            "impulse of the weight",
            fall.momentum_gap,
            "N s",
            at_most=MOMENTUM_BOUND * fall.weight * STOP_TIME,
        ),
        Claim(
            "The joint angles differ from those of a run with a tolerance of 1e-5 rad by at most "
            "the estimated error: largest difference over the estimate",
            fall.error_ratio,
            at_most=1.0,
        ),
        Claim(
            "The accelerations, contact included, are those of the Exudyn model: largest "
            "relative difference",
            float("nan") if run.agreement_with_exudyn is None else run.agreement_with_exudyn,
            at_most=AGREEMENT_BOUND,
        ),
        Claim(
            "Energy is only lost in damping and friction, at every frame: least gain of each",
            min(
                float(np.diff(run.energy[kind]).min())
                for kind in ("dissipated", "contact damping", "friction")
            ),
            "J",
            at_least=-1e-9 * exchanged,
        ),
        Claim(
            "At rest, in the last 0.2 s, the floor carries the weight",
            contact.weight_carried,
            "of the weight",
            1.0 - WEIGHT_BOUND,
            1.0 + WEIGHT_BOUND,
        ),
        Claim(
            "A start 0.001 rad off changes the height of the centre of mass by at most 20 mm",
            1e3 * float(np.abs(contact.height_sensitivity).max()),
            "mm",
            at_most=1e3 * HEIGHT_BOUND,
            remark="a property of the fall, which another start need not have",
        ),
    ]


_HEIGHTS = (1.3, 1.35, 0.75, 1.35, 1.1)
"""Relative heights of the panels."""


def _draw(fall: Collapse) -> Figure:
    figure, panels = create_panels(9.2, len(_HEIGHTS), 1, _HEIGHTS)
    strip, *below = (row[0] for row in panels)
    reaction, height, energy, error = below
    _draw_strip(strip, fall)
    _draw_reaction(reaction, fall)
    height.plot(fall.run.times, fall.run.centre_of_mass[:, 1], color=BLACK, lw=1.4)
    height.set(ylim=(0.0, None), ylabel="height of the\ncentre of mass [m]")
    _draw_energy(energy, fall)
    _draw_errors(error, fall)
    error.set(xlim=(0.0, SHOWN_TIME), xlabel="time [s]")
    for axes in below:
        for time in _MOMENTS:
            axes.axvline(time, color=PALE, lw=0.8, zorder=0.5)
        axes.grid(visible=False, axis="x")
    figure.align_ylabels(below)
    return figure


def _draw_strip(axes: Axes, fall: Collapse) -> None:
    """Draw the moments; the panel does not share the times of those below."""
    frames = [round(time / FRAME_INTERVAL) for time in _MOMENTS]
    inner = axes.inset_axes((-0.115, 0.0, 1.115, 1.0))
    axes.set_axis_off()
    draw_strip(inner, _STRIP, Surfaces.of_figure(fall.body), poses_at(fall.run.poses, frames))
    labels = replace(_STRIP, bottom=_STRIP.bottom + 0.08)
    draw_strip_labels(inner, labels, (f"{time:.1f} s" for time in _MOMENTS), fontsize=7.5)


def contact_groups(contact: ContactRecord) -> Iterator[tuple[float, list[str]]]:
    """Yield the first times and names of segments that touch at about the same time."""
    touched = sorted(
        (one.first_time, name)
        for name, one in contact.segments.items()
        if one.first_time is not None
    )
    group: list[str] = []
    start = 0.0
    for time, name in touched:
        if group and time - start > _GROUP_TIME:
            yield start, group
            group = []
        start = start if group else time
        group.append(name.replace("_", " "))
    if group:
        yield start, group


def _draw_reaction(axes: Axes, fall: Collapse) -> None:
    vertical = fall.contact.ground_reaction[:, 1] / fall.weight
    axes.plot(fall.run.times, vertical, color=BLUE, lw=1.2)
    axes.axhline(1.0, color=BLACK, lw=0.8, ls="--")
    axes.text(SHOWN_TIME, 1.0, "weight ", ha="right", va="bottom", fontsize=7.0)
    top = 1.55 * float(vertical.max())
    for time, names in contact_groups(fall.contact):
        axes.axvline(time, ymax=0.97, color=VERMILION, lw=0.8, ls=":")
        axes.plot([time], [0.0], "^", color=VERMILION, ms=4.0, clip_on=False, zorder=4)
        look: Look = {"va": "top", "fontsize": 6.5, "linespacing": 1.1, "color": VERMILION}
        axes.text(time + 0.008, 0.98 * top, "\n".join(names), **look)
    axes.set(ylim=(0.0, top), ylabel="vertical reaction\n/ body weight")


_LEGEND: Look = {"loc": "lower right", "fontsize": 6.5}

_STACK = (
    ("kinetic", BLUE, "kinetic"),
    ("gravity", "#A6CEE3", "gravity"),
    ("spring", GREEN, "springs of the joints"),
    ("contact", BLACK, "springs of the contact"),
    ("dissipated", "#F0E442", "lost in the joints"),
    ("contact damping", VERMILION, "lost in the contact"),
    ("friction", "#CC79A7", "lost in friction"),
)
"""Kind, colour and label of the energies, from below."""


def _draw_energy(axes: Axes, fall: Collapse) -> None:
    run = fall.run
    energies = [run.energy[kind] - run.energy[kind].min() for kind, _, _ in _STACK]
    _, colours, labels = zip(*_STACK, strict=True)
    look: Look = {"colors": colours, "labels": labels, "edgecolor": "white", "linewidth": 0.3}
    layers = axes.stackplot(run.times, energies, **look)
    total = np.sum(energies, axis=0)
    (line,) = axes.plot(run.times, total, color=BLACK, lw=1.0, label="sum: constant")
    axes.set(ylim=(0.0, 1.02 * float(total.max())), ylabel="energy [J]")
    handles = [line, *reversed(layers)]
    axes.legend(handles=handles, labelspacing=0.25, handlelength=1.2, **_LEGEND)


def _draw_errors(axes: Axes, fall: Collapse) -> None:
    times = fall.run.times
    for values, colour, dash, label in (
        (fall.sensitivity, VERMILION, "--", "change from a start 0.001 rad off"),
        (fall.run.accuracy.by_frame, GREY, ":", "estimated error of the run"),
        (fall.errors, BLUE, "-", f"its difference from a run with {FINE_TOLERANCE:g} rad"),
    ):
        axes.semilogy(times, np.maximum(values, 1e-12), dash, color=colour, lw=1.2, label=label)
    axes.axhline(TOLERANCE, color=BLACK, lw=0.8)
    axes.text(SHOWN_TIME, TOLERANCE, "tolerance ", ha="right", va="bottom", fontsize=7.0)
    axes.set(ylim=(1e-11, 10.0), ylabel="joint angles\n[rad]")
    axes.legend(labelspacing=0.25, **_LEGEND)


fall_on_floor = PlateDefinition(
    name="fall_on_floor",
    title="The standing prototype collapses on a floor",
    sign="The reaction is the vertical force of the floor on the whole figure, upwards positive, "
    "over its weight. Gravity's energy is zero at its lowest in the run. The error is the largest "
    "rotation between the joints of two runs.",
    references=(thesis_reference("appendix A, the figure and its springs"),),
    collect=simulate_collapse,
    caption=_caption,
    draw=_draw,
    claims=_claims,
    tables=lambda fall: {
        "fall_on_floor": {
            "time [s]": fall.run.times,
            "vertical reaction [N]": fall.contact.ground_reaction[:, 1],
            "height of the centre of mass [m]": fall.run.centre_of_mass[:, 1],
            **{f"{kind} [J]": values for kind, values in fall.run.energy.items()},
            "estimated error [rad]": fall.run.accuracy.by_frame,
            "difference from the fine run [rad]": fall.errors,
            "change from a start 0.001 rad off [rad]": fall.sensitivity,
        }
    },
)
