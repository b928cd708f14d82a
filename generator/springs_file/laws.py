"""The elastic laws of a springs file, one row a law.

A row of `LAWS` has the keys of a law, by which it is read and written, and how it is described. A
new law is a module in `springs/` and a row here. `scale`, `offset_deg` and `hysteresis_Nm` change
any law.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import degrees, isfinite
from typing import Any, Generic, TypeAlias, TypeVar, cast

import numpy as np

from generator.springs_file.published import PUBLISHED_KEY, PublishedKey, PublishedLaw
from generator.toml_file.reader import Pair, TableReader
from generator.toml_file.rows import (
    ENERGY_HINT,
    Interval,
    Number,
    Numbers,
    Row,
    Sign,
    lines_of_rows,
    read_rows,
)
from generator.toml_file.writer import (
    degree_to_toml,
    degrees_to_toml,
    number_to_toml,
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

COEFFICIENTS_KEY, CONSTANT_KEY = "coefficients_Nm_rad", "constant_Nm"
INCREASING_KEY, DECREASING_KEY = "increasing_points_deg_Nm", "decreasing_points_deg_Nm"

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


@dataclass(frozen=True)
class SlideEntry:
    """A linear spring along a translation, as a table states it.

    Attributes:
        stiffness: stiffness [N/m].
        rest: displacement without force [m].
    """

    stiffness: float
    rest: float = 0.0

    @property
    def law(self) -> Linear:
        """The law of the displacement."""
        return Linear(self.stiffness, self.rest)


EntryLaw: TypeAlias = Elastic | CubicEntry | SlideEntry | PublishedLaw
"""The law of a table: complete, or to be completed by its joint or by the published tables."""

L = TypeVar("L")


@dataclass(frozen=True)
class LawForm(Generic[L]):
    """The keys of a law in a table.

    Attributes:
        name: Name of the law, in messages.
        entry_type: Class of the law of a table, with the attributes that the rows name.
        required: Rows of which all are needed.
        optional: Rows that may stand beside.
        make: Law of the values of the rows by attribute; None for the class itself.
        check: Whether a law can be used; it notes the fault if not.
    """

    name: str
    entry_type: type[L]
    required: tuple[Row[Any], ...]
    optional: tuple[Row[Any], ...] = ()
    make: Callable[..., L] | None = None
    check: Callable[[TableReader, L], bool] | None = None

    @property
    def rows(self) -> tuple[Row[Any], ...]:
        """All rows."""
        return (*self.required, *self.optional)

    @property
    def required_keys(self) -> tuple[str, ...]:
        """Keys of which all are needed."""
        return tuple(row.key for row in self.required)

    @property
    def optional_keys(self) -> tuple[str, ...]:
        """Keys that may stand beside."""
        return tuple(row.key for row in self.optional)

    def is_present(self, table: TableReader) -> bool:
        """Return whether a table has any of the keys that make the law."""
        return any(key in table.content for key in self.required_keys)

    def parse(self, table: TableReader) -> L | None:
        """Return the law of a table; None with a fault noted."""
        values = read_rows(table, self.rows)
        if any(name not in values for row in self.required for name in row.attributes):
            return None
        law = (self.make or self.entry_type)(**values)
        return law if self.check is None or self.check(table, law) else None


@dataclass(frozen=True)
class LawSchema(Generic[L]):
    """One elastic law; what is left out follows from its keys.

    Attributes:
        law: Class of the law.
        form: Keys in a springs file, or None for a law that no key makes.
        describe: One line, with the units of the law's axis.
        to_json: Content for `--json`; angles in deg where the key says so, else rad and SI.
    """

    law: type[L]
    form: LawForm[Any] | None = None
    describe: Callable[[L, AxisUnits], str] | None = None
    to_json: Callable[[L], dict[str, object]] | None = None


def describe_law(law: Elastic, units: AxisUnits = ROTATION_UNITS) -> str:
    """Describe a law in one line; `a` is the angle in rad.

    Args:
        law: law of an axis, or of a translation.
        units: units of its axis.
    """
    schema = _SCHEMAS[type(law)]
    if schema.describe is not None:
        return schema.describe(law, units)
    name, *values = _row_data(law).items()
    numbers = (
        f"{key} {value:g}" if isinstance(value, float) else f"{key} {value}"
        for key, value in values
    )
    return ", ".join([str(name[1]), *numbers])


def law_data(law: Elastic) -> dict[str, object]:
    """Return a law for `--json`; angles in deg where the key says so, else rad and SI."""
    schema = _SCHEMAS[type(law)]
    return _row_data(law) if schema.to_json is None else schema.to_json(law)


def _row_data(law: Elastic) -> dict[str, object]:
    """Return the name of a law without its article, and the values of its keys in their units."""
    form = _SCHEMAS[type(law)].form
    assert form is not None
    name = form.name.removeprefix("a ").removeprefix("an ")
    return {"law": name} | {row.key: _in_unit(row.value_of(law), row.key) for row in form.rows}


def _in_unit(value: Any, key: str) -> object:
    """Return a number, or a list of numbers, in the unit of a key; None for an open end."""
    if isinstance(value, tuple):
        return [_in_unit(part, key) for part in cast("tuple[Any, ...]", value)]
    if not isinstance(value, float):
        return value
    number = degrees(value) if key.endswith("_deg") else value
    return number if isfinite(number) else None


def write_law(law: EntryLaw) -> Iterator[str]:
    """Yield the lines of a law in a springs file.

    Raises:
        ValueError: for a law that no key holds.
    """
    form = next((form for form in LAW_FORMS if isinstance(law, form.entry_type)), None)
    if form is None:
        raise ValueError(f"a springs file has no key for {describe_law(cast('Elastic', law))}")
    yield from lines_of_rows(law, form.rows)


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


class _DeadZone(Row[tuple[Pair | None, bool]]):
    """Edges of a dead zone, or "none"; and that the file says so."""

    def read(self, table: TableReader) -> tuple[Pair | None, bool] | None:
        if table.content.get(self.key) == NO_DEAD_ZONE:
            return None, True
        zone = Interval(self.key).read(table)
        return None if zone is None else (zone, True)

    def value_to_toml(self, value: tuple[Pair | None, bool]) -> str:
        return quote_toml(NO_DEAD_ZONE) if value[0] is None else degrees_to_toml(value[0])


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


def _describe_linear(law: Linear, units: AxisUnits) -> str:
    rest = units.format(law.rest)
    return f"linear {law.stiffness:g} {units.stiffness}, rest {rest}"


def _linear_data(law: Linear) -> dict[str, object]:
    return {"law": "linear", "stiffness": law.stiffness, "rest": law.rest}


class _Exponentials(Row[tuple[ExponentialTerm, ...]]):
    """Pairs of amplitude [N m] and rate [1/rad]."""

    def read(self, table: TableReader) -> tuple[ExponentialTerm, ...] | None:
        pairs = table.pairs(self.key, 1)
        flat = [k for k, (_, rate) in enumerate(pairs) if rate == 0.0]
        for k in flat:
            hint = f"an exponential of rate zero is a constant: `{CONSTANT_KEY}`"
            table.error(self.key, "the rate of an exponential must not be zero", hint, k, 1)
        return tuple(ExponentialTerm(*pair) for pair in pairs) if pairs and not flat else None

    def value_to_toml(self, value: tuple[ExponentialTerm, ...]) -> str:
        if any(term.centre or term.end is not None for term in value):
            raise ValueError("a springs file holds exponentials about the angle zero, without end")
        return pairs_to_toml((number_to_toml(t.amplitude), number_to_toml(t.rate)) for t in value)


def _describe_exponentials(law: Exponential, units: AxisUnits) -> str:
    del units
    terms = " ".join(map(_format_term, law.terms))
    return f"exponentials {law.constant:g} {terms} N m{_format_measured_range(law.valid_range)}"


def _format_term(term: ExponentialTerm) -> str:
    angle = f"(a {-degrees(term.centre):+.4g} deg)" if term.centre else "a"
    return f"{term.amplitude:+.4g} exp({term.rate:.4g} {angle}{format_exponent_end(term.end)})"


def format_exponent_end(end: float | None) -> str:
    """Return `; tangent beyond 1.5` for an exponential that ends at an exponent, else ""."""
    return "" if end is None else f"; tangent beyond {end:.4g}"


def _exponentials_data(law: Exponential) -> dict[str, object]:
    terms = [
        {"amplitude_Nm": t.amplitude, "rate_1_rad": t.rate, "centre_deg": degrees(t.centre)}
        | ({} if t.end is None else {"end": t.end})
        for t in law.terms
    ]
    data: dict[str, object] = {"law": "exponentials", "terms": terms, "constant_Nm": law.constant}
    return data | {"measured_deg": range_in_degrees(law.valid_range)}


class _Curve(Row[Elastic]):
    """Pairs of angle [deg] and torque [N m], the points of a curve."""

    def read(self, table: TableReader) -> Elastic | None:
        points, wrong = table.pairs(self.key, 2, ("deg", "Nm")), False
        for k, (before, after) in enumerate(pairwise(points), start=1):
            if after[0] <= before[0]:
                wrong = True
                order = f"{degrees(after[0]):.6g} deg comes after {degrees(before[0]):.6g} deg"
                message = f"the points of a curve are not in order: {order}"
                hint = "their angles increase: [[deg, N m], ...]"
                table.error(self.key, message, hint, k)
        if not points or wrong:
            return None
        law = Interpolated(points)
        if is_finite(law):
            return law
        table.error(self.key, "this curve is too steep for numbers", "are its angles in deg?")
        return None

    def value_of(self, owner: object) -> Elastic | None:
        return owner if isinstance(owner, Interpolated) else super().value_of(owner)

    def value_to_toml(self, value: Elastic) -> str:
        if not isinstance(value, Interpolated):
            message = "a springs file holds two curves through points, or one and a hysteresis"
            raise ValueError(message)
        return pairs_to_toml(
            (degree_to_toml(angle), number_to_toml(torque)) for angle, torque in value.points
        )


def _only_curve(points: Interpolated) -> Interpolated:
    return points


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


def _describe_limits(law: SmoothLimit, units: AxisUnits) -> str:
    below, above = law.lower_stiffness, law.upper_stiffness
    zone = format_range(law.lower, law.upper, units)
    stiffness = f"{below:.4g} and {above:.4g} {units.stiffness}"
    transition = units.format(law.transition)
    measured = _format_measured_range(law.valid_range)
    return f"limits {zone}, {stiffness}, fully grown {transition} beyond{measured}"


def _loses_energy(table: TableReader, law: Hysteresis) -> bool:
    """Return whether the curve of the growing angle is nowhere above the other; note it if not."""
    up, down = law.increasing, law.decreasing
    low, high = law.valid_range or (0.0, 0.0)
    if low >= high:
        hint = "they are compared where both are known"
        table.error(DECREASING_KEY, "the two curves have no stretch of angles in common", hint)
        return False
    angles = np.unique(
        [*np.linspace(low, high, 181), *(c for c in law.breakpoints if low < c < high)]
    )
    excess = np.asarray(up.torque(angles)) - np.asarray(down.torque(angles))
    worst = int(excess.argmax())
    largest = float(np.abs(np.asarray(up.torque(angles))).max())
    if excess[worst] <= _CURVE_ORDER_TOLERANCE * (1.0 + largest):
        return True
    where = f"at {degrees(angles[worst]):.4g} deg by {excess[worst]:.3g} N m"
    table.error(
        INCREASING_KEY,
        f"the curve of the growing angle lies above that of the falling one, {where}: "
        "a cycle there would feed energy",
        "the torques act on the child, and friction opposes motion; are the two exchanged?",
    )
    return False


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


_REST = Number("rest_deg", attribute="rest")
_MEASURED = Interval("measured_deg", attribute="valid_range")

LAWS: tuple[LawSchema[Any], ...] = (
    LawSchema(
        Cubic,
        LawForm(
            "a cubic",
            CubicEntry,
            (Numbers(COEFFICIENTS_KEY, count=4, attribute="coefficients"),),
            (
                Sign("sense", "-1: the moment resists; +1: it acts on the child"),
                _DeadZone("dead_zone_deg", attribute=("dead_zone", "dead_zone_stated")),
                _REST,
            ),
        ),
        _describe_cubic,
        _cubic_data,
    ),
    LawSchema(
        Linear,
        LawForm(
            "a linear spring",
            Linear,
            (Number("stiffness_Nm_rad", 0.0, hint=ENERGY_HINT, attribute="stiffness"),),
            (_REST,),
        ),
        _describe_linear,
        _linear_data,
    ),
    LawSchema(
        Exponential,
        LawForm(
            "exponentials",
            Exponential,
            (_Exponentials("exponentials_Nm_1_rad", attribute="terms"),),
            (Number(CONSTANT_KEY, attribute="constant"), _MEASURED),
        ),
        _describe_exponentials,
        _exponentials_data,
    ),
    LawSchema(
        Interpolated,
        LawForm(
            "a curve through points",
            Interpolated,
            (_Curve("points_deg_Nm", attribute="points"),),
            make=_only_curve,
        ),
        _describe_curve,
        _curve_data,
    ),
    LawSchema(
        SmoothLimit,
        LawForm(
            "smooth limits",
            SmoothLimit,
            (
                Interval("limits_deg", attribute=("lower", "upper")),
                Numbers(
                    "limit_stiffness_Nm_rad",
                    count=2,
                    negative_error=("a limit's stiffness must not be below zero", ""),
                    attribute=("lower_stiffness", "upper_stiffness"),
                ),
                Number(
                    "transition_deg",
                    is_positive=True,
                    hint="the angle over which the limit grows to its full stiffness",
                    attribute="transition",
                ),
            ),
            (_MEASURED,),
        ),
        _describe_limits,
    ),
    LawSchema(
        Hysteresis,
        LawForm(
            "two curves",
            Hysteresis,
            (
                _Curve(INCREASING_KEY, attribute="increasing"),
                _Curve(DECREASING_KEY, attribute="decreasing"),
            ),
            check=_loses_energy,
        ),
        _describe_hysteresis,
        _hysteresis_data,
    ),
    LawSchema(Stop, None, _describe_stop, _stop_data),
    LawSchema(Transformed, None, _describe_transformed, _transformed_data),
)
"""All elastic laws, in the order of messages."""

_SCHEMAS = {schema.law: schema for schema in LAWS}

SLIDE_FORM = LawForm(
    "a linear spring along a translation",
    SlideEntry,
    (Number("stiffness_N_m", 0.0, hint=ENERGY_HINT, attribute="stiffness"),),
    (Number("rest_m", attribute="rest"),),
)
"""The form of the law of a translation."""

LAW_FORMS: tuple[LawForm[Any], ...] = (
    *(schema.form for schema in LAWS if schema.form is not None),
    SLIDE_FORM,
    LawForm(
        "a published curve",
        PublishedLaw,
        (PublishedKey(PUBLISHED_KEY, "curve", attribute="key"),),
        (
            Sign(
                "published_sense",
                "-1: the axis's positive angle is opposite to the published motion",
                attribute="sense",
            ),
        ),
    ),
)
"""The forms that a law has in a table; a published curve names one instead of its numbers."""

ELASTIC_KEYS = tuple(form.required_keys[0] for form in LAW_FORMS)
"""For each law the key that is named when there is none."""

LAW_ROWS = tuple(dict.fromkeys(row for form in LAW_FORMS for row in form.rows))
"""The rows of all laws."""
