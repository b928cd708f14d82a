"""`mover plots`: what it writes, what it says, and with which code it ends."""

import json
import os
import signal
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from generator.cli.app import app
from plots import run as plates
from plots.canvas import draw_plate
from plots.run import PLATES
from tests.tiny_plates import TARGETS, damper, spring

SCRIPT = """
import sys
from plots import run
run.PLATES = dict(pair.split("=") for pair in sys.argv.pop(1).split(","))
from generator.cli.app import main
main()
"""

GOOD = {name: TARGETS[name] for name in ("spring", "damper")}


@pytest.fixture
def _tiny(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(plates, "PLATES", GOOD)


def mover(*words: object) -> Result:
    """Run the command in this process."""
    return CliRunner().invoke(app, ["plots", *map(str, words)])


def line_of(names: list[str], *words: object) -> list[str]:
    """The command line of a process of its own, in which there are these plates only."""
    known = ",".join(f"{name}={TARGETS[name]}" for name in names)
    return [sys.executable, "-c", SCRIPT, known, "plots", *map(str, words)]


def run(names: list[str], *words: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(line_of(names, *words), capture_output=True, text=True, check=False)


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_files_and_words(tmp_path: Path):
    folder = tmp_path / "new" / "plates"
    done = run(["spring", "damper"], "-o", folder)
    assert done.returncode == 0, done.stderr
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
    lines = done.stdout.splitlines()
    assert lines[:3] == [
        "spring: A spring <b>& its moment</b>",
        "  holds          -1.047 N m  (at most 0 N m)  The moment at 30 deg restores",
        "  holds          2           (1 to 3)         a < 3 & b | c",
    ]
    assert lines[4:8] == [
        "damper: A damper",
        "  DOES NOT HOLD  3 N m       (at most 0 N m)  It restores",
        "    It only damps.",
        "  DOES NOT HOLD  nan         (at least 0)     It is known",
    ]
    assert lines[9:] == [
        "2 of 4 claims hold, 2 do not.",
        "",
        f"wrote 8 files in {folder}",
        f"the report is {folder / 'report.html'}",
    ]


@pytest.mark.usefixtures("_tiny")
def test_two_runs_give_the_same_files(tmp_path: Path):
    assert mover("-o", tmp_path / "a", "--jobs", 1).exit_code == 0
    assert mover("-o", tmp_path / "b", "--jobs", 2, "--quiet").stdout == ""
    assert contents(tmp_path / "a") == contents(tmp_path / "b")


@pytest.mark.usefixtures("_tiny")
def test_the_plates_that_are_named_are_made(tmp_path: Path):
    result = mover("damper", "-o", tmp_path, "--json", "damper")
    assert result.exit_code == 0
    said = json.loads(result.stdout)
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
        },
        {
            "sentence": "It is known",
            "measured": None,
            "unit": "",
            "at_least": 0.0,
            "at_most": None,
            "holds": False,
            "remark": "",
        },
    ]
    assert sorted(said["files"]) == sorted(str(path) for path in tmp_path.iterdir())
    assert "mover plots -o DIR damper</code>" in (tmp_path / "report.html").read_text("utf-8")


def test_strict_fails_when_a_claim_does_not_hold(tmp_path: Path):
    done = run(["spring", "damper"], "-o", tmp_path, "--strict")
    assert done.returncode == 3
    assert "error: --strict requires all claims to hold: 2 of 4" in done.stderr
    assert (tmp_path / "report.html").exists()
    assert run(["spring"], "-o", tmp_path, "--strict").returncode == 0


