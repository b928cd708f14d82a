"""Scenes in files, `NAME.scene.toml`: props that a figure may touch (`docs/contact.md`).

A prop is a table with the name of its shape, as `[[box]]`; it names its `[[surface]]`. The unit of
a number is part of its key.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, cast

from generator.contact.scene import SHAPES, Prop, Scene
from generator.diagnostics import (
    Diagnostics,
    Source,
    Span,
    select_errors,
    shorten,
    spelling_hint,
)
from generator.file_kind import FileKind
from generator.run_options import MAX_FRICTION
from generator.toml_file.reader import TableReader, parse_document
from generator.toml_file.rows import Number, TableRows, Text
from generator.toml_file.spans import TomlSpans, locate_keys
from generator.toml_file.writer import quote_long_toml
from springs.contact import DEFAULT_SURFACE, Surface

MAX_NAME_LENGTH = 40

SURFACE_TABLE = "surface"

_NUMBERS: Mapping[str, Number] = {
    "stiffness": Number(
        "stiffness_N_m", 1.0, 1e9, " N/m", "of each contact sphere; flesh on a hard floor: 3e4"
    ),
    "damping": Number("damping_s_m", 0.0, 1e3, " s/m", "0: an elastic impact; 1: the default"),
    "friction": Number("friction", 0.0, MAX_FRICTION, "", "the coefficient of friction"),
    "transition_depth": Number(
        "transition_m", 1e-6, 1.0, " m", "the depth over which the stiffness grows"
    ),
    "friction_speed": Number(
        "friction_speed_m_s",
        1e-6,
        10.0,
        " m/s",
        "below it friction is smaller; the default is 0.02",
    ),
    "own_stiffness": Number(
        "own_stiffness_N_m",
        1.0,
        1e9,
        " N/m",
        "of what is below, in series with parts of the body; without it hard",
    ),
}
"""Numbers of a surface, by attribute."""

_NAME, _SURFACE = Text("name", example='"seat"'), Text("surface", example='"wood"')

_SHAPES = {shape.name: shape for shape in SHAPES}
"""Classes of shapes, by the name of their table."""

SCENE_TABLES: Mapping[str, TableRows] = {
    SURFACE_TABLE: TableRows(SURFACE_TABLE, (_NAME, *_NUMBERS.values(), Text("source"))),
    **{
        name: TableRows(name, (_NAME, *shape.rows.values(), _SURFACE))
        for name, shape in _SHAPES.items()
    },
}

_FILE_KIND = "scene file"
_DEFAULTS = Surface()
_SELDOM_WRITTEN = ("transition_depth", "friction_speed", "own_stiffness")
"""Numbers of a surface that are written where they differ from their defaults."""


def read_scene(path_or_name: str | Path) -> Scene:
    """The scene in a file or of a shipped name.

    Raises InputError with all diagnostics on any error. Warnings pass.
    """
    return SCENE_FILE.read(path_or_name)


def _parse_scene(source: Source, diagnostics: Diagnostics) -> Scene | None:
    document = parse_document(source, _FILE_KIND, diagnostics)
    return None if document is None else _parse_content(document, locate_keys(source), diagnostics)


SCENE_FILE = FileKind("scene", ".scene.toml", _parse_scene, is_shipped=True)


def _parse_content(
    document: Mapping[str, Any], spans: TomlSpans, diagnostics: Diagnostics
) -> Scene | None:
    top = TableReader(document, "", 0, spans, diagnostics)
    top.reject_unknown_keys(tuple(SCENE_TABLES), _FILE_KIND)
    surface_tables = _table_readers(top, SURFACE_TABLE)
    tables = [table for name in _SHAPES for table in _table_readers(top, name)]
    # Planes and boxes may alternate in the text; `tomllib` returns those of each kind together.
    tables.sort(key=lambda table: table.header_span.start)
    if not document.keys() & _SHAPES.keys() or not (tables or diagnostics.has_errors):
        hint = f"write {' or '.join(f'`[[{name}]]`' for name in _SHAPES)}"
        diagnostics.error("there is no prop in this file", spans.table(""), hint)
    surface_names = _parse_names(surface_tables, "surface")
    parsed = [_parse_surface(table) for table in surface_tables]
    surfaces = {name: one for name, one in zip(surface_names, parsed, strict=True) if name}
    props = [
        _parse_prop(table, name, surfaces)
        for table, name in zip(tables, _parse_names(tables, "prop"), strict=True)
    ]
    if diagnostics.has_errors:
        return None
    used = {table.content["surface"] for table in tables}
    for table, name in zip(surface_tables, surface_names, strict=True):
        if name not in used:
            diagnostics.warning(f"no prop has the surface `{name}`", table.span("name"))
    return Scene(tuple(prop for prop in props if prop))


def _table_readers(top: TableReader, name: str) -> list[TableReader]:
    """Return the readers of all tables of one kind."""
    tables: Any = top.content.get(name, [])
    if not isinstance(tables, list) or not all(isinstance(t, dict) for t in cast("Any", tables)):
        plural = name + ("es" if name.endswith("x") else "s")
        hint = f"write `[[{name}]]` above each"
        top.diagnostics.error(f"{plural} are tables", top.spans.table(name), hint)
        return []
    readers = [
        TableReader(table, name, index, top.spans, top.diagnostics)
        for index, table in enumerate(cast("list[Mapping[str, Any]]", tables))
    ]
    for reader in readers:
        SCENE_TABLES[name].check_keys(reader)
    return readers


def _parse_names(tables: list[TableReader], noun: str) -> list[str | None]:
    """Names of surfaces, or of props; None, with an error noted, for one that is wrong."""
    names: list[str | None] = []
    first: dict[str, Span] = {}
    for table in tables:
        name = _NAME.read(table)
        if name is not None and not (name.isprintable() and 0 < len(name) <= MAX_NAME_LENGTH):
            hint = f"1 to {MAX_NAME_LENGTH} characters that can be printed"
            table.error("name", f"this is not a name of a {noun}", hint)
            name = None
        elif name is not None and name in first:
            hint = f"the first is in line {first[name].line}"
            table.error("name", f"a second {noun} is called `{name}`", hint)
        elif name is not None:
            first[name] = table.span("name")
        names.append(name)
    return names


def _parse_surface(table: TableReader) -> Surface:
    """One `[[surface]]`; what is wrong there has its default."""
    source = table.text("source")
    numbers = {name: row.read(table) for name, row in _NUMBERS.items()}
    numbers = {name: value for name, value in numbers.items() if value is not None}
    if source is None:
        if not table.content.keys() & {row.key for row in _NUMBERS.values()}:
            return DEFAULT_SURFACE
        if "source" not in table.content:
            message, hint = (
                "this surface has no `source`",
                'write `source = "assumed"`, for example',
            )
            table.diagnostics.warning(message, table.header_span, hint)
    return Surface(**numbers, source=source or "")


def _parse_prop(
    table: TableReader, name: str | None, surfaces: Mapping[str, Surface]
) -> Prop | None:
    """One prop; None, with an error noted, if it is wrong."""
    shape = _SHAPES[table.name].read(table)
    surface = _SURFACE.read(table)
    if surface is not None and surface not in surfaces:
        write = f'write `[[{SURFACE_TABLE}]]` and `name = "{shorten(surface)}"` below it'
        hint = spelling_hint(surface, surfaces) or write
        table.error("surface", f"there is no surface `{shorten(surface)}`", hint)
        return None
    return Prop(name, shape, surfaces[surface]) if name and shape and surface else None


def write_scene(scene: Scene, comment: str = "") -> str:
    """Return the text of a scene file; reading it returns an equal scene, bit for bit.

    A surface has the name of the first prop that has it.

    Args:
        scene: scene to write.
        comment: one or more lines above it.

    Raises:
        ValueError: for what the reader refuses, such as a length beyond its bound.
    """
    names: dict[tuple[Surface, str], str] = {}
    for prop in scene.props:
        names.setdefault((prop.surface, prop.surface.source), prop.name)
    lines = [f"# {line}".rstrip() for line in comment.splitlines()]
    for (surface, _), name in names.items():
        lines += ["", f"[[{SURFACE_TABLE}]]", *_surface_lines(name, surface)]
    for prop in scene.props:
        lines += ["", f"[[{prop.shape.name}]]", _NAME.write(prop.name), *prop.shape.write()]
        surface_name = names[prop.surface, prop.surface.source]
        lines.append(_SURFACE.write(surface_name))
    text = "\n".join([*lines, ""]).lstrip("\n")
    errors = select_errors(SCENE_FILE.parse_text(text).diagnostics)
    if errors:
        raise ValueError(f"a {_FILE_KIND} cannot hold this scene: {errors[0].message}")
    return text


def _surface_lines(name: str, surface: Surface) -> Iterator[str]:
    yield _NAME.write(name)
    for attribute, row in _NUMBERS.items():
        value = getattr(surface, attribute)
        if attribute not in _SELDOM_WRITTEN or value != getattr(_DEFAULTS, attribute):
            yield row.write(value)
    if surface.source:
        yield f"source = {quote_long_toml(surface.source)}"
