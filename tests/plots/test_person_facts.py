"""The facts against which a person is tested."""

import copy
import tomllib
from importlib.resources import files
from typing import Any

import pytest

from generator.person.body import LIMB_SEGMENTS, TRUNK_SEGMENTS
from generator.person.survey import Sex
from plots.person_facts import parse_person_facts, person_facts
from plots.plate import ClaimKind, Outcome


@pytest.fixture
def data() -> dict[str, Any]:
    text = files("plots").joinpath("data/person_facts.toml").read_text(encoding="utf-8")
    return copy.deepcopy(tomllib.loads(text))


def test_units() -> None:
    facts = person_facts()
    mass, *moments = facts.segments[Sex.MALE].segments["upper_leg"]
    assert (mass, moments) == (10.36, pytest.approx([0.19978, 0.19994, 0.04134]))
    man = facts.men[0]
    assert (man.stature, man.mass) == pytest.approx((1.834, 78.7), rel=5e-4)
    assert man.postures["standing"].moments == pytest.approx((14.91, 13.45, 1.48), abs=6e-3)
    assert 1.0 - man.postures["standing"].centre_depth / man.stature == pytest.approx(0.554, 1e-3)


def test_the_segments_are_those_of_a_person_and_sum_to_its_mass() -> None:
    for means in person_facts().segments.values():
        assert set(means.segments) == {*TRUNK_SEGMENTS, *LIMB_SEGMENTS}
        sides = {name: 2.0 if name in LIMB_SEGMENTS else 1.0 for name in means.segments}
        total = sum(sides[name] * row[0] for name, row in means.segments.items())
        assert total == pytest.approx(means.mass, rel=1e-2)
        for _, *moments in means.segments.values():
            assert max(moments) < sum(moments) - max(moments)


def test_a_fact_compares() -> None:
    fact = person_facts().facts["knee_ratio"]
    assert fact.value_text == "1.678 ± 0.09"
    claim = fact.compare("x", 2.0, "too free")
    assert (claim.kind, claim.outcome) == (ClaimKind.COMPARISON, Outcome.DIFFERS)
    assert fact.compare("x", 1.6).outcome is Outcome.AGREES


def test_a_value_outside_its_band_is_refused(data: dict[str, Any]) -> None:
    data["fact"][0]["value"] = 5.0
    with pytest.raises(ValueError, match="segment_difference"):
        parse_person_facts(data)


def test_a_key_is_unique(data: dict[str, Any]) -> None:
    data["fact"].append(data["fact"][0])
    with pytest.raises(ValueError, match="same key"):
        parse_person_facts(data)


def test_a_source_must_exist(data: dict[str, Any]) -> None:
    del data["source"]["kim_1996"]
    with pytest.raises(KeyError, match="kim_1996"):
        parse_person_facts(data)
