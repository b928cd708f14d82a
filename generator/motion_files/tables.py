"""A motion as a table of displacements: `.csv`, and OpenSim's `.mot` (deg) and `.sto` (rad).

A `.csv` has its header in lines that begin with `#`. In OpenSim's tables a displacement is the
coordinate `JOINT_k`, k from 1 in the order of the chain, the innermost axis first; times are
seconds, lengths metres. After them the tables of a run with contact have the ground reaction in the
columns of OpenSim's force files.
"""

from collections.abc import Iterator
from functools import partial
from math import isfinite
from pathlib import Path

import numpy as np

from generator.contact_record import ContactRecord, centre_of_pressure
from generator.figure import AxisKind
from generator.kinematics.free_root import FREE_CHAINS
from generator.losses import Loss, Losses
from generator.motion_files.action import display_unit, format_chain, format_displacement
from generator.motion_files.motion import (
    CONTACT_DEPTHS,
    CONTACT_SIZES,
    GROUND_REACTION,
    NO_FIGURE,
    FigureMotion,
    unrepresented,
)
from generator.motion_files.skeleton import continuous_quaternions
from generator.names import coordinate_names, plain_names, renaming_loss
from generator.recording import energy_kinds
from generator.rotations import Array, matrix_from_chain_angles
from generator.text_io import write_atomic

GROUND_REACTION_LABELS = tuple(
    f"ground_{quantity}{axis}" for quantity in ("force_v", "force_p", "torque_") for axis in "xyz"
)
"""Force, its point and a moment, as OpenSim's examples of ground reactions call them."""

NO_ENERGIES = Loss("energies: the motion is not that of a run, which alone has them")


def write_csv(motion: FigureMotion, path: Path) -> Losses:
    """Write a motion as a table of comma-separated values, whole or not at all.

    Raises:
        OSError: the file cannot be written.
        ValueError: a displacement is not finite.
    """
    write_atomic(path, format_csv(motion))
    kept = ("energies", GROUND_REACTION, CONTACT_SIZES, CONTACT_DEPTHS)
    return Losses.collect("table", [NO_FIGURE, unrepresented(motion, *kept) or NO_ENERGIES])


def format_csv(motion: FigureMotion) -> str:
    """The text of the table: `time [s]`, each displacement `JOINT.k`, the energies of a run.

    A free segment has its orientation as a unit quaternion too, `SEGMENT.qw` to `SEGMENT.qz`, which
    is continuous and has no poles: 1, 0, 0, 0 for the orientation in the figure's file. A run with
    contact has the ground reaction, without a point below `MIN_VERTICAL_FORCE`, and for each
    segment `SEGMENT.contact_force` and `SEGMENT.contact_depth`.

    Raises ValueError for a displacement that is not finite.
    """
    return "".join(f"{line}\n" for line in _csv_lines(motion))


def _csv_lines(motion: FigureMotion) -> Iterator[str]:
    yield from (f"# {line}" for line in motion.header.lines())
    titles, columns = ["time [s]"], [[repr(time) for time in motion.times.tolist()]]
    for name, chain in motion.chains.items():
        yield f"# joint {name} {format_chain(chain)}"
        for k, factor in enumerate(chain):
            unit = display_unit(factor)
            titles.append(f"{name}.{k + 1} [{unit}]")
            values = motion.displacements[name][:, k].tolist()
            columns.append([format_displacement(value, unit) for value in values])
        if chain in FREE_CHAINS:
            titles += [f"{name}.{part} [1]" for part in ("qw", "qx", "qy", "qz")]
            turned = matrix_from_chain_angles(
                [factor.axis for factor in chain[:3]], motion.displacements[name][:, :3]
            )
            quaternions = continuous_quaternions(turned)[:, (3, 0, 1, 2)]
            columns += [[repr(value) for value in part] for part in quaternions.T.tolist()]
    if motion.recording is not None:
        energy = motion.recording.energy
        for kind in energy_kinds(energy):
            titles.append(f"{kind} [J]")
            columns.append([repr(value) for value in energy[kind].tolist()])
        for title, column in _contact_columns(motion.recording.contact):
            titles.append(title)
            columns.append(column)
    yield ",".join(titles)
    yield from (",".join(row) for row in zip(*columns, strict=True))


