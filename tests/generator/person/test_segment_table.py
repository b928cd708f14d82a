"""The published table of segments agrees with itself and with the numbers it was derived from."""

from collections.abc import Iterator
from dataclasses import replace
from math import sqrt

import pytest

from generator.person.segment_table import SegmentRow, SegmentTable, de_leva_table
from generator.person.sources import load_data_file
from generator.person.survey import Sex

PAIRED = {"upper_arm", "forearm", "hand", "thigh", "shank", "foot"}

HALF_LENGTH, HALF_CENTRE, HALF_RADIUS = 0.05e-3, 0.005e-2, 0.05e-2
"""Half of the last printed digit: of lengths [m], of centres and radii as fractions."""

# Zatsiorsky, Kinetics of Human Motion, 2002, tables 4.4 and A2.5, as one code base has them:
# mass [kg], moments of inertia about the sagittal, transverse, longitudinal axes [kg cm2].
ZATSIORSKY = {
    Sex.MALE: {
        "foot": (0.997, 44, 40, 10.3),
        "shank": (3.16, 385, 371, 64.6),
        "thigh": (10.36, 1997.8, 1999.4, 413.4),
        "hand": (0.447, 13.2, 8.76, 5.37),
        "forearm": (1.177, 64.7, 60.2, 12.6),
        "upper_arm": (1.98, 127.3, 114.4, 38.95),
        "head": (5.018, 272.1, 293.9, 202.4),
        "upper_trunk": (11.654, 1725.6, 705.2, 1454.5),
        "middle_trunk": (11.953, 1280.8, 819.1, 1203.1),
        "lower_trunk": (8.164, 656.8, 525, 592.4),
    },
    Sex.FEMALE: {
        "foot": (0.88, 41.1, 35.6, 8.9),
        "shank": (3, 409.9, 399.7, 48.6),
        "thigh": (9.16, 1690.1, 1647.3, 324.2),
        "hand": (0.35, 6, 4.4, 2.4),
        "forearm": (0.86, 40.9, 39.7, 5.3),
        "upper_arm": (1.58, 92.3, 80.7, 26.2),
        "head": (4.2, 183.6, 216.5, 172.7),
        "upper_trunk": (9.58, 1082.8, 490.3, 1005),
        "middle_trunk": (9.08, 717.3, 480.2, 658.7),
        "lower_trunk": (7.73, 477.3, 411, 503),
    },
}


def list_faults(table: SegmentTable) -> list[str]:
    """List the numbers of a table that contradict others."""
    kinds = (_list_mass_faults, _list_end_point_faults, _list_trunk_faults, _list_radius_faults)
    return [fault for kind in kinds for fault in kind(table)]


def _list_mass_faults(table: SegmentTable) -> Iterator[str]:
    masses = {row.segment: row.mass for row in table.rows if row.mass is not None}
    trunk = masses.pop("trunk")
    total = sum(mass * (2 if name in PAIRED else 1) for name, mass in masses.items())
    if abs(total - {Sex.MALE: 1.0, Sex.FEMALE: 0.9999}[table.sex]) > 1e-9:
        yield f"masses sum to {total}"
    parts = sum(masses[name] for name in ("upper_trunk", "middle_trunk", "lower_trunk"))
    if abs(parts - trunk) > 1e-9:
        yield f"parts of the trunk sum to {parts}"


def _list_end_point_faults(table: SegmentTable) -> Iterator[str]:
    """Compare rows of one segment: centre and radii in metres do not depend on the end points."""
    for name in {row.segment for row in table.rows}:
        rows = [row for row in table.rows if row.segment == name]
        places = dict(zip(rows[0].ends, (0.0, rows[0].length), strict=True))
        centre = rows[0].centre * rows[0].length
        for row in rows[1:]:
            first, second = row.ends
            start = places[first] if first in places else places[second] - row.length
            places.setdefault(first, start)
            end = places.setdefault(second, start + row.length)
            margin = 3 * HALF_LENGTH + HALF_CENTRE * (row.length + rows[0].length)
            if abs(end - start - row.length) > 3 * HALF_LENGTH:
                yield f"{name} {row.ends}: length"
            if abs(start + row.centre * row.length - centre) > margin:
                yield f"{name} {row.ends}: centre"
            for index in range(3):
                lengths = [radius_of_gyration(one, index) for one in (row, rows[0])]
                margin = sum(
                    HALF_RADIUS * one.length + HALF_LENGTH * one.radii[index]
                    for one in (row, rows[0])
                )
                if abs(lengths[0] - lengths[1]) > margin:
                    yield f"{name} {row.ends}: radius {index}"


