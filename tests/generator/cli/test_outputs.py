"""Files of one command are put in place all at once, or none of them is."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks.interrupts import Interruption, interrupt_commands
from generator.cli import outputs as module
from generator.cli.interrupts import call_on_signals, defer_interrupt, hold_interrupts
from generator.cli.outputs import write_all_or_none, write_files
from generator.diagnostics import InputError
from generator.losses import Losses
from generator.text_io import temporary_path, write_atomic
from tests.command import mover
from tests.paths import ROOT
from tests.processes import ENVIRONMENT

needs_posix = pytest.mark.skipif(os.name != "posix", reason="needs signals of POSIX")


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def interrupt_after(count: int, number: int) -> Callable[..., None]:
    """Return `move_into_place` that gets a signal when it has put so many files in place."""
    moved: list[Path] = []

    def move(part: Path, path: Path) -> None:
        real_move(part, path)
        moved.append(path)
        if len(moved) == count:
            signal.raise_signal(number)

    real_move = module.move_into_place
    return move


@pytest.mark.parametrize(
    ("words", "files"),
    [
        (("simulate", "pendulum", "--stop", 0.02, "-o", "a.npz", "-o", "a.csv"), 2),
        (("convert", "pendulum", "a.xml", "a.urdf", "a.fig"), 5),
        (("convert", "prototype", "dyspam", "a.fig"), 2),
        (("pose", "prototype", "-o", "a.pose"), 1),
    ],
)
def test_ctrl_c_between_files_waits_for_the_last(
    words: tuple[object, ...],
    files: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    sigint_handler: None,
):
    monkeypatch.chdir(tmp_path)
    done = mover(*words)
    whole = names(tmp_path)
    assert done.exit_code == 0
    assert len(whole) == files
    os.mkdir("again")
    monkeypatch.chdir("again")
    monkeypatch.setattr(module, "move_into_place", interrupt_after(1, signal.SIGINT))
    done = mover(*words)
    assert (done.exit_code, done.stderr) == (3, "error: interrupted; the files were written\n")
    assert names(Path()) == whole


def test_ctrl_c_before_the_files_are_in_place_leaves_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(module, "check_writable", interrupted)
    (tmp_path / "a.txt").write_text("old")
    with pytest.raises(KeyboardInterrupt):
        write_files({tmp_path / "a.txt": "new", tmp_path / "b.txt": "new"})
    assert names(tmp_path) == ["a.txt"]
    assert (tmp_path / "a.txt").read_text() == "old"


def test_a_motion_is_written_to_all_files_or_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def full(*_: object) -> Losses:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(module, "motion_writer", lambda path: full if path.suffix == ".csv" else ok)
    with pytest.raises(InputError, match="no space left"):
        module.write_motion(None, [tmp_path / "a.npz", tmp_path / "a.csv"])  # type: ignore[arg-type]
    assert names(tmp_path) == []


def ok(motion: object, path: Path) -> Losses:
    write_atomic(path, "whole")
    return Losses("")


@needs_posix
def test_a_signal_to_end_waits_for_the_last_file(tmp_path: Path):
    """The process dies by SIGTERM, as ever, but with both files in place."""
    script = """
import signal, sys
from pathlib import Path
from generator.cli import outputs
move = outputs.move_into_place
def interrupted(part, path):
    move(part, path)
    signal.raise_signal(signal.SIGTERM)
outputs.move_into_place = interrupted
outputs.write_files({Path(sys.argv[1], name): "text" for name in "ab"})
"""
    line = [sys.executable, "-c", script, str(tmp_path)]
    done = subprocess.run(line, cwd=ROOT, check=False)
    assert done.returncode == -signal.SIGTERM
    assert names(tmp_path) == ["a", "b"]


WRITE_FOLDERS_FOR_EVER = """
import sys
from itertools import count
from pathlib import Path
from generator.cli.outputs import write_all_or_none
from generator.losses import Losses
from generator.text_io import write_atomic
def write(part):
    part.mkdir()
    for name in "abcd":
        write_atomic(part / name, "x" * 1000)
    return Losses("")
print("ready", flush=True)
for k in count():
    write_all_or_none([(Path(sys.argv[1], str(k)), write)])
