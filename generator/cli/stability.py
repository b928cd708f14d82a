"""`mover stability`: whether a figure stands on its support, in a pose or along a motion.

What `--support` and `--below` mean, and how a support is called in sentences.
"""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from typing import Annotated

import numpy as np
import typer

from generator.cli.answer import CommandResult, finite_or_none, format_count, format_table
from generator.cli.inputs import (
    check_distances,
    load_figure,
    motion_from_options,
    placement_from_options,
    placements_of_motion,
)
from generator.cli.options import (
    CM,
    FigureName,
    JointValues,
    MotionFile,
    PoseFile,
    TableOutput,
    format_rounded,
    in_cm,
    length_from_option,
    vector_from_option,
    xyz_cm,
)
from generator.cli.outputs import check_table_output, check_writable, write_file
from generator.diagnostics import UsageError
from generator.figure import Figure, SiteRef, Vector
from generator.kinematics.centre_of_mass import Masses, segment_masses
from generator.kinematics.stability import (
    Y_UP,
    Balance,
    FixedSupport,
    LowFaces,
    Patch,
    Points,
    Stability,
    Support,
    patch_from_faces,
    patch_from_site,
)
from generator.kinematics.stability import stability as stability_of
from generator.motion_files import FigureMotion
from generator.motion_files.action import format_displacement
from generator.rotations import Array, unit_vector
from generator.text_io import format_csv_comment

SUPPORT_SYNTAX = "SEGMENT, SEGMENT:FACE,FACE or SEGMENT.SITE"

_SITE_PATTERN = re.compile(r"(\w+)\.(\w+)")
_FACES_PATTERN = re.compile(r"(\w+)(?::\s*([0-9]{1,9}(?:\s*,\s*[0-9]{1,9})*))?")


def support_from_options(
    figure: Figure, texts: Sequence[str], below: float | None, up: Vector
) -> Support:
    """Return the support that the options define.

    Args:
        figure: that stands on it.
        texts: of the form `SEGMENT`, `SEGMENT:FACE,FACE` or `SEGMENT.SITE`.
        below: height up to which all faces support [m].
        up: normal of the ground.

    Raises:
        UsageError: a text cannot be read or does not fit the figure, or not one way is chosen.
        InputError: a psurf is missing or wrong.
    """
    if bool(texts) == (below is not None):
        raise UsageError("give either --support or --below")
    if below is not None:
        return LowFaces(figure, below, up)
    return FixedSupport([_patch_from_text(figure, text) for text in texts])


def _patch_from_text(figure: Figure, text: str) -> Patch:
    site, faces = _SITE_PATTERN.fullmatch(text), _FACES_PATTERN.fullmatch(text)
    try:
        if site is not None:
            return patch_from_site(figure, SiteRef(site[1], site[2]))
        if faces is None:
            raise UsageError(f"expected {SUPPORT_SYNTAX}")
        numbers = None if faces[2] is None else [int(word) for word in faces[2].split(",")]
        return patch_from_faces(figure, faces[1], numbers)
    except UsageError as failure:
        raise UsageError(f"--support {text}: {failure}") from None


MAX_SUPPORTS_LISTED = 3
"""Supports are listed up to this number, else counted."""


@dataclass(frozen=True)
class PoseStability:
    """Stability of a figure in one pose, its supports and its centre of mass [m]."""

    centre: Array
    points: Points
    stability: Stability


def stability(
    name: FigureName,
    support: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SEGMENT[:FACE,...]|SEGMENT.SITE",
            help="Support of the figure: faces of a segment's psurf, numbered from 1, or all of "
            "them, or a site. May be repeated.",
        ),
    ] = None,
    below: Annotated[
        str | None,
        typer.Option(
            metavar="HEIGHT", help="Support on all faces at or below this height, such as 1cm."
        ),
    ] = None,
    up: Annotated[
        str | None, typer.Option(metavar="X,Y,Z", help="Normal of the ground. [default: 0,1,0]")
    ] = None,
    pose: PoseFile = None,
    displacements: JointValues = None,
    along: MotionFile = None,
    output: TableOutput = None,
) -> CommandResult:
    """Test whether the centre of mass is over the support."""
    check_table_output(output, along)
    normal = _up_direction(up)
    height = None if below is None else length_from_option("--below", below)
    figure, warnings = load_figure(name)
    carrier = support_from_options(figure, support or (), height, normal)
    masses = segment_masses(figure)
    if along is None:
        placement, more = placement_from_options(figure, pose, displacements or ())
        state = _pose_stability(masses, carrier, placement.poses, normal)
        text = f"{name}: {stability_sentence(state.stability)}\n\n{_details_table(state, masses)}"
        data = {"figure": name, "mass_kg": masses.total, "up": list(normal)}
        return CommandResult(text, {**data, **_data(state)}, (*warnings, *more))
    motion, more = motion_from_options(figure, along, pose, displacements or ())
    files = [] if output is None else [output]
    check_writable(files, (figure.path, along))
    states = list(_stability_along_motion(motion, masses, carrier, normal))
    for path in files:
        write_file(path, _format_csv(motion, states))
    return CommandResult(
        text="\n".join([_summary(motion, states), *(f"wrote {path}" for path in files)]),
        data={
            "figure": name,
            "motion": str(along),
            "mass_kg": masses.total,
            "up": list(normal),
            "times_s": motion.times.tolist(),
            "balance": [state.stability.balance.value for state in states],
            "margin_cm": [_margin_cm(state.stability) for state in states],
            "centre_of_mass_cm": [in_cm(state.centre) for state in states],
            "files": [str(path) for path in files],
        },
        diagnostics=(*warnings, *more),
    )


