"""The command `mover`: the table of its commands, and the only module that prints and exits.

A command is a function with the parameters of a typer command that returns a `CommandResult`. Its
module is imported when it runs, so that `mover --help` does not wait for numpy, scipy and Exudyn.
"""

import sys
from typing import NoReturn

from generator.cli.interrupts import forget_written_files, interruption_message


def leave_interrupted(*, as_json: bool) -> NoReturn:
    """Report an interruption and exit with the code of a failed run.

    No slow import is needed: Ctrl-C may come while this module is imported.
    """
    message = interruption_message()
    try:
        sys.stderr.write(f"error: {message}\n")
        if as_json:
            sys.stdout.write(f'{{\n  "error": "{message}"\n}}\n')
    except (OSError, AttributeError):  # there may be no such streams, or full ones
        pass
    sys.exit(3)


try:  # these take some tenths of a second, in which Ctrl-C may come
    import atexit
    import gc
    import os
    import re
    import warnings
    from collections.abc import Callable, Generator, Iterator
    from contextlib import contextmanager, suppress
    from dataclasses import replace
    from importlib import import_module
    from inspect import Parameter, signature
    from typing import TYPE_CHECKING, Annotated, Any, cast

    import typer
    from typer.core import TyperCommand, TyperGroup
    from typer.main import get_command
except KeyboardInterrupt:
    leave_interrupted(as_json="--json" in sys.argv)

if TYPE_CHECKING:
    from io import TextIOWrapper

    from generator.cli.answer import CommandResult
    from generator.diagnostics import Diagnostic

COMMANDS = {
    "simulate": "Simulate a figure under gravity, loads, springs and contact.",
    "compare": "Compare motions: bodies, curves, and what differs most.",
    "sweep": "Simulate a figure many times, each with other parameters.",
    "person": "Make the figure of a person of a sex, stature and mass.",
    "convert": "Convert a motion, a figure or a model, and list the losses.",
    "check": "Check a figure, a scene, a study, a motion or a model.",
    "describe": "List the segments, masses, joints and springs of a figure.",
    "cite": "Cite the sources of the numbers in a figure or a table.",
    "pose": "Show or save a pose: displacements of joints, positions.",
    "com": "Find the centre of mass, in a pose or along a motion.",
    "stability": "Test whether the centre of mass is over the support.",
    "hold": "Judge whether a person can hold a posture with loads.",
    "shoulder": "Pose an arm by the direction of its elbow.",
    "link": "Set joints and move the joints that are linked to them.",
    "track": "Find the motion of a figure from measured markers.",
    "inverse": "Find joint moments of a measured motion, and the passive share.",
    "settle": "Find the equilibrium of a figure under gravity and springs.",
    "mass": "Compute the mass properties of a closed surface.",
    "complete": "Estimate missing masses and inertias of a figure from psurfs.",
    "view": "Show a figure, a pose or a motion in the browser.",
    "warm-up": "Compile the integrator ahead of the first simulation.",
    "fit": "Fit a curve to measured moments and write it as a spring.",
    "identify": "Fit springs to measured joint angles over time.",
    "plots": "Draw curves and motions, and check the claims about them.",
    "picture": "Draw pictures and videos of a figure, a pose or a motion.",
}
"""The first line of the help of each command, in the order of the help.

The function of a command has its name, in a module of its name here, unless `MODULES` has another.
"""

MODULES = {
    "fit": "plots.fit",
    "identify": "plots.identification",
    "plots": "plots.run",
    "picture": "plots.picture",
}
"""Modules of the commands of other packages."""

_HELP_OPTIONS = {"help_option_names": ["-h", "--help"]}

_JSON = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
_QUIET = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")]
_VERBOSE = Annotated[bool, typer.Option("--verbose", "-v", help="Print all details and warnings.")]

MAX_BRIEF_WARNINGS = 3
"""Warnings that are printed without `--verbose`, a line each."""

