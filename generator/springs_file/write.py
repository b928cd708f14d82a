"""Writing a springs file: the inverse of reading one."""

import json
import re
from collections.abc import Iterable, Iterator
from fractions import Fraction
from math import isfinite

from generator.springs_file.coupled import NEAREST_CONSERVATIVE, CoupledEntry
from generator.springs_file.laws import (
    DECREASING_KEY,
    EXPONENTIALS_KEY,
    HYSTERESIS_KEY,
    INCREASING_KEY,
    LIMIT_STIFFNESS_KEY,
    LIMITS_KEY,
    MEASURED_KEY,
    POINTS_KEY,
    PUBLISHED_KEY,
    SLIP_RATE_KEY,
    TRANSITION_KEY,
    StandaloneLaw,
)
from generator.springs_file.parse import NO_DEAD_ZONE, SpringEntry, SpringsFile
from generator.springs_file.toml_table import COUPLED_TABLE, MAX_LINE_LENGTH, SPRING_TABLE
from generator.units import parse_unit, shortest_decimal
from springs import Elastic
from springs.coupled import CoupledExponential
from springs.damping import DEFAULT_SLIP_RATE
from springs.exponential import Exponential, ExponentialTerm
from springs.hysteresis import Hysteresis
from springs.interpolated import Interpolated
from springs.smooth_limit import SmoothLimit
from springs.stop import DEFAULT_STOP_ONSET, DEFAULT_STOP_STIFFNESS

_DEGREE_FACTOR = parse_unit("deg").factor
_RADIAN_FACTOR = parse_unit("rad").factor
_MAX_LINE_WIDTH = 96
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
        lines.append(f"figure = {_quote(content.figure)}")
    if content.joining is not None:
        lines.append(f"law = {_quote(content.joining.value)}")
    tables = [(SPRING_TABLE, _entry(entry)) for entry in content.entries]
    tables += [(COUPLED_TABLE, _coupled_entry(entry)) for entry in content.coupled]
    for name, said in tables:
        lines += [*([""] if lines and lines[-1] else []), f"[[{name}]]", *said]
    text = "\n".join([*lines, ""])
    if any(len(line) > MAX_LINE_LENGTH for line in text.split("\n")):
        raise ValueError(f"a line of a springs file has at most {MAX_LINE_LENGTH} characters")
    return text


def _entry(entry: SpringEntry) -> Iterator[str]:
    yield f"joints = {_quoted_list(entry.joints)}"
    yield f"axis = {_quote(entry.axis or 'joint')}"
    if entry.motion:
        yield f"motion = {_quote(entry.motion)}"
    if entry.coefficients is not None:
        yield f"coefficients_Nm_rad = {_numbers(entry.coefficients)}"
    if entry.sense is not None:
        yield f"sense = {entry.sense:+d}"
    if entry.dead_zone is not None:
        yield f"dead_zone_deg = {_degrees(entry.dead_zone)}"
    elif entry.dead_zone_stated:
        yield f"dead_zone_deg = {_quote(NO_DEAD_ZONE)}"
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
        yield f"{HYSTERESIS_KEY} = {_number(entry.hysteresis)}"
    if entry.slip_rate != DEFAULT_SLIP_RATE:
        yield f"{SLIP_RATE_KEY} = {_number(entry.slip_rate)}"
    yield f"viscous_Nms_rad = {_number(entry.damping.viscous)}"
    if entry.damping.coulomb:
        yield f"coulomb_Nm = {_number(entry.damping.coulomb)}"
    if entry.stop_stiffness != DEFAULT_STOP_STIFFNESS:
        yield f"stop_stiffness_Nm_rad = {_number(entry.stop_stiffness)}"
    if entry.stop_onset != DEFAULT_STOP_ONSET:
        yield f"stop_onset_deg = {_degree(entry.stop_onset)}"
    yield from _provenance_lines(entry)


def _provenance_lines(entry: SpringEntry | CoupledEntry) -> Iterator[str]:
    for key, said in (("reference", entry.reference), ("why", entry.why)):
        if said:
            yield f"{key} = {_quote_multiline(said)}"


def _law(law: StandaloneLaw | None) -> Iterator[str]:
    """The keys of a law that stands whole in its table."""
    if isinstance(law, Exponential):
        pairs = [(_number(_amplitude_at_zero(term)), _number(term.rate)) for term in law.terms]
        yield f"{EXPONENTIALS_KEY} = {_pairs(pairs)}"
        if law.constant:
            yield f"constant_Nm = {_number(law.constant)}"
        yield from _measured_range(law.valid_range)
    elif isinstance(law, Interpolated):
        yield f"{POINTS_KEY} = {_points(law)}"
    elif isinstance(law, SmoothLimit):
        yield f"{LIMITS_KEY} = {_degrees((law.lower, law.upper))}"
        yield f"{LIMIT_STIFFNESS_KEY} = {_numbers((law.lower_stiffness, law.upper_stiffness))}"
        yield f"{TRANSITION_KEY} = {_degree(law.transition)}"
        yield from _measured_range(law.valid_range)
    elif isinstance(law, Hysteresis):
        yield f"{INCREASING_KEY} = {_points(law.increasing)}"
        yield f"{DECREASING_KEY} = {_points(law.decreasing)}"
    elif law is not None:
        yield f"{PUBLISHED_KEY} = {_quote(law.key)}"
        if law.sense != 1:
            yield f"published_sense = {law.sense:+d}"


