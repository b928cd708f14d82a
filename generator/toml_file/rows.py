"""Rows of a table: each is a key with the form and the bounds of its value.

A row reads the value of its key, notes what is wrong with it, and writes it. It may name the
attribute of the object that holds the value; what the object has by default is not written.
"""

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from enum import Enum
from math import inf
from typing import Any, Generic, TypeVar, cast

from generator.diagnostics import closest_match
from generator.toml_file.reader import Pair, TableReader, unit_factor
from generator.toml_file.writer import (
    names_to_toml,
    number_to_toml,
    quote_long_toml,
    quote_toml,
    text_to_toml,
)

V = TypeVar("V")

Vector = tuple[float, float, float]

_UNLIKE_ANY_ITEM = object()

ENERGY_HINT = "a passive joint feeds no energy"


@dataclass(frozen=True)
class Row(ABC, Generic[V]):
    """A key of a table. One with an example of its value, in TOML, must be there.

    Attributes:
        key: Key in the table.
        example: Value of a required key, as it is written.
        attribute: Name of the attribute that holds the value, `parent.child` within a part of the
            object; several names for a value that is the tuple of them; "" for that of the key.
        is_always_written: Whether a default is written too.
        usual: Item of a list that is not written where all items are equal to this one.
    """

    key: str
    example: str = field(default="", kw_only=True)
    attribute: str | tuple[str, ...] = field(default="", kw_only=True)
    is_always_written: bool = field(default=False, kw_only=True)
    usual: object = field(default=_UNLIKE_ANY_ITEM, kw_only=True)

    @abstractmethod
    def read(self, table: TableReader) -> V | None:
        """Return the value; None if it is absent or, with an error noted, wrong."""

    @abstractmethod
    def value_to_toml(self, value: V) -> str:
        """Return a value as it is written."""

    @property
    def bounds(self) -> str:
        """Bounds of the value in words, with their unit; "" without any."""
        return ""

    def write(self, value: V) -> str:
        """Return the line of a value, which is read as an equal one."""
        return f"{self.key} = {self.value_to_toml(value)}"

    @property
    def attributes(self) -> tuple[str, ...]:
        """Names of the attributes that hold the value."""
        stated = self.attribute or self.key
        return (stated,) if isinstance(stated, str) else stated

    def values_by_attribute(self, table: TableReader) -> dict[str, Any]:
        """Return the value, or its parts, by attribute; {} where `read` returns None."""
        value: Any = self.read(table)
        if value is None:
            return {}
        parts: Any = (value,) if len(self.attributes) == 1 else value
        return dict(zip(self.attributes, parts, strict=True))

    def value_of(self, owner: object) -> V | None:
        """Return the value that an object has; None where there is none."""
        values: Any = tuple(_attribute(owner, name) for name in self.attributes)
        return values[0] if len(values) == 1 else values

    def lines(self, owner: object) -> Iterator[str]:
        """Yield the line of the value that an object has, unless it is the default."""
        value = self.value_of(owner)
        if value is not None and (self.is_always_written or not self._is_default(owner, value)):
            yield self.write(value)

    def _is_default(self, owner: object, value: V) -> bool:
        if self.usual is not _UNLIKE_ANY_ITEM:
            return all(item == self.usual for item in cast("tuple[object, ...]", value))
        return all(_attribute(owner, name) == _default(owner, name) for name in self.attributes)


def _attribute(owner: object, path: str) -> Any:
    """Return an attribute of an object, or of a part of it; None where there is no such part."""
    value: Any = owner
    for name in path.split("."):
        value = None if value is None else getattr(value, name)
    return value


def _default(owner: object, path: str) -> object:
    """Return the default of a field of a dataclass, or `MISSING`."""
    parent, _, name = path.rpartition(".")
    owner = _attribute(owner, parent) if parent else owner
    known = fields(owner) if is_dataclass(owner) else ()
    return next((each.default for each in known if each.name == name), MISSING)


@dataclass(frozen=True)
class Text(Row[str]):
    """A string; a long one may be written over several lines."""

    is_long: bool = field(default=False, kw_only=True)

    def read(self, table: TableReader) -> str | None:
        """Return the string."""
        return table.text(self.key)

    def value_to_toml(self, value: str) -> str:
        """Return it in quotes."""
        return quote_long_toml(value) if self.is_long else quote_toml(value)


