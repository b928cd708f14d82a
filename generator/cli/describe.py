"""`mover describe`: what a figure consists of."""

from collections.abc import Mapping, Sequence

from generator.cli.answer import CommandResult, format_count, format_table
from generator.cli.inputs import load_figure, springs_from_option
from generator.cli.options import FigureName, SpringsChoice, in_display_units
from generator.cli.springs_text import coupled_spring_lines, spring_lines, springs_data
from generator.diagnostics import Diagnostic, InputError
from generator.figure import Figure, Joint, JointAxis, Segment, is_rotation
from generator.geometry.contact_spheres import SegmentSpheres, SphereSource, fit_contact_spheres
from generator.motion_files.action import format_chain
from generator.person.identity import identity_of
from generator.simulation.preconditions import simulation_obstacles
from springs import SpringSet


def describe(name: FigureName, springs: SpringsChoice = None) -> CommandResult:
    """List the segments, masses, joints and springs of a figure."""
    figure, warnings = load_figure(name)
    spring_set, more = springs_from_option(figure, springs)
    obstacles = simulation_obstacles(figure, spring_set)
    title = f"{_title(name, figure)}\n{_simulation_text(obstacles)}"
    try:
        spheres = fit_contact_spheres(figure)
    except InputError as failure:  # a missing psurf is a warning of the figure's own
        spheres = {}
        title += f"\nno contact spheres: {failure.diagnostics[0].message}"
    sections = [title, _segments(figure, spheres), _joints(figure), _springs(spring_set)]
    return CommandResult(
        text="\n\n".join(sections),
        data={
            **_data(name, figure, spring_set, spheres),
            "can_be_simulated": not obstacles,
            "obstacles": [obstacle.as_dict() for obstacle in obstacles],
        },
        diagnostics=(*warnings, *more),
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


def _title(name: str, figure: Figure) -> str:
    person = identity_of(figure)
    who = "" if person is None else f"\n{person.sex.value}, stature {person.stature:.4g} m"
    return (
        f"{name}: {format_count(len(figure.bodies), 'moving segment')}, "
        f"{format_count(len(figure.joints), 'joint')}, "
        f"{figure.degrees_of_freedom} degrees of freedom, {figure.total_mass:.4g} kg\n"
        f"root {figure.root}{who}"
    )


def _simulation_text(obstacles: Sequence[Diagnostic]) -> str:
    """State in a line whether a figure can be simulated, and the first reason against it."""
    if not obstacles:
        return "can be simulated"
    more = f" (and {len(obstacles) - 1} more: see `mover check`)" if len(obstacles) > 1 else ""
    return f"cannot be simulated: {obstacles[0].message}{more}"


def _segments(figure: Figure, spheres: Mapping[str, SegmentSpheres]) -> str:
    titles = ["segment", "mass [kg]", "inertia [kg m^2]", "centre of mass [m]", "contact spheres"]
    rows = [titles]
    for segment in figure.segments.values():
        if segment.name in figure.ground:
            rows.append([segment.name, "ground"])
            continue
        mass = "none" if segment.mass is None else f"{segment.mass:.4f}"
        rows.append(
            [
                segment.name,
                mass,
                _format_vector(segment.inertia),
                _format_vector(_centre(segment)),
                _format_spheres(spheres.get(segment.name)),
            ]
        )
    return format_table(rows)


def _format_spheres(fit: SegmentSpheres | None) -> str:
    """Number of spheres, their source, and the largest error in height."""
    if fit is None or fit.source is SphereSource.NONE:
        return "none"
    error = "" if fit.largest_error is None else f" within {1e3 * fit.largest_error:.1f} mm"
    return f"{len(fit.spheres)} {fit.source}{error}"


def _spheres_data(fit: SegmentSpheres | None) -> dict[str, object] | None:
    if fit is None:
        return None
    return {
        "source": fit.source.value,
        "largest_error_m": fit.largest_error,
        "spheres": [
            {"centre_m": list(sphere.centre), "radius_m": sphere.radius} for sphere in fit.spheres
        ],
    }


def _joints(figure: Figure) -> str:
    rows = [["joint", "kind", "type", "connects", "displacement"]]
    rows += [
        [
            joint.name,
            joint_kind(joint.chain),
            format_chain(joint.chain),
            f"{joint.parent} to {joint.child}",
            _format_displacement(joint),
        ]
        for joint in figure.joints.values()
    ]
    return format_table(rows, left_columns=5)


def _springs(springs: SpringSet) -> str:
    if not springs.joints and not springs.coupled:
        return f"springs: none ({springs.origin})" if springs.origin != "none" else "springs: none"
    lines = [f"springs: {springs.origin}; spherical joints by the {springs.joining.value} law"]
    for name, joint in springs.joints.items():
        lines.append(name)
        lines += [f"  {line}" for line in spring_lines(joint)]
    for spring in springs.coupled:
        lines.append("over several joints")
        lines += [f"  {line}" for line in coupled_spring_lines(spring)]
    return "\n".join(lines)


def _centre(segment: Segment) -> list[float] | None:
    centre = segment.centre_of_mass
    return None if centre is None else [float(part) for part in centre]


def _format_vector(values: Sequence[float] | None) -> str:
    return "none" if values is None else " ".join(f"{value:.4f}" for value in values)


def _format_displacement(joint: Joint) -> str:
    shown = zip(in_display_units(joint.displacement, joint.chain), joint.chain, strict=True)
    return " ".join(f"{value:.4g} {axis.units.displacement}" for value, axis in shown)


def _data(
    name: str, figure: Figure, springs: SpringSet, spheres: Mapping[str, SegmentSpheres]
) -> dict[str, object]:
    person = identity_of(figure)
    return {
        "figure": name,
        "file": None if figure.path is None else str(figure.path),
        "name": figure.name,
        "sex": None if person is None else person.sex.value,
        "stature_m": None if person is None else person.stature,
        "root": str(figure.root),
        "degrees_of_freedom": figure.degrees_of_freedom,
        "total_mass_kg": figure.total_mass,
        "segments": [
            {
                "name": segment.name,
                "ground": segment.name in figure.ground,
                "mass_kg": segment.mass,
                "inertia_kg_m2": None if segment.inertia is None else list(segment.inertia),
                "centre_of_mass_m": _centre(segment),
                "psurf": segment.psurf,
                "contact_spheres": _spheres_data(spheres.get(segment.name)),
                "sites": list(segment.sites),
            }
            for segment in figure.segments.values()
        ],
        "joints": [
            {
                "name": joint.name,
                "parent": str(joint.parent),
                "child": str(joint.child),
                "kind": joint_kind(joint.chain),
                "type": format_chain(joint.chain),
                "degrees_of_freedom": joint.degrees_of_freedom,
                "displacement": in_display_units(joint.displacement, joint.chain),
                "units": [factor.units.displacement for factor in joint.chain],
            }
            for joint in figure.joints.values()
        ],
        "springs": springs_data(springs),
    }
