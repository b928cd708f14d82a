"""Energy of the falling prototype, and the error of the integrator."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from generator import Plan, Recording, read_figure, simulate
from generator.recording import ENERGY_KINDS
from plots.canvas import (
    BLACK,
    GREY,
    LINE_STYLES,
    THESIS_STYLE,
    LineStyle,
    create_panels,
    draw_line,
)
from plots.literature import thesis_reference
from plots.plate import Claim
from plots.plate_definition import PlateDefinition
from plots.whole_body import on_both_sides, posture_in_radians
from springs.backends import Array

STEP_SIZES = (2e-3, 1e-3, 5e-4)
"""Step sizes of the runs [s]."""

STOP_TIME, FRAME_INTERVAL = 1.5, 0.01
"""End and frame interval of every run [s]."""

_INITIAL_ANGLES: Mapping[str, tuple[float, ...]] = {
    "shoulder": (0.0, 20.0, 20.0),
    "hip_joint": (0.0, 5.0, 20.0),
    "elbow": (30.0,),
    "knee": (30.0,),
}
"""Initial angles of both sides, in the order of each joint's axes [deg].

No joint is at a breakpoint of its curve: the figure's own start has elbows and knees at the edge of
their dead zones.
"""

ENERGY_BOUND = 1e-4
"""Largest energy error relative to the energy exchanged, as docs/simulation.md states it."""

ERROR_RATIO_BOUNDS = (3.5, 4.5)
"""Bounds of the ratio of errors of two steps, one twice the other; 4 for small steps."""

_CAPTION = (
    "The prototype, bent and at rest, falls about its pinned pelvis without loads. Above: energies "
    "at the finest step. Below: error of their sum for three fixed steps, and the bound. Until the "
    "first joint reaches a breakpoint of its curve, such as the edge of a dead zone, the error is "
    "proportional to the square of the step. A step across a breakpoint adds an error that depends "
    "on the position of the breakpoint in the step, so that from there on halving the step divides "
    "the error by four only on average. Neither the thesis nor another source has energies to "
    "compare with: the reference is the conservation of energy."
)


@dataclass(frozen=True)
class Falls:
    """The same fall with several steps.

    Attributes:
        runs: runs by step [s].
        breakpoint_frame: last frame before a joint reaches a breakpoint of its curve.
    """

    runs: Mapping[float, Recording]
    breakpoint_frame: int

    @property
    def finest_run(self) -> Recording:
        """The run with the smallest step."""
        return self.runs[min(self.runs)]

    @property
    def exchanged_energy(self) -> float:
        """Range of the potential energy over the run plus the energy dissipated [J]."""
        energy = self.finest_run.energy
        return float(np.ptp(energy["gravity"] + energy["spring"]) + energy["dissipated"][-1])

    def energy_errors(self, step: float) -> Array:
        """Energy gained since the start, shape (n,) [J]."""
        balance = self.runs[step].energy_balance
        return balance - balance[0]

    def error_ratio(self, step: float, last: int | None = None) -> float:
        """Ratio of the largest errors with `step` and with half of it, up to a frame."""
        coarse, fine = (
            float(np.abs(self.energy_errors(size)[:last]).max()) for size in (step, 0.5 * step)
        )
        return coarse / fine


def simulate_falls() -> Falls:
    """Simulate the fall of the prototype with all step sizes."""
    body = read_figure("prototype")
    start = posture_in_radians(on_both_sides(_INITIAL_ANGLES))
    plans = {
        step: Plan(stop=STOP_TIME, frame=FRAME_INTERVAL, step=step, displacements=start)
        for step in STEP_SIZES
    }
    runs = {step: simulate(body, plan) for step, plan in plans.items()}
    return Falls(runs, _first_breakpoint_frame(runs[min(STEP_SIZES)]))


def _first_breakpoint_frame(run: Recording) -> int:
    """Index of the last frame before a spring's angle crosses a breakpoint of its law."""
    first, model = len(run.times), run.require_model()
    for name, joint in model.springs.joints.items():
        chain = model.figure.joints[name].chain
        for spring in joint.axes:
            if len(chain) == 1:
                along = float(np.dot(spring.direction, chain[0].axis))
                angle = along * run.displacements[name][:, 0]
            else:
                angle = run.rotation_vectors[name] @ np.array(spring.direction)
            for edge in {edge for law in spring.elastic for edge in law.breakpoints}:
                crossings = np.flatnonzero((angle[1:] - edge) * (angle[:-1] - edge) <= 0.0)
                first = min([first, *crossings.tolist()])
    return first


