"""Framing of pictures: views, sizes, and the whole body within the picture."""

from dataclasses import replace
from itertools import pairwise
from math import pi, radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.contact.box import Box
from generator.contact.plane import Plane
from generator.contact.scene import Prop, Scene
from generator.diagnostics import MoverError
from plots.figure_image import Body, Strip, View, draw_moments
from plots.framing import (
    VIEWS,
    Size,
    bounds,
    floor_height,
    frame_moments,
    scaled,
    size_from_options,
    view_from_options,
)
from plots.picture import Subject
from springs.contact import DEFAULT_SURFACE
from tests.motions import shipped
from tests.pictures import NO_SCENE, drawn, moving, standing, view_of

angles = st.floats(-pi, pi)
tilts = st.floats(-1.5, 1.5)


def screen(subject: Subject, poses: dict[str, np.ndarray], strip: Strip, place: int) -> np.ndarray:
    """Columns and heights of all corners in the picture [m], shape (n, 2)."""
    corners, _ = subject.body.place(poses)
    seen = corners.reshape(-1, 3) @ strip.view.axes[:2].T
    return seen + np.array([place * strip.spacing, 0.0])


@given(angles, tilts, st.sampled_from([None, -0.3, 0.0, 2.5]))
def test_a_strip_contains_every_moment_without_overlap(
    turn: float, tilt: float, floor: float | None
):
    subject, view = moving(), View(turn, tilt)
    moments = subject.moments([0.1, 0.2, 0.37, 0.5])
    limits = [bounds(subject.body, poses, NO_SCENE, view) for poses in moments]
    strip = frame_moments(limits, view, floor)
    seen = [screen(subject, poses, strip, k) for k, poses in enumerate(moments)]
    for points in seen:
        assert np.all(points > (strip.left, strip.bottom))
        assert np.all(points < (strip.left + strip.width(len(moments)), strip.top))
    for one, other in pairwise(seen):
        assert one[:, 0].max() < other[:, 0].min()


@pytest.mark.parametrize("name", VIEWS)
@pytest.mark.parametrize("figure", ["prototype", "pendulum", "clavicles"])
def test_a_picture_ends_outside_the_body(name: str, figure: str):
    image = drawn(standing(figure), view_of(name))
    alpha = image[..., 3]
    assert not np.any(alpha[[0, -1]])
    assert not np.any(alpha[:, [0, -1]])
    rows, columns = (np.flatnonzero(alpha.any(axis=axis)) for axis in (1, 0))
    widest = max(alpha.shape)
    assert min(rows[0], columns[0]) < 0.06 * widest + 2
    assert alpha.shape[0] - rows[-1] < 0.06 * widest + 2
    assert alpha.shape[1] - columns[-1] < 0.06 * widest + 2


@pytest.mark.parametrize("name", ["front", "back"])
def test_a_symmetric_pose_has_a_symmetric_front(name: str):
    alpha = drawn(standing(), view_of(name))[..., 3].astype(float)
    assert np.mean(np.abs(alpha - alpha[:, ::-1])) < 2.0
    side = drawn(standing(), view_of("side"))[..., 3].astype(float)
    assert np.mean(np.abs(side - side[:, ::-1])) > 20.0


