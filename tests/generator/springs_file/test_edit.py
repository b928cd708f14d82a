"""Changes of springs, and the springs files that state them."""

from dataclasses import replace
from math import radians
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from generator import read_figure
from generator.diagnostics import ModelError, UsageError
from generator.figure_file import FIGURE_FILE
from generator.springs_file.edit import (
    SpringEdit,
    apply_edits,
    check_target,
    cubic_dead_zone,
    edit_of_other_side,
    edit_spring,
    format_all,
    format_changes,
    plain_law,
    springs_and_text,
    springs_from_text,
)
from generator.springs_file.read import load_springs, read_springs
from springs import AxisSpring, Damping, Linear, SphericalLaw, SpringSet, Stop, total_torque
from springs.published.tables import curve
from tests.laws import STRATEGIES

FIGURE = read_figure("prototype")
SPRINGS = read_springs(None, FIGURE)
KNEE = SPRINGS.joints["left_knee"].axes[0].direction
OWN_FILE = FIGURE_FILE.shipped()["prototype"].with_name("prototype.springs.toml")
ANGLES = np.radians(np.linspace(-30.0, 150.0, 181))
LAWS = st.one_of(*STRATEGIES.values()).filter(lambda law: not isinstance(law, Stop))


def spring_of(springs: SpringSet, joint: str, motion: str) -> AxisSpring:
    return next(axis for axis in springs.joints[joint].axes if axis.motion == motion)


def torques(spring: AxisSpring) -> np.ndarray:
    return np.asarray(total_torque(spring.elastic, ANGLES))


AXES = [(name, axis.direction) for name, joint in SPRINGS.joints.items() for axis in joint.axes]
EDITS = st.builds(
    lambda at, **changes: SpringEdit(*at, **changes),
    st.sampled_from(AXES),
    scale=st.floats(0.0, 10.0),
    offset=st.floats(-1.0, 1.0),
    viscous=st.none() | st.floats(0.0, 10.0),
    coulomb=st.none() | st.floats(0.0, 10.0),
)


@settings(max_examples=10, deadline=None)
@given(st.lists(EDITS, max_size=4, unique_by=lambda edit: (edit.joint, edit.direction)))
@pytest.mark.parametrize("choice", [None, "printed"])
def test_a_file_of_edits_is_read_as_the_edited_springs(choice, edits):
    base = read_springs(choice, FIGURE)
    springs, text = springs_and_text(
        FIGURE, base, apply_edits(base, edits), Path("my.springs.toml"), choice
    )
    changed = apply_edits(base, edits)
    assert springs.joints == changed.joints
    assert (springs.law, springs.coupled) == (base.law, base.coupled)
    assert bool(text) == (changed != base)
    again = springs_from_text(text, FIGURE, Path("my.springs.toml")) if text else base
    assert again.joints == springs.joints


@settings(max_examples=50, deadline=None)
@given(LAWS, st.floats(0.0, 5.0), st.floats(-1.0, 1.0))
def test_the_parts_of_a_law_make_its_torque(law, scale, offset):
    whole = plain_law(law).whole
    assert np.allclose(whole.torque(ANGLES), law.torque(ANGLES), rtol=1e-12, atol=1e-9)
    edit = SpringEdit("knee", (1.0, 0.0, 0.0), scale, offset)
    spring = edit_spring(AxisSpring((1.0, 0.0, 0.0), (law,)), edit)
    assume(not plain_law(law).hysteresis)  # its difference is not scaled
    expected = scale * np.asarray(law.torque(ANGLES - offset))
    assert np.allclose(torques(spring), expected, rtol=1e-9, atol=1e-6)


@given(LAWS)
def test_an_edit_about_the_opposite_axis_is_its_mirror_image(law):
    spring = AxisSpring((0.0, 1.0, 0.0), (law,))
    one = edit_spring(spring, SpringEdit("knee", (0.0, 1.0, 0.0), 2.0, 0.25))
    other = edit_spring(spring.with_opposite_axis(), SpringEdit("knee", (0.0, 1.0, 0.0), 2.0, 0.25))
    assert np.allclose(torques(other.with_opposite_axis()), torques(one), rtol=1e-9, atol=1e-6)


def test_an_edit_of_one_side_leaves_the_other():
    edit = SpringEdit("left_knee", KNEE, scale=3.0, viscous=1.5)
    changed = apply_edits(SPRINGS, [edit])
    assert changed.joints["right_knee"] == SPRINGS.joints["right_knee"]
    left, before = (one.joints["left_knee"].axes[0] for one in (changed, SPRINGS))
    assert np.array_equal(torques(left), 3.0 * torques(before))
    assert left.damping == Damping(1.5, before.damping.coulomb)
    both = edit_of_other_side(SPRINGS, edit)
    assert both is not None
    assert both.joint == "right_knee"
    changed = apply_edits(SPRINGS, [edit, both])
    assert torques(changed.joints["right_knee"].axes[0]).tolist() == torques(left).tolist()
    assert edit_of_other_side(SPRINGS, replace(edit, joint="waist")) is None


