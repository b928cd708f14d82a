"""Option values that a figure gives a meaning: `JOINT=a,b,c` and `X,Y,Z`."""

from collections.abc import Iterable, Mapping, Sequence
from math import isfinite

from generator.animation.displayed import meant_number, unit_of
from generator.commands.answer import UsageError
from generator.errors import nearest
from generator.figure import Factor, Figure, Vector
from generator.posture.free_root import let_go
from generator.posture.placement import drawn_displacements
from generator.posture.tree import hang
from generator.reader.values import bound_of

LARGEST = 1e9
"""Beyond it a component that a person gives is a slip; see `generator.reader.units.Bound`."""

Chains = Mapping[str, Sequence[Factor]]


def chains_of(figure: Figure, *, free_root: bool = False) -> Chains:
    """The chains that values can be given for, by joint.

    With a free root those of the figure let go, in which joints named after the segments that fly
    stand for those to the ground.
    """
    if free_root:
        figure, _ = let_go(figure, drawn_displacements(hang(figure)))
    return {name: joint.chain for name, joint in figure.joints.items()}


def displacements_given(
    option: str, texts: Iterable[str], chains: Chains
) -> dict[str, tuple[float, ...]]:
    """What `JOINT=a,b,c` says, by joint [rad or m, or their rates]; degrees and cm are written.

    Raises UsageError for what cannot be read or does not fit a chain.
    """
    given: dict[str, tuple[float, ...]] = {}
    for text in texts:
        name, equals, values = text.partition("=")
        name = name.strip()
        if not equals:
            raise UsageError(f"{option} {text}: expected JOINT=a,b,c")
        if name not in chains:
            hint = nearest(name, chains)
            raise UsageError(f"{option} {text}: the figure has no joint `{name}`; {hint}")
        if name in given:
            raise UsageError(f"{option} {text}: `{name}` was given before")
        parts, chain = values.split(","), chains[name]
        if len(parts) != len(chain):
            units = ",".join(map(unit_of, chain))
            raise UsageError(
                f"{option} {text}: `{name}` takes {len(chain)} values ({units}), not {len(parts)}"
            )
        given[name] = tuple(
            _meant(option, text, part.strip(), factor)
            for part, factor in zip(parts, chain, strict=True)
        )
    return given


def vector_given(option: str, text: str, largest: float = LARGEST) -> Vector:
    """What `X,Y,Z` says. Raises UsageError unless it is three numbers, none beyond `largest`."""
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise UsageError(f"{option} {text}: expected three numbers, X,Y,Z") from None
    if not all(map(isfinite, (x, y, z))):
        raise UsageError(f"{option} {text}: the numbers must be finite")
    if any(abs(part) > largest for part in (x, y, z)):
        raise UsageError(f"{option} {text}: the numbers must be at most {largest:g}")
    return x, y, z


def _meant(option: str, text: str, part: str, factor: Factor) -> float:
    try:
        value = meant_number(part, unit_of(factor))
    except (ValueError, OverflowError):
        raise UsageError(f"{option} {text}: `{part}` is no finite number") from None
    bound = bound_of(factor)
    if not bound.holds(value):
        raise UsageError(f"{option} {text}: `{part}` is beyond {bound.said}")
    return value