# The base class of all errors of the parser; typer does not export it.
_ParserError = cast("type[typer.BadParameter]", typer.BadParameter.__base__)


class _Command(TyperCommand):
    """A command whose help has a section for each panel of options."""

    def format_options(self, ctx: Any, formatter: Any) -> None:
        sections: dict[str, list[tuple[str, str]]] = {}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            title = "Arguments" if parameter.param_type_name == "argument" else "Options"
            if record is not None:
                title = getattr(parameter, "rich_help_panel", None) or title
                sections.setdefault(title, []).append(record)
        for title, records in sections.items():
            with formatter.section(title):
                formatter.write_dl(records)


class _Commands(TyperGroup):
    """All commands. Errors of the parser are printed like those of a command, also as JSON."""

    _lists_names = False

    def shell_complete(self, ctx: Any, incomplete: str) -> Any:
        """Return completions of a command's name, without importing the commands."""
        self._lists_names = True
        try:
            return super().shell_complete(ctx, incomplete)
        finally:
            self._lists_names = False

    def list_commands(self, ctx: Any) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        if cmd_name in COMMANDS and self._lists_names:
            return TyperCommand(cmd_name, help=COMMANDS[cmd_name])
        return _load_command(cmd_name) if cmd_name in COMMANDS else None

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        width = formatter.width - 6 - max(map(len, COMMANDS))
        with formatter.section("Commands"):
            formatter.write_dl(
                [
                    (name, TyperCommand(name, help=summary).get_short_help_str(width))
                    for name, summary in COMMANDS.items()
                ]
            )

    def make_context(self, info_name: Any, args: list[str], *others: Any, **extra: Any) -> Any:
        with _report_parser_errors(as_json="--json" in args):
            return super().make_context(info_name, args, *others, **extra)

    def invoke(self, ctx: Any) -> Any:
        with _report_parser_errors(as_json="--json" in ctx.args):
            return super().invoke(ctx)


def command_function(name: str) -> "Callable[..., CommandResult]":
    """Import the function of a command."""
    attribute = name.replace("-", "_")
    return getattr(import_module(MODULES.get(name, f"generator.cli.{attribute}")), attribute)


def _load_command(name: str) -> Any:
    """Import the function of a command and make it a command that prints its result.

    Every command gets the options `--json`, `--quiet` and `--verbose`. A function with a keyword
    `show_progress`, `as_json` or `verbose` gets its value.
    """
    function = command_function(name)
    accepted = signature(function).parameters

    def run(*, as_json: bool, quiet: bool, verbose: bool, **options: Any) -> None:
        settings = {
            "as_json": as_json,
            "verbose": verbose,
            "show_progress": _has_terminal() and not quiet,
        }
        options |= {key: value for key, value in settings.items() if key in accepted}
        _print_result(lambda: function(**options), as_json, quiet, verbose)

    shared = {"quiet": _QUIET, "verbose": _VERBOSE, "as_json": _JSON}
    parameters = [one for one in accepted.values() if one.kind is not Parameter.KEYWORD_ONLY]
    parameters += [
        Parameter(key, Parameter.POSITIONAL_OR_KEYWORD, default=False, annotation=annotation)
        for key, annotation in shared.items()
    ]
    run.__doc__ = function.__doc__
    run.__annotations__ = {one.name: one.annotation for one in parameters}
    vars(run)["__signature__"] = signature(function).replace(
        parameters=parameters, return_annotation=None
    )
    single = typer.Typer(
        add_completion=False, rich_markup_mode=None, context_settings=_HELP_OPTIONS
    )
    single.command(name, cls=_Command)(run)
    return get_command(single)


app = typer.Typer(
    cls=_Commands,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings=_HELP_OPTIONS,
    help="Simulate human figures with passive joints: figure files in, motion out.",
    epilog="Exit codes: 0 success, 1 invalid input, 2 usage error, 3 failed run.",
)


def _show_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"mover {version('exudyn-mover')}")
        raise typer.Exit


