"""The figure hung from its root."""

from dataclasses import replace

import pytest

from generator.diagnostics import InputError, ModelError
from generator.kinematics.tree import build_tree
from tests.chains import BALL, at, body, chain, figure, ground, joint, row, two_bodies


def test_branches_come_base_first() -> None:
    tree = build_tree(row(4))
    assert [(b.inboard, b.outboard) for b in tree.joints] == [
        ("ground", "bar0"),
        ("bar0", "bar1"),
        ("bar1", "bar2"),
        ("bar2", "bar3"),
    ]
    assert tree.closures == ()


def test_a_figure_has_one_tree_and_its_equal_another() -> None:
    made = row(2)
    equal = replace(made, path=None)
    assert build_tree(made) is build_tree(made)
    assert equal == made
    assert build_tree(equal).figure is equal
    wrong = replace(made, joints={})
    for _ in range(2):
        with pytest.raises(InputError):
            build_tree(wrong)


def test_the_tree_does_not_follow_the_order_in_connect() -> None:
    factors, values = chain("Rz"), (0.2,)
    there, back = (build_tree(two_bodies(factors, values, reverse=r)) for r in (False, True))
    assert [b.outboard for b in there.joints] == [b.outboard for b in back.joints]
    assert [b.parent_is_inboard for b in there.joints] == [True, True]
    assert [b.parent_is_inboard for b in back.joints] == [True, False]


def test_nor_the_order_of_segments_and_joints() -> None:
    made = row(4)
    turned = replace(
        made,
        segments=dict(reversed(made.segments.items())),
        joints=dict(reversed(made.joints.items())),
    )
    assert {(b.inboard, b.outboard) for b in build_tree(turned).joints} == {
        (b.inboard, b.outboard) for b in build_tree(made).joints
    }


def test_a_loop_has_one_closing_joint() -> None:
    made = figure(
        [ground(), body("a"), body("b", sites={"far": at(shift=(0.1, 0.0, 0.0))})],
        [
            joint("one", "ground.base", "a.near", BALL),
            joint("two", "a.near", "b.near", BALL),
            joint("three", "b.far", "ground.base", BALL),
        ],
    )
    tree = build_tree(made)
    assert len(tree.joints) == 2
    assert len(tree.closures) == 1


def test_a_segment_out_of_reach_is_named() -> None:
    made = figure(
        [ground(), body("a"), body("lost")], [joint("one", "ground.base", "a.near", BALL)]
    )
    with pytest.raises(InputError, match="no joints lead from the root to segment `lost`"):
        build_tree(made)


def test_a_chain_that_no_joint_holds_is_refused() -> None:
    made = figure([ground(), body("a")], [joint("one", "ground.base", "a.near", chain("Rx Ty Rz"))])
    with pytest.raises(ModelError, match="translation is between"):
        build_tree(made)
