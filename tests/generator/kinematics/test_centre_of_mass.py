"""The centre of mass: by hand, by differences, and as MuJoCo and a run have it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator import read_figure
from generator.diagnostics import InputError, MoverError, UsageError
from generator.kinematics.centre_of_mass import (
    centre_of_mass,
    centre_of_mass_jacobian,
    own_segments,
    segment_masses,
)
from generator.kinematics.loops import close_loops, consistent_rates
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from tests.chains import at, body, chain, figure, ground, joint

# Appendix A, standing: mass [g], and of the centre of mass the height, how far in front of the hips
# and how far to their left it is [cm]. Hips at 94.1, waist at 107.2, knees at 50.7, shoulders at
# 157.2, elbows at 123.8 cm. The limbs' own y is to the right, so what is 0.01 on it is -0.01 here.
STANDING = {
    "right_lower_leg": (4000.77, 50.7 - 23.73, 2.61, -6.12 - 0.01),
    "left_lower_leg": (4000.77, 50.7 - 23.73, 2.61, 6.12 - 0.01),
    "right_upper_leg": (8205.55, 94.1 - 18.07, 0.0, -6.12),
    "left_upper_leg": (8205.55, 94.1 - 18.07, 0.0, 6.12),
    "right_lower_arm": (1815.81, 123.8 - 17.51, -0.01, -17.2),
    "left_lower_arm": (1815.81, 123.8 - 17.51, -0.01, 17.2),
    "right_upper_arm": (2297.4, 157.2 - 13.99, -0.03, -17.2 - 0.02),
    "left_upper_arm": (2297.4, 157.2 - 13.99, -0.03, 17.2 - 0.02),
    "lower_torso": (3469.32, 94.1 + 6.17, 0.0, 0.0),
    "center_torso": (13169.6, 107.2 + 33.76, 0.09, -0.08),
}

VALUES = st.lists(st.floats(-3.0, 3.0), min_size=22, max_size=22).map(np.array)


@cache
def prototype():
    return build_tree(read_figure("prototype"))


def posed(values):
    """The prototype at 22 displacements in the order of its file."""
    tree, rest = prototype(), list(values)
    return forward_kinematics(
        tree,
        {
            name: np.array([rest.pop(0) for _ in joint.chain])
            for name, joint in tree.figure.joints.items()
        },
    )


def by_hand(names):
    rows = np.array([STANDING[name] for name in names])
    height, front, left = rows[:, 0] @ rows[:, 1:] / rows[:, 0].sum()
    return np.array([left, height, front]) / 100.0


@pytest.mark.parametrize(
    "segments",
    [None, ["left_lower_leg"], ["right_upper_arm", "right_lower_arm"], list(STANDING)[::-1]],
)
def test_the_standing_prototype_by_hand(segments):
    expected = by_hand(segments or STANDING)
    assert centre_of_mass(posed(np.zeros(22)), segments) == pytest.approx(expected, abs=1e-14)


@given(VALUES, st.sets(st.sampled_from(list(STANDING)), min_size=1, max_size=9))
def test_parts_join_by_their_masses(values, some):
    placement = posed(values)
    parts = [some, set(STANDING) - some]
    masses = [segment_masses(placement.tree.figure, part).total for part in parts]
    joined = sum(
        m * centre_of_mass(placement, part) for m, part in zip(masses, parts, strict=True)
    ) / sum(masses)
    assert np.allclose(joined, centre_of_mass(placement), atol=1e-13)


@given(VALUES, st.sampled_from([None, ("left_lower_leg", "center_torso"), ("right_upper_arm",)]))
def test_the_jacobian_is_the_slope(values, segments):
    slopes = centre_of_mass_jacobian(posed(values), segments)
    assert slopes.shape == (3, 22)
    for k, side in enumerate(np.eye(22)):
        ends = [centre_of_mass(posed(values + h * side), segments) for h in (1e-5, -1e-5)]
        assert np.allclose(slopes[:, k], (ends[0] - ends[1]) / 2e-5, atol=1e-9)


def test_columns_are_in_the_order_of_the_file():
    """A knee moves nothing but its shank; its column is not where the tree has it."""
    slopes = centre_of_mass_jacobian(posed(np.zeros(22)), ["left_lower_leg"])
    names = [name for name, j in prototype().figure.joints.items() for _ in j.chain]
    moving = {name for name, column in zip(names, slopes.T, strict=True) if np.any(column != 0.0)}
    assert moving == {"root_torso", "left_hip_joint", "left_knee"}
    alone = centre_of_mass_jacobian(posed(np.zeros(22)), ["center_torso"])
    assert {n for n, c in zip(names, alone.T, strict=True) if np.any(c != 0.0)} == {
        "root_torso",
        "waist",
    }


def test_in_a_closed_loop_the_centre_follows_the_rates_that_keep_it_closed():
    tree = build_tree(read_figure("fourbar"))
    closed = close_loops(tree, initial_displacements(tree))
    rates = {name: np.zeros(1) for name in tree.figure.joints} | {"crank_bearing": np.ones(1)}
    moving = consistent_rates(closed, rates, fixed={"crank_bearing"})
    by_joint = dict(zip((b.joint.name for b in tree.joints), moving, strict=True))
    order = [by_joint.get(name, 0.0) for name in tree.figure.joints]
    velocity = centre_of_mass_jacobian(closed) @ order

    def turned(angle):
        asked = {**closed.displacements, "crank_bearing": np.array([np.pi + angle])}
        return centre_of_mass(close_loops(tree, asked, fixed={"crank_bearing"}))

    assert np.allclose(velocity, (turned(1e-5) - turned(-1e-5)) / 2e-5, atol=1e-7)
    assert np.linalg.norm(velocity) > 0.1


def test_a_whole_motion_has_its_centres_at_once():
    tree = prototype()
    random = np.random.default_rng(5)
    motion = {
        n: random.normal(size=(6, j.degrees_of_freedom)) for n, j in tree.figure.joints.items()
    }
    together = forward_kinematics(tree, motion)
    masses = segment_masses(tree.figure)
    for frame in range(6):
        alone = forward_kinematics(tree, {name: rows[frame] for name, rows in motion.items()})
        assert np.allclose(masses.centre(together.poses)[frame], masses.centre(alone.poses))
        assert np.allclose(masses.jacobian(together)[frame], masses.jacobian(alone))


@pytest.mark.verify
@pytest.mark.parametrize("seed", range(3))
def test_mujoco_has_the_same_centre_and_the_same_slopes(seed):
    mujoco = pytest.importorskip("mujoco")
    from benchmarks.engines.mujoco_engine import MuJoCo
    from benchmarks.tree import tree_model

    random = np.random.default_rng(seed)
    sizes = {name: j.degrees_of_freedom for name, j in prototype().figure.joints.items()}
    values, rates = (
        {name: random.uniform(-1.2, 1.2, size) for name, size in sizes.items()} for _ in range(2)
    )
    engine = MuJoCo(tree_model(prototype().figure, values, rates))
    data = engine.start()
    mujoco.mj_forward(engine.model, data)
    placement = forward_kinematics(prototype(), values)
    assert np.allclose(centre_of_mass(placement), data.subtree_com[0], atol=1e-12)
    slopes = np.zeros((3, engine.model.nv))
    mujoco.mj_jacSubtreeCom(engine.model, data, slopes, 0)
    velocity = centre_of_mass_jacobian(placement) @ np.concatenate(list(rates.values()))
    assert np.allclose(velocity, slopes @ data.qvel, atol=1e-12)


def with_segment(**changes):
    """The prototype with another left shank."""
    whole = prototype().figure
    shank = replace(whole.segments["left_lower_leg"], **changes)
    return replace(whole, segments={**whole.segments, shank.name: shank})


def test_what_has_no_mass_or_centre_is_told_with_its_place():
    with pytest.raises(InputError) as raised:
        segment_masses(with_segment(mass=None, sites={}))
    assert [fault.message for fault in raised.value.diagnostics] == [
        "segment `left_lower_leg` has no mass",
        "segment `left_lower_leg` has no site `CM`",
    ]
    assert all(fault.span.text == "left_lower_leg" for fault in raised.value.diagnostics)
    others = [name for name in STANDING if name != "left_lower_leg"]
    found = centre_of_mass(
        forward_kinematics(build_tree(with_segment(mass=None)), initial_displacements(prototype())),
        others,
    )
    assert found == pytest.approx(by_hand(others))


def test_unknown_segments_and_parts_of_the_ground_are_refused():
    with pytest.raises(UsageError, match="did you mean `left_lower_leg`"):
        segment_masses(prototype().figure, ["left_lower_legg"])
    with pytest.raises(UsageError, match="`body_root` is part of the ground"):
        segment_masses(prototype().figure, ["body_root"])


def test_a_segment_that_is_asked_for_twice_counts_once():
    assert segment_masses(prototype().figure, ["lower_torso"] * 2).total == 3.46932


def test_no_mass_has_no_centre():
    with pytest.raises(MoverError, match="so there is no centre of mass"):
        segment_masses(figure([ground()], []))
    with pytest.raises(MoverError, match="so there is no centre of mass"):
        segment_masses(with_segment(mass=0.0), ["left_lower_leg"])


def test_the_root_s_segment_counts_where_it_has_a_mass():
    """A figure held at its foot: 3 kg in the foot, 1 kg hung 0.8 m above."""
    foot = body("foot", 3.0, centre=(0.1, 0.0, 0.0), sites={"top": at(shift=(0, 0.5, 0))})
    leg = body("leg", 1.0, centre=(0.1, 0.3, 0.0))
    held = replace(
        figure([ground(), foot, leg], [joint("ankle", "foot.top", "leg.near", chain("Rz"))]),
        segments={"foot": foot, "leg": leg},
        root=joint("x", "foot.near", "leg.near", ()).parent,
    )
    assert own_segments(held) == ("foot", "leg")
    tree = build_tree(held)
    assert centre_of_mass(forward_kinematics(tree, initial_displacements(tree))) == pytest.approx(
        [0.1, 0.2, 0.0]
    )
