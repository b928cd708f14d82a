"""Links of joints in a file, `NAME.links.toml`: one `[[link]]` for each control.

The unit of an offset is part of its key. `generator.kinematics.links`
binds the names and numbers to a figure.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from generator.diagnostics import Diagnostics, Source, Span
from generator.file_kind import FileKind
from generator.toml_file.reader import TableReader, parse_document
from generator.toml_file.rows import Flag, Names, Number, Row, TableRows, Text

MAX_LINK_FACTOR = 1e6
"""No joint follows another so much faster, and none so far from it [rad or m]."""

LINK_TABLE = "link"


class _Place(Row[int]):
    """A place of a degree of freedom, counted from 1 in the file and from 0 in an entry."""

    def read(self, table: TableReader) -> int | None:
        value = table.content.get(self.key)
        if value is None or (type(value) is int and value >= 1):
            return None if value is None else value - 1
        hint = "degrees of freedom are counted from 1, in the order of the joint's `type`"
        table.error(self.key, f"`{self.key}` is a whole number above zero", hint)
        return None

    def value_to_toml(self, value: int) -> str:
        return str(value + 1)


FILE_ROWS = TableRows("links file", (Text("figure"),), (LINK_TABLE,))
_PLACES = (_Place("dof"), _Place("control_dof"))
_FACTOR = Number("factor", -MAX_LINK_FACTOR, MAX_LINK_FACTOR)
_OFFSETS = tuple(
    Number(f"offset_{unit}", -MAX_LINK_FACTOR, MAX_LINK_FACTOR, f" {si}", attribute=name)
    for unit, si, name in (("deg", "rad", "offset_of_angle"), ("m", "m", "offset_of_length"))
)
LINK_ROWS = TableRows(
    LINK_TABLE,
    (
        Names("joints", example='["right_elbow"]'),
        Text("control", example='"left_elbow"'),
        *_PLACES,
        _FACTOR,
        Flag("mirror"),
        *_OFFSETS,
        Text("why"),
    ),
)


@dataclass(frozen=True)
class LinkEntry:
    """A `[[link]]` table, in SI.

    Attributes:
        joints: the joints that follow.
        control: the joint that they follow.
        dof: place of the degree of freedom that follows, from 0; None for all, or the only one.
        control_dof: the same of the one that is followed.
        factor: factor of the control's displacement.
        mirror: whether signs are chosen so that the joints move as the control's mirror image.
        offset: added to the displacement [rad or m].
        offset_is_length: whether the offset was given in m.
        why: why the joints are linked.
        origins: places of the keys' values; "link" is the table, "joints.0" the first joint.
    """

    joints: tuple[str, ...]
    control: str
    dof: int | None = None
    control_dof: int | None = None
    factor: float = 1.0
    mirror: bool = False
    offset: float = 0.0
    offset_is_length: bool = False
    why: str = ""
    origins: Mapping[str, Span] = field(default_factory=dict[str, Span], compare=False, repr=False)

    def span(self, key: str) -> Span | None:
        """Span of the value of a key, or else of the table."""
        return self.origins.get(key) or self.origins.get(LINK_TABLE)


@dataclass(frozen=True)
class LinksFile:
    """Contents of a links file: the figure it was written for, and the links."""

    entries: tuple[LinkEntry, ...]
    figure: str | None = None
    origins: Mapping[str, Span] = field(default_factory=dict[str, Span], compare=False, repr=False)


def _parse_links(source: Source, diagnostics: Diagnostics) -> LinksFile | None:
    top = parse_document(source, FILE_ROWS.noun, diagnostics)
    if top is None:
        return None
    FILE_ROWS.check_keys(top)
    tables = top.tables(LINK_TABLE, "links")
    if top.content.get(LINK_TABLE, []) == []:
        place, hint = top.spans.table(""), "write `[[link]]`"
        diagnostics.error("this file has no link", place, hint)
    read = [_parse_entry(table) for table in tables]
    entries = tuple(entry for entry in read if entry)
    origins = {key: top.span(key) for key in top.content}
    return LinksFile(entries, **FILE_ROWS.read(top), origins=origins)


LINK_ENTRIES = FileKind("links", ".links.toml", _parse_links)
"""The links as they are written, without a figure; `generator.kinematics.links` binds them."""


def _parse_entry(table: TableReader) -> LinkEntry | None:
    """One `[[link]]`; None, with an error reported, if it says nothing that can be used."""
    content = table.content
    LINK_ROWS.check_keys(table)
    values: dict[str, Any] = LINK_ROWS.read(table)
    if values.get("factor") == 0.0:
        hint = "a joint that keeps still needs no link"
        table.error("factor", "a factor of zero links nothing", hint)
    offsets = [row.key for row in _OFFSETS if row.key in content]
    if len(offsets) > 1:
        table.error(offsets[1], "a link has one offset", " or ".join(offsets))
    if values.get("mirror"):
        for key in (*(row.key for row in _PLACES), *offsets):
            if key in content:
                hint = "it chooses the signs of a whole joint"
                table.error(key, f"`{key}` has no meaning beside `mirror`", hint)
    unclear = any(row.key in content and row.key not in values for row in _PLACES)
    if "joints" not in values or "control" not in values or unclear:
        return None
    angle, length = (values.pop(row.attributes[0], None) for row in _OFFSETS)
    origins = {key: table.span(key) for key in content} | {LINK_TABLE: table.header_span}
    origins |= {f"joints.{k}": table.span("joints", k) for k in range(len(values["joints"]))}
    is_length = offsets == ["offset_m"]
    offset = (length if is_length else angle) or 0.0
    return LinkEntry(**values, offset=offset, offset_is_length=is_length, origins=origins)
