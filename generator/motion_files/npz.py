"""All arrays of a run in one `.npz`, bit for bit: `numpy.load` reads it, and so does this program.

An array is named after its place in the recording: `times`, `poses/SEGMENT`, `displacements/JOINT`,
`energy/KIND` ...; `about` is a text in JSON with everything else. Reading is the exact inverse of
writing.
"""

import json
import zlib
from collections.abc import Container, Iterable, Mapping
from io import BytesIO
from math import prod
from pathlib import Path
from tokenize import TokenError
from typing import Any
from zipfile import ZIP_DEFLATED, ZIP_STORED, BadZipFile, ZipFile, ZipInfo

import numpy as np
from numpy.lib import format as npy

from generator.contact.record import ContactRecord, HeadImpact, Overlap, PartContact, SegmentContact
from generator.contact.scene import NO_SCENE, Scene
from generator.contact_file.parts import Evidence
from generator.diagnostics import InputError, ModelError, error
from generator.figure import AxisKind, JointAxis
from generator.input_files.scene import SCENE_FILE, write_scene
from generator.losses import Loss, Losses
from generator.motion_files.motion import FigureMotion, Header, first_frame_interval, lost_props
from generator.recording import (
    CONTACT_ENERGY_KINDS,
    ENERGY_KINDS,
    TONE_ENERGY_KIND,
    WHOLE_RECORDING,
    Accuracy,
    Ending,
    Outcome,
    Recording,
)
from generator.rotations import Array
from generator.run_options import Integrator
from generator.text_io import open_regular_file, os_error_reason, write_atomic

VERSION = 1
METADATA_KEY = "about"

JOINT_FIELDS = ("displacements", "velocities", "rotation_vectors", "reactions", "passive_torques")
DRIVE_TORQUE_FIELD = "drive_torques"
POSE_FIELD = "poses"
FRAME_ERROR_FIELD = "error_by_frame"
ENERGY_FIELD = "energy"
CONTACT_FORCE_FIELD = "contact_forces"
CONTACT_DEPTH_FIELD = "contact_depths"
PART_FORCE_FIELD = "part_forces"
FORCE_POINT_FIELD = "force_points"
GROUND_REACTION_FIELD = "ground_reaction"
EXTREME_FORCE_FIELD = "extreme_forces"
SENSITIVITY_FIELDS = ("sensitivity", "height_sensitivity")

MAY_BE_INFINITE = (FRAME_ERROR_FIELD, *SENSITIVITY_FIELDS)
"""Arrays whose numbers need not be finite."""


def write(motion: FigureMotion, path: Path) -> Losses:
    """Write a motion with all its data, whole or not at all.

    Raises:
        OSError: the file cannot be written.
        ModelError: the motion is of another figure, or its run left out parts of the recording.
    """
    arrays: dict[str, Array] = {"times": motion.times}
    arrays |= _prefix_names(POSE_FIELD, motion.poses)
    run = motion.recording
    if run is not None and run.recorded != WHOLE_RECORDING:
        raise ModelError("an .npz file needs a whole recording: simulate without `record`")
    if run is None:
        arrays |= _prefix_names("displacements", motion.displacements)
    else:
        for field in JOINT_FIELDS:
            arrays |= _prefix_names(field, getattr(run, field))
        arrays |= _prefix_names(DRIVE_TORQUE_FIELD, run.drive_torques)
        arrays |= {"centre_of_mass": run.centre_of_mass, FRAME_ERROR_FIELD: run.accuracy.by_frame}
        arrays |= _prefix_names(ENERGY_FIELD, run.energy)
        arrays |= _contact_arrays(run.contact)
    about = _metadata(motion)
    stream = BytesIO()
    np.savez_compressed(
        stream, allow_pickle=False, **arrays, **{METADATA_KEY: np.array(json.dumps(about))}
    )
    write_atomic(path, stream.getvalue())
    losses = [Loss("the figure: its segments, masses and shapes; the names are there")]
    if about["scene"] is None and (loss := lost_props(motion)) is not None:
        losses.append(loss)
    if (size := sum(array.nbytes for array in arrays.values())) > MAX_RUN_BYTES:
        losses.append(Loss(f"a way back into this program: {_size_text(size)}"))
    return Losses.collect("npz", losses)


