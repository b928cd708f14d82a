"""The plates of falls: their tables are those of the shipped studies, and their claims can fail."""

import csv
from dataclasses import replace

import pytest

from generator.study.designs import design_points
from generator.study.sensitivity import IndexKind, estimate_indices, read_indices
from generator.study.study import RunResult
from generator.study.study_file import STUDY_FILE, read_study
from plots.plates.study_of_falls import DATA, _index_claims
from plots.study_plate import read_runs

PEOPLE = DATA / "study_falls"


@pytest.mark.parametrize("name", ["falls", "falls_stiffness"])
def test_the_tables_are_of_the_shipped_studies(name: str) -> None:
    folder = DATA / f"study_{name}"
    assert (folder / "study.toml").read_bytes() == STUDY_FILE.find(name).read_bytes()
    points, runs = design_points(read_study(STUDY_FILE.find(name))), read_runs(folder)
    for column, values in zip(points.T, runs.parameters.values(), strict=True):
        assert values == pytest.approx(column, rel=1e-9)
    assert runs.is_done.all()


def test_the_indices_are_those_of_the_table() -> None:
    study = read_study(STUDY_FILE.find("falls"))
    with (PEOPLE / "runs.csv").open(encoding="utf-8", newline="") as table:
        rows = [
            RunResult(
                row["outcome"],
                row["message"],
                {name: float(row[name]) if row[name] else None for name in study.measures},
            )
            for row in csv.DictReader(table)
        ]
    fresh, shipped = estimate_indices(study, rows), read_indices(PEOPLE / "sensitivity.json")
    for name, measure in fresh.measures.items():
        for parameter, estimates in measure.parameters.items():
            for kind, estimate in estimates.items():
                other = shipped.measures[name].parameters[parameter][kind]
                assert (other.value, other.low, other.high) == pytest.approx(
                    (estimate.value, estimate.low, estimate.high), rel=1e-6, abs=1e-9
                )


def test_a_claim_fails_where_the_interval_reaches_the_bound() -> None:
    indices = read_indices(PEOPLE / "sensitivity.json")
    measure = indices.measures["head_force"]
    tone = measure.parameters["tone"]
    wide = replace(tone[IndexKind.TOTAL], low=0.02)
    parameters = {**measure.parameters, "tone": {**tone, IndexKind.TOTAL: wide}}
    changed = replace(measure, parameters=parameters)
    changed = replace(indices, measures={**indices.measures, "head_force": changed})
    failing = [claim.sentence for claim in _index_claims(changed) if not claim.holds]
    assert len(failing) == 1
    assert "tone" in failing[0]
