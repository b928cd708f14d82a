"""Geometry of OpenSim's models: its frames, sizes, scales and colours."""

from pathlib import Path

import numpy as np
import pytest

from generator.diagnostics import InputError, Source
from generator.geometry.read import segment_colour
from generator.model_files.formats import parse_model
from generator.model_files.model_files import Imported
from generator.model_files.opensim.read import read_vtp
from tests.generator.model_files.imported_models import lost

MODEL = """<OpenSimDocument Version="40500"><Model name="m">
<Ground name="ground"><attached_geometry/></Ground>
<BodySet name="bodyset"><objects><Body name="b"><mass>1</mass><mass_center>0 0 0</mass_center>
<inertia>1 1 1 0 0 0</inertia><components><PhysicalOffsetFrame name="off">
<socket_parent>..</socket_parent><translation>0 0 5</translation>
<orientation>0 0 1.5707963267948966</orientation>{0}</PhysicalOffsetFrame></components>{1}</Body>
</objects></BodySet><JointSet name="jointset"><objects><PinJoint name="j">
<socket_parent_frame>/ground</socket_parent_frame><socket_child_frame>/bodyset/b
</socket_child_frame></PinJoint></objects></JointSet></Model></OpenSimDocument>"""

VTP = """<VTKFile type="PolyData"><PolyData><Piece NumberOfPoints="4" NumberOfPolys="2">
<PointData><DataArray Name="Normals" format="ascii">9 9</DataArray></PointData>
<Points><DataArray type="Float32" NumberOfComponents="3" format="{}">0 0 0 1 0 0 1 1 0 0 1 0
</DataArray></Points><Polys><DataArray Name="connectivity" format="ascii">0 1 2 3 0 2 1</DataArray>
<DataArray Name="offsets" format="ascii">4 7</DataArray></Polys></Piece></PolyData></VTKFile>"""


def geometry(tag: str, extra: str = "", **values: object) -> str:
    inner = "".join(f"<{key}>{value}</{key}>" for key, value in values.items())
    shape = f"<{tag} name='g'><socket_frame>..</socket_frame>{inner}{extra}</{tag}>"
    return f"<attached_geometry>{shape}</attached_geometry>"


def parsed(on_body: str, on_frame: str = "", directory: Path | None = None) -> Imported:
    text = MODEL.format(on_frame, on_body)
    return parse_model(Source("m.osim", text), directory).require_value()


EXTENTS = {
    "Brick": (geometry("Brick", half_lengths="1 2 3"), (1.0, 2.0, 3.0)),
    "Sphere": (geometry("Sphere", radius=2), (2.0, 2.0, 2.0)),
    "Ellipsoid": (geometry("Ellipsoid", radii="1 2 3"), (1.0, 2.0, 3.0)),
    "Cylinder about y": (geometry("Cylinder", radius=1, half_height=4), (1.0, 4.0, 1.0)),
    "scaled": (geometry("Brick", half_lengths="1 2 3", scale_factors="2 -1 1"), (2.0, 2.0, 3.0)),
}


@pytest.mark.parametrize("name", EXTENTS)
def test_shapes_have_their_sizes(name: str):
    text, half = EXTENTS[name]
    surface = parsed(text).surfaces["b"]
    np.testing.assert_allclose(surface.vertices.max(axis=0), half, rtol=1e-12)
    np.testing.assert_allclose(surface.vertices.min(axis=0), np.negative(half), rtol=1e-12)


def test_a_shape_stands_in_its_frame():
    surface = parsed("", geometry("Brick", half_lengths="1 2 3")).surfaces["b"]
    np.testing.assert_allclose(surface.vertices.max(axis=0), [2.0, 1.0, 8.0], rtol=1e-12)


def test_colours_are_those_of_the_appearance_or_white():
    red = "<Appearance><color>1 0.25 0</color></Appearance>"
    for extra, colour in ((red, (1.0, 0.25, 0.0)), ("", (1.0, 1.0, 1.0))):
        figure = parsed(geometry("Sphere", extra, radius=1)).figure
        assert segment_colour(figure, figure.segments["b"]) == colour
    hidden = "<Appearance><visible>false</visible></Appearance>"
    assert parsed(geometry("Sphere", hidden, radius=1)).surfaces == {}


def test_mesh_files_stand_beside_the_model_or_in_its_geometry_folder(tmp_path: Path):
    (tmp_path / "Geometry").mkdir()
    (tmp_path / "Geometry/square.vtp").write_text(VTP.format("ascii"))
    mesh = geometry("Mesh", mesh_file="square.vtp", scale_factors="2 3 4")
    surface = parsed(mesh, directory=tmp_path).surfaces["b"]
    assert surface.faces == ((0, 1, 2, 3), (0, 2, 1))
    np.testing.assert_array_equal(surface.vertices[2], [2.0, 3.0, 0.0])
    assert lost(parsed(mesh), "missing") == ("square.vtp",)


@pytest.mark.parametrize(
    "text",
    [
        *("", "<a/>", "<VTKFile/>", VTP.format("binary")),
        *(VTP.format("ascii").replace("4 7", ends) for ends in ("9", "4 7.5", "4 1e300", "4" * 30)),
        VTP.format("ascii").replace("Points>", "Dots>"),
    ],
)
def test_other_files_are_no_meshes_and_are_not_quoted(text: str, tmp_path: Path):
    (tmp_path / "part.vtp").write_text(text)
    with pytest.raises(InputError) as refusal:
        read_vtp(tmp_path / "part.vtp")
    assert "cannot be read as vtp" in str(refusal.value)
    imported = parsed(geometry("Mesh", mesh_file="part.vtp"), directory=tmp_path)
    assert lost(imported, "cannot be read") == ("part.vtp",)


def test_sizes_are_positive():
    text = MODEL.format("", geometry("Sphere", radius=-1))
    (fault,) = parse_model(Source("m.osim", text)).diagnostics
    assert "is negative" in fault.message
    imported = parsed(geometry("Sphere", radius=0))
    assert imported.surfaces == {}
    assert len(lost(imported, "size zero")) == 1


def test_mesh_files_are_looked_for_in_the_geometry_folders_above(tmp_path: Path):
    model = tmp_path / "Models" / "Arm"
    model.mkdir(parents=True)
    (tmp_path / "Geometry").mkdir()
    (tmp_path / "Geometry/square.vtp").write_text(VTP.format("ascii"))
    imported = parsed(geometry("Mesh", mesh_file="square.vtp"), directory=model)
    assert imported.surfaces["b"].face_count == 2
