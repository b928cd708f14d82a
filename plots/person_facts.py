"""Measurements of people against which a person is tested (`plots/data/person_facts.toml`)."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from generator.person.measures import Sex
from plots.plate import Claim, comparison
from springs.published.reference import Reference, Sample, SampleKind, Sureness

_INCH, _POUND, _POUND_INCH_SECOND_SQUARED = 0.0254, 0.45359237, 0.112984829
"""In m, kg and kg m2."""

_KG_CM2 = 1e-4


@dataclass(frozen=True)
class FactSource:
    """Publication of measurements, and the people who were measured."""

    reference: Reference
    sample: Sample


@dataclass(frozen=True)
class Fact:
    """A measured number with the band within which a person agrees with it.

    Attributes:
        key: name in the file.
        quantity: quantity in words.
        value: mean, in `unit`.
        spread: standard deviation between people; None if unknown.
        unit: unit of the value, or "".
        low: lower end of the band.
        high: upper end of the band.
        band: reason for its width.
        source: source of the value.
    """

    key: str
    quantity: str
    value: float
    spread: float | None
    unit: str
    low: float
    high: float
    band: str
    source: FactSource

    def __post_init__(self) -> None:
        """Raise ValueError for a value outside its own band."""
        if not self.low <= self.value <= self.high:
            raise ValueError(f"{self.key}: {self.value} is not within {self.low} to {self.high}")

    @property
    def value_text(self) -> str:
        """The value with its spread and unit: `3.87 ± 0.62 rad/s`."""
        spread = "" if self.spread is None else f" ± {self.spread:.3g}"
        return f"{self.value:.4g}{spread} {self.unit}".rstrip()

    def compare(self, sentence: str, measured: float, remark: str = "") -> Claim:
        """Return the comparison of a number of a person with the fact.

        The remark explains a number outside the band, and is left out for one within.
        """
        return comparison(sentence, measured, self.unit, self.low, self.high, remark)


@dataclass(frozen=True)
class SegmentMeans:
    """Mean masses and moments of inertia of the segments of a sample.

    Attributes:
        stature: stature of the mean body [m].
        mass: mass of the mean body [kg].
        segments: mass [kg] and moments of inertia about the antero-posterior, medio-lateral and
            longitudinal axis [kg m2], by name without side.
    """

    stature: float
    mass: float
    segments: Mapping[str, tuple[float, float, float, float]]


@dataclass(frozen=True)
class Posture:
    """A man in a posture, axes through his centre of mass.

    Attributes:
        centre_depth: distance of the centre of mass from the top of the head [m].
        moments: moments of inertia about the antero-posterior, lateral and long axis [kg m2].
    """

    centre_depth: float
    moments: tuple[float, float, float]


@dataclass(frozen=True)
class MeasuredMan:
    """A man of a stature [m] and a mass [kg] in several postures."""

    stature: float
    mass: float
    postures: Mapping[str, Posture]


@dataclass(frozen=True)
class PersonFacts:
    """All facts of the file."""

    sources: Mapping[str, FactSource]
    facts: Mapping[str, Fact]
    segments: Mapping[Sex, SegmentMeans]
    men: tuple[MeasuredMan, ...]

    def references(self, *names: str) -> tuple[str, ...]:
        """Return the references of sources, in full."""
        return tuple(str(self.sources[name].reference) for name in names)


@cache
def person_facts() -> PersonFacts:
    """Read the shipped facts."""
    text = files("plots").joinpath("data/person_facts.toml").read_text(encoding="utf-8")
    return parse_person_facts(tomllib.loads(text))


def parse_person_facts(data: Mapping[str, Any]) -> PersonFacts:
    """Read the facts of a parsed file. Raises KeyError, TypeError and ValueError."""
    sources = {name: _source(row) for name, row in data["source"].items()}
    facts: list[Fact] = []
    for row in data["fact"]:
        values: dict[str, Any] = {"spread": None, **row, "source": sources[row["source"]]}
        facts.append(Fact(**values))
    if len({fact.key for fact in facts}) != len(facts):
        raise ValueError("two facts have the same key")
    return PersonFacts(
        sources=sources,
        facts={fact.key: fact for fact in facts},
        segments={Sex(sex): _segment_means(row) for sex, row in data["segments"].items()},
        men=tuple(_man(row) for row in data["man"]),
    )


def _source(row: Mapping[str, Any]) -> FactSource:
    reference = Reference(
        row["reference"], Sureness(row["sureness"]), row.get("doi", ""), row["place"]
    )
    return FactSource(reference, Sample(SampleKind(row["sample"]), row["subjects"]))


def _segment_means(row: Mapping[str, Any]) -> SegmentMeans:
    numbers = dict(row)
    stature, mass = numbers.pop("stature_m"), numbers.pop("mass_kg")
    segments = {
        name: (kilograms, *(_KG_CM2 * moment for moment in moments))
        for name, (kilograms, *moments) in numbers.items()
    }
    return SegmentMeans(stature, mass, segments)


def _man(row: Mapping[str, Any]) -> MeasuredMan:
    numbers = dict(row)
    stature, mass = numbers.pop("stature_in") * _INCH, numbers.pop("weight_lb") * _POUND
    postures = {
        name: Posture(
            depth * _INCH, (*(_POUND_INCH_SECOND_SQUARED * moment for moment in moments),)
        )
        for name, (depth, *moments) in numbers.items()
    }
    return MeasuredMan(stature, mass, postures)
