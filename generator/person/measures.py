"""Measures of a person: sex, stature, mass, and the dimensions that follow or were measured."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from generator.named_mapping import NamedMapping


class Sex(StrEnum):
    """Sex of the sample from which the numbers of a person come."""

    MALE = "male"
    FEMALE = "female"


@dataclass(frozen=True)
class BodyDimension:
    """A dimension of the body.

    Attributes:
        name: of ANSUR II, in words joined by "_" ("chest_breadth", "lateral_malleolus_height").
        value: [m].
        expected: value of the regression on stature and mass [m].
        standard_error: of the regression [m].
        is_measured: whether the user stated the value.
    """

    name: str
    value: float
    expected: float
    standard_error: float
    is_measured: bool = False

    @property
    def ratio(self) -> float:
        """Value over the expected one; 1 unless it was measured."""
        return self.value / self.expected if self.is_measured else 1.0


@dataclass(frozen=True)
class Measures:
    """Measures of a person.

    Attributes:
        sex: of the samples that are used.
        stature: [m].
        mass: [kg].
        dimensions: by their names; every dimension of ANSUR II that is used.
        warnings: sentences on what lies outside the samples.
    """

    sex: Sex
    stature: float
    mass: float
    dimensions: Mapping[str, BodyDimension]
    warnings: tuple[str, ...] = field(default=(), compare=False)

    def __post_init__(self) -> None:
        """Make unknown names state the nearest one."""
        dimensions = NamedMapping(self.dimensions, "a person has no dimension")
        object.__setattr__(self, "dimensions", dimensions)

    def length(self, name: str) -> float:
        """Value of a dimension [m]. Raises UnknownNameError."""
        return self.dimensions[name].value

    def ratio(self, name: str) -> float:
        """Measured over expected value of a dimension; 1 unless it was measured."""
        return self.dimensions[name].ratio
