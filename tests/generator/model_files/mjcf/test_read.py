"""MJCF models against MuJoCo's own reading of them."""

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from benchmarks.exported import our_moments
from generator.diagnostics import Source
from generator.figure_file import FIGURE_FILE
from generator.figure_file.write import write_figure
from generator.model_files.body_tree.to_figure import ORIGIN, WORLD
from generator.model_files.formats import parse_model, read_model
from generator.model_files.mjcf.write import format_mjcf
from generator.model_files.model_files import Imported
from generator.run_options import Integrator
from generator.simulation.plan import Plan
from generator.simulation.run import simulate
from springs import SphericalLaw, SpringSet
from tests.generator.model_files.imported_models import (
    MODELS,
    coordinate,
    fall,
    lost,
    placed,
    pose_in_model,
    rates,
    without_limits,
    written_and_read,
)
from tests.generator.model_files.mujoco_fall import MuJoCo, difference

HUMANOID = MODELS / "humanoid.xml"
MECHANISM = MODELS / "mechanism.xml"


def text_of(body: str, before: str = "") -> str:
    return f'<mujoco model="m">{before}<worldbody>{body}</worldbody></mujoco>'


def parsed(text: str, **choices: bool) -> Imported:
    return parse_model(Source("m.xml", text), None, **choices).require_value()


@pytest.fixture(params=[HUMANOID, MECHANISM], ids=["humanoid", "mechanism"])
def path(request: pytest.FixtureRequest) -> Path:
    return request.param


@pytest.mark.verify
@pytest.mark.parametrize("apart", [False, True])
def test_bodies_and_sites_stand_where_mujoco_has_them(path, apart):
    imported, twin = read_model(path, separate=apart), MuJoCo(path)
    rng = np.random.default_rng(3)
    for _ in range(5):
        values = rng.uniform(-1.2, 1.2, len(twin.names))
        twin.set(values, 0.0 * values)
        placement = placed(imported, dict(zip(twin.names, values, strict=True)))
        seen = 0
        for k in range(1, twin.model.nbody):
            name = twin.model.body(k).name
            if name in imported.figure.segments:
                pose = pose_in_model(placement, name)
                np.testing.assert_allclose(pose[:3, 3], twin.data.xpos[k], atol=1e-9)
                np.testing.assert_allclose(pose[:3, :3], twin.data.xmat[k].reshape(3, 3), atol=1e-9)
                seen += 1
        assert seen >= 4
        for k in range(twin.model.nsite):
            name = twin.model.site(k).name
            (home,) = [s.name for s in imported.figure.segments.values() if name in s.sites]
            pose = pose_in_model(placement, home, name)
            np.testing.assert_allclose(pose[:3, 3], twin.data.site_xpos[k], atol=1e-9)
            np.testing.assert_allclose(
                pose[:3, :3], twin.data.site_xmat[k].reshape(3, 3), atol=1e-9
            )


@pytest.mark.verify
def test_the_mass_is_mujocos_and_so_is_its_centre(path):
    imported, twin = read_model(path), MuJoCo(path)
    moving = [k for k in range(1, twin.model.nbody) if twin.model.body_weldid[k]]
    mass = float(twin.model.body_mass[moving].sum())
    assert imported.figure.total_mass == pytest.approx(mass, rel=1e-12)
    values = np.full(len(twin.names), 0.3)
    twin.set(values, 0.0 * values)
    placement = placed(imported, dict(zip(twin.names, values, strict=True)))
    ours = sum(
        segment.mass * pose_in_model(placement, name, "CM")[:3, 3]
        for name, segment in imported.figure.bodies.items()
    )
    theirs = (twin.model.body_mass[moving, None] * twin.data.xipos[moving]).sum(axis=0)
    np.testing.assert_allclose(ours, theirs, atol=1e-10)


@pytest.mark.verify
def test_a_passive_fall_is_mujocos(path, tmp_path):
    imported = without_limits(read_model(path, separate=True))
    assert difference(path, imported, tmp_path) < 1e-6


@pytest.mark.verify
def test_a_public_humanoid_falls_as_in_mujoco(tmp_path):
    """The humanoid of Gymnasium, which is the older one of MuJoCo."""
    found = find_spec("gymnasium")
    if found is None or found.origin is None:
        pytest.skip("gymnasium is not installed")
    path = Path(found.origin).parent / "envs" / "mujoco" / "assets" / "humanoid.xml"
    imported = without_limits(read_model(path, separate=True))
    assert imported.figure.total_mass > 40.0
    assert difference(path, imported, tmp_path) < 1e-6


