"""`mover describe`: the segments, joints and springs of a figure."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import degrees, exp

import numpy as np

from generator.cli import inputs, options
from generator.cli.answer import CommandResult, Paragraphs, Table, format_count
from generator.cli.contact import laws_table
from generator.contact.spheres import SegmentSpheres, SphereSource, fit_contact_spheres
from generator.contact_file.parts import BodyPart
from generator.diagnostics import Diagnostic, InputError
from generator.figure import ContactSphere, Joint, JointAxis, Segment, is_rotation
from generator.kinematics.effective_mass import head_effective_masses
from generator.model import Model, contact_of_figure
from generator.motion_files.action import format_chain
from generator.person.identity import identity_of
from generator.simulation.preconditions import simulation_obstacles
from generator.springs_file.axes import axis_name, coupled_axis_names
from generator.springs_file.laws import (
    describe_law,
    format_exponent_end,
    format_range,
    law_data,
    range_in_degrees,
)
from generator.units import ROTATION_UNITS, TRANSLATION_UNITS
from springs import AxisSpring, CoupledSpring, JointSprings, Reach, SpringSet
from springs.coupled import CoupledExponential, CoupledTerm


@dataclass(frozen=True)
class Description(CommandResult):
    """Contents of a figure.

    Attributes:
        name: Figure as it was named.
        model: Figure, springs and parts of the body.
        fits: Contact spheres by segment; none where they cannot be fitted.
        touching: The same spheres, with their parts of the body.
        spheres_fault: Why they cannot.
        obstacles: Why the figure cannot be simulated.
    """

    name: str
    model: Model
    fits: Mapping[str, SegmentSpheres]
    touching: Mapping[str, Sequence[ContactSphere]]
    spheres_fault: str | None
    obstacles: Sequence[Diagnostic]

    @property
    def head_masses(self) -> Mapping[str, float] | None:
        """Effective masses of the head of a person [kg]."""
        figure = self.model.figure
        return None if identity_of(figure) is None else head_effective_masses(figure) or None

    def to_json(self) -> dict[str, object]:
        """Return segments, joints, springs and parts."""
        figure, body = self.model.figure, self.model.contact
        person = identity_of(figure)
        return {
            "figure": self.name,
            "file": figure.path,
            "name": figure.name,
            "sex": person and person.sex,
            "stature_m": person and person.stature,
            "root": str(figure.root),
            "degrees_of_freedom": figure.degrees_of_freedom,
            "total_mass_kg": figure.total_mass,
            "head_effective_mass_kg": self.head_masses,
            "segments": [
                {
                    "name": name,
                    "ground": name in figure.ground,
                    "mass_kg": segment.mass,
                    "inertia_kg_m2": segment.inertia,
                    "centre_of_mass_m": segment.centre_of_mass,
                    "psurf": segment.psurf,
                    "contact_spheres": self.fits.get(name)
                    and _spheres_data(self.fits[name], self.touching.get(name, ())),
                    "sites": list(segment.sites),
                }
                for name, segment in figure.segments.items()
            ],
            "joints": [
                {
                    "name": joint.name,
                    "parent": str(joint.parent),
                    "child": str(joint.child),
                    "kind": joint_kind(joint.chain),
                    "type": format_chain(joint.chain),
                    "degrees_of_freedom": joint.degrees_of_freedom,
                    "displacement": options.in_display_units(joint.displacement, joint.chain),
                    "units": [factor.units.displacement for factor in joint.chain],
                }
                for joint in figure.joints.values()
            ],
            "springs": springs_data(self.model.springs),
            "parts": [] if body is None else [_part_data(part) for part in body.parts],
            "can_be_simulated": not self.obstacles,
            "obstacles": self.obstacles,
        }

    def paragraphs(self) -> Paragraphs:
        """Return a summary, tables of segments and joints, and the laws of the springs."""
        figure, person = self.model.figure, identity_of(self.model.figure)
        lines = [
            f"{self.name}: {format_count(len(figure.bodies), 'moving segment')}, "
            f"{format_count(len(figure.joints), 'joint')}, {figure.freedoms}, "
            f"{figure.total_mass:.4g} kg",
            f"root {figure.root}",
        ]
        if person is not None:
            lines.append(f"{person.sex}, stature {person.stature:.4g} m")
        if self.head_masses:
            masses = (f"{mass:.3g} kg" for mass in self.head_masses.values())
            places = ("at the crown", "from front or back", "from the side")
            blows = ", ".join(map(" ".join, zip(masses, places, strict=True)))
            lines.append(f"head effective mass {blows}, in a short blow towards its centre of mass")
        lines.append("can be simulated")
        if self.obstacles:
            more = len(self.obstacles) - 1
            others = f" (and {more} more: see `mover check`)" if more else ""
            lines[-1] = f"cannot be simulated: {self.obstacles[0].message}{others}"
        if self.spheres_fault is not None:
            lines.append(f"no contact spheres: {self.spheres_fault}")
        yield "\n".join(lines)
        titles = ("mass [kg]", "inertia [kg m^2]", "centre of mass [m]", "contact spheres")
        yield Table([("segment", *titles), *map(self._segment_cells, figure.segments.values())])
        titles = ("joint", "kind", "type", "connects", "displacement")
        yield Table([titles, *map(_joint_cells, figure.joints.values())], 5)
        if self.model.contact is not None:
            yield laws_table(self.model.contact.parts)
        yield "\n".join(_springs_lines(self.model.springs))

    def _segment_cells(self, segment: Segment) -> list[str]:
        """Return the cells of a segment: its mass properties, and source and fit of its spheres."""
        if segment.name in self.model.figure.ground:
            return [segment.name, "ground"]
        vectors = [
            "none" if values is None else " ".join(f"{value:.4f}" for value in values)
            for values in (segment.inertia, segment.centre_of_mass)
        ]
        fit, spheres = self.fits.get(segment.name), "none"
        if fit is not None and fit.source is not SphereSource.NONE:
            largest = fit.largest_error
            error = "" if largest is None else f" within {1e3 * largest:.1f} mm"
            spheres = f"{len(fit.spheres)} {fit.source}{error}"
        mass = "none" if segment.mass is None else f"{segment.mass:.4f}"
        return [segment.name, mass, *vectors, spheres]


def _joint_cells(joint: Joint) -> list[str]:
    values = options.in_display_units(joint.displacement, joint.chain)
    pairs = zip(values, joint.chain, strict=True)
    displacement = " ".join(f"{value:.4g} {axis.units.displacement}" for value, axis in pairs)
    kind = joint_kind(joint.chain), format_chain(joint.chain)
    return [joint.name, *kind, f"{joint.parent} to {joint.child}", displacement]


def describe(name: options.FigureName, springs: options.SpringsChoice = None) -> CommandResult:
    """List the segments, masses, joints and springs of a figure."""
    figure, warnings = inputs.load_figure(name)
    spring_set, more = inputs.springs_from_option(figure, springs)
    obstacles = simulation_obstacles(Model(figure, spring_set))
    fits: Mapping[str, SegmentSpheres] = {}
    fault = None
    try:
        fits = fit_contact_spheres(figure)
    except InputError as failure:  # a missing psurf is a warning of the figure's own
        fault = failure.diagnostics[0].message
    model = Model(figure, spring_set, contact_of_figure(figure))
    touching = {name: fit.spheres for name, fit in fits.items()}
    if model.contact is not None and fault is None:
        touching = model.contact.assign(touching)
    return Description(
        name, model, fits, touching, fault, obstacles, diagnostics=(*warnings, *more)
    )


def joint_kind(chain: Sequence[JointAxis]) -> str:
    """The name of a joint of this chain among mechanisms."""
    turns = sum(is_rotation(factor.kind) for factor in chain)
    slides = len(chain) - turns
    names = {
        (0, 0): "fixed",
        (1, 0): "revolute",
        (2, 0): "universal",
        (3, 0): "spherical",
        (0, 1): "prismatic",
        (3, 3): "free",
    }
    return names.get((turns, slides), f"{turns} rotations, {slides} translations")


def _part_data(part: BodyPart) -> dict[str, object]:
    """Return a part of the body for `--json`."""
    return {
        "name": part.name,
        "within": part.within or None,
        "spheres": [f"{segment} {number}" for segment, number in part.spheres],
        "from_m": [depth for depth, _ in part.law.stages],
        "stiffness_N_m": [stiffness for _, stiffness in part.law.stages],
        "damping_s_m": part.law.damping,
        "band": part.band,
        "class": part.evidence,
        "source": part.law.source,
    }


def _spheres_data(fit: SegmentSpheres, touching: Sequence[ContactSphere]) -> dict[str, object]:
    """Return the contact spheres of a segment for `--json`, as they are assigned to parts."""
    return {
        "source": fit.source,
        "largest_error_m": fit.largest_error,
        "spheres": [
            {
                "centre_m": one.centre,
                "radius_m": one.radius,
                "part": one.part or None,
                **({"region": one.region} if one.region else {}),
            }
            for one in touching
        ],
    }


def _springs_lines(springs: SpringSet) -> Iterator[str]:
    """Yield the lines on all springs."""
    if not springs.joints and not springs.coupled:
        yield f"springs: none ({springs.origin})" if springs.origin != "none" else "springs: none"
        return
    yield f"springs: {springs.origin}; spherical joints by the {springs.law.value} law"
    for name, joint in springs.joints.items():
        yield name
        yield from (f"  {line}" for line in spring_lines(joint))
    for spring in springs.coupled:
        yield "over several joints"
        yield from (f"  {line}" for line in coupled_spring_lines(spring))


def coupled_law_lines(law: CoupledExponential) -> Iterator[str]:
    """Yield a line for each torque of a coupled law, and one on its range and its energy."""
    letters = _coordinate_symbols(law.coordinates)
    for i, name in enumerate(law.coordinates):
        terms = [_format_coupled_term(t, i, letters) for t in law.terms if t.amplitudes[i] != 0.0]
        yield f"{name}: {' '.join([f'{law.constants[i]:g}', *terms])} N m"
    angles = ", ".join(f"{a} {name}" for a, name in zip(letters, law.coordinates, strict=True))
    energy = "conservative" if law.is_conservative else "not conservative"
    known = [
        f"{name} {format_range(*one)}"
        for name, one in zip(law.coordinates, law.valid_ranges, strict=True)
        if one is not None
    ]
    valid = f"; known for {', '.join(known)}" if known else ""
    yield f"{angles} in rad; {energy}{valid}"


def coupled_law_data(law: CoupledExponential) -> dict[str, object]:
    """A law over several joints for `--json`; lists have an entry for each coordinate."""
    return {
        "coordinates": law.coordinates,
        "constants_Nm": law.constants,
        "terms": [
            {
                "amplitudes_Nm": term.amplitudes,
                "rates_1_rad": term.rates,
                "exponent": term.exponent,
            }
            | ({} if term.end is None else {"end": term.end})
            for term in law.terms
        ],
        "measured_deg": [range_in_degrees(known) for known in law.valid_ranges],
        "conservative": law.is_conservative,
    }


def _format_coupled_term(term: CoupledTerm, i: int, letters: tuple[str, ...]) -> str:
    pairs = [(r, a) for r, a in zip(term.rates, letters, strict=True) if r != 0.0]
    words = " ".join(f"{r:{'+' if k else ''}.4g} {a}" for k, (r, a) in enumerate(pairs))
    end = format_exponent_end(None if term.end is None else term.end - term.exponent)
    return f"{term.amplitudes[i] * exp(term.exponent):+.4g} exp({words}{end})"


def _coordinate_symbols(coordinates: tuple[str, ...]) -> tuple[str, ...]:
    """A short name for each angle: its first letter where these differ, else a1, a2, ..."""
    first = tuple(name[:1].lower() for name in coordinates)
    numbered = tuple(f"a{k}" for k in range(1, len(coordinates) + 1))
    return first if len(set(first)) == len(first) and all(map(str.isalpha, first)) else numbered


def springs_data(springs: SpringSet) -> dict[str, object]:
    """Return all springs for `--json`; angles in deg where the key says so, else rad and SI."""
    return {
        "origin": springs.origin,
        "law": springs.law,
        "joints": {
            name: {
                "axes": [_axis_data(spring) for spring in joint.axes],
                "slides": [_axis_data(spring) for spring in joint.translations],
            }
            | ({} if joint.reach is None else {"reach": _reach_data(joint.reach)})
            for name, joint in springs.joints.items()
        },
        "coupled": [_coupled_spring_data(spring) for spring in springs.coupled],
    }


def spring_lines(joint: JointSprings) -> Iterator[str]:
    """Yield a line for each law of each axis of a joint, and one for its reference."""
    if joint.reach is not None:
        yield from _reach_lines(joint.reach)
    for spring, units in [(s, ROTATION_UNITS) for s in joint.axes] + [
        (s, TRANSLATION_UNITS) for s in joint.translations
    ]:
        motion = f" ({spring.motion})" if spring.motion else ""
        yield f"{units.preposition} {axis_name(spring.direction)}{motion}"
        for law in spring.elastic:
            yield f"  {describe_law(law, units)}"
        damping = spring.damping
        if damping.viscous or damping.coulomb:
            viscous = f"{damping.viscous:g} {units.damping}"
            yield f"  damping {viscous}, friction {damping.coulomb:g} {units.effort}"
        if spring.reference:
            yield f"  reference: {spring.reference}"


def _reach_lines(reach: Reach) -> Iterator[str]:
    """Yield the range of a reach and how well it fits, its laws, and its reference."""
    angles = np.degrees(reach.boundary_at(np.radians(np.arange(360.0))))
    off_boundary, off_turn = np.degrees(reach.residuals)
    yield (
        f"reach: {angles.min():.0f} to {angles.max():.0f} deg from plane "
        f"{degrees(reach.centre.plane):.4g}, elevation {degrees(reach.centre.elevation):.4g} deg; "
        f"it meets its points within {off_boundary:.1f} deg"
    )
    for law in reach.beyond.elastic:
        yield f"  {describe_law(law)}"
    if reach.turns:
        yield f"turn about the limb; it meets its ranges within {off_turn:.1f} deg"
        for law in reach.turn.elastic:
            yield f"  {describe_law(law)}"
    if reach.reference:
        yield f"  reference: {reach.reference}"


def _reach_data(reach: Reach) -> dict[str, object]:
    off_boundary, off_turn = reach.residuals
    return {
        "centre_deg": [degrees(reach.centre.plane), degrees(reach.centre.elevation)],
        "boundary_deg": [[degrees(p.plane), degrees(p.elevation)] for p in reach.boundary],
        "turns_deg": [
            [degrees(v) for v in (t.at.plane, t.at.elevation, t.lower, t.upper)]
            for t in reach.turns
        ],
        "boundary_residual_deg": degrees(off_boundary),
        "turn_residual_deg": degrees(off_turn),
        "beyond": [law_data(law) for law in reach.beyond.elastic],
        "turn": [law_data(law) for law in reach.turn.elastic],
        "reference": reach.reference,
        "why": reach.why,
    }


def coupled_spring_lines(spring: CoupledSpring) -> Iterator[str]:
    """Yield the joints of a coupled law, the law, and its reference."""
    pairs = zip(spring.law.coordinates, coupled_axis_names(spring), strict=True)
    yield ", ".join(f"{name} at {place}" for name, place in pairs)
    for line in coupled_law_lines(spring.law):
        yield f"  {line}"
    if spring.reference:
        yield f"  reference: {spring.reference}"


def _axis_data(spring: AxisSpring) -> dict[str, object]:
    return {
        "axis": axis_name(spring.direction),
        "direction": spring.direction,
        "motion": spring.motion,
        "laws": [law_data(law) for law in spring.elastic],
        "viscous": spring.damping.viscous,
        "coulomb": spring.damping.coulomb,
        "reference": spring.reference,
        "why": spring.why,
    }


def _coupled_spring_data(spring: CoupledSpring) -> dict[str, object]:
    return {
        "axes": [
            {
                "joint": axis.joint,
                "axis": axis_name(axis.direction),
                "direction": axis.direction,
            }
            for axis in spring.axes
        ],
        **coupled_law_data(spring.law),
        "reference": spring.reference,
        "why": spring.why,
    }
