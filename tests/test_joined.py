"""Commands of other packages: joined by name, loaded late, never in place of our own."""

import sys
from importlib.metadata import EntryPoint
from types import ModuleType
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner

from generator import joined
from generator.cli import app
from generator.commands.answer import Answer, ExitCode, UsageError
from generator.errors import InputError, error


def greet(
    name: Annotated[str, typer.Argument(help="Who is greeted.")],
    times: Annotated[int, typer.Option(help="How often.")] = 1,
    as_json: Annotated[bool, typer.Option("--json")] = False,
) -> "Answer":
    """Say hello."""
    del as_json
    if times < 1:
        raise UsageError("--times is at least 1")
    if name == "nobody":
        raise InputError((error("there is nobody"),))
    code = ExitCode.RUN_FAILED if name == "ghost" else ExitCode.GOOD
    return Answer(" ".join([f"hello {name}"] * times), {"name": name, "times": times}, code=code)


@pytest.fixture(autouse=True)
def _others(monkeypatch: pytest.MonkeyPatch):
    """Another package that joins `greet`, and a `check` of its own."""
    module = ModuleType("another_package")
    vars(module)["greet"] = greet
    monkeypatch.setitem(sys.modules, "another_package", module)
    entries = {
        name: EntryPoint(name, value, joined.GROUP)
        for name, value in (
            ("greet", "another_package:greet"),
            ("check", "another_package:greet"),
        )
    }
    monkeypatch.setattr(joined, "joined_commands", lambda: entries)


def test_the_help_lists_it_after_ours():
    said = CliRunner().invoke(app, ["--help"]).stdout
    assert said.count("  check ") == 1
    assert said.index("  cite ") < said.index("  greet     Say hello.")


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
