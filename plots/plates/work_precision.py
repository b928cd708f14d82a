"""Wall time against error in several engines, and its growth with the size of the figure."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import nan

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from generator import Plan, Recording, read_figure, simulate
from generator.run_options import Integrator
from plots.canvas import BLACK, GREY, LINE_STYLES, LineStyle, create_panels, draw_line
from plots.literature import OWN_ENGINE, Measurements, read_measurements
from plots.plate import Claim, ClaimKind, table_name
from plots.plate_definition import PlateDefinition
from springs.backends import Array

_COMPILED, _ONE_RUN, _WHOLE_CALL = "compiled", "compiled, one run", "compiled, whole call"
_EXUDYN, _EXUDYN_STEP = "Exudyn's integrator", "Exudyn's integrator, fixed step"
_PURPLE = LINE_STYLES[4].colour

RUN_TOLERANCES = (1e-3, 1e-5)
"""Tolerances of the runs made for the claims [rad]."""

MAX_STEPS = 200
"""Steps that one second of the prototype may take at the first tolerance."""

MAX_STEPS_RATIO = 2.0
"""Steps at the second tolerance over those at the first. The eighth root of the ratio of the
tolerances, for a method of order 8, is 1.78; one of order 2 needs 10."""

MAX_TIME_RATIO = 0.05
"""Integration time of the compiled method over that of Exudyn's integrator."""

_CAPTION = (
    "Left: one second of the reference figure, the prototype with (20 + 60 a^2) r and 0.08 N m "
    "s/rad in every joint, where a is the magnitude of the rotation vector r: all engines "
    "evaluate these springs natively except Pinocchio, which has none and is called from numpy "
    "and SciPy. This program represents them by six axis springs per spherical joint. Its "
    "compiled runs are repeated until two agree, and have an error estimate and 50 frames; one "
    "run has neither, as the runs of the other engines; the whole call has building, the "
    "comparison with Exudyn, energies and reactions in addition. Middle: one second of the "
    "prototype with its own springs, which only this program evaluates natively; the others call "
    "numpy, which takes most of their time. Right: 0.1 s of chains of bars on spherical joints "
    "with linear springs, in steps of 1 ms or to an accuracy of 1e-3. "
)

_METHOD_STYLES: Mapping[tuple[str, str], LineStyle] = {
    (OWN_ENGINE, _COMPILED): LineStyle(BLACK, "-", "o"),
    (OWN_ENGINE, _ONE_RUN): LineStyle(BLACK, ":", "^"),
    (OWN_ENGINE, _WHOLE_CALL): LineStyle(BLACK, "-.", "D"),
    (OWN_ENGINE, _EXUDYN): LineStyle(_PURPLE, "-", "o"),
    (OWN_ENGINE, _EXUDYN_STEP): LineStyle(_PURPLE, "--", "s"),
    ("MuJoCo", "RK4"): LINE_STYLES[0],
    ("MuJoCo", "RK4, split at corners"): LineStyle(LINE_STYLES[0].colour, ":", "s"),
    ("MuJoCo", "Euler"): LineStyle(LINE_STYLES[0].colour, "--", "v"),
    ("MuJoCo", "implicitfast"): LineStyle(LINE_STYLES[0].colour, "-.", "^"),
    ("OpenSim", "Runge-Kutta-Merson"): LINE_STYLES[1],
    ("OpenSim", "DOP853 of SciPy"): LINE_STYLES[1],
    ("Pinocchio", "DOP853 of SciPy"): LINE_STYLES[2],
    ("Drake", "Runge-Kutta 3"): LineStyle(GREY, "-", "D"),
}

_OWN_CHAIN = f"{OWN_ENGINE}, {_COMPILED}"


@dataclass(frozen=True)
class BenchmarkTables:
    """Measurements drawn by the plate."""

    costs: Measurements
    chains: Measurements
    startup: Measurements
    python_shares: Measurements


def cheapest_wall_time(costs: Measurements, target: float) -> float:
    """Wall time of the fastest run with an error of at most `target` [rad]; nan if none [s]."""
    fit = costs.column("wall [s]")[costs.column("error [rad]") <= target]
    return float(fit.min()) if fit.size else nan


def _claims(_: BenchmarkTables) -> list[Claim]:
    """Compare runs made now: steps are the method's matter, and times only as a ratio."""
    figure = read_figure("prototype")
    large, small = RUN_TOLERANCES
    plan = Plan(stop=1.0, frame=0.02, tolerance=large)
    coarse, fine, implicit = (
        simulate(figure, replace(plan, **changes))
        for changes in ({}, {"tolerance": small}, {"integrator": Integrator.EXUDYN})
    )
    return [
        Claim(
            f"One second of the prototype's fall to {large:g} rad takes no more than "
            f"{MAX_STEPS} steps, those of all runs counted",
            float(coarse.accuracy.steps),
            at_most=float(MAX_STEPS),
            kind=ClaimKind.SPEED,
        ),
        Claim(
            f"An accuracy {large / small:g} times as fine takes at most {MAX_STEPS_RATIO:.2g} "
            "times the steps, as of a method of high order",
            fine.accuracy.steps / coarse.accuracy.steps,
            at_most=MAX_STEPS_RATIO,
            kind=ClaimKind.SPEED,
        ),
        Claim(
            f"Integration to {large:g} rad takes at most {MAX_TIME_RATIO:g} of the "
            "wall time of Exudyn's integrator",
            coarse.wall_time / implicit.wall_time,
            at_most=MAX_TIME_RATIO,
            kind=ClaimKind.SPEED,
        ),
        Claim(
            f"The fall to {large:g} rad is that to {small:g} rad: largest "
            "difference of a joint's rotation",
            _largest_difference(coarse, fine),
            "rad",
            at_most=large,
        ),
        Claim(
            f"The fall to {small:g} rad is that of Exudyn's integrator to "
            f"{large:g} rad: largest difference of a joint's rotation",
            _largest_difference(implicit, fine),
            "rad",
            at_most=sum(RUN_TOLERANCES),
        ),
    ]


