"""Tables of contact, and the forces on spheres and on capsules as code.

The forces are recorded from their definitions in `generator.contact`. The form of the first depends
on the class of a prop's shape only, so the code is the same for all figures; radii, lengths and
surfaces are constants in a table.
"""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cache
from math import hypot
from typing import Any

import numpy as np

from generator.contact.force import contact_force
from generator.contact.scene import NO_SCENE, SHAPES, Scene
from generator.contact.self_contact import LIMB_SURFACE, CapsulePair, capsule_force
from generator.contact.shape import Shape
from generator.figure import ContactSphere
from generator.rotations import Array
from generator.simulation.compiled.layout import (
    CONTACT_INPUTS,
    FIRST_HALF,
    FIRST_MIDDLE,
    PAIR_CONSTANT_COLUMNS,
    PAIR_INPUTS,
    PAIR_RANGE,
    PAIR_REACH,
    PROP_AXES,
    PROP_COLUMNS,
    PROP_LARGEST,
    PROP_LEAST,
    PROP_ORIGIN,
    RADIUS_DIFFERENCE,
    SECOND_HALF,
    SECOND_MIDDLE,
    SPHERE_RADIUS,
    IndexArray,
)
from generator.simulation.compiled.recorder import RECORDING, Recorder, Symbol
from springs import Real
from springs.contact import DEFAULT_SURFACE, Surface, rising_force, rising_slope
from springs.contact_part import PartLaw

_HEADER = '''"""Generated from the definition of contact; constants are in the table P."""
import math


def contact(kind, o, W, P):
'''

_PAIR_HEADER = '''"""Generated from the definition of two capsules; constants are in the table P."""
import math


def pair(o, W, P):
'''


_STAGE_HEADER = '''"""Generated from the definition of a stage of the law of a part."""


def stage(x, k, e, W):
'''


def stage_source() -> str:
    """Return the source of force and slope of a stage, which are stored."""
    recorder = _LiteralRecorder()
    x, k, e = (Symbol(recorder, name) for name in "xke")
    results = [law(x, k, e, RECORDING) for law in (rising_force, rising_slope)]
    lines, _ = _lines_and_constants(recorder, results, 0)
    return _STAGE_HEADER + "".join(f"    {line}\n" for line in lines)


class _LiteralRecorder(Recorder):
    """Lines of code whose constants stand in them."""

    def name(self, value: Real) -> str:
        """Return the name of a symbol, or a constant."""
        return value.name if isinstance(value, Symbol) else repr(float(value))


def contact_source(results: Collection[int] | None = None) -> str:
    """Return the source of the law of contact for all shapes.

    Args:
        results: places of the results to compute, such as `CONTACT_DEPTH`; None for all.
    """
    text = _HEADER
    for kind, shape in enumerate(SHAPES):
        lines, _ = _record(shape(), DEFAULT_SURFACE, 0.1)
        if results is not None:
            lines = _lines_before(lines, {f"W[{place}]" for place in results})
        text += f"    if kind == {kind}:\n" + "".join(f"        {line}\n" for line in lines)
    return text


def _lines_before(lines: Sequence[str], results: set[str]) -> list[str]:
    """Return the lines on which results depend, in their order."""
    needed, kept = set(results), list[str]()
    for line in reversed(lines):
        name, _, value = line.partition(" = ")
        if name in needed:
            needed.update(re.findall(r"v\d+", value))
            kept.append(line)
    return kept[::-1]


class _TableRecorder(Recorder):
    """Lines of code whose constants may be arrays: those of many laws of one form."""

    def name(self, value: Real) -> str:
        """Return the name of a symbol, or the table's entry of a constant."""
        if not isinstance(value, np.ndarray):
            return super().name(value)
        constants: list[Any] = self.constants
        constants.append(value)
        return f"P[o + {len(constants) - 1}]"


def _record(
    shape: Shape,
    surface: Surface,
    radius: float | Array,
    lengths: Sequence[Array] | None = None,
) -> tuple[tuple[str, ...], tuple[Any, ...]]:
    """Record the force on a sphere: lines of code, and their constants.

    Those of many spheres are recorded at once with arrays of radii, and those of many props with
    arrays of their lengths.
    """
    recorder = _TableRecorder()
    x, y, z, *motion = (Symbol(recorder, f"W[{k}]") for k in range(CONTACT_INPUTS))
    velocity, spin = (motion[0], motion[1], motion[2]), (motion[3], motion[4], motion[5])
    force = contact_force(
        shape, surface, radius, (x, y, z), velocity, spin, RECORDING, lengths=lengths
    )
    results = [
        *(force.normal * part for part in (*force.direction, *force.arm)),
        (force.normal - force.elastic) * force.rate,
        force.normal * force.friction_power,
        force.depth,
        force.rate,
        *force.normal_direction,
        force.stiffness,
        force.damping,
        force.friction,
        force.friction_bend,
    ]
    return _lines_and_constants(recorder, results, CONTACT_INPUTS)


