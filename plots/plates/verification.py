"""One second of the prototype with its own springs, compiled and in five independent engines."""

# Matplotlib leaves the types of its keyword arguments open.
# pyright: reportUnknownMemberType=false

from collections.abc import Mapping
from dataclasses import replace
from math import radians

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from generator import Plan, Recording, read_figure, simulate
from plots.canvas import BLACK, LINE_STYLES, LineStyle, add_footer, create_panels, plot_style
from plots.literature import Measurements, read_measurements
from plots.plate import Claim, Plate
from springs.backends import Array
from springs.published import tables as published

AGREEMENT_TOLERANCE = 1e-8
"""Largest difference between the stored finest runs of the engines [rad]."""

RUN_TOLERANCE = 1e-9
"""Tolerance of the runs made for the claims [rad]."""

TABLE_TOLERANCE = 1e-8
"""Largest difference from the stored angles [rad]."""

START_POSES: Mapping[str, Mapping[str, tuple[float, ...]]] = {
    "standing": {},
    "striding": {
        "left_hip_joint": (5.0, 8.0, 40.0),
        "right_hip_joint": (-5.0, 4.0, -10.0),
        "left_knee": (50.0,),
        "right_knee": (15.0,),
        "right_elbow": (-30.0,),
        "left_shoulder": (10.0, 5.0, -20.0),
    },
    "reaching": {
        "waist": (5.0, 10.0, -8.0),
        "left_shoulder": (15.0, 40.0, -20.0),
        "right_shoulder": (10.0, 60.0, 10.0),
        "left_elbow": (30.0,),
        "right_elbow": (60.0,),
        "left_hip_joint": (5.0, -5.0, 15.0),
        "right_hip_joint": (-8.0, 10.0, 30.0),
        "left_knee": (95.0,),
        "right_knee": (70.0,),
    },
}
"""Starts of the falls at rest, as in the benchmarks [deg]."""

_OWN_ENGINE = "this program"
"""Name of the compiled run in the tables."""

_SIGN = (
    "Differences are from Pinocchio's accelerations integrated by DOP853 at 1e-13, finer than all "
    "other runs here: for joints the largest angle of R_a^T R_b over all joints, for energy the "
    "change since the start. Angles drawn are magnitudes of the joints' rotation vectors."
)
_CAPTION = (
    "The prototype falls for one second about its pinned pelvis, from rest in three poses: "
    "standing; striding; and reaching with both arms, one knee bent beyond the edge of its dead "
    "zone. Every engine has the same 22 degrees of freedom and the same curves, but its own "
    "equations: the compiled run of this program a recursion along the tree, integrated by DOP853 "
    "with breakpoints located; Exudyn constraints between bodies in redundant coordinates and its "
    "own implicit integrator, steered by this program; MuJoCo joint coordinates and its own "
    "Runge-Kutta method of order 4; Pinocchio, OpenSim and Drake compute accelerations that SciPy "
    "integrates, in steps that end where a curve enters or leaves its dead zone. For MuJoCo, "
    "Pinocchio, OpenSim and Drake the law of the joints was derived and implemented a second "
    "time. Above: four joints in the finest runs of all engines, whose lines coincide. Below: "
    "differences from the reference. "
)
_JOINT_DASHES = {
    "right_elbow": "-",
    "left_shoulder": "--",
    "right_hip_joint": "-.",
    "left_knee": ":",
}
"""Joints whose angles are drawn, and their dashes."""


def verification() -> Plate:
    """Draw the plate."""
    runs, motion = read_measurements("verification"), read_measurements("verification_motion")
    thesis = published.publication("otani_1989").reference
    references = (str(replace(thesis, place="appendix A, the figure and its springs")),)
    return Plate(
        name="verification",
        title="The falling prototype in five engines",
        caption=_CAPTION + _agreement_text(runs) + runs.origin,
        sign=_SIGN,
        figure=_draw(motion, references),
        claims=tuple(_claims(motion)),
        tables=_tables(motion),
        references=references,
    )


