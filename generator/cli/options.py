"""Arguments and options that several commands share, and their values as numbers.

Values are `JOINT=a,b,c` and `X,Y,Z`, or have a unit: `1.05g/cm3`, `1cm`, `mm`. Positions and
displacements are shown in centimetres and degrees.
"""

import re
from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from fractions import Fraction
from inspect import Parameter, signature
from math import isfinite
from pathlib import Path
from typing import Annotated, Any, NamedTuple, TypeVar

import typer

from generator.diagnostics import UsageError, format_count, spelling_hint
from generator.figure import Figure, JointAxis, Vector
from generator.figure_file.read import FIGURE_FILE
from generator.figure_file.values import displacement_bound
from generator.kinematics.free_root import Joints, settable_joints
from generator.motion_files.action import LENGTH_UNIT, parse_displacement
from generator.rotations import Array
from generator.run_options import MAX_GRAVITY, PANELS, RUN_OPTIONS
from generator.units import (
    DIMENSION_POWERS,
    INPUT_BOUNDS,
    UNIT_EXAMPLES,
    Dimension,
    UnitError,
    convert_to_si,
    parse_unit,
)
from springs import SphericalLaw

R = TypeVar("R")


def complete_figure_name(incomplete: str) -> list[str]:
    """Return the figures that begin so, shipped or in this folder, for completion by the shell.

    Nothing for other paths: the shell completes them itself.
    """
    here = sorted(str(path) for path in Path().glob(f"*{FIGURE_FILE.suffix}"))
    found = [*FIGURE_FILE.shipped(), *here]
    return [name for name in found if name.startswith(incomplete)]


FigureName = Annotated[
    str,
    typer.Argument(
        metavar="FIGURE",
        help="A figure file, or the name of a shipped figure.",
        autocompletion=complete_figure_name,
    ),
]
OptionalFigureName = Annotated[
    str | None,
    typer.Argument(
        metavar="FIGURE",
        help="A figure file, or the name of a shipped figure; not needed with --replay.",
        autocompletion=complete_figure_name,
        show_default=False,
    ),
]


def option(metavar: str, text: str, *flags: str) -> Any:
    """Return an option of a command with its help."""
    return typer.Option(*flags, metavar=metavar, help=text)


def output_option(metavar: str, text: str) -> Any:
    """Return the option `-o` of a command."""
    return option(metavar, text, "--output", "-o")


def run_option(key: str, panel: str | None = None) -> Any:
    """Return the option of a command for an option of a run, in a section of its help."""
    row = RUN_OPTIONS[key]
    return typer.Option(row.flag, metavar=row.metavar, help=row.help, rich_help_panel=panel)


SpringsChoice = Annotated[str | None, run_option("springs")]
PoseFile = Annotated[Path | None, run_option("pose")]
JointValues = Annotated[list[str] | None, run_option("set")]
LawChoice = Annotated[SphericalLaw | None, run_option("law")]
FreeRoot = Annotated[bool, run_option("free_root")]
Gravity = Annotated[str | None, run_option("gravity")]
FloorOption = Annotated[bool, run_option("floor")]
HeightOption = Annotated[float | None, run_option("height")]
FrictionOption = Annotated[float | None, run_option("friction")]
SceneOption = Annotated[str | None, run_option("scene")]
FallOption = Annotated[str | None, run_option("fall")]
SeedOption = Annotated[int | None, run_option("seed")]
LinksFile = Annotated[Path | None, run_option("links")]
LockedJoints = Annotated[list[str] | None, run_option("lock")]
MotionFile = Annotated[
    Path | None, option("MOTION", "Motion, instead of a single pose.", "--along")
]
TableOutput = Annotated[Path | None, output_option("FILE.csv", "Table with one row per frame.")]
PoseOutput = Annotated[Path | None, output_option("FILE.pose", "Pose file to write.")]
BodyName = Annotated[
    str,
    typer.Argument(metavar="FIGURE|MODEL", help="A figure, or a model: .osim .xml .mjcf .urdf."),
]
UpAxis = Annotated[str, option("y|z", "Axis of the laboratory that points up.")]
Density = Annotated[str, option("1.05g/cm3", "Density with its unit.", "--density")]


