"""Numbers in XML: attributes and texts that hold one or several of them."""

import re
from collections.abc import Sequence
from math import inf, isfinite

from generator.exchange.incoming.xml_text import Element, Written
from generator.figure import Vector
from generator.reader.findings import Findings
from generator.reader.vocabulary import shown
from generator.source import Span

_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_WORD = re.compile(r"[^\s]+")
_INFINITE = {"inf": inf, "+inf": inf, "-inf": -inf}


def numbers(
    written: Written,
    findings: Findings,
    least: int,
    most: int | None = None,
    *,
    infinite: bool = False,
) -> tuple[float, ...] | None:
    """The numbers of a text; None, with the fault noted, when it holds others or too few or many.

    Args:
        written: the text; blanks stand between the numbers.
        findings: for faults.
        least: how many numbers there are at least.
        most: at most; None for `least`.
        infinite: whether `Inf` counts as a number.
    """
    most = least if most is None else most
    values: list[float] = []
    for match in _WORD.finditer(written.text):
        word = match[0]
        if infinite and word.lower() in _INFINITE:
            values.append(_INFINITE[word.lower()])
            continue
        if not _NUMBER.fullmatch(word):
            findings.error(
                f"`{shown(word)}` is no number", _part(written, match), _wanted(least, most)
            )
            return None
        values.append(float(word))
        if not isfinite(values[-1]):
            findings.error(
                f"`{shown(word)}` is too large", _part(written, match), "a number must be finite"
            )
            return None
    if not least <= len(values) <= most:
        has = "1 number" if len(values) == 1 else f"{len(values)} numbers"
        findings.error(f"{has} instead of {_count(least, most)}", written.span)
        return None
    return tuple(values)


def vector(
    element: Element, name: str, findings: Findings, default: Vector = (0.0, 0.0, 0.0)
) -> Vector:
    """Three numbers of an attribute; `default` without it, or when it is wrong."""
    written = element.attributes.get(name)
    read = None if written is None else numbers(written, findings, 3)
    return default if read is None else (read[0], read[1], read[2])


def number(element: Element, name: str, findings: Findings, default: float = 0.0) -> float:
    """One number of an attribute; `default` without it, or when it is wrong."""
    written = element.attributes.get(name)
    read = None if written is None else numbers(written, findings, 1)
    return default if read is None else read[0]


def direction(axis: Sequence[float], place: Span, findings: Findings) -> Vector:
    """An axis with length one; z, with a fault noted, for one without a direction."""
    length = sum(part * part for part in axis) ** 0.5
    if not 1e-10 < length < inf:
        findings.error("this vector has no direction", place, "an axis is longer than zero")
        return 0.0, 0.0, 1.0
    x, y, z = (part / length for part in axis)
    return x, y, z


def _part(written: Written, match: re.Match[str]) -> Span:
    """The place of a word; the whole text where entities keep the two apart."""
    span = written.span
    start = span.start + match.start()
    part = Span(span.source, start, start + len(match[0]))
    return part if part.text == match[0] else span


def _count(least: int, most: int) -> str:
    return f"{least}" if least == most else f"{least} to {most}"


def _wanted(least: int, most: int) -> str:
    few = least == most == 1
    return "one number stands here" if few else f"{_count(least, most)} numbers stand here"
