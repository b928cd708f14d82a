"""The elastic laws of a springs file, one row a law.

A row of `LAWS` says how a law is read from a table, written to one, described in a line and given
to `--json`. A new law is a module in `springs/` and a row here. Some keys make a law, some stand
beside the keys of one law, and some (`scale`, `offset_deg`, `hysteresis_Nm`) change any law.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import degrees, isfinite
from typing import Any, Generic, TypeAlias, TypeVar, cast

import numpy as np

from generator.springs_file.published import (
    PUBLISHED_KEY,
    PublishedLaw,
    parse_published_law,
    write_published_law,
)
from generator.toml_file.reader import Pair, TableReader
from generator.toml_file.writer import (
    degree_to_toml,
    degrees_to_toml,
    number_to_toml,
    numbers_to_toml,
    pairs_to_toml,
    quote_toml,
)
from generator.units import ROTATION_UNITS, AxisUnits
from springs.cubic import Coefficients, Cubic
from springs.elastic import Elastic, Range
from springs.exponential import Exponential, ExponentialTerm
from springs.hysteresis import Hysteresis
from springs.interpolated import Interpolated
from springs.linear import Linear
from springs.smooth_limit import SmoothLimit
from springs.stop import Stop
from springs.transformed import Transformed

COEFFICIENTS_KEY, STIFFNESS_KEY, REST_KEY = "coefficients_Nm_rad", "stiffness_Nm_rad", "rest_deg"
DEAD_ZONE_KEY, SENSE_KEY = "dead_zone_deg", "sense"
EXPONENTIALS_KEY, CONSTANT_KEY, POINTS_KEY = (
    "exponentials_Nm_1_rad",
    "constant_Nm",
    "points_deg_Nm",
)
LIMITS_KEY, LIMIT_STIFFNESS_KEY, TRANSITION_KEY = (
    "limits_deg",
    "limit_stiffness_Nm_rad",
    "transition_deg",
)
INCREASING_KEY, DECREASING_KEY = "increasing_points_deg_Nm", "decreasing_points_deg_Nm"
MEASURED_KEY, HYSTERESIS_KEY, SLIP_RATE_KEY = "measured_deg", "hysteresis_Nm", "slip_rad_s"

MODIFIER_KEYS = ("scale", "offset_deg", HYSTERESIS_KEY)
"""Keys that change any elastic law."""

NO_DEAD_ZONE = "none"
"""`dead_zone_deg = "none"` takes the cubic as it is, also where it has three roots."""

_CURVE_ORDER_TOLERANCE = 1e-9  # rounding in the order of two curves [N m]


@dataclass(frozen=True)
class CubicEntry:
    """A cubic as a table states it; its joint's limits may decide on its sense and dead zone.

    Attributes:
        coefficients: c0..c3 [N m, N m/rad, N m/rad^2, N m/rad^3].
        sense: sense of the cubic when the file states it.
        dead_zone: edges of the dead zone, counted from `rest` [rad].
        dead_zone_stated: whether the file says what the dead zone is, or that there is none.
        rest: displacement at which the cubic's angle is zero [rad].
    """

    coefficients: Coefficients
    sense: int | None = None
    dead_zone: Pair | None = None
    dead_zone_stated: bool = False
    rest: float = 0.0


EntryLaw: TypeAlias = Elastic | CubicEntry | PublishedLaw
"""The law of a table: complete, or to be completed by its joint or by the published tables."""

L = TypeVar("L")


@dataclass(frozen=True)
class LawForm(Generic[L]):
    """The keys of a law in a table.

    Attributes:
        name: of the law, in messages.
        entry_type: class that `parse` returns.
        required_keys: all of them are needed.
        optional_keys: may stand beside.
        parse: the law of a table; None with a fault noted.
        to_toml: lines of a table.
    """

    name: str
    entry_type: type[L]
    required_keys: tuple[str, ...]
    optional_keys: tuple[str, ...]
    parse: Callable[[TableReader], L | None]
    to_toml: Callable[[L], Iterator[str]]

    def is_present(self, table: TableReader) -> bool:
        """Return whether a table has any of the keys that make the law."""
        return any(key in table.content for key in self.required_keys)


@dataclass(frozen=True)
class LawSchema(Generic[L]):
    """One elastic law.

    Attributes:
        law: its class.
        describe: one line, with the units of its axis.
        to_json: for `--json`; angles in deg where the key says so, else rad and SI.
        form: its keys in a springs file, or None for a law that no key makes.
    """

    law: type[L]
    describe: Callable[[L, AxisUnits], str]
    to_json: Callable[[L], dict[str, object]]
    form: LawForm[Any] | None = None


def describe_law(law: Elastic, units: AxisUnits = ROTATION_UNITS) -> str:
    """Describe a law in one line; `a` is the angle in rad.

    Args:
        law: of an axis, or of a translation.
        units: of its axis.
    """
    return _SCHEMAS[type(law)].describe(law, units)


def law_data(law: Elastic) -> dict[str, object]:
    """Return a law for `--json`; angles in deg where the key says so, else rad and SI."""
    return _SCHEMAS[type(law)].to_json(law)


def write_law(law: EntryLaw) -> Iterator[str]:
    """Yield the lines of a law in a springs file.

    Raises:
        ValueError: for a law that no key holds.
    """
    form = next((form for form in LAW_FORMS if isinstance(law, form.entry_type)), None)
    if form is None:
        raise ValueError(f"a springs file has no key for {describe_law(cast('Elastic', law))}")
    yield from form.to_toml(law)


def parse_law(table: TableReader) -> EntryLaw | None:
    """Parse the law of a table, the first of several; None without one, or with a fault noted."""
    form = next((form for form in LAW_FORMS if form.is_present(table)), None)
    return None if form is None else form.parse(table)


MAX_LAW_VALUE = 1e100
"""Torque [N m] and energy [J] above which squares and products may overflow."""

_TEST_ANGLES = np.radians(np.linspace(-200.0, 200.0, 401))
"""Angles that cover the range of any joint [rad]."""


def is_finite(law: Elastic) -> bool:
    """Return whether torque and energy of a law are finite at all angles a joint may reach."""
    curves = (law.increasing, law.decreasing) if isinstance(law, Hysteresis) else (law,)
    places = np.concatenate([_TEST_ANGLES, np.array(law.breakpoints, dtype=float)])
    try:
        with np.errstate(all="ignore"):
            values = [np.asarray(f(places)) for one in curves for f in (one.torque, one.energy)]
    except ValueError:  # slopes between points that are not finite
        return False
    return all(bool(np.all(np.abs(value) < MAX_LAW_VALUE)) for value in values)


def _parse_cubic(table: TableReader) -> CubicEntry | None:
    coefficients, zone = table.numbers(COEFFICIENTS_KEY, 4), None
    if table.content.get(DEAD_ZONE_KEY) != NO_DEAD_ZONE:
        zone = table.numbers(DEAD_ZONE_KEY, 2)
    if zone is not None and zone[0] > zone[1]:
        table.error(DEAD_ZONE_KEY, "the dead zone ends before it begins", "[lower, upper]")
    sense, rest = table.sign(SENSE_KEY), table.number(REST_KEY)
    if coefficients is None:
        return None
    return CubicEntry(
        cast("Coefficients", coefficients),
        sense,
        cast("Pair | None", zone),
        DEAD_ZONE_KEY in table.content,
        rest or 0.0,
    )


def _write_cubic(law: CubicEntry) -> Iterator[str]:
    yield f"{COEFFICIENTS_KEY} = {numbers_to_toml(law.coefficients)}"
    if law.sense is not None:
        yield f"{SENSE_KEY} = {law.sense:+d}"
    if law.dead_zone is not None:
        yield f"{DEAD_ZONE_KEY} = {degrees_to_toml(law.dead_zone)}"
    elif law.dead_zone_stated:
        yield f"{DEAD_ZONE_KEY} = {quote_toml(NO_DEAD_ZONE)}"
    if law.rest:
        yield f"{REST_KEY} = {degree_to_toml(law.rest)}"


def _describe_cubic(law: Cubic, units: AxisUnits) -> str:
    c0, c1, c2, c3 = law.coefficients
    words = f"cubic {c0:g} {c1:+g} a {c2:+g} a^2 {c3:+g} a^3 N m, sense {law.sense:+d}"
    zone = "none" if law.dead_zone is None else format_range(*law.dead_zone, units)
    rest = f", rest {units.format(law.rest)}" if law.rest else ""
    return f"{words}, dead zone {zone}{rest}"


def _cubic_data(law: Cubic) -> dict[str, object]:
    return {
        "law": "cubic",
        "coefficients": list(law.coefficients),
        "sense": law.sense,
        "dead_zone_deg": range_in_degrees(law.dead_zone),
        "rest_deg": degrees(law.rest),
    }


def _parse_linear(table: TableReader) -> Linear | None:
    stiffness, rest = table.number(STIFFNESS_KEY, negative=False), table.number(REST_KEY)
    return None if stiffness is None else Linear(stiffness, rest or 0.0)


def _write_linear(law: Linear) -> Iterator[str]:
    yield f"{STIFFNESS_KEY} = {number_to_toml(law.stiffness)}"
    if law.rest:
        yield f"{REST_KEY} = {degree_to_toml(law.rest)}"


def _describe_linear(law: Linear, units: AxisUnits) -> str:
    rest = units.format(law.rest)
    return f"linear {law.stiffness:g} {units.stiffness}, rest {rest}"


def _linear_data(law: Linear) -> dict[str, object]:
    return {"law": "linear", "stiffness": law.stiffness, "rest": law.rest}


def _parse_exponentials(table: TableReader) -> Exponential | None:
    pairs, constant = table.pairs(EXPONENTIALS_KEY, 1), table.number(CONSTANT_KEY)
    measured = table.interval(MEASURED_KEY)
    flat = [k for k, (_, rate) in enumerate(pairs) if rate == 0.0]
    for k in flat:
        hint = f"an exponential of rate zero is a constant: `{CONSTANT_KEY}`"
        table.error(EXPONENTIALS_KEY, "the rate of an exponential must not be zero", hint, k, 1)
    if not pairs or flat:
        return None
    terms = tuple(ExponentialTerm(amplitude, rate) for amplitude, rate in pairs)
    return Exponential(terms, constant or 0.0, measured)


def _write_exponentials(law: Exponential) -> Iterator[str]:
    if any(term.centre for term in law.terms):
        raise ValueError("a springs file holds exponentials about the angle zero")
    pairs = [(number_to_toml(term.amplitude), number_to_toml(term.rate)) for term in law.terms]
    yield f"{EXPONENTIALS_KEY} = {pairs_to_toml(pairs)}"
    if law.constant:
        yield f"{CONSTANT_KEY} = {number_to_toml(law.constant)}"
    yield from _write_measured_range(law.valid_range)


def _write_measured_range(measured: Range | None) -> Iterator[str]:
    if measured is not None:
        yield f"{MEASURED_KEY} = {degrees_to_toml(measured)}"


def _describe_exponentials(law: Exponential, units: AxisUnits) -> str:
    del units
    terms = " ".join(map(_format_term, law.terms))
    return f"exponentials {law.constant:g} {terms} N m{_format_measured_range(law.valid_range)}"


def _format_term(term: ExponentialTerm) -> str:
    angle = f"(a {-degrees(term.centre):+.4g} deg)" if term.centre else "a"
    return f"{term.amplitude:+.4g} exp({term.rate:.4g} {angle})"


def _exponentials_data(law: Exponential) -> dict[str, object]:
    terms = [
        {"amplitude_Nm": t.amplitude, "rate_1_rad": t.rate, "centre_deg": degrees(t.centre)}
        for t in law.terms
    ]
    data: dict[str, object] = {"law": "exponentials", "terms": terms, "constant_Nm": law.constant}
    return data | {"measured_deg": range_in_degrees(law.valid_range)}


def _parse_points(table: TableReader, key: str = POINTS_KEY) -> Interpolated | None:
    """A curve through points."""
    points, units = table.pairs(key, 2, ("deg", "Nm")), "their angles increase: [[deg, N m], ...]"
    wrong = False
    for k, (before, after) in enumerate(pairwise(points), start=1):
        if after[0] <= before[0]:
            wrong = True
            order = f"{degrees(after[0]):.6g} deg comes after {degrees(before[0]):.6g} deg"
            table.error(key, f"the points of a curve are not in order: {order}", units, k)
    if not points or wrong:
        return None
    law = Interpolated(points)
    if is_finite(law):
        return law
    table.error(key, "this curve is too steep for numbers", "are its angles in deg?")
    return None


def _write_curve(law: Interpolated) -> Iterator[str]:
    yield f"{POINTS_KEY} = {_points_to_toml(law)}"


def _points_to_toml(law: Elastic) -> str:
    if not isinstance(law, Interpolated):
        raise ValueError("a springs file holds two curves through points, or one and a hysteresis")
    return pairs_to_toml(
        [(degree_to_toml(angle), number_to_toml(torque)) for angle, torque in law.points]
    )


def _describe_curve(law: Interpolated, units: AxisUnits) -> str:
    first, last = (
        f"{torque + 0.0:.4g} N m at {units.format(angle)}"
        for angle, torque in (law.points[0], law.points[-1])
    )
    return f"curve through {len(law.points)} points, {first} to {last}"


def _curve_data(law: Interpolated) -> dict[str, object]:
    points = [[degrees(angle), torque] for angle, torque in law.points]
    measured = range_in_degrees(law.valid_range)
    return {"law": "points", "points_deg_Nm": points, "measured_deg": measured}


def _parse_limits(table: TableReader) -> SmoothLimit | None:
    limits, stiffness = table.interval(LIMITS_KEY), table.numbers(LIMIT_STIFFNESS_KEY, 2)
    above = "the angle over which the limit grows to its full stiffness"
    transition = table.number(TRANSITION_KEY, negative=False, zero=False, hint=above)
    measured = table.interval(MEASURED_KEY)
    for k, value in enumerate(stiffness or ()):
        if value < 0.0:
            table.error(LIMIT_STIFFNESS_KEY, "a limit's stiffness must not be below zero", "", k)
            stiffness = None
    if limits is None or stiffness is None or transition is None:
        return None
    return SmoothLimit(*limits, *cast("Pair", stiffness), transition, measured)


def _write_limits(law: SmoothLimit) -> Iterator[str]:
    stiffness = numbers_to_toml((law.lower_stiffness, law.upper_stiffness))
    yield f"{LIMITS_KEY} = {degrees_to_toml((law.lower, law.upper))}"
    yield f"{LIMIT_STIFFNESS_KEY} = {stiffness}"
    yield f"{TRANSITION_KEY} = {degree_to_toml(law.transition)}"
    yield from _write_measured_range(law.valid_range)


def _describe_limits(law: SmoothLimit, units: AxisUnits) -> str:
    below, above = law.lower_stiffness, law.upper_stiffness
    zone = format_range(law.lower, law.upper, units)
    stiffness = f"{below:.4g} and {above:.4g} {units.stiffness}"
    transition = units.format(law.transition)
    measured = _format_measured_range(law.valid_range)
    return f"limits {zone}, {stiffness}, fully grown {transition} beyond{measured}"


def _limits_data(law: SmoothLimit) -> dict[str, object]:
    return {
        "law": "smooth limits",
        "limits_deg": [degrees(law.lower), degrees(law.upper)],
        "limit_stiffness_Nm_rad": [law.lower_stiffness, law.upper_stiffness],
        "transition_deg": degrees(law.transition),
        "measured_deg": range_in_degrees(law.valid_range),
    }


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


def _write_two_curves(law: Hysteresis) -> Iterator[str]:
    yield f"{INCREASING_KEY} = {_points_to_toml(law.increasing)}"
    yield f"{DECREASING_KEY} = {_points_to_toml(law.decreasing)}"


def _describe_hysteresis(law: Hysteresis, units: AxisUnits) -> str:
    """Describe two curves, or one with a hysteresis where they are the same at a distance."""
    up, down, slip = law.increasing, law.decreasing, f"slip {law.slip:g} rad/s"
    if isinstance(up, Transformed) and isinstance(down, Transformed) and up.law == down.law:
        plain = (up.scale, up.offset) == (down.scale, down.offset) == (1.0, 0.0)
        if plain and up.constant == -down.constant:
            width = f"hysteresis {2.0 * down.constant:.4g} N m"
            return f"{describe_law(up.law, units)}, {width}, {slip}"
    growing, falling = (describe_law(curve, units) for curve in (up, down))
    return f"growing angle: {growing}; falling angle: {falling}; {slip}"


def _hysteresis_data(law: Hysteresis) -> dict[str, object]:
    return {
        "law": "directional",
        "increasing": law_data(law.increasing),
        "decreasing": law_data(law.decreasing),
        "slip_rad_s": law.slip,
        "measured_deg": range_in_degrees(law.valid_range),
    }


def _describe_stop(law: Stop, units: AxisUnits) -> str:
    zone = format_range(law.lower, law.upper, units)
    return f"stops at {zone}, {law.stiffness:g} {units.stiffness}"


def _stop_data(law: Stop) -> dict[str, object]:
    return {
        "law": "stop",
        "lower": law.lower,
        "upper": law.upper,
        "stiffness": law.stiffness,
        "onset": law.onset,
    }


def _describe_transformed(law: Transformed, units: AxisUnits) -> str:
    times = f", times {law.scale:g}" if law.scale != 1.0 else ""
    moved = f", moved by {units.format(law.offset)}" if law.offset else ""
    constant = f", {law.constant:+g} N m" if law.constant else ""
    return f"{describe_law(law.law, units)}{times}{moved}{constant}"


def _transformed_data(law: Transformed) -> dict[str, object]:
    return {
        "law": "scaled",
        "of": law_data(law.law),
        "scale": law.scale,
        "offset_deg": degrees(law.offset),
        "constant_Nm": law.constant,
    }


def _format_measured_range(measured: Range | None) -> str:
    return f", known for {format_range(*measured)}" if measured is not None else ""


def format_range(low: float | None, high: float | None, units: AxisUnits = ROTATION_UNITS) -> str:
    """Format a range as `-5 deg .. 110 deg`, or in cm; `-` for an open end."""
    ends = ["-" if end is None else units.format(end) for end in (low, high)]
    return " .. ".join(ends)


def range_in_degrees(interval: Range | None) -> list[float | None] | None:
    """Return the ends in degrees, None for one that is open."""
    return interval and [degrees(end) if isfinite(end) else None for end in interval]


LAWS: tuple[LawSchema[Any], ...] = (
    LawSchema(
        Cubic,
        _describe_cubic,
        _cubic_data,
        LawForm(
            "a cubic",
            CubicEntry,
            (COEFFICIENTS_KEY,),
            (SENSE_KEY, DEAD_ZONE_KEY, REST_KEY),
            _parse_cubic,
            _write_cubic,
        ),
    ),
    LawSchema(
        Linear,
        _describe_linear,
        _linear_data,
        LawForm(
            "a linear spring", Linear, (STIFFNESS_KEY,), (REST_KEY,), _parse_linear, _write_linear
        ),
    ),
    LawSchema(
        Exponential,
        _describe_exponentials,
        _exponentials_data,
        LawForm(
            "exponentials",
            Exponential,
            (EXPONENTIALS_KEY,),
            (CONSTANT_KEY, MEASURED_KEY),
            _parse_exponentials,
            _write_exponentials,
        ),
    ),
    LawSchema(
        Interpolated,
        _describe_curve,
        _curve_data,
        LawForm(
            "a curve through points", Interpolated, (POINTS_KEY,), (), _parse_points, _write_curve
        ),
    ),
    LawSchema(
        SmoothLimit,
        _describe_limits,
        _limits_data,
        LawForm(
            "limits",
            SmoothLimit,
            (LIMITS_KEY, LIMIT_STIFFNESS_KEY, TRANSITION_KEY),
            (MEASURED_KEY,),
            _parse_limits,
            _write_limits,
        ),
    ),
    LawSchema(
        Hysteresis,
        _describe_hysteresis,
        _hysteresis_data,
        LawForm(
            "two curves",
            Hysteresis,
            (INCREASING_KEY, DECREASING_KEY),
            (),
            _parse_two_curves,
            _write_two_curves,
        ),
    ),
    LawSchema(Stop, _describe_stop, _stop_data),
    LawSchema(Transformed, _describe_transformed, _transformed_data),
)
"""All elastic laws, in the order of messages."""

_SCHEMAS = {schema.law: schema for schema in LAWS}

_PUBLISHED_FORM = LawForm(
    "a published curve",
    PublishedLaw,
    (PUBLISHED_KEY,),
    ("published_sense",),
    parse_published_law,
    write_published_law,
)
LAW_FORMS: tuple[LawForm[Any], ...] = (
    *(schema.form for schema in LAWS if schema.form is not None),
    _PUBLISHED_FORM,
)
"""The forms that a law has in a table; a published curve names one instead of its numbers."""

ELASTIC_KEYS = tuple(form.required_keys[0] for form in LAW_FORMS)
"""For each law the key that is named when there is none."""

LAW_KEYS = tuple(
    dict.fromkeys(
        (
            *(key for form in LAW_FORMS for key in (*form.required_keys, *form.optional_keys)),
            *MODIFIER_KEYS,
            SLIP_RATE_KEY,
        )
    )
)
