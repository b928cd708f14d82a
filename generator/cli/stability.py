"""`mover stability`: whether a figure stands on its support, in a pose or along a motion.

What `--support` and `--below` mean, and how a support is called in sentences.
"""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path

import numpy as np

from generator.cli.answer import (
    CommandResult,
    UsageError,
    finite_or_none,
    format_count,
    format_table,
)
from generator.cli.com import check_table_output, masses_from_option
from generator.cli.inputs import (
    LoadedMotion,
    check_distances,
    load_figure,
    motion_from_options,
    placement_from_options,
)
from generator.cli.options import (
    CM,
    format_rounded,
    in_cm,
    length_from_option,
    vector_from_option,
    xyz_cm,
)
from generator.cli.outputs import check_writable, write_text
from generator.figure import Figure, SiteRef, Vector
from generator.kinematics.centre_of_mass import Masses
from generator.kinematics.stability import (
    Y_UP,
    Balance,
    FixedSupport,
    LowFaces,
    Patch,
    Points,
    Stability,
    Support,
    UnknownSupportError,
    patch_from_faces,
    patch_from_site,
    stability,
)
from generator.motion_files.action import format_displacement
from generator.rotations import Array, unit_vector

SUPPORT_SYNTAX = "SEGMENT, SEGMENT:FACE,FACE or SEGMENT.SITE"

_SITE_PATTERN = re.compile(r"(\w+)\.(\w+)")
_FACES_PATTERN = re.compile(r"(\w+)(?::\s*([0-9]{1,9}(?:\s*,\s*[0-9]{1,9})*))?")


