"""`mover convert`, and the files of motions that `mover simulate` writes."""

import json
import os
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from generator import read_action, read_figure
from generator.cli.app import app
from generator.model_files.formats import write_fig
from generator.motion_files import MOTION_FORMATS, format_action, motion_from_action, read_npz
from generator.motion_files.action import ActionFile
from generator.motion_files.glb import write as write_glb
from springs import SpringSet
from tests.generator.model_files.model_cases import on_a_rail
from tests.motions import FIGURES, clip


def mover(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def answer(*words: object) -> dict:
    result = mover(*words, "--json")
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout)


def failure(*words: object) -> tuple[int, str]:
    """Exit code and message; nothing for people on the standard output, and JSON on demand."""
    result = mover(*words)
    assert result.stdout == ""
    assert "error: " in result.stderr
    again = mover(*words, "--json")
    assert again.exit_code == result.exit_code
    assert "error" in json.loads(again.stdout)
    return result.exit_code, result.stderr


@cache
def swing_text() -> str:
    motion = clip("fourbar")
    return format_action(
        ActionFile(motion.header, motion.chains, motion.times, motion.displacements)
    )


@pytest.fixture
def swing(tmp_path: Path) -> Path:
    """A motion of the shipped four-bar linkage, as an action file."""
    path = tmp_path / "swing.action"
    path.write_text(swing_text(), encoding="utf-8")
    return path


def test_an_action_file_becomes_every_format(swing: Path):
    outputs = [swing.with_name(f"out{suffix}") for suffix in MOTION_FORMATS]
    said = answer("convert", swing, *outputs)
    assert said["files"] == [str(path) for path in outputs]
    assert said["frames"] == 51
    assert all(path.stat().st_size > 100 for path in outputs)
    assert swing.with_name("out.action").read_text(encoding="utf-8") == swing_text()
    # Without a run there is nothing beside the motion that could be lost.
    told = [loss["what"] for each in said["losses"].values() for loss in each]
    assert not any(what.startswith("what the run says") for what in told)
    assert said["losses"][str(swing.with_name("out.bvh"))]


def test_losses_are_told_to_people_too(swing: Path):
    result = mover("convert", swing, swing.with_name("out.bvh"))
    assert result.exit_code == 0
    assert f"wrote {swing.with_name('out.bvh')}" in result.stdout
    assert f"not in {swing.with_name('out.bvh')}:\n" in result.stdout
    assert "close loops; the motion of their segments is unchanged: rocker_pin" in result.stdout


def test_what_is_converted_is_what_would_have_been_written(swing: Path):
    assert mover("convert", swing, swing.with_name("out.glb")).exit_code == 0
    figure = read_figure("fourbar")
    write_glb(motion_from_action(read_action(swing), figure), swing.with_name("straight.glb"))
    straight = swing.with_name("straight.glb").read_bytes()
    assert swing.with_name("out.glb").read_bytes() == straight


def test_a_run_goes_through_npz_without_a_loss(tmp_path: Path):
    first = ("-o", tmp_path / "run.npz", "-o", tmp_path / "run.action", "-o", tmp_path / "run.csv")
    said = answer("simulate", "fourbar", "--stop", 0.1, *first)
    assert set(said["losses"]) == set(said["files"])
    again = [tmp_path / name for name in ("again.npz", "again.action", "again.csv")]
    answer("convert", tmp_path / "run.npz", *again)
    for made in again:
        assert made.read_bytes() == made.with_stem("run").read_bytes()
    header, recording = read_npz(again[0])
    assert header.figure == "fourbar.fig"
    assert recording.times.size == 6


@pytest.mark.parametrize("suffix", sorted(MOTION_FORMATS))
def test_simulate_writes_every_format_and_tells_its_losses(suffix: str, tmp_path: Path):
    path = tmp_path / f"fall{suffix}"
    result = mover("simulate", "pendulum", "--stop", 0.04, "--step", 0.01, "-o", path)
    assert result.exit_code == 0
    assert path.exists()
    assert f"not in {path}:\n" in result.stdout


