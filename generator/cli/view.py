"""`mover view`: a page in the browser to pose a figure, play a motion and let it fall."""

import os
import sys
import time
import webbrowser
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Thread
from typing import Annotated

import typer

from generator.cli.answer import CommandResult, Paragraphs
from generator.cli.compare import compare
from generator.cli.convert import Conversion
from generator.cli.inputs import (
    check_segment_distances,
    load_figure,
    load_motion,
    placement_from_options,
    refuse_model,
    springs_from_option,
)
from generator.cli.interrupts import call_on_signals
from generator.cli.options import (
    LawChoice,
    SpringsChoice,
    complete_figure_name,
    format_frames,
    option,
)
from generator.cli.outputs import (
    check_motion_formats,
    check_writable,
    suffix_fault,
    write_motion,
)
from generator.conversion import READABLE_SUFFIXES, check_readable
from generator.diagnostics import Diagnostic, UsageError, warning
from generator.figure import Figure
from generator.input_files.pose import POSE_FILE
from generator.kinematics.placement import Placement, batched_placements
from generator.motion_files import MOTION_FORMATS, FigureMotion
from generator.motion_files.page import springs_choices
from generator.springs_file.parse import SPRINGS_FILE
from generator.springs_file.read import load_springs_file
from springs import SphericalLaw, SpringSet

PAGE_SUFFIX = ".html"

_OTHER_SUFFIXES = (".toml", ".optional")
"""Suffixes of files that are inputs of other commands."""

_Warnings = tuple[Diagnostic, ...]


@dataclass(frozen=True)
class ViewInputs:
    """Contents of the files that a command line names."""

    figure: Figure
    springs: SpringSet
    springs_choice: str | None
    placement: Placement
    motion: FigureMotion | None
    second: FigureMotion | None
    warnings: _Warnings


def view(
    name: Annotated[
        str,
        typer.Argument(
            metavar="FIGURE|POSE|MOTION|SPRINGS",
            help="A figure as elsewhere, a .pose, a motion (.action .npz .mot .sto) or a "
            ".springs.toml.",
            autocompletion=complete_figure_name,
        ),
    ],
    figure: Annotated[
        str | None,
        option("FIGURE", "Figure of a pose; of motions or springs, if not the one named."),
    ] = None,
    second: Annotated[
        Path | None, option("MOTION", "Second motion, shown translucent.", "--with")
    ] = None,
    springs: SpringsChoice = None,
    law: LawChoice = None,
    export: Annotated[
        Path | None,
        option(
            "PAGE.html", "Write the motion, or both compared, as a page without a server, and end."
        ),
    ] = None,
    port: Annotated[
        int | None, typer.Option(help="Port of the page. [default: the first free one from 8080]")
    ] = None,
    host: Annotated[
        str,
        typer.Option(help="Address to listen on; with another one, other machines reach the page."),
    ] = "127.0.0.1",
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Print the address only.")
    ] = False,
) -> CommandResult:
    """Show a figure, a pose or a motion in the browser."""
    if not name.strip():
        raise UsageError("the name of what to show is empty: name a figure, a pose or a motion")
    path = Path(name)
    _check_kind(path, figure, second, export)
    if export is not None and second is not None:
        if springs is not None or law is not None:
            raise UsageError("--export with --with compares motions: leave out --springs and --law")
        return compare([path, second], [export], figure)
    if export is not None:
        return _export(path, figure, springs, law, export)
    inputs = load_inputs(path, figure, second, springs, law)
    return _serve(inputs, name, host, port, open_browser=not no_browser)


def is_motion(path: Path) -> bool:
    """Return whether a path is a motion that can be read, by its suffix."""
    return path.suffix.lower() in READABLE_SUFFIXES


def _is_springs_file(path: Path) -> bool:
    return path.name.endswith(SPRINGS_FILE.suffix)


