"""Shapes of geoms: where MuJoCo has them, of the geoms that a model draws, in their colours."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from generator.diagnostics import Source
from generator.geometry.read import segment_colour
from generator.model_files.formats import parse_model, read_model
from generator.model_files.model_files import Imported
from generator.rotations import Array
from tests.generator.model_files.imported_models import lost

TETRAHEDRON = 'vertex="0 0 0  1 0 0  0 2 0  0 0 3"'

GEOMS = {
    "sphere": '<geom type="sphere" size=".3" pos="1 2 3"/>',
    "box": '<geom type="box" size=".1 .2 .3" pos="1 2 3" euler="10 20 30"/>',
    "capsule": '<geom type="capsule" size=".1" fromto="0 0 0 1 2 3"/>',
    "cylinder": '<geom type="cylinder" size=".1 .4" quat="1 2 3 4"/>',
    "ellipsoid": '<geom type="ellipsoid" size=".1 .2 .3" zaxis="1 1 0"/>',
    "default class": '<geom class="thin" pos="0 1 0"/>',
    "mesh": '<geom type="mesh" mesh="m" pos=".5 0 0" euler="10 20 30"/>',
    "moved mesh": '<geom type="mesh" mesh="moved" axisangle="0 1 0 40"/>',
    "mirrored mesh": '<geom type="mesh" mesh="mirrored" pos=".5 0 0"/>',
    "in a frame": '<frame pos="0 0 1" euler="0 90 0"><geom size=".2" pos="1 0 0"/></frame>',
}

MODEL = f"""<mujoco><default><default class="thin"><geom type="box" size=".1 .1 .5"/></default>
  </default><asset><mesh name="m" {TETRAHEDRON}/>
  <mesh name="moved" {TETRAHEDRON} refpos=".1 .2 .3" refquat=".9 .1 .2 .3" scale="1 2 3"/>
  <mesh name="mirrored" {TETRAHEDRON} scale="1 1 -1"/></asset>
  <worldbody><body name="b"><freejoint/>
  <inertial mass="1" diaginertia="1 1 1" pos="0 0 0"/>{{}}</body></worldbody></mujoco>"""


def parsed(geoms: str, assets: str = "", directory: Path | None = None) -> Imported:
    text = MODEL.format(geoms).replace("</asset>", f"{assets}</asset>")
    return parse_model(Source("m.xml", text), directory).require_value()


def extent(points: Array) -> Array:
    return np.array([points.min(axis=0), points.max(axis=0)])


def directions() -> Array:
    rows = np.random.default_rng(5).normal(size=(40, 3))
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def support(api: Any, data: Any, model: Any) -> Array:
    """Farthest distance of the only geom along each direction, by MuJoCo's sizes."""
    turn, at = data.geom_xmat[0].reshape(3, 3), data.geom_xpos[0]
    local = directions() @ turn
    size, kind = model.geom_size[0], api.mjtGeom(model.geom_type[0])
    match kind.name:
        case "mjGEOM_SPHERE":
            reach = np.full(len(local), size[0])
        case "mjGEOM_BOX":
            reach = np.abs(local) @ size
        case "mjGEOM_CAPSULE":
            reach = size[0] + np.abs(local[:, 2]) * size[1]
        case "mjGEOM_CYLINDER":
            reach = size[0] * np.hypot(local[:, 0], local[:, 1]) + np.abs(local[:, 2]) * size[1]
        case "mjGEOM_ELLIPSOID":
            reach = np.linalg.norm(local * size, axis=1)
        case _:
            reach = (local @ model.mesh_vert[mesh_rows(model)].T).max(axis=1)
    return reach + directions() @ at


def mesh_rows(model: Any) -> slice:
    mesh = model.geom_dataid[0]
    start = model.mesh_vertadr[mesh]
    return slice(start, start + model.mesh_vertnum[mesh])


@pytest.mark.verify
@pytest.mark.parametrize("name", GEOMS)
def test_shapes_are_where_mujoco_has_them(name: str):
    api: Any = pytest.importorskip("mujoco")
    model = api.MjModel.from_xml_string(MODEL.format(GEOMS[name]))
    data = api.MjData(model)
    api.mj_kinematics(model, data)
    theirs = support(api, data, model)
    ours = (directions() @ parsed(GEOMS[name]).surfaces["b"].vertices.T).max(axis=1)
    # Corners of round shapes lie on them, so that the shape itself reaches a little farther.
    rounding = 0.02 if "mesh" not in name and name not in ("box", "default class") else 1e-6
    assert np.all(ours <= theirs + 1e-6)
    assert np.all(ours >= theirs - rounding)


def test_geoms_without_contact_are_the_shape_of_a_body():
    drawn = '<geom size=".1" contype="0" conaffinity="0" rgba="1 0 0 1"/>'
    imported = parsed(f'{drawn}<geom type="box" size="9 9 9"/>')
    assert np.abs(imported.surfaces["b"].vertices).max() == pytest.approx(0.1)
    lost(imported, "contact of geoms")


def test_all_geoms_are_the_shape_of_a_body_otherwise():
    imported = parsed('<geom size=".1"/><geom type="box" size="9 9 9"/>')
    assert np.abs(imported.surfaces["b"].vertices).max() == pytest.approx(9.0)


