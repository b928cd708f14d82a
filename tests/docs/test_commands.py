"""docs/commands.md lists every command, and every option of `mover simulate`."""

import re

from typer.testing import CliRunner

from generator.cli.app import COMMANDS, app
from tests.paths import DOCS

PAGE = (DOCS / "commands.md").read_text(encoding="utf-8")


def test_every_command_is_on_the_page() -> None:
    assert [name for name in COMMANDS if not re.search(rf"`mover {name}[ `]", PAGE)] == []


def test_every_option_of_simulate_is_on_the_page() -> None:
    text = CliRunner().invoke(app, ["simulate", "--help"]).output
    options = set(re.findall(r"--[a-z][a-z-]+", text)) - {"--help", "--output"}
    assert len(options) > 15
    assert sorted(one for one in options if f"`{one}" not in PAGE) == []
