"""`mover stability`: whether a figure stands on its support, in a pose or along a motion.

What `--support` and `--below` mean, and how a support is called in sentences.
"""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np

from generator.cli import inputs, options, outputs
from generator.cli.answer import CommandResult, Paragraphs, Table, format_count, format_written
from generator.cli.options import CM, format_rounded, in_cm, option
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

SUPPORT_SYNTAX = "SEGMENT, SEGMENT:FACE,FACE or SEGMENT.SITE"

_SITE_PATTERN = re.compile(r"(\w+)\.(\w+)")
_FACES_PATTERN = re.compile(r"(\w+)(?::\s*([0-9]{1,9}(?:\s*,\s*[0-9]{1,9})*))?")


def support_from_options(
    figure: Figure, texts: Sequence[str], below: float | None, up: Vector
) -> Support:
    """Return the support: parts of a figure, or all of its faces up to a height [m].

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


class Standing(NamedTuple):
    """Stability of a figure in one pose, its supports and its centre of mass [m]."""

    centre: Array
    points: Points
    stability: Stability


class Corner(NamedTuple):
    """A corner of a support."""

    of: str
    on_ground_cm: Sequence[float]


@dataclass(frozen=True)
class PoseStability(CommandResult):
    """Stability of a figure in a pose."""

    figure: str
    mass_kg: float
    up: Vector
    balance: Balance
    margin_cm: float
    sentence: str
    centre_of_mass_cm: Sequence[float]
    supports: Sequence[str]
    corners: Sequence[Corner]
    area_cm2: float
    pivot: Sequence[int]
    direction: Array | None

    def paragraphs(self) -> Paragraphs:
        """Return the sentence on the balance, and a table of its reasons."""
        centre = _format_xyz(self.centre_of_mass_cm)
        rows = [("centre of mass", f"{centre} cm, {self.mass_kg:.4g} kg")]
        if self.corners:
            text = ", ".join(self.supports)
            if len(self.supports) > MAX_SUPPORTS_LISTED:
                text = f"{len(self.supports)} faces and sites"
            if self.area_cm2:
                corners = format_count(len(self.corners), "corner")
                text += f"; {corners}, {format_rounded(self.area_cm2)} cm^2"
            ends = (self.corners[k] for k in self.pivot)
            names = (f"{end.of} at {_format_xyz(end.on_ground_cm)} cm" for end in ends)
            inside = self.balance is Balance.INSIDE
            rows.append(("support", text))
            rows.append(("nearest edge" if inside else "tips over", " to ".join(names)))
            if self.direction is not None:
                where = _format_xyz(self.direction.tolist(), 4)
                rows.append(("outwards" if inside else "towards", where))
        return f"{self.figure}: {self.sentence}", Table(rows, 2)


@dataclass(frozen=True)
class MotionStability(CommandResult):
    """Stability of a figure along a motion, in each frame."""

    figure: str
    motion: Path
    mass_kg: float
    up: Vector
    times_s: Sequence[float]
    balance: Sequence[Balance]
    margin_cm: Sequence[float]
    centre_of_mass_cm: Sequence[Sequence[float]]
    files: Sequence[Path]

    def paragraphs(self) -> Paragraphs:
        """Return the frames of each balance, and the extreme margins."""
        tally, times, margins = Counter(self.balance), self.times_s, np.array(self.margin_cm)
        counts = [f"{tally[balance]} {balance.value}" for balance in Balance if tally[balance]]
        rows = [("frames", ", ".join(counts))]
        supported = np.flatnonzero(np.isfinite(margins))
        if supported.size:
            for name, pick in (("least margin", np.argmin), ("greatest margin", np.argmax)):
                k = int(supported[pick(margins[supported])])
                rows.append((name, f"{format_rounded(margins[k])} cm at {times[k]:.6g} s"))
        fallen = np.flatnonzero(margins < 0.0)
        if fallen.size:
            rows.append(("first not balanced", f"{times[fallen[0]]:.6g} s"))
        return options.format_frames(times), Table(rows, 2), format_written(self.files)


def _format_xyz(vector: Sequence[float], digits: int = 2) -> str:
    return f"({', '.join(format_rounded(part, digits) for part in vector)})"


def stability(
    name: options.FigureName,
    support: Annotated[
        list[str] | None,
        option(
            "SEGMENT[:FACE,...]|SEGMENT.SITE",
            "Support of the figure: faces of a segment's psurf, numbered from 1, or all of "
            "them, or a site. May be repeated.",
        ),
    ] = None,
    below: Annotated[
        str | None, option("HEIGHT", "Support on all faces at or below this height, such as 1cm.")
    ] = None,
    up: Annotated[str | None, option("X,Y,Z", "Normal of the ground. [default: 0,1,0]")] = None,
    pose: options.PoseFile = None,
    displacements: options.JointValues = None,
    along: options.MotionFile = None,
    output: options.TableOutput = None,
) -> CommandResult:
    """Test whether the centre of mass is over the support."""
    outputs.check_table_output(output, along)
    normal = _up_direction(up)
    height = None if below is None else options.length_from_option("--below", below)
    figure, warnings = inputs.load_figure(name)
    carrier = support_from_options(figure, support or (), height, normal)
    masses = segment_masses(figure)
    if along is None:
        placement, more = inputs.placement_from_options(figure, pose, displacements or ())
        centre, points, found = _standing(masses, carrier, placement.poses, normal)
        return PoseStability(
            figure=name,
            mass_kg=masses.total,
            up=normal,
            balance=found.balance,
            margin_cm=found.margin / CM,
            sentence=stability_sentence(found),
            centre_of_mass_cm=in_cm(centre),
            supports=points.sources,
            corners=[
                Corner(points.names[int(source)], in_cm(corner))
                for source, corner in zip(found.sources, found.corners, strict=True)
            ],
            area_cm2=found.area / CM**2,
            pivot=found.pivot,
            direction=found.direction,
            diagnostics=(*warnings, *more),
        )
    motion, more = inputs.motion_from_options(figure, along, pose, displacements or ())
    files = outputs.output_files(output, (figure.path, along))
    states = list(_stability_along_motion(motion, masses, carrier, normal))
    for path in files:
        titles = "time [s],balance,margin [cm],x [cm],y [cm],z [cm]"
        rows = map(_table_cells, states)
        outputs.write_frame_table(path, motion.header.lines(), titles, motion.times, rows)
    return MotionStability(
        figure=name,
        motion=along,
        mass_kg=masses.total,
        up=normal,
        times_s=motion.times.tolist(),
        balance=[state.stability.balance for state in states],
        margin_cm=[state.stability.margin / CM for state in states],
        centre_of_mass_cm=[in_cm(state.centre) for state in states],
        files=files,
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
    up = np.array(Y_UP if text is None else options.vector_from_option("--up", text, largest=inf))
    largest = np.abs(up).max()
    if largest == 0.0:
        raise UsageError(f"--up {text}: the direction must not be zero")
    x, y, z = unit_vector(
        up / largest
    ).tolist()  # first scaled: squares of large components overflow
    return x, y, z


def _standing(masses: Masses, support: Support, poses: Mapping[str, Array], up: Vector) -> Standing:
    centre, points = masses.centre(poses), support.points_in_pose(poses)
    inputs.check_distances("the centre of mass", centre)
    inputs.check_distances("a point of support", points.positions)
    return Standing(centre, points, stability_of(centre, points.positions, up))


def _stability_along_motion(
    motion: FigureMotion, masses: Masses, support: Support, up: Vector
) -> Iterator[Standing]:
    for placement in inputs.placements_of_motion(motion):
        for k in range(len(placement.poses[placement.tree.figure.root.segment])):
            poses = {name: rows[k] for name, rows in placement.poses.items()}
            yield _standing(masses, support, poses, up)


def _table_cells(state: Standing) -> list[str]:
    """Return balance, margin and centre of mass as cells of a table."""
    margin, centre = state.stability.margin, state.centre.tolist()
    margin_text = format_displacement(margin, "cm") if isfinite(margin) else ""
    lengths = [format_displacement(length, "cm") for length in centre]
    return [state.stability.balance.value, margin_text, *lengths]
