"""The generated law of contact, executed as plain Python, against its definition; its tables."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator.contact.box import Box
from generator.contact.force import contact_force
from generator.contact.plane import Plane
from generator.contact.scene import SHAPES, Prop, Scene
from generator.contact.self_contact import LIMB_SURFACE, Capsule, CapsulePair, capsule_force
from generator.contact.shape import Shape
from generator.figure import ContactSphere
from generator.simulation.compiled.contact_tables import (
    _record,
    contact_source,
    contact_tables,
    pair_source,
    pair_tables,
)
from generator.simulation.compiled.layout import (
    CONTACT_INPUTS,
    CONTACT_RESULTS,
    PAIR_INPUTS,
    PAIR_RESULTS,
)
from springs import FLOATS
from springs.contact import DEFAULT_SURFACE, Surface
from springs.contact_part import PartLaw
from springs.layer import Layer
from tests.contact_figures import CRATE, SOFT, TILTED, Touch, touches

DIFFERENT = Surface(1e3, 0.3, 0.2, 0.01, 0.05)


@cache
def law() -> Callable[..., None]:
    """The generated function in plain Python."""
    names: dict[str, Any] = {}
    exec(contact_source(), names)
    return names["contact"]


def kind_of(shape: Shape) -> int:
    return SHAPES.index(type(shape))


PLANE, BOX = map(SHAPES.index, (Plane, Box))


def evaluate(
    kind: int, parameters: Sequence[float], offset: int, inputs: Sequence[float]
) -> list[float]:
    """Results of the generated code."""
    work = [*inputs, *[np.nan] * CONTACT_RESULTS]
    law()(kind, offset, work, parameters)
    assert work[:CONTACT_INPUTS] == list(inputs)
    return work[CONTACT_INPUTS:]


def expected_results(touch: Touch) -> tuple[list[float], float]:
    """Results by the definition with numpy, and the depth."""
    force = contact_force(
        touch.shape,
        touch.surface,
        np.float64(touch.radius),
        *(
            tuple(np.float64(x) for x in vector)
            for vector in (touch.centre, touch.velocity, touch.spin)
        ),
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
    return [float(result) for result in results], float(force.depth)


@given(touches())
def test_the_code_gives_the_numbers_of_the_law(touch: Touch) -> None:
    """To the last digit, for planes and boxes, outside, in the transition, and beyond."""
    _, constants = _record(touch.shape, touch.surface, touch.radius)
    inputs = (*touch.centre, *touch.velocity, *touch.spin)
    expected, _ = expected_results(touch)
    assert evaluate(kind_of(touch.shape), constants, 0, inputs) == expected


LINES = {
    PLANE: _record(TILTED.shape, SOFT, 0.2)[0],
    BOX: _record(CRATE.shape, SOFT, 0.2)[0],
}
"""Recorded lines of the law on each kind of prop."""


@pytest.mark.slow
@settings(max_examples=20)
@given(touches(), touches())
def test_one_form_serves_all_spheres_and_surfaces(one: Touch, other: Touch) -> None:
    """The lines depend on the kind of prop only; all that differs is in the table."""
    for touch in (one, other):
        assert _record(touch.shape, touch.surface, touch.radius)[0] == LINES[kind_of(touch.shape)]


# Tables

SPHERES = {
    "thigh": (ContactSphere((0.1, 0.2, 0.3), 0.05), ContactSphere((0.0, -0.1, 0.0), 0.07)),
    "shank": (ContactSphere((0.0, 0.0, 0.4), 0.06),),
}
LINKS = {"thigh": 2, "shank": 4}
POINTS = np.arange(15.0).reshape(5, 3) / 10.0
PROPS = Scene((TILTED, CRATE, Prop("other", CRATE.shape, DIFFERENT)))


def test_tables_of_spheres_and_props() -> None:
    groups, reaches, places, kinds, numbers, parameters, offsets, *parts = contact_tables(
        PROPS, SPHERES, LINKS, POINTS
    )
    assert [part.size for part in parts] == [0, 0, 0]
    assert groups.tolist() == [[2, 0, 2], [4, 2, 3]]
    distances = np.linalg.norm(places[:, :3], axis=1) + places[:, 3]
    assert reaches == pytest.approx([distances[:2].max(), distances[2]])
    assert places.shape == (3, 4)
    assert places[:, :3] == pytest.approx(
        np.array([[0.1, 0.2, 0.3], [0.0, -0.1, 0.0], [0.0, 0.0, 0.4]]) - POINTS[[2, 2, 4]]
    )
    assert places[:, 3].tolist() == [0.05, 0.07, 0.06]
    assert kinds.tolist() == [[PLANE], [BOX], [BOX]]
    for row, prop in zip(numbers, PROPS.props, strict=True):
        assert np.array_equal(row[:3], prop.shape.pose[:3, 3])
        assert np.array_equal(row[3:12].reshape(3, 3), prop.shape.pose[:3, :3])
        assert np.array_equal(row[12:].reshape(2, 3), prop.shape.bounds)
    assert offsets.shape == (3, 3)
    assert offsets[0, 0] == 0
    assert parameters.ndim == 1
    assert groups.dtype == kinds.dtype == offsets.dtype == np.int64


def test_tables_of_parts() -> None:
    """A part of two segments; the sphere of none is a part of its own, with the prop's surface."""
    knee = {
        name: tuple(replace(one, part="knee") for one in some) for name, some in SPHERES.items()
    }
    knee["thigh"] = (SPHERES["thigh"][0], *knee["thigh"][1:])
    law = PartLaw(((0.0, 3e4), (0.02, 9e4)), 0.7)
    soft = replace(DIFFERENT, layer=Layer(((0.0, 6e4),)))
    scene = Scene((TILTED, Prop("soft", CRATE.shape, soft)))
    *_, parts, offsets, table = contact_tables(scene, knee, LINKS, POINTS, {"knee": law})
    assert parts.tolist() == [[1, -1], [0, -1], [0, -1]]
    assert offsets.shape == (2, 2)

    def constants(part: int, prop: int, size: int) -> list[float]:
        at = offsets[part, prop]
        return table[at : at + size].tolist()

    assert constants(0, 0, 9) == [0.7, 1.0, 2.0, 0.0, 3e4, 5e-3, 0.02, 6e4, 2e-3]
    series = law.on(soft.layer)
    assert constants(0, 1, 6) == [series.damping, 1.0, 2.0, 0.0, 2e4, 5e-3]
    assert constants(1, 1, 6) == [
        soft.damping,
        1.0,
        1.0,
        0.0,
        soft.stiffness,
        soft.transition_depth,
    ]


