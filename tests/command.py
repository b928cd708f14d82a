"""The command `mover`, run in this process."""

import json
from typing import Any

from typer.testing import CliRunner, Result

from generator.cli.app import app


def mover(*words: object) -> Result:
    """Result of a command line."""
    return CliRunner().invoke(app, [str(word) for word in words])


def run(*words: object) -> Result:
    """Result of a command that succeeds."""
    result = mover(*words)
    assert result.exit_code == 0, result.output
    return result


def answer(*words: object) -> Any:
    """JSON of a command that succeeds."""
    return json.loads(run(*words, "--json").stdout)
