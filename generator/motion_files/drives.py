"""Joints driven by a motion from a file: a table, or an action file."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from generator.diagnostics import (
    Diagnostic,
    InputError,
    error,
    spelling_hint,
    warning,
)
from generator.drive import Drive
from generator.figure import AxisKind, Figure
from generator.input_files.drives import (
    OVERSHOOT_HINT,
    describe_overshoot,
    parse_drives_file,
)
from generator.motion_files.action import ActionFile, read_action

ACTION_SUFFIX = ".action"


def read_drives(
    path: str | Path, figure: Figure, joints: Sequence[str] = ()
) -> Mapping[str, Drive]:
    """Read the drives of a figure from a file.

    Args:
        path: of an action file, or else of a table.
        figure: whose joints are driven.
        joints: names of the joints to drive; empty for all in the file.

    Raises:
        InputError: with all errors.
    """
    return read_drives_with_warnings(path, figure, joints)[0]


def read_drives_with_warnings(
    path: str | Path, figure: Figure, joints: Sequence[str] = ()
) -> tuple[Mapping[str, Drive], tuple[Diagnostic, ...]]:
    """Read drives as `read_drives` does, with warnings about splines that overshoot their rows.

    Raises InputError.
    """
    if Path(path).suffix.lower() == ACTION_SUFFIX:
        drives = drives_from_action(read_action(path), figure, joints, str(path))
        warnings = [
            warning(f"{path}: {describe_overshoot(joint, one.column, one)}", hint=OVERSHOOT_HINT)
            for joint, drive in drives.items()
            for one in drive.overshoots()
        ]
        return drives, tuple(warnings)
    reading = parse_drives_file(path, figure, joints)
    drives = reading.require_value()
    _require_driven(joints, drives, str(path))
    return drives, reading.diagnostics


def drives_from_action(
    action: ActionFile, figure: Figure, joints: Sequence[str] = (), name: str = "<action>"
) -> Mapping[str, Drive]:
    """Return the drives of an action file, which errors call `name`.

    Raises InputError as `read_drives` does.
    """
    selected = {
        joint: chain
        for joint, chain in action.chains.items()
        if chain and (not joints or joint in joints)
    }
    diagnostics: list[Diagnostic] = []
    if len(action.times) < 2:
        diagnostics.append(error(f"{name}: a motion of one frame drives nothing"))
    for joint, chain in selected.items():
        known = figure.joints.get(joint)
        if known is None:
            hint = f"{spelling_hint(joint, figure.joints)}; `--driven` chooses some of its joints"
            diagnostics.append(error(f"{name}: the figure has no joint `{joint}`", hint=hint))
        elif known.chain != chain:
            diagnostics.append(error(f"{name}: joint `{joint}` has other axes than in the figure"))
        elif any(factor.kind is not AxisKind.ROTATION for factor in chain):
            message = f"{name}: joint `{joint}` has a translation, and only rotations can be driven"
            diagnostics.append(error(message))
    if diagnostics:
        raise InputError(diagnostics)
    _require_driven(joints, selected, name)
    drives: dict[str, Drive] = {}
    for joint in selected:
        try:
            drives[joint] = Drive(action.times, action.displacements[joint])
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
