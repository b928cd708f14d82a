"""The commands that weigh surfaces: `mass` and `complete`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from generator.command_line.options import Json, Name

if TYPE_CHECKING:
    from generator.cli.answer import CommandResult


def mass(
    file: Annotated[
        str,
        typer.Argument(
            metavar="FILE", help="A surface: .pss .stl .obj .ply .glb; with --segment a figure."
        ),
    ],
    density: Annotated[str, typer.Option(metavar="1.05g/cm3", help="With its unit.")],
    unit: Annotated[
        str | None,
        typer.Option(help="What 1 means in the file: mm, cm, m, in, ft. A .pss has cm, a .glb m."),
    ] = None,
    about: Annotated[
        str | None,
        typer.Option(metavar="X,Y,Z", help="Inertia about this point too, in the file's unit."),
    ] = None,
    segment: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="The psurf of this segment, as lines to paste."),
    ] = None,
    fix_winding: Annotated[
        bool, typer.Option("--fix-winding", help="Turn faces that look to the wrong side.")
    ] = False,
    as_json: Json = False,
) -> "CommandResult":
    """Weigh the body within a surface: volume, mass, centre of mass, inertia."""
    del as_json
    from generator.cli import mass as command

    return command.mass(
        command.Request(file, density, unit, about, segment, fix_winding=fix_winding)
    )


def complete(
    figure: Name,
    density: Annotated[str, typer.Option(metavar="1.05g/cm3", help="With its unit.")],
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="OUT.fig", help="Where the figure goes.")
    ],
    as_json: Json = False,
) -> "CommandResult":
    """Fill in the masses, inertias and centres of mass that a figure lacks, from its psurfs."""
    del as_json
    from generator.cli import complete as command

    return command.complete(figure, density, output)
