"""`mover track`: the motion of a figure from measured markers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from generator.cli import options, outputs
from generator.cli.answer import HIDDEN, CommandResult, Paragraphs, Table, format_written
from generator.cli.inverse import load_body
from generator.cli.options import option, output_option
from generator.diagnostics import (
    Diagnostic,
    InputError,
    UsageError,
    error,
    format_count,
    shorten,
    spelling_hint,
    warning,
)
from generator.figure import Figure
from generator.inverse.markers import (
    TASKS_FILE,
    Markers,
    MarkerSite,
    find_marker_sites,
    read_markers,
)
from generator.inverse.tracking import Tracked, track_markers
from generator.kinematics.free_root import detach_root
from generator.kinematics.links import LINKS_FILE, NO_LINKS, Coordinate, Links
from generator.kinematics.placement import initial_displacements
from generator.kinematics.tree import Tree, build_tree
from generator.motion_files import FigureMotion
from generator.motion_files.motion import motion_from_figure
from generator.rotations import Array

MAX_RMS_MM = 50.0
"""Distance of markers from their sites, rms, above which the motion is in doubt; an estimate."""

MAX_LISTED = 8
"""Names that a warning lists."""


@dataclass(frozen=True)
class MarkerFit:
    """Distances of a marker from its site."""

    segment: str
    weight: float
    rms_mm: float
    largest_mm: float
    missing_frames: int


@dataclass(frozen=True, kw_only=True)
class TrackResult(CommandResult):
    """Motion of a figure from markers.

    Attributes:
        figure: Figure or model.
        markers_file: File of the markers.
        frames: Number of frames.
        rms_mm: Root mean square of all distances.
        markers: Distances by marker.
        unused: Markers without a site in the figure, or without weight.
        files: Files that were written.
    """

    figure: str
    markers_file: Path
    frames: int
    rms_mm: float
    markers: Mapping[str, MarkerFit]
    unused: Sequence[str]
    files: Sequence[Path]
    title: str = field(default="", metadata=HIDDEN)

    def paragraphs(self) -> Paragraphs:
        """Return the distances of all markers, the largest first."""
        yield f"{self.title}, {len(self.markers)} markers within {self.rms_mm:.3g} mm (rms)"
        rows = [["marker", "segment", "rms [mm]", "largest [mm]", "missing frames"]]
        worst = sorted(self.markers.items(), key=lambda one: -one[1].rms_mm)
        for name, one in worst:
            distances = (f"{one.rms_mm:.3g}", f"{one.largest_mm:.3g}")
            rows.append([name, one.segment, *distances, str(one.missing_frames)])
        yield Table(rows, left_columns=2)
        yield format_written(self.files)


def track(
    model: options.BodyName,
    markers: Annotated[
        Path, typer.Argument(metavar="MARKERS", help="Measured markers: .trc, or .c3d.")
    ],
    output: Annotated[list[Path], output_option("FILE", "Motion, .mot .sto .action ...")],
    weight: Annotated[
        list[str] | None,
        option("MARKER=W", "Weight of a marker, 0 to leave it out; repeat it. [default: 1]"),
    ] = None,
    tasks: Annotated[
        Path | None, option("SETUP.xml", "Weights of OpenSim's setup; others are left out.")
    ] = None,
    links: options.LinksFile = None,
    free_root: options.FreeRoot = False,
    up: options.UpAxis = "y",
) -> CommandResult:
    """Find the motion of a figure from measured markers.

    A marker belongs to the site SEGMENT.SITE, or to the only site of its name. Limits of joints and
    links are kept.
    """
    outputs.check_motion_formats(output)
    if up not in ("y", "z"):
        raise UsageError(f"--up {up}: y or z")
    figure, coordinates, warnings = load_body(model)
    outputs.check_writable(output, (figure.path, model, markers, tasks, links))
    tree = _tree(figure, model, free_root=free_root)
    followers, more = _links(links, tree.figure)
    measured = read_markers(markers, up)
    sites = find_marker_sites(measured.names, tree.figure)
    weights = _weights(measured, weight or (), tasks)
    try:
        tracked = track_markers(tree, measured, sites, weights, followers)
    except InputError as failure:
        faults = [error(f"{markers}: {one.message}", hint=one.hint) for one in failure.diagnostics]
        raise InputError(faults) from None
    frame = motion_from_figure(figure)
    times = measured.times
    header = replace(
        frame.header,
        start=float(times[0]),
        stop=float(times[-1]),
        frame_interval=float(f"{times[1] - times[0]:.12g}") if len(times) > 1 else None,
        message=f"Tracked from {markers.name}.",
    )
    motion = FigureMotion(
        figure,
        header,
        {name: tree.figure.joints[name].chain for name in tree.figure.joints},
        times,
        tracked.displacements,
        coordinates=coordinates,
    )
    outputs.write_motion(motion, output)
    unused = [name for name in measured.names if name not in tracked.markers]
    return TrackResult(
        figure=model,
        markers_file=markers,
        frames=len(times),
        rms_mm=tracked.rms_mm,
        markers=_fits(tracked, sites, weights),
        unused=unused,
        files=output,
        title=options.format_frames(times),
        diagnostics=(*warnings, *more, *_doubts(tracked, unused, up)),
    )


def _tree(figure: Figure, model: str, *, free_root: bool) -> Tree:
    """Return the tree that markers move. Raises InputError for one with loops or without motion."""
    if free_root:
        figure, _ = detach_root(figure, initial_displacements(build_tree(figure)))
    tree = build_tree(figure)
    if tree.closures:
        names = ", ".join(joint.name for joint in tree.closures)
        raise InputError([error(f"{model}: the joints {names} close loops, which are not tracked")])
    if not tree.kinematics.size:
        raise InputError([error(f"{model}: nothing in this figure moves")])
    return tree


def _links(path: Path | None, figure: Figure) -> tuple[Links, tuple[Diagnostic, ...]]:
    if path is None:
        return NO_LINKS, ()
    parsed = LINKS_FILE.parse_file(path, figure)
    return parsed.require_value(), parsed.diagnostics


def _weights(markers: Markers, texts: Sequence[str], tasks: Path | None) -> dict[str, float]:
    """Return the weights of markers. Raises UsageError and InputError."""
    weights = dict.fromkeys(markers.names, 1.0)
    if tasks is not None:
        known = TASKS_FILE.read(tasks)
        weights = {name: known.get(name, 0.0) for name in markers.names}
    for text in texts:
        name, equals, number = text.rpartition("=")
        if not equals:
            raise UsageError(f"--weight {text}: expected MARKER=W, such as sacrum=10")
        if name not in weights:
            hint = spelling_hint(name, weights)
            raise UsageError(f"--weight {text}: there is no marker `{shorten(name)}`; {hint}")
        try:
            weights[name] = float(number)
        except ValueError:
            weights[name] = -1.0
        if not (weights[name] >= 0.0 and isfinite(weights[name])):
            raise UsageError(f"--weight {text}: a weight is a number from 0")
    return weights


def _fits(
    tracked: Tracked, sites: Mapping[str, MarkerSite], weights: Mapping[str, float]
) -> dict[str, MarkerFit]:
    fits: dict[str, MarkerFit] = {}
    for name, distances in zip(tracked.markers, 1e3 * tracked.distances.T, strict=True):
        seen: Array = distances[np.isfinite(distances)]
        rms = float(np.sqrt(np.mean(seen**2))) if len(seen) else float("nan")
        largest = float(seen.max()) if len(seen) else float("nan")
        missing = len(distances) - len(seen)
        fits[name] = MarkerFit(sites[name].segment, weights[name], rms, largest, missing)
    return fits


def _doubts(tracked: Tracked, unused: Sequence[str], up: str) -> Sequence[Diagnostic]:
    found: list[Diagnostic] = []
    if (rms := tracked.rms_mm) > MAX_RMS_MM:
        other = "y" if up == "z" else "z"
        found.append(
            warning(
                f"the markers are {rms:.3g} mm (rms) from their sites, which is not their motion: "
                f"another axis may point up (--up {other}), or units, names of markers or the "
                "size of the figure be others"
            )
        )
    if unused:
        what = f"markers without a site in the figure, or without weight: {_listed(unused)}"
        found.append(warning(what))
    if tracked.undetermined:
        frames = max(tracked.undetermined.values())
        names = _listed(list(map(_displacement, tracked.undetermined)))
        what = f"in {format_count(frames, 'frame')} the markers do not determine {names}"
        found.append(warning(what, hint="they keep the value of the figure, or of frames before"))
    if tracked.at_limits:
        names = _listed(list(map(_displacement, tracked.at_limits)))
        found.append(warning(f"at a limit of the joint in some frames: {names}"))
    return found


def _displacement(at: Coordinate) -> str:
    return f"{at.joint}_{at.index + 1}"


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(map(shorten, names[:MAX_LISTED]))
    return shown + (f" and {len(names) - MAX_LISTED} more" if len(names) > MAX_LISTED else "")
