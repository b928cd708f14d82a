"""The facts of falls: the shipped file, and errors that name the row."""

import copy
import re
import tomllib
from importlib.resources import files
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator import Falls, Model, Plan, read_figure
from generator.study.run_results import RunResults
from generator.study.study import Design, DesignKind, Study
from plots.fall_facts import (
    QUANTITIES,
    FallFactError,
    FallFacts,
    Group,
    Rule,
    Use,
    fall_facts,
    parse_fall_facts,
)
from springs.published.reference import Sureness

SHIPPED = tomllib.loads(files("plots").joinpath("data/fall_facts.toml").read_text(encoding="utf-8"))
MEAN, INTERVAL = "head_speed", "dummy_head_force"


def changed(key: str, **cells: Any) -> dict[str, Any]:
    """The shipped file with other cells in a row; None leaves one out."""
    data = copy.deepcopy(SHIPPED)
    (row,) = (row for row in data["fact"] if row["key"] == key)
    row.update(cells)
    for name in [name for name, cell in cells.items() if cell is None]:
        del row[name]
    return data


def test_every_rule_use_sureness_and_group_has_a_fact():
    facts = fall_facts().facts
    assert {fact.rule for fact in facts} == set(Rule)
    assert {fact.use for fact in facts} == set(Use)
    assert {fact.group for fact in facts} == set(Group)
    assert {fact.sureness for fact in facts} <= set(Sureness)


def test_quantities_are_numbers_of_many_falls():
    """But for those of falls on floors and of a head alone."""
    study = Study("push", Model(read_figure("male50")), Plan(), {}, Design(DesignKind.LIST), {})
    numbers = Falls(study, np.zeros((0, 2)), RunResults({}, 0), 1.0).summary()
    others = {"floor_force_N", "single_head_force_N", "single_head_acceleration_g"}
    assert QUANTITIES.keys() - others < numbers.keys()


def test_numbers_of_the_source_are_those_of_the_fact():
    head = fall_facts()["head_speed"]
    assert (head.mean, head.sd, head.n, head.unit) == (2.91, 0.86, 12, "m/s")
    assert head.span == pytest.approx((2.05, 3.77))
    assert head.value_text == "2.91 (0.86) m/s, n 12"
    dummies = fall_facts()["dummy_head_acceleration"]
    assert (dummies.span, dummies.falls) == ((146.0, 502.0), "limp")
    assert fall_facts()["head_odds_backward"].value_text == "2.7 (1.3 to 5.9)"
    assert [one.floor for one in fall_facts().facts if one.floor] == [400.0, 95.0, 67.0, 59.0]


def test_facts_that_set_a_parameter_name_it():
    chosen = {fact.key for fact in fall_facts().facts if fact.parameter}
    assert chosen == {fact.key for fact in fall_facts().facts if fact.use is Use.SETS}
    assert {"head_hits", "hand_lead"} < chosen


@pytest.mark.parametrize(
    ("key", "cells", "message"),
    [
        (MEAN, {"mean": None}, "rule `mean` needs `mean`"),
        (MEAN, {"name": None}, "`name` is missing"),
        (MEAN, {"name": " "}, "name must be a text"),
        (MEAN, {"mean": "2.9"}, "mean must be a finite number, not '2.9'"),
        (MEAN, {"mean": True}, "mean must be a finite number, not True"),
        (MEAN, {"sd": 0.0}, "sd must be positive, not 0"),
        (MEAN, {"sd": None}, "`n` without `sd`"),
        (MEAN, {"n": 1}, "n must be an integer from 2 on, not 1"),
        (MEAN, {"n": 12.0}, "n must be an integer from 2 on, not 12.0"),
        (MEAN, {"median": 3.0}, "unknown key `median`"),
        (MEAN, {"low": 1.0}, "rule `mean` has no use for `low`"),
        (MEAN, {"unit": "km/h"}, "unit is `km/h`, but its numbers are in `m/s`"),
        (MEAN, {"rule": "mode"}, "rule is one of mean, share, odds"),
        (MEAN, {"sureness": "R"}, "sureness is one of C2, C1, P, C1+P, D, M, not 'R'"),
        (MEAN, {"falls": "asleep"}, "falls is one of awake, limp"),
        (MEAN, {"direction": "up"}, "direction is one of forward, sideways, backward"),
        (MEAN, {"source": "nobody"}, "unknown source `nobody`"),
        (MEAN, {"quantity": "head_size"}, "unknown quantity `head_size`"),
        (MEAN, {"use": "sets"}, "what sets a parameter names it"),
        (MEAN, {"parameter": "tone"}, "what sets a parameter names it"),
        (INTERVAL, {"low": 30.0}, "is within 30 to 24.5"),
        (INTERVAL, {"high": None}, "rule `interval` needs `high`"),
        ("head_odds_sideways", {"mean": 7.0}, "is within 1.2 to 6.3"),
        ("head_odds_sideways", {"low": -1.0}, "a ratio is positive"),
        ("head_odds_sideways", {"directions": ["forward"]}, "directions are two different ones"),
        ("head_odds_sideways", {"directions": ["forward", "up"]}, "direction is one of"),
        ("floor_59", {"floor_kN_m": -59}, "floor_kN_m must be positive"),
    ],
)
def test_an_error_names_the_row(key: str, cells: dict[str, Any], message: str):
    number = [row["key"] for row in SHIPPED["fact"]].index(key) + 1
    with pytest.raises(FallFactError, match=re.escape(message)) as raised:
        parse_fall_facts(changed(key, **cells))
    assert str(raised.value).startswith(f"fact {number} (`{key}`): ")


def test_rows_of_the_file_as_a_whole():
    twice = changed(MEAN)
    twice["fact"].append(twice["fact"][0])
    with pytest.raises(FallFactError, match="`pelvis_speed` is the key of another fact"):
        parse_fall_facts(twice)
    idle = changed(MEAN)
    idle["source"]["nobody"] = {"reference": "A. Nobody, 1999"}
    with pytest.raises(FallFactError, match="source `nobody`: no fact has it"):
        parse_fall_facts(idle)
    idle["source"]["nobody"] = {"title": "x"}
    with pytest.raises(FallFactError, match="source `nobody`: `reference` is missing"):
        parse_fall_facts(idle)
    with pytest.raises(FallFactError, match="the file: `fact` is missing"):
        parse_fall_facts({"source": {}})
    nameless = changed(MEAN)
    del nameless["fact"][1]["key"]
    with pytest.raises(FallFactError, match=r"^fact 2: `key` is missing"):
        parse_fall_facts(nameless)


ROWS = st.integers(0, len(SHIPPED["fact"]) - 1)
CELLS = st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.lists(st.text())


def read_or_error(data: dict[str, Any]) -> FallFacts | str:
    """The facts of a file, or the error that it has."""
    try:
        return parse_fall_facts(data)
    except FallFactError as failure:
        return str(failure)


@given(ROWS, st.data())
def test_a_file_with_any_cell_is_read_or_its_row_is_named(number: int, data: st.DataObject):
    changes = copy.deepcopy(SHIPPED)
    row = changes["fact"][number]
    key = data.draw(st.sampled_from(sorted(row)))
    row[key] = data.draw(CELLS)
    found = read_or_error(changes)
    if isinstance(found, str):
        assert found.startswith((f"fact {number + 1}", "source "))
        return
    assert len(found.facts) == len(SHIPPED["fact"])
    value = getattr(found.facts[number], {"floor_kN_m": "floor"}.get(key, key))
    assert row[key] in (value, getattr(value, "key", value))
