"""Bodies in contact against closed forms: impact, friction, rolling, tipping, and energy."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from math import degrees, pi, radians

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from generator import Recording
from plots import contact_cases as forms
from plots.canvas import BLACK, LINE_STYLES, LineStyle, Look, create_canvas, draw_line
from plots.contact_cases import BODY, FIRM, GRAVITY, MASS, ContactCase
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
        slides = (self.creeping, self.slipping, self.stopping, self.beginning, self.balls)
        listed = [case for group in (self.impacts, self.peaks, *slides) for case in group.values()]
        return (*listed, *self.rod, self.resting)

    @property
    def runs(self) -> tuple[Recording, ...]:
        """All runs."""
        return (*(case.run for case in (*self.all, *self.turned.values())), self.tumbling)


def simulate_cases() -> Cases:
    """Simulate all motions."""
    turned = partial(forms.ball_on_incline, turned_gravity=True)
    return Cases(
        impacts={key: forms.rebound(*key) for key in product(DAMPINGS, IMPACT_SPEEDS, STIFFNESSES)},
        peaks={speed: forms.elastic_peak(speed) for speed in IMPACT_SPEEDS},
        creeping={slope: forms.creeping_block(radians(slope)) for slope in CREEP_SLOPES},
        slipping={slope: forms.slipping_block(radians(slope)) for slope in SLIP_SLOPES},
        balls={slope: forms.ball_on_incline(radians(slope)) for slope in BALL_SLOPES},
        turned={slope: turned(radians(slope)) for slope in BALL_SLOPES},
        stopping={speed: forms.stopping_block(speed) for speed in SLIDING_SPEEDS},
        beginning={speed: forms.ball_begins_to_roll(speed) for speed in SLIDING_SPEEDS},
        rod=forms.tipping_rod(ROD_START, ROD_ANGLES),
        resting=forms.resting_block(),
        tumbling=forms.tumbling_block(),
    )


_FRICTION_ANGLE = degrees(np.arctan(FIRM.friction))


def _claims(cases: Cases) -> Iterator[Claim]:
    limit, balls = degrees(forms.friction_angle_of_rolling(FIRM)), cases.balls
    turned = [
        replace(case, closed_form=balls[slope].measured) for slope, case in cases.turned.items()
    ]
    compared: Mapping[str, tuple[Iterable[ContactCase], float]] = {
        f"{len(cases.impacts)} impacts without gravity have the restitution that follows from "
        "damping and speed alone": (cases.impacts.values(), 1e-8),
        "The peak force of an impact without damping is that which stores the kinetic energy": (
            cases.peaks.values(),
            3e-4,
        ),
        f"Below the friction angle of {_FRICTION_ANGLE:.1f} deg a block creeps down an incline "
        "at the speed at which friction holds its weight": (cases.creeping.values(), 1e-4),
        f"From {min(cases.slipping):g} deg on it slips with g (sin - mu cos)": (
            cases.slipping.values(),
            3e-3,
        ),
        "A sliding block comes to rest after the stopping distance of its friction": (
            cases.stopping.values(),
            2e-3,
        ),
        "A sliding ball rolls in the end with 5/7 of its speed": (cases.beginning.values(), 1e-8),
        "A ball rolls down an incline with 5/7 g sin": (
            [case for slope, case in balls.items() if slope < limit],
            1e-6,
        ),
        "On a steeper one it slips with g (sin - mu cos)": (
            [case for slope, case in balls.items() if slope >= limit],
            1e-4,
        ),
        "A horizontal plane in turned gravity accelerates it as an inclined plane does": (
            turned,
            1e-6,
        ),
        "A rod that tips over its rounded foot has the rate of its energy": (cases.rod, 1e-3),
        "A block at rest is carried with its weight": ([cases.resting], 1e-6),
    }
    for sentence, (some, bound) in compared.items():
        largest = float(np.max([case.relative_error for case in some]))
        yield Claim(f"{sentence}: largest relative difference", largest, at_most=bound)
    run, exchanged = cases.tumbling, forms.exchanged_energy(cases.tumbling)
    sentence = (
        "A thrown block keeps the sum of its energies with those lost in impacts and "
        f"friction: largest change, of {exchanged:.3g} J exchanged"
    )
    yield Claim(sentence, float(np.ptp(run.energy_balance)), "J", at_most=1e-9 * exchanged)
    assert run.contact is not None
    gained = MASS * (run.velocities[BODY][-1, 3:] - run.velocities[BODY][0, 3:])
    weight = np.array([0.0, -MASS * GRAVITY * (run.times[-1] - run.times[0]), 0.0])
    gap = float(np.linalg.norm(gained - weight - run.contact.segments[BODY].impulse))
    sentence = "Its momentum changes by the impulses of the plane and of its weight: difference"
    yield Claim(sentence, gap, "N s", at_most=1e-9)
    differences = [one.agreement_with_exudyn for one in cases.runs]
    yield Claim(
        "In all these runs the accelerations are those of the Exudyn model: largest relative "
        "difference",
        float(np.max([np.nan if one is None else one for one in differences])),
        at_most=EXUDYN_AGREEMENT,
    )


def _draw(cases: Cases) -> Figure:
    figure = create_canvas(5.8)
    impact, creep, incline, stopping, rod, energy = figure.subplots(2, 3).flat
    ball, block, *_ = LINE_STYLES
    _draw_restitution(impact, cases)
    creep.set_yscale("log")
    slopes = np.linspace(2.0, 30.5, 200)
    _draw_closed(
        creep, slopes, lambda slope: 1e3 * forms.creep_speed(slope, FIRM), ball, np.radians
    )
    _draw_measured(creep, cases.creeping, ball, scale=1e3)
    creep.axvline(_FRICTION_ANGLE, color=BLACK, lw=1.0, ls=(0, (1, 1)))
    creep.set(title="block creeps", xlabel="slope [deg]", ylabel="speed [mm/s]")
    look: Look = {"rotation": 90, "transform": creep.transAxes, "fontsize": 7.0, "ha": "right"}
    creep.text(0.93, 0.04, "friction angle", **look)
    slopes, steep = np.linspace(0.0, 75.0, 151), np.linspace(_FRICTION_ANGLE, 50.0, 50)
    rolls, slips = (
        partial(forms.ball_acceleration, surface=FIRM),
        partial(forms.slip_acceleration, surface=FIRM),
    )
    _draw_closed(incline, slopes, rolls, ball, np.radians, "ball")
    _draw_closed(incline, steep, slips, block, np.radians, "block")
    _draw_measured(incline, cases.balls, ball)
    _draw_measured(incline, cases.slipping, block)
    incline.set(title="down an incline", xlabel="slope [deg]", ylabel="acceleration [m/s²]")
    incline.legend(loc="upper left", fontsize=7.0)
    speeds = np.linspace(0.0, 2.2, 100)
    _draw_closed(stopping, speeds, partial(forms.stopping_distance, surface=FIRM), ball)
    _draw_measured(stopping, cases.stopping, ball)
    stopping.set(title="block slides to rest", xlabel="initial speed [m/s]", ylabel="distance [m]")
    _draw_closed(
        rod, np.linspace(ROD_START, 0.3 * pi, 100), partial(forms.tipping_rate, ROD_START), ball
    )
    _draw_measured(rod, dict(zip(ROD_ANGLES, cases.rod, strict=True)), ball)
    rod.set(title="rod tips", xlabel="angle from the vertical [rad]")
    rod.set_ylabel("angular velocity [rad/s]")
    _draw_energy(energy, cases.tumbling)
    return figure


def _draw_restitution(axes: Axes, cases: Cases) -> None:
    for damping, pen in zip(DAMPINGS, LINE_STYLES, strict=False):
        closed, label = partial(forms.restitution, damping), f"a = {damping:g} s/m"
        _draw_closed(axes, np.linspace(0.02, 3.2, 100), closed, pen, label=label)
        for stiffness, marker, size in zip(STIFFNESSES, ("o", "."), (6.0, 4.0), strict=True):
            some = {speed: cases.impacts[damping, speed, stiffness] for speed in IMPACT_SPEEDS}
            _draw_measured(axes, some, LineStyle(pen.colour, "", marker), size)
    axes.set(title="impact", xlabel="speed of approach [m/s]", ylabel="restitution [1]")
    axes.set_ylim(0.0, 1.05)
    axes.legend(fontsize=7.0)


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


def _draw_closed(
    axes: Axes,
    at: Array,
    closed: Callable[[float], float],
    pen: LineStyle,
    convert: Callable[[Array], Array] = np.asarray,
    label: str = "_",
) -> None:
    """Draw a closed form over a parameter that is converted to its unit."""
    values = [closed(one) for one in convert(at).tolist()]
    axes.plot(at, values, pen.dash, color=pen.colour, lw=1.2, label=label)


def _draw_measured(
    axes: Axes,
    cases: Mapping[float, ContactCase],
    pen: LineStyle,
    size: float = 5.0,
    scale: float = 1.0,
) -> None:
    """Draw measured numbers over a parameter, in another unit by a scale."""
    fill = "white" if pen.marker != "." else pen.colour
    measured = [scale * case.measured for case in cases.values()]
    draw_line(axes, list(cases), measured, pen, ls="none", ms=size, mfc=fill)


def _tables(cases: Cases) -> dict[str, Mapping[str, Array]]:
    keys = np.array(list(cases.impacts))
    names = ("damping [s/m]", "speed [m/s]", "stiffness [N/m]")
    columns = {name: keys[:, k] for k, name in enumerate(names)}
    run = cases.tumbling
    kinds = ("kinetic", "gravity", "contact", "contact damping", "friction")
    return {
        "restitution": columns | _compared(cases.impacts.values(), "1"),
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


def _compared(cases: Collection[ContactCase], unit: str) -> dict[str, Array]:
    """Columns of measured numbers and closed forms."""
    return {
        f"measured [{unit}]": np.array([case.measured for case in cases]),
        f"closed form [{unit}]": np.array([case.closed_form for case in cases]),
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