def with_run_options(command: Callable[..., R]) -> Callable[..., R]:
    """Give a command all options of a run, after its own, in sections of the help.

    It names those that it uses itself; the others are its `**options`.
    """
    shared = [
        Parameter(
            row.field,
            Parameter.POSITIONAL_OR_KEYWORD,
            default=False if row.type is bool else None,
            annotation=Annotated[
                bool if row.type is bool else row.type | None, run_option(key, panel)
            ],
        )
        for panel, keys in PANELS.items()
        for key in keys
        for row in (RUN_OPTIONS[key],)
    ]
    names = {one.name for one in shared}
    own = signature(command)
    parameters = own.parameters.values()
    others = [one for one in parameters if one.name not in names]
    kinds = Parameter.KEYWORD_ONLY, Parameter.VAR_KEYWORD
    first = [one for one in others if one.kind not in kinds]
    last = [one for one in others if one.kind is Parameter.KEYWORD_ONLY]
    vars(command)["__signature__"] = own.replace(parameters=[*first, *shared, *last])
    return command


CM = 0.01
"""A centimetre [m]."""


def in_display_units(values: Iterable[float], chain: Sequence[JointAxis]) -> list[float]:
    """Convert displacements [rad or m] to degrees and cm."""
    factors = (float(parse_unit(factor.units.displacement).factor) for factor in chain)
    return [float(value) / factor for value, factor in zip(values, factors, strict=True)]


class JointDisplacement(NamedTuple):
    """Displacements of a joint [units]."""

    name: str
    displacement: Sequence[float]
    units: Sequence[str]

    def texts(self, digits: int) -> list[str]:
        """Return each displacement with its unit and so many decimals."""
        pairs = zip(self.displacement, self.units, strict=True)
        return [f"{format_rounded(value, digits)} {unit}" for value, unit in pairs]


def joint_displacements(
    figure: Figure, displacements: Mapping[str, Iterable[float]]
) -> list[JointDisplacement]:
    """Return the displacements [rad or m] of all joints in degrees and cm."""
    return [
        JointDisplacement(
            name,
            in_display_units(displacements[name], joint.chain),
            [factor.units.displacement for factor in joint.chain],
        )
        for name, joint in figure.joints.items()
    ]


def in_cm(position: Array) -> list[float]:
    """Convert a position [m] to cm, without negative zeros."""
    return [float(part) / CM + 0.0 for part in position]


def format_rounded(number: float, digits: int = 2) -> str:
    """Format a number with fixed decimals, without negative zero."""
    return f"{round(number, digits) + 0.0:.{digits}f}"


def format_frames(times: Sequence[float] | Array, figure: object = None) -> str:
    """State the number of frames at times [s], of a figure, and their first and last time."""
    of_figure = "" if figure is None else f" of {figure}"
    span = f"{times[0]:g} to {times[-1]:g} s"
    return f"{format_count(len(times), 'frame')}{of_figure}, {span}"


def velocities_from_options(
    texts: Iterable[str], figure: Figure, *, free_root: bool = False
) -> dict[str, tuple[float, ...]]:
    """Parse the values of `--velocity`, by joint or free segment [rad/s or m/s].

    Joints have deg/s and cm/s; a free segment has an angular velocity [deg/s] and the velocity of
    its centre of mass [m/s].

    Raises UsageError for text that is invalid or does not fit a chain.
    """
    texts = list(texts)
    joints = settable_joints(figure, free_root=free_root)
    free = joints.keys() - figure.joints.keys() if free_root else ()
    if not free_root:
        for text in texts:
            name = text.partition("=")[0].strip()
            if name in figure.segments and name not in joints:
                raise UsageError(
                    f"--velocity {text}: `{name}` is a segment, which has a velocity of its own "
                    "with --free-root only"
                )
    return displacements_from_options("--velocity", texts, joints, free)


