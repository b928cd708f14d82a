"""Any scene that a file can hold."""

from dataclasses import replace
from math import degrees, inf

from hypothesis import strategies as st

from generator.contact.box import Box
from generator.contact.plane import Plane
from generator.contact.scene import Cover, Prop, Scene
from springs.contact import Surface
from springs.layer import Layer

lengths = st.floats(-1e3, 1e3)
sizes = st.floats(0.0, 1e3, exclude_min=True)
turns = st.floats(-degrees(1.0) * 300, degrees(1.0) * 300)
directions = st.tuples(*[st.floats(allow_nan=False, allow_infinity=False)] * 3).filter(any)
shapes = st.builds(Plane, st.tuples(*[lengths] * 3), directions) | st.builds(
    Box, st.tuples(*[lengths] * 3), st.tuples(*[sizes] * 3), st.tuples(*[turns] * 3)
)
words = st.text(max_size=300) | st.text('"\\ #[]\n\t=', max_size=60)


@st.composite
def layers(draw: st.DrawFn, sources: st.SearchStrategy[str] = words) -> Layer:
    stiffnesses = draw(st.lists(st.floats(1.0, 1e9), min_size=1, max_size=3))
    steps = draw(st.lists(st.floats(1e-3, 0.2), min_size=3, max_size=3))
    depths = [0.0, steps[0], steps[0] + steps[1]][: len(stiffnesses)]
    thickness = depths[-1] + steps[2] if draw(st.booleans()) else inf
    return Layer(tuple(zip(depths, stiffnesses, strict=True)), thickness, draw(sources))


surfaces = st.builds(
    Surface,
    st.floats(1.0, 1e9),
    st.floats(0.0, 1e3),
    st.floats(0.0, 10.0),
    st.floats(1e-6, 1.0) | st.just(5e-3),
    st.floats(1e-6, 10.0) | st.just(0.02),
    words,
)
names = st.text(min_size=1, max_size=40).filter(str.isprintable)


@st.composite
def scenes(draw: st.DrawFn) -> Scene:
    of_props = draw(st.lists(names, min_size=1, max_size=4, unique=True))
    bare = draw(st.lists(surfaces, min_size=1, max_size=3))
    below = st.none() | layers(st.just(""))
    known = st.sampled_from([replace(one, layer=draw(below)) for one in bare])
    props = tuple(Prop(name, draw(shapes), draw(known)) for name in of_props)
    parts = draw(st.lists(words, max_size=2, unique=True))
    return Scene(props, tuple(Cover(part, draw(layers())) for part in parts))
