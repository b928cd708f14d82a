"""Knee, elbow and leg of a person swinging freely, beside measured swings."""

# Matplotlib leaves the types of its keyword arguments open.
# pyright: reportUnknownMemberType=false

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import radians

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from generator import Plan, read_figure, simulate
from generator.figure import Figure as Body
from generator.kinematics.placement import forward_kinematics
from generator.kinematics.tree import build_tree
from generator.rotations import matrix_from_rotation_vector
from generator.scene import Scene
from plots.canvas import (
    BLACK,
    BLUE,
    PALE,
    VERMILION,
    LineStyle,
    add_footer,
    create_canvas,
    draw_zero_line,
    plot_style,
)
from plots.figure_image import SKIN, Poses, Strip, View, draw_moments
from plots.figure_image import Body as Surfaces
from plots.pendulum import Swing
from plots.person_facts import Fact, person_facts
from plots.plate import Claim, Plate
from plots.whole_body import Posture, on_both_sides, posture_in_radians
from springs.backends import Array

PERSONS = {"male50": "man", "female50": "woman"}
"""Words for the figures."""

FRAME_INTERVAL, TOLERANCE = 0.01, 1e-5
"""Interval between frames [s] and tolerance of the joint angles [rad]."""

SWING_AMPLITUDE = radians(2.0)
"""Amplitude beyond which a swing counts [rad]."""

GRAVITY = 9.81
"""[m/s2]"""


@dataclass(frozen=True)
class Setup:
    """A joint that is released, everything else fixed.

    Attributes:
        joint: of the figure.
        axis: index of its displacement.
        start: displacement at the release [deg].
        down: direction of gravity in the axes of the standing figure.
        stop: end of the run [s].
        posture: of the other joints.
        turn: rotation vector that lays the figure as it was measured [rad].
    """

    joint: str
    axis: int
    start: float
    down: tuple[float, float, float]
    stop: float
    posture: Posture = field(default_factory=dict[str, tuple[float, ...]])
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)


KNEE = Setup("left_knee", 0, 0.0, (0.0, 0.0, -1.0), 15.0, turn=(-0.5 * np.pi, 0.0, 0.0))
"""Supine, the shank over the edge; released with the knee straight."""

ELBOW = Setup(
    "left_elbow",
    0,
    0.0,
    (0.0, 0.0, 1.0),
    15.0,
    posture=on_both_sides({"shoulder": (0.0, 90.0, 0.0)}),
    turn=(0.5 * np.pi, 0.0, 0.0),
)
"""Prone, the upper arm level to the side; released with the elbow straight."""

LEG = Setup("left_hip_joint", 2, 15.0, (0.0, -1.0, 0.0), 15.0)
"""Standing on the other leg; released with the hip flexed by 15 deg, the knee straight."""

SETUPS: Mapping[str, Setup] = {"knee": KNEE, "elbow": ELBOW, "leg": LEG}


@dataclass(frozen=True)
class Swings:
    """Swings of the persons.

    Attributes:
        bodies: figures by name.
        swings: by names of person and setup.
    """

    bodies: Mapping[str, Body]
    swings: Mapping[tuple[str, str], Swing]


def release(body: Body, setup: Setup) -> Swing:
    """Simulate the swing of a joint."""
    from generator.simulation.equilibrium import find_equilibrium  # Exudyn takes its time

    start = [0.0] * body.joints[setup.joint].degrees_of_freedom
    start[setup.axis] = radians(setup.start)
    x, y, z = setup.down
    plan = Plan(
        stop=setup.stop,
        frame=FRAME_INTERVAL,
        tolerance=TOLERANCE,
        locked=tuple(name for name in body.joints if name != setup.joint),
        gravity=(GRAVITY * x, GRAVITY * y, GRAVITY * z),
        displacements={**posture_in_radians(setup.posture), setup.joint: tuple(start)},
    )
    run = simulate(body, plan)
    rest = find_equilibrium(body, plan).displacements[setup.joint][setup.axis]
    return Swing(
        run.times,
        run.displacements[setup.joint][:, setup.axis],
        run.velocities[setup.joint][:, setup.axis],
        float(rest),
    )


def simulate_swings() -> Swings:
    """Simulate the swings of all persons."""
    bodies = {name: read_figure(name) for name in PERSONS}
    swings = {
        (person, name): release(body, setup)
        for person, body in bodies.items()
        for name, setup in SETUPS.items()
    }
    return Swings(bodies, swings)


