"""Shapes of bodies as the psurfs and colours of segments."""

from pathlib import Path

import numpy as np
import pytest

from generator.figure import Attribute, Figure, Segment, SiteRef
from generator.geometry.primitives import box, sphere
from generator.geometry.psurf import PSURF_FILE, format_psurf
from generator.geometry.read import segment_colour
from generator.geometry.surface import Surface
from generator.losses import Losses
from generator.model_files.body_tree import shapes
from generator.model_files.body_tree.shapes import MeshFiles, Shape, join_shapes, with_colours
from generator.model_files.opensim.read import read_vtp

RED, BLUE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 9 9 9\nf 1 2 3\n"


def texts(losses: Losses) -> list[str]:
    return [str(loss) for loss in losses.entries]


def test_a_segment_has_the_colour_of_its_largest_shape():
    losses = Losses("model")
    parts = [Shape(box(1, 1, 1), BLUE), Shape(sphere(0.5), RED), Shape(sphere(0.5), RED)]
    surfaces, colours = join_shapes({"arm": parts, "bare": []}, losses)
    assert surfaces["arm"].face_count == 6 + 2 * sphere(1.0).face_count
    assert colours == {"arm": BLUE}
    assert list(surfaces) == ["arm"]
    assert texts(losses) == ["further colours: a segment has that of its largest surface: arm"]


def test_shapes_of_many_faces_are_simplified(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(shapes, "MAX_FACES", 250)
    losses, many = Losses("model"), sphere(0.5)
    assert many.face_count > 250
    surfaces, _ = join_shapes({"arm": [Shape(many)]}, losses)
    assert 100 < surfaces["arm"].face_count <= 250
    (text,) = texts(losses)
    assert text.startswith(
        "shapes of more than 250 faces, whose vertices move by at most: arm (288 faces, 1"
    )


def test_equal_colours_share_an_attribute_of_a_new_name():
    segments = {name: Segment(name) for name in ("a", "b", "c")}
    known = {"colour_1": Attribute("colour_1", {"rgb": (0.1, 0.2, 0.3)})}
    figure = Figure(segments, {}, SiteRef("a", "x"), known)
    painted = with_colours(figure, {"a": RED, "b": BLUE, "c": RED})
    assert list(painted.attributes) == ["colour_1", "colour_1_2", "colour_2"]
    assert [segment_colour(painted, one) for one in painted.segments.values()] == [RED, BLUE, RED]


def test_mesh_files_are_found_in_the_first_folder_that_has_them(tmp_path: Path):
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "part.obj").write_text(TRIANGLE)
    losses = Losses("model")
    files = MeshFiles(losses)
    surface = files.find((tmp_path, tmp_path / "meshes"), "part.obj")
    assert surface is not None
    assert surface.vertices.shape == (3, 3)
    assert files.find((tmp_path / "meshes",), "part.obj") is surface
    assert texts(losses) == []


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("gone.stl", None, "shapes whose mesh file is missing: gone.stl"),
        ("part.dae", "", "shapes in mesh files of a format that is not read: part.dae"),
        ("part.obj", "secret words", "shapes whose mesh file cannot be read: part.obj"),
        ("part\0.obj", None, "shapes whose mesh file is missing: part\0.obj"),
    ],
)
def test_a_file_without_a_mesh_is_a_loss(
    name: str, content: str | None, sentence: str, tmp_path: Path
):
    if content is not None:
        (tmp_path / name).write_text(content)
    losses = Losses("model")
    assert MeshFiles(losses).find((tmp_path,), name) is None
    assert texts(losses) == [sentence]


def test_other_formats_have_readers_of_their_own(tmp_path: Path):
    (tmp_path / "part.own").write_text("")
    files = MeshFiles(Losses("model"), {".own": lambda path: box(1, 2, 3)})
    found = files.find((tmp_path,), "part.own")
    assert isinstance(found, Surface)
    np.testing.assert_array_equal(found.vertices, box(1, 2, 3).vertices)


MESHES = {
    "folded.obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 1 4\nf 2 3 4\n",
    "folded.vtp": """<VTKFile><PolyData><Piece><Points><DataArray format="ascii">
        0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points><Polys>
        <DataArray Name="connectivity" format="ascii">0 1 2 0 0 3 1 2 3</DataArray>
        <DataArray Name="offsets" format="ascii">3 6 9</DataArray>
      </Polys></Piece></PolyData></VTKFile>""",
}


@pytest.mark.parametrize("name", MESHES)
def test_faces_that_are_lines_are_left_out(name: str, tmp_path: Path):
    (tmp_path / name).write_text(MESHES[name])
    losses = Losses("model")
    surface = MeshFiles(losses, {".vtp": read_vtp}).find([tmp_path], name)
    assert surface is not None
    surfaces, _ = join_shapes({"arm": [Shape(surface)]}, losses)
    again = PSURF_FILE.parse_text(format_psurf(surfaces["arm"])).require_value()
    assert again.face_count == 2
    assert texts(losses) == []


def test_a_shape_of_lines_alone_is_a_loss():
    losses = Losses("model")
    lines = Surface.from_faces(np.eye(3), [(0, 1, 0), (1, 1, 2)])
    assert join_shapes({"arm": [Shape(lines)]}, losses) == ({}, {})
    assert texts(losses) == ["shapes whose faces are all lines or points: arm"]
