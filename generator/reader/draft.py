"""A figure in the making: what could be read, before it is known to be whole."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from generator.figure import Attribute, Figure, Joint, Segment, SiteRef
from generator.source import Span


@dataclass
class Draft:
    """The parts of a figure. `place` is its keyword or name; `root` is None while unknown.

    `joints` holds those with a readable `connect`; `segments` holds all that are named.
    """

    place: Span
    name: str | None = None
    segments: dict[str, Segment] = field(default_factory=dict[str, Segment])
    joints: dict[str, Joint] = field(default_factory=dict[str, Joint])
    attributes: dict[str, Attribute] = field(default_factory=dict[str, Attribute])
    root: SiteRef | None = None
    origins: dict[str, Span] = field(default_factory=dict[str, Span])

    def figure(self, root: SiteRef) -> Figure:
        """The figure that stands on `root`."""
        return Figure(
            segments=self.segments,
            joints=self.joints,
            root=root,
            attributes=self.attributes,
            name=self.name,
            origins=self.origins,
        )


def place_of(origins: Mapping[str, Span], *names: str) -> Span | None:
    """Where the first of `names` is written that is written anywhere; else the thing itself."""
    return next((origins[name] for name in (*names, "name") if name in origins), None)
