"""Shaded pictures of moments: projection, what hides what, shadows, size."""

from dataclasses import replace
from functools import cache
from math import radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator import Plan, Recording, read_figure, simulate
from generator.figure import Figure
from generator.scene import Box, Prop, Scene
from plots.figure_image import GROUND, SKIN, Strip, View, rasterize, strip_image
from springs.contact import DEFAULT_SURFACE

FRONT = View(turn=0.0, tilt=radians(15.0))
STRIP = Strip(FRONT, spacing=1.5, left=-0.7, right=0.7, bottom=-0.3, top=2.0, scale=40.0)


@cache
def motion() -> tuple[Figure, Recording]:
    figure = read_figure("prototype")
    return figure, simulate(figure, Plan(stop=0.02, free_root=True, height=0.0))


def picture(*boxes: Box, frames: tuple[int, ...] = (0,), strip: Strip = STRIP) -> np.ndarray:
    scene = Scene(tuple(Prop(f"box{k}", box, DEFAULT_SURFACE) for k, box in enumerate(boxes)))
    return strip_image(*motion(), frames, strip, scene).astype(float)


def pixel(image: np.ndarray, point: tuple[float, float, float], strip: Strip = STRIP) -> np.ndarray:
    """The pixel of a point of the world in the first moment."""
    right, up, _ = strip.view.axes @ np.array(point)
    row = image.shape[0] - 1 - int(strip.scale * (up - strip.bottom))
    return image[row, int(strip.scale * (right - strip.left))]


def is_skin(colour: np.ndarray) -> bool:
    """Tell whether a colour is a shade of the figure's."""
    return bool(np.allclose(colour[:3] / colour[0], np.array(SKIN[:3]) / SKIN[0], atol=0.03))


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


def test_a_box_before_the_figure_hides_it() -> None:
    size = (0.6, 0.6, 0.1)
    assert not is_skin(pixel(picture(Box((0.0, 1.4, 0.6), size)), (0.0, 1.45, 0.0)))
    assert is_skin(pixel(picture(Box((0.0, 1.4, -0.6), size)), (0.0, 1.45, 0.0)))


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


def test_segments_without_a_surface_are_not_drawn() -> None:
    figure, recording = motion()
    bare = replace(
        figure,
        segments={name: replace(each, psurf=None) for name, each in figure.segments.items()},
    )
    box = Scene((Prop("box", Box((0.0, 0.5, 0.0), (0.2, 1.0, 0.2)), DEFAULT_SURFACE),))
    image = strip_image(bare, recording, (0,), STRIP, box)
    assert not any(is_skin(each) for each in image[image[..., 3] > 0].astype(float))
