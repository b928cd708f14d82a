"""Losses: the parts of a figure or motion that a format cannot hold."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import IntEnum

from springs.short_repr import short_repr

MAX_NAMED_PLACES = 8
"""Number of places that a sentence names; the data name all."""


class Effect(IntEnum):
    """Kind of change that a loss makes, the gravest first."""

    MOTION = 0
    """The motion, or what acts."""

    APPROXIMATION = 1
    """The motion, by an error that is small or stated."""

    DESCRIPTION = 2
    """Shapes, names, sources: what does not move."""

    ROUNDING = 3
    """The last digits of numbers."""


@dataclass(frozen=True)
class Loss:
    """One thing that is not in the file, or not as it was.

    Attributes:
        what: the sentence that says it, without a full stop.
        where: the joints, segments or other names that it is about; empty for the whole.
        effect: what it changes.
    """

    what: str
    where: tuple[str, ...] = ()
    effect: Effect = field(default=Effect.MOTION, kw_only=True)

    def __post_init__(self) -> None:
        """Refuse a loss without a sentence."""
        if not self.what.strip():
            raise ValueError("a loss says what was lost")

    def __str__(self) -> str:
        """Return the sentence with its places."""
        if not self.where:
            return self.what
        left = len(self.where) - MAX_NAMED_PLACES
        more = f" and {left} more" if left > 0 else ""
        return f"{self.what}: {', '.join(self.where[:MAX_NAMED_PLACES])}{more}"


@short_repr
@dataclass
class Losses:
    """All that one file does not hold, by effect, and then in the order in which it was noted.

    Losses of one kind are one sentence with all its places.

    Attributes:
        format: what sentences call the format.
    """

    format: str
    _places: dict[str, list[str]] = field(default_factory=dict[str, list[str]])
    _effects: dict[str, Effect] = field(default_factory=dict[str, Effect])

    @classmethod
    def collect(cls, name: str, each: Iterable[Loss | None]) -> "Losses":
        """Return the losses of a format among `each`, in which None stands for no loss."""
        losses = cls(name)
        for loss in each:
            losses.add_loss(loss)
        return losses

    def add(self, what: str, *where: str, effect: Effect = Effect.MOTION) -> None:
        """Note a loss, at places or of the whole."""
        self._effects[what] = min(effect, self._effects.get(what, effect))
        places = self._places.setdefault(what, [])
        places += [place for place in dict.fromkeys(where) if place not in places]

    def add_description(self, what: str, *where: str) -> None:
        """Note a loss of what does not move, as `add`."""
        self.add(what, *where, effect=Effect.DESCRIPTION)

    def add_loss(self, loss: Loss | None) -> None:
        """Note a loss that has its sentence already; None stands for no loss."""
        if loss is not None:
            self.add(loss.what, *loss.where, effect=loss.effect)

    def __str__(self) -> str:
        """A loss a line."""
        return "\n".join(map(str, self.entries))

    @property
    def entries(self) -> tuple[Loss, ...]:
        """The losses, the gravest first; empty where the file holds everything."""
        places, effects = self._places, self._effects
        ordered = sorted(places, key=lambda what: effects[what])
        return tuple(Loss(one, tuple(places[one]), effect=effects[one]) for one in ordered)

    def to_json(self) -> list[dict[str, object]]:
        """Return the losses for `--json`."""
        return [{"what": loss.what, "where": list(loss.where)} for loss in self.entries]
