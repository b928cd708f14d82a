"""Studies in files, `NAME.study.toml` (`docs/study-file.md`).

A study names its figure, the options of its runs as `mover simulate` has them, what varies between
the runs, and what is measured in each. Paths in it are relative to its folder.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, cast

import figures
from generator.diagnostics import (
    Diagnostic,
    Diagnostics,
    ModelError,
    MoverError,
    Parsed,
    Source,
    Span,
    UsageError,
    error,
    select_errors,
    shorten,
    spelling_hint,
)
from generator.figure import Figure
from generator.figure_file.read import find_figure, parse_figure_file, shipped_figures
from generator.input_files.csv_columns import (
    data_lines,
    parse_columns,
    parse_number_cell,
    split_cells,
)
from generator.person.measures import estimate_measures
from generator.person.survey import Sex
from generator.simulation.plan import Plan
from generator.simulation.preconditions import simulation_obstacles
from generator.springs_file.read import OPTIONAL_SUFFIX, load_springs
from generator.springs_file.toml_spans import locate_keys
from generator.springs_file.toml_table import TableReader, parse_document
from generator.study.designs import evenly_spaced, run_count
from generator.study.parameters import Case, ParameterPath, apply_values, parse_path
from generator.study.person_case import PERSON_SPRINGS, person_case
from generator.study.run_options import RUN_KEYS, adopt, parse_plan, parse_table, relative_path
from generator.study.study import (
    Design,
    DesignKind,
    Distribution,
    Levels,
    LogNormal,
    Measure,
    Normal,
    Parameter,
    PersonArguments,
    Sensitivity,
    Study,
    Take,
    Uniform,
)
from generator.text_io import is_file, load_text, parse_file, parse_text, path_exists
from springs import Joining, SpringSet

STUDY_SUFFIX = ".study.toml"

MAX_RUNS = 1_000_000
"""Largest number of runs of a study; more are a typing error."""

MAX_SEED = 2**63 - 1
MAX_RESAMPLES = 100_000
MAX_NAME_LENGTH = 60
RESERVED_NAMES = ("run", "outcome", "message")
"""Other columns of the table of runs."""

FILE_KIND = "study file"
PERSON_KEYS = ("sex", "stature_m", "mass_kg", "springs")
DESIGN_KEYS = ("kind", "runs", "seed", "file")
MEASURE_KEYS = ("column", "take")
SENSITIVITY_KEYS = ("confidence", "resamples")
STUDY_KEYS = (
    *("figure", "person", "springs", *RUN_KEYS),
    *("design", "parameters", "measures", "sensitivity"),
)
_OTHER_OPTIONS = ("loads", "links", "lock", "drive", "driven", "starts", "spread", "integrator")
"""Options of `mover simulate` that a study does not have."""

_DISTRIBUTIONS = (("low", "high"), ("values",), ("mean", "sd"), ("median", "factor"))
"""Keys of each distribution of a parameter."""

PARAMETER_KEYS = ("path", "points", *(key for keys in _DISTRIBUTIONS for key in keys))
_DISTRIBUTION_HINT = "`low` and `high`, `values`, `mean` and `sd`, or `median` and `factor`"

_NAME = re.compile(rf"[\w-]{{1,{MAX_NAME_LENGTH}}}")
_RANDOM_KINDS = (DesignKind.LATIN_HYPERCUBE, DesignKind.SOBOL, DesignKind.MORRIS)
_INDEX_KINDS = (DesignKind.SOBOL, DesignKind.MORRIS)

_PLACEHOLDER = Design(DesignKind.LIST)
"""Stands for a design with errors, so that the rest of the file is checked."""

V = TypeVar("V")


class _Subject(NamedTuple):
    """Figure of a study, with its springs; a person also has its arguments."""

    name: str
    figure: Figure
    springs: SpringSet
    person: PersonArguments | None = None


def shipped_studies() -> dict[str, Path]:
    """The studies that come with this program, by name."""
    paths = sorted(Path(figures.__path__[0]).glob(f"*{STUDY_SUFFIX}"))
    return {path.name.removesuffix(STUDY_SUFFIX): path for path in paths}


def find_study(path_or_name: str | Path) -> Path:
    """Return an existing path, else that of a shipped study, else the path unchanged."""
    path = Path(path_or_name)
    return path if is_file(path) else shipped_studies().get(str(path_or_name), path)


def read_study(path_or_name: str | Path) -> Study:
    """The study in a file or of a shipped name.

    Raises InputError with all diagnostics on any error. Warnings pass.
    """
    return parse_study(path_or_name).require_value()


def parse_study(path_or_name: str | Path) -> Parsed[Study]:
    """The study in a file or of a shipped name, with all diagnostics; bad input raises nothing."""
    name, path = str(path_or_name), find_study(path_or_name)
    if not path_exists(path):
        hint = spelling_hint(name.removesuffix(STUDY_SUFFIX), shipped_studies())
        missing = error(f"there is no file `{name}` and no shipped study of that name", hint=hint)
        return Parsed(None, (missing,))
    return parse_file(path, partial(_parse_source, folder=path.parent), name)


def parse_study_text(text: str, folder: str | Path, name: str = "<text>") -> Parsed[Study]:
    """The study that `text` describes; paths in it are relative to `folder`."""
    return parse_text(text, partial(_parse_source, folder=Path(folder)), name)


def _parse_source(source: Source, diagnostics: Diagnostics, folder: Path) -> Study | None:
    document = parse_document(source, FILE_KIND, diagnostics)
    if document is None:
        return None
    top = TableReader(document, "", 0, locate_keys(source), diagnostics)
    if not document:
        diagnostics.error("this study is empty", top.header_span, 'begin with `figure = "NAME"`')
        return None
    for key in _OTHER_OPTIONS:
        if key in document:
            place = top.spans.key("", 0, key)
            diagnostics.error(f"a study has no `{key}`", place, "use `mover simulate` for it")
    top.reject_unknown_keys((*STUDY_KEYS, *_OTHER_OPTIONS), "study")
    subject = _parse_subject(top, folder)
    plan = parse_plan(top, subject and subject.figure, subject and subject.springs, folder)
    kind = _parse_kind(top)
    parameters = _parse_parameters(top, kind)
    measures = _parse_measures(top, parameters)
    sensitivity = _parse_sensitivity(top, kind)
    design = _parse_design(top, kind, parameters, sensitivity, folder)
    if subject is None or plan is None:
        return None
    study = Study(
        name=subject.name,
        figure=subject.figure,
        plan=plan,
        parameters={name: one for name, one in parameters.items() if one is not None},
        design=design or _PLACEHOLDER,
        measures={name: one for name, one in measures.items() if one is not None},
        person=subject.person,
        sensitivity=sensitivity,
        text=source.text,
    )
    _check_simulatable(study, top)
    _check_paths(study, top)
    if design is not None and len(study.parameters) == len(parameters):
        _check_run_count(study, top)
    return study


# Figure, person and springs


def _parse_subject(top: TableReader, folder: Path) -> _Subject | None:
    """Return the figure of the file, or of its person."""
    joining = _parse_joining(top)
    person = _parse_person(top, joining)
    if "person" in top.content:
        for key in ("figure", "springs"):
            if key in top.content:
                hint = {"figure": "leave out one of them", "springs": "write it below `[person]`"}
                message = f"a study of a person has no `{key}`"
                top.diagnostics.error(message, top.spans.key("", 0, key), hint[key])
        return person
    if "figure" not in top.content:
        hint = 'write `figure = "NAME"`, or `[person]`'
        top.diagnostics.error("this study has no figure", top.header_span, hint)
        return None
    name = top.text("figure")
    if name is None:
        return None
    path = relative_path(name, folder)
    if not is_file(path):
        path = shipped_figures().get(name, path)
    if not path_exists(path):
        hint = spelling_hint(Path(name).stem, shipped_figures())
        message = f"there is no file `{shorten(name)}` and no shipped figure of that name"
        top.error("figure", message, hint)
        return None
    figure = adopt(top, "figure", parse_figure_file(path))
    if figure is None:
        return None
    choice = _springs_choice(top, folder)
    key = "figure" if choice is None else "springs"
    loaded = adopt(top, key, load_springs(figure, path.parent, path.stem, choice, joining))
    return None if loaded is None else _Subject(figure.name or path.stem, figure, loaded.springs)


def _parse_joining(top: TableReader) -> Joining | None:
    law = top.choice("law", tuple(one.value for one in Joining))
    return None if law is None else Joining(law)


def _springs_choice(top: TableReader, folder: Path) -> str | Path | None:
    """Return a choice of springs as `--springs` takes it; a path is relative to the file."""
    choice = top.text("springs")
    if choice is None:
        return None
    path = relative_path(choice, folder)
    is_path = len(Path(choice).parts) > 1 or Path(choice).suffix in (".toml", OPTIONAL_SUFFIX)
    return path if is_path or is_file(path) else choice


def _parse_person(top: TableReader, joining: Joining | None) -> _Subject | None:
    """Return the person of `[person]`; None if it is absent or, with errors, wrong."""
    table = parse_table(top, "person")
    if table is None:
        return None
    table.reject_unknown_keys(PERSON_KEYS, "person")
    examples = {"sex": '"female"', "stature_m": "1.63", "mass_kg": "62"}
    _require_keys(table, examples, "person")
    sex = table.choice("sex", tuple(one.value for one in Sex))
    stature, mass = (table.number(key) for key in ("stature_m", "mass_kg"))
    springs = table.choice("springs", PERSON_SPRINGS)
    if sex is None or stature is None or mass is None:
        return None
    person = PersonArguments(Sex(sex), stature, mass, springs or PERSON_SPRINGS[0])
    try:
        figure, spring_set = person_case(person, joining=joining)
    except UsageError as failure:
        key = "stature_m" if str(failure).startswith("a stature") else "mass_kg"
        table.error(key, str(failure))
        return None
    return _Subject(f"{sex}, {stature:g} m, {mass:g} kg", figure, spring_set, person)


def _require_keys(table: TableReader, examples: Mapping[str, str], noun: str) -> bool:
    """Note an error for each missing key, unless an unknown key is a slip of it."""
    known = PERSON_KEYS + DESIGN_KEYS + PARAMETER_KEYS + MEASURE_KEYS
    slips = {closest_match(key, examples) for key in table.content if key not in known}
    missing = [key for key in examples if key not in table.content]
    for key in missing:
        if key not in slips:
            hint = f"write `{key} = {examples[key]}`, for example"
            message = f"this {noun} has no `{key}`"
            table.diagnostics.error(message, table.header_span, hint)
    return not missing


# Design


def _parse_kind(top: TableReader) -> DesignKind | None:
    """Return the kind of the design; None if it is absent or, with an error, wrong."""
    table = parse_table(top, "design")
    if table is None:
        if "design" not in top.content:
            hint = f"write `[design]` and `kind = {_KIND_EXAMPLE}` below it"
            top.diagnostics.error("this study has no design", top.header_span, hint)
        return None
    _reject_unknown_keys(table, DESIGN_KEYS, "design")
    _require_keys(table, {"kind": _KIND_EXAMPLE}, "design")
    kind = table.choice("kind", tuple(one.value for one in DesignKind))
    return None if kind is None else DesignKind(kind)


_KIND_EXAMPLE = '"latin-hypercube"'


def _parse_design(
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
        _require_keys(table, {"runs": "64"}, f"{kind} design")
    elif "runs" in table.content:
        hint = "it has the rows of its file" if is_list else "it has all combinations of its values"
        table.error("runs", f"a {kind} design has no `runs`", hint)
    runs = _parse_integer(table, "runs", 1, MAX_RUNS) if has_runs else None
    seed = _parse_integer(table, "seed", 0, MAX_SEED)
    if "file" in table.content and not is_list:
        table.error("file", f"a {kind} design has no `file`", 'the kind of a file is "list"')
    rows = _parse_rows(table, tuple(parameters), folder) if is_list else ()
    if rows is None or (has_runs and runs is None):
        return None
    if kind is DesignKind.SOBOL and runs is not None and runs & (runs - 1):
        near = 1 << (runs.bit_length() - 1)
        message = f"{runs} is not a power of two, which a Sobol sequence needs to be balanced"
        add = table.diagnostics.warning if sensitivity is None else table.diagnostics.error
        add(message, table.span("runs"), f"write {near} or {2 * near}")
    return Design(kind, runs, seed or 0, rows)


def _parse_rows(
    table: TableReader, names: tuple[str, ...], folder: Path
) -> tuple[tuple[float, ...], ...] | None:
    """Return the values of the parameters in the table of a list; None with an error noted."""
    if not _require_keys(table, {"file": '"points.csv"'}, "list"):
        return None
    name = table.text("file")
    if name is None or not names:
        return None
    path = relative_path(name, folder)
    source, unreadable = load_text(path, str(path))
    if unreadable is not None:
        return adopt(table, "file", Parsed(None, (unreadable,)))
    lines, example = data_lines(source), ",".join(names)
    faults = table.diagnostics
    if not lines:
        faults.error("this list is empty", Span(source, 0, 1), example)
        return None
    columns = parse_columns(lines[0], names, example, faults)
    if len(columns) < len(names):
        return None
    if len(lines) == 1:
        faults.error("this list has no rows", lines[0], "a row below the titles is a run")
    titles, rows = split_cells(lines[0]), list[tuple[float, ...]]()
    if len(lines) - 1 > MAX_RUNS:
        faults.error(f"a study has at most {MAX_RUNS:,} runs", lines[MAX_RUNS + 1])
        return None
    for line in lines[1:]:
        cells = split_cells(line)
        if len(cells) != len(titles):
            message = f"this row has {format_count(len(cells), 'cell')}, not {len(titles)}"
            faults.error(message, line, example)
            continue
        read = [parse_number_cell(cells[columns[one].index], one, faults) for one in names]
        rows.append(tuple(value for value in read if value is not None))
    return tuple(rows)


def _parse_integer(table: TableReader, key: str, least: int, largest: int) -> int | None:
    """Return a whole number; None if it is absent or, with an error, wrong."""
    value: Any = table.content.get(key)
    if value is None:
        return None
    if type(value) is not int:
        table.error(key, f"`{key}` must be a whole number", "without quotes and decimals")
    elif not least <= value <= largest:
        table.error(key, f"`{key}` must be from {least:,} to {largest:,}")
    else:
        return value
    return None


def _reject_unknown_keys(table: TableReader, known: tuple[str, ...], noun: str) -> None:
    """Note an error for each unknown key; an option of the runs stands above all tables."""
    for key in table.content:
        if key in RUN_KEYS and key not in known:
            place = table.spans.key(table.name, 0, key)
            hint = "write it above the first `[table]`"
            table.diagnostics.error(f"`{key}` is not a key of a {noun}", place, hint)
    table.reject_unknown_keys((*known, *RUN_KEYS), noun)


# Parameters


def _parse_parameters(top: TableReader, kind: DesignKind | None) -> dict[str, Parameter | None]:
    """Return the parameters by name; None, with an error noted, for one that is wrong."""
    table = parse_table(top, "parameters")
    if table is None or not table.content:
        if "parameters" not in top.content or table is not None:
            hint = 'write `[parameters]` and `g = { path = "gravity", low = 0.8, high = 1.2 }`'
            place = top.spans.table("parameters")
            top.diagnostics.error("this study has no parameters", place, hint)
        return {}
    rows = {name: _row(table, name, "parameter", ()) for name in table.content}
    return {
        name: None if row is None else _parse_parameter(row, name, kind)
        for name, row in rows.items()
    }


def _row(table: TableReader, name: str, noun: str, taken: Iterable[str]) -> TableReader | None:
    """Return the table of one parameter or measure; None, with an error noted, if it is wrong."""
    place = table.spans.key(table.name, 0, name)
    faults = table.diagnostics
    if name in RESERVED_NAMES or name in taken:
        other = "a parameter" if name in taken else "another column"
        faults.error(f"`{name}` is the name of {other} of the table of runs", place, "rename it")
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
        keys = "path, low, high" if noun == "parameter" else "column, take"
        faults.error(f"a {noun} is a table", place, f"write `{name} = {{ {keys} }}` with values")
    return None


def _parse_parameter(table: TableReader, name: str, kind: DesignKind | None) -> Parameter | None:
    table.reject_unknown_keys(PARAMETER_KEYS, "parameter")
    has_path = _require_keys(table, {"path": '"springs.knee.scale"'}, "parameter")
    paths = _parse_texts(table, "path") if has_path else ()
    before = len(table.diagnostics.entries)
    distribution = _parse_distribution(table, name, kind)
    if not paths or len(table.diagnostics.entries) > before and distribution is None:
        return None
    return Parameter(name, paths, distribution)


def _parse_texts(table: TableReader, key: str) -> tuple[str, ...]:
    """Return a text, or a list of texts; empty, with an error noted, for anything else."""
    value: Any = table.content[key]
    texts: list[Any] = value if isinstance(value, list) else [value]
    if not texts or not all(isinstance(text, str) for text in texts):
        hint = 'texts stand in quotes: `"gravity"`'
        table.error(key, f"`{key}` must be a text or a list of texts", hint)
        return ()
    return tuple(texts)


def _parse_distribution(
    table: TableReader, name: str, kind: DesignKind | None
) -> Distribution | None:
    """Return the distribution of a parameter; None if it is absent or, with an error, wrong."""
    present = [keys for keys in _DISTRIBUTIONS if any(key in table.content for key in keys)]
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
    missing = [key for key in keys if key not in table.content]
    if missing:
        there = next(key for key in keys if key in table.content)
        table.error(there, f"`{there}` needs `{missing[0]}` beside it")
        return None
    if keys == ("values",):
        return _parse_levels(table, kind)
    numbers = {key: table.number(key) for key in keys}
    points = _parse_integer(table, "points", 2, MAX_RUNS)
    first, second = numbers.values()
    if first is None or second is None:
        return None
    for key in keys:
        if abs(cast("float", numbers[key])) > MAX_ABS_VALUE:
            table.error(key, "this number is too large", f"at most {MAX_ABS_VALUE:g}")
            return None
    match keys:
        case ("low", "high"):
            return _parse_uniform(table, kind, first, second, points)
        case ("mean", "sd"):
            if second <= 0.0:
                table.error("sd", f"the standard deviation must be above zero, not {second:g}")
                return None
            distribution = Normal(first, second)
        case _:
            if first <= 0.0:
                hint = "a log-normal distribution has positive values"
                table.error("median", f"`median` must be above zero, not {first:g}", hint)
                return None
            if second <= 1.0:
                hint = "the ratio of a value at one standard deviation to the median"
                table.error("factor", f"`factor` must be above 1, not {second:g}", hint)
                return None
            distribution = LogNormal(first, second)
    if kind is DesignKind.GRID:
        hint = "write `values`, or `low`, `high` and `points`"
        table.error(keys[0], "a grid needs the values of each parameter", hint)
        return None
    return distribution


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
        table.diagnostics.error("a grid needs `points` between its ends", table.header_span, hint)
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


# Measures and sensitivity


def _parse_measures(
    top: TableReader, parameters: Mapping[str, Parameter | None]
) -> dict[str, Measure | None]:
    """Return the measures by name; None, with an error noted, for one that is wrong."""
    table = parse_table(top, "measures")
    if table is None or not table.content:
        if "measures" not in top.content or table is not None:
            hint = 'write `[measures]` and `end = { column = "kinetic [J]", take = "last" }`'
            top.diagnostics.error("this study has no measures", top.spans.table("measures"), hint)
        return {}
    rows = {name: _row(table, name, "measure", parameters) for name in table.content}
    return {name: None if row is None else _parse_measure(row, name) for name, row in rows.items()}


def _parse_measure(table: TableReader, name: str) -> Measure | None:
    table.reject_unknown_keys(MEASURE_KEYS, "measure")
    _require_keys(table, {"column": '"kinetic [J]"', "take": '"last"'}, "measure")
    column = table.text("column")
    take = table.choice("take", tuple(one.value for one in Take))
    return None if column is None or take is None else Measure(name, column, Take(take))


def _parse_sensitivity(top: TableReader, kind: DesignKind | None) -> Sensitivity | None:
    """Return the sensitivity indices that are asked for; None without any."""
    table = parse_table(top, "sensitivity")
    if table is None:
        return None
    _reject_unknown_keys(table, SENSITIVITY_KEYS, "sensitivity")
    if kind is not None and kind not in _INDEX_KINDS:
        hint = f"the kind is one of {', '.join(_INDEX_KINDS)}; or leave out `[sensitivity]`"
        message = f"sensitivity indices do not follow from a {kind} design"
        table.diagnostics.error(message, table.header_span, hint)
    confidence = table.number("confidence")
    if confidence is not None and not 0.0 < confidence < 1.0:
        hint = "0.95 is the default"
        table.error("confidence", f"`confidence` must be between 0 and 1, not {confidence:g}", hint)
    resamples = _parse_integer(table, "resamples", 1, MAX_RESAMPLES)
    return Sensitivity(
        Sensitivity.confidence if confidence is None else confidence,
        Sensitivity.resamples if resamples is None else resamples,
    )


# Checks of the whole study


def _check_simulatable(study: Study, top: TableReader) -> None:
    """Note the reasons why the figure cannot be simulated from its start."""
    springs = study.plan.springs
    if springs is None or top.diagnostics.has_errors:
        return
    faults = simulation_obstacles(study.figure, springs, study.plan.displacements)
    known = {one.message for one in top.diagnostics.entries}
    key = "person" if study.person else "figure"
    adopt(top, key, Parsed(None, tuple(one for one in faults if one.message not in known)))


def _check_paths(study: Study, top: TableReader) -> None:
    """Note unknown paths, two of one quantity, and ends of ranges that a quantity cannot have."""
    case = Case(study.figure, study.plan)
    first: dict[ParameterPath, Span] = {}
    for parameter in study.parameters.values():
        place = f"parameters.{parameter.name}"
        for k, text in enumerate(parameter.paths):
            item = (
                k if isinstance(top.content["parameters"][parameter.name]["path"], list) else None
            )
            span = top.spans.value(place, 0, "path", item)
            try:
                path = parse_path(text, case, study.person)
            except MoverError as failure:
                top.diagnostics.error(str(failure), span)
                continue
            if path in first:
                hint = f"the first is in line {first[path].line}"
                top.diagnostics.error(f"`{path}` is set twice", span, hint)
                continue
            first[path] = span
            _check_ends(case, path, parameter, top, place)


def _check_ends(
    case: Case, path: ParameterPath, parameter: Parameter, top: TableReader, place: str
) -> None:
    """Note values of a parameter that its quantity cannot have."""
    match parameter.distribution:
        case Uniform(low=low, high=high):
            values = {"low": low, "high": high}
        case Normal(mean=mean):
            values = {"mean": mean}
        case LogNormal(median=median):
            values = {"median": median}
        case Levels(values=levels):
            values = {"values": min(levels), "points": max(levels)}
        case None:
            return
    for key, value in values.items():
        try:
            apply_values(case, [(path, value)])
        except MoverError as failure:
            top.diagnostics.error(str(failure), top.spans.value(place, 0, key))
            return


def _check_run_count(study: Study, top: TableReader) -> None:
    """Note an error of more runs than `MAX_RUNS`."""
    try:
        count = run_count(study)
    except ModelError:  # noted before
        return
    if count > MAX_RUNS:
        place = top.spans.value("design", 0, "runs" if study.design.runs else "kind")
        message = f"this study has {count:,} runs"
        top.diagnostics.error(message, place, f"at most {MAX_RUNS:,}")
