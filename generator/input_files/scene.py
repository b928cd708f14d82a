"""Scenes in files, `NAME.scene.toml`: planes and boxes that a figure may touch (`docs/contact.md`).

A `[[plane]]` or a `[[box]]` is a prop; it names its `[[surface]]`. The unit of a number is part of
its key.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, cast

from generator.diagnostics import (
    Diagnostics,
    Source,
    Span,
    select_errors,
    shorten,
    spelling_hint,
)
from generator.file_kind import FileKind
from generator.scene import Box, Plane, Prop, Scene, Shape, Vector
from generator.toml_file.reader import TableReader, parse_document
from generator.toml_file.rows import Number, TableRows, Text, Vector3
from generator.toml_file.spans import TomlSpans, locate_keys
from generator.toml_file.writer import quote_long_toml
from generator.units import INPUT_BOUNDS, Dimension
from springs.contact import DEFAULT_SURFACE, Surface

MAX_LENGTH = 1e3
"""Largest coordinate and length in a scene [m]."""

MAX_FRICTION = 10.0
"""Largest coefficient of friction of a surface."""

MAX_NAME_LENGTH = 40

SURFACE_TABLE, PLANE_TABLE, BOX_TABLE = "surface", "plane", "box"
SCENE_KEYS = (SURFACE_TABLE, PLANE_TABLE, BOX_TABLE)


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
}
"""Numbers of a surface, by attribute."""

_AT_MOST = f"at most {MAX_LENGTH:g} m"
_NAME, _SURFACE = Text("name", example='"seat"'), Text("surface", example='"wood"')
_POINT = Vector3("point_m", MAX_LENGTH, _AT_MOST, "coordinate")
_NORMAL = Vector3("normal", example="[0, 1, 0]")
_CENTRE = Vector3("centre_m", MAX_LENGTH, _AT_MOST, "coordinate", example="[0, 0.2, -0.3]")
_SIZE = Vector3(
    "size_m",
    MAX_LENGTH,
    _AT_MOST,
    "length",
    ("a length of a box must be above zero", "in m, along its x, y, z"),
    example="[0.5, 0.4, 0.4]",
)
_ANGLE_BOUND = INPUT_BOUNDS[Dimension.ANGLE]
_ANGLES = Vector3("angles_deg", _ANGLE_BOUND.max_abs, str(_ANGLE_BOUND), "angle")

SCENE_TABLES: Mapping[str, TableRows] = {
    SURFACE_TABLE: TableRows(SURFACE_TABLE, (_NAME, *_NUMBERS.values(), Text("source"))),
    PLANE_TABLE: TableRows(PLANE_TABLE, (_NAME, _POINT, _NORMAL, _SURFACE)),
    BOX_TABLE: TableRows(BOX_TABLE, (_NAME, _CENTRE, _SIZE, _ANGLES, _SURFACE)),
}

_FILE_KIND = "scene file"
_ORIGIN: Vector = (0.0, 0.0, 0.0)
_DEFAULTS = Surface()
_SELDOM_WRITTEN = ("transition_depth", "friction_speed")
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
    top.reject_unknown_keys(SCENE_KEYS, _FILE_KIND)
    surface_tables = _table_readers(top, SURFACE_TABLE)
    tables = [*_table_readers(top, PLANE_TABLE), *_table_readers(top, BOX_TABLE)]
    # Planes and boxes may alternate in the text; `tomllib` returns those of each kind together.
    tables.sort(key=lambda table: table.header_span.start)
    if not document.keys() & {PLANE_TABLE, BOX_TABLE} or not (tables or diagnostics.has_errors):
        hint = f"write `[[{PLANE_TABLE}]]` or `[[{BOX_TABLE}]]`"
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
        plural = {SURFACE_TABLE: "surfaces", PLANE_TABLE: "planes", BOX_TABLE: "boxes"}[name]
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
    """One `[[plane]]` or `[[box]]`; None, with an error noted, if it is wrong."""
    shape = _parse_plane(table) if table.name == PLANE_TABLE else _parse_box(table)
    surface = _SURFACE.read(table)
    if surface is not None and surface not in surfaces:
        write = f'write `[[{SURFACE_TABLE}]]` and `name = "{shorten(surface)}"` below it'
        hint = spelling_hint(surface, surfaces) or write
        table.error("surface", f"there is no surface `{shorten(surface)}`", hint)
        return None
    return Prop(name, shape, surfaces[surface]) if name and shape and surface else None


def _parse_plane(table: TableReader) -> Plane | None:
    point = _POINT.read(table) if _POINT.key in table.content else _ORIGIN
    normal = _NORMAL.read(table)
    if normal is not None and not any(normal):
        table.error("normal", "the normal of a plane must not be zero", "up is [0, 1, 0]")
        normal = None
    return None if point is None or normal is None else Plane(point, normal)


def _parse_box(table: TableReader) -> Box | None:
    centre, size = _CENTRE.read(table), _SIZE.read(table)
    angles = _ANGLES.read(table) if _ANGLES.key in table.content else _ORIGIN
    return None if centre is None or size is None or angles is None else Box(centre, size, angles)


def write_scene(scene: Scene, comment: str = "") -> str:
    """Return the text of a scene file; reading it returns an equal scene, bit for bit.

    A surface has the name of the first prop that has it.

    Args:
        scene: to write.
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
        table = PLANE_TABLE if isinstance(prop.shape, Plane) else BOX_TABLE
        lines += ["", f"[[{table}]]", _NAME.write(prop.name), *_shape_lines(prop.shape)]
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


def _shape_lines(shape: Shape) -> Iterator[str]:
    if isinstance(shape, Plane):
        yield from (_POINT.write(shape.point), _NORMAL.write(shape.normal))
        return
    yield from (_CENTRE.write(shape.centre), _SIZE.write(shape.size))
    if any(shape.angles):
        yield _ANGLES.write(shape.angles)