def displacements_from_options(
    option: str, texts: Iterable[str], joints: Joints, in_metres: Container[str] = ()
) -> dict[str, tuple[float, ...]]:
    """Parse `JOINT=a,b,c` in deg and cm, or m for some joints, by joint [rad or m, or their rates].

    Three values of an elastic joint, such as a neck, are those of its rotations.

    Raises UsageError for text that is invalid or does not fit a chain.
    """
    values_by_joint: dict[str, tuple[float, ...]] = {}
    for text in texts:
        name, equals, values = text.partition("=")
        name = name.strip()
        if not equals:
            raise UsageError(f"{option} {text}: expected JOINT=a,b,c")
        if name not in joints:
            hint = spelling_hint(name, joints)
            raise UsageError(f"{option} {text}: the figure has no joint `{name}`; {hint}")
        if name in values_by_joint:
            raise UsageError(f"{option} {text}: `{name}` is set twice")
        parts, joint = values.split(","), joints[name]
        is_free = name in in_metres
        chain = joint.chain if is_free else joint.axes_of(len(parts))
        units = [factor.units.displacement for factor in chain]
        if is_free:
            units = ["m" if unit == LENGTH_UNIT else unit for unit in units]
        if len(parts) != len(chain):
            count = format_count(len(chain), "value")
            raise UsageError(
                f"{option} {text}: `{name}` takes {count} ({','.join(units)}), not {len(parts)}"
            )
        numbers = [
            _displacement_value(option, text, part.strip(), factor, unit)
            for part, factor, unit in zip(parts, chain, units, strict=True)
        ]
        values_by_joint[name] = tuple(numbers) if is_free else joint.complete(numbers)
    return values_by_joint


def vector_from_option(option: str, text: str, largest: float = MAX_GRAVITY) -> Vector:
    """Parse `X,Y,Z`. Raises UsageError unless it is three numbers of at most `largest`."""
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise UsageError(f"{option} {text}: expected three numbers, X,Y,Z") from None
    if not all(map(isfinite, (x, y, z))):
        raise UsageError(f"{option} {text}: the numbers must be finite")
    if any(abs(part) > largest for part in (x, y, z)):
        raise UsageError(f"{option} {text}: the numbers must be at most {largest:g}")
    return x, y, z


def _displacement_value(option: str, text: str, part: str, factor: JointAxis, unit: str) -> float:
    try:
        value = parse_displacement(part, unit)
    except (ValueError, OverflowError):
        fault = f"{option} {text}: `{part}` is not a finite number"
        match = _QUANTITY.fullmatch(part)
        if match and match[2]:
            rate = "/s" if option == "--velocity" else ""
            fault = f"{option} {text}: give `{part}` as a number in {unit}{rate}, without a unit"
        raise UsageError(fault) from None
    bound = displacement_bound(factor)
    if not bound.contains(value):
        raise UsageError(f"{option} {text}: `{part}` is beyond {bound.text}")
    return value


_QUANTITY = re.compile(r"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?)\s*(.*?)\s*")

MIN_DENSITY = 1e-6
"""Smallest density [kg/m3]: smaller ones are typing errors."""


def density_from_option(option: str, text: str) -> float:
    """Parse a density [kg/m3] such as `1.05g/cm3`, with its unit. Raises UsageError."""
    density = _quantity_from_option(option, text, Dimension.DENSITY, "1.05g/cm3")
    if not density >= MIN_DENSITY:
        raise UsageError(f"{option} {text}: a density is at least {MIN_DENSITY:g} kg/m3")
    return density


def length_from_option(option: str, text: str, example: str = "1cm") -> float:
    """Parse a length [m] such as the example; zero needs no unit. Raises UsageError."""
    return _quantity_from_option(option, text, Dimension.LENGTH, example)


def mass_from_option(option: str, text: str) -> float:
    """Parse a mass [kg] such as `75kg`; zero needs no unit. Raises UsageError."""
    return _quantity_from_option(option, text, Dimension.MASS, "75kg")


def angle_from_option(option: str, text: str) -> float:
    """Parse an angle [rad] such as `1deg`; zero needs no unit. Raises UsageError."""
    return _quantity_from_option(option, text, Dimension.ANGLE, "1deg")


def length_unit_from_option(option: str, text: str) -> Fraction:
    """Parse a unit of length [m] such as `mm`. Raises UsageError."""
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
            f"{option} {text}: `{unit}` is not a unit of {dimension.value}; "
            f"give one of {UNIT_EXAMPLES[dimension]}"
        )
    return named.factor
