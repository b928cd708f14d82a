"""A person of a study is the one that `mover person` writes."""

from dataclasses import replace

import pytest

from generator.contact.spheres import fit_contact_spheres
from generator.diagnostics import UsageError
from generator.figure_file.read import read_figure
from generator.model import contact_of_figure
from generator.person.joints import Neck
from generator.person.measures import estimate_measures
from generator.person.person import build_person
from generator.person.survey import Sex
from generator.springs_file.read import read_springs
from generator.study.person_figure import _make_body, make_person
from generator.study.study import PersonArguments


@pytest.mark.parametrize(
    ("springs", "choice"), [("published", None), ("coupled", None), ("riener", "riener")]
)
def test_springs_are_those_of_the_shipped_person(springs: str, choice: str | None) -> None:
    shipped = read_springs(choice, read_figure("male50"))
    person = PersonArguments(Sex.MALE, 1.756, 85.5, springs)
    made = make_person(person, with_spheres=False).springs
    assert made.joints == shipped.joints
    assert made.coupled == shipped.coupled


def test_contact_spheres_are_those_of_the_shipped_surfaces() -> None:
    shipped = read_figure("male50")
    person = PersonArguments(Sex.MALE, 1.756, 85.5, "none")
    made = make_person(person, with_spheres=True, stops_edges=True)
    assert made.contact is not None
    assert made.contact.parts == contact_of_figure(shipped).parts
    assert {name: fit.spheres for name, fit in fit_contact_spheres(made.figure).items()} == {
        name: fit.spheres for name, fit in fit_contact_spheres(shipped).items()
    }


def test_measured_dimension_changes_the_figure() -> None:
    person = PersonArguments(Sex.FEMALE, 1.63, 68.0, "none")
    plain, large = (
        make_person(person, measured, with_spheres=False).figure
        for measured in ({}, {"foot_length": 0.28})
    )
    assert plain != large
    assert plain.total_mass == pytest.approx(68.0)
    assert large.total_mass == pytest.approx(68.0)


def test_springs_alone_leave_the_figure_as_it_was() -> None:
    person = PersonArguments(Sex.MALE, 1.8, 80.0)
    first, other = (
        make_person(one, with_spheres=False) for one in (person, replace(person, hip_datum=0.2))
    )
    assert other.figure is first.figure
    assert other.springs != first.springs
    _make_body.cache_clear()
    fresh = make_person(person, with_spheres=False)
    assert fresh.figure == first.figure
    assert fresh.springs == first.springs


def test_impossible_person() -> None:
    with pytest.raises(UsageError, match="a mass of"):
        make_person(PersonArguments(Sex.MALE, 1.75, 5.0), with_spheres=False)
    with pytest.raises(UsageError, match="published, riener, coupled, none"):
        make_person(PersonArguments(Sex.MALE, 1.75, 75.0, "soft"), with_spheres=False)
    with pytest.raises(UsageError, match="the hip datum is from 0 to 15 deg"):
        make_person(PersonArguments(Sex.MALE, 1.75, 75.0, hip_datum=0.3), with_spheres=False)


@pytest.mark.parametrize("neck", Neck)
def test_neck_is_that_of_build_person(neck: Neck) -> None:
    made = make_person(PersonArguments(Sex.MALE, 1.756, 85.5, neck=neck), with_spheres=False)
    whole = build_person(estimate_measures(Sex.MALE, 1.756, 85.5), neck=neck).model
    assert made.figure.joints == whole.figure.joints
    assert made.springs.joints["neck"] == whole.springs.joints["neck"]
    assert bool(made.springs.joints["neck"].translations) is (neck is Neck.ELASTIC)


def test_elastic_neck_without_springs() -> None:
    person = PersonArguments(Sex.MALE, 1.75, 75.0, "none", neck=Neck.ELASTIC)
    with pytest.raises(UsageError, match="an elastic neck needs springs"):
        make_person(person, with_spheres=False)
