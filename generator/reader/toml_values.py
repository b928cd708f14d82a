"""Values of a TOML table, in SI by the unit that ends their key, or a fault where one is wrong."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, cast

from generator.errors import nearest
from generator.reader.findings import Findings
from generator.reader.tokens import LONGEST_WORD
from generator.reader.toml_places import Places
from generator.reader.units import converted, unit_named
from generator.reader.vocabulary import shown
from generator.source import Span

TABLE = "spring"
"""Name of the tables of a springs file."""

_FACTORS: Mapping[str, Fraction] = {"deg": unit_named("deg").factor}
"""SI value of 1 for keys that end in `_deg`; the other keys are in SI already."""


@dataclass(frozen=True)
class NumberText:
    """A decimal number as written, so that it is converted once and exactly."""

    text: str


def number_text(text: str) -> NumberText:
    """What `tomllib` is to make of a decimal number."""
    return NumberText(text.replace("_", ""))


@dataclass(frozen=True)
class TableReader:
    """One table: its content as `tomllib` read it, and where to look for places."""

    content: Mapping[str, Any]
    name: str
    index: int
    places: Places
    findings: Findings

    @property
    def header(self) -> Span:
        """Where the table begins."""
        return self.places.table(self.name, self.index)

    def place(self, key: str, item: int | None = None) -> Span:
        """Where a value, or one item of an array, is written."""
        return self.places.value(self.name, self.index, key, item)

    def error(self, key: str, message: str, hint: str = "", item: int | None = None) -> None:
        """Note an error of a value."""
        self.findings.error(message, self.place(key, item), hint)

    def refuse_unknown(self, known: Iterable[str], what: str) -> None:
        """Note an error for each key that is none of `known`."""
        names = tuple(known)
        for key in self.content:
            if key not in names:
                place = self.places.key(self.name, self.index, key)
                message = f"unknown key `{shown(key)}` in a {what}"
                self.findings.error(message, place, nearest(key, names))

    def text(self, key: str) -> str | None:
        """A string."""
        value = self.content.get(key)
        if value is None or isinstance(value, str):
            return value
        self.error(key, f"`{key}` is a text", 'a text stands in quotes: `"..."`')
        return None

    def choice(self, key: str, known: tuple[str, ...]) -> str | None:
        """A string out of a few."""
        value = self.content.get(key)
        if value is None or value in known:
            return value
        said = shown(value) if isinstance(value, str) else self.place(key).text
        self.error(key, f"`{key}` is not `{said}`", f"it is one of: {', '.join(known)}")
        return None

    def names(self, key: str) -> tuple[str, ...]:
        """A list of names, at least one; empty, with a fault noted, when it is none."""
        value: Any = self.content.get(key)
        if value is None:
            hint = f'write `{key} = ["left_knee", "right_knee"]`'
            self.findings.error(f"this {self.name} has no `{key}`", self.header, hint)
            return ()
        items = cast("list[Any]", value) if isinstance(value, list) else []
        if not items or not all(isinstance(item, str) for item in items):
            self.error(key, f"`{key}` is a list of names", 'as in `["left_knee", "right_knee"]`')
            return ()
        return tuple(items)

    def number(self, key: str, *, negative: bool = True, zero: bool = True) -> float | None:
        """A number in SI; None when there is none or, with a fault noted, a wrong one."""
        if key not in self.content:
            return None
        value = self._number(key, self.content[key], None)
        if value is not None and ((value < 0.0 and not negative) or (value == 0.0 and not zero)):
            least = "not below zero" if zero else "above zero"
            self.error(key, f"`{key}` is {least}", "a passive joint feeds no energy")
            return None
        return value

    def numbers(self, key: str, count: int) -> tuple[float, ...] | None:
        """A list of `count` numbers in SI; None as for `number`."""
        if key not in self.content:
            return None
        value: Any = self.content[key]
        if not isinstance(value, list):
            self.error(key, f"`{key}` is a list of {count} numbers", "in square brackets")
            return None
        items = cast("list[Any]", value)
        if len(items) != count:
            self.error(key, f"`{key}` has {len(items)} instead of {count} numbers")
            return None
        read = [self._number(key, item, k) for k, item in enumerate(items)]
        values = tuple(number for number in read if number is not None)
        return values if len(values) == count else None

    def sign(self, key: str) -> int | None:
        """+1 or -1."""
        value = self.content.get(key)
        if value is None:
            return None
        if type(value) is int and value in (-1, 1):
            return value
        hint = "-1: the moment resists; +1: it acts on the child as it stands"
        self.error(key, f"`{key}` is -1 or +1", hint)
        return None

    def _number(self, key: str, value: object, item: int | None) -> float | None:
        """One finite number in SI."""
        factor = _FACTORS.get(key.rpartition("_")[2], Fraction(1))
        text = value.text if isinstance(value, NumberText) else None
        if type(value) is int:
            text = str(value) if value.bit_length() < 8 * LONGEST_WORD else "inf"
        if text is None:
            self.error(key, "a number is expected here", "without quotes and without a unit", item)
            return None
        if len(text) > LONGEST_WORD or "n" in text:
            self.error(key, "this number is not finite", "a number is written in digits", item)
            return None
        try:
            return converted(text, factor)
        except OverflowError:
            self.error(key, "this number is too large", "a number must be finite", item)
            return None
