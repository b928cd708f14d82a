"""What the coupled laws of a springs file give the joints of a figure."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from generator.diagnostics import Findings, Span, nearest, shorten
from generator.figure import Figure, Vector
from generator.springs_file.axes import AxisError, axis_named, sign_along
from generator.springs_file.coupled import CoupledEntry
from generator.springs_file.laws import LARGEST
from generator.springs_file.parse import SpringsFile
from springs import CoupledAxis, CoupledSpring
from springs.coupled import CoupledExponential
from springs.lint.report import Replaced

_FARTHEST = np.radians([-200.0, 200.0])
"""Angles that a joint may reach [rad]."""


@dataclass(frozen=True)
class Hung:
    """Where a coordinate is hung: its joint, the name of its axis, and where both are written."""

    joint: str
    axis: str | None
    place: Span | None
    axis_place: Span | None


Directions = Callable[[Hung, Findings], Vector | None]
"""Finds the axis of a joint in its frame; None with a fault noted."""


def coupled_of_figure(
    figure: Figure, content: SpringsFile, findings: Findings
) -> tuple[CoupledSpring, ...]:
    """The coupled laws of a file, hung on a figure."""

    def direction(hung: Hung, findings: Findings) -> Vector | None:
        joint = figure.joints.get(hung.joint)
        if joint is None:
            missing = f"the figure has no joint `{shorten(hung.joint)}`"
            findings.error(missing, hung.place, nearest(hung.joint, figure.joints))
            return None
        try:
            return axis_named(joint, hung.axis)
        except AxisError as fault:
            findings.error(str(fault), hung.axis_place or hung.place, fault.hint)
            return None

    return coupled_springs(content, direction, findings)


def coupled_springs(
    content: SpringsFile, direction: Directions, findings: Findings
) -> tuple[CoupledSpring, ...]:
    """The coupled laws of a file, one spring for each side.

    Args:
        content: the file.
        direction: finds the axes.
        findings: for faults.
    """
    made: list[CoupledSpring] = []
    hung: dict[frozenset[CoupledAxis], CoupledEntry] = {}
    for entry in content.coupled:
        if not (_is_finite(entry.as_given) and _is_finite(entry.law)):
            findings.error(
                "the torque of this coupled law is too large for a number within a turn",
                entry.origins.get("terms") or entry.origins.get("coupled"),
                "are its rates for angles in rad?",
            )
            continue
        for k in range(len(entry.joints)):
            axes = _side(entry, k, direction, findings)
            if axes is None:
                continue
            made.append(CoupledSpring(entry.law, axes, entry.reference, entry.why))
            other = hung.setdefault(frozenset(map(_line, axes)), entry)
            if other is not entry:
                _note_second(entry, other, axes, k, findings)
    return tuple(made)


def _line(axis: CoupledAxis) -> CoupledAxis:
    """An axis told without its sense."""
    x, y, z = (abs(part) for part in axis.direction)
    return CoupledAxis(axis.joint, (x, y, z))


def _note_second(
    entry: CoupledEntry,
    first: CoupledEntry,
    axes: tuple[CoupledAxis, ...],
    k: int,
    findings: Findings,
) -> None:
    """Two laws over the same axes add: an error where it is one law, else a warning."""
    named = " and ".join(f"`{shorten(axis.joint)}`" for axis in axes)
    place = entry.joint_origins[k][0] if entry.joint_origins else None
    header = first.origins.get("coupled")
    where = f"the first stands in line {header.line}" if header else ""
    if entry.is_same(first):
        findings.error(f"this law hangs on {named} already", place, where)
    else:
        said = f"a second law over the same axes of {named}: the two add"
        findings.warning(said, place, where)


def replaced_laws(content: SpringsFile) -> tuple[Replaced, ...]:
    """The laws of a file that stand for others, to which they are the nearest conservative ones."""
    return tuple(
        Replaced(entry.law, original)
        for entry in content.coupled
        if (original := entry.replaced) is not None
    )


def _side(
    entry: CoupledEntry, k: int, direction: Directions, findings: Findings
) -> tuple[CoupledAxis, ...] | None:
    """The axes of one side; None with a fault noted."""
    places = entry.joint_origins[k] if entry.joint_origins else (None,) * len(entry.joints[k])
    axes: list[CoupledAxis] = []
    for name, axis, sense, place in zip(
        entry.joints[k], entry.axes, entry.senses, places, strict=True
    ):
        found = direction(Hung(name, axis, place, entry.origins.get("axes")), findings)
        if found is not None:
            x, y, z = found
            axes.append(CoupledAxis(name, found if sense > 0 else (-x, -y, -z)))
    if len(axes) < len(places):
        return None
    for (i, one), (j, other) in combinations(enumerate(axes), 2):
        if one.joint == other.joint and sign_along(one.direction, other.direction):
            first, second = entry.coordinates[i], entry.coordinates[j]
            said = (
                f"`{shorten(first)}` and `{shorten(second)}` are one axis of `{shorten(one.joint)}`"
            )
            findings.error(said, places[j], "each coordinate has an axis of its own")
            return None
    return tuple(axes)


def _is_finite(law: CoupledExponential) -> bool:
    """Whether the torques of a law are numbers wherever its joints may turn."""
    corners = np.meshgrid(*(_FARTHEST for _ in law.coordinates))
    with np.errstate(all="ignore"):
        torques = law.torques(corners)
    return all(bool(np.all(np.abs(torque) < LARGEST)) for torque in torques)
