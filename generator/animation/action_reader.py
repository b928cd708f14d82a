"""Reading an action file: the inverse of writing one, bit for bit."""

import re
from contextlib import suppress
from pathlib import Path

import numpy as np

from generator.animation.action import END, UNITS, VERSION, ActionFile, normalised
from generator.animation.displayed import meant_number, unit_of
from generator.animation.header import NONE, Header
from generator.errors import InputError, error, nearest
from generator.figure import Factor
from generator.frames import Array
from generator.reader.findings import EnoughFaults, Findings
from generator.reader.text_file import read_text, unified
from generator.reader.vocabulary import shown
from generator.recording import Ending
from generator.source import Source, Span

ROUNDING = 1e-9
"""By how much a normalised time may differ from that of its seconds."""

_WORD = re.compile(r"\S+")
_DIGEST = re.compile(r"[0-9a-f]{64}")
_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?"
_COUNT = re.compile(r"[0-9]{1,9}")
_IS_NUMBER = re.compile(_NUMBER)
_FACTOR = re.compile(rf"([RT])\(({_NUMBER}),({_NUMBER}),({_NUMBER})\)")


def read_action(path: str | Path) -> ActionFile:
    """The motion in an action file. Raises InputError with all faults, each with its line."""
    source, fault = read_text(Path(path), str(path))
    if fault is not None:
        raise InputError((fault,))
    return parse_action(source.text, source.name)


def parse_action(text: str, name: str = "<text>") -> ActionFile:
    """The motion that `text` describes. Raises InputError with all faults, each with its line."""
    return _Parser(Source(name, unified(text))).action()


class _Parser:
    """Goes through the lines that say something: not blank, no comment."""

    def __init__(self, source: Source) -> None:
        self._source = source
        self._lines: list[Span] = []
        start = 0
        for line in source.text.split("\n"):
            if line.strip() and not line.startswith("#"):
                self._lines.append(Span(source, start, start + len(line)))
            start += len(line) + 1
        self._next = 0

    def action(self) -> ActionFile:
        """The whole file."""
        version = self._entry("action")
        if version.text != VERSION:
            raise _at(
                version,
                f"unknown version `{shown(version.text)}` of the action file",
                f"this program reads version {VERSION}",
            )
        units = self._entry("units")
        if units.text != UNITS:
            raise _at(units, f"unknown units `{shown(units.text)}`", f"they are `{UNITS}`")
        header = self._header()
        chains = self._chains()
        return self._motion(header, chains)

    def _line(self, expected: str) -> Span:
        """The next line."""
        if self._next == len(self._lines):
            end = len(self._source.text.rstrip())
            place = Span(self._source, max(end - 1, 0), max(end, 1))
            raise _at(place, f"the file ends before {expected}", "it is not whole")
        self._next += 1
        return self._lines[self._next - 1]

    def _entry(self, key: str) -> Span:
        """The value after `key`."""
        line = self._line(f"`{key}`")
        word, _, value = line.text.partition(" ")
        if word != key or not value.strip():
            raise _at(line, f"expected `{key}` and its value", f"found `{shown(line.text)}`")
        start = line.start + len(word) + 1
        lead = len(value) - len(value.lstrip())
        return Span(self._source, start + lead, start + len(value.rstrip()))

    def _time(self, key: str) -> float:
        return _number(self._entry(key), "s")

    def _header(self) -> Header:
        figure, digest = self._entry("figure"), self._entry("sha256")
        if digest.text != NONE and not _DIGEST.fullmatch(digest.text):
            raise _at(digest, "this is no SHA-256", f"64 hexadecimal digits, or `{NONE}`")
        start, stop = self._time("start"), self._time("stop")
        frame = self._entry("frame")
        interval = None if frame.text == NONE else _number(frame, "s")
        springs, law, outcome = self._entry("springs"), self._entry("law"), self._entry("outcome")
        endings = {ending.value: ending for ending in Ending}
        if outcome.text not in endings:
            raise _at(
                outcome,
                f"unknown outcome `{shown(outcome.text)}`",
                nearest(outcome.text, endings),
            )
        return Header(
            figure=figure.text,
            sha256=None if digest.text == NONE else digest.text,
            start=start,
            stop=stop,
            frame=interval,
            springs=springs.text,
            law=law.text,
            outcome=endings[outcome.text],
            message=self._entry("message").text,
        )

    def _count(self, key: str, least: int) -> int:
        place = self._entry(key)
        if not _COUNT.fullmatch(place.text) or int(place.text) < least:
            raise _at(place, f"`{shown(place.text)}` is no number of {key}")
        return int(place.text)

    def _chains(self) -> dict[str, tuple[Factor, ...]]:
        chains: dict[str, tuple[Factor, ...]] = {}
        for k in range(self._count("joints", 0)):
            line = self._line(f"joint {k + 1} of the table")
            words = _words(line)
            if len(words) != 2:
                raise _at(line, "a joint has a name and a chain", "`knee R(0,-1,0)`")
            name = words[0].text
            if name in chains:
                raise _at(words[0], f"a second joint `{shown(name)}`")
            chains[name] = _chain(words[1])
        return chains

    def _frame(self, which: str) -> Span:
        line = self._line(which)
        if line.text.strip() == END:
            raise _at(line, f"`{END}` stands before {which}", "it is not whole")
        return line

    def _motion(self, header: Header, chains: dict[str, tuple[Factor, ...]]) -> ActionFile:
        """The rows, of which all faults are told."""
        units = [unit_of(factor) for chain in chains.values() for factor in chain]
        count = self._count("frames", 1)
        lines = [self._frame(f"frame {k + 1} of {count}") for k in range(count)]
        end = self._line(f"`{END}`")
        if end.text.strip() != END:
            raise _at(end, f"expected `{END}` after {count} frames")
        if self._next < len(self._lines):
            raise _at(self._lines[self._next], f"nothing stands after `{END}`")
        table = _table(lines, ["s", "s", *units], header)
        cuts = np.cumsum([2, *(len(chain) for chain in chains.values())])
        _, *parts = np.split(table, cuts[:-1], axis=1) if chains else [table]
        return ActionFile(header, chains, table[:, 1].copy(), dict(zip(chains, parts, strict=True)))


