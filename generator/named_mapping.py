"""Mappings from names to values whose error for an unknown name states the nearest one."""

from collections.abc import Iterable, Mapping
from typing import Protocol, TypeVar

from generator.diagnostics import ModelError, shorten, spelling_hint
from springs.short_repr import represent_mapping


class UnknownNameError(ModelError, KeyError):
    """A mapping has no such name; the message states the nearest one."""

    def __str__(self) -> str:
        """The sentence, without the quotes of a KeyError."""
        return str(self.args[0])


class Named(Protocol):
    """A value with a name."""

    @property
    def name(self) -> str:
        """The name."""
        ...


V = TypeVar("V")
N = TypeVar("N", bound=Named)


class NamedMapping(dict[str, V]):
    """Values by name, in order; `mapping[name]` raises UnknownNameError for an unknown name.

    `subject` opens its sentence: "the figure has no joint".
    """

    def __init__(self, values: Mapping[str, V] | Iterable[tuple[str, V]] = (), subject: str = ""):
        """Copy the values."""
        super().__init__(values)
        self.subject = subject or "there is no name"

    def __repr__(self) -> str:
        """Number of values and the first names, in a line."""
        return represent_mapping(self)

    def __missing__(self, name: str) -> V:
        """Raise UnknownNameError."""
        hint = spelling_hint(str(name), self) or "it has none"
        raise UnknownNameError(f"{self.subject} `{shorten(str(name))}`; {hint}")


def by_name(*values: N) -> dict[str, N]:
    """Return segments, sites, joints or attributes as a mapping from their names.

    Raises ModelError for a name that occurs twice.
    """
    mapping: dict[str, N] = {}
    for value in values:
        if mapping.setdefault(value.name, value) is not value:
            raise ModelError(f"two values are named `{shorten(value.name)}`")
    return mapping
