"""Strengths of a person by joint and motion, from `strengths.toml` and `anderson_2007.toml`."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum, StrEnum
from functools import cache
from importlib.resources import files
from math import erf, inf, nan, radians, sqrt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from springs.backends import Array
from springs.published.reference import Reference, Sample, SampleKind, Sureness
from springs.published.tables import split_motion
from springs.strength.laws import CosineLaw, GaussianLaw, PointLaw, StrengthLaw

GRAVITY = 9.81
"""Acceleration in the unit of strength, mass times gravity times stature [m/s2]."""

Pair = tuple[float, float]


class StrengthClass(Enum):
    """Origin of a number."""

    PUBLISHED = "published"
    """As printed."""
    SCALED = "scaled"
    """From a published number by a rule."""
    ESTIMATE = "estimate"
    """Not from a study."""


class Age(StrEnum):
    """Ages of a sample [years]."""

    YOUNG = "18-25"
    MIDDLE = "55-65"
    OLD = "over-65"

    @classmethod
    def of_years(cls, years: float) -> "Age":
        """Return the sample nearest to an age: up to 40 years, up to 65, or above.

        Nobody between 25 and 55 was measured. Raises ValueError for ages that are not adult.
        """
        if not 18.0 <= years <= 110.0:
            raise ValueError("ages are from 18 to 110 years")
        return cls.YOUNG if years <= 40.0 else cls.MIDDLE if years <= 65.0 else cls.OLD


@dataclass(frozen=True)
class Body:
    """A person's measures on which strength depends.

    Attributes:
        mass: Mass [kg].
        stature: Stature [m].
        is_female: Whether it is a woman's.
        age: Ages of the sample.
    """

    mass: float
    stature: float
    is_female: bool = False
    age: Age = Age.YOUNG

    @property
    def sex(self) -> str:
        """Sex, as in the tables."""
        return "female" if self.is_female else "male"


@dataclass(frozen=True)
class Strength:
    """Largest voluntary torques about an axis.

    Attributes:
        largest: In the sense of the motion and against it, at the best angle [N m].
        origin: Class of the number in the sense of the motion.
        reference: Publication of the numbers; "" for an estimate.
        laws: Laws of the angle in both directions; the numbers at all angles by default.
        spreads: Standard deviations between people over the means; nan where unknown.
        opposite_origin: Class of the number against the motion; that of the other by default.
    """

    largest: Pair
    origin: StrengthClass
    reference: str = ""
    laws: tuple[StrengthLaw, StrengthLaw] | None = None
    spreads: Pair = (nan, nan)
    opposite_origin: StrengthClass | None = None

    @property
    def origins(self) -> tuple[StrengthClass, StrengthClass]:
        """Classes in the sense of the motion and against it."""
        return self.origin, self.opposite_origin or self.origin

    def law(self, is_opposite: bool) -> StrengthLaw:
        """Return the law in the sense of the motion or against it."""
        return self.laws[is_opposite] if self.laws else PointLaw(self.largest[is_opposite])

    def capacity(self, angle: ArrayLike, is_opposite: bool, rate: ArrayLike = 0.0) -> Array:
        """Return the largest torque [N m] in the sense of the motion, or against it.

        Args:
            angle: Angle in the sense of the motion [rad], shape (...).
            is_opposite: Whether the torque is against the motion.
            rate: Rate in the direction of the torque [rad/s].
        """
        return self.law(is_opposite).torque(angle, rate)

    def reversed(self) -> "Strength":
        """Return the same strength of the opposite motion, with angles in its sense."""
        laws = self.laws and (_Mirrored(self.laws[1]), _Mirrored(self.laws[0]))
        first, second = self.origins
        return replace(
            self,
            largest=self.largest[::-1],
            laws=laws,
            spreads=self.spreads[::-1],
            origin=second,
            opposite_origin=None if first is second else first,
        )

    def scaled(self, factor: float, origin: StrengthClass) -> "Strength":
        """Return the strength times a factor, of another class."""
        plus, minus = self.largest
        laws = self.laws and (_scaled_law(self.laws[0], factor), _scaled_law(self.laws[1], factor))
        return replace(
            self,
            largest=(plus * factor, minus * factor),
            laws=laws,
            origin=origin,
            opposite_origin=None,
        )


@dataclass(frozen=True)
class _Mirrored:
    """A law read with the angle of the opposite motion."""

    own: StrengthLaw

    @property
    def largest(self) -> float:
        return self.own.largest

    @property
    def angles(self) -> tuple[float, float]:
        low, high = self.own.angles
        return -high, -low

    def torque(self, angle: ArrayLike, rate: ArrayLike = 0.0) -> Array:
        return self.own.torque(-np.asarray(angle, dtype=float), rate)


def _scaled_law(law: StrengthLaw, factor: float) -> StrengthLaw:
    match law:
        case CosineLaw():
            return replace(law, size=law.size * factor)
        case PointLaw() | GaussianLaw():
            return replace(law, largest=law.largest * factor)
        case _Mirrored():
            return _Mirrored(_scaled_law(law.own, factor))
        case _:
            raise TypeError(f"no rule scales {law}")


@dataclass(frozen=True)
class AndersonRow:
    """A row of table 3 of Anderson, Madigan & Nussbaum 2007.

    Attributes:
        motion: Direction of the torque ("knee extension").
        sex: `male` or `female`.
        age: Ages of the sample.
        coefficients: C1 to C6; C1 in units of mass times gravity times stature.
        deviations: Their standard deviations between people.
    """

    motion: str
    sex: str
    age: Age
    coefficients: tuple[float, float, float, float, float, float]
    deviations: tuple[float, float, float, float, float, float]

    @property
    def spread(self) -> float:
        """Standard deviation of C1 between people over its mean."""
        return self.deviations[0] / self.coefficients[0]


@dataclass(frozen=True)
class StrengthRow:
    """A row of the table.

    Attributes:
        motion: Part of the body and motion ("knee flexion").
        opposite: Opposite motion; that of a symmetric one is itself.
        torque: Torques of men in the sense of the motion and against it [N m]; None for shares.
        share: The same in units of mass times gravity times stature; None for torques.
        women_share: Those of women; None where the row is of men only.
        origins: Classes of the numbers.
        citation: Publication with the place and how it was checked; None for an estimate.
        sample: People who were measured.
        spreads: Standard deviations between people over the means.
        shapes: Best angles and standard deviations of Gaussians in both directions [rad]; () for
            none.
        has_curves: Whether the laws are those of `anderson_rows`.
        why: Reason of a rule.
    """

    motion: str
    opposite: str
    torque: Pair | None
    share: Pair | None
    women_share: Pair | None
    origins: tuple[StrengthClass, StrengthClass]
    citation: Reference | None
    sample: Sample
    spreads: Pair
    shapes: tuple[Pair, ...] = ()
    has_curves: bool = False
    why: str = ""

    @property
    def origin(self) -> StrengthClass:
        """Class of the number in the sense of the motion."""
        return self.origins[0]

    @property
    def reference(self) -> str:
        """Publication in a line; "" for an estimate."""
        return "" if self.citation is None else str(self.citation)

    def strength(self, body: Body | None) -> Strength | None:
        """Return the strength of a body; None for a share of an unknown one.

        Torques of an unknown body are those of young men.
        """
        if self.has_curves:
            return None if body is None else self._curves(body)
        is_female = body is not None and body.is_female
        has_women = self.women_share is not None
        if self.share is None:
            assert self.torque is not None
            largest = self.torque
        elif body is None:
            return None
        else:
            size = body.mass * GRAVITY * body.stature
            share = self.women_share if is_female and self.women_share is not None else self.share
            largest = (size * share[0], size * share[1])
        laws = None
        if self.shapes:
            plus, minus = (
                GaussianLaw(torque, *shape)
                for torque, shape in zip(largest, self.shapes, strict=True)
            )
            laws = plus, minus
        first, second = self.origins
        opposite = None if first is second else second
        own = Strength(largest, first, self.reference, laws, self.spreads, opposite)
        if is_female and not has_women:
            own = own.scaled(women_factor(), StrengthClass.ESTIMATE)
        if body is not None and body.age is not Age.YOUNG:
            own = own.scaled(float(_document()["age"][body.age]), StrengthClass.ESTIMATE)
        return own

    def _curves(self, body: Body) -> Strength:
        """Return the curves of a sex and age; those of over-65 scaled by the norms of the knee."""
        size = body.mass * GRAVITY * body.stature
        rows = [anderson_row(motion, body.sex, body.age) for motion in (self.motion, self.opposite)]
        laws = [CosineLaw(size, row.coefficients) for row in rows]
        spreads = [row.spread for row in rows]
        origin = StrengthClass.PUBLISHED
        if body.age is Age.OLD:
            # Six people: too few for a spread, and stronger than the norms.
            spreads = [anderson_row(row.motion, row.sex, Age.MIDDLE).spread for row in rows]
            norms = [norm(row.motion, body.sex, Age.OLD) for row in rows]
            if None in norms:
                origin, factor = StrengthClass.ESTIMATE, old_factor(body.sex)
                laws = [replace(law, size=size * factor) for law in laws]
            else:
                origin = StrengthClass.SCALED
                laws = [
                    replace(law, size=body.mass * (known or 0.0) / law.coefficients[0])
                    for law, known in zip(laws, norms, strict=True)
                ]
        (plus, minus), (first, second) = laws, spreads
        largest = plus.largest, minus.largest
        return Strength(largest, origin, self.reference, (plus, minus), (first, second))


@cache
def _document() -> Mapping[str, Any]:
    return _read("strengths.toml")


def _read(name: str) -> Mapping[str, Any]:
    path = files("springs").joinpath("strength", name)
    return tomllib.loads(path.read_text(encoding="utf-8"))


def reference_of(table: Mapping[str, Any]) -> Reference | None:
    """Return the reference of a table of this room; None without one."""
    if "reference" not in table:
        return None
    return Reference(
        table["reference"],
        Sureness(table["sureness"]),
        table.get("doi", ""),
        table.get("place", ""),
    )


def women_factor() -> float:
    """Return women's share of men's strength, an estimate, for rows of men only."""
    return float(_document()["women"]["factor"])


@cache
def anderson_rows() -> tuple[AndersonRow, ...]:
    """Return the 36 rows of Anderson, Madigan & Nussbaum 2007."""
    return tuple(
        AndersonRow(row["motion"], row["sex"], Age(row["age"]), tuple(row["C"]), tuple(row["sd"]))
        for row in _anderson()["rows"]
    )


@cache
def _anderson() -> Mapping[str, Any]:
    return _read("anderson_2007.toml")


@cache
def anderson_row(motion: str, sex: str, age: Age) -> AndersonRow:
    """Return the row of a motion, sex and age. Raises StopIteration for one that is not there."""
    return next(
        row for row in anderson_rows() if (row.motion, row.sex, row.age) == (motion, sex, age)
    )


@dataclass(frozen=True)
class Norm:
    """A norm of strength at mid-range.

    Attributes:
        motion: Direction of the torque.
        sex: `male` or `female`.
        age: `adult`, or ages of `Age`.
        interval: 95 % interval of the pooled mean [N m/kg].
    """

    motion: str
    sex: str
    age: str
    interval: Pair


@cache
def norms() -> tuple[Norm, ...]:
    """Return the norms of the knee (Sarabon, Kozinc & Perman 2021)."""
    return tuple(
        Norm(row["motion"], row["sex"], row["age"], (row["Nm_kg"][0], row["Nm_kg"][1]))
        for row in _document()["norms"]["rows"]
    )


def norm(motion: str, sex: str, age: str) -> float | None:
    """Return the middle of the interval of a norm [N m/kg]; None where there is none."""
    for row in norms():
        if (row.motion, row.sex, row.age) == (motion, sex, age):
            return 0.5 * sum(row.interval)
    return None


@dataclass(frozen=True)
class Check:
    """A measurement beside which a row is put, and which sets none.

    Attributes:
        motion: Direction of the torque, or name of a factor.
        sex: `male` or `female`.
        what: Kind of the number.
        unit: Unit; "1" for a ratio.
        interval: Ends of what was measured, equal for a single number.
        origin: Class of the comparison.
        reference: Source.
        sample: Bodies that were measured.
    """

    motion: str
    sex: str
    what: str
    unit: str
    interval: Pair
    origin: StrengthClass
    reference: Reference
    sample: Sample


@cache
def checks() -> tuple[Check, ...]:
    """Return measurements beside which strengths are put."""
    return tuple(map(_parse_check, _document()["check"]))


def _parse_check(row: Mapping[str, Any]) -> Check:
    source = _document()["sources"][row["source"]]
    reference, (low, high) = reference_of(source), row["interval"]
    assert reference is not None
    return Check(
        row["motion"],
        row["sex"],
        row["what"],
        row["unit"],
        (low, high),
        StrengthClass(row["class"]),
        reference,
        Sample(SampleKind(source["sample"]), source.get("subjects")),
    )


def old_share() -> float:
    """Return the share over 65 years of young strength, an estimate, for rows without curves."""
    return float(_document()["age"][Age.OLD])


_MEAN_STATURES = {"male": 1.75, "female": 1.63}
"""Statures by which norms per kilogram are compared with curves, estimates [m]."""


@cache
def old_factor(sex: str) -> float:
    """Return the norm of old knees over the curves of over-65, the mean of both directions."""
    ratios: list[float] = []
    for motion in ("knee extension", "knee flexion"):
        known = norm(motion, sex, Age.OLD)
        assert known is not None
        c1 = anderson_row(motion, sex, Age.OLD).coefficients[0]
        ratios.append(known / (c1 * GRAVITY * _MEAN_STATURES[sex]))
    return sum(ratios) / len(ratios)


@cache
def strength_rows() -> tuple[StrengthRow, ...]:
    """Return all rows of the table."""
    return tuple(map(_parse_row, _document()["strength"]))


def _parse_row(row: Mapping[str, Any]) -> StrengthRow:
    def pair(key: str) -> Pair | None:
        if key not in row:
            return None
        plus, minus = map(float, row[key])
        return plus, minus

    motion, opposite = row["motion"], row.get("opposite", row["motion"])
    origin = StrengthClass(row["class"])
    origins = origin, StrengthClass(row.get("opposite_class", origin.value))
    value = float(_document()["spread"]["value"])
    spreads = pair("spread") or (value, value)
    share, women = pair("share"), pair("women_share")
    table, subjects, has_curves = row, row.get("subjects"), "curves" in row
    if has_curves:
        table, subjects = _anderson(), sum(_anderson()["subjects"].values())
        young = {
            sex: [anderson_row(one, sex, Age.YOUNG) for one in (motion, opposite)]
            for sex in ("male", "female")
        }
        share, women = (
            (young[sex][0].coefficients[0], young[sex][1].coefficients[0]) for sex in young
        )
        spreads = young["male"][0].spread, young["male"][1].spread
    shapes = tuple((radians(best), radians(sd)) for best, sd in row.get("gaussian_deg", ()))
    kind = SampleKind(table.get("sample", "estimate"))
    return StrengthRow(
        motion,
        opposite,
        pair("torque_Nm"),
        share,
        women,
        origins,
        reference_of(table),
        Sample(kind, subjects),
        spreads,
        shapes,
        has_curves,
        row.get("why", ""),
    )


def strength(joint: str, motion: str, body: Body | None = None) -> Strength | None:
    """Return the strength of a motion of a joint; None where none is known.

    Args:
        joint: Name of the joint in its figure; one of its words says which it is ("left_elbow").
        motion: Name of a positive angle ("flexion", "twist to the left"). A part of the body before
            it ("lumbar flexion") takes precedence over the joint's words.
        body: Person; None where it is not known.
    """
    parts, kind = split_motion(joint, motion)
    for words in parts:
        wanted = {f"{word} {kind}" for word in words}
        for row in strength_rows():
            if row.motion in wanted:
                return row.strength(body)
            if row.opposite in wanted:
                own = row.strength(body)
                return own and own.reversed()
    return None


_ENDURANCE_JOINTS = {"ankle": "ankle", "knee": "knee", "shoulder": "shoulder", "elbow": "elbow"}
_TRUNK = frozenset({"waist", "lumbar", "thorax"})

LEAST_ENDURANCE_USE = 0.1
"""Use below which no endurance is stated: by three-compartment models a use below 0.08 to 0.09 can
be held for ever, and the power law knows no such bound."""


def endurance(joint: str, use: float) -> float | None:
    """Return the time for which a share of the strength of a joint can be held [s].

    After Frey-Law & Avin 2010; joints that have no row there have the general one. It is 0 above
    the strength, and None below `LEAST_ENDURANCE_USE`.
    """
    if use < LEAST_ENDURANCE_USE:
        return None
    if use > 1.0:
        return 0.0
    factor, exponent = endurance_row(joint)
    return float(factor * use**exponent)


def endurance_row(joint: str) -> Pair:
    """Return factor [s] and exponent of the endurance of a joint."""
    words = joint.lower().split("_")
    row = "trunk" if _TRUNK & set(words) else "general"
    row = next((_ENDURANCE_JOINTS[word] for word in words if word in _ENDURANCE_JOINTS), row)
    factor, exponent = _document()["endurance"][row]
    return factor, exponent


def endurance_reference() -> Reference:
    """Return the source of `endurance`."""
    found = reference_of(_document()["endurance"])
    assert found is not None
    return found


def norm_reference() -> Reference:
    """Return the source of `norms`."""
    found = reference_of(_document()["norms"])
    assert found is not None
    return found


def percent_capable(demand: float, capacity: float, spread: float) -> float:
    """Return the percentage of people whose strength is at least a demand, by a normal law.

    Args:
        demand: Torque or force that is needed, not below zero.
        capacity: Mean of the strength, in the same unit.
        spread: Standard deviation over the mean.
    """
    if capacity <= 0.0:
        return 0.0 if demand > 0.0 else 100.0
    deviation = spread * capacity
    x = (capacity - demand) / deviation if deviation else inf if capacity >= demand else -inf
    return 50.0 * (1.0 + erf(x / sqrt(2.0)))


def percentile_5(capacity: float, spread: float) -> float:
    """Return the strength that 95 % of people have, by a normal law; 0 at least."""
    return max(capacity * (1.0 - _QUANTILE_95 * spread), 0.0)


_QUANTILE_95 = 1.6448536269514722
"""Standard normal deviate that 5 % of people exceed."""
