"""Props: axes of planes, distance from boxes, force and moment on a sphere, the deepest start."""

from math import inf, nan

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from generator.contact.box import Box
from generator.contact.force import contact_force
from generator.contact.plane import Plane
from generator.contact.scene import (
    FLOOR,
    Prop,
    Scene,
    deepest_start,
    floor_height,
    floor_prop,
    with_floor,
)
from generator.diagnostics import ModelError
from generator.rotations import inverse_pose
from springs.backends import FLOATS
from springs.contact import Surface

SURFACE = Surface(stiffness=2e4, damping=0.7, friction=0.4)


def vectors(bound: float, least: float | None = None) -> st.SearchStrategy[tuple]:
    return st.tuples(*[st.floats(-bound if least is None else least, bound)] * 3)


angles = vectors(np.pi)
boxes = st.builds(Box, vectors(5.0), vectors(2.0, 0.1), angles)
points = vectors(6.0)
velocities = vectors(5.0)
radii = st.floats(0.01, 0.3)
shapes = boxes | st.builds(
    Plane, vectors(5.0), vectors(1.0).filter(lambda n: np.linalg.norm(n) > 1e-3)
)


@st.composite
def contacts(draw: st.DrawFn) -> tuple:
    """A shape, a point near it or inside, and the radius of a sphere there."""
    shape, radius, shares = draw(shapes), draw(radii), np.array(draw(vectors(1.0)))
    reach = np.full(3, radius) + (np.array(shape.size) / 2 if isinstance(shape, Box) else 0.0)
    return shape, transformed(shape.pose, shares * reach), radius


def distance(shape, point) -> float:
    return float(shape.distance(tuple(point))[0])


def transformed(pose, point):
    return pose[:3, :3] @ np.asarray(point) + pose[:3, 3]


def world_force(shape, radius, centre, velocity, spin, surface=SURFACE):
    """Force and moment about the centre in the world, where the sphere is there too."""
    pose = shape.pose
    turn, local = pose[:3, :3], transformed(inverse_pose(pose), centre)
    found = contact_force(
        shape, surface, radius, local, turn.T @ np.array(velocity), turn.T @ np.array(spin)
    )
    direction, arm = (np.array(list(map(float, v))) for v in (found.direction, found.arm))
    return found, turn @ direction * found.normal, turn @ arm * found.normal


# Shapes


@given(vectors(1.0), vectors(1e3))
def test_the_axes_of_a_plane(normal, point):
    assume(any(normal))
    pose = Plane(point, normal).pose
    turn, unit = pose[:3, :3], np.array(normal) / max(map(abs, normal))
    assert turn @ turn.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1.0)
    assert turn[:, 1] == pytest.approx(unit / np.linalg.norm(unit), abs=1e-12)
    assert np.array_equal(pose[:3, 3], point)


@pytest.mark.parametrize("normal", [(0.0, 0.0, 0.0), (nan, 1.0, 0.0), (0.0, inf, 0.0)])
def test_a_plane_needs_a_direction(normal):
    with pytest.raises(ModelError, match="a normal that is not zero"):
        Plane((0.0, 0.0, 0.0), normal)


@pytest.mark.parametrize("length", [0.0, -1.0, nan, inf])
def test_a_box_needs_a_volume(length: float):
    with pytest.raises(ModelError, match="must be positive"):
        Box((0.0, 0.0, 0.0), (1.0, length, 1.0))


def test_two_props_have_two_names():
    floor = floor_prop((0.0, 1.0, 0.0))
    assert floor.name == FLOOR
    with pytest.raises(ModelError, match=f"two props are called `{FLOOR}`"):
        Scene((floor, floor))


def surface_points(box: Box, count: int) -> np.ndarray:
    """A grid on the faces of a box, in its axes, shape (n, 3)."""
    ticks = np.linspace(-0.5, 0.5, count)
    grid = np.stack(np.meshgrid(ticks, ticks, [-0.5, 0.5], indexing="ij"), -1).reshape(-1, 3)
    faces = np.vstack([np.roll(grid, k, axis=1) for k in range(3)])
    return faces * np.array(box.size)


