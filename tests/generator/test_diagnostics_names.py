"""Names in Python: a wrong one is a sentence with the nearest name."""

import copy
import pickle
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from generator import (
    Plan,
    UnknownNameError,
    by_name,
    read_action,
    read_figure,
    read_springs,
    simulate,
    static_torques,
)
from generator.diagnostics import ModelError, NamedMapping
from generator.figure import Figure, Segment, Site, SiteRef
from generator.kinematics.placement import forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree


@pytest.fixture(scope="module")
def prototype() -> Figure:
    return read_figure("prototype")


def test_a_wrong_name_of_a_part_raises_with_the_nearest(prototype: Figure) -> None:
    with pytest.raises(UnknownNameError) as joint:
        _ = prototype.joints["left_kne"]
    assert str(joint.value) == "the figure has no joint `left_kne`; did you mean `left_knee`?"
    with pytest.raises(UnknownNameError, match="no segment `left_lower_lag`; did you mean `left_l"):
        _ = prototype.segments["left_lower_lag"]
    with pytest.raises(UnknownNameError, match="segment `lower_torso` has no site `rlaterl`; did"):
        prototype.site(SiteRef("lower_torso", "rlaterl"))


def test_it_is_a_key_error_and_other_questions_are_those_of_a_dict(prototype: Figure) -> None:
    with pytest.raises(KeyError):
        _ = prototype.joints["tail"]
    assert prototype.joints.get("tail") is None
    assert "tail" not in prototype.joints
    assert {**prototype.joints} == prototype.joints


def test_a_copy_keeps_the_sentence(prototype: Figure) -> None:
    for same in (copy.deepcopy(prototype), pickle.loads(pickle.dumps(prototype))):
        assert same == prototype
        with pytest.raises(UnknownNameError, match="did you mean `waist`"):
            _ = same.joints["wast"]
    assert asdict(prototype)["joints"]["waist"]["name"] == "waist"


def test_an_empty_mapping_has_no_nearest_name() -> None:
    with pytest.raises(UnknownNameError, match="the cart has no wheel `left`; it has none"):
        _ = NamedMapping[int]({}, "the cart has no wheel")["left"]


def test_kinematics_take_the_joints_of_the_figure_only(prototype: Figure) -> None:
    tree = build_tree(prototype)
    start = initial_displacements(tree)
    placed = forward_kinematics(tree, start)
    with pytest.raises(UnknownNameError, match="no segment `lower_tors`; did you mean `lower_t"):
        _ = placed.poses["lower_tors"]
    with pytest.raises(UnknownNameError, match="did you mean `left_knee`"):
        forward_kinematics(tree, {**start, "left_kne": start["left_knee"]})
    del start["left_knee"]
    with pytest.raises(ModelError, match="the displacements of joint `left_knee` are missing"):
        forward_kinematics(tree, start)


def test_parts_are_listed_under_their_own_names(prototype: Figure) -> None:
    sites = by_name(Site("top"), Site("bottom"))
    assert list(sites) == ["top", "bottom"]
    assert Segment("arm", sites=sites).sites["top"].name == "top"
    with pytest.raises(ModelError, match="two values are named `top`"):
        by_name(Site("top"), Site("top"))
    with pytest.raises(ModelError, match="`top` is listed as `tip`"):
        Segment("arm", sites={"tip": Site("top")})
    with pytest.raises(ModelError, match="`waist` is listed as `neck`"):
        replace(prototype, joints={"neck": prototype.joints["waist"]})


def test_motions_springs_and_torques_name_the_nearest_joint(tmp_path: Path) -> None:
    figure = read_figure("fourbar")
    springs = read_springs(None, read_figure("prototype"))
    with pytest.raises(UnknownNameError, match="the springs have no joint `left_kne`; did you me"):
        _ = springs.joints["left_kne"]
    simulate(figure, Plan(stop=0.02)).write(tmp_path / "turn.action")
    action = read_action(tmp_path / "turn.action")
    with pytest.raises(UnknownNameError, match="the motion has no joint `crank`; did you mean `cr"):
        _ = action.displacements["crank"]
    pendulum = read_figure("pendulum")
    with pytest.raises(UnknownNameError, match="no joint `sholder`; did you mean `shoulder`"):
        _ = static_torques(pendulum, [{}])["sholder"]
