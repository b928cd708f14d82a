"""Surfaces that enclose no body are refused, or repaired on request.

The sentences of psurf files are in `tests/faults/psurf`.
"""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from generator.diagnostics import InputError, Severity
from generator.geometry import Surface, build_solid
from generator.geometry.validate import winding_numbers
from generator.rotations import matrix_from_rotation_vector
from tests.bodies import box, cells, frame, inside_out, lattice, prism, together

NEST = together(
    box((0, 0, 0), (6, 6, 6)), inside_out(box((1, 1, 1), (4, 4, 4))), box((2, 2, 2), (1, 1, 1))
)

L_OUTLINE = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 4), (0, 4)]


def surface(body):
    return Surface.from_faces(*body, name="body.pss")


def refused(body):
    """The messages for a body that is none."""
    with pytest.raises(InputError) as raised:
        build_solid(surface(body))
    faults = raised.value.diagnostics
    assert all(fault.severity is Severity.ERROR for fault in faults)
    assert all(fault.message.startswith("body.pss: ") for fault in faults)
    return [fault.message.removeprefix("body.pss: ") for fault in faults]


def with_turned(body, *faces):
    points, sides = body
    return points, [s[::-1] if k in faces else s for k, s in enumerate(sides)]


def without_face(body, face):
    return body[0], [s for k, s in enumerate(body[1]) if k != face]


def with_moved(body, vertex, shift):
    points = np.array(body[0])
    points[vertex] += shift
    return points, body[1]


def klein_bottle(count=8):
    """A grid of triangles whose left and right rims are joined mirrored: a Klein bottle.

    No such surface closes in space without passing through itself; how its faces meet is enough.
    """
    points = np.random.default_rng(0).normal(size=(count * count, 3))
    faces = []
    for i in range(count):
        for j in range(count):

            def at(a, b):
                return (a % count) * count + ((-b) % count if a == count else b % count)

            quad = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
            faces += [(quad[0], quad[1], quad[2]), (quad[0], quad[2], quad[3])]
    return points, faces


def test_of_many_open_edges_ten_are_named():
    turns = np.arange(20) * np.pi / 10
    drum = prism(np.column_stack([np.cos(turns), np.sin(turns)]), 1.0)
    (message,) = refused(without_face(drum, 0))
    assert "20 edges belong to one face only" in message
    assert message.count(")-(") == 10
    assert message.endswith("and 10 more m")


@pytest.mark.parametrize("turned", [(0,), (2, 4), (1, 2, 3, 4), (0, 1, 2, 3, 4)])
def test_turned_faces_are_named_even_when_they_are_the_most(turned):
    (message,) = refused(with_turned(box(), *turned))
    names = ", ".join(str(k + 1) for k in turned)
    verb = "face {} is" if len(turned) == 1 else "faces {} are"
    assert message.startswith(verb.format(names) + " flipped: ")


def test_a_body_and_its_void_that_are_both_turned_are_inside_out():
    (message,) = refused(
        inside_out(together(box((0, 0, 0), (3, 3, 3)), inside_out(box((1, 1, 1)))))
    )
    assert message.startswith("the surface is inside out: ")
    assert message.endswith("-26 m^3")


def test_all_that_is_wrong_is_told_at_once():
    body = together(
        inside_out(box()), with_turned(box((3, 0, 0)), 2), box((6, 0, 0), (3, 3, 3)), box((7, 1, 1))
    )
    told = refused(body)
    assert len(told) == 3
    assert told[0].startswith("the surface is inside out in the part of face 1")
    assert told[1].startswith("a shell within a body faces outwards in the part of face 19")
    assert told[2].startswith("face 9 is flipped")


def test_a_wall_between_two_rooms_is_refused():
    points, faces = cells([(0, 0, 0), (1, 0, 0)])
    wall = [int(np.flatnonzero((points == p).all(axis=1))[0]) for p in
            ((1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1))]  # fmt: skip
    messages = refused((points, [*faces, tuple(wall)]))
    assert any("edges belong to more than two faces" in message for message in messages)


def test_a_body_pinched_to_a_point_is_used_with_a_warning():
    """One shell that comes back to a vertex: two fans of faces meet there."""
    filled = set(lattice(3)) - {(1, 1, 1), (2, 2, 2)}
    solid = build_solid(surface(cells(filled)))
    assert solid.volume == pytest.approx(25.0)
    (warning,) = solid.warnings
    assert "at a point: vertex (2 2 2)" in warning.message


