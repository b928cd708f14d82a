"""`mover inverse`."""

import csv
from pathlib import Path

import numpy as np
import pytest

from generator.motion_files import COORDINATES_FILE
from tests.command import answer, mover, run
from tests.generator.inverse.walking import FORCES, LOADS, MODEL, MOTION

WALK = ("inverse", MODEL, MOTION, "--forces", LOADS, "--cutoff", "6Hz")


@pytest.fixture(scope="module")
def said(tmp_path_factory: pytest.TempPathFactory):
    path = tmp_path_factory.mktemp("walk") / "moments.sto"
    return answer(*WALK, "-o", path), COORDINATES_FILE.read(path)


def test_json_has_the_numbers_of_the_table(said):
    data, table = said
    assert [title.text for title in table.titles] == list(data["moments"])
    assert np.array_equal(table.times, data["times_s"])
    assert np.array_equal(table.numbers.T, np.array(list(data["moments"].values())))


def test_summaries_are_of_sure_samples(said):
    data, _ = said
    times = np.array(data["times_s"])
    kept = (times >= data["sure_s"][0]) & (times <= data["sure_s"][1])
    assert data["sure_s"] == pytest.approx([0.5, 2.0], abs=0.02)
    for name, one in data["coordinates"].items():
        moments = np.array(data["moments"][f"{name}_moment"])[kept]
        assert (one["smallest"], one["largest"]) == (moments.min(), moments.max())
        work = np.trapezoid(np.array(data["powers_W"][name])[kept], times[kept])
        assert one["positive_work_J"] + one["negative_work_J"] == pytest.approx(work)
    assert set(data["residuals"]) == {"pelvis_tilt", "pelvis_tx", "pelvis_ty"}


def test_options_for_a_table_are_those_of_a_file_of_loads(tmp_path: Path):
    figure = tmp_path / "gait10.fig"
    run("convert", MODEL, figure)
    words = ("--force", "calcn_r=ground_force", "--force", "calcn_l=1_ground_force")
    of_file = answer("inverse", figure, MOTION, "--forces", LOADS, "--cutoff", "6Hz")
    of_table = answer("inverse", figure, MOTION, "--forces", FORCES, *words, "--cutoff", "6 Hz")
    assert of_file["moments"] == of_table["moments"]


def test_knees_of_a_model_slide_as_those_of_the_figure_that_is_made_of_it(said, tmp_path: Path):
    figure = tmp_path / "gait10.fig"
    run("convert", MODEL, figure)
    of_figure = answer("inverse", figure, MOTION, "--forces", LOADS, "--cutoff", "6Hz")
    for name, moments in said[0]["moments"].items():
        np.testing.assert_allclose(of_figure["moments"][name], moments, atol=1e-9)


@pytest.mark.slow
def test_a_fall_of_a_person_needs_no_moments_but_those_of_its_springs(tmp_path: Path):
    """Persons and free roots: nothing is left over at the root of a fall in the air."""
    fall = tmp_path / "fall.npz"
    run("simulate", "male50", "--free-root", "--stop", "0.1", "--frame", "0.002", "-o", fall)
    data = answer("inverse", "male50", fall)
    assert set(data["residuals"]) == {f"lower_torso_{k}" for k in range(1, 7)}
    for one in data["residuals"].values():
        assert abs(one["largest"]) < 1.0


def test_the_text_says_what_was_done():
    text = run(*WALK).stdout
    assert "151 frames, 0 to 2.5 s, filtered at 6 Hz; forces on calcn_r, calcn_l; 72.6 kg" in text
    assert "of body weight" in text


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (("--cutoff", "6"), 2, "expected a frequency such as 6Hz"),
        (("--cutoff", "0Hz"), 2, "a frequency is above zero"),
        (("--cutoff", "40Hz"), 1, "walk.mot: a cutoff of 40 Hz is not between 0.397 Hz"),
        (("--force", "calcn_r=ground_force"), 2, "--force is for tables"),
        (("-o", "moments.txt"), 2, "`.txt` is not a known suffix"),
        (("--gravity", "1"), 2, "expected three numbers"),
    ],
)
def test_refusals(words: tuple[str, ...], code: int, message: str):
    result = mover("inverse", MODEL, MOTION, "--forces", LOADS, *words)
    assert (result.exit_code, message in result.stderr) == (code, True), result.stderr


def changed(path: Path, old: str, new: str, folder: Path) -> Path:
    found = folder / path.name
    found.write_text(path.read_text().replace(old, new))
    return found


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("inDegrees=yes", "inDegrees=no", "they seem to be degrees"),
        ("knee_angle_r", "knee", "displacements without a column: knee_angle_r"),
        ("pelvis_tilt\tpelvis_tx\tpelvis_ty", "a\tb\tc", "without a column"),
        ("      0.50000000", "            nan", "`nan` is not finite"),
    ],
)
def test_wrong_motions(old: str, new: str, message: str, tmp_path: Path):
    """An unknown column is an error where one is missing; nothing is written then."""
    out = tmp_path / "out.sto"
    path = changed(MOTION, old, new, tmp_path)
    result = mover("inverse", MODEL, path, "--forces", LOADS, "-o", out, "--verbose")
    assert message in result.stderr
    assert (result.exit_code, out.exists()) == (1, False)