@app.callback()
def mover(
    show_version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Version.")
    ] = False,
) -> None:
    """Simulate human figures with passive joints: figure files in, motion out."""


def _has_terminal() -> bool:
    """Return whether the standard error stream is a terminal; there may be no such stream."""
    return getattr(sys.stderr, "isatty", bool)()


def _print_result(
    make: "Callable[[], CommandResult]", as_json: bool, quiet: bool, verbose: bool
) -> None:
    """Print the result of a command, or why there is none, and exit with its code."""
    from generator.cli.answer import ExitCode, format_paragraphs, json_text
    from generator.diagnostics import (
        InputError,
        MoverError,
        Severity,
        UsageError,
        WallLimitError,
        select_errors,
    )
    from generator.text_io import os_error_reason

    forget_written_files()
    try:
        with warnings.catch_warnings():
            # Numbers beyond the largest float are reported in a sentence, where they matter.
            warnings.simplefilter("ignore", RuntimeWarning)
            result = make()
    except InputError as failure:
        diagnostics = [d for d in failure.diagnostics if d.severity is not Severity.NOTE]
        shown = select_errors(diagnostics) if quiet else diagnostics
        data = {"error": "the input is wrong", "faults": diagnostics}
        _fail(ExitCode.WRONG_INPUT, "\n\n".join(map(str, shown)), data, as_json)
    except (MoverError, OSError, KeyboardInterrupt) as failure:
        code, message = ExitCode.WRONG_INPUT, str(failure)
        if isinstance(failure, UsageError):
            code = ExitCode.USAGE
        elif isinstance(failure, WallLimitError):
            code = ExitCode.RUN_FAILED
        elif isinstance(failure, KeyboardInterrupt):
            code, message = ExitCode.RUN_FAILED, interruption_message()
        elif isinstance(failure, OSError):
            # Outputs have errors of their own, so this is of a file that the command reads.
            subject = "an input file" if failure.filename is None else f"`{failure.filename}`"
            message = f"{subject} cannot be read: {os_error_reason(failure)}"
        _fail(code, f"error: {message}", {"error": message}, as_json)
    if not quiet:
        result = replace(result, diagnostics=(*result.diagnostics, *_cache_warnings()))
    with _error_stream():
        if not quiet:
            for text in _warning_texts(result, in_full=verbose):
                _echo(text, err=True)
        if result.failure is not None:
            _echo(f"error: {result.failure}", err=True)
    if as_json:
        typer.echo(json_text(result))
    elif not quiet:
        _echo(format_paragraphs([*result.paragraphs(), *(result.details() if verbose else ())]))
    raise typer.Exit(result.code)


_SEVERITY = re.compile(r"^((?:\S.*?:[0-9]+:[0-9]+: )?)(error|warning|note):", re.MULTILINE)
_MARK = re.compile(r"^( *\| *)(\^+)$", re.MULTILINE)
_SEVERITY_COLOURS = {"error": "red", "warning": "yellow", "note": "cyan"}


def _echo(text: str, *, err: bool = False) -> None:
    """Print a text, with colours on a terminal."""
    typer.echo(paint(text), err=err)  # which drops the colours where it is not a terminal


def paint(text: str) -> str:
    """Return a text with colours for severities and marks, unless the variable NO_COLOR is set."""
    if os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb":
        return text

    def severity(found: "re.Match[str]") -> str:
        return found[1] + typer.style(f"{found[2]}:", fg=_SEVERITY_COLOURS[found[2]], bold=True)

    text = _SEVERITY.sub(severity, text)
    return _MARK.sub(lambda mark: mark[1] + typer.style(mark[2], bold=True), text)


def _cache_warnings() -> "Iterator[Diagnostic]":
    """Yield a warning if the command did not use the folder of compiled code."""
    if "generator.simulation.compiled_run" not in sys.modules:
        return  # nothing was compiled
    from generator.diagnostics import warning
    from generator.simulation.compiled.code_cache import cache_warning

    text = cache_warning()
    if text is not None:
        yield warning(text)