def test_the_named_views_show_what_they_say():
    forwards, left, up = np.array([(0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    seen = {name: view_of(name).axes for name in VIEWS}
    assert seen["front"] @ left == pytest.approx([1.0, 0.0, 0.0])
    assert seen["front"] @ forwards == pytest.approx([0.0, 0.0, 1.0])
    assert seen["back"] @ left == pytest.approx([-1.0, 0.0, 0.0])
    assert seen["side"] @ forwards == pytest.approx([1.0, 0.0, 0.0])
    assert seen["top"] @ up == pytest.approx([0.0, 0.0, 1.0])
    assert seen["top"] @ forwards == pytest.approx([1.0, 0.0, 0.0])
    assert min(seen["three-quarter"][2] @ forwards, seen["three-quarter"][2] @ up) > 0.0
    turned = view_from_options("side", None, 30.0)
    assert (turned.turn, turned.tilt) == pytest.approx((radians(-90.0), radians(30.0)))


def box_scene(centre: tuple[float, float, float]) -> Scene:
    return Scene((Prop("box", Box(centre, (1.0, 2.2, 0.2)), DEFAULT_SURFACE),))


def test_a_nearer_box_hides_the_body_and_a_farther_one_does_not():
    subject = standing()
    (poses,) = subject.moments(())
    orange = []
    for z in (1.0, -1.0):
        scene, view = box_scene((0.0, 1.0, z)), view_of("front")
        strip = scaled(
            frame_moments([bounds(subject.body, poses, scene, view)], view, None), 1, Size(100)
        )
        image = draw_moments(subject.body, [poses], strip, scene).astype(int)
        orange.append(np.count_nonzero(image[..., 0] > image[..., 2] + 50))
        assert not np.any(image[[0, -1], :, 3]), "the box is in the picture"
    assert orange[0] == 0
    assert orange[1] > 500


def test_the_floor_is_that_of_the_scene():
    level = Prop("ground", Plane((3.0, 0.25, 1.0), (0.0, 2.0, 0.0)), DEFAULT_SURFACE)
    ramp = Prop("ramp", Plane((0.0, 0.0, 0.0), (0.0, 1.0, 1.0)), DEFAULT_SURFACE)
    assert floor_height(NO_SCENE, False) is None
    assert floor_height(NO_SCENE, True) == 0.0
    assert floor_height(Scene((ramp,)), False) is None
    assert floor_height(Scene((ramp, level)), True) == 0.25


def test_the_floor_reaches_both_edges():
    image = drawn(standing(), view_of("three-quarter"), floor=0.0)
    alpha = image[..., 3]
    assert np.any(alpha[:, 0] == 255)
    assert np.any(alpha[:, -1] == 255)
    assert not np.any(alpha[[0, -1]])


def test_travel_is_seen_in_a_strip():
    view = view_of("side")
    low, high = np.array([-0.2, 0.0, -0.2]), np.array([0.2, 1.0, 0.2])
    there = np.stack([low, high])
    moments = [there + np.array([shift, 0.0, 0.0]) for shift in (0.0, 0.3, 0.4)]
    strip = frame_moments(moments, view, None)
    edges = [each[:, 0] + k * strip.spacing for k, each in enumerate(moments)]
    gaps = [later[0] - earlier[1] for earlier, later in pairwise(edges)]
    assert gaps[0] - gaps[1] == pytest.approx(0.2)
    assert min(gaps) > 0.0


@pytest.mark.parametrize(
    ("options", "size"),
    [
        ((None, None, None), Size(None, None, 100.0)),
        (("640", None, None), Size(640, None, 100.0)),
        (("640px", None, 150.0), Size(640, None, 150.0)),
        (("8cm", None, None), Size(945, None, 300.0)),
        (("8 cm", None, 300.0), Size(945, None, 300.0)),
        (("85mm", None, 100.0), Size(335, None, 100.0)),
        (("2.5in", None, None), Size(750, None, 300.0)),
        ((None, 200.0, None), Size(None, 200.0, 100.0)),
    ],
)
def test_the_size_of_options(options: tuple[str | None, float | None, float | None], size: Size):
    assert size_from_options(*options) == size


def test_a_figure_without_anything_to_draw_is_refused():
    figure = shipped("prototype")
    bare = {name: replace(each, psurf=None, sites={}) for name, each in figure.segments.items()}
    empty = Body.of_figure(replace(figure, joints={}, segments=bare))
    assert empty.segments == ()
    poses = standing().moments(())[0]
    with pytest.raises(MoverError, match="nothing to draw"):
        bounds(empty, poses, NO_SCENE, view_of("front"))
