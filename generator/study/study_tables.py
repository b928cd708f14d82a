"""Tables of a study's file: values, names and paths, with errors at their places."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, TypeVar, cast

from generator.diagnostics import Diagnostics, MoverError, Parsed, Span, shorten
from generator.input_files.csv_columns import MAX_ABS_VALUE
from generator.person.joints import Neck
from generator.person.survey import Sex
from generator.run_options import STUDY_OPTIONS
from generator.study.person_figure import PERSON_SPRINGS
from generator.study.study import DesignKind, Statistic
from generator.toml_file import rows
from generator.toml_file.reader import TableReader
from generator.toml_file.rows import Choice, Integer, Number, TableRows, Text

STUDY_SUFFIX = ".study.toml"

RUN_KEYS = tuple(option.key for option in STUDY_OPTIONS)
"""Options of a run."""

STUDY_TABLES = ("design", "parameters", "measures", "sensitivity")
STUDY_KEYS = ("figure", "person", *RUN_KEYS, *STUDY_TABLES)

MAX_RUNS = 1_000_000
"""Largest number of runs of a study; more are a typing error."""

KIND = Choice("kind", tuple(DesignKind), example='"latin-hypercube"')
RUNS, SEED = Integer("runs", 1, MAX_RUNS), Integer("seed", 0, 2**63 - 1)
POINTS, RESAMPLES = Integer("points", 2, MAX_RUNS), Integer("resamples", 1, 100_000)
DESIGN_ROWS = TableRows("design", (KIND, RUNS, SEED, Text("file")))
_NUMBER_BOUNDS = (-MAX_ABS_VALUE, MAX_ABS_VALUE)
DISTRIBUTION_ROWS = (
    (Number("low", *_NUMBER_BOUNDS), Number("high", *_NUMBER_BOUNDS)),
    (Number("mean", *_NUMBER_BOUNDS), Number("sd", 0.0, MAX_ABS_VALUE, is_positive=True)),
    (
        Number(
            "median",
            0.0,
            MAX_ABS_VALUE,
            hint="a log-normal distribution has positive values",
            is_positive=True,
        ),
        Number(
            "factor",
            1.0,
            MAX_ABS_VALUE,
            hint="the ratio of a value at one standard deviation to the median",
        ),
    ),
)
"""Pairs of numbers that describe a distribution."""

DISTRIBUTION_KEYS = (("values",), *(tuple(row.key for row in pair) for pair in DISTRIBUTION_ROWS))
PARAMETER_ROWS = TableRows(
    "parameter",
    (*(row for pair in DISTRIBUTION_ROWS for row in pair), POINTS),
    ("path", "values"),
)
PERSON_ROWS = TableRows(
    "person",
    (
        Choice("sex", tuple(Sex), example='"female"'),
        Number("stature_m", example="1.63", attribute="stature"),
        Number("mass_kg", example="62", attribute="mass"),
        Choice("springs", PERSON_SPRINGS),
        Number("hip_datum_deg", attribute="hip_datum"),
        Choice("neck", tuple(Neck)),
    ),
)
MEASURE_ROWS = TableRows(
    "measure",
    (Text("column", example='"kinetic [J]"'), Choice("take", tuple(Statistic), example='"last"')),
)
SENSITIVITY_ROWS = TableRows("sensitivity", (Number("confidence"), RESAMPLES))

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
        table = cast("dict[str, Any]", content)
        return TableReader(table, name, 0, top.spans, top.diagnostics)
    if content is not None:
        place = top.spans.table(name)
        top.diagnostics.error(f"`{name}` is a table", place, f"write `[{name}]` above its keys")
    return None


def require_table(top: TableReader, name: str, example: str) -> TableReader | None:
    """Return the reader of a table with keys; None, with an error noted, if there is none."""
    table = parse_table(top, name)
    if table is not None and table.content:
        return table
    is_absent = name not in top.content and name not in rows.find_slips(top, STUDY_KEYS)
    if table is not None or is_absent:
        hint = f"write `[{name}]` and `{example}` below it"
        top.diagnostics.error(f"this study has no {name}", top.spans.table(name), hint)
    return None


def value_of_file(table: TableReader, key: str, parsed: Parsed[V]) -> V | None:
    """Return the value of a file that a key names, and note its diagnostics."""
    place = table.span(key)
    placed = [replace(one, span=one.span or place) for one in parsed.diagnostics]
    table.diagnostics.extend(Diagnostics(placed))
    return parsed.value


def note_failure(diagnostics: Diagnostics, failure: MoverError, span: Span | None) -> None:
    """Note an error, of which a second clause is the hint."""
    message, _, hint = str(failure).partition("; ")
    diagnostics.error(message, span, hint)


def check_keys(table: TableReader, own: TableRows) -> None:
    """Note unknown and missing keys of a table; an option of the runs stands above all tables."""
    for key in table.content:
        if key in RUN_KEYS and key not in own.keys:
            place = table.spans.key(table.name, 0, key)
            hint = "write it above the first `[table]`"
            table.diagnostics.error(f"`{key}` is not a key of a {own.noun}", place, hint)
    table.reject_unknown_keys((*own.keys, *RUN_KEYS), own.noun)
    require_keys(table, own.examples, own.noun)


def require_keys(table: TableReader, examples: Mapping[str, str], noun: str) -> bool:
    """Note an error for each missing key of a table, unless an unknown key is a slip of it.

    Keys of other tables of a study are not slips.
    """
    tables = (PERSON_ROWS, DESIGN_ROWS, PARAMETER_ROWS, MEASURE_ROWS)
    return rows.require_keys(table, examples, noun, tuple(key for t in tables for key in t.keys))


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
