"""A motion as a table of comma-separated values, with its header in lines that begin with `#`."""

from collections.abc import Iterator
from pathlib import Path

from generator.losses import Loss, Losses
from generator.motion_files.action import shown_chain, shown_number, unit_of
from generator.motion_files.motion import NO_FIGURE, Clip, unheld
from generator.recording import ENERGY_KINDS
from generator.text_io import write_whole

NO_ENERGIES = Loss("energies: the motion is not that of a run, which alone has them")


def write(clip: Clip, path: Path) -> Losses:
    """Write a motion as a table, whole or not at all.

    Raises:
        OSError: the file cannot be written.
        ValueError: a displacement is not finite.
    """
    write_whole(path, format_csv(clip))
    return Losses.of("table", [NO_FIGURE, unheld(clip, "energies") or NO_ENERGIES])


def format_csv(clip: Clip) -> str:
    """The text of the table: `time [s]`, each displacement `JOINT.k`, the energies of a run.

    Raises ValueError for a displacement that is not finite.
    """
    return "".join(f"{line}\n" for line in _lines(clip))


def _lines(clip: Clip) -> Iterator[str]:
    yield from (f"# {line}" for line in clip.header.lines())
    titles, columns = ["time [s]"], [[repr(time) for time in clip.times.tolist()]]
    for name, chain in clip.chains.items():
        yield f"# joint {name} {shown_chain(chain)}"
        for k, factor in enumerate(chain):
            unit = unit_of(factor)
            titles.append(f"{name}.{k + 1} [{unit}]")
            values = clip.displacements[name][:, k].tolist()
            columns.append([shown_number(value, unit) for value in values])
    if clip.recording is not None:
        for kind in ENERGY_KINDS:
            titles.append(f"{kind} [J]")
            columns.append([repr(value) for value in clip.recording.energy[kind].tolist()])
    yield ",".join(titles)
    yield from (",".join(row) for row in zip(*columns, strict=True))
