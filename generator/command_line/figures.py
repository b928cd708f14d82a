"""The commands that read a figure: `check`, `describe`, `cite`."""

from typing import TYPE_CHECKING

from generator.command_line.options import Checked, Cited, Json, Name, Springs

if TYPE_CHECKING:
    from generator.cli.answer import CommandResult


def check(figure: Checked, springs: Springs = None, as_json: Json = False) -> "CommandResult":
    """Report all that is wrong or odd in a figure, its springs and their curves."""
    del as_json
    from generator.cli import check as command

    return command.check(figure, springs)


def describe(figure: Name, springs: Springs = None, as_json: Json = False) -> "CommandResult":
    """Show segments, masses, joints and springs of a figure."""
    del as_json
    from generator.cli import describe as command

    return command.describe(figure, springs)


def cite(figure: Cited, springs: Springs = None, as_json: Json = False) -> "CommandResult":
    """Show the references of the numbers that a figure uses, or of a published table."""
    del as_json
    from generator.cli import cite as command

    return command.cite(figure, springs)
