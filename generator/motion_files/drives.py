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
    """What a file drives of a figure.

    Args:
        path: of an action file, or else of a table.
        figure: whose joints are driven.
        joints: names of the joints to drive; all that the file moves when there are none.

    Raises:
        InputError: with all faults.
    """
    return read_drives_with_warnings(path, figure, joints)[0]


def read_drives_with_warnings(
    path: str | Path, figure: Figure, joints: Sequence[str] = ()
) -> tuple[Mapping[str, Drive], tuple[Diagnostic, ...]]:
    """What `read_drives` reads, with warnings where a spline leaves the range of its rows by much.

    Raises InputError as it does.
    """
    if Path(path).suffix.lower() == ACTION_SUFFIX:
        drives = drives_from_action(read_action(path), figure, joints, str(path))
        told = [
            warning(f"{path}: {describe_overshoot(joint, one.column, one)}", hint=OVERSHOOT_HINT)
            for joint, drive in drives.items()
            for one in drive.overshoots()
        ]
        return drives, tuple(told)
    reading = parse_drives_file(path, figure, joints)
    drives = reading.require_value()
    _require_driven(joints, drives, str(path))
    return drives, reading.diagnostics


def drives_from_action(
    action: ActionFile, figure: Figure, joints: Sequence[str] = (), name: str = "<action>"
) -> Mapping[str, Drive]:
    """What an action file drives of a figure; `name` is what errors call it.

    Raises InputError as `read_drives` does.
    """
    asked = {
        joint: chain
        for joint, chain in action.chains.items()
        if chain and (not joints or joint in joints)
    }
    faults: list[Diagnostic] = []
    if len(action.times) < 2:
        faults.append(error(f"{name}: a motion of one frame drives nothing"))
    for joint, chain in asked.items():
        known = figure.joints.get(joint)
        if known is None:
            hint = f"{spelling_hint(joint, figure.joints)}; `--driven` chooses some of its joints"
            faults.append(error(f"{name}: the figure has no joint `{joint}`", hint=hint))
        elif known.chain != chain:
            faults.append(error(f"{name}: joint `{joint}` has other axes than in the figure"))
        elif any(factor.kind is not AxisKind.ROTATION for factor in chain):
            said = f"{name}: joint `{joint}` slides, and only turns can be driven in a simulation"
            faults.append(error(said))
    if faults:
        raise InputError(faults)
    _require_driven(joints, asked, name)
    drives: dict[str, Drive] = {}
    for joint in asked:
        try:
            drives[joint] = Drive(action.times, action.displacements[joint])
        except ValueError as failure:
            faults.append(error(f"{name}: joint `{joint}`: {failure}"))
    if faults:
        raise InputError(faults)
    return drives


def _require_driven(required: Sequence[str], found: Mapping[str, object], name: str) -> None:
    """Raise InputError for joints that were asked for and are not in the file."""
    faults = [
        error(f"{name}: joint `{joint}` is not driven there", hint=spelling_hint(joint, found))
        for joint in required
        if joint not in found
    ]
    if faults:
        raise InputError(faults)
