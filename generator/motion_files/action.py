"""The action file: a motion as text that explains itself (figure 3.6; `docs/action-file.md`).

Displacements are in degrees and centimetres, exact to the last bit: a float of degrees does not
hold every float of radians, so the text is the shortest decimal whose exact value, converted to SI,
is the original float. Reading is the exact inverse of writing.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from decimal import Context, Decimal
from fractions import Fraction
from math import isfinite
from pathlib import Path

import numpy as np

from generator.diagnostics import (
    Diagnostics,
    InputError,
    NamedMapping,
    Source,
    Span,
    TooManyErrors,
    error,
    shorten,
    spelling_hint,
)
from generator.figure import AxisKind, Figure, JointAxis
from generator.file_kind import FileKind
from generator.losses import Losses
from generator.motion_files.motion import (
    NO_FIGURE,
    NONE,
    FigureMotion,
    Header,
    lost_props,
    unrepresented,
)
from generator.recording import Ending
from generator.rotations import Array
from generator.text_io import write_atomic
from generator.units import (
    ROTATION_UNITS,
    TRANSLATION_UNITS,
    Dimension,
    convert_to_si,
    format_quantity,
    parse_unit,
)
from springs.short_repr import short_repr

ANGLE_UNIT = ROTATION_UNITS.displacement
LENGTH_UNIT = TRANSLATION_UNITS.displacement

_EXACT_CONTEXT = Context(prec=60)
_ROUNDING_CONTEXT = Context(prec=18)  # with 17 the floats just above a power of two may be missed


def format_displacement(value: float, unit: str) -> str:
    """Format a displacement [rad or m] in `unit`. Raises ValueError unless it is finite."""
    if not isfinite(value):
        raise ValueError(f"an output file cannot hold {value}")
    if value == 0.0:
        return repr(float(value))
    scale = parse_unit(unit).factor
    near = float(value) / float(scale)
    text = repr(near)
    if isfinite(near) and convert_to_si(text, scale) == value:
        return text
    exact = Fraction(value) / scale
    quotient = _EXACT_CONTEXT.divide(Decimal(exact.numerator), Decimal(exact.denominator))
    return str(_ROUNDING_CONTEXT.plus(quotient)).replace("E", "e")


def parse_displacement(text: str, unit: str) -> float:
    """Parse a displacement in `unit` [rad or m].

    Raises ValueError for an invalid number, OverflowError beyond the largest float.
    """
    near = float(text)
    return near if near == 0.0 else convert_to_si(text, parse_unit(unit).factor)


def format_chain(chain: Sequence[JointAxis]) -> str:
    """Format a chain in the figure language; `fixed` without degrees of freedom."""
    axes = [",".join(format_quantity(x, Dimension.NUMBER) for x in one.axis) for one in chain]
    return "*".join(f"{f.kind.value}({a})" for f, a in zip(chain, axes, strict=True)) or "fixed"


VERSION = "1"
UNITS = f"s {ANGLE_UNIT} {LENGTH_UNIT}"
END = "end"


@short_repr
@dataclass(frozen=True, eq=False)
class ActionFile:
    """Contents of an action file, in SI units and radians; n frames.

    Attributes:
        header: where the motion is from.
        chains: the factors of each joint, in figure order, the innermost first.
        times: shape (n,) [s].
        displacements: displacements of each joint, shape (n, degrees of freedom) [rad or m].
    """

    header: Header
    chains: Mapping[str, tuple[JointAxis, ...]]
    times: Array
    displacements: Mapping[str, Array]

    def __post_init__(self) -> None:
        """Refuse what an action file cannot hold."""
        if self.times.ndim != 1 or self.times.size == 0 or np.any(np.diff(self.times) <= 0.0):
            raise ValueError("the times of a motion are one row that increases")
        for name, chain in self.chains.items():
            if name.split() != [name] or name.startswith("#"):
                raise ValueError(f"an action file cannot hold a joint named {name!r}")
            if self.displacements[name].shape != (len(self.times), len(chain)):
                raise ValueError(f"joint {name} needs {len(chain)} displacements a frame")
        for name in ("chains", "displacements"):
            values = NamedMapping(getattr(self, name), "the motion has no joint")
            object.__setattr__(self, name, values)

    @property
    def normalised_times(self) -> Array:
        """Times as fractions of the motion, 0 to 1, shape (n,); 0 for a single frame."""
        return normalise_times(self.times)


def normalise_times(times: Array) -> Array:
    """Times as fractions of the whole, shape (n,); 0 for a single one."""
    whole = times[-1] - times[0]
    return (times - times[0]) / (whole if whole > 0.0 else 1.0)


def motion_from_action(action: ActionFile, figure: Figure) -> FigureMotion:
    """The motion in an action file, of a figure."""
    return FigureMotion(figure, action.header, action.chains, action.times, action.displacements)


def format_action(action: ActionFile) -> str:
    """The text of an action file. Raises ValueError for a number that is not finite."""
    return "".join(f"{line}\n" for line in _lines(action))


def write(motion: FigureMotion, path: Path) -> Losses:
    """Write a motion as an action file, whole or not at all.

    Raises:
        OSError: the file cannot be written.
        ValueError: a displacement is not finite, or a name not one word.
    """
    action = ActionFile(motion.header, motion.chains, motion.times, motion.displacements)
    write_atomic(path, format_action(action))
    return Losses.collect("action file", [NO_FIGURE, lost_props(motion), unrepresented(motion)])


def _lines(action: ActionFile) -> Iterator[str]:
    yield "# The motion of a figure: a table of its joints, then a row for each frame."
    yield f"action {VERSION}"
    yield f"units {UNITS}"
    yield from action.header.lines()
    yield f"joints {len(action.chains)}"
    columns: list[str] = []
    for name, chain in action.chains.items():
        yield f"{name} {format_chain(chain)}"
        columns += [f"{name}.{k}" for k in range(1, len(chain) + 1)]
    yield f"frames {len(action.times)}"
    yield f"# {' '.join(['normalised', 'seconds', *columns])}"
    units = {
        name: [factor.units.displacement for factor in chain]
        for name, chain in action.chains.items()
    }
    rows = {name: action.displacements[name].tolist() for name in action.chains}
    fractions, times = action.normalised_times.tolist(), action.times.tolist()
    for frame, (fraction, time) in enumerate(zip(fractions, times, strict=True)):
        words = [repr(fraction), repr(time)]
        for name, row in rows.items():
            words += map(format_displacement, row[frame], units[name])
        yield " ".join(words)
    yield END


MAX_NORMALISED_TIME_ERROR = 1e-9
"""Largest error of a normalised time."""

_WORD = re.compile(r"\S+")
DIGEST = re.compile(r"[0-9a-f]{64}")
_NUMBER_REGEX = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?"
_COUNT = re.compile(r"[0-9]{1,9}")
_NUMBER_PATTERN = re.compile(_NUMBER_REGEX)
_FACTOR = re.compile(rf"([RT])\(({_NUMBER_REGEX}),({_NUMBER_REGEX}),({_NUMBER_REGEX})\)")


def read_action(path: str | Path) -> ActionFile:
    """Read an action file. Raises InputError with all errors."""
    return ACTION_FILE.read(path)


def _parse_action(source: Source, diagnostics: Diagnostics) -> ActionFile | None:
    try:
        return _Parser(source).parse()
    except InputError as failure:
        diagnostics.extend(Diagnostics(list(failure.diagnostics)))
        return None


ACTION_FILE = FileKind("motion", ".action", _parse_action)


class _Parser:
    """Parses the lines that are neither blank nor comments."""

    def __init__(self, source: Source) -> None:
        self._source = source
        self._lines: list[Span] = []
        start = 0
        for line in source.text.split("\n"):
            if line.strip() and not line.startswith("#"):
                self._lines.append(Span(source, start, start + len(line)))
            start += len(line) + 1
        self._next = 0

    def parse(self) -> ActionFile:
        """The whole file."""
        version = self._entry("action")
        if version.text != VERSION:
            raise _error_at(
                version,
                f"unknown version `{shorten(version.text)}` of the action file",
                f"this program reads version {VERSION}",
            )
        units = self._entry("units")
        if units.text != UNITS:
            raise _error_at(units, f"unknown units `{shorten(units.text)}`", f"they are `{UNITS}`")
        header = self._header()
        chains = self._chains()
        return self._motion(header, chains)

    def _next_line(self, expected: str) -> Span:
        """The next line."""
        if self._next == len(self._lines):
            end = len(self._source.text.rstrip())
            place = Span(self._source, max(end - 1, 0), max(end, 1))
            raise _error_at(place, f"the file ends before {expected}", "it is not whole")
        self._next += 1
        return self._lines[self._next - 1]

    def _entry(self, key: str) -> Span:
        """The value after `key`."""
        line = self._next_line(f"`{key}`")
        word, _, value = line.text.partition(" ")
        if word != key or not value.strip():
            raise _error_at(
                line, f"expected `{key}` and its value", f"found `{shorten(line.text)}`"
            )
        start = line.start + len(word) + 1
        lead = len(value) - len(value.lstrip())
        return Span(self._source, start + lead, start + len(value.rstrip()))

    def _time(self, key: str) -> float:
        return _number(self._entry(key), "s")

    def _header(self) -> Header:
        figure, digest = self._entry("figure"), self._entry("sha256")
        if digest.text != NONE and not DIGEST.fullmatch(digest.text):
            raise _error_at(
                digest, "this is not a SHA-256 digest", f"64 hexadecimal digits, or `{NONE}`"
            )
        start, stop = self._time("start"), self._time("stop")
        frame = self._entry("frame")
        interval = None if frame.text == NONE else _number(frame, "s")
        springs, law, outcome = self._entry("springs"), self._entry("law"), self._entry("outcome")
        endings = {ending.value: ending for ending in Ending}
        if outcome.text not in endings:
            raise _error_at(
                outcome,
                f"unknown outcome `{shorten(outcome.text)}`",
                spelling_hint(outcome.text, endings),
            )
        return Header(
            figure=figure.text,
            sha256=None if digest.text == NONE else digest.text,
            start=start,
            stop=stop,
            frame_interval=interval,
            springs=springs.text,
            law=law.text,
            outcome=endings[outcome.text],
            message=self._entry("message").text,
        )

    def _count(self, key: str, min_count: int) -> int:
        place = self._entry(key)
        if not _COUNT.fullmatch(place.text) or int(place.text) < min_count:
            raise _error_at(place, f"`{shorten(place.text)}` is not a number of {key}")
        return int(place.text)

    def _chains(self) -> dict[str, tuple[JointAxis, ...]]:
        chains: dict[str, tuple[JointAxis, ...]] = {}
        for k in range(self._count("joints", 0)):
            line = self._next_line(f"joint {k + 1} of the table")
            words = words_of_line(line)
            if len(words) != 2:
                raise _error_at(line, "a joint has a name and a chain", "`knee R(0,-1,0)`")
            name = words[0].text
            if name in chains:
                raise _error_at(words[0], f"a second joint `{shorten(name)}`")
            chains[name] = parse_chain(words[1])
        return chains

    def _frame_line(self, expected: str) -> Span:
        line = self._next_line(expected)
        if line.text.strip() == END:
            raise _error_at(line, f"`{END}` stands before {expected}", "it is not whole")
        return line

    def _motion(self, header: Header, chains: dict[str, tuple[JointAxis, ...]]) -> ActionFile:
        """Parse the rows and report all errors."""
        units = [factor.units.displacement for chain in chains.values() for factor in chain]
        count = self._count("frames", 1)
        lines = [self._frame_line(f"frame {k + 1} of {count}") for k in range(count)]
        end = self._next_line(f"`{END}`")
        if end.text.strip() != END:
            raise _error_at(end, f"expected `{END}` after {count} frames")
        if self._next < len(self._lines):
            raise _error_at(self._lines[self._next], f"nothing stands after `{END}`")
        table = _table(lines, ["s", "s", *units], header)
        cuts = np.cumsum([2, *(len(chain) for chain in chains.values())])
        _, *parts = np.split(table, cuts[:-1], axis=1) if chains else [table]
        return ActionFile(header, chains, table[:, 1].copy(), dict(zip(chains, parts, strict=True)))


def _table(lines: list[Span], units: list[str], header: Header) -> Array:
    """Parse the numbers of all frames, one row each. Raises InputError with all errors."""
    collector = Diagnostics()
    table = np.zeros((len(lines), len(units)))
    with suppress(TooManyErrors):
        for k, line in enumerate(lines):
            numbers = _row(line, units, collector)
            if numbers is not None:
                table[k] = numbers
        if not collector.has_errors:
            _check_times(table, lines, header, collector)
    if collector.has_errors:
        raise InputError(collector.sorted_by_position())
    return table


def _row(line: Span, units: list[str], diagnostics: Diagnostics) -> list[float] | None:
    """Parse normalised time, seconds [s] and displacements [rad or m]; None with an error."""
    words = words_of_line(line)
    if len(words) != len(units):
        diagnostics.error(
            f"this row has {len(words)} columns, not {len(units)}",
            line,
            "normalised time, seconds, and a column for each displacement",
        )
        return None
    numbers: list[float] = []
    for word, unit in zip(words, units, strict=True):
        try:
            numbers.append(_number(word, unit))
        except InputError as failure:
            for fault in failure.diagnostics:
                diagnostics.error(fault.message, fault.span, fault.hint)
    return numbers if len(numbers) == len(units) else None


def _check_times(table: Array, lines: list[Span], header: Header, diagnostics: Diagnostics) -> None:
    """Check that times increase and agree with the header and the normalised times."""
    times = table[:, 1]
    for k in np.flatnonzero(np.diff(times) <= 0.0):
        diagnostics.error("the time does not increase", words_of_line(lines[k + 1])[1])
    if diagnostics.has_errors:
        return
    for k in np.flatnonzero(
        np.abs(table[:, 0] - normalise_times(times)) > MAX_NORMALISED_TIME_ERROR
    ):
        diagnostics.error(
            "the normalised time does not belong to the seconds", words_of_line(lines[k])[0]
        )
    if header.start != times[0]:
        diagnostics.error(f"the first frame is not at the start, {header.start} s", lines[0])
    if header.stop != times[-1]:
        diagnostics.error(f"the last frame is not at the stop, {header.stop} s", lines[-1])


def _error_at(span: Span, message: str, hint: str = "") -> InputError:
    return InputError((error(message, span, hint),))


def words_of_line(line: Span) -> list[Span]:
    """Words of a line, with their places."""
    return [
        Span(line.source, line.start + match.start(), line.start + match.end())
        for match in _WORD.finditer(line.text)
    ]


def _number(span: Span, unit: str) -> float:
    """Parse the number at a place in a unit, as SI."""
    if not _NUMBER_PATTERN.fullmatch(span.text):
        raise _error_at(span, f"`{shorten(span.text)}` is not a number")
    try:
        return parse_displacement(span.text, unit)
    except (ValueError, OverflowError):
        raise _error_at(span, f"`{shorten(span.text)}` is not finite") from None


def parse_chain(span: Span) -> tuple[JointAxis, ...]:
    """Parse a chain as `format_chain` writes it. Raises InputError."""
    if span.text == "fixed":
        return ()
    factors: list[JointAxis] = []
    for text in span.text.split("*"):
        match = _FACTOR.fullmatch(text)
        if match is None:
            raise _error_at(
                span, f"`{shorten(span.text)}` is not a chain", "`R(0,0,1)*R(1,0,0)` or `fixed`"
            )
        x, y, z = (float(part) for part in match.groups()[1:])
        factors.append(JointAxis(AxisKind(match[1]), (x, y, z)))
    return tuple(factors)
