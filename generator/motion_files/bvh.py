"""A motion as BVH, the hierarchy and rows of numbers that animation programs exchange.

Lengths are centimetres, or another unit by `scale`; y is up, the figure faces +z. Angles are
degrees, in the order `Xrotation Yrotation Zrotation`: the orientation of a bone is `Rx Ry Rz`. At
rest, with all angles zero, the figure stands with all its displacements zero.
"""

from collections.abc import Iterator, Sequence
from math import ceil, isfinite, log10
from pathlib import Path

import numpy as np

from generator.diagnostics import UsageError
from generator.identifiers import plain_names, renaming_loss
from generator.losses import Effect, Loss, Losses
from generator.motion_files.motion import FigureMotion, late_start, lost_props, unrepresented
from generator.motion_files.resample import resample
from generator.motion_files.skeleton import Bone, Skeleton, bones_with_block_ends, build_skeleton
from generator.rotations import Array, RotationSequence
from generator.text_io import write_atomic

_MIN_DECIMALS = 6
_METRE_DECIMALS = 8
"""Decimals of lengths in metres; a shorter unit needs fewer."""

CENTIMETRES_PER_METRE = 100.0
"""Default scale: the unit of length of most programs that read BVH is the centimetre."""

MAX_SCALE = 1e9
"""Largest scale, and the inverse of the smallest: beyond them digits overflow."""

_MAX_INTERVAL_DEVIATION = 1e-6
"""Largest deviation of uniform frame times, relative to their interval."""

_SINGLE_FRAME_INTERVAL = 1.0
"""Interval in the file of a single frame [s]: some readers divide by it."""

_MIN_TRANSLATION = 1e-5
"""Translation of a bone above which its position is written [m]."""

_XYZ_SEQUENCE = RotationSequence(((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)))
"""Rx Ry Rz, the innermost first."""

_POSITIONS = "Xposition Yposition Zposition"
_ROTATIONS = "Xrotation Yrotation Zrotation"


def write(motion: FigureMotion, path: Path, scale: float = CENTIMETRES_PER_METRE) -> Losses:
    """Write a motion as BVH, whole or not at all.

    Args:
        motion: the motion.
        path: path of the file.
        scale: units of length of the file in a metre: 100 for centimetres, 1 for metres.

    Raises:
        UsageError: the scale is not positive, or beyond `MAX_SCALE`.
        OSError: the file cannot be written.
        ModelError: the motion is of another figure.
    """
    if not (isfinite(scale) and scale > 0.0):
        raise UsageError(f"a scale of {scale:g} units per metre: it must be positive")
    if not 1.0 / MAX_SCALE <= scale <= MAX_SCALE:
        raise UsageError(
            f"a scale of {scale:g} units per metre: it must be from {1.0 / MAX_SCALE:g} to "
            f"{MAX_SCALE:g}"
        )
    uniform, count, interval, uneven = _uniform_motion(motion)
    skeleton = build_skeleton(uniform)
    names = plain_names([*(bone.joint for bone in skeleton.bones), _ground_name(motion, skeleton)])
    decimals = _decimals(scale)
    lines = [
        *_hierarchy(motion, skeleton, names, scale),
        *_motion(skeleton, count, interval, scale),
    ]
    write_atomic(path, "".join(f"{line}\n" for line in lines))
    losses = [
        *skeleton.losses(_MIN_TRANSLATION),
        uneven,
        late_start(motion),
        renaming_loss(names),
        Loss("shapes, colours, masses and springs, and all segments that do not move"),
        Loss("displacements: the file holds orientations as angles of its own, X Y Z"),
        Loss("where the motion is from, and how the run ended", effect=Effect.DESCRIPTION),
        lost_props(motion),
        unrepresented(motion),
        Loss(
            f"digits: numbers have {decimals} decimals, angles in deg, lengths in {_unit(scale)}",
            effect=Effect.ROUNDING,
        ),
    ]
    return Losses.collect("BVH", losses)


def _decimals(scale: float) -> int:
    """Return the number of decimals at a scale."""
    return max(_MIN_DECIMALS, ceil(_METRE_DECIMALS - log10(scale)))


def _unit(scale: float) -> str:
    """Return the unit of length of a scale, as a phrase."""
    names = {1.0: "m", CENTIMETRES_PER_METRE: "cm", 1000.0: "mm"}
    return names.get(scale, f"1/{scale:g} m")


