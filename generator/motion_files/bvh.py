"""A motion as BVH, the hierarchy and rows of numbers that animation programs exchange.

Lengths are centimetres, y is up, the figure faces +z. Angles are degrees, in the order
`Xrotation Yrotation Zrotation`: the orientation of a bone is `Rx Ry Rz`. At rest, with all angles
zero, the figure stands with all its displacements zero.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from generator.losses import Loss, Losses
from generator.motion_files.motion import Clip, unheld
from generator.motion_files.skeleton import Bone, Skeleton, closings, skeleton_of
from generator.names import loss_of_names, plain_names
from generator.rotations import Array, Sequence3
from generator.text_io import write_whole

_PLACES = 6
_CENTIMETRES = 100.0
_EVEN = 1e-6
"""Frames count as equally far apart up to this share of their interval."""

_STILL = 1.0
"""The interval that a motion of one frame is given [s]: some readers divide by it."""

_LEAST_SHIFT = 1e-5
"""A bone is told with its position when its joint moves it by more than this [m]."""

_ANGLES = Sequence3(((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)))
"""Rx Ry Rz, the innermost first."""

_POSITIONS = "Xposition Yposition Zposition"
_ROTATIONS = "Xrotation Yrotation Zrotation"


def write(clip: Clip, path: Path) -> Losses:
    """Write a motion as BVH, whole or not at all.

    Raises:
        OSError: the file cannot be written.
        OtherMotionError: the motion is of another figure.
    """
    skeleton = skeleton_of(clip)
    names = plain_names([*(bone.joint for bone in skeleton.bones), _ground(clip, skeleton)])
    interval, raster, uneven = _raster(clip.times)
    lines = [*_hierarchy(clip, skeleton, names), *_motion(clip, skeleton, interval, raster)]
    write_whole(path, "".join(f"{line}\n" for line in lines))
    start = float(clip.times[0])
    losses = [
        *skeleton.losses(_LEAST_SHIFT),
        uneven,
        Loss(f"the time of the first frame, {start:g} s; the file begins at 0 s")
        if start
        else None,
        loss_of_names(names),
        Loss("shapes, colours, masses and springs, and all segments that do not move"),
        Loss("displacements: the file holds orientations as angles of its own, X Y Z"),
        Loss("where the motion is from, and how the run ended"),
        unheld(clip),
        Loss(f"digits: angles have {_PLACES} decimals of a degree, lengths {_PLACES} of a cm"),
    ]
    return Losses.of("BVH", losses)


def _raster(times: Array) -> tuple[float, Array, Loss | None]:
    """The interval of frames [s], their times [s], and what is lost by their being equally far.

    The last frame of a run may be nearer than the others, and is left out then.
    """
    if len(times) == 1:
        return _STILL, times, None
    steps = np.diff(times)
    interval = float(f"{steps[0]:.12g}")
    even = np.abs(times - times[0] - interval * np.arange(len(times))) <= _EVEN * interval
    if np.all(even):
        return interval, times, None
    if np.all(even[:-1]) and steps[-1] < interval:
        said = f"the last frame, at {times[-1]:g} s: it is not {interval:g} s after the one before"
        return interval, times[:-1], Loss(said)
    interval = float(times[-1] - times[0]) / (len(times) - 1)
    raster = times[0] + interval * np.arange(len(times))
    raster[-1] = times[-1]
    said = f"the times of the frames: they are {interval:g} s apart here, what moves interpolated"
    return interval, raster, Loss(said)


def _hierarchy(clip: Clip, skeleton: Skeleton, names: dict[str, str]) -> Iterator[str]:
    """The bones, each within the one that it hangs from; several roots hang from the ground."""
    yield "HIERARCHY"
    several = len(skeleton.roots) > 1
    lead = 1 if several else 0
    if several:
        yield f"ROOT {names[_ground(clip, skeleton)]}"
        yield from ("{", "\tOFFSET 0.0 0.0 0.0", f"\tCHANNELS 3 {_ROTATIONS}")
    bases = {bone.base for bone in skeleton.bones}
    for bone, ends in closings(skeleton.bones):
        outer = "\t" * (bone.depth + lead)
        inner = f"{outer}\t"
        yield f"{outer}{'JOINT' if bone.depth + lead else 'ROOT'} {names[bone.joint]}"
        placed = _has_positions(skeleton, bone)
        # Readers differ in whether positions count from the offset, so there is one or the other.
        offset = np.zeros(3) if placed else bone.offset
        channels = f"6 {_POSITIONS} {_ROTATIONS}" if placed else f"3 {_ROTATIONS}"
        yield from (f"{outer}{{", f"{inner}OFFSET {_row(offset * _CENTIMETRES)}")
        yield f"{inner}CHANNELS {channels}"
        if bone.segment not in bases:
            tip = _tip(clip, skeleton, bone) * _CENTIMETRES
            yield from (f"{inner}End Site", f"{inner}{{", f"{inner}\tOFFSET {_row(tip)}")
            yield f"{inner}}}"
        for k in range(ends):
            yield "\t" * (bone.depth + lead - k) + "}"
    if several:
        yield "}"


def _ground(clip: Clip, skeleton: Skeleton) -> str:
    """The name of the ground: that of the root's segment, unless a joint has it."""
    name = clip.figure.root.segment
    return f"{name}_ground" if any(bone.joint == name for bone in skeleton.bones) else name