def test_a_face_a_little_off_its_plane_is_used_with_a_warning():
    solid = build_solid(surface(with_moved(box(), 6, (0, 0, 0.03))))
    (warning,) = solid.warnings
    assert warning.severity is Severity.WARNING
    assert "face 2 is not planar" in warning.message
    assert solid.volume == pytest.approx(1.01, abs=1e-12)


@given(st.floats(1e-4, 0.2))
def test_one_percent_of_the_size_is_the_limit(rise):
    """A unit square with one corner up: the mid-plane passes all four at rise/4 or so."""
    body = with_moved(box(), 6, (0, 0, rise))
    corners = body[0][[4, 5, 6, 7]]
    middle = corners - corners.mean(axis=0)
    normal = np.cross(corners[2] - corners[0], corners[3] - corners[1])
    off = np.abs(middle @ normal).max() / np.linalg.norm(normal)
    ratio = off / np.linalg.norm(np.ptp(corners, axis=0))
    assume(abs(ratio - 0.01) > 1e-9)
    if ratio > 0.01:
        assert "not planar" in refused(body)[0]
    else:
        assert len(build_solid(surface(body)).warnings) == 1


def test_rounding_is_no_bend():
    turn = matrix_from_rotation_vector([0.3, 0.2, -0.5])
    points, faces = prism([(0, 0), (3, 0), (3, 1), (1, 1), (1, 4), (0, 4)], 2.0)
    assert build_solid(surface((points @ turn.T + 1.0, faces))).warnings == ()


def test_a_surface_without_faces_is_refused():
    assert refused((np.zeros((3, 3)), [])) == ["the surface has no faces"]


def test_a_face_without_area_is_refused_but_a_sliver_is_not():
    points, faces = box()
    points = np.vstack([points, [[0.25, 0, 0], [0.5, 0, 0]]])
    # Edge 0-1 is split by vertices 8 and 9 on one side of it and bridged by flat faces.
    sliver = [(0, 8, 1), (8, 9, 1)]
    body = points, [f if f != faces[2] else (0, 8, 9, 1, 5, 4) for f in faces]
    body = body[0], [*body[1], *[s[::-1] for s in sliver]]
    solid = build_solid(surface(body))
    assert solid.volume == pytest.approx(1.0)
    assert [w.message for w in solid.warnings] == ["body.pss: faces 7, 8 are without area"]
    crossed = points, [*body[1][:-2], (1, 9, 8, 0)]
    assert any("without area: the sides cross" in message for message in refused(crossed))


def test_a_face_that_passes_a_vertex_twice_is_refused():
    points, faces = box()
    assert refused((points, [(0, 3, 2, 1, 0), *faces[1:]])) == ["face 1 has a vertex twice"]


def test_coordinates_beyond_reason_are_refused():
    assert "from the origin" in refused(box((0, 0, 0), (1e60, 1, 1)))[0]


def test_vertices_at_one_place_are_joined_where_the_surface_is_open_without():
    points, faces = box()
    apart = points[[corner for face in faces for corner in face]], np.arange(24).reshape(6, 4)
    solid = build_solid(surface(apart))
    assert solid.merged_vertex_count == 16
    assert solid.volume == pytest.approx(1.0)
    stacked = build_solid(surface(together(box(), box((1, 0, 0)))))
    assert (stacked.merged_vertex_count, len(stacked.shells)) == (0, 2)


# --fix-winding


@given(st.sampled_from(["box", "frame", "nest", "two"]), st.integers(0, 2**30))
def test_any_turning_of_faces_is_mended(name, seed):
    body = {
        "box": box(),
        "frame": frame(4.0, 2.0, 1.0),
        "nest": NEST,
        "two": together(box(), box((4, 0, 0), (2, 2, 2))),
    }[name]
    turned = np.flatnonzero(np.random.default_rng(seed).random(len(body[1])) < 0.5)
    solid = build_solid(surface(with_turned(body, *turned)), fix_winding=True)
    assert solid.flipped.tolist() == turned.tolist()
    assert solid.volume == pytest.approx(build_solid(surface(body)).volume, rel=1e-12)
    assert build_solid(solid.surface).flipped.size == 0


def test_what_cannot_be_mended_is_refused_all_the_same():
    for body in (without_face(box(), 0), klein_bottle(), cells([(0, 0, 0), (1, 1, 0)])):
        with pytest.raises(InputError):
            build_solid(surface(body), fix_winding=True)


# How shells lie to each other