def stability_sentence(found: Stability) -> str:
    """Return a sentence on the stability of a figure."""
    distance = f"{format_rounded(abs(found.margin) / CM)} cm"
    shape = {1: "a single point", 2: "a single line"}.get(len(found.corners))
    if found.balance is Balance.UNSUPPORTED:
        return "not balanced, nothing supports the figure"
    if found.balance is Balance.INSIDE:
        return f"balanced, the centre of mass is {distance} inside the edge of the support"
    if found.balance is Balance.ON_EDGE:
        if shape is None:
            return "marginal, the centre of mass is on the edge of the support"
        return f"marginal, the support is {shape} directly below the centre of mass"
    if shape is None:
        return f"not balanced, the centre of mass is {distance} outside the support"
    return f"not balanced, the support is {shape} and the centre of mass is {distance} off it"


def _up_direction(text: str | None) -> Vector:
    up = np.array(Y_UP if text is None else vector_from_option("--up", text, largest=inf))
    largest = np.abs(up).max()
    if largest == 0.0:
        raise UsageError(f"--up {text}: the direction must not be zero")
    x, y, z = unit_vector(
        up / largest
    ).tolist()  # first scaled: squares of large components overflow
    return x, y, z


def _pose_stability(
    masses: Masses, support: Support, poses: Mapping[str, Array], up: Vector
) -> PoseStability:
    centre, points = masses.centre(poses), support.points_in_pose(poses)
    check_distances("the centre of mass", centre)
    check_distances("a point of support", points.positions)
    return PoseStability(centre, points, stability_of(centre, points.positions, up))


def _stability_along_motion(
    motion: FigureMotion, masses: Masses, support: Support, up: Vector
) -> Iterator[PoseStability]:
    for placement in placements_of_motion(motion):
        for k in range(len(placement.poses[placement.tree.figure.root.segment])):
            poses = {name: rows[k] for name, rows in placement.poses.items()}
            yield _pose_stability(masses, support, poses, up)


def _details_table(state: PoseStability, masses: Masses) -> str:
    found, points = state.stability, state.points
    rows = [("centre of mass", f"{xyz_cm(state.centre)}, {masses.total:.4g} kg")]
    if not len(found.corners):
        return format_table(rows, left_columns=2)
    sources = points.sources
    what = (
        ", ".join(sources)
        if len(sources) <= MAX_SUPPORTS_LISTED
        else f"{len(sources)} faces and sites"
    )
    if found.area:
        area = format_rounded(found.area / CM**2)
        what += f"; {format_count(len(found.corners), 'corner')}, {area} cm^2"
    rows.append(("support", what))
    names = [f"{points.names[found.sources[k]]} at {xyz_cm(found.corners[k])}" for k in found.pivot]
    inside = found.balance is Balance.INSIDE
    rows.append(("nearest edge" if inside else "tips over", " to ".join(names)))
    if found.direction is not None:
        x, y, z = (format_rounded(part, 4) for part in found.direction)
        rows.append(("outwards" if inside else "towards", f"({x}, {y}, {z})"))
    return format_table(rows, left_columns=2)


def _data(standing: PoseStability) -> dict[str, object]:
    found, points = standing.stability, standing.points
    return {
        "balance": found.balance.value,
        "margin_cm": _margin_cm(found),
        "sentence": stability_sentence(found),
        "centre_of_mass_cm": in_cm(standing.centre),
        "supports": list(points.sources),
        "corners": [
            {"of": points.names[source], "on_ground_cm": in_cm(corner)}
            for source, corner in zip(found.sources, found.corners, strict=True)
        ],
        "area_cm2": found.area / CM**2,
        "pivot": list(found.pivot),
        "direction": None if found.direction is None else found.direction.tolist(),
    }


def _margin_cm(found: Stability) -> float | None:
    margin = finite_or_none(found.margin)
    return None if margin is None else margin / CM


def _summary(motion: FigureMotion, states: Sequence[PoseStability]) -> str:
    times = motion.times
    tally = Counter(one.stability.balance for one in states)
    frames = f"{format_count(len(times), 'frame')}, {times[0]:g} to {times[-1]:g} s"
    counts = [f"{tally[balance]} {balance.value}" for balance in Balance if tally[balance]]
    rows = [("frames", ", ".join(counts))]
    margins = np.array([one.stability.margin for one in states])
    supported = np.flatnonzero(np.isfinite(margins))
    if supported.size:
        for name, pick in (("least margin", np.argmin), ("greatest margin", np.argmax)):
            k = int(supported[pick(margins[supported])])
            rows.append((name, f"{format_rounded(margins[k] / CM)} cm at {times[k]:.6g} s"))
    fallen = np.flatnonzero(margins < 0.0)
    if fallen.size:
        rows.append(("first not balanced", f"{times[fallen[0]]:.6g} s"))
    return f"{frames}\n\n{format_table(rows, left_columns=2)}\n"


def _format_csv(motion: FigureMotion, states: Sequence[PoseStability]) -> str:
    """Format balance, margin and centre of mass of every frame as CSV, with the motion's header."""
    comments = map(format_csv_comment, motion.header.lines())
    lines = ["time [s],balance,margin [cm],x [cm],y [cm],z [cm]"]
    for time, one in zip(motion.times.tolist(), states, strict=True):
        margin = finite_or_none(one.stability.margin)
        cells = [repr(time), one.stability.balance.value]
        cells.append("" if margin is None else format_displacement(margin, "cm"))
        cells += [format_displacement(part, "cm") for part in one.centre.tolist()]
        lines.append(",".join(cells))
    return "".join([*comments, *(f"{line}\n" for line in lines)])