def test_an_unknown_column_is_left_out(tmp_path: Path):
    lines = MOTION.read_text().splitlines()
    start = next(k for k, line in enumerate(lines) if line.split()[:1] == ["time"])
    wider = [line + ("\tspare" if k == start else "\t0") for k, line in enumerate(lines)]
    path = tmp_path / "walk.mot"
    path.write_text("\n".join([*lines[:start], *wider[start:], ""]).replace("=11", "=12"))
    result = mover("inverse", MODEL, path, "--forces", LOADS, "--verbose")
    assert result.exit_code == 0
    assert "columns that are not displacements of the figure are left out: spare" in result.stderr


def test_the_column_of_another_force_is_no_hint(tmp_path: Path):
    forces = tmp_path / "nocol.mot"
    lines = FORCES.read_text().splitlines()
    start = next(k for k, line in enumerate(lines) if line.split()[:1] == ["time"])
    titles = lines[start].split()
    titles[titles.index("ground_force_px")] = "spare"
    lines[start] = "\t".join(titles)
    forces.write_text("\n".join([*lines, ""]))
    words = ("--force", "calcn_r=ground_force", "--force", "calcn_l=1_ground_force")
    result = mover("inverse", MODEL, MOTION, "--forces", forces, *words)
    assert result.exit_code == 1
    assert "there is no column `ground_force_px`" in result.stderr
    assert "1_ground_force_px" not in result.stderr.replace(lines[start], "")
    assert "spare" in result.stderr


def test_a_large_residual_of_the_root_is_loud():
    loud = "the residual of the root is 1 body weights on average"
    assert loud in mover("inverse", MODEL, MOTION, "--cutoff", "6Hz").stderr
    assert "residual" not in mover(*WALK).stderr


def test_nothing_is_written_over_an_input():
    result = mover("inverse", MODEL, MOTION, "--forces", FORCES, "--force", "calcn_r=ground_force",
                   "-o", MOTION.with_suffix(".sto").parent / "no" / "such.sto")  # fmt: skip
    assert result.exit_code == 1
    assert "cannot be written" in result.stderr


def test_the_passive_share_is_a_range(tmp_path: Path):
    share = tmp_path / "share.csv"
    data = answer(*WALK, "-o", share)
    assert data["zero_uncertainty_deg"] == 10.0
    hip = data["passive"]["hip_flexion_r"]
    assert 0.0 < hip["share"][0] < hip["share"][1] < 1.0
    assert set(hip["by_law"]) == {"riener_edrich_1999/leg", "silder_2007/leg_curves"}
    assert hip["known"][0] < hip["known"][1] < 1.0
    titles, *rows = csv.reader(share.open(encoding="utf-8"))
    table = [dict(zip(titles, row, strict=True)) for row in rows]
    assert [float(row["time [s]"]) for row in table] == data["times_s"]
    net = [float(row["hip_flexion_r net [N m]"]) for row in table]
    assert net == data["moments"]["hip_flexion_r_moment"]
    beyond = [row for row in table if float(row["hip_flexion_r known"]) == 0.0]
    assert beyond
    assert all(row["hip_flexion_r passive lower [N m]"] == "" for row in beyond)
    known = [row for row in table if float(row["hip_flexion_r known"]) == 1.0]
    assert all(
        float(row["hip_flexion_r passive lower [N m]"])
        <= float(row["hip_flexion_r passive upper [N m]"])
        for row in known
    )


def test_a_static_trial_halves_the_uncertainty_of_zeros(tmp_path: Path):
    lines = MOTION.read_text().splitlines()
    head = next(k for k, line in enumerate(lines) if line.startswith("time")) + 1
    standing = tmp_path / "static.mot"
    names = lines[head - 1].split()
    row = "\t".join("-12" if name == "hip_flexion_r" else "0" for name in names[1:])
    lines = [*lines[:head], f"0\t{row}", f"1\t{row}"]
    standing.write_text("\n".join(lines).replace("nRows=151", "nRows=2"))
    data = answer(*WALK, "--neutral", standing)
    assert data["zero_uncertainty_deg"] == 5.0
    plain = answer(*WALK)["passive"]["hip_flexion_r"]["share"]
    assert data["passive"]["hip_flexion_r"]["share"][1] < plain[1]


@pytest.mark.slow
def test_chosen_laws_and_springs(tmp_path: Path):
    fall = tmp_path / "fall.npz"
    run("simulate", "male50", "--free-root", "--stop", "1.2", "-o", fall)
    data = answer("inverse", "male50", fall, "--springs", "riener", "--springs", "silder_2007/leg")
    assert set(data["passive"]["left_knee_1"]["by_law"]) == {"riener", "silder_2007/leg"}
    result = mover("inverse", "male50", fall, "--springs", "silder_2007/leg")
    assert "parameters that are means of subjects" in result.stderr


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--springs", "silder_2007/no"), "no coupled law"),
        (("--springs", "davy_audu_1987/hip"), "is not known"),
        (("--hip-zero", "10"), "the unit is missing"),
    ],
)
def test_refused_laws(words: tuple[str, ...], message: str):
    result = mover(*WALK, *words)
    assert (result.exit_code, message in result.stderr) == (2, True), result.stderr


def test_published_laws_need_legs(tmp_path: Path):
    swing, share = tmp_path / "swing.npz", tmp_path / "share.csv"
    run("simulate", "leg", "--stop", "1.2", "-o", swing)
    assert "passive share" not in run("inverse", "leg", swing).stdout
    result = mover("inverse", "leg", swing, "-o", share)
    assert "no hip, knee and ankle were found by their names" in result.stderr
    assert not share.exists()
