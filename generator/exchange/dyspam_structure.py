"""DYSPAM's file `structure` (figure 3.1): how much there is of everything, and the run's times."""

from contextlib import suppress
from dataclasses import dataclass

from generator.exchange.dyspam_mechanism import LOAD_KINDS
from generator.exchange.dyspam_rows import BrokenTableError, Row, Rows, number_text
from generator.reader.findings import Findings
from generator.source import Source, Span

_NUMERICS = "0.00000001, 0.00001, 0.000001, 7\n10.0 ,1.0 ,0.1/\n"
"""The parameters of the numerical procedures, as figure 3.1 has them."""


@dataclass(frozen=True)
class Times:
    """When a simulation starts and stops, its step, and the interval of what it writes [s]."""

    start: float = 0.0
    step: float = 0.001
    stop: float = 1.0
    frame: float = 0.02


@dataclass(frozen=True)
class Structure:
    """What the file says.

    Attributes:
        bodies: how many move.
        joints: how many there are.
        freedoms: degrees of freedom of the whole.
        loads: how many of each of `LOAD_KINDS`.
        springs: how many linear springs `ndyspamfile` has.
        times: of the simulation.
        flagged: whether a flag is set; what it asks for is not known.
        place: of the first line.
    """

    bodies: int
    joints: int
    freedoms: int
    loads: tuple[int, ...]
    springs: int
    times: Times = Times()
    flagged: bool = False
    place: Span | None = None


def structure_text(structure: Structure) -> str:
    """The text of the file, with all flags zero."""
    times = structure.times
    said = (times.start, times.step, times.stop, times.frame)
    return (
        f"{structure.bodies}, {structure.joints}, {structure.freedoms}\n"
        f"{' '.join(map(str, structure.loads))}\n"
        f"0, 0, {structure.springs}\n"
        "0, 0\n"
        "0\n"
        f"{', '.join(number_text(time, decimals=6) for time in said)}\n"
        f"{_NUMERICS}"
    )


def structure_in(source: Source, findings: Findings) -> Structure | None:
    """What a text says, as far as it can be told; faults go to `findings`."""
    with suppress(BrokenTableError):
        return _structure(Rows(source, findings))
    return None


def _structure(rows: Rows) -> Structure:
    first = rows.take("the first line", "bodies joints degrees_of_freedom")
    names = ("number of bodies", "number of joints", "number of degrees of freedom")
    bodies, joints, freedoms = (
        rows.whole(word, name, low=low)
        for word, name, low in zip(first.words, names, (1, 1, 0), strict=True)
    )
    line = rows.take("the line of loads", "global_forces local_forces global_moments local_moments")
    loads = tuple(
        rows.whole(word, f"number of loads `{kind.value}`")
        for word, kind in zip(line.words, LOAD_KINDS, strict=True)
    )
    line = rows.take("the line of springs", "flag flag rotational_springs")
    springs = rows.whole(line.words[2], "number of rotational springs")
    flags = [*line.words[:2]]
    flags += rows.take("a line of flags", "flag flag").words
    flags += rows.take("a line of flags", "flag").words
    flagged = any([rows.number(word) != 0.0 for word in flags])
    times = _times(rows.take("the line of times", "start step stop animation_step"), rows)
    for form in ("parameter parameter parameter parameter", "parameter parameter parameter"):
        rows.numbers(rows.take("a line of numerical parameters", form).words)
    rows.finish("the numerical parameters")
    return Structure(bodies, joints, freedoms, loads, springs, times, flagged, first.span)


def _times(line: Row, rows: Rows) -> Times:
    start, step, stop, frame = rows.numbers(line.words)
    if not rows.findings.has_errors:
        if stop <= start:
            rows.findings.error("the stop time is not after the start", line.words[2])
        for word, what, value in ((line.words[1], "step", step), (line.words[3], "frame", frame)):
            if value <= 0.0:
                rows.findings.error(f"the {what} is not above zero", word)
    return Times(start, step, stop, frame)
