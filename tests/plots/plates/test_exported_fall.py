"""The plate of exported models: its claims, and the table that it draws."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.exports import BENT
from plots.literature import Measurements, read_measurements
from plots.plate import ClaimKind
from plots.plates import exported_fall
from plots.plates.exported_fall import MUJOCO, OPENSIM, OUR_LAWS, START_ANGLES
from tests.plots.drawn import data, plate


def test_the_laws_themselves_move_the_figure_as_here() -> None:
    claims = plate("exported_fall").claims
    exact = [claim for claim in claims if claim.kind is ClaimKind.VERIFICATION]
    assert len(exact) == 2
    assert [claim.sentence for claim in exact if not claim.holds] == []
    assert all(claim.measured > 0.0 for claim in claims)


def test_the_approximation_of_mujoco_s_file_is_compared() -> None:
    (claim,) = [c for c in plate("exported_fall").claims if c.kind is ClaimKind.COMPARISON]
    assert claim.at_most == 10.0
    distances = data("exported_fall").distances(MUJOCO)[
        data("exported_fall").run.times < 0.4 + 1e-9
    ]
    assert claim.measured == pytest.approx(1e3 * distances.max())
    assert claim.measured < 1e3 * data("exported_fall").distances(MUJOCO).max()


@pytest.mark.parametrize("program", [OPENSIM, OUR_LAWS])
def test_another_motion_fails(program: str) -> None:
    fall = data("exported_fall")
    rows = [
        {**row, "left_elbow_1 [rad]": str(float(row["left_elbow_1 [rad]"]) + 0.01)}
        if row["program"] == program
        else row
        for row in fall.measured.rows
    ]
    changed = replace(fall, measured=Measurements(fall.measured.provenance, rows))
    failing = [claim for claim in exported_fall._claims(changed) if not claim.holds]
    words = "OpenSim" if program == OPENSIM else "callback"
    assert any(words in claim.sentence for claim in failing)


def test_the_start_is_that_of_the_benchmark() -> None:
    assert START_ANGLES == BENT
    fall = data("exported_fall")
    for program in (MUJOCO, OUR_LAWS, OPENSIM):
        assert fall.distances(program)[0] < 1e-6


def test_every_program_has_every_frame() -> None:
    table = read_measurements("exports_motion")
    assert table.values("program") == [MUJOCO, OUR_LAWS, OPENSIM]
    for program in table.values("program"):
        times = table.select_rows(program=program).column("time [s]")
        assert times == pytest.approx(data("exported_fall").run.times, abs=1e-9)


def test_the_figure_moves() -> None:
    fall = data("exported_fall")
    for joint in exported_fall._JOINTS:
        for program in ("", MUJOCO):
            assert np.ptp(fall.joint_angles(program, joint)) > 30.0
