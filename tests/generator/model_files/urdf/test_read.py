"""URDF models against Pinocchio's own reading of them."""

import numpy as np
import pytest

from generator.diagnostics import Source
from generator.model_files.formats import parse_model, read_model
from tests.generator.model_files.imported_models import (
    MODELS,
    lost,
    placed,
    pose_in_model,
    written_and_read,
)
from tests.generator.model_files.pinocchio_fall import (
    FLYING,
    PLANAR,
    SINGLE,
    Pinocchio,
    difference,
)

ARM = MODELS / "arm.urdf"


@pytest.mark.verify
def test_links_stand_where_pinocchio_has_them():
    imported, twin = read_model(ARM), Pinocchio(ARM)
    rng = np.random.default_rng(2)
    names = (*SINGLE, *PLANAR, *FLYING)
    for _ in range(5):
        values = dict(zip(names, rng.uniform(-1.2, 1.2, len(names)), strict=True))
        theirs = twin.frames(twin.configuration(values))
        placement = placed(imported, values)
        for link in ("column", "upper", "slider", "puck", "drone"):
            ours = pose_in_model(placement, link)
            np.testing.assert_allclose(ours, theirs[link], atol=1e-9, err_msg=link)
        tool = pose_in_model(placement, "upper", "tool")
        np.testing.assert_allclose(tool, theirs["tool"], atol=1e-9)


@pytest.mark.verify
def test_the_mass_is_pinocchios():
    twin = Pinocchio(ARM)
    total = twin.api.computeTotalMass(twin.model)
    assert read_model(ARM).figure.total_mass == pytest.approx(total, rel=1e-12)


@pytest.mark.verify
def test_a_passive_fall_is_pinocchios(tmp_path):
    assert difference(ARM, tmp_path, SINGLE) < 1e-6


def test_links_without_mass_become_one_joint_with_the_next():
    imported = read_model(ARM)
    shoulder = imported.figure.joints["shoulder"]
    assert [factor.axis for factor in shoulder.chain] == [(1, 0, 0), (0, 1, 0)]
    assert lost(imported, "bodies without mass") == ("yoke",)
    assert lost(imported, "without a joint") == ("base", "tool")


def test_a_link_with_mass_at_the_root_is_held_and_can_be_let_go():
    text = """<robot name="r">
      <link name="pelvis"><inertial><mass value="5"/>
        <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="leg"><inertial><mass value="2"/>
        <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="hip" type="continuous"><parent link="pelvis"/><child link="leg"/></joint>
    </robot>"""
    figure = parse_model(Source("r.urdf", text)).require_value().figure
    held = figure.joints["base"]
    assert (held.chain, held.parent.segment, held.child.segment) == ((), "world", "pelvis")
    assert figure.total_mass == 7.0


def test_what_a_figure_does_not_hold_is_told_by_name(tmp_path):
    imported = read_model(ARM)
    assert lost(imported, "mimic") == ("lift (turntable)",)
    assert lost(imported, "effort and speed") == ("shoulder_pitch", "shoulder_roll", "lift")
    assert list(imported.surfaces) == ["column"]
    assert lost(imported, "transmissions") == ("drive",)
    assert "lift" in lost(imported, "stops of 1000 N m/rad")
    written_and_read(imported, tmp_path)


def test_dry_friction_stands_in_a_springs_file(tmp_path):
    text = """<robot name="r"><link name="base"/>
      <link name="leg"><inertial><mass value="2"/>
        <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="hip" type="continuous"><parent link="base"/><child link="leg"/>
        <dynamics damping="0.2" friction="0.6"/></joint></robot>"""
    _, springs = written_and_read(parse_model(Source("r.urdf", text)).require_value(), tmp_path)
    (axis,) = springs.joints["hip"].axes
    assert (axis.damping.viscous, axis.damping.coulomb) == (0.2, 0.6)


FOOT = """<robot name="r">
  <link name="base"/>
  <link name="shank"><inertial><mass value="1"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="foot"><inertial><mass value="0"/>
    <inertia ixx="5" iyy="7" izz="9" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="knee" type="revolute"><parent link="base"/><child link="shank"/>
    <axis xyz="1 0 0"/><limit lower="-1e16" upper="1e16" effort="1" velocity="1"/></joint>
  <joint name="ankle" type="TYPE"><parent link="shank"/><child link="foot"/>
    <origin xyz="0 0 -0.3" rpy="0 0 1.5707963267948966"/></joint>
  REST
</robot>"""
FIXED_FOOT = FOOT.replace("TYPE", "fixed").replace("REST", "")


def test_inertia_without_mass_is_added_to_the_link_it_is_fixed_to():
    imported = parse_model(Source("r.urdf", FIXED_FOOT)).require_value()
    inertia = imported.figure.segments["shank"].inertia
    assert inertia == pytest.approx((7.1, 5.1, 9.1), rel=1e-12)


@pytest.mark.verify
def test_inertia_without_mass_is_added_as_in_pinocchio(tmp_path):
    path = tmp_path / "foot.urdf"
    path.write_text(FIXED_FOOT)
    inertia = np.diag(Pinocchio(path).model.inertias[1].inertia)
    assert inertia == pytest.approx((7.1, 5.1, 9.1), rel=1e-12)


def test_inertia_of_a_moving_link_without_mass_is_a_loss():
    toes = """<link name="toes"><inertial><mass value="1"/>
        <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="toe" type="continuous"><parent link="foot"/><child link="toes"/></joint>"""
    text = FOOT.replace("TYPE", "continuous").replace("REST", toes)
    imported = parse_model(Source("r.urdf", text)).require_value()
    assert lost(imported, "inertia of bodies without mass") == ("foot",)


def test_limits_that_stand_for_none_are_left_out():
    imported = parse_model(Source("r.urdf", FIXED_FOOT)).require_value()
    knee = imported.figure.joints["knee"]
    assert (knee.lower_limit, knee.upper_limit) == (None, None)
    assert lost(imported, "limits beyond 100 turns") == ("knee",)
    half = FIXED_FOOT.replace('lower="-1e16"', 'lower="-1"')
    knee = parse_model(Source("r.urdf", half)).require_value().figure.joints["knee"]
    assert knee.lower_limit == (-1.0,)
    assert knee.upper_limit is not None
    assert knee.upper_limit[0] == pytest.approx(200.0 * np.pi)


def test_elements_of_other_programs_are_not_macros():
    text = FIXED_FOOT.replace("</robot>", "<drake:loop_joint name='l'/></robot>")
    imported = parse_model(Source("r.urdf", text)).require_value()
    assert lost(imported, "unknown elements") == ("l",)