def _contact_columns(contact: ContactRecord | None) -> Iterator[tuple[str, list[str]]]:
    """Yield titles and cells of a contact record; none without one."""
    if contact is None:
        return
    reaction = contact.ground_reaction
    points, free_moments = centre_of_pressure(reaction)
    for k, axis in enumerate("xyz"):
        yield f"ground_force_v{axis} [N]", list(map(repr, reaction[:, k].tolist()))
    for k, axis in ((0, "x"), (2, "z")):
        yield f"ground_force_p{axis} [cm]", list(map(_length_or_blank, points[:, k].tolist()))
    torques = [repr(value) if isfinite(value) else "" for value in free_moments.tolist()]
    yield "ground_torque_y [N m]", torques
    for name, forces in contact.forces.items():
        sizes = np.linalg.norm(forces, axis=1).tolist()
        yield f"{name}.contact_force [N]", list(map(repr, sizes))
    for name, depths in contact.depths.items():
        cells = [format_displacement(depth, "cm") for depth in depths.tolist()]
        yield f"{name}.contact_depth [cm]", cells


def _length_or_blank(length: float) -> str:
    """Format a length [m] in cm; blank for NaN."""
    return format_displacement(length, "cm") if isfinite(length) else ""


def _write_coordinates(motion: FigureMotion, path: Path, *, in_degrees: bool) -> Losses:
    """Write the displacements of a motion, whole or not at all.

    Raises OSError when the file cannot be written.
    """
    write_atomic(path, "".join(f"{line}\n" for line in _coordinate_lines(motion, in_degrees)))
    fixed = tuple(name for name, chain in motion.chains.items() if not chain)
    losses = [
        NO_FIGURE,
        Loss("the axes of the displacements, which are those of the figure"),
        Loss("joints without freedoms", fixed) if fixed else None,
        renaming_loss(plain_names(motion.chains)),
        unrepresented(motion, GROUND_REACTION),
        Loss("digits: degrees are rounded to 17, which may change the last bit of an angle")
        if in_degrees
        else None,
    ]
    return Losses.collect("OpenSim table", losses)


write_mot = partial(_write_coordinates, in_degrees=True)
"""As OpenSim's own motions are."""

write_sto = partial(_write_coordinates, in_degrees=False)
"""As OpenSim's own results are: no digit is lost."""


def point_wrench(ground_reaction: Array) -> Array:
    """Force [N], its point in the plane y = 0 [m] and the moment there [N m], shape (n, 9).

    The moment is about y. Where the vertical force is below `MIN_VERTICAL_FORCE`, the point is the
    origin and the moment has all components, so that every row is equivalent to the ground
    reaction, shape (n, 6).
    """
    points, free_moments = centre_of_pressure(ground_reaction)
    has_point = np.isfinite(free_moments)[:, None]
    about_y = free_moments[:, None] * (0.0, 1.0, 0.0)
    return np.hstack(
        [
            ground_reaction[:, :3],
            np.where(has_point, points, 0.0),
            np.where(has_point, about_y, ground_reaction[:, 3:]),
        ]
    )


def _coordinate_lines(motion: FigureMotion, in_degrees: bool) -> Iterator[str]:
    names = coordinate_names(motion.chains)
    labels = ["time"]
    columns = [motion.times]
    for name, chain in motion.chains.items():
        labels += names[name]
        for k, factor in enumerate(chain):
            values = motion.displacements[name][:, k]
            columns.append(
                np.degrees(values) if in_degrees and factor.kind is AxisKind.ROTATION else values
            )
    contact = None if motion.recording is None else motion.recording.contact
    if contact is not None:
        labels += GROUND_REACTION_LABELS
        columns += list(point_wrench(contact.ground_reaction).T)
    yield "Coordinates"
    yield "version=1"
    yield f"nRows={len(motion.times)}"
    yield f"nColumns={len(labels)}"
    yield f"inDegrees={'yes' if in_degrees else 'no'}"
    for line in motion.header.lines():
        name, _, value = line.partition(" ")
        yield f"{name}={value}"
    yield "endheader"
    yield "\t".join(labels)
    for row in np.stack(columns, axis=1).tolist():
        yield "\t".join(map(repr, row))
