"""Commands that other packages join to `mover`, without this one importing them.

A package names them in its metadata, as entry points of the group `mover.commands`: the name of the
command, and a function. The function's parameters are those of a `typer` command, one of them
`as_json`, its docstring is the help, and it returns an `Answer`. Its module is imported when the
command is run, and for the help: it must be light, and import what is slow when it is called.

Two parameters have a meaning of their own. `quiet` is an option as `as_json` is, of a command that
then says only what went wrong. `progress` is none of the command line: it gets a `Progress`, which
shows on a terminal how far the command is.
"""

from collections.abc import Callable, Mapping
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from inspect import Signature, signature
from typing import TYPE_CHECKING, Any, Protocol

import typer
from typer.core import TyperGroup
from typer.main import get_command

if TYPE_CHECKING:
    from generator.cli.answer import CommandResult
    from generator.cli.progress import ItemMonitor

GROUP = "mover.commands"

_PROGRESS = "progress"


class Give(Protocol):
    """Prints an answer and exits with its code."""

    def __call__(
        self, make: "Callable[[ItemMonitor], CommandResult]", *, as_json: bool, quiet: bool
    ) -> None:
        """Make the answer, or say what kept it from being made."""
        ...


@cache
def joined_commands() -> dict[str, EntryPoint]:
    """The entry points of all installed packages, by the names of their commands."""
    return {entry.name: entry for entry in entry_points(group=GROUP)}


def joining(give: Give, own: "Mapping[str, Callable[..., CommandResult]]") -> type[TyperGroup]:
    """The kind of a group of commands to which installed packages join theirs.

    Args:
        give: prints the answers.
        own: functions of the command line that are commands beside those the group has; they and
            those win over commands of other packages.
    """

    class Joining(TyperGroup):
        def list_commands(self, ctx: Any) -> list[str]:
            known = [*super().list_commands(ctx), *own]
            return [*known, *sorted(set(joined_commands()) - set(known))]

        def get_command(self, ctx: Any, cmd_name: str) -> Any:
            known = super().get_command(ctx, cmd_name)
            if known is not None:
                return known
            if cmd_name in own:
                return _command(cmd_name, own[cmd_name], give)
            if cmd_name not in joined_commands():
                return None
            return _command(cmd_name, joined_commands()[cmd_name].load(), give)

    return Joining


def _command(name: str, function: "Callable[..., CommandResult]", give: Give) -> Any:
    """The command that gives the answer of a function of the command line.

    `typer` reads parameters and annotations. Those of the answer and of the progress are left out:
    their types live in modules that the help need not import.
    """
    accepted = signature(function).parameters

    def run(**given: Any) -> None:
        def make(progress: "ItemMonitor") -> "CommandResult":
            shown = {_PROGRESS: progress} if _PROGRESS in accepted else {}
            return function(**given, **shown)

        give(make, as_json=given["as_json"], quiet=given.get("quiet", False))

    parameters = [
        one.replace(annotation=function.__annotations__[one.name])
        for one in accepted.values()
        if one.name != _PROGRESS
    ]
    run.__doc__ = function.__doc__
    run.__annotations__ = {one.name: one.annotation for one in parameters}
    vars(run)["__signature__"] = Signature(parameters)
    app = typer.Typer(
        add_completion=False,
        rich_markup_mode=None,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.command(name)(run)
    return get_command(app)
