"""Writing a springs file: the inverse of reading one."""

import json
import re
from collections.abc import Iterator
from fractions import Fraction
from math import isfinite

from generator.reader.springs_file import LONGEST_LINE, NO_DEAD_ZONE, SpringEntry, SpringsFile
from generator.reader.toml_values import TABLE
from generator.reader.units import decimal_of, unit_named
from springs.stop import ONSET, STIFFNESS

_DEGREE = unit_named("deg").factor
_ONE = unit_named("rad").factor
_WIDTH = 96
_WORD = re.compile("[^ ]+ *")


def write_springs(content: SpringsFile, comment: str = "") -> str:
    """The text of a springs file; reading it gives the same springs, to the last bit.

    Args:
        content: what the file says.
        comment: said above it, one line or several.

    Raises:
        ValueError: for what the file cannot say: a number that is not finite, a longer word than
            is read.
    """
    lines = [f"# {line}".rstrip() for line in comment.splitlines()]
    lines += [""] if lines else []
    if content.figure is not None:
        lines.append(f"figure = {_text(content.figure)}")
    if content.law is not None:
        lines.append(f"law = {_text(content.law.value)}")
    for entry in content.entries:
        lines += [*([""] if lines and lines[-1] else []), f"[[{TABLE}]]", *_entry(entry)]
    text = "\n".join([*lines, ""])
    if any(len(line) > LONGEST_LINE for line in text.split("\n")):
        raise ValueError(f"a line of a springs file has at most {LONGEST_LINE} characters")
    return text


def _entry(entry: SpringEntry) -> Iterator[str]:
    yield f"joints = [{', '.join(map(_text, entry.joints))}]"
    yield f"axis = {_text(entry.axis or 'joint')}"
    if entry.motion:
        yield f"motion = {_text(entry.motion)}"
    if entry.coefficients is not None:
        yield f"coefficients_Nm_rad = {_numbers(entry.coefficients)}"
    if entry.sense is not None:
        yield f"sense = {entry.sense:+d}"
    if entry.dead_zone is not None:
        yield f"dead_zone_deg = {_degrees(entry.dead_zone)}"
    elif entry.dead_zone_stated:
        yield f"dead_zone_deg = {_text(NO_DEAD_ZONE)}"
    if entry.stiffness is not None:
        yield f"stiffness_Nm_rad = {_number(entry.stiffness)}"
    if entry.rest:
        yield f"rest_deg = {_degree(entry.rest)}"
    yield f"viscous_Nms_rad = {_number(entry.damping.viscous)}"
    if entry.damping.coulomb:
        yield f"coulomb_Nm = {_number(entry.damping.coulomb)}"
    if entry.stop_stiffness != STIFFNESS:
        yield f"stop_stiffness_Nm_rad = {_number(entry.stop_stiffness)}"
    if entry.stop_onset != ONSET:
        yield f"stop_onset_deg = {_degree(entry.stop_onset)}"
    for key, said in (("reference", entry.reference), ("why", entry.why)):
        if said:
            yield f"{key} = {_paragraph(said)}"


def _number(value: float, unit: Fraction = _ONE) -> str:
    if not isfinite(value):
        raise ValueError(f"a springs file holds finite numbers, not {value}")
    return decimal_of(value, unit)


def _degree(value: float) -> str:
    return _number(value, _DEGREE)


def _numbers(values: tuple[float, ...]) -> str:
    return f"[{', '.join(map(_number, values))}]"


def _degrees(values: tuple[float, ...]) -> str:
    return f"[{', '.join(map(_degree, values))}]"


def _text(text: str) -> str:
    """A string in quotes, with the escapes that TOML shares with JSON."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _paragraph(text: str) -> str:
    """A string over several lines that is read as one, where it would make a long line.

    Each line but the last ends in blanks and a backslash: the reader drops what follows up to the
    next word, so that blanks at the very start of a text need one line.
    """
    if len(text) <= _WIDTH or text.startswith(" "):
        return _text(text)
    lines = [""]
    for word in _WORD.findall(_text(text)[1:-1]):
        if len(lines[-1]) + len(word) > _WIDTH:
            lines.append("")
        lines[-1] += word
    return '"""\\\n' + "\\\n".join(filter(None, lines)) + '"""'
