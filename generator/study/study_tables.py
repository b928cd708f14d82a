"""Tables of a study's file, among them design and parameters, with errors at their places."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar, cast

from generator.diagnostics import (
    Diagnostics,
    MoverError,
    Parsed,
    Span,
    format_count,
    shorten,
)
from generator.input_files.csv_columns import (
    MAX_ABS_VALUE,
    data_lines,
    parse_columns,
    parse_number_cell,
    split_cells,
)
from generator.person.joints import Neck
from generator.person.survey import Sex
from generator.run_options import STUDY_OPTIONS
from generator.study.designs import evenly_spaced
from generator.study.person_figure import PERSON_SPRINGS
from generator.study.sensitivity import MIN_SAMPLES
from generator.study.study import (
    Design,
    DesignKind,
    Distribution,
    Levels,
    LogNormal,
    Normal,
    Parameter,
    Sensitivity,
    Statistic,
    Uniform,
)
from generator.text_io import csv_value, load_text
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


_DISTRIBUTION_HINT = "`low` and `high`, `values`, `mean` and `sd`, or `median` and `factor`"
_RANDOM_KINDS = (DesignKind.LATIN_HYPERCUBE, DesignKind.SOBOL, DesignKind.MORRIS)


def parse_parameters(top: TableReader, kind: DesignKind | None) -> dict[str, Parameter | None]:
    """Return the parameters by name; None, with an error noted, for one that is wrong."""
    table = require_table(top, "parameters", PARAMETER_EXAMPLE)
    if table is None:
        return {}
    rows = {name: parse_row(table, name, "parameter", ()) for name in table.content}
    return {
        name: None if row is None else _parse_parameter(row, name, kind)
        for name, row in rows.items()
    }


def _parse_parameter(table: TableReader, name: str, kind: DesignKind | None) -> Parameter | None:
    table.reject_unknown_keys(PARAMETER_ROWS.keys, PARAMETER_ROWS.noun)
    has_path = require_keys(table, {"path": '"springs.knee.scale"'}, "parameter")
    paths = parse_texts(table, "path") if has_path else ()
    distribution = _parse_distribution(table, name, kind)
    return Parameter(name, paths, distribution) if paths else None


def _parse_distribution(
    table: TableReader, name: str, kind: DesignKind | None
) -> Distribution | None:
    """Return the distribution of a parameter; None if it is absent or, with an error, wrong."""
    present = [keys for keys in DISTRIBUTION_KEYS if any(key in table.content for key in keys)]
    if not present:
        if kind is not None and kind is not DesignKind.LIST:
            message = f"the parameter `{name}` has no values"
            table.diagnostics.error(message, table.header_span, f"write {_DISTRIBUTION_HINT}")
        return None
    if len(present) > 1:
        first, second = (next(k for k in keys if k in table.content) for keys in present[:2])
        hint = f"a parameter has one of {_DISTRIBUTION_HINT}"
        table.error(second, f"`{first}` and `{second}` exclude each other", hint)
        return None
    (keys,) = present
    if kind is DesignKind.LIST:
        span = table.span(keys[0] if keys[0] in table.content else keys[-1])
        hint = "they are in the file of the list"
        table.diagnostics.warning(f"the values of `{name}` here are not used", span, hint)
        return None
    missing = [key for key in keys if key not in table.content]
    if missing and table.content.keys() <= set(PARAMETER_ROWS.keys):  # else a slip of it, perhaps
        there = next(key for key in keys if key in table.content)
        table.error(there, f"`{there}` needs `{missing[0]}` beside it")
    if missing:
        return None
    if keys == ("values",):
        return _parse_levels(table, kind)
    (pair,) = (rows for rows in DISTRIBUTION_ROWS if rows[0].key == keys[0])
    first, second = (row.read(table) for row in pair)
    points = POINTS.read(table)
    if first is None or second is None:
        return None
    if keys == ("low", "high"):
        return _parse_uniform(table, kind, first, second, points)
    if keys == ("median", "factor") and second <= 1.0:
        hint = "the ratio of a value at one standard deviation to the median"
        table.error("factor", f"`factor` must be above 1, not {second:g}", hint)
        return None
    if kind is DesignKind.GRID:
        hint = "write `values`, or `low`, `high` and `points`"
        table.error(keys[0], "a grid needs the values of each parameter", hint)
        return None
    return Normal(first, second) if keys == ("mean", "sd") else LogNormal(first, second)


def _parse_uniform(
    table: TableReader, kind: DesignKind | None, low: float, high: float, points: int | None
) -> Distribution | None:
    if low >= high:
        table.error("high", f"`high` must be above `low` ({low:g}), not {high:g}")
        return None
    if kind is not DesignKind.GRID:
        if "points" in table.content and kind is not None:
            hint = f"a {kind} design samples between `low` and `high`"
            table.diagnostics.warning("`points` is for a grid", table.span("points"), hint)
        return Uniform(low, high)
    if points is not None:
        return evenly_spaced(low, high, points)
    if "points" not in table.content:
        hint = "write `points = 5`, for example, or `values` instead"
        table.diagnostics.error(
            "a grid needs the number of `points` from `low` to `high`", table.header_span, hint
        )
    return None


def _parse_levels(table: TableReader, kind: DesignKind | None) -> Levels | None:
    items = table.items("values")
    if not items:
        table.error("values", "`values` must be a list of numbers", "in square brackets")
        return None
    values = table.numbers("values", len(items))
    if values is None:
        return None
    for k, value in enumerate(values):
        if abs(value) > MAX_ABS_VALUE:
            table.error("values", "this number is too large", f"at most {MAX_ABS_VALUE:g}", k)
            return None
        if kind is DesignKind.GRID and value in values[:k]:
            table.error("values", f"the value {value:g} stands here twice", item=k)
            return None
    return Levels(values)


def parse_kind(top: TableReader) -> DesignKind | None:
    """Return the kind of the design; None if it is absent or, with an error, wrong."""
    table = require_table(top, "design", f"kind = {KIND.example}")
    if table is None:
        return None
    check_keys(table, DESIGN_ROWS)
    return KIND.read(table)


def parse_design(
    top: TableReader,
    kind: DesignKind | None,
    parameters: Mapping[str, Parameter | None],
    sensitivity: Sensitivity | None,
    folder: Path,
) -> Design | None:
    """Return the design; None, with an error noted, if it is wrong."""
    if kind is None:
        return None
    table = parse_table(top, "design")
    assert table is not None
    has_runs, is_list = kind in _RANDOM_KINDS, kind is DesignKind.LIST
    if has_runs:
        require_keys(table, {"runs": "64"}, f"{kind} design")
    elif "runs" in table.content:
        hint = "it has the rows of its file" if is_list else "it has all combinations of its values"
        table.error("runs", f"a {kind} design has no `runs`", hint)
    runs = RUNS.read(table) if has_runs else None
    seed = SEED.read(table)
    if "file" in table.content and not is_list:
        table.error("file", f"a {kind} design has no `file`", 'the kind of a file is "list"')
    rows = _parse_rows(table, tuple(parameters), folder) if is_list else ()
    if rows is None or (has_runs and runs is None):
        return None
    if sensitivity is not None and runs is not None and runs < MIN_SAMPLES:
        nouns = {DesignKind.SOBOL: "base samples", DesignKind.MORRIS: "trajectories"}
        noun = nouns.get(kind, "runs")
        table.error("runs", f"indices need at least {MIN_SAMPLES} {noun}, not {runs}")
    elif kind is DesignKind.SOBOL and runs is not None and runs & (runs - 1):
        near = 1 << (runs.bit_length() - 1)
        message = f"{runs} is not a power of two, which a Sobol sequence needs to be balanced"
        add = table.diagnostics.warning if sensitivity is None else table.diagnostics.error
        add(message, table.span("runs"), f"write {near} or {2 * near}")
    file = folder / table.content["file"] if is_list else None
    return Design(kind, runs, seed or 0, rows, file)


def _parse_rows(
    table: TableReader, names: tuple[str, ...], folder: Path
) -> tuple[tuple[float, ...], ...] | None:
    """Return the values of the parameters in the table of a list; None with an error noted."""
    if not require_keys(table, {"file": '"points.csv"'}, "list"):
        return None
    name = table.text("file")
    if name is None or not names:
        return None
    path = folder / name
    source, unreadable = load_text(path, str(path))
    if unreadable is not None:
        return value_of_file(
            table, "file", Parsed[tuple[tuple[float, ...], ...]](None, (unreadable,))
        )
    lines, example = data_lines(source), ",".join(names)
    faults = table.diagnostics
    if not lines:
        faults.error("this list is empty", Span(source, 0, 1), example)
        return None
    columns = parse_columns(
        lines[0], names, example, faults, lambda cell: (csv_value(cell.text), "")
    )
    if len(columns) < len(names):
        return None
    if len(lines) == 1:
        faults.error("this list has no rows", lines[0], "a row below the titles is a run")
    titles, rows, is_complete = split_cells(lines[0]), list[tuple[float, ...]](), True
    if len(lines) - 1 > MAX_RUNS:
        faults.error(f"a study has at most {MAX_RUNS:,} runs", lines[MAX_RUNS + 1])
        return None
    for line in lines[1:]:
        cells = split_cells(line)
        if len(cells) != len(titles):
            message = f"this row has {format_count(len(cells), 'cell')}, not {len(titles)}"
            faults.error(message, line, example)
            is_complete = False
            continue
        read = [parse_number_cell(cells[columns[one].index], one, faults) for one in names]
        rows.append(tuple(value for value in read if value is not None))
        is_complete = is_complete and len(rows[-1]) == len(names)
    return tuple(rows) if is_complete and rows else None
