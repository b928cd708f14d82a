"""A motion as a table of comma-separated values, with its header in lines that begin with `#`."""

from collections.abc import Iterator
from pathlib import Path

from generator.animation.displayed import shown_chain, shown_number, unit_of
from generator.animation.header import header_of
from generator.animation.whole_file import write_whole
from generator.figure import Figure
from generator.recording import ENERGY_KINDS, Recording


def write(recording: Recording, figure: Figure, path: Path) -> None:
    """Write a recording of a figure as a table, whole or not at all.

    Raises OSError when the file cannot be written.
    """
    write_whole(path, format_csv(recording, figure))


def format_csv(recording: Recording, figure: Figure) -> str:
    """The text of the table: `time [s]`, each displacement `JOINT.k`, the energies.

    Raises ValueError for a displacement that is not finite.
    """
    return "".join(f"{line}\n" for line in _lines(recording, figure))


def _lines(recording: Recording, figure: Figure) -> Iterator[str]:
    yield from (f"# {line}" for line in header_of(recording, figure).lines())
    titles, columns = ["time [s]"], [[repr(time) for time in recording.times.tolist()]]
    for name, chain in recording.chains.items():
        yield f"# joint {name} {shown_chain(chain)}"
        for k, factor in enumerate(chain):
            unit = unit_of(factor)
            titles.append(f"{name}.{k + 1} [{unit}]")
            values = recording.displacements[name][:, k].tolist()
            columns.append([shown_number(value, unit) for value in values])
    for kind in ENERGY_KINDS:
        titles.append(f"{kind} [J]")
        columns.append([repr(value) for value in recording.energy[kind].tolist()])
    yield ",".join(titles)
    yield from (",".join(row) for row in zip(*columns, strict=True))
