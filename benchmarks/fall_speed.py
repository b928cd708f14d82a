"""Cost of a fall on a floor relative to MuJoCo's, measured side by side in one process.

    python -m benchmarks.fall_speed

MuJoCo's model is the exported tree without its springs: balls and hinges with one stiffness and
damping, four spheres a segment, a plane, implicitfast with steps of 2 ms. Its fall is another one;
what is compared is what a fall of such a body costs. Times are CPU times, the least of interleaved
rounds.
"""

import tempfile
from collections.abc import Callable
from pathlib import Path
from time import process_time

import mujoco
import numpy as np

from benchmarks import tables
from generator import Plan, Scene, build_model, convert, read_figure, simulate
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


def main() -> None:
    """Print the table."""
    figure, outside = read_figure(NAME), mujoco_model()
    compiled = compile_model(build_model(figure, PLAN))
    times = np.linspace(0.0, STOP, round(STOP / PLAN.frame) + 1)
    lean = {RecordingPart.CONTACT}
    jobs: dict[str, Callable[[], object]] = {
        "MuJoCo, implicitfast 2 ms": lambda: mujoco_fall(outside),
        "one run at 1e-6": lambda: refinement.run_once(compiled, times, 1e-6),
        "one run at 1e-5": lambda: refinement.run_once(compiled, times, 1e-5),
        "one implicit run at 1e-3": lambda: refinement.run_once(
            compiled, times, 1e-3, is_implicit=True
        ),
        "simulate": lambda: simulate(figure, PLAN, threads=1),
        "simulate, contact only": lambda: simulate(figure, PLAN, record=lean, threads=1),
    }
    least = dict.fromkeys(jobs, np.inf)
    for job in jobs.values():
        job()
    for _ in range(ROUNDS):
        for name, job in jobs.items():
            start = process_time()
            job()
            least[name] = min(least[name], process_time() - start)
    base = least["MuJoCo, implicitfast 2 ms"]
    tables.show(
        {"what": name, "CPU [ms]": f"{1e3 * took:.1f}", "over MuJoCo": f"{took / base:.2f}"}
        for name, took in least.items()
    )


if __name__ == "__main__":
    main()
