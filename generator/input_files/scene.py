"""Scenes in files, `NAME.scene.toml`: planes and boxes that a figure may touch (`docs/contact.md`).

A `[[plane]]` or a `[[box]]` is a prop; it names its `[[surface]]`. The unit of a number is part of
its key.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from generator.diagnostics import (
    Diagnostics,
    Source,
    Span,
    closest_match,
    select_errors,
    shorten,
    spelling_hint,
)
from generator.file_kind import FileKind
from generator.scene import Box, Plane, Prop, Scene, Shape, Vector
from generator.toml_file.reader import TableReader, parse_document
from generator.toml_file.spans import TomlSpans, locate_keys
from generator.toml_file.writer import (
    degrees_to_toml,
    number_to_toml,
    numbers_to_toml,
    quote_long_toml,
    quote_toml,
)
from generator.units import INPUT_BOUNDS, Dimension
from springs.contact import DEFAULT_SURFACE, Surface

MAX_LENGTH = 1e3
"""Largest coordinate and length in a scene [m]."""

MAX_FRICTION = 10.0
"""Largest coefficient of friction of a surface."""

MAX_NAME_LENGTH = 40

SURFACE_TABLE, PLANE_TABLE, BOX_TABLE = "surface", "plane", "box"
SCENE_KEYS = (SURFACE_TABLE, PLANE_TABLE, BOX_TABLE)


@dataclass(frozen=True)
class _SurfaceNumber:
    """A number of a surface: its attribute there, its range, and a hint for other values."""

    attribute: str
    least: float
    largest: float
    unit: str
    hint: str


_SURFACE_NUMBERS: Mapping[str, _SurfaceNumber] = {
    "stiffness_N_m": _SurfaceNumber(
        "stiffness", 1.0, 1e9, " N/m", "of each contact sphere; flesh on a hard floor: 3e4"
    ),
    "damping_s_m": _SurfaceNumber(
        "damping", 0.0, 1e3, " s/m", "0: an elastic impact; 1: the default"
    ),
    "friction": _SurfaceNumber("friction", 0.0, MAX_FRICTION, "", "the coefficient of friction"),
    "transition_m": _SurfaceNumber(
        "transition_depth", 1e-6, 1.0, " m", "the depth over which the stiffness grows"
    ),
    "friction_speed_m_s": _SurfaceNumber(
        "friction_speed", 1e-6, 10.0, " m/s", "below it friction is smaller; the default is 0.02"
    ),
}
SURFACE_KEYS = ("name", *_SURFACE_NUMBERS, "source")
PLANE_KEYS = ("name", "point_m", "normal", "surface")
BOX_KEYS = ("name", "centre_m", "size_m", "angles_deg", "surface")

_EXAMPLES: Mapping[str, str] = {
    "name": '"seat"',
    "surface": '"wood"',
    "normal": "[0, 1, 0]",
    "centre_m": "[0, 0.2, -0.3]",
    "size_m": "[0.5, 0.4, 0.4]",
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
    return [
        TableReader(table, name, index, top.spans, top.diagnostics)
        for index, table in enumerate(cast("list[Mapping[str, Any]]", tables))
    ]


def _parse_names(tables: list[TableReader], noun: str) -> list[str | None]:
    """Names of surfaces, or of props; None, with an error noted, for one that is wrong."""
    names: list[str | None] = []
    first: dict[str, Span] = {}
    for table in tables:
        name = table.text("name") if _require_key(table, "name") else None
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


def _require_key(table: TableReader, key: str) -> bool:
    """Return whether a key is there; note an error if not, and no unknown key is a slip of it."""
    known = {SURFACE_TABLE: SURFACE_KEYS, PLANE_TABLE: PLANE_KEYS, BOX_TABLE: BOX_KEYS}[table.name]
    if key in table.content:
        return True
    if key not in (closest_match(other, known) for other in table.content if other not in known):
        message, hint = f"this {table.name} has no `{key}`", f"write `{key} = {_EXAMPLES[key]}`"
        table.diagnostics.error(message, table.header_span, hint)
    return False


def _parse_surface(table: TableReader) -> Surface:
    """One `[[surface]]`; what is wrong there has its default."""
    table.reject_unknown_keys(SURFACE_KEYS, SURFACE_TABLE)
    source = table.text("source")
    numbers: dict[str, float] = {}
    for key, row in _SURFACE_NUMBERS.items():
        value = table.number(key)
        if value is None:
            continue
        if row.least <= value <= row.largest:
            numbers[row.attribute] = value
            continue
        ends = f"from {row.least:g} to {row.largest:g}{row.unit}"
        table.error(key, f"`{key}` must be {ends}, not {value:g}", row.hint)
    if source is None:
        if not table.content.keys() & _SURFACE_NUMBERS.keys():
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
    is_plane = table.name == PLANE_TABLE
    table.reject_unknown_keys(PLANE_KEYS if is_plane else BOX_KEYS, table.name)
    shape = _parse_plane(table) if is_plane else _parse_box(table)
    surface = table.text("surface") if _require_key(table, "surface") else None
    if surface is not None and surface not in surfaces:
        write = f'write `[[{SURFACE_TABLE}]]` and `name = "{shorten(surface)}"` below it'
        hint = spelling_hint(surface, surfaces) or write
        table.error("surface", f"there is no surface `{shorten(surface)}`", hint)
        return None
    return Prop(name, shape, surfaces[surface]) if name and shape and surface else None


def _parse_plane(table: TableReader) -> Plane | None:
    point = _parse_lengths(table, "point_m") if "point_m" in table.content else _ORIGIN
    normal = table.numbers("normal", 3) if _require_key(table, "normal") else None
    if normal is not None and not any(normal):
        table.error("normal", "the normal of a plane must not be zero", "up is [0, 1, 0]")
        normal = None
    return None if point is None or normal is None else Plane(point, cast("Vector", normal))


def _parse_box(table: TableReader) -> Box | None:
    centre, size = (
        _parse_lengths(table, key, is_size=key == "size_m") if _require_key(table, key) else None
        for key in ("centre_m", "size_m")
    )
    angles = table.numbers("angles_deg", 3) if "angles_deg" in table.content else _ORIGIN
    bound = INPUT_BOUNDS[Dimension.ANGLE]
    for k, angle in enumerate(angles or ()):
        if not bound.contains(angle):
            table.error("angles_deg", "this angle is too large", str(bound), k)
    if centre is None or size is None or angles is None:
        return None
    return Box(centre, size, cast("Vector", angles))


def _parse_lengths(table: TableReader, key: str, *, is_size: bool = False) -> Vector | None:
    """Three coordinates, or lengths of edges [m]; None, with an error noted, if they are wrong."""
    values, is_valid = table.numbers(key, 3), True
    for k, value in enumerate(values or ()):
        if is_size and value <= 0.0:
            table.error(key, "a length of a box must be above zero", "in m, along its x, y, z", k)
            is_valid = False
        elif abs(value) > MAX_LENGTH:
            noun = "length" if is_size else "coordinate"
            table.error(key, f"this {noun} is too large", f"at most {MAX_LENGTH:g} m", k)
            is_valid = False
    return cast("Vector", values) if values is not None and is_valid else None


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
        lines += ["", f"[[{table}]]", f"name = {quote_toml(prop.name)}", *_shape_lines(prop.shape)]
        surface_name = names[prop.surface, prop.surface.source]
        lines.append(f"surface = {quote_toml(surface_name)}")
    text = "\n".join([*lines, ""]).lstrip("\n")
    errors = select_errors(SCENE_FILE.parse_text(text).diagnostics)
    if errors:
        raise ValueError(f"a {_FILE_KIND} cannot hold this scene: {errors[0].message}")
    return text


def _surface_lines(name: str, surface: Surface) -> Iterator[str]:
    yield f"name = {quote_toml(name)}"
    for key, row in _SURFACE_NUMBERS.items():
        value = getattr(surface, row.attribute)
        if row.attribute not in _SELDOM_WRITTEN or value != getattr(_DEFAULTS, row.attribute):
            yield f"{key} = {number_to_toml(value)}"
    if surface.source:
        yield f"source = {quote_long_toml(surface.source)}"


def _shape_lines(shape: Shape) -> Iterator[str]:
    if isinstance(shape, Plane):
        yield f"point_m = {numbers_to_toml(shape.point)}"
        yield f"normal = {numbers_to_toml(shape.normal)}"
        return
    yield f"centre_m = {numbers_to_toml(shape.centre)}"
    yield f"size_m = {numbers_to_toml(shape.size)}"
    if any(shape.angles):
        yield f"angles_deg = {degrees_to_toml(shape.angles)}"
