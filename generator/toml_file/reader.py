"""Values of a TOML table, read in SI by the unit that ends their key."""

import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, cast

from generator.diagnostics import Diagnostics, Source, Span, closest_match, shorten, spelling_hint
from generator.figure_file.lexer import MAX_WORD_LENGTH
from generator.toml_file.spans import TomlSpans, locate_keys
from generator.toml_file.writer import MAX_LINE_LENGTH
from generator.units import convert_to_si, parse_unit

Pair = tuple[float, float]

_UNIT_FACTORS: Mapping[str, Fraction] = {
    unit: parse_unit(unit).factor for unit in ("deg", "mm", "cm", "in", "ft")
}
"""SI value of 1 for keys that end in `_deg` or `_cm`; keys of other endings are in SI already."""


def unit_factor(key: str) -> Fraction:
    """Return the SI value of 1 for numbers of a key, by its ending."""
    return _UNIT_FACTORS.get(key.rpartition("_")[2], Fraction(1))


@dataclass(frozen=True)
class NumberText:
    """A decimal number as written, so that it is converted once and exactly."""

    text: str


def number_text(text: str) -> NumberText:
    """Return a decimal number unconverted, for `tomllib`."""
    return NumberText(text.replace("_", ""))


@dataclass(frozen=True)
class TableReader:
    """One table: its content as `tomllib` read it, and the spans of its keys."""

    content: Mapping[str, Any]
    name: str
    index: int
    spans: TomlSpans
    diagnostics: Diagnostics
    parent_item: tuple[str, int] | None = None
    """Of an inline table: key and index in its list; its own keys have no span."""

    @property
    def header_span(self) -> Span:
        """Span of the table's header."""
        if self.parent_item is not None:
            return self.spans.value(self.name, self.index, *self.parent_item)
        return self.spans.table(self.name, self.index)

    def span(self, key: str, item: int | None = None, part: int | None = None) -> Span:
        """Span of a value, of one item of an array, or of one part of such an item."""
        if self.parent_item is not None:
            return self.header_span
        return self.spans.value(self.name, self.index, key, item, part)

    def error(
        self,
        key: str,
        message: str,
        hint: str = "",
        item: int | None = None,
        part: int | None = None,
    ) -> None:
        """Note an error of a value."""
        self.diagnostics.error(message, self.span(key, item, part), hint)

    def reject_unknown_keys(self, known: Iterable[str], noun: str) -> None:
        """Note an error for each key that is not in `known`."""
        names = tuple(known)
        for key in self.content:
            if key not in names:
                place = self.header_span
                if self.parent_item is None:
                    place = self.spans.key(self.name, self.index, key)
                message = f"unknown key `{shorten(key)}` in a {noun}"
                self.diagnostics.error(message, place, spelling_hint(key, names))

    def text(self, key: str) -> str | None:
        """A string."""
        value = self.content.get(key)
        if value is None or isinstance(value, str):
            return value
        self.error(key, f"`{key}` must be a text", 'a text stands in quotes: `"..."`')
        return None

    def choice(self, key: str, known: tuple[str, ...]) -> str | None:
        """One of a few strings."""
        value = self.content.get(key)
        if value is None or value in known:
            return value
        is_text = isinstance(value, str)
        near = closest_match(value, known) if is_text else None
        hint = f"did you mean `{near}`?" if near else f"it is one of: {', '.join(known)}"
        shown = shorten(value) if is_text else self.span(key).text
        self.error(key, f"`{key}` cannot be `{shown}`", hint)
        return None

    def tables(self, name: str, noun: str) -> list["TableReader"]:
        """Readers of all `[[name]]`; messages call several of them `noun`."""
        found: Any = self.content.get(name, [])
        if isinstance(found, list) and all(isinstance(t, dict) for t in cast("list[Any]", found)):
            tables = enumerate(cast("list[Mapping[str, Any]]", found))
            return [TableReader(t, name, k, self.spans, self.diagnostics) for k, t in tables]
        self.error(name, f"{noun} are tables", f"write `[[{name}]]` above each")
        return []

    def names(self, key: str, example: str) -> tuple[str, ...]:
        """One or more names; empty if they are absent or, with a fault noted, wrong."""
        if key not in self.content:
            return ()
        items = self.items(key)
        if not items or not all(isinstance(item, str) for item in items):
            self.error(key, f"`{key}` must be a list of names", f"as in `{example}`")
            return ()
        return tuple(items)

    def number(self, key: str) -> float | None:
        """A number in SI; None if it is absent or, with a fault noted, wrong."""
        return self._number(key, self.content[key], None) if key in self.content else None

    def numbers(self, key: str, count: int) -> tuple[float, ...] | None:
        """A list of `count` numbers in SI; None as for `number`."""
        if key not in self.content:
            return None
        items, noun = self.items(key), "number" if count == 1 else "numbers"
        if items is None:
            self.error(key, f"`{key}` must be a list of {count} {noun}", "in square brackets")
            return None
        if len(items) != count:
            self.error(key, f"`{key}` has {len(items)} instead of {count} {noun}")
            return None
        read = [self._number(key, item, k) for k, item in enumerate(items)]
        values = tuple(number for number in read if number is not None)
        return values if len(values) == count else None

    def numbers_in(self, key: str, units: Sequence[str]) -> tuple[float, ...] | None:
        """A list of numbers in these units, in SI; or a single number where there is one unit.

        None as for `number`. The end of the key is not a unit.
        """
        items = self.items(key)
        if items is None and len(units) == 1:
            value = self._number(key, self.content[key], None, unit=units[0])
            return None if value is None else (value,)
        if items is None or len(items) != len(units):
            count = f"{len(units)} {'number' if len(units) == 1 else 'numbers'}"
            self.error(key, f"`{key}` must be a list of {count}", f"[{', '.join(units)}]")
            return None
        read = [
            self._number(key, item, k, unit=unit)
            for k, (item, unit) in enumerate(zip(items, units, strict=True))
        ]
        values = tuple(number for number in read if number is not None)
        return values if len(values) == len(units) else None

    def pairs(
        self, key: str, min_count: int, units: tuple[str, str] = ("", "")
    ) -> tuple[Pair, ...]:
        """A list of pairs of numbers in SI, `min_count` or more; empty as None for `number`.

        Args:
            key: its name.
            min_count: how many there are at least.
            units: "deg" for a number of each pair in degrees.
        """
        pairs = self.number_lists(key, min_count, units, ("pair", "two", "[[0, 1.5], [10, 2]]"))
        return tuple((first, second) for first, second in pairs)

    def number_lists(
        self, key: str, min_count: int, units: Sequence[str], words: tuple[str, str, str]
    ) -> tuple[tuple[float, ...], ...]:
        """A list of lists of numbers in SI, `min_count` or more; empty as None for `number`.

        Args:
            key: its name.
            min_count: how many there are at least.
            units: "deg" for a number of each in degrees.
            words: what each is called in errors, how many numbers it has, and an example.
        """
        noun, count, example = words
        if key not in self.content:
            return ()
        items = self.items(key)
        if items is None or not all(isinstance(item, list) for item in items):
            message = f"`{key}` must be a list of {noun}s of numbers"
            self.error(key, message, f"as in `{example}`")
            return ()
        if len(items) < min_count:
            found = f"{len(items)} {noun if len(items) == 1 else noun + 's'}"
            self.error(key, f"`{key}` has {found} and needs {min_count} at least")
            return ()
        read: list[tuple[float, ...]] = []
        for k, item in enumerate(items):
            if len(item) != len(units):
                numbers = "number" if len(item) == 1 else "numbers"
                self.error(key, f"a {noun} has {count} numbers, not {len(item)} {numbers}", "", k)
                continue
            values = [self._number(key, one, k, part, units[part]) for part, one in enumerate(item)]
            known = tuple(value for value in values if value is not None)
            if len(known) == len(units):
                read.append(known)
        return tuple(read) if len(read) == len(items) else ()

    def items(self, key: str) -> list[Any] | None:
        """Return the items of a list unconverted; None for any other value."""
        value: Any = self.content.get(key)
        return cast("list[Any]", value) if isinstance(value, list) else None

    def _number(
        self, key: str, value: object, item: int | None, part: int | None = None, unit: str = ""
    ) -> float | None:
        """One finite number in SI."""
        factor = unit_factor(unit or key)
        text = value.text if isinstance(value, NumberText) else None
        if type(value) is int:
            text = str(value) if value.bit_length() < 8 * MAX_WORD_LENGTH else "inf"
        message, hint = "", ""
        if text is None:
            message, hint = "a number is expected here", "without quotes and without a unit"
        elif len(text) > MAX_WORD_LENGTH or "n" in text:
            message, hint = "this number is not finite", "a number is written in digits"
        else:
            with suppress(OverflowError):
                return convert_to_si(text, factor)
            message, hint = "this number is too large", "a number must be finite"
        self.error(key, message, hint, item, part)
        return None


