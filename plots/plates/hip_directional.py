"""Hysteresis of the hip: a slow cycle in Exudyn (the thesis's figure 4.7)."""

from dataclasses import dataclass, replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture

from generator import Plan, Recording, read_figure, simulate
from generator.figure import Figure, SiteRef
from generator.loads import LoadKind, TimedLoad
from plots.canvas import (
    BLUE,
    LINE_STYLES,
    PALE,
    THESIS_STYLE,
    Look,
    create_panels,
    draw_line,
    draw_points,
    draw_zero_line,
)
from plots.literature import YOON_MANSOUR, thesis_reference
from plots.plate import Claim
from plots.plate_definition import PlateDefinition
from springs import AxisSpring, Damping, JointSprings, SpringSet
from springs.backends import Array
from springs.elastic import describe_extrapolation
from springs.hysteresis import Hysteresis
from springs.published import tables as published
from springs.transformed import Transformed

_HIP = "left_hip_joint"
_PELVIS, _THIGH = "lower_torso", "left_upper_leg"
_PERIOD = 8.0
_FRAMES = 800
_STEP = 1e-3
_BRAKE_DAMPING = 10.0
"""Damping that limits the speed; subtracted from the measured torque [N m s/rad]."""


@dataclass(frozen=True)
class Cycle:
    """One cycle from the smallest angle and back, in n intervals between frames.

    Attributes:
        angle: hip flexion at the middle of each interval, shape (n,) [rad].
        angle_change: angle change over each interval, shape (n,) [rad].
        torque: passive torque on the thigh without the brake, shape (n,) [N m].
        dissipated_energy: dissipated energy of the joint in Exudyn's energy balance, without the
            brake [J].
    """

    angle: Array
    angle_change: Array
    torque: Array
    dissipated_energy: float

    @property
    def ends(self) -> tuple[float, float]:
        """Smallest and largest angle [rad]."""
        return float(self.angle.min()), float(self.angle.max())

    @property
    def energy_loss(self) -> float:
        """Area of the loop of torque against angle [J]; positive for a loss."""
        return -float(np.sum(self.torque * self.angle_change))

    def torque_on_branch(self, angles: Array, sign: int) -> Array:
        """Torque at angles [rad] while the angle increases (+1) or decreases (-1) [N m]."""
        chosen = np.flatnonzero(np.sign(self.angle_change) == sign)
        chosen = chosen[np.argsort(self.angle[chosen])]
        return np.interp(angles, self.angle[chosen], self.torque[chosen])


def drive_hip(law: Hysteresis, low: float, high: float) -> Cycle:
    """Drive the prototype's thigh slowly from about `low` to `high` [rad] and back.

    The thigh rotates on the fixed pelvis about its flexion axis, without gravity. The moment that
    drives it is a cosine between those that balance the law at both ends. The second of two cycles
    is returned. The passive torque is inertia times acceleration minus the drive: it comes from the
    motion, not from the law.
    """
    figure = _build_thigh_figure()
    spring = AxisSpring((0.0, 1.0, 0.0), (law,), Damping(viscous=_BRAKE_DAMPING))
    times = np.linspace(0.0, 2.0 * _PERIOD, 2 * _FRAMES + 1)
    least, most = -float(law.decreasing.torque(low)), -float(law.increasing.torque(high))
    swing = 0.5 * (most - least) * np.cos(2.0 * np.pi * times / _PERIOD)
    moments = [(0.0, moment, 0.0) for moment in (0.5 * (least + most) - swing).tolist()]
    load = TimedLoad(SiteRef(_THIGH, "proximal"), LoadKind.GLOBAL_MOMENT, times.tolist(), moments)
    plan = Plan(
        stop=2.0 * _PERIOD,
        frame=_PERIOD / _FRAMES,
        step=_STEP,
        springs=SpringSet({_HIP: JointSprings(_HIP, (spring,))}),
        gravity=(0.0, 0.0, 0.0),
        displacements={_HIP: (low,)},
        loads=(load,),
    )
    return _last_cycle(simulate(figure, plan), load)


def _build_thigh_figure() -> Figure:
    """Build the prototype's left thigh on its pelvis, the ground, with its flexion axis."""
    body = read_figure("prototype")
    hip = body.joints[_HIP]
    (flexion,) = (factor for factor in hip.chain if factor.axis == (0.0, 1.0, 0.0))
    revolute = replace(hip, chain=(flexion,), displacement=(0.0,), stiff=None, rest=None, damp=None)
    pelvis = replace(body.segments[_PELVIS], mass=-1.0)
    return Figure(
        {_PELVIS: pelvis, _THIGH: body.segments[_THIGH]},
        {_HIP: revolute},
        SiteRef(_PELVIS, "llateral"),
        body.attributes,
    )