def _coupled_entry(entry: CoupledEntry) -> Iterator[str]:
    sides = [_quoted_list(side) for side in entry.joints]
    yield f"joints = {sides[0] if len(sides) == 1 else _list(sides)}"
    if any(axis is not None for axis in entry.axes):
        yield f"axes = {_quoted_list(axis or 'joint' for axis in entry.axes)}"
    if any(sense != 1 for sense in entry.senses):
        yield f"senses = [{', '.join(f'{sense:+d}' for sense in entry.senses)}]"
    yield f"coordinates = {_quoted_list(entry.coordinates)}"
    if entry.published is not None:
        yield f"{PUBLISHED_KEY} = {_quote(entry.published)}"
    if entry.held:
        yield f"held = {_quoted_list(name for name, _ in entry.held)}"
        yield f"held_deg = {_degrees(angle for _, angle in entry.held)}"
    if entry.explicit_law is not None:
        yield from _explicit_law(entry.explicit_law)
    if entry.is_nearest_conservative:
        yield f"conservative = {_quote(NEAREST_CONSERVATIVE)}"
    if entry.scale != 1.0:
        yield f"scale = {_number(entry.scale)}"
    if any(entry.offsets):
        yield f"offsets_deg = {_degrees(entry.offsets)}"
    yield from _provenance_lines(entry)


def _explicit_law(law: CoupledExponential) -> Iterator[str]:
    """A coupled law in numbers."""
    terms: list[str] = []
    for term in law.terms:
        exponent = f", exponent = {_number(term.exponent)}" if term.exponent else ""
        amplitudes, rates = _numbers(term.amplitudes), _numbers(term.rates)
        terms.append(f"{{ amplitudes_Nm = {amplitudes}, rates_1_rad = {rates}{exponent} }}")
    yield f"terms = {_list(terms)}"
    if any(law.constants):
        yield f"constants_Nm = {_numbers(law.constants)}"
    known = [one for one in law.valid_ranges if one is not None]
    if known and len(known) < len(law.valid_ranges):
        raise ValueError("a springs file knows the ranges of all coordinates or of none")
    if known:
        yield f"{MEASURED_KEY} = {_list(map(_degrees, known))}"


def _amplitude_at_zero(term: ExponentialTerm) -> float:
    """The amplitude of an exponential, which a file gives at the angle zero."""
    if term.centre:
        raise ValueError("a springs file holds exponentials about the angle zero")
    return term.amplitude


def _measured_range(measured: tuple[float, float] | None) -> Iterator[str]:
    if measured is not None:
        yield f"{MEASURED_KEY} = {_degrees(measured)}"


def _points(law: Elastic) -> str:
    if not isinstance(law, Interpolated):
        raise ValueError("a springs file holds two curves through points, or one and a hysteresis")
    return _pairs([(_degree(angle), _number(torque)) for angle, torque in law.points])


def _pairs(pairs: Iterable[tuple[str, str]]) -> str:
    return _list(f"[{first}, {second}]" for first, second in pairs)


def _list(items: Iterable[str]) -> str:
    """A list, over several lines where it would make a long one."""
    texts = list(items)
    short = f"[{', '.join(texts)}]"
    return (
        short
        if len(short) <= _MAX_LINE_WIDTH
        else "\n".join(["[", *(f"    {t}," for t in texts), "]"])
    )


def _quoted_list(names: Iterable[str]) -> str:
    return f"[{', '.join(map(_quote, names))}]"


def _number(value: float, unit: Fraction = _RADIAN_FACTOR) -> str:
    if not isfinite(value):
        raise ValueError(f"a springs file holds finite numbers, not {value}")
    return shortest_decimal(value, unit)


def _degree(value: float) -> str:
    return _number(value, _DEGREE_FACTOR)


def _numbers(values: Iterable[float]) -> str:
    return f"[{', '.join(map(_number, values))}]"


def _degrees(values: Iterable[float]) -> str:
    return f"[{', '.join(map(_degree, values))}]"


def _quote(text: str) -> str:
    """A string in quotes, with the escapes that TOML shares with JSON."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _quote_multiline(text: str) -> str:
    """A string over several lines that is read as one, where it would make a long line.

    Each line but the last ends in blanks and a backslash: the reader drops what follows up to the
    next word, so that blanks at the very start of a text need one line.
    """
    if len(text) <= _MAX_LINE_WIDTH or text.startswith(" "):
        return _quote(text)
    lines = [""]
    for word in _WORD.findall(_quote(text)[1:-1]):
        if len(lines[-1]) + len(word) > _MAX_LINE_WIDTH:
            lines.append("")
        lines[-1] += word
    return '"""\\\n' + "\\\n".join(filter(None, lines)) + '"""'
