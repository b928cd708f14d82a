"""What a format could not hold: the report that every writer returns.

A report in the making: losses of one kind are one sentence with all its places.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field

MAX_NAMED_PLACES = 8
"""So many places are named in a sentence; the data names all."""


@dataclass(frozen=True)
class Loss:
    """One thing that is not in the file, or not as it was.

    Attributes:
        what: the sentence that says it, without a full stop.
        where: the joints, segments or other names that it is about; empty for the whole.
    """

    what: str
    where: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse a loss that says nothing."""
        if not self.what.strip():
            raise ValueError("a loss says what was lost")

    def __str__(self) -> str:
        """The sentence with its places."""
        if not self.where:
            return self.what
        left = len(self.where) - MAX_NAMED_PLACES
        more = f" and {left} more" if left > 0 else ""
        return f"{self.what}: {', '.join(self.where[:MAX_NAMED_PLACES])}{more}"


@dataclass(frozen=True)
class Losses:
    """All that one file does not hold.

    Attributes:
        format: what sentences call the format.
        entries: one after the other; empty where the file holds everything.
    """

    format: str
    entries: tuple[Loss, ...] = ()

    @classmethod
    def collect(cls, name: str, each: Iterable[Loss | None]) -> "Losses":
        """The losses of a format among `each`, in which None stands for no loss."""
        return cls(name, tuple(loss for loss in each if loss is not None))

    def to_json(self) -> list[dict[str, object]]:
        """The losses for `--json`."""
        return [{"what": loss.what, "where": list(loss.where)} for loss in self.entries]


@dataclass
class LossReport:
    """What a writer could not write, in the order in which it found it.

    Attributes:
        format: what sentences call the format.
    """

    format: str
    _places: dict[str, list[str]] = field(default_factory=dict[str, list[str]])

    def add(self, what: str, *where: str) -> None:
        """Note a loss, at places or of the whole."""
        places = self._places.setdefault(what, [])
        places += [place for place in where if place not in places]

    def add_loss(self, loss: Loss | None) -> None:
        """Note a loss that is put in words already; None is none."""
        if loss is not None:
            self.add(loss.what, *loss.where)

    @property
    def losses(self) -> Losses:
        """All that was noted."""
        each = (Loss(what, tuple(where)) for what, where in self._places.items())
        return Losses(self.format, tuple(each))
