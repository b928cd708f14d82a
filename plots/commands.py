"""The commands `mover fit` and `mover plots`.

What a command needs is imported when it runs: matplotlib takes its time.
"""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from generator.cli.answer import CommandResult


class Axis(StrEnum):
    """Which axis of its joint a spring is about."""

    X = "x"
    Y = "y"
    Z = "z"
    JOINT = "joint"


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
        typer.Option("--passive", help="Bind the cubic to restore at both ends of the data."),
    ] = False,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write a .springs.toml file."),
    ] = None,
    joints: Annotated[
        list[str] | None,
        typer.Option("--joint", metavar="NAME", help="A joint that gets the spring; for -o."),
    ] = None,
    axis: Annotated[
        Axis, typer.Option(help="The axis of the joint, where it has several.")
    ] = Axis.JOINT,
    motion: Annotated[
        str, typer.Option(metavar="TEXT", help="What a positive angle is, such as `flexion`.")
    ] = "",
    reference: Annotated[str, typer.Option(metavar="TEXT", help="Where the data are from.")] = "",
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the fit: .svg or .png.")
    ] = None,
) -> "CommandResult":
    """Fit a cubic to measured moments and make it a spring.

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
        typer.Argument(metavar="[NAME]...", help="The plates to make; all of them unless told."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Where the files go."),
    ] = None,
    gallery: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.md", help="Write a page of Markdown, its pictures in the folder FILE."
        ),
    ] = None,
    strict: Annotated[
        bool, typer.Option("--strict", help="Fail when a claim does not hold.")
    ] = False,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Processes at a time; as many as cores unless told.")
    ] = None,
    listed: Annotated[bool, typer.Option("--list", help="Name the plates and make none.")] = False,
    *,
    as_json: bool = False,
    show_progress: bool = False,
) -> "CommandResult":
    """Draw curves and motion, and measure what is claimed of them.

    Each plate becomes a picture (.svg and .png) and its numbers (.csv); report.html shows all.
    """
    from generator.cli.progress import item_progress_bar, no_item_monitor
    from plots.run import plots

    return plots(
        names or (),
        output=output,
        gallery=gallery,
        strict=strict,
        jobs=jobs,
        listed=listed,
        progress=item_progress_bar if show_progress and not as_json else no_item_monitor,
    )
