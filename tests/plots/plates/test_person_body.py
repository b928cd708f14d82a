"""The plate of whole persons: postures, ratios, and dimensions read from surfaces."""

from dataclasses import replace

import numpy as np
import pytest

from generator.kinematics.centre_of_mass import segment_masses
from generator.person.measures import Sex
from plots.plate import Outcome
from plots.plates.person_body import DIMENSIONS, MEASURED_POSTURES, SITTING, STANDING, WholePerson
from plots.whole_body import mass_properties
from tests.plots.drawn import data, maker, plate


def man() -> WholePerson:
    return data("person_body").mean(Sex.MALE)


def test_the_centre_of_mass_agrees() -> None:
    claims = [c for c in plate("person_body").claims if "centre of mass" in c.sentence]
    assert len(claims) == 2 + len(MEASURED_POSTURES)
    assert all(claim.outcome is Outcome.AGREES for claim in claims)


def test_what_differs_says_why() -> None:
    for claim in plate("person_body").claims:
        assert bool(claim.explanation) == (claim.outcome is not Outcome.AGREES), claim.sentence


def test_postures_lead_where_they_are_named() -> None:
    poses = {name: man().poses(posture) for name, posture in MEASURED_POSTURES.items()}
    shoulder, hand = (poses["arms_up"][f"left_{name}"][:3, 3] for name in ("upper_arm", "hand"))
    assert hand[1] > shoulder[1] + 0.4
    assert hand[0] == pytest.approx(shoulder[0], abs=1e-9)
    spread = poses["spread"]
    assert spread["left_hand"][0, 3] > 0.5 > -0.5 > spread["right_hand"][0, 3]
    assert spread["left_foot"][0, 3] > 0.4
    sitting = man().poses(SITTING)
    assert sitting["left_lower_leg"][1, 3] == pytest.approx(sitting["left_upper_leg"][1, 3])
    assert sitting["left_lower_leg"][2, 3] > 0.35
    assert sitting["left_foot"][1, 3] < sitting["left_lower_leg"][1, 3] - 0.35


def test_the_long_axis_is_vertical() -> None:
    """A standing man resists a turn about it least, and one about z about as one about x."""
    lateral, long, forward = np.diag(man().whole({}).inertia)
    assert long < 0.2 * lateral < lateral < 1.1 * forward


def test_dimensions_lie_within_the_body() -> None:
    dimensions = man().dimensions
    assert 0.49 < dimensions["sitting_height"] / man().person.measures.stature < 0.56
    assert 0.98 < dimensions["span"] / man().person.measures.stature < 1.1
    hand = man().poses({})["left_hand"][1, 3]
    assert dimensions["wrist_height"] == pytest.approx(hand)


def test_a_measured_man_of_twice_the_inertia_differs() -> None:
    def twice(measured):
        postures = {
            name: replace(one, moments=tuple(2.0 * moment for moment in one.moments))
            for name, one in measured.postures.items()
        }
        return replace(measured, postures=postures)

    wrong = replace(
        data("person_body"),
        men=tuple((twice(measured), person) for measured, person in data("person_body").men),
    )
    ratios = wrong.inertia_ratios(STANDING)
    assert ratios == pytest.approx(0.5 * data("person_body").inertia_ratios(STANDING))
    claims = [
        c for c in maker("person_body").build(wrong).claims if "moment of inertia" in c.sentence
    ]
    assert all(claim.outcome is Outcome.DIFFERS for claim in claims)


def test_the_mass_is_the_person_s() -> None:
    figure = man().person.figure
    assert segment_masses(figure).total == pytest.approx(man().person.measures.mass)
    assert mass_properties(figure, man().poses({})).mass == pytest.approx(85.5, abs=0.1)


def test_the_tables_have_every_dimension() -> None:
    tables = plate("person_body").tables
    assert len(tables["dimensions"]) == 2 * len(DIMENSIONS)
    assert {len(column) for column in tables["postures"].values()} == {3}