def _prefix_names(field: str, arrays: Mapping[str, Array]) -> dict[str, Array]:
    return {f"{field}/{name}": array for name, array in arrays.items()}


def _contact_arrays(contact: ContactRecord | None) -> dict[str, Array]:
    """Return the arrays of a contact record by name."""
    if contact is None:
        return {}
    arrays = _prefix_names(CONTACT_FORCE_FIELD, contact.forces)
    arrays |= _prefix_names(CONTACT_DEPTH_FIELD, contact.depths)
    arrays |= _prefix_names(PART_FORCE_FIELD, contact.part_forces)
    arrays |= _prefix_names(FORCE_POINT_FIELD, contact.force_points)
    arrays[GROUND_REACTION_FIELD] = contact.ground_reaction
    if contact.extreme_forces is not None:
        arrays[EXTREME_FORCE_FIELD] = contact.extreme_forces
    return arrays | {name: getattr(contact, name) for name in _sensitivities(contact)}


def _sensitivities(contact: ContactRecord) -> list[str]:
    """Names of the sensitivities that were computed."""
    return [name for name in SENSITIVITY_FIELDS if getattr(contact, name) is not None]


def _metadata(motion: FigureMotion) -> dict[str, Any]:
    """Return the data that are not arrays; numbers that JSON does not have are strings."""
    header, run = motion.header, motion.recording
    about: dict[str, Any] = {
        "npz": VERSION,
        "figure": header.figure,
        "sha256": header.sha256,
        "springs": header.springs,
        "law": header.law,
        "outcome": header.outcome.value,
        "message": header.message,
        "scene": _scene_text(motion.scene),
        "chains": {
            name: [[f.kind.value, *f.axis] for f in chain] for name, chain in motion.chains.items()
        },
    }
    if run is not None:
        about["run"] = _run_metadata(run)
    return about


def _scene_text(scene: Scene) -> str | None:
    """Return the text of a scene file, "" without props; None for a scene that no file can hold."""
    try:
        return write_scene(scene) if scene.props or scene.covers else ""
    except ValueError:
        return None


def _run_metadata(run: Recording) -> dict[str, Any]:
    accuracy, outcome = run.accuracy, run.outcome
    return {
        "springs": run.springs,
        "law": run.law,
        "ending": outcome.ending.value,
        "message": outcome.message,
        "last_time": outcome.last_time,
        "joint": outcome.joint,
        "estimate": _json_number(accuracy.estimate),
        "asked": _json_number(accuracy.tolerance),
        "held_until": _json_number(accuracy.tolerance_met_until),
        "step": accuracy.step,
        "steps": accuracy.steps,
        "constraint_drift": _json_number(run.constraint_drift),
        "strayed": _json_number(run.prescribed_motion_drift),
        "wall_time": run.wall_time,
        "integrator": run.integrator.value,
        "integrator_reason": run.integrator_reason,
        "agreement_with_exudyn": run.agreement_with_exudyn,
        "build_time": run.build_time,
        "contact": None if run.contact is None else _contact_metadata(run.contact),
    }


def _contact_metadata(contact: ContactRecord) -> dict[str, Any]:
    """Return the data of a contact record that are not arrays."""
    overlap, part = contact.overlap, contact.max_depth_part
    return {
        "segments": {
            name: {
                "first_time": _json_number(segment.first_time),
                **_json_numbers(segment, _SEGMENT_NUMBERS),
                "impulse": [_json_number(part) for part in segment.impulse],
            }
            for name, segment in contact.segments.items()
        },
        **_json_numbers(contact, _CONTACT_NUMBERS),
        "max_depth_segment": contact.max_depth_segment,
        **({"max_depth_part": part} if part != contact.max_depth_segment else {}),
        **_json_numbers(contact, ("weight_carried", "impact_shift")),
        "sensitivities": _sensitivities(contact),
        "overlap": None
        if overlap is None
        else [_json_number(overlap.depth), *overlap[1:3], _json_number(overlap.time)],
        "head_injury": {name: _json_number(value) for name, value in contact.head_injury.items()},
        "heads": {
            name: [*_json_numbers(head, _HEAD_NUMBERS).values()]
            for name, head in contact.heads.items()
        },
        "parts": {name: _part_metadata(part) for name, part in contact.parts.items()},
    }


