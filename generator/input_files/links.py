"""Links of joints in a file, `NAME.links.toml`: one `[[link]]` for each control.

The unit of an offset is part of its key. `generator.kinematics.links`
binds the names and numbers to a figure.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite
from typing import Any, cast

from generator.diagnostics import Diagnostics, Source, Span
from generator.file_kind import FileKind
from generator.toml_file.reader import MAX_LINE_LENGTH, TableReader, parse_document
from generator.toml_file.spans import TomlSpans, locate_keys
from generator.units import parse_unit, shortest_decimal

MAX_LINK_FACTOR = 1e6
"""No joint follows another so much faster, and none so far from it [rad or m]."""

LINK_TABLE = "link"
LINKS_FILE_KEYS = ("figure", LINK_TABLE)
OFFSET_KEYS = ("offset_deg", "offset_m")
COORDINATE_KEYS = ("dof", "control_dof")
LINK_KEYS = ("joints", "control", *COORDINATE_KEYS, "factor", "mirror", *OFFSET_KEYS, "why")

_FILE_KIND = "links file"
_ZERO_FACTOR_HINT = "a joint that keeps still needs no link"
_NUMBERING_HINT = "degrees of freedom are counted from 1, in the order of the joint's `type`"


@dataclass(frozen=True)
class LinkEntry:
    """A `[[link]]` table, in SI.

    Attributes:
        joints: the joints that follow.
        control: the joint that they follow.
        dof: place of the degree of freedom that follows, from 0; None for all, or the only one.
        control_dof: the same of the one that is followed.
        factor: of the control's displacement.
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
    document = parse_document(source, _FILE_KIND, diagnostics)
    return None if document is None else _parse_content(document, locate_keys(source), diagnostics)


LINK_ENTRIES = FileKind("links", ".links.toml", _parse_links)
"""The links as they are written, without a figure; `generator.kinematics.links` binds them."""


def _parse_content(
    document: Mapping[str, Any], spans: TomlSpans, diagnostics: Diagnostics
) -> LinksFile:
    top = TableReader(document, "", 0, spans, diagnostics)
    top.reject_unknown_keys(LINKS_FILE_KEYS, _FILE_KIND)
    tables: Any = document.get(LINK_TABLE, [])
    if not isinstance(tables, list) or not all(isinstance(t, dict) for t in cast("Any", tables)):
        top.error(LINK_TABLE, "links are tables", "write `[[link]]` above each")
        tables = []
    elif not tables:
        diagnostics.error("there is no link in this file", spans.table(""), "write `[[link]]`")
    read = [
        _parse_entry(TableReader(table, LINK_TABLE, index, spans, diagnostics))
        for index, table in enumerate(cast("list[Mapping[str, Any]]", tables))
    ]
    origins = {key: top.span(key) for key in LINKS_FILE_KEYS if key in document}
    return LinksFile(tuple(entry for entry in read if entry), top.text("figure"), origins)


def _parse_entry(table: TableReader) -> LinkEntry | None:
    """One `[[link]]`; None, with an error reported, if it says nothing that can be used."""
    content = table.content
    table.reject_unknown_keys(LINK_KEYS, "link")
    joints = table.names("joints", '["right_elbow"]', "link")
    if "control" not in content:
        table.diagnostics.error(
            "this link has no `control`", table.header_span, 'as in "left_elbow"'
        )
    control = table.text("control")
    places = {key: _parse_coordinate_index(table, key) for key in COORDINATE_KEYS}
    mirror = _parse_flag(table, "mirror")
    factor = table.number("factor")
    if factor == 0.0:
        table.error("factor", "a factor of zero links nothing", _ZERO_FACTOR_HINT)
    elif factor is not None and abs(factor) > MAX_LINK_FACTOR:
        hint = f"from -{MAX_LINK_FACTOR:.0e} to {MAX_LINK_FACTOR:.0e}"
        table.error("factor", "no joint follows another by such a factor", hint)
    offsets = [key for key in OFFSET_KEYS if key in content]
    if len(offsets) > 1:
        table.error(offsets[1], "a link has one offset", " or ".join(OFFSET_KEYS))
    offset = table.number(offsets[0]) if offsets else None
    if offset is not None and abs(offset) > MAX_LINK_FACTOR:
        table.error(offsets[0], f"the offset is beyond {MAX_LINK_FACTOR:.0e} rad or m")
    if mirror:
        for key in (*COORDINATE_KEYS, *offsets):
            if key in content:
                hint = "it chooses the signs of a whole joint"
                table.error(key, f"`{key}` has no meaning beside `mirror`", hint)
    why = table.text("why") or ""
    unclear = any(key in content and place is None for key, place in places.items())
    if not joints or control is None or unclear:
        return None
    origins = {key: table.span(key) for key in content} | {LINK_TABLE: table.header_span}
    origins |= {f"joints.{k}": table.span("joints", k) for k in range(len(joints))}
    return LinkEntry(
        joints=joints,
        control=control,
        dof=places["dof"],
        control_dof=places["control_dof"],
        factor=1.0 if factor is None else factor,
        mirror=mirror,
        offset=offset or 0.0,
        offset_is_length=offsets == ["offset_m"],
        why=why,
        origins=origins,
    )


def _parse_coordinate_index(table: TableReader, key: str) -> int | None:
    """The place, from 0, of the degree of freedom that a key numbers from 1."""
    value = table.content.get(key)
    if value is None:
        return None
    if type(value) is int and value >= 1:
        return value - 1
    table.error(key, f"`{key}` is a whole number above zero", _NUMBERING_HINT)
    return None


def _parse_flag(table: TableReader, key: str) -> bool:
    value = table.content.get(key, False)
    if not isinstance(value, bool):
        table.error(key, f"`{key}` is true or false", "without quotes")
        return False
    return value


def write_links(content: LinksFile, comment: str = "") -> str:
    """The text of a links file; reading it gives the same links, to the last bit.

    Args:
        content: what the file says.
        comment: said above it, one line or several.

    Raises:
        ValueError: for what the file cannot say: a number that is not finite, a text longer than
            is read.
    """
    lines = [f"# {line}".rstrip() for line in comment.splitlines()]
    lines += [""] if lines else []
    if content.figure is not None:
        lines.append(f"figure = {_text(content.figure)}")
    for entry in content.entries:
        lines += [*([""] if lines and lines[-1] else []), f"[[{LINK_TABLE}]]", *_entry_text(entry)]
    if any(len(line) > MAX_LINE_LENGTH for line in lines):
        raise ValueError(f"a line of a links file has at most {MAX_LINE_LENGTH} characters")
    return "\n".join([*lines, ""])


def _entry_text(entry: LinkEntry) -> Iterator[str]:
    yield f"joints = [{', '.join(map(_text, entry.joints))}]"
    yield f"control = {_text(entry.control)}"
    if entry.dof is not None:
        yield f"dof = {entry.dof + 1}"
    if entry.control_dof is not None:
        yield f"control_dof = {entry.control_dof + 1}"
    yield f"factor = {_number(entry.factor, 'rad')}"
    if entry.mirror:
        yield "mirror = true"
    if entry.offset or entry.offset_is_length:
        unit = "m" if entry.offset_is_length else "deg"
        yield f"offset_{unit} = {_number(entry.offset, unit)}"
    if entry.why:
        yield f"why = {_text(entry.why)}"


def _number(value: float, unit: str) -> str:
    if not isfinite(value):
        raise ValueError(f"a links file holds finite numbers, not {value}")
    return shortest_decimal(value, parse_unit(unit).factor)


def _text(text: str) -> str:
    """A string in quotes, with the escapes that TOML shares with JSON."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
