"""Laws of linked degrees of freedom."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import ModelError
from generator.follower_curve import CurveKind, FollowerCurve
from generator.kinematics.links import Coordinate, Link, Links, cycle_message, cycles

CURVE = FollowerCurve(CurveKind.SIMM_SPLINE, (-2.0, 0.1, -0.5, 0.4, 0.3, -0.2, 1.1, 0.0, 2.0, 0.3))
JOINTS = {"a": 3, "b": 1, "c": 2, "d": 3}
FREEDOMS = [Coordinate(name, k) for name, count in JOINTS.items() for k in range(count)]
FACTORS = st.floats(0.05, 3.0) | st.floats(-3.0, -0.05)
OFFSETS = st.floats(-2.0, 2.0)
POSES = st.fixed_dictionaries(
    {
        name: st.lists(st.floats(-3.0, 3.0), min_size=n, max_size=n).map(np.array)
        for name, n in JOINTS.items()
    }
)


@st.composite
def some_links(draw):
    """Links that hold together: each freedom follows at most one that stands before it."""
    order = draw(st.permutations(FREEDOMS))
    made = []
    for k, follower in enumerate(order):
        if k and draw(st.booleans()):
            control = order[draw(st.integers(0, k - 1))]
            made.append(Link(follower, control, draw(FACTORS), draw(OFFSETS)))
    return Links(tuple(draw(st.permutations(made))))


def value(pose, freedom):
    return pose[freedom.joint][freedom.index]


@given(some_links(), POSES)
def test_following_is_a_projection_on_the_links(links, pose):
    before = {name: row.copy() for name, row in pose.items()}
    moved = links.follow(pose)
    for link in links.links:
        expected = link.factor * value(moved, link.control) + link.offset
        assert value(moved, link.follower) == pytest.approx(expected, rel=1e-9, abs=1e-9)
    for freedom in set(FREEDOMS) - {link.follower for link in links.links}:
        assert value(moved, freedom) == value(pose, freedom)
    again = links.follow(moved)
    for name, row in moved.items():
        assert np.array_equal(row, again[name])
        assert np.array_equal(pose[name], before[name])


@given(some_links(), POSES)
def test_what_follows_meets_the_constraints(links, pose):
    moved = links.follow(pose)
    rows, offsets = links.constraints(FREEDOMS)
    stacked = np.array([value(moved, freedom) for freedom in FREEDOMS])
    assert rows.shape == (len(links.links), len(FREEDOMS))
    assert np.linalg.matrix_rank(rows) == len(links.links)
    assert rows @ stacked == pytest.approx(offsets, rel=1e-9, abs=1e-9)


@given(some_links())
def test_resolved_controls_follow_nothing(links):
    followers = {link.follower for link in links.links}
    assert not {link.control for link in links.resolved} & followers
    assert [link.follower for link in links.resolved] == [link.follower for link in links.links]


@given(st.lists(st.tuples(FACTORS, OFFSETS), min_size=1, max_size=6))
def test_factors_multiply_along_a_chain(steps):
    names = [Coordinate(f"j{k}", 0) for k in range(len(steps) + 1)]
    chain = [Link(names[k + 1], names[k], *step) for k, step in enumerate(steps)]
    last = Links(tuple(reversed(chain))).resolved[0]
    assert last.control == names[0]
    assert last.factor == pytest.approx(np.prod([factor for factor, _ in steps]))
    at_zero = 0.0
    for factor, offset in steps:
        at_zero = factor * at_zero + offset
    assert last.offset == pytest.approx(at_zero, abs=1e-9)


@given(some_links(), st.data())
def test_a_link_that_closes_a_chain_is_refused_by_name(links, data):
    if not links.links:
        return
    lowest = data.draw(st.sampled_from(links.resolved))
    closing = Link(lowest.control, lowest.follower)
    with pytest.raises(ModelError, match=r"follows itself|the links form a cycle") as caught:
        Links((*links.links, closing))
    assert str(lowest.control) in str(caught.value)
    assert str(lowest.follower) in str(caught.value)


def test_a_motion_follows_frame_by_frame():
    links = Links((Link(Coordinate("b", 0), Coordinate("a", 1), -2.0, 0.5),))
    frames = {"a": np.arange(12.0).reshape(4, 3), "b": np.zeros((4, 1))}
    assert links.follow(frames)["b"][:, 0] == pytest.approx([-1.5, -7.5, -13.5, -19.5])


def test_the_sentence_of_a_cycle_names_it_in_its_order():
    ring = [Coordinate(name, 0) for name in "abc"]
    links = [Link(ring[0], ring[1]), Link(ring[1], ring[2]), Link(ring[2], ring[0])]
    (cycle,) = cycles(links)
    assert (
        cycle_message(cycle)
        == "the links form a cycle: a 1 follows b 1, which follows c 1, which follows a 1"
    )
    (alone,) = cycles([Link(ring[0], ring[0])])
    assert cycle_message(alone) == "a 1 follows itself"


def test_two_cycles_are_two():
    a, b, c, d = (Coordinate(name, 0) for name in "abcd")
    found = cycles([Link(a, b), Link(b, a), Link(c, d), Link(d, c)])
    assert [set(cycle) for cycle in found] == [{a, b}, {c, d}]


def test_a_freedom_that_follows_twice_is_refused():
    a, b, c = FREEDOMS[:3]
    with pytest.raises(ModelError, match="a 1 has two links"):
        Links((Link(a, b), Link(a, c)))


@pytest.mark.parametrize(
    ("numbers", "said"),
    [((0, 0), "zero"), ((np.nan, 0), "finite"), ((1, np.nan), "finite"), ((1, np.inf), "finite")],
)
def test_what_is_no_link_is_refused(numbers, said):
    with pytest.raises(ModelError, match=said):
        Link(FREEDOMS[0], FREEDOMS[1], *numbers)


def test_factors_beyond_the_floats_are_refused():
    a, b, c = FREEDOMS[:3]
    for factor, said in ((1e200, "finite"), (1e-200, "zero")):
        with pytest.raises(ModelError, match=said):
            Links((Link(a, b, factor), Link(b, c, factor)))


def test_displacements_beyond_the_floats_are_refused():
    a, b = FREEDOMS[:2]
    links = Links((Link(a, b, 1e299),))
    for value in (100.0, 1e300, np.nan, np.inf):
        with pytest.raises(ModelError, match="the displacement of a 1 is not finite"):
            links.follow({"a": np.array([0.0, value, 0.0])})


def test_missing_displacements_are_named():
    links = Links((Link(Coordinate("b", 0), Coordinate("a", 2)),))
    for pose in ({"a": np.zeros(3)}, {"a": np.zeros(2), "b": np.zeros(1)}):
        with pytest.raises(ModelError, match=r"no displacement of (b 1|a 3)"):
            links.follow(pose)
    with pytest.raises(ModelError, match="no displacement of b 1"):
        links.constraints(FREEDOMS[:3])


def test_five_thousand_links_in_a_row_resolve():
    chain = [Link(Coordinate(f"j{k + 1}", 0), Coordinate(f"j{k}", 0)) for k in range(5000)]
    assert {link.control for link in Links(tuple(reversed(chain))).resolved} == {
        Coordinate("j0", 0)
    }


def test_links_by_curves_compose_with_linear_ones_alone():
    """The values along a chain are those of its links one after the other."""
    one, two, three = (Coordinate(name, 0) for name in ("one", "two", "three"))
    line, curve = Link(two, one, -2.0, 0.1), Link(three, two, 3.0, 0.2, CURVE)
    at = np.linspace(-1.5, 1.5, 7)
    chain = curve.compose(line)
    assert chain.control == one
    assert chain.at(at) == pytest.approx(curve.at(line.at(at)))
    assert chain.at(at, 1) == pytest.approx(curve.at(line.at(at), 1) * line.at(at, 1))
    assert chain.at(at, 2) == pytest.approx(curve.at(line.at(at), 2) * line.at(at, 1) ** 2)
    back = Link(one, three, 0.5, -0.3).compose(replace(curve, control=Coordinate("four", 0)))
    assert back.at(at) == pytest.approx(0.5 * curve.at(at) - 0.3)
    assert back.as_curve.at(at) == pytest.approx(back.at(at))
    with pytest.raises(ModelError, match="both by a curve"):
        curve.compose(Link(two, one, curve=CURVE))