def _part_metadata(part: PartContact) -> dict[str, Any]:
    return {
        "first_time": _json_number(part.first_time),
        **_json_numbers(part, _SEGMENT_NUMBERS),
        "body_weights": _json_number(part.body_weights),
        "band": list(part.band),
        "class": part.evidence.value,
        "within": part.within,
    }


_SEGMENT_NUMBERS = ("impact_speed", "peak_force", "peak_time")
_HEAD_NUMBERS = ("peak_acceleration", "peak_time", "head_weights")
_CONTACT_NUMBERS = ("max_force", "max_force_time", "max_depth", "creep", "dissipated")


def _json_number(number: float | None) -> float | str | None:
    return number if number is None or np.isfinite(number) else repr(float(number))


_INVALID_ARCHIVE_ERRORS = (
    BadZipFile,
    ValueError,
    EOFError,
    KeyError,
    zlib.error,
    NotImplementedError,
    MemoryError,
    TokenError,
    RuntimeError,
    OverflowError,
)
"""Exceptions of zipfile and numpy for an invalid or truncated file."""

MAX_RUN_BYTES = 400_000_000
"""Bytes of all arrays of the largest run that is read: some 80,000 frames of the prototype."""

MAX_ORTHONORMALITY_ERROR = 1e-6
"""Largest difference of R^T R of a pose from the identity."""

Chains = dict[str, tuple[JointAxis, ...]]


def read_npz(path: str | Path) -> tuple[Header, Recording]:
    """Read the header and the run in a `.npz` of this program.

    Raises InputError, with all errors, if the file is invalid or truncated, lacks an array, or
    holds numbers that are not finite (except in `error_by_frame`) or poses that are not rigid.
    """
    arrays = _load_arrays(Path(path))
    about = _read_metadata(arrays, Path(path))
    try:
        chains = _chains(about["chains"])
        if "run" not in about:
            raise _invalid_file(
                path, ["it holds a motion without a run; name the file that it was made from"]
            )
        times = arrays.get("times", np.zeros(0))
        if times.ndim != 1 or times.size == 0 or not np.all(np.diff(times) > 0.0):
            raise _invalid_file(path, ["the array `times` is not one row that increases"])
        contact = about["run"].get("contact")  # files without it are older than contact
        problems = list(_structure_errors(arrays, chains, contact, times.size))
        problems = problems or list(_value_errors(arrays))
        if problems:
            raise _invalid_file(path, problems)
        recording = _recording(arrays, about, chains)
        return _header(about, times), recording
    except (KeyError, TypeError, ValueError, AttributeError):
        raise _invalid_file(
            path, [f"its `{METADATA_KEY}` is not what this program writes"]
        ) from None


def _invalid_file(path: str | Path, messages: Iterable[str]) -> InputError:
    return InputError([error(f"`{path}` is not a run: {each}") for each in messages])


def _load_arrays(path: Path) -> dict[str, np.ndarray[Any, np.dtype[Any]]]:
    """All arrays of the file by name."""
    try:
        with open_regular_file(path) as file:
            if file.peek(len(npy.MAGIC_PREFIX)).startswith(npy.MAGIC_PREFIX):
                raise _invalid_file(path, ["it is one array, not an archive of them"])
            with ZipFile(file) as archive:
                members = archive.infolist()
                if (size := sum(member.file_size for member in members)) > MAX_RUN_BYTES:
                    raise _invalid_file(path, [_size_text(size)])
                return {
                    member.filename.removesuffix(".npy"): _load_array(archive, member)
                    for member in members
                }
    except OSError as failure:
        message = f"`{path}` cannot be read: {os_error_reason(failure)}"
        raise InputError([error(message)]) from None
    except _INVALID_ARCHIVE_ERRORS:
        raise _invalid_file(path, ["it is not an archive of numpy, or is truncated"]) from None