def test_the_figure_beside_the_motion_is_taken_when_it_is_the_one(swing: Path):
    text = (FIGURES / "fourbar.fig").read_text(encoding="utf-8")
    beside = swing.with_name("fourbar.fig")
    beside.write_text(text, encoding="utf-8")
    assert answer("convert", swing, swing.with_name("out.mot"))["figure"] == str(beside)
    # Another figure of that name is passed over for the shipped one, which is the one.
    beside.write_text(text + "\n# mine\n", encoding="utf-8")
    said = answer("convert", swing, swing.with_name("out.mot"))
    assert said["figure"] == str(FIGURES / "fourbar.fig")


def test_a_figure_that_changed_is_taken_with_a_warning(swing: Path):
    mine = swing.with_name("mine.fig")
    mine.write_text((FIGURES / "fourbar.fig").read_text(encoding="utf-8") + "\n", encoding="utf-8")
    result = mover("convert", swing, swing.with_name("out.glb"), "--figure", mine)
    assert result.exit_code == 0
    assert f"than `{mine}`" in result.stderr


def test_a_figure_becomes_a_figure_file(tmp_path: Path):
    said = answer("convert", "prototype", tmp_path / "out.fig")
    assert read_figure(tmp_path / "out.fig") == read_figure("prototype")
    assert any("springs" in loss["what"] for loss in said["losses"][str(tmp_path / "out.fig")])
    said = answer(
        "convert", "prototype", tmp_path / "o.txt", "--to", "peabody", "--springs", "none"
    )
    assert read_figure(tmp_path / "o.txt") == read_figure("prototype")
    assert not any("springs" in loss["what"] for loss in said["losses"][str(tmp_path / "o.txt")])


def test_no_output_is_written_when_one_cannot_be(tmp_path: Path):
    rail = tmp_path / "rail.fig"
    write_fig(on_a_rail(), SpringSet(), rail)
    text = rail.read_text(encoding="utf-8")
    code, said = failure("convert", rail, tmp_path / "a.xml", tmp_path / "dyspam")
    assert code == 1
    assert "it has a translation" in said
    assert os.listdir(tmp_path) == ["rail.fig"]
    assert rail.read_text(encoding="utf-8") == text


def test_a_file_within_a_folder_that_cannot_be_replaced_stops_all(tmp_path: Path):
    (tmp_path / "dyspam" / "optional").mkdir(parents=True)
    code, said = failure("convert", "pendulum", tmp_path / "a.xml", tmp_path / "dyspam")
    assert code == 1
    assert f"`{tmp_path / 'dyspam' / 'optional'}` cannot be written: it is a directory" in said
    assert os.listdir(tmp_path) == ["dyspam"]
    assert os.listdir(tmp_path / "dyspam") == ["optional"]
    (tmp_path / "dyspam" / "optional").rmdir()
    answer("convert", "pendulum", tmp_path / "a.xml", tmp_path / "dyspam")
    assert sorted(os.listdir(tmp_path)) == ["a.xml", "dyspam"]
    assert len(os.listdir(tmp_path / "dyspam")) == 4


def test_a_file_in_the_place_of_a_folder_is_told_once(tmp_path: Path):
    (tmp_path / "dyspam").write_text("mine")
    code, said = failure("convert", "pendulum", tmp_path / "a.xml", tmp_path / "dyspam")
    assert code == 1
    assert said.count("error: ") == 1
    assert f"`{tmp_path / 'dyspam'}` cannot be written: it is not a directory" in said
    assert os.listdir(tmp_path) == ["dyspam"]


def test_a_table_of_an_action_file_tells_that_it_has_no_energies(swing: Path):
    said = answer("convert", swing, swing.with_name("o.csv"))["losses"]
    assert any("energies" in loss["what"] for loss in said[str(swing.with_name("o.csv"))])
    assert "[J]" not in swing.with_name("o.csv").read_text(encoding="utf-8")


def test_a_motion_of_another_figure_is_refused(swing: Path):
    code, said = failure("convert", swing, swing.with_name("o.glb"), "--figure", "pendulum")
    assert code == 1
    assert "crank_bearing" in said
    assert not swing.with_name("o.glb").exists()


