"""`mover view`: a page in the browser to pose a figure, play a motion and let it fall."""

import signal
import time
import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from generator.cli.answer import CommandResult
from generator.cli.inputs import load_figure, placement_from_options, springs_from_option
from generator.cli.options import JoiningLaw, SpringsChoice
from generator.diagnostics import UsageError


def view(
    name: Annotated[
        str,
        typer.Argument(
            metavar="FIGURE|POSE|MOTION|SPRINGS",
            help="A figure as elsewhere, a .pose, a motion (.action or .npz) or a .springs.toml.",
        ),
    ],
    springs: SpringsChoice = None,
    law: JoiningLaw = None,
    port: Annotated[
        int | None, typer.Option(help="Port of the page. [default: the first free one from 8080]")
    ] = None,
    host: Annotated[
        str, typer.Option(help="Address to listen at; others than this machine may reach it.")
    ] = "127.0.0.1",
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Print the address only.")
    ] = False,
) -> CommandResult:
    """Show a figure, a pose or a motion in the browser, and change it there."""
    try:
        from generator.viewer import server as page_server
    except ModuleNotFoundError as failure:
        if failure.name != "viser":
            raise
        message = "the page needs viser: pip install 'exudyn-mover[viewer]'"
        raise UsageError(message) from None
    from generator.viewer.panels import PANELS
    from generator.viewer.viewer import Content, Viewer

    figure, warnings = load_figure(name)
    spring_set, more = springs_from_option(figure, springs, law)
    placement, others = placement_from_options(figure, None, ())
    title = figure.name or name
    content = Content(
        figure, spring_set, placement, Path.cwd(), title=title, springs_choice=springs
    )
    server = page_server.open_server(host, page_server.find_port(host, port), content.title)
    where = page_server.address(server, host)
    viewer = Viewer(server, content, PANELS)
    typer.echo(f"{where}\nCtrl-C ends the page.", err=True)
    if not page_server.is_loopback(host):
        typer.echo(f"The page is open to every machine that reaches {host}.", err=True)
    if not no_browser:
        webbrowser.open(where)
    began = time.monotonic()

    def end(_number: int, _frame: object) -> None:
        viewer.stop()

    signal.signal(signal.SIGTERM, end)
    try:
        viewer.run()
    except KeyboardInterrupt:
        pass
    finally:
        viewer.close()
        page_server.close_server(server)
    seconds = time.monotonic() - began
    return CommandResult(
        text=f"The page was open for {seconds:.0f} s.",
        data={"address": where, "open_s": seconds},
        diagnostics=(*warnings, *more, *others),
    )
