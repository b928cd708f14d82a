"""`mover plots`: what it writes, what it says, and with which code it ends."""

import os
import signal
import sys
from collections.abc import Callable, Iterator, Mapping
from importlib import metadata
from pathlib import Path

import pytest

from plots import run as module
from plots.canvas import draw_plate
from plots.medium import REPORT, Medium
from plots.plate import DrawnPlate, FailedPlate
from plots.run import PLATES, make_plate
from tests.command import answer, mover, run
from tests.processes import on_terminal, read_to_end
from tests.tiny_plates import TARGETS, damper, spring

TINY = {name: TARGETS[name] for name in ("spring", "damper")}
FILES = ["report.html", "spring.csv", "spring.png", "spring.svg"]

SCRIPT = """
import sys
from plots import run
run.PLATES = dict(pair.split("=") for pair in sys.argv.pop(1).split(","))
from generator.cli.app import main
main()
"""


def make_here(
    targets: Mapping[str, str],
    jobs: int,
    check: Callable[[], None] = lambda: None,
    medium: Medium = REPORT,
) -> Iterator[DrawnPlate | FailedPlate]:
    """Make plates in this process; one that is endless is interrupted."""
    for name, target in targets.items():
        if name == "endless":
            raise KeyboardInterrupt
        yield make_plate(name, target, medium)


