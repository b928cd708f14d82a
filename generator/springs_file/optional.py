"""DYSPAM's `optional` file: the cubic springs of a figure (section 4.1.5, figure 4.1).

A record is four lines of bare numbers: joint and axis number; c0 c1 c2 c3; b_v and b_coul; alpha_0,
alpha_l and alpha_u. Joints are counted in the order of the figure file. Units are cgs and radians.
Comments from `#` to the end of a line are an extension.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from fractions import Fraction
from math import isfinite

from generator.diagnostics import (
    Diagnostics,
    Source,
    Span,
    shorten,
)
from generator.figure_file.lexer import MAX_WORD_LENGTH
from generator.file_kind import FileKind
from generator.units import Dimension, convert_to_si, default_unit_factor
from springs import Coefficients

_DIMENSIONLESS_FACTOR = Fraction(1)
_MOMENT_FACTOR = default_unit_factor(Dimension.MOMENT)
_RECORD_LINES = (
    ("joint and axis number", (_DIMENSIONLESS_FACTOR,) * 2),
    ("c0 c1 c2 c3", (_MOMENT_FACTOR,) * 4),
    ("b_v b_coul", (default_unit_factor(Dimension.ANGULAR_DAMPING), _MOMENT_FACTOR)),
    ("alpha_0 alpha_l alpha_u", (_DIMENSIONLESS_FACTOR,) * 3),
)
"""The lines of a record: what stands in them, and the SI value of the number 1 in each place."""

MAX_JOINT_NUMBER = 1_000_000
"""Largest joint number accepted."""

_WORD = re.compile(r"\S++")
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eEdD][+-]?[0-9]{1,6})?")


@dataclass(frozen=True)
class OptionalRecord:
    """The spring of one axis, as printed but in SI.

    Attributes:
        joint: number of the joint, from 1, in the order of the figure file.
        axis: 1, 2, 3 for x, y, z of the joint frame; 3 for the axis of a revolute.
        coefficients: c0..c3 [N m, N m/rad, N m/rad^2, N m/rad^3].
        viscous: b_v [N m s/rad].
        coulomb: b_coul [N m].
        rest: alpha_0 [rad].
        dead_zone: alpha_l and alpha_u [rad]; both zero where the axis has none of its own.
        origins: where each line is written: "axis", "coefficients", "damping", "dead_zone".
    """

    joint: int
    axis: int
    coefficients: Coefficients
    viscous: float = 0.0
    coulomb: float = 0.0
    rest: float = 0.0
    dead_zone: tuple[float, float] = (0.0, 0.0)
    origins: Mapping[str, Span] = field(default_factory=dict[str, Span], compare=False, repr=False)

    def __post_init__(self) -> None:
        """Refuse what the file form cannot hold."""
        if self.joint < 1 or self.axis not in (1, 2, 3):
            raise ValueError("joints are counted from 1, and the axes of a joint are 1, 2 and 3")
        numbers = (*self.coefficients, self.viscous, self.coulomb, self.rest, *self.dead_zone)
        if not all(map(isfinite, numbers)):
            raise ValueError("the numbers of a spring are finite")
        if self.viscous < 0.0 or self.coulomb < 0.0:
            raise ValueError("damping and friction are not negative")


@dataclass(frozen=True)
class _Line:
    """The words of a line that has any."""

    words: tuple[Span, ...]

    @property
    def span(self) -> Span:
        return self.words[0].extend_to(self.words[-1])


def _parse_records(source: Source, diagnostics: Diagnostics) -> tuple[OptionalRecord, ...]:
    """The sound records of a text; errors go to `diagnostics`, which may raise TooManyErrors."""
    read = [
        _parse_record(group, diagnostics) for group in _group_lines(_lines(source), diagnostics)
    ]
    if not read:
        diagnostics.error("there is no record in this file", Span(source, 0, 1), _record_form())
    first: dict[tuple[int, int], OptionalRecord] = {}
    for record in filter(None, read):
        earlier = first.setdefault((record.joint, record.axis), record)
        if earlier is not record:
            diagnostics.error(
                f"a second record of joint {record.joint}, axis {record.axis}",
                record.origins["axis"],
                f"the first is in line {earlier.origins['axis'].line}",
            )
    return tuple(first.values())


OPTIONAL_FILE = FileKind("printed springs", ".optional", _parse_records)


def write_optional(records: Iterable[OptionalRecord]) -> str:
    """The text of an `optional` file; reading it gives records equal to `records`."""
    lines: list[str] = []
    for record in records:
        damping, angles = (record.viscous, record.coulomb), (record.rest, *record.dead_zone)
        lines.append(f"{record.joint} {record.axis}")
        lines.append(" ".join(_format_scaled(c, 7) for c in record.coefficients))
        lines.append(" ".join(_format_scaled(value, 7) for value in damping))
        lines.append(" ".join(_format_scaled(value, 0) for value in angles))
    return "".join(f"{line}\n" for line in lines)


def _lines(source: Source) -> Iterator[_Line]:
    """The lines with words in them, one by one: who stops early has not read the rest."""
    start = 0
    for line in source.text.split("\n"):
        bare = line.partition("#")[0]
        words = tuple(
            Span(source, start + match.start(), start + match.end())
            for match in _WORD.finditer(bare)
        )
        if words:
            yield _Line(words)
        start += len(line) + 1


def _group_lines(lines: Iterable[_Line], diagnostics: Diagnostics) -> Iterable[dict[int, _Line]]:
    """The lines of each record by their place in it.

    A line with the wrong number of words that would suit as the next one means a lost line.
    """
    group: dict[int, _Line] = {}
    place, last = 0, None
    for line in lines:
        last = line
        count, expected, after = (
            len(line.words),
            _expected_word_count(place),
            _expected_word_count(place + 1),
        )
        if count != expected and count == after:
            diagnostics.error(
                f"the line {_line_form(place)} is missing before this one",
                line.span,
                _record_form(),
            )
            if place == 3:
                yield group
                group = {}
            place = (place + 1) % 4
        elif count != expected:
            diagnostics.error(
                f"{count} value{'s' if count > 1 else ''} instead of {expected}",
                line.span,
                f"this line is {_line_form(place)}",
            )
        group[place] = line
        place = (place + 1) % 4
        if place == 0:
            yield group
            group = {}
    if last is not None and place:
        yield group
        diagnostics.error(
            f"the last record ends before its line {_line_form(place)}",
            last.span,
            _record_form(),
        )


def _expected_word_count(place: int) -> int:
    return len(_RECORD_LINES[place % 4][1])


def _line_form(place: int) -> str:
    return f"`{_RECORD_LINES[place][0]}`"


def _record_form() -> str:
    return "a record has four lines: " + "; ".join(what for what, _ in _RECORD_LINES)


def _parse_record(group: Mapping[int, _Line], diagnostics: Diagnostics) -> OptionalRecord | None:
    """A record of four good lines, else None."""
    rows = {place: _parse_numbers(line, place, diagnostics) for place, line in group.items()}
    axis, coefficients, damping, angles = (rows.get(place) for place in range(4))
    sound = _is_valid_axis(axis, group, diagnostics) & _is_valid_damping(
        damping, group, diagnostics
    )
    if not (axis and coefficients and damping and angles and sound):
        return None
    c0, c1, c2, c3 = coefficients
    rest, lower, upper = angles
    names = ("axis", "coefficients", "damping", "dead_zone")
    return OptionalRecord(
        int(axis[0]),
        int(axis[1]),
        (c0, c1, c2, c3),
        *damping,
        rest=rest,
        dead_zone=(lower, upper),
        origins={name: group[place].span for place, name in enumerate(names)},
    )


def _is_valid_axis(
    numbers: tuple[float, ...] | None, group: Mapping[int, _Line], diagnostics: Diagnostics
) -> bool:
    """Return whether joint and axis are whole numbers in range."""
    if numbers is None:
        return False
    sound = True
    hints = ("joints are counted from 1, as in the figure file", "it is 1 to 3")
    for k, what in enumerate(("joint", "axis")):
        if not numbers[k].is_integer() or not 1 <= numbers[k] <= (MAX_JOINT_NUMBER, 3)[k]:
            word = group[0].words[k]
            diagnostics.error(f"the {what} number is `{shorten(word.text)}`", word, hints[k])
            sound = False
    return sound


def _is_valid_damping(
    numbers: tuple[float, ...] | None, group: Mapping[int, _Line], diagnostics: Diagnostics
) -> bool:
    """Return whether damping and friction dissipate energy."""
    if numbers is None:
        return False
    wrong = [k for k, value in enumerate(numbers) if value < 0.0]
    for k in wrong:
        what = ("damping", "friction")[k]
        diagnostics.error(f"{what} is negative", group[2].words[k], "it would feed energy")
    return not wrong


def _parse_numbers(line: _Line, place: int, diagnostics: Diagnostics) -> tuple[float, ...] | None:
    """The numbers of a line in SI; None, with a fault noted, when it has others."""
    factors = _RECORD_LINES[place][1]
    if len(line.words) != len(factors):
        return None
    read = [
        _parse_number(word, factor, diagnostics)
        for word, factor in zip(line.words, factors, strict=True)
    ]
    values = tuple(value for value in read if value is not None)
    return values if len(values) == len(read) else None


def _parse_number(word: Span, factor: Fraction, diagnostics: Diagnostics) -> float | None:
    if word.end - word.start > MAX_WORD_LENGTH or not _NUMBER.fullmatch(word.text):
        hint = "a number looks like `12`, `-0.5` or `2.41e+09`, without a unit"
        diagnostics.error(f"`{shorten(word.text)}` is not a number", word, hint)
        return None
    try:
        return convert_to_si(word.text.lower().replace("d", "e"), factor)
    except OverflowError:
        diagnostics.error(f"`{shorten(word.text)}` is too large", word, "a number must be finite")
        return None


def _format_scaled(value: float, places: int) -> str:
    """The shortest decimal of `value` times 10^places."""
    exact = Decimal(repr(value)).scaleb(places).normalize()
    if exact == 0:
        return "0.0"
    text = f"{exact:f}" if -6 <= exact.adjusted() < 12 else f"{exact:e}"
    return text
