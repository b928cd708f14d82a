"""The commands that pose a figure: `pose`, `com`, `stability`, `shoulder`, `link`, `settle`."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from generator.command_line.options import (
    Along,
    Joins,
    Json,
    LinksFile,
    Lock,
    Name,
    PoseFile,
    PoseOutput,
    Set,
    Springs,
    Table,
)

if TYPE_CHECKING:
    from generator.cli.answer import CommandResult


class Side(StrEnum):
    """The sides of the body, by the names of `generator.kinematics.shoulder.Side`."""

    LEFT = "left"
    RIGHT = "right"


class Rhythm(StrEnum):
    """The rhythms of the shoulder, by the names of `generator.kinematics.shoulder_rhythm`."""

    OTANI = "otani"
    DE_GROOT_BRAND = "de_groot_brand"


def pose(
    figure: Name,
    file: PoseFile = None,
    displacements: Set = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="A .pose file, or a .fig with these displacements.",
        ),
    ] = None,
    as_json: Json = False,
) -> "CommandResult":
    """Show and keep a pose: displacements of all joints, positions of all sites.

    The option --set may be repeated and changes what --pose says.
    """
    del as_json
    from generator.cli import pose as command

    return command.pose(figure, file, displacements or (), output)


def com(
    figure: Name,
    pose: PoseFile = None,
    displacements: Set = None,
    segments: Annotated[
        str | None, typer.Option(metavar="a,b,...", help="Of these segments alone.")
    ] = None,
    along: Along = None,
    output: Table = None,
    as_json: Json = False,
) -> "CommandResult":
    """Find the centre of mass of a figure, in a pose or along a motion."""
    del as_json
    from generator.cli import com as command

    return command.com(command.Request(figure, pose, displacements or (), segments, along, output))


def stability(
    figure: Name,
    support: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SEGMENT[:FACE,...]|SEGMENT.SITE",
            help="What carries the figure: faces of a segment's psurf, counted from 1, or all of "
            "them, or a site. May be repeated.",
        ),
    ] = None,
    below: Annotated[
        str | None,
        typer.Option(metavar="HEIGHT", help="In its place: all faces at or below, such as 1cm."),
    ] = None,
    up: Annotated[
        str | None, typer.Option(metavar="X,Y,Z", help="Normal of the ground; 0,1,0.")
    ] = None,
    pose: PoseFile = None,
    displacements: Set = None,
    along: Along = None,
    output: Table = None,
    as_json: Json = False,
) -> "CommandResult":
    """Test whether the centre of mass stands over the support, in a pose or along a motion."""
    del as_json
    from generator.cli import stability as command

    return command.stability_of(
        command.Request(figure, support or (), below, up, pose, displacements or (), along, output)
    )


def shoulder(
    figure: Name,
    side: Annotated[Side, typer.Option(help="Which arm.")],
    latitude: Annotated[float, typer.Option(help="Of the elbow [deg]; 0 overhead, 180 hanging.")],
    longitude: Annotated[
        float, typer.Option(help="Of the elbow [deg]; 0 ahead, 90 to the arm's own side.")
    ],
    rhythm: Annotated[
        Rhythm, typer.Option(help="How the clavicle follows the arm.")
    ] = Rhythm.OTANI,
    output: PoseOutput = None,
    as_json: Json = False,
) -> "CommandResult":
    """Position an arm by where its elbow points, with the clavicle and the natural twist."""
    del as_json
    from generator.cli import shoulder as command

    return command.shoulder(
        figure,
        side=side.value,
        latitude=latitude,
        longitude=longitude,
        rhythm=rhythm.value,
        output=output,
    )


def link(
    figure: Name,
    links: Annotated[
        Path, typer.Argument(metavar="LINKS.toml", help="A file of links, docs/links.md.")
    ],
    pose: PoseFile = None,
    displacements: Set = None,
    output: PoseOutput = None,
    as_json: Json = False,
) -> "CommandResult":
    """Set joints and let those follow that are linked to them.

    The option --set may be repeated and changes what --pose says.
    """
    del as_json
    from generator.cli import link as command

    return command.link(figure, links, pose, displacements or (), output)


def settle(
    figure: Name,
    springs: Springs = None,
    law: Joins = None,
    gravity: Annotated[
        str | None, typer.Option(metavar="X,Y,Z", help="[m/s^2], world axes; 0,-9.81,0.")
    ] = None,
    pose: PoseFile = None,
    displacements: Set = None,
    links: LinksFile = None,
    locks: Lock = None,
    output: PoseOutput = None,
    as_json: Json = False,
) -> "CommandResult":
    """Find the pose in which a figure comes to rest under gravity and its springs.

    The options --set and --lock may be repeated.
    """
    del as_json
    from generator.cli import settle as command

    return command.settle(
        command.Request(
            figure=figure,
            springs=springs,
            law=None if law is None else law.value,
            gravity=gravity,
            pose=pose,
            displacements=displacements or (),
            links=links,
            locks=locks or (),
            output=output,
        )
    )
