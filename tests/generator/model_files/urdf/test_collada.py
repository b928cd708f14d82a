"""Surfaces of COLLADA files, by hand and as Pinocchio reads them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from generator.diagnostics import InputError
from generator.geometry.surface import build_tetrahedra
from generator.model_files.formats import read_model
from generator.model_files.urdf.collada import read_collada
from generator.rotations import Array

AXES = "".join(f'<param name="{name}" type="float"/>' for name in "XYZ")

SOURCE = f"""<source id="p"><float_array id="a" count="12">0 0 0  1 0 0  0 2 0  0 0 3</float_array>
<technique_common><accessor source="#a" count="4" stride="3">{AXES}</accessor></technique_common>
</source><source id="n"><float_array id="b" count="3">0 0 1</float_array>
<technique_common><accessor source="#b" count="1" stride="3">{AXES}</accessor></technique_common>
</source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>"""

INPUTS = """<input semantic="VERTEX" source="#v" offset="0"/>
<input semantic="NORMAL" source="#n" offset="1"/>"""

FACES = {
    "triangles": "<p>0 0 2 0 1 0  0 0 1 0 3 0  1 0 2 0 3 0  0 0 3 0 2 0</p>",
    "polylist": "<vcount>3 3 3 3</vcount><p>0 0 2 0 1 0 0 0 1 0 3 0 1 0 2 0 3 0 0 0 3 0 2 0</p>",
    "polygons": "<p>0 0 2 0 1 0</p><p>0 0 1 0 3 0</p><p>1 0 2 0 3 0</p><p>0 0 3 0 2 0</p>",
    "trifans": "<p>3 0 0 0 1 0 2 0 0 0</p><p>0 0 2 0 1 0</p>",
    "tristrips": "<p>0 0 1 0 3 0 2 0 0 0</p><p>0 0 2 0 1 0</p>",
}

SCENE = """<library_visual_scenes><visual_scene id="s"><node>
<translate>0.5 0 0</translate><rotate>0 0 1 90</rotate><scale>1 1 2</scale>
<node><matrix>1 0 0 0.25  0 1 0 0  0 0 1 0  0 0 0 1</matrix><instance_geometry url="#g"/></node>
<instance_node url="#more"/></node></visual_scene></library_visual_scenes>
<library_nodes><node id="more"><translate>0 0 -4</translate><instance_geometry url="#g"/></node>
</library_nodes>"""


def written(folder: Path, kind: str = "triangles", up: str = "Z_UP", scene: str = SCENE) -> Path:
    path = folder / "part.dae"
    path.write_text(
        f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimetre" meter="0.01"/><up_axis>{up}</up_axis></asset>
<library_geometries><geometry id="g"><mesh>{SOURCE}<{kind} count="4">{INPUTS}{FACES[kind]}
</{kind}></mesh></geometry></library_geometries>{scene}
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""
    )
    return path


def extent(points: Array) -> Array:
    return np.array([points.min(axis=0), points.max(axis=0)])


@pytest.mark.parametrize("kind", FACES)
def test_faces_stand_where_the_nodes_place_them(tmp_path: Path, kind: str):
    found = read_collada(written(tmp_path, kind))
    # Turned by 90 deg the box of x from 0 to 1 and y from 0 to 2 has x from -2 to 0, y from 0 to 1.
    np.testing.assert_allclose(
        extent(found.vertices), [[-0.015, 0.0, -0.08], [0.005, 0.0125, 0.06]], atol=1e-15
    )
    assert found.face_count == 8
    assert build_tetrahedra(found).volume == pytest.approx(2 * 2 * 1e-6, rel=1e-12)


def test_without_a_scene_the_geometries_stand_at_the_origin(tmp_path: Path):
    found = read_collada(written(tmp_path, scene=""))
    np.testing.assert_allclose(extent(found.vertices), [[0.0, 0.0, 0.0], [0.01, 0.02, 0.03]])


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('url="#more"', 'url="#s"'),  # a circle
        ('url="#g"', 'url="#gone"'),
        ("0 0 3</float_array>", "0 0</float_array>"),
        ("1 0 2 0 3 0", "1 0 2 0 9 0"),
        ("1 0 2 0 3 0", "1 0 2 0 x 0"),
        ('semantic="VERTEX"', 'semantic="NORMAL"'),
        ('semantic="POSITION"', 'semantic="WEIGHT"'),
        ("<matrix>1 ", "<matrix>"),
        ("COLLADA", "OTHER"),
        ("</COLLADA>", ""),
        ("triangles", "lines"),
    ],
)
def test_damaged_files_are_refused(tmp_path: Path, old: str, new: str):
    path = written(tmp_path)
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(InputError, match="cannot be read as dae"):
        read_collada(path)


ROBOT = """<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial><visual>
<origin xyz="0 0.1 0"/><geometry><mesh filename="part.dae" scale="2 1 1"/></geometry></visual>
</link><joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint></robot>"""


@pytest.mark.verify
@pytest.mark.parametrize("up", ["Z_UP", "Y_UP", "X_UP"])
def test_pinocchio_has_the_same_vertices(tmp_path: Path, up: str):
    """It takes units for metres, as RViz does not."""
    api: Any = pytest.importorskip("pinocchio")
    part = written(tmp_path, up=up)
    part.write_text(part.read_text().replace('meter="0.01"', 'meter="1"'))
    path = tmp_path / "robot.urdf"
    path.write_text(ROBOT)
    model = api.buildModelFromUrdf(str(path))
    shapes = api.buildGeomFromUrdf(
        model, str(path), api.GeometryType.VISUAL, package_dirs=[str(tmp_path)]
    )
    theirs = np.array(shapes.geometryObjects[0].geometry.vertices())
    ours = read_model(path).surfaces["b"].vertices
    np.testing.assert_allclose(extent(ours) - [0.0, 0.1, 0.0], extent(theirs), atol=1e-5)