PAW = """<body name="paw"><inertial pos="0 0 -.002" mass="5e-5" diaginertia="5e-11 4e-11 2e-11"/>
<joint name="p" axis="0 1 0"/><joint name="q" axis="1 .3 0"/><joint name="r" axis="0 .2 1"/>
</body>"""
"""Three oblique hinges of a paw of 0.05 g."""


@pytest.mark.parametrize("name", ["humanoid", "paw"])
def test_carriers_fall_by_compiled_integration(name: str):
    """Whose accelerations are those of Exudyn's equations."""
    imported = read_model(HUMANOID) if name == "humanoid" else parsed(text_of(PAW))
    figure = imported.figure
    assert any(segment.endswith("_1") for segment in figure.segments)
    speeds = rates(imported, dict.fromkeys(imported.coordinates, 1.0))
    run = simulate(figure, Plan(stop=0.1, springs=SpringSet(), velocities=speeds))
    assert (run.integrator, run.integrator_reason) == (Integrator.COMPILED, "")
    assert run.agreement_with_exudyn is not None
    assert run.agreement_with_exudyn < 1e-11


@pytest.mark.verify
def test_a_light_body_with_carriers_is_written_for_mujoco():
    figure, twin = parsed(text_of(PAW)).figure, pytest.importorskip("mujoco")
    text, _ = format_mjcf(figure, SpringSet())
    model = twin.MjModel.from_xml_string(text)
    assert model.nv == 3
    assert model.body_mass.sum() == pytest.approx(5e-5, rel=1e-12)


def test_hinges_through_one_point_make_one_joint():
    figure = read_model(HUMANOID).figure
    hip = figure.joints["hip_right"]
    assert [factor.axis for factor in hip.chain] == [(0, 1, 0), (0, 0, 1), (1, 0, 0)]
    assert hip.stiff == pytest.approx((20.0, 20.0, 20.0))
    assert np.degrees(hip.lower_limit) == pytest.approx([-110.0, -60.0, -30.0])
    assert figure.joints["abdomen"].degrees_of_freedom == 2
    assert figure.joints["abdomen_x"].degrees_of_freedom == 1
    assert len(figure.joints["shoulder_right"].chain) == 2
    assert not any("rotation vector" in loss.what for loss in read_model(HUMANOID).losses.entries)


HINGES = """<body name="arm"><inertial pos="0 0 -.3" mass="2" diaginertia=".02 .03 .01"/>
<joint name="a" axis="0 1 0" stiffness="5 2 1" damping=".3" {limits}/>
<joint name="b" axis="1 0 0" stiffness="4" springref="20" range="-70 70" limited="false"/>
<joint name="c" axis="0 0 1" stiffness="3" frictionloss=".2"/>{more}</body>"""
BALL = """<body name="hand" pos="0 0 -.6">
<inertial pos="0 0 -.1" mass="1" diaginertia=".01 .01 .01"/>
<joint name="ball" type="ball" {spring}/></body>"""


@pytest.mark.parametrize(
    ("limits", "spring", "law"),
    [
        ("", "", SphericalLaw.COORDINATES),
        ('range="-40 50"', "", SphericalLaw.COORDINATES),
        ("", 'stiffness="2"', SphericalLaw.CONSERVATIVE),
        ("", 'damping="0.1"', SphericalLaw.CONSERVATIVE),
    ],
)
def test_hinges_that_form_a_joint_have_a_law_of_coordinates_unless_a_ball_has_a_law(
    limits: str, spring: str, law: SphericalLaw, tmp_path: Path
):
    text = text_of(HINGES.format(limits=limits, more=BALL.format(spring=spring)))
    imported = parsed(text)
    assert written_and_read(imported, tmp_path)[1].law is law
    approximate = {one.what for one in imported.losses.entries if "rotation vector" in one.what}
    assert bool(approximate) == (law is SphericalLaw.CONSERVATIVE)
    apart = parsed(text, separate=True)
    assert written_and_read(apart, tmp_path)[1].law is SphericalLaw.CONSERVATIVE


@pytest.mark.parametrize(
    ("middle", "is_near"), [('range="-70 70"', False), ('range="-100 70"', True), ("", True)]
)
def test_three_hinges_that_may_come_to_their_pole_are_told(middle: str, is_near: bool):
    text = text_of(
        HINGES.format(limits="", more="").replace('range="-70 70" limited="false"', middle)
    )
    poles = [one.where for one in parsed(text).losses.entries if "have a pole" in one.what]
    assert poles == ([("arm",)] if is_near else [])