def person_pendulums() -> Plate:
    """Draw the plate."""
    return build_plate(simulate_swings())


_SOURCES = ("kim_1996", "knee_trace", "son_1993", "doke_2005")

_SIGN = (
    "Angles are from the angle of rest, positive in flexion. The relaxation index is the first "
    "swing over the drop from start to rest: 2 without damping, 1 without overshoot."
)


def build_plate(made: Swings) -> Plate:
    """Draw the plate of simulated swings."""
    references = person_facts().references(*_SOURCES)
    return Plate(
        name="person_pendulums",
        title="Knee, elbow and leg of a person as pendulums",
        caption=_caption(made),
        sign=_SIGN,
        figure=_draw(made, references),
        claims=tuple(_claims(made)),
        tables=_tables(made),
        references=references,
    )


def _caption(made: Swings) -> str:
    return (
        "One joint is released, all others are fixed, and no muscle acts. Knee: lying on the back, "
        "the shank over the edge, released straight. Elbow: lying face down, the upper arm level "
        "to the side, released straight; the abstract states no more than prone. Leg: standing, "
        "the knee straight, released with the hip flexed by 15 deg. Circles: turning points of one "
        "adult's knee, at multiples of half its period. Bands: published mean and standard "
        "deviation."
    )


def _claims(made: Swings) -> Iterator[Claim]:
    facts = person_facts().facts
    for person, word in PERSONS.items():
        for key, sentence, measured, remark in numbers(made, person):
            fact = facts[key]
            yield fact.compare(
                f"The {word}: {sentence} ({_published_text(fact)})", measured, remark
            )


def _published_text(fact: Fact) -> str:
    return f"published: {fact.value_text}"


def numbers(made: Swings, person: str) -> Iterator[tuple[str, str, float, str]]:
    """Yield fact, sentence, value and remark of each number of a person."""
    knee, elbow, leg = (made.swings[person, name] for name in SETUPS)
    yield "knee_ratio", "relaxation index of the knee", knee.relaxation_index, ""
    yield "knee_period", "period of the knee, mean of the first three", knee.period(), ""
    yield "knee_swings", "swings of the knee beyond 2 deg", knee.swings(SWING_AMPLITUDE), ""
    for key, place in (("first", 0), ("second", 1)):
        yield (
            f"knee_{key}_velocity",
            f"{key} peak of the knee's angular velocity",
            float(knee.peak_rates[place]),
            "",
        )
    yield "elbow_ratio", "relaxation index of the elbow", elbow.relaxation_index, ""
    for key, place in (("first", 0), ("second", 1)):
        yield (
            f"elbow_{key}_velocity",
            f"{key} peak of the elbow's angular velocity",
            float(elbow.peak_rates[place]),
            "",
        )
    yield "leg_frequency", "frequency of the swinging leg, first period", 1.0 / leg.period(1), ""


_STYLES = {"male50": LineStyle(BLUE, "-"), "female50": LineStyle(VERMILION, "--")}

_STRIP = Strip(
    View(turn=radians(65.0), tilt=radians(12.0)),
    spacing=2.2,
    left=-1.0,
    right=1.1,
    bottom=-1.05,
    top=0.95,
    floor=None,
    scale=110.0,
)

_PLACES = ("supine: the knee is released", "prone: the elbow is released", "standing: the leg is")


def _draw(made: Swings, references: tuple[str, ...]) -> Figure:
    with plot_style():
        figure = create_canvas(8.6)
        grid = figure.add_gridspec(4, 2, height_ratios=(1.0, 1.0, 1.0, 0.9))
        _draw_setups(figure.add_subplot(grid[0, :]), made.bodies["male50"])
        for row, name, stop in ((1, "knee", 6.0), (2, "elbow", 4.0)):
            angle = figure.add_subplot(grid[row, 0])
            rate = figure.add_subplot(grid[row, 1])
            _draw_angles(angle, made, name, stop)
            _draw_rates(rate, made, name)
        _draw_trace(figure.axes[1])
        leg = figure.add_subplot(grid[3, :])
        _draw_angles(leg, made, "leg", 8.0)
        _draw_leg_periods(leg)
        for axes in figure.axes[1:]:
            axes.set_xlabel("time [s]")
        figure.align_ylabels(figure.axes[1::2])
        add_footer(figure, _SIGN, references)
    return figure


