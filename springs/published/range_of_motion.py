"""The normal range of motion of a joint about one of its axes, as published."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from springs.published.reference import Reference, Sample, SampleKind
from springs.published.tables import publication, split_motion

PREFERRED_PUBLICATIONS = (
    *("soucie_2011", "boone_azen_1979", "kouyoumdjian_2012", "sforza_2002", "spine_shares"),
    *("alazzawi_2017", "family_practice_notebook", "aaos"),
)
"""Publications with ranges of adults by preference: the first moved the joints passively and
gives the ages."""

PUBLICATIONS_OF_WOMEN = ("macedo_magee_2009", "tommasi_2009")
"""Publications that measured women only, by preference."""

_OPPOSITES: Mapping[str, tuple[str, ...]] = {
    "flexion": ("extension", "hyperextension"),
    "extension": ("flexion",),
    "abduction": ("adduction",),
    "adduction": ("abduction",),
    "medial rotation": ("lateral rotation",),
    "lateral rotation": ("medial rotation",),
    "pronation": ("supination",),
    "supination": ("pronation",),
    "dorsiflexion": ("plantarflexion",),
    "plantarflexion": ("dorsiflexion",),
    "inversion": ("eversion",),
    "eversion": ("inversion",),
    "radial deviation": ("ulnar deviation",),
    "ulnar deviation": ("radial deviation",),
    "lateral bend": ("lateral bend",),
    "twist": ("twist",),
}
"""Names of the opposite motions; the spine's two sides are published as one."""

_OTHER_NAMES: Mapping[str, tuple[str, ...]] = {"extension": ("extension", "hyperextension")}
"""Names under which the end of a motion is published, where these are several."""


_SIDES = (" to the left", " to the right")


def opposite_motions(motion: str) -> tuple[str, ...]:
    """Return the names of the motion opposite to one ("flexion", "lumbar twist to the left").

    It is () for a motion whose opposite has no name.
    """
    for side, other in (_SIDES, _SIDES[::-1]):
        if motion.endswith(side):
            return (motion.removesuffix(side) + other,)
    for kind, opposites in _OPPOSITES.items():
        before = motion.removesuffix(kind)
        if before != motion and (not before or before.endswith(" ")):
            return tuple(before + one for one in opposites if one != kind)
    return ()


@dataclass(frozen=True)
class RangeEnd:
    """One end of a normal range of motion.

    Attributes:
        motion: the direction in which it lies ("elbow hyperextension").
        angle: angle in the sense of the motion asked for, so negative at the lower end [rad].
        source: name of the publication among `springs/published/data`.
        reference: where it is from.
        sample: what was measured.
    """

    motion: str
    angle: float
    source: str
    reference: Reference
    sample: Sample = field(default_factory=Sample)

    @property
    def is_estimate(self) -> bool:
        """True for a number that follows from published ones by a rule that was not measured."""
        return self.sample.kind is SampleKind.ESTIMATE


def normal_range(
    joint: str, motion: str, publications: Sequence[str] = PREFERRED_PUBLICATIONS
) -> tuple[RangeEnd | None, RangeEnd | None]:
    """Lower and upper end of a joint's normal range; None where no verified number is known.

    Args:
        joint: name of the joint in its figure; one of its words says which it is ("left_elbow").
        motion: name of a positive angle ("flexion", "twist to the left"). A part of the body before
            it ("lumbar flexion", "forearm pronation") takes precedence over the joint's words.
        publications: those in which it is looked for, the preferred first.
    """
    parts, kind = split_motion(joint, motion)
    if kind not in _OPPOSITES:
        return None, None
    lower = _first_published_end(parts, _OPPOSITES[kind], -1.0, publications)
    upper = _first_published_end(parts, _OTHER_NAMES.get(kind, (kind,)), 1.0, publications)
    return lower, upper


def _first_published_end(
    parts: Sequence[Sequence[str]], kinds: tuple[str, ...], sign: float, publications: Sequence[str]
) -> RangeEnd | None:
    for words in parts:
        wanted = {f"{word} {kind}" for word in words for kind in kinds}
        for name in publications:
            for row in publication(name).ranges:
                if row.motion in wanted:
                    return RangeEnd(row.motion, sign * row.limit, name, row.reference, row.sample)
    return None