def _last_cycle(run: Recording, load: TimedLoad) -> Cycle:
    """Evaluate the last cycle of a run."""
    times, angle = run.times, run.displacements[_HIP][:, 0]
    rate = run.velocities[_HIP][:, 0]
    fastest = int(np.argmax(np.abs(rate)))
    inertia = 2.0 * run.energy["kinetic"][fastest] / rate[fastest] ** 2
    driven = load.components(times)[:, 1]
    spans = np.diff(times)
    torque = (
        inertia * np.diff(rate) / spans - _midpoints(driven) + _BRAKE_DAMPING * _midpoints(rate)
    )
    braked = _BRAKE_DAMPING * float(np.sum((_midpoints(rate**2) * spans)[-_FRAMES:]))
    dissipated = run.energy["dissipated"]
    return Cycle(
        _midpoints(angle)[-_FRAMES:],
        np.diff(angle)[-_FRAMES:],
        torque[-_FRAMES:],
        float(dissipated[-1] - dissipated[-1 - _FRAMES]) - braked,
    )


def _midpoints(values: Array) -> Array:
    """Means of neighbours, shape (n - 1,)."""
    return 0.5 * (values[1:] + values[:-1])


CURVE_DISTANCE_RANGE = (5.0, 10.0)
"""Distance of the two curves according to the thesis [N m]."""

HYSTERESIS_WIDTH = 7.5
"""Middle of that range [N m]."""

MIN_ANGLE, MAX_ANGLE = 0.0, 80.0
"""Approximate hip angles between which the thigh is driven [deg]."""

_COMPARED_ANGLES = np.arange(10.0, 70.1, 1.0)
"""Hip angles away from both reversals [deg]."""

AREA_BOUND = 0.01
"""Tolerance of the loop's area relative to the energy lost.

At a reversal the moment changes from one curve to the other while the thigh creeps, which cuts the
corners of the loop.
"""

MEDIAN_BOUND = 8.0
"""The thesis's bound of the deviation from the median, in percent of the total range."""

_CAPTION = (
    "Yoon & Mansour measured two curves of the hip, 5 to 10 N m apart; their data are not public. "
    "The thesis's cubic is fitted to the curve of increasing extension. The curve of increasing "
    "flexion lies 7.5 N m below it here, the middle of the thesis's range. The loop is a slow "
    "cycle in Exudyn: a moment drives the prototype's thigh to and fro, and the joint torque "
    "follows from inertia, acceleration and drive, not from the law. The points of Silder et al., "
    "whose direction is unknown, substitute for a measured curve. Below: the loop minus the curve "
    "of its direction; they differ at the reversals only. Range of the thesis's curve: {known}."
)


def hysteresis_law() -> Hysteresis:
    """The thesis's cubic for increasing extension, and a lower one for increasing flexion."""
    thesis = published.curve("otani_1989/hip_y").law
    return Hysteresis(Transformed(thesis, constant=-HYSTERESIS_WIDTH), thesis)


def _claims(cycle: Cycle) -> list[Claim]:
    at = np.radians(_COMPARED_ANGLES)
    difference = cycle.torque_on_branch(at, -1) - cycle.torque_on_branch(at, +1)
    loss = hysteresis_law().cycle_loss(*cycle.ends)
    first, last = _COMPARED_ANGLES[[0, -1]]
    distance = f"difference of the two moments from {first:g} to {last:g} deg of hip flexion"
    return [
        Claim(f"Smallest {distance}", float(difference.min()), "N m", *CURVE_DISTANCE_RANGE),
        Claim(f"Largest {distance}", float(difference.max()), "N m", *CURVE_DISTANCE_RANGE),
        Claim("A cycle of the hip dissipates energy", cycle.energy_loss, "J", at_least=0.0),
        Claim(
            f"The area of the loop is that between the two curves, {loss:.2f} J",
            cycle.energy_loss,
            "J",
            (1.0 - AREA_BOUND) * loss,
            (1.0 + AREA_BOUND) * loss,
        ),
        Claim(
            "The area of the loop equals the energy dissipated by the joint in Exudyn: difference",
            100.0 * abs(cycle.dissipated_energy / cycle.energy_loss - 1.0),
            "%",
            at_most=100.0 * AREA_BOUND,
        ),
        Claim(
            "The median of both moments differs from either by less than 8 % of the total range, "
            "as the thesis expects",
            100.0 * 0.5 * float(difference.max()) / float(np.ptp(cycle.torque)),
            "%",
            at_most=MEDIAN_BOUND,
        ),
    ]


