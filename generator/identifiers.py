"""Names that every format takes: ASCII letters, digits and `_`, and no two alike."""

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import count

from generator.figure import JointAxis
from generator.losses import Effect, Loss

_INVALID_CHARACTER = re.compile(r"[^A-Za-z0-9_]")


def plain_names(names: Iterable[str]) -> dict[str, str]:
    """Return a plain name for each name; names of figure files do not change."""
    listed = list(dict.fromkeys(names))
    plain = {name: name for name in listed if plain_name(name) == name}
    taken = set(plain)
    for name in listed:
        if name not in plain:
            plain[name] = reserve_name(plain_name(name), taken)
    return {name: plain[name] for name in listed}


def plain_name(name: str) -> str:
    """Return the name with `_` for all but ASCII letters and digits, and before a first digit."""
    word = _INVALID_CHARACTER.sub("_", name)
    return word if word and not word[0].isdigit() else f"_{word}"


def free_name(name: str, taken: Collection[str]) -> str:
    """Return the name, or the first of `NAME_2`, `NAME_3` ... that is not taken."""
    return next(new for k in count(1) if (new := name if k == 1 else f"{name}_{k}") not in taken)


def reserve_name(name: str, taken: set[str]) -> str:
    """Return a free name as `free_name` does, and add it to those that are taken."""
    new = free_name(name, taken)
    taken.add(new)
    return new


def renaming_loss(new_names: Mapping[str, str]) -> Loss | None:
    """Return the loss for the names that changed; None if none did."""
    changed = tuple(f"{name!r} is {word}" for name, word in new_names.items() if name != word)
    if not changed:
        return None
    return Loss(
        "names with other characters than letters, digits and _", changed, effect=Effect.DESCRIPTION
    )


def coordinate_names(chains: Mapping[str, Sequence[JointAxis]]) -> dict[str, tuple[str, ...]]:
    """Return the coordinate names `JOINT_1`, `JOINT_2` ... of each joint's displacements.

    They are numbered from 1 in the order of the chain, the innermost factor first, as the
    displacements in figure and action files are.
    """
    plain = plain_names(chains)
    return {
        name: tuple(f"{plain[name]}_{k}" for k in range(1, len(chain) + 1))
        for name, chain in chains.items()
    }
