"""Elastic laws of a person's joints, from the rows of `data/passive_joints.toml`.

A row names a published curve as it is, points of published curves, or a rule that makes an
estimate.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from math import degrees, sinh
from typing import Any, TypeAlias

import numpy as np

from generator.springs_file.published import PublishedLaw
from generator.units import convert_to_si, parse_unit
from springs.elastic import Elastic, Range, valid_range
from springs.interpolated import Interpolated
from springs.published.reference import Reference
from springs.published.tables import coupled_law, curve, publication
from springs.smooth_limit import SmoothLimit

Row: TypeAlias = Mapping[str, Any]
"""A table of the data file."""

_DEGREE = parse_unit("deg").factor
_TORQUE_DECIMALS = 4
"""Decimals of the torques of points [N m]."""


def angle_from_degrees(value: float) -> float:
    """Angle as a springs file reads a number of degrees [rad]."""
    return convert_to_si(repr(float(value)), _DEGREE)


def _rounded_points(points: Iterable[tuple[float, float]]) -> Interpolated:
    """A curve through points of angle [deg] and torque [N m] with a few decimals."""
    return Interpolated(
        tuple(
            (angle_from_degrees(round(angle, 4)), round(torque, _TORQUE_DECIMALS) + 0.0)
            for angle, torque in points
        )
    )


@dataclass(frozen=True)
class PassiveLaw:
    """An elastic law of the sample's mean body.

    Attributes:
        law: law as a springs file holds it.
        references: publications of its numbers.
        rule: how the law follows from them, in sentences, or "".
        point_references: publication of each point, or () where all are of the first.
    """

    law: Elastic | PublishedLaw
    references: tuple[Reference, ...] = ()
    rule: str = ""
    point_references: tuple[Reference, ...] = ()

    @property
    def elastic(self) -> Elastic:
        """The law as torque on the child [N m] of the angle [rad]."""
        return self.law.law if isinstance(self.law, PublishedLaw) else self.law


@dataclass(frozen=True)
class LawContext:
    """Parts of the person to which a rule may refer.

    Attributes:
        normal_range: ends of the joint's normal range about the axis [rad].
        series: law and normal range of the joint in series about the same axis, or None.
    """

    normal_range: Range
    series: tuple[Elastic, Range] | None = None


def build_law(row: Row, context: LawContext) -> PassiveLaw:
    """Return the law of a row, whose one key among `LAW_RULES` says how it is made."""
    key = next(key for key in LAW_RULES if key in row)
    law = LAW_RULES[key](row, context)
    return replace(law, rule=" ".join(filter(None, (law.rule, _extension(law, context)))))


def _extension(law: PassiveLaw, context: LawContext) -> str:
    """Sentence on the angles of the normal range at which the curve is not known, or ""."""
    known = valid_range(law.elastic)
    if known is None:
        return ""
    (first, last), (low, high) = known, context.normal_range
    sides = [
        f"from {degrees(start):.4g} to {degrees(end):.4g} deg"
        for start, end in ((first, low), (last, high))
        if (end - start) * (1.0 if end == high else -1.0) > 1e-9
    ]
    if not sides:
        return ""
    way = "along its tangent" if isinstance(law.elastic, Interpolated) else "by its formula"
    return f"Extended {way} {' and '.join(sides)}, the end of the normal range."


def _published(row: Row, context: LawContext) -> PassiveLaw:
    del context
    law = PublishedLaw(row["published"])
    return PassiveLaw(law, (law.row.reference,), law.row.note.strip())


def _pieces(row: Row, context: LawContext) -> PassiveLaw:
    """Points of published curves, with a linear spring added but to those of the whole torque."""
    del context
    points: list[tuple[float, float]] = []
    references: list[Reference] = []
    plus = row.get("plus")
    for piece in row["pieces"]:
        source = curve(piece["published"])
        references += [source.reference] * len(piece["deg"])
        for angle in piece["deg"]:
            torque = float(source.law.torque(angle_from_degrees(angle)))
            if plus is not None and not piece.get("is_whole", False):
                torque -= plus["stiffness_Nm_rad"] * angle_from_degrees(angle - plus["rest_deg"])
            points.append((angle, torque))
    added: list[Reference] = []
    if plus is not None:
        added = [publication(plus["published"]).reference]
        added = [each for each in added if each.text not in {one.text for one in references}]
    return PassiveLaw(
        _rounded_points(points),
        tuple(dict.fromkeys([*references, *added])),
        point_references=tuple(references),
    )


def _points(row: Row, context: LawContext) -> PassiveLaw:
    del context
    points = _rounded_points(row["points_deg_Nm"])
    return PassiveLaw(points, (publication(row["source"]).reference,))


def _one_coordinate(row: Row, context: LawContext) -> PassiveLaw:
    """One coordinate of a published law of several, at constant angles of the others."""
    del context
    entry = row["held"]
    source = coupled_law(entry["published"])
    angles = {name: angle_from_degrees(angle) for name, angle in entry["deg"].items()}
    law = source.law.single_angle_law(entry["coordinate"], angles)
    law = replace(law, terms=tuple(term for term in law.terms if term.amplitude))
    return PassiveLaw(law, (source.reference,), source.note.strip())


def _wall(row: Row, context: LawContext) -> PassiveLaw:
    """A published wall that begins at some distance before the ends of the normal range."""
    wall = row["wall"]
    source, before = curve(wall["published"]), angle_from_degrees(wall["before_end_deg"])
    law, (low, high) = source.law, context.normal_range
    if not isinstance(law, SmoothLimit):
        raise TypeError(f"`{wall['published']}` has no limits")
    lower, upper = (
        angle_from_degrees(round(degrees(end), 4)) for end in (low + before, high - before)
    )
    placed = replace(law, lower=lower, upper=upper, valid_range=None)
    return PassiveLaw(
        placed,
        (source.reference,),
        f"The walls of `{wall['published']}` are placed {wall['before_end_deg']:g} deg before both "
        "ends of the normal range, where all walls of that publication begin: an estimate.",
    )


def _series(row: Row, context: LawContext) -> PassiveLaw:
    """The law of the joint in series, stretched to the own normal range."""
    assert context.series is not None
    law, (series_low, series_high) = context.series
    low, high = context.normal_range
    if not isinstance(law, Interpolated):
        raise TypeError("only a curve through points can be stretched")
    points = [
        (degrees(angle) * (high / series_high if angle > 0.0 else low / series_low), torque)
        for angle, torque in law.points
    ]
    return PassiveLaw(
        _rounded_points(points),
        (),
        f"It bends in series with the {row['in_series_with']}: at the same torque it is at the "
        f"same fraction of its normal range, {degrees(low):.4g} to {degrees(high):.4g} deg.",
    )


_GROWING_FRACTIONS = (0.25, 0.5, 0.75, 1.0)
"""Fractions of the normal range at which a growing law has points."""


def _growing(row: Row, context: LawContext) -> PassiveLaw:
    """A torque that grows as a hyperbolic sine up to the ends of the normal range."""
    growing, (low, high) = row["growing"], context.normal_range
    end, growth = growing["end_torque_Nm"], growing["growth"]
    sides = [
        (fraction * degrees(angle), sense * end * sinh(growth * fraction) / sinh(growth))
        for angle, sense in ((low, 1.0), (high, -1.0))
        for fraction in _GROWING_FRACTIONS
    ]
    return PassiveLaw(
        _rounded_points(sorted([*sides, (0.0, 0.0)])),
        (),
        f"The torque grows as sinh({growth:g} a / end) to {end:g} N m at the ends of the normal "
        "range: an estimate.",
    )


LAW_RULES: Mapping[str, Callable[[Row, LawContext], PassiveLaw]] = {
    "published": _published,
    "pieces": _pieces,
    "points_deg_Nm": _points,
    "held": _one_coordinate,
    "wall": _wall,
    "in_series_with": _series,
    "growing": _growing,
}
"""The rules by the key that stands for them in a row."""


def rest_stiffness(law: Elastic, normal_range: Range) -> float:
    """Stiffness at rest within the normal range [N m/rad], in the middle of a dead zone.

    Without a rest in the range it is the stiffness at the end nearest to one.
    """
    angles = np.linspace(*normal_range, 2001)
    torques = np.asarray(law.torque(angles))
    smallest = np.abs(torques).min()
    falls = np.flatnonzero((torques[:-1] > 0.0) & (torques[1:] < 0.0))
    if len(falls):
        rest = float(angles[falls[0]])
    else:
        near = np.flatnonzero(np.abs(torques) <= smallest + 1e-9 * np.abs(torques).max())
        rest = float(angles[near[len(near) // 2]])
    step = 1e-4
    rise = float(law.torque(rest + step)) - float(law.torque(rest - step))
    return max(0.0, -rise / (2.0 * step))
