"""A motion as a table of comma-separated values, with its header in lines that begin with `#`."""

from collections.abc import Iterator
from pathlib import Path

from generator.losses import Loss, Losses
from generator.motion_files.action import display_unit, format_chain, format_displacement
from generator.motion_files.motion import NO_FIGURE, FigureMotion, unrepresented
from generator.recording import ENERGY_KINDS
from generator.text_io import write_atomic

NO_ENERGIES = Loss("energies: the motion is not that of a run, which alone has them")


def write(motion: FigureMotion, path: Path) -> Losses:
    """Write a motion as a table, whole or not at all.

    Raises:
        OSError: the file cannot be written.
        ValueError: a displacement is not finite.
    """
    write_atomic(path, format_csv(motion))
    return Losses.collect("table", [NO_FIGURE, unrepresented(motion, "energies") or NO_ENERGIES])


def format_csv(motion: FigureMotion) -> str:
    """The text of the table: `time [s]`, each displacement `JOINT.k`, the energies of a run.

    Raises ValueError for a displacement that is not finite.
    """
    return "".join(f"{line}\n" for line in _lines(motion))


def _lines(motion: FigureMotion) -> Iterator[str]:
    yield from (f"# {line}" for line in motion.header.lines())
    titles, columns = ["time [s]"], [[repr(time) for time in motion.times.tolist()]]
    for name, chain in motion.chains.items():
        yield f"# joint {name} {format_chain(chain)}"
        for k, factor in enumerate(chain):
            unit = display_unit(factor)
            titles.append(f"{name}.{k + 1} [{unit}]")
            values = motion.displacements[name][:, k].tolist()
            columns.append([format_displacement(value, unit) for value in values])
    if motion.recording is not None:
        for kind in ENERGY_KINDS:
            titles.append(f"{kind} [J]")
            columns.append([repr(value) for value in motion.recording.energy[kind].tolist()])
    yield ",".join(titles)
    yield from (",".join(row) for row in zip(*columns, strict=True))
