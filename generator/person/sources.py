"""Sources of a person's numbers: files of published ones, and the rows of the provenance report.

A file `data/*.toml` is one publication. Its head is that of a published table of springs
(`reference`, `sureness`, `doi`, `place`, `note`), the rest its numbers as printed, whose units end
their keys.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cache
from importlib.resources import files
from typing import Any

from springs.published.parse import parse_reference
from springs.published.reference import Reference
from springs.short_repr import short_repr


@dataclass(frozen=True)
class DataFile:
    """A file of published numbers.

    Attributes:
        reference: the publication.
        note: note on the sample, and on how the numbers were checked.
        content: its tables and keys.
    """

    reference: Reference
    note: str
    content: Mapping[str, Any]


@cache
def load_data_file(name: str) -> DataFile:
    """Return the file `data/NAME.toml`."""
    path = files("generator").joinpath("person", "data", f"{name}.toml")
    content = tomllib.loads(path.read_text(encoding="utf-8"))
    return DataFile(parse_reference(content), content["note"].strip(), content)


class Origin(Enum):
    """Origin of a number of a person."""

    STATED = "stated"
    """The user states stature, mass, or a measured dimension."""

    PUBLISHED = "published"
    """Taken or computed from published numbers by a published rule."""

    SCALED = "scaled"
    """A published number of another body, scaled by a rule that was not measured for it."""

    ESTIMATE = "estimate"
    """No published number was found."""


@short_repr
@dataclass(frozen=True)
class SourcedNumber:
    """One number of a person.

    Attributes:
        part: segment, joint or "person".
        quantity: quantity in words ("mass", "length", "viscous damping of flexion").
        value: value in `unit`.
        unit: unit of the value ("kg", "m", "kg m2", "N m s/rad"), or "" without one.
        origin: origin of the value.
        reference: its publication; None for a number of the user or an estimate.
        rule: how the value follows from the reference, or why the estimate is as it is.
    """

    part: str
    quantity: str
    value: float
    unit: str
    origin: Origin
    reference: Reference | None = None
    rule: str = ""
