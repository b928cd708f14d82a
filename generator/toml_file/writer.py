"""Values as TOML."""

import json
import re
from collections.abc import Iterable
from fractions import Fraction
from math import isfinite

from generator.units import parse_unit, shortest_decimal

_DEGREE_FACTOR = parse_unit("deg").factor
_RADIAN_FACTOR = parse_unit("rad").factor
_MAX_LINE_WIDTH = 96
MAX_LINE_LENGTH = 1_000
"""Longest line that is read: `tomllib` needs minutes for some longer ones (`a.a.a. ... = 1`)."""

_WORD = re.compile("[^ ]+ *")


def pairs_to_toml(pairs: Iterable[tuple[str, str]]) -> str:
    """List of pairs, each number in TOML already."""
    return list_to_toml(f"[{first}, {second}]" for first, second in pairs)


def list_to_toml(items: Iterable[str]) -> str:
    """A list, over several lines where it would make a long one."""
    texts = list(items)
    short = f"[{', '.join(texts)}]"
    return (
        short
        if len(short) <= _MAX_LINE_WIDTH
        else "\n".join(["[", *(f"    {t}," for t in texts), "]"])
    )


def names_to_toml(names: Iterable[str]) -> str:
    """List of strings."""
    return f"[{', '.join(map(quote_toml, names))}]"


def number_to_toml(value: float, unit: Fraction = _RADIAN_FACTOR) -> str:
    """Shortest decimal number that is read back as `value`.

    Raises:
        ValueError: for a number that is not finite.
    """
    if not isfinite(value):
        raise ValueError(f"a file holds finite numbers, not {value}")
    return shortest_decimal(value, unit)


def degree_to_toml(value: float) -> str:
    """Decimal number of degrees for an angle [rad]."""
    return number_to_toml(value, _DEGREE_FACTOR)


def numbers_to_toml(values: Iterable[float]) -> str:
    """List of decimal numbers."""
    return f"[{', '.join(map(number_to_toml, values))}]"


def degrees_to_toml(values: Iterable[float]) -> str:
    """List of decimal numbers of degrees for angles [rad]."""
    return f"[{', '.join(map(degree_to_toml, values))}]"


def quote_toml(text: str) -> str:
    """A string in quotes, with the escapes that TOML shares with JSON."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def quote_long_toml(text: str) -> str:
    """A string over several lines that is read as one, where it would make a long line.

    Each line but the last ends in blanks and a backslash: the reader drops what follows up to the
    next word, so that blanks at the very start of a text need one line.
    """
    if len(text) <= _MAX_LINE_WIDTH or text.startswith(" "):
        return quote_toml(text)
    lines = [""]
    for word in _WORD.findall(quote_toml(text)[1:-1]):
        if len(lines[-1]) + len(word) > _MAX_LINE_WIDTH:
            lines.append("")
        lines[-1] += word
    return '"""\\\n' + "\\\n".join(filter(None, lines)) + '"""'


def text_to_toml(text: str) -> str:
    """A text of several lines as a string of several lines."""
    lines = (quote_toml(line)[1:-1] for line in text.split("\n"))
    return '"""\n' + "\n".join(lines) + '"""'


def document_to_toml(
    noun: str,
    head: Iterable[str],
    tables: Iterable[tuple[str, Iterable[str]]],
    comment: str = "",
) -> str:
    """A file: lines of a comment, lines above all tables, and `[[name]]` tables with their lines.

    Raises:
        ValueError: for a line that is too long for the reader.
    """
    lines = [f"# {line}".rstrip() for line in comment.splitlines()]
    lines += [*([""] if lines else []), *head]
    for name, content in tables:
        lines += [*([""] if lines and lines[-1] else []), f"[[{name}]]", *content]
    text = "\n".join([*lines, ""])
    if any(len(line) > MAX_LINE_LENGTH for line in text.split("\n")):
        raise ValueError(f"a line of a {noun} has at most {MAX_LINE_LENGTH} characters")
    return text
