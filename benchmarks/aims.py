"""Cost of this program relative to other engines, measured side by side, against its aims.

Run with `python -m benchmarks aims`. Two tables of the reference figure, one second:

- what a user gets by default: each engine at its own default settings, with its true error
- the cheapest run with an error of at most 1e-3 rad and 1e-5 rad

and the list of aims, but for those of the start, which `startup` has. Times are the least of
interleaved rounds. This program makes its first two runs in two threads, all others use one: both
wall and CPU time are compared. The error is the largest angle of any joint at the end, against
Pinocchio at 1e-13; of chains see `chains`.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from math import inf

from benchmarks import cases, chains, tables
from benchmarks.cases import Case
from benchmarks.engines import exudyn_engine, mujoco_engine, opensim_engine, pinocchio_engine
from benchmarks.outside import Fall, fall
from benchmarks.rounds import best_of
from benchmarks.startup import Aim
from benchmarks.work_precision import last_error

COMMAND = "python -m benchmarks aims"

ROUNDS = 40
"""Of the runs of figures, of milliseconds each."""

CHAIN_ROUNDS = 10

TARGETS = (1e-3, 1e-5)
"""Errors at which engines are compared [rad]."""

CHAIN_TARGET = 1e-4
"""Error at which engines are compared on chains [rad]."""

LONGEST_CHAIN = chains.COUNTS[-1]

OURS = f"{exudyn_engine.NAME}, {exudyn_engine.COMPILED}"
ONE_RUN = f"{exudyn_engine.NAME}, {exudyn_engine.ONE_RUN}"
MUJOCO, OPENSIM = "MuJoCo, RK4", "OpenSim, Runge-Kutta-Merson"

PROTOTYPE_STOP = 2.0
"""Of the prototype's fall with its own springs [s]."""

Run = Callable[[float], Fall]


@dataclass(frozen=True)
class Method:
    """A method of an engine: settings from coarse to fine, and its run at a setting."""

    settings: Iterable[float]
    run: Run


def main() -> None:
    """Print the tables and write them."""
    reference = cases.reference()
    engine = pinocchio_engine.Pinocchio(reference.tree)
    truth = fall(reference.tree, reference.law, engine, cases.STOP, 1e-13, None)
    methods = _methods(reference)
    defaults = best_of(_defaults(reference, methods), ROUNDS)
    print("At default settings, one second of the reference figure:\n")
    rows = list(_default_rows(defaults, truth))
    tables.show(rows)
    tables.write("aims_defaults", COMMAND, rows)
    cheapest = {
        (target, name, setting): partial(method.run, setting)
        for target in TARGETS
        for name, method in methods.items()
        for setting in [coarsest(method, truth, target)]
    }
    print("\nThe cheapest run with an error of at most:\n")
    rows = list(_cheapest_rows(best_of(cheapest, ROUNDS), truth))
    tables.show(rows)
    tables.write("aims_errors", COMMAND, rows)
    print("\nThe aims:\n")
    rows = [aim.row() for aim in _aims(methods)]
    tables.show(rows)
    tables.write("aims", COMMAND, rows)


def coarsest(method: Method, truth: Fall, target: float) -> float:
    """The first setting at which the error is at most `target` [rad]."""
    for setting in method.settings:
        try:
            if last_error(truth, method.run(setting)) <= target:
                return setting
        except RuntimeError:
            continue
    raise RuntimeError(f"no setting errs by less than {target:g} rad")


def _methods(
    case: Case, stop: float = cases.STOP, longest_step: float = 0.016
) -> Mapping[str, Method]:
    """Methods with native springs, which keep the last state; the compiled one keeps frames.

    MuJoCo's RK4 is unstable at steps above `longest_step` [s].
    """
    springs = exudyn_engine.radial_springs(case.figure, case.radial)
    mujoco = mujoco_engine.MuJoCo(case.tree, case.radial)
    opensim = opensim_engine.OpenSim(case.tree, case.radial)
    figure, start = case.figure, case.displacements

    def agreed(tolerance: float) -> Fall:
        plan = exudyn_engine.plan_of(start, springs, stop=stop, tolerance=tolerance)
        return exudyn_engine.fall(figure, plan)[0]

    def once(tolerance: float) -> Fall:
        plan = exudyn_engine.plan_of(start, springs, stop=stop, tolerance=tolerance)
        return exudyn_engine.one_run(figure, plan)

    tolerances = [10.0 ** (-k / 4) for k in range(2, 41)]
    counts = [round(stop / longest_step * 2.0 ** (k / 6)) for k in range(40)]
    return {
        OURS: Method(tolerances, agreed),
        ONE_RUN: Method(tolerances, once),
        MUJOCO: Method(
            [stop / n for n in counts], lambda step: mujoco.fall(stop, step, "RK4", None, None)
        ),
        OPENSIM: Method(tolerances, lambda accuracy: opensim.fall(stop, accuracy)),
    }


def _defaults(case: Case, methods: Mapping[str, Method]) -> Mapping[str, Callable[[], Fall]]:
    """Each engine as it is without any settings, and MuJoCo's better method at its step."""
    springs = exudyn_engine.radial_springs(case.figure, case.radial)
    plan = exudyn_engine.plan_of(case.displacements, springs)
    mujoco = mujoco_engine.MuJoCo(case.tree, case.radial)
    opensim = opensim_engine.OpenSim(case.tree, case.radial)
    integrator, step = mujoco_engine.MuJoCo.defaults()
    return {
        f"{OURS}: tolerance {plan.tolerance:g}, estimate, 50 frames": lambda: exudyn_engine.fall(
            case.figure, plan
        )[0],
        f"{exudyn_engine.NAME}, {exudyn_engine.WHOLE_CALL}": lambda: exudyn_engine.whole_call(
            case.figure, plan
        ),
        f"{ONE_RUN}: tolerance {plan.tolerance:g}": partial(methods[ONE_RUN].run, plan.tolerance),
        "OpenSim": lambda: opensim.fall(cases.STOP, None),
        f"MuJoCo: {integrator}, {1e3 * step:g} ms": lambda: mujoco.fall(
            cases.STOP, step, integrator, None, None
        ),
        f"MuJoCo: RK4, {1e3 * step:g} ms": partial(methods[MUJOCO].run, step),
    }


