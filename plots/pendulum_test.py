"""Numbers of the pendulum (Wartenberg) test, beside published ones of healthy adults.

A limb is released and swings freely: the knee of a person who sits or lies with the shank over an
edge (R. Wartenberg, Neurology 1:18-24, 1951), or the elbow. The numbers are those of measured
angles (`generator.identification.swing`), the published ones those against which a person is tested
(`plots/data/person_facts.toml`).
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from math import degrees, isfinite, nan, radians

from generator.cli.answer import Table, finite_or_none
from generator.diagnostics import InputError, error
from generator.identification.measured_angles import MeasuredAngles
from generator.identification.swing import MeasuredSwing, Swing, smooth_swing
from plots.person_facts import Fact, person_facts

SWING_AMPLITUDE = radians(2.0)
"""Amplitude beyond which a swing counts [rad]."""

_LIMBS = ("knee", "elbow")
"""Joints with published swings, without side."""

_PERIODS = 3
"""Largest number of periods whose mean is taken."""


@dataclass(frozen=True)
class PendulumNumber:
    """A number of a swing.

    Attributes:
        quantity: quantity in words.
        unit: unit of the values, or "".
        value: nan where the record does not have it.
        sd: standard deviation from the noise of the angles; nan where it is unknown.
        fact: published number of healthy people; None without one.
    """

    quantity: str
    unit: str
    value: float
    sd: float
    fact: Fact | None

    @property
    def verdict(self) -> str:
        """Place of the value beside the published band; "" without one."""
        if self.fact is None or not isfinite(self.value):
            return ""
        if self.value < self.fact.low:
            return "below"
        return "above" if self.value > self.fact.high else "within"


@dataclass(frozen=True, eq=False)
class PendulumTest:
    """The pendulum test of a joint.

    Attributes:
        joint: name of the joint, with the number of the displacement if it has several.
        samples: number of angles.
        rate: rate of the samples [1/s].
        noise: standard deviation of the angles about the smoothed ones [rad].
        turns: number of turning points.
        drop: angle from release to rest [rad].
        numbers: numbers of the swing.
    """

    joint: str
    samples: int
    rate: float
    noise: float
    turns: int
    drop: float
    numbers: tuple[PendulumNumber, ...]

    def paragraphs(self) -> Iterator[str]:
        """Text of the test: the numbers, then the sources of the published ones."""
        yield (
            f"{self.joint}: {self.samples} angles, {self.rate:.4g} a second; noise "
            f"{degrees(self.noise):.2g} deg, {self.turns} turning points"
        )
        facts = [number.fact for number in self.numbers if number.fact is not None]
        head = ["quantity", "unit", "value", "sd"]
        rows = [[*head, *(["healthy", "band", ""] if facts else [])]]
        rows += [_cells(number) for number in self.numbers]
        yield str(Table(rows, 2))
        missing = [number.quantity for number in self.numbers if not isfinite(number.value)]
        if missing:
            yield f"The record is too short for: {', '.join(missing)}."
        rates = [number for number in self.numbers if number.fact and number.unit == "rad/s"]
        if any(number.verdict != "within" for number in rates):
            yield (
                "Peaks of the rate are roughly proportional to the drop from release to rest, here "
                f"{abs(degrees(self.drop)):.0f} deg, which the publication does not state."
            )
        if facts:
            lines = ["healthy people:"]
            for source in dict.fromkeys(fact.source for fact in facts):
                own = [fact for fact in facts if fact.source == source]
                bands = (f"{fact.quantity.partition(':')[0]} ({fact.band})" for fact in own)
                lines.append(f"  {'; '.join(bands)}: {source.reference}")
            yield "\n".join(lines)

    def to_json(self) -> dict[str, object]:
        """The test for `--json`."""
        return {
            "joint": self.joint,
            "samples": self.samples,
            "noise_deg": degrees(self.noise),
            "turning_points": self.turns,
            "numbers": [_number_as_json(number) for number in self.numbers],
        }


def pendulum_tests(data: MeasuredAngles) -> tuple[PendulumTest, ...]:
    """Return the pendulum tests of all joints that swing.

    Raises InputError if none does, with the reason for each.
    """
    found: list[PendulumTest] = []
    reasons: list[str] = []
    joints = [joint for joint, _ in data.columns]
    for k, (joint, coordinate) in enumerate(data.columns):
        name = joint if joints.count(joint) == 1 else f"{joint}.{coordinate + 1}"
        try:
            measured = smooth_swing(data.times - data.times[0], data.angles[:, k])
        except ValueError as reason:
            reasons.append(f"{data.name}: {name} is not a swing: {reason}")
        else:
            found.append(_pendulum_test(name, joint, measured))
    if not found:
        raise InputError([error(reason) for reason in reasons])
    return tuple(found)


def _pendulum_test(name: str, joint: str, measured: MeasuredSwing) -> PendulumTest:
    swing = measured.swing
    limb = next((limb for limb in _LIMBS if joint.endswith(limb)), None)
    quantities = _quantities(swing)
    deviations = measured.uncertainties(
        {words: value for words, (_, value, _) in quantities.items()}
    )
    facts = person_facts().facts
    numbers: list[PendulumNumber] = []
    for words, (unit, quantity, key) in quantities.items():
        value = nan
        with suppress(ValueError):
            value = float(quantity(swing))
        fact = facts.get(f"{limb}_{key}") if key else None
        numbers.append(PendulumNumber(words, unit, value, deviations[words], fact))
    times = swing.times
    return PendulumTest(
        name,
        len(times),
        (len(times) - 1) / float(times[-1] - times[0]),
        measured.noise,
        len(swing.turning_times),
        swing.rest - swing.start,
        tuple(numbers),
    )


_Quantity = tuple[str, Callable[[Swing], float], str]
"""Unit, function of the swing, and end of the key of the published number, or ""."""


def _quantities(swing: Swing) -> Mapping[str, _Quantity]:
    """Quantities of a swing, by their words."""
    count = min(_PERIODS, max(1, (len(swing.turning_times) - 1) // 2))
    periods = "first period" if count == 1 else f"period, mean of the first {count}"
    return {
        "angle of release": ("deg", lambda one: degrees(one.start), ""),
        "angle of rest": ("deg", lambda one: degrees(one.rest), ""),
        "first turning point": ("deg", lambda one: degrees(one.turning_angles[0]), ""),
        "first swing": ("deg", lambda one: degrees(one.first_swing), ""),
        "relaxation index": ("", lambda one: one.relaxation_index, "ratio"),
        "swings beyond 2 deg": ("", lambda one: one.swings(SWING_AMPLITUDE), "swings"),
        periods: ("s", lambda one: one.period(count), "period"),
        "first peak of the rate": ("rad/s", lambda one: one.peak_rates[0], "first_velocity"),
        "second peak of the rate": ("rad/s", lambda one: one.peak_rates[1], "second_velocity"),
    }


def _cells(number: PendulumNumber) -> list[str]:
    digits = 3  # two digits of the uncertainty show
    if isfinite(number.sd):
        exponent = int(f"{number.sd:.1e}".partition("e")[2])
        digits = min(4, max(0, 1 - exponent)) if number.sd else 0
    row = [
        number.quantity,
        number.unit,
        f"{number.value:.{digits}f}" if isfinite(number.value) else "-",
        f"{number.sd:.2g}" if isfinite(number.sd) else "-",
    ]
    if number.fact is not None:
        fact = number.fact
        spread = "" if fact.spread is None else f" ± {fact.spread:.2g}"
        row += [f"{fact.value:.4g}{spread}", f"{fact.low:.4g} .. {fact.high:.4g}", number.verdict]
    return row


def _number_as_json(number: PendulumNumber) -> dict[str, object]:
    fact = number.fact
    published = fact and {
        "value": fact.value,
        "sd": fact.spread,
        "band": [fact.low, fact.high],
        "width": fact.band,
        "reference": str(fact.source.reference),
    }
    return {
        "quantity": number.quantity,
        "unit": number.unit,
        "value": finite_or_none(number.value),
        "sd": finite_or_none(number.sd),
        "healthy": published,
        "verdict": number.verdict,
    }
