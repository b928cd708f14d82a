"""Capsules that touch: nearest points, energy, momentum, power; the pairs of a figure."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator import read_figure
from generator.contact.self_contact import (
    BLEND_LENGTH,
    LIMB_SURFACE,
    Capsule,
    CapsuleForce,
    CapsulePair,
    capsule_force,
    capsule_pairs,
    unjoined_pairs,
)
from generator.rotations import Array, matrix_from_axis_angle, matrix_from_xyz
from springs.backends import FLOATS
from springs.contact import Surface
from tests.contact_figures import two_segments, vectors

ELASTIC = Surface(stiffness=2e4, damping=0.0, friction=0.0)
ROUGH = Surface(stiffness=2e4, damping=0.7, friction=0.5)
POSES = {name: np.eye(4) for name in ("first", "second", "third")}


@dataclass(frozen=True)
class Meeting:
    """Two capsules in motion, in any axes."""

    between: tuple[float, ...]
    half_lines: tuple[tuple[float, ...], tuple[float, ...]]
    velocity: tuple[float, ...]
    spins: tuple[tuple[float, ...], tuple[float, ...]]
    radii: tuple[float, float]
    overlap: float

    def force(self, surface: Surface = ROUGH, **changes) -> CapsuleForce:
        """The force where the capsules overlap by `overlap` [m]."""
        inputs = {
            "between": self.between,
            "half_lines": self.half_lines,
            "velocity": self.velocity,
            "spins": self.spins,
            **changes,
        }
        return capsule_force(
            surface, self.reach, self.radii[0] - self.radii[1], **inputs, ops=FLOATS
        )

    @property
    def reach(self) -> float:
        return distance(self.between, self.half_lines) + self.overlap

    def turned(self, turn: Array) -> "Meeting":
        def rotate(vector):
            return tuple((turn @ vector).tolist())

        return replace(
            self,
            between=rotate(self.between),
            half_lines=tuple(map(rotate, self.half_lines)),
            velocity=rotate(self.velocity),
            spins=tuple(map(rotate, self.spins)),
        )


def distance(between, half_lines) -> float:
    """Distance of the lines, by the depth of capsules without a radius."""
    still = (0.0, 0.0, 0.0)
    found = capsule_force(ROUGH, 0.0, 0.0, between, half_lines, still, (still, still), FLOATS)
    return -found.depth


half_lines = vectors(0.4).filter(lambda half: np.linalg.norm(half) > 0.02)
meetings = st.builds(
    Meeting,
    vectors(0.5).filter(lambda between: np.linalg.norm(between) > 0.02),
    st.tuples(half_lines, half_lines),
    vectors(3.0),
    st.tuples(vectors(10.0), vectors(10.0)),
    st.tuples(st.floats(0.02, 0.2), st.floats(0.02, 0.2)),
    st.floats(0.0005, 0.03),
).filter(lambda meeting: distance(meeting.between, meeting.half_lines) > 0.01)


def scaled(force: CapsuleForce, parts) -> Array:
    return force.normal * np.array(parts)


@given(meetings)
def test_the_nearest_points_have_the_smallest_distance(meeting: Meeting):
    """No points of a grid are nearer, and some are nearly as near."""
    s, t = np.meshgrid(*[np.linspace(-1.0, 1.0, 81)] * 2, indexing="ij")
    first, second = map(np.array, meeting.half_lines)
    between = np.array(meeting.between) + t[..., None] * second - s[..., None] * first
    squares = np.sum(between**2, axis=-1) + BLEND_LENGTH**2 * (s**2 + t**2)
    found = distance(meeting.between, meeting.half_lines)
    spacing = (np.linalg.norm(first) + np.linalg.norm(second) + 2 * BLEND_LENGTH) / 80.0
    assert found <= np.sqrt(squares.min()) + 1e-9
    assert found >= np.sqrt(squares.min()) - spacing


def test_the_distance_of_crossed_and_parallel_lines():
    along, up, across = (0.3, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.25)
    assert distance(up, (along, across)) == pytest.approx(0.2, abs=1e-9)
    assert distance(up, (along, along)) == pytest.approx(0.2, abs=1e-9)
    end_to_end = distance((0.7, 0.0, 0.0), (along, along))
    assert end_to_end == pytest.approx(np.sqrt(0.1**2 + 2 * BLEND_LENGTH**2), abs=1e-9)


def test_parallel_lines_touch_in_the_middle_and_the_place_moves_continuously():
    """The moment of a capsule that is tipped out of parallel has no jump."""
    reach, still = 0.21, (0.0, 0.0, 0.0)
    moments = []
    for angle in np.linspace(-0.02, 0.02, 41).tolist():
        tipped = (0.3 * np.cos(angle), 0.3 * np.sin(angle), 0.0)
        found = capsule_force(
            ELASTIC, reach, 0.0, (0.0, 0.2, 0.0), ((0.3, 0.0, 0.0), tipped), still, (still, still)
        )
        moments.append(float(found.normal * found.second_arm[2]))
    assert moments[20] == pytest.approx(0.0, abs=1e-9)
    assert max(np.abs(np.diff(moments))) < 0.2 * max(np.abs(moments))


@given(meetings)
def test_momentum_and_angular_momentum_are_conserved(meeting: Meeting):
    """Both forces act at one point: their moments about the first middle add up to zero."""
    force = meeting.force()
    on_second = scaled(force, force.direction)
    moments = scaled(force, force.first_arm) + scaled(force, force.second_arm)
    moments += np.cross(meeting.between, on_second)
    assert moments == pytest.approx(np.zeros(3), abs=1e-9 * (1.0 + force.normal))


@given(meetings)
def test_the_power_is_that_of_the_energies(meeting: Meeting):
    """The work of the forces is taken from the energy, by the damping and by friction."""
    force = meeting.force()
    power = np.dot(scaled(force, force.direction), meeting.velocity)
    power += np.dot(scaled(force, force.first_arm), meeting.spins[0])
    power += np.dot(scaled(force, force.second_arm), meeting.spins[1])
    expected = -force.normal * force.rate - force.normal * force.friction_power
    assert power == pytest.approx(expected, abs=1e-9 * (1.0 + force.normal * 20.0))
    assert force.friction_power >= 0.0
    assert (force.normal - force.elastic) * force.rate >= 0.0


@given(meetings)
def test_the_elastic_force_is_the_slope_of_the_energy(meeting: Meeting):
    """Along any motion of both capsules, at the rate that the depth has in it."""
    force, step = meeting.force(ELASTIC), 1e-6
    ends = []
    for sign in (1.0, -1.0):
        turns = [matrix_from_axis_angle(_unit(w), np.array(sign * step * np.linalg.norm(w)))
                 for w in meeting.spins]  # fmt: skip
        halves = [turn @ half for turn, half in zip(turns, meeting.half_lines, strict=True)]
        between = np.array(meeting.between) + sign * step * np.array(meeting.velocity)
        ends.append(meeting.reach - distance(tuple(between), tuple(map(tuple, halves))))
    rate = (ends[0] - ends[1]) / (2.0 * step)
    assert force.rate == pytest.approx(rate, abs=1e-4)
    assert ELASTIC.energy(force.depth) > 0.0


def _unit(vector) -> Array:
    size = float(np.linalg.norm(vector))
    return np.array(vector) / size if size else np.array([1.0, 0.0, 0.0])


@given(meetings, vectors(np.pi))
def test_the_force_turns_with_the_capsules(meeting: Meeting, angles):
    turn = matrix_from_xyz(*angles)
    one, other = meeting.force(), meeting.turned(turn).force()
    for name in ("direction", "first_arm", "second_arm"):
        assert np.array(getattr(other, name)) == pytest.approx(
            turn @ np.array(getattr(one, name)), abs=1e-6
        )


@given(meetings)
def test_the_order_of_the_capsules_does_not_matter(meeting: Meeting):
    one = meeting.force()
    exchanged = capsule_force(
        ROUGH,
        meeting.reach,
        meeting.radii[1] - meeting.radii[0],
        tuple(-x for x in meeting.between),
        meeting.half_lines[::-1],
        tuple(-x for x in meeting.velocity),
        meeting.spins[::-1],
        FLOATS,
    )
    assert exchanged.depth == pytest.approx(one.depth, abs=1e-9)
    assert exchanged.normal == pytest.approx(one.normal, rel=1e-5, abs=1e-6)


@given(meetings)
def test_floats_and_arrays_give_the_same_numbers(meeting: Meeting):
    def array(vector):
        return tuple(np.array([x, x]) for x in vector)

    floats = meeting.force()
    arrays = capsule_force(
        ROUGH,
        np.full(2, meeting.reach),
        np.full(2, meeting.radii[0] - meeting.radii[1]),
        array(meeting.between),
        (array(meeting.half_lines[0]), array(meeting.half_lines[1])),
        array(meeting.velocity),
        (array(meeting.spins[0]), array(meeting.spins[1])),
    )
    assert arrays.normal == pytest.approx(np.full(2, floats.normal), rel=1e-9, abs=1e-12)
    for one, other in zip(arrays.second_arm, floats.second_arm, strict=True):
        assert one == pytest.approx(np.full(2, other), rel=1e-9, abs=1e-9)


def test_capsules_apart_and_lines_that_cross():
    still = (0.0, 0.0, 0.0)
    lines = ((0.3, 0.0, 0.0), (0.0, 0.3, 0.0))
    assert capsule_force(ROUGH, 0.1, 0.0, (0, 0, 0.2), lines, still, (still, still)).normal == 0.0
    crossing = capsule_force(ROUGH, 0.1, 0.0, still, lines, (0.1, 0.2, 0.3), (still, still))
    assert np.all(np.isfinite([*crossing.direction, *crossing.first_arm, *crossing.second_arm]))


# Pairs of a figure


def test_the_pairs_of_the_prototype():
    """All but the nine pairs that a joint connects."""
    figure = read_figure("prototype")
    pairs = list(unjoined_pairs(figure))
    assert len(pairs) == 45 - 9
    assert ("lower_torso", "left_lower_leg") in pairs or ("left_lower_leg", "lower_torso") in pairs
    assert not any({"left_upper_leg", "left_lower_leg"} == set(pair) for pair in pairs)


def test_what_overlaps_at_the_start_does_not_count():
    figure = two_segments()
    capsules = {
        "first": Capsule((0.0, 0.0, 0.0), (0.2, 0.0, 0.0), 0.1),
        "third": Capsule((0.0, 0.15, 0.0), (0.0, 0.0, 0.2), 0.08),
    }
    (pair,) = capsule_pairs(figure, capsules, POSES)
    assert {pair.first, pair.second} == {"first", "third"}
    assert pair.reach == pytest.approx(0.15, abs=1e-9)
    far = {**POSES, "third": np.eye(4)}
    far["third"][1, 3] = 1.0
    (pair,) = capsule_pairs(figure, capsules, far)
    assert pair.reach == pytest.approx(0.18)


def test_segments_without_a_capsule_and_joined_ones_do_not_touch():
    figure, capsule = two_segments(), Capsule((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), 0.1)
    assert capsule_pairs(figure, {"first": capsule}, POSES) == ()
    assert capsule_pairs(figure, {"first": capsule, "second": capsule}, POSES) == ()
    pairs = capsule_pairs(figure, dict.fromkeys(POSES, capsule), POSES)
    assert [type(pair) for pair in pairs] == [CapsulePair]


def test_two_limbs_are_half_as_stiff_as_one_on_the_floor():
    assert LIMB_SURFACE.stiffness == pytest.approx(0.5 * Surface().stiffness)
    assert LIMB_SURFACE.source
