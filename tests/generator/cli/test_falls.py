"""`mover simulate FIGURE --fall KIND`: one fall, and many with `--starts`."""

import csv
import json
import re
from math import degrees
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import Result

from generator import Ending, fall_plan, read_figure
from generator.cli.falls import share_interval
from generator.motion_files.npz import read_npz
from generator.simulation.falls import fall_direction
from generator.study.falls import HANDS, HEAD, HIP, PELVIS
from tests.command import answer, mover, run

SEEDS = range(3, 6)
SHORT = ("simulate", "male50", "--fall", "faint", "--stop", 1)
STATISTICS = {
    "pelvis_speed_m_per_s",
    "head_speed_m_per_s",
    "hand_speed_m_per_s",
    "descent_ms",
    "hand_lead_ms",
    "hip_force_N",
    "hip_force_body_weights",
    "head_force_N",
    "head_acceleration_g",
}
SHARES = {"head_hit_share", "hand_hit_share", "pelvis_hit_share"}


class Many:
    """Three falls from the command line, and their table."""

    def __init__(self, path: Path) -> None:
        words = ("--seed", SEEDS[0], "--starts", len(SEEDS), "--json", "-o", path)
        self.data: Any = json.loads(run(*SHORT, *words).stdout)
        with path.open(encoding="utf-8", newline="") as stream:
            self.rows = list(csv.DictReader(stream))


@pytest.fixture(scope="module")
def many(tmp_path_factory: pytest.TempPathFactory) -> Many:
    return Many(tmp_path_factory.mktemp("falls") / "falls.csv")


@pytest.fixture(scope="module")
def singles() -> list[Any]:
    words = ("--integrator", "implicit")
    return [answer(*SHORT, *words, "--seed", seed) for seed in SEEDS]


def test_many_falls_are_single_runs(many: Many, singles: list[Any]):
    keys = ("first_contact_s", "impact_speed_m_per_s", "peak_force_N")
    for row, seed, single in zip(many.rows, SEEDS, singles, strict=True):
        assert float(row["seed"]) == seed
        assert float(row["direction_deg"]) == pytest.approx(degrees(fall_direction("faint", seed)))
        assert single["fall"] == {"kind": "faint", "seed": seed}
        for part in (PELVIS, HEAD, *HANDS):
            touch, speed, force = (single["contact"][key][part] for key in keys)
            cells = [row[f"{part}_{name}"] for name in ("touch_s", "speed_m_per_s", "force_N")]
            expected = ["", "", force] if touch is None else [touch, speed, force]
            assert [float(cell) if cell else "" for cell in cells] == expected


def test_the_json_has_the_means_of_the_single_runs(many: Many, singles: list[Any]):
    falls = many.data["falls"]
    assert falls.keys() == {"n"} | SHARES | STATISTICS
    assert falls["n"] == 3
    assert all(falls[name].keys() == {"mean", "sd"} for name in STATISTICS)
    contacts = [single["contact"] for single in singles]
    touches = [one["first_contact_s"] for one in contacts]
    fell = [k for k, one in enumerate(touches) if one[PELVIS] is not None]
    speeds = [contacts[k]["impact_speed_m_per_s"][PELVIS] for k in fell]
    assert falls["pelvis_speed_m_per_s"]["mean"] == pytest.approx(np.mean(speeds))
    assert falls["pelvis_speed_m_per_s"]["sd"] == pytest.approx(np.std(speeds, ddof=1))
    descents = [1e3 * touches[k][PELVIS] for k in fell]
    assert falls["descent_ms"]["mean"] == pytest.approx(np.mean(descents))
    hands = [1e3 * min(touches[k][hand] for hand in HANDS) for k in fell]
    assert falls["hand_lead_ms"]["mean"] == pytest.approx(np.mean(descents) - np.mean(hands))
    hips = [one["parts"][HIP] for one in contacts]
    forces = [hip["peak_force_N"] for hip in hips if hip["first_contact_s"] is not None]
    assert falls["hip_force_N"]["mean"] == pytest.approx(np.mean(forces))
    weight = 9.81 * sum(body.mass or 0.0 for body in read_figure("male50").bodies.values())
    assert falls["hip_force_body_weights"]["mean"] == pytest.approx(np.mean(forces) / weight)
    assert falls["head_hit_share"] == np.mean([one[HEAD] is not None for one in touches])
    assert falls["pelvis_hit_share"] == len(fell) / len(singles)
    assert falls["hand_hit_share"] == np.mean(
        [any(one[hand] is not None for hand in HANDS) for one in touches]
    )
    said = {key: many.data[key] for key in ("figure", "fall", "seed", "starts", "outcomes")}
    assert said == {
        "figure": "male50",
        "fall": "faint",
        "seed": 3,
        "starts": 3,
        "outcomes": {"done": 3},
    }


