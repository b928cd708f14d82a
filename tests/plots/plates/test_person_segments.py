"""The plate of a person's segments, against differences computed here."""

from dataclasses import replace

import numpy as np
import pytest

from generator.person.body import build_body
from generator.person.measures import Sex, estimate_measures
from plots.person_facts import person_facts
from plots.plate import Outcome
from plots.plates.person_segments import SEGMENTS, claims, differences, leg_factor
from tests.plots.drawn import plate


def outcomes(name: str) -> dict[str, list[Outcome]]:
    drawn = plate("person_segments").claims
    return {
        word: [claim.outcome for claim in drawn if claim.sentence.startswith(f"The {word}")]
        for word in ("man", "woman")
    }[name]


def test_the_man_agrees_but_for_his_legs() -> None:
    assert outcomes("man") == [Outcome.AGREES, Outcome.AGREES, Outcome.DIFFERS]


def test_what_differs_says_why() -> None:
    for claim in plate("person_segments").claims:
        assert bool(claim.remark) == (claim.outcome is Outcome.DIFFERS)


def test_the_legs_differ_by_the_square_of_their_factor() -> None:
    for sex, means in person_facts().segments.items():
        found = differences(sex, means)
        legs = np.concatenate([found[name][1:] for name in ("upper_leg", "lower_leg")])
        assert legs == pytest.approx(100.0 * (leg_factor(sex) ** 2 - 1.0), abs=1.5)


def test_the_axes_of_hand_and_foot_are_those_of_the_table() -> None:
    """The heel-to-toe axis has the least moment of a foot, the hand's length that of a hand."""
    means = person_facts().segments[Sex.MALE]
    body = build_body(estimate_measures(Sex.MALE, means.stature, means.mass))
    assert np.argmin(body.segments["foot"].inertia) == 0
    assert np.argmin(body.segments["hand"].inertia) == 2
    for name in ("hand", "foot"):
        assert means.segments[name][3] == min(means.segments[name][1:])


def test_a_heavier_mean_is_found() -> None:
    means = person_facts().segments[Sex.MALE]
    mass, *moments = means.segments["hand"]
    wrong = replace(means, segments={**means.segments, "hand": (1.1 * mass, *moments)})
    found = list(claims(Sex.MALE, differences(Sex.MALE, wrong)))
    assert found[0].outcome is Outcome.DIFFERS
    assert "hand" in found[0].remark


def test_the_table_has_every_segment() -> None:
    (table,) = plate("person_segments").tables.values()
    assert {len(column) for column in table.values()} == {len(SEGMENTS)}
    assert len(table) == 8
