"""Published table of the segments of a man and a woman: lengths, masses, centres, radii.

A segment may have several rows that differ by their end points. Fractions of a row hold for the
length between its own end points only.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from generator.person.sources import DataFile, load_data_file
from generator.person.survey import Sex
from springs.published.reference import Reference


@dataclass(frozen=True)
class SegmentRow:
    """One segment between two end points.

    Attributes:
        segment: segment in the words of the table.
        ends: abbreviations of the end points.
        length: distance of the end points in the reference body [m].
        centre: centre of mass, as a fraction of the length from the first end point.
        radii: radii of gyration about the centre of mass, as fractions of the length, about the
            sagittal (antero-posterior), transverse (medio-lateral) and longitudinal axes.
        mass: mass as a fraction of the body's, in the first row of each segment.
    """

    segment: str
    ends: tuple[str, str]
    length: float
    centre: float
    radii: tuple[float, float, float]
    mass: float | None = None


@dataclass(frozen=True)
class SegmentTable:
    """Segments of a reference body.

    Attributes:
        sex: sex of the sample.
        stature: stature of the reference body [m].
        mass: mass of the reference body [kg].
        rows: rows in the order of the publication.
        reference: reference of the publication.
    """

    sex: Sex
    stature: float
    mass: float
    rows: tuple[SegmentRow, ...]
    reference: Reference

    def row(self, segment: str, *ends: str) -> SegmentRow:
        """Return the row of a segment between two end points."""
        return next(row for row in self.rows if (row.segment, row.ends) == (segment, ends))

    def mass_fraction(self, segment: str) -> float:
        """Return the mass of a segment as a fraction of the body's."""
        masses = (row.mass for row in self.rows if row.segment == segment)
        return next(mass for mass in masses if mass is not None)


@cache
def de_leva_table(sex: Sex) -> SegmentTable:
    """Table of de Leva 1996 (adjusted numbers of Zatsiorsky and Seluyanov)."""
    return _parse_table(load_data_file("de_leva_1996"), sex)


def _parse_table(data: DataFile, sex: Sex) -> SegmentTable:
    """Parse the rows of one sex."""
    body = data.content[sex]
    return SegmentTable(
        sex,
        body["stature_m"],
        body["mass_kg"],
        tuple(_parse_row(row, row[sex]) for row in data.content["segment"]),
        data.reference,
    )


def _parse_row(row: Mapping[str, Any], numbers: Mapping[str, Any]) -> SegmentRow:
    first, second = row["ends"]
    sagittal, transverse, longitudinal = (radius / 100 for radius in numbers["radii_percent"])
    mass = numbers.get("mass_percent")
    return SegmentRow(
        segment=row["name"],
        ends=(first, second),
        length=numbers["length_mm"] / 1000,
        centre=numbers["centre_percent"] / 100,
        radii=(sagittal, transverse, longitudinal),
        mass=None if mass is None else mass / 100,
    )
