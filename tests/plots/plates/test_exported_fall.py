"""The plate of exported models: its claims, and the table that it draws."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.exports import BENT
from plots.literature import Measurements, read_measurements
from plots.plates import exported_fall
from plots.plates.exported_fall import MUJOCO, OPENSIM, OUR_LAWS, START_ANGLES
from tests.plots.drawn import data


@pytest.mark.parametrize("program", [OPENSIM, MUJOCO, OUR_LAWS])
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
    words = {OPENSIM: "in OpenSim", MUJOCO: "MuJoCo by the file", OUR_LAWS: "in a callback"}
    (claim,) = failing
    assert words[program] in claim.sentence


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
        assert times == pytest.approx(data("exported_fall").times, abs=1e-9)


def test_the_figure_moves() -> None:
    fall = data("exported_fall")
    for joint in exported_fall._JOINTS:
        for program in ("", MUJOCO):
            assert np.ptp(fall.joint_angles(program, joint)) > 30.0
