"""Sources of the numbers in a person's springs, one row a number."""

from collections.abc import Iterator
from math import degrees

from generator.figure import Figure
from generator.person.body import Body
from generator.person.passive_joints import (
    PassiveAxis,
    coupled_leg_springs,
    passive_axes,
    scaling_reference,
)
from generator.person.sources import Origin, SourcedNumber
from generator.springs_file.coupled import CoupledEntry
from generator.springs_file.published import PublishedLaw
from springs.elastic import Elastic
from springs.exponential import Exponential
from springs.interpolated import Interpolated
from springs.linear import Linear
from springs.published.reference import Reference
from springs.published.tables import coupled_law
from springs.smooth_limit import SmoothLimit


def spring_sources(body: Body, figure: Figure) -> tuple[SourcedNumber, ...]:
    """Return every number of a person's springs with its source, the two-joint law's last."""
    rows = [row for axis in passive_axes(body, figure) for row in _axis_sources(axis)]
    for entry in coupled_leg_springs(body, figure).coupled:
        rows += _coupled_sources(entry)
    return tuple(rows)


def _axis_sources(axis: PassiveAxis) -> Iterator[SourcedNumber]:
    part, motion = axis.joint, axis.motion
    reference = axis.law.references[0] if axis.law.references else None
    rule = " ".join(filter(None, (axis.choice, axis.law.rule)))
    for quantity, value, unit in _law_numbers(axis.law.law):
        name = f"{motion}: {quantity}"
        yield SourcedNumber(part, name, value, unit, axis.origin, reference, rule)
    yield SourcedNumber(
        *(part, f"{motion}: factor of the torque", axis.scale, "", Origin.SCALED),
        scaling_reference(),
        axis.scale_rule,
    )
    yield SourcedNumber(
        *(part, f"{motion}: damping ratio of the limb", axis.ratio, "", axis.ratio_origin),
        axis.ratio_reference,
        axis.ratio_rule,
    )
    published = axis.ratio_origin is Origin.PUBLISHED
    yield SourcedNumber(
        *(part, f"{motion}: viscous damping", axis.damping.viscous, "N m s/rad"),
        Origin.SCALED if published else Origin.ESTIMATE,
        axis.ratio_reference,
        axis.damping_rule,
    )


def _law_numbers(law: Elastic | PublishedLaw) -> Iterator[tuple[str, float, str]]:
    """Quantity, value and unit of the numbers of a law, before its factor."""
    if isinstance(law, PublishedLaw):
        yield from _printed_numbers(law)
        return
    match law:
        case Interpolated():
            for angle, torque in law.points:
                yield f"torque at {degrees(angle):.6g} deg", torque, "N m"
        case SmoothLimit():
            yield "lower limit", law.lower, "rad"
            yield "upper limit", law.upper, "rad"
            yield "stiffness beyond the lower limit", law.lower_stiffness, "N m/rad"
            yield "stiffness beyond the upper limit", law.upper_stiffness, "N m/rad"
            yield "angle over which it grows", law.transition, "rad"
        case Exponential():
            for k, term in enumerate(law.terms, start=1):
                yield f"amplitude of exponential {k}", term.amplitude, "N m"
                yield f"rate of exponential {k}", term.rate, "1/rad"
            yield "constant torque", law.constant, "N m"
        case Linear():
            yield "stiffness", law.stiffness, "N m/rad"
            yield "rest", law.rest, "rad"
        case _:
            raise TypeError(f"a person has no law {type(law).__name__}")


def _printed_numbers(law: PublishedLaw) -> Iterator[tuple[str, float, str]]:
    """The law's numbers in SI: those of the law that the printed ones make."""
    made = law.law
    if isinstance(made, Interpolated | SmoothLimit | Exponential | Linear):
        yield from _law_numbers(made)
    else:
        for name, value in law.row.printed.coefficients.items():
            yield f"{name} as printed", value, ""


def _coupled_sources(entry: CoupledEntry) -> Iterator[SourcedNumber]:
    """The numbers of a two-joint law as published, with its factor."""
    assert entry.published is not None
    reference: Reference = coupled_law(entry.published).reference
    law, part = entry.unmodified_law, " and ".join(entry.joints[0]).replace("left_", "")
    for k, term in enumerate(law.terms, start=1):
        numbers = [("exponent at zero angles", term.exponent, "")]
        for name, amplitude, rate in zip(law.coordinates, term.amplitudes, term.rates, strict=True):
            numbers += [(f"torque about {name}", amplitude, "N m"), (name, rate, "1/rad")]
        for quantity, value, unit in numbers:
            label = f"two-joint law, exponential {k}: {quantity}"
            yield SourcedNumber(part, label, value, unit, Origin.PUBLISHED, reference, entry.why)
    for name, constant in zip(law.coordinates, law.constants, strict=True):
        label = f"two-joint law, constant about {name}"
        yield SourcedNumber(part, label, constant, "N m", Origin.PUBLISHED, reference, entry.why)
    yield SourcedNumber(
        *(part, "two-joint law: factor of the torques", entry.scale, "", Origin.SCALED),
        scaling_reference(),
        entry.why,
    )
