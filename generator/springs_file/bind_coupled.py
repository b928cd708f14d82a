"""Binding of the coupled laws of a springs file to the joints of a figure."""

from itertools import combinations

import numpy as np

from generator.diagnostics import Diagnostics, shorten
from generator.figure import Figure
from generator.springs_file.axes import find_axis, parallel_sign
from generator.springs_file.coupled import CoupledEntry
from generator.springs_file.laws import MAX_LAW_VALUE
from generator.springs_file.parse import SpringsFile
from springs import CoupledAxis, CoupledSpring
from springs.coupled import CoupledExponential

_TEST_ANGLES = np.radians([-200.0, 200.0])
"""Angles that a joint may reach [rad]."""


def bind_coupled_springs(
    figure: Figure | None, content: SpringsFile, diagnostics: Diagnostics
) -> tuple[CoupledSpring, ...]:
    """Bind the coupled laws of a file, one spring for each side.

    Args:
        figure: the figure; None if it is not known.
        content: the file.
        diagnostics: diagnostics for faults.
    """
    made: list[CoupledSpring] = []
    hung: dict[frozenset[CoupledAxis], CoupledEntry] = {}
    for entry in content.coupled:
        if not (_has_finite_torques(entry.unmodified_law) and _has_finite_torques(entry.law)):
            diagnostics.error(
                "the torque of this coupled law is too large for a number within a turn",
                entry.origins.get("terms") or entry.origins.get("coupled"),
                "are its rates for angles in rad?",
            )
            continue
        for k in range(len(entry.joints)):
            axes = _bind_side(figure, entry, k, diagnostics)
            if axes is None:
                continue
            made.append(
                CoupledSpring(entry.law, axes, entry.reference, entry.why, entry.original_law)
            )
            other = hung.setdefault(frozenset(map(_unsigned_axis, axes)), entry)
            if other is not entry:
                _report_duplicate(entry, other, axes, k, diagnostics)
    return tuple(made)


def _unsigned_axis(axis: CoupledAxis) -> CoupledAxis:
    """Return an axis without its sense."""
    x, y, z = (abs(part) for part in axis.direction)
    return CoupledAxis(axis.joint, (x, y, z))


def _report_duplicate(
    entry: CoupledEntry,
    first: CoupledEntry,
    axes: tuple[CoupledAxis, ...],
    k: int,
    diagnostics: Diagnostics,
) -> None:
    """Report two laws over the same axes: an error for equal laws, otherwise a warning."""
    named = " and ".join(f"`{shorten(axis.joint)}`" for axis in axes)
    place = entry.joint_spans[k][0] if entry.joint_spans else None
    header = first.origins.get("coupled")
    where = f"the first is in line {header.line}" if header else ""
    if entry.has_same_law(first):
        diagnostics.error(f"this law is bound to {named} already", place, where)
    else:
        message = f"a second law over the same axes of {named}: the two add"
        diagnostics.warning(message, place, where)


def _bind_side(
    figure: Figure | None, entry: CoupledEntry, k: int, diagnostics: Diagnostics
) -> tuple[CoupledAxis, ...] | None:
    """The axes of one side; None with a fault noted."""
    places = entry.joint_spans[k] if entry.joint_spans else (None,) * len(entry.joints[k])
    axes: list[CoupledAxis] = []
    for name, axis, sense, place in zip(
        entry.joints[k], entry.axes, entry.senses, places, strict=True
    ):
        found = find_axis(figure, name, axis, diagnostics, place, entry.origins.get("axes"))
        if found is not None:
            x, y, z = found
            axes.append(CoupledAxis(name, found if sense > 0 else (-x, -y, -z)))
    if len(axes) < len(places):
        return None
    for (i, one), (j, other) in combinations(enumerate(axes), 2):
        if one.joint == other.joint and parallel_sign(one.direction, other.direction):
            first, second = entry.coordinates[i], entry.coordinates[j]
            message = (
                f"`{shorten(first)}` and `{shorten(second)}` are one axis of `{shorten(one.joint)}`"
            )
            diagnostics.error(message, places[j], "each coordinate has an axis of its own")
            return None
    return tuple(axes)


def _has_finite_torques(law: CoupledExponential) -> bool:
    """Return whether the torques of a law are finite at all angles a joint may reach."""
    corners = np.meshgrid(*(_TEST_ANGLES for _ in law.coordinates))
    with np.errstate(all="ignore"):
        torques = law.torques(corners)
    return all(bool(np.all(np.abs(torque) < MAX_LAW_VALUE)) for torque in torques)