def pair_source() -> str:
    """Return the source of the law of two capsules, which returns whether they touch.

    The results are stored if they do.
    """
    lines, _, depth = _record_pair()
    known = next(k for k, line in enumerate(lines) if line.startswith(f"{depth} = "))
    body = [*lines[: known + 1], f"if {depth} <= 0.0:", "    return False", *lines[known + 1 :]]
    return _PAIR_HEADER + "".join(f"    {line}\n" for line in [*body, "return True"])


@cache
def _record_pair() -> tuple[tuple[str, ...], tuple[float, ...], str]:
    """Record the force of two capsules: lines of code, their constants, and the depth's name."""
    recorder = Recorder()
    numbers = [Symbol(recorder, f"W[{k}]") for k in range(PAIR_INPUTS)]
    between, first, second, velocity, first_spin, second_spin = (
        (numbers[k], numbers[k + 1], numbers[k + 2]) for k in range(0, 18, 3)
    )
    force = capsule_force(
        LIMB_SURFACE,
        numbers[18],
        numbers[19],
        between,
        (first, second),
        velocity,
        (first_spin, second_spin),
        RECORDING,
    )
    vectors = (force.direction, force.first_arm, force.second_arm)
    results = [
        *(force.normal * part for vector in vectors for part in vector),
        (force.normal - force.elastic) * force.rate,
        force.normal * force.friction_power,
    ]
    return *_lines_and_constants(recorder, results, PAIR_INPUTS), recorder.name(force.depth)


def _lines_and_constants(
    recorder: Recorder, results: Sequence[Real], place: int
) -> tuple[tuple[str, ...], tuple[float, ...]]:
    """Return the recorded lines, with those that store the results from a place on."""
    ends = [f"W[{place + k}] = {recorder.name(r)}" for k, r in enumerate(results)]
    assert not recorder.switching
    return (*recorder.lines, *ends), tuple(recorder.constants)


def contact_tables(
    scene: Scene,
    spheres: Mapping[str, Sequence[ContactSphere]],
    segment_links: Mapping[str, int],
    points: Array,
    laws: Mapping[str, PartLaw] | None = None,
) -> tuple[
    *tuple[IndexArray, Array, Array, IndexArray, Array, Array, IndexArray],
    *tuple[IndexArray, IndexArray, Array],
]:
    """Return the tables of `Mechanism` that concern contact, up to `part_parameters`.

    Args:
        scene: the props.
        spheres: contact spheres of each segment that has some.
        segment_links: link of each segment.
        points: point of each link in the axes of its segment, shape (links, 3) [m].
        laws: laws of parts of the body by name; without any each sphere resists by itself.
    """
    groups = np.zeros((len(spheres), 3), dtype=np.int64)
    reaches = np.zeros(len(spheres))
    constants = np.array(
        [(*sphere.centre, sphere.radius) for some in spheres.values() for sphere in some],
        dtype=float,
    ).reshape(-1, 4)
    first = 0
    for number, (name, some) in enumerate(spheres.items()):
        link, own = segment_links[name], constants[first : first + len(some)]
        own[:, :3] -= points[link]
        reaches[number] = np.max(np.linalg.norm(own[:, :3], axis=1) + own[:, SPHERE_RADIUS])
        groups[number] = link, first, first + len(some)
        first += len(some)
    return (
        groups,
        reaches,
        constants,
        *_prop_tables(scene),
        *_law_tables(scene, constants[:, SPHERE_RADIUS], has_parts=bool(laws)),
        *_part_tables(scene, spheres, laws or {}),
    )


def _part_tables(
    scene: Scene, spheres: Mapping[str, Sequence[ContactSphere]], laws: Mapping[str, PartLaw]
) -> tuple[IndexArray, IndexArray, Array]:
    """Return the part and region of each sphere, and the constants of each of these and prop.

    A sphere of no part with a law is a part of its own, with the surface of the prop.
    """
    if not laws:
        return np.zeros((0, 2), dtype=np.int64), np.zeros((0, 0), dtype=np.int64), np.zeros(0)
    numbers = {name: number for number, name in enumerate(laws)}
    parts: list[tuple[int, int]] = []
    made: list[PartLaw | None] = list(laws.values())
    for some in spheres.values():
        for sphere in some:
            if sphere.part not in numbers:
                made.append(None)
            part = numbers.get(sphere.part, len(made) - 1)
            parts.append((part, numbers.get(sphere.region, -1)))
    offsets = np.zeros((len(made), len(scene.props)), dtype=np.int64)
    table: list[float] = []
    known: dict[tuple[PartLaw | None, Surface], int] = {}
    for row, law in zip(offsets, made, strict=True):
        for place, prop in enumerate(scene.props):
            key = law, prop.surface
            if key not in known:
                known[key] = len(table)
                table += _part_constants(law, prop.surface)
            row[place] = known[key]
    return np.array(parts, dtype=np.int64), offsets, np.array(table)


