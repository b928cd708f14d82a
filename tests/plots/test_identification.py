"""`mover identify`: what it prints, what it writes, and with which code it ends."""

from pathlib import Path

import numpy as np
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
    (*_, doubt) = [line for line in text.splitlines() if line.startswith("doubt:")]
    assert "on the law of left_knee between -34 and -21 deg, where the swing passed once" in doubt
    (title,) = [line for line in text.splitlines() if line.startswith("quantity")]
    assert title.endswith("law tail 10 %")
    (release,) = [line for line in text.splitlines() if line.startswith("release (start)")]
    assert release.endswith(" sd")
    assert len(text.partition("\nstart ")[0].splitlines()) <= 24
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
    assert data["release_s"] == 0.0
    low, high = data["tails"]
    assert low["end_deg"] == pytest.approx(-34.0, abs=1.0)
    assert (high["inner_deg"], high["end_deg"]) == pytest.approx((32.0, 50.0), abs=1.0)
    assert list(low["changes"]) == [*TRUTH, "pose.left_knee"]
    largest = max(abs(tail["changes"][SCALE]) for tail in (low, high))
    assert scale["change_by_tail"] == largest > scale["sd"]
    assert data["unfinished"] == ""
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
        (["--fit", SCALE, "--wall-limit", "0"], 2, "--wall-limit 0: the limit must be positive"),
    ],
)
def test_what_is_wrong_is_a_sentence(tmp_path: Path, words: list[str], code: int, message: str):
    result = mover("identify", write_leg(tmp_path), data_file(tmp_path), *words)
    assert result.exit_code == code, result.output
    assert message in result.output


def test_times_of_a_device_are_epoch_seconds(tmp_path: Path):
    """Held for half a second, and written with milliseconds."""
    epoch, release = 1_700_000_000, 0.507
    times = np.arange(100) * 0.02
    fine = swing(noise=0.0, frame=0.001, stop=2.0)
    angles = np.interp(np.maximum(times - release, 0.0), fine.times, fine.angles[:, 0])
    noisy = np.degrees(angles + NOISE * np.random.default_rng(3).standard_normal(100))
    rows = [f"{epoch + t:.3f},{a:.3f}" for t, a in zip(times.tolist(), noisy.tolist(), strict=True)]
    data = tmp_path / "device.csv"
    data.write_text("\n".join(["time [s],left_knee [deg]", *rows]), encoding="utf-8")
    words = ("identify", write_leg(tmp_path), data, *FITS, "--starts", 1)
    found = answer(*words, "--stop", f"{epoch + 1.5}")
    scale, _, _, start, released = found["estimates"]
    assert scale["estimate"] == pytest.approx(TRUTH[SCALE], abs=3.0 * scale["sd"])
    assert start["estimate"] == pytest.approx(50.0, abs=3.0 * start["sd"])
    assert released["estimate"] == found["release_s"]
    assert released["estimate"] - epoch == pytest.approx(release, abs=3.0 * released["sd"])
    assert found["start_s"] - epoch == pytest.approx(release - 0.2, abs=0.03)
    assert found["stop_s"] == epoch + 1.5
    assert len(found["samples"]) == pytest.approx(60, abs=2)


def test_the_wall_limit_ends_the_command_with_what_is_known(tmp_path: Path):
    figure, data = write_leg(tmp_path), data_file(tmp_path)
    springs = tmp_path / "leg.mine.springs.toml"
    result = mover("identify", figure, data, *FITS, "--wall-limit", "1e-6", "-o", springs)
    assert result.exit_code == 3
    assert "--wall-limit 1e-06: the wall-time limit was reached before a run" in result.stderr
    assert "nothing was written" in result.stdout
    assert not springs.exists()


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