def _load_array(archive: ZipFile, member: ZipInfo) -> np.ndarray[Any, np.dtype[Any]]:
    """Load one array. Raises ValueError if it declares another size than it has."""
    if member.compress_type not in (ZIP_STORED, ZIP_DEFLATED):
        raise ValueError("numpy writes no such compression")
    with archive.open(member) as stream:
        version = npy.read_magic(stream)
        read_header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        shape, _, kind = read_header(stream)
        if kind.hasobject or stream.tell() + prod(shape) * kind.itemsize != member.file_size:
            raise ValueError("the header does not fit the array")
        stream.seek(0)
        return npy.read_array(stream, allow_pickle=False)


def _size_text(size: int) -> str:
    largest = MAX_RUN_BYTES // 1_000_000
    return f"its arrays take {size / 1e6:,.0f} MB, and at most {largest} MB are read"


def _read_metadata(arrays: Mapping[str, np.ndarray[Any, Any]], path: Path) -> dict[str, Any]:
    """Parse the metadata of the file."""
    if METADATA_KEY not in arrays:
        raise _invalid_file(path, [f"it has no array `{METADATA_KEY}`, which says what it is"])
    try:
        about = json.loads(str(arrays[METADATA_KEY]))
        version = about["npz"]
    except (ValueError, KeyError, TypeError, RecursionError):
        raise _invalid_file(
            path, [f"its `{METADATA_KEY}` is not what this program writes"]
        ) from None
    if version != VERSION:
        raise _invalid_file(path, [f"its version is {version!r}, and this program reads {VERSION}"])
    return about


def _chains(chains: Mapping[str, list[list[Any]]]) -> Chains:
    return {
        name: tuple(
            JointAxis(AxisKind(kind), (float(x), float(y), float(z))) for kind, x, y, z in factors
        )
        for name, factors in chains.items()
    }


def _energy_kinds(names: Container[str]) -> tuple[str, ...]:
    """Kinds of energy of a run; live simulations have those of contact without its record."""
    kinds = [kind for kind in CONTACT_ENERGY_KINDS if f"{ENERGY_FIELD}/{kind}" in names]
    tone = [TONE_ENERGY_KIND] if f"{ENERGY_FIELD}/{TONE_ENERGY_KIND}" in names else []
    return (*ENERGY_KINDS, *tone, *(CONTACT_ENERGY_KINDS if kinds else ()))


def _shapes(
    chains: Chains, contact: Mapping[str, Any] | None, kinds: Iterable[str], count: int
) -> dict[str, tuple[int, ...]]:
    """The shape of every array but those of the segments."""
    widths = {"rotation_vectors": 3, "reactions": 6, "passive_torques": 3}
    shapes: dict[str, tuple[int, ...]] = {
        f"{field}/{name}": (count, widths.get(field, len(chain)))
        for field in JOINT_FIELDS
        for name, chain in chains.items()
    }
    if contact is not None:
        kinds = {**dict.fromkeys(kinds), **dict.fromkeys(ENERGY_KINDS + CONTACT_ENERGY_KINDS)}
        shapes |= {f"{CONTACT_FORCE_FIELD}/{name}": (count, 3) for name in contact["segments"]}
        shapes |= {f"{CONTACT_DEPTH_FIELD}/{name}": (count,) for name in contact["segments"]}
        shapes[GROUND_REACTION_FIELD] = (count, 6)
        shapes |= {
            name: (count,) for name in SENSITIVITY_FIELDS if name in contact["sensitivities"]
        }
    shapes |= {f"{ENERGY_FIELD}/{kind}": (count,) for kind in kinds}
    return shapes | {"centre_of_mass": (count, 3), FRAME_ERROR_FIELD: (count,)}