_BELOW: Look = {"ls": "--", "lw": 1.4}


def _draw(cycle: Cycle) -> Picture:
    both = hysteresis_law()
    angles = np.radians(np.arange(-10.0, 90.1, 0.5))
    at = np.degrees(angles)
    hip, silder = np.array(published.curve("silder_2007/hip_knee_15").printed.points).T
    inside = (hip >= at[0]) & (hip <= at[-1])
    figure, ((upper,), (lower,)) = create_panels(6.6, 2, 1, (3.0, 1.0))
    for law, label, look in (
        (both.decreasing, "thesis [1]: increasing extension", {"lw": 2.2}),
        (both.increasing, f"{HYSTERESIS_WIDTH:g} N m below: increasing flexion", _BELOW),
    ):
        draw_line(upper, at, np.asarray(law.torque(angles)), THESIS_STYLE, label, **look)
    order = np.append(np.arange(len(cycle.angle)), 0)
    loop = np.degrees(cycle.angle)
    upper.fill(loop, cycle.torque, color=PALE, lw=0.0)
    label = f"Exudyn, one cycle: {cycle.energy_loss:.1f} J lost"
    draw_line(upper, loop[order], cycle.torque[order], LINE_STYLES[0], label, markevery=25, lw=1.0)
    label = "substitute [3]: Silder, knee at 15 deg"
    draw_points(upper, hip[inside], silder[inside], LINE_STYLES[1], label)
    _mark_directions(upper, cycle)
    for sign, dash, name in ((-1, "-", "extension"), (+1, "--", "flexion")):
        chosen = np.sign(cycle.angle_change) == sign
        rest = np.where(chosen, cycle.torque - _curve_of_direction(cycle), np.nan)
        lower.plot(loop, rest, dash, color=BLUE, label=f"increasing {name}")
    for axes in (upper, lower):
        draw_zero_line(axes)
    upper.legend(loc="upper right")
    lower.legend(loc="upper center")
    upper.set_ylabel("hip moment [N m]")
    lower.set(ylabel="Exudyn - curve [N m]", xlabel="hip flexion [deg]")
    return figure


def _mark_directions(axes: Axes, cycle: Cycle) -> None:
    """Draw an arrow beside each branch of the loop."""
    for sign, start, word, offset in ((+1, 36.0, "flexing", -6.0), (-1, 56.0, "extending", 8.0)):
        ends = np.array([start, start + 16.0 * sign])
        (x0, x1), (y0, y1) = ends, cycle.torque_on_branch(np.radians(ends), sign) + offset
        arrow = {"arrowstyle": "-|>", "color": BLUE, "mutation_scale": 14.0, "lw": 1.4}
        axes.annotate("", (x1, y1), (x0, y0), arrowprops=arrow)
        place = (0.5 * (x0 + x1), 0.5 * (y0 + y1) + 0.2 * offset)
        axes.annotate(word, place, ha="center", va="top" if offset < 0.0 else "bottom", color=BLUE)


def _curve_of_direction(cycle: Cycle) -> Array:
    """Curve of the direction of motion in each interval of a cycle [N m]."""
    law, grows = hysteresis_law(), cycle.angle_change > 0.0
    sides = (np.asarray(one.torque(cycle.angle)) for one in (law.increasing, law.decreasing))
    return np.where(grows, *sides)


hip_directional = PlateDefinition(
    name="hip_directional",
    title="Hip moment towards flexion and extension (the thesis's figure 4.7)",
    sign="The moment acts on the thigh and is positive towards flexion: it resists where it is "
    "positive in extension and negative in flexion. Hip flexion is positive, 0 standing; in "
    "measurements the knee is at 15 deg.",
    references=(
        thesis_reference("section 4.2.4, figure 4.7 and appendix A"),
        YOON_MANSOUR,
        str(published.curve("silder_2007/hip_knee_15").reference),
    ),
    collect=lambda: drive_hip(hysteresis_law(), np.radians(MIN_ANGLE), np.radians(MAX_ANGLE)),
    caption=lambda cycle: _CAPTION.format(
        known=describe_extrapolation(published.curve("otani_1989/hip_y").valid_range, *cycle.ends)
    ),
    draw=_draw,
    claims=_claims,
    tables=lambda cycle: {
        "loop": {
            "hip flexion [deg]": np.degrees(cycle.angle),
            "direction": np.sign(cycle.angle_change),
            "Exudyn [N m]": cycle.torque,
            "curve of the direction [N m]": _curve_of_direction(cycle),
        }
    },
)
