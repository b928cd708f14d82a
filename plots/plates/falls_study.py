"""The shipped studies of falls: which differences between people matter, and how stiffness does.

Their tables in `plots/data` are what these commands write, without journal and lock:

    mover sweep falls -o plots/data/falls
    mover sweep falls_stiffness -o plots/data/falls_stiffness
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from generator.study.run_case import run_case
from generator.study.sensitivity import INDICES_NAME, IndexKind, StudyIndices, read_indices
from generator.study.study_file import find_study, read_study
from plots.plate import Claim, Plate
from plots.study_plate import StudyRuns, measure_plates, read_runs, sensitivity_plates
from springs.backends import Array

DATA = Path(__file__).parents[1] / "data"
"""Folder of the tables."""

FALLS, STIFFNESS = "falls", "falls_stiffness"
"""Names of the studies, their folders and their plates."""

RANKED = ("pelvis_force", "pelvis_time", "head_force", "damped_energy")
"""Measures of the ranking; the time of the head's impact is in the table."""

REPEATED = 1e-3
"""Largest relative difference of a run that is computed again, for other processors: rounding
grows in a fall."""


def falls() -> Plate:
    """Rank differences between people by how much they change a fall."""
    indices, runs = read_indices(DATA / FALLS / INDICES_NAME), read_runs(DATA / FALLS)
    shown = replace(indices, measures={name: indices.measures[name] for name in RANKED})
    (plate,) = sensitivity_plates(shown, FALLS)
    return replace(
        plate,
        name=FALLS,
        title="Which differences between people change a fall",
        caption=(
            "A man stands, lets go of all muscles and falls backwards onto pelvis and head. "
            "Stature and body mass index vary as in ANSUR II, passive stiffness and damping by a "
            "factor of 1.5 a standard deviation, which is measured at the elbow only. "
            f"{_spread_sentence(runs)} {plate.caption}"
        ),
        claims=(*_leading_claims(indices), _repeated_run(FALLS, runs)),
    )


def falls_stiffness() -> Plate:
    """Draw measures of a fall over the stiffness of all joints."""
    runs = read_runs(DATA / STIFFNESS)
    (plate,) = measure_plates(replace(runs, measures={n: runs.measures[n] for n in RANKED}), "")
    return replace(
        plate,
        name=STIFFNESS,
        title="A fall of the mean man with softer and stiffer joints",
        claims=(_repeated_run(STIFFNESS, runs),),
    )


def _spread_sentence(runs: StudyRuns) -> str:
    """State the 5 % and 95 % quantiles of the forces."""
    low, middle, high = np.nanquantile(runs.measures["pelvis_force"], (0.05, 0.5, 0.95)) / 1e3
    head = np.nanquantile(runs.measures["head_force"], (0.05, 0.5, 0.95)) / 1e3
    return (
        f"In {len(runs.is_done)} runs the force on the pelvis is {low:.1f} to {high:.1f} kN "
        f"(5 % to 95 %; median {middle:.1f}), that on the head {head[0]:.1f} to {head[2]:.1f} kN "
        f"(median {head[1]:.1f})."
    )


def _repeated_run(name: str, runs: StudyRuns) -> Claim:
    """Compute the first run again."""
    values = [float(column[0]) for column in runs.parameters.values()]
    result = run_case(read_study(find_study(name)), values)
    differences = [
        abs((result.measures[measure] or np.nan) / column[0] - 1.0)
        for measure, column in runs.measures.items()
    ]
    return Claim(
        "The first run, computed again, has the measures of the table: largest relative difference",
        float(np.max(differences)),
        at_most=REPEATED,
    )
