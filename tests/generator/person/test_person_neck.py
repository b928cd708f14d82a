"""The elastic neck of a person: its translations, in statics, motion and both models."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest

from generator import Model, Plan, Recording, Stepper, build_person, fall_plan, simulate
from generator.figure import is_rotation
from generator.figure_file.read import FIGURE_FILE
from generator.figure_file.write import write_figure
from generator.kinematics.effective_mass import head_effective_masses
from generator.person.joints import NECK_SLIDES, SLIDING_JOINT, Neck
from generator.person.measures import estimate_measures
from generator.person.person import Person
from generator.person.sources import Origin
from generator.person.survey import Sex
from generator.recording import Ending
from generator.run_options import Integrator
from generator.simulation.statics.equilibrium import find_equilibrium
from generator.tone import Tone
from springs import Linear
from tests.runs import energy_error

G = 9.81
STIFFNESS = (20e3, 20e3, 200e3)


def person(neck: Neck) -> Person:
    return build_person(estimate_measures(Sex.MALE, 1.756, 85.5), neck=neck)


@pytest.fixture(scope="module")
def elastic() -> Person:
    return person(Neck.ELASTIC)


@pytest.fixture(scope="module")
def rigid() -> Person:
    return person(Neck.RIGID)


def head_mass(who: Person) -> float:
    return who.body.segments["head"].mass


def test_an_elastic_neck_has_three_translations_outside_its_rotations(
    elastic: Person, rigid: Person
) -> None:
    joints = [who.figure.joints[SLIDING_JOINT] for who in (rigid, elastic)]
    assert joints[1].chain[:3] == joints[0].chain
    assert [axis.axis for axis in joints[1].chain[3:]] == [slide.axis for slide in NECK_SLIDES]
    assert not any(is_rotation(axis.kind) for axis in joints[1].chain[3:])
    assert joints[1].displacement == (0.0,) * 6
    others = [
        {name: joint for name, joint in who.figure.joints.items() if name != SLIDING_JOINT}
        for who in (rigid, elastic)
    ]
    assert others[0] == others[1]
    read = FIGURE_FILE.parse_text(write_figure(elastic.figure)).require_value()
    assert read.joints[SLIDING_JOINT].chain == joints[1].chain
    assert read.joints[SLIDING_JOINT].upper_limit == joints[1].upper_limit


def test_its_springs_are_linear_and_damped_by_the_ratio_of_the_head(elastic: Person) -> None:
    springs = elastic.model.springs.joints[SLIDING_JOINT]
    assert len(springs.axes) == 3
    for spring, slide, stiffness in zip(springs.translations, NECK_SLIDES, STIFFNESS, strict=True):
        assert spring.direction == slide.axis
        assert spring.motion == slide.motion
        assert spring.elastic[0] == Linear(stiffness)
        viscous = 2.0 * 0.1 * (stiffness * head_mass(elastic)) ** 0.5
        assert spring.damping.viscous == pytest.approx(viscous, rel=1e-4)
        assert spring.reference.startswith("An estimate")
        assert "not fitted" in spring.why or "As forward" in spring.why


def test_its_numbers_have_sources(elastic: Person) -> None:
    rows = {one.quantity: one for one in elastic.sources if one.part == SLIDING_JOINT}
    for slide, stiffness in zip(NECK_SLIDES, STIFFNESS, strict=True):
        row = rows[f"{slide.motion}: stiffness"]
        assert (row.value, row.unit, row.origin) == (stiffness, "N/m", Origin.ESTIMATE)
        assert rows[f"{slide.motion}: viscous damping"].unit == "N s/m"
        assert rows[f"{slide.motion}: limit in both senses"].value == 0.04


@pytest.mark.parametrize("up", [1.0, -1.0], ids=["hanging", "standing"])
def test_the_weight_of_the_head_shifts_it_by_mg_over_k(elastic: Person, up: float) -> None:
    locked = tuple(name for name in elastic.figure.joints if name != SLIDING_JOINT)
    rest = find_equilibrium(elastic.model, Plan(gravity=(0.0, up * G, 0.0), locked=locked))
    expected = [0.0] * 5 + [up * head_mass(elastic) * G / STIFFNESS[2]]
    assert rest.displacements[SLIDING_JOINT] == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_lying_down_the_head_sags_by_mg_over_k_in_shear(elastic: Person) -> None:
    """With rotations that no torque moves: gravity acts at the height of the joint."""
    figure = elastic.figure
    joint = figure.joints[SLIDING_JOINT]
    head = figure.segments["head"]
    sites = {
        **head.sites,
        "CM": replace(head.sites["CM"], location=head.sites["proximal"].location),
    }
    centred = figure.with_parts(replace(head, sites=sites))
    assert joint.child.site == "proximal"
    locked = tuple(name for name in figure.joints if name != SLIDING_JOINT)
    for gravity, index in (((0.0, 0.0, G), 3), ((G, 0.0, 0.0), 4)):
        rest = find_equilibrium(
            Model(centred, elastic.model.springs), Plan(gravity=gravity, locked=locked)
        )
        expected = [0.0] * 6
        expected[index] = head_mass(elastic) * G / STIFFNESS[0]
        assert rest.displacements[SLIDING_JOINT] == pytest.approx(expected, rel=1e-9, abs=1e-9)


BLOW = {
    SLIDING_JOINT: (0.4, -0.5, 0.8, 0.3, 0.2, -0.5),
    "waist": (0.5, 0.2, -1.0),
    "left_shoulder": (1.0, 2.0, 0.5),
    "right_knee": (1.5,),
}
"""Rates with which a motion starts [rad/s or m/s]."""


def motion(who: Person, **fields: object) -> Recording:
    plan = replace(Plan(stop=0.2, velocities=BLOW, free_root=True), **fields)
    return simulate(who.model, plan)


@pytest.mark.parametrize(
    "tone",
    [None, Tone(hold={"all": 0.1}, righting={"neck": 0.5, "trunk": 0.5})],
    ids=["limp", "tone"],
)
def test_it_moves_as_exudyn_says(elastic: Person, tone: Tone | None) -> None:
    run = motion(elastic, tone=tone)
    assert run.outcome.ending is Ending.DONE
    assert run.agreement_with_exudyn is not None
    assert run.agreement_with_exudyn < 1e-10
    shifts = run.displacements[SLIDING_JOINT][:, 3:]
    assert np.ptp(shifts, axis=0).min() > 1e-4
    assert energy_error(run) < 1e-4


def test_the_methods_agree_in_a_fall(elastic: Person) -> None:
    plan = replace(fall_plan(elastic.figure, "faint", 3), stop=0.3)
    runs = [
        simulate(elastic.model, replace(plan, integrator=kind))
        for kind in (Integrator.COMPILED, Integrator.IMPLICIT)
    ]
    for run in runs:
        assert run.agreement_with_exudyn is not None
        assert run.agreement_with_exudyn < 1e-10
    neck = [run.displacements[SLIDING_JOINT][-1] for run in runs]
    assert neck[0][:3] == pytest.approx(neck[1][:3], abs=radians(0.5))
    assert neck[0][3:] == pytest.approx(neck[1][3:], abs=1e-4)


def test_a_live_run_has_its_translations(elastic: Person) -> None:
    stepper = Stepper(elastic.model, Plan(velocities=BLOW, free_root=True))
    stepper.advance(0.05)
    run = motion(elastic, stop=0.05)
    place = stepper.displacements[SLIDING_JOINT]
    assert place == pytest.approx(run.displacements[SLIDING_JOINT][-1], abs=1e-4)


def test_it_leaves_the_head_its_own_mass_in_a_blow(elastic: Person, rigid: Person) -> None:
    masses = head_effective_masses(elastic.figure)
    assert list(masses) == ["crown", "front_or_back", "side"]
    assert list(masses.values()) == pytest.approx([head_mass(elastic)] * 3, rel=1e-9)
    pushed = head_effective_masses(rigid.figure)
    assert pushed["crown"] > 10.0 * head_mass(rigid)
    assert pushed["side"] > pushed["front_or_back"] > 1.2 * head_mass(rigid)
