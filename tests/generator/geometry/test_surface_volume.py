"""Mass properties of polyhedra against closed forms, against trimesh, and the laws they obey."""

import numpy as np
import pytest
import trimesh
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from generator.diagnostics import InputError
from generator.geometry import Surface, build_solid, mass_properties
from generator.inertia import MassProperties
from generator.rotations import matrix_from_rotation_vector, pose_matrix
from tests.bodies import box, cells, frame, inside_out, lattice, prism, together, triangles

DENSITY = 1050.0
EXACT = 1e-12

TETRAHEDRON = (np.array([[0, 0, 0], [2, 0, 0], [0, 3, 0], [0, 0, 4]], float), [
    (0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3),
])  # fmt: skip
L_OUTLINE = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 4), (0, 4)]

vectors = st.tuples(*[st.floats(-2.0, 2.0)] * 3).map(np.array)


def weighed(body, density=DENSITY):
    return mass_properties(Surface.from_faces(*body), density)


def cuboid(low, size, density=DENSITY):
    """A box by the textbook; a negative density is what is cut out."""
    low, size = np.asarray(low, float), np.asarray(size, float)
    x, y, z = size**2
    mass = abs(density) * float(size.prod())
    return MassProperties(mass, low + size / 2, mass / 12 * np.diag([y + z, x + z, x + y]))


def without(body, part):
    """A body from which a part is cut out, by the parallel axis theorem written out."""
    mass = body.mass - part.mass
    centre = (body.mass * body.centre - part.mass * part.centre) / mass
    return MassProperties(mass, centre, body.inertia_about(centre) - part.inertia_about(centre))


def assert_same(found, expected, tolerance=EXACT):
    size = np.sqrt(np.trace(expected.inertia) / expected.mass)
    assert found.mass == pytest.approx(expected.mass, rel=tolerance)
    assert found.centre == pytest.approx(expected.centre, abs=tolerance * size)
    largest = np.abs(expected.inertia).max()
    assert found.inertia == pytest.approx(expected.inertia, abs=tolerance * largest)


def of_trimesh(body, density=DENSITY):
    """The same body by trimesh, whose density scales mass and inertia."""
    mesh = trimesh.Trimesh(body[0], triangles(body), process=False)
    assert mesh.is_watertight
    mesh.density = density
    return MassProperties(float(mesh.mass), mesh.center_mass, mesh.moment_inertia)


def l_shape():
    return cuboid((0, 0, 0), (3, 1, 2)) + cuboid((0, 1, 0), (1, 3, 2))


def tetrahedron():
    """Edges a, b, c of 2, 3, 4 at right angles: int x^2 = a^2 V/10, int xy = ab V/20 about them."""
    edges = np.array([2.0, 3.0, 4.0])
    volume = edges.prod() / 6
    second = volume / 20 * (np.outer(edges, edges) + np.diag(edges**2))
    second -= volume * np.outer(edges, edges) / 16
    inertia = np.trace(second) * np.eye(3) - second
    return MassProperties(DENSITY * volume, edges / 4, DENSITY * inertia)


FORMS = {
    "box": (box((1, 2, 3), (2, 3, 5)), cuboid((1, 2, 3), (2, 3, 5))),
    "tetrahedron": (TETRAHEDRON, tetrahedron()),
    "L": (prism(L_OUTLINE, 2.0), l_shape()),
    "frame": (
        frame(4.0, 2.0, 1.0),
        without(cuboid((-2, -2, 0), (4, 4, 1)), cuboid((-1, -1, 0), (2, 2, 1))),
    ),
    "two boxes": (
        together(box(), box((5, 1, -2), (2, 1, 3))),
        cuboid((0, 0, 0), (1, 1, 1)) + cuboid((5, 1, -2), (2, 1, 3)),
    ),
    "void": (
        together(box((0, 0, 0), (4, 4, 4)), inside_out(box((1, 1, 2), (1, 2, 1)))),
        without(cuboid((0, 0, 0), (4, 4, 4)), cuboid((1, 1, 2), (1, 2, 1))),
    ),
    "body in a void": (
        together(
            box((0, 0, 0), (6, 6, 6)),
            inside_out(box((1, 1, 1), (4, 4, 4))),
            box((2, 2, 3), (1, 2, 1)),
        ),
        without(cuboid((0, 0, 0), (6, 6, 6)), cuboid((1, 1, 1), (4, 4, 4)))
        + cuboid((2, 2, 3), (1, 2, 1)),
    ),
}


@pytest.mark.parametrize("name", FORMS)
def test_closed_forms(name):
    body, expected = FORMS[name]
    assert_same(weighed(body), expected)


@pytest.mark.parametrize("shift", range(6))
def test_a_concave_face_may_start_at_any_corner(shift):
    outline = L_OUTLINE[shift:] + L_OUTLINE[:shift]
    assert_same(weighed(prism(outline, 2.0)), l_shape())