@dataclass(frozen=True)
class Choice(Row[V]):
    """One of a few strings, a member of an enumeration by its value, or a value by its name."""

    known: tuple[V, ...] | Mapping[str, V]

    def read(self, table: TableReader) -> V | None:
        """Return the value."""
        text = table.choice(self.key, tuple(self._by_text))
        return None if text is None else self._by_text[text]

    def value_to_toml(self, value: V) -> str:
        """Return its text in quotes."""
        return quote_toml(next(text for text, one in self._by_text.items() if one == value))

    @property
    def bounds(self) -> str:
        """The strings."""
        return " or ".join(f'"{text}"' for text in self._by_text)

    @property
    def _by_text(self) -> Mapping[str, V]:
        if isinstance(self.known, Mapping):
            return self.known
        return {str(one.value if isinstance(one, Enum) else one): one for one in self.known}


@dataclass(frozen=True)
class Names(Row[tuple[str, ...]]):
    """One or more names; `form` is an example for a key that may be left out."""

    form: str = ""

    def read(self, table: TableReader) -> tuple[str, ...] | None:
        """Return the names."""
        return table.names(self.key, self.form or self.example) or None

    def value_to_toml(self, value: tuple[str, ...]) -> str:
        """Return the list."""
        return names_to_toml(value)


@dataclass(frozen=True)
class Block(Text):
    """A string of several lines."""

    def value_to_toml(self, value: str) -> str:
        """Return its lines between triple quotes."""
        return text_to_toml(value)


@dataclass(frozen=True)
class Number(Row[float]):
    """A number in SI, within bounds that have their unit in errors."""

    least: float = -inf
    largest: float = inf
    unit: str = ""
    hint: str = ""
    is_positive: bool = False

    @property
    def bounds(self) -> str:
        """The interval, or its finite end."""
        if self.largest < inf:
            return f"from {self.least:g} to {self.largest:g}{self.unit}"
        return "above zero" if self.is_positive else "not below zero" if self.least == 0.0 else ""

    def fault(self, value: float) -> str | None:
        """Return what a number must be that it is not; None for one within the bounds."""
        if self.is_positive and not value > 0.0:
            return f"must be above zero, not {value / float(unit_factor(self.key)):g}"
        if self.least <= value <= self.largest:
            return None
        if self.largest == inf:
            return "must not be below zero"
        return f"must be {self.bounds}, not {value:g}"

    def read(self, table: TableReader) -> float | None:
        """Return the number [SI]."""
        value = table.number(self.key)
        fault = None if value is None else self.fault(value)
        if fault is None:
            return value
        table.error(self.key, f"`{self.key}` {fault}", self.hint)
        return None

    def value_to_toml(self, value: float) -> str:
        """Return it in the unit of the key."""
        return number_to_toml(value, unit_factor(self.key))


@dataclass(frozen=True)
class Integer(Row[int]):
    """A whole number within bounds."""

    least: int
    largest: int

    @property
    def bounds(self) -> str:
        """The interval."""
        return f"from {self.least:,} to {self.largest:,}"

    def read(self, table: TableReader) -> int | None:
        """Return the whole number."""
        value: Any = table.content.get(self.key)
        if value is None:
            return None
        if type(value) is not int:
            hint = "without quotes and decimals"
            table.error(self.key, f"`{self.key}` must be a whole number", hint)
        elif not self.least <= value <= self.largest:
            table.error(self.key, f"`{self.key}` must be {self.bounds}")
        else:
            return value
        return None

    def value_to_toml(self, value: int) -> str:
        """Return its digits."""
        return str(value)


@dataclass(frozen=True)
class Flag(Row[bool]):
    """True or false."""

    def read(self, table: TableReader) -> bool | None:
        """Return whether it is true."""
        value: Any = table.content.get(self.key)
        if value is None or isinstance(value, bool):
            return value
        table.error(self.key, f"`{self.key}` must be true or false", "without quotes")
        return None

    def value_to_toml(self, value: bool) -> str:
        """Return `true` or `false`."""
        return str(value).lower()


@dataclass(frozen=True)
class Sign(Row[int]):
    """+1 or -1, with what each of them means."""

    hint: str = ""

    @property
    def bounds(self) -> str:
        """Both numbers."""
        return "-1 or +1"

    def read(self, table: TableReader) -> int | None:
        """Return the sign."""
        value: Any = table.content.get(self.key)
        if value is None or (type(value) is int and value in (-1, 1)):
            return value
        table.error(self.key, f"`{self.key}` must be {self.bounds}", self.hint)
        return None

    def value_to_toml(self, value: int) -> str:
        """Return it with its sign."""
        return f"{value:+d}"


