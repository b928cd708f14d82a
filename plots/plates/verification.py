"""A second of the prototype with its own springs in five engines that share no dynamics."""

# Matplotlib leaves the types of its keyword arguments open.
# pyright: reportUnknownMemberType=false

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from plots.canvas import BLACK, LINE_STYLES, LineStyle, add_footer, create_panels, plot_style
from plots.literature import Measurements, read_measurements
from plots.plate import Claim, Plate
from springs.backends import Array
from springs.published import tables as published

AGREEMENT_TOLERANCE = 1e-6
"""By which all are to agree: joint angles [rad], centre of mass [m], energy [J]."""

_OWN_ENGINE = "Exudyn"

_SIGN = (
    "Differences are from Pinocchio's accelerations integrated by DOP853 at 1e-13, a finer setting "
    "than any other here: of joints the largest angle of R_a^T R_b over all joints, of energy its "
    "change since the start. Angles shown are sizes of the joints' rotation vectors."
)
_CAPTION = (
    "The prototype falls for a second from three starts round its pinned pelvis, at rest at first: "
    "standing; striding; and reaching with both arms while one knee is bent beyond the edge of its "
    "dead zone. Every engine has the same 22 degrees of freedom and the same curves, but its own "
    "equations: Exudyn constraints between bodies in redundant coordinates, integrated by this "
    "program; MuJoCo joint coordinates and its own Runge-Kutta method of order 4; Pinocchio, "
    "OpenSim and Drake give accelerations that SciPy integrates. The law of the joints was written "
    "a second time for all engines but Exudyn, and derived in another way. Above: four joints, the "
    "lines of all engines' finest runs on top of each other. Below: by how much each differs from "
    "the reference. From the striding start the reference itself is the one that is off, by 4e-9 "
    "rad: the others agree with each other more closely than with it. "
)
_JOINT_DASHES = {
    "right_elbow": "-",
    "left_shoulder": "--",
    "right_hip_joint": "-.",
    "left_knee": ":",
}
"""Joints whose angles are drawn, with their lines."""


def verification() -> Plate:
    """Draw the plate."""
    runs, motion = read_measurements("verification"), read_measurements("verification_motion")
    thesis = published.publication("otani_1989").reference
    references = (str(replace(thesis, place="appendix A, the figure and its springs")),)
    return Plate(
        name="verification",
        title="The falling prototype in five engines",
        caption=_CAPTION + runs.origin,
        sign=_SIGN,
        figure=_draw(motion, references),
        claims=tuple(_claims(runs)),
        tables=_tables(motion),
        references=references,
    )


def _claims(runs: Measurements) -> list[Claim]:
    engines = runs.values("engine")
    named = f"{', '.join(engines[:-1])} and {engines[-1]}"
    claims = [
        Claim(
            f"{named} agree in every joint's angle at every frame, from the {start} start",
            max(_finest_value(runs, start, engine, "joints [rad]") for engine in engines),
            "rad",
            at_most=AGREEMENT_TOLERANCE,
        )
        for start in runs.values("start")
    ]
    for what, unit in (("centre of mass", "m"), ("energy", "J")):
        claims.append(
            Claim(
                f"They agree in the {what}, from all starts",
                max(
                    _finest_value(runs, start, engine, f"{what} [{unit}]")
                    for start in runs.values("start")
                    for engine in engines
                ),
                unit,
                at_most=AGREEMENT_TOLERANCE,
            )
        )
    claims.append(
        Claim(
            "Each engine is converged by itself: its joint angles move by no more when it is made "
            "finer for the last time",
            max(
                float(_select_runs(runs, start, engine).column("change to next [rad]")[-2])
                for start in runs.values("start")
                for engine in engines
            ),
            "rad",
            at_most=AGREEMENT_TOLERANCE,
        )
    )
    ours = runs.select_rows(engine=_OWN_ENGINE)
    claims.append(
        Claim(
            "Runs of this program differ from the reference by no more than the tolerance that "
            "they were asked to hold, 1e-4 to 1e-8 rad: difference over tolerance",
            float(np.max(ours.column("joints [rad]") / ours.column("setting"))),
            at_most=1.0,
        )
    )
    return claims


def _select_runs(runs: Measurements, start: str, engine: str) -> Measurements:
    return runs.select_rows(start=start, engine=engine)


def _finest_value(runs: Measurements, start: str, engine: str, header: str) -> float:
    return float(_select_runs(runs, start, engine).column(header)[-1])


def _draw(motion: Measurements, references: tuple[str, ...]) -> Figure:
    starts, engines = motion.values("start"), motion.values("engine")
    with plot_style():
        figure, panels = create_panels(6.6, 2, len(starts), (1.0, 1.2))
        for (upper, lower), start in zip(zip(*panels, strict=True), starts, strict=True):
            upper.set_title(start, loc="left")
            for engine, pen in zip(engines, LINE_STYLES, strict=False):
                _draw_motion(
                    upper, lower, motion.select_rows(start=start, engine=engine), engine, pen
                )
            lower.axhline(
                AGREEMENT_TOLERANCE, color=BLACK, lw=1.0, ls=(0, (1, 1)), label="the claim's bound"
            )
            lower.set_ylim(1e-16, 1e-5)
            lower.set_xlabel("time [s]")
        panels[0][0].legend(loc="upper left", fontsize=7.0)
        panels[0][0].set_ylabel("angle of four joints [deg]")
        panels[1][0].set_ylabel("largest joint difference [rad]")
        panels[1][-1].legend(loc="lower right", fontsize=7.0)
        add_footer(figure, _SIGN, references)
    return figure


def _draw_motion(upper: Axes, lower: Axes, one: Measurements, engine: str, pen: LineStyle) -> None:
    time = one.column("time [s]")
    for joint, dash in _JOINT_DASHES.items():
        label = joint.replace("_", " ").removesuffix(" joint") if engine == _OWN_ENGINE else "_"
        upper.plot(time, one.column(f"{joint} [deg]"), dash, color=pen.colour, lw=1.0, label=label)
    lower.semilogy(
        time[1:],
        one.column("joints [rad]")[1:],
        pen.dash,
        color=pen.colour,
        marker=pen.marker,
        markevery=10,
        ms=3.0,
        mfc="white",
        lw=1.0,
        label=engine,
    )


def _tables(motion: Measurements) -> dict[str, Mapping[str, Array]]:
    headers = [key for key in motion.rows[0] if key not in ("start", "engine")]
    tables: dict[str, Mapping[str, Array]] = {}
    for start in motion.values("start"):
        for engine in motion.values("engine"):
            one = motion.select_rows(start=start, engine=engine)
            tables[f"{start}-{engine.lower()}"] = {key: one.column(key) for key in headers}
    return tables
