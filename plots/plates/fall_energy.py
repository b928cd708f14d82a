"""The energy of the prototype as it falls, and what of it the integrator loses."""

# Matplotlib leaves the types of its keyword arguments open.
# pyright: reportUnknownMemberType=false

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import radians

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from generator import Plan, Recording, read_figure, simulate
from generator.figure import Figure as Body
from generator.recording import ENERGY_KINDS
from generator.simulation.plan import resolve_springs
from plots.canvas import (
    BLACK,
    GREY,
    LINE_STYLES,
    THESIS_STYLE,
    LineStyle,
    add_footer,
    create_panels,
    plot_style,
)
from plots.plate import Claim, Plate
from springs import SpringSet
from springs.backends import Array
from springs.published import tables as published

STEP_SIZES = (2e-3, 1e-3, 5e-4)
"""Of the runs [s]."""

STOP_TIME, FRAME_INTERVAL = 1.5, 0.01
"""Of every run [s]."""

_INITIAL_ANGLES: Mapping[str, tuple[float, ...]] = {
    "shoulder": (0.0, 20.0, 20.0),
    "hip_joint": (0.0, 5.0, 20.0),
    "elbow": (30.0,),
    "knee": (30.0,),
}
"""The start on both sides, in the order of each joint's factors [deg].

All joints are away from the corners of their curves: the figure's own start has elbows and knees on
the edge of their dead zones.
"""

ENERGY_BOUND = 1e-4
"""Share of the energy exchanged; the bound that docs/simulation.md and its tests hold runs to."""

ERROR_RATIO_BOUNDS = (3.5, 4.5)
"""Bounds of the ratio of errors at two steps, one twice the other; 4 for small steps."""

_SIGN = (
    "Energies of the whole figure, as changes since the start. Dissipated is what damping has "
    "taken and only grows. The error is the sum of all changes: positive where energy is made."
)
_CAPTION = (
    "The prototype, bent and at rest, falls round its pinned pelvis; no load acts. Above: where "
    "its energy goes, at the finest step. Below: by how much the sum of all is off, for three "
    "fixed steps, and the bound. Until the first joint reaches a corner of its curve, such as the "
    "edge of a dead zone, the error falls with the square of the step. A step that crosses a "
    "corner adds an error that depends on where in the step the corner lies, so that from there on "
    "halving the step divides the error by four on average only. The thesis prints no energies, "
    "and nobody has measured any: the fall is held against the conservation of energy."
)


@dataclass(frozen=True)
class Falls:
    """The same fall at several steps.

    Attributes:
        runs: by step [s].
        breakpoint_frame: last frame before any joint reaches a corner of its curve.
    """

    runs: Mapping[float, Recording]
    breakpoint_frame: int

    @property
    def finest_run(self) -> Recording:
        """The run with the smallest step."""
        return self.runs[min(self.runs)]

    @property
    def exchanged_energy(self) -> float:
        """Range of the potential energies over the run, and what damping took [J]."""
        energy = self.finest_run.energy
        return float(np.ptp(energy["gravity"] + energy["spring"]) + energy["dissipated"][-1])

    def energy_errors(self, step: float) -> Array:
        """Energy made since the start, shape (n,) [J]."""
        balance = self.runs[step].energy_balance
        return balance - balance[0]

    def error_ratio(self, step: float, last: int | None = None) -> float:
        """Greatest error with `step` over that with half of it, up to a frame."""
        coarse, fine = (
            float(np.abs(self.energy_errors(one)[:last]).max()) for one in (step, 0.5 * step)
        )
        return coarse / fine


def simulate_falls() -> Falls:
    """Let the prototype fall."""
    body = read_figure("prototype")
    start = {
        name: tuple(map(radians, angles))
        for joint, angles in _INITIAL_ANGLES.items()
        for name in (f"left_{joint}", f"right_{joint}")
    }
    plans = {
        step: Plan(stop=STOP_TIME, frame=FRAME_INTERVAL, step=step, displacements=start)
        for step in STEP_SIZES
    }
    runs = {step: simulate(body, plan) for step, plan in plans.items()}
    springs = resolve_springs(body, plans[min(STEP_SIZES)])
    return Falls(runs, _first_breakpoint_frame(body, springs, runs[min(STEP_SIZES)]))


def fall_energy() -> Plate:
    """Draw the plate."""
    return build_plate(simulate_falls())


def build_plate(falls: Falls) -> Plate:
    """Draw the plate of these falls."""
    thesis = published.publication("otani_1989").reference
    references = (str(replace(thesis, place="appendix A, the figure and its springs")),)
    return Plate(
        name="fall_energy",
        title="Energy of the falling prototype",
        caption=_CAPTION,
        sign=_SIGN,
        figure=_draw(falls, references),
        claims=tuple(_claims(falls)),
        tables=_tables(falls),
        references=references,
    )


def _first_breakpoint_frame(body: Body, springs: SpringSet, run: Recording) -> int:
    """The last frame before a spring's angle passes a corner of its law."""
    first = len(run.times)
    for name, joint in springs.joints.items():
        chain = body.joints[name].chain
        for spring in joint.axes:
            if len(chain) == 1:
                along = float(np.dot(spring.direction, chain[0].axis))
                angle = along * run.displacements[name][:, 0]
            else:
                angle = run.rotation_vectors[name] @ np.array(spring.direction)
            for corner in {corner for law in spring.elastic for corner in law.breakpoints}:
                passed = np.flatnonzero((angle[1:] - corner) * (angle[:-1] - corner) <= 0.0)
                first = min([first, *passed.tolist()])
    return first


