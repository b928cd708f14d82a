"""Volumes that surfaces share, and densities of a person's segments."""

import numpy as np
import pytest

from generator.geometry.primitives import box, sphere
from generator.geometry.surface import Surface
from generator.geometry.validate import build_solid
from generator.person.densities import (
    DENSITY_REFERENCES,
    PUBLISHED_DENSITIES,
    SegmentDensity,
    segment_densities,
    shared_volumes,
)
from generator.person.measures import Sex, estimate_measures
from generator.person.person import build_person


def moved(surface: Surface, x: float, y: float = 0.0) -> Surface:
    pose = np.eye(4)
    pose[:2, 3] = x, y
    return surface.transformed(pose)


def test_volume_of_a_sphere() -> None:
    surface = sphere(0.1)
    found = shared_volumes([surface], spacing=0.003)
    assert found == pytest.approx([build_solid(surface).volume], rel=2e-3)


def test_volume_does_not_depend_on_the_place() -> None:
    volumes = [shared_volumes([moved(sphere(0.1), x, 0.3)])[0] for x in (0.0, 0.7013, -2.2)]
    assert volumes == pytest.approx([volumes[0]] * 3, rel=3e-3)


def test_what_two_share_counts_half_for_each() -> None:
    one, two = box(0.1, 0.1, 0.1), moved(box(0.1, 0.1, 0.1), 0.1)
    found = shared_volumes([one, two], spacing=0.004)
    assert found == pytest.approx([0.006, 0.006], rel=0.02)


def test_what_two_share_belongs_to_the_higher_rank() -> None:
    one, two = box(0.1, 0.1, 0.1), moved(box(0.1, 0.1, 0.1), 0.0, 0.1)
    found = shared_volumes([one, two], [0, 1], spacing=0.004)
    assert found == pytest.approx([0.004, 0.008], rel=0.02)


def test_a_void_is_not_counted() -> None:
    outer, inner = box(0.1, 0.1, 0.1), box(0.05, 0.05, 0.05)
    inverse = inner.with_flipped_faces(np.ones(inner.face_count, dtype=bool))
    shell = Surface.from_faces(
        np.concatenate([outer.vertices, inverse.vertices]),
        [*outer.faces, *(tuple(8 + k for k in face) for face in inverse.faces)],
    )
    assert shared_volumes([shell], spacing=0.004) == pytest.approx([0.007], rel=0.02)


@pytest.mark.parametrize(
    ("sex", "stature", "mass"), [(Sex.MALE, 1.756, 85.5), (Sex.FEMALE, 1.628, 67.8)]
)
def test_densities_of_the_mean_bodies(sex: Sex, stature: float, mass: float) -> None:
    person = build_person(estimate_measures(sex, stature, mass), springs="none")
    *rows, whole = segment_densities(person)
    assert {row.name for row in rows} == PUBLISHED_DENSITIES.keys()
    assert all(row.published.keys() == DENSITY_REFERENCES.keys() for row in rows)
    counts = [1 if "torso" in row.name or row.name == "head" else 2 for row in rows]
    total = sum(count * row.volume for count, row in zip(counts, rows, strict=True))
    assert whole.volume == pytest.approx(total)
    assert 1000.0 < whole.density < 1060.0
    assert [row.fault for row in (*rows, whole) if row.fault] == []


@pytest.mark.parametrize("sex", Sex)
def test_a_heavy_person_has_a_head_of_published_density(sex: Sex) -> None:
    """With the shares of the table's body it would be 1595 kg/m3, and the man's foot 1922."""
    person = build_person(estimate_measures(sex, 1.60, 120.0), springs="none")
    found = {row.name: row for row in segment_densities(person)}
    assert found["head"].excess == 0.0
    assert found["foot"].fault is not None
    if sex is Sex.MALE:
        assert found["foot"].density < 1480.0
        assert [name for name, row in found.items() if row.fault] == ["foot"]


def test_a_density_beyond_the_published_ones_is_a_fault() -> None:
    published = {"one": 1000.0, "other": 1100.0}
    excesses = {
        density: SegmentDensity("left_hand", density, 1.0, published).excess
        for density in (600.0, 900.0, 1050.0, 1210.0, 1650.0)
    }
    assert list(excesses.values()) == pytest.approx([-0.4, -0.1, 0.0, 0.1, 0.5])
    faults = [SegmentDensity("hand", d, 1.0, published).fault for d in excesses]
    assert [bool(fault) for fault in faults] == [True, False, False, False, True]
    assert faults[-1] is not None
    assert faults[-1].startswith("the hand has 1650 kg/m3, 50% above the published densities")
    assert SegmentDensity("body", 600.0, 1.0, {}).fault is None