def test_equal_changes_of_both_sides_are_one_table():
    edit = SpringEdit("left_knee", KNEE, scale=2.0)
    both = edit_of_other_side(SPRINGS, edit)
    assert both is not None
    text = format_changes(FIGURE, SPRINGS, apply_edits(SPRINGS, [edit, both]), "prototype")
    assert text.count("[[spring]]") == 1
    assert "scale = 2\n" in text
    assert "viscous" not in text
    assert "Changed: torque" in text


def test_damping_alone_does_not_restate_the_law():
    edit = SpringEdit("left_knee", KNEE, viscous=0.5, coulomb=0.25)
    text = format_changes(FIGURE, SPRINGS, apply_edits(SPRINGS, [edit]))
    assert "coefficients" not in text
    assert "viscous_Nms_rad = 0.5\ncoulomb_Nm = 0.25\n" in text


def test_the_dead_zone_of_a_cubic_is_that_of_its_angles():
    before = SPRINGS.joints["left_knee"].axes[0]
    assert cubic_dead_zone(before) == pytest.approx((0.0, 1.553))
    edit = SpringEdit("left_knee", KNEE, dead_zone=(0.2, 1.0), offset=0.1)
    spring = edit_spring(before, edit)
    assert cubic_dead_zone(spring) == pytest.approx((0.3, 1.1))
    assert total_torque(spring.elastic, 0.35) == 0.0
    assert total_torque(spring.elastic, 1.2) != 0.0
    with pytest.raises(ModelError, match="ends before it begins"):
        edit_spring(before, replace(edit, dead_zone=(1.0, 0.2)))
    linear = AxisSpring((1.0, 0.0, 0.0), (Linear(3.0),))
    with pytest.raises(ModelError, match="not a cubic"):
        edit_spring(linear, replace(edit, direction=(1.0, 0.0, 0.0)))
    with pytest.raises(ModelError, match="no stiffness"):
        edit_spring(before, replace(edit, stiffness=3.0))


def test_a_published_curve_is_named_in_the_file(tmp_path: Path):
    path = tmp_path / "hip.springs.toml"
    path.write_text(
        '[[spring]]\njoints = ["left_hip_joint"]\naxis = "z"\n'
        'published = "van_arkel_2015/hip_rotation"\nviscous_Nms_rad = 0.25\nscale = 2\n',
        encoding="utf-8",
    )
    base = read_springs(path, FIGURE)
    direction = spring_of(base, "left_hip_joint", "medial rotation").direction
    edit = SpringEdit("left_hip_joint", direction, scale=1.5)
    springs, text = springs_and_text(
        FIGURE, base, apply_edits(base, [edit]), tmp_path / "my.springs.toml", path
    )
    assert 'extends = "hip.springs.toml"\n' in text
    assert 'published = "van_arkel_2015/hip_rotation"\nscale = 3\n' in text
    spring = spring_of(springs, "left_hip_joint", "medial rotation")
    assert spring.damping == Damping(0.25)
    law = curve("van_arkel_2015/hip_rotation").law
    assert np.allclose(torques(spring), 3.0 * np.asarray(law.torque(ANGLES)), rtol=1e-12)


def test_a_published_curve_does_not_bring_its_damping_back(tmp_path: Path):
    path = tmp_path / "elbow.springs.toml"
    path.write_text(
        '[[spring]]\njoints = ["left_elbow"]\npublished = "saul_2015/elbow_flexion"\n'
        "viscous_Nms_rad = 0.25\n",
        encoding="utf-8",
    )
    base = read_springs(path, FIGURE)
    assert curve("saul_2015/elbow_flexion").damping not in (None, 0.25)
    direction = base.joints["left_elbow"].axes[0].direction
    edit = SpringEdit("left_elbow", direction, scale=2.0)
    springs, _ = springs_and_text(
        FIGURE, base, apply_edits(base, [edit]), tmp_path / "my.springs.toml", path
    )
    assert springs.joints["left_elbow"].axes[0].damping == Damping(0.25)


