"""The plate of a person's pendulums, against the equations of one rigid limb."""

from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest

from generator import read_figure
from plots.person_facts import person_facts
from plots.plate import Claim, Outcome
from plots.plates.person_pendulums import (
    ELBOW,
    GRAVITY,
    KNEE,
    LIMP,
    MAN,
    RIENER,
    SETUPS,
    SITTING,
    WOMAN,
    Setup,
    Swings,
    release,
)
from plots.whole_body import mass_properties, place_in_posture
from tests.plots.drawn import data, maker, plate


def limb(setup: Setup, *segments: str) -> tuple[float, float]:
    """Inertia about the joint [kg m2], and weight times lever [N m], of segments."""
    body = read_figure(MAN.figure)
    poses = place_in_posture(body, setup.posture)
    one = mass_properties(body, poses, segments)
    joint = poses[segments[0]][:3, 3]
    axis = body.joints[setup.joint]
    turn = (poses[axis.parent.segment] @ body.site(axis.parent).pose_in_segment)[:3, :3]
    direction = turn @ np.array([0.0, 1.0, 0.0])
    lever = float(np.linalg.norm(np.cross(one.centre - joint, direction)))
    return float(direction @ one.inertia_about(joint) @ direction), GRAVITY * one.mass * lever


def claim_of(text: str) -> Claim:
    (found,) = [claim for claim in plate("person_pendulums").claims if text in claim.sentence]
    return found


@pytest.mark.slow
def test_the_limp_leg_is_a_rigid_pendulum() -> None:
    """Released at 20 deg, its period is 1 + a^2 / 16 of that of small swings."""
    leg, _ = SETUPS["leg"]
    inertia, moment = limb(leg, "left_upper_leg", "left_lower_leg", "left_foot")
    swing = data("person_pendulums").swing("leg", LIMP)
    amplitude = abs(swing.start - swing.rest)
    period = 2.0 * pi * sqrt(inertia / moment) * (1.0 + amplitude**2 / 16.0)
    assert swing.period(2) == pytest.approx(period, rel=1e-3)
    assert swing.relaxation_index == pytest.approx(2.0, abs=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "case", "setup", "segments"),
    [
        ("knee", MAN, KNEE, ("left_lower_leg", "left_foot")),
        ("elbow", MAN, ELBOW, ("left_lower_arm", "left_hand")),
    ],
)
def test_no_limb_is_faster_than_its_energy(name, case, setup, segments) -> None:
    """Gravity and the springs give the rate: at most what falling the drop gives, and half more."""
    inertia, moment = limb(setup, *segments)
    swing = data("person_pendulums").swing(name, case)
    free = sqrt(2.0 * moment * (1.0 - np.cos(swing.rest - swing.start)) / inertia)
    assert 0.7 * free < swing.peak_rates[0] < 1.5 * free


@pytest.mark.slow
def test_joints_fall_into_flexion_and_come_to_rest() -> None:
    for name in ("knee", "elbow"):
        for case in SETUPS[name][1]:
            swing = data("person_pendulums").swing(name, case)
            assert swing.start < swing.rest < swing.turning_angles[0]
            distances = np.abs(swing.turning_angles - swing.rest)
            assert np.all(distances[2:] < distances[:-2])


@pytest.mark.slow
def test_people_and_persons_swing_alike() -> None:
    for case in (MAN, WOMAN, RIENER, SITTING):
        for text in ("relaxation index", "period", "number of swings"):
            is_fast = case is WOMAN and text == "period"  # 0.992 s for 1.0 s at least
            outcome = claim_of(f"Knee of the {case.words}: {text}").outcome
            assert outcome is (Outcome.DIFFERS if is_fast else Outcome.AGREES)


@pytest.mark.slow
def test_a_hip_beyond_the_measured_range_is_too_stiff_for_the_knee() -> None:
    outcomes = [claim_of(f"hip at {hip} deg: period").outcome for hip in (60, 90)]
    assert outcomes == [Outcome.DIFFERS, Outcome.DIFFERS]


@pytest.mark.slow
def test_the_frequency_of_a_leg_with_springs_is_not_compared() -> None:
    assert claim_of("Leg of the man without springs").outcome is Outcome.AGREES
    assert claim_of("Leg of the man: ").outcome is Outcome.INCOMPARABLE


@pytest.mark.slow
def test_what_differs_says_why_and_the_index_of_the_elbow_is_not_compared() -> None:
    for claim in plate("person_pendulums").claims:
        assert bool(claim.explanation) == (claim.outcome is not Outcome.AGREES), claim.sentence
    elbow = claim_of("Elbow of the man: relaxation index")
    assert elbow.outcome is Outcome.INCOMPARABLE
    assert f"{data('person_pendulums').swing('elbow', MAN).relaxation_index:.2f}" in elbow.sentence


@pytest.mark.slow
def test_the_bands_drawn_are_those_of_the_facts() -> None:
    figure = plate("person_pendulums").figure
    (axes,) = [each for each in figure.axes if each.get_ylabel().startswith("knee: rate")]
    fact = person_facts().facts["knee_first_velocity"]
    extents = [patch.get_extents().transformed(axes.transData.inverted()) for patch in axes.patches]
    assert any(
        box.y0 == pytest.approx(fact.low) and box.y1 == pytest.approx(fact.high) for box in extents
    )


@pytest.mark.slow
def test_a_stiffer_knee_fails_its_claims() -> None:
    """A swing with a third of the times has three times the rates."""
    made = data("person_pendulums")
    swing = made.swing("knee", MAN)
    fast = replace(swing, times=swing.times / 3.0, rates=3.0 * swing.rates)
    wrong = Swings(made.man, {**made.swings, ("knee", MAN.words): fast})
    claims = {claim.sentence: claim for claim in maker("person_pendulums").build(wrong).claims}
    (period,) = [c for s, c in claims.items() if s.startswith("Knee of the man: period")]
    assert period.outcome is Outcome.DIFFERS


def test_a_release_of_the_prototype_is_a_swing() -> None:
    setup = replace(KNEE, stop=3.0, posture={})
    swing = release(read_figure("prototype"), setup, None)
    assert swing.start == 0.0
    assert 1.0 < swing.relaxation_index < 2.0
