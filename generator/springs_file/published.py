"""`published = "publication/name"`: a curve of the published tables as the law of an axis."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from math import degrees

from generator.diagnostics import shorten, spelling_hint
from generator.toml_file.reader import TableReader
from generator.toml_file.rows import Row
from generator.toml_file.writer import quote_toml
from springs.elastic import Elastic, valid_range
from springs.published.rows import PublishedCurve
from springs.published.tables import curve, publication, publications

PUBLISHED_KEY = "published"


@dataclass(frozen=True)
class PublishedLaw:
    """A published curve about an axis.

    Attributes:
        key: `publication/name`.
        sense: -1 where the axis's positive angle is opposite to the published motion.
    """

    key: str
    sense: int = 1

    @cached_property
    def row(self) -> PublishedCurve:
        """The curve as published."""
        return curve(self.key)

    @property
    def law(self) -> Elastic:
        """Torque on the child [N m] of the axis's angle [rad]."""
        return self.row.law if self.sense > 0 else self.row.law.mirrored()

    @property
    def why(self) -> str:
        """Note on the curve: held joints, measured range, and the note of its row."""
        fixed = [
            f"{name} at {degrees(angle):.4g} deg" for name, angle in self.row.held_angles.items()
        ]
        first = f"As published, with {' and '.join(fixed)}." if fixed else "As published."
        known, ends = self.row.valid_range, ""
        if known is not None and valid_range(self.row.law) is None:
            words = "Measured" if self.row.range_is_measured else "Usable"
            low, high = (f"{degrees(end):.4g}" for end in known)
            ends = f"{words} for its own angles from {low} deg to {high} deg."
        return " ".join(part for part in (first, ends, self.row.note.strip()) if part)

    def motion_name(self, joints: Iterable[str]) -> str:
        """Name of a positive angle of these joints: "flexion" for "knee flexion" at knees."""
        if self.sense < 0:
            return ""
        first, _, rest = self.row.motion.partition(" ")
        words = [joint.lower().split("_") for joint in joints]
        return rest if rest and all(first in each for each in words) else self.row.motion


@dataclass(frozen=True)
class PublishedKey(Row[str]):
    """Name of a row of the published tables, `publication/name`.

    Attributes:
        kind: Kind of the row, "curve" or "coupled law".
    """

    kind: str

    def read(self, table: TableReader) -> str | None:
        """Return the name."""
        row_key = table.text(self.key)
        if row_key is None:
            return None
        source, _, name = row_key.partition("/")
        known = publications()
        if source not in known:
            wanted = f"there is no published table `{shorten(source)}`"
            table.error(self.key, wanted, spelling_hint(source, known))
            return None
        tables = publication(source)
        rows = tables.curves if self.kind == "curve" else tables.coupled_laws
        if name in rows:
            return row_key
        missing = f"`{source}` has no {self.kind} `{shorten(name)}`"
        hint = spelling_hint(name, rows) if rows else f"it has no {self.kind} at all"
        if not name:
            missing = f"`{source}` is a table"
            if rows:
                hint = f"name one of its rows, as in `{source}/{next(iter(rows))}`"
        table.error(self.key, missing, hint)
        return None

    def value_to_toml(self, value: str) -> str:
        """Return it in quotes."""
        return quote_toml(value)