def _default_rows(made: Mapping[str, Fall], truth: Fall) -> Iterable[tables.Row]:
    ours = next(iter(made.values()))
    for name, run in made.items():
        yield {
            "engine": name,
            "error [rad]": last_error(truth, run),
            "wall [ms]": 1e3 * run.wall,
            "CPU [ms]": 1e3 * run.cpu,
            "ours over it, wall": ours.wall / run.wall,
            "ours over it, CPU": ours.cpu / run.cpu,
        }


def _cheapest_rows(
    made: Mapping[tuple[float, str, float], Fall], truth: Fall
) -> Iterable[tables.Row]:
    ours = {target: run for (target, name, _), run in made.items() if name == OURS}
    for (target, name, setting), run in made.items():
        yield {
            "at most [rad]": target,
            "method": name,
            "setting": setting,
            "error [rad]": last_error(truth, run),
            "wall [ms]": 1e3 * run.wall,
            "CPU [ms]": 1e3 * run.cpu,
            "ours over it, wall": ours[target].wall / run.wall,
            "ours over it, CPU": ours[target].cpu / run.cpu,
        }


def _aims(methods: Mapping[str, Method]) -> Iterable[Aim]:
    yield from _figure_aims(methods)
    yield from _prototype_aims()
    yield from _chain_aims()


def _figure_aims(methods: Mapping[str, Method]) -> Iterable[Aim]:
    settings = {
        "ours 1e-3": (OURS, 1e-3),
        "ours 1e-5": (OURS, 1e-5),
        "MuJoCo 4 ms": (MUJOCO, 4e-3),
        "MuJoCo 2 ms": (MUJOCO, 2e-3),
        "OpenSim": (OPENSIM, 1e-3),
    }
    runs = {key: partial(methods[name].run, value) for key, (name, value) in settings.items()}
    made = best_of(runs, ROUNDS)
    for ours, other, text, bound in (
        ("ours 1e-3", "MuJoCo 4 ms", "MuJoCo's RK4 at 4 ms", 1.0),
        ("ours 1e-3", "OpenSim", "OpenSim's default", 0.08),
        ("ours 1e-5", "MuJoCo 2 ms", "MuJoCo's RK4 at 2 ms", 0.8),
    ):
        tolerance = ours.removeprefix("ours ")
        yield _ratio(
            f"reference figure to {tolerance} rad with estimate and 50 frames, over {text}",
            bound,
            made[ours],
            made[other],
        )


def _prototype_aims() -> Iterable[Aim]:
    case = cases.prototype("standing")
    plan = exudyn_engine.plan_of(case.displacements, stop=PROTOTYPE_STOP)
    runs = {
        "integration": lambda: exudyn_engine.fall(case.figure, plan)[0],
        "the whole call": lambda: exudyn_engine.whole_call(case.figure, plan),
    }
    made = best_of(runs, ROUNDS)
    for name, bound in (("integration", 60.0), ("the whole call", 15.0)):
        yield Aim(
            f"prototype, 2 s with its own springs to 1e-3 rad: simulated time over that of {name}",
            inf,
            PROTOTYPE_STOP / made[name].wall,
            PROTOTYPE_STOP / made[name].cpu,
            bound,
        )


def _chain_aims() -> Iterable[Aim]:
    longest = cases.chain(LONGEST_CHAIN)
    truth = chains.exact(longest)
    runs: dict[str, Callable[[], Fall]] = {}
    for name, method in _methods(longest, chains.STOP, longest_step=0.01).items():
        if name != ONE_RUN:
            runs[name] = partial(method.run, coarsest(method, truth, CHAIN_TARGET))
    made = best_of(runs, CHAIN_ROUNDS)
    for other in (MUJOCO, OPENSIM):
        sentence = f"chain of {LONGEST_CHAIN} to {CHAIN_TARGET:g} rad, over {other}"
        yield _ratio(sentence, 0.05, made[OURS], made[other])
    growth = {count: _default_chain(count) for count in chains.COUNTS}
    times = best_of(growth, CHAIN_ROUNDS)
    doublings = [
        (times[count].wall / times[count // 2].wall, times[count].cpu / times[count // 2].cpu)
        for count in chains.COUNTS[1:]
    ]
    print("# doublings, wall:", ", ".join(f"{wall:.2f}" for wall, _ in doublings))
    walls, cpus = zip(*doublings, strict=True)
    sentence = "chains of 5 to 160 at 1e-3 rad: one twice as long over the other, at most"
    yield Aim(sentence, 2.0, max(walls), max(cpus))


def _default_chain(count: int) -> Callable[[], Fall]:
    case = cases.chain(count)
    plan = chains.plan_of(case, tolerance=chains.ACCURACY)
    return lambda: exudyn_engine.fall(case.figure, plan)[0]


def _ratio(sentence: str, bound: float, ours: Fall, other: Fall) -> Aim:
    return Aim(sentence, bound, ours.wall / other.wall, ours.cpu / other.cpu)
