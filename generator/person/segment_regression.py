"""Change of the segments with the build: Zatsiorsky's regressions on body mass and stature.

The published table (`segment_table`) has the shares of one body. A body similar to it has the same
shares, so the build is measured as the mass over that of a similar body of the same stature. Near
the table's body its shares are kept. Away from it the regressions take over, with a weight that
grows from 0 to 1 without a step or a kink. They were measured in men; of women the shares change as
those of a man of the same build, which is an estimate.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from math import hypot, sqrt

from generator.person.segment_table import SegmentTable, de_leva_table
from generator.person.sources import load_data_file
from generator.person.survey import Sex
from springs.published.reference import Reference

PAIRED_SEGMENTS = ("upper_arm", "forearm", "hand", "thigh", "shank", "foot")
"""Segments of the table of which a body has two."""

BAND = 0.15
"""Distance from the table's body within which its shares hold, in stature and build over its."""

HEAVIEST_BUILD: Mapping[Sex, float] = {Sex.MALE: 1.0 + BAND, Sex.FEMALE: 1.525}
"""Heaviest build with the shares of the table.

That of women is 15 % above the build of the survey's mean woman, 1.33: with the shares of the
table's woman, who weighs little, the densities of the mean woman agree with the published ones.
"""

BLEND = 0.15
"""Distance beyond the band in which the weight of the regressions grows to 1."""

STATURE_RANGE = (0.9, 1.1)
"""Range of the statures over that of the table's man in which the regressions are evaluated."""

BUILD_RANGE = (0.8, 2.5)
"""Range of the builds in which they are evaluated: of short, very light men moments become
negative."""

_KG_CM2, _CM = 1e-4, 1e-2

Radii = tuple[float, float, float]
"""Of gyration, about the sagittal, transverse and longitudinal axes."""


@dataclass(frozen=True)
class Regression:
    """Number that is linear in mass and stature.

    Attributes:
        constant: constant term, in the unit of the value.
        per_mass: slope over the body's mass [1/kg of that unit].
        per_stature: slope over stature [1/m of that unit].
    """

    constant: float
    per_mass: float
    per_stature: float

    def evaluate(self, stature: float, mass: float) -> float:
        """Value at a stature [m] and a mass of the body [kg]."""
        return self.constant + self.per_mass * mass + self.per_stature * stature

    def __str__(self) -> str:
        """The formula, for a mass in kg."""
        return (
            f"{self.constant:g} kg {self.per_mass:+g} of the body's mass "
            f"{self.per_stature:+.4g} kg/m stature"
        )


@dataclass(frozen=True)
class SegmentRegressions:
    """Regressions of one segment.

    Attributes:
        mass: mass of one side [kg].
        moments: moments of inertia about the sagittal, transverse and longitudinal axes through
            the centre of mass [kg m2].
    """

    mass: Regression
    moments: tuple[Regression, Regression, Regression]

    def radii(self, stature: float, mass: float) -> Radii:
        """Radii of gyration [m]."""
        own = self.mass.evaluate(stature, mass)
        x, y, z = (sqrt(moment.evaluate(stature, mass) / own) for moment in self.moments)
        return x, y, z


@dataclass(frozen=True)
class RegressionTable:
    """Regressions of all segments of a man.

    Attributes:
        segments: regressions by the names of the segment table.
        reference: publication.
    """

    segments: Mapping[str, SegmentRegressions]
    reference: Reference

    def shares(self, stature: float, mass: float) -> dict[str, float]:
        """Masses of one side over the sum of all sixteen, at a stature [m] and mass [kg]."""
        masses = {name: one.mass.evaluate(stature, mass) for name, one in self.segments.items()}
        return normalised(masses)


def normalised(masses: Mapping[str, float]) -> dict[str, float]:
    """Return masses of one side over the sum of the whole body's, in which limbs count twice."""
    total = sum(mass * (2 if name in PAIRED_SEGMENTS else 1) for name, mass in masses.items())
    return {name: mass / total for name, mass in masses.items()}


