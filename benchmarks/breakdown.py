"""Time per step of the parts of Exudyn's solver, by its own clocks.

Run with `python -m benchmarks.breakdown`, in a process of its own: the build of Exudyn that the
command loads has no clocks in it, so its ordinary build is measured here.
"""

from collections import Counter
from typing import Any
from unittest.mock import patch

from benchmarks import cases, chains, tables
from benchmarks.engines import exudyn_engine
from generator.simulation.exudyn_run import integrate
from springs import SpringSet

CLOCKS = {
    "springs and bodies": ("ODE2RHS", "massMatrix"),
    "Jacobian": ("totalJacobian",),
    "factorization": ("factorization",),
    "constraints": ("reactionForces", "AERHS"),
    "back substitution": ("newtonIncrement",),
    "energy sensors": ("writeSolution",),
}
"""Names of Exudyn's clocks, by what they stand for."""


def main() -> None:
    """Print the table."""
    reference, own = cases.reference(), cases.prototype("striding")
    springs = exudyn_engine.radial_springs(reference.figure, reference.radial)
    runs = [
        (name, case, given, step, cases.STOP)
        for name, case, given in (
            ("reference", reference, springs),
            ("prototype", own, None),
            ("prototype without springs", own, SpringSet()),
        )
        for step in (2e-3, 5e-4)
    ]
    for count in chains.COUNTS:
        case = cases.chain(count)
        given = exudyn_engine.radial_springs(case.figure, case.radial)
        runs.append((f"chain of {count}", case, given, chains.STEP, chains.STOP))
    rows: list[tables.Row] = []
    for name, case, given, step, stop in runs:
        clocked = _Clocked()
        with clocked.patched():
            plan = exudyn_engine.exudyn_plan_of(case.displacements, given, step=step, stop=stop)
            made, _ = exudyn_engine.fall(case.figure, plan)
        rows.append(
            {
                "figure": name,
                "step [s]": step,
                "wall [us]": 1e6 * made.wall / clocked.counts["steps"],
                **clocked.row(),
            }
        )
    tables.show(rows)


class _Clocked:
    """Sums of the solver's clocks and counters over a run."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self._settings, self._advance = integrate._settings, integrate._advance

    def patched(self) -> Any:
        """While this context lasts, the solver's clocks run and are read."""
        return patch.multiple(integrate, _settings=self._with_clocks, _advance=self._and_read)

    def _with_clocks(self, newton: float) -> Any:
        settings = self._settings(newton)
        settings.displayComputationTime = True
        return settings

    def _and_read(
        self, assembly: Any, settings: Any, interval: Any, count: int, *rest: Any, **keep: bool
    ) -> None:
        self._advance(assembly, settings, interval, count, *rest, **keep)
        solver = assembly.mbs.sys["dynamicSolver"]
        self.counts["steps"] += count
        self.counts["iterations"] += solver.it.newtonStepsCount
        self.counts["Jacobians"] += solver.it.newtonJacobiCount
        for clocks in (("total",), *CLOCKS.values()):
            for clock in clocks:
                self.counts[clock] += getattr(solver.timer, clock)

    def row(self) -> dict[str, float]:
        """A step's share of each clock [us], and of the counters."""
        steps = self.counts["steps"]
        if not self.counts["total"]:
            raise RuntimeError("this build of Exudyn has no clocks")
        shares = {
            f"{name} [us]": 1e6 * sum(self.counts[clock] for clock in clocks) / steps
            for name, clocks in CLOCKS.items()
        }
        solver = {"solver [us]": 1e6 * self.counts["total"] / steps}
        return {
            **solver,
            **shares,
            "iterations": self.counts["iterations"] / steps,
            "Jacobians": self.counts["Jacobians"] / steps,
        }


if __name__ == "__main__":
    main()