@given(boxes, points)
def test_the_distance_from_a_box_is_that_of_its_nearest_point(box: Box, point):
    """The nearest one of a grid is farther than the nearest point, by at most half its diagonal."""
    local = transformed(inverse_pose(box.pose), point)
    grid = surface_points(box, 21)
    nearest = np.linalg.norm(grid - local, axis=1).min()
    found = distance(box, local)
    spacing = max(box.size) / 20 / np.sqrt(2.0)
    assert nearest - spacing - 1e-12 <= abs(found) <= nearest + 1e-12
    is_inside = bool(np.all(np.abs(local) < np.array(box.size) / 2))
    assert (found < 0.0) is is_inside or abs(found) < 1e-12


# Forces


@given(angles, vectors(3.0), vectors(1.0), st.floats(0.0, 1.0), radii, velocities, velocities)
def test_a_plane_and_the_face_of_a_huge_box_have_one_force(
    turns, place, along, share, radius, velocity, spin
):
    size = 100.0
    turn = Box(place, (1.0, 1.0, 1.0), turns).pose[:3, :3]
    box = Box(tuple(np.array(place) - 0.5 * size * turn[:, 1]), (size,) * 3, turns)
    plane = Plane(place, tuple(turn[:, 1]))
    centre = np.array(place) + turn @ np.array([along[0], share * radius, along[2]])
    ours, force, moment = world_force(plane, radius, centre, velocity, spin)
    theirs, box_force, box_moment = world_force(box, radius, centre, velocity, spin)
    scale = 1e-9 * (1.0 + float(ours.normal))
    assert ours.depth == pytest.approx(radius * (1.0 - share), abs=1e-12)
    assert force == pytest.approx(box_force, abs=scale)
    assert moment == pytest.approx(box_moment, abs=scale)
    for one, other in zip(
        (ours.depth, ours.rate, ours.elastic, ours.normal, ours.friction_power),
        (theirs.depth, theirs.rate, theirs.elastic, theirs.normal, theirs.friction_power),
        strict=True,
    ):
        assert one == pytest.approx(other, rel=1e-9, abs=scale)


@given(contacts(), velocities, velocities)
def test_force_moment_and_power_belong_together(contact, velocity, spin):
    """Moment is lever x force, friction dissipates, and both powers are all the power there is."""
    shape, centre, radius = contact
    still, normal_force, no_moment = world_force(shape, radius, centre, (0, 0, 0), (0, 0, 0))
    assert no_moment == pytest.approx(np.zeros(3), abs=1e-12)
    normal = shape.pose[:3, :3] @ np.array(list(map(float, still.direction)))
    assert normal_force == pytest.approx(still.normal * normal, abs=1e-6)
    found, force, moment = world_force(shape, radius, centre, velocity, spin)
    scale = 1e-9 * (1.0 + float(found.normal))
    lever = -radius * normal
    assert moment == pytest.approx(np.cross(lever, force), abs=scale)
    slip = np.array(velocity) + np.cross(spin, lever)
    slip -= normal * (normal @ slip)
    friction = force - normal * (normal @ force)
    assert normal @ force == pytest.approx(found.normal, abs=scale)
    assert found.rate == pytest.approx(-normal @ np.array(velocity), abs=1e-9)
    assert friction @ slip <= scale
    assert friction @ slip == pytest.approx(-found.normal * found.friction_power, abs=20 * scale)
    assert np.linalg.norm(np.cross(friction, slip)) <= 20 * scale
    assert np.linalg.norm(friction) <= SURFACE.friction * found.normal + scale
    power = force @ np.array(velocity) + moment @ np.array(spin)
    expected = -found.normal * (found.rate + found.friction_power)
    assert power == pytest.approx(expected, abs=20 * scale)


def test_a_sphere_that_slides_is_braked_with_the_coefficient_of_friction():
    _, force, moment = world_force(
        Plane((0, 0, 0), (0, 1, 0)), 0.1, (0, 0.09, 0), (2, 0, 0), (0, 0, 0)
    )
    normal = 2e4 * (0.01 - 0.5 * SURFACE.transition_depth)
    assert force == pytest.approx([-0.4 * normal, normal, 0.0], rel=1e-4)
    assert moment == pytest.approx([0.0, 0.0, -0.1 * 0.4 * normal], rel=1e-4)


