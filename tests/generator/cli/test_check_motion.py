"""`mover check` of motions, tables, markers and models."""

from pathlib import Path

import numpy as np
import pytest

from generator.inverse.markers import Markers, format_trc
from tests.command import answer, mover, run
from tests.generator.inverse.walking import FORCES, LOADS, MODEL, MOTION


def test_a_walk_and_its_forces(tmp_path: Path):
    for path, expected in (
        (MOTION, "151 frames, 0 to 2.5 s, 60 a second: displacements, with angles in degrees"),
        (FORCES, "--force BODY=ground_force` takes it"),
        (LOADS, "forces of walk_grf.mot on calcn_r, calcn_l"),
        (MODEL, f"`mover convert {MODEL} gait10.fig` makes a figure of it"),
    ):
        said = run("check", path)
        assert expected in said.stdout
        assert answer("check", path)["faults"] == []


def test_moments_are_not_displacements(tmp_path: Path):
    path = tmp_path / "moments.sto"
    run("inverse", MODEL, MOTION, "--forces", LOADS, "-o", path)
    said = answer("check", path)
    assert said["faults"] == []
    text = run("check", path).stdout
    assert "moments and forces of inverse dynamics" in text
    assert "radians" not in text


def test_doubts_about_a_table_have_their_places(tmp_path: Path):
    lines = MOTION.read_text().replace("inDegrees=yes", "inDegrees=no").splitlines()
    kept = [line for line in lines if not line.startswith("nRows")]
    titles = next(k for k, line in enumerate(kept) if line.startswith("time"))
    cells = kept[titles + 5].split("\t")
    kept[titles + 5] = "\t".join([*cells[:2], "nan", *cells[3:]])
    del kept[titles + 20 : titles + 30]
    path = tmp_path / "walk.mot"
    path.write_text("\n".join([*kept, ""]))
    said = answer("check", path)
    messages = [fault["message"] for fault in said["faults"]]
    assert [fault["severity"] for fault in said["faults"]] == ["warning"] * 3
    assert messages[0].startswith("no frame lies between 0.3 and 0.48")
    assert messages[1] == "1 number of `pelvis_tx` are not finite"
    assert "in a table of radians" in messages[2]
    assert said["faults"][1]["line"] == titles + 1


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("walk.mot", "Coordinates\nendheader\ntime\ta\n0\t1\n", "whether angles are in degrees"),
        ("walk.mot", None, "no such file"),
        ("walk.trc", "time,x\n", "this is not a file of markers"),
        ("walk.trc", "caf\udce9 \x07", "this is a binary file, not a text"),
        ("share.csv", "time,x\n", "it takes figures (.fig)"),
        ("walk.html", "<p>", "it takes figures (.fig)"),
        ("notes.txt", "figure {}", "notes.txt` is not a file that `mover check` takes"),
        ("run.npz", "PK", "run.npz"),
        ("model.osim", "<OpenSimDocument", "model.osim:1"),
        ("loads.xml", "<ExternalLoads/>", "`datafile` with the columns is missing"),
    ],
)
def test_a_wrong_file_is_told_with_its_place(
    name: str, text: str | None, message: str, tmp_path: Path
):
    path = tmp_path / name
    if text is not None:
        path.write_bytes(text.encode(errors="surrogateescape"))
    said = mover("check", path)
    assert said.exit_code == 1
    assert message in said.stdout + said.stderr
    assert "the file cannot be used" in said.stdout + said.stderr


def test_markers_that_are_missing_or_far_away(tmp_path: Path):
    positions = np.zeros((20, 3, 3)) + np.arange(3.0)[:, None]
    positions[3:5, 1] = np.nan
    positions[:, 2] = np.nan
    markers = Markers(0.01 * np.arange(20.0), ("a", "b", "c"), positions)
    path = tmp_path / "walk.trc"
    path.write_text(format_trc(markers))
    said = run("check", path).stdout
    assert "20 frames, 0 to 0.19 s, 100 a second" in said
    assert "3 markers: a, b, c" in said
    assert "markers are at x 0 to 1 m, y 0 to 1 m, z 0 to 1 m" in said
    assert ["b", "2", "20"] in [line.split() for line in said.splitlines()]
    faults = answer("check", path)["faults"]
    assert [fault["message"] for fault in faults] == ["markers without any position: c"]
    path.write_text(format_trc(markers).replace("\tm\t", "\tcm\t"))
    assert answer("check", path)["faults"] == faults
    far = Markers(markers.times, markers.names, 1000.0 * positions)
    path.write_text(format_trc(far))
    hints = [fault["hint"] for fault in answer("check", path)["faults"]]
    assert "the `Units` of the file may be others" in hints


def test_a_run_and_a_motion(tmp_path: Path):
    for name in ("fall.npz", "fall.action"):
        run("simulate", "pendulum", "--stop", "0.1", "-o", tmp_path / name)
        said = run("check", tmp_path / name).stdout
        assert "6 frames of pendulum.fig, 0 to 0.1 s: Finished" in said
        assert f"`mover view {tmp_path / name}` shows it" in said
