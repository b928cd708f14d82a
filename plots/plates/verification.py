"""One second of the prototype with its own springs, compiled and in five independent engines."""

from collections.abc import Iterator, Mapping
from math import radians

import numpy as np
from matplotlib.figure import Figure

from generator import Plan, Recording, read_figure, simulate
from plots.canvas import BLACK, LINE_STYLES, Look, create_panels, draw_line
from plots.literature import OWN_ENGINE, Measurements, read_measurements, thesis_reference
from plots.plate import Claim, table_name
from plots.plate_definition import PlateDefinition
from plots.whole_body import Posture, posture_in_radians
from springs.backends import Array

AGREEMENT_TOLERANCE = 1e-8
"""Largest difference between the stored finest runs of the engines [rad]."""

RUN_TOLERANCE = 1e-9
"""Tolerance of the runs made for the claims [rad]."""

TABLE_TOLERANCE = 1e-8
"""Largest difference from the stored angles [rad]."""

START_POSES: Mapping[str, Posture] = {
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

_JOINT_NAMES = {name: name.replace("_", " ").removesuffix(" joint") for name in _JOINT_DASHES}


def _claims(motion: Measurements) -> Iterator[Claim]:
    """Compare runs made now with the motions that the other engines had."""
    engines = [name for name in motion.values("engine") if name != OWN_ENGINE]
    for start, pose in START_POSES.items():
        times = motion.select_rows(start=start, engine=OWN_ENGINE).column("time [s]")
        plan = Plan(
            stop=float(times[-1]),
            frame=float(times[1]),
            tolerance=RUN_TOLERANCE,
            displacements=posture_in_radians(pose),
        )
        run = simulate(read_figure("prototype"), plan)
        differences = [
            float(np.abs(_angle_magnitudes(run, joint) - other.column(f"{joint} [deg]")).max())
            for other in (motion.select_rows(start=start, engine=name) for name in engines)
            for joint in _JOINT_DASHES
        ]
        sentence = (
            f"The {start} fall, simulated now at {RUN_TOLERANCE:g} rad, has the joint angles "
            f"drawn of {', '.join(engines[:-1])} and {engines[-1]}: largest difference"
        )
        yield Claim(sentence, radians(max(differences)), "rad", at_most=TABLE_TOLERANCE)


def _angle_magnitudes(run: Recording, joint: str) -> Array:
    """Magnitude of a joint's rotation in each frame [deg]."""
    if joint in run.rotation_vectors:
        return np.degrees(np.linalg.norm(run.rotation_vectors[joint], axis=1))
    return np.degrees(np.abs(run.displacements[joint][:, 0]))


def _caption(_: Measurements) -> str:
    runs = read_measurements("verification")
    quantities = (("joints", "rad"), ("centre of mass", "m"), ("energy", "J"))
    worst = [
        max(
            float(runs.select_rows(start=start, engine=engine).column(f"{quantity} [{unit}]")[-1])
            for start in runs.values("start")
            for engine in runs.values("engine")
        )
        for quantity, unit in quantities
    ]
    listed = ", ".join(
        f"{value:.1e} {unit} ({quantity})"
        for value, (quantity, unit) in zip(worst, quantities, strict=True)
    )
    return (
        f"{_CAPTION}The finest runs of all engines differ from the reference by at most {listed}. "
        f"{runs.origin}"
    )


def _draw(motion: Measurements) -> Figure:
    starts, engines = motion.values("start"), motion.values("engine")
    figure, panels = create_panels(6.6, 2, len(starts), (1.0, 1.2))
    for (upper, lower), start in zip(zip(*panels, strict=True), starts, strict=True):
        upper.set_title(start)
        lower.set_yscale("log")
        for engine, pen in zip(engines, LINE_STYLES, strict=False):
            run = motion.select_rows(start=start, engine=engine)
            time, names = run.column("time [s]"), _JOINT_NAMES if engine == OWN_ENGINE else {}
            for joint, dash in _JOINT_DASHES.items():
                look: Look = {"color": pen.colour, "lw": 1.0, "label": names.get(joint, "_")}
                upper.plot(time, run.column(f"{joint} [deg]"), dash, **look)
            differences = run.column("joints [rad]")[1:]
            draw_line(lower, time[1:], differences, pen, engine, markevery=10, ms=3.0, lw=1.0)
        look = {"color": BLACK, "lw": 1.0, "ls": (0, (1, 1)), "label": "1e-8 rad"}
        lower.axhline(AGREEMENT_TOLERANCE, **look)
        lower.set(ylim=(1e-16, 1e-5), xlabel="time [s]")
    panels[0][0].legend(loc="upper left", fontsize=7.0)
    panels[0][0].set_ylabel("angle of four joints [deg]")
    panels[1][0].set_ylabel("largest joint difference [rad]")
    engine_lines = panels[1][-1].get_legend_handles_labels()
    figure.legend(*engine_lines, loc="outside upper center", ncols=7, fontsize=7.0)
    return figure


def _tables(motion: Measurements) -> dict[str, dict[str, Array]]:
    groups = motion.groups("start", "engine").items()
    return {table_name(*cells): rows.numbers() for cells, rows in groups}


verification = PlateDefinition(
    name="verification",
    title="The falling prototype in five engines",
    sign="Differences are from Pinocchio's accelerations integrated by DOP853 at 1e-13, finer than "
    "all other runs here: for joints the largest angle of R_a^T R_b over all joints, for energy "
    "the change since the start. Angles drawn are magnitudes of the joints' rotation vectors.",
    references=(thesis_reference("appendix A, the figure and its springs"),),
    collect=lambda: read_measurements("verification_motion"),
    caption=_caption,
    draw=_draw,
    claims=_claims,
    tables=_tables,
)
