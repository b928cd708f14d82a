"""Published curves as they are drawn beside a simulated one.

Tables that were measured elsewhere and are drawn here: `plots/data/NAME.csv`.

Plates that run nothing of their own draw these: other engines, and a machine's clock. The files
begin with comments that tell the command, the day, the machine and the versions.
"""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from math import inf, isinf, radians

import numpy as np

from springs.backends import Array
from springs.elastic import Elastic, Range, describe_extrapolation
from springs.interpolated import Interpolated
from springs.published import tables as published
from springs.published.reference import Reference

YOON_MANSOUR = (
    "Y. S. Yoon & J. M. Mansour, The Passive Elastic Moment at the Hip, J. Biomech. "
    "15:905-910, 1982 (the thesis's source; its data are not public)"
)

_ALL_ANGLES: Range = (-inf, inf)


@dataclass(frozen=True)
class Literature:
    """A curve of the literature, in the senses of our angle and of the torque on the child.

    Attributes:
        label: in the legend, without its reference.
        pieces: laws, each with the range for which it is given [rad]; of those that overlap the
            first counts.
        valid_range: range in which the curve may be used [rad], or None where that is not known.
        reference: where it is from.
        held_text: angles of other joints while it was measured, in words, or "".
        note: what a reader of the picture should know, or "".
        is_line: whether anything is known between its points, where it has some.
    """

    label: str
    pieces: tuple[tuple[Elastic, Range], ...]
    valid_range: Range | None
    reference: Reference
    held_text: str = ""
    note: str = ""
    is_line: bool = True

    def torque(self, angles: Array) -> Array:
        """Torque on the child [N m] at angles [rad]; nan where the curve is not given."""
        result = np.full_like(angles, np.nan)
        for law, (low, high) in reversed(self.pieces):
            inside = (angles >= low) & (angles <= high)
            result[inside] = law.torque(angles[inside])
        return result

    def torque_at(self, angle: float) -> float:
        """Torque on the child [N m] at one angle [rad]."""
        return float(self.torque(np.array([angle]))[0])

    @property
    def points(self) -> tuple[Array, Array] | None:
        """Angles [rad] and torques [N m] of a digitised curve; None for a formula."""
        law = self.pieces[0][0]
        if not isinstance(law, Interpolated):
            return None
        angles, torques = np.array(law.points).T
        return angles, torques

    @property
    def is_digitised(self) -> bool:
        """Whether it is a line through points."""
        return isinstance(self.pieces[0][0], Interpolated)

    def extrapolation_note(self, low: float, high: float) -> str:
        """What to say of the curve where it is drawn from `low` to `high` [rad], or ""."""
        first = min(piece[1][0] for piece in self.pieces)
        last = max(piece[1][1] for piece in self.pieces)
        return describe_extrapolation(self.valid_range, max(low, first), min(high, last))


def literature_from_points(
    points: tuple[tuple[float, float], ...], label: str, reference: Reference, note: str = ""
) -> Literature:
    """Single points (angle [rad], torque on the child [N m]), increasing, and no line."""
    table = Interpolated(points)
    return Literature(
        label, ((table, _ALL_ANGLES),), table.valid_range, reference, "", note, is_line=False
    )


def published_curve(key: str, label: str, note: str = "") -> Literature:
    """The curve `publication/name`; one that is given for one side of zero ends there."""
    curve = published.curve(key)
    given = _ALL_ANGLES if curve.valid_range is None else curve.valid_range
    half = isinf(given[0]) or isinf(given[1])
    held = ", ".join(
        f"{name} at {np.degrees(at):.4g} deg" for name, at in curve.held_angles.items()
    )
    return Literature(
        label,
        ((curve.law, given if half else _ALL_ANGLES),),
        None if half else curve.valid_range,
        curve.reference,
        held,
        note,
    )


def join_curves(*curves: Literature) -> Literature:
    """Curves of one publication for different ranges of one angle, as one; the first names it."""
    first = curves[0]
    pieces = tuple(piece for part in curves for piece in part.pieces)
    return replace(first, pieces=pieces)


def mirror_to_both_sides(half: Literature) -> Literature:
    """A curve given for positive angles, with its mirror image for negative ones."""
    mirrored = tuple((law.mirrored(), (-high, -low)) for law, (low, high) in half.pieces)
    pieces = (*half.pieces, *mirrored)
    return replace(half, pieces=pieces)


def single_angle_curve(
    key: str, motion: str, held_deg: Mapping[str, float], label: str, note: str = ""
) -> Literature:
    """One coordinate of the law of several joints `publication/name`, the others held.

    Args:
        key: of the law.
        motion: the coordinate, as "hip flexion".
        held_deg: the other coordinates [deg].
        label: in the legend.
        note: as in `Literature`.
    """
    row = published.coupled_law(key)
    law = row.law.single_angle_law(
        motion, {name: radians(angle) for name, angle in held_deg.items()}
    )
    held = ", ".join(f"{name.split()[0]} at {angle:g} deg" for name, angle in held_deg.items())
    return Literature(label, ((law, _ALL_ANGLES),), law.valid_range, row.reference, held, note)


TableRow = Mapping[str, str]


@dataclass(frozen=True)
class Measurements:
    """A table as it was written.

    Attributes:
        provenance: what the comments tell, by key.
        rows: by header; all cells as text.
    """

    provenance: Mapping[str, str]
    rows: Sequence[TableRow]

    def select_rows(self, **cells: str) -> "Measurements":
        """The rows with these cells."""
        kept = [row for row in self.rows if all(row[key] == cells[key] for key in cells)]
        return Measurements(self.provenance, kept)

    def column(self, header: str) -> Array:
        """The numbers of a column, shape (rows,)."""
        return np.array([float(row[header]) for row in self.rows], dtype=float)

    def values(self, header: str) -> list[str]:
        """The different cells of a column, in order of appearance."""
        return list(dict.fromkeys(row[header] for row in self.rows))

    @property
    def origin(self) -> str:
        """When, on what, and by which command, in one sentence."""
        made = dict(self.provenance)
        day, machine, command = (made.pop(key) for key in ("measured", "machine", "command"))
        versions = ", ".join(f"{name} {version}" for name, version in made.items())
        return f"Measured on {day} by `{command}` on {machine}, with {versions}."


def read_measurements(name: str) -> Measurements:
    """Read `plots/data/NAME.csv`."""
    text = (files("plots") / "data" / f"{name}.csv").read_text(encoding="utf-8")
    lines = text.splitlines()
    comments = [line.removeprefix("# ") for line in lines if line.startswith("# ")]
    told = dict(comment.split(": ", 1) for comment in comments)
    return Measurements(told, list(csv.DictReader(lines[len(comments) :])))
