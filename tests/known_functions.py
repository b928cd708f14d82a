"""Studies of functions whose sensitivity indices have a closed form."""

from benchmarks.sensitivity import KnownFunction, ishigami, sobol_g
from generator import Plan, read_figure
from generator.model import Model
from generator.study.study import (
    Design,
    DesignKind,
    Measure,
    Parameter,
    RunResult,
    Sensitivity,
    Statistic,
    Study,
    Uniform,
)
from springs.backends import Array

ISHIGAMI, SOBOL_G = ishigami(), sobol_g()

_FIGURE = read_figure("pendulum")


def known_study(
    known: KnownFunction,
    kind: DesignKind,
    runs: int,
    seed: int = 1,
    *,
    resamples: int = 200,
    bounds: tuple[float, float] = (0.0, 1.0),
) -> Study:
    names = [f"p{k}" for k in range(len(known.first))]
    return Study(
        "pendulum",
        Model(_FIGURE),
        Plan(stop=0.1),
        {name: Parameter(name, (f"springs.{name}.scale",), Uniform(*bounds)) for name in names},
        Design(kind, runs, seed),
        {"swing": Measure("swing", "shoulder.2 [deg]", Statistic.LARGEST)},
        sensitivity=Sensitivity(0.95, resamples),
    )


def done(**measures: float) -> RunResult:
    return RunResult("done", "", measures)


def results(outputs: Array) -> list[RunResult]:
    return [done(swing=float(each)) for each in outputs]
