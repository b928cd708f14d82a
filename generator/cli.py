"""The command `mover`: the only module that prints and the only one that exits.

What each command takes stands in `generator.command_line`, what it does in `generator.commands`.
What a command needs is imported when it runs: the help must not wait for numpy, scipy and Exudyn.
"""

import json
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from generator.command_line import conversion, figures, geometry, postures
from generator.command_line.options import (
    Joins,
    Json,
    LinksFile,
    Lock,
    Name,
    PoseFile,
    Set,
    Springs,
)
from generator.joined import joining

if TYPE_CHECKING:
    from io import TextIOWrapper

    from generator.commands.answer import Answer
    from generator.commands.progress import Progress

OWN = (
    conversion.convert,
    figures.check,
    figures.describe,
    figures.cite,
    postures.pose,
    postures.com,
    postures.stability,
    postures.shoulder,
    postures.link,
    postures.settle,
    geometry.mass,
    geometry.complete,
)
"""The commands beside `simulate`, in the order of the help."""


def _give_made(make: "Callable[[Progress], Answer]", *, as_json: bool, quiet: bool) -> None:
    def answer() -> "Answer":
        if as_json or quiet or not _on_terminal():
            from generator.commands.progress import unshown

            return make(unshown)
        from generator.console import counting_bar

        return make(counting_bar)

    _give(answer, as_json=as_json, quiet=quiet)


app = typer.Typer(
    cls=joining(_give_made, {function.__name__: function for function in OWN}),
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Human figures and how they move: figure files in, motion out.",
    epilog="Exit codes: 0 good, 1 the input is wrong, 2 usage, 3 the run failed.",
)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"mover {version('exudyn-mover')}")
        raise typer.Exit


@app.callback()
def mover(
    show_version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Version.")
    ] = False,
) -> None:
    """Human figures and how they move: figure files in, motion out."""


@app.command()
def simulate(
    figure: Name,
    stop: Annotated[float | None, typer.Option(help="Time at which the run ends [s]; 1.")] = None,
    start: Annotated[float | None, typer.Option(help="Time at which it begins [s]; 0.")] = None,
    frame: Annotated[float | None, typer.Option(help="Interval of frames [s]; 0.02.")] = None,
    tolerance: Annotated[
        float | None, typer.Option(help="Largest joint-angle error asked for [rad]; 1e-3.")
    ] = None,
    step: Annotated[
        float | None, typer.Option(help="A fixed step [s], without an error estimate.")
    ] = None,
    springs: Springs = None,
    law: Joins = None,
    gravity: Annotated[
        str | None, typer.Option(metavar="X,Y,Z", help="[m/s^2], world axes; 0,-9.81,0.")
    ] = None,
    free_root: Annotated[
        bool, typer.Option("--free-root", help="Let the figure fly: no joints to the ground.")
    ] = False,
    pose: PoseFile = None,
    displacements: Set = None,
    velocities: Annotated[
        list[str] | None,
        typer.Option("--velocity", metavar="JOINT=a,b,c", help="Initial rates [deg/s or cm/s]."),
    ] = None,
    loads: Annotated[
        Path | None, typer.Option(metavar="FILE.csv", help="Forces and moments that vary in time.")
    ] = None,
    links: LinksFile = None,
    locks: Lock = None,
    drive: Annotated[
        Path | None,
        typer.Option(metavar="MOTION.action|.csv", help="A motion that joints follow."),
    ] = None,
    driven: Annotated[
        list[str] | None,
        typer.Option(metavar="JOINT", help="Only these joints of the --drive file; all."),
    ] = None,
    python_torques: Annotated[
        bool, typer.Option("--python-torques", help="Torques as Python functions: slower, equal.")
    ] = False,
    wall_limit: Annotated[
        float | None, typer.Option(help="Longest time that the run may take [s]; 600.")
    ] = None,
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="Where the motion goes: .action .csv .npz .glb .bvh .mot .sto .x3d.",
        ),
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="Say only what went wrong.")] = False,
    as_json: Json = False,
) -> None:
    """Let a figure move under gravity, loads and its passive joints.

    The options --set, --velocity, --lock, --driven and -o may be repeated.
    """

    def answer() -> "Answer":
        from generator.commands import simulate as command

        request = command.Request(
            figure=figure,
            stop=stop,
            start=start,
            frame=frame,
            tolerance=tolerance,
            step=step,
            springs=springs,
            law=None if law is None else law.value,
            gravity=gravity,
            free_root=free_root,
            pose=pose,
            displacements=displacements or (),
            velocities=velocities or (),
            loads=loads,
            links=links,
            locks=locks or (),
            drive=drive,
            driven=driven or (),
            python_torques=python_torques,
            wall_limit=wall_limit,
            outputs=output or (),
        )
        if quiet or not _on_terminal():
            return command.simulate(request)
        from generator.console import progress_bar

        return command.simulate(request, progress_bar)

    _give(answer, as_json=as_json, quiet=quiet)


def _on_terminal() -> bool:
    """Whether the standard error stream is a terminal; there may be no such stream."""
    return getattr(sys.stderr, "isatty", bool)()


def _give(make: "Callable[[], Answer]", *, as_json: bool, quiet: bool = False) -> None:
    """Print an answer, or what kept it from being made, and exit with its code."""
    from generator.commands.answer import ExitCode, UsageError
    from generator.errors import InputError, MoverError, errors_among

    try:
        answer = make()
    except UsageError as failure:
        _fail(ExitCode.USAGE, f"error: {failure}", {"error": str(failure)}, as_json)
    except InputError as failure:
        told = errors_among(failure.faults) if quiet else failure.faults
        data = {"error": "the input is wrong", "faults": [f.as_dict() for f in failure.faults]}
        _fail(ExitCode.WRONG_INPUT, "\n\n".join(map(str, told)), data, as_json)
    except MoverError as failure:
        _fail(ExitCode.WRONG_INPUT, f"error: {failure}", {"error": str(failure)}, as_json)
    except KeyboardInterrupt:
        said = "interrupted before there was anything to write"
        _fail(ExitCode.RUN_FAILED, f"error: {said}", {"error": said}, as_json)
    else:
        if not quiet:
            for fault in answer.faults:
                typer.echo(f"{fault}\n", err=True)
        if answer.failure is not None:
            typer.echo(f"error: {answer.failure}", err=True)
        if as_json:
            typer.echo(json.dumps(answer.data, indent=2, allow_nan=False))
        elif not quiet:
            typer.echo(answer.text)
        raise typer.Exit(answer.code)


def _fail(code: int, text: str, data: object, as_json: bool) -> None:
    """Tell people what is wrong, and programs as well, and exit."""
    typer.echo(text, err=True)
    if as_json:
        typer.echo(json.dumps(data, indent=2))
    raise typer.Exit(code)


def main() -> None:
    """The entry point of the command."""
    # A file's name may hold what the terminal's encoding does not. There may be no output at all.
    with suppress(AttributeError):
        cast("TextIOWrapper", sys.stdout).reconfigure(errors="backslashreplace")
    try:
        app()
    except OSError as failure:
        # What is left in the buffer must not fail once more at the exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        typer.echo(f"error: the answer could not be written: {failure.strerror}", err=True)
        sys.exit(1)


if __name__ == "__main__":
    main()
