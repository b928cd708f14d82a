"""The table `[[reach]]` of a springs file: the directions of a limb, and its turn in each."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from generator.diagnostics import Severity, Span
from generator.springs_file.axes import AXIS_NAMES
from generator.springs_file.coupled import PROVENANCE_ROWS
from generator.toml_file.reader import Pair, TableReader
from generator.toml_file.rows import Choice, Integer, Names, NumberList, Row, TableRows
from generator.toml_file.writer import degrees_to_toml, list_to_toml
from springs import ReachPoint, TurnRange
from springs.short_repr import short_repr

LONG_AXES = (*AXIS_NAMES, *(f"-{name}" for name in AXIS_NAMES))
"""Names of a limb's own axis."""


@short_repr
@dataclass(frozen=True)
class ReachEntry:
    """A `[[reach]]` table, in SI; the attributes are those of `springs.Reach`.

    Attributes:
        joints: joints that have this reach.
        long_axis: limb's axis in the joint frame of the child, `z` or `-z`.
        planes: axes of the joint about which the limb is raised.
        centre: plane and elevation of the centre [rad].
        boundary: directions on the boundary.
        turns: ranges of the turn.
        harmonics: number of multiples of the azimuth.
        reference: where the points are from.
        why: why they are read as they are.
        origins: places of the keys' values; "reach" is the table, "joints.0" the first joint.
    """

    joints: tuple[str, ...]
    long_axis: str
    planes: tuple[str, ...]
    centre: Pair
    boundary: tuple[ReachPoint, ...]
    turns: tuple[TurnRange, ...] = ()
    harmonics: int = 4
    reference: str = ""
    why: str = ""
    origins: Mapping[str, Span] = field(default_factory=dict[str, Span], compare=False, repr=False)


class _Points(Row[tuple[ReachPoint, ...]]):
    """Directions, each by plane and elevation."""

    def read(self, table: TableReader) -> tuple[ReachPoint, ...] | None:
        pairs = table.pairs(self.key, 3, ("deg", "deg"))
        return tuple(ReachPoint(*pair) for pair in pairs) or None

    def value_to_toml(self, value: tuple[ReachPoint, ...]) -> str:
        return list_to_toml(degrees_to_toml((one.plane, one.elevation)) for one in value)


_TURN_WORDS = ("row", "four", "[[0, 0, -77, 69], [0, 90, -100, 55]]")


class _Turns(Row[tuple[TurnRange, ...]]):
    """Ranges of the turn, each with plane and elevation of its direction."""

    def read(self, table: TableReader) -> tuple[TurnRange, ...] | None:
        rows = table.number_lists(self.key, 6, ("deg",) * 4, _TURN_WORDS)
        for k, (_, _, lower, upper) in enumerate(rows):
            if lower >= upper:
                hint = "[plane, elevation, lowest, highest]"
                table.error(self.key, "the range of a turn ends before it begins", hint, k)
                return None
        return tuple(TurnRange(ReachPoint(a, b), low, high) for a, b, low, high in rows) or None

    def value_to_toml(self, value: tuple[TurnRange, ...]) -> str:
        return list_to_toml(
            degrees_to_toml((one.at.plane, one.at.elevation, one.lower, one.upper)) for one in value
        )


_CENTRE = NumberList[Pair]("centre_deg", example="[55, 70]", count=2, attribute="centre")

REACH_ROWS = TableRows(
    "reach",
    (
        Names("joints", example='["left_shoulder", "right_shoulder"]'),
        Choice("long_axis", LONG_AXES, example='"z"'),
        Names("planes", example='["x", "y"]'),
        _CENTRE,
        _Points("boundary_deg", example="[[0, 175], [90, 170], [180, 35]]", attribute="boundary"),
        _Turns("turns_deg", attribute="turns"),
        Integer("harmonics", 1, 12),
        *PROVENANCE_ROWS,
    ),
)


def parse_reach_entry(table: TableReader) -> ReachEntry | None:
    """Parse one `[[reach]]` table; None, with a fault noted, if it cannot be used."""
    before = len(table.diagnostics.entries)
    REACH_ROWS.check_keys(table)
    values = REACH_ROWS.read(table)
    planes: tuple[str, ...] = values.get("planes", ())
    if planes and (len(planes) != 2 or not set(planes) <= set(AXIS_NAMES)):
        hint = 'the axes of planes 0 and 90 deg, as in `["x", "y"]`'
        table.error("planes", "`planes` must be two of x, y and z", hint)
    if any(one.severity is Severity.ERROR for one in table.diagnostics.entries[before:]):
        return None
    origins = {key: table.span(key) for key in table.content} | {"reach": table.header_span}
    origins |= {f"joints.{k}": table.span("joints", k) for k in range(len(values["joints"]))}
    return ReachEntry(origins=origins, **values)
