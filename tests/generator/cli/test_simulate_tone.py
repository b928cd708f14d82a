"""Tone in the commands."""

from pathlib import Path

import pytest

from generator.input_files.tone import TONE_FILE
from tests.command import answer, mover, run


def test_tone_is_in_the_summary_and_in_the_balance():
    words = (
        "simulate",
        "male50",
        "--stop",
        0.1,
        "--tone",
        "fall",
        "--right",
        "neck=0.2",
        "--hold",
        "legs=0.03",
    )
    said = answer(*words, "--delay", "0.02s", "--release", "80ms")
    assert said["tone"] == (
        "fall; holding legs 0.03; righting neck 0.2, trunk 0.45; from 0.02 s; until 0.08 s; "
        "strengths of axes: 9 published, 12 estimate"
    )
    assert said["agreement_with_exudyn"] < 1e-8
    assert said["energy"]["tone"]["first"] == 0.0
    assert said["energy"]["tone"]["last"] != 0.0
    without = answer("simulate", "pendulum", "--stop", 0.02)
    assert "tone" not in without
    assert "tone" not in without["energy"]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--right", "neck,trnk=0.5"), "no joint or group `trnk`; did you mean `trunk`?"),
        (("--hold", "left_kne=0.5"), "no joint or group `left_kne`; did you mean `left_knee`?"),
        (("--tone", "1.5"), "a share of the strength is from 0 to 1"),
        (("--release", "0.3s"), "--release needs --tone, --right, --hold or --fall"),
        (("--delay", "0.1s"), "--delay needs --tone, --right, --hold or --fall"),
        (("--tone", "fal"), "did you mean `fall`?"),
    ],
)
def test_wrong_tone_is_refused_before_the_run(words: tuple[str, ...], sentence: str):
    result = mover("simulate", "male50", *words)
    assert result.exit_code in (1, 2)
    assert sentence in " ".join(result.output.split())


def test_figure_without_strengths_says_so():
    result = mover("simulate", "pendulum", "--tone", "0.1")
    assert result.exit_code == 1
    assert "no joint of this figure has a known strength" in result.output


def test_tone_file_is_checked(tmp_path: Path):
    shipped = TONE_FILE.shipped()["fall"]
    text = run("check", shipped).output
    assert "righting neck 0.45, trunk 0.45" in text
    assert "no errors, no warnings; the tone can be used" in text
    path = tmp_path / "own.tone.toml"
    path.write_text(shipped.read_text(encoding="utf-8").replace("share = 0.45", "share = 5"))
    result = mover("check", path)
    assert result.exit_code == 1
    assert "must be from 0 to 1, not 5" in result.output
    assert "the tone cannot be used" in result.output


def test_options_add_to_the_tone_of_a_fall():
    words = ("simulate", "male50", "--fall", "push", "--stop", 0.02)
    said = answer(*words, "--hold", "legs=0.1", "--right", "neck=0.2", "--release", "15ms")
    assert said["tone"].startswith(
        "fall; holding legs 0.1; righting neck 0.2, trunk 0.45; until 0.015 s; "
    )
    assert "tone" not in answer(*words, "--tone", "0")
    result = mover("simulate", "male50", "--fall", "faint", "--release", "15ms")
    assert result.exit_code != 0
    assert "--release: this fall is of a limp body; give it --tone, --right or" in result.output


def test_a_fall_without_known_strengths_is_limp_and_says_so():
    result = run("simulate", "male50", "--fall", "push", "--stop", 0.02, "--springs", "none")
    assert "warning: the body is limp in this fall: " in result.stderr
    assert "righting" not in result.stdout
