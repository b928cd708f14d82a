"""A motion as OpenSim reads it: a table of coordinates, `.mot` in degrees and `.sto` in radians.

A displacement is the coordinate `JOINT_k`, k from 1 in the order of the chain, the innermost factor
first; times are seconds, lengths metres.
"""

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

from generator.losses import Loss, Losses
from generator.motion_files.motion import NO_FIGURE, Clip, unheld
from generator.names import coordinate_names, loss_of_names, plain_names
from generator.text_io import write_whole


def write(clip: Clip, path: Path, *, in_degrees: bool) -> Losses:
    """Write the displacements of a motion, whole or not at all.

    Raises OSError when the file cannot be written.
    """
    write_whole(path, "".join(f"{line}\n" for line in _lines(clip, in_degrees)))
    fixed = tuple(name for name, chain in clip.chains.items() if not chain)
    losses = [
        NO_FIGURE,
        Loss("the axes of the displacements, which are those of the figure"),
        Loss("joints without freedoms", fixed) if fixed else None,
        loss_of_names(plain_names(clip.chains)),
        unheld(clip),
        Loss("digits: degrees are rounded to 17, which may change the last bit of an angle")
        if in_degrees
        else None,
    ]
    return Losses.of("OpenSim table", losses)


write_mot = partial(write, in_degrees=True)
"""As OpenSim's own motions are."""

write_sto = partial(write, in_degrees=False)
"""As OpenSim's own results are: no digit is lost."""


def _lines(clip: Clip, in_degrees: bool) -> Iterator[str]:
    names = coordinate_names(clip.chains)
    labels = ["time"]
    columns = [clip.times]
    for name, chain in clip.chains.items():
        labels += names[name]
        for k, factor in enumerate(chain):
            values = clip.displacements[name][:, k]
            columns.append(np.degrees(values) if in_degrees and factor.kind == "R" else values)
    yield "Coordinates"
    yield "version=1"
    yield f"nRows={len(clip.times)}"
    yield f"nColumns={len(labels)}"
    yield f"inDegrees={'yes' if in_degrees else 'no'}"
    for line in clip.header.lines():
        name, _, value = line.partition(" ")
        yield f"{name}={value}"
    yield "endheader"
    yield "\t".join(labels)
    for row in np.stack(columns, axis=1).tolist():
        yield "\t".join(map(repr, row))
