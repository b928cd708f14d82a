"""Arguments and options that several commands have."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer


class Law(StrEnum):
    """The laws that join the axes of a spherical joint, by the names of `springs.Joining`."""

    CONSERVATIVE = "conservative"
    WEIGHTED = "weighted"


Name = Annotated[
    str,
    typer.Argument(metavar="FIGURE", help="A figure file, or the name of a shipped figure."),
]
Checked = Annotated[
    str,
    typer.Argument(
        metavar="FIGURE|SPRINGS.toml",
        help="A figure file, the name of a shipped figure, or a springs file.",
    ),
]
Cited = Annotated[
    str,
    typer.Argument(
        metavar="FIGURE|TABLE",
        help="A figure file, the name of a shipped figure, a published table such as "
        "`riener_edrich_1999` or `riener_edrich_1999/leg`, or `tables` for a list of them.",
    ),
]
Springs = Annotated[
    str | None,
    typer.Option(
        metavar="FILE|NAME|none|printed",
        help="Other springs than the figure's own: a .springs.toml or .optional file, the NAME of "
        "FIGURE.NAME.springs.toml beside it, `none`, or `printed` for the values as printed.",
    ),
]
PoseFile = Annotated[
    Path | None,
    typer.Option("--pose", metavar="FILE.pose", help="A pose, as `mover pose` writes it."),
]
Set = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="JOINT=a,b,c", help="Displacements [deg or cm]."),
]
Joins = Annotated[Law | None, typer.Option("--law", help="How the axes of a spherical joint join.")]
LinksFile = Annotated[
    Path | None,
    typer.Option("--links", metavar="LINKS.toml", help="Links that hold, docs/links.md."),
]
Lock = Annotated[
    list[str] | None,
    typer.Option("--lock", metavar="JOINT", help="A joint that stays at its displacement."),
]
Along = Annotated[
    Path | None, typer.Option(metavar="MOTION.action", help="A motion, in place of one pose.")
]
Table = Annotated[
    Path | None,
    typer.Option("--output", "-o", metavar="FILE.csv", help="A row for each frame of the motion."),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON value.")]


PoseOutput = Annotated[
    Path | None,
    typer.Option("--output", "-o", metavar="FILE.pose", help="Where the pose goes."),
]
