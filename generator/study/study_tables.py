"""Tables of a study's file: values, names and paths, with errors at their places."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar, cast

from generator.diagnostics import Diagnostics, Parsed, closest_match, shorten
from generator.input_files.scene import MAX_FRICTION
from generator.simulation.plan import MAX_HEIGHT
from generator.toml_file import rows
from generator.toml_file.reader import TableReader
from generator.toml_file.rows import Flag, Number, TableRows, Vector3

STUDY_SUFFIX = ".study.toml"

RUN_TABLES = ("set", "velocity")
MAX_TIME = 1e6
"""Largest time of a run, and of its computation [s]."""

MAX_GRAVITY = 1e9
"""Largest component of gravity [m/s2]."""

RUN_NUMBERS = (
    Number("stop", -MAX_TIME, MAX_TIME, " s"),
    Number("start", -MAX_TIME, MAX_TIME, " s"),
    Number("frame", 0.0, MAX_TIME, " s", is_positive=True),
    Number("tolerance", 0.0, 1e3, " rad", is_positive=True),
    Number("step", 0.0, MAX_TIME, " s", is_positive=True),
    Number("height", -MAX_HEIGHT, MAX_HEIGHT, " m"),
    Number("wall_limit", 0.0, MAX_TIME, " s", is_positive=True),
)
FLOOR = Flag("floor")
RUN_FLAGS = (Flag("free_root"), FLOOR, Flag("self_contact"))
GRAVITY = Vector3("gravity", MAX_GRAVITY, f"at most {MAX_GRAVITY:g} m/s2")
FRICTION = Number("friction", 0.0, MAX_FRICTION)
RUN_ROWS = TableRows(
    "study",
    (*RUN_NUMBERS, *RUN_FLAGS, GRAVITY, FRICTION),
    ("law", "scene", "pose", *RUN_TABLES),
)
"""Options of a run."""

RUN_KEYS = RUN_ROWS.keys

STUDY_TABLES = ("design", "parameters", "measures", "sensitivity")
STUDY_KEYS = ("figure", "person", "springs", *RUN_KEYS, *STUDY_TABLES)
PERSON_KEYS = ("sex", "stature_m", "mass_kg", "springs")
DESIGN_KEYS = ("kind", "runs", "seed", "file")
DISTRIBUTION_KEYS = (("low", "high"), ("values",), ("mean", "sd"), ("median", "factor"))
PARAMETER_KEYS = ("path", *(key for keys in DISTRIBUTION_KEYS for key in keys), "points")
MEASURE_KEYS = ("column", "take")
SENSITIVITY_KEYS = ("confidence", "resamples")

PARAMETER_EXAMPLE = 'g = { path = "gravity", low = 0.8, high = 1.2 }'
MEASURE_EXAMPLE = 'end = { column = "kinetic [J]", take = "last" }'

RESERVED_NAMES = ("run", "outcome", "message")
"""Other columns of the table of runs."""

MAX_NAME_LENGTH = 60
_NAME = re.compile(rf"[\w-]{{1,{MAX_NAME_LENGTH}}}")

V = TypeVar("V")


def parse_table(top: TableReader, name: str) -> TableReader | None:
    """Return the reader of a table of the file; None if it is absent or, with an error, not one."""
    content: Any = top.content.get(name)
    if isinstance(content, dict):
        return TableReader(content, name, 0, top.spans, top.diagnostics)  # pyright: ignore[reportUnknownArgumentType]
    if content is not None:
        place = top.spans.table(name)
        top.diagnostics.error(f"`{name}` is a table", place, f"write `[{name}]` above its keys")
    return None


def require_table(top: TableReader, name: str, example: str) -> TableReader | None:
    """Return the reader of a table with keys; None, with an error noted, if there is none."""
    table = parse_table(top, name)
    if table is not None and table.content:
        return table
    slips = (closest_match(key, STUDY_KEYS) for key in top.content if key not in STUDY_KEYS)
    if table is not None or (name not in top.content and name not in slips):
        hint = f"write `[{name}]` and `{example}` below it"
        top.diagnostics.error(f"this study has no {name}", top.spans.table(name), hint)
    return None


def relative_path(text: str, folder: Path) -> Path:
    """Return the path of a file that a study in `folder` names."""
    return folder / Path(text)


def adopt(table: TableReader, key: str, parsed: Parsed[V]) -> V | None:
    """Return the value of a file that a key names, and note its diagnostics."""
    place = table.span(key)
    placed = [replace(one, span=one.span or place) for one in parsed.diagnostics]
    table.diagnostics.extend(Diagnostics(placed))
    return parsed.value


def reject_unknown_keys(table: TableReader, known: tuple[str, ...], noun: str) -> None:
    """Note an error for each unknown key; an option of the runs stands above all tables."""
    for key in table.content:
        if key in RUN_KEYS and key not in known:
            place = table.spans.key(table.name, 0, key)
            hint = "write it above the first `[table]`"
            table.diagnostics.error(f"`{key}` is not a key of a {noun}", place, hint)
    table.reject_unknown_keys((*known, *RUN_KEYS), noun)


def require_keys(table: TableReader, examples: Mapping[str, str], noun: str) -> bool:
    """Note an error for each missing key of a table, unless an unknown key is a slip of it.

    Keys of other tables of a study are not slips.
    """
    return rows.require_keys(
        table, examples, noun, PERSON_KEYS + DESIGN_KEYS + PARAMETER_KEYS + MEASURE_KEYS
    )


def parse_row(table: TableReader, name: str, noun: str, taken: Iterable[str]) -> TableReader | None:
    """Return the table of one parameter or measure; None, with an error noted, if it is wrong."""
    place = table.spans.key(table.name, 0, name)
    faults = table.diagnostics
    if name in RESERVED_NAMES:
        message = f"`{name}` is the name of another column of the table of runs"
        faults.error(message, place, "rename it")
    elif name in taken:
        faults.error(f"`{name}` is the name of a parameter already", place, "rename one of them")
    elif not _NAME.fullmatch(name):
        hint = f"1 to {MAX_NAME_LENGTH} letters, digits, `_` and `-`"
        faults.error(f"`{shorten(name)}` is not a name of a {noun}", place, hint)
    content: Any = table.content[name]
    if isinstance(content, dict):
        return TableReader(
            cast("dict[str, Any]", content), f"{table.name}.{name}", 0, table.spans, faults
        )
    if name in STUDY_KEYS:
        faults.error(f"`{name}` is not a {noun}", place, "write it above the first `[table]`")
    else:
        example = PARAMETER_EXAMPLE if noun == "parameter" else MEASURE_EXAMPLE
        faults.error(f"a {noun} is a table", place, f"write `{example}`, for example")
    return None


def parse_texts(table: TableReader, key: str) -> tuple[str, ...]:
    """Return a text, or a list of texts; empty, with an error noted, for anything else."""
    value: Any = table.content[key]
    texts = cast("list[Any]", value) if isinstance(value, list) else [value]
    if not texts or not all(isinstance(text, str) for text in texts):
        hint = 'texts stand in quotes: `"gravity"`'
        table.error(key, f"`{key}` must be a text or a list of texts", hint)
        return ()
    return tuple(texts)
