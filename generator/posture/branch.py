"""A joint of the tree that a figure is hung up as."""

from dataclasses import dataclass

from generator.figure import Joint


@dataclass(frozen=True)
class Branch:
    """A joint of the tree: `tip` hangs on `base`.

    `forward` tells whether the base is the joint's parent (`connect base to tip`).
    """

    joint: Joint
    base: str
    tip: str
    forward: bool
