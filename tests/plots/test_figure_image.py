"""Shaded pictures of moments: projection, what hides what, shadows, size."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from math import radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator import Plan, Recording, read_figure, simulate
from generator.contact.box import Box
from generator.contact.scene import Prop, Scene
from generator.figure import Figure
from generator.geometry.appearance import Appearance, segment_appearances
from generator.geometry.surface import Surface
from plots import figure_image
from plots.figure_image import GROUND, Body, Strip, View, draw_moments, poses_at, rasterize
from springs.contact import DEFAULT_SURFACE

FRONT = View(turn=0.0, tilt=radians(15.0))
STRIP = Strip(FRONT, spacing=1.5, left=-0.7, right=0.7, bottom=-0.3, top=2.0, scale=40.0)


@cache
def motion() -> tuple[Figure, Recording]:
    figure = read_figure("prototype")
    return figure, simulate(figure, Plan(stop=0.02, free_root=True, height=0.0))


def picture(*boxes: Box, frames: tuple[int, ...] = (0,), strip: Strip = STRIP) -> np.ndarray:
    scene = Scene(tuple(Prop(f"box{k}", box, DEFAULT_SURFACE) for k, box in enumerate(boxes)))
    figure, recording = motion()
    moments = poses_at(recording.poses, frames)
    return draw_moments(Body.of_figure(figure), moments, strip, scene).astype(float)


def pixel(image: np.ndarray, point: tuple[float, float, float], strip: Strip = STRIP) -> np.ndarray:
    """The pixel of a point of the world in the first moment."""
    right, up, _ = strip.view.axes @ np.array(point)
    row = image.shape[0] - 1 - int(strip.scale * (up - strip.bottom))
    return image[row, int(strip.scale * (right - strip.left))]


def is_skin(colour: np.ndarray) -> bool:
    """Tell whether a colour is a shade of the prototype's."""
    return bool(np.allclose(colour[:3] / colour[0], (1.0, 0.37, 0.0), atol=0.03))


@given(st.floats(-4.0, 4.0), st.floats(-1.5, 1.5))
def test_axes_of_a_view_are_a_rotation(turn: float, tilt: float) -> None:
    axes = View(turn, tilt).axes
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert axes[0, 1] == 0.0, "the direction to the right is level"
    assert axes[2, 1] == pytest.approx(np.sin(tilt))


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_the_nearer_triangle_hides_the_other(order: tuple[int, int]) -> None:
    near = np.array([(0.0, 0.0, 2.0), (4.0, 0.0, 2.0), (0.0, 4.0, 2.0)])
    far = near + np.array([1.0, 0.0, -1.0])
    corners = np.array([near, far])[list(order)]
    values = np.array([np.full((3, 1), 5.0), np.full((3, 1), 7.0)])[list(order)]
    depth, found = rasterize(corners, values, (6, 6))
    assert (depth[1, 1], found[1, 1, 0]) == (2.0, 5.0)
    assert (depth[0, 5], found[0, 5, 0]) == (1.0, 7.0)
    assert depth[5, 5] == -np.inf


def test_values_are_interpolated_between_corners() -> None:
    corners = np.array([[(0.0, 0.0, 0.0), (8.0, 0.0, 4.0), (0.0, 8.0, 8.0)]])
    depth, found = rasterize(corners, corners[..., :2], (8, 8))
    assert depth[2, 4] == pytest.approx(4.0 * 0.5 + 2.0)
    assert found[2, 4] == pytest.approx([4.0, 2.0])


def test_the_figure_stands_on_the_floor_before_nothing() -> None:
    image = picture()
    assert image.shape == (round(40 * 2.3), round(40 * 1.4), 4)
    assert is_skin(pixel(image, (0.0, 1.4, 0.0)))
    assert pixel(image, (0.6, 0.0, 0.0)) == pytest.approx(
        [*(255 * np.array(GROUND[:3])), 255], abs=1
    )
    assert pixel(image, (0.6, 1.5, 0.0))[3] == 0.0
    assert pixel(picture(strip=replace(STRIP, floor=None)), (0.6, 0.0, 0.0))[3] == 0.0


@pytest.mark.parametrize("turn", [0.0, 90.0, 180.0, 270.0])
@pytest.mark.parametrize("tilt", [10.0, 80.0])
def test_the_outer_faces_of_a_box_are_seen(turn: float, tilt: float) -> None:
    strip = replace(STRIP, view=View(radians(turn), radians(tilt)), bottom=-2.0, floor=None)
    image = picture(Box((0.0, 1.0, 0.0), (1.2, 2.2, 1.2)), strip=strip)
    assert not any(is_skin(each) for each in image[image[..., 3] == 255.0])


def test_a_box_casts_its_shadow_straight_down() -> None:
    lit, shaded = (
        pixel(image, (0.5, 0.0, 0.4))
        for image in (picture(), picture(Box((0.5, 1.0, 0.4), (0.2, 0.1, 0.2))))
    )
    assert np.all(shaded[:3] < 0.8 * lit[:3])
    assert pixel(picture(Box((0.5, 1.0, -0.4), (0.2, 0.1, 0.2))), (0.5, 0.0, 0.4)) == pytest.approx(
        lit
    )