def test_a_sphere_that_touches_nothing_feels_nothing() -> None:
    for prop in (Prop("floor", Plane((0, 0, 0), (0, 1, 0)), DEFAULT_SURFACE), CRATE):
        inputs = (0.0, 3.0, 0.0, 1.0, -2.0, 3.0, 4.0, 5.0, 6.0)
        constants = _record(prop.shape, prop.surface, 0.1)[1]
        results = evaluate(kind_of(prop.shape), constants, 0, inputs)
        assert results[:8] == [0.0] * 8  # force, moment and powers
        assert results[8] < -0.1  # the depth


# Pairs of capsules

PAIRS = (
    CapsulePair(
        "thigh",
        "shank",
        (
            Capsule((0.1, 0.2, 0.3), (0.0, 0.0, 0.2), 0.07),
            Capsule((0.0, 0.1, 0.0), (0.1, 0, 0), 0.05),
        ),
        0.11,
    ),
    CapsulePair(
        "shank",
        "thigh",
        (
            Capsule((0.0, 0.1, 0.0), (0.1, 0, 0), 0.05),
            Capsule((0.1, 0.2, 0.3), (0.0, 0.0, 0.2), 0.07),
        ),
        0.12,
    ),
)


def evaluate_pair(parameters: Sequence[float], inputs: Sequence[float]) -> tuple[list[float], bool]:
    """Results, NaN where the capsules are apart, and whether they touch."""
    names: dict[str, Any] = {}
    exec(pair_source(), names)
    work = [*inputs, *[np.nan] * PAIR_RESULTS]
    touches = names["pair"](0, work, parameters)
    assert work[:PAIR_INPUTS] == list(inputs)
    return work[PAIR_INPUTS:], touches


@given(
    st.tuples(*[st.floats(-0.4, 0.4)] * 9).filter(lambda x: np.linalg.norm(x[:3]) > 0.05),
    st.tuples(*[st.floats(-5.0, 5.0)] * 9),
)
def test_the_code_of_pairs_gives_the_numbers_of_the_law(places, motions) -> None:
    """For each pair of the table, apart and overlapping."""
    _, constants, parameters = pair_tables(PAIRS, LINKS, POINTS)
    vectors = [(x, y, z) for x, y, z in np.reshape((*places, *motions), (-1, 3)).tolist()]
    for row, pair in zip(constants.tolist(), PAIRS, strict=True):
        results, touches = evaluate_pair(parameters, (*places, *motions, *row[12:14]))
        force = capsule_force(
            LIMB_SURFACE,
            pair.reach,
            pair.capsules[0].radius - pair.capsules[1].radius,
            vectors[0],
            (vectors[1], vectors[2]),
            vectors[3],
            (vectors[4], vectors[5]),
            FLOATS,
        )
        expected = [
            *(
                force.normal * part
                for vector in (force.direction, force.first_arm, force.second_arm)
                for part in vector
            ),
            (force.normal - force.elastic) * force.rate,
            force.normal * force.friction_power,
        ]
        if force.depth > 0.0:
            scale = max(1.0, *map(abs, expected))
            assert results == pytest.approx(expected, abs=1e-12 * scale)
        else:
            assert expected == [0.0] * PAIR_RESULTS
            assert np.isnan(results).all()
        assert touches == (force.depth > 0.0)


def test_tables_of_pairs() -> None:
    rows, places, parameters = pair_tables(PAIRS, LINKS, POINTS)
    assert rows.tolist() == [[2, 4], [4, 2]]
    assert parameters.ndim == 1
    assert places[0, :3] == pytest.approx(np.array((0.1, 0.2, 0.3)) - POINTS[2])
    assert places[0, 6:9] == pytest.approx(np.array((0.0, 0.1, 0.0)) - POINTS[4])
    assert places[0, 3:6].tolist() == [0.0, 0.0, 0.2]
    assert places[0, 9:12].tolist() == [0.1, 0.0, 0.0]
    assert places[:, 12].tolist() == [0.11, 0.12]
    assert places[:, 13] == pytest.approx([0.02, -0.02])
    assert places[:, 14] == pytest.approx([0.11 + 0.3, 0.12 + 0.3])
