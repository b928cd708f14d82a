"""The facts of falls: the shipped file, and facts that contradict themselves."""

import copy
import re
import tomllib
from importlib.resources import files
from typing import Any

import numpy as np
import pytest

from generator import Falls, Model, Plan, read_figure
from generator.study.run_results import RunResults
from generator.study.study import Design, DesignKind, Study
from plots.fall_facts import (
    QUANTITIES,
    Group,
    Rule,
    Use,
    fall_facts,
    parse_fall_facts,
)
from springs.published.reference import Sureness

SHIPPED = tomllib.loads(files("plots").joinpath("data/fall_facts.toml").read_text(encoding="utf-8"))
MEAN, INTERVAL = "head_speed", "dummy_head_force"


def changed(key: str, cells: dict[str, Any]) -> dict[str, Any]:
    """The shipped file with other cells in a row."""
    data = copy.deepcopy(SHIPPED)
    (row,) = (row for row in data["fact"] if row["key"] == key)
    row.update(cells)
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
        (MEAN, {"unit": "km/h"}, "head_speed: its numbers are in `m/s`, not in `km/h`"),
        (MEAN, {"rule": "mode"}, "'mode' is not a valid Rule"),
        (MEAN, {"use": "sets"}, "head_speed: what sets a parameter names it"),
        (MEAN, {"parameter": "tone"}, "head_speed: what sets a parameter names it"),
        (INTERVAL, {"low": 30.0}, "dummy_head_force: its mean is not within 30 to 24.5"),
        ("head_odds_sideways", {"mean": 7.0}, "its mean is not within 1.2 to 6.3"),
        (MEAN, {"key": "pelvis_speed"}, "two facts have the same key"),
    ],
)
def test_a_fact_that_contradicts_itself_is_refused(key: str, cells: dict[str, Any], message: str):
    with pytest.raises(ValueError, match=re.escape(message)):
        parse_fall_facts(changed(key, cells))


def test_every_source_has_a_fact():
    assert {source.key for source in fall_facts().sources} == SHIPPED["source"].keys()
