"""Kinds of fall: starts within their ranges, outside all props, and what a fall touches."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from math import degrees, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator import Figure, Integrator, Plan, Recording, Sex, read_figure, simulate
from generator.diagnostics import ModelError, UnknownNameError
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.person.measures import estimate_measures
from generator.person.person import build_person
from generator.recording import RecordingPart
from generator.rotations import rotation_vector_from_matrix
from generator.run_options import RUN_OPTIONS
from generator.simulation.falls import FALLS, Range, fall_plan
from generator.simulation.run_model import InitialState, initial_state

MAN = read_figure("male50")
TREE = build_tree(MAN)
UPRIGHT = forward_kinematics(TREE, initial_displacements(TREE))
SEEDS = st.integers(0, 2**32)
KINDS = st.sampled_from(list(FALLS))


@cache
def person(sex: Sex, stature: float, mass: float) -> Figure:
    return build_person(estimate_measures(sex, stature, mass), springs="none").figure


@cache
def start(kind: str, seed: int) -> InitialState:
    return initial_state(MAN, fall_plan(MAN, kind, seed))


def turn(kind: str, seed: int, segment: str) -> np.ndarray:
    """Rotation vector of a segment at the start of a fall from the upright man [rad]."""
    displaced = fall_plan(MAN, kind, seed).displacements
    pose = {**UPRIGHT.displacements, **{name: np.array(q) for name, q in displaced.items()}}
    moved = forward_kinematics(UPRIGHT.tree, pose).poses[segment][:3, :3]
    return rotation_vector_from_matrix(moved @ UPRIGHT.poses[segment][:3, :3].T)


def test_the_command_names_all_kinds():
    assert RUN_OPTIONS["fall"].metavar == "|".join(FALLS)


@given(KINDS, SEEDS)
@settings(max_examples=8)
def test_a_seed_is_one_start_bit_for_bit_and_another_seed_another(kind: str, seed: int):
    one, same, other = (fall_plan(MAN, kind, each) for each in (seed, seed, seed + 1))
    assert one == same
    assert one.displacements != other.displacements
    assert (one.free_root, one.stop, one.height) == (True, 2.0, FALLS[kind].height)


def test_a_fall_is_a_start_of_its_own_for_each_kind():
    plans = [fall_plan(MAN, kind, 0) for kind in FALLS]
    assert all(one != other for k, one in enumerate(plans) for other in plans[:k])


def within(value: float, bounds: Range) -> bool:
    return bounds[0] - 1e-9 <= value <= bounds[1] + 1e-9


@given(KINDS, SEEDS)
@settings(max_examples=12)
def test_the_start_is_within_the_ranges_of_its_kind(kind: str, seed: int):
    fall, state = FALLS[kind], start(kind, seed)
    knees = [state.placement.displacements[f"{side}_knee"][0] for side in ("left", "right")]
    assert all(within(knee, fall.knees) for knee in knees)
    lean = turn(kind, seed, "lower_torso")
    assert lean[1] == pytest.approx(0.0, abs=1e-9)  # about a horizontal axis
    least, largest = sorted(abs(np.array(fall.lean)))
    assert within(float(np.linalg.norm(lean)), (least, largest))
    pushed = np.array(fall_plan(MAN, kind, seed).velocities["lower_torso"][3:])
    assert within(float(np.linalg.norm(pushed)), fall.speed)
    if np.linalg.norm(pushed) > 0.0:
        direction = np.arctan2(pushed[0], pushed[2])
        low, high = fall.direction
        assert within((direction - low) % (2.0 * pi) + low, (low, high))


@given(st.sampled_from(["push", "trip", "stairs", "seat"]), SEEDS)
@settings(max_examples=6)
def test_bent_knees_turn_neither_the_trunk_nor_the_soles(kind: str, seed: int):
    """But for legs that are spread by 2 deg, about which hips and ankles bend."""
    assert turn(kind, seed, "upper_torso") == pytest.approx(np.zeros(3), abs=1e-9)
    for foot in ("left_foot", "right_foot"):
        assert turn(kind, seed, foot) == pytest.approx(np.zeros(3), abs=0.01)


def test_leans_go_in_all_directions():
    leans = np.array([turn("faint", seed, "lower_torso") for seed in range(40)])
    forward, left = leans[:, 0] > 0.0, leans[:, 2] < 0.0
    for quadrant in (forward & left, forward & ~left, ~forward & left, ~forward & ~left):
        assert 3 <= quadrant.sum() <= 20


def feet_velocity(kind: str, seed: int) -> np.ndarray:
    """Mean velocity of the ankles at the start of a fall, by a central difference [m/s]."""
    state, interval = start(kind, seed), 1e-5
    places = [
        forward_kinematics(
            state.placement.tree,
            {
                name: values + sign * interval * state.rates[name]
                for name, values in state.placement.displacements.items()
            },
        ).poses
        for sign in (1.0, -1.0)
    ]
    feet = [
        np.mean([one[f"{side}_foot"][:3, 3] for side in ("left", "right")], 0) for one in places
    ]
    return (feet[0] - feet[1]) / (2.0 * interval)


@pytest.mark.parametrize(("kind", "speed"), [("slip", 1.0), ("trip", 1.2), ("faint", 0.0)])
def test_the_feet_start_at_the_speed_of_the_kind(kind: str, speed: float):
    """Ankles are nearer to the hips than the soles, by a tenth of the leg."""
    velocity = feet_velocity(kind, 0)
    assert float(np.linalg.norm(velocity)) == pytest.approx(speed, rel=0.12)
    assert abs(velocity[0]) <= 0.2 * speed + 1e-9


PEOPLE = [(Sex.MALE, 1.95, 70.0), (Sex.FEMALE, 1.5, 80.0), (Sex.MALE, 1.7, 120.0)]


@pytest.mark.parametrize("kind", FALLS)
def test_starts_are_outside_all_props(kind: str):
    """An `initial_state` inside a prop raises ModelError."""
    figures = [MAN, read_figure("female50"), read_figure("prototype")]
    for figure in (*figures, *(person(*one) for one in PEOPLE)):
        for seed in range(2):
            initial_state(figure, fall_plan(figure, kind, seed))


@pytest.mark.parametrize("kind", ["trip", "stairs"])
def test_props_are_as_far_from_the_toes_of_all_people(kind: str):
    plans = [fall_plan(person(*one), kind, 0) for one in PEOPLE]
    places = [[prop.shape.pose[2, 3] for prop in plan.scene.props[1:]] for plan in plans]
    gaps = np.diff(places)
    assert gaps == pytest.approx(np.broadcast_to(gaps[0], gaps.shape))
    assert len({round(place[0], 6) for place in places}) == len(PEOPLE)


@pytest.mark.parametrize(
    ("figure", "kind", "message"),
    [
        ("male50", "fant", "unknown kind of fall `fant`; did you mean `faint`?"),
        ("pendulum", "faint", "only a person falls so: the figure has no joint `left_hip_joint`"),
    ],
)
def test_other_kinds_and_figures_are_refused(figure: str, kind: str, message: str):
    error = UnknownNameError if figure == "male50" else ModelError
    with pytest.raises(error) as raised:
        fall_plan(read_figure(figure), kind)
    assert str(raised.value).startswith(message)


# Falls


@cache
def fall(kind: str, seed: int = 0) -> Recording:
    plan = replace(fall_plan(MAN, kind, seed), integrator=Integrator.IMPLICIT)
    parts = {RecordingPart.CONTACT}
    recording = simulate(MAN, plan, record=parts)
    assert recording.outcome.succeeded
    return recording


def touches(recording: Recording) -> Mapping[str, float]:
    """First touch of each segment, infinite without one [s]."""
    assert recording.contact is not None
    times = {name: one.first_time for name, one in recording.contact.segments.items()}
    return {name: np.inf if time is None else time for name, time in times.items()}


def test_a_backward_slip_lands_on_the_pelvis_and_hands_before_the_head():
    recording, first = fall("slip"), touches(fall("slip"))
    assert max(first["lower_torso"], first["left_hand"]) < first["head"] < np.inf
    assert first["lower_torso"] < min(first["left_lower_leg"], first["right_lower_leg"])
    place = {name: pose[-1, :3, 3] for name, pose in recording.poses.items()}
    assert place["head"][2] < place["lower_torso"][2] < place["left_foot"][2]


def test_a_trip_lands_ahead_on_shins_and_hands_before_pelvis_and_head():
    recording, first = fall("trip"), touches(fall("trip"))
    shins = min(first["left_lower_leg"], first["right_lower_leg"])
    assert shins < min(first["left_hand"], first["right_hand"]) < first["head"] < np.inf
    assert shins < first["lower_torso"]
    place = {name: pose[-1, :3, 3] for name, pose in recording.poses.items()}
    assert place["head"][2] > place["lower_torso"][2] > place["left_foot"][2]


def test_on_stairs_the_body_goes_down_and_ahead():
    recording = fall("stairs")
    assert recording.centre_of_mass[-1, 1] < recording.centre_of_mass[0, 1] - 1.0
    assert recording.centre_of_mass[-1, 2] > recording.centre_of_mass[0, 2] + 0.5


@pytest.mark.parametrize("kind", ["faint", "push"])
def test_a_fall_ends_on_the_floor(kind: str):
    for seed in range(3):
        recording, first = fall(kind, seed), touches(fall(kind, seed))
        assert recording.centre_of_mass[-1, 1] < 0.25
        assert first["left_foot"] < 0.1
        assert min(first["left_hand"], first["right_hand"]) < first["head"]


def test_off_the_bed_the_body_falls_to_its_right():
    recording = fall("bed")
    assert recording.centre_of_mass[0, 1] > 0.55
    assert recording.centre_of_mass[-1, 1] < 0.25
    assert recording.centre_of_mass[-1, 0] < -0.2


def test_on_the_seat_the_body_sits():
    recording, first = fall("seat"), touches(fall("seat"))
    assert first["lower_torso"] < first["head"]
    assert 0.4 < recording.centre_of_mass[-1, 1] < 0.8
    assert recording.centre_of_mass[-1, 2] < -0.2


def test_the_floor_of_a_slip_is_slippery():
    frictions = {kind: fall_plan(MAN, kind).scene.props[0].surface.friction for kind in FALLS}
    assert frictions.pop("slip") == 0.2
    assert set(frictions.values()) == {0.6}


def test_other_fields_of_the_plan_can_be_changed():
    changed = replace(fall_plan(MAN, "faint", 3), stop=0.1)
    assert isinstance(changed, Plan)
    assert simulate(MAN, changed).times[-1] == pytest.approx(0.1)
    assert degrees(changed.displacements["left_knee"][0]) > 5.0
