"""A motion as a table of comma-separated values, with its header in lines that begin with `#`."""

from collections.abc import Iterator
from math import isfinite
from pathlib import Path

import numpy as np

from generator.contact_record import ContactRecord, centre_of_pressure
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
from generator.recording import energy_kinds
from generator.rotations import matrix_from_chain_angles
from generator.text_io import write_atomic

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
