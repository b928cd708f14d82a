"""Verdicts of rows, in closed form and on falls that are made up."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import exp, log, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plots.fall_facts import Direction, FallFact, Falls, fall_facts
from plots.fall_verdicts import (
    NO_PARTS,
    NO_SPREAD,
    TOO_FEW,
    FallTables,
    compare,
    gap,
    in_sector,
    odds_ratio,
    ratio_of_means,
    sd_interval,
)
from plots.literature import Measurements
from plots.plate import Outcome

NAMES = (
    "pelvis_speed_m_per_s",
    "head_speed_m_per_s",
    "hip_force_N",
    "head_force_N",
    "pelvis_hits",
    "head_hits",
)


def table(rows: Sequence[Mapping[str, object]]) -> Measurements:
    return Measurements({}, [{key: str(cell) for key, cell in row.items()} for row in rows])


def made(
    awake: Sequence[Mapping[str, float]],
    limp: Sequence[Mapping[str, float]] = (),
    floors: Mapping[float, float] | None = None,
    heads: Sequence[tuple[float, float]] | None = None,
) -> FallTables:
    """Falls of a body with these numbers, those that are left out NaN, straight ahead."""
    rows = [
        {
            "body": "man",
            "tone": tone,
            "seed": seed,
            "direction_deg": 0.0,
            "done": 1,
            **dict.fromkeys(NAMES, np.nan),
            **numbers,
        }
        for tone, some in (("awake", awake), ("limp", limp))
        for seed, numbers in enumerate(some)
    ]
    on_floors = [
        {"body": "man", "floor_kN_m": f"{floor:g}", "floor_force_N": force}
        for floor, force in (floors or {}).items()
    ]
    alone = [
        {"body": "man", "single_head_force_N": force, "single_head_acceleration_g": acceleration}
        for force, acceleration in heads or ()
    ]
    return FallTables(
        table([{"body": "man", "figure": "male50", "contact": "parts"}]),
        table(rows),
        None if floors is None else table(on_floors),
        None if heads is None else table(alone),
    )


def spread(name: str, mean: float, sd: float, count: int = 40) -> list[dict[str, float]]:
    """Falls whose numbers have a mean and a standard deviation."""
    values = np.linspace(-1.0, 1.0, count)
    return [{name: mean + sd * value / np.std(values, ddof=1)} for value in values]


def fact(key: str, **changes: object) -> FallFact:
    return replace(fall_facts()[key], **changes)


def test_the_interval_of_a_standard_deviation_is_that_of_the_table():
    """n = 12, as for the speed of the head: 0.61 to 1.46 (and 0.0 of chi-square beyond)."""
    assert sd_interval(0.86, 12) == pytest.approx((0.609, 1.460), abs=1e-3)
    # chi-square of one degree of freedom is the square of a normal number
    low, high = sd_interval(1.0, 2)
    assert (low, high) == pytest.approx((1.0 / 2.241403, 1.0 / 0.031338), rel=1e-4)


def test_the_odds_ratio_is_that_of_woolf():
    found = odds_ratio(10, 30, 5, 40)
    a, b, c, d = 10.5, 20.5, 5.5, 35.5
    assert found.value == pytest.approx(a * d / b / c)
    half = 1.96 * sqrt(1 / a + 1 / b + 1 / c + 1 / d)
    assert log(found.high / found.value) == pytest.approx(half)
    assert log(found.value / found.low) == pytest.approx(half)


@given(st.integers(0, 30), st.integers(0, 30))
def test_the_odds_ratio_is_finite_and_inverts(hits: int, others: int):
    one, other = odds_ratio(hits, 30, others, 30), odds_ratio(others, 30, hits, 30)
    assert 0.0 < one.low < one.value < one.high < np.inf
    assert (other.low, other.high) == pytest.approx((1.0 / one.high, 1.0 / one.low))


def test_the_ratio_of_means_is_their_quotient_with_the_spread_of_both():
    values, others = np.array([2.0, 4.0, 6.0]), np.array([1.0, 2.0, 3.0, 2.0])
    found = ratio_of_means(values, others)
    half = 1.96 * sqrt((2.0 / 4.0) ** 2 / 3 + (sqrt(2.0 / 3.0) / 2.0) ** 2 / 4)
    assert found == pytest.approx((2.0, 2.0 * exp(-half), 2.0 * exp(half)))


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [((0, 1), (2, 3), 1.0), ((2, 3), (0, 1), 1.0), ((0, 2), (1, 3), 0.0), ((0, 1), (1, 1), 0.0)],
)
def test_the_gap_of_intervals(one: tuple[int, int], other: tuple[int, int], expected: float):
    assert gap(one, other) == expected


def test_sectors_cover_all_directions_once():
    angles = np.linspace(-540.0, 540.0, 1081)
    inside = np.array([in_sector(angles, one) for one in Direction])
    assert (inside.sum(axis=0) == 1).all()
    for direction, angle in ((Direction.FORWARD, 0.0), (Direction.SIDEWAYS, -90.0)):
        assert in_sector(np.array([angle]), direction).all()
    assert in_sector(np.array([180.0, -170.0]), Direction.BACKWARD).all()


@pytest.mark.parametrize(
    ("mean", "sd", "failing"),
    [
        (2.91, 0.86, []),
        (2.06, 1.45, []),
        (2.04, 0.86, ["mean"]),
        (2.91, 1.47, ["spread"]),
        (2.91, 0.60, ["spread"]),
        (4.0, 0.2, ["mean", "spread"]),
    ],
)
def test_a_mean_is_within_one_deviation_and_a_deviation_within_its_interval(
    mean: float, sd: float, failing: list[str]
):
    found = compare(made(spread("head_speed_m_per_s", mean, sd)), fact("head_speed"), "man")
    assert found.failing == failing
    assert found.outcome is (Outcome.DIFFERS if failing else Outcome.AGREES)
    assert found.verdict == (f"differs: {', '.join(failing)}" if failing else "agrees")


def test_without_a_number_of_people_the_deviation_is_not_judged():
    falls = made(spread("head_speed_m_per_s", 2.91, 5.0))
    found = compare(falls, fact("head_speed", n=None), "man")
    assert found.verdict == "agrees"
    found = compare(falls, fact("head_speed", n=None, sd=None), "man")
    assert (found.verdict, found.criteria[0].claim.obstacle) == ("not judged", NO_SPREAD)


def test_falls_without_the_number_and_those_that_failed_do_not_count():
    falls = [{}, *spread("head_speed_m_per_s", 2.91, 0.86, 20)]
    falls.append({"head_speed_m_per_s": 90.0, "done": 0.0})
    assert compare(made(falls), fact("head_speed"), "man").verdict == "agrees"
    few = compare(made(falls[:2]), fact("head_speed"), "man")
    assert (few.verdict, few.criteria[0].claim.obstacle) == ("not judged", TOO_FEW)


def test_a_fact_of_a_direction_is_compared_with_its_falls():
    ahead = spread("pelvis_speed_m_per_s", 9.0, 0.4)
    aside = [{**one, "direction_deg": 90.0} for one in spread("pelvis_speed_m_per_s", 2.75, 0.4)]
    found = compare(made([*ahead, *aside]), fact("pelvis_speed_sideways"), "man")
    assert found.verdict == "agrees"


@pytest.mark.parametrize(
    ("hits", "verdict"),
    [(27, "differs: share"), (28, "agrees"), (56, "agrees"), (59, "differs: share")],
)
def test_a_share_overlaps(hits: int, verdict: str):
    """Of 100 falls: Wilson's interval of 27 is 19.3 to 36.4 %, beyond 37 to 48 %."""
    falls = made([{"head_hits": float(k < hits)} for k in range(100)])
    published = fact("head_hits", low=37.0, high=48.0)
    assert compare(falls, published, "man").verdict == verdict