@pytest.mark.parametrize(
    "pair",
    [
        (box((0, 0, 0), (2, 1, 1)), box((1, 0, 0), (2, 1, 1))),
        (box((-3, -1, -1), (6, 2, 2)), box((-1, -3, -1), (2, 6, 2))),
        (box((-3, -1, -1), (6, 2, 2)), box((-1, -3, -0.5), (2, 6, 1))),
        (box(), box()),
        (frame(4.0, 2.0, 1.0), box((-0.9, -3, 0.2), (0.3, 6, 0.3))),
    ],
)
def test_bodies_that_cut_through_each_other_are_refused(pair):
    (message,) = refused(together(*pair))
    assert "intersect each other" in message


def test_half_a_box_in_the_same_box_counts_twice():
    """Five of its six faces lie on the larger one's: it is within, and would do for a void."""
    half = box((0, 0, 0), (1, 1, 0.5))
    (message,) = refused(together(box(), half))
    assert "would count twice" in message
    assert build_solid(surface(together(box(), inside_out(half)))).volume == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("pair", "volume"),
    [
        ((box(), box((1, 0, 0))), 2.0),
        ((box(), box((1, 0.5, 0.5))), 2.0),
        ((box(), box((1, 1, 0))), 2.0),
        ((box((0, 0, 0), (3, 3, 3)), inside_out(box((0, 1, 1)))), 26.0),
        ((frame(4.0, 2.0, 1.0), box((-1, -1, 0), (2, 2, 1))), 16.0),
        ((prism(L_OUTLINE, 2.0), box((1, 1, 0), (2, 3, 2))), 24.0),
        ((prism(L_OUTLINE, 2.0), box((1.5, 1.5, -1), (1, 2, 5))), 22.0),
        ((prism(L_OUTLINE[2:] + L_OUTLINE[:2], 2.0), box((1.5, 1.5, -1), (1, 2, 5))), 22.0),
        ((box((-1, -1, 0), (9, 9, 2)), inside_out(prism(L_OUTLINE, 2.0))), 150.0),
        ((frame(4.0, 2.0, 1.0), box((-0.5, -0.5, -5), (1, 1, 10))), 22.0),
    ],
)
def test_bodies_that_touch_or_pass_through_a_hole_are_apart(pair, volume):
    assert build_solid(surface(together(*pair))).volume == pytest.approx(volume, rel=1e-12)


placed = st.tuples(
    st.tuples(*[st.floats(0.2, 2.0)] * 3).map(np.array),
    st.tuples(*[st.floats(-1.2, 1.2)] * 3).map(np.array),
    st.tuples(*[st.floats(-2.0, 2.0)] * 3).map(lambda v: matrix_from_rotation_vector(np.array(v))),
)


def half_spaces(size, centre, turn):
    """A x <= b of a box of this size about a centre."""
    normals = np.vstack([turn.T, -turn.T])
    return normals, normals @ centre + np.tile(size, 2) / 2


@settings(max_examples=60)
@given(placed, placed)
def test_two_boxes_are_apart_or_nested_or_cut_as_linear_programming_says(one, two):
    spaces = [half_spaces(*one), half_spaces(*two)]
    # The largest ball within both: its radius is negative when the boxes are apart.
    a, b = (np.concatenate(parts) for parts in zip(*spaces, strict=True))
    ball = linprog([0, 0, 0, -1], np.column_stack([a, np.ones(12)]), b, bounds=[(None, None)] * 4)
    points = [(box((-0.5,) * 3)[0] * size) @ turn.T + centre for size, centre, turn in (one, two)]
    rooms = [
        float((space[1] - (p @ space[0].T)).min())
        for p, space in zip(points, reversed(spaces), strict=True)
    ]
    assume(min(abs(ball.x[3]), *map(abs, rooms)) > 1e-4)
    body = together(*((p, box()[1]) for p in points))
    if ball.x[3] < 0.0:
        volume = float(one[0].prod() + two[0].prod())
        assert build_solid(surface(body)).volume == pytest.approx(volume)
    elif max(rooms) > 0.0:
        assert "faces outwards" in refused(body)[0]
        mended = build_solid(surface(body), fix_winding=True)
        assert mended.volume == pytest.approx(abs(float(one[0].prod() - two[0].prod())))
    else:
        assert "intersect each other" in refused(body)[0]


@given(st.tuples(*[st.floats(-1.0, 2.0)] * 3))
def test_the_winding_number_tells_inside_from_outside(point):
    points, faces = box()
    corners = points[[(f[0], f[k], f[k + 1]) for f in faces for k in (1, 2)]]
    p = np.array(point)
    depth = float(np.minimum(p, 1 - p).min())
    assume(abs(depth) > 1e-6)
    (turns,) = winding_numbers(corners, p[None])
    assert turns == pytest.approx(1.0 if depth > 0 else 0.0, abs=1e-9)
