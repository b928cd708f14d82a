"""Files of models, and meshes of segments that are read again as surfaces."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from generator import read_figure
from generator.diagnostics import InputError
from generator.geometry.appearance import segment_appearances
from generator.geometry.psurf import format_psurf
from generator.geometry.read import read_mesh
from generator.geometry.surface import Surface
from generator.losses import Losses
from generator.model_files.model_files import (
    ModelFiles,
    format_stl,
    geometry_folder,
    segment_meshes,
)

CORNERS = np.array([[0.0, 0, 0], [2, 0, 0], [2, 2, 0], [1, 0.5, 0], [0, 2, 0]])
CONCAVE = Surface.from_faces(CORNERS, [(0, 1, 2, 3, 4)], "concave")


def arm(path: Path) -> ModelFiles:
    mesh = geometry_folder(path) / "arm.stl"
    losses = Losses("model")
    losses.add("colours", "arm")
    return ModelFiles(path, {mesh: b"solid", path: "model"}, losses)


def test_writes_the_model_and_the_folder_of_its_meshes(tmp_path: Path) -> None:
    files = arm(tmp_path / "arm.osim")
    for _ in range(2):  # into the folder that the first time made
        assert files.write() is files.losses
    assert (tmp_path / "arm.osim").read_text() == "model"
    assert (tmp_path / "arm_geometry" / "arm.stl").read_bytes() == b"solid"


def test_makes_no_folder_for_a_model_in_a_folder_that_is_missing(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        arm(tmp_path / "nowhere" / "arm.osim").write()
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["prototype", "clavicles", "pendulum"])
def test_the_files_are_read_as_the_surfaces(name: str, tmp_path: Path):
    drawn = read_figure(name)
    meshes, losses = segment_meshes(drawn, tmp_path / "a_geometry")
    appearances, lost = segment_appearances(drawn)
    assert meshes.keys() == appearances.keys()
    assert losses == lost
    for segment, mesh in meshes.items():
        assert mesh.path == tmp_path / "a_geometry" / f"{segment}.stl"
        assert mesh.reference == f"a_geometry/{segment}.stl"
        assert mesh.colour == appearances[segment].colour
        mesh.path.parent.mkdir(exist_ok=True)
        mesh.path.write_bytes(mesh.content)
        back = read_mesh(mesh.path, Fraction(1))
        surface = appearances[segment].surface
        low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
        assert np.allclose(back.vertices.min(axis=0), low, atol=1e-6)
        assert np.allclose(back.vertices.max(axis=0), high, atol=1e-6)


def test_a_concave_face_becomes_triangles_within_it():
    data = format_stl(CONCAVE)
    count = int.from_bytes(data[80:84], "little")
    assert count == 3
    assert len(data) == 84 + 50 * count
    assert not data.startswith(b"solid")
    rows = np.frombuffer(data, offset=84, dtype=np.dtype([("v", "<f4", (4, 3)), ("a", "<u2")]))
    normals, corners = rows["v"][:, 0], rows["v"][:, 1:].astype(float)
    assert np.array_equal(normals, [[0.0, 0.0, 1.0]] * 3)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert 0.5 * cross[:, 2].sum() == pytest.approx(2.5)
    assert np.all(cross[:, 2] > 0.0)


SHOULDER = '[[spring]]\njoints = ["shoulder"]\naxis = "x"\n'


def pendulum_files(folder: Path, **others: str) -> ModelFiles:
    """The files of a figure, the texts of some of which are others; a name's `__` is a dot."""
    figure = Path(str(read_figure("pendulum").path)).read_text(encoding="utf-8")
    texts = {
        "arm.springs.toml": f"{SHOULDER}viscous_Nms_rad = 1.0\n",
        "arm.pss": format_psurf(CONCAVE),
        "arm.fig": figure,
    } | {name.replace("__", "."): text for name, text in others.items()}
    contents = {folder / name: text for name, text in texts.items()}
    return ModelFiles(folder / "arm.fig", contents, Losses("figure"))


STEEP = f"{SHOULDER}points_deg_Nm = [[0.0, 0.0], [1e-5, 1e99], [1.0, 0.0]]\n"


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("arm__springs__toml", STEEP, "in line 4: this curve is too steep"),
        ("arm__springs__toml", STEEP + "#\n" * 50_000, "too long for a springs file"),
        ("arm__springs__toml", STEEP.replace('"shoulder"', '"knee"'), "the figure has no joint"),
        ("arm__other__springs__toml", STEEP, "in line 4: this curve is too steep"),
        ("arm__pss", "0 0 0\n1 0 0\n;;\n1 2 1;\n;;\n", "in line 4: vertex 1 is twice"),
        ("arm__fig", "figure arm {", "in line 1"),
    ],
)
def test_files_that_would_not_be_read_again_are_not_written(
    name: str, text: str, reason: str, tmp_path: Path
):
    with pytest.raises(InputError, match=reason) as failure:
        pendulum_files(tmp_path, **{name: text}).write()
    assert str(tmp_path / name.replace("__", ".")) in str(failure.value)
    assert not any(tmp_path.iterdir())


def test_files_that_are_read_again_are_written(tmp_path: Path):
    pendulum_files(tmp_path).write()
    assert len(list(tmp_path.iterdir())) == 3