def _check_kind(path: Path, figure: str | None, second: Path | None, export: Path | None) -> None:
    """Raise UsageError for a file that cannot be shown, or options that do not fit it."""
    for file in (path, *([] if second is None else [second])):
        if file.suffix.lower() in MOTION_FORMATS:
            check_readable(file)
        if file.is_dir():
            raise UsageError(f"{file} is a directory: the page shows files, such as `figure.fig`")
    refuse_model(path)
    if path.suffix.lower() in _OTHER_SUFFIXES and not _is_springs_file(path):
        raise UsageError(
            f"{path} cannot be shown: the page shows figures, poses, motions and "
            f"{SPRINGS_FILE.suffix} files"
        )
    if not is_motion(path):
        for option, value in (("--with", second), ("--export", export)):
            if value is not None:
                raise UsageError(f"{option} is for motions, and {path} is not a motion")
        if path.suffix.lower() == POSE_FILE.suffix:
            if figure is None:
                raise UsageError(f"{path}: a pose does not name its figure; add --figure FIGURE")
        elif figure is not None and not _is_springs_file(path):
            raise UsageError(f"{path} is a figure; --figure is for poses, motions and springs")
        return
    if second is not None and not is_motion(second):
        raise UsageError(f"--with {second}: {suffix_fault(second)}; motions are read from "
                         f"{', '.join(READABLE_SUFFIXES)}")  # fmt: skip
    if export is None:
        return
    if export.suffix.lower() != PAGE_SUFFIX:
        raise UsageError(f"--export {export}: {suffix_fault(export)}; a page ends in {PAGE_SUFFIX}")


def load_inputs(
    path: Path,
    figure_name: str | None,
    second: Path | None,
    springs_choice: str | None,
    law: SphericalLaw | None,
) -> ViewInputs:
    """Read the files that a command line names.

    Raises:
        UsageError: an option does not fit them.
        InputError: a file cannot be read or is wrong.
        MoverError: a motion is of another figure, or a loop cannot be closed.
    """
    motion, ghost, pose, warnings = None, None, None, ()
    if is_motion(path):
        motion, warnings = _load_drawable_motion(path, figure_name)
        figure = motion.figure
        if second is not None:
            ghost, more = _load_drawable_motion(second, figure_name)
            warnings += more
    elif _is_springs_file(path):
        if springs_choice is not None:
            raise UsageError(f"{path} is a springs file; leave out --springs")
        figure, warnings = _springs_owner(path, figure_name)
        springs_choice = str(path)
    else:
        figure, warnings = load_figure(figure_name or str(path))
        pose = path if path.suffix.lower() == POSE_FILE.suffix else None
    if motion is not None and springs_choice is None and law is None:
        springs, springs_choice, of_springs = _springs_of_motion(motion)
    else:
        springs, of_springs = springs_from_option(figure, springs_choice, law)
    placement, of_pose = placement_from_options(figure, pose, ())
    every = dict.fromkeys((*warnings, *of_springs, *of_pose))
    return ViewInputs(figure, springs, springs_choice, placement, motion, ghost, tuple(every))


def _load_drawable_motion(path: Path, figure_name: str | None) -> tuple[FigureMotion, _Warnings]:
    """Read a motion as `load_motion` does; raise MoverError if a segment is too far to be drawn."""
    motion, warnings = load_motion(path, figure_name)
    if motion.recording is None:
        for placement in batched_placements(motion.tree, motion.displacements):
            check_segment_distances(placement)
    else:
        check_segment_distances(Placement(motion.tree, motion.displacements, motion.poses))
    return motion, warnings


def _springs_of_motion(motion: FigureMotion) -> tuple[SpringSet, str | None, _Warnings]:
    """Return the springs that a motion names and their choice, else those of its figure.

    In the second case a warning says so. Spherical joints have the law of the motion.
    """
    law = motion.header.law
    law = SphericalLaw(law) if law in [each.value for each in SphericalLaw] else None
    for choice in springs_choices(motion.header, motion.figure):
        springs, warnings = springs_from_option(motion.figure, choice, law)
        return springs, choice, warnings
    springs, warnings = springs_from_option(motion.figure, None, law)
    message = f"the springs of the motion, `{motion.header.springs}`, are not beside its figure"
    hint = f"the page has the springs of {springs.origin}; choose others with --springs"
    return springs, None, (*warnings, warning(message, hint=hint))


