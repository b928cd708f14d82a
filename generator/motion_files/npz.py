"""All arrays of a run in one `.npz`, bit for bit: `numpy.load` reads it, and so does this program.

An array is named after its place in the recording: `times`, `poses/SEGMENT`, `displacements/JOINT`,
`energy/KIND` ...; `about` is a text in JSON with all that is no array.

Reading a run from a `.npz`: the inverse of writing one, bit for bit.
"""

import json
import zlib
from collections.abc import Iterable, Mapping
from io import BytesIO
from pathlib import Path
from typing import Any, cast
from zipfile import BadZipFile

import numpy as np
from numpy.lib.npyio import NpzFile

from generator.diagnostics import Fault, InputError, error
from generator.figure import Factor
from generator.losses import Loss, Losses
from generator.motion_files.motion import Clip, Header, interval_of
from generator.recording import ENERGY_KINDS, Accuracy, Ending, Outcome, Recording
from generator.rotations import Array
from generator.text_io import reason_of, write_whole

VERSION = 1
ABOUT = "about"

BY_JOINT = ("displacements", "velocities", "rotation_vectors", "reactions", "passive_torques")
BY_DRIVEN_JOINT = "drive_torques"
BY_SEGMENT = "poses"
BY_FRAME = "error_by_frame"
ENERGY = "energy"


def write(clip: Clip, path: Path) -> Losses:
    """Write a motion with all that is known of it, whole or not at all.

    Raises:
        OSError: the file cannot be written.
        OtherMotionError: the motion is of another figure.
    """
    arrays: dict[str, Array] = {"times": clip.times}
    arrays |= _named_arrays(BY_SEGMENT, clip.poses)
    run = clip.recording
    if run is None:
        arrays |= _named_arrays("displacements", clip.displacements)
    else:
        for field in BY_JOINT:
            arrays |= _named_arrays(field, getattr(run, field))
        arrays |= _named_arrays(BY_DRIVEN_JOINT, run.drive_torques)
        arrays |= {"centre_of_mass": run.centre_of_mass, BY_FRAME: run.accuracy.by_frame}
        arrays |= _named_arrays(ENERGY, run.energy)
    stream = BytesIO()
    np.savez_compressed(
        stream, allow_pickle=False, **arrays, **{ABOUT: np.array(json.dumps(_about_text(clip)))}
    )
    write_whole(path, stream.getvalue())
    return Losses(
        "npz", (Loss("the figure: its segments, masses and shapes; the names are there"),)
    )


def _named_arrays(field: str, arrays: Mapping[str, Array]) -> dict[str, Array]:
    return {f"{field}/{name}": array for name, array in arrays.items()}


def _about_text(clip: Clip) -> dict[str, Any]:
    """All that is no array; numbers that JSON does not have are words."""
    header, run = clip.header, clip.recording
    about: dict[str, Any] = {
        "npz": VERSION,
        "figure": header.figure,
        "sha256": header.sha256,
        "springs": header.springs,
        "law": header.law,
        "outcome": header.outcome.value,
        "message": header.message,
        "chains": {name: [[f.kind, *f.axis] for f in chain] for name, chain in clip.chains.items()},
    }
    if run is not None:
        about["run"] = _about_run(run)
    return about


def _about_run(run: Recording) -> dict[str, Any]:
    accuracy, outcome = run.accuracy, run.outcome
    return {
        "springs": run.springs,
        "law": run.law,
        "ending": outcome.ending.value,
        "message": outcome.message,
        "last_time": outcome.last_time,
        "joint": outcome.joint,
        "estimate": _word(accuracy.estimate),
        "asked": _word(accuracy.asked),
        "held_until": _word(accuracy.held_until),
        "step": accuracy.step,
        "steps": accuracy.steps,
        "constraint_drift": _word(run.constraint_drift),
        "strayed": _word(run.strayed),
        "wall_time": run.wall_time,
        "build_time": run.build_time,
    }


def _word(number: float | None) -> float | str | None:
    return number if number is None or np.isfinite(number) else repr(float(number))


_BROKEN = (BadZipFile, ValueError, EOFError, KeyError, zlib.error, NotImplementedError, MemoryError)
"""What numpy raises for a file that is none, or not whole."""