@given(shapes, points, radii, velocities, velocities)
def test_there_is_no_force_outside(shape, centre, radius, velocity, spin):
    found, force, moment = world_force(shape, radius, centre, velocity, spin)
    apart = distance(shape, transformed(inverse_pose(shape.pose), centre))
    assert found.depth == pytest.approx(radius - apart, abs=1e-12)
    if found.depth <= 0.0:
        assert found.elastic == found.normal == 0.0
        assert not force.any()
        assert not moment.any()


@given(contacts(), velocities, velocities)
def test_floats_and_arrays_have_one_force(contact, velocity, spin):
    shape, centre, radius = contact
    centre = tuple(map(float, transformed(inverse_pose(shape.pose), centre)))
    floats = contact_force(shape, SURFACE, radius, centre, velocity, spin, FLOATS)
    rows = [np.array([v, v]) for v in (*centre, *velocity, *spin)]
    arrays = contact_force(shape, SURFACE, radius, rows[:3], rows[3:6], rows[6:])
    for one, other in zip(floats, arrays, strict=True):
        parts = zip(*[v if isinstance(v, tuple) else (v,) for v in (one, other)], strict=True)
        for single, row in parts:
            assert np.broadcast_to(row, 2) == pytest.approx([single] * 2, rel=1e-12, abs=1e-12)


# Starts

SEAT = Prop("seat", Box((0.0, 0.2, 0.0), (0.4, 0.4, 0.4), (0.0, 0.3, 0.0)), SURFACE)
WALL = Prop("wall", Plane((0.0, 0.0, -1.0), (0.0, 0.0, 1.0)), SURFACE)


def test_the_deepest_start_names_prop_and_segment():
    centres = np.array([[0.0, 0.45, 0.0], [0.0, 0.3, 0.0], [0.0, 1.0, -1.1]])
    radii = np.array([0.1, 0.05, 0.1])
    segments = ("torso", "hand", "head")
    assert deepest_start(Scene((SEAT,)), centres, radii, segments) == (
        pytest.approx(0.15), "seat", "hand",
    )  # fmt: skip
    for props in ((WALL, SEAT), (SEAT, WALL)):
        found = deepest_start(Scene(props), centres, radii, segments)
        assert found == (pytest.approx(0.2), "wall", "head")


def test_nothing_penetrates_nothing():
    assert deepest_start(Scene(), np.zeros((1, 3)), np.ones(1), ("leg",)) is None
    assert deepest_start(Scene((SEAT,)), np.zeros((0, 3)), np.zeros(0), ()) is None


@given(
    st.lists(shapes, min_size=1, max_size=3),
    st.lists(st.tuples(points, radii), min_size=1, max_size=4),
)
def test_the_deepest_start_is_the_largest_depth_of_the_forces(some, spheres):
    scene = Scene(tuple(Prop(f"prop {k}", shape, SURFACE) for k, shape in enumerate(some)))
    names = [f"segment {k}" for k in range(len(spheres))]
    centres, sizes = (np.array(column) for column in zip(*spheres, strict=True))
    found = deepest_start(scene, centres, sizes, names)
    depths = {
        (prop.name, name): world_force(prop.shape, radius, centre, (0, 0, 0), (0, 0, 0))[0].depth
        for prop in scene.props
        for name, (centre, radius) in zip(names, spheres, strict=True)
    }
    assert found is not None
    assert found.depth == pytest.approx(max(map(float, depths.values())), abs=1e-12)
    assert found.depth == pytest.approx(float(depths[found.prop, found.segment]), abs=1e-12)


def test_a_floor_moves_alone():
    crate = Prop("crate", Box(), SURFACE)
    both = with_floor(Scene((crate,)), 0.4)
    assert [prop.name for prop in both.props] == [FLOOR, "crate"]
    assert both.props[0].shape.pose[:3, 3].tolist() == [0.0, 0.4, 0.0]
    assert floor_height(both) == 0.4
    assert floor_height(with_floor(both, -1.0)) == -1.0
    assert with_floor(both, None) == Scene((crate,))
    assert floor_height(Scene((crate,))) is None