@cache
def zatsiorsky_regressions() -> RegressionTable:
    """Regressions of Zatsiorsky 2002, of 100 men."""
    data = load_data_file("zatsiorsky_2002")
    names = dict.fromkeys(row.segment for row in de_leva_table(Sex.MALE).rows)
    rows = {name: data.content[name] for name in names if name in data.content}
    return RegressionTable(
        {
            name: SegmentRegressions(
                _parse(row["mass"], 1.0),
                (
                    _parse(row["sagittal"], _KG_CM2),
                    _parse(row["transverse"], _KG_CM2),
                    _parse(row["longitudinal"], _KG_CM2),
                ),
            )
            for name, row in rows.items()
        },
        data.reference,
    )


def _parse(row: Sequence[float], unit: float) -> Regression:
    constant, per_mass, per_stature = row
    return Regression(unit * constant, unit * per_mass, unit * per_stature / _CM)


def build_ratio(table: SegmentTable, stature: float, mass: float) -> float:
    """Return a mass [kg] over that of a body similar to the table's, of that stature [m]."""
    return mass / (table.mass * (stature / table.stature) ** 3)


def regression_weight(sex: Sex, stature: float, mass: float) -> float:
    """Return the weight of the regressions for a person: 0 in the band, 1 far from it.

    The weight and its first derivatives are continuous.
    """
    table = de_leva_table(sex)
    tall, heavy = stature / table.stature, build_ratio(table, stature, mass)
    distance = hypot(
        max(0.0, abs(tall - 1.0) - BAND),
        max(0.0, heavy - HEAVIEST_BUILD[sex], 1.0 - BAND - heavy),
    )
    part = min(1.0, distance / BLEND)
    return part * part * (3.0 - 2.0 * part)


@dataclass(frozen=True)
class BuildChange:
    """Change of a person's segments with the build.

    Attributes:
        weight: weight of the regressions, from 0 to 1.
        stature: stature of the man at whom they are evaluated [m].
        mass: mass of that man [kg].
        is_nearest: whether he is the nearest man of their range, not the person.
        shares: masses of one side over the body's by the regressions, by the table's names.
        radius_factors: factors of the table's radii of gyration, by the table's names.
    """

    weight: float
    stature: float
    mass: float
    is_nearest: bool
    shares: Mapping[str, float]
    radius_factors: Mapping[str, Radii]

    def blend(self, share: float, segment: str) -> float:
        """Return the share of a segment that has `share` of the mass in the table."""
        return (1.0 - self.weight) * share + self.weight * self.shares[segment]

    def moment_factors(self, segment: str) -> Radii:
        """Return factors of the moments that the table's radii have with the segment's mass."""
        x, y, z = (
            1.0 - self.weight + self.weight * factor**2 for factor in self.radius_factors[segment]
        )
        return x, y, z


def build_change(sex: Sex, stature: float, mass: float) -> BuildChange | None:
    """Return the change of a person's segments; None in the band, where the table holds."""
    weight = regression_weight(sex, stature, mass)
    if weight == 0.0:
        return None
    own, man, fits = de_leva_table(sex), de_leva_table(Sex.MALE), zatsiorsky_regressions()
    tall, heavy = stature / own.stature, build_ratio(own, stature, mass)
    near_tall, near_heavy = _clamp(tall, STATURE_RANGE), _clamp(heavy, BUILD_RANGE)
    near_stature = near_tall * man.stature
    near_mass = near_heavy * near_tall**3 * man.mass
    shares = fits.shares(near_stature, near_mass)
    if sex is Sex.FEMALE:
        usual = fits.shares(man.stature, man.mass)
        shares = normalised(
            {name: own.mass_fraction(name) * shares[name] / usual[name] for name in fits.segments}
        )
    factors: dict[str, Radii] = {}
    for name, segment in fits.segments.items():
        x, y, z = (
            new / (near_tall * old)
            for new, old in zip(
                segment.radii(near_stature, near_mass),
                segment.radii(man.stature, man.mass),
                strict=True,
            )
        )
        factors[name] = x, y, z
    is_nearest = (near_tall, near_heavy) != (tall, heavy)
    return BuildChange(weight, near_stature, near_mass, is_nearest, shares, factors)


def _clamp(value: float, limits: tuple[float, float]) -> float:
    low, high = limits
    return min(max(value, low), high)
