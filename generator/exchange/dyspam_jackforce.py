"""DYSPAM's file `jackforce` (figure 3.3): constant loads at points of interest.

A line is the number of the load, the number of its point, and three components. The loads stand in
the order of `LOAD_KINDS`; only `structure` says how many there are of each.
"""

from collections.abc import Iterable, Sequence
from contextlib import suppress

from generator.exchange.dyspam_mechanism import LOAD_KINDS, PointLoad
from generator.exchange.dyspam_rows import BrokenTableError, Rows, number_text
from generator.loads import LoadKind
from generator.reader.findings import Findings
from generator.reader.units import Dimension
from generator.source import Source

_FORM = "load point x y z"


def counts_of(loads: Iterable[PointLoad]) -> tuple[int, ...]:
    """How many loads there are of each of `LOAD_KINDS`."""
    kinds = [load.kind for load in loads]
    return tuple(kinds.count(kind) for kind in LOAD_KINDS)


def jackforce_text(loads: Iterable[PointLoad]) -> str:
    """The text of the file; empty without loads."""
    lines: list[str] = []
    for load in sorted(loads, key=lambda load: LOAD_KINDS.index(load.kind)):
        parts = [number_text(part, _dimension(load.kind)) for part in load.components]
        lines.append(f"{len(lines) + 1} {load.point} {' '.join(parts)}\n")
    return "".join(lines)


def jackforce_in(
    source: Source, counts: Sequence[int], points: int, findings: Findings
) -> tuple[PointLoad, ...]:
    """The loads of a text, as far as they can be told; faults go to `findings`.

    Args:
        source: the text.
        counts: how many loads there are of each of `LOAD_KINDS`.
        points: how many points of interest there are.
        findings: for faults.
    """
    rows, loads = Rows(source, findings), list[PointLoad]()
    with suppress(BrokenTableError):
        for kind, count in zip(LOAD_KINDS, counts, strict=True):
            for k in range(1, count + 1):
                row = rows.take(f"{kind.value} {k} of {count}", _FORM)
                number = len(loads) + 1
                rows.whole(row.words[0], "number of the load", number, number)
                point = rows.whole(row.words[1], "number of the point", 1, points)
                x, y, z = rows.numbers(row.words[2:], _dimension(kind))
                loads.append(PointLoad(kind, point, (x, y, z)))
        rows.finish(f"the {sum(counts)} loads that `structure` counts")
    return tuple(loads)


def _dimension(kind: LoadKind) -> Dimension:
    return Dimension.FORCE if kind.is_force else Dimension.MOMENT
