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

from generator.diagnostics import shorten, spelling_hint
from generator.springs_file.toml_table import Pair, TableReader
from springs.damping import DEFAULT_SLIP_RATE
from springs.elastic import Elastic, valid_range
from springs.exponential import Exponential, ExponentialTerm
from springs.hysteresis import Hysteresis
from springs.interpolated import Interpolated
from springs.published.rows import PublishedCurve
from springs.published.tables import curve, publication, publications
from springs.smooth_limit import SmoothLimit
from springs.transformed import Transformed

MAX_LAW_VALUE = 1e100
"""Torque [N m] and energy [J] beyond which squares and products would leave the numbers."""

_TEST_ANGLES = np.radians(np.linspace(-200.0, 200.0, 401))
"""Angles that a joint may reach, and more [rad]."""


def apply_modifiers(
    law: Elastic, scale: float, offset: float, hysteresis: float, slip_rate: float
) -> Elastic:
    """The law with its torque scaled, moved, and then split by the direction.

    Args:
        law: as it is written.
        scale: factor of its torque.
        offset: how far it is moved towards greater angles [rad].
        hysteresis: distance of the curves of a growing and a falling angle [N m].
        slip_rate: rate at which the direction is told [rad/s].
    """
    if isinstance(law, Hysteresis):
        up, down = (
            _scale_and_shift(one, scale, offset) for one in (law.increasing, law.decreasing)
        )
        return Hysteresis(up, down, slip_rate)
    moved = _scale_and_shift(law, scale, offset)
    return Hysteresis.from_mean_and_width(moved, hysteresis, slip_rate) if hysteresis else moved


def _scale_and_shift(law: Elastic, scale: float, offset: float) -> Elastic:
    return law if (scale, offset) == (1.0, 0.0) else Transformed(law, scale, offset)


def is_finite(law: Elastic) -> bool:
    """Whether torque and energy of a law can be calculated with wherever a joint may turn."""
    curves = (law.increasing, law.decreasing) if isinstance(law, Hysteresis) else (law,)
    places = np.unique([*_TEST_ANGLES, *law.breakpoints])
    try:
        with np.errstate(all="ignore"):
            values = [np.asarray(f(places)) for one in curves for f in (one.torque, one.energy)]
    except ValueError:  # slopes between points that are not finite
        return False
    return all(bool(np.all(np.abs(value) < MAX_LAW_VALUE)) for value in values)


PUBLISHED_KEY = "published"

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
    def row(self) -> PublishedCurve:
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
        known, ends = self.row.valid_range, ""
        if known is not None and valid_range(self.row.law) is None:
            words = "Measured" if self.row.range_is_measured else "Usable"
            low, high = (f"{degrees(end):.4g}" for end in known)
            ends = f"{words} for its own angles from {low} deg to {high} deg."
            ends = ends.replace(" from -inf deg", "").replace(" to inf deg", " on")
        return " ".join(part for part in (said, ends, self.row.note.strip()) if part)

    def motion_name(self, joints: Iterable[str]) -> str:
        """Name of a positive angle of these joints: "flexion" of "knee flexion" at knees."""
        if self.sense < 0:
            return ""
        first, _, rest = self.row.motion.partition(" ")
        words = [joint.lower().split("_") for joint in joints]
        return rest if rest and all(first in each for each in words) else self.row.motion


def parse_published_law(table: TableReader) -> PublishedLaw | None:
    """The curve that a table names; None without one, or with a fault noted."""
    sense = table.sign("published_sense", _SENSE_HINT)
    name = parse_published_key(table, PUBLISHED_KEY, "curve")
    return None if name is None else PublishedLaw(name, sense or 1)


def parse_published_key(table: TableReader, key: str, kind: str) -> str | None:
    """The row `publication/name` of a kind ("curve" or "coupled law"); None as above."""
    said = table.text(key)
    if said is None:
        return None
    source, _, name = said.partition("/")
    known = publications()
    if source not in known:
        wanted = f"there is no published table `{shorten(source)}`"
        table.error(key, wanted, spelling_hint(source, known))
        return None
    rows = publication(source).curves if kind == "curve" else publication(source).coupled_laws
    if name in rows:
        return said
    missing = f"`{source}` has no {kind} `{shorten(name)}`" if name else f"`{source}` is a table"
    hint = spelling_hint(name, rows) if rows else f"it has no {kind} at all"
    if not name and rows:
        hint = f"name one of its rows, as in `{source}/{next(iter(rows))}`"
    table.error(key, missing, hint)
    return None


