"""`mover describe`: what a figure consists of."""

from collections.abc import Sequence

from generator.cli.answer import Answer, aligned, counted
from generator.cli.inputs import figure_of, springs_of
from generator.cli.springs_text import coupled_spring_lines, spring_lines, springs_data
from generator.figure import Factor, Figure, Joint, Segment
from generator.motion_files.action import shown_chain, unit_of
from generator.units import unit_named
from springs import SpringSet


def describe(name: str, springs: str | None = None) -> Answer:
    """Segments, joints and springs of the figure that `name` means."""
    figure, warnings = figure_of(name)
    spring_set, more = springs_of(figure, springs)
    return Answer(
        text="\n\n".join(
            [_title(name, figure), _segments(figure), _joints(figure), _springs(spring_set)]
        ),
        data=_data(name, figure, spring_set),
        faults=(*warnings, *more),
    )


def kind_of(chain: Sequence[Factor]) -> str:
    """The name of a joint of this chain among mechanisms."""
    turns = sum(factor.kind == "R" for factor in chain)
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
    return (
        f"{name}: {counted(len(figure.bodies), 'moving segment')}, "
        f"{counted(len(figure.joints), 'joint')}, "
        f"{figure.degrees_of_freedom} degrees of freedom, {figure.total_mass:.4g} kg\n"
        f"root {figure.root}"
    )


def _segments(figure: Figure) -> str:
    rows = [["segment", "mass [kg]", "inertia [kg m^2]", "centre of mass [m]"]]
    for segment in figure.segments.values():
        if segment.name in figure.ground:
            rows.append([segment.name, "ground"])
            continue
        mass = "none" if segment.mass is None else f"{segment.mass:.4f}"
        rows.append([segment.name, mass, _triple(segment.inertia), _triple(_centre(segment))])
    return aligned(rows)


def _joints(figure: Figure) -> str:
    rows = [["joint", "kind", "type", "connects", "displacement"]]
    rows += [
        [
            joint.name,
            kind_of(joint.chain),
            shown_chain(joint.chain),
            f"{joint.parent} to {joint.child}",
            _displacement(joint),
        ]
        for joint in figure.joints.values()
    ]
    return aligned(rows, left=5)


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


def _triple(values: Sequence[float] | None) -> str:
    return "none" if values is None else " ".join(f"{value:.4f}" for value in values)


def _in_units(joint: Joint) -> list[float]:
    """The displacement of a joint [deg or cm]."""
    return [
        value / float(unit_named(unit_of(factor)).factor)
        for value, factor in zip(joint.displacement, joint.chain, strict=True)
    ]


def _displacement(joint: Joint) -> str:
    shown = zip(_in_units(joint), joint.chain, strict=True)
    return " ".join(f"{value:.4g} {unit_of(factor)}" for value, factor in shown)


def _data(name: str, figure: Figure, springs: SpringSet) -> dict[str, object]:
    return {
        "figure": name,
        "file": None if figure.path is None else str(figure.path),
        "name": figure.name,
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
                "sites": list(segment.sites),
            }
            for segment in figure.segments.values()
        ],
        "joints": [
            {
                "name": joint.name,
                "parent": str(joint.parent),
                "child": str(joint.child),
                "kind": kind_of(joint.chain),
                "type": shown_chain(joint.chain),
                "degrees_of_freedom": joint.degrees_of_freedom,
                "displacement": _in_units(joint),
                "units": [unit_of(factor) for factor in joint.chain],
            }
            for joint in figure.joints.values()
        ],
        "springs": springs_data(springs),
    }
