"""Commands of other packages: joined by name, loaded late, never in place of our own."""

import os
import re
import subprocess
import sys
from contextlib import suppress
from importlib.metadata import EntryPoint
from types import ModuleType
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner

from generator.cli import joined
from generator.cli.answer import CommandResult, ExitCode, UsageError
from generator.cli.app import app
from generator.cli.progress import ItemMonitor
from generator.diagnostics import InputError, error


def greet(
    name: Annotated[str, typer.Argument(help="Who is greeted.")],
    times: Annotated[int, typer.Option(help="How often.")] = 1,
    as_json: Annotated[bool, typer.Option("--json")] = False,
) -> "CommandResult":
    """Say hello."""
    del as_json
    if times < 1:
        raise UsageError("--times is at least 1")
    if name == "nobody":
        raise InputError((error("there is nobody"),))
    code = ExitCode.RUN_FAILED if name == "ghost" else ExitCode.SUCCESS
    return CommandResult(
        " ".join([f"hello {name}"] * times), {"name": name, "times": times}, code=code
    )


def count(
    steps: int,
    quiet: Annotated[bool, typer.Option("--quiet")] = False,
    as_json: Annotated[bool, typer.Option("--json")] = False,
    *,
    progress: "ItemMonitor",
) -> "CommandResult":
    """Count, and tell of it."""
    del quiet, as_json
    with progress(steps, "steps") as done:
        for k in range(steps):
            done(str(k))
    return CommandResult(f"counted {steps} with {progress.__name__}", steps)


@pytest.fixture(autouse=True)
def _others(monkeypatch: pytest.MonkeyPatch):
    """Another package that joins `greet`, `count`, and a `check` of its own."""
    module = ModuleType("another_package")
    vars(module).update(greet=greet, count=count)
    monkeypatch.setitem(sys.modules, "another_package", module)
    entries = {
        name: EntryPoint(name, value, joined.GROUP)
        for name, value in (
            ("greet", "another_package:greet"),
            ("count", "another_package:count"),
            ("check", "another_package:greet"),
        )
    }
    monkeypatch.setattr(joined, "joined_commands", lambda: entries)


def test_the_help_lists_it_after_ours():
    said = CliRunner().invoke(app, ["--help"]).stdout
    listed = re.findall(r"^  (\w+)  +([A-Z].*)$", said, re.MULTILINE)
    names = [name for name, _ in listed]
    assert names.count("check") == 1
    assert names[-2:] == ["count", "greet"]
    assert listed[-1] == ("greet", "Say hello.")


def test_it_is_run_with_its_options():
    result = CliRunner().invoke(app, ["greet", "Ada", "--times", "2"])
    assert (result.exit_code, result.stdout) == (0, "hello Ada hello Ada\n")
    result = CliRunner().invoke(app, ["greet", "Ada", "--json"])
    assert result.stdout == '{\n  "name": "Ada",\n  "times": 1\n}\n'


def test_its_help_is_its_own():
    said = CliRunner().invoke(app, ["greet", "-h"]).stdout
    assert "Who is greeted." in said
    assert "[default: 1]" in said


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (("ghost",), 3, ""),
        (("Ada", "--times", "0"), 2, "--times is at least 1"),
        (("Ada", "--times", "often"), 2, "Invalid value for '--times'"),
        (("nobody",), 1, "there is nobody"),
        ((), 2, "Missing argument"),
    ],
)
def test_it_ends_as_ours_do(words: tuple[str, ...], code: int, message: str):
    result = CliRunner().invoke(app, ["greet", *words])
    assert result.exit_code == code
    assert message in result.stderr


def test_our_own_commands_win():
    result = CliRunner().invoke(app, ["check", "prototype"])
    assert "the figure can be simulated" in result.stdout


def test_an_unknown_command_is_unknown():
    result = CliRunner().invoke(app, ["greeet"])
    assert result.exit_code == 2
    assert "No such command 'greeet'" in result.stderr


def test_progress_is_given_and_no_option():
    result = CliRunner().invoke(app, ["count", "3"])
    assert (result.stdout, result.stderr) == ("counted 3 with unshown\n", "")
    assert "progress" not in CliRunner().invoke(app, ["count", "-h"]).stdout
    assert CliRunner().invoke(app, ["count", "3", "--progress", "x"]).exit_code == 2


def test_quiet_says_nothing_when_nothing_is_wrong():
    result = CliRunner().invoke(app, ["count", "3", "--quiet"])
    assert (result.exit_code, result.output) == (0, "")


@pytest.mark.parametrize(
    ("words", "shown"), [((), True), (("--json",), False), (("--quiet",), False)]
)
def test_a_bar_is_shown_on_a_terminal_only(words: tuple[str, ...], shown: bool):
    pty = pytest.importorskip("pty")
    script = (
        "from importlib.metadata import EntryPoint\n"
        "from generator import cli, joined\n"
        "entry = EntryPoint('count', 'tests.generator.cli.test_joined:count', joined.GROUP)\n"
        "joined.joined_commands = lambda: {'count': entry}\n"
        "cli.main()\n"
    )
    terminal, inner = pty.openpty()
    done = subprocess.run(
        [sys.executable, "-c", script, "count", "3", *words],
        env=os.environ | {"TERM": "xterm"},
        stdout=subprocess.PIPE,
        stderr=inner,
        check=False,
    )
    os.close(inner)
    seen = b""
    with suppress(OSError):  # how a terminal says that the other end is closed
        while chunk := os.read(terminal, 1000):
            seen += chunk
    assert done.returncode == 0, seen
    assert (b"3 of 3 steps" in seen) is shown
    assert bool(seen) is shown
