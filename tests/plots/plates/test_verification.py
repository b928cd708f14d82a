"""The engines agree as the plate says, in runs made now and in the table that it draws."""

import numpy as np
import pytest

from benchmarks.cases import POSES
from plots.literature import read_measurements
from plots.plates import verification
from plots.plates.verification import AGREEMENT_TOLERANCE
from tests.plots.drawn import plate


def test_all_claims_hold() -> None:
    claims = plate("verification").claims
    assert len(claims) == 3
    assert [claim.sentence for claim in claims if not claim.holds] == []
    assert all(claim.measured > 0.0 for claim in claims)


def test_a_run_from_another_start_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    poses = {"standing": {"left_knee": (1.0,)}}
    monkeypatch.setattr(verification, "START_POSES", poses)
    (claim,) = verification._claims(read_measurements("verification_motion"))
    assert not claim.holds


def test_the_starts_are_those_of_the_benchmarks() -> None:
    assert verification.START_POSES == POSES


def test_the_stored_runs_of_the_engines_agree_and_are_converged() -> None:
    runs = read_measurements("verification")
    for start in runs.values("start"):
        for engine in runs.values("engine"):
            rows = runs.select_rows(start=start, engine=engine)
            for header in ("joints [rad]", "centre of mass [m]", "energy [J]"):
                assert rows.column(header)[-1] < AGREEMENT_TOLERANCE
            assert float(rows.rows[-2]["change to next [rad]"]) < AGREEMENT_TOLERANCE
    ours = runs.select_rows(engine="Exudyn")
    assert np.all(ours.column("joints [rad]") < ours.column("setting"))


def test_every_engine_is_there_from_every_start() -> None:
    runs = read_measurements("verification")
    for start in ("standing", "striding", "reaching"):
        engines = runs.select_rows(start=start).values("engine")
        assert engines == ["Exudyn", "MuJoCo", "Pinocchio", "OpenSim", "Drake"]


def test_the_motions_are_those_of_the_finest_runs() -> None:
    runs, motion = read_measurements("verification"), read_measurements("verification_motion")
    for start in runs.values("start"):
        for engine in runs.values("engine"):
            finest = runs.select_rows(start=start, engine=engine).column("joints [rad]")[-1]
            drawn = motion.select_rows(start=start, engine=engine).column("joints [rad]")
            assert drawn.max() == finest
            assert drawn[0] < AGREEMENT_TOLERANCE * 1e-6


def test_the_engines_move() -> None:
    for start in ("standing", "striding", "reaching"):
        one = read_measurements("verification_motion").select_rows(start=start, engine="Exudyn")
        for joint in ("right_elbow", "left_shoulder", "right_hip_joint", "left_knee"):
            assert np.ptp(one.column(f"{joint} [deg]")) > 15.0
