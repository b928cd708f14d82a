"""Arguments and options that several commands share, and their values as numbers.

Values are `JOINT=a,b,c` and `X,Y,Z`, or have a unit: `1.05g/cm3`, `1cm`, `mm`. Positions and
displacements are shown in centimetres and degrees.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from math import isfinite
from pathlib import Path
from typing import Annotated

import typer

from generator.diagnostics import UsageError, spelling_hint
from generator.figure import Figure, JointAxis, Vector
from generator.figure_file.values import displacement_bound
from generator.kinematics.free_root import detach_root
from generator.kinematics.placement import initial_displacements
from generator.kinematics.tree import build_tree
from generator.motion_files.action import display_unit, parse_displacement
from generator.rotations import Array
from generator.units import (
    DIMENSION_POWERS,
    INPUT_BOUNDS,
    UNIT_EXAMPLES,
    Dimension,
    UnitError,
    convert_to_si,
    parse_unit,
)
from springs import Joining

FigureName = Annotated[
    str,
    typer.Argument(metavar="FIGURE", help="A figure file, or the name of a shipped figure."),
]
SpringsChoice = Annotated[
    str | None,
    typer.Option(
        "--springs",
        metavar="FILE|NAME|none|printed",
        help="Other springs than the figure's own: a .springs.toml or .optional file, the NAME of "
        "FIGURE.NAME.springs.toml beside it, `none`, or `printed` for the values as printed.",
    ),
]
PoseFile = Annotated[
    Path | None,
    typer.Option("--pose", metavar="FILE.pose", help="A pose, as `mover pose` writes it."),
]
JointValues = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="JOINT=a,b,c", help="Displacements [deg or cm]."),
]
JoiningLaw = Annotated[
    Joining | None, typer.Option("--law", help="How the axes of a spherical joint join.")
]
Gravity = Annotated[
    str | None,
    typer.Option("--gravity", metavar="X,Y,Z", help="[m/s^2], world axes; 0,-9.81,0."),
]
LinksFile = Annotated[
    Path | None,
    typer.Option("--links", metavar="LINKS.toml", help="Links that hold, docs/links.md."),
]
LockedJoints = Annotated[
    list[str] | None,
    typer.Option("--lock", metavar="JOINT", help="A joint that stays at its displacement."),
]
MotionFile = Annotated[
    Path | None,
    typer.Option("--along", metavar="MOTION.action", help="A motion, in place of one pose."),
]
TableOutput = Annotated[
    Path | None,
    typer.Option("--output", "-o", metavar="FILE.csv", help="A row for each frame of the motion."),
]
PoseOutput = Annotated[
    Path | None,
    typer.Option("--output", "-o", metavar="FILE.pose", help="Where the pose goes."),
]
Density = Annotated[str, typer.Option("--density", metavar="1.05g/cm3", help="With its unit.")]

CM = 0.01
"""A centimetre [m]."""


def in_display_units(values: Iterable[float], chain: Sequence[JointAxis]) -> list[float]:
    """Displacements [rad or m] in degrees and cm."""
    factors = (float(parse_unit(display_unit(factor)).factor) for factor in chain)
    return [float(value) / factor for value, factor in zip(values, factors, strict=True)]


def displacements_data(
    figure: Figure, displacements: Mapping[str, Iterable[float]]
) -> list[dict[str, object]]:
    """Displacements [rad or m] of all joints for `--json`, in degrees and cm."""
    return [
        {
            "name": name,
            "displacement": in_display_units(displacements[name], joint.chain),
            "units": [display_unit(factor) for factor in joint.chain],
        }
        for name, joint in figure.joints.items()
    ]


def in_cm(position: Array) -> list[float]:
    """A position [m] in cm, without minus zeros."""
    return [float(part) / CM + 0.0 for part in position]


def format_rounded(number: float, digits: int = 2) -> str:
    """A number with a fixed count of decimals, without a minus before zero."""
    return f"{round(number, digits) + 0.0:.{digits}f}"


def xyz_cm(position: Array) -> str:
    """A position [m] as a sentence tells it in cm: `(1.00, 2.00, 3.00) cm`."""
    return f"({', '.join(map(format_rounded, in_cm(position)))}) cm"


MAX_COMPONENT = 1e9
"""Beyond it a component that a person gives is a slip; see `generator.units.Bound`."""

Chains = Mapping[str, Sequence[JointAxis]]


def settable_chains(figure: Figure, *, free_root: bool = False) -> Chains:
    """The chains that values can be given for, by joint.

    With a free root those of the figure let go, in which joints named after the segments that fly
    stand for those to the ground.
    """
    if free_root:
        figure, _ = detach_root(figure, initial_displacements(build_tree(figure)))
    return {name: joint.chain for name, joint in figure.joints.items()}


def displacements_from_options(
    option: str, texts: Iterable[str], chains: Chains
) -> dict[str, tuple[float, ...]]:
    """What `JOINT=a,b,c` says, by joint [rad or m, or their rates]; degrees and cm are written.

    Raises UsageError for what cannot be read or does not fit a chain.
    """
    given: dict[str, tuple[float, ...]] = {}
    for text in texts:
        name, equals, values = text.partition("=")
        name = name.strip()
        if not equals:
            raise UsageError(f"{option} {text}: expected JOINT=a,b,c")
        if name not in chains:
            hint = spelling_hint(name, chains)
            raise UsageError(f"{option} {text}: the figure has no joint `{name}`; {hint}")
        if name in given:
            raise UsageError(f"{option} {text}: `{name}` was given before")
        parts, chain = values.split(","), chains[name]
        if len(parts) != len(chain):
            units = ",".join(map(display_unit, chain))
            raise UsageError(
                f"{option} {text}: `{name}` takes {len(chain)} values ({units}), not {len(parts)}"
            )
        given[name] = tuple(
            _displacement_value(option, text, part.strip(), factor)
            for part, factor in zip(parts, chain, strict=True)
        )
    return given


def vector_from_option(option: str, text: str, largest: float = MAX_COMPONENT) -> Vector:
    """What `X,Y,Z` says. Raises UsageError unless it is three numbers, none beyond `largest`."""
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise UsageError(f"{option} {text}: expected three numbers, X,Y,Z") from None
    if not all(map(isfinite, (x, y, z))):
        raise UsageError(f"{option} {text}: the numbers must be finite")
    if any(abs(part) > largest for part in (x, y, z)):
        raise UsageError(f"{option} {text}: the numbers must be at most {largest:g}")
    return x, y, z


def _displacement_value(option: str, text: str, part: str, factor: JointAxis) -> float:
    try:
        value = parse_displacement(part, display_unit(factor))
    except (ValueError, OverflowError):
        raise UsageError(f"{option} {text}: `{part}` is no finite number") from None
    bound = displacement_bound(factor)
    if not bound.contains(value):
        raise UsageError(f"{option} {text}: `{part}` is beyond {bound.text}")
    return value


_QUANTITY = re.compile(r"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?)\s*(.*?)\s*")

MIN_DENSITY = 1e-6
"""Below it a density that a person gives is a slip [kg/m3]."""


def density_from_option(option: str, text: str) -> float:
    """The density [kg/m3] that `1.05g/cm3` says; its unit must stand there. Raises UsageError."""
    density = _quantity_from_option(option, text, Dimension.DENSITY, "1.05g/cm3")
    if not density >= MIN_DENSITY:
        raise UsageError(f"{option} {text}: a density is at least {MIN_DENSITY:g} kg/m3")
    return density


def length_from_option(option: str, text: str) -> float:
    """The length [m] that `1cm` says; zero alone needs no unit. Raises UsageError."""
    return _quantity_from_option(option, text, Dimension.LENGTH, "1cm")


def length_unit_from_option(option: str, text: str) -> Fraction:
    """The length [m] that a unit such as `mm` names. Raises UsageError."""
    return _unit_factor(option, text, text, Dimension.LENGTH)


def _quantity_from_option(option: str, text: str, dimension: Dimension, example: str) -> float:
    match = _QUANTITY.fullmatch(text)
    if match is None:
        raise UsageError(f"{option} {text}: expected {dimension.value} such as {example}")
    number, unit = match[1], match[2]
    if not unit:
        if float(number) == 0.0:
            return 0.0
        raise UsageError(
            f"{option} {text}: the unit is missing; give one of {UNIT_EXAMPLES[dimension]}"
        )
    bound = INPUT_BOUNDS[dimension]
    try:
        value = convert_to_si(number, _unit_factor(option, text, unit, dimension))
    except OverflowError:
        value = float("inf")
    if not bound.contains(value):
        raise UsageError(f"{option} {text}: {bound}")
    return value


def _unit_factor(option: str, text: str, unit: str, dimension: Dimension) -> Fraction:
    try:
        named = parse_unit(unit)
    except UnitError as failure:
        raise UsageError(f"{option} {text}: {failure}; {failure.hint}") from None
    if named.powers != DIMENSION_POWERS[dimension]:
        raise UsageError(
            f"{option} {text}: `{unit}` is no unit of {dimension.value}; "
            f"give one of {UNIT_EXAMPLES[dimension]}"
        )
    return named.factor
