"""The normal range of motion of a joint about one of its axes, as published."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from springs.published.reference import Reference, Sample
from springs.published.tables import publication

PREFERRED_PUBLICATIONS = ("soucie_2011", "boone_azen_1979", "kouyoumdjian_2012", "aaos")
"""Publications with ranges of adults by preference: the first moved the joints passively and
gives the ages."""

_OPPOSITES: Mapping[str, tuple[str, ...]] = {
    "flexion": ("extension", "hyperextension"),
    "abduction": ("adduction",),
    "medial rotation": ("lateral rotation",),
    "pronation": ("supination",),
    "lateral bend": ("lateral bend",),
    "twist": ("twist",),
}
"""Names of the opposite motions; the trunk's two sides are published as one."""


@dataclass(frozen=True)
class RangeEnd:
    """One end of a normal range of motion.

    Attributes:
        motion: the direction in which it lies ("elbow hyperextension").
        angle: in the sense of the motion asked for, so negative at the lower end [rad].
        source: name of the publication among `springs/published/data`.
        reference: where it is from.
        sample: what was measured.
    """

    motion: str
    angle: float
    source: str
    reference: Reference
    sample: Sample = field(default_factory=Sample)


def normal_range(joint: str, motion: str) -> tuple[RangeEnd | None, RangeEnd | None]:
    """Lower and upper end of a joint's normal range; None where no verified number is known.

    Args:
        joint: name of the joint in its figure; one of its words says which it is ("left_elbow").
        motion: name of a positive angle ("flexion", "twist to the left").
    """
    kind = motion.partition(" to the ")[0]
    if kind not in _OPPOSITES:
        return None, None
    words = joint.lower().split("_")
    upper = _first_published_end(words, (kind,), 1.0)
    return _first_published_end(words, _OPPOSITES[kind], -1.0), upper


def _first_published_end(words: list[str], kinds: tuple[str, ...], sign: float) -> RangeEnd | None:
    wanted = {f"{word} {kind}" for word in words for kind in kinds}
    for name in PREFERRED_PUBLICATIONS:
        for row in publication(name).ranges:
            if row.motion in wanted:
                return RangeEnd(row.motion, sign * row.limit, name, row.reference, row.sample)
    return None
