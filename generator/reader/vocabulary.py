"""The words of the figure language: which blocks and fields may stand where."""

from typing import Final

BLOCKS: Final[dict[str, tuple[str, ...]]] = {
    "figure": ("attribute", "segment", "joint"),
    "attribute": (),
    "segment": ("site",),
    "site": (),
    "joint": (),
}
"""For each kind of block, the blocks that may stand in it."""

FIELDS: Final[dict[str, tuple[str, ...]]] = {
    "figure": ("root",),
    "attribute": (),
    "segment": ("psurf", "attribute", "mass", "inertia"),
    "site": ("location", "globalforce", "localforce", "globalmoment", "localmoment"),
    "joint": ("connect", "type", "displacement", "stiff", "rest", "damp", "llimit", "ulimit"),
}
"""For each kind of block, its fields. An attribute's fields are free."""

WORDS: Final = frozenset(BLOCKS) | frozenset(word for words in FIELDS.values() for word in words)
"""Every word with a meaning of its own; one of them at the start of a line begins a statement."""


def known_in(kind: str) -> tuple[str, ...]:
    """All words that may begin a statement in a block of this kind."""
    return (*FIELDS[kind], *BLOCKS[kind])


def home_of(word: str) -> str | None:
    """The kind of block in which the field `word` stands, if it is one."""
    return next((kind for kind, words in FIELDS.items() if word in words), None)


def block_home(word: str) -> str | None:
    """The kind of block in which blocks of the kind `word` stand, if it is one."""
    return next((kind for kind, words in BLOCKS.items() if word in words), None)


def shown(word: str) -> str:
    """`word` as a sentence quotes it: cut when it is long."""
    return word if len(word) <= 40 else word[:37] + "..."