def _part_constants(law: PartLaw | None, surface: Surface) -> list[float]:
    """Return the constants of a part and a surface; see `PART_DAMPING`."""
    if law is None:
        stage = (0.0, surface.stiffness, surface.transition_depth)
        return [surface.damping, 1.0, 1.0, *stage]
    law = law.on(surface.layer)
    stages = list(law.increments)
    numbers = (x for stage in stages for x in stage)
    return [law.damping, law.norm_scale, float(len(stages)), *numbers]


def _law_tables(scene: Scene, radii: Array, *, has_parts: bool = False) -> tuple[Array, IndexArray]:
    """Return the constants of the law for each sphere and prop, and where they begin.

    Args:
        scene: the props.
        radii: Radii of the spheres, shape (S,) [m].
        has_parts: Whether parts have laws: then a sphere has some force without damping, which is
            replaced by its share of that of its part.

    Returns:
        The constants, and the place of the first one of a sphere and a prop, shape (S, props).
    """
    alike: dict[tuple[type[Shape], Surface], list[int]] = {}
    for place, prop in enumerate(scene.props):
        alike.setdefault((type(prop.shape), prop.surface), []).append(place)
    parameters: list[Array] = []
    offsets = np.zeros((len(radii), len(scene.props)), dtype=np.int64)
    begin = 0
    for (_, surface), props in alike.items():
        shapes = [scene.props[place].shape for place in props]
        if has_parts:
            surface = replace(surface, stiffness=1.0, damping=0.0)
        lengths = [*np.array([shape.lengths for shape in shapes]).T]
        _, constants = _record(shapes[0], surface, radii[:, None], lengths)
        table = np.empty((len(radii), len(props), len(constants)))
        for k, constant in enumerate(constants):
            table[:, :, k] = constant
        offsets[:, props] = begin + len(constants) * np.arange(table[..., 0].size).reshape(
            len(radii), len(props)
        )
        parameters.append(table.ravel())
        begin += table.size
    return np.concatenate([np.zeros(0), *parameters]), offsets


def _prop_tables(scene: Scene) -> tuple[IndexArray, Array]:
    """Return the numbers of the props' classes, and their constants."""
    shapes = [prop.shape for prop in scene.props]
    constants = np.zeros((len(shapes), PROP_COLUMNS))
    for row, shape in zip(constants, shapes, strict=True):
        row[PROP_ORIGIN : PROP_ORIGIN + 3] = shape.pose[:3, 3]
        row[PROP_AXES : PROP_AXES + 9] = shape.pose[:3, :3].ravel()
        row[PROP_LEAST : PROP_LEAST + 3], row[PROP_LARGEST : PROP_LARGEST + 3] = shape.bounds
    return np.array(scene.shape_numbers, dtype=np.int64).reshape(-1, 1), constants


def pair_tables(
    pairs: Sequence[CapsulePair], segment_links: Mapping[str, int], points: Array
) -> tuple[IndexArray, Array, Array]:
    """Return the tables of `Mechanism` that concern pairs of capsules.

    Args:
        pairs: pairs of capsules.
        segment_links: link of each segment.
        points: point of each link in the axes of its segment, shape (links, 3) [m].
    """
    rows = np.zeros((len(pairs), 2), dtype=np.int64)
    constants = np.zeros((len(pairs), PAIR_CONSTANT_COLUMNS))
    for row, places, pair in zip(rows, constants, pairs, strict=True):
        first, second = pair.capsules
        links = segment_links[pair.first], segment_links[pair.second]
        row[:] = links
        for link, capsule, middle, half in zip(
            links,
            pair.capsules,
            (FIRST_MIDDLE, SECOND_MIDDLE),
            (FIRST_HALF, SECOND_HALF),
            strict=True,
        ):
            places[middle : middle + 3] = np.asarray(capsule.middle) - points[link]
            places[half : half + 3] = capsule.half_line
        places[PAIR_REACH] = pair.reach
        places[RADIUS_DIFFERENCE] = first.radius - second.radius
        places[PAIR_RANGE] = pair.reach + hypot(*first.half_line) + hypot(*second.half_line)
    parameters = _record_pair()[1] if pairs else ()
    return rows, constants, np.array(parameters, dtype=float)


_NO_POINTS = np.zeros((0, 3))
NO_SPHERES = contact_tables(NO_SCENE, {}, {}, _NO_POINTS)
NO_PAIRS = pair_tables((), {}, _NO_POINTS)