@pytest.mark.verify
def test_hinges_that_form_joints_fall_as_in_mujoco(tmp_path: Path):
    """Their springs, of one joint, are laws of its coordinates: those of each angle."""
    imported = without_limits(read_model(HUMANOID))
    assert max(len(joint.chain) for joint in imported.figure.joints.values()) == 6
    assert difference(HUMANOID, imported, tmp_path) < 1e-6


@pytest.mark.verify
def test_moments_of_hinges_that_form_a_joint_are_mujocos(tmp_path: Path):
    text = text_of(HINGES.format(limits="", more="").replace('frictionloss=".2"', ""))
    imported = parsed(text)
    figure, springs = written_and_read(imported, tmp_path)
    api = pytest.importorskip("mujoco")
    model = api.MjModel.from_xml_string(text)
    data = api.MjData(model)
    names = [model.joint(k).name for k in range(3)]
    order = [imported.coordinates[name].index for name in names]
    rows = np.random.default_rng(2).uniform(-1.2, 1.2, (40, 3))
    ours = our_moments(figure, springs, "arm", rows)
    for row, expected in zip(rows, ours, strict=True):
        data.qpos[:] = row[order]
        api.mj_forward(model, data)
        assert data.qfrc_spring == pytest.approx(expected[order], abs=2e-3)


def test_axes_that_miss_each_other_get_a_carrier():
    imported = read_model(HUMANOID)
    carrier, foot = (imported.figure.segments[name] for name in ("foot_right_1", "foot_right"))
    assert carrier.mass == pytest.approx(1e-9 * foot.mass, rel=1e-6)
    assert lost(imported, "oblique") == (
        "pelvis (abdomen_z, abdomen_y, abdomen_x)",
        "foot_right (ankle_y_right, ankle_x_right)",
    )


@pytest.mark.parametrize(
    ("words", "limited"),
    [
        ('range="-60 60"', True),
        ('range="0 0"', False),
        ('range="3 -3"', False),
        ('range="-60 60" limited="false"', False),
        ('range="-60 60" limited="true"', True),
    ],
)
def test_joints_are_limited_as_in_mujoco(words: str, limited: bool):
    text = text_of(f'<body><joint {words}/><geom size="0.1"/></body>')
    (joint,) = parsed(text).figure.joints.values()
    assert (joint.lower_limit is not None) == limited
    if find_spec("mujoco") is not None:
        import mujoco

        assert bool(mujoco.MjModel.from_xml_string(text).jnt_limited[0]) == limited


def test_carriers_of_light_bodies_have_inertia():
    slides = "".join(
        f'<joint type="slide" axis="{axis}" damping="1"/>' for axis in ("1 0 0", "0 1 0")
    )
    body = f'<body>{slides}<geom size="0.01"/></body>'
    text = f"<mujoco><worldbody>{body}</worldbody></mujoco>"
    figure = parse_model(Source("m.xml", text), None).require_value().figure
    assert all(min(segment.inertia or (0.0,)) > 0.0 for segment in figure.bodies.values())
    assert FIGURE_FILE.parse_text(write_figure(figure)).value is not None


def test_what_a_figure_does_not_hold_is_told_by_name():
    imported = read_model(HUMANOID)
    assert lost(imported, "actuators") == ("hip",)
    assert lost(imported, "tendons") == ("hamstring_right",)
    assert lost(imported, "sensors") == ("vestibule",)
    assert lost(imported, "key frames") == ("crouch",)
    assert lost(imported, "cameras") == ("side",)
    assert "knee_right" in lost(imported, "armature")
    assert lost(imported, "planes") == ("floor",)
    assert "thigh_left" in imported.surfaces
    assert lost(imported, "without a joint") == ("head", "hand_right")
    assert "timestep" in lost(imported, "settings of the simulation")
    assert lost(imported, "x, y, z of the model are z, x, y of the figure") == ()


