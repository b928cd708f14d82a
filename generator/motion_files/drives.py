"""Joints driven by a motion from a file: a table of drives, or a motion that can be read."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from generator.diagnostics import (
    Diagnostic,
    InputError,
    error,
    spelling_hint,
    warning,
)
from generator.drive import Drive
from generator.figure import Figure, Joint, JointAxis, is_rotation
from generator.input_files.coordinates import coordinates_of_figure
from generator.input_files.drives import DRIVES_FILE, OVERSHOOT_HINT, describe_overshoot
from generator.motion_files.action import ActionFile, read_action
from generator.motion_files.npz import read_npz
from generator.motion_files.opensim_table import COORDINATES_FILE
from generator.rotations import Array
from generator.text_io import parse_source


def read_drives(
    path: str | Path, figure: Figure, joints: Sequence[str] = ()
) -> Mapping[str, Drive]:
    """Read the drives of a figure from a file.

    Args:
        path: path of a motion (`.action`, `.npz`, `.mot`, `.sto`), or else of a table.
        figure: figure whose joints are driven.
        joints: names of the joints to drive; empty for all in the file.

    Raises:
        InputError: with all errors.
    """
    return read_drives_with_warnings(path, figure, joints)[0]


def read_drives_with_warnings(
    path: str | Path, figure: Figure, joints: Sequence[str] = ()
) -> tuple[Mapping[str, Drive], tuple[Diagnostic, ...]]:
    """Read drives as `read_drives` does, with warnings: splines that overshoot their rows, columns.

    Raises InputError.
    """
    suffix, found = Path(path).suffix.lower(), ()
    if suffix == ".action":
        drives = drives_from_action(read_action(path), figure, joints, str(path))
    elif suffix == ".npz":
        header, run = read_npz(path)
        action = ActionFile(header, run.chains, run.times, run.displacements)
        drives = drives_from_action(action, figure, joints, str(path))
    elif suffix in (".mot", ".sto"):
        drives, found = _read_coordinate_drives(path, figure, joints)
    else:
        reading = DRIVES_FILE.parse_file(path, figure, joints)
        drives = reading.require_value()
        _require_driven(joints, drives, str(path))
        return drives, reading.diagnostics
    overshoots = [
        warning(f"{path}: {describe_overshoot(joint, one.column, one)}", hint=OVERSHOOT_HINT)
        for joint, drive in drives.items()
        for one in drive.overshoots()
    ]
    return drives, (*found, *overshoots)


def _read_coordinate_drives(
    path: str | Path, figure: Figure, joints: Sequence[str]
) -> tuple[Mapping[str, Drive], tuple[Diagnostic, ...]]:
    """Read the drives in OpenSim's table, with warnings: displacements with a column are driven."""
    table = COORDINATES_FILE.parse_file(path).require_value()
    chains = table.chains(figure)
    coordinates = coordinates_of_figure(figure)
    parsed = parse_source(
        table.source, lambda _, found: table.displacements(chains, found, coordinates)
    )
    values: dict[str, dict[int, Array]] = {}
    for (joint, k), column in sorted(parsed.require_value().items()):
        values.setdefault(joint, {})[k] = column
    columns = {
        joint: _Columns(chains[joint], tuple(some), np.stack(list(some.values()), axis=1))
        for joint, some in values.items()
    }
    return _drives(table.times, columns, figure, joints, str(path)), parsed.diagnostics


def drives_from_action(
    action: ActionFile, figure: Figure, joints: Sequence[str] = (), name: str = "<action>"
) -> Mapping[str, Drive]:
    """Return the drives of an action file, which errors call `name`.

    Raises InputError as `read_drives` does.
    """
    columns = {
        joint: _Columns(chain, None, action.displacements[joint])
        for joint, chain in action.chains.items()
        if chain
    }
    return _drives(action.times, columns, figure, joints, name)


class _Columns(NamedTuple):
    """Displacements of a joint: its chain, their numbers in it from 0 (None for all), their values.

    The values have the shape (n, number of displacements) [rad or m].
    """

    chain: tuple[JointAxis, ...]
    coordinates: tuple[int, ...] | None
    values: Array


def _without_followers(columns: _Columns, joint: Joint | None) -> _Columns:
    """Return columns without displacements that follow others in the figure's file."""
    if joint is None or not joint.followers or joint.chain != columns.chain:
        return columns
    own = range(len(columns.chain)) if columns.coordinates is None else columns.coordinates
    kept = [k for k, place in enumerate(own) if place in joint.free_places]
    return _Columns(columns.chain, tuple(own[k] for k in kept), columns.values[:, kept])


def _drives(
    times: Array, columns: Mapping[str, _Columns], figure: Figure, joints: Sequence[str], name: str
) -> Mapping[str, Drive]:
    """Return the drives of the joints asked for, or of all; raises InputError."""
    selected = {
        joint: _without_followers(some, figure.joints.get(joint))
        for joint, some in columns.items()
        if not joints or joint in joints
    }
    diagnostics: list[Diagnostic] = []
    if len(times) < 2:
        diagnostics.append(error(f"{name}: a motion of one frame drives nothing"))
    for joint, (chain, coordinates, _) in selected.items():
        known = figure.joints.get(joint)
        driven = chain if coordinates is None else [chain[k] for k in coordinates]
        if known is None:
            hint = f"`--driven` selects joints; {spelling_hint(joint, figure.joints)}"
            diagnostics.append(error(f"{name}: the figure has no joint `{joint}`", hint=hint))
        elif known.chain != chain:
            diagnostics.append(error(f"{name}: joint `{joint}` has other axes than in the figure"))
        elif not all(is_rotation(factor.kind) for factor in driven):
            message = f"{name}: joint `{joint}` has a translation, and only rotations can be driven"
            diagnostics.append(error(f"{message} or fitted"))
    if diagnostics:
        raise InputError(diagnostics)
    _require_driven(joints, selected, name)
    drives: dict[str, Drive] = {}
    for joint, (_, coordinates, values) in selected.items():
        try:
            drives[joint] = Drive(times, values, coordinates)
        except ValueError as failure:
            diagnostics.append(error(f"{name}: joint `{joint}`: {failure}"))
    if diagnostics:
        raise InputError(diagnostics)
    return drives


def _require_driven(required: Sequence[str], driven: Mapping[str, object], name: str) -> None:
    """Raise InputError for requested joints that are not in the file."""
    diagnostics = [
        error(f"{name}: joint `{joint}` is not driven there", hint=spelling_hint(joint, driven))
        for joint in required
        if joint not in driven
    ]
    if diagnostics:
        raise InputError(diagnostics)