"""


@needs_posix
def test_a_new_folder_is_whole_or_absent_when_its_writer_is_killed(tmp_path: Path):
    whole: list[Path] = []
    for k in range(5):
        folder = tmp_path / str(k)
        folder.mkdir()
        line = [sys.executable, "-c", WRITE_FOLDERS_FOR_EVER, str(folder)]
        writer = subprocess.Popen(line, cwd=ROOT, stdout=subprocess.PIPE)
        assert writer.stdout is not None
        assert writer.stdout.readline() == b"ready\n"
        time.sleep(0.02 + 0.013 * k)
        writer.kill()
        writer.communicate()
        whole += [path for path in folder.iterdir() if path.suffix != ".part"]
    assert whole
    assert all(names(path) == ["a", "b", "c", "d"] for path in whole)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write")
@pytest.mark.parametrize(
    "words",
    [
        ("simulate", "prototype", "--floor", "-o", "a.action"),
        ("convert", "prototype", "a.glb"),
        ("pose", "prototype", "-o", "a.pose"),
        ("person", "--sex", "male", "--stature", "1.8m", "--mass", "75kg", "-o", "me.fig"),
    ],
)
def test_a_folder_without_permission_is_reported(
    words: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    tmp_path.chmod(0o500)
    result = mover(*words)
    tmp_path.chmod(0o700)
    assert result.exit_code == 1
    assert "permission denied" in result.stderr
    assert names(tmp_path) == []


def test_a_folder_keeps_its_other_files(tmp_path: Path):
    def write(part: Path) -> Losses:
        part.mkdir()
        write_atomic(part / "structure", "new")
        return Losses("")

    (tmp_path / "model").mkdir()
    for name in ("structure", "notes"):
        (tmp_path / "model" / name).write_text("old")
    write_all_or_none([(tmp_path / "model", write)])
    assert (tmp_path / "model" / "structure").read_text() == "new"
    assert (tmp_path / "model" / "notes").read_text() == "old"
    assert names(tmp_path) == ["model"]


def test_a_folder_that_is_closed_is_reported_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Not once for each of its files."""
    (tmp_path / "a_geometry").mkdir()
    monkeypatch.chdir(tmp_path)

    def is_open(path: Path, mode: int) -> bool:
        del mode
        return path.name != "a_geometry"

    monkeypatch.setattr(module, "access", is_open)  # chmod closes nothing to the administrator
    result = mover("convert", "prototype", "a.osim")
    assert result.exit_code == 1
    assert result.stderr == "error: `a_geometry` cannot be written: permission denied\n"
    assert names(tmp_path) == ["a_geometry"]


@needs_posix
def test_parts_of_dead_programs_are_removed_by_the_next_run(tmp_path: Path):
    make = "import sys; from pathlib import Path; from generator.text_io import temporary_path\n"
    make += "print(temporary_path(Path(sys.argv[1])))"
    line = [sys.executable, "-c", make, str(tmp_path / "fall.npz")]
    printed = subprocess.run(line, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    dead = Path(printed.strip())
    dead.write_text("half")
    folder = dead.with_name(dead.name.replace("fall.npz", "model"))
    folder.mkdir()
    (folder / "structure").write_text("half")
    kept = [
        temporary_path(tmp_path / "running.npz"),  # of a program that runs
        dead.with_name(".mine.part"),
        dead.with_name(f".download.{os.getpid()}.part"),
    ]
    for path in kept:
        path.write_text("kept")
    write_files({tmp_path / "other.csv": "text"})
    assert names(tmp_path) == sorted([*(path.name for path in kept), "other.csv"])


def test_commands_run_in_threads(tmp_path: Path):
    """Python allows handlers of signals in the main thread only."""
    results: list[int] = []

    def work() -> None:
        words = ("simulate", "pendulum", "--stop", 0.02, "-o", tmp_path / "a.csv")
        results.append(mover(*words).exit_code)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert results == [0]
    assert names(tmp_path) == ["a.csv"]


@pytest.mark.parametrize("block", [hold_interrupts, defer_interrupt])
def test_a_signal_in_a_block_acts_at_its_end(block: Callable[..., object], sigint_handler: None):
    reached: list[str] = []

    def interrupted() -> None:
        with block():
            signal.raise_signal(signal.SIGINT)
            reached.append("the end of the block")

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert reached
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.parametrize(
    "block", [hold_interrupts, defer_interrupt, lambda: call_on_signals(pytest.fail)]
)
def test_an_ignored_signal_stays_ignored(block: Callable[..., object]):
    """As in a background job of a shell."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with block():
            signal.raise_signal(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, before)


@needs_posix
def test_ctrl_c_while_exudyn_is_imported_is_an_interruption(tmp_path: Path):
    """Exudyn catches it, tries another build, and reports a damaged installation."""
    package = tmp_path / "exudyn"
    package.mkdir()
    (package / "__init__.py").write_text(
        "import signal\n"
        "try:\n    signal.raise_signal(signal.SIGINT)\n"
        "except BaseException:\n    raise ImportError('no build can be loaded')\n"
    )
    environment = {**ENVIRONMENT, "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])}
    line = [sys.executable, "-m", "generator.cli.app", "simulate", "pendulum", "-o", "a.csv"]
    done = subprocess.run(line, cwd=tmp_path, env=environment, capture_output=True, check=False)
    assert done.returncode == 3
    assert done.stderr == b"error: interrupted before anything was written\n"


@pytest.mark.slow
@needs_posix
def test_real_interrupts_leave_all_files_or_none(tmp_path: Path):
    tries = list(interrupt_commands(tmp_path, count=5))
    assert len(tries) == 5
    for each in tries:
        assert each.ending in Interruption.ENDINGS, each
