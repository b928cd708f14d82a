"""Laws of every shape of a prop, each of which is a class in the table `SHAPES`."""

from importlib import import_module
from pkgutil import iter_modules

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import generator.contact
from generator.contact.scene import SHAPES, Prop, Scene
from generator.contact.shape import Shape
from generator.input_files.scene import SCENE_FILE, write_scene
from springs.contact import DEFAULT_SURFACE

each_shape = pytest.mark.parametrize("shape", [made() for made in SHAPES], ids=lambda one: one.name)
points = st.tuples(*[st.floats(-2.0, 2.0)] * 3)


def distance(shape: Shape, point) -> float:
    return float(shape.distance(tuple(point))[0])


def test_every_class_is_in_the_table():
    for module in iter_modules(generator.contact.__path__, "generator.contact."):
        import_module(module.name)
    assert set(Shape.__subclasses__()) == set(SHAPES)
    assert len({shape.name for shape in SHAPES}) == len(SHAPES)


@each_shape
@given(point=points)
def test_a_point_is_no_nearer_than_the_bounds(shape: Shape, point):
    """Compiled code evaluates the force near the bounds only."""
    low, high = shape.bounds
    assert distance(shape, point) >= max(np.max(low - point), np.max(point - high)) - 1e-12


@each_shape
@given(point=points)
def test_the_normal_is_the_gradient_of_the_distance(shape: Shape, point):
    step = 1e-6
    slopes = [
        [(distance(shape, point + side * e) - distance(shape, point)) / (side * step)
         for e in step * np.eye(3)]
        for side in (1.0, -1.0)
    ]  # fmt: skip
    assume(np.allclose(*slopes, atol=1e-3))  # not where two faces are equally near
    normal = np.array(shape.distance(point)[1], float)
    assert np.linalg.norm(normal) == pytest.approx(1.0)
    assert normal == pytest.approx(slopes[0], abs=1e-3)


@each_shape
def test_the_surface_lies_where_the_distance_is_zero(shape: Shape):
    surface = shape.surface()
    assert (surface is None) is shape.is_endless
    if surface is not None:
        assert shape.distance(tuple(surface.vertices.T))[0] == pytest.approx(0.0, abs=1e-12)
        ends = [surface.vertices.min(axis=0), surface.vertices.max(axis=0)]
        assert ends == pytest.approx(shape.bounds, abs=1e-12)


@each_shape
def test_a_file_has_the_shape(shape: Shape):
    scene = Scene((Prop("one", shape, DEFAULT_SURFACE),))
    assert SCENE_FILE.parse_text(write_scene(scene)).require_value() == scene
    assert shape.describe().startswith(shape.name)
    assert len(shape.lengths) <= 5