def test_moments_stand_side_by_side() -> None:
    two = picture(frames=(0, 0))
    width, shift = picture().shape[1], round(40 * 1.5)
    assert two.shape[1] == width + shift
    assert two[:, :width] == pytest.approx(two[:, shift:], abs=40.0)
    assert np.mean(np.abs(two[:, :width] - two[:, shift:])) < 1.0


def test_segments_without_a_psurf_are_drawn_between_their_sites() -> None:
    figure, recording = motion()
    bare = replace(
        figure, segments={name: replace(each, psurf=None) for name, each in figure.segments.items()}
    )
    image = draw_moments(Body.of_figure(bare), poses_at(recording.poses, (0,)), STRIP, Scene())
    elbow = bare.segments["left_upper_arm"].sites["distal"].pose_in_segment[:3, 3]
    x, y, z = (recording.poses["left_upper_arm"][0] @ [*(0.2 * elbow), 1.0])[:3]
    assert is_skin(pixel(image, (x, y, z)))


def test_a_picture_in_bands_is_the_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = picture()
    monkeypatch.setattr(figure_image, "_MAX_BAND_PIXELS", 7 * whole.shape[1])
    assert picture() == pytest.approx(whole, abs=1.0)


def surface(vertices: np.ndarray, faces: Sequence[Sequence[int]]) -> Surface:
    return Surface.from_faces(np.array(vertices, dtype=float), [tuple(f) for f in faces], "test")


CUBE = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)])
CUBE_FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


def appearing(shape: Surface) -> Body:
    """The body of a figure that has one segment of this shape."""
    figure, _ = motion()
    made = Appearance(shape, (0.2, 0.4, 0.6))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figure_image, "segment_appearances", lambda _: ({"bone": made}, ()))
        return Body.of_figure(figure)


@pytest.mark.parametrize("flipped", [False, True])
def test_edges_of_a_cube_are_sharp_and_its_faces_look_outwards(flipped: bool) -> None:
    faces = [face[::-1] if flipped else face for face in CUBE_FACES]
    body = appearing(surface(CUBE, faces))
    assert len(body.corners) == 12
    outward = body.corners.mean(axis=1) - 0.5
    axis = np.abs(outward).argmax(axis=1)
    expected = np.zeros((12, 3))
    expected[np.arange(12), axis] = np.sign(outward[np.arange(12), axis])
    assert body.normals == pytest.approx(np.repeat(expected[:, None], 3, axis=1))
    assert body.colours == pytest.approx(np.tile((0.2, 0.4, 0.6), (12, 1)))


def test_smooth_edges_have_one_normal() -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    rings = [np.array([(np.cos(a), y, np.sin(a)) for a in angles]) for y in (0.0, 1.0)]
    sides = [((k + 1) % 12, k, 12 + k, 12 + (k + 1) % 12) for k in range(12)]
    lids = [tuple(range(12)), tuple(range(23, 11, -1))]
    body = appearing(surface(np.concatenate(rings), [*sides, *lids]))
    on_side = np.abs(body.normals[..., 1]) < 0.5
    radial = body.corners * (1.0, 0.0, 1.0)
    assert body.normals[on_side] == pytest.approx(radial[on_side], abs=0.15)
    assert np.abs(body.normals[~on_side][:, 1]) == pytest.approx(1.0)


def test_an_open_surface_is_seen_from_both_sides() -> None:
    body = appearing(surface(CUBE, CUBE_FACES[:1]))
    for turn in (radians(-90.0), radians(90.0)):
        strip = Strip(View(turn, 0.0), 0.0, left=-1.5, right=1.5, bottom=-0.5, top=1.5, floor=None)
        image = draw_moments(body, [{"bone": np.eye(4)}], strip, Scene())
        assert np.count_nonzero(image[..., 3] == 255) == pytest.approx(150**2, rel=0.03)


def test_the_floor_has_a_height_and_is_seen_from_its_level() -> None:
    level = replace(STRIP, view=View(0.3, 0.0), floor_height=0.5, floor_thickness=0.1)
    image = picture(strip=level)
    right, _, towards = level.view.axes
    assert pixel(image, tuple(0.6 * right + (0.0, 0.45, 0.0)), level)[3] == 255.0
    for height in (0.35, 0.55):
        assert pixel(image, tuple(0.6 * right + (0.0, height, 0.0)), level)[3] == 0.0
    assert towards[1] == 0.0


def test_surfaces_of_a_figure_are_its_body() -> None:
    figure, _ = motion()
    appearances, _ = segment_appearances(figure)
    surfaces = {name: each.surface for name, each in appearances.items()}
    colours = [each.colour for each in appearances.values()]
    one, other = Body.of_surfaces(surfaces, colours), Body.of_figure(figure)
    assert one.segments == other.segments
    assert np.array_equal(one.corners, other.corners)
    assert np.array_equal(one.colours, other.colours)
