"""Options of the runs of a study: keys of its file named as the options of `mover simulate`."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from generator.contact.scene import Scene
from generator.diagnostics import ModelError, MoverError, shorten, spelling_hint
from generator.figure import Figure, follower_faults
from generator.figure_file.values import displacement_bound
from generator.input_files.pose import POSE_FILE
from generator.input_files.scene import SCENE_FILE
from generator.input_files.tone import TONE_FILE
from generator.kinematics.free_root import Joints, settable_joints
from generator.kinematics.loops import OpenLoopError, close_loops
from generator.kinematics.placement import initial_displacements
from generator.kinematics.tree import build_tree
from generator.motion_files.action import LENGTH_UNIT
from generator.run_options import STUDY_OPTIONS
from generator.simulation.falls import FALLS, fall_plan
from generator.simulation.plan import Plan, option_faults, plan_fields
from generator.study.study_tables import (
    RUN_KEYS,
    note_failure,
    parse_table,
    value_of_file,
)
from generator.toml_file.reader import TableReader
from generator.toml_file.rows import Number
from generator.tone import ALL, Tone


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
        share = Number("tone", 0.0, 1.0).read(top)
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