def test_a_plate_that_cannot_be_made_fails_the_command_alone(tmp_path: Path):
    done = run(["raising", "dying", "spring"], "-o", tmp_path)
    assert done.returncode == 3
    assert "the plate `raising` could not be made: ValueError: no moments" in done.stderr
    assert "the plate `dying` could not be made: its process ended with" in done.stderr
    assert "All 2 claims hold." in done.stdout
    assert sorted(contents(tmp_path)) == ["report.html", "spring.csv", "spring.png", "spring.svg"]
    assert "the plate `raising` could not be made" in (tmp_path / "report.html").read_text("utf-8")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "no output folder: add -o DIR"),
        (("sprung", "-o", "there"), "there is no plate `sprung`; did you mean `spring`?"),
        (("x", "-o", "there"), "there is no plate `x`; known here: damper, spring"),
        (("--gallery", "page.html"), "the name of the page must end in .md"),
        (("spring", "--gallery", "page.md"), "leave out the names"),
        (("-o", "there", "--jobs", "0"), "Invalid value for '--jobs'"),
    ],
)
@pytest.mark.usefixtures("_tiny")
def test_wrong_usage_ends_with_2(
    words: tuple[str, ...], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    result = mover(*words)
    assert result.exit_code == 2
    assert message in result.stderr
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("-o", "file"), "`file` cannot be written: it exists and is not a directory"),
        (("-o", "file/below"), "`file/below` cannot be written: not a directory"),
        (("-o", "taken"), "`taken/report.html` cannot be written: it is a directory"),
        (("--gallery", "none/page.md"), "`none/page.md` cannot be written: there is no directory"),
        (("--gallery", "file.md"), "`file` cannot be written"),
    ],
)
@pytest.mark.usefixtures("_tiny")
def test_what_cannot_be_written_ends_with_1_before_any_work(
    words: tuple[str, ...], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("mine")
    Path("taken/report.html").mkdir(parents=True)
    result = mover(*words)
    assert result.exit_code == 1
    assert message in result.stderr
    assert Path("file").read_text() == "mine"
    assert not list(tmp_path.rglob("*.svg"))


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_file_that_cannot_be_written_in_the_end_ends_the_rest(tmp_path: Path, jobs: int):
    (tmp_path / "spring.png").mkdir()
    number = tmp_path / "number"
    done = subprocess.run(
        line_of(["spring", "endless"], "-o", tmp_path, "--jobs", jobs),
        env=os.environ | {"ENDLESS_PROCESS": str(number)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert "spring.png` cannot be written: it is a directory" in done.stderr
    assert not list(tmp_path.glob(".*.part"))


def test_the_list():
    assert mover("--list").stdout.split() == list(PLATES)
    assert json.loads(mover("--list", "--json").stdout) == list(PLATES)


@pytest.mark.usefixtures("_tiny")
def test_the_gallery(tmp_path: Path):
    result = mover("--gallery", tmp_path / "page.md")
    assert result.exit_code == 0, result.stderr
    assert sorted(contents(tmp_path / "page")) == ["damper.svg", "spring.svg"]
    page = (tmp_path / "page.md").read_text("utf-8")
    assert "2 of 4 claims hold, 2 do not." in page
    assert "](page/spring.svg)" in page
    assert "`mover plots --gallery page.md`" in page.replace("\n", " ")


def test_there_is_no_gallery_with_a_plate_missing(tmp_path: Path):
    done = run(["raising", "spring"], "--gallery", tmp_path / "page.md")
    assert done.returncode == 3
    assert not (tmp_path / "page.md").exists()


@pytest.mark.skipif(os.name != "posix", reason="needs SIGINT")
def test_ctrl_c_keeps_what_was_made(tmp_path: Path):
    pty = pytest.importorskip("pty")
    terminal, inner = pty.openpty()
    folder, number = tmp_path / "plates", tmp_path / "number"
    process = subprocess.Popen(
        line_of(["endless", "spring"], "-o", folder, "--jobs", 2),
        env=os.environ | {"TERM": "xterm", "ENDLESS_PROCESS": str(number)},
        stdout=subprocess.PIPE,
        stderr=inner,
    )
    os.close(inner)
    seen = b""
    while b"1 of 2 plates" not in seen:
        seen += os.read(terminal, 1000)
    while not number.exists() or not number.read_text():
        os.read(terminal, 1000)
    process.send_signal(signal.SIGINT)
    try:
        while chunk := os.read(terminal, 1000):
            seen += chunk
    except OSError:  # how a terminal says that the other end is closed
        pass
    said, _ = process.communicate()
    assert process.returncode == 3
    assert b"error: interrupted after 1 of 2 plates" in seen
    assert b"All 2 claims hold." in said
    assert sorted(contents(folder)) == ["report.html", "spring.csv", "spring.png", "spring.svg"]
    text = (folder / "report.html").read_text("utf-8")
    assert "`endless` could not be made: the command was interrupted" in text
    with pytest.raises(ProcessLookupError):
        os.kill(int(number.read_text()), 0)


@pytest.mark.skipif(os.name != "posix", reason="needs SIGINT")
def test_ctrl_c_before_a_plate_is_done(tmp_path: Path):
    number = tmp_path / "number"
    process = subprocess.Popen(
        line_of(["endless"], "-o", tmp_path),
        env=os.environ | {"ENDLESS_PROCESS": str(number)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    while not number.exists() or not number.read_text():
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    said, told = process.communicate()
    assert process.returncode == 3
    assert said == ""
    assert told == "error: interrupted before anything was computed\n"
    assert [path.name for path in tmp_path.iterdir()] == ["number"]
