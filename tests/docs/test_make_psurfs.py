"""The shipped psurfs are closed bodies, and the six of the prototype are those of a person."""

import runpy
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
import trimesh

from generator.geometry import PSURF_FILE
from generator.geometry.validate import validate_surface
from tests.paths import DOCS, FIGURES

SCRIPT = DOCS / "make_psurfs.py"

# Appendix A: mass [g] and z of the centre of mass [cm]; then the density that mass and volume must
# imply [g/cm3] and the extent along x, y and z [cm].
LIMB, TORSO = (0.9, 1.1), (0.45, 0.55)
PERSON = {
    "ecalf.pss": (4000.77, 23.73, LIMB, (27.0, 10.2, 55.5)),
    "eupleg.pss": (8205.55, 18.07, LIMB, (18.8, 14.8, 55.3)),
    "elowarm.pss": (1815.81, 17.51, LIMB, (9.9, 8.2, 51.2)),
    "euparm.pss": (2297.40, 13.99, LIMB, (11.2, 9.8, 41.1)),
    "eltorso.pss": (3469.32, 6.17, TORSO, (18.8, 27.8, 23.0)),
    "echest.pss": (13169.60, 33.76, TORSO, (22.6, 36.0, 84.9)),
}
HIP_HEIGHT, THIGH = 94.1, 43.4
# The sites at which the segments are joined, and the centre of mass [cm].
SITES = {
    "ecalf.pss": [(0, 0, 0), (0, 0, 36.8), (2.61, 0.01, 23.73)],
    "eupleg.pss": [(0, 0, 0), (0, 0, 43.4), (0, 0, 18.07)],
    "elowarm.pss": [(0, 0, 0), (0, 0, 28.8), (-0.01, 0, 17.51)],
    "euparm.pss": [(0, 0, 0), (0, 0, 33.4), (-0.03, 0.02, 13.99)],
    "eltorso.pss": [(0, 0, 0), (0, 6.12, 0), (0, -6.12, 0), (0, 0, 13.1), (0, 0, 6.17)],
    "echest.pss": [(0, 0, 0), (0, 17.2, 50), (0, -17.2, 50), (0, 0, 47.6), (0.09, -0.08, 33.76)],
    "eclavicle.pss": [(0, 0, 0), (0, 0, 17.2), (0, 0, 8.6)],
    "link1.pss": [(0, 0, 0), (75, 0, 0), (150, 0, -15)],
}
CLAVICLE_MASS = 156.0
EVERY = [*PERSON, "eclavicle.pss", "link1.pss", "floor.pss"]


@cache
def read(name):
    """Vertices (n, 3) [cm] and faces counted from 0."""
    surface = PSURF_FILE.read(FIGURES / name)
    return surface.vertices * 100.0, surface.faces


@cache
def mesh(name):
    vertices, faces = read(name)
    fans = [(face[0], b, c) for face in faces for b, c in pairwise(face[1:])]
    return trimesh.Trimesh(vertices, fans, process=False)


def winding_number(body, point):
    """How often the surface goes round a point: 1 inside, 0 outside (Van Oosterom, 1983)."""
    a, b, c = np.moveaxis(body.triangles - np.asarray(point, dtype=float), 1, 0)
    p, q, r = (np.linalg.norm(corner, axis=1) for corner in (a, b, c))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    dots = [np.einsum("ij,ij->i", u, v) for u, v in ((a, b), (b, c), (c, a))]
    angles = np.arctan2(volume, p * q * r + dots[0] * r + dots[1] * p + dots[2] * q)
    return angles.sum() / (2.0 * np.pi)


@pytest.mark.parametrize("name", EVERY)
def test_a_psurf_is_one_sound_body_also_to_trimesh(name):
    assert validate_surface(PSURF_FILE.read(FIGURES / name)).diagnostics == []
    body = mesh(name)
    assert body.is_watertight
    assert body.is_winding_consistent
    assert body.body_count == 1
    assert body.volume > 0.0


