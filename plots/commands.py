"""The commands `mover fit` and `mover plots`.

The rest is imported when a command runs: numpy and matplotlib are slow to import.
"""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from generator.cli.answer import CommandResult


class Axis(StrEnum):
    """Axis of a spring in its joint."""

    X = "x"
    Y = "y"
    Z = "z"
    JOINT = "joint"


class Medium(StrEnum):
    """Medium of pictures."""

    REPORT = "report"
    PAPER = "paper"


class Width(StrEnum):
    """Width of a picture in a paper [mm]."""

    COLUMN = "85"
    PAGE = "174"


def fit(
    data: Annotated[
        Path,
        typer.Argument(
            metavar="DATA.csv",
            help="Measured moments; columns such as `angle [deg]` and `moment [N m]`.",
        ),
    ],
    passive: Annotated[
        bool,
        typer.Option("--passive", help="Constrain the cubic to restore at both ends."),
    ] = False,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write a .springs.toml file."),
    ] = None,
    joints: Annotated[
        list[str] | None,
        typer.Option("--joint", metavar="NAME", help="Joint that gets the spring, with -o."),
    ] = None,
    axis: Annotated[Axis, typer.Option(help="Axis of the joint, if it has several.")] = Axis.JOINT,
    motion: Annotated[
        str, typer.Option(metavar="TEXT", help="Name of the positive sense, such as `flexion`.")
    ] = "",
    reference: Annotated[str, typer.Option(metavar="TEXT", help="Source of the data.")] = "",
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the fit as .svg or .png.")
    ] = None,
) -> "CommandResult":
    """Fit a cubic to measured moments and write it as a spring.

    The option --joint may be repeated.
    """
    from plots.fit import fit

    return fit(
        data,
        passive=passive,
        output=output,
        joints=joints or (),
        axis=None if axis is Axis.JOINT else axis.value,
        motion=motion,
        reference=reference,
        plot=plot,
    )


def plots(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME|MOTION.action|.npz]...",
            help="Plates to draw, or motions [default: all plates].",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Folder of the files."),
    ] = None,
    gallery: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.md", help="Write a Markdown page, with pictures in the folder FILE."
        ),
    ] = None,
    strict: Annotated[
        bool,
        typer.Option(
            "--strict",
            help="Fail if a claim does not hold; differences from published curves do not count.",
        ),
    ] = False,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Number of processes [default: number of cores].")
    ] = None,
    springs: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.springs.toml",
            help="Draw the curves of a springs file; with a motion, use its springs.",
        ),
    ] = None,
    against: Annotated[
        str | None,
        typer.Option(
            metavar="FILE|FIGURE",
            help="Springs to draw beside those of --springs: a springs file, or a figure's own.",
        ),
    ] = None,
    medium: Annotated[
        Medium, typer.Option("--for", help="Medium of the pictures.")
    ] = Medium.REPORT,
    width: Annotated[
        Width | None, typer.Option(help="Width for a paper [mm]. [default: 174]")
    ] = None,
    listed: Annotated[
        bool, typer.Option("--list", help="List the names of the plates and draw none.")
    ] = False,
    *,
    as_json: bool = False,
    show_progress: bool = False,
) -> "CommandResult":
    """Draw curves and motions, and check the claims about them.

    Each plate becomes a picture (.svg and .png) and its numbers (.csv); report.html shows them all.
    With --for paper each is written as .pdf and .svg, with its caption in .txt and its references
    in .bib; there is no report.
    """
    from generator.cli.progress import item_progress_bar, no_item_monitor
    from generator.diagnostics import UsageError
    from plots import medium as media
    from plots.run import plots

    if width is not None and medium is not Medium.PAPER:
        raise UsageError("--width is for --for paper")
    chosen = media.REPORT
    if medium is Medium.PAPER:
        chosen = media.Medium.paper(int((width or Width.PAGE).value))
    return plots(
        names or (),
        output=output,
        gallery=gallery,
        strict=strict,
        jobs=jobs,
        listed=listed,
        springs=springs,
        against=against,
        medium=chosen,
        progress=item_progress_bar if show_progress and not as_json else no_item_monitor,
    )
