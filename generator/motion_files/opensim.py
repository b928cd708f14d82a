"""A motion as OpenSim reads it: a table of coordinates, `.mot` in degrees and `.sto` in radians.

A displacement is the coordinate `JOINT_k`, k from 1 in the order of the chain, the innermost factor
first; times are seconds, lengths metres.
"""

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

from generator.losses import Loss, Losses
from generator.motion_files.motion import NO_FIGURE, FigureMotion, unrepresented
from generator.names import coordinate_names, plain_names, renaming_loss
from generator.text_io import write_atomic


def write(motion: FigureMotion, path: Path, *, in_degrees: bool) -> Losses:
    """Write the displacements of a motion, whole or not at all.

    Raises OSError when the file cannot be written.
    """
    write_atomic(path, "".join(f"{line}\n" for line in _lines(motion, in_degrees)))
    fixed = tuple(name for name, chain in motion.chains.items() if not chain)
    losses = [
        NO_FIGURE,
        Loss("the axes of the displacements, which are those of the figure"),
        Loss("joints without freedoms", fixed) if fixed else None,
        renaming_loss(plain_names(motion.chains)),
        unrepresented(motion),
        Loss("digits: degrees are rounded to 17, which may change the last bit of an angle")
        if in_degrees
        else None,
    ]
    return Losses.collect("OpenSim table", losses)


write_mot = partial(write, in_degrees=True)
"""As OpenSim's own motions are."""

write_sto = partial(write, in_degrees=False)
"""As OpenSim's own results are: no digit is lost."""


def _lines(motion: FigureMotion, in_degrees: bool) -> Iterator[str]:
    names = coordinate_names(motion.chains)
    labels = ["time"]
    columns = [motion.times]
    for name, chain in motion.chains.items():
        labels += names[name]
        for k, factor in enumerate(chain):
            values = motion.displacements[name][:, k]
            columns.append(np.degrees(values) if in_degrees and factor.kind == "R" else values)
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
