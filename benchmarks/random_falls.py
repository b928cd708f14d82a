"""Falls of random persons: `python -m benchmarks.random_falls [PERSONS [STARTS]]`.

Each person falls from starts of all kinds of falls, with parts, neck and tone, by the method of
studies. Printed are runs that failed or hold numbers that are not finite, the balance of energy
over what is exchanged, and what the ground carries of those that have come to rest. Two processes
share the work.
"""

import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from benchmarks.persons import draw_measures
from generator import Recording, simulate
from generator.run_options import Integrator
from generator.simulation.falls import FALLS, fall_plan
from generator.study.person_figure import make_person
from generator.study.study import PersonArguments

PERSONS, STARTS = 20, 50

STOP = 3.0
"""Duration of a fall [s]."""

REST_ENERGY = 0.02
"""Kinetic energy at the end below which a person has come to rest [J]."""


class Row(NamedTuple):
    """Measures of one fall.

    Attributes:
        kind: kind of the fall.
        ending: how the run ended, or "not finite".
        imbalance: error of the energy balance over the exchanged energy.
        carried: mean force of the ground in the last 0.2 s over the weight; NaN for one that still
            moves.
    """

    kind: str
    ending: str
    imbalance: float
    carried: float


def is_finite(recording: Recording) -> bool:
    """Return whether poses, energies and forces of contact are finite numbers."""
    assert recording.contact is not None
    forces = (recording.contact.ground_reaction, *recording.contact.forces.values())
    arrays = (*recording.poses.values(), *recording.energy.values(), *forces)
    return all(bool(np.all(np.isfinite(values))) for values in arrays)


def fall(person: int, starts: int) -> list[Row]:
    """Return the falls of a random person."""
    measures = draw_measures(person)
    arguments = PersonArguments(measures.sex, measures.stature, measures.mass)
    model = make_person(arguments, with_spheres=True)
    rows: list[Row] = []
    for start in range(starts):
        kind = list(FALLS)[start % len(FALLS)]
        plan = fall_plan(model.figure, kind, 1000 * person + start)
        recording = simulate(model, replace(plan, stop=STOP, integrator=Integrator.IMPLICIT))
        assert recording.contact is not None
        ending = recording.outcome.ending.value if is_finite(recording) else "not finite"
        exchanged = max(float(np.ptp(values)) for values in recording.energy.values())
        error = float(np.max(np.abs(recording.energy_balance - recording.energy_balance[0])))
        rests = recording.energy["kinetic"][-1] < REST_ENERGY
        carried = recording.contact.weight_carried if rests else None
        rows.append(Row(kind, ending, error / exchanged, np.nan if carried is None else carried))
    return rows


def main(persons: int = PERSONS, starts: int = STARTS) -> None:
    """Print what was found."""
    with ProcessPoolExecutor(2) as pool:
        rows = [
            row for some in pool.map(partial(fall, starts=starts), range(persons)) for row in some
        ]
    print(f"{len(rows)} falls of {persons} random persons")
    print("kinds:", dict(Counter(row.kind for row in rows)))
    print("endings:", dict(Counter(row.ending for row in rows)))
    imbalance = np.array([row.imbalance for row in rows])
    shares = ", ".join(f"{np.percentile(imbalance, q):.2g}" for q in (50, 90, 99, 100))
    print(f"energy balance over exchanged energy, percentiles 50, 90, 99, 100: {shares}")
    carried = np.array([row.carried for row in rows])
    carried = carried[~np.isnan(carried)]
    print(f"at rest after {STOP:g} s: {len(carried)}, which the ground carries to")
    if len(carried):
        print("  ", np.percentile(carried, [0, 5, 50, 95, 100]).round(5))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
