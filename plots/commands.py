"""The commands `mover fit`, `mover plots` and `mover picture`.

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


class ViewName(StrEnum):
    """Direction from which a figure is seen."""

    FRONT = "front"
    SIDE = "side"
    BACK = "back"
    TOP = "top"
    THREE_QUARTER = "three-quarter"


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
            metavar="[NAME|MOTION|FOLDER]...",
            help="Plates to draw, by their names or the first word of several (person), motions "
            "(.action .npz .mot .sto), or folders of `mover sweep`. [default: all plates]",
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
    figure: Annotated[
        str | None,
        typer.Option(metavar="FIGURE", help="Figure of the motions, if not the one named in them."),
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
        figure=figure,
        medium=chosen,
        progress=item_progress_bar if show_progress and not as_json else no_item_monitor,
    )


def picture(
    source: Annotated[
        str,
        typer.Argument(
            metavar="FIGURE|POSE|MOTION",
            help="A figure as elsewhere, a .pose, or a motion: .action .npz .mot .sto.",
        ),
    ],
    outputs: Annotated[
        list[Path] | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="Picture, .png .svg .pdf, or video of a motion, .mp4 .gif.",
        ),
    ] = None,
    figure: Annotated[
        str | None,
        typer.Option(
            metavar="FIGURE", help="Figure of a pose, or of a motion in place of its own."
        ),
    ] = None,
    pose: Annotated[
        Path | None,
        typer.Option(metavar="FILE.pose", help="Pose file, as written by `mover pose`."),
    ] = None,
    displacements: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="JOINT=a,b,c", help="Displacements [deg or cm]."),
    ] = None,
    at: Annotated[
        str | None,
        typer.Option(metavar="T,...", help="Times of the moments [s]. [default: the first]"),
    ] = None,
    strip: Annotated[
        int | None,
        typer.Option(
            min=2,
            max=60,
            metavar="N",
            help="Number of moments at equal intervals from the first time to the last.",
        ),
    ] = None,
    view: Annotated[
        ViewName, typer.Option(help="Direction of the view of a figure that faces +z.")
    ] = ViewName.THREE_QUARTER,
    turn: Annotated[
        float | None,
        typer.Option(help="Angle of the viewer from +z towards +x, in place of the view's [deg]."),
    ] = None,
    tilt: Annotated[
        float | None,
        typer.Option(
            help="Angle by which the viewer looks down, in place of the view's [deg].",
        ),
    ] = None,
    scene: Annotated[
        str | None,
        typer.Option(metavar="FILE|NAME", help="Scene whose boxes and level floor are drawn."),
    ] = None,
    floor: Annotated[bool, typer.Option("--floor", help="Draw a floor at the height 0.")] = False,
    width: Annotated[
        str | None,
        typer.Option(metavar="640|8cm", help="Width in pixels, cm, mm or in. [default: fits 1600]"),
    ] = None,
    scale: Annotated[
        float | None, typer.Option(help="Scale [pixels/m], in place of a width.")
    ] = None,
    dpi: Annotated[
        float | None,
        typer.Option(help="Resolution [dots/inch]. [default: 300 with a width in cm, else 100]"),
    ] = None,
    transparent: Annotated[
        bool, typer.Option("--transparent", help="Leave out the white background.")
    ] = False,
    no_labels: Annotated[
        bool, typer.Option("--no-labels", help="Leave out the times under several moments.")
    ] = False,
    fps: Annotated[
        float | None,
        typer.Option(min=1.0, max=100.0, help="Frames of a video per second. [default: 30]"),
    ] = None,
    *,
    as_json: bool = False,
    show_progress: bool = False,
) -> "CommandResult":
    """Draw pictures and videos of a figure, a pose or a motion.

    The options -o and --set may be repeated. Each .svg and .pdf holds the body in pixels, the times
    as outlines. A video shows a motion from its first time to its last.
    """
    from generator.cli.progress import item_progress_bar, no_item_monitor
    from plots.framing import size_from_options, view_from_options
    from plots.picture import picture

    return picture(
        source,
        outputs or (),
        figure=figure,
        pose=pose,
        sets=displacements or (),
        at=at,
        strip=strip,
        view=view_from_options(view.value, turn, tilt),
        scene=scene,
        floor=floor,
        size=size_from_options(width, scale, dpi),
        transparent=transparent,
        labels=not no_labels,
        fps=fps,
        progress=item_progress_bar if show_progress and not as_json else no_item_monitor,
    )