def test_gravity_tells_what_is_up():
    body = '<body><joint/><geom size="0.1"/></body>'
    for gravity, up in (
        ("0 0 -9.81", (0, 0, 1)),
        ("0 -9.81 0", (0, 1, 0)),
        ("9.81 0 0", (-1, 0, 0)),
        ("3 4 0", (-0.6, -0.8, 0)),
    ):
        figure = parsed(text_of(body, f'<option gravity="{gravity}"/>')).figure
        turn = figure.segments[WORLD].sites[ORIGIN].pose_in_segment[:3, :3]
        np.testing.assert_allclose(turn @ (0, 1, 0), up, atol=1e-12)
        assert np.linalg.det(turn) == pytest.approx(1.0)


def test_another_gravity_is_told_with_the_option_that_gives_it():
    text = text_of('<body><joint/><geom size="0.1"/></body>', '<option gravity="0 0 -1.62"/>')
    assert lost(parsed(text), "--gravity 0,-1.62,0") == ()


def test_angles_count_from_the_pose_that_the_model_is_drawn_in():
    text = text_of(
        '<body><joint name="j" ref="30" springref="50" stiffness="4" range="-10 90"/>'
        '<geom size="0.1"/></body>'
    )
    imported = parsed(text)
    joint = imported.figure.joints["j"]
    assert np.degrees(imported.coordinates["j"].offset) == pytest.approx(30.0)
    assert np.degrees(joint.rest) == pytest.approx([20.0])
    assert np.degrees(joint.lower_limit) == pytest.approx([-40.0])
    assert np.degrees(joint.upper_limit) == pytest.approx([60.0])


def test_friction_and_growing_stiffness_stand_in_a_springs_file(tmp_path):
    text = text_of(
        '<body><joint name="j" axis="0 1 0" frictionloss="0.3" stiffness="4 1 2" damping="0.1"/>'
        '<geom size="0.1"/></body>'
    )
    _, springs = written_and_read(parsed(text), tmp_path)
    (axis,) = springs.joints["j"].axes
    assert (axis.damping.viscous, axis.damping.coulomb) == (0.1, 0.3)
    (law,) = axis.elastic
    assert law.torque(0.5) == pytest.approx(-(4 * 0.5 + 0.25 + 2 * 0.125))


def test_principal_axes_are_the_segments_axes():
    text = text_of(
        '<body name="b"><joint/><inertial pos="0 0 0" mass="1" '
        'fullinertia="0.02 0.025 0.012 0.002 -0.001 0.003"/></body>'
    )
    segment = parsed(text).figure.segments["b"]
    turn = segment.sites["frame"].pose_in_segment[:3, :3]
    tensor = turn.T @ np.diag(segment.inertia) @ turn
    expected = [[0.02, 0.002, -0.001], [0.002, 0.025, 0.003], [-0.001, 0.003, 0.012]]
    np.testing.assert_allclose(tensor, expected, atol=1e-15)
    # The nearest of the 24 ways to name the axes.
    assert np.all(np.diag(turn) > 0.8)


def test_the_compiler_tells_the_least_and_the_total_mass():
    bodies = text_of(
        '<body name="a"><joint name="i"/><geom size="0.1" mass="1"/></body>'
        '<body name="b"><joint name="j"/><geom size="0.1" mass="3"/></body>'
        '<body name="c"><geom size="0.1" mass="4"/></body>',
        "{}",
    )
    total = parsed(bodies.format('<compiler settotalmass="16"/>')).figure
    assert total.segments["a"].mass == pytest.approx(2.0)
    assert total.segments["b"].inertia == pytest.approx((0.4 * 6.0 * 0.01,) * 3)
    least = parsed(bodies.format('<compiler boundmass="2" boundinertia="0.01"/>')).figure
    assert [least.segments[name].mass for name in "ab"] == pytest.approx([2.0, 3.0])
    assert least.segments["a"].inertia == pytest.approx((0.01,) * 3)


def test_a_ball_keeps_its_springs_exactly():
    joint = read_model(MECHANISM).figure.joints["socket"]
    assert joint.stiff == (2.0, 2.0, 2.0)
    assert len(joint.chain) == 3


FREE = """<body name="ball"><joint name="fly" type="free" damping="0.5"/>
  <inertial pos="0 0 0" mass="2" diaginertia="0.1 0.2 0.25"/></body>"""