def _has_positions(skeleton: Skeleton, bone: Bone) -> bool:
    """Whether a bone is told with its position: where it moves, and the root of all."""
    return bone.farthest_shift > _LEAST_SHIFT or (bone.depth == 0 and len(skeleton.roots) == 1)


def _tip(clip: Clip, skeleton: Skeleton, bone: Bone) -> Array:
    """The site of a bone's segment that is farthest from its origin, seen from there at rest."""
    segment = clip.figure.segments[bone.segment]
    points = [site.pose_in_segment[:3, 3] for site in segment.sites.values()]
    seen = skeleton.shape_at_rest(segment, np.array(points).reshape(-1, 3)) - bone.centre
    return max(seen, key=lambda point: float(np.linalg.norm(point)), default=np.zeros(3))


def _motion(clip: Clip, skeleton: Skeleton, interval: float, raster: Array) -> Iterator[str]:
    yield "MOTION"
    yield f"Frames: {len(raster)}"
    yield f"Frame Time: {interval!r}"
    columns = [np.zeros((len(raster), 3))] if len(skeleton.roots) > 1 else []
    for bone in skeleton.bones:
        turns, shifts = _at(clip.times, bone, raster)
        if _has_positions(skeleton, bone):
            columns.append((bone.offset + shifts) * _CENTIMETRES)
        columns.append(np.degrees(_angles(turns)))
    for row in np.concatenate(columns, axis=1):
        yield _row(row)


def _at(times: Array, bone: Bone, raster: Array) -> tuple[Array, Array]:
    """Turns (k, 3, 3) and shifts (k, 3) [m] of a bone at the times of a raster (k,)."""
    count = len(raster)
    if np.array_equal(times[:count], raster):
        return bone.turns[:count], bone.shifts[:count]
    turned = Slerp(times, Rotation.from_matrix(bone.turns))(raster).as_matrix()
    shifted = [np.interp(raster, times, bone.shifts[:, k]) for k in range(3)]
    return np.asarray(turned, dtype=float), np.stack(shifted, axis=1)


def _angles(turns: Array) -> Array:
    """X, Y, Z angles of orientations (n, 3, 3), continuous from frame to frame, (n, 3) [rad]."""
    near: Array | None = None
    rows: list[Array] = []
    for turn in turns:
        near = _ANGLES.angles(turn, near)
        rows.append(near[::-1])
    return np.array(rows)


def _row(values: Sequence[float] | Array) -> str:
    rounded = np.round(np.asarray(values, dtype=float), _PLACES) + 0.0
    return " ".join(f"{value:.{_PLACES}f}" for value in rounded.tolist())
