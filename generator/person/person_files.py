"""The files of a person: figure, psurfs, springs, and a table of the sources of its numbers."""

import csv
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from textwrap import fill

from generator.contact_file.file import CONTACT_FILE, write_contact
from generator.losses import Loss, Losses
from generator.model_files.model_files import (
    ModelFiles,
    figure_files,
    older_springs_loss,
    springs_path,
)
from generator.person.body import side_names
from generator.person.contact_parts import person_contact
from generator.person.measures import Measures
from generator.person.passive_joints import springs_comment
from generator.person.person import Person
from generator.person.sources import SourcedNumber, load_data_file
from generator.springs_file.write import write_springs
from generator.text_io import format_csv_comment, format_csv_rows, is_file, load_text, read_csv_rows

RIENER_SPRINGS = "riener"
"""Name that chooses the springs with the law of hip and knee alone: `--springs riener`."""

SOURCES_SUFFIX = ".sources.csv"

_COMMENT_WIDTH = 98
"""Characters of a line of a comment."""

MADE_BY = "made by `mover person`"
"""End of the first line of the files; one that ends so may be replaced."""


def sources_path(path: Path) -> Path:
    """Return the path of the sources of the figure file at `path`."""
    return path.with_name(f"{path.stem}{SOURCES_SUFFIX}")


def springs_title(path: Path) -> str:
    """Return the first words in the springs of the figure file at `path`."""
    return f"Passive joints of {path.name}"


def contact_title(path: Path) -> str:
    """Return the first words in the parts of the figure file at `path`."""
    return f"Contact of the parts of {path.name}"


def person_files(person: Person, path: Path, *, has_parts: bool = True) -> ModelFiles:
    """Return the files of a person whose figure file is at `path`.

    The losses, if there are any, are that springs or parts of another figure are beside it.

    Args:
        person: The person.
        path: Path of the figure file.
        has_parts: Whether parts of the body touch props as wholes.
    """
    who = describe_measures(person.body.measures)
    beside = {sources_path(path): format_sources(person.sources, path.name)}
    for name, springs in (
        (None, person.springs_file),
        (RIENER_SPRINGS, person.riener_springs_file),
    ):
        if springs is not None:
            first = f"{springs_title(path)}, {who}, {MADE_BY}"
            comment = f"{first}\n\n{springs_comment()}"
            named = replace(springs, figure=path.stem)
            beside[springs_path(path, name)] = write_springs(named, comment)
    figure = person.figure
    if has_parts:
        first = f"{contact_title(path)}, {who}, {MADE_BY}"
        comment = f"{first}\n\n{fill(load_data_file('contact_parts').note, _COMMENT_WIDTH)}"
        figure, contact = person_contact(person.figure, person.surfaces)
        beside[CONTACT_FILE.beside(path)] = write_contact(contact, comment)
    files = figure_files(
        figure,
        path,
        person.surfaces,
        beside,
        surface_names={segment: name for name in person.surfaces for segment in side_names(name)},
        comment=f"A person, {who}, {MADE_BY}\nSources of the numbers: {sources_path(path).name}",
    )
    stale = [
        older_springs_loss(path) if person.springs_file is None else None,
        None if has_parts else _older_parts_loss(path),
    ]
    return ModelFiles(path, files, Losses.collect("figure", stale))


def _older_parts_loss(path: Path) -> Loss | None:
    """Return the loss that parts beside the figure file at `path` are not of this figure."""
    beside = CONTACT_FILE.beside(path)
    if not beside.exists():
        return None
    return Loss("an older contact file stands beside the figure: delete it", (str(beside),))


def describe_measures(measures: Measures) -> str:
    """Return sex, stature and mass in words: `male, 1.756 m, 85.5 kg`."""
    return f"{measures.sex.value}, {measures.stature:.6g} m, {measures.mass:.6g} kg"


def read_references(path: Path) -> dict[str, list[str]]:
    """Return the references in a table of sources, each with the quantities that are from it.

    Empty without such a file; those before the damage of a damaged one.
    """
    if not is_file(path):
        return {}
    lines = load_text(path, str(path))[0].text.splitlines()
    quantities: dict[str, list[str]] = {}
    with suppress(csv.Error):  # a quote without its end makes a field of the rest of the file
        for row in read_csv_rows(line for line in lines if not line.startswith("#"))[1]:
            reference, quantity = row.get("reference"), row.get("quantity")
            if reference and quantity and quantity not in quantities.setdefault(reference, []):
                quantities[reference].append(quantity)
    return quantities


_COLUMNS = ("part", "quantity", "value", "unit", "origin", "reference", "sureness", "rule")
"""Columns of the table of sources."""


def format_sources(numbers: Iterable[SourcedNumber], figure: str) -> str:
    """Return a table (CSV) with one row a number.

    Args:
        numbers: numbers of a person.
        figure: name of the figure file, for the header.
    """
    return format_csv_comment(f"figure {figure}") + format_csv_rows([_COLUMNS, *map(_row, numbers)])


def _row(number: SourcedNumber) -> tuple[str, ...]:
    source, reference, sureness = number.reference, "", ""
    if source is not None:
        doi = f"doi:{source.doi}" if source.doi else ""
        reference = "; ".join(part for part in (source.text, source.place, doi) if part)
        sureness = source.sureness.description
    return (
        number.part,
        number.quantity,
        repr(float(number.value)),
        number.unit,
        number.origin.value,
        reference,
        sureness,
        number.rule,
    )
