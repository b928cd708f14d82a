"""The elastic laws of a springs file: which keys belong to which, and what they mean.

A table has one law. Some keys make a law, some stand beside the keys of one law, and some change
any law.

What `scale`, `offset_deg` and `hysteresis_Nm` make of a law.

`published = "publication/name"`: a curve of the published tables hung on an axis.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import degrees
from typing import TypeAlias, cast

import numpy as np

from generator.diagnostics import nearest, shorten
from generator.springs_file.toml_table import Pair, TableReader
from springs.damping import SLIP
from springs.elastic import Elastic, measured_range
from springs.exponential import Exponential, Term
from springs.hysteresis import Directional
from springs.interpolated import Table
from springs.published.rows import Curve
from springs.published.tables import curve, publication, publications
from springs.smooth_limit import SmoothLimit
from springs.transformed import Scaled

LARGEST = 1e100
"""Torque [N m] and energy [J] beyond which squares and products would leave the numbers."""

_FARTHEST = np.radians(np.linspace(-200.0, 200.0, 401))
"""Angles that a joint may reach, and more [rad]."""


def changed_law(
    law: Elastic, scale: float, offset: float, hysteresis: float, slip: float
) -> Elastic:
    """The law with its torque scaled, moved, and then split by the direction.

    Args:
        law: as it is written.
        scale: factor of its torque.
        offset: how far it is moved towards greater angles [rad].
        hysteresis: distance of the curves of a growing and a falling angle [N m].
        slip: rate at which the direction is told [rad/s].
    """
    if isinstance(law, Directional):
        up, down = (_moved(one, scale, offset) for one in (law.increasing, law.decreasing))
        return Directional(up, down, slip)
    moved = _moved(law, scale, offset)
    return Directional.around(moved, hysteresis, slip) if hysteresis else moved


def _moved(law: Elastic, scale: float, offset: float) -> Elastic:
    return law if (scale, offset) == (1.0, 0.0) else Scaled(law, scale, offset)


def is_finite(law: Elastic) -> bool:
    """Whether torque and energy of a law can be calculated with wherever a joint may turn."""
    curves = (law.increasing, law.decreasing) if isinstance(law, Directional) else (law,)
    places = np.unique([*_FARTHEST, *law.corners])
    try:
        with np.errstate(all="ignore"):
            values = [np.asarray(f(places)) for one in curves for f in (one.torque, one.energy)]
    except ValueError:  # slopes between points that are not finite
        return False
    return all(bool(np.all(np.abs(value) < LARGEST)) for value in values)


PUBLISHED = "published"

_SENSE_HINT = "-1: the axis's positive angle is against the published motion"


@dataclass(frozen=True)
class PublishedLaw:
    """A published curve about an axis.

    Attributes:
        key: `publication/name`.
        sense: -1 where the axis's positive angle is against the published motion.
    """

    key: str
    sense: int = 1

    @cached_property
    def row(self) -> Curve:
        """The curve as published."""
        return curve(self.key)

    @property
    def law(self) -> Elastic:
        """Torque on the child [N m] of the axis's angle [rad]."""
        return self.row.law if self.sense > 0 else self.row.law.mirrored()

    @property
    def why(self) -> str:
        """What a reader of the file should know of the curve."""
        held = [f"{name} at {degrees(angle):.4g} deg" for name, angle in self.row.held.items()]
        said = f"As published, with {' and '.join(held)}." if held else "As published."
        known, ends = self.row.measured, ""
        if known is not None and measured_range(self.row.law) is None:
            words = "Measured" if self.row.range_is_measured else "Usable"
            low, high = (f"{degrees(end):.4g}" for end in known)
            ends = f"{words} for its own angles from {low} deg to {high} deg."
            ends = ends.replace(" from -inf deg", "").replace(" to inf deg", " on")
        return " ".join(part for part in (said, ends, self.row.note.strip()) if part)

    def motion_at(self, joints: Iterable[str]) -> str:
        """Name of a positive angle of these joints: "flexion" of "knee flexion" at knees."""
        if self.sense < 0:
            return ""
        first, _, rest = self.row.motion.partition(" ")
        words = [joint.lower().split("_") for joint in joints]
        return rest if rest and all(first in each for each in words) else self.row.motion


def published_law(table: TableReader) -> PublishedLaw | None:
    """The curve that a table names; None without one, or with a fault noted."""
    sense = table.sign("published_sense", _SENSE_HINT)
    name = published_name(table, PUBLISHED, "curve")
    return None if name is None else PublishedLaw(name, sense or 1)


