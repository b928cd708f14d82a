"""The command that changes formats: `convert`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from generator.command_line.options import Json, Springs

if TYPE_CHECKING:
    from generator.cli.answer import CommandResult


def convert(
    source: Annotated[
        str,
        typer.Argument(
            metavar="MOTION|FIGURE|MODEL",
            help="A motion, .action or .npz, a figure as elsewhere, or another program's model: "
            ".xml .mjcf .urdf .osim (docs/import.md).",
        ),
    ],
    outputs: Annotated[
        list[Path],
        typer.Argument(
            metavar="OUTPUT...",
            help="Files to write, each in the format of its suffix (docs/formats.md). Of a motion: "
            ".action .csv .npz .glb .bvh .mot .sto .x3d. Of a model: figures, .fig.",
        ),
    ],
    figure: Annotated[
        str | None,
        typer.Option(metavar="FIGURE", help="Of the motion, where it is not the one it names."),
    ] = None,
    springs: Springs = None,
    to: Annotated[
        str | None, typer.Option(metavar="NAME", help="A format of figures, whatever the suffix.")
    ] = None,
    apart: Annotated[
        bool,
        typer.Option(
            "--apart", help="Of a model: hinges with springs or limits stay joints of their own."
        ),
    ] = False,
    as_json: Json = False,
) -> "CommandResult":
    """Write a motion or a figure for other programs, and tell what their formats cannot hold."""
    del as_json
    from generator.cli import convert as command

    return command.convert(command.Request(source, outputs, figure, springs, to, apart))