def _draw_setups(axes: Axes, body: Body) -> None:
    """Draw the three postures at the release, as the figure lay."""
    axes.set_axis_off()
    moments = [_released_poses(body, setup) for setup in SETUPS.values()]
    image = draw_moments(Surfaces.of_figure(body, SKIN[:3]), moments, _STRIP, Scene())
    extent = (_STRIP.left, _STRIP.left + _STRIP.width(len(moments)), _STRIP.bottom, _STRIP.top)
    axes.imshow(image, extent=extent, interpolation="none")
    for place, text in enumerate(_PLACES):
        axes.text(place * _STRIP.spacing, _STRIP.top, text, ha="center", fontsize=7.5)


def _released_poses(body: Body, setup: Setup) -> Poses:
    tree = build_tree(body)
    angles = {
        name: np.radians(setup.posture.get(name, np.zeros(joint.degrees_of_freedom)))
        for name, joint in body.joints.items()
    }
    angles[setup.joint][setup.axis] = radians(setup.start)
    turn = np.eye(4)
    turn[:3, :3] = matrix_from_rotation_vector(np.array(setup.turn))
    placed = forward_kinematics(tree, angles).poses
    return {name: turn @ pose for name, pose in placed.items()}


def _draw_angles(axes: Axes, made: Swings, name: str, stop: float) -> None:
    draw_zero_line(axes)
    for person, word in PERSONS.items():
        swing, style = made.swings[person, name], _STYLES[person]
        axes.plot(
            swing.times,
            np.degrees(swing.angles - swing.rest),
            style.dash,
            color=style.colour,
            lw=1.3,
            label=f"{word}, rest at {np.degrees(swing.rest):.0f} deg",
        )
    axes.set_xlim(0.0, stop)
    axes.set_ylabel(f"{name}: angle from rest [deg]")
    axes.legend(loc="upper right", fontsize=7.0)


TRACE_START, TRACE_HALF_PERIOD = -1.06, 0.55
"""Release of the traced knee from its rest [rad], and half of its period [s]."""

TRACE_TURNS = ((1, 0.94), (2, -0.53), (3, 0.60), (5, 0.38), (7, 0.26))
"""Half periods after the release, and angle from rest [rad], of the traced knee."""


def _draw_trace(axes: Axes) -> None:
    points = [(0, TRACE_START), *TRACE_TURNS]
    axes.plot(
        [TRACE_HALF_PERIOD * count for count, _ in points],
        np.degrees([angle for _, angle in points]),
        "o",
        color=BLACK,
        mfc="white",
        ms=4.0,
        label="one adult [2]",
        zorder=4,
    )
    axes.legend(loc="upper right", fontsize=7.0)


def _draw_rates(axes: Axes, made: Swings, name: str) -> None:
    facts, sign = person_facts().facts, 1.0
    draw_zero_line(axes)
    for key in ("first", "second"):
        fact = facts[f"{name}_{key}_velocity"]
        spread = fact.spread or 0.0
        axes.axhspan(sign * (fact.value - spread), sign * (fact.value + spread), color=PALE, lw=0.0)
        axes.axhline(sign * fact.value, color=BLACK, lw=0.8)
        axes.text(1.49, sign * fact.value, f"{key} peak", ha="right", va="bottom", fontsize=7.0)
        sign = -1.0
    for person in PERSONS:
        swing, style = made.swings[person, name], _STYLES[person]
        axes.plot(swing.times, swing.rates, style.dash, color=style.colour, lw=1.3)
    axes.set_xlim(0.0, 1.5)
    axes.set_ylabel(f"{name}: rate [rad/s]")


def _draw_leg_periods(axes: Axes) -> None:
    """Mark whole periods of the published frequency."""
    fact = person_facts().facts["leg_frequency"]
    for count in range(1, 6):
        axes.axvline(count / fact.value, color=BLACK, lw=0.8, ls=":")
    axes.text(
        1.0 / fact.value, axes.get_ylim()[0], " periods of 0.64 Hz", fontsize=7.0, va="bottom"
    )


def _tables(made: Swings) -> dict[str, Mapping[str, Array]]:
    return {
        name: {
            "time [s]": made.swings["male50", name].times,
            **{
                f"{word}: {quantity}": values
                for person, word in PERSONS.items()
                for swing in [made.swings[person, name]]
                for quantity, values in (
                    ("angle from rest [rad]", swing.angles - swing.rest),
                    ("rate [rad/s]", swing.rates),
                )
            },
        }
        for name in SETUPS
    }
