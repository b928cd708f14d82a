"""Where a point stands over a support: against geometry without hulls, and the odd supports."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from generator.kinematics.stability import EDGE_TOLERANCE, Balance, stability

COORDINATE = st.floats(-2.0, 2.0, allow_subnormal=False)
LATTICE = st.integers(-3, 3).map(float)
FLAT = st.lists(
    st.one_of(st.tuples(COORDINATE, COORDINATE), st.tuples(LATTICE, LATTICE)),
    min_size=1,
    max_size=9,
)
PLACE = st.one_of(st.tuples(COORDINATE, COORDINATE), st.tuples(LATTICE, LATTICE))
TURN = st.tuples(*[st.floats(-3.0, 3.0)] * 3).map(lambda v: Rotation.from_rotvec(v).as_matrix())

SQUARE = np.array([[1.0, 0.0, 1.0], [-1.0, 0.0, 1.0], [-1.0, 0.0, -1.0], [1.0, 0.0, -1.0]])


def on_ground(flat, heights=0.0):
    """Points (x, z) on the ground, or over it, as points in the world."""
    flat = np.array(flat, dtype=float).reshape(-1, 2)
    return np.stack([flat[:, 0], np.broadcast_to(heights, len(flat)), flat[:, 1]], axis=-1)


def margin_by_directions(place, flat):
    """The signed distance of a place from the edge of the hull of points, without their hull.

    It is the least, over all directions u, of how far the points reach along u beyond the place.
    The least is across a line through two points or, outside, along the way from a point.
    """
    c, points = np.array(place), np.array(flat)
    arms = (points[:, None] - points[None]).reshape(-1, 2)
    across = np.stack([-arms[:, 1], arms[:, 0]], axis=-1)
    ways = np.concatenate([across, c - points])
    lengths = np.linalg.norm(ways, axis=1)
    ways = ways[lengths > 1e-12] / lengths[lengths > 1e-12, None]
    if not len(ways):
        return 0.0
    return float(np.min(np.max(ways @ points.T, axis=1) - ways @ c))


@given(PLACE, FLAT)
def test_the_margin_is_that_of_a_geometry_without_hulls(place, flat):
    found = stability(on_ground(place)[0], on_ground(flat))
    assert found.margin == pytest.approx(margin_by_directions(place, flat), abs=1e-8)


@given(PLACE, FLAT, st.lists(st.floats(-3e-9, 3e-9), min_size=18, max_size=18))
def test_points_that_nearly_coincide_do_no_harm(place, flat, jitter):
    doubled = np.repeat(np.array(flat), 2, axis=0)
    doubled += np.array(jitter[: doubled.size] + [0.0] * (doubled.size - 18)).reshape(-1, 2)
    found = stability(on_ground(place)[0], on_ground(doubled))
    assert found.margin == pytest.approx(margin_by_directions(place, flat), abs=2e-8)


@given(PLACE, FLAT)
def test_as_far_as_the_margin_says_is_the_edge(place, flat):
    points = on_ground(flat)
    found = stability(on_ground(place)[0], points)
    assume(found.direction is not None)
    moved = stability(on_ground(place)[0] + found.margin * found.direction, points)
    assert moved.balance is Balance.ON_EDGE
    beyond = stability(on_ground(place)[0] + (found.margin + 0.5) * found.direction, points)
    assert beyond.margin == pytest.approx(-0.5, abs=1e-6)
    assert beyond.balance is Balance.OUTSIDE


@given(PLACE, FLAT, st.lists(st.floats(-5.0, 5.0), min_size=10, max_size=10), TURN, PLACE)
def test_the_ground_may_be_turned_and_points_may_lie_at_any_height(place, flat, heights, turn, off):
    flattened = stability(on_ground(place)[0], on_ground(flat))
    shift = np.array([off[0], 0.3, off[1]])
    centre = turn @ (on_ground(place, heights[9])[0] + shift)
    points = (on_ground(flat, heights[: len(flat)]) + shift) @ turn.T
    turned = stability(centre, points, 2.5 * turn[:, 1])
    assert turned.margin == pytest.approx(flattened.margin, abs=1e-8)
    assert turned.area == pytest.approx(flattened.area, abs=1e-7)
    assert np.allclose(turned.corners @ turn[:, 1], 0.0, atol=1e-12)
    assert turned.centre @ turn[:, 1] == pytest.approx(0.0, abs=1e-12)
    if turned.direction is not None:
        assert turned.direction @ turn[:, 1] == pytest.approx(0.0, abs=1e-12)
        assert np.linalg.norm(turned.direction) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("place", "balance", "margin", "direction", "pivot"),
    [
        ((0.5, 0.0), Balance.INSIDE, 0.5, (1, 0, 0), {0, 3}),
        ((0.0, -0.75), Balance.INSIDE, 0.25, (0, 0, -1), {2, 3}),
        ((1.0, 0.5), Balance.ON_EDGE, 0.0, (1, 0, 0), {0, 3}),
        ((1.0 - 1e-7, 0.5), Balance.ON_EDGE, 1e-7, (1, 0, 0), {0, 3}),
        ((-1.25, 0.5), Balance.OUTSIDE, -0.25, (-1, 0, 0), {1, 2}),
        ((4.0, 5.0), Balance.OUTSIDE, -5.0, (0.6, 0, 0.8), {0}),
    ],
)
def test_a_square_by_hand(place, balance, margin, direction, pivot):
    found = stability([place[0], 7.0, place[1]], SQUARE)
    assert found.balance is balance
    assert found.margin == pytest.approx(margin, abs=1e-12)
    assert found.direction == pytest.approx(direction, abs=1e-12)
    assert {int(found.sources[k]) for k in found.pivot} == pivot
    assert found.area == pytest.approx(4.0)


def test_corners_go_round_anticlockwise_seen_from_above():
    """The cross product of two edges, one after the other, points up."""
    corners = stability([0.0, 0.0, 0.0], SQUARE[[2, 0, 3, 1]]).corners
    edges = np.roll(corners, -1, axis=0) - corners
    assert np.all(np.cross(edges, np.roll(edges, -1, axis=0))[:, 1] > 0.0)


def test_nothing_supports():
    found = stability([0.0, 1.0, 0.0], [])
    assert (found.balance, found.margin, found.area) == (Balance.UNSUPPORTED, -np.inf, 0.0)
    assert (len(found.corners), found.pivot, found.direction) == (0, (), None)


@pytest.mark.parametrize("count", [1, 3])
def test_one_point_supports(count):
    points = np.tile([0.5, 0.0, 0.0], (count, 1))
    off = stability([0.5, 1.0, 2.0], points)
    assert (off.balance, off.margin, len(off.corners)) == (Balance.OUTSIDE, -2.0, 1)
    assert off.direction == pytest.approx([0.0, 0.0, 1.0])
    over = stability([0.5, 1.0, 0.0], points)
    assert (over.balance, over.margin, over.direction) == (Balance.ON_EDGE, 0.0, None)


@pytest.mark.parametrize("count", [2, 5])
def test_a_line_supports(count):
    points = np.linspace([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], count)
    off = stability([0.25, 1.0, -0.5], points)
    assert (off.balance, len(off.corners), off.area) == (Balance.OUTSIDE, 2, 0.0)
    assert off.margin == pytest.approx(-0.5)
    assert off.direction == pytest.approx([0.0, 0.0, -1.0])
    assert len(off.pivot) == 2
    beyond = stability([4.0, 1.0, 4.0], points)
    assert beyond.margin == pytest.approx(-5.0)
    assert beyond.corners[list(beyond.pivot)] == pytest.approx(np.array([[1.0, 0.0, 0.0]]))
    over = stability([0.25, 1.0, 0.0], points)
    assert (over.balance, over.direction) == (Balance.ON_EDGE, None)


def test_a_strip_narrower_than_the_edge_balances_nothing_for_sure():
    strip = on_ground([(-1, 0), (1, 0), (1, EDGE_TOLERANCE), (-1, EDGE_TOLERANCE)])
    assert stability([0.0, 0.0, EDGE_TOLERANCE / 2], strip).balance is Balance.ON_EDGE


def test_a_wall_seen_from_above_is_a_line():
    wall = [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [-1.0, 2.0, 0.0]]
    assert len(stability([0.0, 0.0, 0.3], wall).corners) == 2
    assert stability([0.0, 0.5, 0.3], wall, (0.0, 0.0, 1.0)).margin == pytest.approx(0.5)


def test_many_points_and_large_numbers():
    angles = np.linspace(0.0, 2.0 * np.pi, 20_001)
    ring = 1e6 * np.stack([np.cos(angles), np.zeros_like(angles), np.sin(angles)], axis=-1)
    assert stability([0.0, 0.0, 0.0], ring).margin == pytest.approx(1e6, rel=1e-7)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (([0.0, 0.0, 0.0], SQUARE, (0.0, 0.0, 0.0)), "no direction"),
        (([0.0, np.nan, 0.0], SQUARE), "finite"),
        (([0.0, 0.0, 0.0], SQUARE + np.inf), "finite"),
    ],
)
def test_a_ground_without_a_normal_and_infinite_numbers_are_refused(arguments, said):
    with pytest.raises(ValueError, match=said):
        stability(*arguments)
