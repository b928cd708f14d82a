"""A person of a study is the one that `mover person` writes."""

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
from generator.study.person_figure import make_person
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