def _table(lines: list[Span], units: list[str], header: Header) -> Array:
    """The numbers of all frames, a row each. Raises InputError with the faults of all rows."""
    findings = Findings()
    table = np.zeros((len(lines), len(units)))
    with suppress(EnoughFaults):
        for k, line in enumerate(lines):
            numbers = _row(line, units, findings)
            if numbers is not None:
                table[k] = numbers
        if not findings.has_errors:
            _check_times(table, lines, header, findings)
    if findings.has_errors:
        raise InputError(findings.in_order())
    return table


def _row(line: Span, units: list[str], findings: Findings) -> list[float] | None:
    """Normalised time, seconds [s], displacements [rad or m]; None, with the faults noted."""
    words = _words(line)
    if len(words) != len(units):
        findings.error(
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
            for fault in failure.faults:
                findings.error(fault.message, fault.span, fault.hint)
    return numbers if len(numbers) == len(units) else None


def _check_times(table: Array, lines: list[Span], header: Header, findings: Findings) -> None:
    """Times increase, and agree with the header and with their normalised selves."""
    times = table[:, 1]
    for k in np.flatnonzero(np.diff(times) <= 0.0):
        findings.error("the time does not increase", _words(lines[k + 1])[1])
    if findings.has_errors:
        return
    for k in np.flatnonzero(np.abs(table[:, 0] - normalised(times)) > ROUNDING):
        findings.error("the normalised time does not belong to the seconds", _words(lines[k])[0])
    if header.start != times[0]:
        findings.error(f"the first frame is not at the start, {header.start} s", lines[0])
    if header.stop != times[-1]:
        findings.error(f"the last frame is not at the stop, {header.stop} s", lines[-1])


def _at(place: Span, message: str, hint: str = "") -> InputError:
    return InputError((error(message, place, hint),))


def _words(line: Span) -> list[Span]:
    return [
        Span(line.source, line.start + match.start(), line.start + match.end())
        for match in _WORD.finditer(line.text)
    ]


def _number(place: Span, unit: str) -> float:
    """The number [rad, m or as it stands] at a place in a unit."""
    if not _IS_NUMBER.fullmatch(place.text):
        raise _at(place, f"`{shown(place.text)}` is not a number")
    try:
        return meant_number(place.text, unit)
    except (ValueError, OverflowError):
        raise _at(place, f"`{shown(place.text)}` is not finite") from None


def _chain(place: Span) -> tuple[Factor, ...]:
    if place.text == "fixed":
        return ()
    factors: list[Factor] = []
    for text in place.text.split("*"):
        match = _FACTOR.fullmatch(text)
        if match is None:
            raise _at(place, f"`{shown(place.text)}` is no chain", "`R(0,0,1)*R(1,0,0)` or `fixed`")
        x, y, z = (float(part) for part in match.groups()[1:])
        factors.append(Factor("R" if match[1] == "R" else "T", (x, y, z)))
    return tuple(factors)
