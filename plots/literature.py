"""Published curves that are drawn beside a simulated one, and tables of measured benchmarks.

The benchmarks (`plots/data/NAME.csv`) compare other engines and wall times. The files begin with
comments: command, day, machine and versions.
"""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.resources import files
from math import inf, radians

import numpy as np

from springs.backends import Array
from springs.elastic import Elastic, Range, describe_extrapolation
from springs.interpolated import Interpolated
from springs.published import tables as published
from springs.published.reference import Reference, Sample
from springs.published.rows import PublishedCurve, comparison_obstacle

OWN_ENGINE = "this program"
"""Name of this program in the tables of benchmarks."""

YOON_MANSOUR = (
    "Y. S. Yoon & J. M. Mansour, The Passive Elastic Moment at the Hip, J. Biomech. "
    "15:905-910, 1982 (the thesis's source; its data are not public)"
)

_ALL_ANGLES: Range = (-inf, inf)


def thesis_reference(place: str) -> str:
    """Return the reference of the thesis with a place in it."""
    return str(replace(published.publication("otani_1989").reference, place=place))


@dataclass(frozen=True)
class Literature:
    """A published curve in the sense of the joint's angle, as torque on the child.

    Attributes:
        label: label in the legend, without its reference.
        pieces: laws, each with the range for which it is published [rad]; where they overlap the
            first one applies.
        valid_range: range in which the curve may be used [rad], or None if unknown.
        reference: reference of the publication.
        sample: what was measured.
        range_is_measured: whether `valid_range` is that of a measurement.
        held_text: angles of other joints during the measurement, in words, or "".
        note: remark for the caption, or "".
        is_line: True if the curve is known between its points.
        row: the published row with its scatter, where one row makes the curve.
    """

    label: str
    pieces: tuple[tuple[Elastic, Range], ...]
    valid_range: Range | None
    reference: Reference
    sample: Sample = field(default_factory=Sample)
    range_is_measured: bool = False
    held_text: str = ""
    note: str = ""
    is_line: bool = True
    row: PublishedCurve | None = None

    def known_part(self, low: float, high: float) -> Range:
        """Part of a range [rad] in which the curve may be used; all of it if that is unknown."""
        first, last = self.valid_range or (low, high)
        return max(low, first), min(high, last)

    def torque(self, angles: Array) -> Array:
        """Torque on the child [N m] at angles [rad]; nan outside all pieces."""
        result = np.full_like(angles, np.nan)
        for law, (low, high) in reversed(self.pieces):
            inside = (angles >= low) & (angles <= high)
            result[inside] = law.torque(angles[inside])
        return result

    def torque_at(self, angle: float) -> float:
        """Torque on the child [N m] at one angle [rad]."""
        return float(self.torque(np.array([angle]))[0])

    @property
    def obstacle(self) -> str:
        """Reason why no joint can be compared with the curve, or ""."""
        return comparison_obstacle(self.sample, self.reference, self.range_is_measured)

    @property
    def scatter_text(self) -> str:
        """The published scatter in words, or ""."""
        return "" if self.row is None else self.row.scatter_text

    def band(self, angles: Array) -> tuple[Array, Array] | None:
        """Edges of the published scatter at angles [rad], nan beyond the known range [N m]."""
        edges = None if self.row is None else self.row.torque_band(angles)
        if edges is None:
            return None
        low, high = self.known_part(-inf, inf)
        known = (angles >= low - 1e-12) & (angles <= high + 1e-12)
        below, above = (np.where(known, edge, np.nan) for edge in edges)
        return below, above

    @property
    def points(self) -> tuple[Array, Array] | None:
        """Angles [rad] and torques [N m] of a digitised curve; None for a formula."""
        law = self.pieces[0][0]
        if not isinstance(law, Interpolated):
            return None
        angles, torques = np.array(law.points).T
        return angles, torques

    def extrapolation_note(self, low: float, high: float) -> str:
        """A note on extrapolation for a curve drawn from `low` to `high` [rad], or ""."""
        first = min(piece[1][0] for piece in self.pieces)
        last = max(piece[1][1] for piece in self.pieces)
        return describe_extrapolation(self.valid_range, max(low, first), min(high, last))


def literature_from_points(
    points: tuple[tuple[float, float], ...], label: str, reference: Reference, sample: Sample
) -> Literature:
    """Make unconnected points (angle [rad], torque on the child [N m]); angles increase."""
    table = Interpolated(points)
    pieces, known = ((table, _ALL_ANGLES),), table.valid_range
    return Literature(label, pieces, known, reference, sample, True, is_line=False)


