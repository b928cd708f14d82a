"""Falls of this program beside facts of people: how each row is judged.

A row agrees where all of its criteria hold:

    mean      the mean is within one standard deviation of people's, and, where their number is
              known, the standard deviation is within the 95 % interval of theirs (chi-square)
    share     the 95 % interval of the share (Wilson 1927) overlaps the range of people's
    odds      the 95 % interval of the odds ratio (Woolf 1955, with half a fall added to each count)
              overlaps people's, and the ratio is on people's side of 1 where theirs excludes 1
    ratio     people's ratio is within the 95 % interval of the ratio of means
    interval  the median is within the interval
    value     the number is within 15 % of the published one
    ends      the numbers at both ends are within 15 % of the published ones

Without a published spread a mean is not judged.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from math import exp, inf, log, sqrt
from typing import NamedTuple, assert_never

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from generator.cli.falls import share_interval
from generator.study.falls import summarize
from plots.fall_facts import (
    QUANTITIES,
    RATIO_UNIT,
    Direction,
    FallFact,
    FallFacts,
    Falls,
    Group,
    Rule,
)
from plots.literature import Measurements, read_measurements
from plots.plate import Claim, ClaimKind, Outcome, incomparable_claim
from springs.backends import Array

FOLDER = "falls_of_people"
"""Folder of the tables in `plots/data`."""

TOLERANCE = 0.15
"""Largest relative difference of a single value."""

FEWEST = 2
"""Fewest falls of which a mean is judged."""

NO_SPREAD = "no spread is published"
NO_PARTS = "each sphere resists by itself, which a floor cannot be in series with"
TOO_FEW = "fewer than two falls have the number"

_QUANTILE = 1.96
_SIDES = (45.0, 135.0)
"""Ends of the sector to the side, from straight ahead [deg]."""


class Interval(NamedTuple):
    """Estimate with its 95 % interval."""

    value: float
    low: float
    high: float


class Criterion(NamedTuple):
    """Criterion of a row: what is judged, in a word, and the claim."""

    label: str
    claim: Claim


@dataclass(frozen=True)
class FallTables:
    """Falls of both bodies, as `python -m benchmarks falls-of-people` writes them.

    Attributes:
        bodies: Figure and contact of each body.
        pushes: Numbers of each push.
        floors: Falls on floors; None if no body has parts.
        heads: Blows to heads alone; None likewise.
    """

    bodies: Measurements
    pushes: Measurements
    floors: Measurements | None
    heads: Measurements | None

    @property
    def names(self) -> list[str]:
        """Names of the bodies."""
        return self.bodies.values("body")

    def pushes_of(
        self, body: str, falls: Falls, direction: Direction | None = None
    ) -> Mapping[str, Array]:
        """Return the columns of the pushes of a body that did not fail, of a direction or all."""
        table = self.pushes.select_rows(body=body, tone=falls.value)
        columns = {name: table.column(name) for name in table.rows[0] if name not in _TEXTS}
        chosen = columns["done"] == 1.0
        if direction is not None:
            chosen &= in_sector(columns["direction_deg"], direction)
        return {name: values[chosen] for name, values in columns.items()}


_TEXTS = ("body", "tone")


def read_fall_tables() -> FallTables:
    """Read the shipped tables."""
    folder = files("plots") / "data" / FOLDER
    floors, heads = (
        read_measurements(f"{FOLDER}/{name}") if (folder / f"{name}.csv").is_file() else None
        for name in ("floors", "heads")
    )
    bodies, pushes = (read_measurements(f"{FOLDER}/{name}") for name in ("bodies", "pushes"))
    return FallTables(bodies, pushes, floors, heads)


def in_sector(directions: Array, sector: Direction) -> NDArray[np.bool_]:
    """Return whether directions are in a sector, 0 straight ahead, shape (n,) [deg]."""
    off = np.abs((directions + 180.0) % 360.0 - 180.0)
    near, far = _SIDES
    match sector:
        case Direction.FORWARD:
            return off < near
        case Direction.SIDEWAYS:
            return (off >= near) & (off <= far)
        case Direction.BACKWARD:
            return off > far
        case _:
            assert_never(sector)


def sd_interval(sd: float, n: int) -> tuple[float, float]:
    """Return the 95 % interval of a standard deviation of n normal numbers."""
    low, high = (sd * sqrt((n - 1) / chi2.ppf(share, n - 1)) for share in (0.975, 0.025))
    return float(low), float(high)


def odds_ratio(hits: int, count: int, other_hits: int, other_count: int) -> Interval:
    """Return the odds ratio of two shares with its 95 % interval.

    Half a fall is added to each of the four counts, so that it is finite.
    """
    cells = (hits, count - hits, other_hits, other_count - other_hits)
    a, b, c, d = (one + 0.5 for one in cells)
    middle, half = log(a * d / (b * c)), _QUANTILE * sqrt(1 / a + 1 / b + 1 / c + 1 / d)
    return Interval(exp(middle), exp(middle - half), exp(middle + half))


def ratio_of_means(values: Array, others: Array) -> Interval:
    """Return the ratio of two means of positive numbers with its 95 % interval.

    The logarithm of the ratio is taken as normal.
    """
    (mean, sd), (other, other_sd) = summarize(values), summarize(others)
    variances = (
        (one_sd / one_mean) ** 2 / some.size
        for one_mean, one_sd, some in ((mean, sd, values), (other, other_sd, others))
    )
    middle, half = log(mean / other), _QUANTILE * sqrt(sum(variances))
    return Interval(exp(middle), exp(middle - half), exp(middle + half))


def gap(one: tuple[float, float], other: tuple[float, float]) -> float:
    """Return the distance between two intervals, 0 where they overlap."""
    return max(one[0] - other[1], other[0] - one[1], 0.0)


@dataclass(frozen=True)
class Comparison:
    """A body beside a fact.

    Attributes:
        fact: The fact.
        body: Name of the body.
        criteria: What is judged.
        measured: Numbers of the body in words, in the unit of the fact.
    """

    fact: FallFact
    body: str
    criteria: Sequence[Criterion]
    measured: str

    @property
    def outcome(self) -> Outcome:
        """Outcome of all criteria."""
        outcomes = [one.claim.outcome for one in self.criteria]
        order = (Outcome.INCOMPARABLE, Outcome.DIFFERS)
        return next((one for one in order if one in outcomes), Outcome.AGREES)

    @property
    def failing(self) -> list[str]:
        """Labels of the criteria that do not hold."""
        return [one.label for one in self.criteria if one.claim.outcome is Outcome.DIFFERS]

    @property
    def verdict(self) -> str:
        """Outcome in words, with what differs."""
        if self.outcome is Outcome.DIFFERS:
            return f"differs: {', '.join(self.failing)}"
        return "agrees" if self.outcome is Outcome.AGREES else "not judged"


def sample(tables: FallTables, fact: FallFact, body: str, falls: Falls) -> Array:
    """Return the known numbers of the falls of a body that a fact is about, in its unit."""
    values = tables.pushes_of(body, falls, fact.direction)[fact.quantity]
    return QUANTITIES[fact.quantity].factor * values[np.isfinite(values)]


def share(tables: FallTables, fact: FallFact, body: str, falls: Falls) -> Interval:
    """Return the share of the falls of a body with its 95 % interval, in the unit of the fact."""
    hits, count = _hits(tables, fact, body, falls, fact.direction)
    low, high = share_interval(hits / count, count)
    return Interval(100.0 * hits / count, 100.0 * low, 100.0 * high)


def ratio(tables: FallTables, fact: FallFact, body: str, falls: Falls) -> Interval | None:
    """Return the ratio of two directions of a body; None with too few falls."""
    assert fact.directions is not None
    if fact.rule is Rule.ODDS:
        pairs = [_hits(tables, fact, body, falls, one) for one in fact.directions]
        if any(count < FEWEST for _, count in pairs):
            return None
        return odds_ratio(*pairs[0], *pairs[1])
    some = [tables.pushes_of(body, falls, one)[fact.quantity] for one in fact.directions]
    values, others = (one[np.isfinite(one)] for one in some)
    if min(values.size, others.size) < FEWEST:
        return None
    return ratio_of_means(values, others)


def single_values(tables: FallTables, fact: FallFact, body: str) -> list[float]:
    """Return the number of a body on a floor, or of its head alone at both ends; [] without."""
    table = tables.floors if fact.floor is not None else tables.heads
    if table is None:
        return []
    cells = {"body": body}
    if fact.floor is not None:
        cells["floor_kN_m"] = f"{fact.floor:g}"
    values = table.select_rows(**cells).column(fact.quantity)
    return (QUANTITIES[fact.quantity].factor * values).tolist()


def _hits(
    tables: FallTables, fact: FallFact, body: str, falls: Falls, direction: Direction | None
) -> tuple[int, int]:
    """Return the number of falls in which a part hits, and of all."""
    part = fact.quantity.removesuffix("_hit_share")
    hits = tables.pushes_of(body, falls, direction)[f"{part}_hits"]
    return int(hits.sum()), int(hits.size)


_GROUP_WORDS: Mapping[Group, str] = {
    Group.SPEEDS: "Speed at the first touch",
    Group.TIMES: "Time",
    Group.SHARES: "Share of falls",
    Group.RATIOS: "Ratio",
    Group.HIPS: "Force",
    Group.HEAD_FORCES: "Force",
    Group.HEAD_ACCELERATIONS: "Acceleration",
}


def compare(tables: FallTables, fact: FallFact, body: str) -> Comparison:
    """Return the comparison of a body with a fact."""
    words = f"{_GROUP_WORDS[fact.group]}: {fact.name}, {body}"
    measured, judged = _judge(tables, fact, body)
    if isinstance(judged, str):
        sentence = f"{words}: {measured or 'no number'} (published: {fact.value_text})"
        criteria = [Criterion("", incomparable_claim(sentence, judged))]
        return Comparison(fact, body, criteria, measured)
    unit, kind = "" if fact.unit == RATIO_UNIT else fact.unit, ClaimKind.COMPARISON
    criteria = [
        Criterion(label, Claim(f"{words}: {sentence}", value, unit, low, high, kind=kind))
        for label, sentence, value, low, high in judged
    ]
    return Comparison(fact, body, criteria, measured)


def compare_all(tables: FallTables, facts: FallFacts) -> list[Comparison]:
    """Return the comparison of each body with each fact, fact by fact."""
    return [compare(tables, fact, body) for fact in facts.facts for body in tables.names]


_Judged = tuple[str, str | Sequence[tuple[str, str, float, float, float]]]
"""Numbers of a body in words, and label, sentence, number and bounds of each criterion, or why none
is judged."""


def _judge(tables: FallTables, fact: FallFact, body: str) -> _Judged:
    match fact.rule:
        case Rule.MEAN | Rule.INTERVAL:
            values = sample(tables, fact, body, fact.falls)
            if values.size < FEWEST:
                return "", TOO_FEW
            return (_judge_mean if fact.rule is Rule.MEAN else _judge_interval)(fact, values)
        case Rule.SHARE | Rule.ODDS | Rule.RATIO:
            estimate = share if fact.rule is Rule.SHARE else ratio
            found = estimate(tables, fact, body, fact.falls)
            return ("", TOO_FEW) if found is None else _judge_overlap(fact, found)
        case Rule.VALUE | Rule.ENDS:
            return _judge_values(fact, single_values(tables, fact, body))
        case _:
            assert_never(fact.rule)


def _judge_mean(fact: FallFact, values: Array) -> _Judged:
    mean, sd = summarize(values)
    measured = f"{_number(mean)} ({_number(sd)})"
    if fact.sd is None:
        return measured, NO_SPREAD
    judged = [("mean", f"mean, within one SD of {fact.value_text}", mean, *fact.span)]
    if fact.n is not None:
        sentence = f"SD, within the 95 % interval of an SD of {fact.sd:g}, n {fact.n}"
        judged.append(("spread", sentence, sd, *sd_interval(fact.sd, fact.n)))
    return measured, judged


def _judge_interval(fact: FallFact, values: Array) -> _Judged:
    low, median, high = np.percentile(values, [2.5, 50.0, 97.5]).tolist()
    measured = f"{_number(median)}, {_number(low)} to {_number(high)}"
    return measured, [("median", f"median, within {fact.value_text}", median, *fact.span)]


def _judge_overlap(fact: FallFact, found: Interval) -> _Judged:
    unit = "" if fact.unit == RATIO_UNIT else f" {fact.unit}"
    measured = f"{_number(found.value)} ({_number(found.low)} to {_number(found.high)})"
    sentence = f"{measured}{unit}, published {fact.value_text}: distance between the intervals"
    distance, (low, high) = gap((found.low, found.high), fact.span), fact.span
    judged = [(fact.rule.value, sentence, distance, -inf, 0.0)]
    if fact.rule is Rule.ODDS and not low <= 1.0 <= high:
        side, ends = ("above", (1.0, inf)) if low > 1.0 else ("below", (-inf, 1.0))
        judged.append(("side", f"{side} 1, as published", found.value, *ends))
    return measured, judged


def _judge_values(fact: FallFact, values: Sequence[float]) -> _Judged:
    if not values:
        return "", NO_PARTS
    labels = ("low end", "high end") if fact.rule is Rule.ENDS else ("force",)
    within = f"within {100.0 * TOLERANCE:g} % of"
    judged = [
        (
            label,
            f"{label}, {within} {other:g} {fact.unit}",
            value,
            (1.0 - TOLERANCE) * other,
            (1.0 + TOLERANCE) * other,
        )
        for label, value, other in zip(labels, values, fact.span, strict=False)
    ]
    return " and ".join(map(_number, values)), judged


def _number(value: float) -> str:
    """Format a number with three digits, or as an integer."""
    return f"{value:.0f}" if abs(value) >= 100.0 else f"{value:.3g}"
