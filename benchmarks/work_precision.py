"""Wall time against error: one second of two figures, in every engine, at many settings.

Run with `python -m benchmarks work-precision`. The *reference* figure has springs that every engine
holds by itself:

- this project: as six axis springs a ball (`exudyn_engine.radial_springs`), expression trees
- MuJoCo: `stiffness="20 0 60" damping="0.08"`
- OpenSim: a bushing of expressions and a damper a ball, an expression a hinge
- Drake: a system of symbolic expressions, and the joints' own damping
- Pinocchio has neither springs nor an integrator: numpy and SciPy

The *prototype* has its own springs, which only this project holds by itself. MuJoCo calls them in
numpy; for the others SciPy integrates accelerations that they give.

Walls are of integration alone, without building, the best of several rounds in which all take
turns. The error is the largest angle of any joint at the end, against Pinocchio at 1e-13.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks import cases, tables
from benchmarks.cases import Case
from benchmarks.engines import exudyn_engine, mujoco_engine, opensim_engine, pinocchio_engine
from benchmarks.outside import Accelerator, Fall, fall
from benchmarks.tree import between

COMMAND = "python -m benchmarks work-precision"

ROUNDS = 3

SPLIT = "RK4, split at corners"
"""MuJoCo's steps that cross the edge of a dead zone cut into small ones."""

TARGETS = (1e-3, 1e-5)
"""Errors at which engines are compared [rad]."""


@dataclass(frozen=True)
class Setting:
    """One point: an engine with a method and a setting, ready to run."""

    figure: str
    engine: str
    method: str
    value: float
    run: Callable[[], Fall]


def main() -> None:
    """Print the table, write it, and print the ratios."""
    rows: list[dict[str, object]] = []
    for name, case, make in (
        ("reference", cases.reference(), _native),
        ("prototype", cases.prototype("striding"), _called),
    ):
        engine = pinocchio_engine.Pinocchio(case.tree)
        truth = fall(case.tree, case.law, engine, cases.STOP, 1e-13, None)
        rows += measured(list(make(name, case)), truth)
    tables.show(rows)
    tables.write("work_precision", COMMAND, rows)
    for figure in ("reference", "prototype"):
        _show_costs([row for row in rows if row["figure"] == figure])


def measured(settings: list[Setting], truth: Fall) -> list[dict[str, object]]:
    """Best wall and error of each; a run that fails, or errs by more than 1 rad, is left out."""
    walls = np.full(len(settings), np.inf)
    errors = np.full(len(settings), np.inf)
    for number in range(ROUNDS):
        for k, setting in enumerate(settings):
            # Long runs are their own average.
            if number and (walls[k] > 5.0 or not np.isfinite(errors[k])):
                continue
            try:
                made = setting.run()
            except RuntimeError as failure:
                print(f"{setting.engine}, {setting.method} {setting.value:g}: {failure}")
                continue
            walls[k] = min(walls[k], made.wall)
            errors[k] = _error(truth, made)
    return [
        {
            "figure": s.figure,
            "engine": s.engine,
            "method": s.method,
            "setting": s.value,
            "error [rad]": float(error),
            "wall [s]": float(wall),
        }
        for s, wall, error in zip(settings, walls, errors, strict=True)
        if error < 1.0
    ]


def _error(truth: Fall, made: Fall) -> float:
    last = [{name: turns[-1:] for name, turns in f.rotations.items()} for f in (truth, made)]
    return float(between(*last)[0])