def _structure_errors(
    arrays: Mapping[str, np.ndarray[Any, Any]],
    chains: Chains,
    contact: Mapping[str, Any] | None,
    count: int,
) -> Iterable[str]:
    """Yield errors of missing arrays and wrong shapes."""
    shapes = _shapes(chains, contact, _energy_kinds(arrays), count)
    if contact is not None and EXTREME_FORCE_FIELD in arrays:
        shapes[EXTREME_FORCE_FIELD] = (3, 4)
    segments = _names(arrays, POSE_FIELD)
    shapes |= {f"{POSE_FIELD}/{name}": (count, 4, 4) for name in segments}
    for field in (PART_FORCE_FIELD, FORCE_POINT_FIELD):
        shapes |= {f"{field}/{name}": (count, 3) for name in _names(arrays, PART_FORCE_FIELD)}
    for name in _names(arrays, DRIVE_TORQUE_FIELD):
        if name in chains:
            shapes[f"{DRIVE_TORQUE_FIELD}/{name}"] = (count, len(chains[name]))
        else:
            yield f"it drives joint `{name}`, which it does not have"
    if not segments:
        yield f"it has no arrays `{POSE_FIELD}/SEGMENT`"
    for name, shape in shapes.items():
        if name not in arrays:
            yield f"it has no array `{name}`"
        elif arrays[name].shape != shape:
            yield f"the array `{name}` has shape {arrays[name].shape}, not {shape}"
        elif arrays[name].dtype != np.float64:
            yield f"the array `{name}` holds {arrays[name].dtype}, not float64"


def _value_errors(arrays: Mapping[str, np.ndarray[Any, Any]]) -> Iterable[str]:
    """Yield errors of values: numbers that are not finite, poses that are not rigid."""
    for name, array in arrays.items():
        if name in (METADATA_KEY, *MAY_BE_INFINITE) or array.dtype != np.float64:
            continue
        if not np.all(np.isfinite(array)):
            yield f"the array `{name}` holds numbers that are not finite"
        elif name.startswith(f"{POSE_FIELD}/") and not _are_rigid(array):
            yield f"the array `{name}` holds poses that are not rigid"


def _are_rigid(poses: Array) -> bool:
    """Return True if all poses, shape (n, 4, 4), are rigid."""
    turns = poses[:, :3, :3]
    if np.abs(turns).max() > 1.0 + MAX_ORTHONORMALITY_ERROR:
        return False  # the products below would overflow
    square = np.swapaxes(turns, -1, -2) @ turns
    return bool(
        np.abs(square - np.eye(3)).max() <= MAX_ORTHONORMALITY_ERROR
        and np.all(np.linalg.det(turns) > 0.0)
        and np.all(poses[:, 3] == (0.0, 0.0, 0.0, 1.0))
    )


def _names(arrays: Mapping[str, np.ndarray[Any, Any]], field: str) -> list[str]:
    """The names behind a field, of all arrays that have it."""
    lead = f"{field}/"
    return [name.removeprefix(lead) for name in arrays if name.startswith(lead)]


def _arrays_in_field(
    arrays: Mapping[str, Array], field: str, names: Iterable[str]
) -> dict[str, Array]:
    return {name: arrays[f"{field}/{name}"] for name in names}


def _recording(arrays: Mapping[str, Array], metadata: dict[str, Any], chains: Chains) -> Recording:
    run = metadata["run"]
    by_joint: dict[str, Any] = {
        field: _arrays_in_field(arrays, field, chains) for field in JOINT_FIELDS
    }
    outcome = Outcome(Ending(run["ending"]), run["message"], run["last_time"], run["joint"])
    accuracy = Accuracy(
        _number(run["estimate"]),
        _number(run["asked"]),
        float(run["held_until"]),
        float(run["step"]),
        int(run["steps"]),
        arrays[FRAME_ERROR_FIELD],
    )
    return Recording(
        times=arrays["times"],
        poses=_arrays_in_field(arrays, POSE_FIELD, _names(arrays, POSE_FIELD)),
        chains=chains,
        **by_joint,
        centre_of_mass=arrays["centre_of_mass"],
        energy=_arrays_in_field(arrays, ENERGY_FIELD, _energy_kinds(arrays)),
        outcome=outcome,
        accuracy=accuracy,
        constraint_drift=float(run["constraint_drift"]),
        prescribed_motion_drift=float(run["strayed"]),
        drive_torques=_arrays_in_field(
            arrays, DRIVE_TORQUE_FIELD, _names(arrays, DRIVE_TORQUE_FIELD)
        ),
        wall_time=float(run["wall_time"]),
        build_time=float(run["build_time"]),
        springs=run["springs"],
        law=run["law"],
        # Files without these are older than the compiled integrator.
        integrator=Integrator(run.get("integrator", "exudyn")),
        integrator_reason=str(run.get("integrator_reason", "")),
        agreement_with_exudyn=run.get("agreement_with_exudyn"),
        contact=_contact(arrays, run.get("contact")),
        scene=_scene(metadata.get("scene")),
    )


