"""DYSPAM's input files, a folder of four (sections 3.1.1 and 4.1.5; `docs/dyspam.md`).

Writing is what the thesis's Ernest did; `dyspam_reader` is its inverse. All numbers in the files
are cgs and radians.
"""

from pathlib import Path

import numpy as np

from generator.exchange.dyspam_from_figure import (
    Numbered,
    loads_of,
    lose_of_figure,
    mechanism_of,
    numbered,
)
from generator.exchange.dyspam_jackforce import counts_of, jackforce_text
from generator.exchange.dyspam_springs import written_springs
from generator.exchange.dyspam_structure import Structure, Times, structure_text
from generator.exchange.dyspam_tables import tables_text
from generator.exchange.losses import Losses
from generator.exchange.report import Report
from generator.figure import Figure
from generator.posture.placement import motion_maps, relative_motion_map
from generator.reader.optional import write_optional
from generator.whole_file import write_whole
from springs import SpringSet

FORMAT = "DYSPAM input files"

STRUCTURE = "structure"
TABLES = "ndyspamfile"
LOADS = "jackforce"
OPTIONAL = "optional"
FILES = (STRUCTURE, TABLES, LOADS, OPTIONAL)
"""Names of the files. `optional` is empty where no spring is a cubic."""


def write(figure: Figure, springs: SpringSet, path: Path, times: Times | None = None) -> Losses:
    """Write the four files, each whole, into the folder `path`, which is made if it is not there.

    Args:
        figure: with joints of one or of three rotations.
        springs: of its joints.
        path: the folder.
        times: of the simulation; None for 0 to 1 s.

    Returns:
        What the files do not hold.

    Raises:
        InputError: a figure that the files cannot hold; it has all faults.
        OSError: a file cannot be written.
    """
    given = numbered(figure)
    report = Report(FORMAT)
    lose_of_figure(given, report)
    written = written_springs(springs, given.triads, report)
    mechanism, loads = mechanism_of(given, tuple(written.rows)), loads_of(given)
    structure = Structure(
        bodies=len(mechanism.bodies),
        joints=len(mechanism.connections),
        freedoms=_freedoms(given),
        loads=counts_of(loads),
        springs=len(mechanism.springs),
        times=times or Times(),
    )
    texts = {
        STRUCTURE: structure_text(structure),
        TABLES: tables_text(mechanism),
        LOADS: jackforce_text(loads),
        OPTIONAL: write_optional(written.records),
    }
    path.mkdir(exist_ok=True)
    for name, text in texts.items():
        write_whole(path / name, text)
    return report.losses


def _freedoms(given: Numbered) -> int:
    """Degrees of freedom of the whole: those of the tree less what its loops take at the start.

    The sites of a joint that only turns coincide, so that both motions are told at one point.
    """
    placement = given.placement
    free = sum(branch.joint.degrees_of_freedom for branch in placement.tree.branches)
    if not placement.tree.closures:
        return free
    maps, rows = motion_maps(placement), list[np.ndarray]()
    for joint in placement.tree.closures:
        twists = placement.tree.chains[joint.name].twists(placement.displacements[joint.name]).T
        blocked = np.eye(6) - twists @ np.linalg.pinv(twists)
        rows.append(blocked @ relative_motion_map(placement, maps, joint))
    return free - int(np.linalg.matrix_rank(np.vstack(rows), tol=1e-7))