def test_a_far_box_keeps_nine_digits():
    low = np.array([1e6, -2e6, 3e6])
    found = weighed(box(low, (0.5, 0.25, 0.125)))
    expected = cuboid(low, (0.5, 0.25, 0.125))
    assert found.mass == pytest.approx(expected.mass, rel=1e-9)
    assert found.inertia == pytest.approx(expected.inertia, rel=1e-9, abs=1e-18)
    assert found.centre == pytest.approx(expected.centre, rel=1e-15)


points = st.lists(vectors, min_size=6, max_size=30).map(np.array)


def hull_of(cloud):
    """Vertices and outward triangles of a convex hull."""
    assume(np.linalg.svd(cloud - cloud.mean(axis=0), compute_uv=False)[2] > 0.05)
    hull = ConvexHull(cloud)
    faces = [
        face if np.linalg.det(cloud[face] - cloud.mean(axis=0)) > 0 else face[::-1]
        for face in hull.simplices
    ]
    return cloud, [tuple(map(int, face)) for face in faces], hull.volume


@given(points)
def test_hulls_have_the_volume_that_qhull_says_and_trimeshs_inertia(cloud):
    vertices, faces, volume = hull_of(cloud)
    found = weighed((vertices, faces), 1.0)
    assert found.mass == pytest.approx(volume, rel=1e-9)
    assert_same(found, of_trimesh((vertices, faces), 1.0), 1e-9)


@given(points, vectors, vectors)
def test_a_moved_surface_is_a_moved_body(cloud, turn, shift):
    vertices, faces, _ = hull_of(cloud)
    rotation = matrix_from_rotation_vector(turn)
    moved = weighed((vertices @ rotation.T + shift, faces))
    assert_same(moved, weighed((vertices, faces)).transform(pose_matrix(rotation, shift)), 1e-9)


def edges_of_four(faces):
    counts = {}
    for face in faces:
        for a, b in zip(face, face[1:] + face[:1], strict=True):
            counts[frozenset((a, b))] = counts.get(frozenset((a, b)), 0) + 1
    return sum(count > 2 for count in counts.values())


def cells_of_box(one, two):
    """The cells between two cells, both included."""
    low, high = np.minimum(one, two), np.maximum(one, two)
    return {cell for cell in lattice(5) if (low <= cell).all() and (high >= cell).all()}


@st.composite
def booleans_of_boxes(draw):
    """Boxes joined to one another and cut out of one another, as a set of cells."""
    corner = st.tuples(*[st.integers(0, 4)] * 3)
    filled = cells_of_box((0, 0, 0), draw(corner))
    for _ in range(draw(st.integers(1, 5))):
        other = cells_of_box(draw(corner), draw(corner))
        filled = filled | other if draw(st.booleans()) else filled - other
    assume(filled)
    return filled


def assert_sum_of_cells(filled):
    """The body of cells is their sum, or is refused since it touches itself along an edge."""
    body = cells(filled)
    if edges_of_four(body[1]):
        with pytest.raises(InputError, match="touches itself: edges belong"):
            weighed(body)
        return
    total, *parts = [cuboid(cell, (1, 1, 1)) for cell in sorted(filled)]
    for part in parts:
        total = total + part
    assert_same(weighed(body), total, 1e-11)


@given(st.sets(st.sampled_from(lattice(3)), min_size=1))
def test_any_body_of_cells_is_the_sum_of_its_cells(filled):
    """Concave, with holes and voids, in any number of pieces."""
    assert_sum_of_cells(filled)


@settings(max_examples=25)
@given(booleans_of_boxes())
def test_a_block_without_cells_is_the_block_minus_them(removed):
    """What is cut out of the middle of a block is a void, or a body in a void."""
    inner = {(x + 1, y + 1, z + 1) for x, y, z in removed}
    body = cells(set(lattice(7)) - inner)
    assume(not edges_of_four(body[1]))
    total = cuboid((0, 0, 0), (7, 7, 7))
    for cell in sorted(inner):
        total = without(total, cuboid(cell, (1, 1, 1)))
    assert_same(weighed(body), total, 1e-10)


def test_voids_and_bodies_are_counted():
    body, _ = FORMS["body in a void"]
    shells = build_solid(Surface.from_faces(*body)).shells
    assert [shell.is_void for shell in shells] == [False, True, False]
    assert [shell.volume for shell in shells] == pytest.approx([216.0, -64.0, 2.0])
    assert [shell.face_count for shell in shells] == [6, 6, 6]


def test_unused_vertices_count_for_nothing():
    vertices, faces = box()
    found = weighed((np.vstack([vertices, [[1e9, 0, 0], [-5, 3, 8]]]), faces))
    assert_same(found, cuboid((0, 0, 0), (1, 1, 1)))


@pytest.mark.parametrize("density", [0.0, -1.0, np.nan])
def test_a_density_is_above_zero(density):
    with pytest.raises(ValueError, match="density"):
        weighed(box(), density)
