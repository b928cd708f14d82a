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
    """

    name: str
    law: PartLaw
    spheres: tuple[tuple[str, int], ...]
    band: tuple[float, float] = (1.0, 1.0)
    evidence: Evidence = Evidence.ESTIMATE


@short_repr
@dataclass(frozen=True)
class BodyContact:
    """The parts of a body, by which it touches props.

    Attributes:
        parts: Parts without common spheres.
        origin: File from which they are.

    Raises:
        ModelError: Two parts have a name or a sphere in common.
    """

    parts: tuple[BodyPart, ...]
    origin: str = ""

    def __post_init__(self) -> None:
        """Check that no sphere or name occurs twice."""
        owners: dict[tuple[str, int], str] = {}
        for part in self.parts:
            if sum(other.name == part.name for other in self.parts) > 1:
                raise ModelError(f"two parts of the body are called `{part.name}`")
            for sphere in part.spheres:
                if sphere in owners:
                    segment, number = sphere
                    raise ModelError(
                        f"sphere {number} of segment `{segment}` belongs to the parts "
                        f"`{owners[sphere]}` and `{part.name}`"
                    )
                owners[sphere] = part.name

    @property
    def laws(self) -> dict[str, PartLaw]:
        """Law of each part by its name."""
        return {part.name: part.law for part in self.parts}

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
                made[segment][number] = replace(made[segment][number], part=part.name)
        return {name: tuple(some) for name, some in made.items()}
