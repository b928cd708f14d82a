"""Joints driven by a motion from a file: a table, or an action file."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from generator.diagnostics import Fault, InputError, error, errors_among, nearest, warning
from generator.drive import Drive
from generator.figure import Figure
from generator.input_files.drives import (
    OVERSHOOT_HINT,
    DrivesReading,
    examine_drives,
    overshoot_said,
)
from generator.motion_files.action import ActionFile, read_action

ACTION_SUFFIX = ".action"


def read_drives(path: str | Path, figure: Figure, only: Sequence[str] = ()) -> Mapping[str, Drive]:
    """What a file drives of a figure.

    Args:
        path: of an action file, or else of a table.
        figure: whose joints are driven.
        only: names of the joints to drive; all that the file moves when there are none.

    Raises:
        InputError: with all faults.
    """
    return drives_with_warnings(path, figure, only).drives


def drives_with_warnings(
    path: str | Path, figure: Figure, only: Sequence[str] = ()
) -> DrivesReading:
    """What `read_drives` reads, with warnings where a spline leaves the range of its rows by much.

    Raises InputError as it does.
    """
    if Path(path).suffix.lower() == ACTION_SUFFIX:
        drives = drives_of(read_action(path), figure, only, str(path))
        told = [
            warning(f"{path}: {overshoot_said(joint, one.column, one)}", hint=OVERSHOOT_HINT)
            for joint, drive in drives.items()
            for one in drive.overshoots()
        ]
        return DrivesReading(drives, tuple(told))
    reading = examine_drives(path, figure, only)
    if errors_among(reading.faults):
        raise InputError(reading.faults)
    _insist_on(only, reading.drives, str(path))
    return reading


def drives_of(
    action: ActionFile, figure: Figure, only: Sequence[str] = (), name: str = "<action>"
) -> Mapping[str, Drive]:
    """What an action file drives of a figure; `name` is what errors call it.

    Raises InputError as `read_drives` does.
    """
    asked = {
        joint: chain
        for joint, chain in action.chains.items()
        if chain and (not only or joint in only)
    }
    faults: list[Fault] = []
    if len(action.times) < 2:
        faults.append(error(f"{name}: a motion of one frame drives nothing"))
    for joint, chain in asked.items():
        known = figure.joints.get(joint)
        if known is None:
            hint = f"{nearest(joint, figure.joints)}; `--driven` chooses some of its joints"
            faults.append(error(f"{name}: the figure has no joint `{joint}`", hint=hint))
        elif known.chain != chain:
            faults.append(error(f"{name}: joint `{joint}` has other axes than in the figure"))
        elif any(factor.kind != "R" for factor in chain):
            said = f"{name}: joint `{joint}` slides, and only turns can be driven in a simulation"
            faults.append(error(said))
    if faults:
        raise InputError(faults)
    _insist_on(only, asked, name)
    drives: dict[str, Drive] = {}
    for joint in asked:
        try:
            drives[joint] = Drive(action.times, action.displacements[joint])
        except ValueError as failure:
            faults.append(error(f"{name}: joint `{joint}`: {failure}"))
    if faults:
        raise InputError(faults)
    return drives


def _insist_on(only: Sequence[str], found: Mapping[str, object], name: str) -> None:
    """Raise InputError for joints that were asked for and are not in the file."""
    faults = [
        error(f"{name}: joint `{joint}` is not driven there", hint=nearest(joint, found))
        for joint in only
        if joint not in found
    ]
    if faults:
        raise InputError(faults)
