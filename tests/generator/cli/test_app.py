"""The command line itself: its help, exit codes, streams, signals, and what its parser refuses."""

import json
import os
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from generator import read_action
from generator.cli import app as module
from generator.cli.answer import HIDDEN, CommandResult, Paragraphs
from generator.cli.app import COMMANDS, MODULES, command_function
from generator.recording import Ending
from tests.command import mover, run
from tests.paths import FAULTS, FIGURES, ROOT
from tests.processes import ENVIRONMENT, on_terminal, read_to_end

LOADED = """
import sys
import generator.cli.app
SLOW = {"exudyn", "scipy", "numpy", "matplotlib", "generator.figure_file"}
print(*sorted(SLOW & set(sys.modules)))
"""


def shell(line: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a line of the shell, in which `MOVER` is the command."""
    line = line.replace("MOVER", f"{shlex.quote(sys.executable)} -m generator.cli.app")
    return subprocess.run(
        line, shell=True, cwd=folder, env=ENVIRONMENT, capture_output=True, text=True, check=False
    )


def test_the_command_starts_without_slow_libraries():
    line = [sys.executable, "-c", LOADED]
    assert subprocess.run(line, env=ENVIRONMENT, capture_output=True, check=True).stdout == b"\n"


def test_the_help_of_a_command_opens_with_its_line_in_the_list():
    listed = dict(re.findall(r"^  ([\w-]+)  +(.*)$", run("--help").stdout, re.MULTILINE))
    for command, summary in COMMANDS.items():
        assert str(command_function(command).__doc__).splitlines()[0] == summary
        assert listed[command] == summary  # on one line of a terminal
    assert COMMANDS["com"] in " ".join(run("com", "-h").stdout.split())


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("simulate pendulum --stop soon", "'--stop': give a number of seconds, such as 0.5, w"),
        ("simulate pendulum --height 50cm", "'--height': give a number of metres, such as 0."),
        ("simulate pendulum --friction low", "'--friction': give a number, without a unit"),
        ("simulate pendulum --seed 1.5", "Invalid value for '--seed': give a whole number"),
        ("simulate pendulum --law cubic", "Invalid value for '--law': 'cubic' is not one of"),
        ("simulate", "Missing argument 'FIGURE'"),
        ("convert fall.action", "Missing argument"),
        ("shoulder prototype --side left --latitude abc", "'--latitude'"),
        ("shoulder clavicles --side left --latitude 9 --longitude 0 --rhythm waltz", "'waltz'"),
        ("complete prototype -o a.fig", "Missing option '--density'"),
        ("complete prototype --density 1g/cm3", "Missing option '--output'"),
        ("fit data.csv --axis w", "Invalid value for '--axis'"),
        ("plots -o there --jobs 0", "Invalid value for '--jobs': the number should be "),
        ("com prototype --strict", "No such option: --strict"),
        ("dance prototype", "No such command 'dance'"),
        ("--strict", "No such option: --strict"),
    ],
)
def test_a_refusal_of_the_parser_is_on_the_error_stream_and_in_json(line: str, message: str):
    plain, result = mover(*line.split()), mover(*line.split(), "--json")
    assert (plain.exit_code, result.exit_code) == (2, 2)
    assert plain.stdout == ""
    assert message in plain.stderr
    assert result.stderr == plain.stderr
    assert message in json.loads(result.stdout)["error"]


@pytest.mark.parametrize(("line", "code"), [("com nobody", 1), ("com prototype --set x=1", 2)])
def test_without_json_a_refusal_leaves_the_output_empty(line: str, code: int):
    result = mover(*line.split())
    assert (result.exit_code, result.stdout) == (code, "")
    assert result.stderr == mover(*line.split(), "--json").stderr


def add_command(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Make a function of this module a command."""
    monkeypatch.setitem(COMMANDS, name, name)
    monkeypatch.setitem(MODULES, name, __name__)


SHOWN: list[bool] = []


@dataclass(frozen=True)
class Counted(CommandResult):
    steps: int
    text: str = field(default="counted", metadata=HIDDEN)

    def paragraphs(self) -> Paragraphs:
        return (f"{self.text} {self.steps}",)


def count(steps: int = 1, *, show_progress: bool) -> CommandResult:
    """Count."""
    SHOWN.append(show_progress)
    return Counted(steps)


@pytest.mark.parametrize("terminal", [True, False])
@pytest.mark.parametrize(
    ("words", "output"),
    [((), "counted 3\n"), (("--json",), '{\n  "steps": 3\n}\n'), (("--quiet",), "")],
)
def test_progress_is_shown_on_a_terminal_unless_quiet(
    terminal: bool, words: tuple[str, ...], output: str, monkeypatch: pytest.MonkeyPatch
):
    add_command("count", monkeypatch)
    monkeypatch.setattr(module, "_has_terminal", lambda: terminal)
    assert run("count", "--steps", 3, *words).stdout == output
    assert SHOWN.pop() is (terminal and words != ("--quiet",))


def lose() -> CommandResult:
    """Find a file gone."""
    raise PermissionError(13, "Permission denied", "walk.fig")


def test_an_input_that_vanishes_is_not_an_output(monkeypatch: pytest.MonkeyPatch):
    add_command("lose", monkeypatch)
    done = mover("lose", "--json")
    message = "`walk.fig` cannot be read: permission denied"
    assert (done.exit_code, done.stderr) == (1, f"error: {message}\n")
    assert json.loads(done.stdout) == {"error": message}


def overflow() -> CommandResult:
    """Multiply numbers beyond the largest float."""
    return Counted(0, str(np.array([1e308]) * np.array([10.0])))


def test_numpy_warns_of_nothing(monkeypatch: pytest.MonkeyPatch, recwarn: pytest.WarningsRecorder):
    add_command("overflow", monkeypatch)
    done = run("overflow")
    assert (done.stdout, done.stderr, list(recwarn)) == ("[inf] 0\n", "", [])


def interrupt(*_: object, **__: object) -> Any:
    raise KeyboardInterrupt


INTERRUPTION = "interrupted before anything was written"


@pytest.mark.parametrize("place", ["app", "generator.cli.inputs:load_figure"])
def test_ctrl_c_before_a_run_is_reported(
    place: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    """While the parser is made, and while a command reads its input."""
    path, _, name = place.rpartition(":")
    monkeypatch.setattr(import_module(path) if path else module, name, interrupt)
    monkeypatch.setattr(sys, "argv", ["mover", "com", "prototype", "--json"])
    with pytest.raises(SystemExit) as ended:
        module.main()
    printed, message = capsys.readouterr()
    assert (ended.value.code, message) == (3, f"error: {INTERRUPTION}\n")
    assert json.loads(printed) == {"error": INTERRUPTION}


def test_ctrl_c_while_the_command_is_imported_is_reported(tmp_path: Path):
    (tmp_path / "typer.py").write_text("raise KeyboardInterrupt")
    line = [sys.executable, "-m", "generator.cli.app", "com", "prototype", "--json"]
    environment = {**ENVIRONMENT, "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])}
    done = subprocess.run(line, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (3, f"error: {INTERRUPTION}\n")
    assert json.loads(done.stdout) == {"error": INTERRUPTION}


@pytest.mark.skipif(os.name != "posix", reason="needs SIGINT")
def test_ctrl_c_keeps_what_was_simulated(tmp_path: Path):
    line = [sys.executable, "-m", "generator.cli.app", "simulate", "prototype"]
    line += ["--stop", "300", "--springs", "none", "-o", "fall.action"]
    with on_terminal(line, cwd=tmp_path) as (run, terminal):
        seen = b""
        while b"real time" not in seen:
            seen += os.read(terminal, 1000)
        run.send_signal(signal.SIGINT)
        seen += read_to_end(terminal)
        said, _ = run.communicate()
    assert run.returncode == 3
    assert b"pass 2, step" in seen
    assert b"interrupted at" in said
    action = read_action(tmp_path / "fall.action")
    assert action.header.outcome is Ending.INTERRUPTED
    assert 0.0 < action.times[-1] < 300.0


def test_a_reader_that_leaves_early_sees_no_traceback(tmp_path: Path):
    done = shell("MOVER describe prototype --json | head -c 10", tmp_path)
    assert "Traceback" not in done.stderr
    assert done.stdout.startswith("{")


@pytest.mark.skipif(os.name != "posix", reason="needs a shell that closes streams")
@pytest.mark.parametrize(("stream", "output"), [("1", ""), ("2", "Finished 0.02 s")])
def test_a_stream_may_be_closed(stream: str, output: str, tmp_path: Path):
    line = f"MOVER simulate pendulum --stop 0.02 -o swing.csv {stream}>&-"
    done = shell(line, tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith(output)
    assert (tmp_path / "swing.csv").exists()


@pytest.mark.skipif(sys.platform != "linux", reason="needs a device that is full")
@pytest.mark.parametrize("words", ["describe pendulum", "--help"])
def test_an_output_that_is_full_is_reported(words: str, tmp_path: Path):
    done = shell(f"MOVER {words} > /dev/full", tmp_path)
    assert done.returncode == 1
    assert done.stderr == "error: the output could not be written: No space left on device\n"


@pytest.mark.skipif(sys.platform != "linux", reason="needs a device that is full")
@pytest.mark.parametrize(("words", "code"), [("--strict", 2), ("com prototype", 0)])
def test_an_error_stream_that_is_full_changes_nothing(words: str, code: int, tmp_path: Path):
    done = shell(f"MOVER {words} --json 2> /dev/full", tmp_path)
    assert done.returncode == code
    assert ("error" in json.loads(done.stdout)) == (code != 0)


@pytest.mark.skipif(sys.platform != "linux", reason="needs names that are any bytes")
def test_a_name_that_is_not_text_can_be_printed(tmp_path: Path):
    (tmp_path / "odd\udcff.fig").write_bytes((FIGURES / "fourbar.fig").read_bytes())
    line = [sys.executable, "-m", "generator.cli.app", "check", "odd\udcff.fig"]
    environment = {**ENVIRONMENT, "PYTHONIOENCODING": "utf-8"}
    done = subprocess.run(line, cwd=tmp_path, env=environment, capture_output=True, check=False)
    assert done.returncode == 0
    assert b"odd\\udcff.fig: no errors" in done.stdout


# Completion and colours


COMPLETE = """
import os, sys
sys.argv = ["mover"]
from generator.cli.app import main
for line in os.environ["LINES_TO_COMPLETE"].splitlines():
    words = {"COMP_WORDS": line, "COMP_CWORD": str(line.count(" ")), "_TYPER_COMPLETE_ARGS": line}
    os.environ.update(words)
    try:
        main()
    except SystemExit as end:
        assert not end.code
    print("====", flush=True)
"""


def completions(
    shell: str, lines: Sequence[str], *python_options: str
) -> "subprocess.CompletedProcess[str]":
    """Completions that a shell offers for the last words of lines, one line after the other."""
    environment = {
        "_MOVER_COMPLETE": f"complete_{shell}",
        "LINES_TO_COMPLETE": "\n".join(lines),
        "_TYPER_COMPLETE_FISH_ACTION": "get-args",
    }
    return subprocess.run(
        [sys.executable, *python_options, "-c", COMPLETE],
        env={**ENVIRONMENT, **environment},
        cwd=FAULTS / "pose",
        capture_output=True,
        text=True,
        check=True,
    )


OFFERED = {
    "mover s": (["simulate", "settle", "shoulder", "stability"], ["check", "describe"]),
    "mover simulate p": (["prototype", "pendulum"], ["fourbar"]),
    "mover check pr": (["prototype"], ["pendulum"]),
    "mover simulate prototype --gr": (["--gravity"], ["--stop"]),
}
"""Lines, what is offered for them, and what is not."""


@pytest.mark.parametrize("shell", ["bash", "fish"])
def test_a_shell_completes_commands_figures_and_options(shell: str):
    *answers, rest = completions(shell, list(OFFERED)).stdout.split("====\n")
    assert rest == ""
    for (line, (offered, others)), found in zip(OFFERED.items(), answers, strict=True):
        words = re.findall(r"[\w-]+", found)
        assert set(offered) <= set(words), line
        assert not set(others) & set(words), line


def test_names_of_commands_complete_without_importing_them():
    done = completions("bash", ["mover "], "-X", "importtime")
    assert done.stdout.split() == [*COMMANDS, "===="]
    assert not re.search(r"\b(numpy|scipy|exudyn|rich)\b", done.stderr)


def test_a_script_for_completion_is_shown():
    done = subprocess.run(
        ["bash", "-c", f"{sys.executable} -m generator.cli --show-completion; exit"],
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert "COMPLETE=complete_" in done.stdout


FAULTY = FAULTS / "figure" / "inertia.fig"


def colours(folder: Path, **variables: str) -> str:
    """Output of `describe` of a faulty figure on a terminal."""
    line = [sys.executable, "-m", "generator.cli", "describe", str(FAULTY)]
    with on_terminal(line, folder, {"NO_COLOR": "", **variables}) as (_, terminal):
        return read_to_end(terminal).decode()


def test_severities_and_marks_have_colours_on_a_terminal(tmp_path: Path):
    told = colours(tmp_path)
    assert re.search(r"inertia\.fig:\d+:\d+: \x1b\[31m\x1b\[1merror:\x1b\[0m the", told)
    assert re.search(r"\| +\x1b\[1m\^+\x1b\[0m\r\n", told)
    plain = re.sub(r"\x1b\[\d+m", "", told).replace("\r\n", "\n")
    assert plain == mover("describe", FAULTY).stderr


def test_colours_can_be_left_out(tmp_path: Path):
    told = colours(tmp_path, NO_COLOR="1")
    assert ": error: the inertia of" in told
    assert "\x1b" not in told


def test_warnings_are_yellow_and_pipes_have_no_colours(
    monkeypatch: pytest.MonkeyPatch,
):
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    assert module.paint("a.fig:1:2: warning: odd\nerrors: 3\nnotes: error: 4") == (
        "a.fig:1:2: \x1b[33m\x1b[1mwarning:\x1b[0m odd\nerrors: 3\nnotes: error: 4"
    )
    assert "\x1b" not in mover("describe", FAULTY).output
