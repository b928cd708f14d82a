"""Parts of a body that touch props as wholes: a law, and the contact spheres of each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum

from generator.diagnostics import ModelError
from generator.figure import ContactSphere
from springs.contact_part import PartLaw
from springs.short_repr import short_repr


class Evidence(Enum):
    """Evidence for the numbers of a part."""

    PUBLISHED = "published"
    SCALED = "scaled"
    ESTIMATE = "estimate"


@short_repr
@dataclass(frozen=True)
class BodyPart:
    """A part of the body; it may span segments.

    Attributes:
        name: Name of the part.
        law: Its stiffness and damping.
        spheres: Its contact spheres: segment, and number of the sphere there from 0 on.
        band: Lowest and highest likely stiffness over that of the law.
        evidence: Evidence for the numbers.
        within: Name of the part of which this is a firmer region; empty for a part of its own.
    """

    name: str
    law: PartLaw
    spheres: tuple[tuple[str, int], ...]
    band: tuple[float, float] = (1.0, 1.0)
    evidence: Evidence = Evidence.ESTIMATE
    within: str = ""


@short_repr
@dataclass(frozen=True)
class BodyContact:
    """The parts of a body, by which it touches props.

    Attributes:
        parts: Parts without common spheres, and firmer regions of these, whose spheres are some of
            those of their part.
        origin: File from which they are.

    Raises:
        ModelError: Two parts have a name or a sphere in common, or a region does not fit its part.
    """

    parts: tuple[BodyPart, ...]
    origin: str = ""

    def __post_init__(self) -> None:
        """Check that no name occurs twice, that no sphere has two parts, and the regions."""
        for part in self.parts:
            if sum(other.name == part.name for other in self.parts) > 1:
                raise ModelError(f"two parts of the body are called `{part.name}`")
        for of_regions in (False, True):
            owners: dict[tuple[str, int], str] = {}
            for part in self.parts:
                for sphere in part.spheres if bool(part.within) == of_regions else ():
                    if sphere in owners:
                        segment, number = sphere
                        raise ModelError(
                            f"sphere {number} of segment `{segment}` belongs to the parts "
                            f"`{owners[sphere]}` and `{part.name}`"
                        )
                    owners[sphere] = part.name
        for region in self.parts:
            if region.within:
                self._check_region(region)

    def _check_region(self, region: BodyPart) -> None:
        outer = {part.name: part for part in self.parts if not part.within}.get(region.within)
        if outer is None:
            raise ModelError(
                f"part `{region.name}` is within `{region.within}`, but no other part has this name"
            )
        for segment, number in region.spheres:
            if (segment, number) not in outer.spheres:
                raise ModelError(
                    f"part `{region.name}` has sphere {number} of segment `{segment}`, which "
                    f"`{outer.name}`, that it is within, does not have"
                )
        if region.law.is_softer_than(outer.law):
            raise ModelError(
                f"part `{region.name}` is softer than `{outer.name}`, that it is within"
            )

    @property
    def laws(self) -> dict[str, PartLaw]:
        """Law of each part by its name; that of a region is what it adds to its part."""
        own = {part.name: part.law for part in self.parts}
        return {part.name: replace(part.law, within=own.get(part.within)) for part in self.parts}

    @property
    def regions(self) -> dict[str, str]:
        """Part that each region is within, by the name of the region."""
        return {part.name: part.within for part in self.parts if part.within}

    def assign(
        self, spheres: Mapping[str, Sequence[ContactSphere]]
    ) -> dict[str, tuple[ContactSphere, ...]]:
        """Return the spheres of the segments with the names of their parts.

        Raises:
            ModelError: A part has a sphere that a segment does not have.
        """
        made = {name: list(some) for name, some in spheres.items()}
        for part in self.parts:
            for segment, number in part.spheres:
                count = len(made.get(segment, ()))
                if not 0 <= number < count:
                    raise ModelError(
                        f"part `{part.name}` has sphere {number} of segment `{segment}`, which has "
                        f"{count} of them, numbered from 0"
                    )
                change = {"region": part.name} if part.within else {"part": part.name}
                made[segment][number] = replace(made[segment][number], **change)
        return {name: tuple(some) for name, some in made.items()}