def _springs_owner(path: Path, figure_name: str | None) -> tuple[Figure, _Warnings]:
    """Return the figure of a springs file: the one of `--figure`, or the one that it names."""
    if figure_name is not None:
        return load_figure(figure_name)
    _, _, owner = load_springs_file(path).require_value()
    if owner is None or owner.path is None:
        raise UsageError(f"{path}: the figure of the springs is not known; add --figure FIGURE")
    return load_figure(str(owner.path))


def _export(
    path: Path,
    figure_name: str | None,
    springs_choice: str | None,
    law: SphericalLaw | None,
    page: Path,
) -> CommandResult:
    """Write a motion as a page that needs no server."""
    check_motion_formats([page])
    motion, warnings = _load_drawable_motion(path, figure_name)
    if springs_choice is not None or law is not None:
        springs, more = springs_from_option(motion.figure, springs_choice, law)
        motion, warnings = replace(motion, springs=springs), (*warnings, *more)
    check_writable([page], (path, motion.figure.path))
    written = write_motion(motion, [page])
    return Conversion(
        source=str(path),
        figure=str(motion.figure.path),
        frames=motion.times.size,
        files=[page],
        losses=written,
        title=format_frames(motion.times, motion.figure.path),
        diagnostics=warnings,
    )


@dataclass(frozen=True)
class ViewResult(CommandResult):
    """Page that was open."""

    address: str
    figure: Path | None
    frames: int | None
    springs: str
    open_s: float

    def paragraphs(self) -> Paragraphs:
        """Return the time that the page was open."""
        return (f"The page was open for {self.open_s:.0f} s.",)


def _serve(
    inputs: ViewInputs, name: str, host: str, port: int | None, *, open_browser: bool
) -> CommandResult:
    """Serve the page until Ctrl-C."""
    try:
        from generator.viewer import server as page_server
    except ModuleNotFoundError as failure:
        if failure.name != "viser":
            raise
        message = 'the page needs viser: in the project\'s folder, `pip install -e ".[viewer]"`'
        raise UsageError(message) from None
    from generator.viewer.access import is_loopback
    from generator.viewer.panels import ordered_panels
    from generator.viewer.viewer import Content, Viewer

    content = Content(
        inputs.figure,
        inputs.springs,
        inputs.placement,
        Path.cwd(),
        inputs.motion,
        inputs.second,
        title=inputs.figure.name or name,
        springs_choice=inputs.springs_choice,
    )
    free_port = page_server.find_port(host, port)
    began, viewer, has_ended = time.monotonic(), None, False

    def end() -> None:
        nonlocal has_ended
        has_ended = True
        if viewer is not None:
            viewer.stop()

    with call_on_signals(end):
        server = page_server.open_server(host, free_port, content.title)
        where = page_server.address(server, host)
        try:
            viewer = Viewer(server, content, ordered_panels(content))
            if not has_ended:
                elsewhere = None
                if not is_loopback(host):
                    elsewhere = page_server.address_for_others(server, host)
                _announce(where, elsewhere, inputs.warnings)
                if open_browser and _has_display():
                    Thread(target=webbrowser.open, args=(where,), daemon=True).start()
                viewer.run()
        finally:
            if viewer is not None:
                viewer.close()
            page_server.close_server(server)
    frames = None if inputs.motion is None else inputs.motion.times.size
    seconds = time.monotonic() - began
    return ViewResult(where, inputs.figure.path, frames, inputs.springs.origin, seconds)


def _has_display() -> bool:
    """Return whether a browser can open a window, instead of one that takes over the terminal."""
    variables = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    return sys.platform in ("win32", "darwin") or any(map(os.environ.get, variables))


def _announce(where: str, elsewhere: str | None, warnings: _Warnings) -> None:
    """Print the address, that for other machines if they reach the page, and warnings."""
    typer.echo(f"{where}\nCtrl-C ends the page.", err=True)
    for line in dict.fromkeys(each.first_line for each in warnings):
        typer.echo(line, err=True)
    if elsewhere is not None:
        message = f"other machines reach the page too, at {elsewhere}"
        hint = "who has this address, or reads it on the network, can use the page"
        typer.echo(f"warning: {message}; {hint}", err=True)
