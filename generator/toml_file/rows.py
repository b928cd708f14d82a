"""Rows of a table: each is a key with the form and the bounds of its value."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Any, Generic, TypeVar, cast

from generator.diagnostics import closest_match
from generator.toml_file.reader import TableReader, unit_factor
from generator.toml_file.writer import number_to_toml, quote_toml

V = TypeVar("V")

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Row(ABC, Generic[V]):
    """A key of a table. One with an example of its value, in TOML, must be there."""

    key: str
    example: str = field(default="", kw_only=True)

    @abstractmethod
    def read(self, table: TableReader) -> V | None:
        """Return the value; None if it is absent or, with an error noted, wrong."""

    @abstractmethod
    def value_to_toml(self, value: V) -> str:
        """Return a value as it is written."""

    def write(self, value: V) -> str:
        """Return the line of a value, which is read as an equal one."""
        return f"{self.key} = {self.value_to_toml(value)}"


@dataclass(frozen=True)
class Text(Row[str]):
    """A string."""

    def read(self, table: TableReader) -> str | None:
        """Return the string."""
        return table.text(self.key)

    def value_to_toml(self, value: str) -> str:
        """Return it in quotes."""
        return quote_toml(value)


@dataclass(frozen=True)
class Number(Row[float]):
    """A number in SI, within bounds that have their unit in errors."""

    least: float = -inf
    largest: float = inf
    unit: str = ""
    hint: str = ""
    is_positive: bool = False

    def read(self, table: TableReader) -> float | None:
        """Return the number [SI]."""
        value = table.number(self.key)
        is_below = value is not None and self.is_positive and value <= 0.0
        if value is None or (self.least <= value <= self.largest and not is_below):
            return value
        bounds = "above zero" if is_below else f"from {self.least:g} to {self.largest:g}{self.unit}"
        table.error(self.key, f"`{self.key}` must be {bounds}, not {value:g}", self.hint)
        return None

    def value_to_toml(self, value: float) -> str:
        """Return it in the unit of the key."""
        return number_to_toml(value, unit_factor(self.key))


@dataclass(frozen=True)
class Integer(Row[int]):
    """A whole number within bounds."""

    least: int
    largest: int

    def read(self, table: TableReader) -> int | None:
        """Return the whole number."""
        value: Any = table.content.get(self.key)
        if value is None:
            return None
        if type(value) is not int:
            hint = "without quotes and decimals"
            table.error(self.key, f"`{self.key}` must be a whole number", hint)
        elif not self.least <= value <= self.largest:
            table.error(self.key, f"`{self.key}` must be from {self.least:,} to {self.largest:,}")
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
class Vector3(Row[Vector]):
    """Three numbers in SI, of a largest magnitude; what each of them is called in errors.

    `positive_error` is the message and the hint for one that is not above zero.
    """

    largest: float = inf
    hint: str = ""
    noun: str = "number"
    positive_error: tuple[str, str] | None = None

    def read(self, table: TableReader) -> Vector | None:
        """Return the numbers [SI]."""
        values, is_valid = table.numbers(self.key, 3), True
        for k, value in enumerate(values or ()):
            message, hint = f"this {self.noun} is too large", self.hint
            if self.positive_error is not None and value <= 0.0:
                message, hint = self.positive_error
            elif abs(value) <= self.largest:
                continue
            table.error(self.key, message, hint, k)
            is_valid = False
        return cast("Vector", values) if values is not None and is_valid else None

    def value_to_toml(self, value: Vector) -> str:
        """Return a list in the unit of the key."""
        factor = unit_factor(self.key)
        return f"[{', '.join(number_to_toml(part, factor) for part in value)}]"


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

    def check_keys(self, table: TableReader) -> None:
        """Note an error for each unknown key, and for each missing one that has an example."""
        table.reject_unknown_keys(self.keys, self.noun)
        examples = {row.key: row.example for row in self.rows if row.example}
        require_keys(table, examples, self.noun, self.keys)


def require_keys(
    table: TableReader, examples: Mapping[str, str], noun: str, known: tuple[str, ...]
) -> bool:
    """Note an error for each missing key, unless an unknown key is a slip of it.

    Args:
        table: Table that is checked.
        examples: Examples of the values of the required keys.
        noun: Noun by which messages call the table.
        known: other keys, which are not slips.

    Returns:
        Whether all keys are there.
    """
    slips = {
        closest_match(key, {*examples, *known})
        for key in table.content
        if key not in known and key not in examples
    }
    missing = [key for key in examples if key not in table.content]
    for key in missing:
        if key not in slips:
            message, hint = f"this {noun} has no `{key}`", f"write `{key} = {examples[key]}`"
            table.diagnostics.error(message, table.header_span, hint)
    return not missing