def published_curve(key: str, label: str, note: str = "", side: int = 0) -> Literature:
    """The curve `publication/name`; `side` is the only side of zero that it describes, or 0."""
    curve = published.curve(key)
    ends = {-1: (-inf, 0.0), 0: _ALL_ANGLES, 1: (0.0, inf)}[side]
    angles = curve.held_angles.items()
    held_text = ", ".join(f"{name} at {np.degrees(at):.4g} deg" for name, at in angles)
    source = curve.reference, curve.sample, curve.range_is_measured
    pieces = ((curve.law, ends),)
    return Literature(label, pieces, curve.valid_range, *source, held_text, note, row=curve)


def join_curves(*curves: Literature) -> Literature:
    """Join curves of one publication for different ranges of an angle; the first names them."""
    first = curves[0]
    pieces = tuple(piece for part in curves for piece in part.pieces)
    ranges = [part.valid_range for part in curves if part.valid_range is not None]
    hull = (min(low for low, _ in ranges), max(high for _, high in ranges)) if ranges else None
    return replace(first, pieces=pieces, valid_range=hull, row=None)


def mirror_to_both_sides(half: Literature) -> Literature:
    """Extend a curve for positive angles by its mirror image for negative ones."""
    mirrored = tuple((law.mirrored(), (-high, -low)) for law, (low, high) in half.pieces)
    known = half.valid_range
    other = None if known is None else (-known[1], -known[0])
    return join_curves(half, replace(half, pieces=mirrored, valid_range=other))


def single_angle_curve(
    key: str, motion: str, held_deg: Mapping[str, float], label: str, note: str = ""
) -> Literature:
    """One coordinate of the coupled law `publication/name`, the others constant.

    Args:
        key: of the law.
        motion: the coordinate, as "hip flexion".
        held_deg: the other coordinates [deg].
        label: label in the legend.
        note: note as in `Literature`.
    """
    row, angles = published.coupled_law(key), {name: radians(at) for name, at in held_deg.items()}
    law = row.law.single_angle_law(motion, angles)
    held_text = ", ".join(f"{name.split()[0]} at {angle:g} deg" for name, angle in held_deg.items())
    source = row.reference, row.sample, row.range_is_measured
    return Literature(label, ((law, _ALL_ANGLES),), law.valid_range, *source, held_text, note)


TableRow = Mapping[str, str]


@dataclass(frozen=True)
class Measurements:
    """A table of benchmarks: cells as text by header, and the comments by key."""

    provenance: Mapping[str, str]
    rows: Sequence[TableRow]

    def select_rows(self, **cells: str) -> "Measurements":
        """Select the rows with these cells."""
        rows = [row for row in self.rows if all(row[key] == cells[key] for key in cells)]
        return Measurements(self.provenance, rows)

    def groups(self, *keys: str) -> dict[tuple[str, ...], "Measurements"]:
        """The rows with the same cells in some columns, by these cells, without the columns."""
        rest = [key for key in self.rows[0] if key not in keys]
        groups: dict[tuple[str, ...], list[TableRow]] = {}
        for row in self.rows:
            cells = {key: row[key] for key in rest}
            groups.setdefault(tuple(row[key] for key in keys), []).append(cells)
        return {cells: Measurements(self.provenance, rows) for cells, rows in groups.items()}

    def numbers(self, *headers: str) -> dict[str, Array]:
        """The numbers of columns [default: all], by header."""
        return {header: self.column(header) for header in headers or self.rows[0]}

    def column(self, header: str) -> Array:
        """The numbers of a column, shape (rows,)."""
        return np.array([float(row[header]) for row in self.rows], dtype=float)

    def values(self, header: str) -> list[str]:
        """The distinct cells of a column, in order of appearance."""
        return list(dict.fromkeys(row[header] for row in self.rows))

    @property
    def origin(self) -> str:
        """Day, command, machine and versions in one sentence."""
        versions = dict(self.provenance)
        day, machine, command = (versions.pop(key) for key in ("measured", "machine", "command"))
        programs = ", ".join(f"{name} {version}" for name, version in versions.items())
        return f"Measured on {day} by `{command}` on {machine}, with {programs}."


def read_measurements(name: str) -> Measurements:
    """Read `plots/data/NAME.csv`."""
    text = (files("plots") / "data" / f"{name}.csv").read_text(encoding="utf-8")
    lines = text.splitlines()
    comments = [line.removeprefix("# ") for line in lines if line.startswith("# ")]
    provenance = dict(comment.split(": ", 1) for comment in comments)
    return Measurements(provenance, list(csv.DictReader(lines[len(comments) :])))
