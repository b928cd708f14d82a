"""The command `mover`: the only module that prints and the only one that exits.

What each command takes stands in `generator.command_line`, what it does in `generator.cli`.
What a command needs is imported when it runs: the help must not wait for numpy, scipy and Exudyn.
"""

import sys

from generator.cli.interruption import SAID, leave_interrupted

try:  # these take some tenths of a second, in which Ctrl-C may come
    import os
    from collections.abc import Callable, Generator
    from contextlib import contextmanager, suppress
    from importlib.metadata import version
    from pathlib import Path
    from typing import TYPE_CHECKING, Annotated, Any, cast

    import typer

    from generator.cli.joined import joining
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
except KeyboardInterrupt:
    leave_interrupted(as_json="--json" in sys.argv)

if TYPE_CHECKING:
    from io import TextIOWrapper

    from generator.cli.answer import CommandResult
    from generator.cli.progress import ItemMonitor

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


def _give_made(
    make: "Callable[[ItemMonitor], CommandResult]", *, as_json: bool, quiet: bool
) -> None:
    def answer() -> "CommandResult":
        if as_json or quiet or not _on_terminal():
            from generator.cli.progress import no_item_monitor

            return make(no_item_monitor)
        from generator.cli.progress import item_progress_bar

        return make(item_progress_bar)

    _give(answer, as_json=as_json, quiet=quiet)


_Joining = joining(_give_made, {function.__name__: function for function in OWN})

# Of the parser's errors typer names some only; this is the one that all of them are.
_ParserError = cast("type[typer.BadParameter]", typer.BadParameter.__base__)


class _Commands(_Joining):
    """All commands; what goes wrong before one of them begins is told as what goes wrong in it."""

    def make_context(self, info_name: Any, args: list[str], *others: Any, **extra: Any) -> Any:
        with _told_at_the_door(as_json="--json" in args):
            return super().make_context(info_name, args, *others, **extra)

    def invoke(self, ctx: Any) -> Any:
        with _told_at_the_door(as_json="--json" in ctx.args):
            return super().invoke(ctx)


app = typer.Typer(
    cls=_Commands,
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

    def answer() -> "CommandResult":
        from generator.cli import simulate as command

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
        from generator.cli.progress import progress_bar

        return command.simulate(request, progress_bar)

    _give(answer, as_json=as_json, quiet=quiet)


def _on_terminal() -> bool:
    """Whether the standard error stream is a terminal; there may be no such stream."""
    return getattr(sys.stderr, "isatty", bool)()


def _give(make: "Callable[[], CommandResult]", *, as_json: bool, quiet: bool = False) -> None:
    """Print an answer, or what kept it from being made, and exit with its code."""
    from generator.cli.answer import ExitCode, UsageError, json_text
    from generator.diagnostics import InputError, MoverError, select_errors

    try:
        answer = make()
    except UsageError as failure:
        _fail(ExitCode.USAGE, f"error: {failure}", {"error": str(failure)}, as_json)
    except InputError as failure:
        told = select_errors(failure.diagnostics) if quiet else failure.diagnostics
        data = {"error": "the input is wrong", "faults": [f.as_dict() for f in failure.diagnostics]}
        _fail(ExitCode.WRONG_INPUT, "\n\n".join(map(str, told)), data, as_json)
    except MoverError as failure:
        _fail(ExitCode.WRONG_INPUT, f"error: {failure}", {"error": str(failure)}, as_json)
    except KeyboardInterrupt:
        _fail(ExitCode.RUN_FAILED, f"error: {SAID}", {"error": SAID}, as_json)
    else:
        with _error_stream():
            if not quiet:
                for fault in answer.diagnostics:
                    typer.echo(f"{fault}\n", err=True)
            if answer.failure is not None:
                typer.echo(f"error: {answer.failure}", err=True)
        if as_json:
            typer.echo(json_text(answer.data))
        elif not quiet:
            typer.echo(answer.text)
        raise typer.Exit(answer.code)


def _fail(code: int, text: str, data: object, as_json: bool) -> None:
    """Tell people what is wrong, and programs as well, and exit."""
    from generator.cli.answer import json_text

    with _error_stream():
        typer.echo(text, err=True)
    if as_json:
        typer.echo(json_text(data))
    raise typer.Exit(code)


@contextmanager
def _told_at_the_door(*, as_json: bool) -> Generator[None]:
    """Tell that the parser refuses the command line, or that Ctrl-C came while it was read."""
    try:
        yield
    except KeyboardInterrupt:
        leave_interrupted(as_json=as_json)
    except _ParserError as failure:
        with _error_stream():
            failure.show()
        if as_json:
            from generator.cli.answer import json_text

            typer.echo(json_text({"error": failure.format_message()}))
        raise typer.Exit(failure.exit_code) from None


@contextmanager
def _error_stream() -> Generator[None]:
    """For what goes to the error stream, which may be full: that changes no answer and no code."""
    try:
        yield
    except OSError:
        _silence(2)


def _silence(descriptor: int) -> None:
    """Send a stream nowhere: what is left in its buffer must not fail once more at the exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), descriptor)


def main() -> None:
    """The entry point of the command."""
    # A file's name may hold what the terminal's encoding does not. There may be no output at all.
    with suppress(AttributeError):
        cast("TextIOWrapper", sys.stdout).reconfigure(errors="backslashreplace")
    try:
        app()
    except OSError as failure:
        _silence(1)
        with _error_stream():
            typer.echo(f"error: the answer could not be written: {failure.strerror}", err=True)
        sys.exit(1)
    except KeyboardInterrupt:
        leave_interrupted(as_json="--json" in sys.argv)


if __name__ == "__main__":
    main()
