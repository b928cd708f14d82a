"""Draws a plate: its picture as SVG and PNG, its numbers as comma-separated values."""

import csv
from collections.abc import Iterator, Mapping
from dataclasses import replace
from io import StringIO

from plots.drawn_plate import DrawnPlate
from plots.plate import Plate
from plots.sheet import write_title
from plots.style import picture, styled
from springs.operations import Array


def draw(plate: Plate) -> DrawnPlate:
    """Draw a plate with its title above it; the same plate gives the same bytes."""
    with styled():
        write_title(plate.figure, plate.title)
    return DrawnPlate(
        name=plate.name,
        title=plate.title,
        caption=plate.caption,
        sign=plate.sign,
        # A number of numpy's would take numpy along wherever the claim is sent.
        claims=tuple(replace(claim, measured=float(claim.measured)) for claim in plate.claims),
        references=plate.references,
        svg=picture(plate.figure, "svg"),
        png=picture(plate.figure, "png"),
        tables={
            file_name: table_text(plate, table)
            for file_name, table in zip(_file_names(plate), plate.tables, strict=True)
        },
    )


def table_text(plate: Plate, table: str) -> str:
    """One table of a plate as text.

    Three lines of comment (title, sign convention, references), then the headers, then the rows, in
    nine digits.
    """
    stream = StringIO()
    of_several = f": {table}" if len(plate.tables) > 1 else ""
    for comment in (
        f"{plate.title}{of_several}",
        plate.sign,
        f"References: {'; '.join(plate.references) or 'none'}",
    ):
        stream.write(f"# {' '.join(comment.split())}\n")
    columns = plate.tables[table]
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(_rows(columns))
    return stream.getvalue()


def _rows(columns: Mapping[str, Array]) -> Iterator[list[str]]:
    for values in zip(*columns.values(), strict=True):
        yield [f"{float(value):.9g}" for value in values]


def _file_names(plate: Plate) -> list[str]:
    if len(plate.tables) == 1:
        return [f"{plate.name}.csv"]
    return [f"{plate.name}.{table}.csv" for table in plate.tables]