def _scene(text: str | None) -> Scene:
    """Return the scene of a text; none without one. Raises ValueError for one that is wrong."""
    scene = SCENE_FILE.parse_text(text).value if text else NO_SCENE
    if scene is None:
        raise ValueError("not the text of a scene")
    return scene


def _contact(arrays: Mapping[str, Array], about: Mapping[str, Any] | None) -> ContactRecord | None:
    if about is None:
        return None
    segments: dict[str, SegmentContact] = {}
    for name, segment in about["segments"].items():
        x, y, z = map(float, segment["impulse"])
        numbers = _floats(segment, _SEGMENT_NUMBERS)
        segments[name] = SegmentContact(
            _number(segment["first_time"]), impulse=(x, y, z), **numbers
        )
    overlap = None
    if about["overlap"] is not None:
        depth, segment, other, time = about["overlap"]
        overlap = Overlap(float(depth), segment, other, float(time))
    sensitivity, height_sensitivity = (
        arrays[name] if name in about["sensitivities"] else None for name in SENSITIVITY_FIELDS
    )
    return ContactRecord(
        forces=_arrays_in_field(arrays, CONTACT_FORCE_FIELD, segments),
        ground_reaction=arrays[GROUND_REACTION_FIELD],
        depths=_arrays_in_field(arrays, CONTACT_DEPTH_FIELD, segments),
        segments=segments,
        **_floats(about, _CONTACT_NUMBERS),
        max_depth_segment=about["max_depth_segment"],
        max_depth_part=about.get("max_depth_part", ""),
        weight_carried=_number(about["weight_carried"]),
        impact_shift=_number(about["impact_shift"]),
        sensitivity=sensitivity,
        height_sensitivity=height_sensitivity,
        extreme_forces=arrays.get(EXTREME_FORCE_FIELD),
        overlap=overlap,
        head_injury={name: float(value) for name, value in about["head_injury"].items()},
        # Files without these are older than parts of the body.
        heads={
            name: HeadImpact(*map(float, numbers))
            for name, numbers in about.get("heads", {}).items()
        },
        parts={name: _part(part) for name, part in about.get("parts", {}).items()},
        part_forces=_arrays_in_field(arrays, PART_FORCE_FIELD, _names(arrays, PART_FORCE_FIELD)),
        force_points=_arrays_in_field(arrays, FORCE_POINT_FIELD, _names(arrays, PART_FORCE_FIELD)),
    )


def _part(about: Mapping[str, Any]) -> PartContact:
    low, high = map(float, about["band"])
    return PartContact(
        _number(about["first_time"]),
        **_floats(about, _SEGMENT_NUMBERS),
        body_weights=_number(about["body_weights"]),
        band=(low, high),
        evidence=Evidence(about["class"]),
        within=about["within"],
    )


def _floats(about: Mapping[str, Any], fields: Iterable[str]) -> dict[str, Any]:
    """Return some numbers by the field that holds them."""
    return {field: float(about[field]) for field in fields}


def _json_numbers(owner: object, fields: Iterable[str]) -> dict[str, Any]:
    """Return the numbers of some fields as JSON has them."""
    return {field: _json_number(getattr(owner, field)) for field in fields}


def _number(value: float | str | None) -> float | None:
    return None if value is None else float(value)


def _header(metadata: dict[str, Any], times: Array) -> Header:
    return Header(
        figure=metadata["figure"],
        sha256=metadata["sha256"],
        start=float(times[0]),
        stop=float(times[-1]),
        frame_interval=first_frame_interval(times),
        springs=metadata["springs"],
        law=metadata["law"],
        outcome=Ending(metadata["outcome"]),
        message=metadata["message"],
    )
