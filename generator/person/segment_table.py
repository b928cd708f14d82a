"""Published table of the segments of a man and a woman: lengths, masses, centres, radii.

A segment may have several rows that differ by their end points. Fractions of a row hold for the
length between its own end points only.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from generator.named_mapping import UnknownNameError
from generator.person.measures import Sex
from springs.published.reference import Reference, Sureness


@dataclass(frozen=True)
class SegmentRow:
    """One segment between two end points.

    Attributes:
        segment: in the words of the table.
        ends: abbreviations of the end points.
        length: distance of the end points in the reference body [m].
        centre: of mass, as a fraction of the length from the first end point.
        radii: of gyration about the centre of mass, as fractions of the length, about the sagittal
            (antero-posterior), transverse (medio-lateral) and longitudinal axes.
        mass: as a fraction of the body's, in the first row of each segment.
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
        sex: of the sample.
        stature: of the reference body [m].
        mass: of the reference body [kg].
        rows: in the order of the publication.
        end_points: descriptions of the end points by their abbreviations.
        reference: of the publication.
    """

    sex: Sex
    stature: float
    mass: float
    rows: tuple[SegmentRow, ...]
    end_points: Mapping[str, str]
    reference: Reference

    def row(self, segment: str, *ends: str) -> SegmentRow:
        """Row of a segment between two end points. Raises UnknownNameError."""
        for row in self.rows:
            if row.segment == segment and row.ends == ends:
                return row
        raise UnknownNameError(f"the table has no segment `{segment}` from {' to '.join(ends)}")

    def mass_fraction(self, segment: str) -> float:
        """Mass of a segment as a fraction of the body's. Raises UnknownNameError."""
        for row in self.rows:
            if row.segment == segment and row.mass is not None:
                return row.mass
        raise UnknownNameError(f"the table has no mass of the segment `{segment}`")


@cache
def de_leva_table(sex: Sex) -> SegmentTable:
    """Table of de Leva 1996 (adjusted numbers of Zatsiorsky and Seluyanov)."""
    file = files("generator").joinpath("person", "data", "de_leva_1996.toml")
    return parse_segment_table(file.read_text(encoding="utf-8"), sex)


def parse_segment_table(text: str, sex: Sex) -> SegmentTable:
    """Parse the rows of one sex; the text is one of our own, so that its form is not checked."""
    document = tomllib.loads(text)
    body = document[sex.value]
    return SegmentTable(
        sex,
        body["stature_m"],
        body["mass_kg"],
        tuple(_parse_row(row, row[sex.value]) for row in document["segment"]),
        document["end_points"],
        Reference(
            document["reference"],
            Sureness(document["sureness"]),
            document["doi"],
            document["place"],
        ),
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
