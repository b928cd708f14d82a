"""`mover convert` of motions and figures."""

import os
from pathlib import Path

import pytest

from generator import read_action, read_figure, text_io
from generator.motion_files import MOTION_FORMATS, format_action, motion_from_action, read_npz
from generator.motion_files.action import ActionFile
from generator.motion_files.glb import write as write_glb
from tests.command import answer, mover, run
from tests.motions import FIGURES, clip


@pytest.fixture(scope="module")
def swing_text() -> str:
    motion = clip("fourbar")
    return format_action(
        ActionFile(motion.header, motion.chains, motion.times, motion.displacements)
    )


@pytest.fixture
def swing(tmp_path: Path, swing_text: str) -> Path:
    """A motion of the shipped four-bar linkage, as an action file."""
    path = tmp_path / "swing.action"
    path.write_text(swing_text, encoding="utf-8")
    return path


def test_an_action_file_becomes_every_format(swing: Path, swing_text: str):
    outputs = [swing.with_name(f"out{suffix}") for suffix in MOTION_FORMATS]
    said = answer("convert", swing, *outputs)
    assert said["files"] == [str(path) for path in outputs]
    assert said["frames"] == clip("fourbar").times.size
    assert all(path.stat().st_size > 100 for path in outputs)
    assert swing.with_name("out.action").read_text(encoding="utf-8") == swing_text
    losses = {
        Path(path).suffix: [loss["what"] for loss in entries]
        for path, entries in said["losses"].items()
    }
    assert losses[".bvh"]
    # Without a run there is nothing beside the motion to lose, and there are no energies.
    assert "what the run says" not in str(losses)
    assert any("energies" in what for what in losses[".csv"])
    assert "[J]" not in swing.with_name("out.csv").read_text(encoding="utf-8")
    figure = read_figure("fourbar")
    write_glb(motion_from_action(read_action(swing), figure), swing.with_name("straight.glb"))
    straight = swing.with_name("straight.glb").read_bytes()
    assert swing.with_name("out.glb").read_bytes() == straight


@pytest.mark.parametrize(
    "suffix", [".glb", ".bvh", ".urdf", ".xml", pytest.param(".bioMod", marks=pytest.mark.slow)]
)
def test_losses_are_few_lines_unless_all_are_asked_for(swing: Path, suffix: str, tmp_path: Path):
    source = swing if suffix in MOTION_FORMATS else "prototype"
    output = tmp_path / f"out{suffix}"
    brief = run("convert", source, output).stdout.splitlines()
    brief = [line for line in brief if not line.startswith("wrote")]
    assert len(brief) <= 7
    assert max(map(len, brief[2:]), default=0) <= 112
    assert not [line for line in brief if "digits:" in line]
    losses = answer("convert", source, output)["losses"][str(output)]
    full = run("convert", source, output, "--verbose").stdout.splitlines()
    listed = full[full.index(f"not in {output}:") + 1 :] if losses else []
    assert len(listed) == len(losses)
    assert all(
        line.startswith(f"  {one['what']}") for line, one in zip(listed, losses, strict=True)
    )
    shown = [line for line in brief[2:] if not line.endswith("see them with --verbose")]
    exact = [one for one in losses if not one["what"].startswith("digits:")]
    assert len(shown) == min(4, len(exact))
    left = [line for line in brief if line.endswith("see them with --verbose")]
    assert left == ([f"  {len(exact) - 4} more: see them with --verbose"] if exact[4:] else [])


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
    cut = tmp_path / "cut.npz"
    cut.write_bytes(again[0].read_bytes()[:500])
    result = mover("convert", cut, tmp_path / "out.glb")
    assert (result.exit_code, result.stderr.strip()) == (
        1,
        f"error: `{cut}` is not a run: it is not an archive of numpy, or is truncated",
    )


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
    result = run("convert", swing, swing.with_name("out.glb"), "--figure", mine)
    assert f"than `{mine}`" in result.stderr


def test_a_motion_whose_figure_is_gone_takes_the_one_that_is_named(swing: Path, swing_text: str):
    swing.write_text(swing_text.replace("figure fourbar.fig", "figure gone.fig"))
    said = answer("convert", swing, swing.with_name("o.glb"), "--figure", "fourbar")
    assert said["frames"] == clip("fourbar").times.size


@pytest.mark.parametrize(
    ("words", "loses_springs"), [((), True), (("--to", "peabody", "--springs", "none"), False)]
)
def test_a_figure_becomes_a_figure_file(
    words: tuple[str, ...], loses_springs: bool, tmp_path: Path
):
    path = tmp_path / ("out.txt" if words else "out.fig")
    said = answer("convert", "prototype", path, *words)
    assert read_figure(path) == read_figure("prototype")
    losses = said["losses"].get(str(path), [])
    assert any("springs" in loss["what"] for loss in losses) is loses_springs


def test_a_folder_is_written_beside_a_file(tmp_path: Path):
    run("convert", "pendulum", tmp_path / "a.xml", tmp_path / "dyspam")
    assert sorted(os.listdir(tmp_path)) == ["a.xml", "dyspam"]
    assert len(os.listdir(tmp_path / "dyspam")) == 4


@pytest.mark.parametrize("suffix", [".action", ".mot", ".sto"])
def test_a_motion_that_is_too_long_to_be_read_again_is_not_written(
    swing: Path, suffix: str, monkeypatch: pytest.MonkeyPatch
):
    """With a smaller bound of the reader: 32 MB take half a minute."""
    monkeypatch.setattr(text_io, "MAX_FILE_BYTES", 30_000)
    long, other = swing.with_name(f"long{suffix}"), swing.with_name("long.glb")
    run("convert", swing, long)
    long.unlink()
    result = mover("convert", swing, other, long, "--fps", "5000")
    assert result.exit_code == 1
    assert f"`{long.name}` is larger than" in result.stderr
    assert [path.name for path in swing.parent.iterdir()] == [swing.name]
