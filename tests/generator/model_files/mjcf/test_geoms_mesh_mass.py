"""Masses from meshes: by hand, and those of MuJoCo's compiler."""

from typing import Any

import numpy as np
import pytest

from generator.diagnostics import Source
from generator.inertia import MassProperties
from generator.model_files.formats import parse_model
from generator.model_files.mjcf.geoms import RULES, inertia_box
from tests.generator.model_files.imported_models import lost

ANGLE_BAR = np.array([[0, 0], [4, 0], [4, 1], [1, 1], [1, 3], [0, 3]]) * 0.1
"""A concave outline of 0.06 m2."""

HEIGHT = 0.2


def bar() -> tuple[str, str]:
    """Vertices and triangles of the angle bar, as attributes."""
    count = len(ANGLE_BAR)
    rows = [[*point, z] for z in (0.0, HEIGHT) for point in ANGLE_BAR]
    fans = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]
    sides = [(k, (k + 1) % count) for k in range(count)]
    faces = [face[::-1] for face in fans] + [tuple(k + count for k in face) for face in fans]
    faces += [(a, b, b + count) for a, b in sides] + [(a, b + count, a + count) for a, b in sides]
    vertex = " ".join(f"{number:g}" for row in rows for number in row)
    return vertex, " ".join(str(k) for face in faces for k in face)


def model(geom: str, mesh: str = "", flip: bool = False) -> str:
    vertex, face = bar()
    if flip:
        face = " ".join(reversed(face.split()))
    return f"""<mujoco><compiler angle="degree"/><asset>
    <mesh name="bar" vertex="{vertex}" face="{face}" {mesh}/></asset>
    <worldbody><body name="b" pos="0 0 1"><joint name="j" type="ball"/>{geom}</body></worldbody>
    </mujoco>"""


GEOM = '<geom type="mesh" mesh="bar" pos=".1 .2 .3" euler="10 20 30"/>'


def mass_of(text: str) -> MassProperties:
    """The mass properties of the segment in the frame of the model's body."""
    imported = parse_model(Source("m.xml", text)).require_value()
    segment = imported.figure.segments["b"]
    assert segment.mass is not None
    assert segment.inertia is not None
    frame, centre = (segment.sites[name].pose_in_segment for name in ("frame", "CM"))
    there = MassProperties(segment.mass, centre[:3, 3], np.diag(segment.inertia))
    return there.transform(np.linalg.inv(frame))


@pytest.mark.parametrize(("rule", "volume"), [("exact", 0.012), ("convex", 0.018)])
def test_the_volume_is_that_of_the_solid_or_its_hull(rule: str, volume: float):
    found = mass_of(model('<geom type="mesh" mesh="bar"/>', f'inertia="{rule}"'))
    assert found.mass == pytest.approx(1000.0 * volume, rel=1e-12)


def test_a_shell_has_its_area_and_a_mass_counts_as_it_is():
    found = mass_of(model('<geom type="mesh" mesh="bar" density="2"/>', 'inertia="shell"'))
    assert found.mass == pytest.approx(2.0 * (2.0 * 0.06 + 1.4 * HEIGHT), rel=1e-12)
    assert mass_of(model('<geom type="mesh" mesh="bar" mass="3"/>')).mass == pytest.approx(3.0)


def test_the_legacy_rule_has_too_much_of_a_concave_mesh():
    assert mass_of(model(GEOM)).mass > 12.5


def test_a_box_has_the_inertia_of_the_mesh():
    solid = MassProperties(2.0, np.ones(3), np.diag([0.5, 0.2, 0.4]))
    pose, half = inertia_box(solid)
    squares = half**2
    moments = 2.0 / 3.0 * (squares.sum() - squares)
    np.testing.assert_allclose(pose[:3, :3] @ np.diag(moments) @ pose[:3, :3].T, solid.inertia)
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
    assert half[2] == half.max()


@pytest.mark.parametrize(
    ("mesh", "flip", "reason"),
    [
        ('inertia="exact"', True, "face inwards"),
        ('inertia="heavy"', False, "is not a rule"),
        ('scale="1 1 0"', False, "a scale is not zero"),
        ('inertia="exact" face="0 1 2"', False, "volume"),
    ],
)
def test_what_has_no_mass_is_refused(mesh: str, flip: bool, reason: str):
    text = model(GEOM, mesh, flip)
    if "face=" in mesh:
        text = text.replace(f'face="{bar()[1]}" ', "")
    messages = [one.message for one in parse_model(Source("m.xml", text)).diagnostics]
    assert any(reason in message for message in messages), messages


def test_a_mesh_without_its_file_has_no_mass():
    text = '<mujoco><asset><mesh name="m" file="gone.stl"/></asset><worldbody><body><freejoint/>'
    text += '<geom type="mesh" mesh="m"/></body></worldbody></mujoco>'
    (found,) = parse_model(Source("m.xml", text)).diagnostics
    assert "cannot be read" in found.message
    weightless = text.replace('mesh="m"/></body>', 'mesh="m" mass="0"/><geom size="1"/></body>')
    assert lost(parse_model(Source("m.xml", weightless)).require_value(), "file is missing")


@pytest.mark.verify
@pytest.mark.parametrize("rule", ["", *RULES])
@pytest.mark.parametrize("scale", ["1 1 1", "2 1 -.5"])
@pytest.mark.parametrize(
    "geom",
    [
        GEOM,
        GEOM.replace("/>", ' mass="2.5"/>'),
        '<frame pos="0 .1 0" euler="0 40 0">' + GEOM + "</frame>" + '<geom size=".1"/>',
        *(GEOM.replace('"mesh"', f'"{shape}"', 1) for shape in ("box", "ellipsoid", "cylinder")),
        *(GEOM.replace('"mesh"', f'"{shape}" fitscale=".9"', 1) for shape in ("sphere", "capsule")),
    ],
)
def test_mass_centre_and_inertia_are_mujocos(rule: str, scale: str, geom: str):
    api: Any = pytest.importorskip("mujoco")
    text = model(geom, f'scale="{scale}"' + (f' inertia="{rule}"' if rule else ""))
    theirs, ours = api.MjModel.from_xml_string(text), mass_of(text)
    turn = np.zeros(9)
    api.mju_quat2Mat(turn, theirs.body_iquat[1])
    turn = turn.reshape(3, 3)
    assert ours.mass == pytest.approx(theirs.body_mass[1], rel=1e-6)  # vertices of 24 bits
    np.testing.assert_allclose(ours.centre, theirs.body_ipos[1], atol=1e-6)
    inertia = turn @ np.diag(theirs.body_inertia[1]) @ turn.T
    np.testing.assert_allclose(ours.inertia, inertia, atol=1e-6 * np.abs(inertia).max())
