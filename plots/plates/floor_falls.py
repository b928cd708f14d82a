"""Falls of the free prototype on a floor from ten starts, beside engines with their own contact."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from generator import Plan, read_figure, simulate
from generator.contact.scene import Scene, floor_prop
from plots.canvas import BLACK, GREY, LINE_STYLES, PALE, LineStyle, Look, create_canvas, draw_line
from plots.literature import OWN_ENGINE, Measurements, read_measurements
from plots.plate import Claim, comparison, table_name
from plots.plate_definition import PlateDefinition
from springs.backends import Array
from springs.published.reference import Reference, Sureness

COLLAPSE = "collapse"
"""Name of the fall without a push in the tables."""

HEIGHT_TOLERANCE = 2e-3
"""Largest difference of a run made now from the stored heights before the first impacts [m]."""

COMPARED_TIME = 0.4
"""Time until which a run made now is compared [s]."""

HIP_FORCE = Reference(
    "K.-t. Lim & W. J. Choi, Effect of fall characteristics on the severity of hip impact during a "
    "fall on the ground from standing height, Osteoporos. Int. 31, 2020",
    Sureness.PAGE,
    place="abstract",
)
HIP_FORCE_MEAN, HIP_FORCE_SD = 4.0, 1.7
"""Force on the hip of 20 people, estimated for rigid ground [kN]."""

SMOOTHED_FORCE = "largest force, 10 ms mean [N]"
SMOOTHED_HIP_FORCE = "largest hip force, 10 ms mean [N]"
PEAK_FORCE = "largest force [N]"
PEAK_HIP_FORCE = "largest hip force [N]"
CARRIED = "carried at rest [m g]"


@dataclass(frozen=True)
class Quantity:
    """A number that is read off each fall, in the unit in which it is drawn."""

    header: str
    name: str
    description: str
    unit: str
    factor: float = 1.0
    remark: str = ""

    def read(self, table: Measurements) -> Array:
        """Its values, one for each start."""
        return self.factor * table.column(self.header)


QUANTITIES = (
    *(
        Quantity(f"COM {low} [s]", low, f"time until the centre of mass is {low}", "s")
        for low in ("below 0.6 m", "below 0.25 m")
    ),
    Quantity(
        "COM height at rest [m]",
        "height at rest",
        "height at rest",
        "m",
        remark="its surface is soft in the first 5 mm, and a figure at rest creeps flat",
    ),
    Quantity("drift [m]", "drift", "horizontal drift", "m"),
    Quantity(SMOOTHED_FORCE, "largest force", "largest force of the floor, 10 ms mean", "kN", 1e-3),
)
"""Quantities of the collapse that are compared."""

_CAPTION = (
    "The free prototype without muscles, with its own springs, falls from standing for 3 s. Ten "
    "starts differ by random angles of all joints (standard deviation 0.05 rad), the same in all "
    "engines. After the first impacts each model of contact has a trajectory of its own, so the "
    "distributions are compared. This program and Drake have the same contact spheres, stiffness "
    "and impact damping; MuJoCo has its own contact, with the convex hulls of the segments or the "
    "same spheres, and the time constant of its contact that is written beside them (20 ms is its "
    "default). Friction is 0.6 everywhere; no limb touches another. Above, left: heights in the "
    "collapse with the knees bent. Above, right: largest force on pelvis and a thigh when the "
    "figure stands straight and is pushed or leans to the left, beside the force that was "
    "estimated from falls of 20 people on a mat. Below: five numbers of the collapse. "
)


@dataclass(frozen=True)
class FallTables:
    """Numbers of the falls, heights over time, and starts."""

    falls: Measurements
    heights: Measurements
    starts: Measurements


def contacts(falls: Measurements) -> list[tuple[str, str]]:
    """Engines and their contacts, in the order of the table."""
    return list(dict.fromkeys((row["engine"], row["contact"]) for row in falls.rows))


def select_fall(falls: Measurements, fall: str, contact: tuple[str, str]) -> Measurements:
    """The starts of a fall with an engine and its contact."""
    return falls.select_rows(fall=fall, engine=contact[0], contact=contact[1])


def _rerun_claims(heights: Measurements, starts: Measurements) -> Iterator[Claim]:
    """Compare the first start, simulated now, with what is stored."""
    first = starts.select_rows(start="0")
    angles = {
        joint: tuple(first.select_rows(joint=joint).column("angle [rad]").tolist())
        for joint in first.values("joint")
    }
    scene = Scene((floor_prop((0.0, 1.0, 0.0)),))
    plan = Plan(stop=COMPARED_TIME, displacements=angles, free_root=True, height=0.0, scene=scene)
    run = simulate(read_figure("prototype"), plan)
    own = contacts(heights)[0]
    table = heights.select_rows(engine=own[0], contact=own[1])
    times = table.column("time [s]")
    early = times <= COMPARED_TIME
    now = np.interp(times[early], run.times, run.centre_of_mass[:, 1])
    yield Claim(
        f"The first collapse, simulated now, has the stored heights until {COMPARED_TIME:g} s: "
        "largest difference",
        float(np.abs(now - table.column("start 0 [m]")[early]).max()),
        "m",
        at_most=HEIGHT_TOLERANCE,
    )


def _claims(falls: Measurements) -> Iterator[Claim]:
    """Compare the means with those of the other engines and with the measured force."""
    own, *every = contacts(falls)
    others = [contact for contact in every if contact[0] != OWN_ENGINE]
    for quantity in QUANTITIES:
        values = np.concatenate(
            [quantity.read(select_fall(falls, COLLAPSE, contact)) for contact in others]
        )
        mean, spread = float(np.mean(values)), float(np.std(values, ddof=1))
        compared = comparison(
            f"Collapse, {quantity.description}: the mean of this program is within one standard "
            f"deviation of the mean of all falls in the other engines, {mean:.3g} {quantity.unit}",
            float(np.mean(quantity.read(select_fall(falls, COLLAPSE, own)))),
            quantity.unit,
            mean - spread,
            mean + spread,
        )
        yield replace(compared, remark=quantity.remark)
    for fall in _pushed_falls(falls):
        compared = comparison(
            f"Fall to the left ({fall}): the mean of the largest force on pelvis and a thigh is "
            f"within one standard deviation of what was estimated from falls of people, "
            f"{HIP_FORCE_MEAN:g} kN",
            float(np.mean(1e-3 * select_fall(falls, fall, own).column(PEAK_HIP_FORCE))),
            "kN",
            HIP_FORCE_MEAN - HIP_FORCE_SD,
            HIP_FORCE_MEAN + HIP_FORCE_SD,
        )
        yield replace(compared, remark=_LIMITS_OF_THE_PROTOTYPE)
    carried = select_fall(falls, COLLAPSE, own).column(CARRIED)
    yield Claim(
        "In the last 0.2 s of the ten collapses the floor carries the weight: largest difference "
        "from m g, relative",
        float(np.abs(carried - 1.0).max()),
        at_most=0.05,
    )


_LIMITS_OF_THE_PROTOTYPE = (
    "the prototype weighs 49 kg and does not brace itself; the stiffness of its segments is assumed"
)
"""Remark of its comparisons with falls of people."""


def _pushed_falls(falls: Measurements) -> list[str]:
    return [fall for fall in falls.values("fall") if fall != COLLAPSE]


def _draw(data: FallTables) -> Figure:
    falls = data.falls
    every = contacts(falls)
    styles = dict(zip(falls.values("engine"), LINE_STYLES, strict=False))
    figure = create_canvas(7.4)
    grid = figure.add_gridspec(2, 1, height_ratios=(1.2, 1.0))
    upper, lower = (figure.add_subfigure(grid[row, 0]) for row in range(2))
    _draw_heights(upper.add_subplot(1, 2, 1), data.heights, styles)
    _draw_hip_forces(upper.add_subplot(1, 2, 2), falls, styles)
    for number, quantity in enumerate(QUANTITIES, start=1):
        axes = lower.add_subplot(1, len(QUANTITIES), number)
        for row, contact in enumerate(every):
            values = quantity.read(select_fall(falls, COLLAPSE, contact))
            _draw_distribution(axes, values, row, styles[contact[0]])
        axes.set_title(f"collapse:\n{quantity.name}", fontsize=7.5)
        axes.set_xlabel(f"[{quantity.unit}]")
        _set_rows(axes, every, named=quantity is QUANTITIES[0])
    return figure


def _draw_heights(axes: Axes, heights: Measurements, styles: Mapping[str, LineStyle]) -> None:
    """Draw the heights of all starts, with the first contact of each engine."""
    for engine, style in styles.items():
        some = heights.select_rows(engine=engine)
        contact = some.values("contact")[0]
        table = some.select_rows(contact=contact)
        label = f"{engine}, {contact}"
        for header in (key for key in table.rows[0] if key.startswith("start ")):
            x, y = table.column("time [s]"), table.column(header)
            draw_line(axes, x, y, style, label, marker="", lw=0.7, alpha=0.8)
            label = "_"
    axes.set(ylim=(0.0, None), xlabel="time [s]", ylabel="height [m]")
    axes.set_title("collapse: height of the centre of mass", fontsize=8.0)
    axes.legend(loc="upper right", fontsize=7.0)


_ROW_OFFSETS = (-0.27, 0.0, 0.27)
"""Heights of the three falls to the left within a row."""


def _draw_hip_forces(axes: Axes, falls: Measurements, styles: Mapping[str, LineStyle]) -> None:
    """Draw the largest force on a hip in each fall to the left."""
    low, high = HIP_FORCE_MEAN - HIP_FORCE_SD, HIP_FORCE_MEAN + HIP_FORCE_SD
    axes.axvspan(low, high, color=PALE, alpha=0.7, lw=0.0, zorder=0.5)
    axes.axvline(HIP_FORCE_MEAN, color=GREY, lw=1.0, zorder=0.6)
    every = contacts(falls)
    for row, contact in enumerate(every):
        for offset, fall in zip(_ROW_OFFSETS, _pushed_falls(falls), strict=True):
            values = 1e-3 * select_fall(falls, fall, contact).column(PEAK_HIP_FORCE)
            _draw_distribution(axes, values, row + offset, styles[contact[0]])
            if row == 0:
                look: Look = {"ha": "right", "va": "center", "fontsize": 6.5}
                axes.annotate(fall, (0.99, offset), xycoords=("axes fraction", "data"), **look)
    axes.set_xscale("log")
    axes.set_xticks([1, 2, 4, 10, 20, 40], ["1", "2", "4", "10", "20", "40"])
    axes.minorticks_off()
    _set_rows(axes, every, named=True)
    axes.set_xlabel("largest force on pelvis and thigh [kN]")
    axes.set_title(
        f"three falls to the left; grey: estimated from falls\nof people [1], "
        f"{HIP_FORCE_MEAN:g} (SD {HIP_FORCE_SD:g}) kN",
        fontsize=7.5,
    )


def _draw_distribution(axes: Axes, values: Array, row: float, style: LineStyle) -> None:
    """Draw the values of ten starts on a row, with their mean and standard deviation."""
    mean, spread = float(np.mean(values)), float(np.std(values, ddof=1))
    look: Look = {"ls": "none", "ms": 3.5, "mfc": "none", "mew": 0.7, "alpha": 0.8}
    draw_line(axes, values, np.full(len(values), row), style, **look)
    axes.plot([mean - spread, mean + spread], [row, row], color=BLACK, lw=0.9)
    axes.plot([mean], [row], "|", color=BLACK, ms=9.0, mew=1.6)


def _set_rows(axes: Axes, every: list[tuple[str, str]], *, named: bool) -> None:
    """Name the rows, the first at the top."""
    names = [f"{engine}:\n{contact}" for engine, contact in every]
    axes.set_yticks(range(len(every)), names if named else [""] * len(every), fontsize=6.5)
    axes.set_ylim(len(every) - 0.5, -0.5)
    axes.grid(visible=False, axis="y")


def _tables(data: FallTables) -> dict[str, dict[str, Array]]:
    groups = data.falls.groups("fall", "engine", "contact").items()
    return {table_name(*cells): rows.numbers() for cells, rows in groups}


floor_falls = PlateDefinition(
    name="floor_falls",
    title="Falls on a floor in three engines, each with its own contact",
    sign="Heights are those of the centre of mass above the floor, forces normal to it. Each small "
    "mark is a fall, the upright dash the mean of ten, the line one standard deviation to each "
    "side. Below 0.6 m, 0.25 m: time at which the centre of mass is; at rest: mean of the last 0.2 "
    "s; drift: horizontal. The largest force in the collapse is averaged over 10 ms, that on "
    "pelvis and thigh, of the side with the larger one, is at any step.",
    references=(str(HIP_FORCE),),
    collect=lambda: FallTables(*map(read_measurements, ("falls", "falls_heights", "falls_starts"))),
    caption=lambda data: _CAPTION + data.falls.origin,
    draw=_draw,
    claims=lambda data: (*_rerun_claims(data.heights, data.starts), *_claims(data.falls)),
    tables=_tables,
)
