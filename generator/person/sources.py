"""Numbers of a person with their sources, one row of the provenance report each."""

from dataclasses import dataclass
from enum import Enum

from springs.published.reference import Reference


class Origin(Enum):
    """Way in which a number got into a person."""

    STATED = "stated"
    """By the user: stature, mass, or a measured dimension."""

    PUBLISHED = "published"
    """Taken or computed from published numbers by a published rule."""

    SCALED = "scaled"
    """A published number of another body, scaled by a rule that was not measured for it."""

    ESTIMATE = "estimate"
    """No published number was found."""


@dataclass(frozen=True)
class SourcedNumber:
    """One number of a person.

    Attributes:
        part: segment, joint or "person".
        quantity: in words ("mass", "length", "viscous damping of flexion").
        value: in `unit`.
        unit: of the value ("kg", "m", "kg m2", "N m s/rad"), or "" without one.
        origin: way in which it got there.
        reference: its publication; None for a number of the user or an estimate.
        rule: how the value follows from the reference, or why the estimate is as it is.
    """

    part: str
    quantity: str
    value: float
    unit: str
    origin: Origin
    reference: Reference | None = None
    rule: str = ""