RIGID = 1e-6
"""So far may R^T R of a pose be from the identity."""

Chains = dict[str, tuple[Factor, ...]]


def read_npz(path: str | Path) -> tuple[Header, Recording]:
    """The run in a `.npz` of this program, and where it is from.

    Raises InputError, with all faults, when the file is none, is not whole, lacks an array, or
    holds numbers that are not finite (but for `error_by_frame`) or poses that are not rigid.
    """
    arrays = _arrays(Path(path))
    about = _about(arrays, Path(path))
    try:
        chains = _chains(about["chains"])
        if "run" not in about:
            raise _wrong(path, ["it is from an action file, and holds no run; convert that one"])
        times = arrays.get("times", np.zeros(0))
        if times.ndim != 1 or times.size == 0 or not np.all(np.diff(times) > 0.0):
            raise _wrong(path, ["the array `times` is not one row that increases"])
        faults = list(_faults(arrays, chains, times.size))
        faults = faults or list(_doubts(arrays))
        if faults:
            raise _wrong(path, faults)
        recording = _recording(arrays, about, chains)
        return _header(about, times), recording
    except (KeyError, TypeError, ValueError, AttributeError):
        raise _wrong(path, [f"its `{ABOUT}` is not what this program writes"]) from None


def _wrong(path: str | Path, said: Iterable[str]) -> InputError:
    return InputError([error(f"`{path}` is no run: {each}") for each in said])


def _arrays(path: Path) -> dict[str, np.ndarray[Any, np.dtype[Any]]]:
    """All arrays of the file by name."""
    try:
        loaded = np.load(path, allow_pickle=False)
        if not isinstance(loaded, NpzFile):
            raise _wrong(path, ["it is one array, not an archive of them"])
        archive = cast("NpzFile[Any]", loaded)
        with archive:
            return {name: archive[name] for name in archive.files}
    except OSError as failure:
        raise InputError([_unreadable(path, failure)]) from None
    except _BROKEN:
        raise _wrong(path, ["it is no archive of numpy, or not whole"]) from None


def _unreadable(path: Path, failure: OSError) -> Fault:
    return error(f"`{path}` cannot be read: {reason_of(failure)}")


def _about(arrays: Mapping[str, np.ndarray[Any, Any]], path: Path) -> dict[str, Any]:
    """What the file says in words."""
    if ABOUT not in arrays:
        raise _wrong(path, [f"it has no array `{ABOUT}`, which says what it is"])
    try:
        about = json.loads(str(arrays[ABOUT]))
        version = about["npz"]
    except (ValueError, KeyError, TypeError, RecursionError):
        raise _wrong(path, [f"its `{ABOUT}` is not what this program writes"]) from None
    if version != VERSION:
        raise _wrong(path, [f"its version is {version!r}, and this program reads {VERSION}"])
    return about


def _chains(said: Mapping[str, list[list[Any]]]) -> Chains:
    return {
        name: tuple(
            Factor("R" if kind == "R" else "T", (float(x), float(y), float(z)))
            for kind, x, y, z in factors
        )
        for name, factors in said.items()
    }


def _shapes(chains: Chains, count: int) -> dict[str, tuple[int, ...]]:
    """The shape of every array but those of the segments."""
    widths = {"rotation_vectors": 3, "reactions": 6, "passive_torques": 3}
    shapes: dict[str, tuple[int, ...]] = {
        f"{field}/{name}": (count, widths.get(field, len(chain)))
        for field in BY_JOINT
        for name, chain in chains.items()
    }
    shapes |= {f"{ENERGY}/{kind}": (count,) for kind in ENERGY_KINDS}
    return shapes | {"centre_of_mass": (count, 3), BY_FRAME: (count,)}


