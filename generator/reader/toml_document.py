"""A text in TOML, bounded in size, or the fault that says where it is none."""

import re
import tomllib
from collections.abc import Mapping
from typing import Any

from generator.reader.findings import Findings
from generator.reader.toml_values import number_text
from generator.source import Source, Span

LONGEST_TEXT = 100_000
LONGEST_LINE = 1_000
"""Bounds on what is read: `tomllib` needs minutes for some longer texts (`a.a.a. ... = 1`)."""

_POSITION = re.compile(r" ?\(at (?:line ([0-9]+), column ([0-9]+)|end of document)\)$")


def document_in(source: Source, what: str, findings: Findings) -> Mapping[str, Any] | None:
    """The document that a text holds; None, with the fault noted, when it holds none.

    Args:
        source: the text.
        what: what the text should be, as part of a sentence ("links file").
        findings: for faults.
    """
    place = _excess(source)
    if place is not None:
        findings.error(
            f"this is too long for a {what}",
            place,
            f"at most {LONGEST_TEXT:,} characters in all and {LONGEST_LINE:,} in a line",
        )
        return None
    try:
        return tomllib.loads(source.text, parse_float=number_text)
    except RecursionError:
        findings.error("brackets are nested too deeply", Span(source, 0, 1), "a list holds no list")
    except tomllib.TOMLDecodeError as failure:
        message, span = _syntax_fault(str(failure), source)
        findings.error(message, span, f"a {what} is written in TOML")
    return None


def _excess(source: Source) -> Span | None:
    """Where the text becomes longer than is read."""
    if len(source.text) > LONGEST_TEXT:
        return Span(source, LONGEST_TEXT, LONGEST_TEXT + 1)
    start = 0
    for line in source.text.split("\n"):
        if len(line) > LONGEST_LINE:
            return Span(source, start + LONGEST_LINE, start + LONGEST_LINE + 1)
        start += len(line) + 1
    return None


def _syntax_fault(message: str, source: Source) -> tuple[str, Span]:
    """What `tomllib` says, without its position, and the position as a span."""
    match = _POSITION.search(message)
    said = _POSITION.sub("", message)
    said = f"{said[:1].lower()}{said[1:]}".replace("\\n", "end of line")
    if match is None or match[1] is None:
        end = len(source.text.rstrip())
        return said, Span(source, max(end - 1, 0), max(end, 1))
    line, column = int(match[1]), int(match[2])
    before = sum(len(text) + 1 for text in source.text.split("\n")[: line - 1])
    offset = before + min(column - 1, max(len(source.line(line)) - 1, 0))
    return said, Span(source, offset, offset + 1)