@pytest.fixture
def tiny(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Replace the plates by tiny ones, made in processes as usual."""
    monkeypatch.setattr(module, "PLATES", TINY)
    return lambda *names: monkeypatch.setattr(module, "PLATES", {n: TARGETS[n] for n in names})


@pytest.fixture
def here(tiny: Callable[..., None], monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Replace the plates by tiny ones, made in this process."""
    monkeypatch.setattr(module, "make_plates", make_here)
    return tiny


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.usefixtures("here")
def test_files_and_words(tmp_path: Path):
    folder = tmp_path / "new" / "plates"
    done = run("plots", "-o", folder, "-v")
    assert done.stderr == ""
    files = contents(folder)
    text = files.pop("report.html").decode()
    expected = draw_plate(spring()).files | draw_plate(damper()).files
    assert files == {
        name: content.encode() if isinstance(content, str) else content
        for name, content in expected.items()
    }
    assert "mover plots -o DIR</code>" in text
    assert f"exudyn</dt><dd><code>{metadata.version('exudyn')}</code>" in text
    assert str(tmp_path) not in text
    lines = done.stdout.removeprefix("libraries print\n").splitlines()
    assert lines[:6] == [
        "spring  A spring <b>& its moment</b>",
        "damper  A damper",
        "2 of 4 claims hold, 2 do not.",
        f"wrote 8 files in {folder}",
        f"the report is {folder / 'report.html'}",
        "",
    ]
    assert lines[6:9] == [
        "spring: A spring <b>& its moment</b>",
        "  holds          -1.047 N m  (at most 0 N m)  The moment at 30 deg restores",
        "  holds          2           (1 to 3)         a < 3 & b | c",
    ]
    assert lines[10:] == [
        "damper: A damper",
        "  DOES NOT HOLD  3 N m       (at most 0 N m)  It restores",
        "    It only damps.",
        "  DOES NOT HOLD  nan         (at least 0)     It is known",
    ]


@pytest.mark.slow
def test_other_processes_give_the_same_files_and_print_nothing(
    here: Callable[..., None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    run("plots", "-o", tmp_path / "a")
    monkeypatch.undo()
    monkeypatch.setattr(module, "PLATES", TINY)
    assert run("plots", "-o", tmp_path / "b", "--jobs", 5, "--quiet").stdout == ""
    assert contents(tmp_path / "a") == contents(tmp_path / "b")


def test_the_first_word_of_several_plates_names_them_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    both = {"spring_damper": TARGETS["damper"], "spring": TARGETS["spring"]}
    monkeypatch.setattr(module, "PLATES", both)
    assert [*module._select_targets(["spring"], tmp_path, None)] == ["spring"]
    monkeypatch.setattr(module, "PLATES", {"spring_a": "a", "spring_b": "b", "springs": "c"})
    assert module._select_targets(["spring"], tmp_path, None) == {"spring_a": "a", "spring_b": "b"}


@pytest.mark.usefixtures("here")
def test_the_plates_that_are_named_are_made(tmp_path: Path):
    said = answer("plots", "damper", "-o", tmp_path, "damper")
    assert said["claims"] == 2
    assert said["hold"] == 0
    assert not said["interrupted"]
    assert said["failed"] == []
    (plate,) = said["plates"]
    assert plate["name"] == "damper"
    assert plate["claims"] == [
        {
            "sentence": "It restores",
            "measured": 3.0,
            "unit": "N m",
            "at_least": None,
            "at_most": 0.0,
            "holds": False,
            "remark": "It only damps.",
            "kind": "verification",
            "outcome": "DOES NOT HOLD",
            "obstacle": "",
        },
        {
            "sentence": "It is known",
            "measured": None,
            "unit": "",
            "at_least": 0.0,
            "at_most": None,
            "holds": False,
            "remark": "",
            "kind": "verification",
            "outcome": "DOES NOT HOLD",
            "obstacle": "",
        },
    ]
    assert sorted(said["files"]) == sorted(str(path) for path in tmp_path.iterdir())
    assert "mover plots -o DIR damper</code>" in (tmp_path / "report.html").read_text("utf-8")


@pytest.mark.usefixtures("here")
def test_strict_fails_when_a_claim_does_not_hold(tmp_path: Path):
    done = mover("plots", "-o", tmp_path, "--strict")
    assert done.exit_code == 3
    assert "error: --strict requires all claims to hold: 2 of 4" in done.stderr
    assert (tmp_path / "report.html").exists()
    run("plots", "spring", "-o", tmp_path, "--strict")


def test_a_plate_that_cannot_be_made_fails_the_command_alone(
    here: Callable[..., None], tmp_path: Path
):
    here("raising", "spring")
    done = mover("plots", "-o", tmp_path)
    assert done.exit_code == 3
    assert "the plate `raising` could not be made: ValueError: no moments" in done.stderr
    assert "All 2 claims hold." in done.stdout
    assert sorted(contents(tmp_path)) == FILES
    assert "the plate `raising` could not be made" in (tmp_path / "report.html").read_text("utf-8")
    assert mover("plots", "--gallery", tmp_path / "page.md").exit_code == 3
    assert not (tmp_path / "page.md").exists()


def test_an_interrupted_command_keeps_what_was_made(here: Callable[..., None], tmp_path: Path):
    here("spring", "endless")
    done = mover("plots", "-o", tmp_path)
    assert done.exit_code == 3
    assert done.stderr == "error: interrupted after 1 of 2 plates\n"
    assert "All 2 claims hold." in done.stdout
    assert sorted(contents(tmp_path)) == FILES
    text = (tmp_path / "report.html").read_text("utf-8")
    assert "`endless` could not be made: the command was interrupted" in text


def test_nothing_is_written_before_a_plate_is_made(here: Callable[..., None], tmp_path: Path):
    here("endless")
    done = mover("plots", "-o", tmp_path)
    assert (done.exit_code, done.stdout) == (3, "")
    assert done.stderr == "error: interrupted before anything was written\n"
    assert contents(tmp_path) == {}


def test_a_file_that_cannot_be_written_in_the_end_ends_the_rest(
    tiny: Callable[..., None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    tiny("spring", "endless")
    (tmp_path / "spring.png").mkdir()
    monkeypatch.setenv("ENDLESS_PROCESS", str(tmp_path / "number"))
    done = mover("plots", "-o", tmp_path, "--jobs", 2)
    assert done.exit_code == 1
    assert "spring.png` cannot be written: it is a directory" in done.stderr
    assert not list(tmp_path.glob(".*.part"))


def test_the_list():
    assert run("plots", "--list").stdout.split() == answer("plots", "--list") == list(PLATES)


@pytest.mark.usefixtures("here")
def test_the_gallery(tmp_path: Path):
    run("plots", "--gallery", tmp_path / "page.md")
    assert sorted(contents(tmp_path / "page")) == ["damper.svg", "spring.svg"]
    page = (tmp_path / "page.md").read_text("utf-8")
    assert "2 of 4 claims hold, 2 do not." in page
    assert "](page/spring.svg)" in page
    assert "`mover plots --gallery page.md`" in page.replace("\n", " ")


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="needs SIGINT")
def test_ctrl_c_ends_the_processes(tmp_path: Path):
    folder, number = tmp_path / "plates", tmp_path / "number"
    known = ",".join(f"{name}={TARGETS[name]}" for name in ("endless", "spring"))
    line = [sys.executable, "-c", SCRIPT, known, "plots", "-o", str(folder), "--jobs", "2"]
    with on_terminal(line, tmp_path, {"ENDLESS_PROCESS": str(number)}) as (process, terminal):
        seen = b""
        while b"1 of 2 plates" not in seen:
            seen += os.read(terminal, 1000)
        while not number.exists() or not number.read_text():
            os.read(terminal, 1000)
        process.send_signal(signal.SIGINT)
        seen += read_to_end(terminal)
        said, _ = process.communicate()
    assert process.returncode == 3
    assert b" interrupted after 1 of 2 plates" in seen
    assert b"All 2 claims hold." in said
    assert sorted(contents(folder)) == FILES
    with pytest.raises(ProcessLookupError):
        os.kill(int(number.read_text()), 0)