def _faults(
    arrays: Mapping[str, np.ndarray[Any, Any]], chains: Chains, count: int
) -> Iterable[str]:
    """What is missing, and what has another shape than it must."""
    shapes = _shapes(chains, count)
    segments = _names(arrays, BY_SEGMENT)
    shapes |= {f"{BY_SEGMENT}/{name}": (count, 4, 4) for name in segments}
    for name in _names(arrays, BY_DRIVEN_JOINT):
        if name in chains:
            shapes[f"{BY_DRIVEN_JOINT}/{name}"] = (count, len(chains[name]))
        else:
            yield f"it drives joint `{name}`, which it does not have"
    if not segments:
        yield f"it has no arrays `{BY_SEGMENT}/SEGMENT`"
    for name, shape in shapes.items():
        if name not in arrays:
            yield f"it has no array `{name}`"
        elif arrays[name].shape != shape:
            yield f"the array `{name}` has shape {arrays[name].shape}, not {shape}"
        elif arrays[name].dtype != np.float64:
            yield f"the array `{name}` holds {arrays[name].dtype}, not float64"


def _doubts(arrays: Mapping[str, np.ndarray[Any, Any]]) -> Iterable[str]:
    """What has the right shape and cannot be: numbers that are none, poses that are not rigid."""
    for name, array in arrays.items():
        if name in (ABOUT, BY_FRAME) or array.dtype != np.float64:
            continue
        if not np.all(np.isfinite(array)):
            yield f"the array `{name}` holds numbers that are not finite"
        elif name.startswith(f"{BY_SEGMENT}/") and not _are_rigid(array):
            yield f"the array `{name}` holds poses that are no rotation and shift"


def _are_rigid(poses: Array) -> bool:
    """Whether poses, shape (n, 4, 4), each turn and shift alone."""
    turns = poses[:, :3, :3]
    if np.abs(turns).max() > 1.0 + RIGID:
        return False  # the products below would overflow
    square = np.swapaxes(turns, -1, -2) @ turns
    return bool(
        np.abs(square - np.eye(3)).max() <= RIGID
        and np.all(np.linalg.det(turns) > 0.0)
        and np.all(poses[:, 3] == (0.0, 0.0, 0.0, 1.0))
    )


def _names(arrays: Mapping[str, np.ndarray[Any, Any]], field: str) -> list[str]:
    """The names behind a field, of all arrays that have it."""
    lead = f"{field}/"
    return [name.removeprefix(lead) for name in arrays if name.startswith(lead)]


def _named(arrays: Mapping[str, Array], field: str, names: Iterable[str]) -> dict[str, Array]:
    return {name: arrays[f"{field}/{name}"] for name in names}


def _recording(arrays: Mapping[str, Array], about: dict[str, Any], chains: Chains) -> Recording:
    run = about["run"]
    joints = {field: _named(arrays, field, chains) for field in BY_JOINT}
    outcome = Outcome(Ending(run["ending"]), run["message"], run["last_time"], run["joint"])
    accuracy = Accuracy(
        _number(run["estimate"]),
        _number(run["asked"]),
        float(run["held_until"]),
        float(run["step"]),
        int(run["steps"]),
        arrays[BY_FRAME],
    )
    return Recording(
        times=arrays["times"],
        poses=_named(arrays, BY_SEGMENT, _names(arrays, BY_SEGMENT)),
        chains=chains,
        displacements=joints["displacements"],
        velocities=joints["velocities"],
        rotation_vectors=joints["rotation_vectors"],
        reactions=joints["reactions"],
        passive_torques=joints["passive_torques"],
        centre_of_mass=arrays["centre_of_mass"],
        energy=_named(arrays, ENERGY, ENERGY_KINDS),
        outcome=outcome,
        accuracy=accuracy,
        constraint_drift=float(run["constraint_drift"]),
        strayed=float(run["strayed"]),
        drive_torques=_named(arrays, BY_DRIVEN_JOINT, _names(arrays, BY_DRIVEN_JOINT)),
        wall_time=float(run["wall_time"]),
        build_time=float(run["build_time"]),
        springs=run["springs"],
        law=run["law"],
    )


def _number(said: float | str | None) -> float | None:
    return None if said is None else float(said)


def _header(about: dict[str, Any], times: Array) -> Header:
    return Header(
        figure=about["figure"],
        sha256=about["sha256"],
        start=float(times[0]),
        stop=float(times[-1]),
        frame=interval_of(times),
        springs=about["springs"],
        law=about["law"],
        outcome=Ending(about["outcome"]),
        message=about["message"],
    )
