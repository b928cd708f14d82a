"""The plate of a collapse on a floor: its claims, marks and tables, against the motion."""

from dataclasses import replace

import numpy as np
import pytest

from generator.contact.record import SegmentContact
from plots.plates.fall_on_floor import Collapse, contact_groups
from tests.plots.drawn import data, maker, plate

pytestmark = pytest.mark.slow
"""They share the drawing of the plate with the test of the gallery, which checks its claims."""


@pytest.fixture(scope="module")
def made() -> Collapse:
    return data("fall_on_floor")


@pytest.fixture(scope="module")
def drawn():
    return plate("fall_on_floor")


def panel(drawn, label: str):
    (found,) = [axes for axes in drawn.figure.axes if label in axes.get_ylabel()]
    return found


def test_gravity_is_that_of_the_drawn_height(made, drawn) -> None:
    columns = drawn.tables["fall_on_floor"]
    height = columns["height of the centre of mass [m]"]
    assert columns["gravity [J]"] - columns["gravity [J]"][0] == pytest.approx(
        made.weight * (height - height[0]), abs=1e-6
    )
    assert made.exchanged_energy == pytest.approx(made.weight * np.ptp(height))


def test_the_stack_is_as_high_as_its_sum(made, drawn) -> None:
    axes = panel(drawn, "energy [J]")
    (line,) = [each for each in axes.lines if each.get_label() == "sum: constant"]
    total = np.asarray(line.get_ydata())
    assert np.ptp(total) < 1e-6 * made.exchanged_energy
    top = max(path.vertices[:, 1].max() for each in axes.collections for path in each.get_paths())
    assert top == pytest.approx(total.max(), rel=1e-6)


def test_every_segment_that_touches_is_named_once(made, drawn) -> None:
    names = [
        name
        for text in panel(drawn, "reaction").texts
        for name in text.get_text().split("\n")
        if name.strip() != "weight"
    ]
    touched = [name for name, one in made.contact.segments.items() if one.first_time is not None]
    assert sorted(names) == sorted(name.replace("_", " ") for name in touched)


def test_first_contacts_at_about_the_same_time_share_a_mark(made) -> None:
    times = {"a": 0.5, "b_c": 0.0, "d": 0.55, "e": None, "f": 0.6}
    segments = {
        name: SegmentContact(time, 1.0, 2.0, 0.5, (0.0, 0.0, 0.0)) for name, time in times.items()
    }
    zeros = {name: np.zeros(1) for name in times}
    contact = replace(made.contact, segments=segments, forces=zeros, depths=zeros)
    assert list(contact_groups(contact)) == [(0.0, ["b c"]), (0.5, ["a", "d"]), (0.6, ["f"])]


def test_a_wrong_run_fails_its_claims(made) -> None:
    """Energy that vanishes, an impulse left out, an estimate too small, a floor too weak."""
    run, contact = made.run, made.contact
    energy = {**run.energy, "friction": 0.9 * run.energy["friction"]}
    first = next(iter(contact.segments))
    segments = {**contact.segments, first: replace(contact.segments[first], impulse=(0.0, 0, 0))}
    assert run.accuracy.estimate is not None
    accuracy = replace(run.accuracy, estimate=0.01 * run.accuracy.estimate)
    weak = replace(contact, segments=segments, weight_carried=0.98)
    wrong = replace(run, energy=energy, accuracy=accuracy, contact=weak, agreement_with_exudyn=1e-7)
    failing = [
        not claim.holds for claim in maker("fall_on_floor").build(replace(made, run=wrong)).claims
    ]
    assert failing == [True, True, True, True, False, True, False]
