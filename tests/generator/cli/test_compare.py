"""`mover compare`."""

from pathlib import Path

import numpy as np
import pytest

from generator.kinematics.placement import initial_displacements
from generator.kinematics.tree import Tree
from tests.command import answer, run
from tests.generator.cli.conftest import MotionWriter


@pytest.fixture(scope="module")
def twisting(prototype: Tree, write_motion: MotionWriter) -> Path:
    """The waist twists by 4 degrees a frame, both knees bend by 1, and an elbow by 0.5."""
    rows = {name: np.tile(v, (8, 1)) for name, v in initial_displacements(prototype).items()}
    rows["waist"] = np.radians(np.outer(np.arange(8), [0.0, 4.0, 0.0]))
    for knee in ("left_knee", "right_knee"):
        rows[knee] = rows[knee] + np.radians(np.arange(8))[:, None]
    rows["left_elbow"] = rows["left_elbow"] + 0.5 * np.radians(np.arange(8))[:, None]
    return write_motion("twisting.action", prototype.figure, rows, [0.1 * k for k in range(8)])


def test_the_table_names_what_differs(bending: Path, twisting: Path):
    text = run("compare", bending, twisting).stdout
    lines = text.splitlines()
    assert lines[0] == "0 to 0.7 s, 8 frames."
    first = "more than 5 deg apart from 0.0781 s on, first waist mostly about y"
    assert f"twisting against bending: {first}" in lines
    assert lines[3].split() == ["angle", "[deg]", "bending", "twisting", "differs", "at", "[s]",
                                "5", "deg", "from"]  # fmt: skip
    knees = next(line for line in lines if line.startswith("left/right_knee"))
    assert knees.split()[-4:] == ["7.0", "7.0", "0.700", "0.500"]
    assert lines[-1] == "wrote  nothing; -o FILE.html draws them, .csv has all"
    assert len(lines) < 40


def test_json_has_all_rows_of_the_table(bending: Path, twisting: Path, tmp_path: Path):
    said = answer("compare", bending, twisting, "-o", tmp_path / "out.csv", "--threshold", 10)
    assert (said["start_s"], said["stop_s"], said["frames"]) == (0.0, pytest.approx(0.7), 8)
    assert said["threshold_deg"] == 10.0
    assert [one["name"] for one in said["motions"]] == ["bending", "twisting"]
    assert said["files"] == [str(tmp_path / "out.csv")]
    rows = {row["name"]: row for row in said["differences"]}
    knee, waist = rows["left_knee"], rows["waist"]
    assert knee["difference"] == pytest.approx(7.0)
    assert (knee["unit"], knee["column"], knee["divergence_s"]) == ("deg", "left_knee.1", None)
    # The angle between a bend by 35 and a twist by 28 degrees about axes at right angles.
    half = np.radians(17.5), np.radians(14.0)
    angle = 2.0 * np.degrees(np.arccos(np.cos(half[0]) * np.cos(half[1])))
    assert abs(waist["difference"]) == pytest.approx(angle)
    assert said["divergence"]["twisting"]["joint"] == "waist"
    assert said["divergence"]["twisting"]["time_s"] == waist["divergence_s"]
    table = (tmp_path / "out.csv").read_text(encoding="utf-8").splitlines()
    assert len(table) == 1 + len(said["differences"])
    assert table[0].split(",") == list(knee)


def test_all_motions_are_compared_with_the_first(bending: Path, twisting: Path):
    said = answer("compare", twisting, bending, twisting, "--stop", "0.35")
    assert list(said["divergence"]) == ["bending (2)", "twisting (3)"]
    assert said["divergence"]["twisting (3)"] is None
    assert said["stop_s"] == 0.35
    text = run("compare", twisting, bending, twisting).stdout
    assert "twisting (3) against twisting (1): no joint differs by more than 5 deg\n" in text
    assert text.count("angle [deg]") == 1
