"""Studies in files, `NAME.study.toml` (`docs/study-file.md`).

A study names its figure, the options of its runs as `mover simulate` has them, what varies between
the runs, and what is measured in each. Paths in it are relative to its folder.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from math import radians
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np

from generator.contact.scene import Scene
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
    shorten,
    spelling_hint,
)
from generator.figure import Figure, follower_faults
from generator.figure_file.read import FIGURE_FILE
from generator.figure_file.values import displacement_bound
from generator.file_kind import FileKind
from generator.input_files.pose import POSE_FILE
from generator.input_files.scene import SCENE_FILE
from generator.input_files.tone import TONE_FILE
from generator.kinematics.free_root import Joints, settable_joints
from generator.kinematics.loops import OpenLoopError, close_loops
from generator.kinematics.placement import initial_displacements
from generator.kinematics.tree import build_tree
from generator.model import Model, contact_of_figure
from generator.motion_files.action import LENGTH_UNIT
from generator.person.joints import resolve_neck
from generator.person.measures import estimate_measures
from generator.person.passive_joints import check_hip_datum
from generator.run_options import RUN_OPTIONS, STUDY_OPTIONS
from generator.simulation.falls import FALLS, fall_plan
from generator.simulation.plan import Plan, option_faults, plan_fields
from generator.simulation.preconditions import simulation_obstacles
from generator.springs_file.read import OPTIONAL_FILE, load_springs
from generator.study.designs import design_points, run_count
from generator.study.measures import check_measures
from generator.study.parameter_paths import (
    MASS_INDEX_UNIT,
    Case,
    Number,
    ParameterPath,
    Quantity,
    parse_path,
)
from generator.study.parameters import apply_values, build_case
from generator.study.person_figure import make_person
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
    Uniform,
)
from generator.study.study_tables import (
    MAX_RUNS,
    MEASURE_EXAMPLE,
    MEASURE_ROWS,
    PERSON_ROWS,
    RUN_KEYS,
    SENSITIVITY_ROWS,
    STUDY_KEYS,
    STUDY_SUFFIX,
    check_keys,
    note_failure,
    parse_design,
    parse_kind,
    parse_parameters,
    parse_row,
    parse_table,
    require_keys,
    require_table,
    value_of_file,
)
from generator.text_io import is_file, path_exists
from generator.toml_file.reader import TableReader, parse_document
from generator.toml_file.rows import Number as NumberRow
from generator.tone import ALL, Tone
from springs import SphericalLaw

_FILE_KIND = "study file"
_OTHER_OPTIONS = tuple(key for key, option in RUN_OPTIONS.items() if not option.in_study)
"""Options of `mover simulate` that a study does not have."""

_INDEX_KINDS = (DesignKind.SOBOL, DesignKind.MORRIS, DesignKind.LATIN_HYPERCUBE)

_PLACEHOLDER = Design(DesignKind.LIST)
"""Stands for a design with errors, so that the rest of the file is checked."""


class _Subject(NamedTuple):
    """Model of a study; persons also have their arguments."""

    name: str
    model: Model
    persons: tuple[PersonArguments, ...] = ()


def read_study(path_or_name: str | Path) -> Study:
    """The study in a file or of a shipped name.

    Raises InputError with all diagnostics on any error. Warnings pass.
    """
    return STUDY_FILE.read(path_or_name)


def _parse_study(source: Source, diagnostics: Diagnostics) -> Study | None:
    folder = Path() if source.path is None else source.path.parent
    top = parse_document(source, _FILE_KIND, diagnostics)
    if top is None:
        return None
    if not top.content:
        diagnostics.error("this study is empty", top.header_span, 'begin with `figure = "NAME"`')
        return None
    for key in _OTHER_OPTIONS:
        if key in top.content:
            place = top.spans.key("", 0, key)
            diagnostics.error(f"a study has no `{key}`", place, "use `mover simulate` for it")
    top.reject_unknown_keys((*STUDY_KEYS, *_OTHER_OPTIONS), "study")
    subject = _parse_subject(top, folder)
    plan = parse_plan(top, subject and subject.model.figure, folder)
    kind = parse_kind(top)
    parameters = parse_parameters(top, kind)
    measures = _parse_measures(top, parameters)
    sensitivity = _parse_sensitivity(top, kind)
    design = parse_design(top, kind, parameters, sensitivity, folder)
    if subject is None or plan is None:
        return None
    study = Study(
        name=subject.name,
        model=subject.model,
        plan=plan,
        parameters={name: one for name, one in parameters.items() if one is not None},
        design=design or _PLACEHOLDER,
        measures={name: one for name, one in measures.items() if one is not None},
        persons=subject.persons,
        fall=str(top.content.get("fall", "")),
        stops_edges=_stops_edges(top),
        sensitivity=sensitivity,
        text=source.text,
    )
    _check_paths(study, top)
    if design is not None and len(study.parameters) == len(parameters):
        _check_run_count(study, top)
    _check_measures(study, top)
    return study


STUDY_FILE = FileKind("study", STUDY_SUFFIX, _parse_study, is_shipped=True)


# Figure, person and springs


def _parse_subject(top: TableReader, folder: Path) -> _Subject | None:
    """Return the figure of the file, or of its person."""
    law = RUN_OPTIONS["law"].row.read(top)
    if "person" in top.content:
        for key in ("figure", "springs"):
            if key in top.content:
                hint = {"figure": "leave out one of them", "springs": "write it below `[person]`"}
                message = f"a study of a person has no `{key}`"
                top.diagnostics.error(message, top.spans.key("", 0, key), hint[key])
        return _parse_persons(top, law)
    if "figure" not in top.content:
        hint = 'write `figure = "NAME"`, or `[person]`'
        top.diagnostics.error("this study has no figure", top.header_span, hint)
        return None
    name = top.text("figure")
    if name is None:
        return None
    path = FIGURE_FILE.find(name, folder)
    if not path_exists(path):
        hint = spelling_hint(Path(name).stem, FIGURE_FILE.shipped())
        message = f"there is no file `{shorten(name)}` and no shipped figure of that name"
        top.error("figure", message, hint)
        return None
    figure = value_of_file(top, "figure", FIGURE_FILE.parse_file(path))
    if figure is None:
        return None
    choice = _springs_choice(top, folder)
    key = "figure" if choice is None else "springs"
    springs = value_of_file(top, key, load_springs(figure, path.parent, path.stem, choice, law))
    if springs is None:
        return None
    model = Model(figure, springs, contact_of_figure(figure))
    return _Subject(figure.name or path.stem, model)


def _springs_choice(top: TableReader, folder: Path) -> str | Path | None:
    """Return a choice of springs as `--springs` takes it; a path is relative to the file."""
    choice = top.text("springs")
    if choice is None:
        return None
    path = folder / choice
    is_path = len(Path(choice).parts) > 1 or Path(choice).suffix in (".toml", OPTIONAL_FILE.suffix)
    return path if is_path or is_file(path) else choice


def _parse_persons(top: TableReader, law: SphericalLaw | None) -> _Subject | None:
    """Return the person of `[person]`, or those of `[[person]]`; None if one of them is wrong."""
    if isinstance(top.content["person"], list):
        tables: Sequence[TableReader | None] = top.tables("person", "persons")
    else:
        tables = [parse_table(top, "person")]
    found = [None if table is None else _parse_person(table, top, law) for table in tables]
    subjects = [subject for subject in found if subject is not None]
    if not subjects or len(subjects) < len(found):
        return None
    persons = tuple(person for subject in subjects for person in subject.persons)
    if len(persons) == 1:
        return subjects[0]
    necks = {resolve_neck(person.neck, person.springs) for person in persons}
    if len(necks) > 1:
        top.diagnostics.error(
            "one person has an elastic neck and another a rigid one",
            top.spans.table("person"),
            "give all the same `neck`; without springs it is rigid",
        )
        return None
    return _Subject(f"{len(persons)} persons", subjects[0].model, persons)


def _parse_person(
    table: TableReader, top: TableReader, law: SphericalLaw | None
) -> _Subject | None:
    """Return a person; None, with errors noted, if it is wrong."""
    table.reject_unknown_keys(PERSON_ROWS.keys, PERSON_ROWS.noun)
    require_keys(table, PERSON_ROWS.examples, PERSON_ROWS.noun)
    values = PERSON_ROWS.read(table)
    if not {"sex", "stature", "mass"} <= values.keys():
        return None
    person = PersonArguments(**values)
    try:
        model = make_person(
            person, law=law, with_spheres=_has_props(top), stops_edges=_stops_edges(top)
        )
    except UsageError as failure:
        words = {"a stature": "stature_m", "the hip datum": "hip_datum_deg"}
        words["an elastic neck"] = "neck"
        keys = (key for start, key in words.items() if str(failure).startswith(start))
        table.error(next(keys, "mass_kg"), str(failure))
        return None
    name = f"{person.sex}, {person.stature:g} m, {person.mass:g} kg"
    return _Subject(name, model, (person,))


def _has_props(top: TableReader) -> bool:
    """Return whether the runs have a floor or a scene."""
    return top.content.get("floor") is True or bool(top.content.keys() & {"scene", "fall"})


def _stops_edges(top: TableReader) -> bool:
    """Return whether persons have spheres along their limbs, at which edges of boxes stop.

    Without boxes the bodies of which a parameter changes the size do without them.
    """
    parameters = cast("dict[str, Any]", top.content.get("parameters", {}))
    rows = (cast("dict[str, Any]", row) for row in parameters.values() if isinstance(row, dict))
    texts = str([row.get("path") for row in rows])
    varies_size = bool(re.search(r"person\.(?!hip_datum)", texts))
    fall = top.content.get("fall")
    has_boxes = any(fall == name and one.scene for name, one in FALLS.items())
    return has_boxes or "scene" in top.content or not varies_size


# Measures and sensitivity


def _parse_measures(
    top: TableReader, parameters: Mapping[str, Parameter | None]
) -> dict[str, Measure | None]:
    """Return the measures by name; None, with an error noted, for one that is wrong."""
    table = require_table(top, "measures", MEASURE_EXAMPLE)
    if table is None:
        return {}
    rows = {name: parse_row(table, name, "measure", parameters) for name in table.content}
    return {name: None if row is None else _parse_measure(row, name) for name, row in rows.items()}


def _parse_measure(table: TableReader, name: str) -> Measure | None:
    table.reject_unknown_keys(MEASURE_ROWS.keys, MEASURE_ROWS.noun)
    require_keys(table, MEASURE_ROWS.examples, MEASURE_ROWS.noun)
    values = MEASURE_ROWS.read(table)
    return Measure(name, **values) if len(values) == len(MEASURE_ROWS.rows) else None


def _parse_sensitivity(top: TableReader, kind: DesignKind | None) -> Sensitivity | None:
    """Return the sensitivity indices that are asked for; None without any."""
    table = parse_table(top, "sensitivity")
    if table is None:
        return None
    check_keys(table, SENSITIVITY_ROWS)
    if kind is not None and kind not in _INDEX_KINDS:
        hint = f"the kind is one of {', '.join(_INDEX_KINDS)}; or leave out `[sensitivity]`"
        message = f"sensitivity indices do not follow from a {kind} design"
        table.diagnostics.error(message, table.header_span, hint)
    values = SENSITIVITY_ROWS.read(table)
    if not 0.0 < (confidence := values.get("confidence", Sensitivity.confidence)) < 1.0:
        hint = "0.95 is the default"
        table.error("confidence", f"`confidence` must be between 0 and 1, not {confidence:g}", hint)
    return Sensitivity(**values)


# Checks of the whole study


def _check_paths(study: Study, top: TableReader) -> None:
    """Note unknown paths, two of one quantity, and values that a quantity cannot have."""
    case = Case(study.model, study.plan)
    if len(study.persons) > 1 and not any(
        "person" in parameter.paths for parameter in study.parameters.values()
    ):
        numbers = [*range(1, len(study.persons) + 1)]
        top.diagnostics.error(
            f"no parameter chooses one of the {len(study.persons)} persons",
            top.spans.table("person"),
            f'write `person = {{ path = "person", values = {numbers} }}` below `[parameters]`',
        )
    first: dict[Number, Span] = {}
    for parameter in study.parameters.values():
        place = f"parameters.{parameter.name}"
        for k, text in enumerate(parameter.paths):
            span = top.spans.value(place, 0, "path", k)
            try:
                path = parse_path(
                    text, case, study.persons, falls=bool(study.fall), holds=study.holds
                )
            except MoverError as failure:
                note_failure(top.diagnostics, failure, span)
                continue
            known = next((first[number] for number in path.numbers if number in first), None)
            if known is not None:
                hint = f"the first path to it is in line {known.line}"
                top.diagnostics.error(f"`{path}` changes a quantity a second time", span, hint)
            first = dict.fromkeys(path.numbers, span) | first
            _check_values(study, path, parameter, top)


def _check_values(
    study: Study, path: ParameterPath, parameter: Parameter, top: TableReader
) -> None:
    """Note the first value of a parameter that its quantity cannot have.

    Values far from the centre of a distribution are rare, so that they are a warning only.
    """
    for value, span, is_rare in _sample_values(study, parameter, top):
        try:
            if path.quantity is Quantity.PERSON:
                for person in study.persons:
                    _check_person(person, path, value)
            elif path.quantity in (Quantity.PERSON_NUMBER, Quantity.SEED):
                _check_start(study, path, value)
            else:
                apply_values(Case(study.model, study.plan), [(path, value)])
        except MoverError as failure:
            if is_rare:
                message = f"two standard deviations from the centre, {failure}"
                top.diagnostics.warning(message, span, "runs beyond it fail")
            else:
                note_failure(top.diagnostics, failure, span)
            return


def _check_start(study: Study, path: ParameterPath, value: float) -> None:
    """Raise ModelError for a number of no person, and for an impossible seed."""
    alone = Parameter("", (path.text,), None)
    build_case(replace(study, parameters={"": alone}), [value])


def _check_person(person: PersonArguments, path: ParameterPath, value: float) -> None:
    """Raise UsageError for a measure of a person that is impossible beside the others."""
    stature, mass, name = person.stature, person.mass, path.targets[0].name
    match name:
        case "stature":
            estimate_measures(person.sex, value, mass)
        case "mass" if path.unit == MASS_INDEX_UNIT:
            estimate_measures(person.sex, stature, value * stature**2)
        case "mass":
            estimate_measures(person.sex, stature, value)
        case "hip_datum":
            check_hip_datum(radians(value))
        case _:
            estimate_measures(person.sex, stature, mass, {name: value})


def _sample_values(
    study: Study, parameter: Parameter, top: TableReader
) -> Iterator[tuple[float, Span, bool]]:
    """Yield extreme values of a parameter with their places, and whether they are rare."""
    place = partial(top.spans.value, f"parameters.{parameter.name}", 0)
    match parameter.distribution:
        case Uniform(low=low, high=high):
            yield low, place("low"), False
            yield high, place("high"), False
        case Normal(mean=mean, sd=sd):
            yield mean, place("mean"), False
            yield from ((mean + by * sd, place("sd"), True) for by in (-2.0, 2.0))
        case LogNormal(median=median, factor=factor):
            yield median, place("median"), False
            yield from ((median * factor**by, place("factor"), True) for by in (-2.0, 2.0))
        case Levels(values=values):
            is_list = "values" in top.content["parameters"][parameter.name]
            for key, value in (("low", min(values)), ("high", max(values))):
                span = place("values", values.index(value)) if is_list else place(key)
                yield value, span, False
        case None:
            number = list(top.content["parameters"]).index(parameter.name)
            column = [row[number] for row in study.design.rows]
            span = top.spans.value("design", 0, "file")
            yield from ((value, span, False) for value in sorted(column)[:: len(column) - 1 or 1])


def _check_measures(study: Study, top: TableReader) -> None:
    """Note the measures that no run has, or the reasons why no run can start."""
    obstacles = _start_obstacles(study)
    if obstacles:
        if top.diagnostics.has_errors:
            return
        study = _first_run(study)  # a parameter may set what the figure by itself lacks
        if _start_obstacles(study):
            key = "person" if study.persons else "figure"
            value_of_file(top, key, Parsed[Study](None, obstacles))
            return
    for one in check_measures(study):
        span = top.spans.value(f"measures.{one.measure}", 0, one.key)
        top.diagnostics.error(one.message, span, one.hint)


def _start_obstacles(study: Study) -> tuple[Diagnostic, ...]:
    """Return the reasons why the figure of a study cannot be simulated from its start."""
    obstacles = simulation_obstacles(study.model, study.plan.displacements)
    if obstacles:
        return obstacles
    try:
        tuple(check_measures(study))
    except MoverError as failure:
        message, _, hint = str(failure).partition("; ")
        return (error(message, hint=hint),)
    return ()


def _first_run(study: Study) -> Study:
    """Return a study with the model and the plan of its first run, where that can be built."""
    try:
        case = build_case(study, design_points(study)[0].tolist())
    except (MoverError, ValueError):
        return study
    return replace(study, model=case.model, plan=case.plan)


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


def parse_plan(top: TableReader, figure: Figure | None, folder: Path) -> Plan | None:
    """Return the plan of a study's runs; options with errors, which are noted, have their defaults.

    None without a figure.

    Args:
        top: the file.
        figure: Figure of the study; None if it is wrong.
        folder: folder of the file.
    """
    rows = [one.row for one in STUDY_OPTIONS if not one.is_text and one.key != "law"]
    read = {row.key: row.read(top) for row in rows}  # the springs have read their law
    read["scene"] = _parse_scene(top, folder)
    base = _parse_fall(top, figure)
    of_fall = () if base is None else ("floor", "free_root")
    settings = {key: read.get(key) for key in RUN_KEYS if top.content.get(key, False) is not False}
    if None in (settings.get("start", 0.0), settings.get("stop", 0.0)):
        settings |= dict.fromkeys(_TIMES)
    faults = list(option_faults(settings, RUN_KEYS, "`{}`".format))
    for fault in faults:
        _note(top, fault.keys, fault.sentence)
    options: dict[str, Any] = {}
    try:
        options = plan_fields({key: settings[key] for key in settings if key not in of_fall})
        if not any("stop" in fault.keys for fault in faults):
            Plan(**{key: options[key] for key in _TIMES if key in options})
    except ModelError as failure:
        _note(top, ("floor",), f"{failure}; leave out one of them")
    except ValueError as failure:
        _note(top, _TIMES, str(failure))
    if figure is None:  # only whether they are tables
        for name in ("set", "velocity"):
            parse_table(top, name)
        return None
    if base is None and "fall" in top.content:
        return None
    if base is None:
        options["displacements"] = _parse_start(top, figure, folder)
        free_root = options.get("free_root", False)
        options["velocities"] = _parse_velocities(
            top, figure, options.get("displacements", {}), free_root=free_root
        )
    if "tone" in top.content:
        options["tone"] = _parse_tone(top, figure, folder)
    try:
        return replace(base or Plan(), **options)
    except ValueError as failure:
        if not top.diagnostics.has_errors:
            _note(top, RUN_KEYS, str(failure))
        return None


_TIMES = ("stop", "start", "frame")


def _note(top: TableReader, keys: Sequence[str], sentence: str) -> None:
    """Note an error of options at the first one that the file has; a second clause is the hint."""
    message, hint = re.split("[:;] ", f"{sentence}; ", maxsplit=1)
    key = next(key for key in keys if key in top.content)
    top.error(key, message, hint.removesuffix("; "))


def _parse_fall(top: TableReader, figure: Figure | None) -> Plan | None:
    """Return the plan of a fall of the kind that is stated; None, with an error noted, or without.

    Each run has a start of its own.
    """
    kind = top.text("fall") if "fall" in top.content else None
    if kind is None or figure is None:
        return None
    if kind not in FALLS:
        top.error("fall", f"unknown kind of fall `{shorten(kind)}`", spelling_hint(kind, FALLS))
        return None
    try:
        return fall_plan(figure, kind)
    except MoverError as failure:
        note_failure(top.diagnostics, failure, top.span("fall"))
        return None


def _parse_tone(top: TableReader, figure: Figure, folder: Path) -> Tone | None:
    """Return the tone of a share, a file or a shipped name; None for a share of 0, or an error."""
    value: Any = top.content["tone"]
    if not isinstance(value, str | bool):
        share = NumberRow("tone", 0.0, 1.0).read(top)
        tone = None if share is None else Tone({ALL: share})
    else:
        name = top.text("tone")
        found = None if name is None else TONE_FILE.parse_file(TONE_FILE.find(name, folder))
        tone = found and value_of_file(top, "tone", found)
    if not tone:
        return None
    try:
        tone.righting_shares(figure.joints)
        tone.hold_shares(figure.joints)
    except ModelError as failure:
        note_failure(top.diagnostics, failure, top.span("tone"))
    return tone


def _parse_scene(top: TableReader, folder: Path) -> Scene | None:
    """Return the props of the scene file; None without one or, with errors noted, a wrong one."""
    name = top.text("scene")
    if name is None:
        return None
    return value_of_file(top, "scene", SCENE_FILE.parse_file(SCENE_FILE.find(name, folder)))


def _parse_start(top: TableReader, figure: Figure, folder: Path) -> dict[str, tuple[float, ...]]:
    """Return the initial displacements by joint [rad or m]: of a pose, then those of `[set]`.

    With a pose: of all joints, with closed loops.
    """
    values = _parse_joints(top, "set", settable_joints(figure))
    drawn = {joint: one.displacement for joint, one in figure.joints.items()}
    _refuse_off_curves(top, "set", figure, values, {**drawn, **values})
    name = top.text("pose")
    if name is None:
        return values
    pose = value_of_file(top, "pose", POSE_FILE.parse_file(folder / name, figure))
    if pose is None:
        return values
    tree = build_tree(figure)
    start = {**initial_displacements(tree), **pose}
    start |= {joint: np.array(numbers) for joint, numbers in values.items()}
    try:
        placement = close_loops(tree, start, fixed=set(values or pose))
    except OpenLoopError as failure:
        top.error("pose", str(failure))
        return values
    return {
        joint: tuple(float(value) for value in row)
        for joint, row in placement.displacements.items()
    }


def _parse_velocities(
    top: TableReader,
    figure: Figure,
    displacements: Mapping[str, Sequence[float]],
    *,
    free_root: bool,
) -> dict[str, tuple[float, ...]]:
    """Return the initial rates by joint or free segment [rad/s or m/s]."""
    joints = settable_joints(figure, free_root=free_root)
    free = frozenset(joints.keys() - figure.joints.keys()) if free_root else frozenset[str]()
    rates = _parse_joints(top, "velocity", joints, free)
    drawn = {joint: one.displacement for joint, one in figure.joints.items()}
    _refuse_off_curves(top, "velocity", figure, rates, {**drawn, **displacements}, rates)
    return rates


def _refuse_off_curves(
    top: TableReader,
    name: str,
    figure: Figure,
    stated: Mapping[str, Sequence[float]],
    displacements: Mapping[str, Sequence[float]],
    rates: Mapping[str, Sequence[float]] | None = None,
) -> None:
    """Note an error of each value of a table off the curve that it follows."""
    for joint, fault in follower_faults(figure.joints, stated, displacements, rates):
        top.diagnostics.error(fault, top.spans.key(name, 0, joint), "leave it out, or write 0")


def _parse_joints(
    top: TableReader, name: str, joints: Joints, in_metres: frozenset[str] = frozenset()
) -> dict[str, tuple[float, ...]]:
    """Return numbers by joint [SI], which the table `name` has in deg and cm.

    Args:
        top: the file.
        name: name of the table.
        joints: Joints that can be set, by name.
        in_metres: joints with lengths in m.
    """
    table = parse_table(top, name)
    values: dict[str, tuple[float, ...]] = {}
    for joint in () if table is None else table.content:
        assert table is not None
        if joint not in joints:
            place = table.spans.key(name, 0, joint)
            message = f"the figure has no joint `{shorten(joint)}`"
            table.diagnostics.error(message, place, spelling_hint(joint, joints))
            continue
        own, is_free = joints[joint], joint in in_metres
        chain = own.chain if is_free else own.axes_of(len(table.items(joint) or ()))
        units = [axis.units.displacement for axis in chain]
        if is_free:
            units = ["m" if unit == LENGTH_UNIT else unit for unit in units]
        numbers = table.numbers_in(joint, units)
        if numbers is None:
            continue
        for k, (axis, number) in enumerate(zip(chain, numbers, strict=True)):
            if not displacement_bound(axis).contains(number):
                table.error(joint, "this number is too large", str(displacement_bound(axis)), k)
        values[joint] = numbers if is_free else own.complete(numbers)
    return values