def _claims(falls: Falls) -> Iterator[Claim]:
    finest, exchanged = min(STEP_SIZES), falls.exchanged_energy
    mechanical = np.sum([falls.finest_run.energy[kind] for kind in ENERGY_KINDS[:3]], axis=0)
    crossing = falls.finest_run.times[falls.breakpoint_frame]
    yield Claim(
        f"With steps of {1e3 * finest:g} ms the energy error stays below 1e-4 of the energy "
        f"exchanged, {exchanged:.4g} J",
        float(np.abs(falls.energy_errors(finest)).max()),
        "J",
        at_most=ENERGY_BOUND * exchanged,
    )
    yield Claim(
        "Without loads the sum of kinetic, gravitational and spring energy never grows from "
        "one frame to the next",
        float(np.diff(mechanical).max()),
        "J",
        at_most=0.0,
    )
    yield Claim(
        "The dissipated energy never decreases",
        float(np.diff(falls.finest_run.energy["dissipated"]).min()),
        "J",
        at_least=0.0,
    )
    halved = "Halving the step from {:g} ms divides the largest energy error by"
    for step in STEP_SIZES[:-1]:
        yield Claim(
            f"{halved.format(1e3 * step)} 4, up to {crossing:.2f} s, when the first joint reaches "
            "a breakpoint of its curve",
            falls.error_ratio(step, falls.breakpoint_frame + 1),
            "",
            *ERROR_RATIO_BOUNDS,
        )
    for step in STEP_SIZES[:-1]:
        yield Claim(
            f"{halved.format(1e3 * step)} 2 at least, over the whole fall, breakpoints included",
            falls.error_ratio(step),
            at_least=2.0,
            remark="a step across a breakpoint has an error of its own; runs with a tolerance "
            "end their steps at the breakpoints",
        )


_LINE_STYLES: Mapping[str, LineStyle] = {
    "kinetic": LineStyle(LINE_STYLES[0].colour, "-"),
    "gravity": LineStyle(LINE_STYLES[1].colour, "--"),
    "spring": LineStyle(LINE_STYLES[2].colour, "-."),
    "dissipated": LineStyle(GREY, ":"),
}


def _draw(falls: Falls) -> Figure:
    times = falls.finest_run.times
    figure, ((upper,), (lower,)) = create_panels(6.4, 2, 1, (1.4, 1.0))
    for kind, pen in _LINE_STYLES.items():
        draw_line(upper, times, _energy_change(falls.finest_run, kind), pen, kind, lw=1.6)
    error = falls.energy_errors(min(STEP_SIZES))
    draw_line(upper, times, error, THESIS_STYLE, "sum: the error", lw=2.2)
    title = f"Exudyn, steps of {1e3 * min(STEP_SIZES):g} ms"
    upper.set(ylabel="change of energy [J]", title=title)
    upper.legend(loc="lower left", ncols=2)
    lower.set_yscale("log")
    for step, pen in zip(STEP_SIZES, LINE_STYLES, strict=False):
        error, label = np.abs(falls.energy_errors(step)), f"steps of {1e3 * step:g} ms"
        draw_line(lower, times[1:], error[1:], pen, label, marker="")
    bound = ENERGY_BOUND * falls.exchanged_energy
    lower.axhline(bound, color=BLACK, lw=1.0, ls=(0, (1, 1)), label=f"bound, {bound:.2g} J")
    time = float(times[falls.breakpoint_frame])
    for axes in (upper, lower):
        axes.axvline(time, color=GREY, lw=0.8)
        axes.annotate(
            " first breakpoint of a curve",
            (time, 1.0),
            xycoords=("data", "axes fraction"),
            va="top",
            fontsize=7.0,
            color=GREY,
        )
    lower.set(ylim=(1e-7, 1.0), ylabel="absolute error [J]", xlabel="time [s]")
    lower.legend(loc="lower right", ncols=4)
    return figure


def _energy_change(run: Recording, kind: str) -> Array:
    """Change of an energy since the start [J]."""
    return run.energy[kind] - run.energy[kind][0]


def _tables(falls: Falls) -> dict[str, dict[str, Array]]:
    time = {"time [s]": falls.finest_run.times}
    energies = {f"{kind} [J]": _energy_change(falls.finest_run, kind) for kind in ENERGY_KINDS}
    errors = {
        f"energy error, {1e3 * step:g} ms [J]": falls.energy_errors(step) for step in falls.runs
    }
    return {"energy": time | energies, "error": time | errors}


fall_energy = PlateDefinition(
    name="fall_energy",
    title="Energy of the falling prototype",
    sign="Energies of the whole figure, as changes since the start. The dissipated energy is that "
    "of damping, and only grows. The error is the sum of all changes: positive if energy is "
    "gained.",
    references=(thesis_reference("appendix A, the figure and its springs"),),
    collect=simulate_falls,
    caption=_CAPTION,
    draw=_draw,
    claims=_claims,
    tables=_tables,
)
