"""Tables that were measured elsewhere and are drawn here: `plots/data/NAME.csv`.

Plates that run nothing of their own draw these: other engines, and a machine's clock. The files
begin with comments that tell the command, the day, the machine and the versions.
"""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files

import numpy as np

from springs.operations import Array

Row = Mapping[str, str]


@dataclass(frozen=True)
class Measurements:
    """A table as it was written.

    Attributes:
        made_with: what the comments tell, by key.
        rows: by header; all cells as text.
    """

    made_with: Mapping[str, str]
    rows: Sequence[Row]

    def where(self, **cells: str) -> "Measurements":
        """The rows with these cells."""
        kept = [row for row in self.rows if all(row[key] == cells[key] for key in cells)]
        return Measurements(self.made_with, kept)

    def column(self, header: str) -> Array:
        """The numbers of a column, shape (rows,)."""
        return np.array([float(row[header]) for row in self.rows], dtype=float)

    def values(self, header: str) -> list[str]:
        """The different cells of a column, in order of appearance."""
        return list(dict.fromkeys(row[header] for row in self.rows))

    @property
    def origin(self) -> str:
        """When, on what, and by which command, in one sentence."""
        made = dict(self.made_with)
        day, machine, command = (made.pop(key) for key in ("measured", "machine", "command"))
        versions = ", ".join(f"{name} {version}" for name, version in made.items())
        return f"Measured on {day} by `{command}` on {machine}, with {versions}."


def measurements(name: str) -> Measurements:
    """Read `plots/data/NAME.csv`."""
    text = (files("plots") / "data" / f"{name}.csv").read_text(encoding="utf-8")
    lines = text.splitlines()
    comments = [line.removeprefix("# ") for line in lines if line.startswith("# ")]
    told = dict(comment.split(": ", 1) for comment in comments)
    return Measurements(told, list(csv.DictReader(lines[len(comments) :])))
