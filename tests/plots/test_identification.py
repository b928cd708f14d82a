"""`mover identify`: what it prints, what it writes, and with which code it ends."""

from pathlib import Path

import pytest

from generator.figure_file import read_figure
from generator.springs_file.read import read_springs
from tests.command import answer, mover, run
from tests.swings import NOISE, OFFSET, SCALE, TRUTH, VISCOUS, swing, swing_text, write_leg

FITS = [word for path in TRUTH for word in ("--fit", path)]


def data_file(folder: Path) -> Path:
    path = folder / "swing.csv"
    path.write_text(swing_text(swing()), encoding="utf-8")
    return path


def test_springs_and_a_picture_are_written(tmp_path: Path):
    figure, data = write_leg(tmp_path), data_file(tmp_path)
    springs, picture = tmp_path / "leg.mine.springs.toml", tmp_path / "fit.svg"
    result = run(
        *("identify", figure, data, *FITS, "--sd", "0.5deg", "--starts", 1),
        *("-o", springs, "--plot", picture, "-v"),
    )
    text = result.stdout
    assert "swing.csv: 151 angles of left_knee, 0 to 3 s" in text
    assert "pose.left_knee (start)" in text
    assert "given the masses of the figure" in text
    assert "chi-square" in text
    assert "doubt:" not in text
    assert f"wrote {springs}" in text
    assert "correlation" in text
    assert picture.read_text(encoding="utf-8").startswith("<?xml")
    made = read_springs("mine", read_figure(figure)).joints["left_knee"].axes[0]
    assert made.damping.viscous == pytest.approx(TRUTH[VISCOUS], rel=0.05)


def test_the_json(tmp_path: Path):
    data = answer(
        *("identify", write_leg(tmp_path), data_file(tmp_path), *FITS),
        *("--starts", 1, "--start", 0, "--stop", 2),
    )
    assert [one["path"] for one in data["estimates"]] == [*TRUTH, "pose.left_knee"]
    scale, offset, viscous, start = data["estimates"]
    assert scale["estimate"] == pytest.approx(TRUTH[SCALE], abs=4.0 * scale["sd"])
    assert offset["estimate"] == pytest.approx(TRUTH[OFFSET], abs=4.0 * offset["sd"])
    assert viscous["unit"] == "N m s/rad"
    assert scale["change_per_relative_mass"] == pytest.approx(scale["estimate"], rel=0.01)
    assert len(scale["profile"]["values"]) >= 7
    assert start["is_start"]
    assert start["profile"] is None
    assert len(data["samples"]) == 101
    assert data["noise_sd_deg"] == pytest.approx(0.5, rel=0.2)
    assert not data["noise_is_stated"]
    assert data["condition"] < 100.0
    assert data["stop_s"] == 2.0
    assert NOISE > 0.0


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        ([], 2, "nothing to fit"),
        (["--fit", "springs.left_knee.scal"], 1, "did you mean"),
        (["--fit", SCALE, "--sd", "0.5"], 2, "the unit is missing"),
        (["--fit", SCALE, "--sd", "-1deg"], 2, "--sd -1deg: the standard deviation of the noise"),
        (["--fit", "floor.friction"], 2, "a fit knows springs, segments, pose, velocity, gravity"),
        (["--fit", SCALE, "--step", "1e-3", "--tolerance", "1e-3"], 2, "exclude each other"),
        (["--fit", SCALE, "-o", "x.txt"], 2, "must end in .springs.toml"),
        (["--fit", SCALE, "--plot", "x.pdf"], 2, "must end in .svg or .png"),
        (["--fit", SCALE, "--start", "99"], 2, "fewer than two samples"),
        (["--fit", SCALE, "--lock", "left_knee"], 2, "locked or prescribed"),
        (["--fit", SCALE, "--stop", "nan"], 2, "must be finite"),
    ],
)
def test_what_is_wrong_is_a_sentence(tmp_path: Path, words: list[str], code: int, message: str):
    result = mover("identify", write_leg(tmp_path), data_file(tmp_path), *words)
    assert result.exit_code == code, result.output
    assert message in result.output


def test_masses_that_are_fitted_are_named_beside_the_file(tmp_path: Path):
    figure, data = write_leg(tmp_path), data_file(tmp_path)
    springs = tmp_path / "leg.mine.springs.toml"
    result = run(
        *("identify", figure, data, "--fit", SCALE, "--fit", "segments.shank.mass"),
        *("--starts", 1, "--stop", 0.5, "--tolerance", 1e-4, "-o", springs),
    )
    text = result.stdout
    assert "The masses follow from the torques that are not fitted" in text
    assert "per +1 % of mass" not in text
    assert f"{springs} has springs only: segments.shank.mass is in its comment alone" in text
