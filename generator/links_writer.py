"""Writing a links file: the inverse of reading one."""

import json
from collections.abc import Iterator
from math import isfinite

from generator.reader.links_file import TABLE, LinkEntry, LinksFile
from generator.reader.toml_document import LONGEST_LINE
from generator.reader.units import decimal_of, unit_named


def write_links(content: LinksFile, comment: str = "") -> str:
    """The text of a links file; reading it gives the same links, to the last bit.

    Args:
        content: what the file says.
        comment: said above it, one line or several.

    Raises:
        ValueError: for what the file cannot say: a number that is not finite, a text longer than
            is read.
    """
    lines = [f"# {line}".rstrip() for line in comment.splitlines()]
    lines += [""] if lines else []
    if content.figure is not None:
        lines.append(f"figure = {_text(content.figure)}")
    for entry in content.entries:
        lines += [*([""] if lines and lines[-1] else []), f"[[{TABLE}]]", *_entry(entry)]
    if any(len(line) > LONGEST_LINE for line in lines):
        raise ValueError(f"a line of a links file has at most {LONGEST_LINE} characters")
    return "\n".join([*lines, ""])


def _entry(entry: LinkEntry) -> Iterator[str]:
    yield f"joints = [{', '.join(map(_text, entry.joints))}]"
    yield f"control = {_text(entry.control)}"
    if entry.dof is not None:
        yield f"dof = {entry.dof + 1}"
    if entry.control_dof is not None:
        yield f"control_dof = {entry.control_dof + 1}"
    yield f"factor = {_number(entry.factor, 'rad')}"
    if entry.mirror:
        yield "mirror = true"
    if entry.offset or entry.offset_is_length:
        unit = "m" if entry.offset_is_length else "deg"
        yield f"offset_{unit} = {_number(entry.offset, unit)}"
    if entry.why:
        yield f"why = {_text(entry.why)}"


def _number(value: float, unit: str) -> str:
    if not isfinite(value):
        raise ValueError(f"a links file holds finite numbers, not {value}")
    return decimal_of(value, unit_named(unit).factor)


def _text(text: str) -> str:
    """A string in quotes, with the escapes that TOML shares with JSON."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
