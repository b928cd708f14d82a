from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from generator import read_figure
from generator.geometry import mass_properties
from generator.geometry.appearance import segment_appearances
from generator.geometry.read import read_mesh
from generator.geometry.stl import format_stl
from generator.geometry.surface import Surface

CUBE = Surface.from_faces(
    np.array([[x, y, z] for x in (0.0, 0.1) for y in (0.0, 0.2) for z in (0.0, 0.3)]),
    [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)],
    "cube",
)


def read_again(surface: Surface, folder: Path) -> Surface:
    path = folder / "surface.stl"
    path.write_bytes(format_stl(surface))
    return read_mesh(path, Fraction(1))


def test_a_box_comes_back_with_its_volume_and_its_corners(tmp_path: Path) -> None:
    again = read_again(CUBE, tmp_path)
    assert again.face_count == 12
    assert len({corner for face in again.faces for corner in face}) == 8
    assert mass_properties(again, 1.0).mass == pytest.approx(0.006, rel=1e-6)


@pytest.mark.parametrize("name", ["prototype", "clavicles", "pendulum", "fourbar"])
def test_appearances_of_figures_come_back(name: str, tmp_path: Path) -> None:
    for appearance in segment_appearances(read_figure(name))[0].values():
        again = read_again(appearance.surface, tmp_path)
        for side in (np.min, np.max):
            expected = side(appearance.surface.vertices, axis=0)
            assert side(again.vertices, axis=0) == pytest.approx(expected, abs=1e-6)


def test_normals_point_outwards() -> None:
    content = np.frombuffer(format_stl(CUBE)[84:], np.uint8).reshape(12, 50)
    normals, corners = (
        content[:, part].copy().view("<f4") for part in (slice(0, 12), slice(12, 48))
    )
    centres = corners.reshape(12, 3, 3).mean(axis=1)
    assert np.linalg.norm(normals, axis=1) == pytest.approx(np.ones(12))
    assert (np.sum(normals * (centres - [0.05, 0.1, 0.15]), axis=1) > 0.0).all()
