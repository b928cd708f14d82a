"""Knee, elbow and leg of a person swinging freely, beside measured swings."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import radians

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from generator import Plan, read_figure, simulate
from generator.figure import Figure as Body
from generator.identification.swing import Swing
from generator.kinematics.placement import forward_kinematics
from generator.kinematics.tree import build_tree
from generator.rotations import matrix_from_rotation_vector
from plots.canvas import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    VERMILION,
    LineStyle,
    Look,
    create_canvas,
    draw_line,
    draw_outline,
    draw_range,
    draw_strip,
    draw_strip_labels,
    draw_zero_line,
)
from plots.figure_image import Body as Surfaces
from plots.figure_image import Poses, Strip, View
from plots.person_facts import person_facts
from plots.plate import Claim, incomparable_claim
from plots.plate_definition import PlateDefinition
from plots.whole_body import Posture, on_both_sides, posture_in_radians
from springs.backends import Array

FRAME_INTERVAL, TOLERANCE = 0.01, 1e-4
"""Interval between frames [s] and tolerance of the joint angles [rad]."""

SWING_AMPLITUDE = radians(2.0)
"""Amplitude beyond which a swing counts [rad]."""

GRAVITY = 9.81
"""[m/s2]"""


@dataclass(frozen=True)
class Case:
    """A person with its springs (None for those of the figure), and the style of its curves."""

    figure: str
    words: str
    springs: str | None
    style: LineStyle


MAN = Case("male50", "man", None, LineStyle(BLUE, "-"))
WOMAN = Case("female50", "woman", None, LineStyle(VERMILION, "--"))
RIENER = Case("male50", "man with Riener's leg", "riener", LineStyle(GREEN, "-."))
SITTING = Case("male50", "man, sitting", None, LineStyle("#CC79A7", ":"))
LIMP = Case("male50", "man without springs", "none", LineStyle(GREY, "--"))


@dataclass(frozen=True)
class Setup:
    """A joint that is released, everything else fixed.

    Attributes:
        joint: joint of the figure.
        axis: index of its displacement.
        start: displacement at the release [deg].
        down: direction of gravity in the axes of the standing figure.
        stop: end of the run [s].
        posture: posture of the other joints.
        turn: rotation vector that lays the figure as people lay [rad].
    """

    joint: str
    axis: int
    start: float
    down: tuple[float, float, float]
    stop: float
    posture: Posture = field(default_factory=dict[str, tuple[float, ...]])
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)


_HANGING = on_both_sides({"ankle": (0.0, -20.0)})
KNEE = Setup("left_knee", 0, 0.0, (0.0, 0.0, -1.0), 11.0, _HANGING, (-0.5 * np.pi, 0.0, 0.0))
"""Supine, the shank over the edge, the foot hanging; released with the knee straight."""


def seated_knee(hip: float) -> Setup:
    """Return `KNEE` with the thigh level and the trunk at an angle to it [deg]."""
    down = (0.0, -np.sin(radians(hip)), -np.cos(radians(hip)))
    posture = on_both_sides({"hip_joint": (0.0, 0.0, hip), "ankle": (0.0, -20.0)})
    return replace(KNEE, down=down, posture=posture, turn=(0.0, 0.0, 0.0))


HIPS = (60, 90)
"""Other hip angles at which the knee of a sitting person is released [deg]."""

_LEVEL_ARMS = on_both_sides({"shoulder": (0.0, 90.0, 0.0)})
ELBOW = Setup("left_elbow", 1, 0.0, (0.0, 0.0, 1.0), 4.0, _LEVEL_ARMS, (0.5 * np.pi, 0.0, 0.0))
"""Prone, the upper arm level to the side; released with the elbow straight."""

LEG = Setup("left_hip_joint", 2, 20.0, (0.0, -1.0, 0.0), 4.0)
"""Standing on the other leg; released with the hip flexed, the knee straight."""

SETUPS: Mapping[str, tuple[Setup, tuple[Case, ...]]] = {
    "knee": (KNEE, (MAN, WOMAN, RIENER)),
    "elbow": (ELBOW, (MAN,)),
    "leg": (LEG, (MAN, RIENER, LIMP)),
    "seated knee": (seated_knee(45.0), (SITTING,)),
    **{f"seated knee {hip}": (seated_knee(hip), (SITTING,)) for hip in HIPS},
}
"""Setups with the cases that are simulated."""


@dataclass(frozen=True)
class Swings:
    """Simulated swings by name of the setup and words of the case."""

    man: Body
    swings: Mapping[tuple[str, str], Swing]

    def swing(self, setup: str, case: Case) -> Swing:
        """Swing of a case."""
        return self.swings[setup, case.words]


def release(body: Body, setup: Setup, springs: str | None) -> Swing:
    """Simulate the swing of a joint with a choice of springs."""
    start = [0.0] * body.joints[setup.joint].degrees_of_freedom
    start[setup.axis] = radians(setup.start)
    x, y, z = setup.down
    plan = Plan(
        stop=setup.stop,
        frame=FRAME_INTERVAL,
        tolerance=TOLERANCE,
        spring_choice=springs,
        locked=tuple(name for name in body.joints if name != setup.joint),
        gravity=(GRAVITY * x, GRAVITY * y, GRAVITY * z),
        displacements={**posture_in_radians(setup.posture), setup.joint: tuple(start)},
    )
    run = simulate(body, plan)
    return Swing(
        run.times,
        run.displacements[setup.joint][:, setup.axis],
        run.velocities[setup.joint][:, setup.axis],
    )


def simulate_swings() -> Swings:
    """Simulate all swings."""
    bodies = {name: read_figure(name) for name in (MAN.figure, WOMAN.figure)}
    swings = {
        (name, case.words): release(bodies[case.figure], setup, case.springs)
        for name, (setup, cases) in SETUPS.items()
        for case in cases
    }
    return Swings(bodies[MAN.figure], swings)


def _caption(made: Swings) -> str:
    knees = ", ".join(
        f"{np.degrees(made.swing('knee', case).rest):.0f} deg ({case.words})"
        for case in SETUPS["knee"][1]
    )
    return (
        "One joint is released from rest, all others are fixed, and no muscle acts. Knee: lying on "
        "the back with the thigh level, as the fifty adults did, released straight. Elbow: lying "
        "face down, the upper arm level to the side, released straight; the abstract says prone, "
        "the rest is assumed. Leg: standing on the other one, the knee straight, the hip released "
        f"at {LEG.start:g} deg of flexion, which is assumed. Shaded: at rest; outlines: at the "
        "release and across from it. Circles: turning points of one adult's knee, at multiples of "
        "half its period. Grey bands: mean and standard deviation of the peaks of the rate. The "
        f"knee comes to rest at {knees} of flexion. Riener's leg has the springs of `--springs "
        "riener`. Sitting, the trunk is at 45 deg to the thigh, and the foot hangs at -20 deg, as "
        "it does lying. The damping ratio of the knee is that of the circles' later peaks, and the "
        "damping of the elbow was chosen with a view to the forty adults' index, which is "
        "therefore no test."
    )


def _claims(made: Swings) -> Iterator[Claim]:
    softer = "women's joints are softer even relative to their weight; the scale is that of men"
    for case in SETUPS["knee"][1]:
        reason = softer if case is WOMAN else ""
        yield from _knee_claims(case.words, made.swing("knee", case), reason)
    yield from _knee_claims(SITTING.words, made.swing("seated knee", SITTING))
    stiff = "the law was measured up to 80 deg of the hip, here 10 deg more upright than the trunk"
    for hip in HIPS:
        period = made.swing(f"seated knee {hip}", SITTING).period()
        words = f"Knee of the {SITTING.words}, hip at {hip} deg: period, mean of the first three"
        yield _compare("knee_period", words, period, stiff)
    yield from _elbow_claims(made.swing("elbow", MAN))
    yield from _leg_claims(made)


def _compare(key: str, sentence: str, measured: float, remark: str = "") -> Claim:
    """Compare a number with a fact, whose value the sentence states."""
    fact = person_facts().facts[key]
    return fact.compare(f"{sentence} (published: {fact.value_text})", measured, remark)


def _knee_claims(words: str, swing: Swing, reason: str = "") -> Iterator[Claim]:
    """Compare a knee; the reason explains what differs beside the rates."""
    for key, sentence, measured in (
        ("knee_ratio", "relaxation index", swing.relaxation_index),
        ("knee_period", "period, mean of the first three", swing.period()),
        ("knee_swings", "number of swings beyond 2 deg", swing.swings(SWING_AMPLITUDE)),
    ):
        yield _compare(key, f"Knee of the {words}: {sentence}", measured, reason)
    yield from _peak_claims("knee", words, swing)


def _peak_claims(joint: str, words: str, swing: Swing) -> Iterator[Claim]:
    own = float(np.degrees(abs(swing.start - swing.rest)))
    for place, name in enumerate(("first", "second")):
        key, peak = f"{joint}_{name}_velocity", float(swing.peak_rates[place])
        sentence = f"{joint.capitalize()} of the {words}: {name} peak of the rate"
        remark = (
            f"the peak is roughly proportional to the drop from start to rest, here {own:.0f} deg; "
            "the published peak belongs to about "
            f"{own * person_facts().facts[key].value / peak:.0f} deg, and the abstract states none"
        )
        yield _compare(key, sentence, peak, remark)


def _elbow_claims(swing: Swing) -> Iterator[Claim]:
    index = person_facts().facts["elbow_ratio"]
    yield incomparable_claim(
        f"Elbow of the man: relaxation index, here {swing.relaxation_index:.2f} (published: "
        f"{index.value_text})",
        "the damping was chosen between that of a model and that of these adults",
    )
    yield from _peak_claims("elbow", MAN.words, swing)


def _leg_claims(made: Swings) -> Iterator[Claim]:
    remark = "it was computed from the inertia of a leg under gravity; any stiffness raises it"
    for case in SETUPS["leg"][1]:
        frequency = 1.0 / made.swing("leg", case).period(1)
        words = f"Leg of the {case.words}: frequency of the first period"
        if case is LIMP:
            yield _compare("leg_frequency", words, frequency)
        else:
            fact = person_facts().facts["leg_frequency"]
            sentence = f"{words}, here {frequency:.3f} Hz (published: {fact.value_text})"
            yield incomparable_claim(sentence, remark)


_STRIP = Strip(
    View(turn=radians(65.0), tilt=radians(12.0)),
    spacing=2.3,
    left=-1.05,
    right=1.05,
    bottom=-1.05,
    top=0.95,
    floor=None,
    scale=110.0,
)

_PLACES = ("supine: knee", "prone: elbow", "standing: leg")


def _draw(made: Swings) -> Figure:
    figure = create_canvas(8.6)
    grid = figure.add_gridspec(4, 2, height_ratios=(1.0, 1.0, 1.0, 0.9))
    _draw_setups(figure.add_subplot(grid[0, :]), made)
    angles: list[Axes] = []
    for row, name, stop in ((1, "knee", 6.0), (2, "elbow", 4.0)):
        angle, rate = (figure.add_subplot(grid[row, column]) for column in range(2))
        _draw_angles(angle, _cases(made, name), name, stop)
        _draw_rates(rate, _cases(made, name), name)
        angles.append(angle)
    counts, turns = np.array(TRACE_TURNS).T
    look: Look = {"label": "one adult [2]", "zorder": 4}
    draw_line(angles[0], TRACE_HALF_PERIOD * counts, np.degrees(turns), _TRACE, **look)
    angles[0].set_ylim(-95.0, 150.0)
    angles[0].legend(loc="upper right", ncols=2, fontsize=6.5)
    leg = figure.add_subplot(grid[3, :])
    _draw_angles(leg, _cases(made, "leg"), "leg", LEG.stop)
    frequency = person_facts().facts["leg_frequency"].value
    for count in range(1, 4):
        leg.axvline(count / frequency, color=BLACK, lw=0.8, ls=":")
    box = {"facecolor": "white", "linewidth": 0.0, "pad": 1.0}
    place = (1.02 / frequency, leg.get_ylim()[0])
    leg.text(*place, "period of 0.64 Hz [5]", fontsize=7.0, va="bottom", bbox=box)
    for axes in (leg, *figure.axes[3:5]):
        axes.set_xlabel("time [s]")
    figure.align_ylabels([*angles, leg])
    return figure


def _draw_setups(axes: Axes, made: Swings) -> None:
    """Draw the figures at rest, with outlines at the release and across from it."""
    surfaces = Surfaces.of_figure(made.man)
    swings = [(SETUPS[name][0], made.swing(name, MAN)) for name in ("knee", "elbow", "leg")]

    def poses(angle: Callable[[Swing], float]) -> list[Poses]:
        return [_turned_poses(made.man, setup, angle(swing)) for setup, swing in swings]

    draw_strip(axes, _STRIP, surfaces, poses(lambda swing: swing.rest))
    draw_outline(axes, _STRIP, surfaces, poses(lambda swing: swing.start), BLACK, 0.7)
    across = poses(lambda swing: float(swing.turning_angles[0]))
    draw_outline(axes, _STRIP, surfaces, across, GREY, 0.7)
    draw_strip_labels(axes, _STRIP, _PLACES, fontsize=7.5)


def _turned_poses(body: Body, setup: Setup, angle: float) -> Poses:
    """Poses with the released joint at an angle [rad], turned about the hips as people lay."""
    angles = {
        name: np.radians(setup.posture.get(name, np.zeros(joint.degrees_of_freedom)))
        for name, joint in body.joints.items()
    }
    angles[setup.joint][setup.axis] = angle
    placed = forward_kinematics(build_tree(body), angles).poses
    centre, turn = np.eye(4), np.eye(4)
    centre[:3, 3] = -placed["lower_torso"][:3, 3]
    turn[:3, :3] = matrix_from_rotation_vector(np.array(setup.turn))
    return {name: turn @ centre @ pose for name, pose in placed.items()}


def _cases(made: Swings, panel: str) -> list[tuple[Case, Swing]]:
    """Cases that are drawn in the panels of a joint, with their swings."""
    setups = ("knee", "seated knee") if panel == "knee" else (panel,)
    return [(case, made.swing(name, case)) for name in setups for case in SETUPS[name][1]]


def _draw_angles(axes: Axes, swings: Sequence[tuple[Case, Swing]], name: str, stop: float) -> None:
    draw_zero_line(axes)
    for case, swing in swings:
        angles, label = swing.angles - swing.rest, case.words.removeprefix("man with ")
        draw_line(axes, swing.times, np.degrees(angles), case.style, label, lw=1.3)
    axes.set(xlim=(0.0, stop), ylabel=f"{name}: angle\nfrom rest [deg]")
    axes.legend(loc="upper right", fontsize=6.5)


_TRACE = LineStyle(BLACK, "none", "o")

TRACE_HALF_PERIOD = 0.55
"""Half of the period of the traced knee [s]."""

TRACE_TURNS = ((0, -1.06), (1, 0.94), (2, -0.53), (3, 0.60), (5, 0.38), (7, 0.26))
"""Half periods after the release, and angle from rest [rad], of the traced knee."""


_RATES_SHOWN, _RATES_END = 1.2, 1.4
"""End of the curves of rates, and of their time axes [s]."""


def _draw_rates(axes: Axes, swings: Sequence[tuple[Case, Swing]], name: str) -> None:
    facts = person_facts().facts
    draw_zero_line(axes)
    for key, sign in (("first", 1.0), ("second", -1.0)):
        fact = facts[f"{name}_{key}_velocity"]
        low, high = sorted((sign * fact.low, sign * fact.high))
        draw_range(axes, low, high)
        axes.axhline(sign * fact.value, xmax=_RATES_SHOWN / _RATES_END, color=BLACK, lw=0.8)
        look: Look = {"ha": "right", "va": "center", "fontsize": 7.0, "zorder": 3}
        axes.text(_RATES_END, sign * fact.value, f"{key}\npeak", **look)
    for case, swing in swings:
        shown = swing.times <= _RATES_SHOWN
        draw_line(axes, swing.times[shown], swing.rates[shown], case.style, lw=1.3)
    axes.set(xlim=(0.0, _RATES_END), ylabel=f"{name}: rate [rad/s]")


def _tables(made: Swings) -> dict[str, Mapping[str, Array]]:
    tables: dict[str, Mapping[str, Array]] = {}
    for name, (_, cases) in SETUPS.items():
        tables[name.replace(" ", "_")] = columns = {"time [s]": made.swing(name, cases[0]).times}
        for case in cases:
            swing = made.swing(name, case)
            columns[f"{case.words}: angle from rest [rad]"] = swing.angles - swing.rest
            columns[f"{case.words}: rate [rad/s]"] = swing.rates
    return tables


person_pendulums = PlateDefinition(
    name="person_pendulums",
    title="Knee, elbow and leg of a person as pendulums",
    sign="Angles are from the angle of rest, positive in flexion. The relaxation index is the "
    "first swing over the drop from start to rest: 2 without damping, 1 without overshoot.",
    references=person_facts().references(
        "kim_1996", "knee_trace", "child_trace", "son_1993", "doke_2005"
    ),
    collect=simulate_swings,
    caption=_caption,
    draw=_draw,
    claims=_claims,
    tables=_tables,
)