@dataclass(frozen=True)
class NumberList(Row[V]):
    """A list of `count` numbers in SI, of a largest magnitude; each is called `noun` in errors.

    `count` may be the key of a list that has as many items. `positive_error` is the message and the
    hint for one that is not above zero, `negative_error` for one below zero.
    """

    largest: float = inf
    hint: str = ""
    noun: str = "number"
    positive_error: tuple[str, str] | None = None
    negative_error: tuple[str, str] | None = field(default=None, kw_only=True)
    count: int | str = field(default=3, kw_only=True)

    @property
    def bounds(self) -> str:
        """Bounds of each number."""
        if self.largest < inf:
            return self.hint
        return "not below zero" if self.negative_error else ""

    def read(self, table: TableReader) -> V | None:
        """Return the numbers [SI]."""
        count = item_count(table, self.count)
        values, is_valid = table.numbers(self.key, count) if count else None, True
        for k, value in enumerate(values or ()):
            message, hint = f"this {self.noun} is too large", self.hint
            if self.positive_error is not None and value <= 0.0:
                message, hint = self.positive_error
            elif self.negative_error is not None and value < 0.0:
                message, hint = self.negative_error
            elif abs(value) <= self.largest:
                continue
            table.error(self.key, message, hint, k)
            is_valid = False
        return cast("V", values) if values is not None and is_valid else None

    def value_to_toml(self, value: V) -> str:
        """Return a list in the unit of the key."""
        factor = unit_factor(self.key)
        parts = cast("tuple[float, ...]", value)
        return f"[{', '.join(number_to_toml(part, factor) for part in parts)}]"


def item_count(table: TableReader, count: int | str) -> int:
    """Return a number, or how many items the list of a key has; 0 without one."""
    return count if isinstance(count, int) else len(table.items(count) or ())


class Numbers(NumberList[tuple[float, ...]]):
    """Numbers in SI, as many as `count`."""


class Vector3(NumberList[Vector]):
    """Three numbers in SI."""


@dataclass(frozen=True)
class Interval(NumberList[Pair]):
    """Two numbers in SI, the lower and the upper end."""

    count: int | str = field(default=2, kw_only=True)

    def read(self, table: TableReader) -> Pair | None:
        """Return both ends [SI]."""
        ends = super().read(table)
        if ends is not None and ends[0] > ends[1]:
            table.error(self.key, f"`{self.key}` ends before it begins", "[lower, upper]")
            return None
        return ends


@dataclass(frozen=True)
class TableRows:
    """The rows of a table, and what one such table is called in errors.

    `other_keys` are keys whose values are read in another way.
    """

    noun: str
    rows: tuple[Row[Any], ...]
    other_keys: tuple[str, ...] = ()

    @property
    def keys(self) -> tuple[str, ...]:
        """All keys of the table."""
        return (*(row.key for row in self.rows), *self.other_keys)

    @property
    def examples(self) -> dict[str, str]:
        """Examples of the values of the required keys."""
        return {row.key: row.example for row in self.rows if row.example}

    def check_keys(self, table: TableReader) -> None:
        """Note an error for each unknown key, and for each missing one that has an example."""
        table.reject_unknown_keys(self.keys, self.noun)
        require_keys(table, self.examples, self.noun, self.keys)

    def read(self, table: TableReader) -> dict[str, Any]:
        """Return the values by attribute, without those that are absent or, with errors, wrong."""
        return read_rows(table, self.rows)

    def lines(self, owner: object) -> Iterator[str]:
        """Yield the lines of an object, without those that are read as defaults."""
        return lines_of_rows(owner, self.rows)


def read_rows(table: TableReader, rows: Iterable[Row[Any]]) -> dict[str, Any]:
    """Return the values of rows as `TableRows.read` does."""
    return {name: one for row in rows for name, one in row.values_by_attribute(table).items()}


def lines_of_rows(owner: object, rows: Iterable[Row[Any]]) -> Iterator[str]:
    """Yield the lines of rows as `TableRows.lines` does."""
    for row in rows:
        yield from row.lines(owner)


def require_keys(
    table: TableReader, examples: Mapping[str, str], noun: str, known: tuple[str, ...]
) -> bool:
    """Note an error for each missing key, unless an unknown key is a slip of it.

    Args:
        table: Table that is checked.
        examples: Examples of the values of the required keys.
        noun: Noun by which messages call the table.
        known: Other keys, which are not slips.

    Returns:
        Whether all keys are there.
    """
    slips = find_slips(table, (*known, *examples))
    missing = [key for key in examples if key not in table.content]
    for key in missing:
        if key not in slips:
            message, hint = f"this {noun} has no `{key}`", f"write `{key} = {examples[key]}`"
            table.diagnostics.error(message, table.header_span, hint)
    return not missing


def find_slips(table: TableReader, known: Collection[str]) -> set[str]:
    """Return the known keys of which an unknown key of a table may be a slip."""
    near = (closest_match(key, known) for key in table.content if key not in known)
    return {key for key in near if key is not None}