@pytest.mark.parametrize("name", EVERY)
def test_vertices_are_distinct_and_in_use_and_faces_planar_with_an_area(name):
    vertices, faces = read(name)
    assert len(np.unique(vertices, axis=0)) == len(vertices)
    assert {index for face in faces for index in face} == set(range(len(vertices)))
    for face in faces:
        assert len(set(face)) == len(face) >= 3
        corners = vertices[list(face)] - vertices[list(face)].mean(axis=0)
        longest, second, *third = np.linalg.svd(corners, compute_uv=False)
        assert second > 1e-3 * longest
        assert max(third, default=0.0) < 1e-6 * np.linalg.norm(np.ptp(corners, axis=0))


@pytest.mark.parametrize("name", PERSON)
def test_each_face_looks_away_from_the_middle_of_its_rings(name):
    """A body may have positive volume and still be turned inside out in one place."""
    vertices, faces = read(name)
    rings = vertices.reshape(-1, 16, 3).mean(axis=1)
    for face in faces[2:]:
        corners = vertices[list(face)]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        middle = rings[np.array(face) // 16].mean(axis=0)
        assert normal @ (corners.mean(axis=0) - middle) > 0.0


@pytest.mark.parametrize("name", [*PERSON, "eclavicle.pss", "link1.pss"])
def test_left_is_the_mirror_image_of_right(name):
    vertices, faces = read(name)
    index = {tuple(vertex): i for i, vertex in enumerate(vertices + 0.0)}
    mirror = [index[x, -y + 0.0, z] for x, y, z in vertices]

    def canonical(face):
        start = face.index(min(face))
        return face[start:] + face[:start]

    reflected = {canonical(tuple(mirror[i] for i in reversed(face))) for face in faces}
    assert reflected == {canonical(face) for face in faces}


@pytest.mark.parametrize("name", PERSON)
def test_a_body_suits_its_mass_and_its_person(name):
    """The torso's masses in appendix A are half of what bodies of its lengths would have."""
    mass, height, (least, most), extents = PERSON[name]
    assert least < mass / mesh(name).volume < most
    assert mesh(name).center_mass[2] == pytest.approx(height, abs=2.0)
    assert np.ptp(read(name)[0], axis=0) == pytest.approx(extents, abs=0.2)


def test_the_clavicle_has_the_density_of_flesh_and_its_centre_in_the_middle():
    body = mesh("eclavicle.pss")
    assert LIMB[0] < CLAVICLE_MASS / body.volume < LIMB[1]
    assert body.center_mass == pytest.approx([0.0, 0.0, 8.6])


def test_soles_lie_flat_on_the_floor_with_the_toes_forward():
    vertices, faces = read("ecalf.pss")
    heights = HIP_HEIGHT - THIGH - vertices[:, 2]
    assert heights.min() == pytest.approx(0.0, abs=1e-9)
    flat = [face for face in faces if np.all(heights[list(face)] < 1e-9)]
    touching = vertices[sorted({index for face in flat for index in face})]
    length, breadth, _ = np.ptp(touching, axis=0)
    assert length > 20.0
    assert breadth > 7.0
    assert touching[:, 0].max() > 15.0
    assert touching[:, 0].min() < 0.0


def test_chest_reaches_the_shoulders_and_stature_is_a_mans():
    vertices, _ = read("echest.pss")
    near = np.abs(vertices[:, 2] - 50.0) < 2.5
    assert vertices[near, 1].max() > 17.2
    assert 180.0 < HIP_HEIGHT + 13.1 + vertices[:, 2].max() < 192.0


def test_floor_lies_under_its_origin_and_holds_the_link():
    floor, _ = read("floor.pss")
    assert floor[:, 1].max() == 120.0
    assert np.ptp(floor[floor[:, 1] <= 0.0], axis=0) == pytest.approx((200.0, 2.0, 200.0))


@pytest.mark.parametrize(("name", "sites"), SITES.items())
def test_sites_lie_inside(name, sites):
    for site in sites:
        assert winding_number(mesh(name), site) == pytest.approx(1.0, abs=1e-9)
    assert winding_number(mesh(name), (0.0, 0.0, 500.0)) == pytest.approx(0.0, abs=1e-9)


def test_script_reproduces_the_committed_files(tmp_path):
    runpy.run_path(str(SCRIPT))["write_psurfs"](tmp_path)
    drawn = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert drawn == {path.name: path.read_bytes() for path in FIGURES.glob("*.pss")}
