"""One second of the prototype with its own springs, in five engines, each at several accuracies.

Run with `python -m benchmarks verification`. The reference is Pinocchio's motion at the tightest
tolerance that SciPy takes seriously. This program's compiled run, Exudyn and MuJoCo integrate by
themselves; for Pinocchio, OpenSim and Drake, SciPy's DOP853 integrates their accelerations. The law
of the joints is that of `springs` in the compiled run and in Exudyn, and that of `passive_law` in
all others.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks import cases, tables
from benchmarks.cases import Case
from benchmarks.engines import exudyn_engine, mujoco_engine, opensim_engine, pinocchio_engine
from benchmarks.outside import Fall, fall
from benchmarks.tree import between
from generator.rotations import Array

COMMAND = "python -m benchmarks verification"

TOLERANCES = (1e-8, 1e-10, 1e-12)
"""Of SciPy's integrator, relative and absolute."""

REFERENCE = 1e-13
"""Tolerance of Pinocchio's run, the reference of all."""

COMPILED_TOLERANCES = (1e-4, 1e-6, 1e-9)
EXUDYN_TOLERANCES = (1e-4, 1e-6, 1e-8)
"""Joint angles [rad]."""

EXUDYN = "Exudyn"
"""This program with Exudyn's integrator."""

STEPS = (5e-4, 2.5e-4, 1.25e-4)
"""Of MuJoCo's RK4 [s]."""

SHOWN = ("right_elbow", "left_shoulder", "right_hip_joint", "left_knee")
"""Joints whose angles are written."""


@dataclass(frozen=True)
class Run:
    """A motion by an engine with a setting."""

    engine: str
    method: str
    setting: float
    fall: Fall


@dataclass(frozen=True)
class Difference:
    """By frame: joint angles [rad], centre of mass [m], energy since the start [J]."""

    joints: Array
    centre: Array
    energy: Array


def difference(one: Fall, other: Fall) -> Difference:
    """Differences of two motions."""
    changes = [fall.energy - fall.energy[0] for fall in (one, other)]
    return Difference(
        between(one.rotations, other.rotations),
        np.linalg.norm(one.centre - other.centre, axis=1),
        np.abs(changes[0] - changes[1]),
    )


def runs(case: Case) -> Iterator[Run]:
    """The motions of all engines; of each engine the coarsest first."""
    for engine, method, plan_of, tolerances in (
        (exudyn_engine.NAME, "compiled", exudyn_engine.plan_of, COMPILED_TOLERANCES),
        (EXUDYN, "its integrator", exudyn_engine.exudyn_plan_of, EXUDYN_TOLERANCES),
    ):
        for tolerance in tolerances:
            plan = plan_of(case.displacements, stop=cases.STOP, tolerance=tolerance)
            made, _ = exudyn_engine.fall(case.figure, plan)
            yield Run(engine, method, tolerance, made)
    mujoco = mujoco_engine.MuJoCo(case.tree)
    for step in STEPS:
        yield Run(mujoco_engine.NAME, "RK4", step, mujoco.fall(cases.STOP, step, law=case.law))
    for name, engine in _accelerators(case):
        for tolerance in TOLERANCES:
            made = fall(case.tree, case.law, engine, cases.STOP, tolerance, split=True)
            yield Run(name, "DOP853", tolerance, made)


def reference(case: Case) -> Fall:
    """Return the reference motion."""
    engine = pinocchio_engine.Pinocchio(case.tree)
    return fall(case.tree, case.law, engine, cases.STOP, REFERENCE, split=True)


def _accelerators(case: Case) -> Iterator[tuple[str, object]]:
    yield pinocchio_engine.NAME, pinocchio_engine.Pinocchio(case.tree)
    yield opensim_engine.NAME, opensim_engine.OpenSim(case.tree)
    try:
        from benchmarks.engines import drake_engine
    except ImportError:
        print("Drake is not installed and is left out")
        return
    yield drake_engine.NAME, drake_engine.Drake(case.tree)


def main() -> None:
    """Print the table and write it, and the motions."""
    rows: list[tables.Row] = []
    frames: list[tables.Row] = []
    for pose in cases.POSES:
        case = cases.prototype(pose)
        truth = reference(case)
        made = list(runs(case))
        for run, finer in zip(made, [*made[1:], None], strict=True):
            apart = difference(truth, run.fall)
            same = finer is not None and finer.engine == run.engine
            change = float(difference(run.fall, finer.fall).joints.max()) if same else float("nan")
            rows.append(
                {
                    "start": pose,
                    "engine": run.engine,
                    "method": run.method,
                    "setting": run.setting,
                    "joints [rad]": float(apart.joints.max()),
                    "change to next [rad]": change,
                    "centre of mass [m]": float(apart.centre.max()),
                    "energy [J]": float(apart.energy.max()),
                    "wall [s]": run.fall.wall,
                }
            )
            if not same:
                frames += _frames(pose, run, apart)
    tables.show(rows)
    tables.write("verification", COMMAND, rows)
    tables.write("verification_motion", COMMAND, frames)


def _frames(pose: str, run: Run, apart: Difference) -> Iterator[tables.Row]:
    """The motion of an engine, frame by frame, with what it differs by."""
    angles = {
        f"{name} [deg]": np.degrees(Rotation.from_matrix(run.fall.rotations[name]).magnitude())
        for name in SHOWN
    }
    for k, time in enumerate(np.linspace(0.0, cases.STOP, len(apart.joints))):
        yield {
            "start": pose,
            "engine": run.engine,
            "time [s]": float(time),
            "joints [rad]": float(apart.joints[k]),
            "centre of mass [m]": float(apart.centre[k]),
            "energy [J]": float(apart.energy[k]),
            **{name: f"{values[k]:.7f}" for name, values in angles.items()},
        }