def _claims(motion: Measurements) -> list[Claim]:
    """Compare runs made now with the motions that the other engines had."""
    claims: list[Claim] = []
    for start, pose in START_POSES.items():
        run = _simulate_fall(pose, motion.select_rows(start=start, engine=_OWN_ENGINE))
        engines = [name for name in motion.values("engine") if name != _OWN_ENGINE]
        differences = [
            float(np.abs(_angle_magnitudes(run, joint) - other.column(f"{joint} [deg]")).max())
            for other in (motion.select_rows(start=start, engine=name) for name in engines)
            for joint in _JOINT_DASHES
        ]
        claims.append(
            Claim(
                f"The {start} fall, simulated now at {RUN_TOLERANCE:g} rad, has the joint angles "
                f"drawn of {', '.join(engines[:-1])} and {engines[-1]}: largest difference",
                radians(max(differences)),
                "rad",
                at_most=TABLE_TOLERANCE,
            )
        )
    return claims


def _simulate_fall(pose: Mapping[str, tuple[float, ...]], table: Measurements) -> Recording:
    """Simulate the prototype from a pose [deg], with the frames of a table."""
    times = table.column("time [s]")
    plan = Plan(
        stop=float(times[-1]),
        frame=float(times[1]),
        tolerance=RUN_TOLERANCE,
        displacements={name: tuple(map(radians, angles)) for name, angles in pose.items()},
    )
    return simulate(read_figure("prototype"), plan)


def _angle_magnitudes(run: Recording, joint: str) -> Array:
    """Magnitude of a joint's rotation in each frame [deg]."""
    if joint in run.rotation_vectors:
        return np.degrees(np.linalg.norm(run.rotation_vectors[joint], axis=1))
    return np.degrees(np.abs(run.displacements[joint][:, 0]))


def _agreement_text(runs: Measurements) -> str:
    """Largest differences of the stored finest runs from the reference, as a sentence."""
    quantities = (("joints", "rad"), ("centre of mass", "m"), ("energy", "J"))
    worst = [
        max(
            _finest_value(runs, start, engine, f"{quantity} [{unit}]")
            for start in runs.values("start")
            for engine in runs.values("engine")
        )
        for quantity, unit in quantities
    ]
    listed = ", ".join(
        f"{value:.1e} {unit} ({quantity})"
        for value, (quantity, unit) in zip(worst, quantities, strict=True)
    )
    return f"The finest runs of all engines differ from the reference by at most {listed}. "


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
                AGREEMENT_TOLERANCE,
                color=BLACK,
                lw=1.0,
                ls=(0, (1, 1)),
                label="1e-8 rad",
            )
            lower.set_ylim(1e-16, 1e-5)
            lower.set_xlabel("time [s]")
        panels[0][0].legend(loc="upper left", fontsize=7.0)
        panels[0][0].set_ylabel("angle of four joints [deg]")
        panels[1][0].set_ylabel("largest joint difference [rad]")
        engine_lines = panels[1][-1].get_legend_handles_labels()
        figure.legend(*engine_lines, loc="outside upper center", ncols=7, fontsize=7.0)
        add_footer(figure, _SIGN, references)
    return figure


def _draw_motion(upper: Axes, lower: Axes, run: Measurements, engine: str, pen: LineStyle) -> None:
    time = run.column("time [s]")
    for joint, dash in _JOINT_DASHES.items():
        label = joint.replace("_", " ").removesuffix(" joint") if engine == _OWN_ENGINE else "_"
        upper.plot(time, run.column(f"{joint} [deg]"), dash, color=pen.colour, lw=1.0, label=label)
    lower.semilogy(
        time[1:],
        run.column("joints [rad]")[1:],
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
            run = motion.select_rows(start=start, engine=engine)
            tables[f"{start}-{engine.lower().replace(' ', '-')}"] = {
                key: run.column(key) for key in headers
            }
    return tables
