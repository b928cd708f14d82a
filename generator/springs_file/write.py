"""Writing a springs file: the inverse of reading one."""

import json
import re
from collections.abc import Iterable, Iterator
from fractions import Fraction
from math import isfinite

from generator.springs_file.coupled import NEAREST, CoupledEntry
from generator.springs_file.laws import (
    DECREASING,
    EXPONENTIALS,
    HYSTERESIS,
    INCREASING,
    LIMIT_STIFFNESS,
    LIMITS,
    MEASURED,
    POINTS,
    PUBLISHED,
    SLIP_RATE,
    TRANSITION,
    Written,
)
from generator.springs_file.parse import NO_DEAD_ZONE, SpringEntry, SpringsFile
from generator.springs_file.toml_table import COUPLED, LONGEST_LINE, TABLE
from generator.units import decimal_of, unit_named
from springs import Elastic
from springs.coupled import CoupledExponential
from springs.damping import SLIP
from springs.exponential import Exponential, Term
from springs.hysteresis import Directional
from springs.interpolated import Table
from springs.smooth_limit import SmoothLimit
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
    tables = [(TABLE, _entry(entry)) for entry in content.entries]
    tables += [(COUPLED, _coupled(entry)) for entry in content.coupled]
    for name, said in tables:
        lines += [*([""] if lines and lines[-1] else []), f"[[{name}]]", *said]
    text = "\n".join([*lines, ""])
    if any(len(line) > LONGEST_LINE for line in text.split("\n")):
        raise ValueError(f"a line of a springs file has at most {LONGEST_LINE} characters")
    return text


def _entry(entry: SpringEntry) -> Iterator[str]:
    yield f"joints = {_texts(entry.joints)}"
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
    yield from _law(entry.law)
    if entry.scale != 1.0:
        yield f"scale = {_number(entry.scale)}"
    if entry.offset:
        yield f"offset_deg = {_degree(entry.offset)}"
    if entry.hysteresis:
        yield f"{HYSTERESIS} = {_number(entry.hysteresis)}"
    if entry.slip != SLIP:
        yield f"{SLIP_RATE} = {_number(entry.slip)}"
    yield f"viscous_Nms_rad = {_number(entry.damping.viscous)}"
    if entry.damping.coulomb:
        yield f"coulomb_Nm = {_number(entry.damping.coulomb)}"
    if entry.stop_stiffness != STIFFNESS:
        yield f"stop_stiffness_Nm_rad = {_number(entry.stop_stiffness)}"
    if entry.stop_onset != ONSET:
        yield f"stop_onset_deg = {_degree(entry.stop_onset)}"
    yield from _said(entry)


def _said(entry: SpringEntry | CoupledEntry) -> Iterator[str]:
    for key, said in (("reference", entry.reference), ("why", entry.why)):
        if said:
            yield f"{key} = {_paragraph(said)}"


def _law(law: Written | None) -> Iterator[str]:
    """The keys of a law that stands whole in its table."""
    if isinstance(law, Exponential):
        pairs = [(_number(_at_zero(term)), _number(term.rate)) for term in law.terms]
        yield f"{EXPONENTIALS} = {_pairs(pairs)}"
        if law.constant:
            yield f"constant_Nm = {_number(law.constant)}"
        yield from _measured(law.measured)
    elif isinstance(law, Table):
        yield f"{POINTS} = {_points(law)}"
    elif isinstance(law, SmoothLimit):
        yield f"{LIMITS} = {_degrees((law.lower, law.upper))}"
        yield f"{LIMIT_STIFFNESS} = {_numbers((law.lower_stiffness, law.upper_stiffness))}"
        yield f"{TRANSITION} = {_degree(law.transition)}"
        yield from _measured(law.measured)
    elif isinstance(law, Directional):
        yield f"{INCREASING} = {_points(law.increasing)}"
        yield f"{DECREASING} = {_points(law.decreasing)}"
    elif law is not None:
        yield f"{PUBLISHED} = {_text(law.key)}"
        if law.sense != 1:
            yield f"published_sense = {law.sense:+d}"


def _coupled(entry: CoupledEntry) -> Iterator[str]:
    sides = [_texts(side) for side in entry.joints]
    yield f"joints = {sides[0] if len(sides) == 1 else _list(sides)}"
    if any(axis is not None for axis in entry.axes):
        yield f"axes = {_texts(axis or 'joint' for axis in entry.axes)}"
    if any(sense != 1 for sense in entry.senses):
        yield f"senses = [{', '.join(f'{sense:+d}' for sense in entry.senses)}]"
    yield f"coordinates = {_texts(entry.coordinates)}"
    if entry.published is not None:
        yield f"{PUBLISHED} = {_text(entry.published)}"
    if entry.held:
        yield f"held = {_texts(name for name, _ in entry.held)}"
        yield f"held_deg = {_degrees(angle for _, angle in entry.held)}"
    if entry.own is not None:
        yield from _own(entry.own)
    if entry.is_nearest:
        yield f"conservative = {_text(NEAREST)}"
    if entry.scale != 1.0:
        yield f"scale = {_number(entry.scale)}"
    if any(entry.offsets):
        yield f"offsets_deg = {_degrees(entry.offsets)}"
    yield from _said(entry)


def _own(law: CoupledExponential) -> Iterator[str]:
    """A coupled law in numbers."""
    terms: list[str] = []
    for term in law.terms:
        exponent = f", exponent = {_number(term.exponent)}" if term.exponent else ""
        amplitudes, rates = _numbers(term.amplitudes), _numbers(term.rates)
        terms.append(f"{{ amplitudes_Nm = {amplitudes}, rates_1_rad = {rates}{exponent} }}")
    yield f"terms = {_list(terms)}"
    if any(law.constants):
        yield f"constants_Nm = {_numbers(law.constants)}"
    known = [one for one in law.measured if one is not None]
    if known and len(known) < len(law.measured):
        raise ValueError("a springs file knows the ranges of all coordinates or of none")
    if known:
        yield f"{MEASURED} = {_list(map(_degrees, known))}"


def _at_zero(term: Term) -> float:
    """The amplitude of an exponential, which a file gives at the angle zero."""
    if term.centre:
        raise ValueError("a springs file holds exponentials about the angle zero")
    return term.amplitude


def _measured(measured: tuple[float, float] | None) -> Iterator[str]:
    if measured is not None:
        yield f"{MEASURED} = {_degrees(measured)}"


def _points(law: Elastic) -> str:
    if not isinstance(law, Table):
        raise ValueError("a springs file holds two curves through points, or one and a hysteresis")
    return _pairs([(_degree(angle), _number(torque)) for angle, torque in law.points])


def _pairs(pairs: Iterable[tuple[str, str]]) -> str:
    return _list(f"[{first}, {second}]" for first, second in pairs)


def _list(items: Iterable[str]) -> str:
    """A list, over several lines where it would make a long one."""
    texts = list(items)
    short = f"[{', '.join(texts)}]"
    return short if len(short) <= _WIDTH else "\n".join(["[", *(f"    {t}," for t in texts), "]"])


def _texts(names: Iterable[str]) -> str:
    return f"[{', '.join(map(_text, names))}]"


def _number(value: float, unit: Fraction = _ONE) -> str:
    if not isfinite(value):
        raise ValueError(f"a springs file holds finite numbers, not {value}")
    return decimal_of(value, unit)


def _degree(value: float) -> str:
    return _number(value, _DEGREE)


def _numbers(values: Iterable[float]) -> str:
    return f"[{', '.join(map(_number, values))}]"


def _degrees(values: Iterable[float]) -> str:
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
