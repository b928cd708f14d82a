"""Dimensions of the body as regressions on stature and mass: the survey ANSUR II of 2012.

Within two standard deviations of the sample's stature and mass a dimension is the value of its
regression. Beyond, the regression is evaluated at the nearest stature and mass of that range, and
its value scaled: lengths with stature, girths with the root of mass over stature (so that volumes
grow as the mass), breadths of the skeleton with the smaller of the two factors.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, StrEnum
from functools import cache
from math import sqrt
from typing import Any, assert_never

from generator.diagnostics import NamedMapping
from generator.person.sources import load_data_file
from springs.published.reference import Reference

MAX_DEVIATIONS = 2.0
"""Standard deviations from the sample's mean up to which the regressions are used."""

_MM = 1e-3


class Sex(StrEnum):
    """Sex of the sample from which the numbers of a person come."""

    MALE = "male"
    FEMALE = "female"


class Scaling(Enum):
    """Rule by which a dimension is scaled beyond the range of the sample."""

    LENGTH = "length"
    """With stature."""

    GIRTH = "girth"
    """With the square root of mass over stature."""

    FRAME = "frame"
    """With the smaller factor of the two: a skeleton does not grow with fat."""


@dataclass(frozen=True)
class Spread:
    """Mean and spread of a quantity in a sample, all in its unit."""

    mean: float
    deviation: float
    smallest: float
    largest: float

    @property
    def limits(self) -> tuple[float, float]:
        """Range in which the regressions are used."""
        half = MAX_DEVIATIONS * self.deviation
        return self.mean - half, self.mean + half

    def clamp(self, value: float) -> float:
        """The nearest value within the limits."""
        lower, upper = self.limits
        return min(max(value, lower), upper)


@dataclass(frozen=True)
class SurveySample:
    """The people of one sex.

    Attributes:
        subjects: their number.
        stature: [m].
        mass: [kg].
    """

    subjects: int
    stature: Spread
    mass: Spread


@dataclass(frozen=True)
class DimensionFit:
    """A dimension of one sex: constant + per_stature * stature + per_mass * mass.

    Attributes:
        mean: mean of the sample [m].
        deviation: standard deviation of the sample [m].
        constant: [m].
        per_stature: a number.
        per_mass: [m/kg].
        standard_error: standard error of the regression [m].
    """

    mean: float
    deviation: float
    constant: float
    per_stature: float
    per_mass: float
    standard_error: float

    def evaluate(self, stature: float, mass: float) -> float:
        """Value of the regression [m] at a stature [m] and a mass [kg]."""
        return self.constant + self.per_stature * stature + self.per_mass * mass

    def __str__(self) -> str:
        """The regression as a formula in mm, m and kg."""
        return (
            f"{self.constant / _MM:.1f} mm {self.per_stature / _MM:+.1f} mm/m stature "
            f"{self.per_mass / _MM:+.3f} mm/kg mass; standard error "
            f"{self.standard_error / _MM:.1f} mm"
        )


@dataclass(frozen=True)
class SurveyDimension:
    """A dimension of the survey.

    Attributes:
        name: name in words joined by "_".
        meaning: its end points, in words after the noun of its name.
        scaling: beyond the range of the sample.
        level: level of the body, whose dimensions follow each other; "" for one that stands alone.
        fits: fits of both sexes.
    """

    name: str
    meaning: str
    scaling: Scaling
    level: str
    fits: Mapping[Sex, DimensionFit]


@dataclass(frozen=True)
class Survey:
    """The survey.

    Attributes:
        reference: its report.
        samples: samples of both sexes.
        dimensions: dimensions from which a person is built, by name.
        validation: dimensions that a person is only compared with, by name.
    """

    reference: Reference
    samples: Mapping[Sex, SurveySample]
    dimensions: Mapping[str, SurveyDimension]
    validation: Mapping[str, SurveyDimension]

    def length_factor(self, sex: Sex, stature: float) -> float:
        """Factor of lengths beyond the range of the sample; 1 within it."""
        return stature / self.samples[sex].stature.clamp(stature)

    def expected(self, name: str, sex: Sex, stature: float, mass: float) -> tuple[float, float]:
        """Value and standard error [m] of a dimension of a person.

        Args:
            name: name of a dimension, also of one for validation.
            sex: sex of the sample.
            stature: [m].
            mass: [kg].

        Raises:
            UnknownNameError: for another name.
        """
        row = self.validation[name] if name in self.validation else self.dimensions[name]
        sample = self.samples[sex]
        near_stature, near_mass = sample.stature.clamp(stature), sample.mass.clamp(mass)
        length_factor = self.length_factor(sex, stature)
        girth_factor = sqrt(mass / near_mass / length_factor)
        match row.scaling:
            case Scaling.LENGTH:
                factor = length_factor
            case Scaling.GIRTH:
                factor = girth_factor
            case Scaling.FRAME:
                factor = min(length_factor, girth_factor)
            case _ as never:
                assert_never(never)
        fit = row.fits[sex]
        return factor * fit.evaluate(near_stature, near_mass), factor * fit.standard_error


@cache
def survey() -> Survey:
    """The survey that comes with the program."""
    data = load_data_file("ansur_2012")
    samples = {sex: _parse_sample(data.content["sample"][sex]) for sex in Sex}
    rows, validation = (
        {row["name"]: _parse_dimension(row) for row in data.content[kind]}
        for kind in ("dimension", "validation")
    )
    dimensions = NamedMapping(rows, "the survey has no dimension")
    return Survey(data.reference, samples, dimensions, validation)


def _parse_sample(row: Mapping[str, Any]) -> SurveySample:
    stature = Spread(**{key: _MM * value for key, value in row["stature_mm"].items()})
    return SurveySample(row["subjects"], stature, Spread(**row["mass_kg"]))


def _parse_dimension(row: Mapping[str, Any]) -> SurveyDimension:
    fits = {
        sex: DimensionFit(
            mean=_MM * row[sex]["mean_mm"],
            deviation=_MM * row[sex]["deviation_mm"],
            constant=_MM * row[sex]["constant_mm"],
            per_stature=row[sex]["per_stature"],
            per_mass=_MM * row[sex]["per_mass_mm_kg"],
            standard_error=_MM * row[sex]["error_mm"],
        )
        for sex in Sex
    }
    scaling, level = Scaling(row["kind"]), row.get("level", "")
    return SurveyDimension(row["name"], row["meaning"], scaling, level, fits)