def _native(name: str, case: Case) -> Iterator[Setting]:
    """Each engine with springs of its own."""
    law = case.radial
    springs = exudyn_engine.radial_springs(case.figure, law)
    yield from _ours(name, case, springs)
    mujoco = mujoco_engine.MuJoCo(case.tree, law)
    for count in (62, 88, 125, 177, 250, 354, 500, 707, 1000, 2000):
        yield _stepped(name, mujoco, "RK4", count)
    for integrator in ("Euler", "implicitfast"):
        for count in (1000, 4000, 16000, 64000, 90000):
            yield _stepped(name, mujoco, integrator, count)
    opensim = opensim_engine.OpenSim(case.tree, law)
    for accuracy in (3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 1e-7):
        yield Setting(
            name,
            opensim_engine.NAME,
            "Runge-Kutta-Merson",
            accuracy,
            lambda accuracy=accuracy: opensim.fall(cases.STOP, accuracy),
        )
    yield from _integrated(name, case, pinocchio_engine.NAME, pinocchio_engine.Pinocchio(case.tree))
    try:
        from benchmarks.engines import drake_engine
    except ImportError:
        print("Drake is not installed and is left out")
        return
    drake = drake_engine.Drake(case.tree, law)
    for accuracy in (3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4):
        yield Setting(
            name,
            drake_engine.NAME,
            "Runge-Kutta 3",
            accuracy,
            lambda accuracy=accuracy: drake.fall(cases.STOP, accuracy),
        )


def _called(name: str, case: Case) -> Iterator[Setting]:
    """The curves with dead zones: Exudyn holds them, all others call numpy."""
    yield from _ours(name, case, None)
    mujoco = mujoco_engine.MuJoCo(case.tree)
    for count in (250, 500, 1000, 2000, 4000):
        yield _stepped(name, mujoco, "RK4", count, case)
        yield _stepped(name, mujoco, SPLIT, count, case)
    yield from _integrated(name, case, pinocchio_engine.NAME, pinocchio_engine.Pinocchio(case.tree))
    yield from _integrated(name, case, opensim_engine.NAME, opensim_engine.OpenSim(case.tree))


def _ours(name: str, case: Case, springs: object) -> Iterator[Setting]:
    for key, values in (
        ("tolerance", (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)),
        ("step", (8e-3, 4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4)),
    ):
        for value in values:
            plan = exudyn_engine.plan_of(
                case.displacements, springs, stop=cases.STOP, **{key: value}
            )
            method = "tolerance" if key == "tolerance" else "fixed step"
            yield Setting(
                name,
                exudyn_engine.NAME,
                method,
                value,
                lambda plan=plan: exudyn_engine.fall(case.figure, plan)[0],
            )


def _stepped(
    name: str, mujoco: mujoco_engine.MuJoCo, integrator: str, count: int, case: Case | None = None
) -> Setting:
    step = cases.STOP / count
    law = None if case is None else case.law
    return Setting(
        name,
        mujoco_engine.NAME,
        integrator,
        step,
        lambda: mujoco.fall(
            cases.STOP, step, integrator.split(",")[0], law, None, integrator == SPLIT
        ),
    )


def _integrated(name: str, case: Case, engine: str, accelerator: Accelerator) -> Iterator[Setting]:
    for tolerance in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8):
        yield Setting(
            name,
            engine,
            "DOP853 of SciPy",
            tolerance,
            lambda tolerance=tolerance: fall(
                case.tree, case.law, accelerator, cases.STOP, tolerance, None
            ),
        )


def _show_costs(rows: list[dict[str, object]]) -> None:
    """The cheapest run of each method within an error, and ours over it."""
    print(f"\nCheapest wall [s] within an error, {rows[0]['figure']}:\n")
    methods = dict.fromkeys((str(row["engine"]), str(row["method"])) for row in rows)
    table: list[tables.Row] = []
    for engine, method in methods:
        line: dict[str, object] = {"engine": engine, "method": method}
        for target in TARGETS:
            line[f"{target:g} rad"] = _cheapest(rows, target, engine, method)
            ratio = _cheapest(rows, target, exudyn_engine.NAME) / _cheapest(
                rows, target, engine, method
            )
            line[f"ours over it, {target:g} rad"] = round(ratio, 2)
        table.append(line)
    tables.show(table)


def _cheapest(
    rows: list[dict[str, object]], target: float, engine: str, method: str | None = None
) -> float:
    fit = [
        float(str(row["wall [s]"]))
        for row in rows
        if row["engine"] == engine
        and method in (None, row["method"])
        and float(str(row["error [rad]"])) <= target
    ]
    return min(fit, default=float("nan"))
