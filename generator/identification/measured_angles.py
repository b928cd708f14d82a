"""Measured joint angles over time."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf, ulp
from pathlib import Path

import numpy as np

from generator.diagnostics import Diagnostic, InputError, UsageError, error, warning
from generator.figure import Figure
from generator.input_files.drives import OVERSHOOT_HINT
from generator.motion_files.drives import read_drives_with_warnings
from generator.rotations import Array
from springs.short_repr import short_repr


@short_repr
@dataclass(frozen=True, eq=False)
class MeasuredAngles:
    """Angles of joints at n times.

    Attributes:
        name: name of the data, for reports.
        times: [s], shape (n,), increasing.
        columns: joint and number of the displacement in its chain, from 0, of k columns.
        angles: [rad], shape (n, k).
    """

    name: str
    times: Array
    columns: tuple[tuple[str, int], ...]
    angles: Array

    def check_time(self, time: float) -> None:
        """Raise UsageError for a time far from the samples, as by another epoch [s]."""
        first, last = float(self.times[0]), float(self.times[-1])
        margin = max(last - first, 1.0)
        if not first - margin <= time <= last:
            raise UsageError(
                f"the start at {time!r} s is not near the samples of {self.name}, which go from "
                f"{first!r} s to {last!r} s"
            )

    def between(self, start: float = -inf, stop: float = inf) -> "MeasuredAngles":
        """Return the samples within two times [s]. Raises UsageError for fewer than two."""
        kept = (self.times >= start - _TIME_ROUNDING) & (self.times <= stop + _TIME_ROUNDING)
        if np.count_nonzero(kept) < 2:
            first, last = float(self.times[0]), float(self.times[-1])
            raise UsageError(
                f"fewer than two samples of {self.name} are between the start and the stop; "
                f"it goes from {format_time(first)} s to {format_time(last)} s"
            )
        return replace(self, times=self.times[kept], angles=self.angles[kept])

    def without(self, joints: Sequence[str]) -> "MeasuredAngles":
        """Return the columns of other joints. Raises UsageError if none is left."""
        kept = [k for k, (joint, _) in enumerate(self.columns) if joint not in joints]
        if not kept:
            raise UsageError(f"all joints that {self.name} measures are locked or prescribed")
        return replace(
            self, columns=tuple(self.columns[k] for k in kept), angles=self.angles[:, kept]
        )


_LARGEST_ANGLE = 360.0
"""Angle of a joint above which its unit is doubted [deg]."""

_TIME_ROUNDING = 1e-9
"""Time by which a sample may lie beyond the start or the stop [s]."""

_MAX_ROUNDING = 0.1
"""Resolution of times, as a share of the interval of the samples, above which it is doubted."""

_MAX_DECIMALS = 9


def format_time(time: float) -> str:
    """Return a time [s] with microseconds, of any epoch: `0.02`, `1700000000.02`."""
    return f"{round(time, 6) + 0.0:.6f}".rstrip("0").rstrip(".")


def time_resolution(times: Array) -> float | None:
    """Resolution of times that have lost digits [s]; None for times that are exact.

    They have if the last decimal of all is more than a tenth of their interval, and the intervals
    differ by one or two of it: 30 samples a second with two decimals are 0.03 or 0.04 s apart.
    """
    intervals = np.diff(times)
    median = float(np.median(intervals))
    rounding = ulp(float(np.abs(times).max()))
    if rounding > _MAX_ROUNDING * median:
        return rounding
    for decimals in range(_MAX_DECIMALS):
        step = 10.0**-decimals
        if np.all(np.abs(times - np.round(times, decimals)) <= max(2.0 * rounding, 1e-12)):
            spread = float(np.ptp(intervals))
            is_rounded = step > _MAX_ROUNDING * median and 0.5 * step < spread < 2.5 * step
            return step if is_rounded else None
    return None


def read_measured_angles(
    path: str | Path, figure: Figure
) -> tuple[MeasuredAngles, tuple[Diagnostic, ...]]:
    """Read joint angles from a table (`.csv`) or a motion (`.mot`, `.sto`, `.npz`, `.action`).

    Returns the angles, and warnings.

    Raises:
        InputError: with all errors.
    """
    drives, warnings = read_drives_with_warnings(path, figure)
    if not drives:
        raise InputError([error(f"{path}: no column is an angle of a joint")])
    columns: list[tuple[str, int]] = []
    angles: list[Array] = []
    for joint, drive in drives.items():
        values = np.asarray(drive.values, dtype=float)
        for k, coordinate in enumerate(drive.coordinates or range(values.shape[1])):
            columns.append((joint, coordinate))
            angles.append(values[:, k])
    times = np.asarray(next(iter(drives.values())).times, dtype=float)
    # Noise makes splines overshoot, which matters for drives only.
    kept = [one for one in warnings if one.hint != OVERSHOOT_HINT]
    for (joint, _), column in zip(columns, angles, strict=True):
        largest = float(np.degrees(np.abs(column).max()))
        if largest > _LARGEST_ANGLE:
            words = f"{path}: an angle of `{joint}` is {largest:.0f} deg: is its unit right?"
            kept.append(warning(words))
    resolution = time_resolution(times)
    if resolution is not None:
        kept.append(
            warning(
                f"{path}: the times are rounded to {resolution:.2g} s, though the samples are "
                f"{float(np.median(np.diff(times))):.2g} s apart: the angles seem to move by that "
                "much earlier or later",
                hint="write the times with more decimals, counted from the first sample",
            )
        )
    data = MeasuredAngles(Path(path).name, times, tuple(columns), np.column_stack(angles))
    return data, tuple(kept)
