"""Representations of values in at most two lines, for an interactive session."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import MISSING, Field, fields
from typing import Any, TypeVar, cast

import numpy as np

C = TypeVar("C", bound=type[Any])

MAX_LENGTH = 200
"""Largest number of characters of a representation, about two lines."""

_MAX_FIELD_LENGTH = 50
_SHOWN_NAMES = 3
_SHOWN_NUMBERS = 4


def short_repr(cls: C) -> C:
    """Give a dataclass a representation by the fields that differ from their defaults.

    Large values are represented by their type and size, such as `<array (86, 3)>`.
    """
    type.__setattr__(cls, "__repr__", represent_fields)
    return cls


def represent_fields(value: object) -> str:
    """Represent a dataclass instance in at most `MAX_LENGTH` characters, without line breaks."""
    shown = ", ".join(_changed_fields(value))
    name = type(value).__name__
    return f"{name}({shorten(shown, MAX_LENGTH - len(name) - 2)})"


def represent_mapping(mapping: Mapping[str, object]) -> str:
    """Represent a mapping by its first names and its size: `<16 values: waist, neck, ...>`."""
    names = [str(name) for _, name in zip(range(_SHOWN_NAMES), mapping, strict=False)]
    more = ["..."] if len(mapping) > len(names) else []
    text = f"{_count(mapping)}: {', '.join([*names, *more])}" if names else _count(mapping)
    return f"<{shorten(text, MAX_LENGTH - 2)}>"


def shorten(text: str, length: int) -> str:
    """Cut a text to a length, and put line breaks into one line."""
    line = " ".join(text.split())
    return line if len(line) <= length else f"{line[: length - 3]}..."


def _changed_fields(value: object) -> Iterator[str]:
    """Yield `name=value` for the fields that are shown."""
    for each in fields(cast("Any", value)):
        content = getattr(value, each.name)
        if each.repr and not _is_default(each, content):
            yield f"{each.name}={_represent(content)}"


def _is_default(field: "Field[Any]", content: object) -> bool:
    default = field.default
    if field.default_factory is not MISSING:
        default = field.default_factory()
    if default is MISSING or isinstance(content, np.ndarray):
        return False
    return bool(content == default)


def _represent(content: object) -> str:
    """Represent the value of a field, by its size if it is large."""
    if isinstance(content, np.ndarray):
        return f"<array {np.shape(cast('Any', content))}>"
    if isinstance(content, str):
        return repr(shorten(content, _MAX_FIELD_LENGTH))
    if isinstance(content, Mapping):
        return represent_mapping(cast("Mapping[str, object]", content)) if content else "{}"
    if isinstance(content, Collection):
        items = cast("Collection[object]", content)
        are_few = len(items) <= _SHOWN_NUMBERS
        if not are_few or not all(isinstance(each, str | int | float) for each in items):
            return f"<{_count(items)}>" if items else "()"
        return f"({', '.join(map(_represent, items))})"
    if isinstance(content, float):
        return f"{content:.6g}"
    return shorten(repr(content), _MAX_FIELD_LENGTH)


def _count(values: Collection[object]) -> str:
    return "1 value" if len(values) == 1 else f"{len(values)} values"