MAX_TEXT_LENGTH = 100_000
"""Longest text that is read."""

_POSITION = re.compile(r" ?\(at (?:line ([0-9]+), column ([0-9]+)|end of document)\)$")


def parse_document(
    source: Source, file_kind: str, diagnostics: Diagnostics, max_length: int = MAX_TEXT_LENGTH
) -> TableReader | None:
    """Return the reader of a text in TOML, bounded in size; None with the fault noted.

    Args:
        source: the text.
        file_kind: file kind for messages ("links file").
        diagnostics: diagnostics for faults.
        max_length: max length of the text, in characters.
    """
    place = _find_excess(source, max_length)
    if place is not None:
        diagnostics.error(
            f"this is too long for a {file_kind}",
            place,
            f"at most {max_length:,} characters in all and {MAX_LINE_LENGTH:,} in a line",
        )
        return None
    try:
        content = tomllib.loads(source.text, parse_float=number_text)
        return TableReader(content, "", 0, locate_keys(source), diagnostics)
    except RecursionError:
        diagnostics.error(
            "brackets are nested too deeply", Span(source, 0, 1), "a list holds no list"
        )
    except tomllib.TOMLDecodeError as failure:
        message, span = _syntax_error(str(failure), source)
        diagnostics.error(message, span, f"a {file_kind} is written in TOML")
    return None


def _find_excess(source: Source, max_length: int) -> Span | None:
    """Span of the first character beyond the size limits."""
    if len(source.text) > max_length:
        return Span(source, max_length, max_length + 1)
    start = 0
    for line in source.text.split("\n"):
        if len(line) > MAX_LINE_LENGTH:
            return Span(source, start + MAX_LINE_LENGTH, start + MAX_LINE_LENGTH + 1)
        start += len(line) + 1
    return None


def _syntax_error(message: str, source: Source) -> tuple[str, Span]:
    """Split a message of `tomllib` into its text and its position as a span."""
    match = _POSITION.search(message)
    text = _POSITION.sub("", message)
    text = f"{text[:1].lower()}{text[1:]}".replace("\\n", "end of line")
    if match is None or match[1] is None:
        end = len(source.text.rstrip())
        return text, Span(source, max(end - 1, 0), max(end, 1))
    line, column = int(match[1]), int(match[2])
    before = sum(len(text) + 1 for text in source.text.split("\n")[: line - 1])
    offset = before + min(column - 1, max(len(source.line_text(line)) - 1, 0))
    return text, Span(source, offset, offset + 1)