@pytest.mark.parametrize("by_default", [False, True])
def test_a_free_joint_may_have_damping(by_default, tmp_path):
    """v0 m / c (1 - exp(-c t / m)) along x; the same with the moment of inertia about z."""
    text = text_of(FREE)
    if by_default:
        defaults = '<default><joint damping="0.5"/></default>'
        text = text_of(FREE.replace(' damping="0.5"', ""), defaults)
    imported = parsed(text)
    speeds = {"fly_tx": 1.0, "fly_z": 2.0}
    recording = fall(imported, tmp_path, {}, speeds, gravity=0.0)
    end = {name: coordinate(imported, recording, name)[-1] for name in speeds}
    assert end["fly_tx"] == pytest.approx(1.0 * 2.0 / 0.5 * (1.0 - np.exp(-0.5 * 0.5 / 2.0)))
    assert end["fly_z"] == pytest.approx(2.0 * 0.25 / 0.5 * (1.0 - np.exp(-0.5 * 0.5 / 0.25)))


BOUNDS = [
    ('balanceinertia="true"', "1e-4 2e-4 0.00131", (1.61e-3 / 3.0,) * 3),
    ('boundinertia="0.001"', "1e-4 2e-4 0.00131", (0.001, 0.001, 0.00131)),
    ('balanceinertia="true" boundinertia="0.001"', "1e-4 2e-4 0.00131", (0.001, 0.001, 0.00131)),
    ('balanceinertia="true" boundinertia="0.001"', "1e-4 2e-4 0.003", (0.005 / 3.0,) * 3),
]


@pytest.mark.parametrize(("settings", "moments", "expected"), BOUNDS)
def test_moments_of_inertia_are_bounded_first_and_balanced_then(settings, moments, expected):
    body = f"""<body name="toes"><joint axis="1 0 0"/>
      <inertial pos="0 0 0" mass="1" diaginertia="{moments}"/></body>"""
    imported = parsed(text_of(body, f"<compiler {settings}/>"))
    assert imported.figure.segments["toes"].inertia == pytest.approx(expected, rel=1e-12)


@pytest.mark.verify
@pytest.mark.parametrize(("settings", "moments", "expected"), BOUNDS)
def test_the_bounded_moments_are_mujocos(settings, moments, expected):
    mujoco = pytest.importorskip("mujoco")
    body = f"""<body name="toes"><joint axis="1 0 0"/>
      <inertial pos="0 0 0" mass="1" diaginertia="{moments}"/></body>"""
    model = mujoco.MjModel.from_xml_string(text_of(body, f"<compiler {settings}/>"))
    assert sorted(model.body_inertia[1]) == pytest.approx(expected, rel=1e-12)


def test_inertia_that_no_body_has_is_still_refused():
    body = """<body name="toes"><joint axis="1 0 0"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1e-4 2e-4 0.003"/></body>"""
    text = text_of(body, '<compiler boundinertia="0.001"/>')
    (fault,) = parse_model(Source("m.xml", text), None).diagnostics
    assert "principal moments" in fault.message


MASSLESS = """<body name="arm"><joint name="j" axis="1 0 0"/>
  <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/>
  <body name="disc" pos="0 0 1" euler="0 0 90"><inertial pos="0 0 0" mass="0" diaginertia="5 7 9"/>
  </body></body>"""


def test_inertia_without_mass_is_added_to_the_body_it_is_fixed_to():
    inertia = parsed(text_of(MASSLESS)).figure.segments["arm"].inertia
    assert inertia == pytest.approx((7.1, 5.1, 9.1), rel=1e-12)


@pytest.mark.verify
def test_inertia_without_mass_is_added_as_in_mujoco():
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(text_of(MASSLESS))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    matrix = np.zeros((1, 1))
    mujoco.mj_fullM(model, data, matrix)
    assert matrix[0, 0] == pytest.approx(7.1, rel=1e-12)


@pytest.mark.parametrize("parent", ["", '<joint name="j"/><inertial pos="0 0 0" mass="1" '
                                        'diaginertia="1 1 1"/>'])  # fmt: skip
def test_a_fixed_body_and_a_site_of_one_name_keep_both_frames(parent):
    peg = '<body name="peg" pos="0 0 1"><site name="peg" pos="0.3 0 0"/></body>'
    other = '<body name="arm"><joint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
    imported = parsed(text_of(f'<body name="base">{parent}{peg}</body>{other}</body>'))
    home = imported.figure.segments["base" if parent else WORLD]
    (renamed,) = lost(imported, "changed names")
    assert renamed == "`peg` is `peg_2`"
    between = home.sites["peg_2"].pose_in_segment[:3, 3] - home.sites["peg"].pose_in_segment[:3, 3]
    np.testing.assert_allclose(between, [0.3, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(home.sites["peg"].pose_in_segment[2, 3], 1.0, atol=1e-12)
