"""Cost of a fall on a floor relative to MuJoCo's, measured side by side in one process.

    python -m benchmarks fall-speed

MuJoCo's model is the exported tree without its springs: balls and hinges with one stiffness and
damping, four spheres a segment, a plane, implicitfast with steps of 2 ms. Its fall is another one;
what is compared is what a fall of such a body costs. Times are CPU times, the least of interleaved
rounds, with one thread. A run of a study records its measures only; spheres that never touch tell
what a sphere costs. The peak of memory is that of a process that simulates a minute.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import process_time

import mujoco
import numpy as np

from benchmarks import tables
from generator import (
    Plan,
    Scene,
    build_model,
    convert,
    design_points,
    read_figure,
    read_study,
    run_case,
    simulate,
)
from generator.contact.spheres import fit_contact_spheres
from generator.figure import Figure
from generator.recording import RecordingPart
from generator.simulation.compiled import refinement
from generator.simulation.compiled_run import compile_model

NAME = "male50"

STOP = 2.0
"""Of a fall [s]."""

MUJOCO_STEP = 2e-3
"""Step of MuJoCo [s]."""

STIFFNESS, DAMPING = 5.0, 1.0
"""Of MuJoCo's joints [N m/rad, N m s/rad]."""

RADIUS, SPACING = 0.05, 0.04
"""Radius of MuJoCo's spheres, and their distance from the middle of a segment [m]."""

SHORT = 0.02
"""Of the run whose costs are those of reading, building and starting [s]."""

SPHERES, SMALL_SHARE = 8, 0.1
"""Number of spheres in place of one, and radius of the others over that of the first."""

MUJOCO = "MuJoCo, implicitfast 2 ms"
WHOLE, OF_SHORT = "`simulate`, 2 s", "`simulate`, 0.02 s"
DIFFERENCE = "`simulate`: the difference of these two"

ROUNDS = 7

PLAN = Plan(stop=STOP, free_root=True, scene=Scene.floor())


def mujoco_model() -> mujoco.MjModel:
    """Return the exported tree on a plane, with spheres and linear springs."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{NAME}.xml"
        convert(NAME, path, free_root=True)
        spec = mujoco.MjSpec.from_file(str(path))
    for part in (*spec.geoms, *spec.tendons, *spec.actuators):
        spec.delete(part)
    for body in spec.bodies[1:]:
        for x, z in (
            (-SPACING, -SPACING),
            (-SPACING, SPACING),
            (SPACING, -SPACING),
            (SPACING, SPACING),
        ):
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_SPHERE,
                pos=[x, 0.0, z],
                size=[RADIUS, 0.0, 0.0],
                mass=0.0,
                contype=1,
                conaffinity=2,
            )
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[10.0, 10.0, 1.0],
        quat=[0.5**0.5, -(0.5**0.5), 0.0, 0.0],
        contype=2,
        conaffinity=1,
    )
    for joint in spec.joints:
        if joint.type in (mujoco.mjtJoint.mjJNT_BALL, mujoco.mjtJoint.mjJNT_HINGE):
            joint.stiffness[0], joint.damping[0] = STIFFNESS, DAMPING
    model = spec.compile()
    model.opt.timestep = MUJOCO_STEP
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    return model


def mujoco_fall(model: mujoco.MjModel) -> None:
    """Let MuJoCo's model fall, from standing on the plane."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    spheres = model.geom_type == mujoco.mjtGeom.mjGEOM_SPHERE
    data.qpos[1] -= np.min(data.geom_xpos[spheres, 1] - RADIUS)
    for _ in range(round(STOP / MUJOCO_STEP)):
        mujoco.mj_step(model, data)


def with_more_spheres(figure: Figure) -> Figure:
    """Return a figure with more spheres, as small as never to touch, at the centre of each one."""
    segments = [
        replace(
            figure.segments[name],
            contact_spheres=tuple(
                replace(sphere, radius=sphere.radius * share)
                for sphere in fit.spheres
                for share in (1.0, *(SMALL_SHARE,) * (SPHERES - 1))
            ),
        )
        for name, fit in fit_contact_spheres(figure).items()
        if fit.spheres
    ]
    return figure.with_parts(*segments)


def memory_of_a_minute() -> float:
    """Return the peak memory of a process that simulates a minute [MB]."""
    code = (
        "import json; from benchmarks import child, fall_speed; from dataclasses import replace; "
        "from generator import read_figure, simulate; "
        "simulate(read_figure(fall_speed.NAME), replace(fall_speed.PLAN, stop=60.0)); "
        "print(json.dumps(child.peak()))"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    return float(json.loads(done.stdout))


def main() -> None:
    """Print and write the table."""
    figure, outside = read_figure(NAME), mujoco_model()
    many = with_more_spheres(figure)
    compiled, crowded = (compile_model(build_model(each, PLAN)) for each in (figure, many))
    times = np.linspace(0.0, STOP, round(STOP / PLAN.frame) + 1)
    lean, short = {RecordingPart.CONTACT}, replace(PLAN, stop=SHORT)
    bodies, one_body = read_study("falls"), read_study("falls_stiffness")
    points, of_one_body = iter(design_points(bodies)), iter(design_points(one_body))
    jobs: dict[str, Callable[[], object]] = {
        MUJOCO: lambda: mujoco_fall(outside),
        "one run, steps to 1e-6": lambda: refinement.run_once(compiled, times, 1e-6),
        "one run, steps to 1e-5": lambda: refinement.run_once(compiled, times, 1e-5),
        "one run, steps to 1e-5, with eight times the spheres": lambda: refinement.run_once(
            crowded, times, 1e-5
        ),
        "one run by the implicit method, steps to 1e-3": lambda: refinement.run_once(
            compiled, times, 1e-3, is_implicit=True
        ),
        WHOLE: lambda: simulate(figure, PLAN, threads=1),
        OF_SHORT: lambda: simulate(figure, short, threads=1),
        "`simulate`, with a record of contact only": lambda: simulate(
            figure, PLAN, record=lean, threads=1
        ),
        "one run of the study `falls_stiffness`, of one body": lambda: run_case(
            one_body, next(of_one_body), threads=1
        ),
        "one run of the study `falls`, a body each": lambda: run_case(
            bodies, next(points), threads=1
        ),
    }
    least = dict.fromkeys(jobs, np.inf)
    for job in jobs.values():
        job()
    for _ in range(ROUNDS):
        for name, job in jobs.items():
            start = process_time()
            job()
            least[name] = min(least[name], process_time() - start)
    least[DIFFERENCE] = least[WHOLE] - least[OF_SHORT]
    base = least[MUJOCO]
    rows: list[tables.Row] = [
        {
            "what": name,
            "CPU [ms]": 1e3 * took,
            "over MuJoCo": took / base,
            "falls a second and core": 1.0 / took,
        }
        for name, took in least.items()
    ]
    tables.show(rows)
    tables.write("fall_speed", "python -m benchmarks fall-speed", rows)
    print(f"peak memory of a minute: {memory_of_a_minute():.0f} MB")


if __name__ == "__main__":
    main()