def _list_trunk_faults(table: SegmentTable) -> Iterator[str]:
    """Compare the trunk with its three parts by the parallel axis theorem."""
    names = ("lower_trunk", "middle_trunk", "upper_trunk")
    rows = [next(row for row in table.rows if row.segment == name) for name in names]
    masses = [table.mass_fraction(name) for name in names]
    trunk = next(row for row in table.rows if row.segment == "trunk")
    below, centres = 0.0, list[float]()
    for row in rows:
        centres.append(below + (1 - row.centre) * row.length)
        below += row.length
    if abs(below - trunk.length) > 1e-9:
        yield "parts of the trunk: length"
    centre = sum(m * c for m, c in zip(masses, centres, strict=True)) / sum(masses)
    # 2.9 mm in men, 0.01 mm in women: the numbers of the publication.
    if abs(centre - (1 - trunk.centre) * trunk.length) > 3e-3:
        yield "parts of the trunk: centre"
    for index in range(3):
        moment = sum(
            m * (radius_of_gyration(row, index) ** 2 + (c - centre) ** 2 * (index != 2))
            for row, m, c in zip(rows, masses, centres, strict=True)
        )
        radius = sqrt(moment / sum(masses))
        if abs(radius - radius_of_gyration(trunk, index)) > HALF_RADIUS * trunk.length:
            yield f"parts of the trunk: radius {index}"


def _list_radius_faults(table: SegmentTable) -> Iterator[str]:
    """Compare the radii of gyration with those of the means that the table was derived from."""
    for name, (mass, *moments) in ZATSIORSKY[table.sex].items():
        for row in (row for row in table.rows if row.segment == name):
            for index, moment in enumerate(moments):
                radius = sqrt(moment * 1e-4 / mass)
                margin = 0.01 * radius + HALF_RADIUS * row.length
                if abs(radius_of_gyration(row, index) - radius) > margin:
                    yield f"{name} {row.ends}: radius {index} of the sample"


def radius_of_gyration(row: SegmentRow, index: int) -> float:
    """Radius of gyration [m]."""
    return row.radii[index] * row.length


def change_row(
    table: SegmentTable, segment: str, ends: tuple[str, str], **changes: float
) -> SegmentTable:
    """Return a table with a changed row; a radius is changed by its name."""
    rows = list(table.rows)
    index = rows.index(table.row(segment, *ends))
    radii = list(rows[index].radii)
    for place, axis in enumerate(("sagittal", "transverse", "longitudinal")):
        radii[place] = changes.pop(axis, radii[place])
    sagittal, transverse, longitudinal = radii
    rows[index] = replace(rows[index], radii=(sagittal, transverse, longitudinal), **changes)
    return replace(table, rows=tuple(rows))


@pytest.mark.parametrize("sex", Sex)
def test_the_table_agrees_with_itself_and_with_the_means_of_the_sample(sex: Sex):
    table = de_leva_table(sex)
    assert list_faults(table) == []
    assert len(table.rows) == 21
    end_points = load_data_file("de_leva_1996").content["end_points"]
    assert {end for row in table.rows for end in row.ends} == set(end_points)


# Numbers that public code has wrongly.
SLIPS = {
    "shank of women 9 mm short": (Sex.FEMALE, "shank", "KJC-LMAL", {"length": 0.4233}),
    "thorax of men 36.5 for 46.5": (
        *(Sex.MALE, "upper_trunk", "CERV-XYPH"),
        {"longitudinal": 0.365},
    ),
    "hand of men a tenth": (Sex.MALE, "hand", "WJC-DAC3", {"longitudinal": 0.0184}),
    "hand of women 63.1 for 53.1": (Sex.FEMALE, "hand", "WJC-MET3", {"sagittal": 0.631}),
    "hand of women as of men": (Sex.FEMALE, "hand", "WJC-DAC3", {"longitudinal": 0.184}),
    "foot of women as of men": (Sex.FEMALE, "foot", "HEEL-TTIP", {"longitudinal": 0.124}),
    "head of women 6.69 for 6.68": (Sex.FEMALE, "head", "VERT-MIDG", {"mass": 0.0669}),
    "head of men ten times": (Sex.MALE, "head", "VERT-MIDG", {"mass": 0.694}),
    "trunk of men 30.1": (Sex.MALE, "trunk", "SUPR-MIDH", {"mass": 0.301}),
    "shank to the ankle centre as to the malleolus": (
        *(Sex.MALE, "shank", "KJC-AJC"),
        {"length": 0.434},
    ),
    "trunk with the fraction of another length": (
        *(Sex.MALE, "trunk", "CERV-MIDH"),
        {"centre": 0.4486},
    ),
}


@pytest.mark.parametrize("slip", SLIPS.values(), ids=SLIPS.keys())
def test_a_slip_of_public_code_is_found(slip: tuple[Sex, str, str, dict[str, float]]):
    sex, segment, ends, changes = slip
    first, second = ends.split("-")
    changed = change_row(de_leva_table(sex), segment, (first, second), **changes)
    assert list_faults(changed) != []


@pytest.mark.parametrize("factor", [0.97, 1.03])
@pytest.mark.parametrize("sex", Sex)
def test_a_radius_that_is_3_percent_off_is_found(sex: Sex, factor: float):
    table = de_leva_table(sex)
    for row in table.rows:
        for index, axis in enumerate(("sagittal", "transverse", "longitudinal")):
            change = {axis: factor * row.radii[index]}
            assert list_faults(change_row(table, row.segment, row.ends, **change)) != [], row
