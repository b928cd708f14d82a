"""Scenes in files, `NAME.scene.toml`: props, and covers of parts of the body (`docs/contact.md`).

A prop is a table with the name of its shape, as `[[box]]`; it names its `[[surface]]`. The unit of
a number is part of its key.
"""

from collections.abc import Iterator, Mapping
from math import inf
from pathlib import Path

from generator.contact.scene import SHAPES, Cover, Prop, Scene
from generator.diagnostics import Diagnostics, Source, Span, select_errors, shorten, spelling_hint
from generator.file_kind import FileKind
from generator.run_options import MAX_FRICTION
from generator.toml_file.reader import TableReader, parse_document
from generator.toml_file.rows import Number, Numbers, TableRows, Text
from generator.toml_file.writer import number_to_toml, quote_long_toml
from springs.contact import DEFAULT_SURFACE, Surface
from springs.layer import Layer

MAX_NAME_LENGTH = 40

SURFACE_TABLE = "surface"

SURFACE_NUMBERS: Mapping[str, Number] = {
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


class _StiffnessOfStages(Numbers):
    """Tangent stiffness of each stage; a single one may stand without brackets."""

    def read(self, table: TableReader) -> tuple[float, ...] | None:
        """Return the numbers [SI]."""
        if table.items(self.key) is not None:
            return super().read(table)
        value = Number(self.key, 1.0, self.largest, " N/m", self.hint).read(table)
        return None if value is None else (value,)

    def value_to_toml(self, value: tuple[float, ...]) -> str:
        """Return a list, or a single number."""
        return number_to_toml(value[0]) if len(value) == 1 else super().value_to_toml(value)


_FROM = "from_m"

_POSITIVE = "must be above zero", "the tangent stiffness from each depth on"

_NOT_BELOW = "must not be below zero", "the first stage begins at 0"


def _layer_rows(key: str, hint: str, example: str = "") -> tuple[Numbers, Numbers, Number]:
    """Return the rows of a layer: depths of its stages, their stiffness, and its thickness."""
    return (
        Numbers(_FROM, count=key, negative_error=_NOT_BELOW, largest=1.0, hint="at most 1 m"),
        _StiffnessOfStages(
            key,
            example=example,
            count=_FROM,
            positive_error=_POSITIVE,
            largest=1e9,
            hint=hint,
            noun="stiffness",
        ),
        Number("thickness_m", 1e-6, 1.0, " m", "the compression at which it is pressed through"),
    )


_BELOW = _layer_rows(
    "own_stiffness_N_m", "of what is below, in series with parts of the body; without it hard"
)
"""Rows of the layer below a surface."""

_COVER = _layer_rows("stiffness_N_m", "of the cover, in series with the part", "[30e3, 200e3]")
"""Rows of the layer over a part of the body."""

COVER_TABLE = "cover"

_PART = Text("part", example='"pelvis"')

_NAME, _SURFACE = Text("name", example='"seat"'), Text("surface", example='"wood"')

_SOURCE = Text("source", example='"assumed"')

_SHAPES = {shape.name: shape for shape in SHAPES}
"""Classes of shapes, by the name of their table."""

SCENE_TABLES: Mapping[str, TableRows] = {
    SURFACE_TABLE: TableRows(
        SURFACE_TABLE, (_NAME, *SURFACE_NUMBERS.values(), *_BELOW, Text("source"))
    ),
    COVER_TABLE: TableRows(COVER_TABLE, (_PART, *_COVER, _SOURCE)),
    **{
        name: TableRows(name, (_NAME, *shape.rows.values(), _SURFACE))
        for name, shape in _SHAPES.items()
    },
}

_FILE_KIND = "scene file"
_DEFAULTS = Surface()
_SELDOM_WRITTEN = ("transition_depth", "friction_speed")
"""Numbers of a surface that are written where they differ from their defaults."""


def read_scene(path_or_name: str | Path) -> Scene:
    """The scene in a file or of a shipped name.

    Raises InputError with all diagnostics on any error. Warnings pass.
    """
    return SCENE_FILE.read(path_or_name)


def _parse_scene(source: Source, diagnostics: Diagnostics) -> Scene | None:
    top = parse_document(source, _FILE_KIND, diagnostics)
    if top is None:
        return None
    top.reject_unknown_keys(tuple(SCENE_TABLES), _FILE_KIND)
    surface_tables = _table_readers(top, SURFACE_TABLE)
    covers = _parse_covers(_table_readers(top, COVER_TABLE), source.name)
    tables = [table for name in _SHAPES for table in _table_readers(top, name)]
    # Planes and boxes may alternate in the text; `tomllib` returns those of each kind together.
    tables.sort(key=lambda table: table.header_span.start)
    known = {*_SHAPES, COVER_TABLE}
    if not top.content.keys() & known or not (tables or covers or diagnostics.has_errors):
        hint = f"write {' or '.join(f'`[[{name}]]`' for name in _SHAPES)}"
        diagnostics.error("this file has no prop", top.spans.table(""), hint)
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
    return Scene(tuple(prop for prop in props if prop), covers)


SCENE_FILE = FileKind("scene", ".scene.toml", _parse_scene, is_shipped=True)


def _parse_covers(tables: list[TableReader], file: str) -> tuple[Cover, ...]:
    """Return the covers of parts; what is wrong is noted as an error."""
    covers: dict[str, Cover] = {}
    for table in tables:
        part, source = _PART.read(table), _SOURCE.read(table)
        layer = _parse_layer(table, _COVER, source or "")
        if part is None or layer is None:
            continue
        if part in covers:
            table.error("part", f"a second cover is over the part `{part}`")
        covers[part] = Cover(part, layer, f"{file}:{table.span('part').line}")
    return tuple(covers.values())


def _parse_layer(
    table: TableReader, rows: tuple[Numbers, Numbers, Number], source: str
) -> Layer | None:
    """Return the layer of a table; None if there is none, or with an error noted if it is wrong."""
    begin, stiffness, thickness = rows
    listed = table.items(stiffness.key)
    if stiffness.key not in table.content:
        for row in (begin, thickness):
            if row.key in table.content:
                table.error(row.key, f"`{row.key}` needs `{stiffness.key}`, the stiffness")
        return None
    if listed is None and begin.key in table.content:
        table.error(begin.key, f"`{begin.key}` needs a list of `{stiffness.key}`", "one a stage")
        return None
    if listed is not None and begin.key not in table.content:
        hint = f"write `{begin.key}`, the depths from which they hold"
        table.error(stiffness.key, f"the stages of `{stiffness.key}` begin nowhere", hint)
        return None
    depths = (0.0,) if listed is None else begin.read(table)
    values, limit = stiffness.read(table), thickness.read(table)
    if depths is None or values is None or (limit is None and thickness.key in table.content):
        return None
    try:
        stages = tuple(zip(depths, values, strict=True))
        return Layer(stages, inf if limit is None else limit, source)
    except ValueError as fault:
        table.error(thickness.key if "thickness" in str(fault) else begin.key, str(fault))
        return None


def _table_readers(top: TableReader, name: str) -> list[TableReader]:
    """Return the readers of all tables of one kind."""
    readers = top.tables(name, name + ("es" if name.endswith("x") else "s"))
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
    numbers = {name: row.read(table) for name, row in SURFACE_NUMBERS.items()}
    numbers = {name: value for name, value in numbers.items() if value is not None}
    if source is None:
        if not table.content.keys() & {row.key for row in (*SURFACE_NUMBERS.values(), *_BELOW)}:
            return DEFAULT_SURFACE
        if "source" not in table.content:
            message, hint = (
                "this surface has no `source`",
                'write `source = "assumed"`, for example',
            )
            table.diagnostics.warning(message, table.header_span, hint)
    layer = _parse_layer(table, _BELOW, source or "")
    return Surface(**numbers, source=source or "", layer=layer)


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
    for cover in scene.covers:
        lines += ["", f"[[{COVER_TABLE}]]", _PART.write(cover.part)]
        lines += [*_layer_lines(cover.layer, _COVER), _source_line(cover.layer.source)]
    text = "\n".join([*lines, ""]).lstrip("\n")
    errors = select_errors(SCENE_FILE.parse_text(text).diagnostics)
    if errors:
        raise ValueError(f"a {_FILE_KIND} cannot hold this scene: {errors[0].message}")
    return text


def _surface_lines(name: str, surface: Surface) -> Iterator[str]:
    yield _NAME.write(name)
    for attribute, row in SURFACE_NUMBERS.items():
        value = getattr(surface, attribute)
        if attribute not in _SELDOM_WRITTEN or value != getattr(_DEFAULTS, attribute):
            yield row.write(value)
    if surface.layer is not None:
        yield from _layer_lines(surface.layer, _BELOW)
    if surface.source:
        yield _source_line(surface.source)


def _layer_lines(layer: Layer, rows: tuple[Numbers, Numbers, Number]) -> Iterator[str]:
    depths, stiffnesses = zip(*layer.stages, strict=True)
    begin, stiffness, thickness = rows
    if len(depths) > 1:
        yield begin.write(depths)
    yield stiffness.write(stiffnesses)
    if layer.thickness < inf:
        yield thickness.write(layer.thickness)


def _source_line(source: str) -> str:
    return f"source = {quote_long_toml(source)}"