StandaloneLaw: TypeAlias = Exponential | Interpolated | SmoothLimit | Hysteresis | PublishedLaw
"""A law that stands whole in its table; a cubic and a linear spring need their joint as well."""

EXPONENTIALS_KEY, POINTS_KEY = "exponentials_Nm_1_rad", "points_deg_Nm"
LIMITS_KEY, LIMIT_STIFFNESS_KEY, TRANSITION_KEY = (
    "limits_deg",
    "limit_stiffness_Nm_rad",
    "transition_deg",
)
INCREASING_KEY, DECREASING_KEY = "increasing_points_deg_Nm", "decreasing_points_deg_Nm"
MEASURED_KEY, HYSTERESIS_KEY, SLIP_RATE_KEY = "measured_deg", "hysteresis_Nm", "slip_rad_s"

MODIFIER_KEYS = ("scale", "offset_deg", HYSTERESIS_KEY)
"""Keys that change any elastic law."""

_CURVE_ORDER_TOLERANCE = 1e-9
"""What rounding may do to the order of two curves [N m]."""


@dataclass(frozen=True)
class _LawForm:
    """One law: what it is called, the keys that make it, all of them needed, and those beside."""

    name: str
    required_keys: tuple[str, ...]
    optional_keys: tuple[str, ...] = ()


_LAW_FORMS = (
    _LawForm("a cubic", ("coefficients_Nm_rad",), ("sense", "dead_zone_deg", "rest_deg")),
    _LawForm("a linear spring", ("stiffness_Nm_rad",), ("rest_deg",)),
    _LawForm("exponentials", (EXPONENTIALS_KEY,), ("constant_Nm", MEASURED_KEY)),
    _LawForm("a curve through points", (POINTS_KEY,)),
    _LawForm("limits", (LIMITS_KEY, LIMIT_STIFFNESS_KEY, TRANSITION_KEY), (MEASURED_KEY,)),
    _LawForm("two curves", (INCREASING_KEY, DECREASING_KEY)),
    _LawForm("a published curve", (PUBLISHED_KEY,), ("published_sense",)),
)

ELASTIC_KEYS = tuple(form.required_keys[0] for form in _LAW_FORMS)
"""For each law the key that is named when there is none."""

_FORM_KEYS = tuple(key for form in _LAW_FORMS for key in (*form.required_keys, *form.optional_keys))
LAW_KEYS = tuple(dict.fromkeys((*_FORM_KEYS, *MODIFIER_KEYS, SLIP_RATE_KEY)))


def check_combination(table: TableReader, sufficient_keys: tuple[str, ...]) -> None:
    """A table says something, one law at most, and nothing that its law does not take.

    Args:
        table: of a spring.
        sufficient_keys: keys that are enough without an elastic law.
    """
    content = table.content
    present = [form for form in _LAW_FORMS if any(key in content for key in form.required_keys)]
    if not present and not any(key in content for key in sufficient_keys):
        known = (*ELASTIC_KEYS, *sufficient_keys)
        table.diagnostics.error(
            "this spring has no law", table.header_span, f"it needs one of: {', '.join(known)}"
        )
    for form in present:
        first = next(key for key in form.required_keys if key in content)
        for key in form.required_keys:
            if key not in content:
                table.error(first, f"`{first}` needs `{key}` beside it", f"{form.name} has both")
    for form in present[1:]:
        key = next(key for key in form.required_keys if key in content)
        table.error(
            key,
            f"a spring is {present[0].name} or {form.name}, not both",
            "one elastic law a table",
        )
    for key, owner, hint in _misplaced_keys(table, present):
        table.error(key, f"`{key}` belongs to {owner}", hint)


def _misplaced_keys(table: TableReader, present: list[_LawForm]) -> Iterator[tuple[str, str, str]]:
    """Keys that stand beside no law which takes them; what they belong to; a hint."""
    content = table.content
    for key in dict.fromkeys(key for form in _LAW_FORMS for key in form.optional_keys):
        owners = [form for form in _LAW_FORMS if key in form.optional_keys]
        if key in content and not any(form in present for form in owners):
            hint = " or ".join(f"`{form.required_keys[0]}`" for form in owners)
            yield key, " or ".join(form.name for form in owners), f"with {hint}"
    for key in MODIFIER_KEYS:
        if key in content and not present:
            yield key, "an elastic law", f"with one of: {', '.join(ELASTIC_KEYS)}"
    has_two = any(INCREASING_KEY in form.required_keys for form in present)
    if HYSTERESIS_KEY in content and has_two:
        yield (
            HYSTERESIS_KEY,
            "a law of one curve",
            "two curves say by themselves how far apart they are",
        )
    if SLIP_RATE_KEY in content and HYSTERESIS_KEY not in content and not has_two:
        hint = f"with `{HYSTERESIS_KEY}`, or with `{INCREASING_KEY}` and `{DECREASING_KEY}`"
        yield SLIP_RATE_KEY, "a law that depends on the direction", hint


