"""Figures with contact spheres, props of every kind, and random contacts of a sphere and a prop."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from hypothesis import strategies as st

from generator.contact.box import Box
from generator.contact.plane import Plane
from generator.contact.scene import Prop, Scene, floor_prop
from generator.contact.shape import Shape
from generator.figure import ContactSphere, Figure, Segment
from springs.contact import Surface
from tests.chains import FREE, Vector, at, body, chain, figure, ground, joint, one_body

FLOOR = Scene((floor_prop((0.0, 1.0, 0.0)),))

SOFT = Surface(stiffness=4e3, damping=0.7, friction=0.4, transition_depth=8e-3)

TILTED = Prop("slope", Plane((0.1, -0.05, 0.2), (0.3, 1.0, -0.2)), SOFT)
CRATE = Prop("crate", Box((0.3, 0.1, -0.2), (0.6, 0.5, 0.8), (0.3, -0.5, 0.7)), Surface())
SLOPE_AND_CRATE = Scene((TILTED, CRATE))

RADIUS = 0.1
MASS = 2.0
BALL_INERTIA = (0.4 * MASS * RADIUS**2,) * 3


def with_spheres(segment: Segment, *spheres: tuple[Vector, float]) -> Segment:
    """The segment with contact spheres, each a centre and a radius [m]."""
    return replace(segment, contact_spheres=tuple(ContactSphere(*one) for one in spheres))


def ball(height: float, displacement: Sequence[float] = (0.0,) * 3) -> Figure:
    """A free homogeneous ball whose lowest point is at a height [m]."""
    link = with_spheres(
        body("link", MASS, BALL_INERTIA, (0.0, 0.0, 0.0)), ((0.0, 0.0, 0.0), RADIUS)
    )
    return one_body(FREE, (*displacement, 0.0, height + RADIUS, 0.0), link)


BLOCK_HALF = (0.1, 0.05, 0.1)
_CORNER = 0.02
"""Radius of the spheres in the block's corners [m]."""


def block(height: float, turn: float = 0.0) -> Figure:
    """A free block that touches with its corners, turned about z [rad].

    Its centre is `height` above a plane through the origin that is turned as well [m].
    """
    spheres = [
        (tuple(s * (half - _CORNER) for s, half in zip(signs, BLOCK_HALF, strict=True)), _CORNER)
        for signs in product((-1.0, 1.0), repeat=3)
    ]
    link = with_spheres(body("link", MASS, (0.01, 0.015, 0.01), (0.0, 0.0, 0.0)), *spheres)
    sine, cosine = np.sin(turn), np.cos(turn)
    return one_body(FREE, (0.0, 0.0, turn, -height * sine, height * cosine, 0.0), link)


def odd_body() -> Figure:
    """A free body with three spheres around a centre of mass beside its origin."""
    spheres = (((0.2, 0.1, 0.0), 0.1), ((-0.2, 0.0, 0.15), 0.15), ((0.0, -0.25, -0.1), 0.08))
    return one_body(FREE, segment=with_spheres(body("link"), *spheres))


def two_segments() -> Figure:
    """A free body, one on a hinge, and one with a capsule on a ball, which comes first."""
    first = with_spheres(
        body("first", sites={"far": at((0.4, -0.7, 0.3), (0.1, -0.3, 0.2))}),
        ((0.1, 0.1, 0.0), 0.12),
        ((-0.2, 0.0, 0.1), 0.1),
    )
    second = with_spheres(
        body(
            "second", 1.3, (0.02, 0.015, 0.01), (0.1, 0.15, -0.05), {"tip": at(shift=(0.1, 0, 0))}
        ),
        ((0.0, 0.2, 0.0), 0.15),
    )
    third = body("third", 0.7, (0.004, 0.005, 0.006), (0.0, 0.1, 0.02))
    return figure(
        [ground(), third, first, second],
        [
            joint("root", "ground.base", "first.near", FREE),
            joint("hinge", "first.far", "second.near", chain("Rs"), (0.3,)),
            joint("ball", "second.tip", "third.near", chain("Rx Ry Rz"), (0.2, -0.3, 0.1)),
        ],
    )


def vectors(bound: float, least: float | None = None) -> st.SearchStrategy[tuple]:
    return st.tuples(*[st.floats(-bound if least is None else least, bound)] * 3)


surfaces = st.builds(
    Surface,
    stiffness=st.floats(1e2, 1e6),
    damping=st.floats(0.0, 5.0),
    friction=st.floats(0.0, 2.0),
    transition_depth=st.floats(1e-4, 0.02),
    friction_speed=st.floats(1e-3, 0.1),
)
planes = st.builds(Plane, vectors(5.0), vectors(1.0).filter(lambda n: np.linalg.norm(n) > 1e-3))
boxes = st.builds(Box, vectors(5.0), vectors(2.0, 0.1), vectors(np.pi))


@dataclass(frozen=True)
class Touch:
    """A sphere in the axes of a prop, from outside to deep inside."""

    shape: Shape
    surface: Surface
    radius: float
    centre: tuple[float, ...]
    velocity: tuple[float, ...]
    spin: tuple[float, ...]


@st.composite
def touches(draw: st.DrawFn) -> Touch:
    """Contacts within the transition depth as often as outside and deeper."""
    shape, surface, radius = draw(planes | boxes), draw(surfaces), draw(st.floats(0.01, 0.3))
    depths = surface.transition_depth, 2.0 * radius
    depth = draw(st.floats(-depths[0], 2.0 * depths[0]) | st.floats(-depths[1], depths[1]))
    half, axis, sign = np.array([1.0, 0.0, 1.0]), 1, 1.0
    if isinstance(shape, Box):
        half, axis = 0.5 * np.array(shape.size), draw(st.integers(0, 2))
        sign = draw(st.sampled_from([-1.0, 1.0]))
    centre = np.array(draw(vectors(1.2))) * half
    centre[axis] = sign * (half[axis] + radius - depth)
    return Touch(
        shape, surface, radius, tuple(centre.tolist()), draw(vectors(5.0)), draw(vectors(20.0))
    )