def test_a_dead_zone_is_set_at_the_angles_of_a_shifted_cubic_with_a_rest(tmp_path: Path):
    path = tmp_path / "knee.springs.toml"
    path.write_text(
        '[[spring]]\njoints = ["left_knee"]\ncoefficients_Nm_rad = [0, 10, 0, 50]\n'
        "dead_zone_deg = [-10, 20]\nrest_deg = 5\noffset_deg = 7\n",
        encoding="utf-8",
    )
    (before,) = read_springs(path, FIGURE).joints["left_knee"].axes
    assert cubic_dead_zone(before) == pytest.approx((radians(2.0), radians(32.0)))
    zone = radians(3.0), radians(40.0)
    spring = edit_spring(before, SpringEdit("left_knee", before.direction, dead_zone=zone))
    assert cubic_dead_zone(spring) == pytest.approx(zone)
    inside, outside = total_torque(spring.elastic, np.radians([[4.0, 39.0], [2.0, 41.0]]))
    assert not np.any(inside)
    assert np.all(outside)


def test_the_fields_of_a_figure_stay_where_damping_is_changed(tmp_path: Path):
    text = Path(FIGURE.path or "").parent.joinpath("pendulum.fig").read_text("utf-8")
    (tmp_path / "mine.fig").write_text(text, encoding="utf-8")
    figure = read_figure(tmp_path / "mine.fig")
    base = read_springs(None, figure)
    edits = [
        SpringEdit(name, axis.direction, viscous=2.0)
        for name, joint in base.joints.items()
        for axis in joint.axes
    ]
    assert edits
    springs, _ = springs_and_text(
        figure, base, apply_edits(base, edits), tmp_path / "my.springs.toml"
    )
    for name, joint in base.joints.items():
        for before, after in zip(joint.axes, springs.joints[name].axes, strict=True):
            assert before.elastic == after.elastic
            assert after.damping.viscous == 2.0


@pytest.mark.parametrize("choice", ["coupled", None])
def test_the_saved_file_extends_the_springs_by_name(choice, tmp_path: Path):
    base = read_springs(choice, FIGURE, SphericalLaw.WEIGHTED)
    elbow = base.joints["left_elbow"].axes[0].direction
    edit = SpringEdit("left_elbow", elbow, offset=radians(5.0))
    path = tmp_path / "my.springs.toml"
    springs, text = springs_and_text(FIGURE, base, apply_edits(base, [edit]), path, choice)
    assert f'extends = "{choice or "prototype"}"\n' in text
    path.write_text(text, encoding="utf-8")
    again = load_springs(FIGURE, FIGURE.path and FIGURE.path.parent, "prototype", path)
    assert again.value is not None
    assert replace(again.value, origin=springs.origin) == springs
    assert springs.law is SphericalLaw.WEIGHTED
    assert springs.coupled == base.coupled


def test_what_a_file_cannot_state_is_an_error():
    axis = SPRINGS.joints["left_knee"].axes[0]
    strange = replace(axis, elastic=(*axis.elastic, Linear(1.0)))
    changed = replace(
        SPRINGS,
        joints={
            **SPRINGS.joints,
            "left_knee": replace(SPRINGS.joints["left_knee"], axes=(strange,)),
        },
    )
    with pytest.raises(ModelError, match="several laws of `left_knee`"):
        format_changes(FIGURE, SPRINGS, changed)
    with pytest.raises(ModelError, match="no single law"):
        apply_edits(changed, [SpringEdit("left_knee", KNEE, scale=2.0)])
    with pytest.raises(ModelError, match="no spring about this axis"):
        apply_edits(SPRINGS, [SpringEdit("left_knee", (0.6, 0.8, 0.0), scale=2.0)])
    assert format_changes(FIGURE, SPRINGS, SPRINGS) == ""
    assert "base = " in format_all(FIGURE, SPRINGS)


def test_a_file_may_be_extended_by_changes_of_its_name_that_are_not_saved(tmp_path: Path):
    path = tmp_path / "mine.springs.toml"
    path.write_text('[[spring]]\njoints = ["left_knee"]\nstiffness_Nm_rad = 2\n', "utf-8")
    base = read_springs(path, FIGURE)
    edit = SpringEdit("left_knee", KNEE, stiffness=3.0)
    springs, text = springs_and_text(FIGURE, base, apply_edits(base, [edit]), path, path)
    assert springs.joints["left_knee"].axes[0].elastic == (Linear(3.0),)
    assert springs_from_text(text, FIGURE, path).joints == springs.joints
    check_target(FIGURE, tmp_path / "other.springs.toml", path)
    for choice, file in ((path, path), (path, OWN_FILE), (None, OWN_FILE)):
        with pytest.raises(UsageError, match="choose another name"):
            check_target(FIGURE, file, choice)


def test_a_curve_beside_a_law_over_several_joints_is_not_changed_alone(tmp_path: Path):
    figure = read_figure("male50")
    springs = read_springs(None, figure)
    edit = SpringEdit("left_knee", springs.joints["left_knee"].axes[0].direction, scale=2.0)
    with pytest.raises(ModelError, match="beside a law over several joints"):
        springs_and_text(figure, springs, apply_edits(springs, [edit]), tmp_path / "a.springs.toml")