@pytest.mark.parametrize(
    ("ahead", "aside", "verdict"),
    [
        (30, 15, "agrees"),
        (24, 25, "differs: side"),
        (10, 30, "differs: odds, side"),
        (26, 25, "agrees"),
    ],
)
def test_odds_of_directions(ahead: int, aside: int, verdict: str):
    falls = [
        {"direction_deg": angle, "head_hits": float(k < hits)}
        for angle, hits in ((0.0, ahead), (90.0, aside))
        for k in range(50)
    ]
    assert compare(made(falls), fact("head_odds_sideways"), "man").verdict == verdict


@pytest.mark.parametrize(("backward", "verdict"), [(4.1e3, "agrees"), (6e3, "differs: ratio")])
def test_forces_of_directions(backward: float, verdict: str):
    falls = [
        {**one, "direction_deg": angle}
        for angle, mean in ((180.0, backward), (90.0, 4e3))
        for one in spread("hip_force_N", mean, 1e3)
    ]
    assert compare(made(falls), fact("hip_force_directions"), "man").verdict == verdict


@pytest.mark.parametrize(("median", "verdict"), [(5e3, "agrees"), (3e3, "differs: median")])
def test_dummies_are_compared_with_limp_falls(median: float, verdict: str):
    limp = spread("head_force_N", median, 9e3)
    falls = made(spread("head_force_N", 1e6, 1e3), limp)
    published = fact("dummy_head_force")
    assert published.falls is Falls.LIMP
    assert compare(falls, published, "man").verdict == verdict


@pytest.mark.parametrize(
    ("force", "verdict"),
    [(4.17e3, "agrees"), (4.16e3, "differs: force"), (5.6e3, "agrees"), (5.7e3, "differs: force")],
)
def test_a_force_on_a_floor_is_within_15_percent(force: float, verdict: str):
    """Of 4.9 kN, 4.165 to 5.635."""
    assert compare(made([], floors={59.0: force}), fact("floor_59"), "man").verdict == verdict


def test_both_ends_of_a_head_alone_are_judged():
    falls = made([], heads=[(3.9e3, 100.0), (24.5e3, 500.0)])
    assert compare(falls, fact("single_head_force"), "man").verdict == "agrees"
    assert compare(falls, fact("single_head_acceleration"), "man").failing == ["low end"]


def test_without_parts_floors_are_not_judged():
    for key in ("floor_59", "single_head_force"):
        found = compare(made([]), fact(key), "man")
        assert (found.verdict, found.criteria[0].claim.obstacle) == ("not judged", NO_PARTS)
