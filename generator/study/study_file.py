"""Studies in files, `NAME.study.toml` (`docs/study-file.md`).

A study names its figure, the options of its runs as `mover simulate` has them, what varies between
the runs, and what is measured in each. Paths in it are relative to its folder.
"""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import NamedTuple

import figures
from generator.diagnostics import (
    Diagnostics,
    ModelError,
    MoverError,
    Parsed,
    Source,
    Span,
    UsageError,
    error,
    shorten,
    spelling_hint,
)
from generator.figure import Figure
from generator.figure_file.read import parse_figure_file, shipped_figures
from generator.person.survey import Sex
from generator.simulation.preconditions import simulation_obstacles
from generator.springs_file.read import OPTIONAL_SUFFIX, load_springs
from generator.springs_file.toml_spans import locate_keys
from generator.springs_file.toml_table import TableReader, parse_document
from generator.study.design_table import MAX_RUNS, parse_design, parse_kind, parse_parameters
from generator.study.designs import run_count
from generator.study.parameters import Case, ParameterPath, apply_values, parse_path
from generator.study.person_figure import PERSON_SPRINGS, make_person
from generator.study.run_options import parse_plan
from generator.study.study import (
    Design,
    DesignKind,
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
from generator.study.study_tables import (
    MEASURE_KEYS,
    PERSON_KEYS,
    SENSITIVITY_KEYS,
    STUDY_KEYS,
    adopt,
    parse_integer,
    parse_row,
    parse_table,
    reject_unknown_keys,
    relative_path,
    require_keys,
)
from generator.text_io import is_file, parse_file, parse_text, path_exists
from springs import Joining, SpringSet

STUDY_SUFFIX = ".study.toml"

MAX_RESAMPLES = 100_000

_FILE_KIND = "study file"
_OTHER_OPTIONS = ("loads", "links", "lock", "drive", "driven", "starts", "spread", "integrator")
"""Options of `mover simulate` that a study does not have."""

_INDEX_KINDS = (DesignKind.SOBOL, DesignKind.MORRIS)

_PLACEHOLDER = Design(DesignKind.LIST)
"""Stands for a design with errors, so that the rest of the file is checked."""


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
    document = parse_document(source, _FILE_KIND, diagnostics)
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
    kind = parse_kind(top)
    parameters = parse_parameters(top, kind)
    measures = _parse_measures(top, parameters)
    sensitivity = _parse_sensitivity(top, kind)
    design = parse_design(top, kind, parameters, sensitivity, folder)
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
    require_keys(table, examples, "person")
    sex = table.choice("sex", tuple(one.value for one in Sex))
    stature, mass = (table.number(key) for key in ("stature_m", "mass_kg"))
    springs = table.choice("springs", PERSON_SPRINGS)
    if sex is None or stature is None or mass is None:
        return None
    person = PersonArguments(Sex(sex), stature, mass, springs or PERSON_SPRINGS[0])
    try:
        figure, spring_set = make_person(person, joining=joining, with_spheres=_has_props(top))
    except UsageError as failure:
        key = "stature_m" if str(failure).startswith("a stature") else "mass_kg"
        table.error(key, str(failure))
        return None
    return _Subject(f"{sex}, {stature:g} m, {mass:g} kg", figure, spring_set, person)


def _has_props(top: TableReader) -> bool:
    """Return whether the runs have a floor or a scene."""
    return top.content.get("floor") is True or "scene" in top.content


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
    rows = {name: parse_row(table, name, "measure", parameters) for name in table.content}
    return {name: None if row is None else _parse_measure(row, name) for name, row in rows.items()}


def _parse_measure(table: TableReader, name: str) -> Measure | None:
    table.reject_unknown_keys(MEASURE_KEYS, "measure")
    require_keys(table, {"column": '"kinetic [J]"', "take": '"last"'}, "measure")
    column = table.text("column")
    take = table.choice("take", tuple(one.value for one in Take))
    return None if column is None or take is None else Measure(name, column, Take(take))


def _parse_sensitivity(top: TableReader, kind: DesignKind | None) -> Sensitivity | None:
    """Return the sensitivity indices that are asked for; None without any."""
    table = parse_table(top, "sensitivity")
    if table is None:
        return None
    reject_unknown_keys(table, SENSITIVITY_KEYS, "sensitivity")
    if kind is not None and kind not in _INDEX_KINDS:
        hint = f"the kind is one of {', '.join(_INDEX_KINDS)}; or leave out `[sensitivity]`"
        message = f"sensitivity indices do not follow from a {kind} design"
        table.diagnostics.error(message, table.header_span, hint)
    confidence = table.number("confidence")
    if confidence is not None and not 0.0 < confidence < 1.0:
        hint = "0.95 is the default"
        table.error("confidence", f"`confidence` must be between 0 and 1, not {confidence:g}", hint)
    resamples = parse_integer(table, "resamples", 1, MAX_RESAMPLES)
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
    adopt(top, key, Parsed[Study](None, tuple(one for one in faults if one.message not in known)))


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