def published_name(table: TableReader, key: str, kind: str) -> str | None:
    """The row `publication/name` of a kind ("curve" or "coupled law"); None as above."""
    said = table.text(key)
    if said is None:
        return None
    source, _, name = said.partition("/")
    known = publications()
    if source not in known:
        wanted = f"there is no published table `{shorten(source)}`"
        table.error(key, wanted, nearest(source, known))
        return None
    rows = publication(source).curves if kind == "curve" else publication(source).coupled
    if name in rows:
        return said
    missing = f"`{source}` has no {kind} `{shorten(name)}`" if name else f"`{source}` is a table"
    hint = nearest(name, rows) if rows else f"it has no {kind} at all"
    if not name and rows:
        hint = f"name one of its rows, as in `{source}/{next(iter(rows))}`"
    table.error(key, missing, hint)
    return None


Written: TypeAlias = Exponential | Table | SmoothLimit | Directional | PublishedLaw
"""A law that stands whole in its table; a cubic and a linear spring need their joint as well."""

EXPONENTIALS, POINTS = "exponentials_Nm_1_rad", "points_deg_Nm"
LIMITS, LIMIT_STIFFNESS, TRANSITION = "limits_deg", "limit_stiffness_Nm_rad", "transition_deg"
INCREASING, DECREASING = "increasing_points_deg_Nm", "decreasing_points_deg_Nm"
MEASURED, HYSTERESIS, SLIP_RATE = "measured_deg", "hysteresis_Nm", "slip_rad_s"

ANY_LAW = ("scale", "offset_deg", HYSTERESIS)
"""Keys that change any elastic law."""

_SAME = 1e-9
"""What rounding may do to the order of two curves [N m]."""


@dataclass(frozen=True)
class _Form:
    """One law: what it is called, the keys that make it, all of them needed, and those beside."""

    name: str
    made_by: tuple[str, ...]
    beside: tuple[str, ...] = ()


_FORMS = (
    _Form("a cubic", ("coefficients_Nm_rad",), ("sense", "dead_zone_deg", "rest_deg")),
    _Form("a linear spring", ("stiffness_Nm_rad",), ("rest_deg",)),
    _Form("exponentials", (EXPONENTIALS,), ("constant_Nm", MEASURED)),
    _Form("a curve through points", (POINTS,)),
    _Form("limits", (LIMITS, LIMIT_STIFFNESS, TRANSITION), (MEASURED,)),
    _Form("two curves", (INCREASING, DECREASING)),
    _Form("a published curve", (PUBLISHED,), ("published_sense",)),
)

ELASTIC_KEYS = tuple(form.made_by[0] for form in _FORMS)
"""For each law the key that is named when there is none."""

_KEYS = tuple(key for form in _FORMS for key in (*form.made_by, *form.beside))
LAW_KEYS = tuple(dict.fromkeys((*_KEYS, *ANY_LAW, SLIP_RATE)))


def check_combination(table: TableReader, otherwise: tuple[str, ...]) -> None:
    """A table says something, one law at most, and nothing that its law does not take.

    Args:
        table: of a spring.
        otherwise: keys that are enough without an elastic law.
    """
    content = table.content
    present = [form for form in _FORMS if any(key in content for key in form.made_by)]
    if not present and not any(key in content for key in otherwise):
        known = (*ELASTIC_KEYS, *otherwise)
        table.findings.error(
            "this spring has no law", table.header, f"it needs one of: {', '.join(known)}"
        )
    for form in present:
        first = next(key for key in form.made_by if key in content)
        for key in form.made_by:
            if key not in content:
                table.error(first, f"`{first}` needs `{key}` beside it", f"{form.name} has both")
    for form in present[1:]:
        key = next(key for key in form.made_by if key in content)
        table.error(
            key,
            f"a spring is {present[0].name} or {form.name}, not both",
            "one elastic law a table",
        )
    for key, owner, hint in _misplaced(table, present):
        table.error(key, f"`{key}` belongs to {owner}", hint)


def _misplaced(table: TableReader, present: list[_Form]) -> Iterator[tuple[str, str, str]]:
    """Keys that stand beside no law which takes them; what they belong to; a hint."""
    content = table.content
    for key in dict.fromkeys(key for form in _FORMS for key in form.beside):
        owners = [form for form in _FORMS if key in form.beside]
        if key in content and not any(form in present for form in owners):
            hint = " or ".join(f"`{form.made_by[0]}`" for form in owners)
            yield key, " or ".join(form.name for form in owners), f"with {hint}"
    for key in ANY_LAW:
        if key in content and not present:
            yield key, "an elastic law", f"with one of: {', '.join(ELASTIC_KEYS)}"
    has_two = any(INCREASING in form.made_by for form in present)
    if HYSTERESIS in content and has_two:
        yield (
            HYSTERESIS,
            "a law of one curve",
            "two curves say by themselves how far apart they are",
        )
    if SLIP_RATE in content and HYSTERESIS not in content and not has_two:
        hint = f"with `{HYSTERESIS}`, or with `{INCREASING}` and `{DECREASING}`"
        yield SLIP_RATE, "a law that depends on the direction", hint