def test_a_motion_whose_figure_is_gone_asks_for_it(swing: Path):
    swing.write_text(swing_text().replace("figure fourbar.fig", "figure gone.fig"))
    code, said = failure("convert", swing, swing.with_name("o.glb"))
    assert code == 1
    assert "`gone.fig`, which is not beside it" in said
    assert "--figure" in said
    assert answer("convert", swing, swing.with_name("o.glb"), "--figure", "fourbar")["frames"] == 51


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("{} out.foo", "known are .action, .csv, .npz, .glb, .bvh, .mot, .sto, .x3d"),
        ("{} out", "the suffix is missing"),
        ("{} a.glb ./a.glb", "the file is listed twice"),
        ("{} out.fig", "is a figure and"),
        ("{} out.glb --to peabody", "--to and --springs are for figures"),
        ("{} out.glb --springs none", "--to and --springs are for figures"),
        ("{} out.glb --apart", "--apart is for models of other programs"),
        ("prototype out.fig --apart", "--apart is for models of other programs"),
        ("motion.bvh out.glb", "motions are read from .action, .npz"),
        ("prototype out.glb", "`mover simulate prototype -o out.glb` simulates it"),
        ("prototype out.fog", "known are .fig"),
        ("prototype out.fig --figure pendulum", "--figure is for motions"),
        ("prototype out.fig --to peabod", "did you mean `peabody`"),
        ("{}", "Missing argument"),
    ],
)
def test_what_does_not_fit_is_a_matter_of_usage(
    words: str, sentence: str, swing: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(swing.parent)
    result = mover("convert", *words.format(swing.name).split())
    assert result.exit_code == 2
    assert sentence in " ".join(result.stderr.replace("\u2502", " ").split())
    assert os.listdir(swing.parent) == [swing.name]


@pytest.mark.parametrize("source", ["none.action", "none.npz", "none.fig"])
def test_a_source_that_is_not_there_is_told(source: str, tmp_path: Path):
    code, said = failure(
        "convert",
        tmp_path / source,
        tmp_path / "out.fig" if (source.endswith("fig")) else tmp_path / "out.glb",
    )
    assert code == 1
    assert source in said


def test_a_motion_that_was_cut_is_refused_with_its_line(swing: Path):
    text = swing_text()
    swing.write_text(text[: len(text) // 2], encoding="utf-8")
    code, said = failure("convert", swing, swing.with_name("out.glb"))
    assert code == 1
    assert "swing.action:" in said


def test_an_archive_that_was_cut_is_refused(swing: Path):
    path = swing.with_name("run.npz")
    answer("convert", swing, path)
    path.write_bytes(path.read_bytes()[:500])
    code, said = failure("convert", path, swing.with_name("out.glb"))
    assert (code, said.strip()) == (
        1,
        f"error: `{path}` is not a run: it is not an archive of numpy, or is truncated",
    )


@pytest.mark.parametrize("name", ["nowhere/out.glb", "swing.action", ""])
def test_a_file_that_cannot_be_written_is_told(name: str, swing: Path):
    target = swing.parent / name if name else swing.parent / "folder.glb"
    if not name:
        target.mkdir()
    code, said = failure("convert", swing, target)
    assert code == 1
    assert "cannot be written: " in said
    assert swing.read_text(encoding="utf-8") == swing_text()


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write")
def test_a_folder_without_permission_is_told(swing: Path):
    swing.parent.chmod(0o500)
    code, said = failure("convert", swing, swing.with_name("out.glb"))
    swing.parent.chmod(0o700)
    assert code == 1
    assert "permission denied" in said


def test_a_motion_beyond_all_reach_is_refused(tmp_path: Path):
    motion = clip("slides")
    moved = {n: np.where(d > 10.0, 1e12, d) for n, d in motion.displacements.items()}
    moved["rail"] = moved["rail"] + 1e12
    far = ActionFile(motion.header, motion.chains, motion.times, moved)
    path = tmp_path / "far.action"
    path.write_text(format_action(far), encoding="utf-8")
    from generator.figure_file.write import write_figure

    (tmp_path / "slides.fig").write_text(write_figure(motion.figure), encoding="utf-8")
    code, said = failure("convert", path, tmp_path / "o.glb", "--figure", tmp_path / "slides.fig")
    assert code == 1
    assert "more than 1e+09 m from" in said