def _claims(falls: Falls) -> list[Claim]:
    finest, exchanged = min(STEP_SIZES), falls.exchanged_energy
    mechanical = np.sum([falls.finest_run.energy[kind] for kind in ENERGY_KINDS[:3]], axis=0)
    low, high = ERROR_RATIO_BOUNDS
    corner = falls.finest_run.times[falls.breakpoint_frame]
    claims = [
        Claim(
            f"With steps of {1e3 * finest:g} ms the energy error stays below 1e-4 of the energy "
            f"exchanged, {exchanged:.4g} J",
            float(np.abs(falls.energy_errors(finest)).max()),
            "J",
            at_most=ENERGY_BOUND * exchanged,
        ),
        Claim(
            "Without loads kinetic, gravity's and the springs' energy together never grow from one "
            "frame to the next",
            float(np.diff(mechanical).max()),
            "J",
            at_most=0.0,
        ),
        Claim(
            "What damping has taken never falls",
            float(np.diff(falls.finest_run.energy["dissipated"]).min()),
            "J",
            at_least=0.0,
        ),
    ]
    for step in STEP_SIZES[:-1]:
        halved = f"Halving the step from {1e3 * step:g} ms divides the greatest energy error by 4"
        claims.append(
            Claim(
                f"{halved}, up to {corner:.2f} s, where the first joint reaches a corner of its "
                "curve",
                falls.error_ratio(step, falls.breakpoint_frame + 1),
                at_least=low,
                at_most=high,
            )
        )
    for step in STEP_SIZES[:-1]:
        halved = f"Halving the step from {1e3 * step:g} ms divides the greatest energy error by 4"
        claims.append(
            Claim(
                f"{halved}, over the whole fall, corners included",
                falls.error_ratio(step),
                at_least=low,
                at_most=high,
                remark="a step across a corner of a curve has an error of its own; runs with a "
                "tolerance end their steps at the corners",
            )
        )
    return claims


_LINE_STYLES: Mapping[str, LineStyle] = {
    "kinetic": LineStyle(LINE_STYLES[0].colour, "-"),
    "gravity": LineStyle(LINE_STYLES[1].colour, "--"),
    "spring": LineStyle(LINE_STYLES[2].colour, "-."),
    "dissipated": LineStyle(GREY, ":"),
}


def _draw(falls: Falls, references: tuple[str, ...]) -> Figure:
    times = falls.finest_run.times
    with plot_style():
        figure, ((upper,), (lower,)) = create_panels(6.4, 2, 1, (1.4, 1.0))
        for kind, pen in _LINE_STYLES.items():
            energy = _energy_change(falls.finest_run, kind)
            upper.plot(times, energy, pen.dash, color=pen.colour, label=kind)
        upper.plot(
            times,
            falls.energy_errors(min(STEP_SIZES)),
            color=THESIS_STYLE.colour,
            lw=2.2,
            label="sum: the error",
        )
        upper.set_ylabel("change of energy [J]")
        upper.set_title(f"Exudyn, steps of {1e3 * min(STEP_SIZES):g} ms", loc="left")
        upper.legend(loc="lower left", ncols=2)
        for step, pen in zip(STEP_SIZES, LINE_STYLES, strict=False):
            error = np.abs(falls.energy_errors(step))
            label = f"steps of {1e3 * step:g} ms"
            lower.semilogy(times[1:], error[1:], pen.dash, color=pen.colour, lw=1.2, label=label)
        bound = ENERGY_BOUND * falls.exchanged_energy
        lower.axhline(bound, color=BLACK, lw=1.0, ls=(0, (1, 1)), label=f"bound, {bound:.2g} J")
        for axes in (upper, lower):
            _mark_breakpoint(axes, float(times[falls.breakpoint_frame]))
        lower.set_ylim(1e-7, 1.0)
        lower.set_ylabel("size of the error [J]")
        lower.set_xlabel("time [s]")
        lower.legend(loc="lower right", ncols=4)
        add_footer(figure, _SIGN, references)
    return figure


def _mark_breakpoint(axes: Axes, time: float) -> None:
    axes.axvline(time, color=GREY, lw=0.8)
    axes.annotate(
        " first corner of a curve",
        (time, 1.0),
        xycoords=("data", "axes fraction"),
        va="top",
        fontsize=7.0,
        color=GREY,
    )


def _energy_change(run: Recording, kind: str) -> Array:
    """The change of an energy since the start [J]."""
    return run.energy[kind] - run.energy[kind][0]


def _tables(falls: Falls) -> dict[str, dict[str, Array]]:
    time = {"time [s]": falls.finest_run.times}
    energies = {f"{kind} [J]": _energy_change(falls.finest_run, kind) for kind in ENERGY_KINDS}
    errors = {
        f"energy error, {1e3 * step:g} ms [J]": falls.energy_errors(step) for step in falls.runs
    }
    return {"energy": time | energies, "error": time | errors}
