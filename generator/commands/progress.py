"""How far a command is, told by the command and shown by whoever runs it."""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import TypeAlias

Done: TypeAlias = Callable[[str], None]
"""Told the name of each piece of work when it is done."""

Progress: TypeAlias = Callable[[int, str], AbstractContextManager[Done]]
"""Opens what is told of a number of pieces of work, called by a noun: `progress(17, "plates")`."""


def unshown(total: int, noun: str) -> AbstractContextManager[Done]:
    """Shows nothing."""
    del total, noun
    return nullcontext(_ignore)


def _ignore(name: str) -> None:
    del name
