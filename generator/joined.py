"""Commands that other packages join to `mover`, without this one importing them.

A package names them in its metadata, as entry points of the group `mover.commands`: the name of the
command, and a function. The function's parameters are those of a `typer` command, one of them
`as_json`, its docstring is the help, and it returns an `Answer`. Its module is imported when the
command is run, and for the help: it must be light, and import what is slow when it is called.
"""

from collections.abc import Callable
from functools import cache, partial
from importlib.metadata import EntryPoint, entry_points
from inspect import Signature, signature
from typing import TYPE_CHECKING, Any, Protocol

import typer
from typer.core import TyperGroup
from typer.main import get_command

if TYPE_CHECKING:
    from generator.commands.answer import Answer

GROUP = "mover.commands"


class Give(Protocol):
    """Prints an answer and exits with its code."""

    def __call__(self, make: "Callable[[], Answer]", *, as_json: bool) -> None:
        """Make the answer, or say what kept it from being made."""
        ...


@cache
def joined_commands() -> dict[str, EntryPoint]:
    """The entry points of all installed packages, by the names of their commands."""
    return {entry.name: entry for entry in entry_points(group=GROUP)}


def joining(give: Give) -> type[TyperGroup]:
    """The kind of a group of commands to which installed packages join theirs; its own win."""

    class Joining(TyperGroup):
        def list_commands(self, ctx: Any) -> list[str]:
            own = super().list_commands(ctx)
            return [*own, *sorted(set(joined_commands()) - set(own))]

        def get_command(self, ctx: Any, cmd_name: str) -> Any:
            own = super().get_command(ctx, cmd_name)
            if own is not None or cmd_name not in joined_commands():
                return own
            return _command(cmd_name, joined_commands()[cmd_name].load(), give)

    return Joining


def _command(name: str, function: "Callable[..., Answer]", give: Give) -> Any:
    """The command that gives the answer of a function of the command line.

    `typer` reads parameters and annotations. That of the answer is left out: its type lives in a
    module that the help need not import.
    """

    def run(**given: Any) -> None:
        give(partial(function, **given), as_json=given["as_json"])

    run.__doc__ = function.__doc__
    run.__annotations__ = {k: v for k, v in function.__annotations__.items() if k != "return"}
    parameters = [
        one.replace(annotation=run.__annotations__[one.name])
        for one in signature(function).parameters.values()
    ]
    vars(run)["__signature__"] = Signature(parameters)
    app = typer.Typer(
        add_completion=False,
        rich_markup_mode=None,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.command(name)(run)
    return get_command(app)