def test_the_table_of_many_falls_fits_a_screen_and_states_their_tone_and_parameters(many: Many):
    words = ("simulate", "male50", "--fall", "push", "--starts", 2, "--stop", 0.6)
    scale = ("--scale", "contact.pelvis.stiffness_scale=1.5")
    text, data = run(*words, *scale).stdout, answer(*words, *scale, "--stop", 0.05)
    tone = "fall; righting neck 0.45, trunk 0.45; strengths of axes: 3 published, 6 estimate"
    assert data["tone"] == tone
    assert data["scale"] == {"contact.pelvis.stiffness_scale": 1.5}
    assert f"\ntone   {tone}\nscale  contact.pelvis.stiffness_scale = 1.5\n" in text
    assert "scale" not in many.data
    lines = text.splitlines()
    assert lines[0] == "male50: 2 falls of kind push, seeds 0 to 1: 2 done"
    assert len(lines) <= 24
    assert max(map(len, lines)) <= 90
    assert re.search(r"^speed of the first hand \[m/s\] +[0-9.]+ \([0-9.]+\) ", text, re.MULTILINE)
    assert "head   hits in 0 % of falls (95 % interval 0 to 66 %)" in lines


@pytest.fixture(scope="module")
def one() -> Result:
    return run("simulate", "male50", "--fall", "slip", "--seed", 4, "--stop", 0.04)


def test_a_single_fall_says_that_it_is_one_of_many(one: Result):
    (row,) = re.findall(r"^fall +(.*)$", one.stdout, re.MULTILINE)
    assert row == "slip, seed 4: one of many, whose spread --starts 40 shows"


def test_a_fall_starts_as_in_python_and_lasts_two_seconds(tmp_path: Path):
    path = tmp_path / "fall.npz"
    words = ("--fall", "push", "--seed", 7, "--integrator", "implicit", "-q")
    run("simulate", "male50", *words, "-o", path)
    _, recording = read_npz(path)
    plan = fall_plan(read_figure("male50"), "push", 7)
    assert recording.times[-1] == plan.stop == 2.0
    for name in ("left_knee", "right_hip_joint"):
        assert recording.displacements[name][0] == pytest.approx(plan.displacements[name], abs=1e-9)
    assert recording.outcome.ending is Ending.DONE


def test_what_a_fall_implies_may_be_said(one: Result):
    words = ("--floor", "--free-root", "--height", 0)
    again = run("simulate", "male50", "--fall", "slip", "--seed", 4, "--stop", 0.04, *words)
    lines = [
        [line for line in each.stdout.splitlines() if not line.startswith("time")]
        for each in (one, again)
    ]
    assert lines[0] == lines[1]


def test_a_table_of_falls_is_a_csv_file(tmp_path: Path):
    result = mover(*SHORT, "--starts", 2, "-o", tmp_path / "falls.action")
    assert result.exit_code == 2
    assert "the table of runs is a .csv or a .parquet file" in result.stderr


@pytest.mark.slow
def test_falls_that_fail_are_counted():
    result = mover("simulate", "male50", "--fall", "stairs", "--starts", 2, "--height", 0)
    assert result.exit_code == 3
    assert result.stdout.startswith("male50: 2 falls of kind stairs, seeds 0 to 1: 2 wrong input")
    assert "2 of 2 falls failed, first wrong input: segment" in result.stderr


@pytest.mark.parametrize(
    ("share", "count", "interval"), [(0.5, 10, (0.2366, 0.7634)), (0.0, 20, (0.0, 0.1611))]
)
def test_the_interval_of_a_share_is_that_of_wilson(
    share: float, count: int, interval: tuple[float, float]
):
    assert share_interval(share, count) == pytest.approx(interval, abs=1e-4)
    mirrored = tuple(1.0 - end for end in reversed(share_interval(share, count)))
    assert share_interval(1.0 - share, count) == pytest.approx(mirrored)