def _uniform_motion(motion: FigureMotion) -> tuple[FigureMotion, int, float, Loss | None]:
    """Return a motion with uniform frames, how many of them, their interval [s], and the loss.

    A last frame after a shorter interval is left out; other motions are resampled.
    """
    times = motion.times
    if times.size == 1:
        return motion, 1, _SINGLE_FRAME_INTERVAL, None
    steps = np.diff(times)
    interval = float(f"{steps[0]:.12g}")
    even = (
        np.abs(times - times[0] - interval * np.arange(times.size))
        <= _MAX_INTERVAL_DEVIATION * interval
    )
    if np.all(even):
        return motion, times.size, interval, None
    if np.all(even[:-1]) and steps[-1] < interval:
        message = (
            f"the last frame, at {times[-1]:g} s: it is not {interval:g} s after the one before"
        )
        return motion, times.size - 1, interval, Loss(message)
    interval = float(times[-1] - times[0]) / (times.size - 1)
    message = (
        f"the times of the frames: they are {interval:g} s apart here, what moves interpolated"
    )
    return resample(motion, 1.0 / interval), times.size, interval, Loss(message)


def _hierarchy(
    motion: FigureMotion, skeleton: Skeleton, names: dict[str, str], scale: float
) -> Iterator[str]:
    """Yield the bones, each within its parent; several roots are within a bone of the ground."""
    yield "HIERARCHY"
    decimals = _decimals(scale)
    several = len(skeleton.roots) > 1
    lead = 1 if several else 0
    if several:
        yield f"ROOT {names[_ground_name(motion, skeleton)]}"
        yield from ("{", "\tOFFSET 0.0 0.0 0.0", f"\tCHANNELS 3 {_ROTATIONS}")
    bases = {bone.parent for bone in skeleton.bones}
    for bone, ends in bones_with_block_ends(skeleton.bones):
        outer = "\t" * (bone.depth + lead)
        inner = f"{outer}\t"
        yield f"{outer}{'JOINT' if bone.depth + lead else 'ROOT'} {names[bone.joint]}"
        placed = _has_positions(skeleton, bone)
        # Readers differ in whether positions count from the offset, so there is one or the other.
        offset = np.zeros(3) if placed else bone.offset
        channels = f"6 {_POSITIONS} {_ROTATIONS}" if placed else f"3 {_ROTATIONS}"
        row = _format_row(offset * scale, decimals)
        yield from (f"{outer}{{", f"{inner}OFFSET {row}")
        yield f"{inner}CHANNELS {channels}"
        if bone.segment not in bases:
            row = _format_row(
                skeleton.end_site(bone, motion.figure.segments[bone.segment]) * scale, decimals
            )
            yield from (f"{inner}End Site", f"{inner}{{", f"{inner}\tOFFSET {row}")
            yield f"{inner}}}"
        for k in range(ends):
            yield "\t" * (bone.depth + lead - k) + "}"
    if several:
        yield "}"


def _ground_name(motion: FigureMotion, skeleton: Skeleton) -> str:
    """The name of the ground: that of the root's segment, unless a joint has it."""
    name = motion.figure.root.segment
    return f"{name}_ground" if any(bone.joint == name for bone in skeleton.bones) else name


def _has_positions(skeleton: Skeleton, bone: Bone) -> bool:
    """Return True for a bone that needs a position: one that translates, or a single root."""
    return bone.max_translation > _MIN_TRANSLATION or (bone.depth == 0 and len(skeleton.roots) == 1)


def _motion(skeleton: Skeleton, count: int, interval: float, scale: float) -> Iterator[str]:
    yield "MOTION"
    yield f"Frames: {count}"
    yield f"Frame Time: {interval!r}"
    columns = [np.zeros((count, 3))] if len(skeleton.roots) > 1 else []
    for bone in skeleton.bones:
        if _has_positions(skeleton, bone):
            columns.append((bone.offset + bone.translations[:count]) * scale)
        columns.append(np.degrees(_xyz_angles(bone.rotations[:count])))
    for row in np.concatenate(columns, axis=1):
        yield _format_row(row, _decimals(scale))


def _xyz_angles(rotations: Array) -> Array:
    """X, Y, Z angles of orientations (n, 3, 3), continuous from frame to frame, (n, 3) [rad]."""
    near: Array | None = None
    rows: list[Array] = []
    for turn in rotations:
        near = _XYZ_SEQUENCE.angles(turn, near)
        rows.append(near[::-1])
    return np.array(rows)


def _format_row(values: Sequence[float] | Array, decimals: int) -> str:
    rounded = np.round(np.asarray(values, dtype=float), decimals) + 0.0
    return " ".join(f"{value:.{decimals}f}" for value in rounded.tolist())
