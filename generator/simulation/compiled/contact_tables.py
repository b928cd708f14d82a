"""Tables of contact, and the force on a sphere as code.

The force is recorded from its definition in `generator.scene`. Its form depends on the kind of prop
only, so the code is the same for all figures; radii and surfaces are constants in a table.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import assert_never

import numpy as np

from generator.figure import ContactSphere
from generator.rotations import Array
from generator.scene import Box, Plane, Scene, Shape, contact_force
from generator.simulation.compiled.layout import (
    BOX,
    CONTACT_INPUTS,
    CONTACT_SWITCHES,
    PLANE,
    PROP_AXES,
    PROP_COLUMNS,
    PROP_HALF_SIZE,
    PROP_ORIGIN,
    IndexArray,
)
from generator.simulation.compiled.recorder import RECORDING, Recorder, Symbol
from springs.contact import DEFAULT_SURFACE, Surface

_HEADER = '''"""Generated from the definition of contact; constants are in the table P."""
import math


def contact(kind, o, s, W, P, Z, G):
'''

_EXAMPLES: Sequence[Shape] = (
    Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    Box((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)),
)
"""A prop of each kind, in the order of `PLANE` and `BOX`."""


def contact_source() -> str:
    """Return the source of the law of contact for all kinds of props."""
    text = _HEADER
    for kind, shape in enumerate(_EXAMPLES):
        lines, _ = _record(shape, DEFAULT_SURFACE, 0.1)
        text += f"    if kind == {kind}:\n" + "".join(f"        {line}\n" for line in lines)
    return text


@lru_cache(maxsize=1024)
def _record(
    shape: Shape, surface: Surface, radius: float
) -> tuple[tuple[str, ...], tuple[float, ...]]:
    """Record the force on a sphere: lines of code, and their constants."""
    recorder = Recorder()
    x, y, z, *motion = (Symbol(recorder, f"W[{k}]") for k in range(CONTACT_INPUTS))
    velocity, spin = (motion[0], motion[1], motion[2]), (motion[3], motion[4], motion[5])
    force = contact_force(shape, surface, radius, (x, y, z), velocity, spin, RECORDING)
    results = [
        *(force.normal * part for part in (*force.direction, *force.arm)),
        (force.normal - force.elastic) * force.rate,
        force.normal * force.friction_power,
    ]
    ends = [f"W[{CONTACT_INPUTS + k}] = {recorder.name(r)}" for k, r in enumerate(results)]
    ends += [f"G[s + {k}] = {name}" for k, name in enumerate(recorder.switching)]
    assert len(recorder.switching) == CONTACT_SWITCHES
    return (*recorder.lines, *ends), tuple(recorder.constants)


def contact_tables(
    scene: Scene,
    spheres: Mapping[str, Sequence[ContactSphere]],
    segment_links: Mapping[str, int],
    points: Array,
) -> tuple[IndexArray, Array, IndexArray, Array, Array, IndexArray]:
    """Return the tables of `Mechanism` that concern contact, from `spheres` to `contact_offsets`.

    Args:
        scene: the props.
        spheres: contact spheres of each segment that has some.
        segment_links: link of each segment.
        points: point of each link in the axes of its segment, shape (links, 3) [m].
    """
    rows: list[list[int]] = []
    places: list[Array] = []
    parameters: list[float] = []
    offsets: list[list[int]] = []
    for number, (name, some) in enumerate(spheres.items()):
        link = segment_links[name]
        for sphere in some:
            rows.append([link, number])
            places.append(np.append(np.asarray(sphere.centre) - points[link], sphere.radius))
            offsets.append([])
            for prop in scene.props:
                offsets[-1].append(len(parameters))
                parameters.extend(_record(prop.shape, prop.surface, sphere.radius)[1])
    return (
        np.array(rows, dtype=np.int64).reshape(-1, 2),
        np.array(places, dtype=float).reshape(-1, 4),
        *_prop_tables(scene),
        np.array(parameters, dtype=float),
        np.array(offsets, dtype=np.int64).reshape(len(rows), len(scene.props)),
    )


def _prop_tables(scene: Scene) -> tuple[IndexArray, Array]:
    """Return the kinds and the numbers of the props."""
    kinds: list[int] = []
    constants = np.zeros((len(scene.props), PROP_COLUMNS))
    for row, prop in zip(constants, scene.props, strict=True):
        row[PROP_ORIGIN : PROP_ORIGIN + 3] = prop.shape.pose[:3, 3]
        row[PROP_AXES : PROP_AXES + 9] = prop.shape.pose[:3, :3].ravel()
        match prop.shape:
            case Plane():
                kinds.append(PLANE)
            case Box(size=size):
                kinds.append(BOX)
                row[PROP_HALF_SIZE : PROP_HALF_SIZE + 3] = 0.5 * np.asarray(size)
            case _:
                assert_never(prop.shape)
    return np.array(kinds, dtype=np.int64).reshape(-1, 1), constants
