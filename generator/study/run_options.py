"""Options of the runs of a study: keys of its file named as the options of `mover simulate`."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from generator.diagnostics import shorten, spelling_hint
from generator.figure import Figure
from generator.figure_file.values import displacement_bound
from generator.input_files.pose import POSE_FILE
from generator.input_files.scene import SCENE_FILE
from generator.kinematics.free_root import Chains, settable_chains
from generator.kinematics.loops import OpenLoopError, close_loops
from generator.kinematics.placement import initial_displacements
from generator.kinematics.tree import build_tree
from generator.motion_files.action import LENGTH_UNIT
from generator.scene import FLOOR, Scene, floor_prop
from generator.simulation.plan import MAX_FRAMES, Plan
from generator.study.study_tables import (
    FRICTION,
    GRAVITY,
    RUN_FLAGS,
    RUN_NUMBERS,
    adopt,
    parse_table,
    relative_path,
)
from generator.text_io import is_file
from generator.toml_file.reader import TableReader
from springs import SpringSet
from springs.contact import DEFAULT_SURFACE


def parse_plan(
    top: TableReader, figure: Figure | None, springs: SpringSet | None, folder: Path
) -> Plan | None:
    """Return the plan of a study's runs; options with errors, which are noted, have their defaults.

    None without a figure.

    Args:
        top: the file.
        figure: of the study; None, as for `springs`, if it is wrong.
        springs: of the figure.
        folder: of the file.
    """
    read = {row.key: row.read(top) for row in RUN_NUMBERS}
    numbers = {key: value for key, value in read.items() if value is not None}
    free_root, floor, self_contact = (row.read(top) or False for row in RUN_FLAGS)
    options: dict[str, Any] = {key: value for key, value in numbers.items()}
    gravity = GRAVITY.read(top)
    if gravity is not None:
        options["gravity"] = gravity
    _check_times(top, numbers)
    if "step" in top.content and "tolerance" in top.content:
        hint = "a fixed step has no error control"
        top.error("tolerance", "`step` and `tolerance` exclude each other", hint)
    free_root = free_root or floor or "scene" in top.content
    options["free_root"] = free_root
    scene = _parse_scene(top, Plan(gravity=options.get("gravity", Plan.gravity)), folder)
    height = numbers.get("height")
    if height is not None and not free_root:
        top.error("height", "a height needs a free figure", "write `floor = true`, for example")
    elif height is not None and floor and height < 0.0:
        top.error("height", "the figure would start below the floor", "0 is on the floor")
    elif height is None and (floor or "scene" in top.content):
        options["height"] = 0.0
    if self_contact and not (floor or "scene" in top.content):
        top.error("self_contact", "contact needs a floor or a scene", "write `floor = true`")
    if figure is not None:
        options["displacements"] = _parse_start(top, figure, folder)
        options["velocities"] = _parse_velocities(top, figure, free_root=free_root)
    else:  # only whether they are tables
        for name in ("set", "velocity"):
            parse_table(top, name)
    if figure is None or springs is None:
        return None
    try:
        return Plan(**options, scene=scene, self_contact=self_contact, springs=springs)
    except ValueError as failure:
        if not top.diagnostics.has_errors:
            top.diagnostics.error(str(failure), top.span("stop"))
        return None


def _check_times(top: TableReader, numbers: Mapping[str, float]) -> None:
    """Note the errors of times that do not fit each other."""
    wrong = [key for key in ("start", "stop", "frame") if key in top.content and key not in numbers]
    start, stop, frame = (numbers.get(k, getattr(Plan, k)) for k in ("start", "stop", "frame"))
    if {"start", "stop"} & set(wrong):
        return
    if stop <= start:
        key = "stop" if "stop" in numbers else "start"
        top.error(key, f"the stop time {stop:g} s is not after the start {start:g} s")
    elif not wrong and (stop - start) / frame > MAX_FRAMES:
        key = next(key for key in ("frame", "stop", "start") if key in numbers)
        hint = "use a longer `frame` or an earlier `stop`"
        top.error(key, f"a run has more than {MAX_FRAMES:,} frames", hint)


def _parse_scene(top: TableReader, plan: Plan, folder: Path) -> Scene:
    """Return the floor and the props around the figure."""
    floor = top.content.get("floor") is True
    props, name = Scene(), top.text("scene")
    if name is not None:
        path = relative_path(name, folder)
        props = adopt(top, "scene", SCENE_FILE.parse_file(path if is_file(path) else name)) or props
    friction = FRICTION.read(top)
    if "friction" in top.content and not floor:
        hint = "write `floor = true`; in a scene file each surface has its own"
        top.error("friction", "friction needs a floor", hint)
    if not floor:
        return props
    if any(prop.name == FLOOR for prop in props.props):
        top.error("floor", f"the scene has a prop `{FLOOR}` already", "leave out one of them")
        return props
    surface = DEFAULT_SURFACE if friction is None else replace(DEFAULT_SURFACE, friction=friction)
    return Scene((floor_prop(plan.up, surface), *props.props))


def _parse_start(top: TableReader, figure: Figure, folder: Path) -> dict[str, tuple[float, ...]]:
    """Return the initial displacements by joint [rad or m]: of a pose, then those of `[set]`.

    With a pose: of all joints, with closed loops.
    """
    values = _parse_joints(top, "set", settable_chains(figure))
    name = top.text("pose")
    if name is None:
        return values
    pose = adopt(top, "pose", POSE_FILE.parse_file(relative_path(name, folder), figure))
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
    top: TableReader, figure: Figure, *, free_root: bool
) -> dict[str, tuple[float, ...]]:
    """Return the initial rates by joint or free segment [rad/s or m/s]."""
    chains = settable_chains(figure, free_root=free_root)
    free = frozenset(chains.keys() - figure.joints.keys()) if free_root else frozenset[str]()
    return _parse_joints(top, "velocity", chains, free)


def _parse_joints(
    top: TableReader, name: str, chains: Chains, in_metres: frozenset[str] = frozenset()
) -> dict[str, tuple[float, ...]]:
    """Return numbers by joint [SI], which the table `name` has in deg and cm.

    Args:
        top: the file.
        name: of the table.
        chains: by joint.
        in_metres: joints with lengths in m.
    """
    table = parse_table(top, name)
    values: dict[str, tuple[float, ...]] = {}
    for joint in () if table is None else table.content:
        assert table is not None
        if joint not in chains:
            place = table.spans.key(name, 0, joint)
            message = f"the figure has no joint `{shorten(joint)}`"
            table.diagnostics.error(message, place, spelling_hint(joint, chains))
            continue
        chain = chains[joint]
        units = [axis.units.displacement for axis in chain]
        if joint in in_metres:
            units = ["m" if unit == LENGTH_UNIT else unit for unit in units]
        numbers = table.numbers_in(joint, units)
        if numbers is None:
            continue
        for k, (axis, number) in enumerate(zip(chain, numbers, strict=True)):
            if not displacement_bound(axis).contains(number):
                table.error(joint, "this number is too large", str(displacement_bound(axis)), k)
        values[joint] = numbers
    return values
