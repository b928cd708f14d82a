"""Blows to the heads of limp persons who fall, by the kind of their neck.

    python -m benchmarks.head_blows FIGURE ... [--starts 40]

Each figure falls from the starts of `mover simulate FIGURE --fall faint`, without tone. A row has
the falls in which the head hits, the medians and quartiles of the effective mass, which is the
largest force on the head over the largest acceleration of its centre of mass, and what force and
acceleration are per speed of the first touch, by least squares through zero. Largest values are
those of all steps. The last columns are the seconds of all falls, in turns with the other figures,
and the effective mass of `mover describe`.
"""

import argparse
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import tables
from generator import Model, fall_plan, read_figure, simulate
from generator.kinematics.effective_mass import HEAD, head_effective_masses
from generator.rotations import Array
from generator.run_options import Integrator
from generator.simulation import run

STANDARD_GRAVITY = 9.80665

LEAST_SPEED = 0.5
"""Speed of a touch from which it is a blow [m/s]."""


class Steps:
    """Contact of the steps of the last run, which recordings do not hold."""

    def __init__(self) -> None:
        """Watch the contact of all runs."""
        self._original = run.build_contact_record
        run.build_contact_record = self._record  # pyright: ignore[reportPrivateImportUsage]
        self.force = self.acceleration = 0.0

    def _record(self, model: Any, contact: Any, frames: Any, figure: Any, *rest: Any) -> Any:
        steps, bodies = contact.steps, list(figure.bodies)
        forces = steps.forces[:, list(model.spheres).index(HEAD)]
        accelerations = steps.accelerations[:, bodies.index(HEAD)]
        self.force, self.acceleration = (
            float(np.linalg.norm(vectors, axis=1).max()) for vectors in (forces, accelerations)
        )
        return self._original(model, contact, frames, figure, *rest)


def slope(speeds: Array, values: Array) -> float:
    """Return the least-squares slope through zero."""
    return float(speeds @ values / (speeds @ speeds))


def main() -> None:
    """Print a row for each figure."""
    parser = argparse.ArgumentParser()
    parser.add_argument("figures", nargs="+", type=Path)
    parser.add_argument("--starts", type=int, default=40)
    parser.add_argument("--integrator", type=Integrator, default=Integrator.COMPILED)
    asked = parser.parse_args()
    models = {path: Model.of(read_figure(path)) for path in asked.figures}
    steps, seconds = Steps(), dict.fromkeys(models, 0.0)
    blows: dict[Path, list[tuple[float, float, float]]] = {path: [] for path in models}
    for seed in range(-1, asked.starts):  # the first one compiles
        for path, model in models.items():
            plan = replace(fall_plan(model.figure, "faint", max(seed, 0)), tone=None)
            plan = replace(plan, integrator=asked.integrator)
            start = time.perf_counter()
            recording = simulate(model, plan)
            if seed < 0:
                continue
            seconds[path] += time.perf_counter() - start
            assert recording.contact is not None
            speed = recording.contact.segments[HEAD].impact_speed
            if speed >= LEAST_SPEED:
                blows[path].append((speed, steps.force, steps.acceleration))
    rows: list[tables.Row] = []
    for path, model in models.items():
        speed, force, acceleration = np.array(blows[path]).T
        mass = force / acceleration
        low, middle, high = np.percentile(mass, (25.0, 50.0, 75.0))
        described = head_effective_masses(model.figure)
        rows.append(
            {
                "figure": path.stem,
                "blows": len(mass),
                "mass [kg]": f"{middle:.1f} ({low:.1f} to {high:.1f})",
                "kN per m/s": f"{1e-3 * slope(speed, force):.2f}",
                "g per m/s": f"{slope(speed, acceleration) / STANDARD_GRAVITY:.1f}",
                "time [s]": f"{seconds[path]:.1f}",
                "described [kg]": ", ".join(f"{value:.1f}" for value in described.values()),
            }
        )
    tables.show(rows)


if __name__ == "__main__":
    main()