def written_law(table: TableReader) -> Written | None:
    """The law that a table writes; None without one, or with a fault noted."""
    measured = table.interval(MEASURED)
    read = (
        _exponentials(table, measured),
        _points(table, POINTS),
        _limits(table, measured),
        _two_curves(table),
        published_law(table),
    )
    return next((law for law in read if law is not None), None)


def slip_rate(table: TableReader) -> float:
    """`slip_rad_s`, or what stands for it [rad/s]."""
    hint = "it is the rate at which the direction is told, such as 0.01"
    return table.number(SLIP_RATE, negative=False, zero=False, hint=hint) or SLIP


def _exponentials(table: TableReader, measured: Pair | None) -> Exponential | None:
    """`exponentials_Nm_1_rad` and `constant_Nm`."""
    pairs, constant = table.pairs(EXPONENTIALS, 1), table.number("constant_Nm")
    flat = [k for k, (_, rate) in enumerate(pairs) if rate == 0.0]
    for k in flat:
        hint = "an exponential of rate zero is a constant: `constant_Nm`"
        table.error(EXPONENTIALS, "the rate of an exponential must not be zero", hint, k, 1)
    if not pairs or flat:
        return None
    terms = tuple(Term(amplitude, rate) for amplitude, rate in pairs)
    return Exponential(terms, constant or 0.0, measured)


def _points(table: TableReader, key: str) -> Table | None:
    """A curve through points."""
    points, units = table.pairs(key, 2, ("deg", "Nm")), "their angles increase: [[deg, N m], ...]"
    wrong = False
    for k, (before, after) in enumerate(pairwise(points), start=1):
        if after[0] <= before[0]:
            wrong = True
            said = f"{degrees(after[0]):.6g} deg comes after {degrees(before[0]):.6g} deg"
            table.error(key, f"the points of a curve are not in order: {said}", units, k)
    if not points or wrong:
        return None
    law = Table(points)
    if not is_finite(law):
        table.error(key, "this curve is too steep for numbers", "are its angles in deg?")
        return None
    return law


def _limits(table: TableReader, measured: Pair | None) -> SmoothLimit | None:
    """`limits_deg`, `limit_stiffness_Nm_rad` and `transition_deg`."""
    limits, stiffness = table.interval(LIMITS), table.numbers(LIMIT_STIFFNESS, 2)
    above = "the angle over which the limit grows to its full stiffness"
    transition = table.number(TRANSITION, negative=False, zero=False, hint=above)
    for k, value in enumerate(stiffness or ()):
        if value < 0.0:
            table.error(LIMIT_STIFFNESS, "a limit's stiffness must not be below zero", "", k)
            stiffness = None
    if limits is None or stiffness is None or transition is None:
        return None
    return SmoothLimit(*limits, *cast("Pair", stiffness), transition, measured)


def _two_curves(table: TableReader) -> Directional | None:
    """`increasing_points_deg_Nm` and `decreasing_points_deg_Nm`, in the order that loses energy."""
    up, down = _points(table, INCREASING), _points(table, DECREASING)
    if up is None or down is None:
        return None
    law = Directional(up, down)
    low, high = law.measured or (0.0, 0.0)
    if low >= high:
        hint = "they are compared where both are known"
        table.error(DECREASING, "the two curves have no stretch of angles in common", hint)
        return None
    angles = np.unique([*np.linspace(low, high, 181), *(c for c in law.corners if low < c < high)])
    excess = np.asarray(up.torque(angles)) - np.asarray(down.torque(angles))
    worst = int(excess.argmax())
    if excess[worst] > _SAME * (1.0 + float(np.abs(np.asarray(up.torque(angles))).max())):
        where = f"at {degrees(angles[worst]):.4g} deg by {excess[worst]:.3g} N m"
        table.error(
            INCREASING,
            f"the curve of the growing angle lies above that of the falling one, {where}: "
            "a cycle there would feed energy",
            "the torques act on the child, and friction opposes motion; are the two exchanged?",
        )
        return None
    return law