def _largest_difference(run: Recording, other: Recording) -> float:
    """Largest difference of displacements of revolute joints and of rotation vectors [rad]."""
    return max(
        float(np.abs(vectors - other.rotation_vectors[name]).max())
        if (vectors := run.rotation_vectors.get(name)) is not None
        else float(np.abs(displacements - other.displacements[name]).max())
        for name, displacements in run.displacements.items()
    )


def _ratios_text(data: BenchmarkTables) -> str:
    """The compiled method's stored cost over that of the others, in sentences."""
    reference = data.costs.select_rows(figure="reference")

    def ratio(target: float, engine: str, method: str) -> float:
        other = cheapest_wall_time(reference.select_rows(engine=engine, method=method), target)
        own = reference.select_rows(engine=OWN_ENGINE, method=_COMPILED)
        return cheapest_wall_time(own, target) / other

    listed = " and ".join(
        f"at {target:g} rad {ratio(target, 'MuJoCo', 'RK4'):.2g} (MuJoCo, RK4) and "
        f"{ratio(target, 'OpenSim', 'Runge-Kutta-Merson'):.2g} (OpenSim, Runge-Kutta-Merson)"
        for target in RUN_TOLERANCES
    )
    growth = data.chains.select_rows(method=_OWN_CHAIN).column("over half as many")
    default = data.python_shares.select_rows(figure="prototype").column("outside the compiled runs")
    startup = {row["engine"]: row for row in data.startup.rows}
    imports, builds = (
        float(startup[OWN_ENGINE][key]) / float(startup["OpenSim"][key])
        for key in ("import [s]", "build [s]")
    )
    return (
        "On the reference figure the ratios of the compiled method, which makes two runs side by "
        f"side, are {listed}. A chain twice as long takes up to {np.nanmax(growth):.2g} times as "
        f"long. Of the call for two seconds of the prototype {100.0 * default[0]:.0f} % of the CPU "
        f"time is spent outside the compiled runs. Importing takes {imports:.2g}, building "
        f"{builds:.2g} times as long as with OpenSim. "
    )


def _draw(data: BenchmarkTables) -> Figure:
    figure, ((left, middle, right),) = create_panels(4.8, 1, 3)
    named: set[str] = set()
    for axes, name, title in (
        (left, "reference", "reference figure, native springs"),
        (middle, "prototype", "prototype, its own curves"),
    ):
        for (engine, method), pen in _METHOD_STYLES.items():
            run = data.costs.select_rows(figure=name, engine=engine, method=method)
            if run.rows:
                label = f"{engine}, {method}"
                _draw_line(axes, run, "error [rad]", pen, "_" if label in named else label)
                named.add(label)
        axes.set_xscale("log")
        axes.invert_xaxis()
        axes.set_xlabel("error [rad]")
        axes.set_title(title, fontsize=8.0)
    left.set_ylabel("wall time [s]")
    for (engine, method), pen in _METHOD_STYLES.items():
        run = data.chains.select_rows(method=f"{engine}, {method}")
        if run.rows:
            _draw_line(right, run, "segments", pen)
    counts = data.chains.select_rows(method=_OWN_CHAIN).column("segments")
    right.set_xscale("log")
    right.set_xticks(counts, [f"{count:.0f}" for count in counts])
    right.minorticks_off()
    right.set_xlabel("segments of a chain")
    right.set_title("chains, 0.1 s", fontsize=8.0)
    figure.legend(loc="outside upper center", ncols=3, fontsize=6.5)
    return figure


def _draw_line(
    axes: Axes, run: Measurements, header: str, style: LineStyle, label: str = "_"
) -> None:
    draw_line(axes, run.column(header), run.column("wall [s]"), style, label, ms=3.0, lw=1.0)
    axes.set_yscale("log")


def _tables(data: BenchmarkTables) -> dict[str, dict[str, Array]]:
    tables: dict[str, dict[str, Array]] = {}
    for figure in data.costs.values("figure"):
        for engine, method in _METHOD_STYLES:
            run = data.costs.select_rows(figure=figure, engine=engine, method=method)
            if run.rows:
                columns = run.numbers("setting", "error [rad]", "wall [s]")
                tables[table_name(figure, engine, method)] = columns
    for (method,), run in data.chains.groups("method").items():
        tables[table_name("chains", method)] = run.numbers("segments", "wall [s]", "build [s]")
    return tables


work_precision = PlateDefinition(
    name="work_precision",
    title="Wall time against error",
    sign="Wall time is that of integration alone, except for the whole call, the best of several "
    "rounds of all runs of a kind; the error is the largest angle of R_a^T R_b over all joints at "
    "the end. The cost at an error is that of the fastest run with at most this error. Ratios are "
    "this program's cost over the other's.",
    collect=lambda: BenchmarkTables(
        *map(read_measurements, ("work_precision", "chains", "startup", "python_share"))
    ),
    caption=lambda data: _CAPTION + _ratios_text(data) + data.costs.origin,
    draw=_draw,
    claims=_claims,
    tables=_tables,
)