def test_what_is_invisible_or_endless_is_not_a_shape():
    imported = parsed('<geom size="9" rgba="1 1 1 0"/><geom size=".1"/>')
    assert np.abs(imported.surfaces["b"].vertices).max() == pytest.approx(0.1)
    text = MODEL.format('<geom size=".1"/>').replace(
        "<worldbody>", '<worldbody><geom name="floor" type="plane" size="1 1 1"/>'
    )
    imported = parse_model(Source("m.xml", text), None).require_value()
    assert lost(imported, "planes") == ("floor",)
    assert list(imported.surfaces) == ["b"]


@pytest.mark.parametrize(
    ("geom", "colour"),
    [
        ('<geom size=".1"/>', (0.5, 0.5, 0.5)),
        ('<geom size=".1" rgba="1 0 .25 1"/>', (1.0, 0.0, 0.25)),
        ('<geom size=".1" material="skin"/>', (0.0, 0.75, 1.0)),
        ('<geom size=".1" material="skin" rgba="1 0 .25 1"/>', (1.0, 0.0, 0.25)),
    ],
)
def test_colours_are_those_of_geoms_or_materials(geom: str, colour: tuple[float, float, float]):
    figure = parsed(geom, '<material name="skin" rgba="0 .75 1 1"/>').figure
    assert segment_colour(figure, figure.segments["b"]) == colour


def test_textures_are_lost():
    imported = parsed('<geom size=".1" material="m"/>', '<material name="m" texture="t"/>')
    assert lost(imported, "textures") == ("m",)


def test_a_mesh_without_faces_is_its_convex_hull():
    inside = 'vertex="0 0 0 1 0 0 0 1 0 0 0 1 .1 .1 .1"'
    surface = parsed('<geom type="mesh" mesh="h"/>', f'<mesh name="h" {inside}/>').surfaces["b"]
    assert len(surface.vertices) == surface.face_count == 4


def test_a_reference_without_length_turns_nothing():
    meshes = (f'<mesh name="n" {TETRAHEDRON} {turn}/>' for turn in ("", 'refquat="1e-200 0 0 0"'))
    plain, turned = (parsed('<geom type="mesh" mesh="n"/>', one).surfaces["b"] for one in meshes)
    np.testing.assert_array_equal(turned.vertices, plain.vertices)


def msh(points: Array, faces: Array) -> bytes:
    head = np.array([len(points), 0, 0, len(faces)], dtype="<i4")
    return head.tobytes() + points.astype("<f4").tobytes() + faces.astype("<i4").tobytes()


def test_mesh_files_are_read_from_the_folder_of_meshes(tmp_path: Path):
    (tmp_path / "parts").mkdir()
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    (tmp_path / "parts/a.msh").write_bytes(msh(np.eye(4, 3), faces))
    obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    (tmp_path / "parts/b.obj").write_text(obj)
    text = MODEL.format('<geom type="mesh" mesh="a"/><geom type="mesh" mesh="b" pos="0 0 5"/>')
    text = text.replace(
        "</asset>", '<mesh file="a.msh"/><mesh file="b.obj" scale="2 2 2"/></asset>'
    )
    model = tmp_path / "m.xml"
    model.write_text(text.replace("<default>", '<compiler meshdir="parts"/><default>', 1))
    surface = read_model(model).surfaces["b"]
    assert surface.face_count == 5
    np.testing.assert_allclose(extent(surface.vertices), [[0, 0, 0], [2, 2, 5]])


@pytest.mark.parametrize(
    ("content", "sentence"),
    [(None, "missing"), (b"", "cannot be read"), (b"\1\0\0\0" * 4, "cannot be read")],
)
def test_a_mesh_file_that_cannot_be_read_is_a_loss(
    content: bytes | None, sentence: str, tmp_path: Path
):
    if content is not None:
        (tmp_path / "a.msh").write_bytes(content)
    imported = parsed(
        '<geom type="mesh" mesh="a"/><geom size=".1"/>', '<mesh file="a.msh"/>', tmp_path
    )
    assert lost(imported, sentence) == ("a.msh",)
    assert "b" in imported.surfaces


@pytest.mark.parametrize(
    ("geom", "assets", "message"),
    [
        ('<geom type="mesh" mesh="n"/>', "", "unknown mesh `n`"),
        ('<geom type="mesh" mesh="n"/>', '<mesh name="n" vertex="1 2 3 4 5 6 7 8 9 1"/>', "three"),
        (
            '<geom type="mesh" mesh="n"/>',
            f'<mesh name="n" {TETRAHEDRON} face="0 1 4"/>',
            "a corner that is not a vertex",
        ),
        ('<geom type="mesh" mesh="n"/>', f'<mesh name="n" {TETRAHEDRON} scale="0 1 1"/>', "scale"),
        ('<geom type="cone" size="1"/>', "", "unknown geom type `cone`"),
        ('<geom type="mesh"/>', "", "this geom names no mesh"),
        ('<geom type="ellipsoid" size="1"/>', "", "an ellipsoid needs 3 positive sizes"),
    ],
)
def test_a_wrong_geom_is_refused(geom: str, assets: str, message: str):
    text = MODEL.format(geom).replace("</asset>", f"{assets}</asset>")
    (fault,) = parse_model(Source("m.xml", text), None).diagnostics
    assert message in fault.message
