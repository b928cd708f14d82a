"""Visuals of URDF: shapes, colours, and mesh files of packages."""

from pathlib import Path

import numpy as np
import pytest

from generator.diagnostics import Source
from generator.geometry.read import segment_colour
from generator.model_files.formats import parse_model
from generator.model_files.model_files import Imported
from tests.generator.model_files.imported_models import lost

ROBOT = """<robot name="r"><material name="paint"><color rgba="0 0.5 1 1"/></material>
<link name="base"/><link name="arm"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>{}</link>
<joint name="pin" type="continuous"><parent link="base"/><child link="arm"/></joint></robot>"""

OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def visual(shape: str, extra: str = "", tag: str = "visual") -> str:
    return f"<{tag}>{extra}<geometry>{shape}</geometry></{tag}>"


def parsed(inner: str, directory: Path | None = None) -> Imported:
    return parse_model(Source("r.urdf", ROBOT.format(inner)), directory).require_value()


SIZES = {
    '<box size="2 4 6"/>': (1.0, 2.0, 3.0),
    '<sphere radius="2"/>': (2.0, 2.0, 2.0),
    '<cylinder radius="1" length="4"/>': (1.0, 1.0, 2.0),
    '<capsule radius="1" length="4"/>': (1.0, 1.0, 3.0),
}


@pytest.mark.parametrize("shape", SIZES)
def test_shapes_have_their_sizes(shape: str):
    surface = parsed(visual(shape)).surfaces["arm"]
    np.testing.assert_allclose(surface.vertices.max(axis=0), SIZES[shape], rtol=1e-12)


def test_an_origin_rotates_and_moves_a_shape():
    origin = '<origin xyz="0 0 10" rpy="1.5707963267948966 0 0"/>'
    surface = parsed(visual('<box size="2 4 6"/>', origin)).surfaces["arm"]
    np.testing.assert_allclose(surface.vertices.max(axis=0), [1.0, 3.0, 12.0], rtol=1e-12)


def test_other_elements_beside_a_shape_are_reported():
    model = parsed(visual('<drake:blob/><box size="2 4 6"/><material name="paint"/>'))
    assert lost(model, "unknown elements") == ("drake:blob", "material")
    assert model.surfaces["arm"].face_count == 6


def test_visuals_are_the_shape_and_collisions_where_there_are_none():
    collision = visual('<box size="8 8 8"/>', tag="collision")
    imported = parsed(visual('<sphere radius="1"/>') + collision)
    assert imported.surfaces["arm"].vertices.max() == pytest.approx(1.0)
    lost(imported, "contact")
    assert parsed(collision).surfaces["arm"].vertices.max() == pytest.approx(4.0)


@pytest.mark.parametrize(
    "material",
    ['<material name="paint"/>', '<material name="x"><color rgba="0 0.5 1 0.3"/></material>'],
)
def test_colours_are_those_of_materials(material: str):
    figure = parsed(visual('<sphere radius="1"/>', material)).figure
    assert segment_colour(figure, figure.segments["arm"]) == (0.0, 0.5, 1.0)


@pytest.mark.parametrize(
    "place",
    ["robots/mine_description/meshes", "robots/meshes", "robots/mine_description/urdf/meshes"],
)
def test_packages_are_folders_above_the_model(place: str, tmp_path: Path):
    model = tmp_path / "robots/mine_description/urdf"
    model.mkdir(parents=True)
    (tmp_path / place).mkdir(parents=True)
    (tmp_path / place / "arm.obj").write_text(OBJ)
    mesh = '<mesh filename="package://mine_description/meshes/arm.obj" scale="2 2 2"/>'
    surface = parsed(visual(mesh), model).surfaces["arm"]
    assert surface.vertices.max() == 2.0


def test_files_are_named_by_paths_too(tmp_path: Path):
    (tmp_path / "arm.obj").write_text(OBJ)
    for name in ("arm.obj", f"file://{tmp_path}/arm.obj"):
        mesh = visual(f'<mesh filename="{name}"/>')
        assert parsed(mesh, tmp_path).surfaces["arm"].face_count == 1


def test_a_missing_mesh_is_a_loss():
    names = {"package://other/arm.stl": "missing", "arm.stl": "missing", "package://a": "not read"}
    for name, word in names.items():
        imported = parsed(visual(f'<mesh filename="{name}"/>'))
        assert lost(imported, word) == (name,)
        assert imported.surfaces == {}
    assert str(parsed(visual("<mesh/>")).losses.entries[0]) == "meshes without a file"


@pytest.mark.parametrize(
    ("shape", "message"),
    [('<box size="1 -1 1"/>', "is negative"), ("<blob/>", "unknown shape `blob`")],
)
def test_a_wrong_shape_is_refused(shape: str, message: str):
    (fault,) = parse_model(Source("r.urdf", ROBOT.format(visual(shape)))).diagnostics
    assert message in fault.message


ZERO = ['<box size="0 0 0"/>', '<sphere radius="0"/>', '<cylinder radius="1" length="0"/>']


@pytest.mark.parametrize("tag", ["visual", "collision"])
@pytest.mark.parametrize("shape", ZERO)
def test_a_shape_of_size_zero_is_left_out(shape: str, tag: str):
    imported = parsed(visual(shape, tag=tag) + visual('<box size="2 4 6"/>', tag=tag))
    assert imported.surfaces["arm"].face_count == 6
    assert lost(imported, "size zero") == (f"{shape[1:].split()[0]} of arm",)


def test_a_mesh_that_is_scaled_to_nothing_is_left_out(tmp_path: Path):
    (tmp_path / "arm.obj").write_text(OBJ)
    imported = parsed(visual('<mesh filename="arm.obj" scale="1 0 1"/>'), tmp_path)
    assert imported.surfaces == {}
    assert lost(imported, "size zero") == ("mesh of arm",)
