"""The plate of falls on a floor: its claims, its tables, and the starts that it repeats."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.falls import HEADERS, MANNERS, STARTS
from generator.figure_file import read_figure
from plots.literature import Measurements, read_measurements
from plots.plate import ClaimKind
from plots.plates import floor_falls
from plots.plates.floor_falls import COLLAPSE, OWN_ENGINE, QUANTITIES, contacts, select_fall
from tests.plots.drawn import plate

FALLS = read_measurements("falls")


def test_the_kinds_of_claims() -> None:
    claims = plate("floor_falls").claims
    assert [claim.kind for claim in claims] == [
        ClaimKind.VERIFICATION,
        *[ClaimKind.COMPARISON] * (len(QUANTITIES) + len(MANNERS) - 1),
        ClaimKind.VERIFICATION,
    ]
    assert all(claim.holds for claim in (claims[0], claims[-1]))


def test_a_run_from_other_angles_fails() -> None:
    starts = read_measurements("falls_starts")
    rows = [
        {**row, "angle [rad]": "0.6"} if row["joint"].endswith("knee") else row
        for row in starts.rows
    ]
    changed = Measurements(starts.provenance, rows)
    (claim,) = floor_falls._rerun_claims(read_measurements("falls_heights"), changed)
    assert not claim.holds


@pytest.mark.parametrize("quantity", QUANTITIES, ids=lambda quantity: quantity.header)
def test_a_mean_far_from_the_others_differs(quantity) -> None:
    rows = [
        {**row, quantity.header: str(3.0 * float(row[quantity.header]))}
        if row["engine"] == OWN_ENGINE
        else row
        for row in FALLS.rows
    ]
    number = QUANTITIES.index(quantity)
    claims = list(floor_falls._claims(replace(FALLS, rows=rows)))
    assert not claims[number].holds


def test_the_starts_are_those_of_the_benchmarks() -> None:
    starts = read_measurements("falls_starts")
    figure = read_figure("prototype")
    for seed in range(STARTS):
        some = starts.select_rows(start=str(seed))
        for joint, angles in MANNERS[COLLAPSE].start(figure, seed).displacements.items():
            stored = some.select_rows(joint=joint).column("angle [rad]")
            assert stored == pytest.approx(np.array(angles), abs=1e-9)


def test_every_engine_has_every_fall() -> None:
    assert [engine for engine, _ in contacts(FALLS)] == [
        *[OWN_ENGINE] * 2,
        *["MuJoCo"] * 3,
        "Drake",
    ]
    for contact in contacts(FALLS):
        for fall in MANNERS:
            table = select_fall(FALLS, fall, contact)
            assert table.column("start").tolist() == list(range(STARTS))
            for header in HEADERS.values():
                assert np.all(np.isfinite(table.column(header)))


def test_figures_come_to_rest_on_the_floor() -> None:
    table = FALLS.select_rows(fall=COLLAPSE)
    assert np.all(np.abs(table.column(floor_falls.CARRIED) - 1.0) < 0.1)
    heights = read_measurements("falls_heights")
    starts = [key for key in heights.rows[0] if key.startswith("start ")]
    for header in starts:
        assert np.all(heights.column(header) > 0.04)
        assert np.all(heights.column(header) < 1.1)