def support_from_options(
    figure: Figure, texts: Sequence[str], below: float | None, up: Vector
) -> Support:
    """The support that the options ask for.

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
        raise UsageError("what supports the figure is said by --support or by --below, one of them")
    if below is not None:
        return LowFaces(figure, below, up)
    return FixedSupport([_patch_from_text(figure, text) for text in texts])


def _patch_from_text(figure: Figure, text: str) -> Patch:
    try:
        site = _SITE_PATTERN.fullmatch(text)
        if site is not None:
            return patch_from_site(figure, SiteRef(site[1], site[2]))
        faces = _FACES_PATTERN.fullmatch(text)
        if faces is None:
            raise UsageError(f"--support {text}: expected {SUPPORT_SYNTAX}")
        numbers = None if faces[2] is None else [int(word) for word in faces[2].split(",")]
        return patch_from_faces(figure, faces[1], numbers)
    except UnknownSupportError as failure:
        raise UsageError(f"--support {text}: {failure}") from None


MAX_SUPPORTS_LISTED = 3
"""So many supports are named, more are counted."""


@dataclass(frozen=True)
class Request:
    """The command line of `mover stability`; None where an option is not given."""

    figure: str
    support: Sequence[str] = ()
    below: str | None = None
    up: str | None = None
    pose: Path | None = None
    displacements: Sequence[str] = ()
    along: Path | None = None
    output: Path | None = None


@dataclass(frozen=True)
class PoseStability:
    """How a figure stands in one pose, on what, and where its centre of mass is [m]."""

    centre: Array
    points: Points
    stability: Stability


def stability_of(request: Request) -> CommandResult:
    """How the figure stands that is asked for.

    Raises:
        UsageError: an option cannot be read or does not fit the figure.
        InputError: the figure, a psurf, the pose or the motion is wrong, or the output cannot be
            written.
        MoverError: there is no such pose or motion of the figure, or no mass.
    """
    check_table_output(request.output, request.along)
    up = _up_direction(request.up)
    below = None if request.below is None else length_from_option("--below", request.below)
    figure, warnings = load_figure(request.figure)
    support = support_from_options(figure, request.support, below, up)
    masses = masses_from_option(figure, None)
    if request.along is None:
        placement, more = placement_from_options(figure, request.pose, request.displacements)
        standing = _pose_stability(masses, support, placement.poses, up)
        text = f"{request.figure}: {stability_sentence(standing.stability)}\n\n{_details_table(standing, masses)}"
        data = {"figure": request.figure, "mass_kg": masses.total, "up": list(up)}
        return CommandResult(text, {**data, **_data(standing)}, (*warnings, *more))
    motion, more = motion_from_options(figure, request.along, request.pose, request.displacements)
    files = [] if request.output is None else [request.output]
    check_writable(files, (figure.path, request.along))
    standings = list(_stability_along_motion(motion, masses, support, up))
    for path in files:
        write_text(path, _format_csv(motion, standings))
    return CommandResult(
        text="\n".join([_summary(motion, standings), *(f"wrote {path}" for path in files)]),
        data={
            "figure": request.figure,
            "motion": str(request.along),
            "mass_kg": masses.total,
            "up": list(up),
            "times_s": motion.action.times.tolist(),
            "balance": [one.stability.balance.value for one in standings],
            "margin_cm": [_margin_cm(one.stability) for one in standings],
            "centre_of_mass_cm": [in_cm(one.centre) for one in standings],
            "files": [str(path) for path in files],
        },
        diagnostics=(*warnings, *more),
    )


def stability_sentence(found: Stability) -> str:
    """How a figure stands, in words."""
    distance = f"{format_rounded(abs(found.margin) / CM)} cm"
    shape = {1: "a single point", 2: "a single line"}.get(len(found.corners))
    if found.balance is Balance.UNSUPPORTED:
        return "not balanced, because nothing supports the figure"
    if found.balance is Balance.INSIDE:
        return f"balanced, the centre of mass stands {distance} inside the edge of the support"
    if found.balance is Balance.ON_EDGE:
        if shape is None:
            return "on the verge, the centre of mass stands on the edge of the support"
        return f"on the verge, the support is {shape} right under the centre of mass"
    if shape is None:
        return f"not balanced, the centre of mass stands {distance} outside the support"
    return f"not balanced, the support is {shape} and the centre of mass stands {distance} off it"


def _up_direction(text: str | None) -> Vector:
    up = np.array(Y_UP if text is None else vector_from_option("--up", text, largest=inf))
    largest = np.abs(up).max()
    if largest == 0.0:
        raise UsageError(f"--up {text}: a direction has a length other than zero")
    x, y, z = unit_vector(up / largest).tolist()  # the squares of very long vectors are no floats
    return x, y, z


def _pose_stability(
    masses: Masses, support: Support, poses: Mapping[str, Array], up: Vector
) -> PoseStability:
    centre, points = masses.centre(poses), support.points_in_pose(poses)
    check_distances("the centre of mass", centre)
    check_distances("a point of support", points.positions)
    return PoseStability(centre, points, stability(centre, points.positions, up))


def _stability_along_motion(
    motion: LoadedMotion, masses: Masses, support: Support, up: Vector
) -> Iterator[PoseStability]:
    for placement in motion.placements():
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
        what += f"; {format_count(len(found.corners), 'corner')}, {format_rounded(found.area / CM**2)} cm^2"
    rows.append(("support", what))
    names = [f"{points.names[found.sources[k]]} at {xyz_cm(found.corners[k])}" for k in found.pivot]
    inside = found.balance is Balance.INSIDE
    rows.append(("nearest edge" if inside else "tips over", " to ".join(names)))
    if found.direction is not None:
        x, y, z = (format_rounded(part, 4) for part in found.direction)
        rows.append(("out there" if inside else "towards", f"({x}, {y}, {z})"))
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


def _summary(motion: LoadedMotion, states: Sequence[PoseStability]) -> str:
    times = motion.action.times
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


def _format_csv(motion: LoadedMotion, states: Sequence[PoseStability]) -> str:
    """Balance, margin and centre of mass of every frame, under the header of the motion."""
    lines = [f"# {line}" for line in motion.action.header.lines()]
    lines.append("time [s],balance,margin [cm],x [cm],y [cm],z [cm]")
    for time, one in zip(motion.action.times.tolist(), states, strict=True):
        margin = finite_or_none(one.stability.margin)
        cells = [repr(time), one.stability.balance.value]
        cells.append("" if margin is None else format_displacement(margin, "cm"))
        cells += [format_displacement(part, "cm") for part in one.centre.tolist()]
        lines.append(",".join(cells))
    return "".join(f"{line}\n" for line in lines)