def _warning_texts(result: "CommandResult", *, in_full: bool) -> Iterator[str]:
    """Yield all diagnostics in full, or the first warnings, a line each."""
    from generator.diagnostics import Severity

    if in_full:
        yield from (f"{diagnostic}\n" for diagnostic in result.diagnostics)
        return
    lines = list(
        dict.fromkeys(
            one.first_line for one in result.diagnostics if one.severity is not Severity.NOTE
        )
    )
    yield from lines[:MAX_BRIEF_WARNINGS]
    if len(lines) > MAX_BRIEF_WARNINGS:
        yield f"{len(lines) - MAX_BRIEF_WARNINGS} more: see them with --verbose"


def _fail(code: int, text: str, data: object, as_json: bool) -> NoReturn:
    """Print an error, also as JSON if requested, and exit."""
    from generator.cli.answer import json_text

    with _error_stream():
        _echo(text, err=True)
    if as_json:
        typer.echo(json_text(data))
    raise typer.Exit(code)


@contextmanager
def _report_parser_errors(*, as_json: bool) -> Generator[None]:
    """Report errors of the parser, and Ctrl-C while it runs."""
    try:
        yield
    except KeyboardInterrupt:
        leave_interrupted(as_json=as_json)
    except _ParserError as failure:
        parameter = getattr(failure, "param", None)
        failure.message = _plain_message(failure.message, getattr(parameter, "help", None) or "")
        with _error_stream():
            failure.show()
        if as_json:
            from generator.cli.answer import json_text

            typer.echo(json_text({"error": failure.format_message()}))
        raise typer.Exit(failure.exit_code) from None


_VALIDATOR_SENTENCES = (
    (r"Input should be a valid number, .*", "give a number{unit}, without a unit"),
    (r"Input should be a valid integer, .*", "give a whole number"),
    (r"Input should be (?:a|an) (?:valid )?", "give a "),
    (r"Input should be (?=less|greater)", "the number should be "),
    (r"Value error, ", ""),
)
"""Beginnings of sentences of the library that validates options, and plain ones for them."""

_UNIT_EXAMPLES = {
    "m": " of metres, such as 0.5",
    "s": " of seconds, such as 0.5",
    "deg": " of degrees, such as 20",
    "rad": " of radians, such as 0.001",
}
"""Continuations of "give a number" by the unit in the help of an option."""


def _plain_message(message: str, about: str) -> str:
    """Return the message of the parser about an option, without the terms of a validator."""
    unit = re.search(r"\[(\w+)\]", about)
    number = _UNIT_EXAMPLES.get(unit[1], "") if unit else ""
    for pattern, plain in _VALIDATOR_SENTENCES:
        message = re.sub(pattern, plain.format(unit=number), message)
    return message


@contextmanager
def _error_stream() -> Generator[None]:
    """Ignore a full error stream: it changes neither result nor exit code."""
    try:
        yield
    except OSError:
        _silence(2)


def _silence(descriptor: int) -> None:
    """Redirect a stream to the null device, so that flushing it at exit does not fail again."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), descriptor)


def _collect_garbage_rarely() -> None:
    """Save the time in which Python searches the objects of imported modules for garbage.

    They stay until the process ends, when freezing them saves a last search.
    """
    gc.set_threshold(100_000, 20, 20)
    atexit.register(gc.freeze)


def main() -> None:
    """Run the command: the entry point of the program."""
    _collect_garbage_rarely()
    # File names may not be encodable in the terminal's encoding; stdout may be closed (None).
    with suppress(AttributeError):
        cast("TextIOWrapper", sys.stdout).reconfigure(errors="backslashreplace")
    try:
        app()
    except OSError as failure:
        _silence(1)
        with _error_stream():
            _echo(f"error: the output could not be written: {failure.strerror}", err=True)
        sys.exit(1)
    except KeyboardInterrupt:
        leave_interrupted(as_json="--json" in sys.argv)


if __name__ == "__main__":
    main()
