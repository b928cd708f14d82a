"""A report in the making: losses of one kind are one sentence with all its places."""

from dataclasses import dataclass, field

from generator.exchange.losses import Loss, Losses


@dataclass
class Report:
    """What a writer could not write, in the order in which it found it.

    Attributes:
        format: what sentences call the format.
    """

    format: str
    _places: dict[str, list[str]] = field(default_factory=dict[str, list[str]])

    def lose(self, what: str, *where: str) -> None:
        """Note a loss, at places or of the whole."""
        places = self._places.setdefault(what, [])
        places += [place for place in where if place not in places]

    def add(self, loss: Loss | None) -> None:
        """Note a loss that is put in words already; None is none."""
        if loss is not None:
            self.lose(loss.what, *loss.where)

    @property
    def losses(self) -> Losses:
        """All that was noted."""
        each = (Loss(what, tuple(where)) for what, where in self._places.items())
        return Losses(self.format, tuple(each))
