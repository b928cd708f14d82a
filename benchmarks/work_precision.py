"""Wall time against error: one second of two figures, in every engine, at many settings.

Run with `python -m benchmarks work-precision`. The *reference* figure has springs that every engine
holds by itself:

- this program: as six axis springs a ball (`exudyn_engine.radial_springs`)
- MuJoCo: `stiffness="20 0 60" damping="0.08"`
- OpenSim: a bushing of expressions and a damper a ball, an expression a hinge
- Drake: a system of symbolic expressions, and the joints' own damping
- Pinocchio has neither springs nor an integrator: numpy and SciPy

The *prototype* has its own springs, which only this project holds by itself. MuJoCo calls them in
numpy; for the others SciPy integrates accelerations that they give.

The methods of this program are named in `exudyn_engine`. Times are those of integration alone,
except for the whole call, the best of several rounds in which all take turns; CPU times add the
threads, of which the compiled method uses two and all others one. The error is the largest angle of
any joint at the end, against Pinocchio at 1e-13.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from benchmarks import cases, tables
from benchmarks.cases import Case
from benchmarks.engines import exudyn_engine, mujoco_engine, opensim_engine, pinocchio_engine
from benchmarks.outside import Accelerator, Fall, fall
from benchmarks.rounds import best_of
from benchmarks.tree import between
from generator.simulation.plan import Plan
from springs import SpringSet

COMMAND = "python -m benchmarks work-precision"

ROUNDS = 15

OUR_TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
"""Of the compiled method [rad]."""

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
        truth = fall(case.tree, case.law, engine, cases.STOP, 1e-13, None, split=True)
        rows += measured(list(make(name, case)), truth)
    tables.show(rows)
    tables.write("work_precision", COMMAND, rows)
    for figure in ("reference", "prototype"):
        _show_costs([row for row in rows if row["figure"] == figure])


def measured(settings: list[Setting], truth: Fall) -> list[dict[str, object]]:
    """Best times and error of each; a run that fails, or errs by more than 1 rad, is left out."""
    made = best_of({s: s.run for s in settings}, ROUNDS)
    return [
        {
            "figure": s.figure,
            "engine": s.engine,
            "method": s.method,
            "setting": s.value,
            "error [rad]": error,
            "wall [s]": run.wall,
            "CPU [s]": run.cpu,
        }
        for s, run in made.items()
        if (error := last_error(truth, run)) < 1.0
    ]


def last_error(truth: Fall, made: Fall) -> float:
    """Largest angle between the joints of two motions at the end [rad]."""
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
    """The curves with dead zones: this program holds them, all others call numpy."""
    yield from _ours(name, case, None)
    mujoco = mujoco_engine.MuJoCo(case.tree)
    for count in (250, 500, 1000, 2000, 4000):
        yield _stepped(name, mujoco, "RK4", count, case)
        yield _stepped(name, mujoco, SPLIT, count, case)
    yield from _integrated(name, case, pinocchio_engine.NAME, pinocchio_engine.Pinocchio(case.tree))
    yield from _integrated(name, case, opensim_engine.NAME, opensim_engine.OpenSim(case.tree))


def _ours(name: str, case: Case, springs: SpringSet | None) -> Iterator[Setting]:
    figure = case.figure

    def plan(**given: float) -> Plan:
        return exudyn_engine.plan_of(case.displacements, springs, stop=cases.STOP, **given)

    def implicit(**given: float) -> Plan:
        return exudyn_engine.exudyn_plan_of(case.displacements, springs, stop=cases.STOP, **given)

    methods: tuple[tuple[str, tuple[float, ...], Callable[[float], Fall]], ...] = (
        (
            exudyn_engine.COMPILED,
            OUR_TOLERANCES,
            lambda value: exudyn_engine.fall(figure, plan(tolerance=value))[0],
        ),
        (
            exudyn_engine.WHOLE_CALL,
            OUR_TOLERANCES,
            lambda value: exudyn_engine.whole_call(figure, plan(tolerance=value)),
        ),
        (
            exudyn_engine.ONE_RUN,
            OUR_TOLERANCES,
            lambda value: exudyn_engine.one_run(figure, plan(tolerance=value)),
        ),
        (
            exudyn_engine.EXUDYN,
            (1e-2, 1e-3, 1e-4, 1e-5),
            lambda value: exudyn_engine.fall(figure, implicit(tolerance=value))[0],
        ),
        (
            exudyn_engine.EXUDYN_STEP,
            (8e-3, 4e-3, 2e-3, 1e-3, 5e-4),
            lambda value: exudyn_engine.fall(figure, implicit(step=value))[0],
        ),
    )
    for method, values, run in methods:
        for value in values:
            yield Setting(
                name, exudyn_engine.NAME, method, value, lambda run=run, value=value: run(value)
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
    """The cheapest run of each method within an error, and the compiled method over it."""
    print(f"\nCheapest wall [s] within an error, {rows[0]['figure']}:\n")
    methods = dict.fromkeys((str(row["engine"]), str(row["method"])) for row in rows)
    table: list[tables.Row] = []
    for engine, method in methods:
        line: dict[str, object] = {"engine": engine, "method": method}
        for target in TARGETS:
            line[f"{target:g} rad"] = _cheapest(rows, target, engine, method)
            ratio = _cheapest(rows, target, exudyn_engine.NAME, exudyn_engine.COMPILED) / _cheapest(
                rows, target, engine, method
            )
            line[f"compiled over it, {target:g} rad"] = round(ratio, 4)
        table.append(line)
    tables.show(table)


def _cheapest(rows: list[dict[str, object]], target: float, engine: str, method: str) -> float:
    fit = [
        float(str(row["wall [s]"]))
        for row in rows
        if row["engine"] == engine
        and row["method"] == method
        and float(str(row["error [rad]"])) <= target
    ]
    return min(fit, default=float("nan"))