def parse_law(table: TableReader) -> StandaloneLaw | None:
    """The law that a table writes; None without one, or with a fault noted."""
    measured = table.interval(MEASURED_KEY)
    read = (
        _parse_exponentials(table, measured),
        _parse_points(table, POINTS_KEY),
        _parse_limits(table, measured),
        _parse_two_curves(table),
        parse_published_law(table),
    )
    return next((law for law in read if law is not None), None)


def parse_slip_rate(table: TableReader) -> float:
    """`slip_rad_s`, or what stands for it [rad/s]."""
    hint = "it is the rate at which the direction is told, such as 0.01"
    return table.number(SLIP_RATE_KEY, negative=False, zero=False, hint=hint) or DEFAULT_SLIP_RATE


def _parse_exponentials(table: TableReader, measured: Pair | None) -> Exponential | None:
    """`exponentials_Nm_1_rad` and `constant_Nm`."""
    pairs, constant = table.pairs(EXPONENTIALS_KEY, 1), table.number("constant_Nm")
    flat = [k for k, (_, rate) in enumerate(pairs) if rate == 0.0]
    for k in flat:
        hint = "an exponential of rate zero is a constant: `constant_Nm`"
        table.error(EXPONENTIALS_KEY, "the rate of an exponential must not be zero", hint, k, 1)
    if not pairs or flat:
        return None
    terms = tuple(ExponentialTerm(amplitude, rate) for amplitude, rate in pairs)
    return Exponential(terms, constant or 0.0, measured)


def _parse_points(table: TableReader, key: str) -> Interpolated | None:
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
    law = Interpolated(points)
    if not is_finite(law):
        table.error(key, "this curve is too steep for numbers", "are its angles in deg?")
        return None
    return law


def _parse_limits(table: TableReader, measured: Pair | None) -> SmoothLimit | None:
    """`limits_deg`, `limit_stiffness_Nm_rad` and `transition_deg`."""
    limits, stiffness = table.interval(LIMITS_KEY), table.numbers(LIMIT_STIFFNESS_KEY, 2)
    above = "the angle over which the limit grows to its full stiffness"
    transition = table.number(TRANSITION_KEY, negative=False, zero=False, hint=above)
    for k, value in enumerate(stiffness or ()):
        if value < 0.0:
            table.error(LIMIT_STIFFNESS_KEY, "a limit's stiffness must not be below zero", "", k)
            stiffness = None
    if limits is None or stiffness is None or transition is None:
        return None
    return SmoothLimit(*limits, *cast("Pair", stiffness), transition, measured)


def _parse_two_curves(table: TableReader) -> Hysteresis | None:
    """`increasing_points_deg_Nm` and `decreasing_points_deg_Nm`, in the order that loses energy."""
    up, down = _parse_points(table, INCREASING_KEY), _parse_points(table, DECREASING_KEY)
    if up is None or down is None:
        return None
    law = Hysteresis(up, down)
    low, high = law.valid_range or (0.0, 0.0)
    if low >= high:
        hint = "they are compared where both are known"
        table.error(DECREASING_KEY, "the two curves have no stretch of angles in common", hint)
        return None
    angles = np.unique(
        [*np.linspace(low, high, 181), *(c for c in law.breakpoints if low < c < high)]
    )
    excess = np.asarray(up.torque(angles)) - np.asarray(down.torque(angles))
    worst = int(excess.argmax())
    if excess[worst] > _CURVE_ORDER_TOLERANCE * (
        1.0 + float(np.abs(np.asarray(up.torque(angles))).max())
    ):
        where = f"at {degrees(angles[worst]):.4g} deg by {excess[worst]:.3g} N m"
        table.error(
            INCREASING_KEY,
            f"the curve of the growing angle lies above that of the falling one, {where}: "
            "a cycle there would feed energy",
            "the torques act on the child, and friction opposes motion; are the two exchanged?",
        )
        return None
    return law
