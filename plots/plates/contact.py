"""Bodies in contact against closed forms: impact, friction, rolling, tipping, and energy."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import degrees, pi, radians

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from generator import Recording
from plots.canvas import BLACK, LINE_STYLES, LineStyle, Look, create_canvas, draw_line
from plots.contact_cases import (
    BODY,
    FIRM,
    GRAVITY,
    MASS,
    ContactCase,
    ball_acceleration,
    ball_begins_to_roll,
    ball_on_incline,
    creep_speed,
    creeping_block,
    elastic_peak,
    exchanged_energy,
    friction_angle_of_rolling,
    rebound,
    resting_block,
    restitution,
    slip_acceleration,
    slipping_block,
    stopping_block,
    stopping_distance,
    tipping_rate,
    tipping_rod,
    tumbling_block,
)
from plots.plate import Claim
from plots.plate_definition import PlateDefinition
from springs.backends import Array

DAMPINGS = (0.5, 1.0, 2.0)
"""[s/m]"""

IMPACT_SPEEDS = (0.1, 1.0, 3.0)
"""[m/s]"""

STIFFNESSES = (3e4, 1e6)
"""[N/m]"""

CREEP_SLOPES = (5.0, 10.0, 20.0, 28.0, 30.0)
"""Slopes below the friction angle [deg]."""

SLIP_SLOPES = (35.0, 40.0, 45.0)
"""Slopes well above the friction angle [deg]."""

BALL_SLOPES = (10.0, 30.0, 60.0, 70.0)
"""Slopes on which a ball rolls, and one on which it slips [deg]."""

SLIDING_SPEEDS = (0.5, 1.0, 2.0)
"""[m/s]"""

ROD_START = 0.1
"""Angle of the rod from the vertical at rest [rad]."""

ROD_ANGLES = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.81)
"""Angles at which its rate is compared [rad]."""

EXUDYN_AGREEMENT = 1e-8
"""Largest relative difference of the accelerations from those of the Exudyn model."""

_CAPTION = (
    f"Bodies of {MASS:g} kg with one to eight contact spheres, free in space, simulated by the "
    "compiled integrator. Restitution without gravity [1], circles for a surface of 3e4 N/m, "
    "points for 1e6 N/m: it depends on damping and speed only. A block creeps down an incline "
    "below the friction angle of 31 deg, because friction is smooth at rest, and slips above it; "
    "a ball rolls up to 64.5 deg. A block that slides to rest goes as far as its friction lets "
    "it. The rod rolls over its rounded foot. The block thrown on the plane loses its energy in "
    "impacts and friction: the sum of all kinds is constant. "
)


@dataclass(frozen=True)
class Cases:
    """Simulated motions with their closed forms, by parameter.

    Attributes:
        impacts: impacts by damping [s/m], speed [m/s] and stiffness [N/m].
        peaks: largest forces of impacts without damping, by speed [m/s].
        creeping: creeping by slope [deg].
        slipping: slipping by slope [deg].
        balls: balls on inclined planes, by slope [deg].
        turned: the same balls on a horizontal plane in turned gravity.
        stopping: stopping by initial speed [m/s].
        beginning: ball that begins to roll, by initial speed [m/s].
        rod: rod in the order of `ROD_ANGLES`.
        resting: block at rest.
        tumbling: block that is thrown on the plane.
    """

    impacts: Mapping[tuple[float, float, float], ContactCase]
    peaks: Mapping[float, ContactCase]
    creeping: Mapping[float, ContactCase]
    slipping: Mapping[float, ContactCase]
    balls: Mapping[float, ContactCase]
    turned: Mapping[float, ContactCase]
    stopping: Mapping[float, ContactCase]
    beginning: Mapping[float, ContactCase]
    rod: Sequence[ContactCase]
    resting: ContactCase
    tumbling: Recording

    @property
    def all(self) -> tuple[ContactCase, ...]:
        """All cases with a closed form, in the order of the table."""
        groups = (
            self.impacts,
            self.peaks,
            self.creeping,
            self.slipping,
            self.stopping,
            self.beginning,
            self.balls,
        )
        listed = [case for group in groups for case in group.values()]
        return (*listed, *self.rod, self.resting)

    @property
    def runs(self) -> tuple[Recording, ...]:
        """All runs."""
        return (*(case.run for case in (*self.all, *self.turned.values())), self.tumbling)


def simulate_cases() -> Cases:
    """Simulate all motions."""
    return Cases(
        impacts={key: rebound(*key) for key in product(DAMPINGS, IMPACT_SPEEDS, STIFFNESSES)},
        peaks={speed: elastic_peak(speed) for speed in IMPACT_SPEEDS},
        creeping={slope: creeping_block(radians(slope)) for slope in CREEP_SLOPES},
        slipping={slope: slipping_block(radians(slope)) for slope in SLIP_SLOPES},
        balls={slope: ball_on_incline(radians(slope)) for slope in BALL_SLOPES},
        turned={
            slope: ball_on_incline(radians(slope), turned_gravity=True) for slope in BALL_SLOPES
        },
        stopping={speed: stopping_block(speed) for speed in SLIDING_SPEEDS},
        beginning={speed: ball_begins_to_roll(speed) for speed in SLIDING_SPEEDS},
        rod=tipping_rod(ROD_START, ROD_ANGLES),
        resting=resting_block(),
        tumbling=tumbling_block(),
    )


def _claims(cases: Cases) -> list[Claim]:
    friction_angle = degrees(np.arctan(FIRM.friction))
    rolling = {
        slope: case
        for slope, case in cases.balls.items()
        if radians(slope) < friction_angle_of_rolling(FIRM)
    }
    slipping = [case for slope, case in cases.balls.items() if slope not in rolling]
    exchanged = exchanged_energy(cases.tumbling)
    return [
        _claim(
            f"{len(cases.impacts)} impacts without gravity have the restitution that follows from "
            "damping and speed alone",
            cases.impacts.values(),
            1e-8,
        ),
        _claim(
            "The peak force of an impact without damping is that which stores the kinetic energy",
            cases.peaks.values(),
            3e-4,
        ),
        _claim(
            f"Below the friction angle of {friction_angle:.1f} deg a block creeps down an incline "
            "at the speed at which friction holds its weight",
            cases.creeping.values(),
            1e-4,
        ),
        _claim(
            f"From {min(cases.slipping):g} deg on it slips with g (sin - mu cos)",
            cases.slipping.values(),
            3e-3,
        ),
        _claim(
            "A sliding block comes to rest after the stopping distance of its friction",
            cases.stopping.values(),
            2e-3,
        ),
        _claim(
            "A sliding ball rolls in the end with 5/7 of its speed", cases.beginning.values(), 1e-8
        ),
        _claim("A ball rolls down an incline with 5/7 g sin", rolling.values(), 1e-6),
        _claim("On a steeper one it slips with g (sin - mu cos)", slipping, 1e-4),
        Claim(
            "A horizontal plane in turned gravity accelerates it as an inclined plane does: "
            "largest relative difference",
            _largest(
                abs(turned.measured / cases.balls[slope].measured - 1.0)
                for slope, turned in cases.turned.items()
            ),
            at_most=1e-6,
        ),
        _claim("A rod that tips over its rounded foot has the rate of its energy", cases.rod, 1e-3),
        _claim("A block at rest is carried with its weight", [cases.resting], 1e-6),
        Claim(
            "A thrown block keeps the sum of its energies with those lost in impacts and "
            f"friction: largest change, of {exchanged:.3g} J exchanged",
            float(np.ptp(cases.tumbling.energy_balance)),
            "J",
            at_most=1e-9 * exchanged,
        ),
        Claim(
            "Its momentum changes by the impulses of the plane and of its weight: difference",
            _impulse_gap(cases.tumbling),
            "N s",
            at_most=1e-9,
        ),
        Claim(
            "In all these runs the accelerations are those of the Exudyn model: largest relative "
            "difference",
            _largest(_agreement(run) for run in cases.runs),
            at_most=EXUDYN_AGREEMENT,
        ),
    ]


def _claim(sentence: str, cases: Iterable[ContactCase], bound: float) -> Claim:
    """Bound the largest relative error of some cases."""
    return Claim(
        f"{sentence}: largest relative difference",
        _largest(case.relative_error for case in cases),
        at_most=bound,
    )


def _largest(values: Iterable[float]) -> float:
    """Largest value; nan if one is nan."""
    return float(np.max(list(values)))


def _agreement(run: Recording) -> float:
    return np.nan if run.agreement_with_exudyn is None else run.agreement_with_exudyn


def _impulse_gap(run: Recording) -> float:
    """Difference of momentum gained and impulses [N s]."""
    assert run.contact is not None
    gained = MASS * (run.velocities[BODY][-1, 3:] - run.velocities[BODY][0, 3:])
    weight = np.array([0.0, -MASS * GRAVITY * (run.times[-1] - run.times[0]), 0.0])
    return float(np.linalg.norm(gained - weight - run.contact.segments[BODY].impulse))


def _draw(cases: Cases) -> Figure:
    figure = create_canvas(5.8)
    panels: list[Axes] = list(figure.subplots(2, 3).flat)
    _draw_restitution(panels[0], cases)
    _draw_creep(panels[1], cases)
    _draw_acceleration(panels[2], cases)
    _draw_stopping(panels[3], cases)
    _draw_rod(panels[4], cases)
    _draw_energy(panels[5], cases.tumbling)
    return figure


def _draw_restitution(axes: Axes, cases: Cases) -> None:
    speeds = np.linspace(0.02, 3.2, 100)
    for damping, pen in zip(DAMPINGS, LINE_STYLES, strict=False):
        closed = [restitution(damping, speed) for speed in speeds.tolist()]
        axes.plot(speeds, closed, pen.dash, color=pen.colour, lw=1.2, label=f"a = {damping:g} s/m")
        for stiffness, marker, size in zip(STIFFNESSES, ("o", "."), (6.0, 4.0), strict=True):
            measured = [cases.impacts[damping, speed, stiffness] for speed in IMPACT_SPEEDS]
            _draw_measured(axes, IMPACT_SPEEDS, measured, LineStyle(pen.colour, "", marker), size)
    axes.set(
        title="impact", xlabel="speed of approach [m/s]", ylabel="restitution [1]", ylim=(0.0, 1.05)
    )
    axes.legend(fontsize=7.0)


def _draw_creep(axes: Axes, cases: Cases) -> None:
    slopes = np.linspace(2.0, 30.5, 200)
    closed = [1e3 * creep_speed(slope, FIRM) for slope in np.radians(slopes).tolist()]
    pen = LINE_STYLES[0]
    axes.semilogy(slopes, closed, color=pen.colour, lw=1.2)
    _draw_measured(axes, CREEP_SLOPES, cases.creeping.values(), pen, scale=1e3)
    axes.axvline(degrees(np.arctan(FIRM.friction)), color=BLACK, lw=1.0, ls=(0, (1, 1)))
    axes.set(title="block creeps", xlabel="slope [deg]", ylabel="speed [mm/s]")
    look: Look = {"rotation": 90, "transform": axes.transAxes, "fontsize": 7.0, "ha": "right"}
    axes.text(0.93, 0.04, "friction angle", **look)


def _draw_acceleration(axes: Axes, cases: Cases) -> None:
    ball, block = LINE_STYLES[0], LINE_STYLES[1]
    slopes = np.linspace(0.0, 75.0, 151)
    closed = [ball_acceleration(slope, FIRM) for slope in np.radians(slopes).tolist()]
    axes.plot(slopes, closed, ball.dash, color=ball.colour, lw=1.2, label="ball")
    steep = np.linspace(degrees(np.arctan(FIRM.friction)), 50.0, 50)
    closed = [slip_acceleration(slope, FIRM) for slope in np.radians(steep).tolist()]
    axes.plot(steep, closed, block.dash, color=block.colour, lw=1.2, label="block")
    _draw_measured(axes, BALL_SLOPES, cases.balls.values(), ball)
    _draw_measured(axes, SLIP_SLOPES, cases.slipping.values(), block)
    axes.set(title="down an incline", xlabel="slope [deg]", ylabel="acceleration [m/s²]")
    axes.legend(loc="upper left", fontsize=7.0)


def _draw_stopping(axes: Axes, cases: Cases) -> None:
    pen = LINE_STYLES[0]
    speeds = np.linspace(0.0, 2.2, 100)
    closed = [stopping_distance(speed, FIRM) for speed in speeds.tolist()]
    axes.plot(speeds, closed, color=pen.colour, lw=1.2)
    _draw_measured(axes, SLIDING_SPEEDS, cases.stopping.values(), pen)
    axes.set(title="block slides to rest", xlabel="initial speed [m/s]", ylabel="distance [m]")


def _draw_rod(axes: Axes, cases: Cases) -> None:
    pen = LINE_STYLES[0]
    angles = np.linspace(ROD_START, 0.3 * pi, 100)
    closed = [tipping_rate(ROD_START, angle) for angle in angles.tolist()]
    axes.plot(angles, closed, color=pen.colour, lw=1.2)
    _draw_measured(axes, ROD_ANGLES, cases.rod, pen)
    axes.set(
        title="rod tips", xlabel="angle from the vertical [rad]", ylabel="angular velocity [rad/s]"
    )


def _draw_energy(axes: Axes, run: Recording) -> None:
    kinds = {
        "kinetic": run.energy["kinetic"],
        "gravity": run.energy["gravity"] - run.energy["gravity"].min(),
        "impacts": run.energy["contact damping"],
        "friction": run.energy["friction"],
    }
    for (label, energy), pen in zip(kinds.items(), LINE_STYLES, strict=False):
        axes.plot(run.times, energy, pen.dash, color=pen.colour, lw=1.2, label=label)
    total = np.sum(list(kinds.values()), axis=0) + run.energy["contact"]
    axes.plot(run.times, total, color=BLACK, lw=1.8, label="sum of all")
    axes.set(title="thrown block", xlabel="time [s]", ylabel="energy [J]")
    axes.set_ylim(0.0, 1.45 * float(total.max()))
    axes.legend(loc="upper right", ncols=2, fontsize=7.0)


def _draw_measured(
    axes: Axes,
    parameters: Sequence[float],
    cases: Iterable[ContactCase],
    pen: LineStyle,
    size: float = 5.0,
    scale: float = 1.0,
) -> None:
    """Draw measured numbers over a parameter, in another unit by a scale."""
    fill = "white" if pen.marker != "." else pen.colour
    measured = [scale * case.measured for case in cases]
    draw_line(axes, parameters, measured, pen, ls="none", ms=size, mfc=fill)


def _tables(cases: Cases) -> dict[str, Mapping[str, Array]]:
    keys = np.array(list(cases.impacts))
    names = ("damping [s/m]", "speed [m/s]", "stiffness [N/m]")
    columns = {name: keys[:, k] for k, name in enumerate(names)}
    run = cases.tumbling
    kinds = ("kinetic", "gravity", "contact", "contact damping", "friction")
    return {
        "restitution": columns | _compared(cases.impacts.values(), ""),
        "peak_force": _rows("speed [m/s]", cases.peaks, "N"),
        "creep": _rows("slope [deg]", cases.creeping, "m/s"),
        "slip": _rows("slope [deg]", cases.slipping, "m/s2"),
        "stopping": _rows("speed [m/s]", cases.stopping, "m"),
        "rolling": _rows("speed [m/s]", cases.beginning, "m/s"),
        "ball": _rows("slope [deg]", cases.balls, "m/s2"),
        "rod": _rows("angle [rad]", dict(zip(ROD_ANGLES, cases.rod, strict=True)), "rad/s"),
        "energy": {"time [s]": run.times, **{f"{kind} [J]": run.energy[kind] for kind in kinds}},
    }


def _rows(name: str, cases: Mapping[float, ContactCase], unit: str) -> dict[str, Array]:
    return {name: np.array(list(cases)), **_compared(cases.values(), unit)}


def _compared(cases: Iterable[ContactCase], unit: str) -> dict[str, Array]:
    """Columns of measured numbers and closed forms."""
    listed = list(cases)
    return {
        f"measured [{unit or 1}]": np.array([case.measured for case in listed]),
        f"closed form [{unit or 1}]": np.array([case.closed_form for case in listed]),
    }


contact = PlateDefinition(
    name="contact",
    title="Contact: closed forms",
    sign="Lines are closed forms, symbols simulated motions. Slopes are against the horizontal; "
    "velocities and accelerations are positive downhill and in the direction of sliding.",
    references=(
        "K. H. Hunt & F. R. E. Crossley, Coefficient of restitution interpreted as damping in "
        "vibroimpact, J. Appl. Mech. 42:440-445, 1975; doi:10.1115/1.3423596",
    ),
    collect=simulate_cases,
    caption=_CAPTION,
    draw=_draw,
    claims=_claims,
    tables=_tables,
)
