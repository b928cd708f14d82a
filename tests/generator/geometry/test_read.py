"""Mesh files, as trimesh writes and reads them, and colours of segments."""

import json
import pickle
import struct
import tracemalloc
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
import trimesh

from generator.diagnostics import InputError
from generator.figure import Attribute
from generator.figure_file.read import read_figure
from generator.geometry import build_solid, mass_properties, read_surface
from generator.geometry.read import (
    GREY,
    UnknownSurfaceError,
    read_segment_surface,
    segment_colour,
    with_surfaces,
)
from generator.rotations import matrix_from_rotation_vector, pose_matrix
from tests.chains import BALL, body, figure, ground, joint
from tests.paths import FIGURES

MILLIMETRE = Fraction(1, 1000)
SIZE = (0.5, 0.25, 2.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A box and a ball in every format."""
    path = tmp_path_factory.mktemp("meshes")
    box = trimesh.creation.box(SIZE)
    for suffix in ("stl", "obj", "ply", "glb"):
        box.export(path / f"box.{suffix}")
        trimesh.creation.icosphere(subdivisions=3).export(path / f"ball.{suffix}")
    box.export(path / "ascii.stl", file_type="stl_ascii")
    box.export(path / "ascii.ply", encoding="ascii")
    return path


@pytest.mark.parametrize("name", ["box.stl", "ascii.stl", "box.obj", "box.ply", "ascii.ply"])
def test_formats_without_units_need_one(folder, name):
    with pytest.raises(UnknownSurfaceError, match=r"give the unit, such as `--unit mm`"):
        read_surface(folder / name)
    found = mass_properties(read_surface(folder / name, MILLIMETRE), 1e9)
    assert found.mass == pytest.approx(0.25, rel=1e-12)
    assert found.inertia[0, 0] == pytest.approx(0.25 / 12 * (0.0625 + 4.0) * 1e-6, rel=1e-12)


def test_gltf_is_in_metres(folder):
    assert mass_properties(read_surface(folder / "box.glb"), 1000.0).mass == pytest.approx(250.0)
    small = read_surface(folder / "box.glb", Fraction(1, 10))
    assert mass_properties(small, 1000.0).mass == pytest.approx(0.25)


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply", "glb"])
def test_a_ball_has_the_mass_and_inertia_that_trimesh_says(folder, suffix):
    ball = trimesh.load_mesh(folder / f"ball.{suffix}")
    found = mass_properties(read_surface(folder / f"ball.{suffix}", Fraction(1)), 3.0)
    ball.density = 3.0
    assert found.mass == pytest.approx(ball.mass, rel=1e-10)
    assert found.inertia == pytest.approx(ball.moment_inertia, abs=1e-9 * ball.mass)
    assert found.mass == pytest.approx(4.0 * np.pi, rel=0.02)


def test_stl_vertices_are_joined(folder):
    assert len(read_surface(folder / "box.stl", Fraction(1)).vertices[:]) == 36
    surface = read_surface(folder / "box.stl", Fraction(1))
    assert len(np.unique(surface.corners)) == 8
    assert build_solid(surface).merged_vertex_count == 0


def test_a_scene_is_one_surface_with_its_parts_in_place(tmp_path):
    scene = trimesh.Scene()
    scene.add_geometry(trimesh.creation.box((1, 1, 1)))
    turn = pose_matrix(matrix_from_rotation_vector([0, 0, np.pi / 4]), [3.0, 0.0, 0.0])
    scene.add_geometry(trimesh.creation.box((1, 2, 1)), transform=turn)
    scene.export(tmp_path / "scene.glb")
    solid = build_solid(read_surface(tmp_path / "scene.glb"))
    assert len(solid.shells) == 2
    assert solid.mass_properties(1.0).centre == pytest.approx([2.0, 0, 0], abs=1e-6)


def test_an_open_mesh_names_places(tmp_path):
    box = trimesh.creation.box(SIZE)
    box.update_faces(np.arange(len(box.faces)) != 3)
    path = tmp_path / "open.stl"
    box.export(path)
    with pytest.raises(InputError) as raised:
        build_solid(read_surface(path, MILLIMETRE))
    (fault,) = raised.value.diagnostics
    assert fault.message.startswith(f"{path}: the surface is open: 3 edges belong to one face")
    assert "0.00025" in fault.message
    assert fault.message.endswith(" m")


def test_collapsed_triangles_are_dropped(tmp_path):
    box = trimesh.creation.box(SIZE)
    apart = np.vstack([box.triangles, np.repeat(box.triangles[:1, :1], 3, axis=1)])
    points = apart.reshape(-1, 3)
    mesh = trimesh.Trimesh(points, np.arange(len(points)).reshape(-1, 3), process=False)
    mesh.export(tmp_path / "slack.stl")
    assert read_surface(tmp_path / "slack.stl", Fraction(1)).face_count == 12


@pytest.mark.parametrize("suffix", [".stl", ".obj", ".ply", ".glb", ".gltf"])
@pytest.mark.parametrize(
    "content", [b"", b"hello\n", bytes(range(256)) * 4, b"\xff\xfe\x80\x81" * 100]
)
def test_what_is_no_mesh_is_told(tmp_path, suffix, content):
    path = tmp_path / f"noise{suffix}"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"noise") as raised:
        read_surface(path, Fraction(1))
    (fault,) = raised.value.diagnostics
    assert "module" not in str(fault)
    if content.startswith(b"\xff") and suffix in (".stl", ".ply", ".glb"):
        assert "it is cut short, or holds something else" in fault.message


@pytest.mark.parametrize("size", [1, 50, 83, 84, 300, 683])
def test_a_mesh_that_is_cut_short_is_told(tmp_path, size):
    path = tmp_path / "cut.stl"
    trimesh.creation.box(SIZE).export(path)
    whole = path.read_bytes()
    assert len(whole) == 684
    path.write_bytes(whole[:size])
    with pytest.raises(InputError, match=rf"it is cut short, at {size} (of 684 )?bytes"):
        read_surface(path, Fraction(1))


def test_a_cloud_of_points_has_no_faces(tmp_path):
    trimesh.PointCloud(np.eye(3)).export(tmp_path / "cloud.ply")
    with pytest.raises(InputError, match="there are no faces"):
        read_surface(tmp_path / "cloud.ply", Fraction(1))


def test_a_vertex_that_is_not_finite_is_told(tmp_path):
    path = tmp_path / "odd.obj"
    path.write_text("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(InputError, match="not finite"):
        read_surface(path, Fraction(1))


def test_missing_files_and_directories_are_told(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_surface(tmp_path / "none.stl", Fraction(1))
    (tmp_path / "folder.stl").mkdir()
    with pytest.raises(InputError, match="directory"):
        read_surface(tmp_path / "folder.stl", Fraction(1))


@pytest.mark.parametrize(
    ("name", "said"),
    [("a.pls", "did you mean `.pss`"), ("a.x3d", "known here: .glb"), ("a", "is missing")],
)
def test_an_unknown_suffix_is_told(name, said):
    with pytest.raises(UnknownSurfaceError, match=said):
        read_surface(name)


RED = Attribute("red", {"rgb": (1.0, 0.0, 0.0)})
BRIGHT = Attribute("bright", {"rgb": (2.0, -1.0, 0.5)})
SHINY = Attribute("shiny", {"shine": (1.0,)})


@pytest.mark.parametrize(
    ("attributes", "colour"),
    [
        (("shiny", "red", "bright"), (1.0, 0.0, 0.0)),
        (("bright",), (1.0, 0.0, 0.5)),
        (("shiny",), GREY),
        (("none",), GREY),
        ((), GREY),
    ],
)
def test_the_first_attribute_with_a_colour_gives_it(attributes, colour):
    link = replace(body("link"), attributes=attributes)
    made = figure([ground(), link], [joint("pin", "ground.base", "link.near", BALL)])
    made = replace(made, attributes={each.name: each for each in (RED, BRIGHT, SHINY)})
    assert segment_colour(made, link) == colour


def gltf(path, **changes):
    """Write a glTF file with one array of positions, and changes of it."""
    positions = {"componentType": 5126, "type": "VEC3", "count": 2_000_000_000} | changes
    content = {
        "asset": {"version": "2.0"},
        "accessors": [positions],
        "bufferViews": [],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }
    text = json.dumps(content).encode()
    if path.suffix == ".glb":
        head = struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A)
        text = head + text
    path.write_bytes(text)


@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
def test_an_array_that_is_larger_than_its_file_is_not_made(tmp_path, suffix):
    """It once took 15 GB for 392 bytes; the count here would take 480 MB."""
    path = tmp_path / f"large{suffix}"
    gltf(path, count=40_000_000)
    tracemalloc.start()
    with pytest.raises(InputError, match="arrays take 480 MB, and at most 32 MB are read"):
        read_surface(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 50_000_000


@pytest.mark.parametrize("count", [-1, "many", 1e99, None])
def test_counts_that_are_none_are_refused(tmp_path, count):
    gltf(tmp_path / "count.glb", count=count)
    with pytest.raises(InputError, match=r"count\.glb"):
        read_surface(tmp_path / "count.glb")


def test_surfaces_that_were_read_ahead_stay_as_they_were(tmp_path):
    for name in ("pendulum.fig", "floor.pss", "link1.pss"):
        (tmp_path / name).write_bytes((FIGURES / name).read_bytes())
    (tmp_path / "floor.pss").unlink()
    read = pickle.loads(pickle.dumps(with_surfaces(read_figure(tmp_path / "pendulum.fig"))))
    link, floor = read.segments["link1"], read.segments["floor"]
    (tmp_path / "link1.pss").unlink()
    (tmp_path / "floor.pss").write_bytes((FIGURES / "floor.pss").read_bytes())
    expected = read_surface(FIGURES / "link1.pss")
    assert (read_segment_surface(read, link).vertices == expected.vertices).all()
    with pytest.raises(InputError, match=r"floor\.pss"):
        read_segment_surface(read, floor)
    other = replace(link, psurf="floor.pss", name="other")
    again = with_surfaces(read.with_parts(replace(link, psurf="other.pss"), other))
    assert again.surfaces.keys() == {"link1.pss", "floor.pss", "other.pss"}
    assert read_figure("pendulum").surfaces == {}
